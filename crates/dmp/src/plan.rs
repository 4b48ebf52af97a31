use dmp_log::ScanLog;
use dmp_sensor::{EgoMask, Isometry3, ReturnFilter, Track};

use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::survey;
use crate::watch::Watch;

/// Share of the scans that must have a pose in a run; below, the two hardly belong together.
const MIN_POSED_SHARE: f64 = 0.05;
/// Longest segment of the drive, metres, and how many a short drive is cut into.
const SEGMENT_M: f64 = 12.0;
const SEGMENTS: f64 = 16.0;
/// With fewer segments, or less travel, every scan is a segment of its own.
const MIN_SEGMENTS: usize = 8;
const MIN_TRAVEL_M: f64 = 1.0;

/// What is decided before anything is scored, once for all runs: the scans, the returns, the voxel, the
/// segments.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The scans that have a pose in every run, in order of time.
    pub frames: Vec<PlannedFrame>,
    /// How each run's poses are found.
    pub pairings: Vec<Pairing>,
    /// Scans without a pose, for each run.
    pub without_pose: Vec<usize>,
    /// Returns of scans that were not asked for, and of scans without a pose in some run.
    pub unselected_returns: u64,
    /// Returns of scans that lack a pose in some run.
    pub unposed_returns: u64,
    /// Scans that were not asked for.
    pub unselected: usize,
    /// Whether the log's stamps go backwards somewhere.
    pub out_of_order: usize,
    /// How the drive is cut.
    pub segments: Segments,
    /// Which returns are used.
    pub filter: ReturnFilter,
    /// The voxel edge and how it was chosen.
    pub voxel: VoxelChoice,
    /// Longest gap between poses that is interpolated over, for each run, nanoseconds.
    pub max_gaps_ns: Vec<i64>,
}

/// A scan to be scored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlannedFrame {
    /// Its index in the log.
    pub frame: usize,
    /// Its stamp with the time offset, nanoseconds; `None` where the log has none.
    pub stamp_ns: Option<i64>,
    /// Returns in it, used or not.
    pub returns: u64,
    /// Segment of the drive.
    pub segment: i32,
}

/// How a run's poses are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pairing {
    /// By the time of each return.
    ByStamp,
    /// The n-th pose belongs to the n-th scan; times of returns count from the pose's stamp, where it
    /// has one.
    ByLine,
}

/// How the drive is cut into segments, the same for all runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Segments {
    /// Length asked for or found, metres; `None` where every scan is a segment of its own.
    pub length_m: Option<f64>,
    /// Ordinals of the frames that begin a segment.
    pub starts: Vec<usize>,
    /// The median over the runs of the way from scan to scan, added up, metres.
    pub travel_m: f64,
}

/// The voxel edge and why it is that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoxelChoice {
    /// The edge v, metres.
    pub voxel_m: f64,
    /// Share of returns in voxels with three or more in the sampled blocks; `None` where it was given.
    pub filled_share: Option<f64>,
}

impl Plan {
    /// Looks at log and runs and decides, for settings that were checked. Reads a sample of scans.
    ///
    /// # Errors
    /// When the settings make no sense, a run and the log do not belong together, or nothing is left.
    pub fn new(
        log: &dyn ScanLog,
        runs: &[Run],
        config: &Config,
        watch: &dyn Watch,
    ) -> Result<Self, EvaluateError> {
        check_runs(runs)?;
        let path = &log.summary().path;
        if log.frames().is_empty() {
            return Err(EvaluateError::NoScans { path: path.clone() });
        }
        let pairings = runs.iter().map(|run| pairing_of(log, run)).collect::<Result<Vec<_>, _>>()?;
        let max_gaps_ns: Vec<i64> =
            runs.iter().map(|run| config.max_time_gap_ns.unwrap_or_else(|| auto_gap_ns(run))).collect();
        let tracks: Vec<Track<'_>> = runs
            .iter()
            .zip(&max_gaps_ns)
            .map(|(run, &gap_ns)| Track::new(&run.trajectory, config.body_from_sensor, gap_ns))
            .collect();

        let selection = select(log, runs, &tracks, &pairings, config)?;
        let poses = |frame: &PlannedFrame, run: usize| {
            pose_of_frame(&tracks[run], pairings[run], frame).map(|pose| pose.translation.vector)
        };
        let steps_m: Vec<f64> = selection
            .frames
            .windows(2)
            .map(|pair| {
                let step = |run| Some((poses(&pair[1], run)? - poses(&pair[0], run)?).norm());
                median((0..runs.len()).filter_map(step).collect())
            })
            .collect();
        let mut frames = selection.frames;
        let segments = cut_segments(&steps_m, config.segment_m, &mut frames);

        let mut plan = Self {
            frames,
            pairings,
            without_pose: selection.without_pose,
            unselected_returns: selection.unselected_returns,
            unposed_returns: selection.unposed_returns,
            unselected: selection.unselected,
            out_of_order: selection.out_of_order,
            segments,
            filter: ReturnFilter {
                min_range_m: config.min_range_m,
                max_range_m: config.max_range_m,
                ego: EgoMask::default(),
            },
            voxel: VoxelChoice { voxel_m: 0.0, filled_share: None },
            max_gaps_ns,
        };
        survey::complete(&mut plan, log, runs, config, watch)?;
        Ok(plan)
    }

    /// The runs' tracks, with the gaps of this plan.
    pub(crate) fn tracks<'a>(&self, runs: &'a [Run], config: &Config) -> Vec<Track<'a>> {
        let gaps = runs.iter().zip(&self.max_gaps_ns);
        gaps.map(|(run, &gap_ns)| Track::new(&run.trajectory, config.body_from_sensor, gap_ns)).collect()
    }

    /// Returns of all planned scans, used or not.
    pub fn returns(&self) -> u64 {
        self.frames.iter().map(|frame| frame.returns).sum()
    }
}

/// The sensor's pose at the stamp of a frame (or in its line).
pub(crate) fn pose_of_frame(
    track: &Track<'_>,
    pairing: Pairing,
    frame: &PlannedFrame,
) -> Option<Isometry3<f64>> {
    match pairing {
        Pairing::ByStamp => track.world_from_sensor_at(frame.stamp_ns?),
        Pairing::ByLine => track.world_from_sensor_of_line(frame.frame),
    }
}

/// What a run cannot be called: the words that stand for no run in a report's verdicts.
const RESERVED_NAMES: [&str; 2] = ["mixed", "undecided"];

fn check_runs(runs: &[Run]) -> Result<(), EvaluateError> {
    if runs.is_empty() {
        return Err(EvaluateError::NoRuns);
    }
    for (k, run) in runs.iter().enumerate() {
        if runs[..k].iter().any(|other| other.name == run.name) {
            return Err(EvaluateError::SameName { name: run.name.clone() });
        }
        if RESERVED_NAMES.contains(&run.name.as_str()) {
            return Err(EvaluateError::ReservedName { name: run.name.clone() });
        }
    }
    Ok(())
}

fn pairing_of(log: &dyn ScanLog, run: &Run) -> Result<Pairing, EvaluateError> {
    let scans = log.frames().len();
    let log_stamped = log.frames().iter().all(|frame| frame.stamp_ns.is_some());
    let which = match (log_stamped, run.trajectory.stamps_ns().is_some()) {
        (true, true) => return Ok(Pairing::ByStamp),
        (true, false) => "in the trajectory",
        (false, true) => "in the log",
        (false, false) => "in either",
    };
    let poses = run.trajectory.len();
    if poses == scans {
        Ok(Pairing::ByLine)
    } else {
        Err(EvaluateError::LinePairing { run: run.name.clone(), poses, scans, which })
    }
}

fn auto_gap_ns(run: &Run) -> i64 {
    const SECOND_NS: i64 = 1_000_000_000;
    let stamps = run.trajectory.stamps_ns().unwrap_or_default();
    let mut steps: Vec<i64> = stamps.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    steps.sort_unstable();
    let median_ns = steps.get(steps.len() / 2).copied().unwrap_or(0);
    median_ns.saturating_mul(3).max(SECOND_NS)
}

struct Selection {
    frames: Vec<PlannedFrame>,
    without_pose: Vec<usize>,
    unselected: usize,
    unselected_returns: u64,
    unposed_returns: u64,
    out_of_order: usize,
}

/// The scans that were asked for and have a pose in every run.
fn select(
    log: &dyn ScanLog,
    runs: &[Run],
    tracks: &[Track<'_>],
    pairings: &[Pairing],
    config: &Config,
) -> Result<Selection, EvaluateError> {
    let mut selection = Selection {
        frames: Vec::new(),
        without_pose: vec![0; runs.len()],
        unselected: 0,
        unselected_returns: 0,
        unposed_returns: 0,
        out_of_order: 0,
    };
    for (frame, info) in log.frames().iter().enumerate() {
        if frame % config.every != 0 {
            selection.unselected += 1;
            selection.unselected_returns += info.returns;
            continue;
        }
        let stamp_ns = info.stamp_ns.map(|stamp_ns| stamp_ns.saturating_add(config.time_offset_ns));
        let planned = PlannedFrame { frame, stamp_ns, returns: info.returns, segment: 0 };
        let mut posed = true;
        for (run, track) in tracks.iter().enumerate() {
            if pose_of_frame(track, pairings[run], &planned).is_none() {
                selection.without_pose[run] += 1;
                posed = false;
            }
        }
        if posed {
            selection.frames.push(planned);
        } else {
            selection.unposed_returns += info.returns;
        }
    }
    let asked = log.frames().len() - selection.unselected;
    for (k, run) in runs.iter().enumerate() {
        let found = asked - selection.without_pose[k];
        if found == 0 || (found as f64) < MIN_POSED_SHARE * asked as f64 {
            let why = why_no_overlap(log, run, config);
            return Err(EvaluateError::NoOverlap { run: run.name.clone(), found, scans: asked, why });
        }
    }
    if selection.frames.is_empty() {
        return Err(EvaluateError::NothingInCommon);
    }
    selection.out_of_order =
        selection.frames.windows(2).filter(|pair| pair[1].stamp_ns < pair[0].stamp_ns).count();
    selection.frames.sort_by_key(|frame| (frame.stamp_ns, frame.frame));
    Ok(selection)
}

fn why_no_overlap(log: &dyn ScanLog, run: &Run, config: &Config) -> String {
    let (Some((first, last)), Some([start, .., end])) = (log.summary().span_ns, run.trajectory.stamps_ns())
    else {
        return "the trajectory holds too few poses".to_owned();
    };
    let (first, last) =
        (first.saturating_add(config.time_offset_ns), last.saturating_add(config.time_offset_ns));
    let s = |ns: i64| ns as f64 / 1e9;
    let spans = format!(
        "the log spans {:.3} to {:.3} s, the trajectory {:.3} to {:.3} s",
        s(first),
        s(last),
        s(*start),
        s(*end)
    );
    let gap_ns = start.saturating_sub(last).max(first.saturating_sub(*end));
    if gap_ns > 0 {
        let shift_s = s(start.saturating_sub(first));
        format!(
            "{spans}; they are {:.3} s apart. If their clocks differ, shift the log's: --time-offset {shift_s:.3}",
            s(gap_ns)
        )
    } else {
        format!("{spans}; gaps in the trajectory longer than --max-time-gap are not interpolated over")
    }
}

fn cut_segments(steps_m: &[f64], segment_m: Option<f64>, frames: &mut [PlannedFrame]) -> Segments {
    let travel_m: f64 = steps_m.iter().sum();
    let length_m = segment_m.unwrap_or(SEGMENT_M.min(travel_m / SEGMENTS));
    let mut starts = vec![0];
    if travel_m >= MIN_TRAVEL_M && length_m > 0.0 {
        let (mut along_m, mut cell) = (0.0, 0.0);
        for (ordinal, step_m) in (1..).zip(steps_m) {
            along_m += step_m;
            let here = (along_m / length_m).floor();
            if here > cell {
                starts.push(ordinal);
                cell = here;
            }
        }
    }
    let by_travel = starts.len() >= MIN_SEGMENTS;
    if !by_travel {
        starts = (0..frames.len()).collect();
    }
    let mut segment = -1;
    let mut next = starts.iter().peekable();
    for (ordinal, frame) in frames.iter_mut().enumerate() {
        if next.next_if(|&&start| start == ordinal).is_some() {
            segment += 1;
        }
        frame.segment = segment;
    }
    Segments { length_m: by_travel.then_some(length_m), starts, travel_m }
}

/// The middle value; the mean of the two middle ones of an even number; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.as_slice() {
        [] => 0.0,
        v if v.len() % 2 == 1 => v[v.len() / 2],
        v => 0.5 * (v[v.len() / 2 - 1] + v[v.len() / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(count: usize) -> Vec<PlannedFrame> {
        (0..count).map(|frame| PlannedFrame { frame, stamp_ns: None, returns: 1, segment: 0 }).collect()
    }

    #[test]
    fn a_drive_is_cut_every_twelve_metres() {
        let mut planned = frames(401);
        let segments = cut_segments(&[1.0; 400], None, &mut planned);
        assert_eq!((segments.length_m, segments.starts.len()), (Some(12.0), 34));
        assert_eq!((planned[11].segment, planned[12].segment, planned[400].segment), (0, 1, 33));
    }

    #[test]
    fn a_short_way_gives_sixteen_segments_and_a_stand_none() {
        let mut planned = frames(129);
        assert_eq!(cut_segments(&[0.25; 128], None, &mut planned).length_m, Some(2.0));
        assert_eq!(planned[128].segment, 16);
        let standing = cut_segments(&[0.001; 128], None, &mut planned);
        assert_eq!(standing.length_m, None);
        assert!(planned.iter().enumerate().all(|(k, frame)| frame.segment == k as i32));
    }

    #[test]
    fn scans_further_apart_than_a_segment_are_neighbours_still() {
        let mut planned = frames(21);
        cut_segments(&[30.0; 20], None, &mut planned);
        assert!(planned.iter().enumerate().all(|(k, frame)| frame.segment == k as i32));
    }

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![3.0, 1.0]), 2.0);
        assert_eq!(median(vec![]), 0.0);
    }
}
