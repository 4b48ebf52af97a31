//! What a reader must know before believing a report: when it warns, and the sentences.

use dmp_report::{InputReport, PairReport, Report, RunReport, Withheld};
use std::fmt::Display;

use dmp_lengths::thousands;
use dmp_log::StampJump;
use dmp_runs::{PosedRun, in_voxels};
use dmp_sensor::ReturnCounts;

use crate::passes::{Plan, Scored};

/// Above this share of returns with something in front, trajectory and log hardly belong together.
const BLOCKED_SUSPECT: f64 = 0.6;
/// Above this share of misses, scans and map hardly belong together.
const MISSES_SUSPECT: f64 = 0.5;
/// A share of dropped returns worth a warning.
const DROPS_SUSPECT: f64 = 0.2;
/// A share of returns rejected as the vehicle's that is worth a warning.
const VEHICLE_SUSPECT: f64 = 0.05;
/// A share of returns with ranges of no LiDAR that is worth a warning.
const IMPLAUSIBLE_SUSPECT: f64 = 0.05;
/// Scans, rows of them, or jumps of their stamps that are named.
const MOST_NAMED: usize = 5;
/// Frames below which intervals come from few batches.
const FRAMES_FEW: u64 = 40;

/// Adds the warnings of the report and of its runs.
pub(super) fn add<M>(report: &mut Report, plan: &Plan, scored: &Scored, runs: &[PosedRun<'_, M>]) {
    for (run, state) in report.runs.iter_mut().zip(runs) {
        // What is likely wrong comes before what follows from it.
        run.warnings = state.hint.iter().cloned().chain(of_run(run)).collect();
    }
    report.warnings = of_report(report, plan, runs);
    report.warnings.extend(implausible(&scored.counts));
    let (odd, copied) = (&scored.odd_scans, &scored.copied_scans);
    if !odd.is_empty() {
        let count: usize = odd.iter().map(|row| row.last + 1 - row.scan).sum();
        let differ = if count == 1 { "scan differs" } else { "scans differ" };
        report.warnings.push(format!(
            "{} {differ} from the others, and the log has no checksums: {}; bytes may have changed",
            thousands(count),
            first_of(odd)
        ));
    }
    if !copied.is_empty() {
        report.warnings.push(format!(
            "{}: two scans never have identical returns; the driver may have stopped, or a file was copied",
            first_of(copied)
        ));
    }
}

/// The first of a list, and how many more there are.
fn first_of(all: &[impl Display]) -> String {
    let mut words: Vec<String> = all.iter().take(MOST_NAMED).map(ToString::to_string).collect();
    if let Some(more) = all.len().checked_sub(MOST_NAMED).filter(|more| *more > 0) {
        words.push(format!("and {} more", thousands(more)));
    }
    words.join("; ")
}

/// Where the numbers of the points are hardly coordinates in metres.
pub(super) fn implausible(counts: &ReturnCounts) -> Option<String> {
    let share = counts.implausible() as f64 / counts.total().max(1) as f64;
    (share > IMPLAUSIBLE_SUSPECT).then(|| {
        format!(
            "{:.0} % of the ranges are below 1 mm or above 100 km, which no LiDAR measures: check the byte order \
             (is_bigendian) and the offsets of the point fields",
            100.0 * share
        )
    })
}

fn of_run(run: &RunReport) -> Vec<String> {
    if let (0, Some(thin_voxels)) = (run.map.surfels, run.map.thin_voxels) {
        // What else could be reported follows from that.
        return vec![format!(
            "the map is empty: in {} returns span no surface; try larger voxels (--voxel), and check that the trajectory is \
             of this log and frame (--extrinsic, --time-offset)",
            in_voxels(thin_voxels)
        )];
    }
    let mut warnings = Vec::new();
    if let Some(share) = run.miss_rate.filter(|&share| share > MISSES_SUSPECT) {
        warnings.push(format!(
            "{:.0} % of the returns hit nothing: check that the trajectory is of this log and frame (--extrinsic, \
             --time-offset)",
            100.0 * share
        ));
    }
    if let Some(share) = run.blocked_rate.filter(|&share| share > BLOCKED_SUSPECT) {
        let found = run.map.surfels_contradicted.map_or_else(String::new, |found| {
            let share = found as f64 / run.map.surfels.max(1) as f64;
            format!(" ({:.1} % of the surfels are left out for this)", 100.0 * share)
        });
        warnings.push(format!(
            "{:.0} % of the returns are blocked: things move{found}, or the trajectory is wrong, or not of this log and \
             frame (--extrinsic, --time-offset, quaternion order)",
            100.0 * share
        ));
    }
    if let Some(share) =
        run.coverage.filter(|_| run.r_cv_withheld.as_ref().is_some_and(Withheld::is_low_coverage))
    {
        let percent = 100.0 * share;
        warnings.push(format!(
            "R_cv is not given: coverage is {percent:.1} %, below 50 %; pairs are still compared on common returns"
        ));
    }
    if let Some(share) = run.coverage_revisit.filter(|_| run.has_few_revisits()) {
        warnings.push(if share > 0.0 {
            format!("{:.1} % of points seen on two visits: scores hardly show drift", 100.0 * share)
        } else {
            "no point seen on two visits: scores cannot show drift".to_owned()
        });
    }
    if run.map.map_points_dropped > 0 {
        let count = thousands(run.map.map_points_dropped);
        warnings
            .push(format!("{count} points or triangles of the given map are not finite and were excluded"));
    }
    warnings
}

fn of_report<M>(report: &Report, plan: &Plan, runs: &[PosedRun<'_, M>]) -> Vec<String> {
    let (inputs, selection) = (&report.inputs, &plan.selection);
    let mut warnings: Vec<String> =
        inputs.damage.iter().map(|what| format!("lost from the log: {what}")).collect();
    let mut without_pose: Vec<(usize, Vec<String>)> = Vec::new();
    for state in runs.iter().filter(|state| state.path.scans_without_pose > 0) {
        let (scans, name) = (state.path.scans_without_pose, format!("`{}`", state.run.name));
        match without_pose.iter_mut().find(|(others, _)| *others == scans) {
            Some((_, names)) => names.push(name),
            None => without_pose.push((scans, vec![name])),
        }
    }
    for (scans, names) in without_pose {
        let each = if names.len() == 1 { "it" } else { "each" };
        warnings.push(format!(
            "{} of {} scans have no pose in {}; {each} is scored on the others",
            thousands(scans),
            thousands(plan.frames().len()),
            names.join(", ")
        ));
    }
    for state in runs {
        let (name, path) = (&state.run.name, &state.path);
        if let (1.., Some((gap_s, off_m))) = (path.scans_between_poses, state.poses.left_open()) {
            warnings.push(format!(
                "`{name}` has poses up to {gap_s:.1} s apart, and the sensor may be {:.0} cm off between them, so {} scans \
                 there are excluded: give a pose for every scan",
                100.0 * off_m,
                thousands(path.scans_between_poses)
            ));
        }
        if path.segments.given && path.segments.length.is_none() {
            warnings.push(format!(
                "the given segment length cuts {:.1} m of travel of `{name}` into fewer than 8: every scan is a segment",
                path.segments.travel_m
            ));
        }
    }
    if selection.out_of_order > 0 {
        let times = thousands(selection.out_of_order);
        warnings.push(format!("the log's stamps go backwards {times} times; scans were sorted by time"));
    }
    if selection.same_stamp > 0 {
        let scans = thousands(selection.same_stamp);
        warnings.push(format!("{scans} scans have the stamp of another scan: duplicate scans count twice"));
    }
    let (scans, gaps): (Vec<StampJump>, Vec<StampJump>) =
        selection.stamp_jumps.iter().partition(|jump| matches!(jump, StampJump::Scan { .. }));
    if !scans.is_empty() {
        warnings.push(format!("{}: the clock jumped, or a stamp was changed", first_of(&scans)));
    }
    if !gaps.is_empty() {
        warnings.push(format!("{}: a pause, lost scans or changed stamps", first_of(&gaps)));
    }
    if inputs.point_times.is_some() {
        for run in runs.iter().filter(|run| run.poses.ignores_point_times()) {
            warnings.push(format!(
                "the poses of `{}` have no stamps, so point times are not used: each scan has one pose",
                run.run.name
            ));
        }
    }
    warnings.extend(of_drops(inputs));
    let scans = report.sampling.frames_scored;
    if scans < FRAMES_FEW {
        warnings.push(format!("few scans ({scans}): small differences stay undecided"));
    }
    if report.runs.iter().any(|run| run.coverage.is_none()) {
        warnings.push("a map was given: it may contain the scored returns themselves".to_owned());
        if report.is_cross_validated() {
            warnings.push(
                "given and fused maps are compared: the one made of more scans looks better".to_owned(),
            );
        }
    }
    warnings.extend(contradictions(report));
    warnings
}

/// Of which returns many were excluded, as a share of what was asked for.
fn of_drops(inputs: &InputReport) -> Vec<String> {
    const ASKED_FOR: [&str; 2] = ["scan_not_selected", "not_drawn"];
    let dropped = |reason: &str| inputs.dropped.0.get(reason).copied().unwrap_or(0);
    let [not_selected, _] = ASKED_FOR.map(dropped);
    let asked = inputs.returns - not_selected;
    let share = |reason: &str| dropped(reason) as f64 / asked.max(1) as f64;
    let vehicle = share("vehicle");
    let mut warnings = Vec::new();
    if vehicle > VEHICLE_SUSPECT && vehicle <= DROPS_SUSPECT {
        warnings.push(format!(
            "{:.0} % of the returns were rejected as the vehicle itself: if that is too many, use --ego with a box, or none",
            100.0 * vehicle
        ));
    }
    for reason in inputs.dropped.0.keys().filter(|reason| !ASKED_FOR.contains(&reason.as_str())) {
        let share = share(reason);
        if share > DROPS_SUSPECT {
            warnings.push(format!("{:.0} % of the returns were dropped: {reason}", 100.0 * share));
        }
    }
    warnings
}

/// Runs that are decided to be better although their R_cv at its largest truncation is larger: they miss more, or other,
/// returns, and the column counts all returns while the pair counts those that both predict.
fn contradictions(report: &Report) -> Vec<String> {
    let scale_m = report.config.scales.lengths().widest_m();
    let r_cv = |name: &str| report.run(name)?.r_cv_m2[0];
    let warning = |pair: &PairReport| {
        let better = pair.verdict.better()?;
        let worse = pair.other(better);
        (r_cv(better)? > r_cv(worse)?).then(|| {
            format!(
                "`{better}` is better than `{worse}` on the returns that both predict, though its R_cv at {scale_m} m over \
                 all returns is larger: the verdict counts"
            )
        })
    };
    report.pairs.iter().filter_map(warning).collect()
}
