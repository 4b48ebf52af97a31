//! What the message index behind a chunk says: where in the unpacked chunk its messages are.

use super::framing::Fields;

/// Bytes of an entry of a message index: time and place.
const ENTRY_BYTES: usize = 16;

/// What a pass over the heads keeps in mind.
#[derive(Debug, Default)]
pub(in crate::messages::bag) struct Heads {
    /// The chunk that was passed over last, while its index is met.
    pub(super) chunk: Option<PassedOver>,
    /// Chunks with messages and without a whole index: they were read.
    pub(in crate::messages::bag) unindexed_chunks: u64,
    /// Chunks read to learn what the channels of their messages are.
    pub(in crate::messages::bag) learnt_chunks: u64,
    /// Messages outside the chunks, which have no checksum of their own.
    pub(in crate::messages::bag) loose_messages: u64,
    /// Messages that the summary counts and no index names.
    pub(in crate::messages::bag) unnamed_messages: u64,
}

/// A chunk and what its index says.
#[derive(Debug)]
pub(super) struct PassedOver {
    pub(super) at: u64,
    pub(super) body_bytes: u64,
    pub(super) entries: Vec<Entry>,
    /// Whether an index was met, and nothing that makes it doubtful.
    pub(super) is_indexed: bool,
    pub(super) is_doubtful: bool,
}

/// A message by its index: where in the unpacked chunk its record begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Entry {
    pub(super) record_at: u64,
    pub(super) channel_id: u32,
    pub(super) log_time_ns: u64,
}

impl Heads {
    /// Something is wrong behind the chunk: its index may not be whole.
    pub(super) fn doubt(&mut self) {
        if let Some(chunk) = &mut self.chunk {
            chunk.is_doubtful = true;
        }
    }
}

/// The entries of a message index of MCAP, whose body is a channel's number, a length in bytes, times and places;
/// `None` where it is not whole.
pub(super) fn entries_of(body: &[u8]) -> Option<Vec<Entry>> {
    let mut fields = Fields(body);
    let channel_id = fields.u16("the index's channel").ok()?.into();
    let claimed = u32::from_le_bytes(fields.array("the index's length").ok()?);
    let (entries, rest) =
        fields.0.split_at_checked(usize::try_from(claimed).ok()?)?.0.as_chunks::<ENTRY_BYTES>();
    let entry = |entry: &[u8; ENTRY_BYTES]| {
        let (words, _) = entry.as_chunks::<8>();
        let [log_time_ns, record_at] = words else { return None };
        let [log_time_ns, record_at] = [log_time_ns, record_at].map(|word| u64::from_le_bytes(*word));
        Some(Entry { record_at, channel_id, log_time_ns })
    };
    if !rest.is_empty() {
        return None;
    }
    entries.iter().map(entry).collect()
}
