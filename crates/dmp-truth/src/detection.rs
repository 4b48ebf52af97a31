//! How well a ranked list finds what is true: precision, recall, average precision.
//!
//! Items are accepted in the order of their scores, the lowest first; for each is known whether it is true.
//!
//! ```
//! use dmp_truth::detection::{PrecisionRecall, Ranked};
//!
//! let item = |score: f64, is_true: bool| Ranked { score: Some(score), is_true };
//! let found = PrecisionRecall::of(&[item(0.1, true), item(0.2, false), item(0.3, true)])?;
//! assert_eq!(found.average_precision, 0.5 * (1.0 + 2.0 / 3.0));
//! assert_eq!(found.recall_without_false(), 0.5);
//! # Ok::<(), dmp_truth::detection::DetectionError>(())
//! ```

/// An item of a ranked list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranked {
    /// What it is ranked by, in any unit: lower is better. `None` for one that could not be ranked: it is never accepted,
    /// and if it is true it is missed.
    pub score: Option<f64>,
    /// Whether it is one of those to be found.
    pub is_true: bool,
}

/// The items with one score or a lower one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrecisionRecallPoint {
    /// The highest score among them.
    pub score: f64,
    /// Share of the true items that is among them, in [0, 1].
    pub recall: f64,
    /// Share of them that is true, in [0, 1].
    pub precision: f64,
    /// How many they are.
    pub accepted: usize,
    /// How many of them are true.
    pub found: usize,
}

/// What a ranked list finds, and at what price.
#[derive(Debug, Clone, PartialEq)]
pub struct PrecisionRecall {
    /// A point for each score, from the lowest on; items of one score enter together. Recall never falls, and
    /// is 1 at the last where every true item has a score.
    pub points: Vec<PrecisionRecallPoint>,
    /// Σ (Rₙ − Rₙ₋₁) Pₙ over the points, with R₀ = 0, in (0, 1]: 1 where every true item comes before every
    /// other one.
    pub average_precision: f64,
}

/// Why a list has no precision and recall.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DetectionError {
    /// Recall is a share of what is true.
    #[error("none of the {items} items is true, so there is nothing to be found")]
    NothingTrue {
        /// How many items there are.
        items: usize,
    },
    /// It has no place in an order.
    #[error("the score of item {index} (from 0) is {score}, which is not finite")]
    NotFinite {
        /// Which item, from 0.
        index: usize,
        /// Its score.
        score: f64,
    },
}

impl PrecisionRecall {
    /// Of the items of a list, in any order.
    ///
    /// # Errors
    /// When a score is NaN or infinite, or no item is true.
    pub fn of(items: &[Ranked]) -> Result<Self, DetectionError> {
        let mut of_items = items.iter().enumerate().filter_map(|(index, item)| Some((index, item.score?)));
        if let Some((index, score)) = of_items.find(|(_, score)| !score.is_finite()) {
            return Err(DetectionError::NotFinite { index, score });
        }
        let all = items.iter().filter(|item| item.is_true).count();
        if all == 0 {
            return Err(DetectionError::NothingTrue { items: items.len() });
        }
        let mut ranked: Vec<(f64, bool)> =
            items.iter().filter_map(|item| Some((item.score?, item.is_true))).collect();
        // Zeros of both signs are one score, and all scores are finite.
        ranked.sort_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(std::cmp::Ordering::Equal));
        let (mut accepted, mut found, mut before, mut average_precision) = (0, 0, 0.0, 0.0);
        let points = ranked.chunk_by(|a, b| a.0 == b.0).map(|group| {
            accepted += group.len();
            found += group.iter().filter(|(_, is_true)| *is_true).count();
            let (precision, recall) = (found as f64 / accepted as f64, found as f64 / all as f64);
            average_precision += precision * (recall - before);
            before = recall;
            PrecisionRecallPoint { score: group[0].0, recall, precision, accepted, found }
        });
        let points = points.collect();
        Ok(Self { points, average_precision })
    }

    /// The largest recall without a false item among those accepted; 0 where the best score has one.
    pub fn recall_without_false(&self) -> f64 {
        let clean = self.points.iter().take_while(|point| point.found == point.accepted);
        clean.last().map_or(0.0, |point| point.recall)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn list(scores: &[f64], labels: &[u8]) -> Vec<Ranked> {
        let items = scores.iter().zip(labels);
        items.map(|(&score, &label)| Ranked { score: Some(score), is_true: label == 1 }).collect()
    }

    /// The list counted anew for every score.
    fn oracle(items: &[Ranked]) -> (Vec<(f64, usize, usize)>, f64) {
        let mut scores: Vec<f64> = items.iter().filter_map(|item| item.score).collect();
        scores.sort_by(f64::total_cmp);
        scores.dedup();
        let all = items.iter().filter(|item| item.is_true).count() as f64;
        let (mut points, mut sum, mut before) = (Vec::new(), 0.0, 0.0);
        for score in scores {
            let accepted = items.iter().filter(|item| item.score.is_some_and(|s| s <= score)).count();
            let found =
                items.iter().filter(|item| item.score.is_some_and(|s| s <= score) && item.is_true).count();
            sum += (found as f64 / all - before) * (found as f64 / accepted as f64);
            before = found as f64 / all;
            points.push((score, accepted, found));
        }
        (points, sum)
    }

    #[test]
    fn the_numbers_of_scikit_learn() {
        // `average_precision_score(labels, [-s for s in scores])` of scikit-learn 1.9.1.
        let scores = [0.5, 1.5, 1.5, 2.0, 2.0, 2.0, 3.25, 4.0, 7.0, 9.0];
        let found = PrecisionRecall::of(&list(&scores, &[1, 0, 1, 1, 0, 0, 1, 0, 1, 0])).unwrap();
        assert!((found.average_precision - 0.658_730_158_730_158_8).abs() < 1e-15);
        // `precision_recall_curve`, from its end on.
        let precisions = [1.0, 2.0 / 3.0, 0.5, 4.0 / 7.0, 0.5, 5.0 / 9.0, 0.5];
        let recalls = [0.2, 0.4, 0.6, 0.8, 0.8, 1.0, 1.0];
        let points = || found.points.iter();
        assert_eq!(points().map(|p| p.precision).collect::<Vec<_>>(), precisions);
        assert_eq!(points().map(|p| p.recall).collect::<Vec<_>>(), recalls);
        assert_eq!(points().map(|p| p.score).collect::<Vec<_>>(), [0.5, 1.5, 2.0, 3.25, 4.0, 7.0, 9.0]);
        let found = PrecisionRecall::of(&list(&[-3.0, -3.0, -1.0, 0.0, 0.0], &[0, 0, 1, 0, 1])).unwrap();
        assert!((found.average_precision - 0.366_666_666_666_666_7).abs() < 1e-15);
        assert_eq!(found.recall_without_false(), 0.0);
    }

    #[test]
    fn the_best_list_has_one_and_a_tied_one_the_share_of_what_is_true() {
        let best = PrecisionRecall::of(&list(&[-5.0, -5.0, 1.0, 2.0], &[1, 1, 0, 0])).unwrap();
        assert_eq!((best.average_precision, best.recall_without_false()), (1.0, 1.0));
        // Zeros of both signs are one score.
        let tied = PrecisionRecall::of(&list(&[0.0, -0.0, 0.0, -0.0], &[1, 0, 0, 0])).unwrap();
        assert_eq!((tied.average_precision, tied.points.len()), (0.25, 1));
    }

    #[test]
    fn what_has_no_precision_is_refused() {
        assert_eq!(PrecisionRecall::of(&[]), Err(DetectionError::NothingTrue { items: 0 }));
        let none = PrecisionRecall::of(&list(&[1.0, 2.0], &[0, 0]));
        assert_eq!(none, Err(DetectionError::NothingTrue { items: 2 }));
        for score in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let error = PrecisionRecall::of(&list(&[1.0, score], &[1, 0])).unwrap_err();
            assert!(matches!(error, DetectionError::NotFinite { index: 1, .. }), "{error}");
        }
    }

    proptest! {
        #[test]
        fn any_list_equals_its_definition(
            drawn in proptest::collection::vec((-5_i32..12, proptest::bool::ANY), 1..60),
        ) {
            // Few scores, so that many are tied.
            let score = |s: i32| (s > -5).then(|| f64::from(s) / 3.0);
            let items: Vec<Ranked> =
                drawn.iter().map(|&(s, is_true)| Ranked { score: score(s), is_true }).collect();
            match PrecisionRecall::of(&items) {
                Err(error) => {
                    prop_assert!(items.iter().all(|item| !item.is_true), "{error}");
                }
                Ok(found) => {
                    let (points, average_precision) = oracle(&items);
                    let of_found: Vec<_> = found.points.iter().map(|p| (p.score, p.accepted, p.found)).collect();
                    prop_assert_eq!(of_found, points);
                    prop_assert!((found.average_precision - average_precision).abs() < 1e-14);
                    let clean = items.iter().filter(|item| {
                        item.is_true
                            && item.score.is_some()
                            && items.iter().all(|other| {
                                other.is_true || other.score.is_none_or(|score| Some(score) > item.score)
                            })
                    });
                    let all = items.iter().filter(|item| item.is_true).count() as f64;
                    prop_assert_eq!(found.recall_without_false(), clean.count() as f64 / all);
                }
            }
        }
    }
}
