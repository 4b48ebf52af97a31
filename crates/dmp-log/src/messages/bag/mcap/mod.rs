//! Messages of an MCAP file.

mod ahead;
mod channels;
mod chunk;
mod heads;
mod message_index;
mod messages;
mod part;
mod pass;
mod records;
mod summary_hint;
mod whole;

pub(super) use channels::Channels;
pub(super) use message_index::Heads;
pub(super) use messages::McapMessages;
pub(super) use part::read_part;
pub(super) use records::{HEAD_BYTES, McapPlace, Record};
pub(super) use whole::{read_heads, read_whole};
