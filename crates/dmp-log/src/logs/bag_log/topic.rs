//! The scans of one topic: where each is, and how its points are stored.

use crate::file::{DamageList, shorten};
use crate::messages::{Location, Message, ScanCoding, frame_name};
use crate::points::Layout;
use crate::{Damage, LogError, LogSetting};
use dmp_lengths::thousands;
use std::path::Path;

/// Layouts, the last ones, that a new message's is compared with.
const COMPARED_LAYOUTS: usize = 16;

/// Names of frames that are told apart; scans of further ones count as those of the last.
const MOST_FRAMES: usize = 16;
/// One in so many scans may name another frame and is skipped; more are another sensor.
const FEW_OTHERS: usize = 20;

#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) location: Location,
    pub(super) coding: ScanCoding,
    pub(super) stamp_ns: i64,
    pub(super) returns: u64,
    pub(super) layout: u32,
    /// The place of its frame among those of the topic.
    pub(super) frame: u8,
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
    /// The names of the sensors' frames, in the order in which they are met.
    pub(super) frame_ids: Vec<String>,
    pub(super) stamped_by_points: u64,
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
        let known = self.frame_ids.iter().position(|name| frame_name(name) == frame_name(cloud.frame_id));
        if known.is_none() && self.frame_ids.len() < MOST_FRAMES {
            self.frame_ids.push(cloud.frame_id.to_owned());
        }
        let frame = known.unwrap_or(self.frame_ids.len() - 1) as u8;
        self.stamped_by_points += u64::from(cloud.is_stamped_by_points);
        let (stamp_ns, returns) = (cloud.stamp_ns, cloud.returns());
        // The last layout is almost always the one; a file where it never is must not be compared with all.
        let from = self.layouts.len().saturating_sub(COMPARED_LAYOUTS);
        let last = self.layouts.get(from..).unwrap_or_default();
        let known = last.iter().rposition(|known| *known == cloud.layout).map(|k| from + k);
        let layout = known.unwrap_or(self.layouts.len()) as u32;
        if known.is_none() {
            self.layouts.push(cloud.layout);
        }
        self.entries.push(Entry { location, coding, stamp_ns, returns, layout, frame, message: number });
    }

    /// Keeps the scans of one sensor: that of the frame that is wanted, else the only one. A stray scan of another frame is
    /// skipped; of several sensors one must be named, as each has an extrinsic of its own.
    pub(super) fn choose_frame(
        &mut self,
        (path, topic): (&Path, &str),
        wanted: Option<&str>,
        notes: &mut Vec<String>,
    ) -> Result<(), LogError> {
        if self.entries.is_empty() {
            return Ok(());
        }
        let count = |frame: usize| self.entries.iter().filter(|entry| entry.frame as usize == frame).count();
        let counts: Vec<usize> = (0..self.frame_ids.len()).map(count).collect();
        let in_words = || {
            let one = |(name, count): (&String, &usize)| {
                format!("`{}` ({} scans)", shorten(name), thousands(*count))
            };
            self.frame_ids.iter().zip(&counts).map(one).collect::<Vec<_>>().join(", ")
        };
        let most = counts.iter().copied().max().unwrap_or(0);
        let chosen = match wanted {
            Some(wanted) => {
                let is_wanted = |name: &String| frame_name(name) == frame_name(wanted);
                self.frame_ids.iter().position(is_wanted).ok_or_else(|| {
                    let problem = format!("was given, but the topic has scans of the frames {}", in_words());
                    LogError::setting(path, LogSetting::Topic, format!("{topic}:{wanted}"), problem)
                })?
            }
            None => counts.iter().position(|&count| count == most).unwrap_or(0),
        };
        let others = self.entries.len() - counts.get(chosen).copied().unwrap_or(0);
        if others == 0 {
            self.keep_frame(chosen);
            return Ok(());
        }
        if wanted.is_some() {
            notes.push(format!("{} scans of other frames are left out: {}", thousands(others), in_words()));
        } else if FEW_OTHERS * others > self.entries.len() {
            let problem = format!(
                "topic {topic} has scans of several sensors, of the frames {}; each has a place of its own on the body, so \
                 score one of them at a time: name it with",
                in_words()
            );
            let first = self.frame_ids.first().map_or("", String::as_str);
            return Err(LogError::missing(path, problem, LogSetting::Topic, format!("{topic}:{first}")));
        } else {
            for entry in self.entries.iter().filter(|entry| entry.frame as usize != chosen) {
                let name = self.frame_ids.get(entry.frame as usize).map_or("", String::as_str);
                let what = format!(
                    "its frame is `{}`, unlike that of the others; the scan is skipped",
                    shorten(name)
                );
                self.damage.push(Damage::new(entry.in_words(), what));
            }
        }
        self.keep_frame(chosen);
        Ok(())
    }

    /// Gives up the scans of other frames than this.
    fn keep_frame(&mut self, chosen: usize) {
        self.entries.retain(|entry| entry.frame as usize == chosen);
        self.entries.iter_mut().for_each(|entry| entry.frame = 0);
        self.frame_ids = self.frame_ids.get(chosen).cloned().into_iter().collect();
    }

    /// The same by name; without one all are kept.
    pub(super) fn keep_frame_of(&mut self, name: Option<&str>) {
        let Some(name) = name else { return };
        let of_name = |known: &String| frame_name(known) == frame_name(name);
        self.keep_frame(self.frame_ids.iter().position(of_name).unwrap_or(usize::MAX));
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
