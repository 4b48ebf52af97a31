//! What counts as the same, and how sure verdicts are to be.

use crate::numbers::Confidence;

/// How far apart two runs may be and still count as the same: of their root mean squares at a scale.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Margin {
    /// A share of the better run's own root mean square: of what is there without any difference.
    Share(f64),
    /// So many metres, at every scale.
    Metres(f64),
}

impl Margin {
    /// The margin where the better run's root mean square is `floor_m`, both in metres.
    pub fn metres(self, floor_m: f64) -> f64 {
        match self {
            Self::Share(share) => share * floor_m,
            Self::Metres(metres) => metres,
        }
    }
}

/// A tenth of what is there without any difference.
impl Default for Margin {
    fn default() -> Self {
        Self::Share(0.1)
    }
}

/// What the verdicts on a set of runs are to promise, all of them together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Promise {
    /// How sure it is to be that no two equal runs are declared different: over all scales of all pairs.
    pub confidence: Confidence,
    /// What makes no difference.
    pub margin: Margin,
}

impl Default for Promise {
    fn default() -> Self {
        Self { confidence: Confidence::P99, margin: Margin::default() }
    }
}
