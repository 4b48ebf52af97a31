//! Where furniture stands in a room.

use super::fitting::{Fitting, Span};
use super::furniture::{Piece, coffee_table};
use super::plan::{Face, Plan, RecessKind};

/// No furniture stands so near the start of a wall, metres: it would meet that of the wall before.
const CORNER_M: f64 = 0.85;
const END_M: f64 = 0.05;
/// Largest offset of a table from the middle of the room, as a share of its size.
const OFF_MIDDLE: f64 = 0.04;

/// Furniture along the walls and in the middle.
pub(super) fn furnish(plan: &Plan, fitting: &mut Fitting) {
    for face in &plan.faces {
        line(face, fitting);
    }
    let [w, d, _] = plan.size_m;
    let random = &mut fitting.random;
    let off = [0; 2].map(|_| random.between(-OFF_MIDDLE, OFF_MIDDLE));
    let yaw = random.between(-0.4, 0.4);
    coffee_table([w * (0.5 + off[0]), d * (0.42 + off[1])], yaw, fitting);
}

/// One piece after the other along a wall, as far as doors and alcoves leave room.
fn line(face: &Face, fitting: &mut Fitting) {
    let mut at = CORNER_M;
    let mut before = None;
    while at < face.length_m - END_M {
        let under_window = |span: Span| overlapped(face, span, |kind| kind == RecessKind::Window).is_some();
        let low = under_window([at, at + 1.0]) || fitting.random.chance(0.45);
        let choices: &[Piece] = if low { &Piece::LOW } else { &Piece::HIGH };
        let piece = choices[fitting.random.index(choices.len())];
        if before == Some(piece) {
            at += 0.1;
            before = None;
            continue;
        }
        let [least, most] = piece.width_m();
        let span = [at, at + fitting.random.between(least, most)];
        if let Some(end) = overlapped(face, span, |kind| kind != RecessKind::Window) {
            at = f64::max(at + 0.2, if end - at > 2.5 { at + 0.2 } else { end + 0.08 });
            continue;
        }
        if span[1] > face.length_m - END_M || (!low && under_window(span)) {
            at += 0.2;
            continue;
        }
        piece.put(face, span, fitting);
        if low && !under_window(span) {
            picture(face, span, fitting);
        }
        before = Some(piece);
        at = span[1] + fitting.random.between(0.05, 0.35);
    }
}

/// Where the part of the wall ends that is set back and overlaps with a span.
fn overlapped(face: &Face, [a, b]: Span, which: impl Fn(RecessKind) -> bool) -> Option<f64> {
    let overlaps = |&[from, to]: &Span| from < b + 0.05 && to > a - 0.05;
    let recesses = face.recesses.iter().filter(|recess| which(recess.kind));
    recesses.map(|recess| recess.along_m).find(overlaps).map(|[_, to]| to)
}

/// A frame with a picture that lies deeper.
fn picture(face: &Face, [a, b]: Span, fitting: &mut Fitting) {
    let wide = fitting.random.between(0.4, 0.8).min(b - a - 0.1);
    let high = fitting.random.between(0.3, 0.55);
    let middle = f64::midpoint(a, b) + fitting.random.between(-0.1, 0.1);
    let ([from, to], z) = ([middle - wide / 2.0, middle + wide / 2.0], fitting.random.between(1.25, 1.4));
    fitting.block(face, [from + 0.04, to - 0.04], [0.0, 0.012], [z + 0.04, z + high - 0.04]);
    for side in [[from, from + 0.04], [to - 0.04, to]] {
        fitting.block(face, side, [0.0, 0.035], [z, z + high]);
    }
    for side in [[z, z + 0.04], [z + high - 0.04, z + high]] {
        fitting.block(face, [from, to], [0.0, 0.035], side);
    }
}
