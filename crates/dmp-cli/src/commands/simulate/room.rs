//! `dmp simulate room`: depth images of a furnished room.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use anyhow::Context as _;
use dmp_draw::text::counted;
use dmp_log::{DepthFolderWriter, encode_depth_png};
use dmp_sensor::{Distortion, PinholeCamera};
use dmp_sim::{DepthRecording, DepthRecordingOptions, Room, RoomOptions, ate_rmse_m, room_estimates};

use super::error::in_words;
use super::recording::travel_m;
use crate::console::{Common, Exit, Progress, Usage};
use crate::files::{save, save_trajectory};
use crate::options::{Asked, Out, Spec, simulate};

/// Focal length of an image as wide as this, pixels.
const FOCAL_PX: f64 = 525.0;
const WIDTH_PX: f64 = 640.0;

pub(super) static SPEC: Spec = Spec {
    name: "room",
    about: "Make depth images of a walk through a furnished room, their truth, and five estimates of it",
    more: "The room is generated from the seed: walls with a door, windows and an alcove, and furniture along them. A hand-held \
           camera goes round twice and returns to its start. Depths have the noise and the holes of a Kinect. The estimates \
           range from a good one to one with a false loop closure. World: z up; poses are the camera's, with z ahead, x right, \
           y down.",
    after: "Examples:\n  \
            dmp simulate room -o room/\n  \
            dmp simulate room -o once/ --once --seed 7\n  \
            dmp simulate room -o small/ --size 160x120 --frames 60 --rate 3 --no-noise\n\n\
            Files in FOLDER: depth/ and depth.txt, the images in the layout of TUM RGB-D; camera.json; groundtruth.txt, the \
            true poses; estimates/ with good.txt, another.txt, odometry.txt, off.txt and false_loop.txt; room.obj, the surface \
            of the room.",
    options: &[&[
        &simulate::ROOM_FOLDER,
        &simulate::FRAMES,
        &simulate::RATE,
        &simulate::SIZE,
        &simulate::DEPTH_SCALE,
        &simulate::ROOM,
        &simulate::ONCE,
        &simulate::PEOPLE,
        &simulate::NO_NOISE,
        &simulate::SEED,
    ]],
    run,
    ..Spec::EMPTY
};

/// What is in the folder beside the images.
const TRUTH: &str = "groundtruth.txt";
const ESTIMATES: &str = "estimates";
const SURFACE: &str = "room.obj";

fn camera(size_px: [u32; 2]) -> Result<PinholeCamera, Usage> {
    let focal_px = FOCAL_PX * f64::from(size_px[0]) / WIDTH_PX;
    let centre_px = size_px.map(|px| (f64::from(px) - 1.0) / 2.0);
    PinholeCamera::new(size_px, [focal_px; 2], centre_px, Distortion::NONE)
        .map_err(|error| Usage(error.to_string()))
}

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let size_px = asked.get(&simulate::SIZE).unwrap_or([640, 480]);
    let camera = camera(size_px)?;
    let folder = &asked.need(&simulate::ROOM_FOLDER)?;
    let seed = asked.get(&simulate::SEED).unwrap_or(1);
    let size_m = asked.get(&simulate::ROOM).unwrap_or([7.0, 5.6, 2.6]);
    let room = Room::new(RoomOptions { seed, size_m }).map_err(in_words)?;
    let units_per_m = asked.get(&simulate::DEPTH_SCALE).unwrap_or(5000.0);
    let options = DepthRecordingOptions {
        seed,
        camera,
        images: asked.get(&simulate::FRAMES).unwrap_or(600),
        rate_hz: asked.get(&simulate::RATE).unwrap_or(30.0),
        revisit: !asked.has(&simulate::ONCE),
        noise: !asked.has(&simulate::NO_NOISE),
        units_per_m,
        people: asked.get(&simulate::PEOPLE).unwrap_or(0),
    };
    let recording = DepthRecording::new(&room, options).map_err(in_words)?;
    let truth = recording.truth().map_err(in_words)?;
    let estimates = room_estimates(&truth, seed).map_err(in_words)?;

    let mut images = DepthFolderWriter::create(folder, &camera, units_per_m)?;
    let progress = Progress::new(common);
    progress.start("simulating", "images", recording.len() as u64);
    let encoded = recording.map_images(|image| {
        let png = encode_depth_png(size_px, &image.units);
        (image.stamp_ns, image.valid(), png)
    });
    let mut valid = 0;
    for (stamp_ns, of_image, png) in encoded {
        let png = png?;
        images.write_encoded(stamp_ns, &png)?;
        progress.done(1);
        common.host.go_on()?;
        valid += of_image;
    }
    drop(progress);

    let pixels = size_px.map(|px| px as usize);
    let share = valid as f64 / (pixels[0] * pixels[1] * recording.len()) as f64;
    let first = format!(
        "{}: {}, {:.0} % of their pixels measured, {:.1} m of travel",
        folder.display(),
        counted(recording.len() as u64, "image"),
        share * 100.0,
        travel_m(&truth),
    );
    // All is written before any of it is printed, and has its name when it is whole.
    let made = images.folder().to_path_buf();
    let mut lines = vec![first];
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

#[cfg(test)]
mod tests {
    use super::*;

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
