//! Selects the vector instructions for casting.

#[cfg(target_arch = "x86_64")]
use crate::lanes::{Avx2, Avx512};
use crate::lanes::{Job, Portable, Simd};

/// The vector instructions for casting. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Path(Instructions);

#[derive(Debug, Clone, Copy)]
enum Instructions {
    Portable(Portable),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl PartialEq for Instructions {
    fn eq(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }
}

impl Eq for Instructions {}

impl Path {
    /// Those available on this processor, the fastest first.
    pub fn all() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        let wide = [Avx512::found().map(Instructions::Avx512), Avx2::found().map(Instructions::Avx2)];
        #[cfg(not(target_arch = "x86_64"))]
        let wide: [Option<Instructions>; 0] = [];
        wide.into_iter().flatten().chain([Instructions::Portable(Portable)]).map(Self).collect()
    }

    /// The fastest available on this processor.
    pub fn best() -> Self {
        Self::all()[0]
    }

    /// Its name: `avx512`, `avx2` or `portable`.
    pub fn name(self) -> &'static str {
        match self.0 {
            Instructions::Portable(_) => "portable",
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(_) => "avx512",
        }
    }

    /// Runs a job on this path.
    pub(crate) fn run<J: Job>(self, job: J) -> J::Output {
        match self.0 {
            Instructions::Portable(simd) => simd.run(job),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(simd) => simd.run(job),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(simd) => simd.run(job),
        }
    }
}
