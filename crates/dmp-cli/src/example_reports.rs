//! Reports made by hand, for tests.

use dmp::{
    Basis, ConfigReport, DropReport, Ego, EgoReport, InputReport, MapReport, MemoryReport, PairReport,
    PassTimes, PromiseReport, Report, RunReport, SamplingReport, ScaleReport, ScaleScores, Scales,
    SegmentReport, Verdict, Warning, Withheld,
};

/// Truth and noise not told apart, drift worse, and mixed against noise.
pub(crate) fn three_runs() -> Report {
    let mut drift = run("drift", 2.0);
    drift.coverage = Some(0.431);
    drift.r_cv_m2 = ScaleScores::new([10.0, 2.0, 0.5, 0.2].map(|scale_m| (scale_m, None)));
    drift.r_cv_interval_m2 = None;
    let why = Withheld::from("coverage is 0.431, below 0.5".to_owned());
    drift.r_cv_withheld = Some(why.clone());
    drift.warnings = vec![Warning::LowCoverage { why }];
    let runs = vec![drift, run("größe", 1.1), run("truth", 1.0)];
    let mut undecided = pair("truth", "größe", Basis::CrossValidated, &[10.0, 2.0, 0.5, 0.2]);
    undecided.verdict = Verdict::Undecided;
    undecided.reason = "undecided: no scale shows a difference outside its interval".into();
    let mut mixed = pair("drift", "größe", Basis::CrossValidated, &[10.0, 2.0, 0.5, 0.2]);
    mixed.verdict = Verdict::Mixed { run: "größe".into(), decided_at_m: 10.0, is_same: false };
    mixed.reason =
        "better on the whole, globally: decided at the 10 m scale, but worse in frames 12–40 at 30 m".into();
    for scale in &mut mixed.scales {
        scale.difference_m2 = scale.difference_m2.map(|difference| -difference);
        scale.interval_m2 = scale.interval_m2.map(|[low, high]| [-high, -low]);
    }
    let pairs = vec![mixed, pair("truth", "drift", Basis::CrossValidated, &[10.0, 2.0, 0.5, 0.2]), undecided];
    let mut report = report(runs, &["truth", "größe", "drift"], pairs);
    report.ties = vec![["truth".into(), "größe".into()]];
    report.warnings = vec![Warning::Other("3 of 600 scans have no pose in `drift`".into())];
    report
}

pub(crate) fn one_run() -> Report {
    report(vec![run("truth", 1.0)], &["truth"], Vec::new())
}

/// Two runs with maps that were given.
pub(crate) fn given_maps() -> Report {
    let given = |name, factor| {
        let mut run = run(name, factor);
        (run.coverage, run.coverage_revisit) = (None, None);
        run.r_cv_m2 = ScaleScores::new([10.0, 2.0, 0.5, 0.2].map(|scale_m| (scale_m, None)));
        run.r_cv_interval_m2 = None;
        run.r_cv_withheld = Some(Withheld::Other("the map was given".into()));
        run
    };
    let pairs = vec![pair("a", "b", Basis::Near, &[5.0, 2.0, 0.5])];
    let mut report = report(vec![given("a", 1.0), given("b", 4.0)], &["a", "b"], pairs);
    report.config.segments.length_m = None;
    report
}

/// Each better than the next.
pub(crate) fn many_runs(count: usize) -> Report {
    let names: Vec<String> = (0..count).map(|k| format!("run {k}")).collect();
    let order: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut pairs = Vec::new();
    for (k, a) in order.iter().enumerate() {
        pairs.extend(order.iter().skip(k + 1).map(|b| pair(a, b, Basis::CrossValidated, &[10.0])));
    }
    report(order.iter().map(|name| run(name, 1.0)).collect(), &order, pairs)
}

fn run(name: &str, factor: f64) -> RunReport {
    let scaled = |value: f64| Some(factor * value);
    RunReport {
        name: name.into(),
        returns: 1_200_000,
        frames: 597,
        dmp_sum_m2: factor * 4_096_000.0,
        dmp_mean_m2: scaled(3.4567),
        dmp_depth_sum_m2: None,
        dmp_depth_mean_m2: None,
        r_cv_m2: ScaleScores::new([
            (10.0, scaled(2.25)),
            (2.0, scaled(0.16)),
            (0.5, scaled(0.01)),
            (0.2, scaled(0.0025)),
        ]),
        r_cv_interval_m2: Some([factor * 2.0, factor * 2.5]),
        r_cv_withheld: None,
        r_near_interval_m2: None,
        r_near_m2: ScaleScores::new([(5.0, scaled(0.36)), (2.0, scaled(0.04)), (0.5, scaled(0.0004))]),
        miss_rate: Some(0.021),
        blocked_rate: Some(0.1234),
        coverage: Some(0.8125),
        coverage_revisit: Some(0.345),
        log_likelihood_raw: factor * -5_120_000_000.0,
        map: MapReport {
            surfels: 345_678,
            tiles: 91,
            thin_voxels: Some(12_345),
            map_points_dropped: 0,
            surfels_with_trails: None,
            surfels_contradicted: None,
        },
        warnings: Vec::new(),
    }
}

/// `a` better than `b` at the largest scale.
fn pair(a: &str, b: &str, basis: Basis, scales_m: &[f64]) -> PairReport {
    let scale = |&scale_m: &f64| ScaleReport {
        scale_m,
        mean_a_m2: Some(0.1 * scale_m),
        mean_b_m2: Some(0.1254 * scale_m),
        difference_m2: Some(-0.0254 * scale_m),
        interval_m2: Some([-0.0307 * scale_m, -0.0201 * scale_m]),
        apart_at_most_m: Some(0.02),
        margin_m: Some(0.01),
        returns: 876_543,
    };
    PairReport {
        a: a.into(),
        b: b.into(),
        basis,
        scales: scales_m.iter().map(scale).collect(),
        llr_raw: 123_456.0,
        verdict: Verdict::Better { run: a.into(), decided_at_m: scales_m[0], is_same: false },
        reason: "better globally: decided at the 10 m scale (876543 common returns)".into(),
        frames_needed: None,
        places_needed: None,
    }
}

fn report(runs: Vec<RunReport>, order: &[&str], pairs: Vec<PairReport>) -> Report {
    Report {
        schema: Report::SCHEMA.into(),
        dmp_version: "0.0.0".into(),
        config: ConfigReport {
            voxel_m: 1638.0 / 8192.0,
            voxel_filled_share: Some(0.75),
            tile_edge_m: 32.0,
            disc_radius_m: 0.16,
            segments: SegmentReport {
                length_m: Some(12.0),
                length_s: None,
                length_scans: None,
                count: 29,
                travel_m: 351.0,
                starts_ns: Vec::new(),
                starts_scan: Vec::new(),
            },
            min_range_m: 1.5,
            max_range_m: 100.0,
            horizon_m: 200.0,
            ego: EgoReport { known: Ego::Auto, cells: 0 },
            every: 1,
            body_from_sensor: Some([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
            time_offset_s: 0.0,
            sigma_m: Some(0.02),
            depth_noise: None,
            scales: Scales::Drive,
            miss_price: 0.15,
            free_space: false,
        },
        inputs: InputReport {
            log: "town.mcap".into(),
            format: "MCAP".into(),
            fingerprint: "crc32:00000000".into(),
            bytes: 20_000_000,
            has_checksums: Some(true),
            topic: Some("/points".into()),
            point_times: None,
            span_ns: Some((0, 60_000_000_000)),
            scans: 600,
            scans_used: 597,
            returns: 1_234_567,
            returns_used: 1_200_000,
            dropped: DropReport(
                [("too_near", 30_000), ("too_far", 4567), ("vehicle", 0)]
                    .map(|(why, n)| (why.into(), n))
                    .into(),
            ),
            runs: Vec::new(),
            notes: Vec::new(),
            damage: Vec::new(),
        },
        free_space: None,
        runs,
        left_out: Vec::new(),
        order: order.iter().map(|&name| name.to_owned()).collect(),
        ties: Vec::new(),
        pairs,
        drift: None,
        promise: PromiseReport {
            confidence: 0.99,
            interval_confidence: 0.9975,
            same_within_share: Some(0.1),
            same_within_m: None,
            of_each_result: false,
        },
        sampling: SamplingReport {
            frames_scored: 597,
            frames_total: 597,
            seed: None,
            looks: None,
            places: None,
        },
        warnings: Vec::new(),
        timing: PassTimes {
            plan_s: 0.5,
            fuse_s: 1.25,
            trails_s: 0.0,
            cast_s: 61.25,
            drift_s: 0.0,
            total_s: 63.0,
            threads: 2,
        },
        memory: MemoryReport {
            budget_bytes: 2 << 30,
            peak_anon_bytes: Some(300 << 20),
            scratch_bytes: 0,
            disk_bytes: 0,
            disk_bytes_estimated: 0,
            tile_loads: 182,
            tiles_in_reach: 160,
            tile_visits: 182,
        },
        tiles: Vec::new(),
    }
}
