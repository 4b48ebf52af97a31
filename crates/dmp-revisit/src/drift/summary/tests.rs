use super::*;
use crate::drift::VisitReport;

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

/// Visits of a run: pairs of scans of their own, three in a block.
fn visits(run: &[Option<Displacement>]) -> (Vec<VisitPairReport>, Vec<PairFacts>) {
    let visit = |scan: usize| VisitReport { scan, stamp_ns: None, scans: vec![scan, scan + 1] };
    let report = |k: usize| VisitPairReport {
        first: visit(10 * k),
        second: visit(10 * k + 5),
        apart_m: 0.0,
        way_m: 100.0,
        at_m: [0.0; 3],
        off: run[k],
        at_least_m: None,
        why_not: None,
        first_from_second: None,
        covariance: None,
    };
    let facts = |k: usize| PairFacts { block: k / 3, way_m: 100.0, time_s: Some(k as f64) };
    ((0..run.len()).map(report).collect(), (0..run.len()).map(facts).collect())
}

fn drift_of(name: &str, run: &[Option<Displacement>]) -> RunDrift {
    let (visits, pairs) = visits(run);
    let facts = RunFacts {
        name,
        travel_m: 1000.0,
        segments: 90,
        pairs_found: run.len(),
        searched_m: 6.0,
        pairs: &pairs,
    };
    of_run(&facts, visits, (1.0, p95()))
}

/// A segment has two scans.
fn starts() -> Vec<usize> {
    (0..400).map(|segment| 2 * segment).collect()
}

fn both(a: &[Option<Displacement>], b: &[Option<Displacement>], confidence: Confidence) -> DriftComparison {
    let blocks: Vec<usize> = (0..a.len()).map(|k| k / 3).collect();
    compared([&drift_of("a", a), &drift_of("b", b)], &blocks, &starts(), [confidence; 2])
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
    let drift = drift_of("kiss", &run);
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
    let drift = drift_of("still", &run);
    // 5 cm of noise and nothing else.
    assert!(drift.rms_m.value.unwrap() < 0.01, "{drift:?}");
}

#[test]
fn pairs_without_an_answer_are_counted() {
    let mut run = vec![Some(off(0.1, 0.0)); 8];
    run[2] = None;
    let open = run[5].as_mut().unwrap();
    (open.along_m, open.distance_m) = (None, None);
    let drift = drift_of("kiss", &run);
    assert_eq!((drift.pairs, drift.pairs_in_part, drift.pairs_refused), (6, 1, 1));
    // Three blocks are too few for an interval.
    assert!(drift.rms_m.value.is_some() && drift.rms_m.interval.is_none());
    let nothing = drift_of("lost", &[None; 8]);
    assert_eq!((nothing.pairs, nothing.rms_m.value, nothing.yaw_deg), (0, None, None));
    let compared = both(&run, &[None; 8], p95());
    assert_eq!((compared.pairs, compared.better, compared.rms_a_m), (0, None, None));
}

/// A pair where nothing fits is far off, not absent: the run is never the better one.
#[test]
fn a_lost_visit_is_evidence() {
    let near: Vec<_> = (0..24).map(|_| Some(off(0.1, 0.001))).collect();
    let far: Vec<_> = (0..24).map(|_| Some(off(0.5, 0.001))).collect();
    let compared_with = |run: &RunDrift| {
        let blocks: Vec<usize> = (0..24).map(|k| k / 3).collect();
        compared([run, &drift_of("b", &far)], &blocks, &starts(), [p95(); 2])
    };
    assert_eq!(compared_with(&drift_of("a", &near)).better.as_deref(), Some("a"));
    // Where it often has no answer and the other has, that is no merit.
    let mut fewer = near.clone();
    fewer[7] = None;
    assert_eq!(compared_with(&drift_of("a", &fewer)).better.as_deref(), Some("a"));
    let mut few = fewer.clone();
    few[8..12].fill(None);
    let silent = drift_of("a", &few);
    assert_eq!((silent.pairs_refused, silent.pairs_lost), (5, 0));
    assert_eq!(compared_with(&silent).better, None);
    let (mut visits, pairs) = visits(&fewer);
    visits[7].at_least_m = Some(6.0);
    let facts = RunFacts {
        name: "a",
        travel_m: 1000.0,
        segments: 90,
        pairs_found: 24,
        searched_m: 6.0,
        pairs: &pairs,
    };
    let lost = of_run(&facts, visits, (1.0, p95()));
    assert_eq!((lost.pairs, lost.pairs_lost, lost.pairs_refused, lost.pairs_in_part), (23, 1, 0, 0));
    let rms_m = ((23.0 * 0.01 + 36.0) / 24.0_f64).sqrt();
    assert!((lost.rms_m.value.unwrap() - rms_m).abs() < 1e-4, "{lost:?}");
    assert_eq!((compared_with(&lost).better, compared_with(&lost).pairs), (None, 24));
}

/// The null: among equally wrong runs, one is better no more often than the intervals promise; and the power.
#[test]
fn equal_runs_are_equal_and_others_are_ranked() {
    let mut wrong = 0;
    for seed in 0..200 {
        let run = |which: usize| -> Vec<_> {
            (0..60).map(|k| Some(off(0.1 * chance(seed, which, k), 0.0))).collect()
        };
        wrong += usize::from(both(&run(1), &run(2), p95()).better.is_some());
    }
    assert!(wrong <= 20, "{wrong} of 200 at 95 %");
    let run = |size_m: f64| -> Vec<_> { (0..60).map(|k| Some(off(size_m * scattered(k), 0.0))).collect() };
    let drift = both(&run(0.1), &run(0.3), Confidence::P99);
    assert_eq!(drift.better.as_deref(), Some("a"));
    assert_eq!(drift, both(&run(0.1), &run(0.3), Confidence::P99));
}

/// The null with the fewest blocks that have an interval, whose pairs are correlated.
#[test]
fn few_blocks_do_not_tell_equal_runs_apart() {
    let mut wrong = 0;
    for seed in 0..1000 {
        let run = |which: usize| -> Vec<_> {
            (0..18).map(|k| Some(off(0.1 + 0.05 * chance(seed, which, k / 3), 0.0))).collect()
        };
        wrong += usize::from(both(&run(1), &run(2), Confidence::P99).better.is_some());
    }
    assert!(wrong <= 20, "{wrong} of 1000 at 99 %");
}

/// A consistent difference counts only if it exceeds the measurement error: the same run in two worlds
/// differs by rounding alone, possibly always with one sign.
#[test]
fn what_is_less_than_the_measurement_tells_nothing() {
    let better = |a_m: f64, b_m: f64| {
        let run = |off_m: f64| vec![Some(off(off_m, 0.003)); 24];
        both(&run(a_m), &run(b_m), Confidence::P99).better
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

/// Runs have visits of their own: those that lie next to each other are compared.
#[test]
fn visits_of_neighbouring_scans_are_the_same() {
    let run = vec![Some(off(0.1, 0.0)); 24];
    let (mut other, blocks) = (drift_of("b", &run), vec![0; 24]);
    for visit in &mut other.visits {
        // The cut of this run is a scan later.
        [&mut visit.first.scan, &mut visit.second.scan].into_iter().for_each(|scan| *scan += 2);
    }
    let pairs =
        |other: &RunDrift| compared([&drift_of("a", &run), other], &blocks, &starts(), [p95(); 2]).pairs;
    assert_eq!(pairs(&other), 24);
    other.visits.remove(3);
    other.visits[5].second.scan += 1;
    assert_eq!(pairs(&other), 22);
}
