//! A recording: depth images of a walk through a room, and the truth about it.

use std::f64::consts::TAU;

use dmp_sensor::{Isometry3, PinholeCamera, Trajectory, Vector3};
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::fitting::Solid;
use super::furnished::Room;
use super::image::DepthImage;
use super::noise::measured;
use super::view::{Seen, View};
use super::walk::{RoomWalk, RoomWalkOptions};
use crate::error::{SimError, require};
use crate::parts::shape::Shape;

/// Images that are rendered at the same time, on all threads, and held in memory together.
const BATCH: usize = 16;
/// How fast people walk, and how near they come to the camera, metres.
const WALK_M_S: f64 = 0.8;
const ARM_M: f64 = 0.7;
/// Nanoseconds at which recordings begin.
const START_NS: i64 = 1_700_000_000_000_000_000;

/// A recording of a hand-held depth camera in a [`Room`].
#[derive(Debug, Clone, PartialEq)]
pub struct DepthRecordingOptions {
    /// Seed of the walk and the noise.
    pub seed: u64,
    /// The camera.
    pub camera: PinholeCamera,
    /// Number of images, 2 or more.
    pub images: usize,
    /// Images per second, Hz.
    pub rate_hz: f64,
    /// Whether the walk comes back to what it has seen.
    pub revisit: bool,
    /// Whether depths have the noise and the holes of a Kinect. Without it they are exact to half a unit.
    pub noise: bool,
    /// Units of a depth per metre: 5000 in TUM RGB-D.
    pub units_per_m: f64,
    /// People who walk around the middle of the room, out of the camera's way.
    pub people: usize,
}

impl DepthRecordingOptions {
    /// 600 images of such a camera in 20 s.
    pub fn new(camera: PinholeCamera) -> Self {
        let (images, rate_hz, units_per_m) = (600, 30.0, 5000.0);
        Self { seed: 1, camera, images, rate_hz, revisit: true, noise: true, units_per_m, people: 0 }
    }
}

/// Depth images of a walk through a room, and the truth about it.
#[derive(Debug, Clone)]
pub struct DepthRecording<'a> {
    room: &'a Room,
    options: DepthRecordingOptions,
    walk: RoomWalk,
    view: View,
}

impl<'a> DepthRecording<'a> {
    /// Takes the camera through `room`.
    ///
    /// # Errors
    /// When a number is outside its range, or the room has no place to walk.
    pub fn new(room: &'a Room, options: DepthRecordingOptions) -> Result<Self, SimError> {
        let DepthRecordingOptions { seed, images, rate_hz, revisit, units_per_m, .. } = options;
        require(
            (2..=1_000_000).contains(&images),
            "the number of images",
            "from 2 to 1000000",
            images as f64,
        )?;
        require((0.1..=1000.0).contains(&rate_hz), "the images per second", "from 0.1 to 1000", rate_hz)?;
        require((1.0..=65_535.0).contains(&units_per_m), "the units per m", "from 1 to 65535", units_per_m)?;
        let duration_s = (images - 1) as f64 / rate_hz;
        let walk = RoomWalk::new(room, RoomWalkOptions { seed, duration_s, start_ns: START_NS, revisit })?;
        Ok(Self { room, view: View::new(&options.camera), walk, options })
    }

    /// What it was made from.
    pub fn options(&self) -> &DepthRecordingOptions {
        &self.options
    }

    /// The path of the camera.
    pub fn walk(&self) -> &RoomWalk {
        &self.walk
    }

    /// Number of images.
    #[expect(clippy::len_without_is_empty, reason = "a recording has at least two images")]
    pub fn len(&self) -> usize {
        self.options.images
    }

    /// When the `index`-th image is taken, nanoseconds.
    pub fn stamp_ns(&self, index: usize) -> i64 {
        START_NS + libm::round(index as f64 * 1e9 / self.options.rate_hz) as i64
    }

    /// The `index`-th image. `O(pixels · solids of a tile)`.
    pub fn image(&self, index: usize) -> DepthImage {
        let stamp_ns = self.stamp_ns(index);
        let world_from_camera = self.walk.world_from_camera_at(stamp_ns);
        let seen = match self.options.people {
            0 => self.seen(&world_from_camera),
            people => {
                let seconds = (stamp_ns - START_NS) as f64 / 1e9;
                self.view
                    .seen(&with_people(self.room, people, seconds, &world_from_camera), &world_from_camera)
            }
        };
        let DepthRecordingOptions { camera, seed, noise, units_per_m, .. } = &self.options;
        if *noise {
            let depths_m = measured(&seen, camera, *seed, index as u64);
            DepthImage::new(stamp_ns, depths_m.into_iter(), *units_per_m)
        } else {
            DepthImage::new(stamp_ns, seen.into_iter().map(|seen| seen.depth_m), *units_per_m)
        }
    }

    /// What `of` makes of each image, in order, on all threads, a few images at a time.
    pub fn map_images<T: Send>(&self, of: impl Fn(DepthImage) -> T + Sync) -> impl Iterator<Item = T> {
        (0..self.len()).step_by(BATCH).flat_map(move |first| {
            let batch = first..(first + BATCH).min(self.len());
            let made: Vec<T> = batch.into_par_iter().map(|index| of(self.image(index))).collect();
            made
        })
    }

    /// The true trajectory of the camera (z ahead, x right, y down), a pose an image.
    ///
    /// # Errors
    /// Never: stamps ascend by construction.
    pub fn truth(&self) -> Result<Trajectory, SimError> {
        let stamps_ns = (0..self.len()).map(|index| self.stamp_ns(index));
        let poses = stamps_ns.map(|stamp_ns| (stamp_ns, self.walk.world_from_camera_at(stamp_ns)));
        Ok(Trajectory::stamped(poses.collect())?.trajectory)
    }

    /// What the pixels see from a pose.
    pub(super) fn seen(&self, world_from_camera: &Isometry3<f64>) -> Vec<Seen> {
        self.view.seen(self.room, world_from_camera)
    }
}

/// The room with people at a time of the walk. Who would be nearer to the camera than an arm's length is not there.
fn with_people(room: &Room, people: usize, time_s: f64, world_from_camera: &Isometry3<f64>) -> Room {
    let mut room = room.clone();
    let [width_m, depth_m, _] = room.options.size_m;
    let radius_m = 0.3 * width_m.min(depth_m);
    for person in 0..people {
        let share = person as f64 / people as f64;
        let (sin, cos) = libm::sincos(TAU * share + WALK_M_S / radius_m * time_s);
        let foot = Vector3::new(width_m / 2.0 + radius_m * cos, depth_m / 2.0 + radius_m * sin, 0.0);
        if (foot - world_from_camera.translation.vector).xy().norm() > ARM_M {
            let shape = Shape::Cylinder { foot, radius_m: 0.25, height_m: 1.7 };
            room.bounds.push(shape.bounds());
            room.solids.push(Solid { shape, lost: 0.02 });
        }
    }
    room
}
