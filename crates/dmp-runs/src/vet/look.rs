//! Vets one run with a few scans of the log.

use dmp_reduce::Confidence;
use dmp_report::PoseAt;
use dmp_revisit::calibrate::{
    Axis, Block, Calibration, Mount, Order, Together, calibrate, instant, times_as_often, together,
    together_in_turns, together_of_blocks,
};

use super::found::{Doubt, DoubtTest, Found};
use super::mend::{Mend, rounded, rounded_ns};
use super::readings::{self, Reading};
use crate::asked::{EvaluateError, Run, Settings};
use crate::runs::{Heads, Selection, on_log_clock, own_frame};

/// Confidence required before an error is reported.
const CONFIDENCE: f64 = 0.999;
/// Another interpretation is chosen if the scans fit better by this factor, and by this share of the returns.
/// Correct inputs gain less than a hundredth from any, wrong ones half as much again and more.
const BETTER_BY: f64 = 1.25;
const BETTER_BY_SHARE: f64 = 0.1;
/// What is misread is misread all the way: where more than this share of the blocks fits better as given, by
/// [`BETTER_BY_SHARE`], the run is wrong in another way. One that loses its way half through stands still as millimetres.
const MOST_WORSE: f64 = 0.1;
/// One block in so many is enough to see that an interpretation is not worth all: there it must fit better by this factor.
const FEW: usize = 4;
const WORTH_BY: f64 = 1.1;
/// An interpretation in which the vehicle travels less than this part of its path proves nothing: scans of
/// one place always fit together.
const LEAST_WAY: f64 = 0.5;
/// Poses that belong to the scans fit them better than those of other scans, and in turns better than without the turns:
/// by this factor at least. The first is tested only where the path within a block is longer than this, metres of a drive.
const RELATED_BY: f64 = 1.02;
const WAY_THAT_TELLS_M: f64 = 2.0;
/// With fewer blocks, or turns, it may be chance.
const FEWEST_BLOCKS: usize = 12;
const TURNS_THAT_TELL: usize = 6;
/// Poses that are off by more from the path between their neighbours, metres of a drive, fit no better than others': that
/// is noise, and contradicts nothing. A rotation counts at the other distance.
const JITTER_M: f64 = 0.1;
const REACH_M: f64 = 10.0;
/// An estimated offset this near to an instant of the scan counts as that instant, nanoseconds.
const NEAR_NS: i64 = 4_000_000;

/// Whether a share of returns that meet is larger by so much that no correct input gains as much.
pub(super) fn is_better_share(other: f64, given: f64) -> bool {
    other > BETTER_BY * given && other > BETTER_BY_SHARE + given
}

/// Whether it is to be found at which instant of a scan the poses of a run hold.
pub(super) fn has_open_instant(run: &Run) -> bool {
    run.trajectory.stamps_ns().is_none() && run.pose_at.is_none()
}

/// The log by which runs are vetted.
pub(super) struct Look<'a> {
    pub(super) heads: Heads<'a>,
    pub(super) settings: &'a Settings,
    pub(super) blocks: &'a [Block],
    /// Those that show at which instant poses without stamps hold.
    pub(super) of_instant: &'a [Block],
}

impl Look<'_> {
    /// Vets a run: finds its errors, and estimates clock offset and extrinsic.
    pub(super) fn at(&self, run: &Run) -> Result<Found, EvaluateError> {
        let mut found = Found {
            name: run.name.clone(),
            together: None,
            together_as_read: None,
            calibration: None,
            mends: Vec::new(),
            instant: None,
            can_be_mended: true,
            is_at_odds: false,
            not_paired: None,
            is_thin: false,
            doubt: None,
        };
        // On its own: whether it has poses for the scans.
        let frames = Selection::new(self.heads, self.settings)?.frames;
        let alone =
            own_frame::place(self.heads, &frames, std::slice::from_ref(run), vec![None], self.settings);
        if let Err(error) = alone {
            return match error {
                EvaluateError::LinePairing { .. }
                | EvaluateError::LinesOutOfTime { .. }
                | EvaluateError::BeyondTimes { .. }
                | EvaluateError::NoOverlap { .. }
                | EvaluateError::TooSparse { .. } => {
                    found.not_paired = Some(Box::new(error));
                    Ok(found)
                }
                error => Err(error),
            };
        }
        let Some(given) = self.together(run, 1)? else { return Ok(found) };
        found.together = Some(given.share());
        found.is_thin = given.is_too_thin();
        if found.is_thin {
            return Ok(found);
        }
        let mut read = run.clone();
        if let Some((better, reading)) = self.best_reading(run, given)? {
            found.together_as_read = Some(better.share());
            found.can_be_mended = !(run.is_carried && matches!(reading.mend, Mend::PosesAs(_)));
            found.mends.push(reading.mend);
            read = reading.mend.applied_to(run).unwrap_or(read);
        }
        found.instant = self.instant(&read)?;
        read.pose_at = found.instant.or(read.pose_at);
        found.calibration = self.calibrate(&read)?;
        Ok(found)
    }

    /// The instant of the scans at which the poses of a run without stamps hold, where none was chosen and the scans show
    /// beyond doubt that it is not that of their stamps.
    fn instant(&self, run: &Run) -> Result<Option<PoseAt>, EvaluateError> {
        let instants: Vec<(PoseAt, f64)> = PoseAt::ALL
            .into_iter()
            .map(|at| (at, -(at.after_stamp_ns(self.heads.summary()) as f64) / 1e9))
            .filter(|(_, later_s)| *later_s != 0.0)
            .collect();
        if !has_open_instant(run) || instants.is_empty() || self.settings.time_offset_ns(run) != 0 {
            return Ok(None);
        }
        let later_s: Vec<f64> = instants.iter().map(|(_, later_s)| *later_s).collect();
        let metre_m = self.settings.metre_m();
        let found = |mount: &Mount<'_>| instant(self.of_instant, mount, metre_m, &later_s, certain());
        Ok(self.mounted(run, found)?.map(|k| instants[k].0))
    }

    /// What suggests that a run has the poses of another log, whatever is fixed.
    pub(super) fn doubt_of(&self, found: &Found, run: &Run) -> Result<Option<Doubt>, EvaluateError> {
        let is_looked_at = found.not_paired.is_none() && !found.is_thin;
        if is_looked_at { self.doubt(&found.fixed(run)) } else { Ok(None) }
    }

    fn doubt(&self, run: &Run) -> Result<Option<Doubt>, EvaluateError> {
        let metre_m = self.settings.metre_m();
        self.mounted(run, |mount| {
            let [own, other] = [Order::Own, Order::Reversed]
                .map(|order| together_of_blocks(self.blocks, mount, order, metre_m));
            let way_m: f64 = own.iter().map(|block| block.way_m).sum();
            let tells =
                own.len() >= FEWEST_BLOCKS && way_m > WAY_THAT_TELLS_M * metre_m * self.blocks.len() as f64;
            let jitters = mount.trajectory.jitter_m(REACH_M * metre_m) > JITTER_M * metre_m;
            let doubt = |test, own: &[Together], other: &[Together]| {
                let times = times_as_often(own, other, certain())?;
                let together = [own, other].map(share_of);
                let is_certain = !jitters && times.high() < RELATED_BY;
                (times.value < RELATED_BY).then_some(Doubt { test, together, is_certain })
            };
            let in_turns = together_in_turns(self.blocks, mount, metre_m);
            let poses = || doubt(DoubtTest::OtherPoses, &own, &other);
            let turns = || doubt(DoubtTest::NoTurns, &in_turns[0], &in_turns[1]);
            let turns_tell = in_turns[0].len() >= TURNS_THAT_TELL;
            let doubts = [tells.then(poses).flatten(), turns_tell.then(turns).flatten()];
            doubts.into_iter().flatten().max_by_key(|doubt| doubt.is_certain)
        })
    }

    /// The interpretation with which the scans fit much better, if there is one.
    fn best_reading(&self, run: &Run, given: Together) -> Result<Option<(Together, Reading)>, EvaluateError> {
        let speed_m_per_s = given.way_m / given.way_s.max(1e-3);
        let mut best: Option<(Together, Reading)> = None;
        let few_given = self.together(run, FEW)?.map_or(0.0, |few| few.share());
        for reading in readings::all(run, self.settings, self.heads.summary(), speed_m_per_s) {
            let Some(read) = reading.mend.applied_to(run) else { continue };
            if self.together(&read, FEW)?.is_some_and(|few| few.share() < WORTH_BY * few_given) {
                continue;
            }
            let Some(fit) = self.together(&read, 1)? else { continue };
            let stands = reading.is_shift && fit.way_m < LEAST_WAY * given.way_m;
            // A share of the few returns at the end of the drive does not count.
            let is_whole = 2 * fit.returns > given.returns;
            let better = is_better_share(fit.share(), given.share());
            if !stands
                && is_whole
                && better
                && best.as_ref().is_none_or(|(best, _)| fit.share() > best.share())
                && self.is_all_the_way(run, &read)?
            {
                best = Some((fit, reading));
            }
        }
        Ok(best)
    }

    /// Whether hardly any block fits better as `given` than as `read`.
    fn is_all_the_way(&self, given: &Run, read: &Run) -> Result<bool, EvaluateError> {
        let of_blocks = |run: &Run| {
            self.mounted(run, |mount| {
                Some(together_of_blocks(self.blocks, mount, Order::Own, self.settings.metre_m()))
            })
        };
        let (Some(given), Some(read)) = (of_blocks(given)?, of_blocks(read)?) else { return Ok(false) };
        let both = given.iter().zip(&read).filter(|(given, read)| given.returns > 0 && read.returns > 0);
        let (all, worse) = both.fold((0, 0), |(all, worse), (given, read)| {
            (all + 1, worse + usize::from(given.share() > read.share() + BETTER_BY_SHARE))
        });
        Ok(worse as f64 <= MOST_WORSE * f64::from(all))
    }

    /// The share of returns that meet those of nearby scans; `None` where none can be placed.
    pub(super) fn share(&self, run: &Run) -> Result<Option<f64>, EvaluateError> {
        Ok(self.together(run, 1)?.map(|together| together.share()))
    }

    /// How well the scans of one block in so many fit together.
    fn together(&self, run: &Run, one_in: usize) -> Result<Option<Together>, EvaluateError> {
        self.mounted(run, |mount| {
            let found = together(self.blocks, mount, Order::Own, self.settings.metre_m(), one_in);
            (found.returns > 0).then_some(found)
        })
    }

    fn calibrate(&self, run: &Run) -> Result<Option<Calibration>, EvaluateError> {
        let sweeps = self.heads.summary().has_point_times();
        self.mounted(run, |mount| calibrate(self.blocks, mount, self.settings.metre_m(), sweeps, certain()))
    }

    /// Calls `what` with the run's poses on the log's clock, if scans have times.
    pub(super) fn mounted<T>(
        &self,
        run: &Run,
        what: impl FnOnce(&Mount<'_>) -> Option<T>,
    ) -> Result<Option<T>, EvaluateError> {
        let from_start = run.trajectory.from_its_start();
        let placed = on_log_clock(self.heads, run, from_start, self.settings)?;
        if placed.trajectory.stamps_ns().is_none() {
            return Ok(None);
        }
        Ok(what(&Mount {
            trajectory: &placed.trajectory,
            body_from_sensor: self.settings.body_from_sensor(run),
            max_gap_ns: self.settings.max_time_gap_ns.unwrap_or_else(|| placed.trajectory.usual_gap_ns()),
            later_than_lines_ns: placed.shift_ns,
        }))
    }

    /// Adds the fixes of detected errors. Adds none if points are motion-corrected by this run but not by
    /// others.
    pub(super) fn add_mends(&self, run: &Run, found: &mut Found, points_are_corrected: bool) {
        let Some(calibration) = &found.calibration else { return };
        let pays = |axis: Axis| calibration.of(axis).pays;
        if pays(Axis::Sweep) && !points_are_corrected {
            found.is_at_odds = true;
            return;
        }
        let read = found.fixed(run);
        if pays(Axis::Time) {
            let later_ns = (1e9 * calibration.mended[Axis::Time as usize]).round() as i64;
            let half_ns = (1e9 * calibration.of(Axis::Time).half) as i64;
            let mend = self.clock_mend(&read, later_ns, half_ns, points_are_corrected);
            found.mends.retain(|other| std::mem::discriminant(other) != std::mem::discriminant(&mend));
            found.mends.push(mend);
        }
        if Axis::ALL[2..].iter().any(|&axis| pays(axis)) {
            let given = self.settings.body_from_sensor(&read);
            found.mends.retain(|mend| !matches!(mend, Mend::Extrinsic(_)));
            found.mends.push(Mend::Extrinsic(rounded(&(given * calibration.sensor_motion()))));
        }
    }

    /// The instant of the scan at which the poses hold if one is near, else a clock offset. With
    /// motion-corrected points, whose times must be ignored, a scan is an instant.
    fn clock_mend(&self, run: &Run, later_ns: i64, half_ns: i64, points_are_corrected: bool) -> Mend {
        let after_ns = |at: PoseAt| at.after_stamp_ns(self.heads.summary());
        let offset_ns = self.settings.time_offset_ns(run).saturating_add(later_ns);
        if points_are_corrected {
            return Mend::TimeOffset(rounded_ns(offset_ns.saturating_sub(after_ns(run.instant()))));
        }
        if self.settings.time_offset_ns(run) == 0 {
            // The poses hold this long after their stamps.
            let held_ns = after_ns(run.instant()).saturating_sub(later_ns);
            let off_ns = |at: &PoseAt| after_ns(*at).saturating_sub(held_ns).abs();
            let nearest = PoseAt::ALL.into_iter().min_by_key(off_ns);
            let moves =
                |at: &PoseAt| after_ns(*at).abs_diff(after_ns(run.instant())) > NEAR_NS.unsigned_abs();
            if let Some(at) = nearest.filter(|at| moves(at) && off_ns(at) <= half_ns.max(NEAR_NS)) {
                return Mend::PoseAt(at);
            }
        }
        Mend::TimeOffset(rounded_ns(offset_ns))
    }
}

/// The confidence with which an error is reported.
fn certain() -> Confidence {
    Confidence::new(CONFIDENCE).unwrap_or(Confidence::P99)
}

fn share_of(blocks: &[Together]) -> f64 {
    let met: u64 = blocks.iter().map(|block| block.met).sum();
    let returns: u64 = blocks.iter().map(|block| block.returns).sum();
    met as f64 / returns.max(1) as f64
}
