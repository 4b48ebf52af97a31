//! A furnished room, and what a ray meets in it.

use dmp_sensor::Vector3;

use super::fitting::{Fitting, Solid};
use super::plan::{Plan, RoomOptions};
use super::{furnish, walls};
use crate::error::{SimError, require};

/// What a ray met in a room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoomHit {
    /// Range from the ray's origin, metres.
    pub range_m: f64,
    /// Outward unit normal of the surface there.
    pub normal: Vector3<f64>,
}

/// A furnished room: walls with doors, windows and an alcove, a corner that is cut out or a wall that divides it,
/// and furniture along them, all of boxes, cylinders and spheres. It lies in the world frame, x east, y north, z up;
/// its floor is z = 0 and its south-western corner (0, 0).
#[derive(Debug, Clone)]
pub struct Room {
    pub(super) options: RoomOptions,
    pub(super) solids: Vec<Solid>,
    /// Of each solid: the lower and upper corner of the smallest box along the axes around it.
    pub(super) bounds: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl Room {
    /// Builds and furnishes the room: the same options give the same room, to the bit.
    ///
    /// # Errors
    /// When it is smaller than 5 × 4.5 × 2.3 m or larger than 12 × 12 × 5 m.
    pub fn new(options: RoomOptions) -> Result<Self, SimError> {
        let [width, depth, height] = options.size_m;
        require((5.0..=12.0).contains(&width), "the width of the room in m", "from 5 to 12", width)?;
        require((4.5..=12.0).contains(&depth), "the depth of the room in m", "from 4.5 to 12", depth)?;
        require((2.3..=5.0).contains(&height), "the height of the room in m", "from 2.3 to 5", height)?;
        let plan = Plan::new(&options);
        let mut fitting = Fitting::new(options.seed);
        walls::build(&plan, &mut fitting);
        furnish::furnish(&plan, &mut fitting);
        let solids = fitting.solids;
        let bounds = solids.iter().map(|solid| solid.shape.bounds()).collect();
        Ok(Self { options, solids, bounds })
    }

    /// The numbers it was built from.
    pub fn options(&self) -> &RoomOptions {
        &self.options
    }

    /// Number of boxes, cylinders and spheres it is built of.
    pub fn solids(&self) -> usize {
        self.solids.len()
    }

    /// The first surface from `origin` along the unit vector `direction`. `None` for rays from outside
    /// that pass by; from within, every ray meets a surface. A solid that the origin lies in is not seen.
    /// `O(solids)`.
    pub fn cast(&self, origin: Vector3<f64>, direction: Vector3<f64>) -> Option<RoomHit> {
        let entries = self.solids.iter().filter_map(|solid| solid.shape.entry(origin, direction));
        let nearest = entries.min_by(|a, b| a.range_m.total_cmp(&b.range_m))?;
        Some(RoomHit { range_m: nearest.range_m, normal: nearest.normal })
    }
}
