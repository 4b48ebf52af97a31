//! The sums, against the formulas written out; and that neither order nor splitting changes a bit.

use dmp_reduce::{
    Basis, Comparison, Confidence, DepthResidual, FrameSums, Layout, MissPrice, ReduceError, Reducer,
    Residuals, RunSums, Scales, SurfaceGroup,
};
use proptest::prelude::*;

const CV: Basis = Basis::CrossValidated;

fn residual() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -0.4..0.4f64, 2 => -6.0..6.0f64, 1 => -80.0..80.0f64, 1 => -1e4..1e4f64]
}

fn residuals() -> impl Strategy<Value = Residuals> {
    let parts = (prop::option::weighted(0.8, residual()), -5.0..5.0f64, any::<(bool, bool, bool)>());
    (parts, residual(), 0..9i32).prop_map(|((first_m, nearest, (near, own, revisited)), zc, cube)| {
        Residuals {
            first_m,
            nearest_m: first_m
                .filter(|_| near)
                .map(|first: f64| if first.abs() < 5.0 { first } else { nearest }),
            independent_m: first_m.filter(|_| !own).map(|_| zc),
            revisited: revisited && !own,
            is_left_out: false,
            depth: first_m.map(|m| DepthResidual { first_m: 0.8 * m, first_sigmas: 7.0 * m }),
            surfaces: [SurfaceGroup::of_cube([cube, 0, 0]); 2],
        }
    })
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

fn cut(residual_m: f64, tau_m: f64) -> f64 {
    (residual_m * residual_m).min(tau_m * tau_m)
}

/// A residual as pairs have it: in steps, so that kept results compare to the same bits.
fn kept(residual_m: f64, scales: Scales) -> f64 {
    let steps = if scales == Scales::Room { 81_920.0 } else { 8192.0 };
    (residual_m.abs() * steps).round() / steps
}

/// Up to the rounding of the squares, of which a sum holds a few hundred.
fn close(got: Option<f64>, expected: Option<f64>) -> bool {
    match (got, expected) {
        (Some(got), Some(expected)) => (got - expected).abs() <= 2e-10 + 1e-12 * expected.abs(),
        (got, expected) => got == expected,
    }
}

proptest! {
    #[test]
    fn the_scores_are_those_of_the_formulas(returns in prop::collection::vec(residuals(), 0..300), room: bool) {
        let scales = if room { Scales::Room } else { Scales::Drive };
        let (widest_m, blocked_m) = if room { (1.0, 0.05) } else { (10.0, 0.5) };
        let mut sums = RunSums::new(scales);
        returns.iter().for_each(|r| sums.add(r));
        let share = |f: fn(&Residuals) -> bool| mean(returns.iter().map(|r| f64::from(u8::from(f(r)))));
        let dmp = |r: &Residuals| r.first_m.map(|m| m * m);
        prop_assert!(close(Some(sums.dmp_sum_m2()), Some(returns.iter().filter_map(dmp).sum())));
        prop_assert!(close(sums.dmp_mean_m2(), mean(returns.iter().filter_map(dmp))));
        let depth = |factor: f64| move |r: &Residuals| r.first_m.map(|m| (factor * m) * (factor * m));
        prop_assert!(close(Some(sums.dmp_depth_sum_m2()), Some(returns.iter().filter_map(depth(0.8)).sum())));
        prop_assert!(close(sums.dmp_depth_mean_m2(), mean(returns.iter().filter_map(depth(0.8)))));
        prop_assert!(close(Some(sums.depth_sigmas_squared()), Some(returns.iter().filter_map(depth(7.0)).sum())));
        for share in [0.0, 0.1, 0.25, 1.0] {
            let price = MissPrice::new(share).unwrap();
            let cost = |r: &Residuals| r.independent_m.map_or(widest_m * widest_m * share, |m| cut(m, widest_m));
            prop_assert!(close(sums.r_cv_widest_m2(price), mean(returns.iter().map(cost))));
        }
        let price = MissPrice::default();
        prop_assert_eq!(sums.r_cv_m2(price)[0], (widest_m, sums.r_cv_widest_m2(price)));
        for (tau, score) in &sums.r_cv_m2(price)[1..] {
            let expected = mean(returns.iter().filter_map(|r| r.independent_m).map(|m| cut(m, *tau)));
            prop_assert!(close(*score, expected), "R_cv({tau})");
        }
        for (tau, score) in sums.r_near_m2() {
            let square = |r: &Residuals| r.first_m.map(|_| r.nearest_m.map_or(tau * tau, |m| cut(m, tau)));
            prop_assert!(close(score, mean(returns.iter().filter_map(square))), "R_near({tau})");
        }
        prop_assert_eq!(sums.miss_rate(), share(|r| r.first_m.is_none()));
        prop_assert_eq!(sums.blocked_rate(), mean(returns.iter().map(|r| f64::from(u8::from(r.first_m.is_some_and(|m| m > blocked_m))))));
        prop_assert_eq!(sums.coverage(), share(|r| r.independent_m.is_some()));
        prop_assert_eq!(sums.coverage_revisit(), share(|r| r.revisited));
        prop_assert_eq!(sums.non_finite(), 0);
    }

    #[test]
    fn returns_add_up_in_any_order(
        returns in prop::collection::vec(residuals(), 0..200),
        split in 0usize..200,
    ) {
        let mut forth = RunSums::default();
        returns.iter().for_each(|r| forth.add(r));
        let (left, right) = returns.split_at(split.min(returns.len()));
        let (mut back, mut rest) = (RunSums::default(), RunSums::default());
        right.iter().rev().for_each(|r| back.add(r));
        left.iter().rev().for_each(|r| rest.add(r));
        back.merge(&rest);
        prop_assert_eq!(forth, back);
    }

    #[test]
    fn pairs_are_compared_on_common_returns(
        returns in prop::collection::vec([residuals(), residuals(), residuals()], 0..200),
        near in prop::collection::vec(any::<bool>(), 3),
        room: bool,
    ) {
        let scales = if room { Scales::Room } else { Scales::Drive };
        let bases: Vec<_> = near.iter().map(|&n| if n { Basis::Near } else { CV }).collect();
        let mut frame = FrameSums::on_scales(&bases, scales);
        returns.iter().for_each(|r| frame.add_return(r));
        for (pair, (a, b)) in frame.pair_sums().zip([(0, 1), (0, 2), (1, 2)]) {
            for (k, &tau) in pair.basis().scales_m(scales).iter().enumerate() {
                // A run is kept on its own basis alone.
                let square = |r: &Residuals, basis: Basis| {
                    let of = |m: f64| cut(if basis == pair.basis() { kept(m, scales) } else { m }, tau);
                    match pair.basis() {
                        Basis::CrossValidated => r.independent_m.map(of),
                        Basis::Near => r.first_m.map(|_| r.nearest_m.map_or(tau * tau, of)),
                    }
                };
                let both = |r: &[Residuals; 3]| Some((square(&r[a], bases[a])?, square(&r[b], bases[b])?));
                let common: Vec<_> = returns.iter().filter_map(both).collect();
                prop_assert_eq!(pair.returns(), common.len() as u64);
                let (sum_a, sum_b) = pair.at(k);
                prop_assert!(close(Some(sum_a.to_m2()), Some(common.iter().map(|c| c.0).sum())));
                prop_assert!(close(Some(sum_b.to_m2()), Some(common.iter().map(|c| c.1).sum())));
            }
        }
    }

    #[test]
    fn frames_come_in_any_order_and_split(
        frames in prop::collection::vec(prop::collection::vec([residuals(), residuals(), residuals()], 0..30), 1..60)
            .prop_flat_map(|frames| {
                let order = Just((0..frames.len()).collect::<Vec<_>>()).prop_shuffle();
                (Just(frames), order)
            }),
        shards in 1usize..5,
        left_out in 0u64..3,
    ) {
        let (frames, order) = frames;
        let count = frames.len() as u64;
        let layout = Layout::new(count + left_out, vec![CV, CV, Basis::Near]);
        let sums_of = |ordinal: usize| {
            let mut sums = FrameSums::new(layout.bases());
            frames[ordinal].iter().for_each(|r| sums.add_return(r));
            sums
        };
        let mut whole = Reducer::new(layout.clone());
        for ordinal in 0..frames.len() {
            whole.add_frame(ordinal as u64, &sums_of(ordinal))?;
        }
        let mut parts = vec![Reducer::new(layout.clone()); shards];
        for (k, &ordinal) in order.iter().enumerate() {
            parts[(k * k + ordinal) % shards].add_frame(ordinal as u64, &sums_of(ordinal))?;
        }
        let mut merged = parts.pop().unwrap_or_else(|| Reducer::new(layout.clone()));
        for part in parts.iter().rev() {
            merged.merge(part)?;
        }
        prop_assert_eq!(&merged, &whole);
        prop_assert_eq!(bits(&merged), bits(&whole));
        prop_assert_eq!(merged.frames_added(), count);
    }

    #[test]
    fn the_difference_is_the_mean_over_common_returns(
        frames in prop::collection::vec(prop::collection::vec([residuals(), residuals()], 0..40), 4..30),
    ) {
        let count = frames.len() as u64;
        let mut reducer = Reducer::new(Layout::new(count, vec![CV; 2]));
        for (ordinal, frame) in frames.iter().enumerate() {
            let mut sums = FrameSums::new(&[CV; 2]);
            frame.iter().for_each(|r| sums.add_return(r));
            reducer.add_frame(ordinal as u64, &sums)?;
        }
        let pair = reducer.compare(0, 1, Confidence::P99);
        for scale in &pair.scales {
            let tau = scale.scale_m;
            let of_run = |r: &Residuals| Some(cut(kept(r.independent_m?, Scales::Drive), tau));
            let both = |r: &[Residuals; 2]| Some((of_run(&r[0])?, of_run(&r[1])?));
            let common: Vec<_> = frames.iter().flatten().filter_map(both).collect();
            prop_assert_eq!(pair.common_returns, common.len() as u64);
            prop_assert!(close(scale.mean_a_m2, mean(common.iter().map(|c| c.0))));
            prop_assert!(close(scale.mean_b_m2, mean(common.iter().map(|c| c.1))));
            let difference = mean(common.iter().map(|c| c.0 - c.1));
            prop_assert!(close(scale.difference.map(|d| d.value_m2), difference));
        }
    }
}

/// Every answer, written out so that all bits show.
fn bits(reducer: &Reducer) -> String {
    let comparisons: Vec<Comparison> = reducer.comparisons(Confidence::P99).pairs;
    let scores: Vec<_> = (0..3).map(|run| reducer.scores(run, Confidence::P99)).collect();
    format!("{scores:?} {comparisons:?}")
}

fn reducer_of(count: u64, total: u64) -> Result<Reducer, ReduceError> {
    let mut reducer = Reducer::new(Layout::new(total, vec![CV; 2]));
    let mut frame = FrameSums::new(&[CV; 2]);
    for scored in 0..count {
        let ordinal = scored * total / count;
        frame.clear();
        for k in 0..20 + ordinal % 7 {
            let wave = libm::sin((ordinal * 31 + k * 7) as f64);
            let surface = SurfaceGroup::of_cube([k as i32, 0, 0]);
            let of_run = |m| Residuals { surfaces: [surface; 2], ..Residuals::all(m) };
            frame.add_return(&[0.3 * wave, 0.2 + 0.3 * wave].map(of_run));
        }
        reducer.add_frame(ordinal, &frame)?;
    }
    Ok(reducer)
}

#[test]
fn a_sample_has_the_interval_of_its_own_frames() -> Result<(), ReduceError> {
    let interval = |count, total| -> Result<_, ReduceError> {
        Ok(reducer_of(count, total)?.compare(0, 1, Confidence::P99).scales[0].interval())
    };
    let (all, sampled) = (interval(50, 50)?.unwrap(), interval(50, 500)?.unwrap());
    assert!(all.degrees >= 10 && sampled.degrees >= 10, "{all:?} {sampled:?}");
    assert_eq!(interval(3, 3)?, None);
    assert_eq!(interval(3, 30)?, None);
    assert!(interval(4, 4)?.is_some());
    Ok(())
}

#[test]
fn a_runs_own_score_has_an_interval() -> Result<(), ReduceError> {
    let scores = reducer_of(60, 600)?.scores(1, Confidence::P99);
    for (plain, (scale_m, estimate)) in
        scores.sums.r_cv_m2(MissPrice::default()).into_iter().zip(scores.r_cv_m2)
    {
        let estimate = estimate.unwrap();
        assert_eq!(plain, (scale_m, Some(estimate.value_m2)));
        let interval = estimate.interval.unwrap();
        assert!(interval.low_m2 < estimate.value_m2 && estimate.value_m2 < interval.high_m2);
    }
    assert_eq!(scores.r_near_m2[0].1.unwrap().value_m2, scores.sums.r_near_m2()[0].1.unwrap());
    Ok(())
}

#[test]
fn what_does_not_fit_the_layout_is_refused() -> Result<(), ReduceError> {
    let mut reducer = Reducer::new(Layout::new(2, vec![CV; 2]));
    let frame = FrameSums::new(&[CV; 2]);
    assert_eq!(reducer.add_frame(2, &frame), Err(ReduceError::NoSuchFrame { ordinal: 2, frames: 2 }));
    assert_eq!(reducer.add_frame(0, &FrameSums::new(&[CV, Basis::Near])), Err(ReduceError::OtherRuns));
    reducer.add_frame(0, &frame)?;
    let half = reducer.clone();
    reducer.add_frame(1, &frame)?;
    assert_eq!(reducer.add_frame(1, &frame), Err(ReduceError::FrameTwice { ordinal: 1 }));
    // One frame twice beside another that is missing has as many frames as there are.
    assert_eq!(half.clone().merge(&half), Err(ReduceError::FrameTwice { ordinal: 0 }));
    assert_eq!(reducer.merge(&half), Err(ReduceError::FrameTwice { ordinal: 0 }));
    let other = Reducer::new(Layout::new(3, vec![CV; 2]));
    assert_eq!(reducer.merge(&other), Err(ReduceError::OtherLayout));
    let priced =
        |share| Ok(Reducer::new(Layout::new(2, vec![CV; 2]).with_miss_price(MissPrice::new(share).unwrap())));
    for (share, merged) in [(0.25, Err(ReduceError::OtherLayout)), (0.15, Ok(()))] {
        assert_eq!(reducer.merge(&priced(share)?), merged);
        assert_eq!(priced(share)?.merge(&reducer), merged);
    }
    assert_eq!(reducer.frames_added(), 2);
    Ok(())
}

#[test]
fn sums_of_nothing_keep_their_lengths_and_other_lengths_are_refused() {
    let mut room = RunSums::new(Scales::Room);
    room.merge(&RunSums::default());
    room.add(&Residuals::all(3.0));
    assert_eq!((room.scales(), room.r_near_m2()[0]), (Scales::Room, (0.5, Some(0.25))));
    let mut empty = RunSums::default();
    empty.merge(&room);
    assert_eq!(empty, room);

    let of_room = Layout::new(2, vec![CV; 2]).on_scales(Scales::Room);
    let mut reducer = Reducer::new(of_room.clone());
    let mut frame = FrameSums::on_scales(of_room.bases(), Scales::Room);
    frame.add_return(&[Residuals::all(0.1), Residuals::all(0.2)]);
    assert_eq!(reducer.add_frame(0, &FrameSums::new(of_room.bases())), Err(ReduceError::OtherRuns));
    reducer.add_frame(0, &frame).unwrap();
    assert_eq!(Reducer::resume(of_room, reducer.seen()), Ok(reducer.clone()));
    let of_drive = Layout::new(2, vec![CV; 2]);
    assert_eq!(Reducer::resume(of_drive, reducer.seen()), Err(ReduceError::OtherRuns));

    // What was kept by another version may have fewer units.
    let json = serde_json::to_string(&reducer.seen()).unwrap();
    let first = json.find("\"surfaces\":[").unwrap() + "\"surfaces\":[".len();
    let second = first + json[first..].find("},").unwrap() + "},".len();
    let cut = serde_json::from_str(&format!("{}{}", &json[..first], &json[second..])).unwrap();
    let of_room = Layout::new(2, vec![CV; 2]).on_scales(Scales::Room);
    assert_eq!(Reducer::resume(of_room, cut), Err(ReduceError::OtherRuns));
}
