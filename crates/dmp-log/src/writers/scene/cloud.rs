//! Points of a scene.

use crate::messages::{CdrWriter, FLOAT32, OpenCloud, PointField, RosStamp, UINT32, start_cloud};

/// A colour twice, each as one of the viewers finds it by its name: `rgb` (0x00RRGGBB) for Foxglove and `RViz`, `colors`
/// (0xRRGGBBAA) for rerun.
const FIELDS: [PointField; 9] = [
    ("x", FLOAT32),
    ("y", FLOAT32),
    ("z", FLOAT32),
    ("rgb", UINT32),
    ("colors", UINT32),
    ("residual_m", FLOAT32),
    ("normal_x", FLOAT32),
    ("normal_y", FLOAT32),
    ("normal_z", FLOAT32),
];
/// Those of points without normals.
const WITHOUT_NORMAL: usize = 6;

/// A point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScenePoint {
    /// Where it lies in the frame of its cloud, metres.
    pub place_m: [f32; 3],
    /// Red, green, blue.
    pub colour: [u8; 3],
    /// How much the map is off there, metres; `None` where that is not known.
    pub residual_m: Option<f32>,
}

/// A cloud to which points are added, until it is written.
#[derive(Debug)]
pub struct SceneCloud {
    pub(super) message: CdrWriter,
    open: OpenCloud,
}

impl SceneCloud {
    pub(super) fn start(
        mut message: CdrWriter,
        (stamp, frame): (RosStamp, &str),
        points: usize,
        with_normals: bool,
    ) -> Result<Self, String> {
        let fields = if with_normals { &FIELDS[..] } else { &FIELDS[..WITHOUT_NORMAL] };
        let open = start_cloud(&mut message, stamp, frame, fields, (4 * fields.len(), points))?;
        Ok(Self { message, open })
    }

    /// Adds a point.
    pub fn push(&mut self, point: &ScenePoint) {
        let [r, g, b] = point.colour;
        let colours = [[b, g, r, 0], [0xff, b, g, r]];
        let residual_m = point.residual_m.unwrap_or(f32::NAN).to_le_bytes();
        let bytes = self.message.message();
        bytes.extend_from_slice(point.place_m.map(f32::to_le_bytes).as_flattened());
        bytes.extend_from_slice(colours.as_flattened());
        bytes.extend_from_slice(&residual_m);
    }

    /// Adds a point of a surface.
    pub fn push_surfel(&mut self, point: &ScenePoint, normal: [f32; 3]) {
        self.push(point);
        self.message.message().extend_from_slice(normal.map(f32::to_le_bytes).as_flattened());
    }

    /// The message, and how many points are in it.
    pub(super) fn finish(self) -> Result<(CdrWriter, u32), String> {
        let Self { mut message, open } = self;
        let points = open.close(&mut message, true)?;
        Ok((message, points))
    }
}
