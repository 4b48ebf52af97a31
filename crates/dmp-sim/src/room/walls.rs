//! Floor, ceiling and walls of a room, with doors, windows and alcoves.

use dmp_sensor::Vector3;

use super::fitting::Fitting;
use super::plan::{Block, DEEPEST_M, Face, Plan, Recess, RecessKind};
use crate::parts::shape::Shape;

/// Behind the faces of walls, floor and ceiling, metres: more than anything is set back.
const THICK_M: f64 = DEEPEST_M + 0.3;
/// Width and depth of the bars of a window, and of the frame of a door.
const BAR_M: [f64; 2] = [0.06, 0.05];

/// Floor, ceiling, walls, and what is built into them.
pub(super) fn build(plan: &Plan, fitting: &mut Fitting) {
    let [w, d, h] = plan.size_m;
    let slab = |low: f64, high: f64| {
        Shape::upright(Vector3::new(-THICK_M, -THICK_M, low), Vector3::new(w + THICK_M, d + THICK_M, high))
    };
    fitting.put(slab(-THICK_M, 0.0));
    fitting.put(slab(h, h + THICK_M));
    for face in plan.faces.iter().filter(|face| face.outer) {
        wall(face, plan.size_m, fitting);
    }
    if let Block::Corner([a, b]) | Block::Divider([a, b]) = plan.block {
        fitting.put(Shape::upright(Vector3::new(a[0], a[1], 0.0), Vector3::new(b[0], b[1], h)));
    }
}

/// A wall in columns: whole ones beside what is set back, and what lies below, above and behind it.
fn wall(face: &Face, [width_m, depth_m, height_m]: [f64; 3], fitting: &mut Fitting) {
    let whole = [-THICK_M, 0.0];
    // At the corners of the room walls reach beyond each other. Elsewhere something stands before their ends.
    let corner = |[x, y]: [f64; 2]| (x == 0.0 || x == width_m) && (y == 0.0 || y == depth_m);
    let beyond = |along_m: f64| if corner(face.at(along_m, 0.0)) { THICK_M } else { 0.0 };
    let mut from = -beyond(0.0);
    for recess in &face.recesses {
        let [a, b] = recess.along_m;
        let [low, high] = recess.height_m;
        fitting.block(face, [from, a], whole, [0.0, height_m]);
        if low > 0.0 {
            fitting.block(face, [a, b], whole, [0.0, low]);
        }
        fitting.block(face, [a, b], whole, [high, height_m]);
        let behind = [-THICK_M, -recess.depth_m];
        match recess.kind {
            RecessKind::Window => {
                fitting.dark(|fitting| fitting.block(face, [a, b], behind, recess.height_m));
            }
            _ => fitting.block(face, [a, b], behind, recess.height_m),
        }
        detail(face, recess, fitting);
        from = b;
    }
    fitting.block(face, [from, face.length_m + beyond(face.length_m)], whole, [0.0, height_m]);
}

/// Bars and a sill, panels and a knob, or a board.
fn detail(face: &Face, recess: &Recess, fitting: &mut Fitting) {
    let Recess { kind, along_m: [a, b], height_m: [low, high], depth_m } = *recess;
    let [bar, deep] = BAR_M;
    let off = [-depth_m, -depth_m + deep];
    match kind {
        RecessKind::Window => {
            let middle = f64::midpoint(a, b);
            for at in [a + bar / 2.0, middle, b - bar / 2.0] {
                fitting.block(face, [at - bar / 2.0, at + bar / 2.0], off, [low, high]);
            }
            for at in [low + bar / 2.0, high - bar / 2.0] {
                fitting.block(face, [a, b], off, [at - bar / 2.0, at + bar / 2.0]);
            }
            fitting.block(face, [a - 0.05, b + 0.05], [-0.05, 0.08], [low - 0.03, low]);
        }
        RecessKind::Door => {
            let panel = [a + 0.15, b - 0.15];
            let raised = [-depth_m, -depth_m + 0.025];
            fitting.block(face, panel, raised, [0.2, 0.9]);
            fitting.block(face, panel, raised, [1.1, high - 0.2]);
            let [x, y] = face.at(a + 0.07, -depth_m + 0.05);
            fitting.ball([x, y, 1.02], 0.035);
        }
        RecessKind::Alcove => {
            fitting.block(face, [a, b], [-depth_m, -depth_m + 0.35], [0.7, 0.74]);
            fitting.block(face, [a, b], [-depth_m, -depth_m + 0.3], [1.4, 1.43]);
            let at = face.at(a + 0.4, -depth_m + 0.18);
            fitting.cylinder(at, 0.09, [0.74, 1.02]);
            let [x, y] = face.at(b - 0.5, -depth_m + 0.17);
            fitting.ball([x, y, 1.55], 0.12);
            let turn = fitting.random.between(-0.6, 0.6);
            fitting.turned(face.at(b - 0.6, -depth_m + 0.35), [0.5, 0.4], [0.0, 0.42], turn);
        }
    }
}
