//! Messages of a file of records, most of them in chunks: MCAP, bags of ROS 1.

mod ahead;
mod channels;
mod chunk;
mod framing;
mod heads;
mod last_message;
mod message_index;
mod messages;
mod part;
mod pass;
mod records;
mod ros1;
mod summary_hint;
mod whole;

pub(super) use channels::Channels;
pub(super) use framing::Framing;
pub(super) use message_index::Heads;
pub(super) use messages::ChunkedMessages;
pub(super) use part::read_part;
pub(super) use records::{Record, RecordPlace};
pub(super) use whole::{read_heads, read_whole};
