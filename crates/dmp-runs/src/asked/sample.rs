//! Selects the scored frames, and the confidence required at each look.

use dmp_reduce::{Confidence, FrameSet, mixed};

use crate::asked::error::EvaluateError;
use crate::asked::setting_name::SettingName;

/// Default number of frames of the first look: Zhang & Chen 2021 sample frames too. On city drives 28 frames
/// find the better of two runs nearly as often as all frames do.
const FIRST_LOOK: u64 = 28;

/// How many of the frames are scored. The maps use all of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Sample {
    /// Every one.
    #[default]
    All,
    /// This many, or all if there are fewer.
    Frames(u64),
    /// This share, from above 0 to 1.
    Share(f64),
}

impl Sample {
    /// Number of scored frames out of `all`: at least one.
    fn of(self, all: u64) -> u64 {
        let frames = match self {
            Self::All => all,
            Self::Frames(frames) => frames,
            // A share of 1 is exactly all of them.
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

/// When growing samples stop.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Decide {
    /// The names of the two runs to decide; `None`: every pair.
    pub pair: Option<(String, String)>,
}

/// The nested samples of an evaluation: one, or those scored in turn until the decision is made. All are
/// systematic samples with one random start.
#[derive(Debug, Clone, PartialEq)]
pub struct Looks {
    all: u64,
    sizes: Vec<u64>,
    start: u64,
}

impl Looks {
    /// The samples of `all` frames that `seed` draws: `sample`, and with `decide` further ones, twice as
    /// large each, and finally all.
    pub fn new(all: u64, sample: Sample, seed: u64, decide: bool) -> Self {
        let first = if decide && sample == Sample::All { Sample::Frames(FIRST_LOOK) } else { sample };
        let mut sizes = vec![first.of(all)];
        while let Some(&last) = sizes.last().filter(|&&last| decide && last < all) {
            // A sample of more than half of the frames cannot be doubled: then all of them.
            sizes.push(if 2 * last < all { 2 * last } else { all });
        }
        Self { all, sizes, start: mixed(seed) }
    }

    /// Whether the first look does not score all frames.
    pub fn is_sampled(&self) -> bool {
        self.sizes.first().is_some_and(|&first| first < self.all)
    }

    /// The number of frames seen by each look.
    pub fn sizes(&self) -> &[u64] {
        &self.sizes
    }

    /// The largest number of looks at samples, without the one at all frames.
    fn at_samples(&self) -> u32 {
        self.sizes.iter().filter(|&&size| size < self.all).count() as u32
    }

    /// The confidence of a look at `scored` frames, so that all possible looks together have the confidence
    /// `asked` (Bonferroni's inequality). If samples come before all frames, half of the error is kept for
    /// the last look, so that it decides nearly what it would alone.
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
    /// When there is no such look.
    pub fn frames(&self, look: usize) -> impl Iterator<Item = usize> {
        let (all, size) = (self.all, self.sizes[look]);
        // Twice as many steps are half as long. So `start` becomes twice the fraction of a step, minus
        // possibly a whole step: the frames of a look are among those of the next.
        let start = self.start << look.min(63);
        (0..size).map(move |k| systematic(k, start, size, all))
    }

    /// The frames that look number `look` adds to the earlier ones.
    pub fn added(&self, look: usize) -> FrameSet {
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
                // All steps are equal up to rounding.
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

        /// Every frame is equally likely: the condition for an unbiased estimate.
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
