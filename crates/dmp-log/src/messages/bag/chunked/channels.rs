//! Which channel of a file carries what.

use super::framing::{Fields, Framing};
use super::ros1;
use crate::messages::bag::basics::Channel;
use mcap::records::op;
use std::collections::{BTreeMap, BTreeSet, btree_map::Entry};

/// The schemas and channels met so far.
#[derive(Debug, Clone, Default)]
pub(in crate::messages::bag) struct Channels {
    schema_names: BTreeMap<u32, String>,
    /// By schema, the channels that name it.
    of_schema: BTreeMap<u32, BTreeSet<u32>>,
    by_id: BTreeMap<u32, Described>,
    /// Messages of channels not described when they were met.
    unknown: BTreeMap<u32, u64>,
}

#[derive(Debug, Clone)]
struct Described {
    schema_id: u32,
    /// Its type follows when the schema is met.
    channel: Channel,
}

impl Channels {
    /// Takes in a schema, channel or connection. The first description of a number holds.
    pub(super) fn describe(&mut self, framing: Framing, opcode: u8, body: &[u8]) -> Result<(), String> {
        if framing == Framing::Ros1 {
            // Each has its own type.
            let (id, topic, message_type) = ros1::connection(body)?;
            self.schema(id, message_type)?;
            return self.channel(id, id, topic, "ros1");
        }
        let mut fields = Fields(body);
        match opcode {
            op::SCHEMA => {
                let (id, name) = (fields.u16("a schema's number")?.into(), fields.string("a schema's name")?);
                self.schema(id, name)
            }
            op::CHANNEL => {
                let id = fields.u16("a channel's number")?.into();
                let schema_id = fields.u16("a channel's schema")?.into();
                let topic = fields.string("a channel's topic")?;
                let encoding = fields.string("a channel's encoding")?;
                self.channel(id, schema_id, topic, encoding)
            }
            _ => Ok(()),
        }
    }

    fn schema(&mut self, id: u32, name: &str) -> Result<(), String> {
        match self.schema_names.entry(id) {
            Entry::Occupied(known) if known.get() == name => return Ok(()),
            Entry::Occupied(_) => return Err(format!("schema {id} is described twice, differently")),
            Entry::Vacant(place) => place.insert(name.to_owned()),
        };
        for channel in self.of_schema.get(&id).into_iter().flatten() {
            if let Some(described) = self.by_id.get_mut(channel) {
                name.clone_into(&mut described.channel.message_type);
            }
        }
        Ok(())
    }

    fn channel(&mut self, id: u32, schema_id: u32, topic: &str, encoding: &str) -> Result<(), String> {
        match self.by_id.entry(id) {
            Entry::Occupied(known) => {
                let Described { schema_id: known_schema, channel } = known.get();
                let again = Channel::new(topic, &channel.message_type, encoding);
                if (*known_schema, channel) != (schema_id, &again) {
                    return Err(format!("channel {id} is described twice, differently"));
                }
            }
            Entry::Vacant(place) => {
                let message_type = self.schema_names.get(&schema_id).map_or("", String::as_str);
                let channel = Channel::new(topic, message_type, encoding);
                place.insert(Described { schema_id, channel });
                self.of_schema.entry(schema_id).or_default().insert(id);
            }
        }
        Ok(())
    }

    pub(super) fn knows(&self, id: u32) -> bool {
        self.by_id.contains_key(&id)
    }

    pub(super) fn get(&self, id: u32) -> Option<&Channel> {
        self.by_id.get(&id).map(|described| &described.channel)
    }

    /// The channel of a message; one that is nowhere described so far is counted.
    pub(super) fn of_message(&mut self, id: u32) -> Option<&Channel> {
        if !self.knows(id) {
            *self.unknown.entry(id).or_default() += 1;
        }
        self.get(id)
    }

    /// Numbers of channels whose messages were met before any description.
    pub(super) fn unknown(&self) -> impl Iterator<Item = (u32, u64)> {
        self.unknown.iter().map(|(&id, &count)| (id, count))
    }

    pub(super) fn described(&self) -> Vec<Channel> {
        self.by_id.values().map(|described| described.channel.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &mut Vec<u8>, text: &str) {
        bytes.extend((text.len() as u32).to_le_bytes());
        bytes.extend(text.bytes());
    }

    fn schema(id: u16, name: &str) -> Vec<u8> {
        let mut body = id.to_le_bytes().to_vec();
        text(&mut body, name);
        body
    }

    fn channel(id: u16, schema_id: u16, topic: &str) -> Vec<u8> {
        let mut body = [id.to_le_bytes(), schema_id.to_le_bytes()].concat();
        text(&mut body, topic);
        text(&mut body, "cdr");
        body
    }

    #[test]
    fn types_are_found_in_any_order_and_the_first_description_holds() {
        let mut channels = Channels::default();
        channels.describe(Framing::Mcap, op::CHANNEL, &channel(1, 7, "/a")).unwrap();
        channels.describe(Framing::Mcap, op::SCHEMA, &schema(7, "Cloud")).unwrap();
        channels.describe(Framing::Mcap, op::CHANNEL, &channel(2, 7, "/b")).unwrap();
        channels.describe(Framing::Mcap, op::CHANNEL, &channel(1, 7, "/a")).unwrap();
        for (opcode, body) in [(op::CHANNEL, channel(1, 7, "/c")), (op::SCHEMA, schema(7, "Other"))] {
            assert!(
                channels.describe(Framing::Mcap, opcode, &body).unwrap_err().contains("twice, differently")
            );
        }
        for (id, topic) in [(1, "/a"), (2, "/b")] {
            let found = channels.of_message(id).unwrap();
            assert_eq!((found.topic.as_str(), found.message_type.as_str()), (topic, "Cloud"));
        }
        assert!(channels.of_message(3).is_none());
        assert_eq!(channels.unknown().collect::<Vec<_>>(), [(3, 1)]);
    }

    /// No memory is taken for a name before its bytes are there.
    #[test]
    fn claimed_lengths_are_checked() {
        let forged = [&[1, 0][..], &u32::MAX.to_le_bytes(), b"abc"].concat();
        let error = Channels::default().describe(Framing::Mcap, op::SCHEMA, &forged).unwrap_err();
        assert_eq!(error, "a schema's name claims 4294967295 bytes of 3");
        assert!(Channels::default().describe(Framing::Mcap, op::CHANNEL, &[1]).is_err());
    }

    /// Sixty thousand channels, each described many times: what they cost does not grow with their number.
    #[test]
    fn many_channels_of_one_schema_are_described() {
        let mut channels = Channels::default();
        for _ in 0..4 {
            for id in 0..60_000 {
                channels.describe(Framing::Mcap, op::CHANNEL, &channel(id, 7, "/a")).unwrap();
            }
        }
        channels.describe(Framing::Mcap, op::SCHEMA, &schema(7, "Cloud")).unwrap();
        assert!(channels.described().iter().all(|channel| channel.message_type == "Cloud"));
    }
}
