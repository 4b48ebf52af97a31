//! What a pass over a bag finds: topics with scans, and frames that do not move.

use super::topic::TopicIndex;
use crate::file::DamageList;
use crate::messages::{Bag, BagFound, Channel, Message, PoseCoding, STATIC_TOPIC, ScanCoding};
use crate::{Damage, LogError, StaticFrames};
use std::collections::BTreeMap;

/// The frames that do not move, as messages have them.
#[derive(Debug, Default)]
pub(super) struct FoundFrames {
    pub(super) frames: StaticFrames,
    pub(super) damage: DamageList,
}

/// How the messages of a channel hold frames that do not move; `None` where they do not.
pub(super) fn frames_coding(channel: &Channel) -> Option<PoseCoding> {
    PoseCoding::of(channel).filter(|_| channel.topic == STATIC_TOPIC)
}

impl FoundFrames {
    pub(super) fn take(&mut self, message: &Message<'_>) {
        if let Some(coding) = frames_coding(message.channel)
            && let Err(problem) = self.frames.add_message(coding, message.body)
        {
            let place = format!("{STATIC_TOPIC} ({})", message.location.in_words());
            self.damage.push(Damage::new(place, format!("{problem}; these frames are skipped")));
        }
    }
}

/// Walks over the bag once: every topic with scans that are read, also those of which no message could be,
/// and the frames that do not move.
pub(super) fn clouds_of(
    bag: &Bag,
) -> Result<(BagFound, BTreeMap<String, TopicIndex>, StaticFrames), LogError> {
    let mut clouds: BTreeMap<String, TopicIndex> = BTreeMap::new();
    let mut found = FoundFrames::default();
    let mut bag_found = bag.read_whole(&mut |message| {
        found.take(&message);
        let Some(coding) = ScanCoding::of(message.channel) else { return };
        match clouds.get_mut(&message.channel.topic) {
            Some(topic) => topic.add(coding, message),
            None => clouds.entry(message.channel.topic.clone()).or_default().add(coding, message),
        }
    })?;
    for channel in bag_found.topics.channels().filter(|channel| ScanCoding::of(channel).is_some()) {
        clouds.entry(channel.topic.clone()).or_default();
    }
    bag_found.damage.append(&mut found.damage.into_vec());
    Ok((bag_found, clouds, found.frames))
}
