//! A caster's work as files: read, checked, and brought to what the caster takes.
//!
//! Little-endian numbers without a header, in metres from any one origin: surfels of seven f32 (centre xyz, unit
//! normal xyz, radius), rays of seven f32 (origin xyz, unit direction xyz, measured range), support of two i32 a
//! surfel (third lowest and third highest segment), segments of one i32 a ray.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use dmp_cast::Query;
use dmp_map::WorldSurfel;

/// Where the work is.
#[derive(Debug, Clone)]
pub(super) struct Files {
    /// What it is called in tables.
    pub(super) name: String,
    pub(super) surfels: PathBuf,
    pub(super) rays: PathBuf,
    /// Support and segments: without them no surfel is independent of a ray.
    pub(super) segments: Option<[PathBuf; 2]>,
}

impl Files {
    /// The files of a scene in a folder.
    pub(super) fn of_scene(folder: &Path, name: &str) -> Self {
        let [surfels, rays, support, segments] =
            ["surfels", "rays", "support", "segments"].map(|kind| folder.join(format!("{name}.{kind}")));
        Self { name: name.to_owned(), surfels, rays, segments: Some([support, segments]) }
    }

    pub(super) fn are_there(&self) -> bool {
        let all = [&self.surfels, &self.rays].into_iter().chain(self.segments.iter().flatten());
        all.into_iter().all(|path| path.is_file())
    }
}

/// Centre, normal, radius; or origin, direction, measured range.
pub(super) type Record = [f32; 7];

/// Bytes of a record.
pub(super) const RECORD_BYTES: u64 = size_of::<Record>() as u64;

/// Coordinates beyond this are refused, metres, as in a map.
const LIMIT_M: f32 = 5e7;
/// Vectors whose length is further than this from one are refused.
const MOST_OFF: f64 = 1e-3;
/// Those further off than this are brought to one: more than rounding to f32 does.
const ROUNDING: f64 = 1e-6;

/// The numbers of the files, every vector of length one.
#[derive(Debug)]
pub(super) struct Work {
    pub(super) surfels: Vec<Record>,
    pub(super) rays: Vec<Record>,
    /// How many normals and directions had another length.
    pub(super) scaled: usize,
    support: Option<Vec<[i32; 2]>>,
    segments: Option<Vec<i32>>,
}

impl Work {
    /// Reads the files.
    ///
    /// # Errors
    /// Names the file, the record and the value that is no surfel or no ray.
    pub(super) fn read(files: &Files) -> anyhow::Result<Self> {
        let (mut surfels, mut rays) = (records(&files.surfels)?, read_rays(&files.rays)?);
        let mut scaled = 0;
        let radius_m = surfels.first().map_or(0.0, |surfel| surfel[6]);
        for (row, surfel) in surfels.iter_mut().enumerate() {
            let checked = check(surfel, "normal").and_then(|is_scaled| {
                let own_m = surfel[6];
                ensure!(own_m > 0.0, "radius {own_m} m");
                ensure!(
                    own_m == radius_m,
                    "radius {own_m} m, that of surfel 0 is {radius_m} m: the discs of a map have one radius"
                );
                Ok(is_scaled)
            });
            scaled += usize::from(checked.with_context(|| at(&files.surfels, "surfel", row))?);
        }
        for (row, ray) in rays.iter_mut().enumerate() {
            let checked = check(ray, "direction").and_then(|is_scaled| {
                ensure!(ray[6] >= 0.0, "measured range {} m", ray[6]);
                Ok(is_scaled)
            });
            scaled += usize::from(checked.with_context(|| at(&files.rays, "ray", row))?);
        }
        let (mut support, mut segments) = (None, None);
        if let Some([of_surfels, of_rays]) = &files.segments {
            support = Some(numbers(of_surfels, |bytes: [u8; 8]| {
                let [a, b, c, d, e, f, g, h] = bytes;
                [i32::from_le_bytes([a, b, c, d]), i32::from_le_bytes([e, f, g, h])]
            })?);
            segments = Some(numbers(of_rays, i32::from_le_bytes)?);
            let counts = [support.as_ref().map_or(0, Vec::len), segments.as_ref().map_or(0, Vec::len)];
            for (path, count, what, wanted) in
                [(of_surfels, counts[0], "surfels", surfels.len()), (of_rays, counts[1], "rays", rays.len())]
            {
                ensure!(count == wanted, "{}: {count} records of {wanted} {what}", path.display());
            }
        }
        Ok(Self { surfels, rays, scaled, support, segments })
    }

    /// Other rays, without segments.
    pub(super) fn change_rays(&mut self, path: &Path) -> anyhow::Result<()> {
        self.rays = read_rays(path)?;
        self.segments = None;
        Ok(())
    }

    /// The radius of every disc, metres.
    pub(super) fn radius_m(&self) -> f64 {
        self.surfels.first().map_or(0.0, |surfel| f64::from(surfel[6]))
    }

    /// The surfels, moved by `shift_m`.
    pub(super) fn world_surfels(&self, shift_m: [f64; 3]) -> impl Iterator<Item = WorldSurfel> {
        self.surfels.iter().enumerate().map(move |(row, surfel)| {
            let seen = self.support.as_ref().and_then(|support| support.get(row));
            // Never independent where nothing is known.
            let [third_lowest, third_highest] = seen.copied().unwrap_or([i32::MAX, i32::MIN]);
            WorldSurfel {
                centre_in_world_m: moved(surfel, shift_m),
                normal: [surfel[3], surfel[4], surfel[5]],
                third_lowest,
                third_highest,
            }
        })
    }

    /// The rays, moved by `shift_m`.
    pub(super) fn queries(&self, shift_m: [f64; 3]) -> Vec<Query> {
        let segment = |row: usize| self.segments.as_ref().and_then(|segments| segments.get(row)).copied();
        let query = |(row, ray): (usize, &Record)| Query {
            origin_in_world_m: moved(ray, shift_m),
            direction_in_world: [ray[3], ray[4], ray[5]].map(f64::from),
            measured_m: f64::from(ray[6]),
            segment: segment(row),
        };
        self.rays.iter().enumerate().map(query).collect()
    }

    /// Lowest and highest corner of the surfels' centres, metres.
    pub(super) fn bounds_m(&self) -> [[f64; 3]; 2] {
        corners(self.surfels.iter())
    }

    /// Further than any ray must go to have met everything, metres.
    pub(super) fn horizon_m(&self) -> f64 {
        let [low, high] = corners(self.surfels.iter().chain(&self.rays));
        let diagonal_m = (0..3).map(|k| (high[k] - low[k]) * (high[k] - low[k])).sum::<f64>().sqrt();
        diagonal_m + 2.0 * self.radius_m() + 1.0
    }

    /// Writes surfels and rays for casters that take vectors as they are.
    pub(super) fn write(&self, files: &Files) -> anyhow::Result<()> {
        write_records(&files.surfels, self.surfels.iter())?;
        write_records(&files.rays, self.rays.iter())
    }
}

fn corners<'a>(records: impl Iterator<Item = &'a Record>) -> [[f64; 3]; 2] {
    let mut corners = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for record in records {
        for k in 0..3 {
            corners[0][k] = corners[0][k].min(f64::from(record[k]));
            corners[1][k] = corners[1][k].max(f64::from(record[k]));
        }
    }
    corners
}

fn moved(record: &Record, shift_m: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| f64::from(record[k]) + shift_m[k])
}

fn at(path: &Path, what: &str, row: usize) -> String {
    format!("{}: {what} {row}, at byte {}", path.display(), row as u64 * RECORD_BYTES)
}

/// Whether the vector had to be brought to length one, to which it is near in any case.
fn check(record: &mut Record, vector: &str) -> anyhow::Result<bool> {
    ensure!(record.iter().all(|x| x.is_finite()), "{record:?} is not finite");
    let place = &record[..3];
    ensure!(place.iter().all(|x| x.abs() <= LIMIT_M), "{place:?} m is outside the world of ±{LIMIT_M:e} m");
    let length = record[3..6].iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt();
    ensure!((length - 1.0).abs() <= MOST_OFF, "{vector} {:?} of length {length}, not 1", &record[3..6]);
    let is_scaled = (length - 1.0).abs() > ROUNDING;
    if is_scaled {
        record[3..6].iter_mut().for_each(|x| *x = (f64::from(*x) / length) as f32);
    }
    Ok(is_scaled)
}

fn read_rays(path: &Path) -> anyhow::Result<Vec<Record>> {
    records(path)
}

fn records(path: &Path) -> anyhow::Result<Vec<Record>> {
    let records: Vec<Record> = numbers(path, |bytes: [u8; RECORD_BYTES as usize]| {
        std::array::from_fn(|k| {
            f32::from_le_bytes([bytes[4 * k], bytes[4 * k + 1], bytes[4 * k + 2], bytes[4 * k + 3]])
        })
    })?;
    ensure!(!records.is_empty(), "{}: empty", path.display());
    Ok(records)
}

/// The little-endian records of a file.
pub(super) fn numbers<const N: usize, T>(path: &Path, record: fn([u8; N]) -> T) -> anyhow::Result<Vec<T>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let (records, rest) = bytes.as_chunks::<N>();
    ensure!(rest.is_empty(), "{}: {} bytes are no whole records of {N}", path.display(), bytes.len());
    Ok(records.iter().copied().map(record).collect())
}

/// Writes records of f32.
pub(super) fn write_records<'a>(
    path: &Path,
    records: impl Iterator<Item = &'a Record>,
) -> anyhow::Result<()> {
    write_numbers(path, records.flatten().map(|x| x.to_le_bytes()))
}

/// Writes the bytes of numbers one after the other.
pub(super) fn write_numbers<const N: usize>(
    path: &Path,
    numbers: impl Iterator<Item = [u8; N]>,
) -> anyhow::Result<()> {
    let at = || path.display().to_string();
    let mut file = BufWriter::new(File::create(path).with_context(at)?);
    for bytes in numbers {
        file.write_all(&bytes).with_context(at)?;
    }
    file.flush().with_context(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(surfels: &[Record], rays: &[Record]) -> Result<Work, String> {
        let folder = tempfile::tempdir().unwrap();
        let [s, r] = ["s", "r"].map(|name| folder.path().join(name));
        write_records(&s, surfels.iter()).unwrap();
        write_records(&r, rays.iter()).unwrap();
        let files = Files { name: String::new(), surfels: s, rays: r, segments: None };
        let folder = format!("{}/", folder.path().display());
        Work::read(&files).map_err(|error| format!("{error:#}").replace(&folder, ""))
    }

    const SURFEL: Record = [1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.16];
    const RAY: Record = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 5.0];

    #[test]
    fn vectors_near_length_one_are_brought_to_it() {
        let work = read(&[SURFEL], &[RAY, [0.0, 0.0, 0.0, 0.0, 1.0009, 0.0, 5.0]]).unwrap();
        assert_eq!((work.scaled, work.rays[1][4]), (1, 1.0));
        let [query, _] = work.queries([1.0, 0.0, 0.0])[..] else { panic!("two rays") };
        assert_eq!((query.origin_in_world_m, query.segment), ([1.0, 0.0, 0.0], None));
    }

    #[test]
    fn what_is_no_surfel_or_no_ray_is_named() {
        let with = |record: Record, k: usize, value: f32| {
            let mut record = record;
            record[k] = value;
            record
        };
        for (surfel, ray, message) in [
            (
                with(SURFEL, 0, f32::NAN),
                RAY,
                "s: surfel 1, at byte 28: [NaN, 2.0, 3.0, 0.0, 0.0, 1.0, 0.16] is not finite",
            ),
            (
                with(SURFEL, 0, 1e8),
                RAY,
                "s: surfel 1, at byte 28: [100000000.0, 2.0, 3.0] m is outside the world of ±5e7 m",
            ),
            (
                with(SURFEL, 5, 0.5),
                RAY,
                "s: surfel 1, at byte 28: normal [0.0, 0.0, 0.5] of length 0.5, not 1",
            ),
            (
                with(SURFEL, 6, 0.2),
                RAY,
                "s: surfel 1, at byte 28: radius 0.2 m, that of surfel 0 is 0.16 m: the discs of a map have one radius",
            ),
            (with(SURFEL, 6, -0.2), RAY, "s: surfel 1, at byte 28: radius -0.2 m"),
            (SURFEL, with(RAY, 3, 0.0), "r: ray 1, at byte 28: direction [0.0, 0.0, 0.0] of length 0, not 1"),
            (SURFEL, with(RAY, 6, -1.0), "r: ray 1, at byte 28: measured range -1 m"),
            (
                SURFEL,
                with(RAY, 6, f32::INFINITY),
                "r: ray 1, at byte 28: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, inf] is not finite",
            ),
        ] {
            assert_eq!(read(&[SURFEL, surfel], &[RAY, ray]).unwrap_err(), message);
        }
        assert_eq!(read(&[], &[RAY]).unwrap_err(), "s: empty");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cut");
        std::fs::write(&path, [0; 30]).unwrap();
        let error = records(&path).unwrap_err().to_string();
        assert!(error.ends_with("cut: 30 bytes are no whole records of 28"), "{error}");
    }
}
