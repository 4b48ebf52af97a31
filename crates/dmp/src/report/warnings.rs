use dmp_sensor::ReturnCounts;

use super::{PairReport, PlacesReport, Report, RunReport, SamplingReport};
use crate::plan::Plan;
use crate::run_state::RunState;

/// Below this share of returns seen on another visit, nothing is said about the global shape.
const REVISIT_NEEDED: f64 = 0.05;
/// Above this share of returns with something in front, trajectory and log hardly belong together.
const BLOCKED_SUSPECT: f64 = 0.6;
/// Above this share of returns kept out of the maps, it is hardly traffic alone.
const LEFT_OUT_SUSPECT: f64 = 0.2;
/// Above this share of misses, scans and map hardly belong together.
const MISSES_SUSPECT: f64 = 0.5;
/// A share of dropped returns worth a word.
const DROPS_TOLD: f64 = 0.2;
/// A share of returns taken for the vehicle that is worth a word.
const VEHICLE_TOLD: f64 = 0.05;
/// A share of returns with ranges of no LiDAR that is worth a word.
const IMPLAUSIBLE_TOLD: f64 = 0.05;
/// Frames below which a sample has no intervals.
const FRAMES_NEEDED: u64 = 4;
/// How much more may be read for places than was asked for before it is worth a word.
const OVER_ASKED: f64 = 1.1;
/// Frames below which intervals come from few batches.
const FRAMES_FEW: u64 = 40;

/// Adds what a reader must know before believing the report.
pub(super) fn add<M>(report: &mut Report, plan: &Plan, counts: &ReturnCounts, runs: &[RunState<'_, M>]) {
    for (run, state) in report.runs.iter_mut().zip(runs) {
        // What is likely wrong comes before what follows from it.
        run.warnings = state.hint.iter().cloned().chain(of_run(run)).collect();
    }
    report.warnings = of_report(report, plan, runs);
    report.warnings.extend(implausible(counts));
}

/// Where the numbers of the points are hardly coordinates in metres.
pub(super) fn implausible(counts: &ReturnCounts) -> Option<String> {
    let share = counts.implausible() as f64 / counts.total().max(1) as f64;
    (share > IMPLAUSIBLE_TOLD).then(|| {
        format!(
            "{:.0} % of the ranges are below 1 mm or above 100 km, which no LiDAR measures: are the points' bytes in the order \
             that the log says (is_bigendian), and their fields where it says?",
            100.0 * share
        )
    })
}

fn of_run(run: &RunReport) -> Vec<String> {
    let mut warnings = Vec::new();
    let percent = |share: f64| 100.0 * share;
    if let Some(miss_rate) = run.miss_rate.filter(|&rate| rate > MISSES_SUSPECT) {
        warnings.push(format!(
            "{:.0} % of the returns hit nothing: is the trajectory that of this log and this frame (--extrinsic, --time-offset)?",
            percent(miss_rate)
        ));
    }
    if let Some(rate) = run.blocked_rate.filter(|&rate| rate > BLOCKED_SUSPECT) {
        warnings.push(format!(
            "{:.0} % of the returns have something in front of them: a map this inconsistent is ruined, or the trajectory is not that of this log and frame (--extrinsic, --time-offset, order of the quaternion)",
            percent(rate)
        ));
    }
    if let Some(why) = run.r_cv_withheld.as_deref().filter(|why| why.starts_with("coverage")) {
        warnings.push(format!("R_cv is not given: {why}; pairs are still compared on common returns"));
    }
    if let Some(share) = run.coverage_revisit.filter(|&share| share < REVISIT_NEEDED) {
        warnings.push(format!(
            "only {:.1} % of the returns see a place again on another visit: drift and bends of the whole cannot be judged",
            percent(share)
        ));
    }
    if run.map.map_points_dropped > 0 {
        warnings.push(format!(
            "{} points or triangles of the given map are not finite and were left out",
            run.map.map_points_dropped
        ));
    }
    warnings
}

fn of_report<M>(report: &Report, plan: &Plan, runs: &[RunState<'_, M>]) -> Vec<String> {
    let inputs = &report.inputs;
    let mut warnings = Vec::new();
    for lost in &inputs.damage {
        warnings.push(format!("lost from the log: {lost}"));
    }
    for run in inputs.runs.iter().filter(|run| run.scans_without_pose > 0) {
        warnings.push(format!(
            "{} of {} scans have no pose in `{}`; all runs are compared on the {} scans that have one in every run",
            run.scans_without_pose, inputs.scans, run.name, inputs.scans_used
        ));
    }
    if plan.selection.out_of_order > 0 {
        warnings.push(format!(
            "the log's stamps go backwards {} times; scans were put in order of time",
            plan.selection.out_of_order
        ));
    }
    if plan.segments.given && plan.segments.length.is_none() {
        warnings.push(format!(
            "the segment length asked for cuts {} scans and {:.1} m of travel into fewer than 8: every scan is a segment of \
             its own",
            plan.frames().len(),
            plan.segments.travel_m
        ));
    }
    if plan.selection.same_stamp > 0 {
        warnings.push(format!(
            "{} scans have the stamp of another scan: a log that holds scans twice counts them twice",
            plan.selection.same_stamp
        ));
    }
    if inputs.point_times.is_some() {
        for run in runs.iter().filter(|run| run.poses.ignores_point_times()) {
            warnings.push(format!(
                "the poses of `{}` have no stamps, so the times of points are not used: each scan has one pose",
                run.name()
            ));
        }
    }
    let dropped = |reason: &str| inputs.dropped.0.get(reason).copied().unwrap_or(0);
    // Those that were read to be scored.
    let read = inputs.returns - dropped("scan_not_selected") - dropped("scan_not_sampled");
    let read = read.max(1) as f64;
    let vehicle = dropped("vehicle") as f64 / read;
    if vehicle > VEHICLE_TOLD && vehicle <= DROPS_TOLD {
        warnings.push(format!(
            "{:.0} % of the returns were taken for the vehicle: if that is too many, give --ego a box, or none",
            100.0 * vehicle
        ));
    }
    for (reason, count) in &inputs.dropped.0 {
        let share = *count as f64 / read;
        let asked_for = matches!(reason.as_str(), "scan_not_selected" | "scan_not_sampled");
        if share > DROPS_TOLD && !asked_for {
            warnings.push(format!("{:.0} % of the returns were dropped: {reason}", 100.0 * share));
        }
    }
    let SamplingReport { frames_scored, frames_total, .. } = report.sampling;
    if frames_scored < frames_total && frames_scored < FRAMES_NEEDED {
        warnings
            .push(format!("a sample of {frames_scored} scans has no intervals: {FRAMES_NEEDED} are needed"));
    }
    if let Some(places) = &report.sampling.places {
        warnings.extend(of_places(places, inputs.bytes));
    }
    if report.sampling.frames_total < FRAMES_FEW {
        warnings.push(format!(
            "few scans ({}): intervals are wide, if there are any",
            report.sampling.frames_total
        ));
    }
    if report.runs.iter().any(|run| run.coverage.is_none()) {
        warnings.push("a map was given: returns may be compared with surfels made of themselves".to_owned());
        if report.runs.iter().any(|run| run.coverage.is_some()) {
            warnings.push(
                "maps that were given stand beside maps that were fused: the one with more scans in it looks better"
                    .to_owned(),
            );
        }
    }
    warnings.extend(contradictions(report));
    warnings.extend(free_space(report));
    warnings
}

/// What a sample of places tells and what it cannot.
fn of_places(places: &PlacesReport, log_bytes: u64) -> Vec<String> {
    let PlacesReport {
        drawn,
        total,
        revisited,
        revisited_total,
        cut,
        radius_m,
        are_fewest,
        share_asked,
        bytes_read,
        ..
    } = *places;
    let mut warnings = Vec::new();
    if revisited_total == 0 {
        warnings.push(format!(
            "the way comes back to no place: the scores tell how well scans within {:.0} m of each other fit together, and \
             nothing of drift and bends of the whole",
            2.0 * radius_m
        ));
    } else if revisited == 0 {
        warnings.push(format!(
            "the way comes back to {revisited_total} of {total} places, and none of these was drawn: nothing is told of drift \
             and bends of the whole; a larger --quick or another --seed may draw some"
        ));
    }
    if cut > 0 {
        warnings.push(format!(
            "at {cut} of the places lie more scans than are read for one: a run that lost its way, or many passes"
        ));
    }
    let share = bytes_read.map_or(0.0, |bytes| bytes as f64 / log_bytes.max(1) as f64);
    if share > OVER_ASKED * share_asked {
        warnings.push(format!(
            "{:.1} % of the log's bytes were read, more than asked for: {}",
            100.0 * share,
            if are_fewest {
                format!("{drawn} places are the fewest, and the log is short or has no index")
            } else {
                "the places drawn are larger than most, or the log has no index".to_owned()
            }
        ));
    }
    warnings
}

/// Runs that are decided to be better although their R_cv at its largest truncation is larger: they miss more, or other,
/// returns, and the column counts all returns while the pair counts those that both predict.
fn contradictions(report: &Report) -> Vec<String> {
    let r_cv = |name: &str| report.runs.iter().find(|run| run.name == name)?.r_cv_m2[0];
    let told = |pair: &PairReport| {
        let worse = if pair.verdict == pair.a { &pair.b } else { &pair.a };
        let decided = pair.verdict == pair.a || pair.verdict == pair.b;
        (decided && r_cv(&pair.verdict)? > r_cv(worse)?).then(|| {
            format!(
                "`{}` is better than `{worse}` on the returns that both predict, though its R_cv at {} m over all returns is larger: believe the pair",
                pair.verdict,
                report.config.scales.lengths().widest_m()
            )
        })
    };
    report.pairs.iter().filter_map(told).collect()
}

fn free_space(report: &Report) -> Vec<String> {
    let Some(free_space) = &report.free_space else { return Vec::new() };
    let mut warnings = Vec::new();
    if let [only] = free_space.votes.as_slice() {
        warnings.push(format!(
            "only `{only}` says what a trail is, and nobody vouches for what its rays contradict: --free-space also \
             hides its own doubled walls"
        ));
    }
    let share = free_space.returns_left_out as f64 / free_space.returns_fused.max(1) as f64;
    if share > LEFT_OUT_SUSPECT {
        warnings.push(format!(
            "{:.0} % of the returns were kept out of the maps: that is more than traffic; are all runs wrong?",
            100.0 * share
        ));
    }
    warnings
}
