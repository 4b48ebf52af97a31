//! `dmp simulate room`: depth images of a furnished room.

use dmp_draw::text::counted;
use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use dmp_log::{DepthFolderWriter, encode_depth_png};
use dmp_sensor::{Distortion, PinholeCamera, Trajectory};
use dmp_sim::{DepthRecording, DepthRecordingOptions, Room, RoomOptions, ate_rmse_m, room_estimates};

use super::fault::told;
use super::progress::Progress;
use crate::common::Common;
use crate::exit::{Exit, Usage};
use crate::save::{save, save_trajectory};

/// Focal length of an image as wide as this, pixels.
const FOCAL_PX: f64 = 525.0;
const WIDTH_PX: f64 = 640.0;

/// Make depth images of a walk through a furnished room, their truth, and five estimates of it
///
/// The room is made of the seed: walls with a door, windows and an alcove, and furniture along them. A hand-held
/// camera goes twice round and looks about; it ends where it began. Depths have the noise and the holes of a Kinect.
/// The estimates go from a good one to one with a false loop closure, by absolute trajectory error. World: z up;
/// poses are the camera's, with z ahead, x right, y down.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    dmp simulate room -o room/\n  \
    dmp simulate room -o once/ --once --seed 7\n  \
    dmp simulate room -o small/ --size 160x120 --frames 60 --rate 3 --no-noise\n\n\
    Files in FOLDER: depth/ and depth.txt, the images as TUM RGB-D has them; camera.json; groundtruth.txt, the true \
    poses; estimates/ with good.txt, another.txt, odometry.txt, off.txt and false_loop.txt; room.obj, the surface \
    of the room.")]
pub(crate) struct RoomArgs {
    /// The folder for the files; there must be nothing yet
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Number of images
    #[arg(long, default_value_t = 600, value_name = "N")]
    frames: usize,
    /// Images per second, Hz; fewer make the same walk longer
    #[arg(long, default_value_t = 30.0, value_name = "HZ")]
    rate: f64,
    /// Width and height of an image, pixels; the focal length is 525 pixels for each 640 of the width
    #[arg(long, default_value = "640x480", value_name = "WxH", value_parser = size_px)]
    size: [u32; 2],
    /// Units of the depth images per metre
    #[arg(long, default_value_t = 5000.0, value_name = "N")]
    depth_scale: f64,
    /// Width, depth and height of the room, metres
    #[arg(long, default_value = "7x5.6x2.6", value_name = "WxDxH", value_parser = room_m)]
    room: [f64; 3],
    /// Walk a part of a round only, so that nothing is seen again later on
    #[arg(long)]
    once: bool,
    /// Exact depths, without holes
    #[arg(long)]
    no_noise: bool,
    /// Another number makes another room, another walk, other noise and other estimates
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// What is in the folder beside the images.
const TRUTH: &str = "groundtruth.txt";
const ESTIMATES: &str = "estimates";
const SURFACE: &str = "room.obj";

impl RoomArgs {
    fn camera(&self) -> Result<PinholeCamera, Usage> {
        let focal_px = FOCAL_PX * f64::from(self.size[0]) / WIDTH_PX;
        let centre_px = self.size.map(|px| (f64::from(px) - 1.0) / 2.0);
        PinholeCamera::new(self.size, [focal_px; 2], centre_px, Distortion::NONE)
            .map_err(|error| Usage(error.to_string()))
    }
}

pub(super) fn run(arguments: &RoomArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let camera = arguments.camera()?;
    let folder = &arguments.output;
    let seed = arguments.seed;
    let room = Room::new(RoomOptions { seed, size_m: arguments.room }).map_err(told)?;
    let options = DepthRecordingOptions {
        seed,
        camera,
        images: arguments.frames,
        rate_hz: arguments.rate,
        revisit: !arguments.once,
        noise: !arguments.no_noise,
        units_per_m: arguments.depth_scale,
    };
    let recording = DepthRecording::new(&room, options).map_err(told)?;
    let truth = recording.truth().map_err(told)?;
    let estimates = room_estimates(&truth, seed).map_err(told)?;

    let mut images = DepthFolderWriter::create(folder, &camera, arguments.depth_scale)?;
    let progress = Progress::of_images(common, recording.len());
    let encoded = recording.map_images(|image| {
        let png = encode_depth_png(arguments.size, &image.units);
        (image.stamp_ns, image.valid(), png)
    });
    let mut valid = 0;
    for (stamp_ns, of_image, png) in encoded {
        let png = png?;
        images.write_encoded(stamp_ns, &png)?;
        progress.image_written(png.len());
        progress.go_on()?;
        valid += of_image;
    }
    drop(progress);

    let pixels = arguments.size.map(|px| px as usize);
    let share = valid as f64 / (pixels[0] * pixels[1] * recording.len()) as f64;
    let told = format!(
        "{}: {}, {:.0} % of their pixels measured, {:.1} m of travel",
        folder.display(),
        counted(recording.len() as u64, "image"),
        share * 100.0,
        travel_m(&truth),
    );
    // All is written before any of it is told, and has its name when it is whole.
    let made = images.folder().to_path_buf();
    let mut lines = vec![told];
    save_trajectory(&made.join(TRUTH), &truth)?;
    lines.push(format!("{}: {}", folder.join(TRUTH).display(), counted(truth.len() as u64, "pose")));
    std::fs::create_dir(made.join(ESTIMATES))
        .with_context(|| format!("{}: cannot make", folder.display()))?;
    for estimate in &estimates {
        let name = Path::new(ESTIMATES).join(format!("{}.txt", estimate.name));
        save_trajectory(&made.join(&name), &estimate.trajectory)?;
        let ate_m = ate_rmse_m(&estimate.trajectory, &truth);
        lines.push(format!("{}: ATE {ate_m:.3} m, {}", folder.join(name).display(), estimate.what));
    }
    let triangles = room.triangles();
    save(&made.join(SURFACE), |out| write_obj(out, &triangles))?;
    lines.push(format!(
        "{}: {}",
        folder.join(SURFACE).display(),
        counted(triangles.len() as u64, "triangle")
    ));
    images.finish()?;
    lines.iter().try_for_each(|line| writeln!(out, "{line}"))?;
    Ok(Exit::Done)
}

/// Vertices, each once, to the micrometre, and faces.
fn write_obj(out: &mut impl Write, triangles: &[[[f64; 3]; 3]]) -> std::io::Result<()> {
    let mut numbers: HashMap<[i64; 3], usize> = HashMap::new();
    for triangle in triangles {
        let mut face = [0; 3];
        for (corner, vertex) in face.iter_mut().zip(triangle) {
            let next = numbers.len() + 1;
            *corner = *numbers.entry(vertex.map(|c| (c * 1e6).round() as i64)).or_insert(next);
            if *corner == next {
                let [x, y, z] = vertex;
                writeln!(out, "v {x:.6} {y:.6} {z:.6}")?;
            }
        }
        writeln!(out, "f {} {} {}", face[0], face[1], face[2])?;
    }
    Ok(())
}

fn travel_m(run: &Trajectory) -> f64 {
    let steps = run.poses().windows(2).map(|pair| pair[1].translation.vector - pair[0].translation.vector);
    steps.map(|step| step.norm()).sum()
}

/// Two counts of pixels: `640x480`.
fn size_px(text: &str) -> Result<[u32; 2], String> {
    let parse = |text: &str| text.trim().parse::<u32>().ok();
    let both = text.split_once('x').and_then(|(w, h)| Some([parse(w)?, parse(h)?]));
    both.ok_or_else(|| format!("`{text}` is no size in pixels: try 640x480"))
}

/// Three lengths in metres: `7x5.6x2.6`.
fn room_m(text: &str) -> Result<[f64; 3], String> {
    let all: Option<Vec<f64>> = text.split('x').map(|part| part.trim().parse().ok()).collect();
    all.and_then(|all| all.try_into().ok())
        .ok_or_else(|| format!("`{text}` are no width, depth and height in metres: try 7x5.6x2.6"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_understood() {
        assert_eq!(size_px("160x120"), Ok([160, 120]));
        assert_eq!(room_m("8x6x2.5"), Ok([8.0, 6.0, 2.5]));
        for text in ["7x5.6xfoox2.6", "7xx5.6x2.6"] {
            assert!(room_m(text).is_err(), "{text}");
        }
        for text in ["640", "x480", "640x480x3", "-1x5", ""] {
            assert!(size_px(text).is_err_and(|error| error.contains("try")), "{text}");
            assert!(text == "640x480x3" || room_m(text).is_err_and(|error| error.contains("try")), "{text}");
        }
    }

    #[test]
    fn vertices_are_written_once() {
        let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mut text = Vec::new();
        write_obj(&mut text, &[[a, b, c], [a, c, d]]).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(text.lines().filter(|line| line.starts_with("v ")).count(), 4);
        assert!(text.ends_with("f 1 3 4\n"), "{text}");
    }
}
