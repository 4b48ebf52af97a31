//! Pieces of furniture, each at a place along a wall, of a given width.

use super::fitting::{Fitting, Span};
use super::plan::Face;

/// A kind of furniture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Piece {
    Shelf,
    Cupboard,
    Chest,
    Sofa,
    Desk,
    Plant,
    Lamp,
}

impl Piece {
    pub(super) const HIGH: [Self; 4] = [Self::Shelf, Self::Cupboard, Self::Plant, Self::Lamp];
    /// What fits below a window or a picture.
    pub(super) const LOW: [Self; 3] = [Self::Chest, Self::Sofa, Self::Desk];

    /// Narrowest and widest, metres.
    pub(super) fn width_m(self) -> Span {
        match self {
            Self::Shelf => [0.8, 1.3],
            Self::Cupboard => [0.8, 1.2],
            Self::Chest => [0.8, 1.1],
            Self::Sofa => [1.6, 2.0],
            Self::Desk => [1.2, 1.5],
            Self::Plant | Self::Lamp => [0.45, 0.55],
        }
    }

    pub(super) fn put(self, face: &Face, [a, b]: Span, fitting: &mut Fitting) {
        match self {
            Self::Shelf => shelf(face, [a, b], fitting),
            Self::Cupboard => {
                let height_m = fitting.random.between(1.6, 2.05);
                fitting.dark(|fitting| cupboard(face, [a, b], height_m, fitting));
            }
            Self::Chest => cupboard(face, [a, b], 0.75, fitting),
            Self::Sofa => fitting.dark(|fitting| sofa(face, [a, b], fitting)),
            Self::Desk => desk(face, [a, b], fitting),
            Self::Plant => plant(face.at(f64::midpoint(a, b), 0.3), fitting),
            Self::Lamp => lamp(face.at(f64::midpoint(a, b), 0.25), fitting),
        }
    }
}

/// Sides, a back, boards, and books and boxes on them.
fn shelf(face: &Face, [a, b]: Span, fitting: &mut Fitting) {
    let deep = fitting.random.between(0.26, 0.34);
    let boards = 4 + fitting.random.index(2);
    let rise = 0.36;
    let top = boards as f64 * rise;
    fitting.block(face, [a, a + 0.025], [0.0, deep], [0.0, top]);
    fitting.block(face, [b - 0.025, b], [0.0, deep], [0.0, top]);
    fitting.block(face, [a, b], [0.0, 0.015], [0.0, top]);
    for board in 0..boards {
        let z = 0.06 + board as f64 * rise;
        fitting.block(face, [a, b], [0.0, deep], [z, z + 0.025]);
        let mut at = a + 0.04;
        loop {
            let wide = fitting.random.between(0.08, 0.3);
            if at + wide > b - 0.04 {
                break;
            }
            let (high, off) = (fitting.random.between(0.14, 0.3), fitting.random.between(0.02, 0.1));
            fitting.block(
                face,
                [at, at + wide],
                [0.015, deep - off],
                [z + 0.025, z + 0.025 + high.min(rise - 0.04)],
            );
            at += wide + fitting.random.between(0.02, 0.22);
        }
    }
}

/// A body, two doors that stand out and their knobs.
fn cupboard(face: &Face, [a, b]: Span, height_m: f64, fitting: &mut Fitting) {
    let deep = fitting.random.between(0.42, 0.58);
    let middle = f64::midpoint(a, b);
    fitting.block(face, [a, b], [0.0, deep], [0.0, height_m]);
    for [from, to, knob] in
        [[a + 0.02, middle - 0.01, middle - 0.06], [middle + 0.01, b - 0.02, middle + 0.06]]
    {
        fitting.block(face, [from, to], [deep, deep + 0.02], [0.08, height_m - 0.03]);
        let [x, y] = face.at(knob, deep + 0.035);
        fitting.ball([x, y, height_m * 0.55], 0.022);
    }
    if height_m < 1.0 {
        let at = face.at(a + 0.25, deep / 2.0);
        fitting.cylinder(at, 0.07, [height_m, height_m + 0.24]);
        let turn = face.heading_rad() + fitting.random.between(-0.5, 0.5);
        fitting.turned(face.at(b - 0.25, deep / 2.0), [0.26, 0.19], [height_m, height_m + 0.08], turn);
    }
}

/// A seat, a back, two arms and two cushions.
fn sofa(face: &Face, [a, b]: Span, fitting: &mut Fitting) {
    let deep = 0.72;
    fitting.block(face, [a, b], [0.04, deep], [0.05, 0.4]);
    fitting.block(face, [a, b], [0.04, 0.24], [0.4, 0.78]);
    fitting.block(face, [a, a + 0.18], [0.04, deep], [0.4, 0.58]);
    fitting.block(face, [b - 0.18, b], [0.04, deep], [0.4, 0.58]);
    for at in [a + 0.42, b - 0.45] {
        let turn = face.heading_rad() + fitting.random.between(-0.4, 0.4);
        fitting.turned(face.at(at, 0.36), [0.42, 0.14], [0.4, 0.7], turn);
    }
}

/// A top on four legs, a screen that loses readings, boxes, and a chair.
fn desk(face: &Face, [a, b]: Span, fitting: &mut Fitting) {
    let (deep, top) = (0.62, 0.73);
    fitting.block(face, [a, b], [0.02, deep], [top - 0.03, top]);
    for (along, off) in [(a + 0.06, 0.07), (b - 0.06, 0.07), (a + 0.06, deep - 0.06), (b - 0.06, deep - 0.06)]
    {
        fitting.cylinder(face.at(along, off), 0.025, [0.0, top - 0.03]);
    }
    let middle = f64::midpoint(a, b) + fitting.random.between(-0.15, 0.15);
    fitting.dark(|fitting| {
        fitting.block(face, [middle - 0.28, middle + 0.28], [0.14, 0.18], [top + 0.08, top + 0.42]);
    });
    fitting.block(face, [middle - 0.1, middle + 0.1], [0.1, 0.26], [top, top + 0.08]);
    let turn = face.heading_rad() + fitting.random.between(-0.4, 0.4);
    fitting.turned(face.at(b - 0.22, 0.4), [0.24, 0.17], [top, top + 0.11], turn);
    chair(face.at(middle, deep + 0.16), turn, fitting);
}

/// A seat on four legs, with a low back.
fn chair([x, y]: [f64; 2], yaw: f64, fitting: &mut Fitting) {
    let (sin, cos) = libm::sincos(yaw);
    let at = |u: f64, v: f64| [x + cos * u - sin * v, y + sin * u + cos * v];
    fitting.turned([x, y], [0.42, 0.42], [0.42, 0.46], yaw);
    fitting.turned(at(0.0, 0.19), [0.4, 0.03], [0.5, 0.78], yaw);
    for (u, v) in [(0.17, 0.17), (-0.17, 0.17), (0.17, -0.17), (-0.17, -0.17)] {
        fitting.cylinder(at(u, v), 0.018, [0.0, 0.42]);
    }
}

/// A pot, a stem and leaves in balls.
fn plant([x, y]: [f64; 2], fitting: &mut Fitting) {
    fitting.cylinder([x, y], 0.16, [0.0, 0.34]);
    fitting.cylinder([x, y], 0.02, [0.34, 1.0]);
    for k in 0..6 {
        let random = &mut fitting.random;
        let angle = f64::from(k) * 1.1 + random.between(0.0, 0.6);
        let (radius_m, out) = (random.between(0.09, 0.15), random.between(0.05, 0.12));
        let z = random.between(0.8, 1.45);
        let (sin, cos) = libm::sincos(angle);
        fitting.ball([x + out * cos, y + out * sin, z], radius_m);
    }
}

/// A foot, a stem, a shade.
fn lamp(at: [f64; 2], fitting: &mut Fitting) {
    fitting.cylinder(at, 0.14, [0.0, 0.03]);
    fitting.dark(|fitting| fitting.cylinder(at, 0.015, [0.03, 1.45]));
    fitting.cylinder(at, 0.19, [1.45, 1.75]);
}

/// A low table with things on it, on a rug.
pub(super) fn coffee_table([x, y]: [f64; 2], yaw: f64, fitting: &mut Fitting) {
    let (sin, cos) = libm::sincos(yaw);
    let at = |u: f64, v: f64| [x + cos * u - sin * v, y + sin * u + cos * v];
    fitting.turned([x, y], [2.0, 1.4], [0.0, 0.015], yaw);
    fitting.turned([x, y], [1.1, 0.6], [0.38, 0.42], yaw);
    for (u, v) in [(0.48, 0.23), (-0.48, 0.23), (0.48, -0.23), (-0.48, -0.23)] {
        fitting.turned(at(u, v), [0.05, 0.05], [0.015, 0.38], yaw);
    }
    fitting.cylinder(at(0.3, 0.1), 0.06, [0.42, 0.6]);
    fitting.turned(at(-0.2, -0.05), [0.3, 0.21], [0.42, 0.46], yaw + 0.5);
    fitting.turned(at(-0.2, -0.05), [0.24, 0.17], [0.46, 0.5], yaw + 0.2);
    let [u, v] = at(0.05, 0.15);
    fitting.ball([u, v, 0.48], 0.06);
}
