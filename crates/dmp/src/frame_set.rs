//! Some of the planned frames, by their ordinals: what is done, what is to be scored.

/// A set of ordinals: a bit for each.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct FrameSet(Vec<u64>);

impl FrameSet {
    pub(crate) fn insert(&mut self, ordinal: usize) {
        if self.0.len() <= ordinal / 64 {
            self.0.resize(ordinal / 64 + 1, 0);
        }
        self.0[ordinal / 64] |= 1 << (ordinal % 64);
    }

    pub(crate) fn contains(&self, ordinal: usize) -> bool {
        self.0.get(ordinal / 64).is_some_and(|word| word >> (ordinal % 64) & 1 == 1)
    }
}
