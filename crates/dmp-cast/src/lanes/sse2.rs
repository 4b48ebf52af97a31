//! Four lanes of SSE2, which every x86-64 processor has.

#![expect(unsafe_code, reason = "loads and stores of vectors")]

use std::arch::x86_64::{
    __m128, __m128i, _mm_add_ps, _mm_and_ps, _mm_and_si128, _mm_andnot_ps, _mm_castsi128_ps, _mm_cmpeq_epi32,
    _mm_cmpeq_ps, _mm_cmpgt_epi32, _mm_cmple_ps, _mm_cmplt_epi32, _mm_cmplt_ps, _mm_cvtsi32_si128,
    _mm_cvtss_f32, _mm_div_ps, _mm_loadu_ps, _mm_loadu_si128, _mm_max_ps, _mm_max_ss, _mm_min_ps, _mm_min_ss,
    _mm_movehl_ps, _mm_movemask_ps, _mm_mul_ps, _mm_or_ps, _mm_or_si128, _mm_set1_epi32, _mm_set1_ps,
    _mm_setr_epi32, _mm_shuffle_ps, _mm_sll_epi32, _mm_storeu_ps, _mm_storeu_si128, _mm_sub_ps,
};

use super::portable::Portable;
use super::simd::{Lanes, Mask};
use super::vector::{lanes_of_intrinsics, operators};

#[derive(Debug, Clone, Copy)]
pub(crate) struct Four(__m128);

/// All bits of a lane, or none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mask4(__m128);

#[derive(Debug, Clone, Copy)]
pub(crate) struct Ints4(__m128i);

operators!(Four: Add add _mm_add_ps, Sub sub _mm_sub_ps, Mul mul _mm_mul_ps, Div div _mm_div_ps);
operators!(Mask4: BitAnd bitand _mm_and_ps, BitOr bitor _mm_or_ps);

impl Mask for Mask4 {
    const COUNT: usize = 4;

    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: every x86-64 processor has SSE2.
        unsafe { _mm_movemask_ps(self.0) as u32 }
    }
}

#[inline(always)]
fn load_ints(values: &[i32]) -> __m128i {
    let values = &values[..4];
    // SAFETY: four ints lie there.
    unsafe { _mm_loadu_si128(values.as_ptr().cast()) }
}

impl Lanes for Four {
    lanes_of_intrinsics!(
        Portable, Mask4, 4;
        splat _mm_set1_ps, load _mm_loadu_ps, store _mm_storeu_ps, min _mm_min_ps, max _mm_max_ps,
        lt _mm_cmplt_ps, le _mm_cmple_ps, equal _mm_cmpeq_ps
    );
    type Ints = Ints4;

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: every x86-64 processor has SSE2.
        Self(unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn where_or(self, mask: Mask4, other: Self) -> Self {
        // SAFETY: every x86-64 processor has SSE2.
        Self(unsafe { _mm_or_ps(_mm_and_ps(mask.0, self.0), _mm_andnot_ps(mask.0, other.0)) })
    }
    #[inline(always)]
    fn mask_of(_: Portable, bits: u32) -> Mask4 {
        // SAFETY: every x86-64 processor has SSE2.
        let lanes = unsafe { _mm_setr_epi32(1, 2, 4, 8) };
        // SAFETY: every x86-64 processor has SSE2.
        let set = unsafe { _mm_and_si128(_mm_set1_epi32(bits as i32), lanes) };
        // SAFETY: every x86-64 processor has SSE2.
        Mask4(unsafe { _mm_castsi128_ps(_mm_cmpeq_epi32(set, lanes)) })
    }
    #[inline(always)]
    fn below(_: Portable, values: &[i32], bound: i32) -> Mask4 {
        // SAFETY: every x86-64 processor has SSE2.
        Mask4(unsafe { _mm_castsi128_ps(_mm_cmplt_epi32(load_ints(values), _mm_set1_epi32(bound))) })
    }
    #[inline(always)]
    fn above(_: Portable, values: &[i32], bound: i32) -> Mask4 {
        // SAFETY: every x86-64 processor has SSE2.
        Mask4(unsafe { _mm_castsi128_ps(_mm_cmpgt_epi32(load_ints(values), _mm_set1_epi32(bound))) })
    }
    #[inline(always)]
    fn tagged(_: Portable, values: &[u32], bits: u32, tag: u32) -> Ints4 {
        let values = &values[..4];
        // SAFETY: four ints lie there.
        let values = unsafe { _mm_loadu_si128(values.as_ptr().cast()) };
        // SAFETY: every x86-64 processor has SSE2.
        let up = unsafe { _mm_sll_epi32(values, _mm_cvtsi32_si128(bits as i32)) };
        // SAFETY: every x86-64 processor has SSE2.
        Ints4(unsafe { _mm_or_si128(up, _mm_set1_epi32(tag as i32)) })
    }
    #[inline(always)]
    fn pack(ints: Ints4, bits: u32, packed: &mut [u32]) {
        let mut from = [0u32; 4];
        // SAFETY: four ints fit there.
        unsafe { _mm_storeu_si128(from.as_mut_ptr().cast(), ints.0) };
        let packed = &mut packed[..4];
        let mut to = 0;
        for (k, from) in from.into_iter().enumerate() {
            packed[to & 3] = from;
            to += (bits >> k & 1) as usize;
        }
    }
    #[inline(always)]
    fn pack_lanes(_: Portable, first: u32, bits: u32, packed: &mut [u32]) {
        let packed = &mut packed[..4];
        let mut to = 0;
        for k in 0..4 {
            packed[to & 3] = first + k;
            to += (bits >> k & 1) as usize;
        }
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        // SAFETY: every x86-64 processor has SSE2.
        let two = unsafe { _mm_min_ps(self.0, _mm_movehl_ps(self.0, self.0)) };
        // SAFETY: every x86-64 processor has SSE2.
        unsafe { _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps::<1>(two, two))) }
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        // SAFETY: every x86-64 processor has SSE2.
        let two = unsafe { _mm_max_ps(self.0, _mm_movehl_ps(self.0, self.0)) };
        // SAFETY: every x86-64 processor has SSE2.
        unsafe { _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps::<1>(two, two))) }
    }
}
