//! Where in an MCAP file a message is, and the record that has to be read for it.

/// Where a message is in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bag) struct McapPlace {
    /// Where the chunk's record starts in the file, or the message's own record outside a chunk.
    pub(in crate::bag) record_at: u64,
    /// Bytes of that record's body.
    pub(in crate::bag) record_bytes: u64,
    /// Place of the message's body in the unpacked chunk; `None` outside a chunk.
    pub(in crate::bag) in_chunk: Option<u64>,
    /// Bytes of the message's body.
    pub(in crate::bag) body_bytes: u64,
}

/// A chunk, or a message outside the chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bag) struct Record {
    pub(super) at: u64,
    pub(super) body_bytes: u64,
    pub(super) is_chunk: bool,
}

impl Record {
    /// That in which a message lies.
    pub(in crate::bag) fn of(place: McapPlace) -> Self {
        Self { at: place.record_at, body_bytes: place.record_bytes, is_chunk: place.in_chunk.is_some() }
    }
}
