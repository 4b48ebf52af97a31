//! Ratios against what they should be, of numbers drawn with a known scatter.

use super::*;
use proptest::prelude::*;

const UNIT: f64 = (1u64 << 40) as f64;

/// A frame: its totals over some pieces of surface, as (cube, m², returns).
type FrameOf = Vec<(i32, f64, u64)>;

/// The frames spread evenly over `all`.
fn ratio_of(frames: &[FrameOf], all: u64) -> Ratio {
    let mut ratio = Ratio::default();
    for (ordinal, frame) in frames.iter().enumerate() {
        let ordinal = ordinal as u64 * all / frames.len() as u64;
        ratio.add_frame(
            ordinal,
            Frames(all),
            frame.iter().map(|&(cube, sum_m2, returns)| {
                (SurfaceGroup::of_cube([cube, 0, 0]), Total { sum: (sum_m2 * UNIT) as i128, returns })
            }),
        );
    }
    ratio
}

/// The variance that units (Δ, N) show of D = ΣΔ / ΣN as it is written in books, and Σe⁴ / (Σe²)².
fn direct(units: impl Iterator<Item = (f64, f64)>) -> (f64, f64, usize) {
    let used: Vec<_> = units.filter(|unit| unit.1 > 0.0).collect();
    let (sum, returns) = used.iter().fold((0.0, 0.0), |(s, n), u| (s + u.0, n + u.1));
    let errors: Vec<f64> = used.iter().map(|(delta, n)| delta - sum / returns * n).collect();
    let [squares, fourths]: [f64; 2] = [2, 4].map(|power| errors.iter().map(|e| e.powi(power)).sum());
    let u = used.len() as f64;
    (u / (u - 1.0) * squares / (returns * returns), fourths / (squares * squares), used.len())
}

fn of_keys(frames: &[FrameOf], key: impl Fn(usize, i32) -> usize) -> (f64, f64, usize) {
    let mut units = vec![(0.0, 0.0); 4096];
    for (ordinal, frame) in frames.iter().enumerate() {
        for &(cube, sum_m2, returns) in frame {
            let unit = &mut units[key(ordinal, cube)];
            *unit = (unit.0 + sum_m2, unit.1 + returns as f64);
        }
    }
    direct(units.into_iter())
}

fn degrees((_, kurtosis, units): (f64, f64, usize)) -> f64 {
    (3.0 / kurtosis - 3.0).clamp(1.0, (units - 1) as f64)
}

fn frames(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<FrameOf>> {
    let piece = (0..200i32, -50.0..50.0f64, 1u64..500).prop_map(|(cube, d, n)| (cube, d * n as f64, n));
    prop::collection::vec(prop::collection::vec(piece, 0..12), count)
}

proptest! {
    #[test]
    fn it_is_the_two_way_ratio_estimator(frames in frames(4..200)) {
        let k = frames.len();
        let ratio = ratio_of(&frames, k as u64);
        let of_frames = of_keys(&frames, |frame, _| frame);
        let of_groups = of_keys(&frames, |_, cube| SurfaceGroup::of_cube([cube, 0, 0]).index());
        let stretches = (k / 2).clamp(2, 40);
        let of_stretches = of_keys(&frames, |frame, _| frame * stretches / k);
        let error = ratio.mean().and_then(|mean| mean.error);
        if of_frames.2 < 4 || of_groups.2 < 4 || of_stretches.2 < 2 {
            prop_assert_eq!(error, None);
            return Ok(());
        }
        let (in_time, time_degrees) = if of_stretches.0 >= of_frames.0 {
            (of_stretches.0, degrees(of_stretches))
        } else {
            (of_frames.0, of_frames.2 as f64 - 1.0)
        };
        let variance = in_time + of_groups.0;
        let satterthwaite = variance * variance
            / (in_time * in_time / time_degrees + of_groups.0 * of_groups.0 / degrees(of_groups));
        let (error_m2, degrees) = error.unwrap();
        prop_assert!((error_m2 / variance.sqrt() - 1.0).abs() < 1e-9, "{} {}", error_m2, variance.sqrt());
        prop_assert!((degrees as f64 - satterthwaite.floor()).abs() <= 1.0, "{} {}", degrees, satterthwaite);
    }

    #[test]
    fn an_interval_is_as_wide_as_it_is_to_be_sure(frames in frames(60..80)) {
        let mean = ratio_of(&frames, 80).mean().unwrap();
        let (error_m2, degrees) = mean.error.unwrap();
        for level in [0.9, 0.99, 0.9999] {
            let confidence = Confidence::new(level).unwrap();
            let interval = mean.within(confidence).interval.unwrap();
            let half_m2 = confidence.student_t(degrees) * error_m2;
            prop_assert!((interval.high_m2 - mean.value_m2 - half_m2).abs() < 1e-9);
            prop_assert!((mean.value_m2 - interval.low_m2 - half_m2).abs() < 1e-9);
            // What an interval excludes is less likely by chance than what the level leaves, and the other way round.
            prop_assert_eq!(interval.excludes_zero(), mean.chance() < 1.0 - level);
        }
    }
}

/// Of `n` returns with the same difference on each of ten pieces of surface.
fn even(difference_m2: f64, n: u64) -> FrameOf {
    (0..10).map(|cube| (cube, difference_m2 * n as f64, n)).collect()
}

#[test]
fn a_constant_difference_has_an_interval_without_width() {
    let frames: Vec<_> = (1..30).map(|n| even(0.1875, n)).collect();
    for total in [29, 100] {
        let mean = ratio_of(&frames, total).mean().unwrap();
        let interval = mean.within(Confidence::P99).interval.unwrap();
        assert_eq!((interval.low_m2, interval.high_m2), (0.1875, 0.1875));
        assert!(interval.excludes_zero());
        assert_eq!(mean.chance(), 0.0);
    }
}

#[test]
fn small_scatter_on_a_large_difference_is_not_lost() {
    // Scatter of one part in 10^12, below what the cancelling squares keep in floating point.
    let sum = |f: i128| (600 << 40) * 1000 + f % 2 * 600;
    let mut ratio = Ratio::default();
    for f in 0..100 {
        let total = Total { sum: sum(f), returns: 1000 };
        ratio.add_frame(f as u64, Frames(1000), [(SurfaceGroup::NONE, total)].into_iter());
    }
    // e = ±300 units: Σ e² = 100 · 300².
    assert_eq!(ratio.frame_errors(), 9e6);
}

#[test]
fn few_frames_few_surfaces_or_one_stretch_give_no_interval() {
    let error = |frames: &[FrameOf], all| ratio_of(frames, all).mean().unwrap().error;
    assert_eq!(error(&[even(1.0, 10), vec![], even(2.0, 10), even(1.0, 10)], 4), None);
    assert!(error(&[even(1.0, 10), even(1.5, 10), even(2.0, 10), even(1.0, 10)], 4).is_some());
    let on_three: Vec<FrameOf> = (0..50).map(|f| even(f64::from(f % 7), 10)[..3].to_vec()).collect();
    assert_eq!(error(&on_three, 50), None);
    let mut frames = vec![FrameOf::new(); 1000];
    (0..25).for_each(|f| frames[f] = even(1.0, 1));
    let mean = ratio_of(&frames, 1000).mean().unwrap();
    assert_eq!((mean.value_m2, mean.returns, mean.error), (1.0, 250, None));
    frames[25] = even(1.5, 1);
    assert!(error(&frames, 1000).is_some());
    assert!(ratio_of(&[], 0).mean().is_none());
}

#[test]
fn the_largest_log_does_not_overflow() {
    // 2^12 frames of 2^32 returns, every one at the largest difference there can be.
    let mut ratio = Ratio::default();
    let frames = Frames(1 << 12);
    for ordinal in 0..1 << 12 {
        let largest: i128 = if ordinal % 64 == 63 { 1 - (1 << 50) } else { (1 << 50) - 1 };
        let total = Total { sum: largest << 30, returns: 1 << 30 };
        let pieces = (0..4).map(|cube| (SurfaceGroup::of_cube([cube, 0, 0]), total));
        ratio.add_frame(ordinal, frames, pieces);
    }
    let (share, largest) = (1.0 / 64.0, (1u64 << 50) as f64);
    let variance = 4.0 * share * (1.0 - share) * largest * largest;
    let expected = variance * (2f64).powi(32 + 32 + 12);
    assert!((ratio.frame_errors() / expected - 1.0).abs() < 1e-9);
    assert!(ratio.mean().unwrap().error.unwrap().0.is_finite());
}

/// Numbers near enough to normal: sums of twelve uniform ones.
fn normals() -> impl FnMut() -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        (0..12).fold(-6.0, |sum, _| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            sum + (state >> 11) as f64 / (1u64 << 53) as f64
        })
    }
}

/// Share of trials in which an interval at 99 % holds 0, which is true.
fn covered(trials: u32, mut frames: impl FnMut() -> Vec<FrameOf>) -> [f64; 3] {
    let mut counts = [0; 3];
    for _ in 0..trials {
        let frames = frames();
        let ratio = ratio_of(&frames, frames.len() as u64);
        let all = ratio.scatter().unwrap();
        let alone = [ratio.stretches.scatter(ratio.total), ratio.surfaces.scatter(ratio.total), all];
        for (count, scatter) in counts.iter_mut().zip(alone) {
            let t = units_to_m2(ratio.total.sum as f64) / units_to_m2(scatter.variance.sqrt());
            *count += u32::from(t.abs() <= Confidence::P99.student_t(scatter.degrees as u64));
        }
    }
    counts.map(|count| f64::from(count) / f64::from(trials))
}

/// Neighbouring frames alike and surfaces with errors of their own, as in every drive: stretches alone and surfaces alone
/// promise too much, both together do not.
#[test]
fn two_kinds_of_units_are_needed() {
    let mut normal = normals();
    let both = covered(600, || {
        let of_surface: Vec<f64> = (0..60).map(|_| normal()).collect();
        let mut of_time = normal();
        let mut drive = Vec::new();
        for frame in 0..300 {
            of_time = 0.6 * of_time + 0.8 * normal();
            // Ten of the sixty surfaces are in view, and all of them come back.
            let pieces = (0..10).map(|k| (frame / 5 + k) % 60);
            let piece = |cube: i32| (cube, 20.0 * (of_surface[cube as usize] + of_time + 0.3 * normal()), 20);
            drive.push(pieces.map(piece).collect());
        }
        drive
    });
    assert!(both[0] < 0.97 && both[1] < 0.97, "{both:?}");
    assert!(both[2] >= 0.985, "{both:?}");
}
