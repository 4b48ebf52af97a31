//! Draws the places to read: as many as the bytes allow.

use dmp_reduce::mixed;

/// With fewer places intervals are wide, and on a long drive with few revisits too narrow: see
/// `docs/accuracy.md`.
pub(crate) const FEW_PLACES: usize = 20;

/// The numbers of `count` places that `seed` draws, ascending. It is a systematic sample of the revisited
/// places followed by the others. So each kind has its share, evenly spread along the path. `revisited` has
/// one flag per place.
pub(super) fn drawn_places(revisited: &[bool], count: usize, seed: u64) -> Vec<usize> {
    grown_places(revisited, count, 0, seed)
}

/// The same after `count` was doubled `doubled` times, or all places: a sample holds those with fewer.
fn grown_places(revisited: &[bool], count: usize, doubled: u32, seed: u64) -> Vec<usize> {
    let of = |kind: bool| (0..revisited.len()).filter(move |&place| revisited[place] == kind);
    let order: Vec<usize> = of(true).chain(of(false)).collect();
    let size = order.len().min(count << doubled);
    // Twice as many steps are half as long. So the start becomes twice the fraction of a step, minus possibly a whole one.
    let start = mixed(seed) << doubled;
    let mut drawn: Vec<usize> = (0..size).map(|k| order[systematic(k, start, size, order.len())]).collect();
    drawn.sort_unstable();
    drawn
}

/// The `k`-th of `size` equal steps over `all` places, `start` / 2^64 steps after its beginning.
fn systematic(k: usize, start: u64, size: usize, all: usize) -> usize {
    let (size, all) = (size as u128, all as u128);
    let along = ((k as u128) << 64) + u128::from(start);
    // (k + start/2^64) · all / size, rounded down, without losing the high bits.
    let (whole, rest) = (along / size, along % size);
    ((whole * all + rest * all / size) >> 64) as usize
}

/// Draws as many places as fit `budget_bytes`, but at least [`FEW_PLACES`]; `bytes` has the size of every
/// place. The number does not depend on which places are drawn, so a sample may exceed the budget; a margin
/// of two standard deviations makes that rare.
pub(super) fn draw(bytes: &[u64], revisited: &[bool], budget_bytes: u64, seed: u64) -> Vec<usize> {
    let few = FEW_PLACES.min(bytes.len());
    let mut counts = (few..=bytes.len()).rev();
    let count = counts.find(|&count| most_bytes(bytes, count) <= budget_bytes as f64).unwrap_or(few);
    drawn_places(revisited, count, seed)
}

/// Growing samples: [`FEW_PLACES`], then twice as many as long as they fit `budget_bytes`. Each has the places that it adds
/// to the one before.
pub(super) fn growing(bytes: &[u64], revisited: &[bool], budget_bytes: u64, seed: u64) -> Vec<Vec<usize>> {
    let (few, all) = (FEW_PLACES.min(bytes.len()), bytes.len());
    let fits = |doubled: &u32| *doubled == 0 || most_bytes(bytes, few << doubled) <= budget_bytes as f64;
    // More than half of the places cannot be doubled.
    let doublings = (0..usize::BITS).take_while(|doubled| few << doubled <= all).take_while(fits);
    let samples: Vec<Vec<usize>> =
        doublings.map(|doubled| grown_places(revisited, few, doubled, seed)).collect();
    let added = |look: usize| {
        let is_new = |place: &&usize| look == 0 || samples[look - 1].binary_search(place).is_err();
        samples[look].iter().filter(is_new).copied().collect()
    };
    (0..samples.len()).map(added).collect()
}

/// Bytes of so many places, and two standard deviations more.
fn most_bytes(bytes: &[u64], count: usize) -> f64 {
    let all = bytes.len().max(1) as f64;
    let mean = bytes.iter().map(|&bytes| bytes as f64).sum::<f64>() / all;
    let square = |bytes: &u64| (*bytes as f64 - mean) * (*bytes as f64 - mean);
    let deviation = (bytes.iter().map(square).sum::<f64>() / all).sqrt();
    let count = count as f64;
    count * mean + 2.0 * deviation * (count * (1.0 - count / all)).max(0.0).sqrt()
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

    #[test]
    fn growing_samples_hold_each_other_and_double() {
        for (places, budget_bytes, sizes) in [
            (1000, u64::MAX, &[20, 20, 40, 80, 160, 320][..]),
            (1000, 8000, &[20, 20, 40]),
            (1000, 0, &[20]),
            (39, u64::MAX, &[20]),
            (7, u64::MAX, &[7]),
        ] {
            let revisited: Vec<bool> = (0..places).map(|k| k % 3 == 0).collect();
            for seed in 0..20 {
                let looks = growing(&vec![100; places], &revisited, budget_bytes, seed);
                assert_eq!(looks.iter().map(Vec::len).collect::<Vec<_>>(), sizes);
                let mut all = looks.concat();
                all.sort_unstable();
                assert!(all.windows(2).all(|pair| pair[0] < pair[1]) && all.last() < Some(&places));
                // Half of the places in the end: of both kinds, and evenly.
                let kind = |of: bool| all.iter().filter(|&&place| revisited[place] == of).count() as f64;
                assert!((kind(true) / all.len() as f64 - 1.0 / 3.0).abs() < 0.1);
            }
        }
    }
}
