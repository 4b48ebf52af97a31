//! Lengths of pose graphs: of the map of one, and of simulated ones.

/// How the map of a pose graph is grouped, and when a part of it has changed.
#[derive(Debug)]
pub struct LoopMapLengths {
    /// Edge of the columns that the rays of a keyframe are grouped by, metres.
    pub column_m: f64,
    /// Beyond this a surfel makes no difference to the scale of `R_near` by which loops are ranked: the scale, the radius of
    /// a disc, and the cell that a normal comes from, metres.
    pub near_m: f64,
    /// A place where no patch moved more than this is as it was, where nothing else is asked for, metres.
    pub moved_m: f64,
    /// Length of a stretch of the path, metres: keyframes nearer than that to each other see the same surfels, and what a
    /// finer or coarser meeting with voxels does to one it does to the others.
    pub stretch_m: f64,
}

/// How a simulated pose graph is made where nothing else is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulatedLoopLengths {
    /// Travel from one keyframe to the next, metres.
    pub spacing_m: f64,
    /// A turn after which there is a keyframe, too, however short the path, radians; `None` for none.
    pub spacing_rad: Option<f64>,
    /// Standard deviation of a step of one metre of the odometry along each axis, metres.
    pub step_sigma_m: f64,
    /// The same of the rotation about each axis, radians.
    pub step_sigma_rad: f64,
    /// What the odometry turns too far to the left in each metre of travel, radians.
    pub yaw_bias_rad_per_m: f64,
    /// Of its loop candidates.
    pub loops: LoopLengths,
}

/// What counts as one place and as another in a simulated pose graph, and what loop measurements are off by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopLengths {
    /// Keyframes this close to each other are at one place, metres.
    pub same_place_m: f64,
    /// Keyframes farther from each other than this are not, metres.
    pub other_place_m: f64,
    /// Travel between the two keyframes of a loop, at least, metres.
    pub between_m: f64,
    /// By how much a near loop is off before noise: least and most, metres.
    pub near_m: [f64; 2],
    /// Farthest that two places which look alike are measured apart, metres.
    pub alike_within_m: f64,
    /// Error of every loop measurement along each axis: standard deviation, metres.
    pub sigma_m: f64,
    /// What every loop measurement claims to be off by along each axis: standard deviation, metres.
    pub claimed_sigma_m: f64,
    /// Of a camera (z ahead, y down): what of a place it sees. `None` for a body with z up that sees all around.
    pub views: Option<CameraViews>,
}

/// By how much two cameras at one place may be turned from each other, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraViews {
    /// They see the same up to this angle …
    pub same_rad: f64,
    /// … and nothing of what the other sees beyond this one, wherever they are.
    pub other_rad: f64,
}
