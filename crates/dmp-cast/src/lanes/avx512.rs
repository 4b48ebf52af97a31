//! Sixteen lanes of AVX-512; eight are those of AVX2.

#![expect(unsafe_code, reason = "the processor's vector instructions")]

use std::arch::x86_64::{
    __m512, __m512i, __mmask16, _CMP_EQ_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _mm_cvtsi32_si128, _mm512_abs_ps,
    _mm512_add_epi32, _mm512_add_ps, _mm512_cmp_ps_mask, _mm512_cmpgt_epi32_mask, _mm512_cmplt_epi32_mask,
    _mm512_div_ps, _mm512_loadu_ps, _mm512_loadu_si512, _mm512_mask_blend_ps, _mm512_maskz_compress_epi32,
    _mm512_max_ps, _mm512_min_ps, _mm512_mul_ps, _mm512_or_si512, _mm512_reduce_max_ps, _mm512_reduce_min_ps,
    _mm512_set1_epi32, _mm512_set1_ps, _mm512_setr_epi32, _mm512_sll_epi32, _mm512_storeu_ps,
    _mm512_storeu_si512, _mm512_sub_ps,
};
use std::ops::{BitAnd, BitOr};

use super::avx2::{self, Avx2};
use super::simd::{Job, Lanes, Mask, Simd};
use super::vector::{lanes_of_intrinsics, operators};

/// AVX-512 (F, VL, BW, DQ), which includes AVX2.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx512(());

impl Avx512 {
    /// `Some` if the processor has it.
    pub(crate) fn found() -> Option<Self> {
        use std::arch::is_x86_feature_detected as has;
        let found = has!("avx512f") && has!("avx512vl") && has!("avx512bw") && has!("avx512dq");
        (found && Avx2::found().is_some()).then_some(Self(()))
    }
}

impl Simd for Avx512 {
    type Eight = avx2::Eight;
    type Sixteen = Sixteen;

    #[inline(always)]
    fn eight(self) -> Avx2 {
        // SAFETY: `found` checks all of them.
        unsafe { Avx2::assume() }
    }
    #[inline(always)]
    fn sixteen(self) -> Self {
        self
    }

    #[inline]
    fn run<J: Job>(self, job: J) -> J::Output {
        #[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,bmi1,bmi2,lzcnt,popcnt")]
        #[inline(never)]
        fn enabled<J: Job>(simd: Avx512, job: J) -> J::Output {
            job.on(simd)
        }
        // SAFETY: a value of this type exists only where these were found.
        unsafe { enabled(self, job) }
    }
}

/// Exists only where an [`Avx512`] does, or was loaded with one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sixteen(__m512);

/// A bit for each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mask16(__mmask16);

/// Exists only where an [`Avx512`] does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ints16(__m512i);

operators!(Sixteen: Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps, Div div _mm512_div_ps);

impl BitAnd for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Mask for Mask16 {
    const COUNT: usize = 16;

    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl Lanes for Sixteen {
    lanes_of_intrinsics!(
        Avx512, Mask16, 16;
        splat _mm512_set1_ps, load _mm512_loadu_ps, store _mm512_storeu_ps, min _mm512_min_ps, max _mm512_max_ps,
        lt _mm512_cmp_ps_mask::<_CMP_LT_OQ>, le _mm512_cmp_ps_mask::<_CMP_LE_OQ>, equal _mm512_cmp_ps_mask::<_CMP_EQ_OQ>
    );
    type Ints = Ints16;

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the vector exists only where AVX-512 was found.
        Self(unsafe { _mm512_abs_ps(self.0) })
    }
    #[inline(always)]
    fn where_or(self, mask: Mask16, other: Self) -> Self {
        // SAFETY: the vectors exist only where AVX-512 was found.
        Self(unsafe { _mm512_mask_blend_ps(mask.0, other.0, self.0) })
    }
    #[inline(always)]
    fn mask_of(_: Avx512, bits: u32) -> Mask16 {
        Mask16(bits as u16)
    }
    #[inline(always)]
    fn below(_: Avx512, values: &[i32], bound: i32) -> Mask16 {
        let values = &values[..16];
        // SAFETY: AVX-512 was found, and sixteen ints lie there.
        Mask16(unsafe {
            _mm512_cmplt_epi32_mask(_mm512_loadu_si512(values.as_ptr().cast()), _mm512_set1_epi32(bound))
        })
    }
    #[inline(always)]
    fn above(_: Avx512, values: &[i32], bound: i32) -> Mask16 {
        let values = &values[..16];
        // SAFETY: AVX-512 was found, and sixteen ints lie there.
        Mask16(unsafe {
            _mm512_cmpgt_epi32_mask(_mm512_loadu_si512(values.as_ptr().cast()), _mm512_set1_epi32(bound))
        })
    }
    #[inline(always)]
    fn tagged(_: Avx512, values: &[u32], bits: u32, tag: u32) -> Ints16 {
        let values = &values[..16];
        // SAFETY: AVX-512 was found, and sixteen ints lie there.
        Ints16(unsafe {
            let values = _mm512_loadu_si512(values.as_ptr().cast());
            let up = _mm512_sll_epi32(values, _mm_cvtsi32_si128(bits as i32));
            _mm512_or_si512(up, _mm512_set1_epi32(tag as i32))
        })
    }
    #[inline(always)]
    fn pack(ints: Ints16, bits: u32, packed: &mut [u32]) {
        let packed = &mut packed[..16];
        // SAFETY: the vector exists only where AVX-512 was found, and sixteen ints fit there.
        unsafe {
            let moved = _mm512_maskz_compress_epi32(bits as u16, ints.0);
            _mm512_storeu_si512(packed.as_mut_ptr().cast(), moved);
        }
    }
    #[inline(always)]
    fn pack_lanes(_: Avx512, first: u32, bits: u32, packed: &mut [u32]) {
        let packed = &mut packed[..16];
        // SAFETY: AVX-512 was found, and sixteen ints fit there.
        unsafe {
            let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let numbers = _mm512_add_epi32(lanes, _mm512_set1_epi32(first as i32));
            let moved = _mm512_maskz_compress_epi32(bits as u16, numbers);
            _mm512_storeu_si512(packed.as_mut_ptr().cast(), moved);
        }
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        // SAFETY: the vector exists only where AVX-512 was found.
        unsafe { _mm512_reduce_min_ps(self.0) }
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        // SAFETY: the vector exists only where AVX-512 was found.
        unsafe { _mm512_reduce_max_ps(self.0) }
    }
}
