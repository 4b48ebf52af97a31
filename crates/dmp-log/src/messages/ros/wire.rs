//! How ROS puts messages into bytes: CDR for ROS 2, its own unaligned form for ROS 1. Read in place.

use dmp_lengths::thousands;

/// Why a message ended before it should.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WireError(pub(crate) String);

/// How a message is put into bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Encoding {
    /// ROS 2: aligned, in either byte order, which a header of four bytes says.
    Cdr,
    /// ROS 1: nothing aligned, lowest byte first. Bags of ROS 1 have it, and MCAP files converted from them.
    Ros1,
}

impl Encoding {
    /// By the name that a bag has for it.
    pub(crate) fn of(name: &str) -> Option<Self> {
        match name {
            "cdr" => Some(Self::Cdr),
            "ros1" => Some(Self::Ros1),
            _ => None,
        }
    }
}

/// Reads the parts of a message one after the other.
#[derive(Debug, Clone)]
pub(crate) struct WireReader<'a> {
    payload: &'a [u8],
    at: usize,
    encoding: Encoding,
    big_endian: bool,
}

impl<'a> WireReader<'a> {
    pub(crate) fn new(encoding: Encoding, message: &'a [u8]) -> Result<Self, WireError> {
        if encoding == Encoding::Ros1 {
            return Ok(Self { payload: message, at: 0, encoding, big_endian: false });
        }
        let [0, kind @ (0 | 1), _, _, payload @ ..] = message else {
            let start = message.get(..4).unwrap_or(message);
            return Err(WireError(format!("the message starts with {start:02x?}, which is not plain CDR")));
        };
        Ok(Self { payload, at: 0, encoding, big_endian: *kind == 0 })
    }

    /// CDR aligns numbers to their size, counted from the end of its header.
    fn align(&mut self, bytes: usize) {
        if self.encoding == Encoding::Cdr {
            self.at = self.at.next_multiple_of(bytes);
        }
    }

    fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], WireError> {
        let rest = self.payload.get(self.at..).unwrap_or_default();
        let Some(bytes) = rest.get(..count) else {
            return Err(WireError(format!(
                "{what} takes {} bytes, the message has {} left",
                thousands(count),
                thousands(rest.len())
            )));
        };
        self.at += count;
        Ok(bytes)
    }

    /// The next number, lowest byte first.
    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], WireError> {
        self.align(N);
        let bytes = self.take(N, what)?.first_chunk().copied();
        let mut bytes: [u8; N] = bytes.ok_or_else(|| WireError(format!("{what} is cut")))?;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub(crate) fn u8(&mut self, what: &str) -> Result<u8, WireError> {
        self.array(what).map(u8::from_le_bytes)
    }

    pub(crate) fn u32(&mut self, what: &str) -> Result<u32, WireError> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, what: &str) -> Result<u64, WireError> {
        self.array(what).map(u64::from_le_bytes)
    }

    pub(crate) fn f64(&mut self, what: &str) -> Result<f64, WireError> {
        self.u64(what).map(f64::from_bits)
    }

    /// `builtin_interfaces/msg/Time`, nanoseconds.
    pub(crate) fn stamp_ns(&mut self) -> Result<i64, WireError> {
        let seconds = self.i32("stamp")?;
        let nanoseconds = self.u32("stamp")?;
        if nanoseconds >= 1_000_000_000 {
            return Err(WireError(format!("the stamp has {nanoseconds} nanoseconds, more than a second")));
        }
        Ok(i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds))
    }

    /// `std_msgs/msg/Header`: stamp in nanoseconds, frame.
    pub(crate) fn header(&mut self) -> Result<(i64, &'a str), WireError> {
        if self.encoding == Encoding::Ros1 {
            self.u32("seq")?;
        }
        Ok((self.stamp_ns()?, self.string("frame_id")?))
    }

    /// Whether numbers have their highest byte first.
    pub(crate) fn is_big_endian(&self) -> bool {
        self.big_endian
    }

    /// Whether numbers are aligned.
    pub(crate) fn is_aligned(&self) -> bool {
        self.encoding == Encoding::Cdr
    }

    /// What follows, aligned to four bytes where anything is.
    pub(crate) fn rest(&mut self) -> &'a [u8] {
        self.align(4);
        let rest = self.payload.get(self.at..).unwrap_or_default();
        self.at = self.payload.len();
        rest
    }

    pub(crate) fn i32(&mut self, what: &str) -> Result<i32, WireError> {
        Ok(self.u32(what)?.cast_signed())
    }

    /// A sequence of bytes.
    pub(crate) fn bytes(&mut self, what: &str) -> Result<&'a [u8], WireError> {
        let count = self.u32(what)?;
        self.take(count as usize, what)
    }

    /// A string without the zero that ends it.
    pub(crate) fn string(&mut self, what: &str) -> Result<&'a str, WireError> {
        let bytes = self.bytes(what)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(bytes)
            .map_err(|_| WireError(format!("{what} is not text: {:02x?}", bytes.get(..16).unwrap_or(bytes))))
    }
}

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RosStamp {
    seconds: i32,
    nanoseconds: u32,
}

impl RosStamp {
    /// The first instant of 1970: of what has no time.
    pub(crate) const ZERO: Self = Self { seconds: 0, nanoseconds: 0 };

    /// A stamp in nanoseconds. What is beyond 32 bits of seconds is said.
    pub(crate) fn of_ns(stamp_ns: i64) -> Result<Self, String> {
        let seconds = i32::try_from(stamp_ns.div_euclid(1_000_000_000))
            .map_err(|_| format!("the stamp {stamp_ns} ns is beyond 32 bits of seconds"))?;
        Ok(Self { seconds, nanoseconds: stamp_ns.rem_euclid(1_000_000_000) as u32 })
    }
}

/// Writes CDR, little-endian.
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

    pub(crate) fn f32(&mut self, value: f32) {
        self.u32(value.to_bits());
    }

    /// Eight bytes, which CDR aligns to eight, counted from the end of its header.
    pub(crate) fn f64(&mut self, value: f64) {
        let payload = self.message.len().saturating_sub(4);
        self.message.resize(4 + payload.next_multiple_of(8), 0);
        self.message.extend_from_slice(&value.to_le_bytes());
    }

    /// `builtin_interfaces/msg/Time`.
    pub(crate) fn stamp(&mut self, stamp: RosStamp) {
        self.u32(stamp.seconds.cast_unsigned());
        self.u32(stamp.nanoseconds);
    }

    /// `std_msgs/msg/Header`.
    pub(crate) fn header(&mut self, stamp: RosStamp, frame_id: &str) {
        self.stamp(stamp);
        self.string(frame_id);
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
        let mut reader = WireReader::new(Encoding::Cdr, &little).unwrap();
        assert_eq!((reader.u8("a"), reader.u32("b")), (Ok(7), Ok(0x0201)));
        let big = [0, 0, 0, 0, 0, 0, 0, 3, b'a', b'b', 0];
        let mut reader = WireReader::new(Encoding::Cdr, &big).unwrap();
        assert_eq!(reader.string("name"), Ok("ab"));
        assert_eq!(reader.u8("c").unwrap_err().0, "c takes 1 bytes, the message has 0 left");
    }

    #[test]
    fn claimed_lengths_are_checked() {
        let mut reader = WireReader::new(Encoding::Cdr, &[0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 1]).unwrap();
        assert!(reader.bytes("data").unwrap_err().0.contains("4,294,967,295 bytes, the message has 1 left"));
        assert!(WireReader::new(Encoding::Cdr, &[0, 1]).unwrap_err().0.contains("[00, 01]"));
        assert!(WireReader::new(Encoding::Cdr, &[0, 7, 0, 0]).is_err());
    }
}
