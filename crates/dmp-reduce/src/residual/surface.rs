//! Pieces of surface, sorted into few groups: returns on one piece err together.

use super::scales::Scales;

/// Groups of surface by which errors are separated.
pub(crate) const GROUPS: usize = 64;

/// The piece of surface that a prediction lies on, as one of 64 groups into which all pieces are sorted by a hash.
///
/// Returns whose rays end on one piece of a map err together, whenever they were measured. A piece is a cube of the
/// map, of [`Lengths::surface_m`](crate::Lengths) along an edge. There may be any number of them; which of
/// them share a group has nothing to do with where they are, so the scatter of the groups is that of the pieces
/// (random groups: Wolter, *Introduction to Variance Estimation*, 2007, chapter 2), in memory that does not grow
/// with the map.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SurfaceGroup(u8);

impl SurfaceGroup {
    /// Where nothing is known of surfaces: all in one group.
    pub const NONE: Self = Self(0);

    /// The group of the piece at a place of the map, metres.
    #[inline]
    pub fn of_place(place_m: [f64; 3], scales: Scales) -> Self {
        let edge_m = scales.lengths().surface_m;
        Self::of_cube(place_m.map(|c| floor(c / edge_m)))
    }

    /// The group of a cube, by its number along each axis.
    #[inline]
    pub fn of_cube([x, y, z]: [i32; 3]) -> Self {
        // 21 bits of each number, and the finaliser of SplitMix64 (Steele, Lea & Flood 2014): neighbours along any axis
        // fall into groups that have nothing in common.
        let bits = |number: i32| u64::from(number as u32 & 0x1f_ffff);
        let mut hash = bits(x) << 42 | bits(y) << 21 | bits(z);
        hash = hash.wrapping_add(0x9e37_79b9_7f4a_7c15);
        hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        Self(((hash ^ (hash >> 31)) % GROUPS as u64) as u8)
    }

    /// The group of a number below their count; of any other one of them.
    #[inline]
    pub(crate) fn of_number(number: u8) -> Self {
        Self(number % GROUPS as u8)
    }

    /// Every group, in order.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..GROUPS as u8).map(Self)
    }

    #[inline]
    pub(crate) fn index(self) -> usize {
        usize::from(self.0) % GROUPS
    }
}

/// `f64::floor` as an integer, which is a call into a library on processors that are not asked for more than the oldest
/// instructions.
#[inline]
pub fn floor(number: f64) -> i32 {
    let truncated = number as i32;
    truncated.saturating_sub(i32::from(f64::from(truncated) > number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_are_those_of_the_library() {
        let least = f64::from(i32::MIN);
        let far = [
            least,
            least - 0.5,
            least + 0.5,
            2e9,
            3e9,
            -3e9,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
            -0.0,
            1e-300,
        ];
        let near = (-4_000..4_000).map(|k| f64::from(k) * 0.25);
        for number in far.into_iter().chain(near.flat_map(|x| [x, x.next_down(), x.next_up()])) {
            assert_eq!(floor(number), number.floor() as i32, "{number}");
        }
    }

    #[test]
    fn cubes_are_spread_evenly_and_neighbours_have_nothing_in_common() {
        let edge = 24;
        let group = |x, y, z| SurfaceGroup::of_cube([x, y, z]).index();
        let mut counts = [0u32; GROUPS];
        let mut together = [0u32; 3];
        for (x, y, z) in
            (-edge..edge).flat_map(|x| (-edge..edge).flat_map(move |y| (-3..3).map(move |z| (x, y, z))))
        {
            counts[group(x, y, z)] += 1;
            for (axis, neighbour) in [[x + 1, y, z], [x, y + 1, z], [x, y, z + 1]].into_iter().enumerate() {
                let [x1, y1, z1] = neighbour;
                together[axis] += u32::from(group(x, y, z) == group(x1, y1, z1));
            }
        }
        let cubes = f64::from(48 * 48 * 6);
        let expected = cubes / GROUPS as f64;
        // χ² of 63 degrees is below 104 in 999 of 1000 cases.
        let chi2: f64 = counts.iter().map(|&n| (f64::from(n) - expected).powi(2) / expected).sum();
        assert!(chi2 < 104.0, "{chi2}");
        for same in together {
            assert!((f64::from(same) - expected).abs() < 5.0 * expected.sqrt(), "{same} of {expected}");
        }
    }
}
