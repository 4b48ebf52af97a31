//! Which channel of an MCAP file carries what.

use super::chunk::one_line;
use crate::bag::Channel;
use mcap::records::{Record, op};
use std::collections::{BTreeMap, btree_map::Entry};

/// The schemas and channels met so far.
#[derive(Debug, Default)]
pub(super) struct Channels {
    schema_names: BTreeMap<u16, String>,
    described: BTreeMap<u16, Described>,
    by_id: BTreeMap<u16, Channel>,
    /// Messages of channels not described when they were met.
    unknown: BTreeMap<u16, u64>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Described {
    topic: String,
    encoding: String,
    schema_id: u16,
}

impl Channels {
    /// Takes in a schema or channel record. The first description of a number holds.
    pub(super) fn describe(&mut self, opcode: u8, body: &[u8]) -> Result<(), String> {
        let record = mcap::parse_record(opcode, body).map_err(|e| one_line(&e.to_string()))?;
        match record {
            Record::Schema { header, .. } => insert(&mut self.schema_names, header.id, header.name)
                .map_err(|id| format!("schema {id} is described twice, differently"))?,
            Record::Channel(channel) => {
                let (id, topic) = (channel.id, channel.topic);
                let described =
                    Described { topic, encoding: channel.message_encoding, schema_id: channel.schema_id };
                insert(&mut self.described, id, described)
                    .map_err(|id| format!("channel {id} is described twice, differently"))?;
            }
            _ => return Ok(()),
        }
        let resolved = self.described.iter().map(|(&id, described)| {
            let name = self.schema_names.get(&described.schema_id).cloned().unwrap_or_default();
            let (topic, encoding) = (described.topic.clone(), described.encoding.clone());
            (id, Channel { topic, message_type: name, encoding })
        });
        self.by_id = resolved.collect();
        Ok(())
    }

    pub(super) fn is_description(opcode: u8) -> bool {
        matches!(opcode, op::SCHEMA | op::CHANNEL)
    }

    /// The channel of a message; one that is nowhere described so far is counted.
    pub(super) fn of_message(&mut self, id: u16) -> Option<&Channel> {
        if !self.by_id.contains_key(&id) {
            *self.unknown.entry(id).or_default() += 1;
        }
        self.by_id.get(&id)
    }

    /// Numbers of channels whose messages were met before any description.
    pub(super) fn unknown(&self) -> impl Iterator<Item = (u16, u64)> {
        self.unknown.iter().map(|(&id, &count)| (id, count))
    }

    pub(super) fn into_channels(self) -> Vec<Channel> {
        self.by_id.into_values().collect()
    }
}

fn insert<T: PartialEq>(map: &mut BTreeMap<u16, T>, id: u16, value: T) -> Result<(), u16> {
    match map.entry(id) {
        Entry::Vacant(place) => {
            place.insert(value);
            Ok(())
        }
        Entry::Occupied(known) if *known.get() == value => Ok(()),
        Entry::Occupied(_) => Err(id),
    }
}
