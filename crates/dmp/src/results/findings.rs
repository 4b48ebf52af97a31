//! How a report is built of what the passes found.

use dmp_log::{Damage, shown_path};
use dmp_map::Store;
use dmp_reduce::{Comparison, Comparisons, RunSums, log_likelihood_raw};
use dmp_report::SegmentLength;
use dmp_report::{
    ConfigReport, DepthNoiseReport, DropReport, EgoReport, InputReport, MapReport, MemoryReport, PairFacts,
    PairReport, PassTimes, PromiseReport, Report, RunFacts, RunInputReport, RunReport, SamplingReport,
    SegmentReport, TileReport,
};
use dmp_revisit::apart::Apart;
use dmp_runs::{Heads, MapSource, Means, PlannedFrame, PosedRun, RunPath, Settings, apart_of, back_of};
use dmp_sensor::seven;
use dmp_sensor::{DepthNoise, DropReason, ReturnCounts};

use super::warnings;
use crate::means::peak;
use crate::passes::{FuseTotals, MapFacts, Plan, Scored, horizon_m};

/// What the report has of a run's map.
#[derive(Debug, Clone, Default)]
pub(crate) struct MapSummary {
    pub(crate) report: MapReport,
    pub(crate) facts: MapFacts,
}

/// The part of a report that speaks of a map.
pub(crate) fn map_report(store: &Store, facts: &MapFacts) -> MapReport {
    MapReport {
        surfels: facts.trails.map_or(store.surfels(), |trails| trails.surfels),
        tiles: facts.trails.map_or(store.entries().count() as u64, |trails| trails.tiles),
        thin_voxels: facts.thin_voxels,
        map_points_dropped: facts.points_dropped,
        thickness: facts.thickness.clone(),
        surfels_contradicted: facts.trails.map(|trails| trails.contradicted),
    }
}

/// Dropped returns by reason, as one line.
pub(crate) fn drops_in_words(counts: &ReturnCounts) -> String {
    let parts: Vec<String> = DropReason::ALL
        .iter()
        .filter(|&&reason| counts.dropped(reason) > 0)
        .map(|&reason| format!("{} {}", counts.dropped(reason), reason.name()))
        .collect();
    if parts.is_empty() {
        return "the scans are empty".to_owned();
    }
    let implausible = warnings::implausible(counts).map_or(String::new(), |warning| format!("; {warning}"));
    format!("{}{implausible}", parts.join(", "))
}

/// All results of an evaluation.
#[derive(Clone, Copy)]
pub(crate) struct Findings<'a> {
    pub(crate) heads: Heads<'a>,
    /// What of the log is lost.
    pub(crate) damage: &'a [Damage],
    pub(crate) settings: &'a Settings,
    pub(crate) means: &'a Means,
    pub(crate) plan: &'a Plan,
    pub(crate) runs: &'a [PosedRun<'a, MapSummary>],
    pub(crate) fused: FuseTotals,
    pub(crate) scored: &'a Scored,
    pub(crate) timing: PassTimes,
}

impl Findings<'_> {
    /// The report of an evaluation; what is known of the disk is added later.
    pub(crate) fn report(&self) -> Report {
        let Self { settings, plan, runs, fused, scored, timing, .. } = *self;
        let reducer = &scored.reducer;
        let Comparisons { of_each_interval, pairs } = reducer.comparisons(scored.confidence);
        let (pairs, apart): (Vec<_>, Vec<_>) = pairs.into_iter().map(|pair| self.with_apart(pair)).unzip();
        let mut report = Report {
            schema: Report::SCHEMA.to_owned(),
            dmp_version: env!("CARGO_PKG_VERSION").to_owned(),
            config: self.config(),
            inputs: self.inputs(),
            runs: (0..runs.len()).map(|run| self.run(run)).collect(),
            left_out: Vec::new(),
            order: Vec::new(),
            ties: Vec::new(),
            pairs: pairs.iter().zip(apart).map(|(pair, apart)| self.pair(pair, apart)).collect(),
            drift: None,
            promise: PromiseReport {
                confidence: settings.confidence.level(),
                interval_confidence: of_each_interval.level(),
                same_within_m: settings.same_within_m,
                of_each_result: false,
            },
            sampling: SamplingReport {
                frames_scored: plan.frames().len() as u64,
                seed: (plan.draw.one_in() > 1).then_some(settings.seed),
                returns_one_in: plan.draw.one_in(),
                quick: None,
            },
            warnings: Vec::new(),
            timing,
            memory: MemoryReport {
                budget_bytes: self.means.memory_bytes,
                peak_anon_bytes: peak::peak_anonymous_bytes(),
                scratch_bytes: fused.scratch_bytes,
                disk_bytes: fused.scratch_bytes,
                disk_bytes_estimated: 0,
                tile_loads: scored.tile_loads,
                tiles_in_reach: scored.tiles_in_reach,
                tile_visits: scored.tile_visits,
            },
            tiles: tile_reports(scored),
        };
        report.rank();
        warnings::add(&mut report, plan, scored, runs);
        report
    }

    /// Whether a depth camera measured.
    fn has_depth(&self) -> bool {
        self.heads.summary().camera.is_some()
    }

    fn config(&self) -> ConfigReport {
        let Self { settings: config, plan, runs, scored, .. } = *self;
        let has_depth = self.has_depth();
        let lattice = scored.lattice;
        ConfigReport {
            voxel_m: lattice.voxel_m(),
            voxel_filled_share: plan.surveyed.filled_share,
            tile_edge_m: lattice.tile_edge_m(),
            disc_radius_m: lattice.disc_radius_m(),
            min_range_m: config.min_range_m,
            max_range_m: config.max_range_m,
            horizon_m: horizon_m(config),
            ego: EgoReport { known: config.ego, cells: plan.filter.ego.cells() },
            every: config.every,
            body_from_sensor: common(runs.iter().map(|run| config.body_from_sensor(run.run)))
                .as_ref()
                .map(seven),
            time_offset_s: config.time_offset_ns as f64 / 1e9,
            miss_price: config.miss_price.share(),
            sigma_m: config.asked_sigma_m.or((!has_depth).then(|| config.sigma_m())),
            depth_noise: (has_depth && config.asked_sigma_m.is_none()).then(|| {
                let DepthNoise { least_m, growth_per_m, nearest_m } = config.depth_noise();
                DepthNoiseReport { least_m, growth_per_m, nearest_m }
            }),
            scales: config.scales,
            segment: config.segment,
        }
    }

    fn inputs(&self) -> InputReport {
        let Self { heads, damage, settings, plan, runs, .. } = *self;
        let counts = &self.scored.counts;
        let summary = heads.summary();
        let run_input = |state: &PosedRun<'_, MapSummary>| {
            let run = state.run;
            RunInputReport {
                name: run.name.clone(),
                file: run.source.file.clone(),
                format: run.source.format.clone(),
                poses: run.trajectory.len(),
                body_from_sensor: seven(&settings.body_from_sensor(run)),
                body_from_sensor_source: match (&run.source.body_from_sensor, run.body_from_sensor) {
                    (Some(source), _) => source.clone(),
                    (None, Some(_)) => "given for the run".to_owned(),
                    (None, None) => "the settings, for all runs".to_owned(),
                },
                world_from_own: seven(&state.own_from_world.inverse()),
                pairing: state.poses.pairing,
                pose_at: run.instant(),
                conventions: None,
                time_offset_s: settings.time_offset_ns(run) as f64 / 1e9,
                max_time_gap_s: state.poses.max_gap_ns as f64 / 1e9,
                longest_gap_s: state.poses.longest_gap_s(),
                scans_between_poses: state.path.scans_between_poses,
                scans_without_pose: state.path.scans_without_pose,
                segments: segment_report(&state.path, plan.frames()),
                map: match &run.map {
                    MapSource::Fused => "fused".to_owned(),
                    MapSource::Given(path) => shown_path(path),
                },
                map_notes: state.map.facts.notes.clone(),
                notes: run.source.notes.clone(),
            }
        };
        InputReport {
            log: shown_path(&summary.path),
            format: summary.format.name().to_owned(),
            fingerprint: summary.fingerprint.clone(),
            bytes: summary.bytes,
            has_checksums: Some(summary.has_checksums),
            topic: summary.topic.clone(),
            point_times: summary.point_times.clone(),
            span_ns: summary.span_ns,
            scans: heads.readable(),
            scans_used: (0..plan.frames().len()).filter(|&k| runs.iter().any(|run| run.path.has(k))).count(),
            returns: counts.total(),
            returns_at: plan.surveyed.returns,
            returns_used: counts.used(),
            dropped: DropReport(
                DropReason::ALL
                    .iter()
                    .map(|&reason| (reason.name().to_owned(), counts.dropped(reason)))
                    .collect(),
            ),
            runs: runs.iter().map(run_input).collect(),
            notes: summary.notes.clone(),
            damage: damage.iter().map(|damage| format!("{}: {}", damage.place, damage.what)).collect(),
        }
    }

    /// The raw log-likelihood of a run, of a depth camera in its own number with its own noise (eq. 8–12).
    fn log_likelihood(&self, sums: &RunSums) -> f64 {
        let has_depth = self.has_depth();
        match self.settings.asked_sigma_m {
            None if has_depth => -0.5 * sums.depth_sigmas_squared(),
            Some(sigma_m) if has_depth => log_likelihood_raw(sums.dmp_depth_sum_m2(), sigma_m),
            _ => log_likelihood_raw(sums.dmp_sum_m2(), self.settings.sigma_m()),
        }
    }

    fn run(&self, run: usize) -> RunReport {
        let Self { settings: config, runs, scored, .. } = *self;
        let scores = scored.reducer.scores(run, config.confidence);
        RunReport::of(
            &scores,
            RunFacts {
                name: runs[run].run.name.clone(),
                frames: self.frames_of(run),
                basis: scored.reducer.layout().bases()[run],
                has_depth: self.has_depth(),
                log_likelihood: self.log_likelihood(&scores.sums),
                map: runs[run].map.report.clone(),
            },
        )
    }

    /// Scans scored with a pose in a run.
    fn frames_of(&self, run: usize) -> usize {
        let reducer = &self.scored.reducer;
        reducer.frames().iter().filter(|&ordinal| self.runs[run].path.has(ordinal)).count()
    }

    /// A comparison with how far apart its runs are; those that are nowhere apart by what matters are the same. No run is better
    /// that puts visits of a place too far apart to meet.
    fn with_apart(&self, pair: Comparison) -> (Comparison, Option<Apart>) {
        let Self { plan, runs, settings, scored, .. } = *self;
        let ruler = plan.ruler(self.heads.summary(), settings);
        let apart = apart_of(plan.frames(), [pair.a, pair.b].map(|run| &runs[run]), &ruler);
        let is_same = apart.is_some_and(|apart| apart.is_same(pair.basis, settings.same_within_m));
        if is_same {
            return (pair.of_same(), apart);
        }
        (
            pair.with_revisits(
                |run| scored.reducer.sums(run),
                |run| back_of(plan.frames(), &runs[run], &ruler),
            ),
            apart,
        )
    }

    fn pair(&self, pair: &Comparison, apart: Option<Apart>) -> PairReport {
        let Self { settings: config, runs, scored, .. } = *self;
        PairReport::of(
            pair,
            PairFacts {
                name: &|run| runs[run].run.name.clone(),
                log_likelihood: &|run| self.log_likelihood(scored.reducer.sums(run)),
                scan_of_unit: &|unit| scored.scan_of_unit[unit as usize] as u64,
                scales: config.scales,
            },
            apart,
        )
    }
}

/// How a path is cut.
pub(crate) fn segment_report(path: &RunPath, frames: &[PlannedFrame]) -> SegmentReport {
    let segments = &path.segments;
    let starts = || segments.starts.iter().map(|&ordinal| &frames[ordinal]);
    let length = segments.length;
    SegmentReport {
        length_m: length
            .and_then(|length| if let SegmentLength::Metres(m) = length { Some(m) } else { None }),
        length_s: length
            .and_then(|length| if let SegmentLength::Seconds(s) = length { Some(s) } else { None }),
        length_scans: length
            .and_then(|length| if let SegmentLength::Scans(scans) = length { Some(scans) } else { None }),
        count: segments.starts.len(),
        travel_m: segments.travel_m,
        starts_ns: starts().filter_map(|frame| frame.stamp_ns).collect(),
        starts_scan: starts().map(|frame| frame.number).collect(),
    }
}

/// What all have in common; `None` where two differ.
fn common<T: PartialEq>(mut values: impl Iterator<Item = T>) -> Option<T> {
    let first = values.next()?;
    values.all(|value| value == first).then_some(first)
}

fn tile_reports(scored: &Scored) -> Vec<TileReport> {
    let mut tiles: Vec<TileReport> =
        scored.tiles.iter().map(|(&(run, tile), &sums)| TileReport { run, tile, sums }).collect();
    tiles.sort_by_key(|tile| (tile.run, tile.tile));
    tiles
}
