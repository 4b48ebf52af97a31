//! Which places are read: as many as the bytes allow.

use crate::sample::{Looks, Sample};

/// Places below which an interval is too wide to decide anything.
const FEW_PLACES: usize = 12;

/// The numbers of the places that `seed` draws, evenly spread along the way: as many as take no more than
/// `budget_bytes`, but never fewer than twelve; `bytes` are those of every place.
pub(crate) fn draw(bytes: &[u64], budget_bytes: u64, seed: u64) -> Vec<usize> {
    let all = bytes.len();
    let mean = bytes.iter().map(|&bytes| bytes as f64).sum::<f64>() / all.max(1) as f64;
    let few = FEW_PLACES.min(all);
    // A sample may hit larger places than others: from a few more than the mean allows, downwards.
    let most = (1.2 * budget_bytes as f64 / mean.max(1.0)) as usize;
    let mut count = most.clamp(few, all);
    loop {
        let drawn: Vec<usize> =
            Looks::new(all as u64, Sample::Frames(count as u64), seed, false).frames(0).collect();
        let drawn_bytes: u64 = drawn.iter().map(|&place| bytes[place]).sum();
        if drawn_bytes <= budget_bytes || count <= few {
            return drawn;
        }
        count -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bytes_say_how_many_places() {
        let bytes = vec![100; 1000];
        assert_eq!(draw(&bytes, 5000, 3).len(), 50);
        assert_eq!(draw(&bytes, 5099, 4).len(), 50);
        assert_eq!(draw(&bytes, 0, 3).len(), 12);
        assert_eq!(draw(&bytes, u64::MAX, 3).len(), 1000);
        assert_eq!(draw(&[7; 5], 0, 3), [0, 1, 2, 3, 4]);
        assert_ne!(draw(&bytes, 5000, 3), draw(&bytes, 5000, 4));
    }

    #[test]
    fn large_places_leave_room_for_fewer() {
        let bytes: Vec<u64> = (0..500).map(|k| if k % 7 == 0 { 1000 } else { 10 }).collect();
        for seed in 0..50 {
            let drawn = draw(&bytes, 6000, seed);
            assert!(drawn.iter().map(|&k| bytes[k]).sum::<u64>() <= 6000 || drawn.len() == 12);
            assert!(drawn.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }
}
