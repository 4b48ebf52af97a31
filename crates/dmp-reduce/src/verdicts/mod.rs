//! What the sums answer: scores, comparisons, verdicts, an order of the runs.

mod answers;
mod compare;
mod family;
mod guard;
mod order;
mod scale_comparison;
mod verdict;

pub use answers::{Comparisons, RunScores};
pub use compare::Comparison;
pub use guard::{GuardCheck, Stretch};
pub use order::{Ranked, order_runs};
pub use scale_comparison::ScaleComparison;
pub use verdict::{UndecidedReason, Verdict};
