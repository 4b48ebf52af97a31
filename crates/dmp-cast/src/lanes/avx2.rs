//! Eight lanes of AVX2; two vectors make sixteen.

#![expect(unsafe_code, reason = "the processor's vector instructions")]

use std::arch::x86_64::{
    __m256, __m256i, _CMP_EQ_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _mm_cvtsi32_si128, _mm_cvtsi64_si128, _mm_cvtss_f32,
    _mm_max_ps, _mm_max_ss, _mm_min_ps, _mm_min_ss, _mm_movehl_ps, _mm_shuffle_ps, _mm256_add_epi32,
    _mm256_add_ps, _mm256_and_ps, _mm256_and_si256, _mm256_andnot_ps, _mm256_blendv_ps,
    _mm256_castps256_ps128, _mm256_castsi256_ps, _mm256_cmp_ps, _mm256_cmpeq_epi32, _mm256_cmpgt_epi32,
    _mm256_cvtepu8_epi32, _mm256_div_ps, _mm256_extractf128_ps, _mm256_loadu_ps, _mm256_loadu_si256,
    _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_or_ps, _mm256_or_si256,
    _mm256_permutevar8x32_epi32, _mm256_set1_epi32, _mm256_set1_ps, _mm256_setr_epi32, _mm256_sll_epi32,
    _mm256_storeu_ps, _mm256_storeu_si256, _mm256_sub_ps,
};

use super::pair::Pair;
use super::simd::{Job, Lanes, Mask, Simd};
use super::vector::{lanes_of_intrinsics, operators};

/// AVX2, with the bit instructions of the same processors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// `Some` if the processor has it.
    pub(crate) fn found() -> Option<Self> {
        use std::arch::is_x86_feature_detected as has;
        let bits = has!("bmi1") && has!("bmi2") && has!("lzcnt") && has!("popcnt");
        (bits && has!("avx2")).then_some(Self(()))
    }

    /// # Safety
    /// The processor must have the features that [`Self::found`] checks.
    pub(super) unsafe fn assume() -> Self {
        Self(())
    }
}

impl Simd for Avx2 {
    type Eight = Eight;
    type Sixteen = Pair<Eight>;

    #[inline(always)]
    fn eight(self) -> Self {
        self
    }
    #[inline(always)]
    fn sixteen(self) -> Self {
        self
    }

    #[inline]
    fn run<J: Job>(self, job: J) -> J::Output {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
        #[inline(never)]
        fn enabled<J: Job>(simd: Avx2, job: J) -> J::Output {
            job.on(simd)
        }
        // SAFETY: a value of this type exists only where these were found.
        unsafe { enabled(self, job) }
    }
}

/// For each byte the positions of its set bits, first to last.
static SET_BITS: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut to) = (0, 0);
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                table[byte][to] = bit as u8;
                to += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    table
};

/// Exists only where an [`Avx2`] does, or was loaded with one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eight(__m256);

/// All bits of a lane, or none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mask8(__m256);

/// Exists only where an [`Avx2`] does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ints8(__m256i);

operators!(Eight: Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps);
operators!(Mask8: BitAnd bitand _mm256_and_ps, BitOr bitor _mm256_or_ps);

impl Mask for Mask8 {
    const COUNT: usize = 8;

    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: the mask exists only where AVX2 was found.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
}

#[inline(always)]
fn load_ints(_: Avx2, values: &[i32]) -> __m256i {
    let values = &values[..8];
    // SAFETY: AVX2 was found, and eight ints lie there.
    unsafe { _mm256_loadu_si256(values.as_ptr().cast()) }
}

impl Lanes for Eight {
    lanes_of_intrinsics!(
        Avx2, Mask8, 8;
        splat _mm256_set1_ps, load _mm256_loadu_ps, store _mm256_storeu_ps, min _mm256_min_ps, max _mm256_max_ps,
        lt _mm256_cmp_ps::<_CMP_LT_OQ>, le _mm256_cmp_ps::<_CMP_LE_OQ>, equal _mm256_cmp_ps::<_CMP_EQ_OQ>
    );
    type Ints = Ints8;

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the vector exists only where AVX2 was found.
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn where_or(self, mask: Mask8, other: Self) -> Self {
        // SAFETY: the vectors exist only where AVX2 was found.
        Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask.0) })
    }
    #[inline(always)]
    fn mask_of(_: Avx2, bits: u32) -> Mask8 {
        // SAFETY: AVX2 was found.
        Mask8(unsafe {
            let lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lanes);
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lanes))
        })
    }
    #[inline(always)]
    fn below(simd: Avx2, values: &[i32], bound: i32) -> Mask8 {
        let values = load_ints(simd, values);
        // SAFETY: AVX2 was found.
        Mask8(unsafe { _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(bound), values)) })
    }
    #[inline(always)]
    fn above(simd: Avx2, values: &[i32], bound: i32) -> Mask8 {
        let values = load_ints(simd, values);
        // SAFETY: AVX2 was found.
        Mask8(unsafe { _mm256_castsi256_ps(_mm256_cmpgt_epi32(values, _mm256_set1_epi32(bound))) })
    }
    #[inline(always)]
    fn tagged(_: Avx2, values: &[u32], bits: u32, tag: u32) -> Ints8 {
        let values = &values[..8];
        // SAFETY: AVX2 was found, and eight ints lie there.
        Ints8(unsafe {
            let values = _mm256_loadu_si256(values.as_ptr().cast());
            let up = _mm256_sll_epi32(values, _mm_cvtsi32_si128(bits as i32));
            _mm256_or_si256(up, _mm256_set1_epi32(tag as i32))
        })
    }
    #[inline(always)]
    fn pack(ints: Ints8, bits: u32, packed: &mut [u32]) {
        let packed = &mut packed[..8];
        let places = u64::from_le_bytes(SET_BITS[bits as usize & 255]);
        // SAFETY: the vector exists only where AVX2 was found, and eight ints fit there.
        unsafe {
            let places = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(places as i64));
            _mm256_storeu_si256(packed.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(ints.0, places));
        }
    }
    #[inline(always)]
    fn pack_lanes(_: Avx2, first: u32, bits: u32, packed: &mut [u32]) {
        let packed = &mut packed[..8];
        let places = u64::from_le_bytes(SET_BITS[bits as usize & 255]);
        // SAFETY: AVX2 was found, and eight ints fit there.
        unsafe {
            let places = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(places as i64));
            let moved = _mm256_add_epi32(places, _mm256_set1_epi32(first as i32));
            _mm256_storeu_si256(packed.as_mut_ptr().cast(), moved);
        }
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        // SAFETY: the vector exists only where AVX2 was found.
        unsafe {
            let four = _mm_min_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let two = _mm_min_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        // SAFETY: the vector exists only where AVX2 was found.
        unsafe {
            let four = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }
}
