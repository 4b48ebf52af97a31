//! Some records of a file, whose places are known from a pass over its heads.

use super::channels::Channels;
use super::framing::Framing;
use super::pass::{Each, Pass};
use super::records::{Record, Source};
use crate::file::{DamageList, ReadCount};
use dmp_lengths::thousands;
use std::collections::BTreeSet;
use std::io;
use std::path::Path;

/// Reads these records and nothing else, each once, with the same checks as a pass over everything; `known`
/// are the channels of the whole file. Gives what is wrong in them, and where the records begin that give nothing.
pub(in crate::messages::bag) fn read_part(
    path: &Path,
    framing: Framing,
    count: &ReadCount,
    (known, file_bytes): (&Channels, u64),
    records: &[Record],
    each: &mut Each<'_>,
) -> io::Result<(DamageList, BTreeSet<u64>)> {
    let mut source = Source::open_for_pieces(path, framing, count)?;
    if source.length() != file_bytes {
        let [then, now] = [file_bytes, source.length()].map(thousands);
        let problem = format!("the file has changed since it was opened: {then} bytes then, {now} now");
        return Err(io::Error::other(problem));
    }
    let mut pass = Pass::new(framing, known.clone(), each);
    let mut unreadable = BTreeSet::new();
    for record in records {
        let is_whole = if record.is_chunk {
            pass.chunk(&mut source, record.at, record.body_bytes)?
        } else {
            pass.message(&mut source, record.at, record.body_bytes)?;
            true
        };
        if !is_whole {
            unreadable.insert(record.at);
        }
    }
    Ok((pass.damage, unreadable))
}
