//! Stores of messages by topic: MCAP files, bags of ROS 1, rosbag2's `SQLite` files, and bags of several such files.
//!
//! What the messages are is not known here; [`crate::messages::ros`] knows.

mod basics;
mod chunked;
mod indexed;
mod location;
mod part;
mod reader;
mod rosbag2;
mod sqlite;
mod store;
mod topics;

pub(crate) use basics::Channel;
pub(crate) use indexed::{IndexedBag, IndexedPlace};
pub(crate) use location::Location;
pub(crate) use part::BagIndex;
pub(crate) use reader::BagReader;
pub(crate) use store::{Bag, BagFound, Message};
pub(crate) use topics::in_words;
