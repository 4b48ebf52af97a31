//! The scans of a drive through a city.

use std::f64::consts::{PI, TAU};

use dmp_sensor::{Scan, Vector3};

use crate::city::beams::Beams;
use crate::city::blocks::Blocks;
use crate::city::column::{GROUND, LANES, NOTHING};
use crate::city::firing::Firing;
use crate::city::noise::Normal;
use crate::city::view::{Frame, View};
use crate::city::way::CityDrive;
use crate::lidar::Lidar;
use crate::lidar_options::{LidarOptions, Sweep};
use crate::parts::solid::{GROUND_REFLECTIVITY, Hit, Surface};
use crate::random::Random;
use crate::ways::START_NS;

/// The patch of ground reaches this far beyond the range of the sensor, metres.
const BEYOND_M: f64 = 16.0;

/// Measures the scans of a drive through a city.
///
/// All beams of a firing start at one point and lie in one plane. So the forms are sorted once a scan into
/// sectors of the horizon, nearest first, and met with eight beams at a time; the ground is looked at once a
/// firing.
#[derive(Debug, Clone)]
pub(crate) struct Scanner {
    pub(crate) lidar: Lidar,
    beams: Beams,
    normal: Normal,
    rounding: Rounding,
}

/// How coordinates are rounded.
#[derive(Debug, Clone, Copy)]
struct Rounding {
    step_m: f64,
    per_m: f64,
}

impl Rounding {
    /// To multiples of `step_m`; those of zero, or too fine to be seen in a point, are none.
    fn new(step_m: f64) -> Self {
        if step_m < 1e-9 { Self { step_m: 1.0, per_m: 0.0 } } else { Self { step_m, per_m: 1.0 / step_m } }
    }

    fn of(self, point: Vector3<f64>) -> [f32; 3] {
        // Beyond 2⁵² doubles have no fraction: adding this rounds, and subtracting it leaves the whole number.
        const WHOLE: f64 = 1.5 * (1u64 << 52) as f64;
        if self.per_m == 0.0 {
            return point.map(|c| c as f32).into();
        }
        [point.x, point.y, point.z].map(|c| ((c * self.per_m + WHOLE - WHOLE) * self.step_m) as f32)
    }
}

impl Scanner {
    pub(crate) fn new(lidar: Lidar) -> Self {
        let rounding = Rounding::new(lidar.options().resolution_m);
        Self { beams: Beams::new(lidar.elevations()), lidar, normal: Normal::new(), rounding }
    }

    /// Radius around the place of a scan within which blocks must be loaded, metres.
    pub(crate) fn reach_m(&self, speed_m_s: f64) -> f64 {
        self.lidar.options().max_range_m + speed_m_s * 1.2 / self.lidar.options().rate_hz + 1.0
    }

    pub(crate) fn stamp_ns(&self, index: usize) -> i64 {
        self.lidar.stamp_ns(START_NS, index)
    }

    /// Sweep number `index` of a drive.
    pub(crate) fn scan(&self, drive: &CityDrive, blocks: &Blocks, reach_m: f64, index: usize) -> Scan {
        let LidarOptions { azimuth_steps, sweep, max_range_m, rate_hz, .. } = *self.lidar.options();
        let stamp_ns = self.stamp_ns(index);
        let place = drive.place(stamp_ns);
        let ground = drive.terrain.patch(place, reach_m + BEYOND_M);
        let offset_ns = |firing: usize| (1e9 / rate_hz * (firing as f64 / azimuth_steps as f64)) as i64;
        let poses: Vec<_> = match sweep {
            Sweep::Spinning => (0..azimuth_steps)
                .map(|n| drive.world_from_body_on(&ground, stamp_ns + offset_ns(n)))
                .collect(),
            Sweep::Instant => vec![drive.world_from_body_on(&ground, stamp_ns); azimuth_steps],
        };
        let frame = Frame::new(&poses, max_range_m);
        let view = View::new(&frame, blocks.around(place, reach_m), &self.beams);

        let mut scan = Scan { stamp_ns: Some(stamp_ns), ..Scan::default() };
        let most = azimuth_steps * self.beams.elevations.len();
        scan.points_in_sensor_m.reserve_exact(most);
        if sweep == Sweep::Spinning {
            scan.time_offsets_ns.reserve_exact(most);
        }
        let mut firing = Firing::new(&self.beams, max_range_m);
        for (n, pose) in poses.iter().enumerate() {
            let azimuth = libm::sincos(TAU * (n as f64 / azimuth_steps as f64) - PI);
            firing.aim(pose, azimuth, &ground, &self.beams);
            let start = pose.translation.vector - frame.origin;
            let start = [start.x as f32, start.y as f32, start.z as f32];
            let heading = pose.rotation * Vector3::new(azimuth.1, azimuth.0, 0.0);
            let from = |centre: [f32; 3]| [0, 1, 2].map(|k| centre[k] - start[k]);
            let items = view.in_sector(frame.sector(heading));
            let meet = |firing: &mut Firing| {
                for item in items {
                    let [first, last] = item.groups.map(usize::from);
                    for group in &mut firing.groups[first..=last] {
                        if group.farthest_m > item.near_m {
                            let form = &view.seen[item.number as usize].form;
                            group.meet(form, from(form.centre), item.number);
                        }
                    }
                }
            };
            meet(&mut firing);
            // Beams that have met a form meet it again: that changes nothing.
            if firing.settle(&ground, &self.beams) {
                meet(&mut firing);
            }
            let random = Random::new(self.lidar.options().seed, &[b'c'.into(), index as u64, n as u64]);
            self.measure(
                &firing,
                azimuth,
                random,
                |number| (view.seen[number as usize].form, from),
                &mut scan,
            );
            if sweep == Sweep::Spinning {
                scan.time_offsets_ns.resize(scan.points_in_sensor_m.len(), offset_ns(n));
            }
        }
        scan
    }

    /// Turns what the beams met into points.
    fn measure<F: Fn([f32; 3]) -> [f32; 3]>(
        &self,
        firing: &Firing,
        (sin, cos): (f64, f64),
        mut random: Random,
        form: impl Fn(u32) -> (crate::city::form::Form, F),
        scan: &mut Scan,
    ) {
        let options = self.lidar.options();
        let lost_below = (options.drop_out * (1u64 << 24) as f64) as u64;
        let mut aside = Random::new(options.seed, &[b'c'.into(), b'b'.into(), random.word()]);
        for (beam, &(up, level)) in self.beams.elevations.iter().enumerate() {
            // Drawn in any case: what one beam meets does not change the noise of the next.
            let word = random.word();
            let (group, l) = (&firing.groups[beam / LANES], beam % LANES);
            let range_m = f64::from(group.far_m[l]);
            let (cos_incidence, reflectivity) = match group.met[l] {
                NOTHING => (0.0, 0.0),
                GROUND => {
                    let [x, y] = firing.slopes[beam];
                    let d = [0, 1, 2].map(|k| f64::from(group.direction[k][l]));
                    ((x * d[0] + y * d[1] - d[2]) / (1.0 + x * x + y * y).sqrt(), GROUND_REFLECTIVITY)
                }
                number => {
                    let (form, from) = form(number);
                    let cos = group.cos_incidence(l, &form, from(form.centre));
                    (f64::from(cos), f64::from(form.reflectivity))
                }
            };
            let hit = Hit { range_m, cos_incidence, reflectivity, surface: Surface::Ground };
            let seen = (word & 0xff_ffff) >= lost_below && self.lidar.sees(&hit);
            let measured_m = range_m + options.range_noise_m * self.normal.of(word);
            let fired = Vector3::new(level * cos, level * sin, up);
            let reported = self.lidar.reported(fired, &mut aside);
            if seen && measured_m >= options.min_range_m {
                scan.points_in_sensor_m.push(self.rounding.of(reported * measured_m));
            } else {
                scan.points_in_sensor_m.extend(options.no_return.point());
            }
        }
    }
}

#[cfg(test)]
mod tests;
