//! The path of every processor: SSE2 on x86-64, plain code elsewhere.

use super::pair::Pair;
use super::portable::Portable;
use super::simd::{Job, Simd};

#[cfg(target_arch = "x86_64")]
type Best = super::sse2::Four;
#[cfg(not(target_arch = "x86_64"))]
type Best = super::portable::Four;

impl Simd for Portable {
    type Eight = Pair<Best>;
    type Sixteen = Pair<Pair<Best>>;

    #[inline(always)]
    fn eight(self) -> Self {
        self
    }
    #[inline(always)]
    fn sixteen(self) -> Self {
        self
    }

    #[inline(never)]
    fn run<J: Job>(self, job: J) -> J::Output {
        job.on(self)
    }
}
