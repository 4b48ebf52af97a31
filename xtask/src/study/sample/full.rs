//! What all scans of a drive say.

use dmp::Confidence;
use dmp_reduce::{Comparison, Promise, Reducer, Verdict};

/// What all scans say.
pub(in crate::study) struct Full {
    pub(in crate::study) runs: Vec<Option<f64>>,
    pub(in crate::study) pairs: Vec<Comparison>,
}

impl Full {
    pub(in crate::study) fn of(whole: &Reducer) -> Self {
        let runs = (0..whole.layout().bases().len()).map(|run| value_of(whole, run)).collect();
        Self { runs, pairs: whole.comparisons(Promise::default()).pairs }
    }

    /// Whether the run that a verdict calls better is the worse one, at the scale that decided.
    pub(super) fn contradicts(&self, pair: usize, said: &Comparison) -> bool {
        let Some((which, decided_at_m)) = decided(said) else { return false };
        let scale = self.pairs[pair].scales.iter().find(|scale| scale.scale_m == decided_at_m);
        let difference_m2 = scale.and_then(|scale| scale.difference).map_or(0.0, |d| d.value_m2);
        // Negative where a is better.
        difference_m2 == 0.0 || (difference_m2 < 0.0) != (which == said.a)
    }
}

fn value_of(reducer: &Reducer, run: usize) -> Option<f64> {
    Some(reducer.scores(run, Confidence::P99).r_cv_m2[0].1?.value_m2)
}

/// The better run and the scale, where anything is decided.
pub(super) fn decided(comparison: &Comparison) -> Option<(usize, f64)> {
    match comparison.verdict {
        Verdict::Better { which, decided_at_m, .. } | Verdict::Mixed { which, decided_at_m, .. } => {
            Some((which, decided_at_m))
        }
        Verdict::Same { .. } | Verdict::Undecided { .. } => None,
    }
}
