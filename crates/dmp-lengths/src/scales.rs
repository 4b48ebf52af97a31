//! The kinds of recordings, and the table of their lengths.

use crate::lengths::Lengths;
use crate::loops::{CameraViews, LoopLengths, LoopMapLengths, SimulatedLoopLengths};

/// The kind of what is measured, which says by which lengths returns are judged and which defaults go with them.
///
/// The lengths are in proportion to what sensors see. `docs/metric.md` and `docs/paper.md` have the evidence for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scales {
    /// For a LiDAR: `R_cv` at 10, 2, 0.5 and 0.2 m, `R_near` at 5, 2 and 0.5 m.
    #[default]
    Drive,
    /// For depth cameras, a tenth of those: `R_cv` at 1, 0.2, 0.05 and 0.02 m, `R_near` at 0.5, 0.2 and 0.05 m.
    Room,
}

const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// An entry for each kind, in the order of [`Scales`].
const TABLE: &[(Scales, Lengths)] = &[
    (
        Scales::Drive,
        Lengths {
            name: "drive",
            recording: "drive",
            metre_m: 1.0,
            cv_m: [30.0, 10.0, 2.0, 0.5, 0.2],
            near_m: [5.0, 2.0, 0.5],
            blocked_m: 0.5,
            surface_m: 4.0,
            reach_units: ["metre", "decimetre", "centimetre"],
            min_range_m: 1.5,
            max_range_m: 100.0,
            voxels_m: [0.2, 0.3, 0.5],
            cloud_voxel_m: 0.2,
            segment_m: Some(12.0),
            has_vehicle: true,
            pass_m: 66.0,
            same_within_m: 0.04,
            loop_map: LoopMapLengths { column_m: 8.0, near_m: 3.0, moved_m: 0.02, stretch_m: 5.0 },
            // Through streets, with a sensor that sees all around: a drift of some metres in 500 to 800 m.
            simulated_loops: SimulatedLoopLengths {
                spacing_m: 1.0,
                spacing_rad: None,
                step_sigma_m: 0.02,
                step_sigma_rad: 0.03 * RAD_PER_DEG,
                yaw_bias_rad_per_m: 0.006 * RAD_PER_DEG,
                loops: LoopLengths {
                    same_place_m: 8.0,
                    other_place_m: 40.0,
                    between_m: 100.0,
                    near_m: [3.4, 9.6],
                    alike_within_m: 2.0,
                    sigma_m: 0.05,
                    claimed_sigma_m: 0.1,
                    views: None,
                },
            },
        },
    ),
    (
        Scales::Room,
        Lengths {
            name: "room",
            recording: "recording",
            metre_m: 0.1,
            cv_m: [3.0, 1.0, 0.2, 0.05, 0.02],
            near_m: [0.5, 0.2, 0.05],
            blocked_m: 0.05,
            surface_m: 0.4,
            reach_units: ["decimetre", "centimetre", "centimetre"],
            min_range_m: 0.3,
            max_range_m: 10.0,
            voxels_m: [0.02, 0.03, 0.05],
            cloud_voxel_m: 0.02,
            // A camera that is held and turned sees something else without going anywhere.
            segment_m: None,
            // Nobody holds a camera so that a part of themselves is always in view.
            has_vehicle: false,
            pass_m: 6.6,
            same_within_m: 0.004,
            // A tenth of a drive's, to the bit: 3.0 * 0.1 is not 0.3.
            loop_map: LoopMapLengths {
                column_m: 0.8,
                near_m: 3.0 * 0.1,
                moved_m: 0.02 * 0.1,
                stretch_m: 0.5,
            },
            // A walk with a camera in the hand: a drift of some decimetres in 20 m. Near loops are off by 0.15 to 0.6 m with any
            // noise.
            simulated_loops: SimulatedLoopLengths {
                spacing_m: 0.2,
                spacing_rad: Some(15.0 * RAD_PER_DEG),
                step_sigma_m: 0.02,
                step_sigma_rad: 0.3 * RAD_PER_DEG,
                yaw_bias_rad_per_m: 0.1 * RAD_PER_DEG,
                loops: LoopLengths {
                    same_place_m: 0.8,
                    other_place_m: 2.2,
                    between_m: 5.0,
                    near_m: [0.19, 0.56],
                    alike_within_m: 0.2,
                    sigma_m: 0.005,
                    claimed_sigma_m: 0.01,
                    views: Some(CameraViews { same_rad: 30.0 * RAD_PER_DEG, other_rad: 90.0 * RAD_PER_DEG }),
                },
            },
        },
    ),
];

const _: () = {
    let mut index = 0;
    while index < TABLE.len() {
        assert!(TABLE[index].0 as usize == index, "the table has another order than the kinds");
        index += 1;
    }
};

impl Scales {
    /// Every kind with its lengths, in the order of the kinds.
    pub const ALL: &[(Self, Lengths)] = TABLE;

    /// The lengths of this kind.
    #[inline]
    pub const fn lengths(self) -> &'static Lengths {
        &TABLE[self as usize].1
    }

    /// The kind with a name as options and results have it; `None` for any other name.
    pub fn named(name: &str) -> Option<Self> {
        TABLE.iter().find(|(_, lengths)| lengths.name == name).map(|(scales, _)| *scales)
    }

    /// The default for a log: depth cameras are held in rooms, other sensors are driven.
    pub fn of_sensor(is_depth_camera: bool) -> Self {
        if is_depth_camera { Self::Room } else { Self::Drive }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lengths::Reach;
    use serde::Deserialize as _;
    use serde::de::value::{Error, StrDeserializer};

    #[test]
    fn every_kind_has_an_entry_under_its_own_name() {
        let read = |name| Scales::deserialize(StrDeserializer::<Error>::new(name));
        // "unknown variant `none`, expected `drive` or `room`"
        let message = read("none").unwrap_err().to_string();
        let known: Vec<_> = message.split('`').skip(3).step_by(2).collect();
        assert_eq!(known, Scales::ALL.iter().map(|(_, lengths)| lengths.name).collect::<Vec<_>>());
        for (scales, lengths) in Scales::ALL {
            assert_eq!(read(lengths.name).unwrap(), *scales);
            assert_eq!(Scales::named(lengths.name), Some(*scales));
            assert_eq!(scales.lengths().name, lengths.name);
        }
        assert_eq!(Scales::named("auto"), None);
    }

    #[test]
    fn the_lengths_of_every_kind_are_in_order() {
        for (_, lengths) in Scales::ALL {
            assert!(lengths.cv_m.is_sorted_by(|a, b| a > b) && lengths.near_m.is_sorted_by(|a, b| a > b));
            assert!(lengths.voxels_m.is_sorted_by(|a, b| a < b) && lengths.min_range_m < lengths.max_range_m);
            assert_eq!(lengths.metre_m, lengths.widest_m() / Scales::Drive.lengths().widest_m());
            assert_eq!(lengths.surface_m, 4.0 * lengths.metre_m);
            let reaches = lengths.cv_m.map(|m| lengths.reach(m));
            let [middle, local, fine] = lengths.reach_units;
            let (middle, local, fine) = (Reach::Middle(middle), Reach::Local(local), Reach::Fine(fine));
            assert_eq!(reaches, [Reach::Global, Reach::Global, middle, local, fine]);
        }
    }
}
