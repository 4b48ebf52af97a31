//! Vectors of twice as many lanes, from two vectors.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use super::simd::{Lanes, Mask};

/// Twice as many lanes, from two vectors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair<L>(L, L);

/// Their masks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PairMask<M>(M, M);

impl<M: Mask> BitAnd for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0, self.1 & other.1)
    }
}

impl<M: Mask> BitOr for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0, self.1 | other.1)
    }
}

impl<M: Mask> Mask for PairMask<M> {
    const COUNT: usize = 2 * M::COUNT;

    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.bits() | (self.1.bits() << M::COUNT)
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<L: Lanes> $trait for Pair<L> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(self.0.$name(other.0), self.1.$name(other.1))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<L: Lanes> Lanes for Pair<L> {
    type Simd = L::Simd;
    type Mask = PairMask<L::Mask>;
    type Ints = [L::Ints; 2];
    const COUNT: usize = 2 * L::COUNT;

    #[inline(always)]
    fn splat(simd: L::Simd, value: f32) -> Self {
        Self(L::splat(simd, value), L::splat(simd, value))
    }
    #[inline(always)]
    fn load(simd: L::Simd, values: &[f32]) -> Self {
        let values = &values[..Self::COUNT];
        Self(L::load(simd, values), L::load(simd, &values[L::COUNT..]))
    }
    #[inline(always)]
    fn store(self, values: &mut [f32]) {
        let values = &mut values[..Self::COUNT];
        self.0.store(values);
        self.1.store(&mut values[L::COUNT..]);
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        PairMask(self.0.lt(other.0), self.1.lt(other.1))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        PairMask(self.0.le(other.0), self.1.le(other.1))
    }
    #[inline(always)]
    fn equal(self, other: Self) -> Self::Mask {
        PairMask(self.0.equal(other.0), self.1.equal(other.1))
    }
    #[inline(always)]
    fn where_or(self, mask: Self::Mask, other: Self) -> Self {
        Self(self.0.where_or(mask.0, other.0), self.1.where_or(mask.1, other.1))
    }
    #[inline(always)]
    fn mask_of(simd: L::Simd, bits: u32) -> Self::Mask {
        PairMask(L::mask_of(simd, bits), L::mask_of(simd, bits >> L::COUNT))
    }
    #[inline(always)]
    fn below(simd: L::Simd, values: &[i32], bound: i32) -> Self::Mask {
        let values = &values[..Self::COUNT];
        PairMask(L::below(simd, values, bound), L::below(simd, &values[L::COUNT..], bound))
    }
    #[inline(always)]
    fn above(simd: L::Simd, values: &[i32], bound: i32) -> Self::Mask {
        let values = &values[..Self::COUNT];
        PairMask(L::above(simd, values, bound), L::above(simd, &values[L::COUNT..], bound))
    }
    #[inline(always)]
    fn tagged(simd: L::Simd, values: &[u32], bits: u32, tag: u32) -> Self::Ints {
        let values = &values[..Self::COUNT];
        [L::tagged(simd, values, bits, tag), L::tagged(simd, &values[L::COUNT..], bits, tag)]
    }
    #[inline(always)]
    fn pack(ints: Self::Ints, bits: u32, packed: &mut [u32]) {
        let packed = &mut packed[..Self::COUNT];
        let low = bits & ((1 << L::COUNT) - 1);
        L::pack(ints[0], low, packed);
        let at = low.count_ones() as usize;
        L::pack(ints[1], bits >> L::COUNT, &mut packed[at..]);
    }
    #[inline(always)]
    fn pack_lanes(simd: L::Simd, first: u32, bits: u32, packed: &mut [u32]) {
        let packed = &mut packed[..Self::COUNT];
        let low = bits & ((1 << L::COUNT) - 1);
        L::pack_lanes(simd, first, low, packed);
        let at = low.count_ones() as usize;
        L::pack_lanes(simd, first + L::COUNT as u32, bits >> L::COUNT, &mut packed[at..]);
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        self.0.min(self.1).smallest()
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        self.0.max(self.1).largest()
    }
}
