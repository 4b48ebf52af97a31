//! Result files as evo writes them: a ZIP with `info.json`, `stats.json` and arrays in numpy's format.

use std::io::{Seek, Write};

use dmp_truth::trajectory::Prepared;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::compared::Compared;

/// Writes the file of a run. The same contents give the same bytes.
pub(super) fn write(metric: &str, run: &Compared, file: impl Write + Seek) -> std::io::Result<()> {
    let Compared { names: [reference, estimate], title, errors, prepared, .. } = run;
    let mut zip = ZipWriter::new(file);
    let label = format!("{} ({})", metric.to_uppercase(), errors.unit.name());
    let info =
        serde_json::json!({"title": title, "ref_name": reference, "est_name": estimate, "label": label});
    let stats: serde_json::Map<_, _> =
        run.stats.named().into_iter().map(|(name, value)| (name.to_owned(), value.into())).collect();
    entry(&mut zip, "info.json", info.to_string().as_bytes())?;
    entry(&mut zip, "stats.json", serde_json::Value::Object(stats).to_string().as_bytes())?;
    array(&mut zip, "error_array", &[errors.values.len()], &errors.values)?;

    // The pose at the start has no relative error of its own, but distances are counted from it.
    let relative = metric == "rpe";
    let first = relative.then_some(0);
    let kept: Vec<usize> = first.into_iter().chain(errors.poses.iter().copied()).collect();
    let Prepared { reference, estimate, .. } = prepared;
    let [of_reference, of_estimate] = [reference, estimate].map(|path| path.select(&kept));
    if let Some(stamps_s) = of_estimate.stamps_s() {
        let from = usize::from(relative);
        let start_s = stamps_s.first().copied().unwrap_or_default();
        let seconds: Vec<f64> = stamps_s.iter().map(|stamp| stamp - start_s).collect();
        for (name, values) in [
            ("seconds_from_start", &seconds[..]),
            ("timestamps", stamps_s),
            ("distances_from_start", &of_reference.distances_m()),
            ("distances", &of_estimate.distances_m()),
        ] {
            array(&mut zip, name, &[values.len() - from], &values[from..])?;
        }
    }
    if let Some(moved_by) = prepared.moved_by {
        array(&mut zip, "alignment_transformation_sim3", &[4, 4], moved_by.rows().as_flattened())?;
    }
    zip.finish()?.flush()
}

fn entry(zip: &mut ZipWriter<impl Write + Seek>, name: &str, bytes: &[u8]) -> std::io::Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .large_file(bytes.len() > u32::MAX as usize / 2);
    zip.start_file(name, options)?;
    zip.write_all(bytes)
}

/// numpy's format, version 1.0: magic, length of the heading, heading padded to 64 bytes, numbers.
fn array(
    zip: &mut ZipWriter<impl Write + Seek>,
    name: &str,
    shape: &[usize],
    values: &[f64],
) -> std::io::Result<()> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    // A tuple of one has a comma behind it; one more behind others does no harm.
    let shape = shape.join(",");
    let heading = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape},), }}");
    let width = (10 + heading.len() + 1).next_multiple_of(64) - 10 - 1;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(((width + 1) as u16).to_le_bytes());
    bytes.extend(format!("{heading:<width$}\n").as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    entry(zip, &format!("{name}.npy"), &bytes)
}
