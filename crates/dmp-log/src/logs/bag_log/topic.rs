//! The scans of one topic: where each is, and how its points are stored.

use crate::Damage;
use crate::file::DamageList;
use crate::messages::{Location, Message, ScanCoding};
use crate::points::Layout;

/// Layouts, the last ones, that a new message's is compared with.
const COMPARED_LAYOUTS: usize = 16;

#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) location: Location,
    pub(super) coding: ScanCoding,
    pub(super) stamp_ns: i64,
    pub(super) returns: u64,
    pub(super) layout: u32,
    /// Its number among the topic's messages.
    pub(super) message: u64,
}

impl Entry {
    /// Where it is, for people.
    pub(super) fn in_words(&self) -> String {
        format!("message {} ({})", self.message, self.location.in_words())
    }
}

#[derive(Debug, Clone, Default)]
pub(super) struct TopicIndex {
    pub(super) entries: Vec<Entry>,
    pub(super) layouts: Vec<Layout>,
    pub(super) frame_id: Option<String>,
    pub(super) other_frame_ids: u64,
    pub(super) damage: DamageList,
    pub(super) messages: u64,
}

impl TopicIndex {
    pub(super) fn add(&mut self, coding: ScanCoding, message: Message<'_>) {
        let number = self.messages;
        self.messages += 1;
        self.add_numbered(coding, message, number);
    }

    /// Takes in the message that has this number among all of the topic.
    pub(super) fn add_numbered(&mut self, coding: ScanCoding, message: Message<'_>, number: u64) {
        let Message { location, body, .. } = message;
        let cloud = match coding.parse(body) {
            Ok(cloud) => cloud,
            Err(problem) => {
                let place = format!("message {number} ({})", location.in_words());
                self.damage.push(Damage::new(place, format!("{problem}; the scan is skipped")));
                return;
            }
        };
        match &self.frame_id {
            None => self.frame_id = Some(cloud.frame_id.to_owned()),
            Some(first) => self.other_frame_ids += u64::from(first != cloud.frame_id),
        }
        let (stamp_ns, returns) = (cloud.stamp_ns, cloud.returns());
        // The last layout is almost always the one; a file where it never is must not be compared with all.
        let from = self.layouts.len().saturating_sub(COMPARED_LAYOUTS);
        let last = self.layouts.get(from..).unwrap_or_default();
        let known = last.iter().rposition(|known| *known == cloud.layout).map(|k| from + k);
        let layout = known.unwrap_or(self.layouts.len()) as u32;
        if known.is_none() {
            self.layouts.push(cloud.layout);
        }
        self.entries.push(Entry { location, coding, stamp_ns, returns, layout, message: number });
    }

    pub(super) fn layout_of(&self, entry: &Entry) -> Option<&Layout> {
        self.layouts.get(entry.layout as usize)
    }

    /// The layout of the first scan with points; without any, that of the first scan.
    pub(super) fn first_layout(&self) -> Option<&Layout> {
        let first = self.entries.iter().find(|entry| entry.returns > 0).or(self.entries.first());
        first.and_then(|entry| self.layout_of(entry))
    }
}
