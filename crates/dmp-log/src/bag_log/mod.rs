//! Scan logs in bags: one topic of messages with scans.

mod topic;

use crate::bag::{Bag, BagReader, Walked, in_words};
use crate::damage::DamageList;
use crate::frames::STATIC_TOPIC;
use crate::log::{period_ns, runs_of_eight, span_ns};
use crate::points::{Field, SampledScan, TimeChoice, TimeRule, choose_time, sampled_frames};
use crate::ros::{Cloud, PoseCoding, ScanCoding};
use crate::{
    Damage, FrameInfo, LogError, LogOptions, LogSummary, LogSurvey, Place, ScanLog, ScanReader, ScanStream,
    StaticFrames, TopicInfo,
};
use dmp_sensor::Scan;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use topic::{Entry, TopicIndex};

/// A bag with one topic of scans chosen.
#[derive(Debug)]
pub(crate) struct BagLog {
    bag: Bag,
    frames: Vec<FrameInfo>,
    topic: TopicIndex,
    time: Option<TimeChoice>,
    summary: LogSummary,
    static_frames: StaticFrames,
}

impl BagLog {
    /// Reads the bag once from start to end, one chunk in memory at a time.
    pub(crate) fn open(bag: Bag, options: &LogOptions) -> Result<Self, LogError> {
        let (walked, clouds, static_frames) = clouds_of(&bag)?;
        let topics = walked.topics.infos();
        if let (true, Some(first)) = (clouds.is_empty(), walked.damage.first()) {
            let problem = format!("no scan can be read; {}: {}", first.place, first.what);
            return Err(LogError::malformed(bag.path(), Place::WholeFile, problem));
        }
        let (name, topic) = choose_topic(bag.path(), clouds, options.topic.as_deref(), &topics)?;
        let mut notes = Vec::new();
        if options.topic.is_none() {
            notes.push(format!("topic {name}: the only one with point clouds"));
        }
        Self::of_topic(bag, name, topic, (&walked, &static_frames), notes, options)
    }

    /// Reads the bag once and opens every topic with scans, or the one that the options name.
    pub(crate) fn survey(bag: &Bag, options: &LogOptions) -> Result<LogSurvey, LogError> {
        let (walked, clouds, static_frames) = clouds_of(bag)?;
        let topics = walked.topics.infos();
        let clouds = match &options.topic {
            None => clouds,
            Some(wanted) => [choose_topic(bag.path(), clouds, Some(wanted), &topics)?].into(),
        };
        let stream = |(name, topic): (String, TopicIndex)| {
            let found = (&walked, &static_frames);
            let open =
                |topic, options| Self::of_topic(bag.clone(), name.clone(), topic, found, Vec::new(), options);
            let (log, problem) = match open(topic.clone(), options) {
                Ok(log) => (Some(log), None),
                Err(problem) => (open(topic, &LogOptions::without_times()).ok(), Some(problem)),
            };
            let all = log.as_ref().map(|log| log.summary.damage.as_slice()).unwrap_or_default();
            let damage = all.get(walked.damage.len()..).unwrap_or_default().to_vec();
            let log = log.map(|log| Box::new(log) as Box<dyn ScanLog>);
            ScanStream { topic: Some(name.clone()), log, damage, problem }
        };
        let streams = clouds.into_iter().map(stream).collect();
        let (path, format) = (bag.path().into(), bag.format());
        let (bytes, fingerprint) = (walked.bytes, bag.fingerprint()?);
        let damage = walked.damage;
        Ok(LogSurvey { path, format, bytes, fingerprint, topics, streams, static_frames, damage })
    }

    fn of_topic(
        bag: Bag,
        name: String,
        mut topic: TopicIndex,
        (walked, static_frames): (&Walked, &StaticFrames),
        mut notes: Vec<String>,
        options: &LogOptions,
    ) -> Result<Self, LogError> {
        let topics = walked.topics.infos();
        let mut damage = walked.damage.clone();
        damage.append(&mut std::mem::take(&mut topic.damage).into_vec());
        if topic.other_frame_ids > 0 {
            notes.push(format!("{} scans name another frame_id than the first", topic.other_frame_ids));
        }
        let summary = LogSummary {
            path: bag.path().into(),
            format: bag.format(),
            topic: Some(name),
            frame_id: topic.frame_id.clone(),
            fields: Vec::new(),
            point_bytes: 0,
            returns: 0,
            span_ns: None,
            period_ns: None,
            point_times: None,
            notes,
            damage,
            fingerprint: bag.fingerprint()?,
            bytes: walked.bytes,
            topics,
        };
        let static_frames = static_frames.clone();
        let mut log = Self { bag, frames: Vec::new(), topic, time: None, summary, static_frames };
        log.describe();
        log.decide_time(options)?;
        log.describe();
        if log.frames.is_empty() {
            let lost = log.summary.damage.first().map(|first| format!("; {}: {}", first.place, first.what));
            let problem = format!(
                "topic {} has no scan that can be read{}",
                log.summary.topic.as_deref().unwrap_or_default(),
                lost.unwrap_or_default()
            );
            return Err(LogError::malformed(log.bag.path(), Place::WholeFile, problem));
        }
        Ok(log)
    }

    /// Fills what follows from the entries.
    fn describe(&mut self) {
        let info = |entry: &Entry| FrameInfo { stamp_ns: Some(entry.stamp_ns), returns: entry.returns };
        self.frames = self.topic.entries.iter().map(info).collect();
        self.summary.returns = self.frames.iter().map(|frame| frame.returns).sum();
        self.summary.span_ns = span_ns(&self.frames);
        self.summary.period_ns = period_ns(&self.frames);
        if let Some(layout) = self.topic.first_layout() {
            self.summary.fields = layout.field_infos(self.time.as_ref().map(|time| time.field.as_str()));
            self.summary.point_bytes = layout.point_bytes();
        }
    }

    /// Finds the field with the times and what they mean, and gives up the scans that lack it.
    fn decide_time(&mut self, options: &LogOptions) -> Result<(), LogError> {
        let Some(layout) = self.topic.first_layout().filter(|_| self.summary.returns > 0) else {
            return Ok(());
        };
        let mut notes = std::mem::take(&mut self.summary.notes);
        let period_ns = self.summary.period_ns;
        let sample = |fields: &[String]| self.sample(fields);
        let choice = choose_time(self.bag.path(), layout, options, period_ns, &mut notes, sample);
        self.summary.notes = notes;
        let Some(choice) = choice? else { return Ok(()) };
        self.summary.point_times = Some(choice.words.clone());
        let (layouts, mut damage) = (&self.topic.layouts, DamageList::default());
        self.topic.entries.retain(|entry| {
            let layout = layouts.get(entry.layout as usize);
            let kept =
                entry.returns == 0 || layout.is_some_and(|layout| layout.field(&choice.field).is_some());
            if !kept {
                let place = format!("message {} ({})", entry.message, entry.location.in_words());
                let what = format!(
                    "no field `{}`, which the log's first scan has; the scan is skipped",
                    choice.field
                );
                damage.push(Damage::new(place, what));
            }
            kept
        });
        self.summary.damage.append(&mut damage.into_vec());
        self.time = Some(choice);
        Ok(())
    }

    /// What a few scans have in the fields that may hold times.
    fn sample(&self, fields: &[String]) -> Result<Vec<Vec<SampledScan>>, LogError> {
        let mut samples: Vec<Vec<SampledScan>> = vec![Vec::new(); fields.len()];
        let mut reader = BagScanReader { log: self, bag: self.bag.reader() };
        for frame in sampled_frames(self.topic.entries.iter().map(|entry| entry.returns)) {
            reader.with_cloud(frame, |cloud| {
                for (field, sample) in fields.iter().zip(&mut samples) {
                    let extremes = cloud.layout.field(field).and_then(|field| cloud.rows().extremes(field));
                    if let Some((smallest, largest)) = extremes {
                        sample.push(SampledScan { stamp_ns: cloud.stamp_ns, smallest, largest });
                    }
                }
            })?;
        }
        Ok(samples)
    }
}

/// Walks over the bag once: every topic with scans that are read, also those of which no message could be,
/// and the frames that do not move.
fn clouds_of(bag: &Bag) -> Result<(Walked, BTreeMap<String, TopicIndex>, StaticFrames), LogError> {
    let mut clouds: BTreeMap<String, TopicIndex> = BTreeMap::new();
    let (mut static_frames, mut lost_frames) = (StaticFrames::default(), DamageList::default());
    let mut walked = bag.walk(&mut |message| {
        if message.channel.topic == STATIC_TOPIC
            && let Some(coding) = PoseCoding::of(message.channel)
            && let Err(problem) = static_frames.add_message(coding, message.body)
        {
            let place = format!("{STATIC_TOPIC} ({})", message.location.in_words());
            lost_frames.push(Damage::new(place, format!("{problem}; these frames are skipped")));
        }
        let Some(coding) = ScanCoding::of(message.channel) else { return };
        match clouds.get_mut(&message.channel.topic) {
            Some(topic) => topic.add(coding, message),
            None => clouds.entry(message.channel.topic.clone()).or_default().add(coding, message),
        }
    })?;
    for channel in walked.topics.channels().filter(|channel| ScanCoding::of(channel).is_some()) {
        clouds.entry(channel.topic.clone()).or_default();
    }
    walked.damage.append(&mut lost_frames.into_vec());
    Ok((walked, clouds, static_frames))
}

fn choose_topic(
    path: &Path,
    mut clouds: BTreeMap<String, TopicIndex>,
    wanted: Option<&str>,
    topics: &[TopicInfo],
) -> Result<(String, TopicIndex), LogError> {
    let all = || in_words(topics);
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

impl ScanLog for BagLog {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn static_frames(&self) -> &StaticFrames {
        &self.static_frames
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(BagScanReader { log: self, bag: self.bag.reader() }))
    }

    fn groups(&self) -> Vec<Range<usize>> {
        let entries = &self.topic.entries;
        if !entries.iter().any(|entry| entry.location.is_in_chunk()) {
            return runs_of_eight(entries.len());
        }
        let mut start = 0;
        let chunks = entries.chunk_by(|a, b| a.location.shares_chunk(&b.location));
        chunks
            .map(|chunk| {
                let group = start..start + chunk.len();
                start = group.end;
                group
            })
            .collect()
    }
}

/// Reads scans of a [`BagLog`].
#[derive(Debug)]
struct BagScanReader<'a> {
    log: &'a BagLog,
    bag: BagReader<'a>,
}

impl BagScanReader<'_> {
    fn with_cloud(&mut self, frame: usize, use_it: impl FnOnce(&Cloud<'_>)) -> Result<(), LogError> {
        let malformed =
            |problem: String| LogError::malformed(self.log.bag.path(), Place::Frame(frame as u64), problem);
        let entries = &self.log.topic.entries;
        let Some(entry) = entries.get(frame) else {
            return Err(malformed(format!("the log has {} scans", entries.len())));
        };
        let message = self.bag.message(&entry.location, frame)?;
        let cloud = Cloud::parse(entry.coding, message).map_err(malformed)?;
        if cloud.returns() != entry.returns || cloud.stamp_ns != entry.stamp_ns {
            return Err(malformed("the file has changed since it was opened".into()));
        }
        use_it(&cloud);
        Ok(())
    }
}

impl ScanReader for BagScanReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        scan.clear();
        let time = self.log.time.as_ref();
        self.with_cloud(frame, |cloud| {
            let of_field = |choice: &TimeChoice| -> Option<(Field, TimeRule)> {
                Some((cloud.layout.field(&choice.field)?, choice.rule))
            };
            scan.stamp_ns = Some(cloud.stamp_ns);
            cloud.rows().append_to(time.and_then(of_field), scan);
        })
    }
}
