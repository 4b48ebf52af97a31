//! The middle of the last five values, nearly: what `LASzip` expects of a coordinate's next difference.

/// Five values in order, of which one end and then the other is replaced.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Median {
    values: [i32; 5],
    /// Which end the next value takes the place of.
    at_high_end: bool,
}

impl Median {
    pub(crate) fn new() -> Self {
        Self { values: [0; 5], at_high_end: true }
    }

    #[inline]
    pub(crate) fn get(&self) -> i32 {
        self.values[2]
    }

    /// Puts in a value. The next one takes the other end's place if this one is not on the other side of the middle.
    #[inline]
    pub(crate) fn add(&mut self, value: i32) {
        let [a, b, c, d, e] = self.values;
        // Without a branch for each place: they would be guessed wrong.
        let [a, b, c, d] = if self.at_high_end {
            self.at_high_end = value < c;
            [a, b, c, d]
        } else {
            self.at_high_end = value <= c;
            [b, c, d, e]
        };
        self.values =
            [value.min(a), value.min(b).max(a), value.min(c).max(b), value.min(d).max(c), value.max(d)];
    }
}
