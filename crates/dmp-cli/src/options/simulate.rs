//! Options of `dmp simulate`.

use std::path::PathBuf;

use dmp_sim::{Companion, NoReturn, Route};

use super::Group::Plain;
use super::values::{self, parsed};
use super::{Entry, Opt, Role};

pub(crate) static SEED: Opt<u64> = Opt {
    help: "Seed: the same seed gives the same files. Default: 1",
    ..Opt::text(Plain, "seed", "N", "7", parsed)
};
/// The log of a drive.
pub(crate) static DRIVE: Opt<PathBuf> = Opt {
    help: "The log: FILE.mcap, or a FOLDER/ of KITTI scans (.bin) with times",
    ..Opt::output(Plain, "LOG")
};
pub(crate) static TRUTH: Opt<PathBuf> = Opt {
    help: "The true trajectory: FILE.tum, or of a town FILE.txt for KITTI rows, one a scan. Default: LOG.truth.tum, which is not \
           overwritten",
    ..Opt::path(Plain, "truth", "FILE", Role::Written)
};
pub(crate) static TRUTH_RATE: Opt<f64> = Opt {
    help: "Poses of the true trajectory per second, Hz. Default: 20",
    ..Opt::text(Plain, "truth-rate", "HZ", "100", parsed)
};
pub(crate) static BEAMS: Opt<usize> = Opt {
    help: "Beams of the sensor. Default: 16 in a town, 64 in a city",
    ..Opt::text(Plain, "beams", "BEAMS", "32", parsed)
};
pub(crate) static AZIMUTH_STEPS: Opt<usize> = Opt {
    help: "Firings per turn. Default: 900 in a town, 1024 in a city",
    ..Opt::text(Plain, "azimuth-steps", "N", "200", parsed)
};
pub(crate) static SPEED: Opt<f64> = Opt {
    help: "Speed on straight streets, m/s; curves are slower. Default: 6 in a town, 10 in a city",
    ..Opt::text(Plain, "speed", "M/S", "8", parsed)
};
pub(crate) static ELEVATION: Opt<[f64; 2]> = Opt {
    is_signed: true,
    help: "Elevation of the lowest and highest beam, degrees. Default: -15,15; of more than 16 beams -25,15",
    ..Opt::text(Plain, "elevation", "LOW,HIGH", "-20,10", values::elevations_rad)
};
/// Turns of a sensor, or images.
pub(crate) static RATE: Opt<f64> = Opt {
    help: "Scans per second, Hz. Default: 10; of the images of a room 30",
    ..Opt::text(Plain, "rate", "HZ", "5", parsed)
};
pub(crate) static RANGE_NOISE: Opt<f64> = Opt {
    help: "Standard deviation of measured ranges, metres. Default: 0.02",
    ..Opt::text(Plain, "range-noise", "LENGTH", "2cm", values::length_m)
};
pub(crate) static FARTHEST: Opt<f64> = Opt {
    help: "Range of the farthest return of a bright surface seen straight on, metres. Default: 100",
    ..Opt::text(Plain, "max-range", "LENGTH", "50", values::length_m)
};
pub(crate) static DROP_OUT: Opt<f64> = Opt {
    help: "Share of the returns that are lost at random. Default: 0.01",
    ..Opt::text(Plain, "drop-out", "SHARE", "0", parsed)
};
pub(crate) static RESOLUTION: Opt<f64> = Opt {
    help: "Coordinates are rounded to multiples of this, metres, 0 for none. Default: 1/512; powers of two keep files small",
    ..Opt::text(Plain, "resolution", "METRES", "0", parsed)
};
pub(crate) static NO_RETURN: Opt<NoReturn> = Opt {
    help: "What the log holds where no return came back: nothing, the point (0, 0, 0), or a point of NaNs. Default: omit",
    ..Opt::words(
        Plain,
        "no-return",
        "WHAT",
        &[("omit", NoReturn::Omitted), ("zero", NoReturn::Zero), ("nan", NoReturn::NotANumber)],
    )
};
pub(crate) static INSTANT: Opt<bool> = Opt {
    help: "Take each scan at one instant, as if the sensor stood still, without times of its returns",
    ..Opt::switch(Plain, "instant")
};

/// The sensor, and what is saved of its drive.
pub(crate) const RECORDING: &[&dyn Entry] = &[
    &DRIVE,
    &TRUTH,
    &TRUTH_RATE,
    &SEED,
    &BEAMS,
    &AZIMUTH_STEPS,
    &SPEED,
    &ELEVATION,
    &RATE,
    &RANGE_NOISE,
    &FARTHEST,
    &DROP_OUT,
    &RESOLUTION,
    &NO_RETURN,
    &INSTANT,
];

pub(crate) static SCANS: Opt<usize> =
    Opt { help: "Number of scans. Default: 600", ..Opt::text(Plain, "scans", "N", "40", parsed) };
/// What stands along the streets of a town.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Streets {
    Varied,
    Alike,
    Tunnel,
}
pub(crate) static SCENERY: Opt<Streets> = Opt {
    help: "Along the streets: `varied`, houses, trees, poles and parked cars on hills; `alike`, the same house, tree, pole and \
           car every --period on level ground; `tunnel`, a straight bare tunnel 12 m wide and 6 m high. Default: varied",
    ..Opt::words(
        Plain,
        "scenery",
        "SCENERY",
        &[("varied", Streets::Varied), ("alike", Streets::Alike), ("tunnel", Streets::Tunnel)],
    )
};
pub(crate) static PERIOD: Opt<f64> = Opt {
    help: "Distance of houses with `--scenery alike`, 6 to 40 m. Default: 8",
    ..Opt::text(Plain, "period", "LENGTH", "10", values::length_m)
};
pub(crate) static ROUTE: Opt<Route> = Opt {
    help: "The drive: `loop`, round blocks, a third of it a revisit; `out-and-back`, back in the opposite lane; `straight`, the \
           same along one street; `one-way`, no street twice. Default: loop; with other scenery than varied: straight",
    ..Opt::words(
        Plain,
        "route",
        "ROUTE",
        &[
            ("loop", Route::Loop),
            ("out-and-back", Route::OutAndBack),
            ("straight", Route::Straight),
            ("one-way", Route::OneWay),
        ],
    )
};
pub(crate) static TRAFFIC: Opt<usize> =
    Opt { help: "Number of moving cars. Default: 0", ..Opt::text(Plain, "traffic", "N", "20", parsed) };

pub(crate) static PEOPLE: Opt<usize> = Opt {
    help: "Number of people who walk around in the room, up to 20. Default: 0",
    ..Opt::text(Plain, "people", "N", "3", up_to_20)
};

fn up_to_20(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|people| *people <= 20).ok_or_else(|| "must be a number from 0 to 20".to_owned())
}

pub(crate) static COMPANY: Opt<Vec<Companion>> = Opt {
    help: "What moves near the sensor all the way: `ahead=LENGTH` (a car that is followed), `stop-and-go`, `overtaking`, \
           `oncoming`, `bus`, `crowd`; several with commas",
    ..Opt::text(Plain, "company", "KIND", "ahead=15m,oncoming", companions)
};

fn companions(text: &str) -> Result<Vec<Companion>, String> {
    let companion = |word: &str| match word.split_once('=') {
        Some(("ahead", length)) => values::length_m(length).map(Companion::Ahead),
        None if word == "stop-and-go" => Ok(Companion::StopAndGo),
        None if word == "overtaking" => Ok(Companion::Overtaking),
        None if word == "oncoming" => Ok(Companion::Oncoming),
        None if word == "bus" => Ok(Companion::Bus),
        None if word == "crowd" => Ok(Companion::Crowd),
        _ => Err("expected ahead=LENGTH, stop-and-go, overtaking, oncoming, bus or crowd".to_owned()),
    };
    text.split(',').map(companion).collect()
}

pub(crate) static KM: Opt<f64> = Opt {
    is_needed: true,
    is_signed: true,
    help: "Length of the drive, kilometres, from 0.05 to 1000",
    ..Opt::text(Plain, "km", "N", "1", parsed)
};
pub(crate) static REVISIT: Opt<f64> = Opt {
    is_signed: true,
    help: "Share of the path that is driven twice, up to 0.9; 0 for no revisit. Default: 0.3",
    ..Opt::text(Plain, "revisit", "SHARE", "0.5", parsed)
};

pub(crate) static ROOM_FOLDER: Opt<PathBuf> =
    Opt { help: "The folder for the files; it must not exist", ..Opt::output(Plain, "FOLDER") };
pub(crate) static FRAMES: Opt<usize> =
    Opt { help: "Number of images. Default: 600", ..Opt::text(Plain, "frames", "N", "60", parsed) };
pub(crate) static SIZE: Opt<[u32; 2]> = Opt {
    help: "Width and height of an image, pixels; the focal length is 525 pixels for each 640 of the width. Default: 640x480",
    ..Opt::text(Plain, "size", "WxH", "160x120", values::size_px)
};
pub(crate) static DEPTH_SCALE: Opt<f64> = Opt {
    help: "Units of the depth images per metre. Default: 5000",
    ..Opt::text(Plain, "depth-scale", "N", "1000", parsed)
};
pub(crate) static ROOM: Opt<[f64; 3]> = Opt {
    help: "Width, depth and height of the room, metres. Default: 7x5.6x2.6",
    ..Opt::text(Plain, "room", "WxDxH", "8x6x2.5", values::room_m)
};
pub(crate) static ONCE: Opt<bool> =
    Opt { help: "Walk a part of a round only, so that no place is seen twice", ..Opt::switch(Plain, "once") };
pub(crate) static NO_NOISE: Opt<bool> =
    Opt { help: "Exact depths, without holes", ..Opt::switch(Plain, "no-noise") };

pub(crate) static TRAJECTORY: Opt<PathBuf> =
    Opt { help: "The true trajectory: TUM, or KITTI rows", ..Opt::argument("trajectory", "TRAJ") };
pub(crate) static WRONG: Opt<PathBuf> = Opt {
    help: "The wrong trajectory: TUM, or KITTI rows where the true one has no stamps",
    ..Opt::output(Plain, "FILE")
};
pub(crate) static SCALE: Opt<f64> =
    Opt { help: "Scale all distances by this", ..Opt::text(Plain, "scale", "FACTOR", "1.1", parsed) };
pub(crate) static BEND: Opt<f64> = Opt {
    is_signed: true,
    help: "Bend the run upwards by this in its middle, metres, and tilt it accordingly",
    ..Opt::text(Plain, "bend", "LENGTH", "-1", values::length_m)
};
pub(crate) static DRIFT_ATE: Opt<f64> = Opt {
    help: "Smooth drift of heading, tilt and step length with this ATE, metres (RMSE after rigid alignment)",
    ..Opt::text(Plain, "drift-ate", "LENGTH", "1", values::length_m)
};
pub(crate) static FALSE_LOOP: Opt<f64> = Opt {
    help: "A false loop closure that joins two places this far apart, metres",
    ..Opt::text(Plain, "false-loop", "LENGTH", "20", values::length_m)
};
pub(crate) static COLLAPSE: Opt<f64> = Opt {
    help: "Share of the path, in its middle, during which the estimate stands still",
    ..Opt::text(Plain, "collapse", "SHARE", "0.1", parsed)
};
pub(crate) static NOISE: Opt<(f64, f64)> = Opt {
    help: "White noise of every scan's pose: standard deviation along and about each axis",
    ..Opt::text(Plain, "noise", "LENGTH,ANGLE", "0.03,0.1deg", values::noise)
};
pub(crate) static NOISE_INTERVAL: Opt<i64> = Opt {
    help: "Time between scans: denser poses share the noise of a scan. Default: 100ms",
    ..Opt::text(Plain, "noise-interval", "TIME", "50ms", values::interval_ns)
};
/// Of these one at least is given.
pub(crate) const ERRORS: &[&dyn Entry] = &[&SCALE, &BEND, &DRIFT_ATE, &FALSE_LOOP, &COLLAPSE, &NOISE];

pub(crate) static LOOPS_TRUTH: Opt<PathBuf> =
    Opt { help: "The true trajectory, with stamps: TUM, or EuRoC", ..Opt::argument("truth", "TRUTH") };
pub(crate) static LOOPS_FOLDER: Opt<PathBuf> = Opt {
    help: "The folder for the files; it is created if missing. Files in it are not overwritten",
    ..Opt::output(Plain, "FOLDER")
};
pub(crate) static IN_ROOM: Opt<bool> = Opt {
    help: "The trajectory is that of a hand-held camera in a room (z ahead, y down): distances are those of a room",
    ..Opt::switch(Plain, "room")
};
pub(crate) static SPACING: Opt<f64> = Opt {
    help: "Path length from one keyframe to the next, metres. Default: 1; with --room 0.2, or a turn of 15 degrees; with \
           --keyframes 0, which is all of them",
    ..Opt::text(Plain, "spacing", "LENGTH", "2m", values::length_m)
};
pub(crate) static TRUE_LOOPS: Opt<usize> =
    Opt { help: "Number of true candidates. Default: 10", ..Opt::text(Plain, "true", "N", "20", parsed) };
pub(crate) static FALSE_LOOPS: Opt<usize> =
    Opt { help: "Number of false candidates. Default: 10", ..Opt::text(Plain, "false", "N", "20", parsed) };
pub(crate) static NEAR_LOOPS: Opt<usize> =
    Opt { help: "Number of near candidates. Default: 6", ..Opt::text(Plain, "near", "N", "0", parsed) };
pub(crate) static ODOMETRY_NOISE: Opt<(f64, f64)> = Opt {
    help: "Noise of a metre of odometry: standard deviation along and about each axis; it grows with the square root of the \
           path length. Default: 0.02,0.03deg; with --room 0.02,0.3deg",
    ..Opt::text(Plain, "noise", "LENGTH,ANGLE", "5cm,0.1deg", values::noise)
};
pub(crate) static YAW_BIAS: Opt<f64> = Opt {
    is_signed: true,
    help: "Bias of the odometry's yaw in each metre. Default: 0.006deg; with --room 0.1deg",
    ..Opt::text(Plain, "yaw-bias", "ANGLE", "-0.1deg", values::angle_rad)
};
