//! Messages of a `SQLite` file as rosbag2 writes it (`.db3`): the tables `topics` and `messages`.

mod database;
mod messages;
mod pass;

pub(super) use database::{MAGIC, RowPlace};
pub(super) use messages::SqliteMessages;
pub(super) use pass::{read_heads, read_rows, read_whole};
