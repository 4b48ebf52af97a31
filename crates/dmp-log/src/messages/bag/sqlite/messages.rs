//! Single messages of a `SQLite` file.

use super::database::open;
use crate::file::shorten;
use crate::messages::bag::basics::MessageFault;
use rusqlite::Connection;
use rusqlite::types::ValueRef;
use std::io;
use std::path::Path;

#[derive(Debug)]
pub(in crate::messages::bag) struct SqliteMessages {
    connection: Connection,
    message: Vec<u8>,
}

impl SqliteMessages {
    pub(in crate::messages::bag) fn open(path: &Path) -> io::Result<Self> {
        Ok(Self { connection: open(path)?, message: Vec::new() })
    }

    pub(in crate::messages::bag) fn message(&mut self, row: i64) -> Result<&[u8], MessageFault> {
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
