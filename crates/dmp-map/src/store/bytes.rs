//! The bytes of a store: mapped if nobody can change the file, else read.

use std::borrow::Cow;
use std::fs::File;
use std::io;

use memmap2::Mmap;

/// A store's file.
///
/// If a mapped file is truncated, or its disk or mount fails, the program dies by a signal, without an error. So only
/// unlinked files are mapped, which this process has just written. They need no file descriptor, however many runs
/// there are.
#[derive(Debug)]
pub(super) enum StoreBytes {
    Mapped(Mmap),
    Read { file: File, length: u64 },
}

impl StoreBytes {
    /// Reads the file: anyone who can name it may change it.
    pub(super) fn read(file: File) -> io::Result<Self> {
        let length = file.metadata()?.len();
        Ok(Self::Read { file, length })
    }

    /// Maps an unlinked file that this process wrote.
    pub(super) fn mapped(file: &File) -> io::Result<Self> {
        // SAFETY: this process wrote the file and has unlinked it since: nobody else can open it, and nobody here
        // writes.
        #[expect(unsafe_code, reason = "mapping a file is unsafe in Rust; this one never changes")]
        let bytes = unsafe { Mmap::map(file) }?;
        Ok(Self::Mapped(bytes))
    }

    /// Size of the file when it was opened, bytes.
    pub(super) fn len(&self) -> u64 {
        match self {
            Self::Mapped(bytes) => bytes.len() as u64,
            Self::Read { length, .. } => *length,
        }
    }

    /// Some bytes; the caller has compared the range with the file's size.
    pub(super) fn at(&self, offset: u64, bytes: u64) -> io::Result<Cow<'_, [u8]>> {
        let end = offset.checked_add(bytes).filter(|&end| end <= self.len());
        let end = end.ok_or(io::ErrorKind::UnexpectedEof)?;
        match self {
            Self::Mapped(mapped) => Ok(Cow::Borrowed(&mapped[offset as usize..end as usize])),
            Self::Read { file, .. } => {
                let mut read = Vec::new();
                read.try_reserve_exact(bytes as usize)?;
                read.resize(bytes as usize, 0);
                read_exact_at(file, &mut read, offset)?;
                Ok(Cow::Owned(read))
            }
        }
    }
}

#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut bytes: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, bytes, offset) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(read) => {
                bytes = &mut bytes[read..];
                offset += read as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
