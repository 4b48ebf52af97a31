//! Macros for the common part of all vector widths: one intrinsic per operation.

/// Operators of a vector or a mask, each of one intrinsic.
macro_rules! operators {
    ($type:ident: $($trait:ident $name:ident $intrinsic:ident),+) => {
        $(impl std::ops::$trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                // SAFETY: the vectors exist only where their instructions were found.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        })+
    };
}
pub(super) use operators;

/// The functions of [`Lanes`](super::simd::Lanes) with one intrinsic each.
macro_rules! lanes_of_intrinsics {
    (
        $simd:ident, $mask:ident, $count:literal;
        splat $splat:ident, load $load:ident, store $store:ident, min $min:ident, max $max:ident,
        lt $lt:path, le $le:path, equal $equal:path
    ) => {
        type Simd = $simd;
        type Mask = $mask;
        const COUNT: usize = $count;

        #[inline(always)]
        fn splat(_: $simd, value: f32) -> Self {
            // SAFETY: the instructions were found.
            Self(unsafe { $splat(value) })
        }
        #[inline(always)]
        fn load(_: $simd, values: &[f32]) -> Self {
            let values = &values[..$count];
            // SAFETY: the instructions were found, and as many floats lie there.
            Self(unsafe { $load(values.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, values: &mut [f32]) {
            let values = &mut values[..$count];
            // SAFETY: the vector exists only where its instructions were found, and as many floats fit there.
            unsafe { $store(values.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            // SAFETY: the vectors exist only where their instructions were found.
            Self(unsafe { $min(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            // SAFETY: the vectors exist only where their instructions were found.
            Self(unsafe { $max(self.0, other.0) })
        }
        #[inline(always)]
        fn lt(self, other: Self) -> $mask {
            // SAFETY: the vectors exist only where their instructions were found.
            $mask(unsafe { $lt(self.0, other.0) })
        }
        #[inline(always)]
        fn le(self, other: Self) -> $mask {
            // SAFETY: the vectors exist only where their instructions were found.
            $mask(unsafe { $le(self.0, other.0) })
        }
        #[inline(always)]
        fn equal(self, other: Self) -> $mask {
            // SAFETY: the vectors exist only where their instructions were found.
            $mask(unsafe { $equal(self.0, other.0) })
        }
    };
}
pub(super) use lanes_of_intrinsics;
