//! The beams of one firing, met with forms eight at a time.

#![expect(
    clippy::needless_range_loop,
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "plain loops over lanes without branches become vector instructions"
)]

use crate::city::form::{Form, FormKind};

/// Beams that are computed side by side.
pub(crate) const LANES: usize = 8;
pub(crate) type Lanes = [f32; LANES];

/// What a beam met when it met none of the forms.
pub(crate) const NOTHING: u32 = u32::MAX;
/// What a beam met when it met the ground.
pub(crate) const GROUND: u32 = u32::MAX - 1;

/// Eight neighbouring beams: their directions, and the nearest thing each has met so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Group {
    pub(crate) direction: [Lanes; 3],
    inverse: [Lanes; 3],
    pub(crate) far_m: Lanes,
    pub(crate) met: [u32; LANES],
    /// The largest of `far_m`.
    pub(crate) farthest_m: f32,
}

/// No component of a direction is nearer to zero than this, so that all can be divided by.
const LEAST: f32 = 1e-9;

fn inverse(components: &Lanes) -> Lanes {
    components.map(|c| 1.0 / if c.abs() < LEAST { LEAST } else { c })
}

/// As `f32::min` and `max`, without their care for NaN.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Group {
    /// Beams along unit vectors that have met nothing yet up to `far_m`.
    pub(crate) fn new(direction: [Lanes; 3], far_m: Lanes, met: [u32; LANES]) -> Self {
        let inverse = [0, 1, 2].map(|k| inverse(&direction[k]));
        let mut group = Self { direction, inverse, far_m, met, farthest_m: 0.0 };
        group.measure();
        group
    }

    fn measure(&mut self) {
        self.farthest_m = self.far_m.iter().copied().fold(0.0, most);
    }

    /// Meets the beams with a form whose centre lies at `centre` from where they start.
    pub(crate) fn meet(&mut self, form: &Form, centre: [f32; 3], number: u32) {
        let met = match form.kind {
            FormKind::Box => self.meet_box(centre, form.half, number),
            FormKind::Turned => self.meet_turned(centre, form, number),
            FormKind::Tube => self.meet_tube(centre, form.half, number),
            FormKind::Ball => self.meet_ball(centre, form.half, number),
        };
        if met {
            self.measure();
        }
    }

    #[inline(always)]
    fn keep(&mut self, ranges_m: &Lanes, number: u32) -> bool {
        let mut met = 0;
        for l in 0..LANES {
            let nearer = ranges_m[l] < self.far_m[l];
            self.far_m[l] = if nearer { ranges_m[l] } else { self.far_m[l] };
            self.met[l] = if nearer { number } else { self.met[l] };
            met += u32::from(nearer);
        }
        met > 0
    }

    #[inline(always)]
    fn meet_box(&mut self, centre: [f32; 3], half: [f32; 3], number: u32) -> bool {
        let inverse = self.inverse;
        let ranges_m = slabs(&inverse, centre, half);
        self.keep(&ranges_m, number)
    }

    fn meet_turned(&mut self, centre: [f32; 3], form: &Form, number: u32) -> bool {
        let turned = turned(&self.direction, form.turn);
        let inverse = [inverse(&turned[0]), inverse(&turned[1]), self.inverse[2]];
        let ranges_m = slabs(&inverse, turned_point(centre, form.turn), form.half);
        self.keep(&ranges_m, number)
    }

    fn meet_tube(&mut self, centre: [f32; 3], half: [f32; 3], number: u32) -> bool {
        let [dx, dy, dz] = &self.direction;
        let [_, _, iz] = &self.inverse;
        let [radius, _, height] = half;
        let outside = centre[0] * centre[0] + centre[1] * centre[1] - radius * radius;
        let mut ranges_m = [f32::INFINITY; LANES];
        for l in 0..LANES {
            let a = dx[l] * dx[l] + dy[l] * dy[l];
            let b = centre[0] * dx[l] + centre[1] * dy[l];
            let beside = centre[0] * dy[l] - centre[1] * dx[l];
            let root = a * radius * radius - beside * beside;
            let side_m = (b - root.max(0.0).sqrt()) / a;
            let z = side_m * dz[l] - centre[2];
            let through_side = (root >= 0.0) & (b > 0.0) & (outside > 0.0) & (z.abs() <= height);
            // Not through the side: through an end, if at all.
            let end = if dz[l] < 0.0 { centre[2] + height } else { centre[2] - height };
            let end_m = end * iz[l];
            let (x, y) = (end_m * dx[l] - centre[0], end_m * dy[l] - centre[1]);
            let through_end = (end_m > 0.0) & (x * x + y * y <= radius * radius);
            let range_m = if through_end { end_m } else { f32::INFINITY };
            ranges_m[l] = if through_side { side_m } else { range_m };
        }
        self.keep(&ranges_m, number)
    }

    fn meet_ball(&mut self, centre: [f32; 3], half: [f32; 3], number: u32) -> bool {
        let scale = half.map(|h| 1.0 / h);
        let c = [0, 1, 2].map(|k| centre[k] * scale[k]);
        let outside = c[0] * c[0] + c[1] * c[1] + c[2] * c[2] > 1.0;
        let mut ranges_m = [f32::INFINITY; LANES];
        for l in 0..LANES {
            let d = [0, 1, 2].map(|k| self.direction[k][l] * scale[k]);
            let a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let b = c[0] * d[0] + c[1] * d[1] + c[2] * d[2];
            let beside = [c[1] * d[2] - c[2] * d[1], c[2] * d[0] - c[0] * d[2], c[0] * d[1] - c[1] * d[0]];
            let root = a - (beside[0] * beside[0] + beside[1] * beside[1] + beside[2] * beside[2]);
            let range_m = (b - root.max(0.0).sqrt()) / a;
            ranges_m[l] = if (root >= 0.0) & (b > 0.0) & outside { range_m } else { f32::INFINITY };
        }
        self.keep(&ranges_m, number)
    }

    /// Cosine between lane `l` and the normal of the form that it met, whose centre lies at `centre`.
    pub(crate) fn cos_incidence(&self, l: usize, form: &Form, centre: [f32; 3]) -> f32 {
        let direction = [0, 1, 2].map(|k| self.direction[k][l]);
        let range_m = self.far_m[l];
        match form.kind {
            FormKind::Box => facing(direction, centre, form.half),
            FormKind::Turned => {
                let [x, y] = [direction[0], direction[1]];
                let [cos, sin] = form.turn;
                let direction = [cos * x + sin * y, cos * y - sin * x, direction[2]];
                facing(direction, turned_point(centre, form.turn), form.half)
            }
            FormKind::Tube => {
                let [x, y, z] = [0, 1, 2].map(|k| range_m * direction[k] - centre[k]);
                // At an end the point lies within the radius, and at half the height.
                if form.half[2] - z.abs() < 1e-4 * (1.0 + range_m)
                    && x * x + y * y < 0.999 * form.half[0] * form.half[0]
                {
                    direction[2].abs()
                } else {
                    -(x * direction[0] + y * direction[1]) / form.half[0]
                }
            }
            FormKind::Ball => {
                let normal =
                    [0, 1, 2].map(|k| (range_m * direction[k] - centre[k]) / (form.half[k] * form.half[k]));
                let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
                -(normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2]) / length
            }
        }
    }
}

/// Where beams enter a box, by its three slabs; infinite where they do not.
#[inline(always)]
fn slabs(inverse: &[Lanes; 3], centre: [f32; 3], half: [f32; 3]) -> Lanes {
    let (mut enter, mut leave) = ([f32::NEG_INFINITY; LANES], [f32::INFINITY; LANES]);
    for k in 0..3 {
        let (low, high) = (centre[k] - half[k], centre[k] + half[k]);
        for l in 0..LANES {
            let (a, b) = (low * inverse[k][l], high * inverse[k][l]);
            enter[l] = most(enter[l], least(a, b));
            leave[l] = least(leave[l], most(a, b));
        }
    }
    for l in 0..LANES {
        enter[l] = if (enter[l] > 0.0) & (enter[l] <= leave[l]) { enter[l] } else { f32::INFINITY };
    }
    enter
}

#[inline(always)]
fn turned(direction: &[Lanes; 3], [cos, sin]: [f32; 2]) -> [Lanes; 2] {
    let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        x[l] = cos * direction[0][l] + sin * direction[1][l];
        y[l] = cos * direction[1][l] - sin * direction[0][l];
    }
    [x, y]
}

fn turned_point([x, y, z]: [f32; 3], [cos, sin]: [f32; 2]) -> [f32; 3] {
    [cos * x + sin * y, cos * y - sin * x, z]
}

/// Cosine of the incidence on the face of a box through which a beam enters.
fn facing(direction: [f32; 3], centre: [f32; 3], half: [f32; 3]) -> f32 {
    let (mut enter, mut cos) = (f32::NEG_INFINITY, 0.0);
    for k in 0..3 {
        let d = if direction[k].abs() < LEAST { LEAST } else { direction[k] };
        let near = (centre[k] - half[k].copysign(d)) / d;
        if near > enter {
            (enter, cos) = (near, direction[k].abs());
        }
    }
    cos
}
