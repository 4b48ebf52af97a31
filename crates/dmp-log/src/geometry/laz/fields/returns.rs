//! Contexts by a point's return number and its pulse's number of returns. The tables are part of the format.

/// Of point formats up to 5: by number of returns, then return number.
const MAP_10: [[u8; 8]; 8] = [
    [15, 14, 13, 12, 11, 10, 9, 8],
    [14, 0, 1, 3, 6, 10, 10, 9],
    [13, 1, 2, 4, 7, 11, 11, 10],
    [12, 3, 4, 5, 8, 12, 12, 11],
    [11, 6, 7, 8, 9, 13, 13, 12],
    [10, 10, 11, 12, 13, 14, 14, 13],
    [9, 10, 11, 12, 13, 14, 15, 14],
    [8, 9, 10, 11, 12, 13, 14, 15],
];

/// Of point formats from 6 on: the same, with six contexts.
const MAP_14: [[u8; 16]; 16] = [
    [0, 1, 2, 3, 4, 5, 3, 4, 4, 5, 5, 5, 5, 5, 5, 5],
    [1, 0, 1, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3],
    [2, 1, 2, 4, 4, 4, 4, 4, 4, 4, 4, 3, 3, 3, 3, 3],
    [3, 3, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4],
    [4, 3, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4],
    [5, 3, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4],
    [3, 3, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4],
    [4, 3, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4],
    [4, 3, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4],
    [5, 3, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4],
    [5, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 4, 4, 4],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 4, 4],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 4],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5],
];

/// Which of several pulses' returns a point is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Return {
    pub(crate) number: usize,
    pub(crate) of: usize,
}

impl Return {
    /// Of the context of x and y in formats up to 5, less than 16.
    pub(crate) fn context_10(self) -> usize {
        MAP_10[self.of & 7][self.number & 7].into()
    }

    /// Of the context of x and y in formats from 6 on, less than 6.
    pub(crate) fn context_14(self) -> usize {
        MAP_14[self.of & 15][self.number & 15].into()
    }

    /// Which of eight heights is expected.
    pub(crate) fn level(self) -> usize {
        self.of.abs_diff(self.number).min(7)
    }

    /// 1 for the only return of a pulse, by what it says.
    pub(crate) fn single(self) -> usize {
        usize::from(self.of == 1)
    }
}

/// The context of a coordinate by how many bits the ones before it needed: even numbers up to `most`, and `single`.
pub(crate) fn by_width(width: u32, most: u32, single: usize) -> usize {
    (width & !1).min(most) as usize + single
}
