//! What a reducer refuses.

/// What a [`Reducer`](crate::Reducer) does not take.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReduceError {
    /// A frame that the layout has no place for.
    #[error("frame {ordinal} of {frames} frames (the first is 0)")]
    NoSuchFrame {
        /// Its place among the frames.
        ordinal: u64,
        /// Frames that there are.
        frames: u64,
    },
    /// A frame that was added already.
    #[error("frame {ordinal} was added twice (the first is 0)")]
    FrameTwice {
        /// Its place among the frames.
        ordinal: u64,
    },
    /// The frame is of other runs than the layout.
    #[error("the frame is of other runs than the reducer")]
    OtherRuns,
    /// Reducers of different layouts cannot be merged.
    #[error("the two reducers have different layouts")]
    OtherLayout,
    /// More returns than the exact sums are made for.
    #[error("more than 2^32 returns in a frame, or 2^44 in all")]
    TooManyReturns,
}
