//! Updates z1, zn and zc for rays that are cast one by one.

use dmp_map::Independence;

use crate::lanes::{Lanes, Simd};
use crate::within::{Column, Node, PacketAnswers, PacketRays, RAYS, Search, TileView, each_hit};

/// z1 only: the rays' bounds must not exceed the best so far.
pub(crate) struct First<'a>(pub(crate) &'a mut Column);

impl Search for First<'_> {
    #[inline(always)]
    fn take<S: Simd>(
        &mut self,
        simd: S,
        lane: usize,
        _: usize,
        ranges_m: S::Sixteen,
        hits: <S::Sixteen as Lanes>::Mask,
    ) {
        let none = S::Sixteen::splat(simd.sixteen(), f32::INFINITY);
        let first_m = ranges_m.where_or(hits, none).smallest();
        self.0[lane] = self.0[lane].min(first_m);
    }
}

/// z1, zn and zc.
pub(crate) struct Three<'a> {
    tile: &'a TileView<'a>,
    rays: &'a PacketRays,
    independence: Option<Independence>,
    revisit: Option<Independence>,
    /// The best so far: bounds for further crossings.
    answers: &'a mut PacketAnswers,
    /// Bounds of a crossing that may be the nearest.
    window_m: [Column; 2],
}

impl<'a> Three<'a> {
    #[inline(always)]
    pub(crate) fn new(
        tile: &'a TileView<'a>,
        rays: &'a PacketRays,
        [independence, revisit]: [Option<Independence>; 2],
        answers: &'a mut PacketAnswers,
    ) -> Self {
        let mut window_m = [[0.0; RAYS]; 2];
        for lane in 0..RAYS {
            window_m[0][lane] = rays.measured_m[lane] - answers.gap_m[lane];
            window_m[1][lane] = rays.measured_m[lane] + answers.gap_m[lane];
        }
        Self { tile, rays, independence, revisit, answers, window_m }
    }
}

impl Search for Three<'_> {
    #[inline(always)]
    fn children<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        node: &Node,
        enter_m: S::Eight,
        leave_m: S::Eight,
    ) -> <S::Eight as Lanes>::Mask {
        let eight = simd.eight();
        let first = enter_m.lt(S::Eight::splat(eight, self.answers.first_m[lane]));
        let nearest = enter_m.le(S::Eight::splat(eight, self.window_m[1][lane]))
            & S::Eight::splat(eight, self.window_m[0][lane]).le(leave_m);
        let mut wanted = first | nearest;
        if let Some(independence) = self.independence {
            let nearer = enter_m.lt(S::Eight::splat(eight, self.answers.independent_m[lane]));
            wanted = wanted | (nearer & node.may_hold(simd, independence));
        }
        if let (0, Some(revisit)) = (self.answers.revisited >> lane & 1, self.revisit) {
            let at_place = enter_m.le(S::Eight::splat(eight, self.rays.place_m[lane]));
            wanted = wanted | (at_place & node.may_hold(simd, revisit));
        }
        wanted
    }

    #[inline(always)]
    fn take<S: Simd>(
        &mut self,
        _: S,
        lane: usize,
        leaf: usize,
        ranges_m: S::Sixteen,
        hits: <S::Sixteen as Lanes>::Mask,
    ) {
        each_hit(ranges_m, hits, |disc, range_m| self.take_one(lane, leaf, disc, range_m));
    }
}

impl Three<'_> {
    #[inline(always)]
    fn take_one(&mut self, lane: usize, leaf: usize, disc: usize, range_m: f32) {
        let answers = &mut *self.answers;
        answers.first_m[lane] = answers.first_m[lane].min(range_m);
        let gap_m = (range_m - self.rays.measured_m[lane]).abs();
        let (nearest_m, least_m) = (&mut answers.nearest_m[lane], &mut answers.gap_m[lane]);
        if gap_m < *least_m || (gap_m == *least_m && range_m < *nearest_m) {
            (*nearest_m, *least_m) = (range_m, gap_m);
        }
        let [low, high] = self.tile.support[leaf].of(disc);
        let holds = |independence: Option<Independence>| independence.is_some_and(|i| i.holds(low, high));
        if range_m < answers.independent_m[lane] && holds(self.independence) {
            answers.independent_m[lane] = range_m;
        }
        let at_place = range_m <= self.rays.place_m[lane];
        answers.revisited |= u32::from(at_place && holds(self.revisit)) << lane;
    }
}
