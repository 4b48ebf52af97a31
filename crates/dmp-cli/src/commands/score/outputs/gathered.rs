//! What was gathered while returns were scored, for the page and for the scene.

use std::collections::HashMap;

use dmp::{Basis, Scales};
use dmp_draw::{SampledReturn, SeenFrame};
use dmp_sensor::Isometry3;

use super::spool::Sorted;
use crate::console::Hosted;

/// All that was gathered.
#[derive(Debug)]
pub(super) struct Gathered {
    pub(super) scales: Scales,
    /// Scans with a used return, in the order of their time.
    pub(super) frames: Vec<SeenFrame>,
    /// For every scan and run, the pose of the sensor in the world of the run.
    pub(super) poses: Vec<Vec<Isometry3<f64>>>,
    pub(super) bases: Vec<Basis>,
    /// Indices of the runs, best first.
    pub(super) order: Vec<usize>,
    pub(super) start_ns: Option<i64>,
    pub(super) kept: Sorted,
}

impl Gathered {
    /// How many returns are drawn of each run.
    pub(super) fn returns(&self) -> u64 {
        let of_return = (self.bases.len() * SampledReturn::BYTES).max(1);
        self.kept.pieces().map(|bytes| (bytes / of_return) as u64).sum()
    }

    /// The index of each scan by its number in the log.
    pub(super) fn index_of(&self) -> HashMap<usize, usize> {
        self.frames.iter().enumerate().map(|(index, frame)| (frame.number, index)).collect()
    }

    /// Hands over the returns that are drawn, piece by piece in the order of the log: the number of the scan, what every run makes of
    /// each return, one behind the other, and whether the piece is the scan's last.
    pub(super) fn each(
        &self,
        host: &Hosted,
        mut take: impl FnMut(usize, &[[u8; SampledReturn::BYTES]], bool) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        self.kept.each(|piece, is_last| {
            host.go_on()?;
            let (frame, returns) = piece.split_at(size_of::<u32>().min(piece.len()));
            let number = frame.try_into().map_or(0, u32::from_le_bytes);
            take(number as usize, returns.as_chunks().0, is_last)
        })
    }
}
