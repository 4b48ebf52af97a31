//! Damage to the rows of a rosbag2 database: other types, odd stamps, messages that make no sense.

use rusqlite::{Connection, types::Value};

use super::field::{NUMBERS, odd_number};
use super::{Random, bytes, cdr};

/// Statements that leave a database with other rows, tables or columns; views that never end.
const STATEMENTS: &str = "\
    DELETE FROM topics WHERE rowid = (SELECT max(rowid) FROM topics);\n\
    DELETE FROM messages WHERE rowid = (SELECT min(rowid) FROM messages);\n\
    DELETE FROM messages;\n\
    INSERT INTO messages (topic_id, timestamp, data) SELECT topic_id, timestamp, data FROM messages;\n\
    UPDATE messages SET timestamp = timestamp % 7;\n\
    UPDATE messages SET topic_id = topic_id + 1;\n\
    INSERT INTO messages (topic_id, timestamp, data) SELECT topic_id, timestamp, zeroblob(99999999) FROM messages LIMIT 1;\n\
    DROP TABLE topics;\n\
    DROP TABLE messages;\n\
    ALTER TABLE messages RENAME COLUMN data TO old;\n\
    ALTER TABLE messages RENAME TO old; CREATE VIEW messages AS SELECT * FROM old, topics, old AS o;\n\
    ALTER TABLE topics RENAME TO t; CREATE VIEW topics AS WITH RECURSIVE r(id) AS \
    (SELECT 1 UNION ALL SELECT id + 1 FROM r) SELECT r.id, name, type, serialization_format FROM r, t;";

/// One damage; `None` where the file is no database with these tables.
pub(super) fn damage(file: &mut Vec<u8>, random: &mut Random) -> Option<()> {
    let place = tempfile::NamedTempFile::new().ok()?;
    std::fs::write(place.path(), &file).ok()?;
    let base = Connection::open(place.path()).ok()?;
    base.execute_batch("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;").ok()?;
    // Views that never end are for the reader to meet, not for what is written here.
    let views = "SELECT count(*) FROM sqlite_master WHERE type = 'view'";
    if base.query_row(views, [], |row| row.get::<_, i64>(0)).ok()? > 0 {
        return None;
    }
    match random.below(8) {
        0..=3 => damage_message(&base, random)?,
        4 => set_any(&base, "messages", "timestamp topic_id id data", random)?,
        5 => set_any(&base, "topics", "name type serialization_format id", random)?,
        _ => {
            let statements: Vec<&str> = STATEMENTS.lines().collect();
            base.execute_batch(statements[random.below(statements.len())]).ok()?;
        }
    }
    base.close().ok()?;
    *file = std::fs::read(place.path()).ok()?;
    Some(())
}

fn damage_message(base: &Connection, random: &mut Random) -> Option<()> {
    let rows: i64 = base.query_row("SELECT count(*) FROM messages", [], |row| row.get(0)).ok()?;
    let skip = random.below(rows as usize) as i64;
    let find = "SELECT rowid, data FROM messages LIMIT 1 OFFSET ?1";
    let row = |row: &rusqlite::Row<'_>| Ok((row.get::<_, i64>(0)?, row.get::<_, Vec<u8>>(1)?));
    let (id, mut data) = base.query_row(find, [skip], row).ok()?;
    if random.once_in(4) {
        bytes::damage(&mut data, b"", random);
    } else {
        cdr::damage(&mut data, random);
    }
    base.execute("UPDATE messages SET data = ?1 WHERE rowid = ?2", (data, id)).ok().map(drop)
}

/// Any value, of any type, in a column of one row or of all.
fn set_any(base: &Connection, table: &str, columns: &str, random: &mut Random) -> Option<()> {
    let value = match random.below(6) {
        0 => Value::Null,
        1 => Value::Real(random.word(NUMBERS).parse().unwrap_or(-1.5)),
        2 => {
            let texts = ["", "\u{1b}[2J", "sensor_msgs/msg/PointCloud2", "cdr", "x\ny"];
            Value::Text(random.pick(&texts).to_string())
        }
        3 => Value::Text("a".repeat(100_000)),
        4 => Value::Blob(vec![0xff; random.below(50)]),
        _ => Value::Integer(odd_number(random) as i64),
    };
    let which = *random.pick(&["", " WHERE rowid = (SELECT min(rowid) FROM %)"]);
    let line = format!("UPDATE {table} SET {} = ?1{}", random.word(columns), which.replace('%', table));
    base.execute(&line, [value]).ok().map(drop)
}
