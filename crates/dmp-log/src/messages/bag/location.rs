//! Where a message of a bag is.

use super::chunked::{Record, RecordPlace};
use super::sqlite::RowPlace;
use std::cmp::Ordering;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Location {
    /// The file of the bag.
    pub(super) file: u32,
    pub(super) within: Within,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Within {
    Record(RecordPlace),
    Sqlite(RowPlace),
}

impl Location {
    /// For messages: `byte 4711` or `row 12`.
    pub(crate) fn in_words(&self) -> String {
        match self.within {
            Within::Record(place) => format!("byte {}", place.record_at),
            Within::Sqlite(place) => format!("row {}", place.row),
        }
    }

    /// In the order of the bag: the file, the record in it, the place in that record.
    fn order(&self) -> (u32, i64, u64) {
        match self.within {
            // No file has 2⁶³ bytes.
            Within::Record(place) => (self.file, place.record_at.cast_signed(), place.in_chunk.unwrap_or(0)),
            Within::Sqlite(place) => (self.file, place.row, 0),
        }
    }

    /// The order of two messages of a bag; equal is the same message.
    pub(crate) fn compare(&self, other: &Self) -> Ordering {
        self.order().cmp(&other.order())
    }

    /// What has to be read for the message: its file, and the chunk, message or row in it.
    pub(crate) fn record(&self) -> (u32, i64) {
        let (file, record, _) = self.order();
        (file, record)
    }

    /// The same where the file is one of records.
    pub(super) fn chunked_record(&self) -> Option<Record> {
        match self.within {
            Within::Record(place) => Some(Record::of(place)),
            Within::Sqlite(_) => None,
        }
    }

    pub(crate) fn record_bytes(&self) -> u64 {
        match self.within {
            Within::Record(place) => place.record_bytes,
            Within::Sqlite(place) => place.bytes,
        }
    }

    /// Whether two messages are unpacked together.
    pub(crate) fn shares_chunk(&self, other: &Self) -> bool {
        match (self.within, other.within) {
            (Within::Record(a), Within::Record(b)) => {
                self.file == other.file && a.in_chunk.is_some() && a.record_at == b.record_at
            }
            _ => false,
        }
    }

    /// Whether the message is one of several packed into a chunk.
    pub(crate) fn is_in_chunk(&self) -> bool {
        matches!(self.within, Within::Record(place) if place.in_chunk.is_some())
    }
}
