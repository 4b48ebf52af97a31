//! Parts of a bag: which messages it has by its indexes, and some of them read.

use super::basics::Channel;
use super::chunked::{Framing, Heads};
use super::location::{Location, Within};
use super::store::{Bag, BagFound, Message};
use super::{chunked, sqlite};
use crate::LogError;
use crate::file::DamageList;
use dmp_lengths::thousands;
use std::collections::BTreeSet;
use std::io;

/// What is known of a bag of which hardly a message was read.
#[derive(Debug)]
pub(crate) struct BagIndex {
    /// The damage is that outside what can be read later.
    pub(crate) bag_found: BagFound,
    /// What is not known without reading.
    pub(crate) notes: Vec<String>,
    /// By file, what its records are read with.
    known: Vec<Known>,
}

#[derive(Debug)]
enum Known {
    Chunked { framing: Framing, channels: chunked::Channels, bytes: u64 },
    Sqlite,
}

/// What a pass over a part of a bag finds beside the messages.
#[derive(Debug, Default)]
pub(crate) struct PartFound {
    pub(crate) damage: DamageList,
    unreadable: BTreeSet<(u32, i64)>,
}

impl PartFound {
    /// Whether what a message lies in could not be read, which the damage names.
    pub(crate) fn has_lost(&self, location: &Location) -> bool {
        self.unreadable.contains(&location.record())
    }
}

impl Bag {
    /// Hands over what is known of every message without its body: channel, time it was recorded, place.
    pub(crate) fn index(&self, each: &mut dyn FnMut(&Channel, u64, Location)) -> Result<BagIndex, LogError> {
        let mut known = Vec::new();
        // As in the notes below: chunks without an index, chunks learnt from, messages outside chunks, messages in no index.
        let mut counts = [0; 4];
        let bag_found = self.each_file(&mut |file, path, kind, topics| {
            let mut take = |channel: &Channel, log_time_ns: u64, within: Within| {
                topics.count(channel, log_time_ns);
                each(channel, log_time_ns, Location { file, within });
            };
            let Some(framing) = kind.framing() else {
                known.push(Known::Sqlite);
                return sqlite::read_heads(path, &mut |channel, time, place, _| {
                    take(channel, time, Within::Sqlite(place));
                });
            };
            let heads = chunked::read_heads(path, framing, &self.count, &mut |channel, time, place, _| {
                take(channel, time, Within::Record(place));
            })?;
            let Heads { unindexed_chunks, learnt_chunks, loose_messages, unnamed_messages, .. } = heads.heads;
            let more = [unindexed_chunks, learnt_chunks, loose_messages, unnamed_messages];
            counts.iter_mut().zip(more).for_each(|(count, more)| *count += more);
            known.push(Known::Chunked { framing, channels: heads.channels, bytes: heads.found.bytes });
            Ok(heads.found)
        })?;
        let notes = [
            "chunks have no message index and were read to find their scans: `mcap recover IN.mcap -o OUT.mcap`, or of ROS 1 `rosbag reindex IN.bag`, writes a file that has them",
            "chunks were read to learn what is in them: there is no summary",
            "messages lie outside chunks, without a checksum of their own: that of all data is compared only where the whole log is read",
            "messages that the summary counts are in no index: what they are shows only where the whole log is read",
        ];
        let notes = counts.iter().zip(notes).filter(|(count, _)| **count > 0);
        let notes = notes.map(|(&count, note)| format!("{} {note}", thousands(count))).collect();
        Ok(BagIndex { bag_found, notes, known })
    }

    /// Reads what the messages at these places lie in, each once and nothing else, and hands over every message
    /// that is met there. `wanted` is in the order of the bag.
    pub(crate) fn read_part(
        &self,
        index: &BagIndex,
        wanted: &[Location],
        each: &mut dyn FnMut(Message<'_>),
    ) -> Result<PartFound, LogError> {
        let mut part = PartFound::default();
        for of_file in wanted.chunk_by(|a, b| a.file == b.file) {
            let Some(file) = of_file.first().map(|first| first.file) else { continue };
            let Some(((path, _), known)) = self.files.get(file as usize).zip(index.known.get(file as usize))
            else {
                continue;
            };
            let mut take = |channel: &Channel, log_time_ns: u64, within: Within, body: &[u8]| {
                each(Message { channel, location: Location { file, within }, log_time_ns, body });
            };
            let found = match known {
                Known::Chunked { framing, channels, bytes } => {
                    let mut records: Vec<_> = of_file.iter().filter_map(Location::chunked_record).collect();
                    records.dedup();
                    let mut take = |channel: &Channel, time, place, body: &[u8]| {
                        take(channel, time, Within::Record(place), body);
                    };
                    chunked::read_part(path, *framing, &self.count, (channels, *bytes), &records, &mut take)
                        .map(|(damage, at)| (damage, at.into_iter().map(u64::cast_signed).collect()))
                }
                Known::Sqlite => {
                    let rows: Vec<_> = of_file.iter().map(|location| location.record().1).collect();
                    sqlite::read_rows(path, &rows, &mut |channel, time, place, body| {
                        take(channel, time, Within::Sqlite(place), body);
                    })
                }
            };
            let found: io::Result<(DamageList, BTreeSet<i64>)> = found;
            let (damage, unreadable) = found.map_err(|e| LogError::io(path, "read", e))?;
            part.damage.append(damage, |lost| self.in_file(path, lost));
            part.unreadable.extend(unreadable.into_iter().map(|record| (file, record)));
        }
        Ok(part)
    }
}
