//! Solids as the caster of a city takes them: in `f32`, relative to a point nearby.

use crate::parts::shape::Shape;
use crate::parts::solid::Solid;

/// Which formula a form needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FormKind {
    /// A box along the axes.
    Box,
    /// An upright box, turned about the vertical.
    Turned,
    /// An upright cylinder.
    Tube,
    /// An ellipsoid along the axes.
    Ball,
}

/// A solid relative to the corner of its block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Form {
    pub(crate) kind: FormKind,
    pub(crate) centre: [f32; 3],
    /// Half its size along its own axes; of a cylinder radius, radius, half the height.
    pub(crate) half: [f32; 3],
    /// Cosine and sine of its turn about the vertical.
    pub(crate) turn: [f32; 2],
    /// Half the size of the box along the world's axes around it.
    pub(crate) reach: [f32; 3],
    pub(crate) reflectivity: f32,
}

impl Form {
    /// A solid, seen from `corner`.
    pub(crate) fn new(solid: &Solid, corner: [f64; 2]) -> Self {
        let (low, high) = solid.shape.bounds();
        let reach = (high - low) / 2.0;
        let mut centre = (low + high) / 2.0;
        centre.x -= corner[0];
        centre.y -= corner[1];
        let (kind, half, turn) = match solid.shape {
            Shape::Box { half, sin_yaw: 0.0, .. } => (FormKind::Box, half, [1.0, 0.0]),
            Shape::Box { half, cos_yaw, sin_yaw, .. } => (FormKind::Turned, half, [cos_yaw, sin_yaw]),
            Shape::Cylinder { .. } => (FormKind::Tube, reach, [1.0, 0.0]),
            Shape::Ellipsoid { half, .. } => (FormKind::Ball, half, [1.0, 0.0]),
        };
        Self {
            kind,
            centre: centre.map(|c| c as f32).into(),
            half: half.map(|c| c as f32).into(),
            turn: turn.map(|c| c as f32),
            reach: reach.map(|c| c as f32).into(),
            reflectivity: solid.reflectivity as f32,
        }
    }
}
