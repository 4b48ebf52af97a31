//! One firing: all beams at once, from one point.

use dmp_sensor::{Isometry3, Vector3};

use crate::city::beams::Beams;
use crate::city::column::{GROUND, Group, LANES, NOTHING};
use crate::city::profile::{Crossing, Profile, refine};
use crate::city::terrain::Patch;

/// The profile lies along one heading; where the sensor is tilted, beams above each other differ in theirs by a
/// degree or two. So much, as a share of the range, the ground may lie outside the step that it was found in.
const SLACK: f64 = 0.02;

/// The beams of one firing, and what they met.
///
/// The ground is first known to within a step of its profile. Only where no form hides it is it looked for.
#[derive(Debug, Clone)]
pub(crate) struct Firing {
    pub(crate) groups: Vec<Group>,
    /// Slope of the ground where a beam met it.
    pub(crate) slopes: Vec<[f64; 2]>,
    /// Where each beam comes below the ground.
    ground: Vec<Option<Below>>,
    profile: Profile,
    max_range_m: f64,
    origin: Vector3<f64>,
    /// The axes of the beams: level at the azimuth, and up.
    axes: [Vector3<f64>; 2],
}

/// Ranges along a beam: it is above the ground at the first, and below it near the second.
#[derive(Debug, Clone, Copy)]
struct Below {
    above_m: f32,
    about_m: f64,
}

impl Firing {
    pub(crate) fn new(beams: &Beams, max_range_m: f64) -> Self {
        Self {
            groups: Vec::with_capacity(beams.group_count()),
            slopes: vec![[0.0; 2]; beams.elevations.len()],
            ground: vec![None; beams.elevations.len()],
            profile: Profile::new(max_range_m),
            max_range_m,
            origin: Vector3::zeros(),
            axes: [Vector3::x(), Vector3::z()],
        }
    }

    /// Aims all beams from a pose, at an azimuth given as sine and cosine. None sees beyond the ground.
    pub(crate) fn aim(
        &mut self,
        pose: &Isometry3<f64>,
        (sin, cos): (f64, f64),
        ground: &Patch,
        beams: &Beams,
    ) {
        let level = pose.rotation * Vector3::new(cos, sin, 0.0);
        let up = pose.rotation * Vector3::z();
        self.origin = pose.translation.vector;
        self.axes = [level, up];
        let flat = libm::hypot(level.x, level.y);
        self.profile.look(ground, self.origin, [level.x / flat, level.y / flat]);
        self.groups.clear();
        let (mut step, mut lowest, mut over) = (0, f64::NEG_INFINITY, false);
        for (number, [rises, shares]) in beams.lanes.iter().enumerate() {
            let beam = [0, 1, 2].map(|k| each(|l| level[k] * shares[l] + up[k] * rises[l]));
            let runs = each(|l| (beam[0][l] * beam[0][l] + beam[1][l] * beam[1][l]).sqrt().max(1e-9));
            let slopes = each(|l| beam[2][l] / runs[l]);
            // Beams that are not there have no range to see anything in.
            let (mut far_m, mut met) = ([0.0; LANES], [NOTHING; LANES]);
            let first = number * LANES;
            for (l, below) in self.ground[first..].iter_mut().take(LANES).enumerate() {
                far_m[l] = self.max_range_m as f32;
                *below = None;
                if slopes[l] < lowest {
                    (step, over) = (0, false);
                }
                lowest = slopes[l];
                if over {
                    continue;
                }
                let Some(Crossing { below: at, before_m, about_m, after_m }) =
                    self.profile.first_below(slopes[l], step)
                else {
                    over = true;
                    continue;
                };
                step = at;
                let per_run = 1.0 / runs[l];
                *below = Some(Below {
                    above_m: (before_m * per_run * (1.0 - SLACK)) as f32,
                    about_m: about_m * per_run,
                });
                far_m[l] = (after_m * per_run * (1.0 + SLACK)).min(self.max_range_m) as f32;
                met[l] = GROUND;
            }
            self.groups.push(Group::new(beam.map(|c| c.map(|c| c as f32)), far_m, met));
        }
    }

    /// Finds the ground where beams met it, or a form that may lie behind it. Where there is none after all,
    /// beams are to be met with the forms again: true where there are such.
    pub(crate) fn settle(&mut self, ground: &Patch, beams: &Beams) -> bool {
        let mut again = false;
        let [level, up] = self.axes;
        for (beam, below) in self.ground.iter().enumerate() {
            let Some(Below { above_m, about_m }) = *below else { continue };
            let (group, l) = (&mut self.groups[beam / LANES], beam % LANES);
            if group.met[l] != GROUND && group.far_m[l] <= above_m {
                continue;
            }
            let (rise, share) = beams.elevations[beam];
            let found = refine(ground, self.origin, level * share + up * rise, about_m);
            match found.filter(|(range_m, _)| *range_m < self.max_range_m) {
                Some((range_m, slope)) if group.met[l] == GROUND || (range_m as f32) < group.far_m[l] => {
                    (group.far_m[l], group.met[l]) = (range_m as f32, GROUND);
                    self.slopes[beam] = slope;
                }
                None if group.met[l] == GROUND => {
                    (group.far_m[l], group.met[l]) = (self.max_range_m as f32, NOTHING);
                    group.farthest_m = self.max_range_m as f32;
                    again = true;
                }
                _ => {}
            }
        }
        again
    }
}

/// A number for each lane.
fn each(of: impl Fn(usize) -> f64) -> [f64; LANES] {
    std::array::from_fn(of)
}
