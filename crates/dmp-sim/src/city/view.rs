//! Which forms the firings of one scan may meet: lists by sector of the horizon, nearest first.

use dmp_sensor::{Isometry3, Vector3};

use crate::city::beams::Beams;
use crate::city::blocks::{Block, Cluster};
use crate::city::form::Form;

/// Sectors of the horizon.
const SECTORS: usize = 512;
/// Forms are sorted by distance in steps of this, metres.
const STEP_M: f32 = 0.25;

/// A form in reach of a scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    /// Its centre is relative to the origin of the view.
    pub(crate) form: Form,
    near_m: f32,
    groups: [u8; 2],
    sectors: [u16; 2],
}

/// A form in the list of a sector.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Item {
    pub(crate) number: u32,
    /// It is no nearer than this to any of the scan's firings, metres.
    pub(crate) near_m: f32,
    /// First and last group of beams that may meet it.
    pub(crate) groups: [u8; 2],
}

/// How the firings of a scan lie to each other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    /// The origin of forms: a place amid those of the firings.
    pub(crate) origin: Vector3<f64>,
    /// Turns the world's axes into those of the sensor but for its heading.
    level_from_world: [[f32; 3]; 3],
    /// No firing is farther from the origin, metres, or tilted more, radians.
    moved_m: f32,
    tilted_rad: f32,
    max_range_m: f32,
}

impl Frame {
    /// Around the poses of the firings.
    pub(crate) fn new(poses: &[Isometry3<f64>], max_range_m: f64) -> Self {
        let middle = poses[poses.len() / 2];
        let ahead = middle.rotation * Vector3::x();
        let length = libm::hypot(ahead.x, ahead.y);
        let (cos, sin) = (ahead.x / length, ahead.y / length);
        let up = middle.rotation * Vector3::z();
        let (mut moved_m, mut tilted_rad) = (0.0, 0.0);
        for pose in poses {
            moved_m = f64::max(moved_m, (pose.translation.vector - middle.translation.vector).norm());
            tilted_rad = f64::max(tilted_rad, (pose.rotation * Vector3::z() - up).norm());
        }
        let sensor_from_world = middle.rotation.inverse().to_rotation_matrix();
        let m = sensor_from_world.matrix();
        let row = |a: f64, b: f64| [0, 1, 2].map(|k| (a * m[(0, k)] + b * m[(1, k)]) as f32);
        Self {
            origin: middle.translation.vector,
            level_from_world: [row(cos, -sin), row(sin, cos), [0, 1, 2].map(|k| m[(2, k)] as f32)],
            moved_m: moved_m as f32 * 1.01 + 0.01,
            tilted_rad: tilted_rad as f32 * 1.1 + 1e-3,
            max_range_m: max_range_m as f32,
        }
    }

    /// The sector of a direction in the world.
    pub(crate) fn sector(&self, direction: Vector3<f64>) -> usize {
        let d = direction.map(|c| c as f32);
        let [x, y, _] = self.level([d.x, d.y, d.z]);
        sector(x, y) as usize
    }

    fn level(&self, v: [f32; 3]) -> [f32; 3] {
        self.level_from_world.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// The sectors, beams and least range of a box; `None` where no beam can meet it.
    fn sees(&self, centre: [f32; 3], reach: [f32; 3], beams: &Beams) -> Option<([u16; 2], [u8; 2], f32)> {
        let gap = [0, 1].map(|k| (centre[k].abs() - reach[k] - self.moved_m).max(0.0));
        let range_m = self.max_range_m;
        if gap[0] * gap[0] + gap[1] * gap[1] > range_m * range_m {
            return None;
        }
        let far_m = centre[0].abs() + reach[0] + centre[1].abs() + reach[1] + centre[2].abs() + reach[2];
        let slack_m = self.moved_m + self.tilted_rad * far_m;
        let centre = self.level(centre);
        let reach = self
            .level_from_world
            .map(|row| row[0].abs() * reach[0] + row[1].abs() * reach[1] + row[2].abs() * reach[2] + slack_m);
        let (low, high) = ([0, 1, 2].map(|k| centre[k] - reach[k]), [0, 1, 2].map(|k| centre[k] + reach[k]));
        let gap = [0, 1, 2].map(|k| low[k].max(-high[k]).max(0.0));
        let level = gap[0] * gap[0] + gap[1] * gap[1];
        let near_m = (level + gap[2] * gap[2]).sqrt();
        if near_m > range_m {
            return None;
        }
        let farthest = [0, 1].map(|k| high[k].max(-low[k]));
        let (nearest, farthest) =
            (level.sqrt().max(1e-3), (farthest[0] * farthest[0] + farthest[1] * farthest[1]).sqrt());
        let slope = |z: f32, outward: bool| z / if outward { nearest } else { farthest };
        let groups = beams.groups(slope(low[2], low[2] < 0.0), slope(high[2], high[2] > 0.0))?;
        Some((sectors([low[0], high[0]], [low[1], high[1]]), groups, near_m))
    }
}

/// A number that grows with the angle from the x axis counter-clockwise, from 0 to 4 in a full turn.
fn diamond(x: f32, y: f32) -> f32 {
    let u = x / (x.abs() + y.abs()).max(1e-30);
    if y >= 0.0 { 1.0 - u } else { 3.0 + u }
}

fn sector(x: f32, y: f32) -> u16 {
    ((diamond(x, y) * (SECTORS as f32 / 4.0)) as usize % SECTORS) as u16
}

/// First and last sector, counter-clockwise, in which a rectangle is seen from the origin.
fn sectors([west, east]: [f32; 2], [south, north]: [f32; 2]) -> [u16; 2] {
    let (first, last) = if west > 0.0 {
        ([if south < 0.0 { west } else { east }, south], [if north > 0.0 { west } else { east }, north])
    } else if east < 0.0 {
        ([if north > 0.0 { east } else { west }, north], [if south < 0.0 { east } else { west }, south])
    } else if south > 0.0 {
        ([east, south], [west, south])
    } else if north < 0.0 {
        ([west, north], [east, north])
    } else {
        return [0, SECTORS as u16 - 1];
    };
    // One sector more on either side: where the arithmetic rounds, a corner may lie in the next.
    let (first, last) = (sector(first[0], first[1]), sector(last[0], last[1]));
    [(first + SECTORS as u16 - 1) % SECTORS as u16, (last + 1) % SECTORS as u16]
}

/// The forms in reach of a scan.
#[derive(Debug, Clone, Default)]
pub(crate) struct View {
    /// Nearest first.
    pub(crate) seen: Vec<Seen>,
    /// `items[starts[s]..starts[s + 1]]` are the forms of sector `s`, nearest first.
    starts: Vec<u32>,
    items: Vec<Item>,
}

impl View {
    /// What of the blocks the beams may meet.
    pub(crate) fn new<'a>(frame: &Frame, blocks: impl Iterator<Item = &'a Block>, beams: &Beams) -> Self {
        let mut seen = Vec::new();
        for block in blocks {
            let offset =
                [block.corner[0] - frame.origin.x, block.corner[1] - frame.origin.y, -frame.origin.z];
            let offset = offset.map(|c| c as f32);
            for Cluster { centre, reach, forms } in &block.clusters {
                let from = |c: [f32; 3]| [0, 1, 2].map(|k| c[k] + offset[k]);
                if frame.sees(from(*centre), *reach, beams).is_none() {
                    continue;
                }
                for form in forms {
                    let centre = from(form.centre);
                    if let Some((sectors, groups, near_m)) = frame.sees(centre, form.reach, beams) {
                        seen.push(Seen { form: Form { centre, ..*form }, near_m, groups, sectors });
                    }
                }
            }
        }
        Self::sorted(&seen, frame.max_range_m)
    }

    fn sorted(unsorted: &[Seen], max_range_m: f32) -> Self {
        let step = |near_m: f32| (near_m / STEP_M) as usize;
        let order = counting_sort(unsorted.len(), step(max_range_m) + 1, |k| step(unsorted[k].near_m));
        let seen: Vec<Seen> = order.into_iter().map(|k| unsorted[k as usize]).collect();
        let mut starts = vec![0; SECTORS + 1];
        let spans = |[first, last]: [u16; 2]| {
            let count = (usize::from(last) + SECTORS - usize::from(first)) % SECTORS + 1;
            (0..count).map(move |k| (usize::from(first) + k) % SECTORS)
        };
        for form in &seen {
            spans(form.sectors).for_each(|sector| starts[sector + 1] += 1);
        }
        for sector in 0..SECTORS {
            starts[sector + 1] += starts[sector];
        }
        let mut next = starts.clone();
        let mut items = vec![Item::default(); starts[SECTORS] as usize];
        for (number, form) in seen.iter().enumerate() {
            spans(form.sectors).for_each(|sector| {
                items[next[sector] as usize] =
                    Item { number: number as u32, near_m: form.near_m, groups: form.groups };
                next[sector] += 1;
            });
        }
        Self { seen, starts, items }
    }

    /// The forms that may be met in a sector, nearest first.
    pub(crate) fn in_sector(&self, sector: usize) -> &[Item] {
        &self.items[self.starts[sector] as usize..self.starts[sector + 1] as usize]
    }
}

/// The numbers below `count` in the order of their keys, which are below `keys`; equal ones as they were.
fn counting_sort(count: usize, keys: usize, key: impl Fn(usize) -> usize) -> Vec<u32> {
    let mut starts = vec![0u32; keys + 1];
    (0..count).for_each(|k| starts[key(k) + 1] += 1);
    for k in 0..keys {
        starts[k + 1] += starts[k];
    }
    let mut order = vec![0; count];
    for k in 0..count {
        let at = &mut starts[key(k)];
        order[*at as usize] = k as u32;
        *at += 1;
    }
    order
}
