//! A drive through a city: where the car is at every instant.

use dmp_sensor::Isometry3;

use super::course::Course;
use super::tour::tour;
use crate::city::plan::Plan;
use crate::city::terrain::{Patch, Terrain};
use crate::ways::{CORNER_M, HEIGHT_M, MARGIN_S, START_NS, Stance, Sways, corner, lane, motion};

/// A car's course through a city: its pose at every instant.
#[derive(Debug, Clone)]
pub(crate) struct CityDrive {
    pub(crate) terrain: Terrain,
    course: Course,
    sways: Sways,
    /// When the first scan starts, seconds after the start of the line.
    lead_s: f64,
    pub(crate) duration_s: f64,
    pub(crate) revisited: f64,
}

impl CityDrive {
    /// Over `travel_m` of streets, a `share` of them again.
    pub(crate) fn new(plan: Plan, travel_m: f64, share: f64, speed_m_s: f64) -> Self {
        let lead_m = MARGIN_S * 1.1 * speed_m_s;
        // Curves cut the corners: less than a tenth of the length for blocks of this size.
        let tour = tour(plan, lead_m + travel_m * 1.12 + lead_m, share);
        let course =
            Course::new(&lane(&tour.corners), corner(CORNER_M, 1.0), speed_m_s, &mut plan.random(b'v', &[]));
        let lead_s = course.time_s(lead_m);
        let duration_s = course.time_s(lead_m + travel_m) - lead_s;
        let sways = Sways::of_car(plan.seed);
        Self { terrain: Terrain { plan }, course, sways, lead_s, duration_s, revisited: tour.revisited }
    }

    /// Place on the map, metres.
    pub(crate) fn place(&self, stamp_ns: i64) -> [f64; 2] {
        let at = self.course.at(self.time_s(stamp_ns) + self.lead_s).1;
        [at.x, at.y]
    }

    fn time_s(&self, stamp_ns: i64) -> f64 {
        motion::time_s(stamp_ns, START_NS, self.duration_s)
    }

    /// The body's pose, which is the sensor's, at an instant.
    pub(crate) fn world_from_body_at(&self, stamp_ns: i64) -> Isometry3<f64> {
        self.pose(stamp_ns, |x, y| self.terrain.at(x, y))
    }

    /// The same on a patch of ground that is already computed.
    pub(crate) fn world_from_body_on(&self, ground: &Patch, stamp_ns: i64) -> Isometry3<f64> {
        self.pose(stamp_ns, |x, y| ground.at(x, y))
    }

    fn pose(&self, stamp_ns: i64, ground: impl Fn(f64, f64) -> (f64, [f64; 2])) -> Isometry3<f64> {
        let time_s = self.time_s(stamp_ns);
        let (travel_m, at) = self.course.at(time_s + self.lead_s);
        let on_map = self.sways.on_map(&at, travel_m);
        let (floor_m, slope) = ground(on_map[0], on_map[1]);
        self.sways.pose(on_map, &Stance::on_ground(floor_m, slope, on_map[2]), HEIGHT_M, time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(share: f64) -> CityDrive {
        CityDrive::new(Plan { seed: 2 }, 6000.0, share, 12.0)
    }

    fn places(drive: &CityDrive) -> Vec<[f64; 2]> {
        (0..(drive.duration_s * 10.0) as i64).map(|k| drive.place(START_NS + k * 100_000_000)).collect()
    }

    #[test]
    fn a_road_without_revisits_never_comes_near_itself() {
        let drive = drive(0.0);
        let places = places(&drive);
        let mut travel_m = vec![0.0];
        for pair in places.windows(2) {
            let step_m = libm::hypot(pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
            travel_m.push(travel_m[travel_m.len() - 1] + step_m);
        }
        for n in (0..places.len()).step_by(7) {
            for m in (0..n).step_by(5) {
                let apart_m = libm::hypot(places[n][0] - places[m][0], places[n][1] - places[m][1]);
                assert!(apart_m > 250.0 || travel_m[n] - travel_m[m] < 400.0, "{n} {m}: {apart_m} m");
            }
        }
        assert_eq!(drive.revisited, 0.0);
        assert!((travel_m[travel_m.len() - 1] - 6000.0).abs() < 10.0);
    }

    #[test]
    fn as_much_as_asked_is_driven_again_in_the_same_lane() {
        for share in [0.2, 0.33, 0.6] {
            let places = places(&drive(share));
            let again = (0..places.len()).step_by(10).filter(|&n| {
                let near =
                    |m: &usize| libm::hypot(places[n][0] - places[*m][0], places[n][1] - places[*m][1]) < 1.5;
                (0..n.saturating_sub(150)).any(|m| near(&m))
            });
            let got = again.count() as f64 / (places.len() as f64 / 10.0);
            assert!((got - share).abs() < 0.1, "{share}: {got}");
        }
    }

    #[test]
    fn the_motion_is_smooth_and_twenty_poses_a_second_give_it_to_a_millimetre() {
        let drive = drive(0.3);
        let poses = (-1..2000).map(|k| START_NS + k * 50_000_000);
        let run = poses.map(|t| (t, drive.world_from_body_at(t))).collect();
        let run = dmp_sensor::Trajectory::stamped(run).unwrap().trajectory;
        let place = |k: i64| drive.world_from_body_at(START_NS + k * 20_000_000).translation.vector;
        for k in 0..4900 {
            let acceleration = (place(k + 2) - place(k + 1) * 2.0 + place(k)) / (0.02 * 0.02);
            assert!(acceleration.norm() < 6.0, "{k}: {} m/s2", acceleration.norm());
            let stamp_ns = START_NS + k * 20_000_000 + 13_000_000;
            let (truth, between) =
                (drive.world_from_body_at(stamp_ns), run.world_from_body_at(stamp_ns, i64::MAX).unwrap());
            let off_m = (truth.translation.vector - between.translation.vector).norm();
            assert!(off_m < 2e-3 && truth.rotation.angle_to(&between.rotation) < 5e-4, "{k}: {off_m} m");
        }
    }
}
