//! Where everything of a scene comes to lie: the common frame of all runs.

use dmp::Scales;
use dmp_draw::{colour_of_size, laid_onto};
use dmp_log::ScenePoint;
use dmp_sensor::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::super::gathered::Gathered;

/// Viewers have 32 bits for a place: what is further off than this is moved by whole kilometres.
const FAR_M: f64 = 10_000.0;
const KILOMETRE_M: f64 = 1_000.0;

/// Where everything comes to lie.
pub(super) struct Placed<'a> {
    pub(super) gathered: &'a Gathered,
    pub(super) names: Vec<&'a str>,
    /// For every run, its world seen from the common frame.
    pub(super) map_from_world: Vec<Isometry3<f64>>,
}

impl Placed<'_> {
    pub(super) fn scales(&self) -> Scales {
        self.gathered.scales
    }

    /// Residuals count up to this, metres: 2, in a room 0.2.
    pub(super) fn cut_m(&self) -> f32 {
        self.scales().lengths().near_m[1] as f32
    }

    /// How much the map of a run is off in a scan, metres.
    pub(super) fn off_m(&self, frame: usize, run: usize) -> Option<f32> {
        self.gathered.frames[frame].scores[run].rms_m(self.scales()).map(|[_, wide_m]| wide_m as f32)
    }

    /// A place in the world of a run.
    pub(super) fn at(&self, run: usize, in_world_m: [f64; 3]) -> [f64; 3] {
        (self.map_from_world[run] * Point3::from(in_world_m)).into()
    }

    /// A point in the common frame, coloured by how much the map is off there.
    pub(super) fn point_in_map(&self, at_m: [f64; 3], residual_m: Option<f32>) -> ScenePoint {
        let colour = colour_of_size(residual_m, self.scales());
        ScenePoint { place_m: at_m.map(|m| m as f32), colour, residual_m }
    }
}

/// The place in the world of the best run that is the origin of the common frame, and the world of every run in that frame.
pub(super) fn common_frame(gathered: &Gathered, runs: usize, best: usize) -> ([f64; 3], Vec<Isometry3<f64>>) {
    let poses_of = |run: usize| gathered.poses.iter().map(|of_runs| of_runs[run]).collect::<Vec<_>>();
    let onto = if runs > 0 { poses_of(best) } else { Vec::new() };
    let first = onto.first().map_or(Vector3::zeros(), |pose| pose.translation.vector);
    let origin = if first.amax() > FAR_M { first.map(round_km) } else { Vector3::zeros() };
    let moved = Isometry3::from_parts(Translation3::from(-origin), UnitQuaternion::identity());
    let of_run = |run: usize| {
        if run == best { moved } else { moved * laid_onto(&poses_of(run), &onto, gathered.scales) }
    };
    (origin.into(), (0..runs).map(of_run).collect())
}

fn round_km(m: f64) -> f64 {
    (m / KILOMETRE_M).round() * KILOMETRE_M
}
