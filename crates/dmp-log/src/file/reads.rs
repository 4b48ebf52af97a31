//! Files whose bytes are counted as they are read.

use crate::{LogError, PlaceInFile};
use dmp_disk::open_input;
use dmp_lengths::thousands;
use std::fs::{File, Metadata};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
#[cfg(unix)]
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

/// How many bytes were read from the files opened with it. Clones count together.
#[derive(Debug, Clone, Default)]
pub(crate) struct ReadCount(Arc<AtomicU64>);

impl ReadCount {
    /// Bytes so far, also of files that are closed.
    pub(crate) fn bytes(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Opens a file for reading.
    pub(crate) fn open(&self, path: &Path) -> io::Result<CountedFile> {
        Ok(CountedFile { file: open_input(path)?, count: self.clone() })
    }
}

/// A file open for reading.
#[derive(Debug)]
pub(crate) struct CountedFile {
    file: File,
    count: ReadCount,
}

impl CountedFile {
    pub(crate) fn metadata(&self) -> io::Result<Metadata> {
        self.file.metadata()
    }
}

/// A file as it was when the log was opened: of another length or changed later, it is another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct KnownFile {
    pub(crate) path: PathBuf,
    pub(crate) length: u64,
    /// When it was last written; `None` where the system does not say.
    modified: Option<SystemTime>,
}

impl KnownFile {
    pub(crate) fn new(path: &Path, metadata: &Metadata) -> Self {
        Self { path: path.into(), length: metadata.len(), modified: metadata.modified().ok() }
    }

    /// What is said where it is not the file that was opened `before`.
    pub(crate) fn changed_since(&self, before: &Self) -> LogError {
        let [then, now] = [before.length, self.length].map(thousands);
        let problem = format!("the file has changed since it was opened: {then} bytes then, {now} now");
        LogError::malformed(&self.path, PlaceInFile::WholeFile, problem)
    }
}

impl Read for CountedFile {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        // Not every decoder asks again where a signal came first.
        let count = loop {
            match self.file.read(bytes) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                read => break read?,
            }
        };
        self.count.0.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl Seek for CountedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        self.file.stream_position()
    }
}

/// Refuses what gives bytes without end, or waits for somebody to type them.
pub(crate) fn refuse_device(path: &Path) -> Result<(), LogError> {
    #[cfg(unix)]
    if let Ok(kind) = path.metadata().map(|metadata| metadata.file_type())
        && (kind.is_char_device() || kind.is_block_device())
    {
        return Err(LogError::malformed(path, PlaceInFile::WholeFile, "a device, no file"));
    }
    Ok(())
}

/// The first bytes of a file, by which formats are recognised: 16, or fewer where it is shorter.
pub(crate) fn start_of(path: &Path) -> Result<Vec<u8>, LogError> {
    refuse_device(path)?;
    let mut start = Vec::new();
    let file = open_input(path).map_err(|e| LogError::io(path, "open", e))?;
    file.take(16).read_to_end(&mut start).map_err(|e| LogError::io(path, "read", e))?;
    Ok(start)
}

/// Opens a file that is read from its start, and its length.
pub(crate) fn open_sized(path: &Path) -> Result<(BufReader<File>, u64), LogError> {
    let file = open_input(path).map_err(|e| LogError::io(path, "open", e))?;
    let length = file.metadata().map_err(|e| LogError::io(path, "read", e))?.len();
    Ok((BufReader::with_capacity(1 << 16, file), length))
}

/// Reads `count` bytes from `at` on, which were there when the log was opened.
pub(crate) fn fill(
    path: &Path,
    input: &mut (impl Read + Seek),
    at: u64,
    count: u64,
    bytes: &mut Vec<u8>,
) -> Result<(), LogError> {
    bytes.clear();
    let mut read = || -> io::Result<()> {
        input.seek(SeekFrom::Start(at))?;
        input.by_ref().take(count).read_to_end(bytes)?;
        Ok(())
    };
    read().map_err(|e| LogError::io(path, "read", e))?;
    if bytes.len() as u64 != count {
        let problem = format!("{count} bytes were here when the file was opened, it is shorter now");
        return Err(LogError::malformed(path, PlaceInFile::Byte(at + bytes.len() as u64), problem));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_counted_and_what_is_skipped_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, [7; 1000]).unwrap();
        let count = ReadCount::default();
        let mut bytes = Vec::new();
        let mut file = count.open(&path).unwrap();
        file.seek(SeekFrom::Start(900)).unwrap();
        file.read_to_end(&mut bytes).unwrap();
        count.clone().open(&path).unwrap().read_exact(&mut bytes[..30]).unwrap();
        assert_eq!((bytes.len(), count.bytes()), (100, 130));
    }
}
