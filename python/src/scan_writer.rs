//! Writes scans from arrays, one by one, into a log.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use dmp_log::{LogError, McapCompression, McapScanWriter, McapWriterOptions};
use dmp_sensor::Scan;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::{failed, input, is_over};

/// Writes scans as PointCloud2 into an MCAP file, which appears when it is finished.
#[pyclass(module = "dmp_slam._core")]
#[derive(Debug)]
pub(crate) struct ScanWriter {
    /// Behind a lock, since the compressor must not be shared by threads.
    writer: Mutex<Option<Box<McapScanWriter>>>,
    /// Reused for its memory.
    scan: Scan,
}

#[pymethods]
impl ScanWriter {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        // The file is read soon, on the same machine, and then removed.
        let options = McapWriterOptions {
            compression: McapCompression::Lz4,
            // Keeps negative stamps, for poses that have the scans' stamps.
            signed_times: true,
            ..McapWriterOptions::default()
        };
        let writer = McapScanWriter::create(&path, &options).map_err(|error| failed_to_write(py, &error))?;
        Ok(Self { writer: Mutex::new(Some(Box::new(writer))), scan: Scan::default() })
    }

    /// Appends a scan: points in metres in the sensor's frame (N × 3), nanoseconds of each after the stamp or `None`,
    /// and the stamp in nanoseconds.
    #[pyo3(signature = (points, offsets_ns, stamp_ns))]
    fn write(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f32>,
        offsets_ns: Option<PyReadonlyArray1<'_, i64>>,
        stamp_ns: i64,
    ) -> PyResult<()> {
        let Self { writer, scan } = self;
        let writer = writer.get_mut().unwrap_or_else(PoisonError::into_inner);
        let writer = writer.as_mut().ok_or_else(|| is_over("log"))?;
        if points.shape()[1] != 3 {
            return Err(PyValueError::new_err("points must be N × 3"));
        }
        scan.clear();
        scan.stamp_ns = Some(stamp_ns);
        scan.points_in_sensor_m
            .extend(points.as_array().rows().into_iter().map(|row| [row[0], row[1], row[2]]));
        if let Some(offsets_ns) = &offsets_ns {
            scan.time_offsets_ns.extend(offsets_ns.as_array());
        }
        py.detach(|| writer.write_scan(scan)).map_err(|error| failed_to_write(py, &error))
    }

    /// Completes the log.
    fn finish(&mut self, py: Python<'_>) -> PyResult<()> {
        let writer = self.writer.get_mut().unwrap_or_else(PoisonError::into_inner);
        let writer = writer.take().ok_or_else(|| is_over("log"))?;
        py.detach(|| writer.finish()).map_err(|error| failed_to_write(py, &error))
    }

    /// Removes the incomplete log.
    fn abandon(&mut self, py: Python<'_>) {
        let writer = self.writer.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        py.detach(|| drop(writer));
    }
}

/// A full disk is not an error of the scans.
fn failed_to_write(py: Python<'_>, error: &LogError) -> PyErr {
    if error.is_of_writing() { failed(py, error) } else { input(py, error) }
}
