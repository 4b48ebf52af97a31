//! Reading a cloud of any format.

use super::format::CloudFormat;
use super::{e57_cloud, las_cloud, pcd_cloud, ply_cloud};
use crate::file::start_of;
use crate::geometry::pcd::header::starts_like_pcd;
use crate::{LengthUnit, LogError};
use std::path::Path;

/// What was read of a cloud.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CloudSummary {
    /// The file's format.
    pub format: CloudFormat,
    /// Points handed over, those that are not finite included.
    pub points: u64,
    /// What the file says of its unit where that is not plainly the metre; `None` where the unit was given.
    pub unit_note: Option<String>,
}

/// Reads the points of a LAS, LAZ, PLY, PCD or E57 file and hands them to `sink` in batches of at most 65,536, in
/// the file's order and frame, in metres. Memory does not grow with the file.
///
/// The file's coordinates are in `unit`; with `None`, in what a LAS or LAZ file says, else in metres.
///
/// Only E57 has checksums. In the others damaged coordinates in a file that is otherwise sound look like
/// true ones.
///
/// Called in a rayon pool, the chunks of a LAZ file are decoded ahead on its threads, a few at a time. The points, their order and
/// the errors are the same.
///
/// The sink's own error comes back as it is; `E` only has to be able to hold a [`LogError`].
///
/// # Errors
/// When the file cannot be read, is in no format known here, has fewer points than it claims, or says that
/// its coordinates are longitude and latitude; and the first error of `sink`.
///
/// ```
/// use dmp_log::{LogError, read_cloud};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("map.ply");
/// let head = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
/// std::fs::write(&path, format!("{head}end_header\n1 2 3\n4 5 6\n"))?;
/// let mut points_m = Vec::new();
/// let summary = read_cloud(&path, None, |batch| {
///     points_m.extend_from_slice(batch);
///     Ok::<(), LogError>(())
/// })?;
/// assert_eq!((summary.points, points_m[1]), (2, [4.0, 5.0, 6.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_cloud<E: From<LogError>>(
    path: &Path,
    unit: Option<LengthUnit>,
    mut sink: impl FnMut(&[[f64; 3]]) -> Result<(), E>,
) -> Result<CloudSummary, E> {
    let mut start = start_of(path)?;
    let scale = [unit.unwrap_or(LengthUnit::Metre).metres(); 3];
    let is_pcd = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pcd"));
    let (format, points, unit_note) = match start.as_slice() {
        [b'L', b'A', b'S', b'F', ..] => las_cloud::read(path, unit, &mut sink)?,
        [b'A', b'S', b'T', b'M', b'-', b'E', b'5', b'7', ..] => {
            let (format, points) = e57_cloud::read(path, scale, &mut sink)?;
            (format, points, None)
        }
        [b'p', b'l', b'y', b'\n' | b'\r', ..] => {
            let (format, points) = ply_cloud::read(path, scale, &mut sink)?;
            (format, points, None)
        }
        start if is_pcd || starts_like_pcd(start) => {
            let (format, points) = pcd_cloud::read(path, scale, &mut sink)?;
            (format, points, None)
        }
        _ => {
            start.truncate(4);
            let looked_for =
                format!("looked for a LAS, LAZ, PLY, PCD or E57 cloud; the file starts with {start:02x?}");
            return Err(LogError::UnknownFormat { path: path.into(), looked_for }.into());
        }
    };
    Ok(CloudSummary { format, points, unit_note })
}
