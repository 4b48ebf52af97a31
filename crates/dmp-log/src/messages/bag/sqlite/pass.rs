//! Passes over the rows of a file: over all of them, with their messages or without, and over some.

use super::database::{RowPlace, bytes_cut_off, open_bag, to_io};
use crate::Damage;
use crate::file::{DamageList, shorten};
use crate::messages::bag::basics::{Channel, FileFound};
use dmp_lengths::thousands;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;

/// How often reading goes on behind a place that cannot be read.
const MAX_HOLES: usize = 64;

/// What is done with a message: its channel, the time it was recorded, its place, its body, which is empty
/// where only heads are read.
type Each<'a> = dyn FnMut(&Channel, u64, RowPlace, &[u8]) + 'a;

/// The columns that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Columns {
    All,
    /// The length of a message is in the head of its row: for it the message is not read.
    Heads,
}

impl Columns {
    fn select(self) -> &'static str {
        match self {
            Self::All => "SELECT id, topic_id, timestamp, data FROM messages WHERE id >= ?1 ORDER BY id",
            Self::Heads => {
                "SELECT id, topic_id, timestamp, CASE typeof(data) WHEN 'blob' THEN length(data) END \
                 FROM messages WHERE id >= ?1 ORDER BY id"
            }
        }
    }
}

/// Reads the messages in the order of their rows. What cannot be read is damage; a file that is no bag at
/// all is an error.
pub(in crate::messages::bag) fn read_whole(path: &Path, each: &mut Each<'_>) -> io::Result<FileFound> {
    read_columns(path, Columns::All, each)
}

/// The same without the messages' bodies.
pub(in crate::messages::bag) fn read_heads(path: &Path, each: &mut Each<'_>) -> io::Result<FileFound> {
    read_columns(path, Columns::Heads, each)
}

/// Reads these rows. Gives what is wrong with them, and those that give nothing.
pub(in crate::messages::bag) fn read_rows(
    path: &Path,
    rows: &[i64],
    each: &mut Each<'_>,
) -> io::Result<(DamageList, BTreeSet<i64>)> {
    let (connection, channels) = open_bag(path)?;
    let mut pass = Pass::new(channels, Columns::All, each);
    let mut unreadable = BTreeSet::new();
    let one = "SELECT id, topic_id, timestamp, data FROM messages WHERE id = ?1";
    let mut statement = connection.prepare(one).map_err(to_io)?;
    for &row in rows {
        let read = statement.query_row([row], |row| pass.row(row));
        // For the place of what is lost.
        pass.next = row;
        match read {
            Ok(true) => continue,
            Ok(false) => {}
            Err(rusqlite::Error::QueryReturnedNoRows) => {
                pass.lost("it was there when the file was opened and is not found by its number".to_owned());
            }
            Err(error) => pass.lost(format!("{}: its message is lost", shorten(&error.to_string()))),
        }
        unreadable.insert(row);
    }
    Ok((pass.damage, unreadable))
}

fn read_columns(path: &Path, columns: Columns, each: &mut Each<'_>) -> io::Result<FileFound> {
    let (connection, channels) = open_bag(path)?;
    let mut found = FileFound {
        channels: channels.values().cloned().collect(),
        bytes: path.metadata()?.len(),
        ..FileFound::default()
    };
    let mut pass = Pass::new(channels, columns, each);
    let (mut holes, mut step, mut last_lost) = (0, 1, None);
    let cut_bytes = bytes_cut_off(path)?;
    if cut_bytes > 0 {
        let what = format!("the file is cut short: {} bytes of it are missing", thousands(cut_bytes));
        pass.damage.push(Damage::new(format!("byte {}", found.bytes), what));
    }
    loop {
        let before = pass.next;
        match pass.messages(&connection) {
            Ok(()) => break,
            Err(error) if holes == MAX_HOLES || before == i64::MAX => {
                if last_lost == Some(before) {
                    break;
                }
                pass.lost(format!("{}: what follows is lost", shorten(&error.to_string())));
                break;
            }
            Err(error) => {
                if pass.next != before {
                    step = 1;
                }
                // Of a hole that is jumped over in several steps only the beginning is named.
                if last_lost != Some(before) {
                    pass.lost(format!("{}: messages from here are lost", shorten(&error.to_string())));
                }
                let from =
                    if pass.next == i64::MIN { first_row(&connection).unwrap_or(0) } else { pass.next };
                pass.next = from.saturating_add(step);
                last_lost = Some(pass.next);
                step = step.saturating_mul(2);
                holes += 1;
            }
        }
    }
    for (id, count) in std::mem::take(&mut pass.unknown) {
        let what = format!("{} messages of a topic that is nowhere described are lost", thousands(count));
        pass.damage.push(Damage::new(format!("topic {id}"), what));
    }
    found.damage = pass.damage;
    Ok(found)
}

struct Pass<'a, 'b> {
    channels: BTreeMap<i64, Channel>,
    columns: Columns,
    /// The row from which to read.
    next: i64,
    unknown: BTreeMap<i64, u64>,
    damage: DamageList,
    each: &'a mut Each<'b>,
}

impl<'a, 'b> Pass<'a, 'b> {
    fn new(channels: BTreeMap<i64, Channel>, columns: Columns, each: &'a mut Each<'b>) -> Self {
        let (unknown, damage) = (BTreeMap::new(), DamageList::default());
        Self { channels, columns, next: i64::MIN, unknown, damage, each }
    }
}

impl Pass<'_, '_> {
    fn messages(&mut self, connection: &Connection) -> rusqlite::Result<()> {
        let mut statement = connection.prepare(self.columns.select())?;
        let mut rows = statement.query([self.next])?;
        while let Some(row) = rows.next()? {
            self.row(row)?;
        }
        Ok(())
    }

    /// Hands over a row's message; whether there is one.
    fn row(&mut self, row: &Row<'_>) -> rusqlite::Result<bool> {
        let id: i64 = row.get(0)?;
        self.next = id.saturating_add(1);
        let no_message = |pass: &mut Self| {
            let what = "a row that is no topic, time and bytes is lost".to_owned();
            pass.damage.push(Damage::new(format!("row {id}"), what));
            Ok(false)
        };
        let (ValueRef::Integer(topic), ValueRef::Integer(time_ns)) = (row.get_ref(1)?, row.get_ref(2)?)
        else {
            return no_message(self);
        };
        let (bytes, body) = match (self.columns, row.get_ref(3)?) {
            (Columns::All, ValueRef::Blob(body)) => (body.len() as u64, body),
            (Columns::Heads, ValueRef::Integer(bytes)) => (bytes.max(0).cast_unsigned(), [].as_slice()),
            _ => return no_message(self),
        };
        let place = RowPlace { row: id, bytes };
        match self.channels.get(&topic) {
            Some(channel) => (self.each)(channel, time_ns.max(0).cast_unsigned(), place, body),
            None => *self.unknown.entry(topic).or_default() += 1,
        }
        Ok(true)
    }

    fn lost(&mut self, what: String) {
        let place =
            if self.next == i64::MIN { "the first row".to_owned() } else { format!("row {}", self.next) };
        self.damage.push(Damage::new(place, what));
    }
}

fn first_row(connection: &Connection) -> rusqlite::Result<i64> {
    connection.query_row("SELECT min(id) FROM messages", [], |row| row.get(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_of(schema: &str) -> io::Result<FileFound> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.db3");
        Connection::open(&path).unwrap().execute_batch(schema).unwrap();
        read_whole(&path, &mut |_, _, _, body| assert!(body.len() < 10))
    }

    #[test]
    fn only_plain_tables_are_read() {
        let topics =
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
                      INSERT INTO topics VALUES(1, '/points', 'sensor_msgs/msg/PointCloud2', 'cdr');";
        let plain =
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
                     INSERT INTO messages VALUES(1, 1, 5, x'0001');";
        assert!(read_of(&format!("{topics}{plain}")).unwrap().damage.into_vec().is_empty());
        // Rows without an end, and bytes out of nothing.
        let endless =
            "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n)
                       SELECT id, 1 AS topic_id, 5 AS timestamp, x'00' AS data FROM n;";
        let computed = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
                        data BLOB GENERATED ALWAYS AS (zeroblob(200000000)));
                        INSERT INTO messages(topic_id, timestamp) VALUES(1, 5);";
        for messages in [endless, computed, ""] {
            let error = read_of(&format!("{topics}{messages}")).unwrap_err().to_string();
            assert!(error.contains("`messages` is no plain table"), "{error}");
        }
    }
}
