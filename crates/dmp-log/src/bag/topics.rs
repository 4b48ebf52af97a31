use super::Channel;
use crate::TopicInfo;
use std::collections::BTreeMap;

/// Every channel of a bag with what was counted of it; a topic with several equal channels is one.
#[derive(Debug, Default)]
pub(crate) struct Topics {
    by_channel: BTreeMap<Channel, Seen>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    messages: u64,
    span_ns: Option<(u64, u64)>,
}

impl Topics {
    pub(super) fn describe(&mut self, channel: &Channel) {
        if !self.by_channel.contains_key(channel) {
            self.by_channel.insert(channel.clone(), Seen::default());
        }
    }

    pub(super) fn count(&mut self, channel: &Channel, log_time_ns: u64) {
        self.describe(channel);
        if let Some(seen) = self.by_channel.get_mut(channel) {
            let (first, last) = seen.span_ns.unwrap_or((log_time_ns, log_time_ns));
            seen.span_ns = Some((first.min(log_time_ns), last.max(log_time_ns)));
            seen.messages += 1;
        }
    }

    /// Every channel, by topic.
    pub(crate) fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.by_channel.keys()
    }

    /// Every topic, by name.
    pub(crate) fn infos(&self) -> Vec<TopicInfo> {
        let info = |(channel, seen): (&Channel, &Seen)| {
            let message_type = match channel.message_type.as_str() {
                "" => "no type",
                name => name,
            };
            TopicInfo {
                name: channel.topic.clone(),
                message_type: format!("{message_type} ({})", channel.encoding),
                messages: seen.messages,
                span_ns: seen.span_ns,
            }
        };
        self.by_channel.iter().map(info).collect()
    }
}

/// The topics in one line, for messages.
pub(crate) fn in_words(topics: &[TopicInfo]) -> String {
    if topics.is_empty() {
        return "no topics".into();
    }
    let word =
        |topic: &TopicInfo| format!("{} [{}, {} messages]", topic.name, topic.message_type, topic.messages);
    topics.iter().map(word).collect::<Vec<_>>().join(", ")
}
