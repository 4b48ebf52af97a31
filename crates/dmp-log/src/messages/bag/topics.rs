//! The topics of a bag with what was counted of each.

use super::basics::Channel;
use crate::TopicInfo;
use crate::file::shorten;
use dmp_lengths::thousands;
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

    pub(crate) fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.by_channel.keys()
    }

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

/// Most topics that a message names.
const MOST_NAMED: usize = 50;

/// The topics in one line, for messages.
pub(crate) fn in_words(topics: &[TopicInfo]) -> String {
    if topics.is_empty() {
        return "no topics".into();
    }
    let word = |topic: &TopicInfo| {
        let (name, message_type) = (shorten(&topic.name), shorten(&topic.message_type));
        format!("{name} [{message_type}, {} messages]", thousands(topic.messages))
    };
    let named = topics.iter().take(MOST_NAMED).map(word).collect::<Vec<_>>().join(", ");
    match topics.len().saturating_sub(MOST_NAMED) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_of_topics_fit_in_a_line() {
        let topic = |k: usize| TopicInfo {
            name: format!("/{k}\n{}", "x".repeat(100_000)),
            message_type: "a (cdr)".into(),
            messages: 1,
            span_ns: None,
        };
        let words = in_words(&(0..60).map(topic).collect::<Vec<_>>());
        assert!(words.starts_with("/0 xxx") && words.ends_with(" and 10 more"), "{words}");
        assert!(words.len() < 10_000 && !words.contains('\n'));
    }
}
