//! Sums points by voxel before they are added to the map.

use super::narrow_moments::PackedSums;
use crate::MapError;
use crate::grid::{InVoxel, Lattice, Located, TOGETHER, Window, unpacked};

/// Voxels whose points are summed at a time: 32 KiB, which stay in the first-level cache.
const RECENT: usize = 512;

/// Sums points voxel by voxel before they are added to the map. A sensor's returns within a short time mostly fall into
/// few voxels, whose sums in the map are far away in memory.
///
/// It is direct-mapped: a voxel has one slot, and another voxel in that slot evicts it.
#[derive(Debug)]
pub(crate) struct RecentVoxels {
    recent: Box<[Recent]>,
    /// Entries evicted by a block of points.
    out: Box<[Recent; TOGETHER]>,
    found: Box<Located>,
}

#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
struct Recent {
    sums: PackedSums,
    /// Its number in the window.
    voxel: u64,
}

impl Default for RecentVoxels {
    fn default() -> Self {
        Self {
            recent: vec![Recent::default(); RECENT].into_boxed_slice(),
            out: Box::new([Recent::default(); TOGETHER]),
            found: Box::new(Located { voxels: [0; TOGETHER], offsets: [0; TOGETHER] }),
        }
    }
}

impl RecentVoxels {
    /// Passes on the sums of points by voxels; some voxels come in several parts. The sums of a part are not full.
    ///
    /// # Errors
    /// When a point lies outside the world; earlier points are passed on or dropped.
    #[inline]
    pub(crate) fn add(
        &mut self,
        lattice: &Lattice,
        points_in_world_m: &[[f64; 3]],
        mut part: impl FnMut([u32; 3], PackedSums),
    ) -> Result<(), MapError> {
        let Some(&first) = points_in_world_m.first() else { return Ok(()) };
        let window = Window::around(*lattice, first)?;
        let most_points = PackedSums::most_points(lattice.voxel_units());
        let (blocks, rest) = points_in_world_m.as_chunks::<TOGETHER>();
        for block in blocks {
            if window.locate(block, &mut self.found) {
                let count = self.add_block(most_points);
                for out in self.out.iter().take(count).filter(|out| out.sums.count() > 0) {
                    part(window.voxel(out.voxel), out.sums);
                }
            } else {
                self.add_singly(&window, block, most_points, &mut part)?;
            }
        }
        self.add_singly(&window, rest, most_points, &mut part)?;
        for recent in self.recent.iter_mut().filter(|recent| recent.sums.count() > 0) {
            part(window.voxel(recent.voxel), std::mem::take(&mut recent.sums));
        }
        Ok(())
    }

    /// Adds the located points and returns the number of evicted entries.
    #[inline]
    fn add_block(&mut self, most_points: u32) -> usize {
        let Self { recent, out, found } = self;
        let mut count = 0;
        for (&voxel, &offset) in found.voxels.iter().zip(&found.offsets) {
            // Written in either case: no processor can predict which points evict an entry.
            let out = &mut out[count % TOGETHER];
            let is_out = add_point(recent, voxel, unpacked(offset), most_points, out);
            count += usize::from(is_out);
        }
        count
    }

    /// Adds points at any position, one by one.
    #[cold]
    fn add_singly(
        &mut self,
        window: &Window,
        points_in_world_m: &[[f64; 3]],
        most_points: u32,
        part: &mut impl FnMut([u32; 3], PackedSums),
    ) -> Result<(), MapError> {
        for &point in points_in_world_m {
            let located = window.lattice().in_voxel(point);
            // Nothing may remain for the next call.
            let located = located.inspect_err(|_| self.recent.fill(Recent::default()));
            let InVoxel { voxel, offset_units } = located?;
            if let Some(number) = window.number(voxel) {
                let mut out = Recent::default();
                let is_out = add_point(&mut self.recent, number, offset_units, most_points, &mut out);
                if is_out && out.sums.count() > 0 {
                    part(window.voxel(out.voxel), out.sums);
                }
            } else {
                let mut sums = PackedSums::default();
                sums.add_point(offset_units);
                part(voxel, sums);
            }
        }
        Ok(())
    }
}

/// Adds a point and writes the slot's previous content to `out`. Returns whether that is evicted: it is another voxel,
/// or its sums could become full.
#[inline]
fn add_point(
    recent: &mut [Recent],
    voxel: u64,
    offset_units: [u16; 3],
    most_points: u32,
    out: &mut Recent,
) -> bool {
    let recent = &mut recent[place_of(voxel)];
    *out = *recent;
    let stays = (out.voxel == voxel) & (out.sums.count() < most_points);
    let mut sums = out.sums.only_if(stays);
    sums.add_point(offset_units);
    *recent = Recent { sums, voxel };
    !stays
}

#[inline]
fn place_of(voxel: u64) -> usize {
    (voxel.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (u64::BITS - RECENT.ilog2())) as usize
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::voxels::moments::Moments;
    use crate::voxels::narrow_moments::NarrowMoments;
    use proptest::prelude::*;

    type Sums = BTreeMap<[u32; 3], Moments>;

    fn expected(lattice: &Lattice, points: &[[f64; 3]]) -> Sums {
        let mut sums = Sums::new();
        for &point in points {
            let InVoxel { voxel, offset_units } = lattice.in_voxel(point).unwrap();
            sums.entry(voxel).or_default().add(offset_units.map(u32::from), None);
        }
        sums
    }

    fn summed(recent: &mut RecentVoxels, lattice: &Lattice, points: &[[f64; 3]]) -> (Sums, usize) {
        let (mut sums, mut parts) = (Sums::new(), 0);
        let add = |voxel, part: PackedSums| {
            parts += 1;
            let mut narrow = NarrowMoments::default();
            assert!(!narrow.add(&part, None), "the sums of a part are full");
            sums.entry(voxel).or_default().merge(&narrow.carry());
        };
        recent.add(lattice, points, add).unwrap();
        (sums, parts)
    }

    proptest! {
        #[test]
        fn sums_are_those_of_points_one_by_one(
            voxel_m in 0.05..2.0_f64, origin in prop::array::uniform3(-4.9e7..4.9e7_f64),
            spread_m in prop::sample::select(vec![0.5, 10.0, 1000.0, 9000.0, 1e6]),
            steps in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 0..700),
        ) {
            let lattice = Lattice::new(voxel_m).unwrap();
            let at = |step: [f64; 3]| std::array::from_fn(|k| origin[k] + spread_m * step[k].powi(3));
            let points: Vec<[f64; 3]> = steps.into_iter().map(at).collect();
            let mut recent = RecentVoxels::default();
            for points in [&points[..], &points[points.len() / 3..]] {
                prop_assert_eq!(summed(&mut recent, &lattice, points).0, expected(&lattice, points));
            }
        }
    }

    #[test]
    fn runs_of_points_are_cut_before_their_sums_are_full() {
        for (voxel_m, expected_parts) in [(2.0, 5000 / 8), (0.2, 7), (0.05, 1)] {
            let lattice = Lattice::new(voxel_m).unwrap();
            let points = vec![[voxel_m - 1e-4; 3]; 5000];
            let (sums, parts) = summed(&mut RecentVoxels::default(), &lattice, &points);
            assert_eq!(sums, expected(&lattice, &points));
            assert_eq!(parts, expected_parts, "{voxel_m}");
        }
    }

    #[test]
    fn the_world_ends_where_it_ends() {
        let lattice = Lattice::new(0.2).unwrap();
        let mut recent = RecentVoxels::default();
        let mut points = vec![[5e7 - 1.0, 1.0 - 5e7, 0.0]; 200];
        points[70] = [5e7, -5e7, 0.0];
        assert_eq!(summed(&mut recent, &lattice, &points).0, expected(&lattice, &points));
        points[70][0] = 5e7 + 1.0;
        assert!(recent.add(&lattice, &points, |_, _| ()).is_err());
    }

    #[test]
    fn a_point_outside_the_world_leaves_nothing_behind() {
        let lattice = Lattice::new(0.2).unwrap();
        let mut recent = RecentVoxels::default();
        for outside in [f64::NAN, 6e7, f64::NEG_INFINITY] {
            for at in [0, 40, 199] {
                let mut points = vec![[1.0; 3]; 200];
                points[at][2] = outside;
                assert!(recent.add(&lattice, &points, |_, _| ()).is_err());
            }
            let points = [[1.0; 3], [2.0; 3]];
            assert_eq!(summed(&mut recent, &lattice, &points).0, expected(&lattice, &points));
        }
    }
}
