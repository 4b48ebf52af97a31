//! Draws the places to read: as many as the byte budget allows.

use dmp_runs::{Looks, Sample};

/// With fewer places intervals are wide, and on a long drive with few revisits too narrow: see
/// `docs/accuracy.md`.
pub(crate) const FEW_PLACES: usize = 20;

/// The numbers of `count` places that `seed` draws, ascending. It is a systematic sample of the revisited
/// places followed by the others. So each kind has its share, evenly spread along the path. `revisited` has
/// one flag per place.
pub fn drawn_places(revisited: &[bool], count: usize, seed: u64) -> Vec<usize> {
    let of = |kind: bool| (0..revisited.len()).filter(move |&place| revisited[place] == kind);
    let order: Vec<usize> = of(true).chain(of(false)).collect();
    let looks = Looks::new(order.len() as u64, Sample::Frames(count as u64), seed, false);
    let mut drawn: Vec<usize> = looks.frames(0).map(|place| order[place]).collect();
    drawn.sort_unstable();
    drawn
}

/// Draws as many places as fit `budget_bytes`, but at least [`FEW_PLACES`]; `bytes` has the size of every
/// place. The number does not depend on which places are drawn, so a sample may exceed the budget; a margin
/// of two standard deviations makes that rare.
pub(super) fn draw(bytes: &[u64], revisited: &[bool], budget_bytes: u64, seed: u64) -> Vec<usize> {
    let all = bytes.len();
    let mean = bytes.iter().map(|&bytes| bytes as f64).sum::<f64>() / all.max(1) as f64;
    let square = |bytes: &u64| (*bytes as f64 - mean) * (*bytes as f64 - mean);
    let deviation = (bytes.iter().map(square).sum::<f64>() / all.max(1) as f64).sqrt();
    let most = |count: &usize| {
        let count = *count as f64;
        count * mean + 2.0 * deviation * (count * (1.0 - count / all as f64)).sqrt()
    };
    let few = FEW_PLACES.min(all);
    let count = (few..=all).rev().find(|count| most(count) <= budget_bytes as f64).unwrap_or(few);
    drawn_places(revisited, count, seed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bytes_say_how_many_places() {
        let (bytes, once) = (vec![100; 1000], vec![false; 1000]);
        let count = |budget_bytes| draw(&bytes, &once, budget_bytes, 3).len();
        assert_eq!([5000, 5099, 0, 1 << 40].map(count), [50, 50, 20, 1000]);
        assert_eq!(draw(&[7; 5], &once[..5], 0, 3), [0, 1, 2, 3, 4]);
        assert_ne!(draw(&bytes, &once, 5000, 3), draw(&bytes, &once, 5000, 4));
    }

    #[test]
    fn most_samples_take_no_more_than_there_is() {
        let bytes: Vec<u64> = (0..500).map(|k| if k % 7 == 0 { 1000 } else { 10 }).collect();
        let taken = |seed| -> u64 {
            draw(&bytes, &[false; 500], 20_000, seed).iter().map(|&place| bytes[place]).sum()
        };
        let more = (0..1000).filter(|&seed| taken(seed) > 20_000).count();
        assert!(more < 50, "{more}");
        assert!((0..1000).map(taken).sum::<u64>() > 1000 * 10_000);
    }

    /// Large places, which most scans see, are drawn as often as others.
    #[test]
    fn the_bytes_do_not_say_which_places() {
        let bytes: Vec<u64> = (0..300).map(|k| if k % 20 == 7 { 1200 } else { 100 }).collect();
        let mut times = [0; 300];
        let mut drawn = 0;
        for seed in 0..4000 {
            let places = draw(&bytes, &[false; 300], 6000, seed);
            drawn += places.len();
            places.into_iter().for_each(|place| times[place] += 1);
        }
        let expected = drawn as f64 / 300.0;
        let scatter = (expected * (1.0 - expected / 4000.0)).sqrt();
        assert!(times.iter().all(|&count| (f64::from(count) - expected).abs() < 5.0 * scatter), "{times:?}");
    }

    #[test]
    fn either_kind_of_place_has_its_share() {
        // Every fourth, so that a systematic sample along the path would meet always or never.
        let revisited: Vec<bool> = (0..400).map(|k| k % 4 == 0).collect();
        for seed in 0..100 {
            let drawn = drawn_places(&revisited, 40, seed);
            let count = drawn.iter().filter(|&&place| revisited[place]).count();
            assert!((9..=11).contains(&count), "{count}");
            assert!(drawn.len() == 40 && drawn.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }

    /// Every place is equally likely: the condition for an unbiased estimate.
    #[test]
    fn every_place_has_its_chance() {
        let revisited: Vec<bool> = (0..37).map(|k| k % 3 == 0 || k > 30).collect();
        let mut times = [0; 37];
        for seed in 0..4000 {
            drawn_places(&revisited, 9, seed).into_iter().for_each(|place| times[place] += 1);
        }
        let expected = 4000.0 * 9.0 / 37.0;
        let scatter = f64::sqrt(expected * (1.0 - 9.0 / 37.0));
        assert!(times.iter().all(|&count| (f64::from(count) - expected).abs() < 5.0 * scatter), "{times:?}");
    }
}
