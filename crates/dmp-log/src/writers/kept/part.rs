//! A message: returns of one scan in one run, byte by byte.

/// Bytes of a return, whose meaning is that of whoever keeps them.
pub const RETURN_BYTES: usize = 4;

/// Returns of a message at most.
pub(super) const MOST_RETURNS: usize = 1 << 16;
/// The scan's place among those that could be scored, its number in the log, its mark, the number of the first return; the
/// pose.
const HEAD_BYTES: usize = (4 + 7) * 8;

/// Returns of one scan in one run that follow each other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KeptPart {
    /// The scan's place among those that could be scored.
    pub ordinal: u64,
    /// Its number in the log.
    pub scan: u64,
    /// What distinguishes its returns from others as many.
    pub mark: u64,
    /// How many of its returns come before.
    pub first: u64,
    /// The pose of the sensor in the frame of the run, x, y, z, qx, qy, qz, qw; NaN where it has none.
    pub pose: [f64; 7],
    /// The returns in their order, 2^16 at most.
    pub returns: Vec<[u8; RETURN_BYTES]>,
}

/// Puts a message together: the first bytes of all returns, then the second ones, and so on. So zstd finds them alike.
pub(super) fn write(
    message: &mut Vec<u8>,
    (head, pose): ([u64; 4], [f64; 7]),
    returns: &[[u8; RETURN_BYTES]],
) {
    message.clear();
    message.extend_from_slice(head.map(u64::to_le_bytes).as_flattened());
    message.extend_from_slice(pose.map(f64::to_le_bytes).as_flattened());
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
    let mut words = head.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes));
    let mut next = || words.next().unwrap_or_default();
    [part.ordinal, part.scan, part.mark, part.first] = std::array::from_fn(|_| next());
    part.pose = std::array::from_fn(|_| f64::from_bits(next()));
    part.returns.clear();
    part.returns.resize(count, [0; RETURN_BYTES]);
    for (plane, bytes) in planes.chunks_exact(count.max(1)).enumerate() {
        for (returned, byte) in part.returns.iter_mut().zip(bytes) {
            returned[plane] = *byte;
        }
    }
    Ok(())
}
