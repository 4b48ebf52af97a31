//! Reading a result that was kept.

use super::part::{self, KeptPart};
use super::writer::{JSON, PLANES, RESULT, RETURNS};
use crate::LogError;
use crate::error::PlaceInFile;
use dmp_disk::open_input;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read as _};
use std::path::{Path, PathBuf};

/// No record is larger, nor a chunk: twice the largest result, and far more than a message of returns.
const MOST_BYTES: usize = 1 << 27;

/// Reads a result with its returns, in the order in which they were written. Chunks are checked on the way.
pub struct KeptReader {
    path: PathBuf,
    file: BufReader<File>,
    reader: LinearReader,
    /// Names of the runs by their numbers, and the numbers by channel.
    runs: Vec<String>,
    channels: BTreeMap<u16, Topic>,
    messages: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Topic {
    Result,
    Run(usize),
}

/// Takes a message of a topic, or says what is wrong with it.
type Take<'a> = dyn FnMut(Topic, &[u8]) -> Result<(), String> + 'a;

impl fmt::Debug for KeptReader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("KeptReader")
            .field("path", &self.path)
            .field("runs", &self.runs)
            .finish_non_exhaustive()
    }
}

/// Whether the file begins as one that is read here: JSON does not.
///
/// # Errors
/// When it cannot be read.
pub fn is_kept(path: &Path) -> Result<bool, LogError> {
    let mut start = Vec::new();
    let file = open_input(path).map_err(|error| LogError::io(path, "open", error))?;
    let magic = mcap::MAGIC;
    let read = file.take(magic.len() as u64).read_to_end(&mut start);
    read.map_err(|error| LogError::io(path, "read", error))?;
    Ok(start == magic)
}

impl KeptReader {
    /// Opens a file, and reads the result in it, as JSON.
    ///
    /// # Errors
    /// When it cannot be read, or holds no result.
    pub fn open(path: &Path) -> Result<(Self, Vec<u8>), LogError> {
        let file = open_input(path).map_err(|error| LogError::io(path, "open", error))?;
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MOST_BYTES)
            .with_check_finishes_after_end_magic(true);
        let mut reader = Self {
            path: path.into(),
            file: BufReader::with_capacity(1 << 18, file),
            reader: LinearReader::new_with_options(options),
            runs: Vec::new(),
            channels: BTreeMap::new(),
            messages: 0,
        };
        let mut result = None;
        let found = reader.next_message(&mut |topic, message| {
            if topic == Topic::Result {
                result = Some(message.to_vec());
            }
            Ok(())
        })?;
        match result.filter(|_| found) {
            Some(result) => Ok((reader, result)),
            None => Err(reader.malformed(format!("no message on {RESULT}: no result of `dmp score --keep`"))),
        }
    }

    /// The runs that were met so far, by their numbers.
    pub fn runs(&self) -> &[String] {
        &self.runs
    }

    /// Reads the next returns into `part`; returns the number of their run; `None` behind the last.
    ///
    /// # Errors
    /// When the file cannot be read, or is not as it was written.
    pub fn next_part(&mut self, part: &mut KeptPart) -> Result<Option<usize>, LogError> {
        let mut of_run = None;
        let found = self.next_message(&mut |topic, message| match topic {
            Topic::Run(run) => {
                of_run = Some(run);
                part::read(message, part)
            }
            Topic::Result => Err(format!("a second message on {RESULT}")),
        })?;
        Ok(of_run.filter(|_| found))
    }

    /// Hands over the next message; returns whether there was one.
    fn next_message(&mut self, take: &mut Take<'_>) -> Result<bool, LogError> {
        let Self { path, file, reader, runs, channels, messages } = self;
        let malformed = |messages: u64, problem: String| LogError::Malformed {
            path: path.clone(),
            place: PlaceInFile::Message(messages),
            problem,
        };
        while let Some(event) = reader.next_event() {
            match event.map_err(|error| malformed(*messages, in_words(&error)))? {
                LinearReadEvent::ReadRequest(bytes) => {
                    let read = file.read(reader.insert(bytes));
                    reader.notify_read(read.map_err(|error| LogError::io(path, "read", error))?);
                }
                LinearReadEvent::Record { opcode: op::CHANNEL, data } => {
                    let record = mcap::parse_record(op::CHANNEL, data);
                    let record = record.map_err(|error| malformed(*messages, in_words(&error)))?;
                    let Record::Channel(channel) = record else { continue };
                    let topic = topic_of(&channel.topic, &channel.message_encoding, runs);
                    channels
                        .entry(channel.id)
                        .or_insert(topic.map_err(|problem| malformed(*messages, problem))?);
                }
                LinearReadEvent::Record { opcode: op::MESSAGE, data } => {
                    let record = mcap::parse_record(op::MESSAGE, data);
                    let record = record.map_err(|error| malformed(*messages, in_words(&error)))?;
                    let Record::Message { header, data } = record else { continue };
                    let topic = channels.get(&header.channel_id).copied();
                    let none = || {
                        malformed(
                            *messages,
                            format!("of channel {}, which is not described", header.channel_id),
                        )
                    };
                    take(topic.ok_or_else(none)?, &data).map_err(|problem| malformed(*messages, problem))?;
                    *messages += 1;
                    return Ok(true);
                }
                LinearReadEvent::Record { .. } => {}
            }
        }
        Ok(false)
    }

    fn malformed(&self, problem: String) -> LogError {
        LogError::Malformed { path: self.path.clone(), place: PlaceInFile::Message(self.messages), problem }
    }
}

/// What is on a topic; a run that is new gets the next number.
fn topic_of(topic: &str, encoding: &str, runs: &mut Vec<String>) -> Result<Topic, String> {
    let run = topic.strip_prefix('/').and_then(|topic| topic.strip_suffix(RETURNS));
    match (run, encoding) {
        (_, JSON) if topic == RESULT => Ok(Topic::Result),
        (Some(run), PLANES) => {
            let number = runs.iter().position(|known| known == run);
            Ok(Topic::Run(number.unwrap_or_else(|| {
                runs.push(run.to_owned());
                runs.len() - 1
            })))
        }
        _ => Err(format!(
            "a topic `{topic}` in `{encoding}`: no result of `dmp score --keep` of this version: score again"
        )),
    }
}

fn in_words(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::UnexpectedEof => "the file ends before its end was written".to_owned(),
        other => other.to_string(),
    }
}
