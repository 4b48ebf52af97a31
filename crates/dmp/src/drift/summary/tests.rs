use super::*;
use crate::drift::{VisitPairOfRun, VisitReport};

/// A pair in which a run is off by this much to the side, and the noise of each part.
fn off(sideways_m: f64, sigma_m: f64) -> Displacement {
    Displacement {
        along_m: Some(0.0),
        sideways_m: Some(sideways_m),
        up_m: Some(0.0),
        sigma_m: [sigma_m.hypot(0.01); 3],
        distance_m: Some(sideways_m.abs()),
        roll_deg: 0.0,
        pitch_deg: 0.0,
        yaw_deg: 0.3,
        angle_deg: 0.3,
        in_world_m: [0.0; 3],
        allowance_m: 0.01,
        overlap: 0.6,
        held: 0.1,
    }
}

/// Visits of some runs, each pair this many segments after the one before.
fn visits(of_runs: &[Vec<Option<Displacement>>]) -> (Vec<VisitPairReport>, Vec<PairFacts>) {
    let visit = VisitReport { scan: 0, stamp_ns: None, scans: Vec::new() };
    let of_run = |off: Option<Displacement>| VisitPairOfRun {
        at_m: None,
        off,
        why_not: None,
        first_from_second: None,
        covariance: None,
    };
    let pairs = of_runs[0].len();
    let report = |k: usize| VisitPairReport {
        first: visit.clone(),
        second: visit.clone(),
        apart_m: 0.0,
        way_m: 100.0,
        runs: of_runs.iter().map(|run| of_run(run[k])).collect(),
    };
    let facts = |k: usize| PairFacts { block: k / 3, way_m: 100.0, time_s: Some(k as f64) };
    ((0..pairs).map(report).collect(), (0..pairs).map(facts).collect())
}

/// Evenly spread over −1 to 1, without an order that blocks could follow.
fn scattered(k: usize) -> f64 {
    let part = (k as u32).wrapping_mul(2_654_435_769);
    f64::from(part) / 2_147_483_648.0 - 1.0
}

fn p95() -> Confidence {
    Confidence::new(0.95).unwrap()
}

/// Pseudo-random, between −1 and 1.
fn chance(seed: usize, run: usize, k: usize) -> f64 {
    let drawn = mixed(mixed(mixed(seed as u64) ^ run as u64) ^ k as u64);
    (drawn >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

#[test]
fn a_run_is_off_by_what_its_pairs_are() {
    let run: Vec<_> = (0..30).map(|k| Some(off(if k % 2 == 0 { 0.3 } else { -0.5 }, 0.0))).collect();
    let (visits, facts) = visits(&[run]);
    let drift = of_run("kiss", 0, &visits, &facts, (1.0, p95()));
    let rms_m = (0.5_f64 * (0.09 + 0.25)).sqrt();
    let near = |value: Option<f64>, expected: f64| value.is_some_and(|v| (v - expected).abs() < 1e-12);
    assert!(near(drift.rms_m.value, rms_m) && near(drift.sideways_m, rms_m), "{drift:?}");
    assert!(near(drift.median_m.value, 0.3) && near(drift.p95_m.value, 0.5), "{drift:?}");
    assert!(
        near(drift.of_the_way_percent, 0.3) && near(drift.up_m, 0.0) && near(drift.yaw_deg, 0.3),
        "{drift:?}"
    );
    let [low, high] = drift.rms_m.interval.unwrap();
    assert!(low < rms_m && rms_m < high && high < 0.5, "{drift:?}");
    assert_eq!((drift.pairs, drift.pairs_refused, drift.over_way.len()), (30, 0, 1));
    assert_eq!(drift.over_time.iter().map(|bin| bin.pairs).sum::<usize>(), 30);
}

#[test]
fn noise_of_the_measurement_is_taken_off() {
    let run: Vec<_> =
        (0..400).map(|k| Some(off(0.05 * 3.0_f64.sqrt() * scattered(k), 0.05 / 3.0_f64.sqrt()))).collect();
    let (visits, facts) = visits(&[run]);
    let drift = of_run("still", 0, &visits, &facts, (1.0, p95()));
    // 5 cm of noise and nothing else.
    assert!(drift.rms_m.value.unwrap() < 0.01, "{drift:?}");
}

#[test]
fn pairs_without_an_answer_are_counted() {
    let mut run = vec![Some(off(0.1, 0.0)); 8];
    run[2] = None;
    let open = run[5].as_mut().unwrap();
    (open.along_m, open.distance_m) = (None, None);
    let (visits, facts) = visits(&[run, vec![None; 8]]);
    let drift = of_run("kiss", 0, &visits, &facts, (1.0, p95()));
    assert_eq!((drift.pairs, drift.pairs_in_part, drift.pairs_refused), (6, 1, 1));
    // Three blocks are too few for an interval.
    assert!(drift.rms_m.value.is_some() && drift.rms_m.interval.is_none());
    let nothing = of_run("lost", 1, &visits, &facts, (1.0, p95()));
    assert_eq!((nothing.pairs, nothing.rms_m.value, nothing.yaw_deg), (0, None, None));
    let compared = compared((0, 1), ["kiss", "lost"], &visits, &facts, p95());
    assert_eq!((compared.pairs, compared.better, compared.rms_a_m), (0, None, None));
}

/// The null: among equally wrong runs, one is better no more often than the intervals promise; and the power.
#[test]
fn equal_runs_are_equal_and_others_are_ranked() {
    let mut wrong = 0;
    for seed in 0..200 {
        let run = |which: usize| -> Vec<_> {
            (0..60).map(|k| Some(off(0.1 * chance(seed, which, k), 0.0))).collect()
        };
        let (visits, facts) = visits(&[run(1), run(2)]);
        wrong += usize::from(compared((0, 1), ["a", "b"], &visits, &facts, p95()).better.is_some());
    }
    assert!(wrong <= 20, "{wrong} of 200 at 95 %");
    let run = |size_m: f64| -> Vec<_> { (0..60).map(|k| Some(off(size_m * scattered(k), 0.0))).collect() };
    let (visits, facts) = visits(&[run(0.1), run(0.3)]);
    let drift = compared((0, 1), ["a", "b"], &visits, &facts, Confidence::P99);
    assert_eq!(drift.better.as_deref(), Some("a"));
    assert_eq!(drift, compared((0, 1), ["a", "b"], &visits, &facts, Confidence::P99));
}

/// The null with the fewest blocks that have an interval, whose pairs are correlated.
#[test]
fn few_blocks_do_not_tell_equal_runs_apart() {
    let mut wrong = 0;
    for seed in 0..1000 {
        let run = |which: usize| -> Vec<_> {
            (0..18).map(|k| Some(off(0.1 + 0.05 * chance(seed, which, k / 3), 0.0))).collect()
        };
        let (visits, facts) = visits(&[run(1), run(2)]);
        wrong += usize::from(compared((0, 1), ["a", "b"], &visits, &facts, Confidence::P99).better.is_some());
    }
    assert!(wrong <= 20, "{wrong} of 1000 at 99 %");
}

/// A consistent difference counts only if it exceeds the measurement error: the same run in two worlds
/// differs by rounding alone, possibly always with one sign.
#[test]
fn what_is_less_than_the_measurement_tells_nothing() {
    let better = |a_m: f64, b_m: f64| {
        let run = |off_m: f64| vec![Some(off(off_m, 0.003)); 24];
        let (visits, facts) = visits(&[run(a_m), run(b_m)]);
        compared((0, 1), ["a", "b"], &visits, &facts, Confidence::P99).better
    };
    for base_m in [0.0, 0.01, 0.3, 3.0] {
        assert_eq!(better(base_m, base_m + 1e-9), None, "{base_m}");
        assert_eq!(better(base_m, base_m + 0.003), None, "{base_m}");
        assert_eq!(better(base_m, base_m + 0.03).as_deref(), Some("a"), "{base_m}");
        assert_eq!(better(base_m + 0.03, base_m).as_deref(), Some("b"), "{base_m}");
    }
}

#[test]
fn pairs_in_a_row_are_blocks() {
    let row = |count: usize, first: usize, second: usize| (0..count).map(move |k| (first + k, second + k));
    let rows = |long: usize| -> Vec<(usize, usize)> {
        row(7, 0, 50).chain(row(2, 10, 60)).chain(row(1, 13, 30)).chain(row(long, 100, 300)).collect()
    };
    let blocks_of = |long: usize| blocks(&rows(long));
    assert_eq!(blocks_of(30)[..10], [0, 0, 0, 0, 0, 1, 1, 2, 2, 3]);
    assert_eq!(blocks_of(30).last(), Some(&9));
    // Of 18 pairs two are one, of ten every pair counts.
    assert_eq!(blocks_of(8), [0, 0, 1, 1, 2, 2, 3, 4, 4, 5, 6, 6, 7, 7, 8, 8, 9, 9]);
    assert_eq!(blocks_of(0), (0..10).collect::<Vec<_>>());
    assert!(blocks(&[]).is_empty());
}
