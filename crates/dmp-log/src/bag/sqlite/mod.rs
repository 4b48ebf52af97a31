//! Messages of a `SQLite` file as rosbag2 writes it (`.db3`): the tables `topics` and `messages`.

mod database;
mod messages;
mod walk;

pub(super) use database::{MAGIC, RowPlace};
pub(super) use messages::SqliteMessages;
pub(super) use walk::{walk, walk_heads, walk_rows};
