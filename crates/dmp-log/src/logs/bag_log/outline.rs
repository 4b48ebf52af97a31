//! A bag by its indexes: which scans it has, and parts of them.

use super::found::{FoundFrames, frames_coding};
use super::log::{BagLog, take_scan};
use super::open::AroundScans;
use super::topic::{Entry, TopicIndex};
use crate::messages::{Bag, BagIndex, Location, STATIC_TOPIC, ScanCoding};
use crate::points::{TimeChoice, frames_to_look_at};
use crate::scans::median_step_ns;
use crate::{Damage, LogError, LogOptions, LogSummary, MemoryLog, OutlinedScan, StaticFrames};
use dmp_lengths::thousands;
use dmp_sensor::Scan;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Places along the log where pairs of scans are looked at.
const PLACES: usize = 4;
/// Chunks with frames that do not move that are read however large they are.
const FEW_RECORDS: usize = 4;
/// Of the log's bytes, the part that may be read beyond these for such frames.
const FRAMES_SHARE: u64 = 200;

/// What an index says of the scans of one topic, and what a look at a few of them shows of all.
#[derive(Debug)]
pub(crate) struct BagOutline {
    around: AroundScans,
    index: BagIndex,
    name: String,
    /// The frame of the scans that are read, where the topic has others, too.
    frame: Option<String>,
    /// In the order of the bag.
    scans: Vec<Promised>,
    /// Messages with frames that do not move.
    frames_at: Vec<Location>,
    /// What holds for the whole log, wherever a part of it lies; returns are not known.
    pub(crate) summary: LogSummary,
    time: Option<TimeChoice>,
    /// As far as they lie in few bytes.
    pub(crate) static_frames: StaticFrames,
    /// What is added to the time a scan was recorded for its stamp, and how far that is off at most.
    stamp_after_log_ns: i64,
    pub(crate) stamp_error_ns: i64,
}

#[derive(Debug, Clone, Copy)]
struct Promised {
    location: Location,
    log_time_ns: Option<i64>,
}

/// Takes a scan as it is met: its number in the log, its coding, its bytes.
type Meet<'a> = dyn FnMut(usize, ScanCoding, &[u8]) + 'a;

impl BagOutline {
    /// Passes over the bag, and looks at a few of its scans.
    pub(crate) fn open(bag: Bag, options: &LogOptions) -> Result<Self, LogError> {
        let mut clouds: BTreeMap<String, Vec<Promised>> = BTreeMap::new();
        let mut frames_at = Vec::new();
        let index = bag.index(&mut |channel, log_time_ns, location| {
            if frames_coding(channel).is_some() {
                frames_at.push(location);
            }
            if ScanCoding::of(channel).is_some() {
                let promised = Promised { location, log_time_ns: i64::try_from(log_time_ns).ok() };
                match clouds.get_mut(&channel.topic) {
                    Some(scans) => scans.push(promised),
                    None => clouds.entry(channel.topic.clone()).or_default().push(promised),
                }
            }
        })?;
        for channel in index.bag_found.topics.channels().filter(|channel| ScanCoding::of(channel).is_some()) {
            clouds.entry(channel.topic.clone()).or_default();
        }
        let around = AroundScans::new(bag, &index.bag_found, StaticFrames::default())?;
        let mut notes = Vec::new();
        let (name, mut scans) = around.choose(clouds, options, &mut notes)?;
        scans.sort_by(|a, b| a.location.compare(&b.location));
        scans.dedup_by(|a, b| a.location.compare(&b.location).is_eq());
        notes.extend(index.notes.iter().cloned());
        let frames_at = few_records(frames_at, around.bytes, &mut notes);
        let summary = BagLog::undecided(&around, name.clone(), TopicIndex::default(), notes).summary;
        let mut outline = Self {
            around,
            index,
            name,
            frame: options.topic_and_frame().1.map(str::to_owned),
            scans,
            frames_at,
            summary,
            time: None,
            static_frames: StaticFrames::default(),
            stamp_after_log_ns: 0,
            stamp_error_ns: 0,
        };
        outline.look(options)?;
        Ok(outline)
    }

    /// Looks at a few scans: at those that a log opened whole looks at for the times of its points, and at pairs
    /// evenly spread.
    fn look(&mut self, options: &LogOptions) -> Result<(), LogError> {
        let count = self.scans.len();
        let mut places = PLACES;
        let (mut few, numbers) = loop {
            let numbers = self.with_their_groups(&looked_at(count, places));
            let few = self.read(&numbers, &mut |_, _, _| ())?;
            if few.frames.iter().any(|frame| frame.returns > 0) || numbers.len() == count {
                break (few, numbers);
            }
            places = places.saturating_mul(4);
        };
        if self.frame.is_none() {
            let (at, mut notes) = ((self.around.bag.path(), self.name.as_str()), Vec::new());
            few.topic.choose_frame(at, None, &mut notes)?;
            self.frame = few.topic.frame_ids.first().cloned();
            few.summary.frame_id.clone_from(&self.frame);
            few.describe();
        }
        self.compare_stamps(&few.topic.entries);
        let period_ns = self.period_ns(&few.topic.entries);
        let of_whole = frames_to_look_at(std::iter::repeat_n(1, count));
        let entries = &few.topic.entries;
        let frame_of = |number: usize| {
            entries.iter().position(|entry| entry.message == number as u64 && entry.returns > 0)
        };
        let frames = of_whole.into_iter().map(frame_of).collect::<Option<Vec<usize>>>();
        let frames =
            frames.unwrap_or_else(|| frames_to_look_at(few.frames.iter().map(|frame| frame.returns)));
        few.summary.notes = std::mem::take(&mut self.summary.notes);
        few.decide_time(options, period_ns, frames)?;
        let mut few = few.finish()?;
        few.summary.notes.push(format!(
            "{} of {} scans were looked at to outline the log",
            thousands(numbers.len()),
            thousands(count)
        ));
        self.around.damage.clone_from(&few.summary.damage);
        // They are known now, and need not be read again for every part.
        self.frames_at.clear();
        let stamps_ns = || self.stamps_ns().flatten();
        let span_ns = stamps_ns().min().zip(stamps_ns().max());
        self.summary = LogSummary { returns: 0, span_ns, period_ns, ..few.summary };
        self.time = few.time;
        self.static_frames = Arc::unwrap_or_clone(few.static_frames);
        Ok(())
    }

    /// The numbers with those of all scans that are read with them.
    fn with_their_groups(&self, numbers: &BTreeSet<usize>) -> Vec<usize> {
        let record = |number: usize| self.scans.get(number).map(|scan| scan.location.record());
        let records: BTreeSet<_> = numbers.iter().map(|&number| record(number)).collect();
        (0..self.scans.len()).filter(|&number| records.contains(&record(number))).collect()
    }

    /// Learns the usual distance of a scan's stamp from the time it was recorded.
    fn compare_stamps(&mut self, entries: &[Entry]) {
        let after_ns = |entry: &Entry| {
            let log_time_ns = self.scans.get(entry.message as usize)?.log_time_ns?;
            entry.stamp_ns.checked_sub(log_time_ns)
        };
        let mut after_ns: Vec<i64> = entries.iter().filter_map(after_ns).collect();
        after_ns.sort_unstable();
        let median_ns = after_ns.get(after_ns.len() / 2).copied().unwrap_or(0);
        let off_ns = |&after_ns: &i64| after_ns.saturating_sub(median_ns).saturating_abs();
        self.stamp_after_log_ns = median_ns;
        self.stamp_error_ns = after_ns.iter().map(off_ns).max().unwrap_or(0);
    }

    /// The time from scan to scan: from the index where its times are good for that, else from the neighbours
    /// among the scans that were looked at.
    fn period_ns(&self, entries: &[Entry]) -> Option<i64> {
        let by_index = median_step_ns(self.scans.iter().filter_map(|scan| scan.log_time_ns).collect());
        let pairs = entries.windows(2).filter(|pair| pair[1].message == pair[0].message + 1);
        let steps_ns = pairs.filter_map(|pair| pair[1].stamp_ns.checked_sub(pair[0].stamp_ns));
        let mut steps_ns: Vec<i64> = steps_ns.filter(|&step_ns| step_ns > 0).collect();
        steps_ns.sort_unstable();
        let by_neighbours = steps_ns.get(steps_ns.len() / 2).copied();
        by_index.filter(|&period_ns| self.stamp_error_ns <= period_ns / 4).or(by_neighbours).or(by_index)
    }

    /// The stamps of the scans, as near as the index has them.
    fn stamps_ns(&self) -> impl Iterator<Item = Option<i64>> {
        let stamp_ns = |scan: &Promised| Some(scan.log_time_ns?.saturating_add(self.stamp_after_log_ns));
        self.scans.iter().map(stamp_ns)
    }

    pub(crate) fn scans(&self) -> Vec<OutlinedScan> {
        let groups = self.scans.chunk_by(|a, b| a.location.record() == b.location.record());
        let grouped = groups.enumerate().flat_map(|(k, group)| group.iter().map(move |scan| (k, scan)));
        let outlined = |((group, scan), stamp_ns): ((usize, &Promised), Option<i64>)| OutlinedScan {
            stamp_ns,
            group: group as u32,
            bytes: scan.location.record_bytes(),
        };
        grouped.zip(self.stamps_ns()).map(outlined).collect()
    }

    pub(crate) fn bytes_read(&self) -> Option<u64> {
        self.around.bag.bytes_read()
    }

    /// Reads some scans, numbers ascending, what they lie in once, and keeps them.
    pub(crate) fn load(&self, wanted: &[usize]) -> Result<MemoryLog, LogError> {
        let mut scans = BTreeMap::new();
        let time = self.time.as_ref();
        let log = self.part_with(wanted, &mut |number, coding, body| {
            // One that is broken is reported where all are taken in.
            if let Ok(cloud) = coding.parse(body) {
                let mut scan = Scan::default();
                take_scan(&cloud, time, &mut scan);
                scans.insert(number, scan);
            }
        })?;
        Ok(MemoryLog::part_of(&log, &mut |number| scans.remove(&number)))
    }

    pub(crate) fn part(&self, wanted: &[usize]) -> Result<BagLog, LogError> {
        self.part_with(wanted, &mut |_, _, _| ())?.if_any()
    }

    fn part_with(&self, wanted: &[usize], meet: &mut Meet<'_>) -> Result<BagLog, LogError> {
        let mut log = self.read(wanted, meet)?;
        log.summary.notes.splice(0..0, self.summary.notes.iter().cloned());
        if let Some(time) = &self.time {
            log.take_time(time.clone());
        }
        log.describe();
        log.summary.fields.clone_from(&self.summary.fields);
        log.summary.point_bytes = self.summary.point_bytes;
        // What was met is better than the index, if everything was to be met.
        if wanted.len() < self.scans.len() {
            log.summary.period_ns = self.summary.period_ns;
            let [opened, all] = [log.frames.len(), self.scans.len()].map(thousands);
            log.summary.notes.push(format!("{opened} of {all} scans opened, by the index of the log"));
        }
        Ok(log)
    }

    /// Reads what these scans lie in, and the frames that do not move.
    fn read(&self, wanted: &[usize], meet: &mut Meet<'_>) -> Result<BagLog, LogError> {
        let places = wanted.iter().filter_map(|&number| self.scans.get(number)).map(|scan| scan.location);
        let mut places: Vec<Location> = places.chain(self.frames_at.iter().copied()).collect();
        places.sort_by(Location::compare);
        let frame_ids = self.summary.frame_id.iter().cloned().collect();
        let mut topic = TopicIndex { frame_ids, ..TopicIndex::default() };
        let (mut frames, mut met, mut unnamed) = (FoundFrames::default(), BTreeSet::new(), 0);
        let mut other_times = Vec::new();
        frames.frames.clone_from(&self.static_frames);
        let mut part = self.around.bag.read_part(&self.index, &places, &mut |message| {
            frames.take(&message);
            let Some(coding) = ScanCoding::of(message.channel) else { return };
            if message.channel.topic != self.name {
                return;
            }
            match self.scans.binary_search_by(|scan| scan.location.compare(&message.location)) {
                Ok(number) if wanted.binary_search(&number).is_ok() => {
                    met.insert(number);
                    let promised = self.scans.get(number).and_then(|scan| scan.log_time_ns);
                    if promised != i64::try_from(message.log_time_ns).ok() {
                        other_times.push(number);
                    }
                    meet(number, coding, message.body);
                    topic.add_numbered(coding, message, number as u64);
                }
                Ok(_) => {}
                Err(_) => unnamed += 1,
            }
        })?;
        for &number in wanted.iter().filter(|number| !met.contains(number)) {
            let Some(scan) = self.scans.get(number).filter(|scan| !part.has_lost(&scan.location)) else {
                continue;
            };
            let place = format!("message {number} ({})", scan.location.in_words());
            let what = "the index names a scan where there is none; it is skipped";
            part.damage.push(Damage::new(place, what));
        }
        // Where it has another time for all of them, whoever wrote it meant another one.
        let is_meant = other_times.len() > 1 && other_times.len() == met.len();
        for number in other_times.into_iter().filter(|_| !is_meant) {
            let Some(scan) = self.scans.get(number) else { continue };
            let place = format!("message {number} ({})", scan.location.in_words());
            part.damage.push(Damage::new(place, "the index has another time for it than the message itself"));
        }
        if unnamed > 0 {
            let what = format!("{} scans that the index does not name are skipped", thousands(unnamed));
            part.damage.push(Damage::new("what was read", what));
        }
        part.damage.append(frames.damage, |lost| lost);
        topic.keep_frame_of(self.frame.as_deref());
        part.damage.append(std::mem::take(&mut topic.damage), |lost| lost);
        let mut log = BagLog::undecided(&self.around, self.name.clone(), topic, Vec::new());
        log.add_damage(part.damage.into_vec());
        log.static_frames = frames.frames.into();
        log.part_of = Some(self.scans.len());
        Ok(log)
    }
}

/// Numbers of scans to look at.
fn looked_at(count: usize, places: usize) -> BTreeSet<usize> {
    let mut numbers: BTreeSet<usize> = frames_to_look_at(std::iter::repeat_n(1, count)).into_iter().collect();
    let (last, steps) = (count.saturating_sub(2), places.saturating_sub(1).max(1));
    for place in 0..places.min(count) {
        let first = (last as u128 * place as u128 / steps as u128) as usize;
        numbers.extend([first, first + 1].into_iter().filter(|&number| number < count));
    }
    if places >= count {
        numbers.extend(0..count);
    }
    numbers
}

/// The messages with frames that lie in few bytes: a log that repeats them all the time need not be read for them.
fn few_records(frames_at: Vec<Location>, log_bytes: u64, notes: &mut Vec<String>) -> Vec<Location> {
    let (all, mut records, mut bytes) = (frames_at.len(), 0, 0_u64);
    let mut last = None;
    let mut few = frames_at;
    let cut = few.iter().position(|location| {
        if last.replace(location.record()) != Some(location.record()) {
            records += 1;
            bytes = bytes.saturating_add(location.record_bytes());
        }
        records > FEW_RECORDS && bytes > log_bytes / FRAMES_SHARE
    });
    if let Some(cut) = cut {
        few.truncate(cut);
        notes.push(format!(
            "{STATIC_TOPIC}: the first {} of {} messages are read in a part of the log",
            thousands(cut),
            thousands(all)
        ));
    }
    few
}
