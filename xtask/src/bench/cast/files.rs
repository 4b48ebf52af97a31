//! A caster's work as files: read, checked, and brought to what the caster takes.
//!
//! Little-endian numbers without a header, in metres from any one origin: surfels of seven f32 (centre xyz, unit
//! normal xyz, radius), rays of seven f32 (origin xyz, unit direction xyz, measured range), support of two i32 a
//! surfel (third lowest and third highest segment), segments of one i32 a ray.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use dmp_cast::Query;
use dmp_map::WorldSurfel;

use super::records::{RECORD_BYTES, Record, numbers, records, write_records};

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
    /// What was subtracted from every place, metres.
    pub(super) origin_m: [f32; 3],
    support: Option<Vec<[i32; 2]>>,
    segments: Option<Vec<i32>>,
}

impl Work {
    /// Reads the files.
    ///
    /// # Errors
    /// Names the file, the record and the value that is no surfel or no ray.
    pub(super) fn read(files: &Files) -> anyhow::Result<Self> {
        let (mut surfels, mut rays) = (records(&files.surfels)?, records(&files.rays)?);
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
        let origin_m = near(&surfels, &rays);
        for record in surfels.iter_mut().chain(&mut rays) {
            (0..3).for_each(|k| record[k] -= origin_m[k]);
        }
        Ok(Self { surfels, rays, scaled, origin_m, support, segments })
    }

    /// Other rays, without segments.
    pub(super) fn change_rays(&mut self, path: &Path) -> anyhow::Result<()> {
        self.rays = records(path)?;
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

    /// Writes surfels and rays for casters that take numbers as they are.
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

/// A place near everything, where all can be brought without loss: casters that compute in f32 are lost where
/// the files' coordinates are large.
///
/// A difference of two f32 is exact where neither is more than twice the other.
fn near(surfels: &[Record], rays: &[Record]) -> [f32; 3] {
    let [low, high] = corners(surfels.iter().chain(rays));
    [0, 1, 2].map(|k| {
        let (near, far) = (low[k].abs().min(high[k].abs()), low[k].abs().max(high[k].abs()));
        let middle = (low[k].midpoint(high[k])).round() as f32;
        let is_exact = low[k] * high[k] > 0.0 && far <= 1.25 * near && middle != 0.0;
        if is_exact { middle } else { 0.0 }
    })
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
    fn places_far_from_zero_are_brought_near_without_loss() {
        let at = |record: Record, place: [f32; 3]| {
            let mut record = record;
            record[..3].copy_from_slice(&place);
            record
        };
        let surfels =
            [at(SURFEL, [500_000.03, -5_400_000.5, 3.0]), at(SURFEL, [500_100.97, -5_400_100.0, 4.0])];
        let work = read(&surfels, &[at(RAY, [500_050.5, -5_400_050.0, -1.0])]).unwrap();
        assert_eq!(work.origin_m, [500_051.0, -5_400_050.0, 0.0]);
        for (moved, surfel) in work.surfels.iter().zip(surfels) {
            for k in 0..3 {
                assert_eq!(f64::from(moved[k]) + f64::from(work.origin_m[k]), f64::from(surfel[k]));
            }
        }
        assert!(work.surfels[0][0].abs() < 51.0);
        assert_eq!(read(&[SURFEL], &[RAY]).unwrap().origin_m, [0.0; 3]);
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
    }
}
