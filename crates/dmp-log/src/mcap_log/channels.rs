//! Which channel of an MCAP file carries what.

use super::chunk::one_line;
use crate::TopicInfo;
use mcap::records::{Record, op};
use std::collections::{BTreeMap, btree_map::Entry};

/// The type of message that is read.
const CLOUD: [&str; 2] = ["sensor_msgs/msg/PointCloud2", "sensor_msgs/PointCloud2"];

/// A channel: its topic, and what its messages are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Channel {
    pub(super) topic: String,
    pub(super) encoding: String,
    schema_id: u16,
}

/// The schemas and channels met so far.
#[derive(Debug, Default)]
pub(super) struct Channels {
    schema_names: BTreeMap<u16, String>,
    by_id: BTreeMap<u16, Channel>,
    messages: BTreeMap<u16, u64>,
}

impl Channels {
    /// Takes in a schema or channel record. The first description of a number holds.
    pub(super) fn describe(&mut self, opcode: u8, body: &[u8]) -> Result<(), String> {
        let record = mcap::parse_record(opcode, body).map_err(|e| one_line(&e.to_string()))?;
        match record {
            Record::Schema { header, .. } => insert(&mut self.schema_names, header.id, header.name)
                .map_err(|id| format!("schema {id} is described twice, differently")),
            Record::Channel(channel) => {
                let (id, topic) = (channel.id, channel.topic);
                let channel =
                    Channel { topic, encoding: channel.message_encoding, schema_id: channel.schema_id };
                insert(&mut self.by_id, id, channel)
                    .map_err(|id| format!("channel {id} is described twice, differently"))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn is_description(opcode: u8) -> bool {
        matches!(opcode, op::SCHEMA | op::CHANNEL)
    }

    pub(super) fn get(&self, id: u16) -> Option<&Channel> {
        self.by_id.get(&id)
    }

    /// Whether the channel's messages are point clouds in CDR.
    pub(super) fn is_cloud(&self, channel: &Channel) -> bool {
        channel.encoding == "cdr" && CLOUD.contains(&self.schema_name(channel))
    }

    /// The topics with point clouds in CDR.
    pub(super) fn cloud_topics(&self) -> Vec<String> {
        let clouds = self.by_id.values().filter(|channel| self.is_cloud(channel));
        clouds.map(|channel| channel.topic.clone()).collect()
    }

    fn schema_name(&self, channel: &Channel) -> &str {
        self.schema_names.get(&channel.schema_id).map_or("", String::as_str)
    }

    pub(super) fn count_message(&mut self, id: u16) {
        *self.messages.entry(id).or_default() += 1;
    }

    /// Numbers of messages whose channel is nowhere described.
    pub(super) fn undescribed(&self) -> impl Iterator<Item = (u16, u64)> {
        self.messages.iter().filter(|(id, _)| !self.by_id.contains_key(id)).map(|(&id, &count)| (id, count))
    }

    /// Every topic, by name; a topic with several channels is one.
    pub(super) fn topics(&self) -> Vec<TopicInfo> {
        let mut topics: BTreeMap<(&str, String), u64> = BTreeMap::new();
        for (id, channel) in &self.by_id {
            let schema = match self.schema_name(channel) {
                "" => "no type",
                name => name,
            };
            let message_type = format!("{schema} ({})", channel.encoding);
            *topics.entry((&channel.topic, message_type)).or_default() +=
                self.messages.get(id).copied().unwrap_or(0);
        }
        let info = |((name, message_type), messages): ((&str, String), u64)| TopicInfo {
            name: name.to_owned(),
            message_type,
            messages,
        };
        topics.into_iter().map(info).collect()
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

/// The topics in one line, for messages.
pub(super) fn in_words(topics: &[TopicInfo]) -> String {
    if topics.is_empty() {
        return "no topics".into();
    }
    let word =
        |topic: &TopicInfo| format!("{} [{}, {} messages]", topic.name, topic.message_type, topic.messages);
    topics.iter().map(word).collect::<Vec<_>>().join(", ")
}
