//! Two visits of one street, simulated.

use dmp_map::{Lattice, PatchBuilder};
use dmp_sensor::{Isometry3, Track, Translation3, UnitQuaternion, Vector3};
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route};

use crate::align::{Alignment, Pyramid};

pub(crate) const VOXEL_M: f64 = 0.5;

pub(crate) fn pyramid(points: impl IntoIterator<Item = [f64; 3]>) -> Pyramid {
    let mut patch = PatchBuilder::new(Lattice::new(VOXEL_M).unwrap());
    patch.add(&points.into_iter().collect::<Vec<_>>()).unwrap();
    Pyramid::new(&patch)
}

pub(crate) fn turned(yaw_rad: f64, shift_m: [f64; 3]) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad);
    Isometry3::from_parts(Translation3::from(Vector3::from(shift_m)), rotation)
}

pub(crate) fn moved(by: &Isometry3<f64>, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    points.iter().map(|&point| (by * nalgebra::Point3::from(point)).into()).collect()
}

/// Returns of every other scan of a drive along a street, from the first or from the second, in the frame of the place.
pub(crate) fn visits(seed: u64) -> [Vec<[f64; 3]>; 2] {
    let lidar = LidarOptions { azimuth_steps: 450, ..LidarOptions::with_beams(16) };
    let options =
        RecordingOptions { seed, scans: 40, route: Route::OneWay, speed_m_s: 8.0, traffic: 0, lidar };
    let town = options.town().unwrap();
    let recording = Recording::new(&town, &options).unwrap();
    let truth = recording.drive().trajectory(50.0).unwrap();
    let track = Track::new(&truth, Isometry3::identity(), 1_000_000_000);
    let place = recording.drive().world_from_body_at(recording.drive().options().start_ns + 2_000_000_000);
    let mut visits = [Vec::new(), Vec::new()];
    for (number, scan) in recording.scans().enumerate() {
        for (k, point) in scan.points_in_sensor_m.iter().enumerate() {
            let at_ns = scan.stamp_ns.unwrap() + scan.time_offsets_ns.get(k).copied().unwrap_or(0);
            let Some(world_from_sensor) = track.world_from_sensor_at(at_ns) else { continue };
            let in_sensor = nalgebra::Point3::from(point.map(f64::from));
            let in_place = place.inverse() * (world_from_sensor * in_sensor);
            if in_place.coords.norm() < 40.0 {
                visits[number % 2].push(in_place.into());
            }
        }
    }
    visits
}

/// How far the motion is from `expected` at the place, metres and radians.
pub(crate) fn off(found: &Alignment, expected: &Isometry3<f64>) -> (f64, f64) {
    let between = found.target_from_source * expected.inverse();
    (between.translation.vector.norm(), between.rotation.angle())
}
