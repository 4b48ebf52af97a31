use dmp_sensor::{Isometry3, Vector3};

use super::RAD_PER_DEG;

/// What counts as one place and as another, and what loop measurements are off by: of a drive, or of a walk through
/// a room.
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
    /// What every loop measurement is off by along each axis, and what it claims, standard deviations in metres.
    pub sigma_m: f64,
    /// See there.
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

impl LoopLengths {
    /// A drive through streets, with a sensor that sees all around.
    pub const DRIVE: Self = Self {
        same_place_m: 8.0,
        other_place_m: 40.0,
        between_m: 100.0,
        near_m: [3.4, 9.6],
        alike_within_m: 2.0,
        sigma_m: 0.05,
        claimed_sigma_m: 0.1,
        views: None,
    };

    /// A walk through a room with a camera: about a tenth. Near loops are off by 0.15 to 0.6 m with any noise.
    pub const ROOM: Self = Self {
        same_place_m: 0.8,
        other_place_m: 2.2,
        between_m: 5.0,
        near_m: [0.19, 0.56],
        alike_within_m: 0.2,
        sigma_m: 0.005,
        claimed_sigma_m: 0.01,
        views: Some(CameraViews { same_rad: 30.0 * RAD_PER_DEG, other_rad: 90.0 * RAD_PER_DEG }),
    };

    /// Whether two poses are at one place, and look at the same things.
    pub(super) fn are_one(&self, a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
        let views = self.views.is_none_or(|views| a.rotation.angle_to(&b.rotation) <= views.same_rad);
        apart_m(a, b) <= self.same_place_m && views
    }

    /// Whether two poses are at places far apart, or look at other things.
    pub(super) fn are_others(&self, a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
        let views = self.views.is_some_and(|views| a.rotation.angle_to(&b.rotation) > views.other_rad);
        apart_m(a, b) > self.other_place_m || views
    }

    /// Which way is up in the body, and ahead.
    pub(super) fn up_and_ahead(&self) -> [Vector3<f64>; 2] {
        if self.views.is_some() { [-Vector3::y(), Vector3::z()] } else { [Vector3::z(), Vector3::x()] }
    }
}

fn apart_m(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.translation.vector - b.translation.vector).norm()
}
