//! Which frames were added, by their ordinals.

/// A set of frames by their ordinals: a bit for each.
///
/// ```
/// use dmp_reduce::FrameSet;
///
/// let mut set: FrameSet = (3..7).collect();
/// assert!(set.insert(9) && !set.insert(4));
/// assert_eq!((set.len(), set.contains(6), set.contains(7)), (5, true, false));
/// assert_eq!(set.first_in_common(&[1, 6, 9].into_iter().collect()), Some(6));
/// assert_eq!(set.iter().collect::<Vec<_>>(), [3, 4, 5, 6, 9]);
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(from = "Vec<u64>")]
pub struct FrameSet(Vec<u64>);

impl From<Vec<u64>> for FrameSet {
    /// Words behind the last frame are none, so that equal sets are equal.
    fn from(mut words: Vec<u64>) -> Self {
        words.truncate(words.iter().rposition(|&word| word != 0).map_or(0, |last| last + 1));
        Self(words)
    }
}

impl FrameSet {
    /// Adds a frame; true where it was not there.
    pub fn insert(&mut self, ordinal: usize) -> bool {
        if self.0.len() <= ordinal / 64 {
            self.0.resize(ordinal / 64 + 1, 0);
        }
        let (word, bit) = (&mut self.0[ordinal / 64], 1 << (ordinal % 64));
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    }

    /// Whether a frame is in it.
    pub fn contains(&self, ordinal: usize) -> bool {
        self.0.get(ordinal / 64).is_some_and(|word| word >> (ordinal % 64) & 1 == 1)
    }

    /// Frames in it.
    pub fn len(&self) -> u64 {
        self.0.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The largest ordinal.
    pub fn last(&self) -> Option<usize> {
        let word = self.0.last()?;
        Some(64 * self.0.len() - 1 - word.leading_zeros() as usize)
    }

    /// The smallest ordinal that is in both.
    pub fn first_in_common(&self, other: &Self) -> Option<usize> {
        let common = self.0.iter().zip(&other.0).map(|(a, b)| a & b);
        let (place, word) = common.enumerate().find(|(_, word)| *word != 0)?;
        Some(64 * place + word.trailing_zeros() as usize)
    }

    /// Adds all of another set.
    pub fn merge(&mut self, other: &Self) {
        self.0.resize(self.0.len().max(other.0.len()), 0);
        self.0.iter_mut().zip(&other.0).for_each(|(mine, theirs)| *mine |= theirs);
    }

    /// The ordinals, ascending.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        let of_word = |(place, &word): (usize, &u64)| {
            (0..64).filter(move |bit| word >> bit & 1 == 1).map(move |bit| 64 * place + bit)
        };
        self.0.iter().enumerate().flat_map(of_word)
    }
}

impl Extend<usize> for FrameSet {
    fn extend<I: IntoIterator<Item = usize>>(&mut self, ordinals: I) {
        for ordinal in ordinals {
            self.insert(ordinal);
        }
    }
}

impl FromIterator<usize> for FrameSet {
    fn from_iter<I: IntoIterator<Item = usize>>(ordinals: I) -> Self {
        let mut set = Self::default();
        set.extend(ordinals);
        set
    }
}
