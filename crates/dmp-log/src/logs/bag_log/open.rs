//! Opening a bag: which topic is read, and its summary.

use super::decide::{Seen, look_at};
use super::found::clouds_of;
use super::log::BagLog;
use super::packets::advice;
use super::topic::{Entry, TopicIndex};
use crate::file::first_in_words;
use crate::messages::{Bag, BagFound, ScanCoding, in_words};
use crate::points::frames_to_look_at;
use crate::{
    Damage, FrameInfo, LogError, LogOptions, LogSummary, LogSurvey, PlaceInFile, ScanStream, StaticFrames,
    TopicInfo,
};
use dmp_lengths::thousands;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// What is known of a bag beside its scans.
#[derive(Debug)]
pub(super) struct AroundScans {
    pub(super) bag: Bag,
    pub(super) topics: Arc<[TopicInfo]>,
    pub(super) static_frames: Arc<StaticFrames>,
    pub(super) damage: Vec<Damage>,
    pub(super) bytes: u64,
    pub(super) fingerprint: String,
    has_checksums: bool,
}

impl AroundScans {
    pub(super) fn new(bag: Bag, bag_found: &BagFound, static_frames: StaticFrames) -> Result<Self, LogError> {
        let (topics, damage) = (bag_found.topics.infos().into(), bag_found.damage.clone());
        let fingerprint = bag.fingerprint()?;
        let static_frames = static_frames.into();
        let has_checksums = !bag_found.unguarded && bag.format().has_checksums();
        Ok(Self { bag, topics, static_frames, damage, bytes: bag_found.bytes, fingerprint, has_checksums })
    }

    /// Chooses the topic that is read: the one that is wanted, or the only one.
    pub(super) fn choose<T>(
        &self,
        clouds: BTreeMap<String, T>,
        options: &LogOptions,
        notes: &mut Vec<String>,
    ) -> Result<(String, T), LogError> {
        if clouds.is_empty() && !self.damage.is_empty() {
            let problem = format!("no scan can be read{}", first_in_words(&self.damage));
            return Err(LogError::malformed(self.bag.path(), PlaceInFile::WholeFile, problem));
        }
        let (name, topic) = choose_topic(self.bag.path(), clouds, options.topic_and_frame().0, &self.topics)?;
        notes.extend(self.bag.missing_files());
        if options.topic_and_frame().0.is_none() {
            notes.push(format!("topic {name}: the only one with point clouds"));
        }
        Ok((name, topic))
    }
}

impl BagLog {
    /// Reads the bag once from start to end, one chunk in memory at a time, or a few in a pool with several threads.
    pub(crate) fn open(bag: Bag, options: &LogOptions) -> Result<Self, LogError> {
        if options.is_checked_as_read {
            let with_starts = bag.clone().with_starts_of(|channel| ScanCoding::of(channel).is_some());
            // Of a log in which anything is wrong all is taken stock of.
            if let Ok(log) = Self::opened(with_starts, options)
                && log.summary.damage.is_empty()
            {
                return Ok(log);
            }
        }
        Self::opened(bag, options)
    }

    fn opened(bag: Bag, options: &LogOptions) -> Result<Self, LogError> {
        let (bag_found, clouds, static_frames) = clouds_of(&bag)?;
        let around = AroundScans::new(bag, &bag_found, static_frames)?;
        let mut notes = Vec::new();
        let (name, mut topic) = around.choose(clouds, options, &mut notes)?;
        let path = around.bag.path();
        topic.choose_frame((path, &name), options.topic_and_frame().1, &mut notes)?;
        Self::of_topic(&around, name, topic, notes, options)
    }

    /// Reads the bag once and opens every topic with scans, or the one that the options name.
    pub(crate) fn survey(bag: &Bag, options: &LogOptions) -> Result<LogSurvey, LogError> {
        let (bag_found, clouds, static_frames) = clouds_of(bag)?;
        let mut around = AroundScans::new(bag.clone(), &bag_found, static_frames)?;
        let (wanted, frame) = options.topic_and_frame();
        let clouds = match wanted {
            None => clouds,
            Some(wanted) => [choose_topic(bag.path(), clouds, Some(wanted), &around.topics)?].into(),
        };
        // What the streams share is in the summary once: there may be as many as topics.
        let damage = std::mem::take(&mut around.damage);
        let mut several: Vec<Option<LogError>> = Vec::new();
        let undecided = |(name, mut topic): (String, TopicIndex)| {
            let (at, mut notes) = ((bag.path(), name.as_str()), Vec::from_iter(bag.missing_files()));
            several.push(topic.choose_frame(at, frame, &mut notes).err());
            Self::undecided(&around, name, topic, notes)
        };
        let logs: Vec<Self> = clouds.into_iter().map(undecided).collect();
        let looked_at: Vec<(&Self, Vec<usize>)> = logs
            .iter()
            .map(|log| (log, frames_to_look_at(log.frames.iter().map(|frame| frame.returns))))
            .collect();
        let seen = look_at(&mut bag.reader(), &looked_at, options);
        let streams = logs.into_iter().zip(seen).zip(several);
        let stream = |((log, seen), several): ((Self, _), Option<LogError>)| {
            let stream = log.into_stream(seen, &damage, options);
            ScanStream { problem: several.or(stream.problem), ..stream }
        };
        let streams = streams.map(stream).collect();
        let AroundScans { topics, static_frames, bytes, fingerprint, .. } = around;
        let (path, format, topics) = (bag.path().into(), bag.format(), topics.to_vec());
        let static_frames = Arc::unwrap_or_clone(static_frames);
        Ok(LogSurvey { path, format, bytes, fingerprint, topics, streams, static_frames, damage })
    }

    /// The summary of one topic of several, given what a few of its scans have where times may be and what is lost of the
    /// bag.
    fn into_stream(
        mut self,
        seen: Result<Seen, LogError>,
        lost: &[Damage],
        options: &LogOptions,
    ) -> ScanStream {
        let (period_ns, notes) = (self.summary.period_ns, self.summary.notes.clone());
        let problem = self.decide_time_from(options, period_ns, |_| seen).err();
        if problem.is_some() {
            self.summary.notes = notes;
            // Without times nothing is left to decide.
            let _ = self.decide_time_from(&LogOptions::without_times(), period_ns, |_| Ok(Seen::new()));
        }
        let (topic, damage) = (self.summary.topic.clone(), self.summary.damage.clone());
        if self.topic.entries.is_empty() {
            // It may be the reason.
            self.summary.damage.splice(0..0, lost.first().cloned());
        }
        match self.finish() {
            Ok(log) => ScanStream { topic, log: Some(Box::new(log)), damage, problem },
            Err(no_scan) => ScanStream { topic, log: None, damage, problem: problem.or(Some(no_scan)) },
        }
    }

    fn of_topic(
        around: &AroundScans,
        name: String,
        topic: TopicIndex,
        notes: Vec<String>,
        options: &LogOptions,
    ) -> Result<Self, LogError> {
        let mut log = Self::undecided(around, name, topic, notes);
        let looked_at = frames_to_look_at(log.frames.iter().map(|frame| frame.returns));
        log.decide_time(options, log.summary.period_ns, looked_at)?;
        log.finish()
    }

    /// All scans that could be read, without a meaning of their times.
    pub(super) fn undecided(
        around: &AroundScans,
        name: String,
        mut topic: TopicIndex,
        mut notes: Vec<String>,
    ) -> Self {
        let mut damage = around.damage.clone();
        damage.append(&mut std::mem::take(&mut topic.damage).into_vec());
        if topic.stamped_by_points > 0 {
            notes.push(format!(
                "{} scans have no stamp in their header (0 s): each has that of its first point",
                thousands(topic.stamped_by_points)
            ));
        }
        let bag = around.bag.clone();
        let summary = LogSummary {
            topic: Some(name),
            frame_id: topic.frame_ids.first().cloned(),
            notes,
            damage,
            has_checksums: around.has_checksums,
            fingerprint: around.fingerprint.clone(),
            bytes: around.bytes,
            topics: Arc::clone(&around.topics),
            ..LogSummary::of(bag.path(), bag.format())
        };
        let static_frames = Arc::clone(&around.static_frames);
        let mut log =
            Self { bag, frames: Vec::new(), topic, time: None, summary, static_frames, part_of: None };
        log.describe();
        log
    }

    /// The log, if any scan of it is left.
    pub(super) fn finish(mut self) -> Result<Self, LogError> {
        self.describe();
        self.if_any()
    }

    pub(super) fn if_any(self) -> Result<Self, LogError> {
        if self.frames.is_empty() {
            let problem = format!(
                "topic {} has no scan that can be read{}",
                self.summary.topic.as_deref().unwrap_or_default(),
                first_in_words(&self.summary.damage)
            );
            return Err(LogError::malformed(self.bag.path(), PlaceInFile::WholeFile, problem));
        }
        Ok(self)
    }

    /// Fills what follows from the entries.
    pub(super) fn describe(&mut self) {
        let info = |entry: &Entry| FrameInfo { stamp_ns: Some(entry.stamp_ns), returns: entry.returns };
        self.frames = self.topic.entries.iter().map(info).collect();
        self.summary.describe(&self.frames);
        if let Some(layout) = self.topic.first_layout() {
            self.summary.fields = layout.field_infos(self.time.as_ref().map(|time| time.field.as_str()));
            self.summary.point_bytes = layout.point_bytes();
        }
    }
}

fn choose_topic<T>(
    path: &Path,
    mut clouds: BTreeMap<String, T>,
    wanted: Option<&str>,
    topics: &[TopicInfo],
) -> Result<(String, T), LogError> {
    let all = || in_words(topics) + &advice(topics);
    if let Some(wanted) = wanted {
        return clouds.remove_entry(wanted).ok_or_else(|| LogError::UnknownTopic {
            path: path.into(),
            wanted: wanted.into(),
            topics: all(),
        });
    }
    if clouds.len() > 1 {
        let readable: Vec<_> =
            topics.iter().filter(|topic| clouds.contains_key(&topic.name)).cloned().collect();
        return Err(LogError::SeveralTopics { path: path.into(), topics: in_words(&readable) });
    }
    clouds.pop_first().ok_or_else(|| LogError::NoCloudTopic { path: path.into(), topics: all() })
}
