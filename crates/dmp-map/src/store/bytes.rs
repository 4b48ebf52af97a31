//! The bytes of a store: mapped where nobody can change the file, read where somebody can.

use std::borrow::Cow;
use std::fs::File;
use std::io;

use memmap2::Mmap;

/// A store's file.
///
/// A file that is cut short, or on a disk that fails, or on a mount that goes, while it is mapped ends the program without a
/// word: a page that cannot be had is a signal, not an error. So only files that have lost their names are mapped, which this
/// process wrote itself a moment ago; they need no file descriptor, however many runs there are.
#[derive(Debug)]
pub(super) enum StoreBytes {
    Mapped(Mmap),
    Read { file: File, length: u64 },
}

impl StoreBytes {
    /// Whoever can name the file may change it.
    pub(super) fn read(file: File) -> io::Result<Self> {
        let length = file.metadata()?.len();
        Ok(Self::Read { file, length })
    }

    /// A file without a name that this process wrote.
    pub(super) fn mapped(file: &File) -> io::Result<Self> {
        // SAFETY: this process wrote the file and gave its name away since: no other can open it, and none here writes.
        #[expect(unsafe_code, reason = "mapping a file is unsafe in Rust; this one never changes")]
        let bytes = unsafe { Mmap::map(file) }?;
        Ok(Self::Mapped(bytes))
    }

    /// Bytes of the file when it was opened.
    pub(super) fn len(&self) -> u64 {
        match self {
            Self::Mapped(bytes) => bytes.len() as u64,
            Self::Read { length, .. } => *length,
        }
    }

    /// Some bytes; whoever asks has compared their number with that of the file.
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
