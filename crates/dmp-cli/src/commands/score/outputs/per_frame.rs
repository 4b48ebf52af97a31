//! A table with the scores of every run in every scan.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use dmp::{FrameSums, Scales};

use super::rows::{RunRows, columns, scores};
use super::spool::Sorted;
use crate::files::save;

/// The lines of one scan, a line for each run.
pub(super) fn lines(frame: u32, stamp_ns: Option<i64>, sums: &FrameSums, runs: &[RunRows]) -> String {
    let stamp = stamp_ns.map(|stamp_ns| stamp_ns.to_string()).unwrap_or_default();
    let mut lines = String::new();
    for (run, sums) in runs.iter().zip(sums.runs()) {
        // Writing to a string cannot fail.
        let _ = write!(lines, "{frame},{stamp},{},", run.name);
        scores(&mut lines, &sums, run);
    }
    lines
}

/// Writes the lines of all scans in order of the log.
pub(super) fn write(path: &Path, scales: Scales, lines: &Sorted) -> anyhow::Result<()> {
    save(path, |out| {
        writeln!(out, "frame,stamp_ns,run,{}", columns(scales))?;
        lines.each(|lines, _| Ok(out.write_all(lines)?)).map_err(std::io::Error::other)
    })
}
