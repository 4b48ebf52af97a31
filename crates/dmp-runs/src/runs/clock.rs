//! Converts the stamps of a run's poses to the log's clock.
//!
//! SLAM systems stamp a pose like its scan but mean the scan's start, middle or end. Their clocks lag behind
//! the log's, or they omit stamps, and the n-th pose is that of the n-th scan. This module converts all of
//! them to poses at times of the log. So every return of every run is posed by the same rule: between the
//! poses at its own time.

use dmp_report::Pairing;
use dmp_sensor::Trajectory;

use crate::asked::{EvaluateError, Run, Settings};
use crate::runs::heads::Heads;

/// A run's poses at times of the log.
#[derive(Debug, Clone)]
pub struct OnClock {
    pub pairing: Pairing,
    pub trajectory: Trajectory,
    /// Shift from its own stamps to those of the poses, nanoseconds.
    pub shift_ns: i64,
    /// The scan period of the log, nanoseconds.
    pub period_ns: Option<i64>,
    /// From the stamp of a scan to its first and its last return, nanoseconds.
    pub sweep_ns: [i64; 2],
}

/// Converts the poses of a run, given in some frame as `trajectory`, to the log's clock. Poses without stamps
/// get those of their scans, if these have any.
///
/// # Errors
/// When scans and poses can be paired neither by stamp nor line by line, or a time is out of range.
pub fn on_log_clock(
    heads: Heads<'_>,
    run: &Run,
    trajectory: Trajectory,
    settings: &Settings,
) -> Result<OnClock, EvaluateError> {
    let pairing = pairing_of(heads, run)?;
    // The offset for all runs is already in the scans' stamps, if they have any.
    let added_ns = if heads.summary().span_ns.is_some() { settings.time_offset_ns } else { 0 };
    let trajectory = match trajectory.stamps_ns() {
        Some(_) => trajectory,
        None => with_stamps(heads, run, trajectory, added_ns)?,
    };
    let later_ns = added_ns.saturating_sub(settings.time_offset_ns(run));
    let shift_ns = run.instant().after_stamp_ns(heads.summary()).saturating_add(later_ns);
    let beyond = || EvaluateError::BeyondTimes { run: run.name.clone(), shift_s: shift_ns as f64 / 1e9 };
    let trajectory = trajectory.later_by(shift_ns).ok_or_else(beyond)?;
    let (period_ns, sweep_ns) = (heads.summary().period_ns, heads.summary().sweep_ns);
    Ok(OnClock { pairing, trajectory, shift_ns, period_ns, sweep_ns })
}

fn pairing_of(heads: Heads<'_>, run: &Run) -> Result<Pairing, EvaluateError> {
    let scans = heads.scans_in_log();
    let log_stamped = heads.scans().all(|(_, info)| info.stamp_ns.is_some());
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

/// Poses without stamps, at those of their scans; unchanged if no stamps are known.
fn with_stamps(
    heads: Heads<'_>,
    run: &Run,
    trajectory: Trajectory,
    added_ns: i64,
) -> Result<Trajectory, EvaluateError> {
    let Some(stamps_ns) = stamps_of_lines(heads) else { return Ok(trajectory) };
    let stamps_ns: Vec<i64> = stamps_ns.into_iter().map(|ns| ns.saturating_add(added_ns)).collect();
    if let Some(line) = stamps_ns.windows(2).position(|pair| pair[1] <= pair[0]) {
        if !heads.summary().has_point_times() {
            // Scans that are instants need no stamps.
            return Ok(trajectory);
        }
        let (run, scan) = (run.name.clone(), line + 1);
        return Err(EvaluateError::LinesOutOfTime { run, scan, stamp_s: stamps_ns[scan] as f64 / 1e9 });
    }
    let poses = stamps_ns.into_iter().zip(trajectory.poses().iter().copied()).collect();
    // They ascend.
    Ok(Trajectory::stamped(poses).map_or(trajectory, |stamped| stamped.trajectory))
}

/// The stamps of all scans of the log; `None` if scans have none.
fn stamps_of_lines(heads: Heads<'_>) -> Option<Vec<i64>> {
    let known: Option<Vec<(usize, i64)>> =
        heads.scans().map(|(number, info)| Some((number, info.stamp_ns?))).collect();
    filled(&known?, heads.scans_in_log(), heads.summary().period_ns.unwrap_or(0))
}

/// The stamps of `scans` scans, some of them known: the others are interpolated, or extrapolated by the
/// period.
fn filled(known: &[(usize, i64)], scans: usize, period_ns: i64) -> Option<Vec<i64>> {
    let (first, last) = (*known.first()?, *known.last()?);
    let steps = |lines: usize| period_ns.saturating_mul(i64::try_from(lines).unwrap_or(i64::MAX));
    let mut stamps_ns: Vec<i64> = Vec::with_capacity(scans);
    stamps_ns.extend((0..first.0).map(|line| first.1.saturating_sub(steps(first.0 - line))));
    stamps_ns.push(first.1);
    for pair in known.windows(2) {
        let [(line, from_ns), (next, to_ns)] = [pair[0], pair[1]];
        let between = |k: usize| {
            let share = (k - line) as f64 / next.saturating_sub(line).max(1) as f64;
            from_ns.saturating_add((share * to_ns.saturating_sub(from_ns) as f64) as i64)
        };
        stamps_ns.extend((line + 1..next).map(between));
        stamps_ns.push(to_ns);
    }
    stamps_ns.extend((last.0 + 1..scans).map(|line| last.1.saturating_add(steps(line - last.0))));
    (stamps_ns.len() == scans).then_some(stamps_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asked::Config;
    use dmp_log::MemoryLog;
    use dmp_reduce::Scales;
    use dmp_report::PoseAt;
    use dmp_sensor::{Isometry3, Scan};

    fn log(stamps_ns: &[Option<i64>]) -> MemoryLog {
        let scan = |&stamp_ns: &Option<i64>| Scan {
            stamp_ns,
            points_in_sensor_m: vec![[1.0, 0.0, 0.0]; 3],
            time_offsets_ns: vec![2, 4, 10],
        };
        MemoryLog::new("memory", stamps_ns.iter().map(scan).collect()).unwrap()
    }

    fn poses(count: usize) -> Vec<Isometry3<f64>> {
        (0..count).map(|k| Isometry3::translation(k as f64, 0.0, 0.0)).collect()
    }

    fn on_clock(log: &MemoryLog, run: &Run) -> Result<OnClock, EvaluateError> {
        let config = Config { time_offset_ns: 1000, ..Config::default() };
        let settings = config.on_scales(Scales::Drive).unwrap().0;
        on_log_clock(Heads::Log(log), run, run.trajectory.clone(), &settings)
    }

    fn unstamped(count: usize) -> Run {
        Run::new("a", Trajectory::unstamped(poses(count)).unwrap())
    }

    #[test]
    fn poses_without_stamps_have_those_of_their_scans() {
        let log = log(&[Some(100), Some(200), Some(300)]);
        for (pose_at, stamps_ns) in [
            (PoseAt::Stamp, [1100, 1200, 1300]),
            (PoseAt::Start, [1102, 1202, 1302]),
            (PoseAt::Middle, [1106, 1206, 1306]),
            (PoseAt::End, [1110, 1210, 1310]),
        ] {
            let placed = on_clock(&log, &Run { pose_at: Some(pose_at), ..unstamped(3) }).unwrap();
            assert_eq!(placed.trajectory.stamps_ns(), Some(&stamps_ns[..]));
            assert_eq!((placed.pairing, placed.shift_ns), (Pairing::ByLine, stamps_ns[0] - 1100));
            assert_eq!(pose_at.to_string().parse(), Ok(pose_at));
        }
        assert!("later".parse::<PoseAt>().unwrap_err().contains("start, middle, end or stamp"));
        assert!(matches!(on_clock(&log, &unstamped(4)), Err(EvaluateError::LinePairing { .. })));
    }

    #[test]
    fn an_offset_of_a_run_takes_the_place_of_that_of_all() {
        let log = log(&[Some(100), Some(200)]);
        let stamped = Trajectory::stamped(vec![(0, poses(1)[0]), (500, poses(1)[0])]).unwrap().trajectory;
        let run = Run::new("a", stamped);
        let shift_ns = |run: &Run| on_clock(&log, run).unwrap().shift_ns;
        // The offset for all runs is in the stamps of the scans.
        assert_eq!(shift_ns(&run), 0);
        assert_eq!(shift_ns(&Run { time_offset_ns: Some(1000), ..run.clone() }), 0);
        assert_eq!(shift_ns(&Run { time_offset_ns: Some(1700), ..run.clone() }), -700);
        let beyond = Run { time_offset_ns: Some(i64::MIN), ..run };
        assert!(matches!(on_clock(&log, &beyond), Err(EvaluateError::BeyondTimes { .. })));
    }

    #[test]
    fn without_any_stamp_there_is_none() {
        let log = log(&[None, None]);
        let stamped = Trajectory::stamped(vec![(5, poses(1)[0]), (9, poses(1)[0])]).unwrap().trajectory;
        // Here no scan has a stamp that includes the offset for all runs.
        assert_eq!(on_clock(&log, &Run::new("a", stamped)).unwrap().shift_ns, -1000);
        assert_eq!(on_clock(&log, &unstamped(2)).unwrap().trajectory.stamps_ns(), None);
    }

    #[test]
    fn lines_out_of_time_are_reported_where_they_matter() {
        let error = on_clock(&log(&[Some(100), Some(300), Some(300)]), &unstamped(3)).unwrap_err();
        let EvaluateError::LinesOutOfTime { scan, .. } = error else { panic!("{error}") };
        assert_eq!(scan, 2);
        let instants = [100, 300, 300].map(|ns| Scan { stamp_ns: Some(ns), ..Scan::default() });
        let instants = MemoryLog::new("memory", instants.into()).unwrap();
        assert_eq!(on_clock(&instants, &unstamped(3)).unwrap().trajectory.stamps_ns(), None);
    }

    #[test]
    fn scans_that_cannot_be_read_lie_between_their_neighbours() {
        assert_eq!(filled(&[(1, 10), (4, 40)], 6, 9), Some(vec![1, 10, 20, 30, 40, 49]));
        assert_eq!(filled(&[], 6, 9), None);
    }
}
