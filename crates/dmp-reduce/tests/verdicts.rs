//! The verdict on a pair of runs: the cascade of scales, the place guard, the reasons.
#![expect(clippy::expect_used, reason = "a case that cannot be set up is a failed test")]

use dmp_reduce::{
    Basis, Comparison, Confidence, FrameSums, Layout, MissPrice, Ranked, Reducer, Residuals, Scales, Stretch,
    SurfaceGroup, UndecidedReason, Verdict, order_runs,
};

const CV: Basis = Basis::CrossValidated;
const RETURNS: u32 = 40;

/// Reduces `frames` of a layout, of which `residuals(frame, k)` gives the residuals of every run for the k-th return.
fn reduced<const RUNS: usize>(
    layout: Layout,
    frames: impl Iterator<Item = u64>,
    residuals: impl Fn(u64, u32) -> [Residuals; RUNS],
) -> Reducer {
    let mut sums = FrameSums::new(layout.bases());
    let mut reducer = Reducer::new(layout);
    for frame in frames {
        sums.clear();
        (0..RETURNS).for_each(|k| sums.add_return(&residuals(frame, k).map(|r| on(frame, k, r))));
        reducer.add_frame(frame, &sums).expect("the frames of the layout");
    }
    reducer
}

/// Compares two runs of which `residuals_m(frame, k)` gives the residuals of the k-th return.
fn compare(bases: [Basis; 2], frames: u64, residuals_m: impl Fn(u64, u32) -> [Option<f64>; 2]) -> Comparison {
    let residuals = |frame, k| residuals_m(frame, k).map(|m| m.map_or(Residuals::MISS, Residuals::all));
    reduced(Layout::new(frames, bases.to_vec()), 0..frames, residuals).compare(0, 1, Confidence::P99)
}

/// The surface that the k-th return of a frame lies on: new ones come into view, old ones are left behind.
fn on(frame: u64, k: u32, residuals: Residuals) -> Residuals {
    let surface = SurfaceGroup::of_cube([(frame / 4 + u64::from(k)) as i32, 0, 0]);
    Residuals { surfaces: [surface; 2], ..residuals }
}

/// A number in [−1, 1) that looks random and is the same for everyone.
fn noise(frame: u64, k: u32, which: u64) -> f64 {
    let mut x = (frame * 1_000_003 + u64::from(k)).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (which << 60);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

#[track_caller]
fn assert_better(pair: &Comparison, run: usize, at_m: f64, reason: &str) {
    let Verdict::Better { which, decided_at_m, returns } = pair.verdict else {
        panic!("{:?}", pair.verdict);
    };
    assert_eq!((which, decided_at_m, returns), (run, at_m, pair.common_returns));
    assert_eq!(pair.verdict.reason(Scales::Drive), format!("{reason} ({returns} common returns)"));
}

#[test]
fn a_gross_error_decides_at_ten_metres() {
    let pair = compare([CV; 2], 60, |f, k| [Some(6.0 + noise(f, k, 1)), Some(noise(f, k, 2))]);
    assert_better(&pair, 1, 10.0, "better globally: decided at the 10 m scale");
    assert!(pair.scales[0].difference.unwrap().value_m2 > 30.0);
    assert_eq!(pair.scales.iter().map(|s| s.scale_m).collect::<Vec<_>>(), [10.0, 2.0, 0.5, 0.2]);
}

#[test]
fn smaller_errors_decide_at_smaller_scales() {
    let cases = [
        (40.0, 1.0, 2.0, "better at the metre scale: decided at 2 m, undecided above"),
        (2.0, 0.15, 0.5, "better locally: decided at 0.5 m, undecided above"),
        (0.5, 0.06, 0.2, "better only at the centimetre scale: decided at 0.2 m, undecided above"),
    ];
    for (outlier_m, error_m, decided_at_m, reason) in cases {
        // Outliers hide what is smaller than they are. Both runs have as many, in neighbouring frames.
        let pair = compare([CV; 2], 200, |f, k| {
            let outlier = |frame| Some(outlier_m).filter(|_| noise(frame, k, 1) > 0.2);
            [outlier(f).or(Some(0.0)), outlier(f ^ 1).or(Some(error_m))]
        });
        assert_better(&pair, 0, decided_at_m, reason);
    }
}

#[test]
fn undecided_pairs_say_why() {
    let undecided = |pair: Comparison| match pair.verdict {
        Verdict::Undecided { reason } => (reason, pair.verdict.reason(Scales::Drive)),
        verdict => panic!("{verdict:?}"),
    };
    let apart = compare([CV; 2], 50, |_, k| if k % 2 == 0 { [Some(0.1), None] } else { [None, Some(0.1)] });
    assert_eq!(undecided(apart).0, UndecidedReason::NoCommonReturns);
    let three = compare([CV; 2], 3, |_, _| [Some(0.1), Some(5.0)]);
    assert_eq!(
        undecided(three),
        (
            UndecidedReason::TooFewFrames { frames: 3 },
            "undecided: only 3 frames have common returns, 4 are needed".into()
        )
    );
    let short = compare([CV; 2], 1000, |f, k| {
        [Some(0.1 + noise(f, k, 1)), Some(5.0).filter(|_| (25..50).contains(&f))]
    });
    assert_eq!(undecided(short).0, UndecidedReason::OneStretch);
    let one_place =
        compare([CV; 2], 60, |f, k| [Some(noise(f, k, 1)), Some(5.0).filter(|_| f / 4 + u64::from(k) == 30)]);
    assert_eq!(undecided(one_place).0, UndecidedReason::FewSurfaces { groups: 1 });
}

#[test]
fn runs_that_are_known_to_be_one_are_the_same_whatever_their_residuals() {
    let apart = compare([CV; 2], 80, |f, k| [0.1, 0.3].map(|m| Some(m + 0.01 * noise(f, k, 1))));
    assert!(matches!(apart.verdict, Verdict::Better { which: 0, .. }), "{apart:?}");
    let same = apart.clone().of_same();
    assert_eq!((&same.verdict, same.verdict.reason(Scales::Drive).as_str()), (&Verdict::Same, "the same"));
    assert_eq!((same.scales, same.common_returns), (apart.scales, apart.common_returns));
}

#[test]
fn the_guard_finds_the_places_that_oppose() {
    // b is 3 m off nearly everywhere; between frames 120 and 179 it is a that is off, by 2.5 m.
    let residuals = |f: u64, k: u32| {
        let off = if (120..180).contains(&f) { [2.5, 0.0] } else { [0.0, 3.0] };
        [Some(off[0] + 0.1 * noise(f, k, 1)), Some(off[1] + 0.1 * noise(f, k, 2))]
    };
    let pair = compare([CV; 2], 600, residuals);
    let Verdict::Mixed { which, decided_at_m, opposed_at_m, ref places, .. } = pair.verdict else {
        panic!("{:?}", pair.verdict);
    };
    assert_eq!((which, decided_at_m, opposed_at_m), (0, 10.0, 30.0));
    assert_eq!(places[..], [Stretch { first: 120, last: 179 }]);
    let reason = pair.verdict.reason(Scales::Drive);
    let expected = "better on the whole, globally: decided at the 10 m scale, \
                    but worse in scans 120–179 at 30 m (24000 common returns)";
    assert_eq!(reason, expected);
    assert!(pair.verdict.reason_with(Scales::Drive, |ordinal| 10 * ordinal).contains("scans 1200–1790 at"));
    // By hand: L = (0.1 · 2.5² + 0.9 · 3²) / 2 and one tenth of the places opposes by 2.5² / L.
    let level = 0.5 * (0.1 * 6.25 + 0.9 * 9.0);
    let guard = &pair.guard[0];
    assert!((guard.opposition - 0.1 * 6.25 / level).abs() < 0.002, "{}", guard.opposition);
    assert!((guard.support - 0.9 * 9.0 / level).abs() < 0.01, "{}", guard.support);
    assert_eq!(guard.scale_m, 30.0);
    assert_eq!(pair.guard[1].scale_m, 2.0);
}

/// Residuals of pairs are squared as they are kept: in steps of 1/8192 m.
const KEPT: f64 = 2e-4;

/// Without any noise: a and b are level but for `opposing` in the first places, `supporting` in the
/// others, so that the means are known beforehand.
fn guard_of(opposing_places: u64, opposing_m2: f64, supporting_m2: f64, level_m2: f64) -> Comparison {
    let residual = |more_m2: f64| Some((level_m2 + more_m2).sqrt());
    compare([CV; 2], 200, |f, _| {
        if f / 20 < opposing_places {
            [residual(opposing_m2), residual(0.0)]
        } else {
            [residual(0.0), residual(supporting_m2)]
        }
    })
}

#[test]
fn a_little_opposition_is_tolerated() {
    // Truncated at 2 m (4 m²) all of it is below: both guards see the same numbers.
    let pair = guard_of(1, 0.1, 1.0, 2.0);
    assert!(matches!(pair.verdict, Verdict::Better { which: 0, .. }), "{:?}", pair.guard);
    let level = 0.5 * (2.0 + 0.1 * 0.1 + 2.0 + 0.9);
    for guard in &pair.guard {
        assert!((guard.opposition - 0.01 / level).abs() < KEPT);
        assert!((guard.support - 0.9 / level).abs() < KEPT);
        assert!(!guard.tripped);
    }
    assert_eq!(pair.guard[1].against, [Stretch { first: 0, last: 19 }]);
}

#[test]
fn at_two_metres_the_opposition_is_weighed_against_the_support() {
    // Below .10, so that the guard at 30 m is content.
    let level = |opposing: f64, supporting: f64| 0.5 * (6.0 + 0.2 * opposing + 0.8 * supporting);
    let outweighed = guard_of(2, 0.9, 1.0, 3.0);
    let guard = &outweighed.guard[1];
    assert!((guard.opposition - 0.18 / level(0.9, 1.0)).abs() < KEPT);
    assert!(guard.opposition > 0.02 && guard.opposition < 0.25 * guard.support && !guard.tripped);
    assert!(matches!(outweighed.verdict, Verdict::Better { which: 0, .. }));

    let weighty = guard_of(2, 1.0, 0.9, 3.0);
    let guard = &weighty.guard[1];
    assert!((guard.support - 0.72 / level(1.0, 0.9)).abs() < KEPT);
    assert!(guard.opposition < 0.10 && guard.opposition > 0.25 * guard.support && guard.tripped);
    assert!(!weighty.guard[0].tripped);
    let Verdict::Mixed { which: 0, opposed_at_m: 2.0, places, .. } = weighty.verdict else {
        panic!("{:?}", weighty.verdict);
    };
    assert_eq!(places, [Stretch { first: 0, last: 39 }]);
}

#[test]
fn a_given_map_is_judged_by_the_nearest_crossing() {
    let pair = compare([CV, Basis::Near], 60, |f, k| [Some(noise(f, k, 1)), Some(4.0 + noise(f, k, 2))]);
    assert_eq!(pair.basis, Basis::Near);
    assert_better(&pair, 0, 5.0, "better globally: decided at the 5 m scale");
    assert_eq!(pair.scales.iter().map(|s| s.scale_m).collect::<Vec<_>>(), [5.0, 2.0, 0.5]);
    assert_eq!(pair.guard.iter().map(|g| g.scale_m).collect::<Vec<_>>(), [5.0, 2.0]);
}

/// The runs along the decided verdicts, else by ascending `R_cv` at its widest scale.
fn in_order(reducer: &Reducer, comparisons: &[Comparison]) -> Vec<Ranked> {
    let runs = reducer.layout().bases().len();
    let score = |run| reducer.scores(run, Confidence::P99).r_cv_m2[0].1.map(|score| score.value_m2);
    let decided = |pair: &Comparison| match pair.verdict {
        Verdict::Better { which, .. } => Some((which, pair.a + pair.b - which)),
        _ => None,
    };
    order_runs(
        &(0..runs).map(score).collect::<Vec<_>>(),
        &comparisons.iter().filter_map(decided).collect::<Vec<_>>(),
    )
}

#[test]
fn runs_are_listed_along_the_verdicts() {
    // Run 2 misses a third of the returns, so its R_cv(10) is bad; where it does see something it is the best.
    let reducer = reduced(Layout::new(50, vec![CV; 4]), 0..50, |frame, k| {
        let off = |base: f64, which| Residuals::all(base + 0.05 * noise(frame, k, which));
        let seldom = if k % 3 < 2 { off(0.0, 3) } else { Residuals::MISS };
        [off(2.0, 1), off(0.5, 2), seldom, off(0.5, 4)]
    });
    let r_cv_m2 = |run| reducer.scores(run, Confidence::P99).r_cv_m2[0].1.unwrap().value_m2;
    let order = in_order(&reducer, &reducer.comparisons(Confidence::P99).pairs);
    let runs: Vec<_> = order.iter().map(|r| r.run).collect();
    assert_eq!((runs[0], runs[3]), (2, 0));
    assert_eq!(order.iter().map(|r| r.tied_with_next).collect::<Vec<_>>(), [false, true, false, false]);
    assert!(r_cv_m2(2) > r_cv_m2(0));
}

#[test]
fn a_run_that_predicts_less_than_half_of_what_the_other_does_is_not_the_better_one() {
    // The first run predicts one in `of` returns, without error.
    for (of, better) in [(1, Some(0)), (2, Some(0)), (3, None), (8, None)] {
        let predicts =
            |frame: u64, k: u32| [k.is_multiple_of(of).then_some(0.1), Some(0.5 + 0.05 * noise(frame, k, 2))];
        let pair = compare([CV; 2], 60, predicts);
        if let Some(better) = better {
            assert!(matches!(pair.verdict, Verdict::Better { which, .. } if which == better), "{pair:?}");
        } else {
            let all = 60 * u64::from(RETURNS);
            let reason = UndecidedReason::LessCovered { predicted: pair.common_returns, other: all };
            assert_eq!(pair.verdict, Verdict::Undecided { reason });
        }
        // The other way round nothing is amiss.
        let worse =
            |frame: u64, k: u32| [k.is_multiple_of(of).then_some(0.5 + 0.05 * noise(frame, k, 2)), Some(0.1)];
        let pair = compare([CV; 2], 60, worse);
        assert!(matches!(pair.verdict, Verdict::Better { which: 1, .. }), "{pair:?}");
    }
}

#[test]
fn a_run_that_comes_back_and_does_not_find_what_it_saw_is_not_the_better_one() {
    // The first run finds every return without error, and one in `of` on another visit; the second one in `others`.
    for (of, others, back, is_held_back) in [
        (9, 3, 0.4, true),
        (100, 3, 0.4, true),
        // It does not come back.
        (9, 3, 0.0, false),
        (9, 3, 0.2, false),
        // The other run finds as little.
        (6, 3, 0.4, false),
        (100, 100, 0.4, false),
    ] {
        let reducer = reduced(Layout::new(60, vec![CV; 2]), 0..60, |frame, k| {
            let seen = |m, of: u32| Residuals { revisited: k.is_multiple_of(of), ..Residuals::all(m) };
            [seen(0.1, of), seen(0.5 + 0.05 * noise(frame, k, 2), others)]
        });
        let pair = reducer.compare(0, 1, Confidence::P99).with_revisits(
            |run| reducer.sums(run),
            |run| {
                assert_eq!(run, 0);
                back
            },
        );
        let revisits = |of| 60 * (0..RETURNS).filter(|k| k.is_multiple_of(of)).count() as u64;
        let reason = UndecidedReason::VisitsApart { revisited: revisits(of), other: revisits(others) };
        match pair.verdict {
            Verdict::Better { which: 0, .. } => assert!(!is_held_back, "{of} {others} {back}"),
            Verdict::Undecided { reason: found } => assert_eq!((found, is_held_back), (reason, true)),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn undecided_runs_are_listed_by_the_price_of_a_miss() {
    // Of every fourth return run 0 predicts nothing and run 1 is 3 m off, 9 of the 100 m² of a full square;
    // on the others, those in common, they are alike.
    let listed = |share: f64| {
        let price = MissPrice::new(share).expect("a share");
        let layout = Layout::new(50, vec![CV; 2]).with_miss_price(price);
        let reducer = reduced(layout, 0..50, |frame, k| {
            let apart = [Residuals::MISS, Residuals::all(3.0)];
            if k % 4 == 0 { apart } else { [Residuals::all(noise(frame, k, 1)); 2] }
        });
        let comparisons = reducer.comparisons(Confidence::P99).pairs;
        assert!(matches!(comparisons[0].verdict, Verdict::Undecided { .. }), "{comparisons:?}");
        in_order(&reducer, &comparisons).iter().map(|r| (r.run, r.tied_with_next)).collect::<Vec<_>>()
    };
    for share in [0.0, 0.089] {
        assert_eq!(listed(share), [(0, true), (1, false)], "{share}");
    }
    for share in [0.091, 0.15, 1.0] {
        assert_eq!(listed(share), [(1, true), (0, false)], "{share}");
    }
}

/// Runs of the same noise: all equal, and any two with a verdict are one wrong command.
#[test]
fn of_many_equal_runs_none_is_better() {
    let decided_wrongly = |runs: usize, confidence: f64, seeds: u64| {
        let promise = Confidence::new(confidence).unwrap();
        let wrong = (0..seeds).filter(|seed| {
            let mut reducer = Reducer::new(Layout::new(60, vec![CV; runs]));
            let mut sums = FrameSums::new(&vec![CV; runs]);
            for frame in 0..60 {
                sums.clear();
                for k in 0..8 {
                    let of_run =
                        |run| on(frame, k, Residuals::all(3.0 * noise(1000 * seed + frame, k, run as u64)));
                    sums.add_return(&(0..runs).map(of_run).collect::<Vec<_>>());
                }
                reducer.add_frame(frame, &sums).unwrap();
            }
            let decided =
                |pair: &Comparison| matches!(pair.verdict, Verdict::Better { .. } | Verdict::Mixed { .. });
            reducer.comparisons(promise).pairs.iter().any(decided)
        });
        wrong.count()
    };
    // Half of the commands at most are to be wrong, so that a few hundred show something.
    for (runs, seeds) in [(2, 400), (6, 150)] {
        let wrong = decided_wrongly(runs, 0.5, seeds);
        assert!(wrong as f64 <= 0.5 * seeds as f64, "{wrong} of {seeds} commands with {runs} runs");
    }
    assert_eq!(decided_wrongly(6, 0.99, 60), 0);
}

/// Of runs that are far apart no pair needs a share of the error.
#[test]
fn pairs_that_differ_leave_their_share_to_the_others() {
    let offsets_m = [[0.0, 0.0, 0.0, 0.0], [0.0, 2.0, 4.0, 8.0], [0.0, 0.0, 8.0, 8.0]];
    for (offsets_m, pairs) in offsets_m.into_iter().zip([6.0, 1.0, 2.0]) {
        let reducer = reduced(Layout::new(60, vec![CV; 4]), 0..60, |frame, k| {
            std::array::from_fn::<_, 4, _>(|run| Residuals::all(offsets_m[run] + noise(frame, k, run as u64)))
        });
        let level = reducer.comparisons(Confidence::P99).of_each_interval.level();
        assert!((level - (1.0 - 0.01 / (4.0 * pairs))).abs() < 1e-12, "{offsets_m:?}: {level}");
    }
}
