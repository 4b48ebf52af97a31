//! Every return's part in a comparison, gathered while it is scored and kept with the result: `--keep`.

use std::io;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::{Basis, EvaluateError, KeptReturn, MapSource, Report, Run, Scales, ScoredReturns};
use dmp_log::KeptWriter;
use dmp_sensor::seven;

use super::residuals::{Buffers, mixed};
use super::spool::Spool;
use crate::console::Usage;

/// In front of the returns, run by run: the scan's place among those that could be scored, its number, its stamp, how many returns
/// follow, and what they add to the scan's mark; then the poses.
const HEAD_BYTES: usize = 5 * 8;

/// A result that is to be kept.
#[derive(Debug)]
pub(super) struct Keep {
    path: PathBuf,
    runs: usize,
    basis: Basis,
    scales: Scales,
    spool: Spool,
}

impl Keep {
    /// Of these runs, gathered in `spool`.
    ///
    /// # Errors
    /// When some have given maps and others not: they are judged by different scores.
    pub(super) fn new(path: PathBuf, runs: &[Run], scales: Scales, spool: Spool) -> Result<Self, Usage> {
        let fused = runs.iter().filter(|run| run.map == MapSource::Fused).count();
        if fused != 0 && fused != runs.len() {
            let path = path.display();
            return Err(Usage(format!(
                "{path}: of runs with a given map R_near is kept, of the others R_cv: score them in two commands"
            )));
        }
        let basis = if fused > 0 { Basis::CrossValidated } else { Basis::Near };
        Ok(Self { path, runs: runs.len(), basis, scales, spool })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes that wait in the folder, of so many returns that are scored.
    pub(super) fn work_bytes(&self, returns: u64) -> u64 {
        returns * (self.runs * KeptReturn::BYTES) as u64
    }

    /// Keeps a part of a scan.
    pub(super) fn keep(
        &self,
        scored: &ScoredReturns<'_>,
        stamp_ns: i64,
        buffers: &Buffers,
    ) -> io::Result<()> {
        buffers.with(|piece| {
            let [ordinal, scan, returns] =
                [scored.ordinal, scored.frame, scored.offsets_ns.len()].map(|number| number as u64);
            let head = [ordinal, scan, stamp_ns.cast_unsigned(), returns, mark_of(scored)];
            piece.extend_from_slice(head.map(u64::to_le_bytes).as_flattened());
            for run in scored.runs {
                let pose = run.as_ref().map_or([f64::NAN; 7], |run| seven(&run.own_from_sensor));
                piece.extend_from_slice(pose.map(f64::to_le_bytes).as_flattened());
            }
            for run in scored.runs {
                let kept = |index: usize| {
                    let run = run.as_ref().filter(|run| run.is_posed[index]);
                    let kept = run.map(|run| KeptReturn::of(&run.residuals[index], self.basis, self.scales));
                    kept.unwrap_or_default().to_bytes()
                };
                piece.extend((0..scored.offsets_ns.len()).flat_map(kept));
            }
            self.spool.add(scored.frame as u32, piece)
        })
    }

    /// Writes the file, whole or not at all; tells how many bytes it has. `go_on` fails where it is to stop; `step` is called
    /// after each scan.
    pub(super) fn write(
        self,
        report: &Report,
        (go_on, step): (&dyn Fn() -> Result<(), EvaluateError>, &dyn Fn()),
    ) -> anyhow::Result<u64> {
        let names: Vec<&str> = report.runs.iter().map(|run| run.name.as_str()).collect();
        let mut writer = KeptWriter::create(&self.path, &serde_json::to_vec(report)?, &names)?;
        let mut scan: Vec<Vec<[u8; KeptReturn::BYTES]>> = vec![Vec::new(); names.len()];
        let (mut mark, runs) = (0_u64, names.len());
        self.spool.sorted().each(|piece, is_last| {
            go_on()?;
            let ([ordinal, number, stamp_ns, of_piece], poses, returns) =
                taken_apart(piece, runs).context("what was kept is not what is read back")?;
            mark = mark.wrapping_add(of_piece);
            for (of_run, bytes) in scan.iter_mut().zip(returns) {
                of_run.extend(bytes);
            }
            if is_last {
                writer.scan([ordinal, number, mark], stamp_ns.cast_signed(), (&poses, &scan))?;
                mark = 0;
                scan.iter_mut().for_each(Vec::clear);
                step();
            }
            Ok(())
        })?;
        writer.finish()?;
        Ok(std::fs::metadata(&self.path).map_or(0, |file| file.len()))
    }
}

/// The scan's place, number and stamp, what the piece adds to its mark; the poses; and the returns of each run.
type Piece<'a, I> = ([u64; 4], Vec<[f64; 7]>, I);

fn taken_apart(
    piece: &[u8],
    runs: usize,
) -> Option<Piece<'_, impl Iterator<Item = &[[u8; KeptReturn::BYTES]]>>> {
    let (head, rows) = piece.split_first_chunk::<HEAD_BYTES>()?;
    let mut numbers = [0; 5];
    for (number, bytes) in numbers.iter_mut().zip(head.as_chunks().0) {
        *number = u64::from_le_bytes(*bytes);
    }
    let [ordinal, scan, stamp_ns, returns, mark] = numbers;
    let (poses, rows) = rows.split_at_checked(runs * 7 * 8)?;
    let coordinates: Vec<f64> = poses.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let of_runs = rows.as_chunks().0.chunks(usize::try_from(returns).ok()?.max(1));
    Some(([ordinal, scan, stamp_ns, mark], coordinates.as_chunks().0.to_vec(), of_runs))
}

/// What tells these returns of a scan from as many others: of their ranges and numbers, which are the same in every run. Parts of a
/// scan add up.
fn mark_of(scored: &ScoredReturns<'_>) -> u64 {
    let rays = scored.runs.iter().flatten().next().map_or(&[][..], |run| run.rays);
    let ranges_m = rays.iter().map(|ray| ray.range_m);
    let numbered = (scored.first as u64..).zip(ranges_m);
    numbered.fold(0, |sum: u64, (number, range_m)| sum.wrapping_add(mixed(range_m.to_bits() ^ mixed(number))))
}
