//! Four lanes of plain code, which the compiler vectorises for the target.

use std::array::from_fn;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::simd::{Lanes, Mask};

/// The features of every processor of the target.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;

/// Four numbers, on targets without a better path; on x86-64 in tests only.
#[derive(Debug, Clone, Copy)]
#[repr(align(16))]
#[cfg_attr(target_arch = "x86_64", allow(dead_code, reason = "tests hold it to the others there"))]
pub(crate) struct Four([f32; 4]);

/// All bits of a lane, or none.
#[derive(Debug, Clone, Copy)]
#[repr(align(16))]
pub(crate) struct Mask4([u32; 4]);

impl BitAnd for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(from_fn(|k| self.0[k] & other.0[k]))
    }
}

impl BitOr for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(from_fn(|k| self.0[k] | other.0[k]))
    }
}

impl Mask for Mask4 {
    const COUNT: usize = 4;

    #[inline(always)]
    fn bits(self) -> u32 {
        (0..4).map(|k| self.0[k] & (1 << k)).fold(0, |a, b| a | b)
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $operator:tt) => {
        impl $trait for Four {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(from_fn(|k| self.0[k] $operator other.0[k]))
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl Four {
    #[inline(always)]
    fn compare(self, other: Self, holds: impl Fn(f32, f32) -> bool) -> Mask4 {
        Mask4(from_fn(|k| if holds(self.0[k], other.0[k]) { u32::MAX } else { 0 }))
    }
}

impl Lanes for Four {
    type Simd = Portable;
    type Mask = Mask4;
    type Ints = [u32; 4];
    const COUNT: usize = 4;

    #[inline(always)]
    fn splat(_: Portable, value: f32) -> Self {
        Self([value; 4])
    }
    #[inline(always)]
    fn load(_: Portable, values: &[f32]) -> Self {
        let values = &values[..4];
        Self(from_fn(|k| values[k]))
    }
    #[inline(always)]
    fn store(self, values: &mut [f32]) {
        values[..4].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(from_fn(|k| if self.0[k] < other.0[k] { self.0[k] } else { other.0[k] }))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(from_fn(|k| if self.0[k] > other.0[k] { self.0[k] } else { other.0[k] }))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask4 {
        self.compare(other, |a, b| a < b)
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask4 {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn equal(self, other: Self) -> Mask4 {
        self.compare(other, |a, b| a == b)
    }
    #[inline(always)]
    fn where_or(self, mask: Mask4, other: Self) -> Self {
        let lane = |k: usize| (self.0[k].to_bits() & mask.0[k]) | (other.0[k].to_bits() & !mask.0[k]);
        Self(from_fn(|k| f32::from_bits(lane(k))))
    }
    #[inline(always)]
    fn mask_of(_: Portable, bits: u32) -> Mask4 {
        Mask4(from_fn(|k| if bits & (1 << k) == 0 { 0 } else { u32::MAX }))
    }
    #[inline(always)]
    fn below(_: Portable, values: &[i32], bound: i32) -> Mask4 {
        let values = &values[..4];
        Mask4(from_fn(|k| if values[k] < bound { u32::MAX } else { 0 }))
    }
    #[inline(always)]
    fn above(_: Portable, values: &[i32], bound: i32) -> Mask4 {
        let values = &values[..4];
        Mask4(from_fn(|k| if values[k] > bound { u32::MAX } else { 0 }))
    }
    #[inline(always)]
    fn tagged(_: Portable, values: &[u32], bits: u32, tag: u32) -> [u32; 4] {
        let values = &values[..4];
        from_fn(|k| values[k] << bits | tag)
    }
    #[inline(always)]
    fn pack(ints: [u32; 4], mut bits: u32, packed: &mut [u32]) {
        let mut to = 0;
        while bits != 0 {
            packed[to] = ints[bits.trailing_zeros() as usize & 3];
            bits &= bits - 1;
            to += 1;
        }
    }
    #[inline(always)]
    fn pack_lanes(_: Portable, first: u32, mut bits: u32, packed: &mut [u32]) {
        let mut to = 0;
        while bits != 0 {
            packed[to] = first + bits.trailing_zeros();
            bits &= bits - 1;
            to += 1;
        }
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        let least = |a: f32, b: f32| if a < b { a } else { b };
        let [a, b, c, d] = self.0;
        least(least(a, c), least(b, d))
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        let most = |a: f32, b: f32| if a > b { a } else { b };
        let [a, b, c, d] = self.0;
        most(most(a, c), most(b, d))
    }
}
