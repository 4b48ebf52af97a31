//! What files hold, by its hash, remembered as long as nothing says that it has changed.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::input_file::open_input;

/// A file that was changed so shortly before it was read may change again without a later time: clocks of file systems are that
/// coarse. It is not remembered.
const SETTLED: Duration = Duration::from_secs(2);

/// The BLAKE3 hash of some bytes: two contents that differ never have the same.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ContentHash([u8; 32]);

impl ContentHash {
    /// That of these bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Its bytes.
    pub fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

/// As 64 hexadecimal digits.
impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&blake3::Hash::from(self.0).to_hex())
    }
}

impl fmt::Debug for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ContentHash({self})")
    }
}

/// 64 hexadecimal digits are no hash where they are none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a hash is 64 hexadecimal digits")]
pub struct NoHash;

impl FromStr for ContentHash {
    type Err = NoHash;

    fn from_str(text: &str) -> Result<Self, NoHash> {
        blake3::Hash::from_hex(text).map(|hash| Self(*hash.as_bytes())).map_err(|_| NoHash)
    }
}

/// By what a file is known again without reading it, as Git's index has it: its length, when it and its entry were last
/// changed, and its number on the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileState {
    /// Length in bytes.
    pub bytes: u64,
    /// When its content was changed, nanoseconds since 1970.
    pub modified_ns: i64,
    /// When it or its metadata was changed, nanoseconds since 1970; 0 where the system does not say.
    pub changed_ns: i64,
    /// Its number on the disk; 0 where there is none.
    pub inode: u64,
}

impl FileState {
    fn of(found: &Metadata) -> Self {
        let since_1970 = found.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let modified_ns = since_1970.map_or(0, |since| since.as_nanos() as i64);
        let (changed_ns, inode) = of_system(found);
        Self { bytes: found.len(), modified_ns, changed_ns, inode }
    }
}

#[cfg(unix)]
fn of_system(found: &Metadata) -> (i64, u64) {
    use std::os::unix::fs::MetadataExt as _;
    (found.ctime().saturating_mul(1_000_000_000).saturating_add(found.ctime_nsec()), found.ino())
}

#[cfg(not(unix))]
fn of_system(_: &Metadata) -> (i64, u64) {
    (0, 0)
}

/// Hashes of files, each with the state in which the file had it. A file in that state is not read again.
#[derive(Debug, Default)]
pub struct ContentMemo {
    known: BTreeMap<PathBuf, (FileState, ContentHash)>,
    bytes_read: u64,
}

impl ContentMemo {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes what another memo knew.
    pub fn remember(&mut self, path: PathBuf, state: FileState, hash: ContentHash) {
        self.known.insert(path, (state, hash));
    }

    /// All that it knows.
    pub fn known(&self) -> impl Iterator<Item = (&Path, FileState, ContentHash)> {
        self.known.iter().map(|(path, (state, hash))| (path.as_path(), *state, *hash))
    }

    /// Bytes that were read because they were not known.
    pub fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// The hash of a file's content; `go_on` is asked after each piece of some megabytes that is read.
    ///
    /// # Errors
    /// When the file cannot be read, when it changes meanwhile, and where `go_on` fails.
    pub fn hash(
        &mut self,
        path: &Path,
        mut go_on: impl FnMut() -> io::Result<()>,
    ) -> io::Result<ContentHash> {
        let full = std::path::absolute(path)?;
        let began = SystemTime::now();
        let state = FileState::of(&fs::metadata(path)?);
        if let Some((_, hash)) = self.known.get(&full).filter(|(known, _)| *known == state) {
            return Ok(*hash);
        }
        let mut file = open_input(path)?;
        let mut hasher = blake3::Hasher::new();
        let mut piece = vec![0; 4 << 20];
        loop {
            let count = match io::Read::read(&mut file, &mut piece) {
                Ok(0) => break,
                Ok(count) => count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            hasher.update(&piece[..count]);
            self.bytes_read += count as u64;
            go_on()?;
        }
        let found = fs::metadata(path)?;
        if FileState::of(&found) != state {
            return Err(io::Error::other("it changes while it is read"));
        }
        let hash = ContentHash(*hasher.finalize().as_bytes());
        let is_settled = found
            .modified()
            .is_ok_and(|time| began.duration_since(time).is_ok_and(|passed| passed > SETTLED));
        if is_settled {
            self.known.insert(full, (state, hash));
        } else {
            self.known.remove(&full);
        }
        Ok(hash)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn old(path: &Path, seconds: u64) {
        let time = SystemTime::now() - Duration::from_secs(seconds);
        fs::File::options().write(true).open(path).unwrap().set_modified(time).unwrap();
    }

    fn hash(memo: &mut ContentMemo, path: &Path) -> (ContentHash, u64) {
        let before = memo.bytes_read();
        let hash = memo.hash(path, || Ok(())).unwrap();
        (hash, memo.bytes_read() - before)
    }

    #[test]
    fn what_is_known_is_not_read_and_what_changed_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        let mut memo = ContentMemo::new();
        fs::write(&path, b"one").unwrap();
        old(&path, 100);
        let one = hash(&mut memo, &path);
        assert_eq!(one, (ContentHash::of(b"one"), 3));
        assert_eq!(hash(&mut memo, &path), (one.0, 0));
        // As long, and with the time that it had.
        let time = fs::metadata(&path).unwrap().modified().unwrap();
        fs::write(&path, b"two").unwrap();
        fs::File::options().write(true).open(&path).unwrap().set_modified(time).unwrap();
        if cfg!(unix) {
            assert_eq!(hash(&mut memo, &path), (ContentHash::of(b"two"), 3));
        }
        // Touched alone: the same content.
        old(&path, 50);
        assert_eq!(hash(&mut memo, &path).0, ContentHash::of(b"two"));
        let mut other = ContentMemo::new();
        memo.known().for_each(|(path, state, hash)| other.remember(path.to_path_buf(), state, hash));
        assert_eq!(hash(&mut other, &path), (ContentHash::of(b"two"), 0));
    }

    #[test]
    fn what_was_just_written_is_not_remembered() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        fs::write(&path, b"new").unwrap();
        let mut memo = ContentMemo::new();
        assert_eq!((hash(&mut memo, &path).1, hash(&mut memo, &path).1), (3, 3));
        assert_eq!(memo.known().count(), 0);
    }

    #[test]
    fn a_hash_is_read_back_and_reading_stops_where_asked() {
        let hash = ContentHash::of(b"abc");
        assert_eq!(hash.to_string().parse(), Ok(hash));
        assert_eq!("xyz".parse::<ContentHash>(), Err(NoHash));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        fs::write(&path, b"abc").unwrap();
        let stop = || Err(io::ErrorKind::TimedOut.into());
        assert_eq!(ContentMemo::new().hash(&path, stop).unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!(ContentMemo::new().hash(folder.path(), || Ok(())).is_err());
    }
}
