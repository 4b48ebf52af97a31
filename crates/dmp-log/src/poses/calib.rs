//! KITTI's calibration: where the LiDAR sits on the camera.

use dmp_disk::open_input;
use dmp_sensor::Isometry3;

use crate::file::columns::numbers;
use crate::file::{is_file, lines, pose_of_rows, read_text};
use crate::{LogError, ParseError, PlaceInFile};
use std::path::{Path, PathBuf};

/// Largest calibration that is read; one of KITTI has 1 kB.
const MAX_BYTES: u64 = 1 << 20;

/// A calibration that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Calib {
    /// Its file.
    pub path: PathBuf,
    /// Where the LiDAR sits on the camera, metres: z forward, x right, y down in the camera.
    pub camera_from_velodyne: Isometry3<f64>,
}

/// Parses KITTI's calibration: `camera_from_velodyne`. It is `Tr` (odometry: the rectified camera 0, which
/// its poses move), or `R0_rect` · `Tr_velo_to_cam` (objects; `R_rect` · `Tr_velo_cam` in tracking), or the
/// lines `R` and `T` of the raw data's `calib_velo_to_cam.txt` (camera 0 before rectification, under a
/// degree from it). Other lines are passed over.
///
/// # Errors
/// Where there is no such line or it is there twice, and in a line that is cut or holds no rotation.
pub fn parse_calib(bytes: &[u8]) -> Result<Isometry3<f64>, ParseError> {
    parse(bytes)?.ok_or_else(|| {
        let problem =
            "no line `Tr:`, `Tr_velo_to_cam:` or `R:` and `T:`: no calibration of a LiDAR on a camera";
        ParseError::new(PlaceInFile::WholeFile, problem)
    })
}

/// Reads KITTI's calibration, as [`parse_calib`].
///
/// # Errors
/// As [`parse_calib`], and when the file cannot be read.
pub fn read_calib(path: &Path) -> Result<Isometry3<f64>, LogError> {
    // It is read for every run: a pipe would be empty the second time.
    open_input(path).map_err(|e| LogError::io(path, "open", e))?;
    parse_calib(&read(path)?).map_err(|e| e.in_file(path))
}

/// Looks for a `calib.txt` of KITTI in these folders, the first that has one. Files of that name that say
/// nothing of a LiDAR are passed over.
///
/// # Errors
/// When such a file says something of a LiDAR that is broken, or cannot be read.
pub fn find_calib<'a>(folders: impl IntoIterator<Item = &'a Path>) -> Result<Option<Calib>, LogError> {
    for folder in folders {
        let path = folder.join("calib.txt");
        if !is_file(&path)? {
            continue;
        }
        if let Some(camera_from_velodyne) = parse(&read(&path)?).map_err(|e| e.in_file(&path))? {
            return Ok(Some(Calib { path, camera_from_velodyne }));
        }
    }
    Ok(None)
}

fn read(path: &Path) -> Result<Vec<u8>, LogError> {
    read_text(path, "calibration", MAX_BYTES)
}

/// `None` where no line speaks of a LiDAR.
fn parse(bytes: &[u8]) -> Result<Option<Isometry3<f64>>, ParseError> {
    const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let (mut tr, mut velo_to_cam, mut rect, mut r, mut t) = (None, None, None, None, None);
    for line in lines(bytes) {
        // Of a file that is no calibration nothing is asked.
        let Ok((place, columns)) = line else { continue };
        let Some((&key, rest)) = columns.split_first() else { continue };
        let again = match key.trim_end_matches(':') {
            "Tr" => tr.replace((place, numbers::<12>(place, rest, "Tr: a 3 x 4 matrix")?)).is_some(),
            "Tr_velo_to_cam" | "Tr_velo_cam" => {
                velo_to_cam.replace((place, numbers::<12>(place, rest, "a 3 x 4 matrix")?)).is_some()
            }
            "R0_rect" | "R_rect" => {
                rect.replace((place, numbers::<9>(place, rest, "a 3 x 3 matrix")?)).is_some()
            }
            "R" => r.replace((place, numbers::<9>(place, rest, "R: a 3 x 3 matrix")?)).is_some(),
            "T" => t.replace((place, numbers::<3>(place, rest, "T: x y z")?)).is_some(),
            _ => false,
        };
        if again {
            return Err(ParseError::new(place, format!("`{key}` is there twice")));
        }
    }
    let of_parts = |place, [a, b, c, d, e, f, g, h, i]: [f64; 9], [x, y, z]: [f64; 3]| {
        pose_of_rows(place, [a, b, c, x, d, e, f, y, g, h, i, z])
    };
    match (tr, velo_to_cam, r, t) {
        (Some((place, rows)), ..) => pose_of_rows(place, rows).map(Some),
        (None, Some((place, rows)), ..) => {
            let (rect_place, rect) = rect.unwrap_or((place, IDENTITY));
            Ok(Some(of_parts(rect_place, rect, [0.0; 3])? * pose_of_rows(place, rows)?))
        }
        (None, None, Some((place, r)), Some((_, t))) => of_parts(place, r, t).map(Some),
        _ => Ok(None),
    }
}
