//! Sixteen rays inside one tile, in columns.

use crate::lanes::{Lanes, Mask, Simd};

/// Rays of a packet.
pub(crate) const RAYS: usize = 16;
pub(crate) type Column = [f32; RAYS];

/// Sixteen rays inside one tile: ranges count from the places where they enter it. For inactive rays `to_m` is below
/// `from_m`.
#[derive(Debug, Clone, Default)]
#[repr(align(64))]
pub(crate) struct PacketRays {
    /// From the tile's origin, metres.
    pub(crate) origin_m: [Column; 3],
    pub(crate) direction: [Column; 3],
    pub(crate) measured_m: Column,
    /// The last range that may belong to the measured surface:
    /// [`CastSettings::return_m`](crate::CastSettings::return_m) behind it.
    pub(crate) place_m: Column,
    /// Bounds of the search for crossings.
    pub(crate) from_m: Column,
    pub(crate) to_m: Column,
}

impl PacketRays {
    /// Deactivates all but some rays; returns the active ones.
    #[inline(always)]
    pub(crate) fn limit_to<S: Simd>(&mut self, simd: S, lanes: u32) -> u32 {
        let wide = simd.sixteen();
        let (from, to) = (S::Sixteen::load(wide, &self.from_m), S::Sixteen::load(wide, &self.to_m));
        let goes = from.lt(to) & S::Sixteen::mask_of(wide, lanes);
        to.where_or(goes, from - S::Sixteen::splat(wide, 1.0)).store(&mut self.to_m);
        goes.bits()
    }
}

/// Three columns, of all rays.
#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, columns: &[Column; 3]) -> [S::Sixteen; 3] {
    let wide = simd.sixteen();
    [
        S::Sixteen::load(wide, &columns[0]),
        S::Sixteen::load(wide, &columns[1]),
        S::Sixteen::load(wide, &columns[2]),
    ]
}
