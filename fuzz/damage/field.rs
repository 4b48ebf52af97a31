//! Numbers in files, and the values at which readers go wrong.

use super::Random;

/// Numbers as text; as floats they go into binary files too.
pub(super) const NUMBERS: &str = "nan inf -inf 1e308 -1e400 5e-324 1e-30 0 -0 0.0001 0.5 1 -1 3 30 -7.5 1e3 -2e4 1e6 -1e9 \
    4.3e9 1e13 -1e18 1.7e18 1e30 16777217 2147483648 4294967295 4294967296 9007199254740993 9223372036854775807 \
    -9223372036854775808 18446744073709551615 18446744073709551616 99999999999999999999999999999999";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Little,
    Big,
    /// In IEEE 754, little-endian, of 4 or 8 bytes.
    Float,
}

/// A number in a file: its place and width in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) at: usize,
    pub(super) width: usize,
    pub(super) kind: Kind,
}

impl Field {
    pub(super) const fn little(at: usize, width: usize) -> Self {
        Self { at, width, kind: Kind::Little }
    }

    pub(super) const fn float(at: usize, width: usize) -> Self {
        Self { at, width, kind: Kind::Float }
    }

    /// Replaces the number: by an odd one, or by one near it. Does nothing where the file ends before.
    pub(super) fn spoil(self, file: &mut [u8], random: &mut Random) {
        let Some(field) = file.get_mut(self.at..self.at.saturating_add(self.width)) else { return };
        if self.kind == Kind::Float {
            let float: f64 = random.word(NUMBERS).parse().unwrap_or(f64::NAN);
            match field.len() {
                4 => field.copy_from_slice(&(float as f32).to_le_bytes()),
                8 => field.copy_from_slice(&float.to_le_bytes()),
                _ => {}
            }
            return;
        }
        let is_big = self.kind == Kind::Big;
        let mut old = [0; 8];
        old[..self.width].copy_from_slice(field);
        if is_big {
            old[..self.width].reverse();
        }
        let old = u64::from_le_bytes(old);
        let number = match random.below(4) {
            0 => old.wrapping_add(random.below(9) as u64).wrapping_sub(4),
            1 => old.wrapping_mul(*random.pick(&[2, 3, 16, 256, 65_536, u64::MAX])),
            _ => odd_number(random),
        };
        field.copy_from_slice(&number.to_le_bytes()[..self.width]);
        if is_big {
            field.reverse();
        }
    }
}

/// A whole number near a power of two, a small one, or any.
pub(super) fn odd_number(random: &mut Random) -> u64 {
    match random.below(8) {
        0 => random.next(),
        1 => random.below(300) as u64,
        choice => {
            // Where widths and signs end.
            let at_ends = *random.pick(&[0, 7, 8, 15, 16, 31, 32, 62, 63, 64]);
            let bit = if choice == 2 { random.below(65) as u32 } else { at_ends };
            1_u64.checked_shl(bit).unwrap_or(0).wrapping_add(random.below(4) as u64).wrapping_sub(2)
        }
    }
}

/// The number of so many bytes at a place, little-endian.
pub(super) fn number(file: &[u8], at: usize, width: usize) -> Option<usize> {
    let field = file.get(at..at.checked_add(width)?)?;
    let number = field.iter().rev().fold(0_u64, |number, &byte| number << 8 | u64::from(byte));
    usize::try_from(number).ok()
}
