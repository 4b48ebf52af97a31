//! Opening a `SQLite` file of rosbag2: nothing in it is run, and only plain tables are read.

use crate::file::shorten;
use crate::messages::bag::basics::{Channel, MAX_MESSAGE_BYTES};
use dmp_disk::open_input;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension as _};
use std::collections::BTreeMap;
use std::io::{self, Read as _};
use std::path::Path;

/// The first bytes of every `SQLite` 3 file.
pub(in crate::messages::bag) const MAGIC: &[u8] = b"SQLite format 3\0";

/// Where a message is in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::messages::bag) struct RowPlace {
    pub(in crate::messages::bag) row: i64,
    pub(in crate::messages::bag) bytes: u64,
}

/// Opens a bag; what each of its topics is, by number.
pub(super) fn open_bag(path: &Path) -> io::Result<(Connection, BTreeMap<i64, Channel>)> {
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
        let text = |column: usize| row.get::<_, String>(column);
        Ok((row.get(0)?, Channel::new(&text(1)?, &text(2)?, &text(3)?)))
    };
    let channels = statement.query_map([], channel)?;
    channels.collect()
}

/// Opens a file for reading alone; it is not written to, nor is anything beside it.
pub(super) fn open(path: &Path) -> io::Result<Connection> {
    // Says what is missing better than the library does.
    open_input(path)?;
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    // Without a journal nobody is writing, and the file needs no locks and no folder that can be written to.
    let [log, journal, _] =
        [is_beside(path, "-wal")?, is_beside(path, "-journal")?, is_beside(path, "-shm")?];
    let connection = if log && !journal {
        // What was not yet taken over from the log beside it is read with it. Nobody else may write meanwhile, so that its index
        // is held in memory and needs no file.
        Connection::open_with_flags_and_vfs(path, flags, WITHOUT_LOCKS).and_then(|connection| {
            connection.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
            connection.execute_batch("PRAGMA locking_mode = EXCLUSIVE;")?;
            Ok(connection)
        })
    } else if journal {
        Connection::open_with_flags(path, flags)
    } else {
        let uri = format!("file:{}?immutable=1", percent_encoded(path));
        Connection::open_with_flags(uri, flags | OpenFlags::SQLITE_OPEN_URI)
    };
    let connection = connection.map_err(to_io)?;
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_MESSAGE_BYTES as i32).map_err(to_io)?;
    if bytes_cut_off(path)? > 0 {
        refuse_cut_page(path)?;
        // Else the library refuses a file that is shorter than its head says, whatever is whole in it.
        connection.execute_batch("PRAGMA writable_schema = ON;").map_err(to_io)?;
    }
    // Nothing in the file is to be run, and its cells are checked before they are used.
    let settings = "PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0; \
                    PRAGMA query_only = ON; PRAGMA cache_size = -2048;";
    connection.execute_batch(settings).map_err(to_io)?;
    Ok(connection)
}

/// The files of Unix without locks: they are only read, and an exclusive lock needs a file that can be written to.
#[cfg(unix)]
const WITHOUT_LOCKS: &std::ffi::CStr = c"unix-none";
#[cfg(not(unix))]
const WITHOUT_LOCKS: &std::ffi::CStr = c"win32-none";

/// Of a page that is cut the library reads zeros for what is missing, as if they were part of a message.
fn refuse_cut_page(path: &Path) -> io::Result<()> {
    let (bytes, Some([page_bytes, _])) = (path.metadata()?.len(), pages(path)?) else { return Ok(()) };
    if bytes.is_multiple_of(page_bytes) {
        return Ok(());
    }
    let whole = bytes - bytes % page_bytes;
    Err(io::Error::other(format!(
        "as a rosbag2 file: it is cut short within a page: `truncate -s {whole} FILE.db3` on a copy leaves the whole pages, whose \
         messages are read"
    )))
}

/// How many bytes a file lacks of those that its head promises.
pub(super) fn bytes_cut_off(path: &Path) -> io::Result<u64> {
    let promised = pages(path)?.map_or(0, |[page_bytes, pages]| page_bytes * pages);
    Ok(promised.saturating_sub(path.metadata()?.len()))
}

/// The bytes of a page, and the number of pages, as the head of a file has them.
fn pages(path: &Path) -> io::Result<Option<[u64; 2]>> {
    let mut head = Vec::new();
    open_input(path)?.take(100).read_to_end(&mut head)?;
    let (Some(page), Some(pages)) = (
        head.get(16..).and_then(|rest| rest.first_chunk::<2>()),
        head.get(28..).and_then(|rest| rest.first_chunk::<4>()),
    ) else {
        return Ok(None);
    };
    // A page of 65,536 bytes is written as 1.
    let page_bytes = match u16::from_be_bytes(*page) {
        1 => 1 << 16,
        bytes => u64::from(bytes),
    };
    Ok((page_bytes > 0).then(|| [page_bytes, u32::from_be_bytes(*pages).into()]))
}

/// Whether there is a file of the same name and this ending. At a pipe the library would wait.
fn is_beside(path: &Path, ending: &str) -> io::Result<bool> {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    match std::fs::metadata(&name) {
        Ok(found) if found.is_file() => Ok(true),
        Ok(_) => Err(io::Error::other(format!("`{}`, which belongs to it, is no file", name.display()))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
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
pub(super) fn to_io(error: rusqlite::Error) -> io::Error {
    let is_cut = error.sqlite_error_code() == Some(ErrorCode::DatabaseCorrupt);
    let remedy = if is_cut {
        ": is it cut short? `sqlite3 FILE.db3 .recover | sqlite3 WHOLE.db3` saves what is whole"
    } else {
        ""
    };
    io::Error::other(format!("as a rosbag2 file: {}{remedy}", shorten(&error.to_string())))
}
