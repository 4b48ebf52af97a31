//! The plan of a room: its walls, and what is set back in them.

use crate::random::Random;

/// Which [`Room`](crate::Room). Everything in it follows from these numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomOptions {
    /// Another seed makes another plan and other furniture.
    pub seed: u64,
    /// Width (x), depth (y) and height (z) from wall to wall, metres.
    pub size_m: [f64; 3],
}

impl Default for RoomOptions {
    /// A large living room.
    fn default() -> Self {
        Self { seed: 1, size_m: [7.0, 5.6, 2.6] }
    }
}

/// A stretch of wall, seen from within: furniture stands along it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Face {
    /// Where it begins on the floor plan; the room lies to the left of it.
    pub(super) start: [f64; 2],
    /// Unit vector along it, east, north, west or south.
    pub(super) along: [f64; 2],
    pub(super) length_m: f64,
    /// What is set back from it, from its start to its end, not overlapping.
    pub(super) recesses: Vec<Recess>,
    /// Whether it is one of the outer walls: the others are faces of what stands in the room.
    pub(super) outer: bool,
}

/// A part of a wall that is set back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Recess {
    pub(super) kind: RecessKind,
    /// From and to along the wall, in height, and how deep, metres.
    pub(super) along_m: [f64; 2],
    pub(super) height_m: [f64; 2],
    pub(super) depth_m: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RecessKind {
    Door,
    Window,
    Alcove,
}

/// What the floor plan is beside a rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Block {
    /// The north-eastern corner is no part of the room.
    Corner([[f64; 2]; 2]),
    /// A wall that stands out into the room from the north.
    Divider([[f64; 2]; 2]),
    /// Nothing.
    None,
}

/// The floor plan.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    pub(super) size_m: [f64; 3],
    pub(super) faces: Vec<Face>,
    pub(super) block: Block,
}

/// Thickness of a dividing wall, metres.
const DIVIDER_M: f64 = 0.14;
/// Farthest that anything is set back, metres.
pub(super) const DEEPEST_M: f64 = 0.7;
/// Between recesses, and between them and the ends of a wall, at least, metres.
const BESIDE_M: f64 = 0.3;

impl Plan {
    pub(super) fn new(options: &RoomOptions) -> Self {
        let mut random = Random::new(options.seed, &[b'r'.into(), b'p'.into()]);
        let size_m @ [w, d, h] = options.size_m;
        let block = match random.index(3) {
            0 => Block::Corner([
                [w - random.between(0.24, 0.32) * w, d - random.between(0.24, 0.32) * d],
                [w, d],
            ]),
            1 => {
                let (x, y) = (random.between(0.42, 0.58) * w, d - random.between(0.22, 0.3) * d);
                Block::Divider([[x - DIVIDER_M / 2.0, y], [x + DIVIDER_M / 2.0, d]])
            }
            _ => Block::None,
        };
        // Counter-clockwise round the room: the corners, and whether the wall from each is an outer one.
        let mut corners = vec![([0.0, 0.0], true), ([w, 0.0], true)];
        match block {
            Block::Corner([[x, y], _]) => {
                corners.extend([([w, y], false), ([x, y], false), ([x, d], true)]);
            }
            Block::Divider([[x0, y], [x1, _]]) => {
                let inner = [([x1, d], false), ([x1, y], false), ([x0, y], false), ([x0, d], true)];
                corners.push(([w, d], true));
                corners.extend(inner);
            }
            Block::None => corners.push(([w, d], true)),
        }
        corners.push(([0.0, d], true));
        let mut faces: Vec<Face> = (0..corners.len())
            .map(|k| {
                let ((start, outer), (end, _)) = (corners[k], corners[(k + 1) % corners.len()]);
                let step = [end[0] - start[0], end[1] - start[1]];
                let length_m = step[0].abs() + step[1].abs();
                Face { start, along: step.map(|s| s / length_m), length_m, recesses: Vec::new(), outer }
            })
            .collect();
        set_back(&mut faces, h, &mut random);
        Self { size_m, faces, block }
    }
}

/// A door, an alcove where nothing else makes the plan special or by chance, and windows.
fn set_back(faces: &mut [Face], height_m: f64, random: &mut Random) {
    let wide = |faces: &[Face], least_m: f64, random: &mut Random| -> Option<usize> {
        let free =
            |face: &Face| face.outer && face.recesses.is_empty() && face.length_m > least_m + 2.0 * BESIDE_M;
        let free: Vec<usize> = (0..faces.len()).filter(|&k| free(&faces[k])).collect();
        (!free.is_empty()).then(|| free[random.index(free.len())])
    };
    let mut put = |kind: RecessKind, width_m: f64, height_m: [f64; 2], depth_m: f64| {
        if let Some(k) = wide(faces, width_m, random) {
            let from = random.between(BESIDE_M, faces[k].length_m - width_m - BESIDE_M);
            let along_m = [from, from + width_m];
            faces[k].recesses.push(Recess { kind, along_m, height_m, depth_m });
        }
    };
    let top = (height_m - 0.3).min(2.2);
    put(RecessKind::Door, 0.95, [0.0, top.min(2.05)], 0.1);
    put(RecessKind::Alcove, 1.8, [0.0, top], DEEPEST_M);
    put(RecessKind::Window, 1.6, [0.85, top], 0.18);
    put(RecessKind::Window, 1.3, [0.95, top], 0.18);
}
