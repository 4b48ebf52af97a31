//! A borrowed reader for ROS 2 messages in CDR, the plain first version of it.

/// Why a message ended before it should.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CdrError(pub(crate) String);

/// Reads primitives from a message, aligned from the end of its four-byte encapsulation header.
#[derive(Debug, Clone)]
pub(crate) struct CdrReader<'a> {
    payload: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> CdrReader<'a> {
    pub(crate) fn new(message: &'a [u8]) -> Result<Self, CdrError> {
        let [0, kind @ (0 | 1), _, _, payload @ ..] = message else {
            let start = message.get(..4).unwrap_or(message);
            return Err(CdrError(format!("the message starts with {start:02x?}, which is not plain CDR")));
        };
        Ok(Self { payload, at: 0, big_endian: *kind == 0 })
    }

    fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], CdrError> {
        let rest = self.payload.get(self.at..).unwrap_or_default();
        let Some(bytes) = rest.get(..count) else {
            return Err(CdrError(format!("{what} takes {count} bytes, the message has {} left", rest.len())));
        };
        self.at += count;
        Ok(bytes)
    }

    fn word(&mut self, what: &str) -> Result<[u8; 4], CdrError> {
        self.at = self.at.next_multiple_of(4);
        match self.take(4, what)? {
            &[a, b, c, d] => Ok([a, b, c, d]),
            _ => Err(CdrError(format!("{what} is cut"))),
        }
    }

    pub(crate) fn u8(&mut self, what: &str) -> Result<u8, CdrError> {
        self.take(1, what).map(|bytes| bytes.first().copied().unwrap_or_default())
    }

    pub(crate) fn u32(&mut self, what: &str) -> Result<u32, CdrError> {
        let word = self.word(what)?;
        Ok(if self.big_endian { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
    }

    pub(crate) fn i32(&mut self, what: &str) -> Result<i32, CdrError> {
        Ok(self.u32(what)?.cast_signed())
    }

    /// A sequence of bytes.
    pub(crate) fn bytes(&mut self, what: &str) -> Result<&'a [u8], CdrError> {
        let count = self.u32(what)?;
        self.take(count as usize, what)
    }

    /// A string without the zero that ends it.
    pub(crate) fn string(&mut self, what: &str) -> Result<&'a str, CdrError> {
        let bytes = self.bytes(what)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(bytes)
            .map_err(|_| CdrError(format!("{what} is not text: {:02x?}", bytes.get(..16).unwrap_or(bytes))))
    }
}

/// Writes what [`CdrReader`] reads, little-endian.
#[derive(Debug, Default)]
pub(crate) struct CdrWriter {
    message: Vec<u8>,
}

impl CdrWriter {
    /// Starts a new message in the same buffer.
    pub(crate) fn start(&mut self) {
        self.message.clear();
        self.message.extend_from_slice(&[0, 1, 0, 0]);
    }

    pub(crate) fn u8(&mut self, value: u8) {
        self.message.push(value);
    }

    pub(crate) fn u32(&mut self, value: u32) {
        // The header has four bytes, so aligned in the message is aligned in the payload.
        self.message.resize(self.message.len().next_multiple_of(4), 0);
        self.message.extend_from_slice(&value.to_le_bytes());
    }

    pub(crate) fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.message.extend_from_slice(text.as_bytes());
        self.message.push(0);
    }

    /// The message so far, to be appended to.
    pub(crate) fn message(&mut self) -> &mut Vec<u8> {
        &mut self.message
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_aligned_and_in_both_orders() {
        let little = [0, 1, 0, 0, 7, 0xff, 0xff, 0xff, 1, 2, 0, 0];
        let mut reader = CdrReader::new(&little).unwrap();
        assert_eq!((reader.u8("a"), reader.u32("b")), (Ok(7), Ok(0x0201)));
        let big = [0, 0, 0, 0, 0, 0, 0, 3, b'a', b'b', 0];
        let mut reader = CdrReader::new(&big).unwrap();
        assert_eq!(reader.string("name"), Ok("ab"));
        assert_eq!(reader.u8("c").unwrap_err().0, "c takes 1 bytes, the message has 0 left");
    }

    #[test]
    fn claimed_lengths_are_checked() {
        let mut reader = CdrReader::new(&[0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 1]).unwrap();
        assert!(reader.bytes("data").unwrap_err().0.contains("4294967295 bytes, the message has 1 left"));
        assert!(CdrReader::new(&[0, 1]).unwrap_err().0.contains("[00, 01]"));
        assert!(CdrReader::new(&[0, 7, 0, 0]).is_err());
    }
}
