//! Messages of a `SQLite` file as rosbag2 writes it (`.db3`): the tables `topics` and `messages`.

mod walk;

use super::{Channel, MAX_MESSAGE_BYTES, MessageFault};
use crate::decimal::shorten;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags, OptionalExtension as _};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

pub(super) use walk::{walk, walk_heads, walk_rows};

/// The first bytes of every `SQLite` 3 file.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";
/// Where a message is in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RowPlace {
    /// The row of the table.
    pub(super) row: i64,
    /// Bytes of the message.
    pub(super) bytes: u64,
}

/// Opens a bag; what each of its topics is, by number.
fn open_bag(path: &Path) -> io::Result<(Connection, BTreeMap<i64, Channel>)> {
    let connection = open(path)?;
    if let Some(problem) = wrong_table(&connection).map_err(to_io)? {
        return Err(io::Error::other(problem));
    }
    let channels = channels_of(&connection).map_err(to_io)?;
    Ok((connection, channels))
}

/// Says what makes rows as it is read: a view may have rows without an end, a computed column bytes
/// without an end. rosbag2 writes plain tables.
fn wrong_table(connection: &Connection) -> rusqlite::Result<Option<String>> {
    for table in ["topics", "messages"] {
        let has_pages = "SELECT rootpage > 0 AND type = 'table' FROM sqlite_schema WHERE name = ?1";
        let is_stored: Option<bool> =
            connection.query_row(has_pages, [table], |row| row.get(0)).optional()?;
        let computed = "SELECT count(*) FROM pragma_table_xinfo(?1) WHERE hidden <> 0";
        let computed: i64 = connection.query_row(computed, [table], |row| row.get(0))?;
        if is_stored != Some(true) || computed > 0 {
            return Ok(Some(format!("as a rosbag2 file: `{table}` is no plain table")));
        }
    }
    Ok(None)
}

fn channels_of(connection: &Connection) -> rusqlite::Result<BTreeMap<i64, Channel>> {
    let mut statement = connection.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let channel = |row: &rusqlite::Row<'_>| {
        Ok((row.get(0)?, Channel { topic: row.get(1)?, message_type: row.get(2)?, encoding: row.get(3)? }))
    };
    let channels = statement.query_map([], channel)?;
    channels.collect()
}

/// Opens a file for reading alone; it is not written to, nor is anything beside it.
fn open(path: &Path) -> io::Result<Connection> {
    // Says what is missing better than the library does.
    std::fs::File::open(path)?;
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let beside = |suffix: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        Path::new(&name).exists()
    };
    // Without a journal nobody is writing, and the file needs no locks and no folder that can be written to.
    let connection = if beside("-wal") || beside("-journal") {
        Connection::open_with_flags(path, flags)
    } else {
        let uri = format!("file:{}?immutable=1", percent_encoded(path));
        Connection::open_with_flags(uri, flags | OpenFlags::SQLITE_OPEN_URI)
    };
    let connection = connection.map_err(to_io)?;
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_MESSAGE_BYTES as i32).map_err(to_io)?;
    // Nothing in the file is to be run, and its cells are checked before they are used.
    let settings = "PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0; \
                    PRAGMA query_only = ON; PRAGMA cache_size = -2048;";
    connection.execute_batch(settings).map_err(to_io)?;
    Ok(connection)
}

/// A path as a URI has it.
fn percent_encoded(path: &Path) -> String {
    let encode = |byte: &u8| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'_' | b'-' => char::from(*byte).to_string(),
        other => format!("%{other:02X}"),
    };
    path.as_os_str().as_encoded_bytes().iter().map(encode).collect()
}

#[expect(clippy::needless_pass_by_value, reason = "for map_err")]
fn to_io(error: rusqlite::Error) -> io::Error {
    io::Error::other(format!("as a rosbag2 file: {}", shorten(&error.to_string())))
}

/// Reads single messages of a file.
#[derive(Debug)]
pub(super) struct SqliteMessages {
    connection: Connection,
    message: Vec<u8>,
}

impl SqliteMessages {
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        Ok(Self { connection: open(path)?, message: Vec::new() })
    }

    pub(super) fn message(&mut self, row: i64) -> Result<&[u8], MessageFault> {
        let changed = |problem: String| MessageFault::Changed(format!("row {row}: {problem}"));
        let mut statement = self
            .connection
            .prepare("SELECT data FROM messages WHERE id = ?1")
            .map_err(|e| changed(shorten(&e.to_string())))?;
        let message = &mut self.message;
        message.clear();
        let copied = statement.query_row([row], |row| {
            let ValueRef::Blob(body) = row.get_ref(0)? else { return Ok(false) };
            message.extend_from_slice(body);
            Ok(true)
        });
        match copied {
            Ok(true) => Ok(&self.message),
            Ok(false) => Err(changed("was bytes when the log was opened and is not any more".into())),
            Err(error) => Err(changed(shorten(&error.to_string()))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::FileWalked;

    fn walk_of(schema: &str) -> io::Result<FileWalked> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.db3");
        Connection::open(&path).unwrap().execute_batch(schema).unwrap();
        walk(&path, &mut |_, _, _, body| assert!(body.len() < 10))
    }

    #[test]
    fn only_plain_tables_are_read() {
        let topics =
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
                      INSERT INTO topics VALUES(1, '/points', 'sensor_msgs/msg/PointCloud2', 'cdr');";
        let plain =
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
                     INSERT INTO messages VALUES(1, 1, 5, x'0001');";
        assert!(walk_of(&format!("{topics}{plain}")).unwrap().damage.into_vec().is_empty());
        // Rows without an end, and bytes out of nothing.
        let endless =
            "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n)
                       SELECT id, 1 AS topic_id, 5 AS timestamp, x'00' AS data FROM n;";
        let computed = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
                        data BLOB GENERATED ALWAYS AS (zeroblob(200000000)));
                        INSERT INTO messages(topic_id, timestamp) VALUES(1, 5);";
        for messages in [endless, computed, ""] {
            let error = walk_of(&format!("{topics}{messages}")).unwrap_err().to_string();
            assert!(error.contains("`messages` is no plain table"), "{error}");
        }
    }
}
