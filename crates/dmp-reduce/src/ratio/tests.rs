use super::*;
use proptest::prelude::*;

const UNIT: f64 = (1u64 << 40) as f64;

fn asked(scored: u64, all: u64) -> Asked {
    Asked { scored, frames: Frames(all), confidence: Confidence::P99 }
}

/// The frames spread evenly over `all`.
fn ratio_of(frames: &[(f64, u64)], all: u64) -> (Ratio, Asked) {
    let asked = asked(frames.len() as u64, all);
    let mut ratio = Ratio::default();
    for (ordinal, &(sum_m2, returns)) in frames.iter().enumerate() {
        let ordinal = ordinal as u64 * all / frames.len() as u64;
        ratio.add_frame(ordinal, Total { sum: (sum_m2 * UNIT) as i128, returns }, asked.frames);
    }
    (ratio, asked)
}

fn half_m2(ratio: &Ratio, asked_for: Asked) -> f64 {
    units_to_m2(ratio.half_width(asked_for).unwrap().0)
}

/// The estimator as it is written in books, over units (Δ, N).
fn direct_half_m2(units: &[(f64, f64)]) -> f64 {
    let (sum, returns) = units.iter().fold((0.0, 0.0), |(s, n), u| (s + u.0, n + u.1));
    let d = sum / returns;
    let used: Vec<_> = units.iter().filter(|u| u.1 > 0.0).collect();
    let u = used.len() as f64;
    let errors: f64 = used.iter().map(|(sum, n)| (sum - d * n).powi(2)).sum();
    Confidence::P99.student_t(used.len() as u64 - 1) * (u / (u - 1.0) * errors).sqrt() / returns
}

proptest! {
    #[test]
    fn it_is_the_linearised_ratio_estimator(
        frames in prop::collection::vec((-50.0..50.0f64, 0u64..500), 4..90),
        sampled: bool,
    ) {
        let frames: Vec<_> = frames.into_iter().map(|(d, n)| (d * n as f64, n)).collect();
        let k = frames.len();
        let (ratio, asked_for) = ratio_of(&frames, k as u64 * if sampled { 3 } else { 1 });
        let as_f64 = |f: &[(f64, u64)]| f.iter().fold((0.0, 0.0), |(s, n), f| (s + f.0, n + f.1 as f64));
        let of_frames: Vec<_> = frames.iter().map(|&f| as_f64(&[f])).collect();
        let u = (k / 2).clamp(2, 20);
        let of_batches: Vec<_> =
            (0..u).map(|b| as_f64(&frames[(b * k).div_ceil(u)..((b + 1) * k).div_ceil(u)])).collect();
        if of_frames.iter().filter(|f| f.1 > 0.0).count() < 4 {
            prop_assert!(ratio.half_width(asked_for).is_none());
        } else if sampled {
            let expected = direct_half_m2(&of_frames) * (2f64 / 3.0).sqrt();
            prop_assert!((half_m2(&ratio, asked_for) / expected - 1.0).abs() < 1e-9);
        } else if of_batches.iter().filter(|b| b.1 > 0.0).count() > 1 {
            let expected = direct_half_m2(&of_frames).max(direct_half_m2(&of_batches));
            prop_assert!((half_m2(&ratio, asked_for) / expected - 1.0).abs() < 1e-9);
        }
    }

    /// Where all frames have the same number of returns, a sample's interval is the one of the mean of
    /// per-frame means: d ± t(k−1) s_d / √k · √(1 − k/n).
    #[test]
    fn equal_frames_give_the_interval_of_a_mean(
        d in prop::collection::vec(-5.0..5.0f64, 4..60),
        returns in 1u64..100_000,
        more in 1u64..1000,
    ) {
        let frames: Vec<_> = d.iter().map(|d| (d * returns as f64, returns)).collect();
        let n = d.len() as u64 + more;
        let (ratio, asked_for) = ratio_of(&frames, n);
        let k = d.len() as f64;
        let mean = d.iter().sum::<f64>() / k;
        let s = (d.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (k - 1.0)).sqrt();
        let expected = Confidence::P99.student_t(d.len() as u64 - 1) * s / k.sqrt() * (1.0 - k / n as f64).sqrt();
        let estimate = ratio.estimate(asked_for).unwrap();
        let interval = estimate.interval.unwrap();
        prop_assert!((estimate.value_m2 - mean).abs() < 1e-10);
        prop_assert!((interval.high_m2 - mean - expected).abs() < 1e-9);
        prop_assert!((mean - interval.low_m2 - expected).abs() < 1e-9);
        prop_assert_eq!(interval.degrees, d.len() as u64 - 1);
        prop_assert_eq!(interval.from, IntervalFrom::SampledFrames);
    }
}

#[test]
fn a_constant_difference_has_an_interval_without_width() {
    let frames: Vec<_> = (1..30).map(|n| (0.1875 * n as f64, n)).collect();
    for total in [29, 100] {
        let (ratio, asked_for) = ratio_of(&frames, total);
        let interval = ratio.estimate(asked_for).unwrap().interval.unwrap();
        assert_eq!((interval.low_m2, interval.high_m2), (0.1875, 0.1875));
        assert!(interval.excludes_zero());
    }
}

#[test]
fn small_scatter_on_a_large_difference_is_not_lost() {
    // Scatter of one part in 10^12, below what the cancelling squares keep in floating point.
    let sum = |f: i128| (600 << 40) * 1000 + f % 2 * 600;
    let frames = Frames(1000);
    let mut ratio = Ratio::default();
    for f in 0..100 {
        ratio.add_frame(f as u64, Total { sum: sum(f), returns: 1000 }, frames);
    }
    // e = ±300 units: Σ e² = 100 · 300².
    assert_eq!(ratio.frame_errors(), 9e6);
}

#[test]
fn few_frames_or_one_batch_give_no_interval() {
    let (ratio, asked_for) = ratio_of(&[(1.0, 10), (0.0, 0), (2.0, 10), (1.0, 10)], 4);
    assert_eq!(ratio.estimate(asked_for).unwrap().interval, None);
    let mut frames = vec![(0.0, 0); 100];
    frames[..5].fill((1.0, 10));
    let (ratio, asked_for) = ratio_of(&frames, 100);
    assert_eq!(ratio.estimate(asked_for).unwrap(), Estimate { value_m2: 0.1, returns: 50, interval: None });
    frames[5] = (1.5, 10);
    let (ratio, asked_for) = ratio_of(&frames, 100);
    assert_eq!(ratio.estimate(asked_for).unwrap().interval.unwrap().degrees, 1);
    assert_eq!(ratio_of(&[], 0).0.estimate(asked(0, 0)), None);
}

#[test]
fn the_largest_log_does_not_overflow() {
    // 2^12 frames of 2^32 returns, every one at the largest difference there can be.
    let asked_for = asked(1 << 12, 1 << 12);
    let mut ratio = Ratio::default();
    for ordinal in 0..1 << 12 {
        let largest: i128 = if ordinal % 64 == 63 { 1 - (1 << 50) } else { (1 << 50) - 1 };
        ratio.add_frame(ordinal, Total { sum: largest << 32, returns: 1 << 32 }, asked_for.frames);
    }
    let (share, largest) = (1.0 / 64.0, (1u64 << 50) as f64);
    let variance = 4.0 * share * (1.0 - share) * largest * largest;
    let expected = variance * (2f64).powi(32 + 32 + 12);
    assert!((ratio.frame_errors() / expected - 1.0).abs() < 1e-9);
    assert!(ratio.half_width(asked_for).unwrap().0.is_finite());
}

/// Neighbouring frames alike, as in every drive: single frames promise too much, batches do not.
#[test]
fn correlated_frames_need_batches() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut normal = || {
        // A sum of twelve uniform numbers: near enough to normal.
        (0..12).fold(-6.0, |sum, _| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            sum + (state >> 11) as f64 / (1u64 << 53) as f64
        })
    };
    let (frames, trials, correlation) = (400, 2000, 0.75f64);
    let (mut of_frames, mut of_all) = (0, 0);
    for _ in 0..trials {
        let mut d = normal();
        let series: Vec<_> = (0..frames)
            .map(|_| {
                d = correlation * d + (1.0 - correlation * correlation).sqrt() * normal();
                let returns = 150 + (normal() * 20.0) as u64;
                (d * returns as f64, returns)
            })
            .collect();
        let (ratio, asked_for) = ratio_of(&series, frames);
        let mean = ratio.total().mean_m2().unwrap();
        let frames_alone =
            Confidence::P99.student_t(frames - 1) * ratio.standard_error(frames, ratio.frame_errors());
        of_frames += u32::from(mean.abs() <= units_to_m2(frames_alone));
        of_all += u32::from(!ratio.estimate(asked_for).unwrap().interval.unwrap().excludes_zero());
    }
    let share = |covered: u32| f64::from(covered) / f64::from(trials);
    assert!(share(of_frames) < 0.75, "{}", share(of_frames));
    assert!((0.97..0.995).contains(&share(of_all)), "{}", share(of_all));
}
