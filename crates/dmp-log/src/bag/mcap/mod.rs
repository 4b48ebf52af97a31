//! Messages of an MCAP file.

mod channels;
mod chunk;
mod heads;
mod message_index;
mod messages;
mod part;
mod pass;
mod place;
mod records;
mod summary_hint;
mod walk;

pub(super) use channels::Channels;
pub(super) use messages::McapMessages;
pub(super) use part::walk_part;
pub(super) use pass::{walk, walk_heads};
pub(super) use place::{McapPlace, Record};
