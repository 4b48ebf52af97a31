//! Numbers at places of a point's record.

/// Where the time is in records of point formats up to 5.
pub(crate) const GPS_TIME_10: usize = 20;
/// Where the time is in records of point formats from 6 on.
pub(crate) const GPS_TIME_14: usize = 22;

/// The bytes at a place, zeros where the record is shorter.
pub(crate) fn get<const N: usize>(record: &[u8], at: usize) -> [u8; N] {
    record.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
}

/// Puts bytes at a place, if the record has it.
#[inline]
pub(crate) fn put<const N: usize>(record: &mut [u8], at: usize, bytes: [u8; N]) {
    if let Some(place) = record.get_mut(at..).and_then(|rest| rest.first_chunk_mut()) {
        *place = bytes;
    }
}

/// A point's place, in steps of the file.
pub(crate) type Place = [i32; 3];

pub(crate) fn place(record: &[u8]) -> Place {
    [0, 4, 8].map(|at| i32::from_le_bytes(get(record, at)))
}

#[inline]
pub(crate) fn put_place(record: &mut [u8], place: Place) {
    let mut bytes = [0; 12];
    for (bytes, coordinate) in bytes.as_chunks_mut().0.iter_mut().zip(place) {
        *bytes = coordinate.to_le_bytes();
    }
    put(record, 0, bytes);
}
