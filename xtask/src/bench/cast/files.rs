//! A caster's work as files.
//!
//! Little-endian numbers without a header, in metres: surfels of seven f32 (centre xyz, unit normal xyz, radius), rays of
//! seven f32 (origin xyz, unit direction xyz, measured range), support of two i32 a surfel (third lowest and third highest
//! segment), segments of one i32 a ray.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use dmp_cast::Query;
use dmp_map::WorldSurfel;
use dmp_sensor::Ray;

/// Centre, normal, radius; or origin, direction, measured range.
pub(super) type Record = [f32; 7];

/// Where the work is.
#[derive(Debug, Clone)]
pub(super) struct Files {
    pub(super) name: String,
    pub(super) surfels: PathBuf,
    pub(super) rays: PathBuf,
    pub(super) support: PathBuf,
    pub(super) segments: PathBuf,
}

impl Files {
    /// The files of a scene in a folder.
    pub(super) fn of_scene(folder: &Path, name: &str) -> Self {
        let [surfels, rays, support, segments] =
            ["surfels", "rays", "support", "segments"].map(|kind| folder.join(format!("{name}.{kind}")));
        Self { name: name.to_owned(), surfels, rays, support, segments }
    }

    pub(super) fn exist(&self) -> bool {
        [&self.surfels, &self.rays, &self.support, &self.segments].into_iter().all(|path| path.is_file())
    }
}

/// The numbers of the files.
#[derive(Debug, Default)]
pub(super) struct Work {
    pub(super) surfels: Vec<Record>,
    pub(super) rays: Vec<Record>,
    pub(super) support: Vec<[i32; 2]>,
    pub(super) segments: Vec<i32>,
}

impl Work {
    pub(super) fn read(files: &Files) -> anyhow::Result<Self> {
        let work = Self {
            surfels: numbers(&files.surfels, f32s)?,
            rays: numbers(&files.rays, f32s)?,
            support: numbers(&files.support, |bytes: [u8; 8]| {
                let [a, b, c, d, e, f, g, h] = bytes;
                [i32::from_le_bytes([a, b, c, d]), i32::from_le_bytes([e, f, g, h])]
            })?,
            segments: numbers(&files.segments, i32::from_le_bytes)?,
        };
        let Self { surfels, rays, support, segments } = &work;
        ensure!(!surfels.is_empty() && !rays.is_empty(), "{}: no surfels or no rays", files.name);
        ensure!(support.len() == surfels.len(), "{}: {} records", files.support.display(), support.len());
        ensure!(segments.len() == rays.len(), "{}: {} records", files.segments.display(), segments.len());
        Ok(work)
    }

    pub(super) fn write(&self, files: &Files) -> anyhow::Result<()> {
        write_numbers(&files.surfels, self.surfels.iter().flatten().map(|x| x.to_le_bytes()))?;
        write_numbers(&files.rays, self.rays.iter().flatten().map(|x| x.to_le_bytes()))?;
        write_numbers(&files.support, self.support.iter().flatten().map(|x| x.to_le_bytes()))?;
        write_numbers(&files.segments, self.segments.iter().map(|x| x.to_le_bytes()))
    }

    /// The radius of all discs, metres: those of a map have one.
    pub(super) fn radius_m(&self) -> f64 {
        self.surfels.first().map_or(0.0, |surfel| f64::from(surfel[6]))
    }

    pub(super) fn world_surfels(&self) -> impl Iterator<Item = WorldSurfel> {
        self.surfels.iter().zip(&self.support).map(|(surfel, &[third_lowest, third_highest])| {
            let [x, y, z, nx, ny, nz, _] = *surfel;
            let centre_in_world_m = [x, y, z].map(f64::from);
            WorldSurfel { centre_in_world_m, normal: [nx, ny, nz], third_lowest, third_highest }
        })
    }

    pub(super) fn queries(&self) -> Vec<Query> {
        let query = |(ray, &segment): (&Record, &i32)| {
            let [x, y, z, dx, dy, dz, measured_m] = ray.map(f64::from);
            Query {
                ray: Ray {
                    origin_in_world: [x, y, z],
                    direction_in_world: [dx, dy, dz],
                    range_m: measured_m,
                },
                segment: Some(segment),
            }
        };
        self.rays.iter().zip(&self.segments).map(query).collect()
    }

    /// Further than any ray must go to have met everything, metres.
    pub(super) fn horizon_m(&self) -> f64 {
        let all = || self.surfels.iter().chain(&self.rays);
        let side = |k: usize| {
            let low = all().map(|record| record[k]).fold(f32::INFINITY, f32::min);
            let high = all().map(|record| record[k]).fold(f32::NEG_INFINITY, f32::max);
            f64::from(high) - f64::from(low)
        };
        [0, 1, 2].map(|k| side(k) * side(k)).iter().sum::<f64>().sqrt() + 2.0 * self.radius_m() + 1.0
    }
}

fn f32s(bytes: [u8; 28]) -> Record {
    let (numbers, _) = bytes.as_chunks::<4>();
    std::array::from_fn(|k| f32::from_le_bytes(numbers[k]))
}

/// The little-endian records of a file.
pub(super) fn numbers<const N: usize, T>(path: &Path, record: fn([u8; N]) -> T) -> anyhow::Result<Vec<T>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let (records, rest) = bytes.as_chunks::<N>();
    ensure!(rest.is_empty(), "{}: {} bytes are no whole records of {N}", path.display(), bytes.len());
    Ok(records.iter().copied().map(record).collect())
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

    #[test]
    fn what_is_written_is_read_and_incomplete_files_are_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let files = Files::of_scene(folder.path(), "some");
        let some = [1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.16];
        let work = |rays| Work { surfels: vec![some], rays, support: vec![[1, 2]], segments: vec![3] };
        work(vec![some]).write(&files).unwrap();
        assert!(files.exist());
        assert_eq!(format!("{:?}", Work::read(&files).unwrap()), format!("{:?}", work(vec![some])));
        for (rays, message) in
            [(vec![], "no surfels or no rays"), (vec![some; 2], "some.segments: 1 records")]
        {
            work(rays).write(&files).unwrap();
            let error = Work::read(&files).unwrap_err().to_string();
            assert!(error.ends_with(message), "{error}");
        }
        std::fs::write(&files.surfels, [0; 30]).unwrap();
        let error = Work::read(&files).unwrap_err().to_string();
        assert!(error.ends_with("some.surfels: 30 bytes are no whole records of 28"), "{error}");
    }
}
