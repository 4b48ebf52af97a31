//! A message: returns of one scan in one run, byte by byte.

/// Bytes of a return, whose meaning is that of whoever keeps them.
pub const RETURN_BYTES: usize = 4;

/// Returns of a message at most.
pub(super) const MOST_RETURNS: usize = 1 << 16;
/// The scan's place among those that could be scored, its number in the log, its mark, the number of the first return.
const HEAD_BYTES: usize = 4 * 8;

/// Returns of one scan in one run that follow each other.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct KeptPart {
    /// The scan's place among those that could be scored.
    pub ordinal: u64,
    /// Its number in the log.
    pub scan: u64,
    /// What distinguishes its returns from others as many.
    pub mark: u64,
    /// How many of its returns come before.
    pub first: u64,
    /// The returns in their order, 2^16 at most.
    pub returns: Vec<[u8; RETURN_BYTES]>,
}

/// Puts a message together: the first bytes of all returns, then the second ones, and so on. So zstd finds them alike.
pub(super) fn write(message: &mut Vec<u8>, head: [u64; 4], returns: &[[u8; RETURN_BYTES]]) {
    message.clear();
    message.extend_from_slice(head.map(u64::to_le_bytes).as_flattened());
    for plane in 0..RETURN_BYTES {
        message.extend(returns.iter().map(|bytes| bytes[plane]));
    }
}

/// Takes a message apart.
pub(super) fn read(message: &[u8], part: &mut KeptPart) -> Result<(), String> {
    let bytes = message.len();
    let Some((head, planes)) = message.split_first_chunk::<HEAD_BYTES>() else {
        return Err(format!("a message of {bytes} bytes, its head alone has {HEAD_BYTES}"));
    };
    let count = planes.len() / RETURN_BYTES;
    if count * RETURN_BYTES != planes.len() || count > MOST_RETURNS {
        return Err(format!("a message of {bytes} bytes, which are no returns"));
    }
    let mut numbers = [0; 4];
    for (number, bytes) in numbers.iter_mut().zip(head.as_chunks().0) {
        *number = u64::from_le_bytes(*bytes);
    }
    [part.ordinal, part.scan, part.mark, part.first] = numbers;
    part.returns.clear();
    part.returns.resize(count, [0; RETURN_BYTES]);
    for (plane, bytes) in planes.chunks_exact(count.max(1)).enumerate() {
        for (returned, byte) in part.returns.iter_mut().zip(bytes) {
            returned[plane] = *byte;
        }
    }
    Ok(())
}
