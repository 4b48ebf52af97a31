//! What an entry of the table holds.

use crate::loops::{LoopMapLengths, SimulatedLoopLengths};

/// The lengths of one kind of recording, and what can be done with it.
#[derive(Debug)]
pub struct Lengths {
    /// The name of the kind, in options and results: that of serde.
    pub name: &'static str,
    /// What a log of it is called in sentences.
    pub recording: &'static str,
    /// How long what is a metre on a drive is here, metres. Lengths that have no field of their own are in proportion to it.
    pub metre_m: f64,

    /// Truncations τ at which `R_cv` is summed, metres, largest first. The first serves the place guard alone, the second is
    /// [`Self::widest_m`].
    pub cv_m: [f64; Self::CV],
    /// Truncations τ at which `R_near` is summed, metres, largest first.
    pub near_m: [f64; Self::NEAR],
    /// A return whose first surfel is crossed this much before the measured range is blocked, metres.
    pub blocked_m: f64,
    /// Edge of the cubes of a map that count as one piece of surface, metres: errors are alike within, and have little in
    /// common beyond (`docs/accuracy.md`).
    pub surface_m: f64,
    /// Units in which the middle, the local and the fine [`Reach`] are given: singular, in words.
    pub reach_units: [&'static str; 3],

    /// Smallest range used where none is asked for, metres.
    pub min_range_m: f64,
    /// Largest range used where none is asked for, metres.
    pub max_range_m: f64,
    /// Voxel edges to choose from by the density of the scans, metres, smallest first.
    pub voxels_m: [f64; 3],
    /// Voxel edge for a given cloud or mesh where none is asked for, metres.
    pub cloud_voxel_m: f64,
    /// Longest segment of the path where no length is asked for, metres. A short path is cut into shorter ones. `None`:
    /// segments are cut by the number of scans.
    pub segment_m: Option<f64>,
    /// Whether a vehicle that carries the sensor is looked for in the scans.
    pub has_vehicle: bool,

    /// Travel to either side within which rays through a surfel show that something moved, metres: later ones may show an
    /// error of the run instead.
    pub pass_m: f64,
    /// Runs are the same where 95 % of their points are this near within a visit, metres. Two draws of white noise of 5 mm in
    /// every pose of a drive are 28 mm apart.
    pub same_within_m: f64,

    /// Of the map of a pose graph.
    pub loop_map: LoopMapLengths,
    /// Of simulated pose graphs and loop candidates.
    pub simulated_loops: SimulatedLoopLengths,
}

impl Lengths {
    /// Number of truncations of `R_cv`.
    pub const CV: usize = 5;
    /// Number of truncations of `R_near`.
    pub const NEAR: usize = 3;
    /// Which of [`Self::cv_m`] is [`Self::widest_m`].
    pub const WIDEST: usize = 1;

    /// The largest scale of `R_cv` that is a score: the one in which a return without an independent crossing has its
    /// price, metres.
    #[inline]
    pub const fn widest_m(&self) -> f64 {
        self.cv_m[Self::WIDEST]
    }

    /// What a truncation at `scale_m` metres sees of two maps.
    pub fn reach(&self, scale_m: f64) -> Reach {
        let [middle, local, fine] = self.reach_units;
        match scale_m / self.metre_m {
            m if m >= 5.0 => Reach::Global,
            m if m >= 1.0 => Reach::Middle(middle),
            m if m >= 0.5 => Reach::Local(local),
            _ => Reach::Fine(fine),
        }
    }
}

/// What a truncation sees of two maps, from errors of the whole down to the sharpness of surfaces, with the unit in which
/// it is given: singular, in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// The map as a whole: 10 and 5 m, in a room 1 and 0.5 m.
    Global,
    /// 2 m, in a room 0.2 m.
    Middle(&'static str),
    /// 0.5 m, in a room 0.05 m.
    Local(&'static str),
    /// 0.2 m, in a room 0.02 m.
    Fine(&'static str),
}
