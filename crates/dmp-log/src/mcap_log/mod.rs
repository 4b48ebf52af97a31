//! Scan logs in MCAP.

mod channels;
mod chunk;
mod index;
mod records;
mod summary_hint;

use crate::log::{period_ns, runs_of_eight, span_ns};
use crate::point_cloud2::{Cloud, Field, Layout};
use crate::point_time::{Finding, PointTime, SampledScan, TimeRule, USUAL_PERIOD_NS, candidates, find_rule};
use crate::{
    Damage, FrameInfo, LogError, LogFormat, LogOptions, LogSummary, Place, ScanLog, ScanReader, fingerprint,
};
use chunk::{ChunkDecoder, ChunkFault};
use dmp_sensor::Scan;
use index::{Entry, Index, TopicIndex};
use records::{HEAD_BYTES, Source, split_message};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Scans looked at for the meaning of the times of points.
const SAMPLED_SCANS: usize = 5;

/// An MCAP file with one topic of scans chosen.
#[derive(Debug)]
pub(crate) struct McapLog {
    path: PathBuf,
    frames: Vec<FrameInfo>,
    entries: Vec<Entry>,
    layouts: Vec<Layout>,
    time: Option<(String, TimeRule)>,
    summary: LogSummary,
}

impl McapLog {
    /// Reads the file once from start to end, one chunk in memory at a time.
    pub(crate) fn open(path: &Path, options: &LogOptions) -> Result<Self, LogError> {
        let mut source = Source::open(path).map_err(|e| LogError::io(path, "open", e))?;
        let index = Index::of(&mut source).map_err(|e| LogError::io(path, "read", e))?;
        let topics = index.channels.topics();
        if let (true, Some(first)) = (index.clouds.is_empty(), index.damage.first()) {
            let problem = format!("no scan can be read; {}: {}", first.place, first.what);
            return Err(LogError::malformed(path, Place::WholeFile, problem));
        }
        let (topic, cloud) = choose_topic(path, index.clouds, options.topic.as_deref(), &topics)?;
        let mut damage = index.damage;
        let TopicIndex { entries, layouts, frame_id, other_frame_ids, damage: topic_damage, .. } = cloud;
        damage.extend(topic_damage);
        let mut notes = Vec::new();
        if options.topic.is_none() {
            notes.push(format!("topic {topic}: the only one with point clouds"));
        }
        if other_frame_ids > 0 {
            notes.push(format!("{other_frame_ids} scans name another frame_id than the first"));
        }
        let fingerprint = fingerprint::of_file(path).map_err(|e| LogError::io(path, "read", e))?;
        let summary = LogSummary {
            path: path.into(),
            format: LogFormat::Mcap,
            topic: Some(topic),
            frame_id,
            fields: Vec::new(),
            point_bytes: 0,
            returns: 0,
            span_ns: None,
            period_ns: None,
            point_times: None,
            notes,
            damage,
            fingerprint,
            bytes: source.length(),
            topics,
        };
        let mut log = Self { path: path.into(), frames: Vec::new(), entries, layouts, time: None, summary };
        log.describe();
        log.decide_time(options.point_time)?;
        log.describe();
        if log.frames.is_empty() {
            let lost = log.summary.damage.first().map(|first| format!("; {}: {}", first.place, first.what));
            let problem = format!(
                "topic {} has no scan that can be read{}",
                log.summary.topic.as_deref().unwrap_or_default(),
                lost.unwrap_or_default()
            );
            return Err(LogError::malformed(path, Place::WholeFile, problem));
        }
        Ok(log)
    }

    /// Fills what follows from the entries.
    fn describe(&mut self) {
        let info = |entry: &Entry| FrameInfo { stamp_ns: Some(entry.stamp_ns), returns: entry.returns };
        self.frames = self.entries.iter().map(info).collect();
        self.summary.returns = self.frames.iter().map(|frame| frame.returns).sum();
        self.summary.span_ns = span_ns(&self.frames);
        self.summary.period_ns = period_ns(&self.frames);
        let first = self.entries.iter().find(|entry| entry.returns > 0).or(self.entries.first());
        if let Some(layout) = first.and_then(|entry| self.layouts.get(entry.layout)) {
            self.summary.fields = layout.field_infos();
            self.summary.point_bytes = layout.point_bytes();
        }
    }

    /// Finds the field with the times and what they mean, and gives up the scans that lack it.
    fn decide_time(&mut self, point_time: PointTime) -> Result<(), LogError> {
        let first = self.entries.iter().find(|entry| entry.returns > 0);
        let Some(layout) = first.and_then(|entry| self.layouts.get(entry.layout)) else { return Ok(()) };
        let fields =
            candidates(&layout.names()).into_iter().map(|(_, name)| name.to_owned()).collect::<Vec<_>>();
        let found = match (point_time, fields.first()) {
            (PointTime::Ignore, Some(field)) => {
                self.summary
                    .notes
                    .push(format!("field `{field}`: not used as the time of a point, as was asked"));
                None
            }
            (PointTime::Auto | PointTime::Ignore, None) => None,
            (PointTime::Auto, Some(_)) => self.find_time(&fields)?,
            (PointTime::Relative(_) | PointTime::Absolute(_), field) => {
                let Some(field) = field else {
                    let problem = format!(
                        "--point-time {point_time} was given, but the points have no field for a time among [{}]",
                        layout.names().join(", ")
                    );
                    return Err(LogError::Option { path: self.path.clone(), problem });
                };
                TimeRule::given(point_time).map(|rule| (field.clone(), rule, "as was said".to_owned()))
            }
        };
        let Some((field, rule, evidence)) = found else { return Ok(()) };
        self.summary.point_times = Some(format!("field `{field}`: {}, {evidence}", rule.words()));
        let (layouts, damage) = (&self.layouts, &mut self.summary.damage);
        self.entries.retain(|entry| {
            let has = |layout: &Layout| layout.field(&field).is_some();
            let kept = entry.returns == 0 || layouts.get(entry.layout).is_some_and(has);
            if !kept {
                let place = format!("message {} (byte {})", entry.message, entry.location.record_at);
                let what = format!("no field `{field}`, which the log's first scan has; the scan is skipped");
                damage.push(Damage { place, what });
            }
            kept
        });
        self.time = Some((field, rule));
        Ok(())
    }

    /// Judges the fields by a sample of scans: the first three, the middle and the last with returns.
    fn find_time(&mut self, fields: &[String]) -> Result<Option<(String, TimeRule, String)>, LogError> {
        let filled: Vec<usize> = (0..self.entries.len())
            .filter(|&k| self.entries.get(k).is_some_and(|entry| entry.returns > 0))
            .collect();
        let mut chosen: Vec<usize> = filled.iter().copied().take(SAMPLED_SCANS - 2).collect();
        chosen.extend(filled.get(filled.len() / 2));
        chosen.extend(filled.last());
        chosen.dedup();
        let mut samples: Vec<Vec<SampledScan>> = vec![Vec::new(); fields.len()];
        let mut reader = McapReader::new(self)?;
        for frame in chosen {
            reader.with_cloud(frame, |cloud| {
                for (field, sample) in fields.iter().zip(&mut samples) {
                    let extremes = cloud.layout.field(field).and_then(|field| cloud.extremes(field));
                    if let Some((smallest, largest)) = extremes {
                        sample.push(SampledScan { stamp_ns: cloud.stamp_ns, smallest, largest });
                    }
                }
            })?;
        }
        drop(reader);
        let period_ns = self.summary.period_ns.unwrap_or_else(|| {
            self.summary.notes.push("too few stamps to tell the scan period: 0.1 s is taken".into());
            USUAL_PERIOD_NS
        });
        let mut unclear = None;
        for (field, sample) in fields.iter().zip(&samples) {
            match find_rule(sample, period_ns) {
                Finding::Rule(rule, span_ns) => {
                    let evidence = format!("a scan spans {:.4} s", span_ns / 1e9);
                    return Ok(Some((field.clone(), rule, evidence)));
                }
                Finding::Constant => {
                    let note =
                        format!("field `{field}` is the same for all points of a scan: no times of points");
                    self.summary.notes.push(note);
                }
                Finding::Unclear(problem) => unclear = unclear.or(Some((field, problem))),
            }
        }
        match unclear {
            None => Ok(None),
            Some((field, problem)) => {
                let field = format!("in field `{field}`");
                Err(LogError::PointTime { path: self.path.clone(), field, problem })
            }
        }
    }
}

fn choose_topic(
    path: &Path,
    mut clouds: std::collections::BTreeMap<String, TopicIndex>,
    wanted: Option<&str>,
    topics: &[crate::TopicInfo],
) -> Result<(String, TopicIndex), LogError> {
    let all = || channels::in_words(topics);
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
        return Err(LogError::SeveralTopics { path: path.into(), topics: channels::in_words(&readable) });
    }
    clouds.pop_first().ok_or_else(|| LogError::NoCloudTopic { path: path.into(), topics: all() })
}

impl ScanLog for McapLog {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(McapReader::new(self)?))
    }

    fn groups(&self) -> Vec<Range<usize>> {
        if self.entries.iter().all(|entry| entry.location.in_chunk.is_none()) {
            return runs_of_eight(self.entries.len());
        }
        let mut start = 0;
        let same_chunk = |a: &Entry, b: &Entry| a.location.record_at == b.location.record_at;
        let chunks = self.entries.chunk_by(same_chunk);
        chunks
            .map(|chunk| {
                let group = start..start + chunk.len();
                start = group.end;
                group
            })
            .collect()
    }
}

/// Reads scans of an [`McapLog`]; keeps the chunk it read last.
#[derive(Debug)]
struct McapReader<'a> {
    log: &'a McapLog,
    source: Source,
    decoder: ChunkDecoder,
    /// The chunk that the decoder holds.
    chunk_at: Option<u64>,
    message: Vec<u8>,
}

impl<'a> McapReader<'a> {
    fn new(log: &'a McapLog) -> Result<Self, LogError> {
        let source = Source::open(&log.path).map_err(|e| LogError::io(&log.path, "open", e))?;
        Ok(Self { log, source, decoder: ChunkDecoder::default(), chunk_at: None, message: Vec::new() })
    }

    fn with_cloud(&mut self, frame: usize, use_it: impl FnOnce(&Cloud<'_>)) -> Result<(), LogError> {
        let path = &self.log.path;
        let malformed = |problem: String| LogError::malformed(path, Place::Frame(frame as u64), problem);
        let Some(entry) = self.log.entries.get(frame) else {
            return Err(malformed(format!("the log has {} scans", self.log.entries.len())));
        };
        let location = entry.location;
        let body = if let Some(place) = location.in_chunk {
            if self.chunk_at != Some(location.record_at) {
                self.chunk_at = None;
                match self.decoder.decode(&mut self.source, location.record_at, location.record_bytes) {
                    Ok(_) => self.chunk_at = Some(location.record_at),
                    Err(ChunkFault::Io(error)) => return Err(LogError::io(path, "read", error)),
                    Err(ChunkFault::Damaged(problem)) => {
                        return Err(malformed(format!(
                            "the chunk at byte {} was whole and is not any more: {problem}",
                            location.record_at
                        )));
                    }
                }
            }
            let rest = self.decoder.records().get(place as usize..).unwrap_or_default();
            rest.get(..location.body_bytes as usize).unwrap_or_default()
        } else {
            let read = self.source.read_into(
                location.record_at + HEAD_BYTES,
                location.body_bytes,
                &mut self.message,
            );
            read.map_err(|e| LogError::io(path, "read", e))?;
            &self.message
        };
        let changed = || malformed("the file has changed since it was opened".into());
        let (_, message) = split_message(body).ok_or_else(changed)?;
        let cloud = Cloud::parse(message).map_err(malformed)?;
        if cloud.returns() != entry.returns || cloud.stamp_ns != entry.stamp_ns {
            return Err(changed());
        }
        use_it(&cloud);
        Ok(())
    }
}

impl ScanReader for McapReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        scan.clear();
        let time = self.log.time.as_ref();
        self.with_cloud(frame, |cloud| {
            let of_field = |(name, rule): &(String, TimeRule)| -> Option<(Field, TimeRule)> {
                Some((cloud.layout.field(name)?, *rule))
            };
            cloud.append_to(time.and_then(of_field), scan);
        })
    }
}
