//! Bytes anywhere in a LAS file, never past its end.

use crate::{ParseError, PlaceInFile};
use std::io::{self, Read, Seek, SeekFrom};

/// Bytes of the head of a variable length record.
pub(crate) const VLR_HEAD_BYTES: u64 = 54;

/// Reads at any place of a file of known length.
pub(crate) struct Bytes<'a, R> {
    input: &'a mut R,
    /// Where the input is; `None` where a read failed.
    position: Option<u64>,
    pub(crate) length: u64,
}

impl<'a, R: Read + Seek> Bytes<'a, R> {
    pub(crate) fn of(input: &'a mut R, length: u64) -> Self {
        Self { input, position: None, length }
    }

    fn read(&mut self, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        let step = self
            .position
            .take()
            .and_then(|position| i64::try_from(i128::from(at) - i128::from(position)).ok());
        match step {
            // Keeps what is buffered: there may be millions of records, each of some bytes.
            Some(step) => self.input.seek_relative(step)?,
            None => self.input.seek(SeekFrom::Start(at)).map(|_| ())?,
        }
        self.input.read_exact(bytes)?;
        self.position = at.checked_add(bytes.len() as u64);
        Ok(())
    }

    /// So many bytes, which must lie in the file.
    pub(crate) fn many(&mut self, at: u64, count: u64, what: &str) -> Result<Vec<u8>, ParseError> {
        if at.checked_add(count).is_none_or(|end| end > self.length) {
            let problem = format!("{what} of {count} bytes is beyond the file's end at byte {}", self.length);
            return Err(ParseError::new(PlaceInFile::Byte(at), problem));
        }
        let mut bytes = vec![0; count as usize];
        self.read(at, &mut bytes)
            .map_err(|e| ParseError::new(PlaceInFile::Byte(at), format!("cannot read {what}: {e}")))?;
        Ok(bytes)
    }

    pub(crate) fn at<const N: usize>(&mut self, at: u64, what: &str) -> Result<[u8; N], ParseError> {
        let mut bytes = [0; N];
        if at.checked_add(N as u64).is_none_or(|end| end > self.length) {
            let problem = format!("{what} is beyond the file's end at byte {}", self.length);
            return Err(ParseError::new(PlaceInFile::Byte(at), problem));
        }
        self.read(at, &mut bytes)
            .map_err(|e| ParseError::new(PlaceInFile::Byte(at), format!("cannot read {what}: {e}")))?;
        Ok(bytes)
    }

    pub(crate) fn u16(&mut self, at: u64, what: &str) -> Result<u16, ParseError> {
        self.at(at, what).map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self, at: u64, what: &str) -> Result<u32, ParseError> {
        self.at(at, what).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, at: u64, what: &str) -> Result<u64, ParseError> {
        self.at(at, what).map(u64::from_le_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufReader, Cursor};

    /// Counts what is read from below the buffer.
    struct Counted<'a>(Cursor<&'a [u8]>, &'a mut u64);

    impl Read for Counted<'_> {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            let read = self.0.read(bytes)?;
            *self.1 += read as u64;
            Ok(read)
        }
    }

    impl Seek for Counted<'_> {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.0.seek(to)
        }
    }

    /// A hundred thousand fields side by side, in both directions: the file is read once or twice, not for each.
    #[test]
    fn fields_beside_one_another_are_read_from_the_buffer() {
        let file: Vec<u8> = (0..100_000_u32).flat_map(u32::to_le_bytes).collect();
        let mut read = 0;
        let mut input = BufReader::with_capacity(1 << 16, Counted(Cursor::new(&file), &mut read));
        let mut bytes = Bytes::of(&mut input, file.len() as u64);
        for k in 0..99_990_u32 {
            for field in [k, k + 9, k + 3] {
                assert_eq!(bytes.u32(4 * u64::from(field), "a field").unwrap(), field);
            }
        }
        assert!(bytes.u32(file.len() as u64 - 3, "a field").unwrap_err().problem.contains("beyond"));
        assert_eq!(bytes.u32(0, "a field"), Ok(0));
        drop(input);
        assert!(read < 4 * file.len() as u64, "{read}");
    }
}
