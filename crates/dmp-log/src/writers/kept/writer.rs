//! Writing a result that is kept.

use super::part::{self, MOST_RETURNS, RETURN_BYTES};
use crate::LogError;
use crate::messages::{McapCompression, McapFile};
use std::path::Path;

/// The topic of the result, and behind the run's name that of its returns.
pub(super) const RESULT: &str = "/result";
pub(super) const RETURNS: &str = "/returns";
/// How their messages are written.
pub(super) const JSON: &str = "json";
pub(super) const PLANES: &str = "dmp-returns/3";
/// Size from which a chunk is closed, not packed.
const CHUNK_BYTES: u64 = 1 << 20;

/// Writes a result with all its returns. The same calls give the same bytes. The file gets its name in
/// [`KeptWriter::finish`]; without it nothing is left behind.
///
/// It is MCAP: a message of JSON on `/result`, then of every scan, in order, those of each run on `/RUN/returns`.
#[derive(Debug)]
pub struct KeptWriter {
    file: McapFile,
    runs: Vec<u16>,
    scans: u64,
    message: Vec<u8>,
}

impl KeptWriter {
    /// Starts a file that will be at `path`, in place of what may be there, of a result in JSON and of the runs of these
    /// names.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(path: &Path, result: &[u8], runs: &[&str]) -> Result<Self, LogError> {
        let mut file = McapFile::with_profile("", path, McapCompression::Zstd, CHUNK_BYTES)?;
        let topic = file.plain_topic(RESULT, JSON)?;
        file.write(topic, 0, 0, result)?;
        let topics = runs.iter().map(|run| file.plain_topic(&format!("/{run}{RETURNS}"), PLANES));
        let runs = topics.collect::<Result<_, _>>()?;
        Ok(Self { file, runs, scans: 0, message: Vec::new() })
    }

    /// Writes the next scan: its place among those that could be scored, its number in the log and a mark of its returns; its
    /// stamp; and of each run its [pose](super::KeptPart::pose), and as many returns.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn scan(
        &mut self,
        [ordinal, scan, mark]: [u64; 3],
        stamp_ns: i64,
        (poses, runs): (&[[f64; 7]], &[Vec<[u8; RETURN_BYTES]>]),
    ) -> Result<(), LogError> {
        let returns = runs.first().map_or(0, Vec::len);
        // A scan without returns has its message, too.
        for first in (0..returns.max(1)).step_by(MOST_RETURNS) {
            for ((topic, &pose), of_run) in self.runs.iter().zip(poses).zip(runs) {
                let of_run = &of_run[first.min(of_run.len())..];
                let of_part = &of_run[..of_run.len().min(MOST_RETURNS)];
                part::write(&mut self.message, ([ordinal, scan, mark, first as u64], pose), of_part);
                self.file.write(*topic, self.scans, stamp_ns, &self.message)?;
            }
        }
        self.scans += 1;
        Ok(())
    }

    /// Writes the end, makes the file safe on disk and gives it its name.
    ///
    /// # Errors
    /// When the disk is full or the file cannot be renamed; what was at the path is then untouched.
    pub fn finish(self) -> Result<(), LogError> {
        self.file.finish()
    }
}
