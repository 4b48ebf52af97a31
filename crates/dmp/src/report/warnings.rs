//! When a report warns, and of what.

use dmp_log::StampJump;
use dmp_sensor::ReturnCounts;

use super::contents::Report;
use super::inputs::InputReport;
use super::pair::PairReport;
use super::run::RunReport;
use super::sampling::{PlacesReport, SamplingReport};
use super::warning::Warning;
use crate::cast::Scored;
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
/// Scans, rows of them, or jumps of their stamps that are named.
const MOST_NAMED: usize = 5;
/// Frames below which a sample has no intervals.
const FRAMES_NEEDED: u64 = 4;
/// How much more may be read for places than was asked for before it is worth a word.
const OVER_ASKED: f64 = 1.1;
/// Frames below which intervals come from few batches.
const FRAMES_FEW: u64 = 40;

/// Adds what a reader must know before believing the report.
pub(super) fn add<M>(report: &mut Report, plan: &Plan, scored: &Scored, runs: &[RunState<'_, M>]) {
    for (run, state) in report.runs.iter_mut().zip(runs) {
        // What is likely wrong comes before what follows from it.
        run.warnings = state.hint.iter().cloned().map(Warning::Other).chain(of_run(run)).collect();
    }
    report.warnings = of_report(report, plan, runs);
    report.warnings.extend(implausible(&scored.counts));
    let (odd, copied) = (&scored.odd_scans, &scored.copied_scans);
    if !odd.is_empty() {
        let count = odd.iter().map(|row| row.last + 1 - row.scan).sum();
        let (first, more) = first_of(odd);
        report.warnings.push(Warning::OddScans { count, first, more });
    }
    if !copied.is_empty() {
        let (first, more) = first_of(copied);
        report.warnings.push(Warning::CopiedScans { first, more });
    }
}

/// The first of a list, and how many more there are.
fn first_of<T: Copy>(all: &[T]) -> (Vec<T>, usize) {
    let first = &all[..all.len().min(MOST_NAMED)];
    (first.to_vec(), all.len() - first.len())
}

/// Where the numbers of the points are hardly coordinates in metres.
pub(super) fn implausible(counts: &ReturnCounts) -> Option<Warning> {
    let share = counts.implausible() as f64 / counts.total().max(1) as f64;
    (share > IMPLAUSIBLE_TOLD).then_some(Warning::ImplausibleRanges { share })
}

fn of_run(run: &RunReport) -> Vec<Warning> {
    if let (0, Some(thin_voxels)) = (run.map.surfels, run.map.thin_voxels) {
        // What else could be said follows from that.
        return vec![Warning::EmptyMap { thin_voxels }];
    }
    let above = |share: Option<f64>, limit: f64| share.filter(|&share| share > limit);
    let low = run.r_cv_withheld.as_ref().filter(|why| why.is_low_coverage());
    let revisit = run.coverage_revisit.filter(|&share| share < REVISIT_NEEDED);
    let dropped = run.map.map_points_dropped;
    [
        above(run.miss_rate, MISSES_SUSPECT).map(|share| Warning::Misses { share }),
        above(run.blocked_rate, BLOCKED_SUSPECT).map(|share| Warning::Blocked { share }),
        low.map(|why| Warning::LowCoverage { why: why.clone() }),
        revisit.map(|share| Warning::FewRevisits { share }),
        (dropped > 0).then_some(Warning::MapPointsDropped { count: dropped }),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn of_report<M>(report: &Report, plan: &Plan, runs: &[RunState<'_, M>]) -> Vec<Warning> {
    let (inputs, selection) = (&report.inputs, &plan.selection);
    let mut warnings: Vec<Warning> =
        inputs.damage.iter().map(|what| Warning::Lost { what: what.clone() }).collect();
    for run in inputs.runs.iter().filter(|run| run.scans_without_pose > 0) {
        warnings.push(Warning::ScansWithoutPose {
            run: run.name.clone(),
            without: run.scans_without_pose,
            scans: inputs.scans,
            used: inputs.scans_used,
        });
    }
    for state in runs.iter().filter(|state| state.scans_between_poses > 0) {
        if let Some((gap_s, off_m)) = state.poses.left_open() {
            let (run, scans) = (state.run.name.clone(), state.scans_between_poses);
            warnings.push(Warning::SparsePoses { run, gap_s, off_m, scans });
        }
    }
    if selection.out_of_order > 0 {
        warnings.push(Warning::OutOfOrder { times: selection.out_of_order });
    }
    if plan.segments.given && plan.segments.length.is_none() {
        let (scans, travel_m) = (plan.frames().len(), plan.segments.travel_m);
        warnings.push(Warning::SegmentsTooLong { scans, travel_m });
    }
    if selection.same_stamp > 0 {
        warnings.push(Warning::SameStamp { scans: selection.same_stamp });
    }
    let (scans, gaps): (Vec<StampJump>, Vec<StampJump>) =
        selection.stamp_jumps.iter().partition(|jump| matches!(jump, StampJump::Scan { .. }));
    if !scans.is_empty() {
        let (first, more) = first_of(&scans);
        warnings.push(Warning::StampsOff { first, more });
    }
    if !gaps.is_empty() {
        let (first, more) = first_of(&gaps);
        warnings.push(Warning::StampGaps { first, more });
    }
    if inputs.point_times.is_some() {
        let without = runs.iter().filter(|run| run.poses.ignores_point_times());
        warnings.extend(without.map(|run| Warning::PosesWithoutStamps { run: run.run.name.clone() }));
    }
    warnings.extend(of_drops(inputs));
    let SamplingReport { frames_scored: scored, frames_total, .. } = report.sampling;
    if scored < frames_total && scored < FRAMES_NEEDED {
        warnings.push(Warning::SmallSample { scored, needed: FRAMES_NEEDED });
    }
    if let Some(places) = &report.sampling.places {
        warnings.extend(of_places(places, inputs.bytes));
    }
    if frames_total < FRAMES_FEW {
        warnings.push(Warning::FewScans { scans: frames_total });
    }
    if report.runs.iter().any(|run| run.coverage.is_none()) {
        warnings.push(Warning::MapGiven);
        if report.is_cross_validated() {
            warnings.push(Warning::MapsOfBothKinds);
        }
    }
    warnings.extend(contradictions(report));
    warnings.extend(free_space(report));
    warnings
}

/// Of which returns many were left out: whole scans without a pose of those that were asked for, whether in the sample or not;
/// other returns of what was asked for, and where that was sampled, of what was read of it with a pose.
fn of_drops(inputs: &InputReport) -> Vec<Warning> {
    const ASKED_FOR: [&str; 2] = ["scan_not_selected", "scan_not_sampled"];
    const UNPOSED: &str = "scan_without_pose";
    let dropped = |reason: &str| inputs.dropped.0.get(reason).copied().unwrap_or(0);
    let [not_selected, not_sampled] = ASKED_FOR.map(dropped);
    let asked = inputs.returns - not_selected;
    let read = if not_sampled > 0 { asked - not_sampled - dropped(UNPOSED) } else { asked };
    let share = |reason: &str| {
        let all = if reason == UNPOSED { asked } else { read };
        dropped(reason) as f64 / all.max(1) as f64
    };
    let vehicle = share("vehicle");
    let told =
        (vehicle > VEHICLE_TOLD && vehicle <= DROPS_TOLD).then_some(Warning::Vehicle { share: vehicle });
    let others = inputs.dropped.0.keys().map(|reason| (reason, share(reason)));
    let others =
        others.filter(|(reason, share)| *share > DROPS_TOLD && !ASKED_FOR.contains(&reason.as_str()));
    let others = others.map(|(reason, share)| Warning::Dropped { reason: reason.clone(), share });
    told.into_iter().chain(others).collect()
}

/// What a sample of places tells and what it cannot.
fn of_places(places: &PlacesReport, log_bytes: u64) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if places.revisited_total == 0 {
        warnings.push(Warning::NoPlaceRevisited { within_m: 2.0 * places.radius_m });
    } else if places.revisited == 0 {
        let (revisited, places) = (places.revisited_total, places.total);
        warnings.push(Warning::NoRevisitedPlaceDrawn { revisited, places });
    }
    if places.cut > 0 {
        warnings.push(Warning::PlacesCut { places: places.cut });
    }
    let share = places.bytes_read.map_or(0.0, |bytes| bytes as f64 / log_bytes.max(1) as f64);
    if share > OVER_ASKED * places.share_asked {
        warnings.push(if places.are_fewest {
            Warning::FewestPlacesRead { share, places: places.drawn }
        } else {
            Warning::LargePlacesRead { share }
        });
    }
    warnings
}

/// Runs that are decided to be better although their R_cv at its largest truncation is larger: they miss more, or other,
/// returns, and the column counts all returns while the pair counts those that both predict.
fn contradictions(report: &Report) -> Vec<Warning> {
    let scale_m = report.config.scales.lengths().widest_m();
    let r_cv = |name: &str| report.run(name)?.r_cv_m2[0];
    let told = |pair: &PairReport| {
        let better = pair.verdict.better()?;
        let worse = pair.other(better);
        let (better, worse) =
            (r_cv(better)? > r_cv(worse)?).then(|| (better.to_owned(), worse.to_owned()))?;
        Some(Warning::PairAgainstColumn { better, worse, scale_m })
    };
    report.pairs.iter().filter_map(told).collect()
}

fn free_space(report: &Report) -> Vec<Warning> {
    let Some(free_space) = &report.free_space else { return Vec::new() };
    let mut warnings = Vec::new();
    if let [only] = free_space.votes.as_slice() {
        warnings.push(Warning::OneVote { run: only.clone() });
    }
    let share = free_space.returns_left_out as f64 / free_space.returns_fused.max(1) as f64;
    if share > LEFT_OUT_SUSPECT {
        warnings.push(Warning::ManyTrails { share });
    }
    warnings
}
