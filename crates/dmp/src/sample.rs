//! Which of the frames are scored, and how sure a look at some of them must be.

use dmp_reduce::{Confidence, FrameSet};

use crate::error::EvaluateError;
use crate::setting_name::SettingName;

/// Frames of the first look where nothing else is asked for: Zhang & Chen 2021 sample frames too; on city drives 28
/// find the better of two runs nearly as often as all do.
const FIRST_LOOK: u64 = 28;

/// How many of the frames are scored. The maps are made of all.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Sample {
    /// Every one.
    #[default]
    All,
    /// So many, or all where there are no more.
    Frames(u64),
    /// This share, from above 0 to 1.
    Share(f64),
}

impl Sample {
    /// How many of `all` frames are scored: at least one.
    fn of(self, all: u64) -> u64 {
        let frames = match self {
            Self::All => all,
            Self::Frames(frames) => frames,
            // 1 is all of them exactly.
            Self::Share(share) => (share * all as f64).round() as u64,
        };
        frames.clamp(1.min(all), all)
    }

    pub(crate) fn check(self) -> Result<(), EvaluateError> {
        let (value, why) = match self {
            Self::Frames(0) => ("0 frames".to_owned(), "it must be 1 or more"),
            Self::Share(share) if !(share > 0.0 && share <= 1.0) => {
                (format!("{share}"), "it must be a share above 0 and at most 1")
            }
            _ => return Ok(()),
        };
        Err(EvaluateError::setting(SettingName::Sample, value, why))
    }
}

/// Until when growing samples are scored.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Decide {
    /// The names of the two runs that matter; `None`: every pair does.
    pub pair: Option<(String, String)>,
}

/// The samples of an evaluation, each inside the next: one, or those looked at in turn until what is asked for is
/// decided. All are systematic samples with one random start.
#[derive(Debug, Clone, PartialEq)]
pub struct Looks {
    all: u64,
    sizes: Vec<u64>,
    start: u64,
}

impl Looks {
    /// The samples of `all` frames that `seed` draws: `sample`, and where a decision is asked for those that follow
    /// it, twice as large each, and at the end all.
    pub fn new(all: u64, sample: Sample, seed: u64, decide: bool) -> Self {
        let first = if decide && sample == Sample::All { Sample::Frames(FIRST_LOOK) } else { sample };
        let mut sizes = vec![first.of(all)];
        while let Some(&last) = sizes.last().filter(|&&last| decide && last < all) {
            // A sample of more than half of the frames cannot be doubled: then all of them.
            sizes.push(if 2 * last < all { 2 * last } else { all });
        }
        Self { all, sizes, start: mixed(seed) }
    }

    /// Whether not all frames are scored, or not at once.
    pub(crate) fn is_sampled(&self) -> bool {
        self.sizes.first().is_some_and(|&first| first < self.all)
    }

    /// How many frames each look has seen.
    pub fn sizes(&self) -> &[u64] {
        &self.sizes
    }

    /// How many looks there may be at a sample, the one at all frames apart.
    fn at_samples(&self) -> u32 {
        self.sizes.iter().filter(|&&size| size < self.all).count() as u32
    }

    /// How sure a look at `scored` frames must be, so that all looks that there may be are as sure as `asked` (Bonferroni's
    /// inequality). Where samples may be looked at before all frames are, half of the error is kept for the last look, so
    /// that it decides nearly what it would alone.
    #[must_use]
    pub fn confidence(&self, scored: u64, asked: Confidence) -> Confidence {
        match self.at_samples() {
            0 => asked,
            _ if self.sizes.len() == 1 => asked,
            _ if scored >= self.all => asked.of_each_look(2),
            samples => asked.of_each_look(2 * samples),
        }
    }

    /// The frames of the `look`-th sample, by their ordinals, in order.
    ///
    /// # Panics
    /// Where there is no such look.
    pub fn frames(&self, look: usize) -> impl Iterator<Item = usize> {
        let (all, size) = (self.all, self.sizes[look]);
        // Twice as many steps are half as long, and what was `start` of a step is twice as much of one, or that and a
        // whole step: the frames of a look are among those of the next.
        let start = self.start << look.min(63);
        (0..size).map(move |k| systematic(k, start, size, all))
    }

    /// The frames that look number `look` adds to those before.
    pub(crate) fn added(&self, look: usize) -> FrameSet {
        let before: FrameSet =
            look.checked_sub(1).map_or_else(FrameSet::default, |look| self.frames(look).collect());
        self.frames(look).filter(|&frame| !before.contains(frame)).collect()
    }
}

/// The `k`-th of `size` equal steps over `all` frames, `start` / 2^64 steps after its beginning.
fn systematic(k: u64, start: u64, size: u64, all: u64) -> usize {
    let along = (u128::from(k) << 64) + u128::from(start);
    // (k + start/2^64) · all / size, rounded down, without losing the high bits.
    let (whole, rest) = (along / u128::from(size), along % u128::from(size));
    ((whole * u128::from(all) + rest * u128::from(all) / u128::from(size)) >> 64) as usize
}

/// Any seed as a number that has nothing to do with the next one's: the finaliser of `SplitMix64` (Steele, Lea &
/// Flood 2014).
pub(crate) fn mixed(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_sample_is_systematic_and_the_next_holds_it(
            all in 1u64..5000,
            sample in prop_oneof![
                (1u64..6000).prop_map(Sample::Frames),
                (1e-4..=1.0f64).prop_map(Sample::Share),
                Just(Sample::All),
            ],
            seed: u64,
            decide: bool,
        ) {
            let looks = Looks::new(all, sample, seed, decide);
            let mut seen: Vec<usize> = Vec::new();
            for (look, &size) in looks.sizes().iter().enumerate() {
                let frames: Vec<usize> = looks.frames(look).collect();
                prop_assert_eq!(frames.len() as u64, size);
                prop_assert!(frames.windows(2).all(|pair| pair[0] < pair[1]));
                prop_assert!(frames.last().is_none_or(|&last| (last as u64) < all));
                // No step is longer or shorter than the others by more than the rounding.
                let step = all as f64 / size as f64;
                prop_assert!(frames.windows(2).all(|pair| ((pair[1] - pair[0]) as f64 - step).abs() < 1.0));
                let added = looks.added(look);
                prop_assert!(seen.iter().all(|frame| frames.contains(frame)), "{:?} {:?}", seen, frames);
                for &frame in &frames {
                    prop_assert_eq!(added.contains(frame), !seen.contains(&frame));
                }
                seen = frames;
            }
            let as_asked = if decide { looks.sizes().last() == Some(&all) } else { looks.sizes().len() == 1 };
            prop_assert!(as_asked);
            prop_assert_eq!(looks.at_samples() as usize, looks.sizes().iter().filter(|&&s| s < all).count());
        }

        /// Every frame is as likely as any other: what an unbiased estimate needs.
        #[test]
        fn every_frame_has_its_chance(all in 1u64..60, size in 1u64..60) {
            prop_assume!(size <= all);
            let (seeds, mut drawn) = (4000, vec![0u32; all as usize]);
            for seed in 0..seeds {
                Looks::new(all, Sample::Frames(size), seed, false).frames(0).for_each(|frame| drawn[frame] += 1);
            }
            let expected = f64::from(seeds as u32) * size as f64 / all as f64;
            let scatter = (expected * (1.0 - size as f64 / all as f64)).sqrt().max(1e-9);
            for count in drawn {
                prop_assert!((f64::from(count) - expected).abs() <= 6.0 * scatter, "{} {}", count, expected);
            }
        }
    }

    #[test]
    fn shares_and_numbers_are_of_all_frames() {
        let size = |sample: Sample| Looks::new(942, sample, 0, false).sizes()[0];
        assert_eq!([Sample::Share(0.02), Sample::Share(1.0), Sample::Share(1e-9)].map(size), [19, 942, 1]);
        assert_eq!([Sample::Frames(28), Sample::Frames(1000), Sample::All].map(size), [28, 942, 942]);
        assert_eq!(Looks::new(942, Sample::All, 0, true).sizes(), [28, 56, 112, 224, 448, 896, 942]);
        assert_eq!(Looks::new(0, Sample::All, 0, true).sizes(), [0]);
        let error = |decide, sample, scored| {
            let confidence = Looks::new(942, sample, 0, decide).confidence(scored, Confidence::P99);
            (100.0 * (1.0 - confidence.level()) * 1e6).round() / 1e6
        };
        // Six looks at samples and one at all.
        assert_eq!(
            [28, 896, 942].map(|scored| error(true, Sample::All, scored)),
            [0.083_333, 0.083_333, 0.5]
        );
        assert_eq!((error(false, Sample::All, 942), error(false, Sample::Frames(28), 28)), (1.0, 1.0));
        assert_eq!(error(true, Sample::Frames(942), 942), 1.0);
        assert!(!Looks::new(28, Sample::All, 0, true).is_sampled());
    }
}
