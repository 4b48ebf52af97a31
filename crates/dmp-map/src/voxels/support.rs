//! The segments of the drive that saw a surfel, and the independence that follows.

/// The segments of the drive in which a surfel was seen, as far as independence needs them: the three lowest and the
/// three highest segments of its observations, with multiplicity.
///
/// Order-free and mergeable: the summary of a union is the merge of the summaries.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable, serde::Serialize, serde::Deserialize,
)]
#[repr(C)]
pub struct Support {
    /// Ascending; padded with `ABSENT_LOW`.
    lowest: [i32; 3],
    /// Descending; padded with `ABSENT_HIGH`.
    highest: [i32; 3],
}

const ABSENT_LOW: i32 = i32::MAX;
const ABSENT_HIGH: i32 = i32::MIN;

impl Default for Support {
    fn default() -> Self {
        Self { lowest: [ABSENT_LOW; 3], highest: [ABSENT_HIGH; 3] }
    }
}

impl Support {
    /// Adds one observation made in `segment` (0 to `i32::MAX - 1`).
    #[inline]
    pub fn add(&mut self, segment: i32) {
        let [a, b, c] = self.lowest;
        if segment < c {
            self.lowest = [a.min(segment), b.min(a.max(segment)), c.min(b.max(segment))];
        }
        let [a, b, c] = self.highest;
        if segment > c {
            self.highest = [a.max(segment), b.max(a.min(segment)), c.max(b.min(segment))];
        }
    }

    /// Adds `count` observations made in `segment`.
    #[inline]
    pub(crate) fn add_times(&mut self, segment: i32, count: u32) {
        // More than three change nothing, nor do any between the third-lowest and the third-highest.
        if segment < self.lowest[2] || segment > self.highest[2] {
            (0..count.min(3)).for_each(|_| self.add(segment));
        }
    }

    /// Adds the observations of `other`, which must be disjoint from its own.
    pub fn merge(&mut self, other: &Self) {
        for segment in other.lowest {
            if segment != ABSENT_LOW && segment < self.lowest[2] {
                self.lowest[2] = segment;
                self.lowest.sort_unstable();
            }
        }
        for segment in other.highest {
            if segment != ABSENT_HIGH && segment > self.highest[2] {
                self.highest[2] = segment;
                self.highest.sort_unstable_by(|a, b| b.cmp(a));
            }
        }
    }

    /// The third-lowest segment; `i32::MAX` with fewer than three observations.
    #[inline]
    pub fn third_lowest(&self) -> i32 {
        self.lowest[2]
    }

    /// The third-highest segment; `i32::MIN` with fewer than three observations.
    #[inline]
    pub fn third_highest(&self) -> i32 {
        self.highest[2]
    }
}

/// The condition for observations to be independent of a return made in one segment: at least three before, or at least
/// three after, the segment and its neighbours up to a reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Independence {
    before: i32,
    after: i32,
}

impl Independence {
    /// Observations this many segments on, or fewer, are of the same visit.
    pub const SAME_VISIT: i32 = 5;

    /// Independence of a return made in `segment`, its neighbours up to `reach` segments excluded.
    #[inline]
    pub fn of(segment: i32, reach: i32) -> Self {
        Self { before: segment.saturating_sub(reach), after: segment.saturating_add(reach) }
    }

    /// Third-lowest segments below the first, and third-highest segments above the second, are independent.
    #[inline]
    pub fn bounds(self) -> [i32; 2] {
        [self.before, self.after]
    }

    /// Whether a surfel with these two integers is independent of the return.
    #[inline]
    pub fn holds(self, third_lowest: i32, third_highest: i32) -> bool {
        third_lowest < self.before || third_highest > self.after
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(segments: &[i32]) -> Support {
        let mut support = Support::default();
        segments.iter().for_each(|&s| support.add(s));
        support
    }

    proptest! {
        #[test]
        fn the_summary_answers_as_the_list_does(
            segments in prop::collection::vec(0..30i32, 0..12), cut in 0usize..12, s in 0..30i32, reach in 1..6i32,
        ) {
            let cut = cut.min(segments.len());
            let mut merged = of(&segments[cut..]);
            merged.merge(&of(&segments[..cut]));
            prop_assert_eq!(merged, of(&segments));
            let before = segments.iter().filter(|&&o| o < s - reach).count();
            let after = segments.iter().filter(|&&o| o > s + reach).count();
            let independent = Independence::of(s, reach).holds(merged.third_lowest(), merged.third_highest());
            prop_assert_eq!(independent, before >= 3 || after >= 3);
        }
    }
}
