//! Recordings of a depth camera in simulated rooms, with their truth and estimates.

use std::path::Path;

use anyhow::Context as _;
use dmp::Run;
use dmp_log::{DepthFolderWriter, LogOptions, ScanLog, encode_depth_png, open_log};
use dmp_sensor::{Distortion, PinholeCamera};
use dmp_sim::{DepthRecording, DepthRecordingOptions, Room, RoomOptions, room_estimates};

/// Images of a recording, and their size in pixels.
const IMAGES: usize = 150;
const SIZE_PX: [u32; 2] = [320, 240];
const FOCAL_PX: f64 = 262.5;
/// Duration of a walk, seconds.
const WALK_S: f64 = 20.0;

/// A recording of the room of a seed, written where it is missing, and its runs: the truth, then the estimates.
pub(super) fn room(seed: u64, out: &Path) -> anyhow::Result<(Box<dyn ScanLog>, Vec<Run>)> {
    let centre_px = SIZE_PX.map(|px| (f64::from(px) - 1.0) / 2.0);
    let camera = PinholeCamera::new(SIZE_PX, [FOCAL_PX; 2], centre_px, Distortion::NONE)?;
    let room = Room::new(RoomOptions { seed, ..RoomOptions::default() })?;
    let rate_hz = IMAGES as f64 / WALK_S;
    let options =
        DepthRecordingOptions { seed, images: IMAGES, rate_hz, ..DepthRecordingOptions::new(camera) };
    let recording = DepthRecording::new(&room, options)?;
    let folder = out.join(format!("room-{seed}-{}-{IMAGES}", SIZE_PX[0]));
    if !folder.exists() {
        write(&recording, &camera, &folder).with_context(|| folder.display().to_string())?;
    }
    let truth = recording.truth()?;
    let estimates = room_estimates(&truth, seed)?;
    let mut runs = vec![Run::new("truth", truth)];
    runs.extend(estimates.into_iter().map(|estimate| Run::new(estimate.name, estimate.trajectory)));
    Ok((open_log(&folder, &LogOptions::default())?, runs))
}

fn write(recording: &DepthRecording<'_>, camera: &PinholeCamera, folder: &Path) -> anyhow::Result<()> {
    if let Some(parent) = folder.parent() {
        std::fs::create_dir_all(parent)?;
    }
    let mut images = DepthFolderWriter::create(folder, camera, recording.options().units_per_m)?;
    let encoded =
        recording.map_images(|image| (image.stamp_ns, encode_depth_png(camera.size_px(), &image.units)));
    for (stamp_ns, png) in encoded {
        images.write_encoded(stamp_ns, &png?)?;
    }
    Ok(images.finish()?)
}
