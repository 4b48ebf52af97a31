//! Detects rows of scans with unusual numbers of returns. Neighbours within a row are alike, so comparing
//! neighbours cannot detect them.

/// Least ratio between a scan's number of returns and the median of the log. It must also exceed the square
/// of the ratio that three of four scans stay below.
const OFF: f64 = 1.9;
/// The same for one scan and the next, at both ends of a row, and the fourth power: a scene changes by less.
const STEP: f64 = 1.75;
const USUAL_SHARE: f64 = 0.75;
/// With fewer returns a ratio is not significant.
const ENOUGH: u32 = 200;

/// Whether each scan lies in a row with far more or far fewer returns than most scans, with abrupt ends.
pub(super) fn off_in_rows(returns: &[u32]) -> Vec<bool> {
    let usual = median(returns.to_vec());
    let usual_off = most_have(returns.iter().map(|&own| ratio(own, usual)));
    let most_off = OFF.max(usual_off * usual_off);
    let off = |&own: &u32| (own.max(usual) >= ENOUGH && ratio(own, usual) > most_off).then_some(own > usual);
    let usual_step = most_have(returns.windows(2).map(|pair| ratio(pair[0], pair[1])));
    let most_step = STEP.max(usual_step * usual_step * usual_step * usual_step);
    let steps = |one: Option<&u32>, other: Option<&u32>| {
        one.zip(other).is_some_and(|(&one, &other)| ratio(one, other) > most_step)
    };
    let mut in_row = Vec::with_capacity(returns.len());
    for row in returns.chunk_by(|a, b| off(a) == off(b)) {
        let (start, end) = (in_row.len(), in_row.len() + row.len());
        // A row at an end of the log may be a change of scene.
        let is_odd = row.first().is_some_and(|own| off(own).is_some())
            && steps(start.checked_sub(1).and_then(|before| returns.get(before)), row.first())
            && steps(row.last(), returns.get(end));
        in_row.resize(end, is_odd);
    }
    in_row
}

fn most_have(ratios: impl Iterator<Item = f64>) -> f64 {
    let mut ratios: Vec<f64> = ratios.collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios.get((USUAL_SHARE * ratios.len() as f64) as usize).copied().unwrap_or(1.0)
}

/// The ratio of the larger number to the smaller.
pub(super) fn ratio(one: u32, other: u32) -> f64 {
    f64::from(one.max(other)) / f64::from(one.min(other).max(1))
}

pub(super) fn median(mut values: Vec<u32>) -> u32 {
    values.sort_unstable();
    values.get(values.len() / 2).copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn odd(returns: &[u32]) -> Vec<usize> {
        off_in_rows(returns).iter().enumerate().filter(|&(_, &odd)| odd).map(|(k, _)| k).collect()
    }

    #[test]
    fn rows_with_other_numbers_of_returns_are_found() {
        let mut returns: Vec<u32> = (0..100).map(|k| 20_000 + 50 * k).collect();
        assert_eq!(odd(&returns), [0_usize; 0]);
        returns[30..34].fill(5_000);
        returns[60..63].fill(90_000);
        assert_eq!(odd(&returns), [30, 31, 32, 33, 60, 61, 62]);
        assert_eq!(odd(&[]), [0_usize; 0]);
    }

    /// The null: scenes that open and close, sensors that see little, and logs that begin or end in another place.
    #[test]
    fn scenes_that_change_are_no_rows() {
        let opens = |k: i32| 20_000 - 19_000 * u32::from((40..70).contains(&k));
        let slowly: Vec<u32> = (0..100_u32).map(|k| 40_000 / (1 + k.abs_diff(50) / 2)).collect();
        let at_an_end: Vec<u32> = (0..100).map(|k| if k < 10 { 2_000 } else { 20_000 }).collect();
        let few: Vec<u32> = (0..100).map(|k| if k % 20 == 5 { 10 } else { 150 }).collect();
        let often: Vec<u32> = (0..100).map(opens).collect();
        for returns in [slowly, at_an_end, few, often] {
            assert_eq!(odd(&returns), [0_usize; 0]);
        }
    }
}
