//! Eight or sixteen numbers at once, on three paths that give the same bits.
//!
//! Every operation here is one IEEE operation per lane, on every path: no fused multiply-add, no approximation. So code
//! written with [`Lanes`] gives the same bits on all of them.
//!
//! A vector can only be made with a [`Simd`]. A `Simd` that needs a processor's features is only made where they were
//! detected: so its operations are safe to call.
//!
//! A function that holds vectors must be inlined into one that is compiled for the path's instructions, down to the
//! last of them. Closures cannot be forced to inline: none here holds vectors.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod baseline;
mod fetch;
mod pair;
mod portable;
mod simd;
#[cfg(target_arch = "x86_64")]
mod sse2;
#[cfg(target_arch = "x86_64")]
mod vector;

#[cfg(target_arch = "x86_64")]
pub(crate) use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) use avx512::Avx512;
pub(crate) use fetch::fetch;
pub(crate) use portable::Portable;
pub(crate) use simd::{Job, Lanes, Mask, Simd, dot};

#[cfg(test)]
mod tests;
