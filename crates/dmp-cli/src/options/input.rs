//! Options of what is read: the log, runs, maps, and when and where poses hold.

use std::path::PathBuf;
use std::str::FromStr;

use dmp::PoseAt;
use dmp_log::{BinLayout, PointTime, StampAt, TimeUnit};

use super::Group::{Input, PlaceAndTime};
use super::extrinsic::Extrinsic;
use super::values::{self, Offset, Poses, parsed};
use super::{Entry, Group, Opt, Role};
use crate::named::{Named, NamedFile};

pub(crate) static LOG: Opt<PathBuf> = Opt {
    help: "The log: FILE.mcap, a rosbag2 folder or .db3 with PointCloud2 or Livox CustomMsg; a folder of scans (.bin, \
           .pcd, .ply, .las, .laz); or a folder of depth images (TUM RGB-D, ICL-NUIM, Redwood: 16-bit PNG)",
    ..Opt::argument("log", "LOG")
};
pub(crate) static MORE_RUNS: Opt<NamedFile> = Opt {
    is_argument: true,
    is_many: true,
    is_hidden: true,
    help: "More runs: what a shell makes of `-t runs/*.tum`",
    ..Opt::file(Group::Plain, "more", "[NAME=]RUN")
};
pub(crate) static RUNS: Opt<NamedFile> = Opt {
    short: Some('t'),
    is_many: true,
    unless: Some(&MORE_RUNS),
    is_short_help: true,
    help: "A run: its trajectory, world_from_body in metres. A file (TUM, KITTI rows, EuRoC, .npy, g2o), `topic:/odom` of \
           the log, or `BAG:/odom` of another bag (for frames `topic:/tf:WORLD:BODY`). Default NAME: that of the file",
    ..Opt::file(Input, "trajectory", "[NAME=]RUN")
};
/// Where runs may be given.
pub(crate) static ANY_RUNS: Opt<NamedFile> = Opt {
    short: Some('t'),
    is_many: true,
    help: "A trajectory beside the log: a file, `topic:/odom` of the log, or `BAG:/odom` of another bag",
    ..Opt::file(Input, "trajectory", "[NAME=]RUN")
};
/// Where there is one run.
pub(crate) static RUN: Opt<NamedFile> = Opt {
    short: Some('t'),
    is_needed: true,
    help: "The run: its trajectory, as for `dmp score`",
    ..Opt::file(Input, "trajectory", "[NAME=]RUN")
};
pub(crate) static POSES_AS: Opt<Named<Poses>> = Opt {
    is_many: true,
    help: "What the poses of a file are, where it is not detected: a format (`tum`, `kitti`, `euroc`, `npy`, `g2o`, \
           `redwood`, `csv`), the unit of stamps (`stamps-s`, `stamps-ms`, `stamps-us`, `stamps-ns`), `inverted` \
           (body_from_world), `wxyz` quaternions, or lengths in `mm`, `cm` or `km`. Repeatable; for all runs, or one NAME",
    ..Opt::text(Input, "poses-as", "[NAME=]HOW", "a=inverted", parsed)
};
/// The same of one file.
pub(crate) static FILE_AS: Opt<Poses> = Opt {
    is_many: true,
    help: "What its poses are, as for `dmp score`: a format, the unit of stamps (`stamps-us`), `inverted`, `wxyz`, `mm`, `cm` or \
           `km`. Repeatable. Default: detected",
    ..Opt::text(Input, "poses-as", "HOW", "inverted", parsed)
};
pub(crate) static BETWEEN: Opt<NamedFile> = Opt {
    is_many: true,
    help: "For a run with poses of keyframes only: a trajectory of the same body with poses between them, as of an odometry. \
           It may drift, and have a world frame of its own",
    ..Opt::file(Input, "between", "[NAME=]FILE")
};
pub(crate) static MAPS: Opt<NamedFile> = Opt {
    is_many: true,
    help: "Score against this map instead of the one fused from the scans: LAS, LAZ, PLY, PCD, a mesh in PLY or OBJ, or a \
           .dmpmap, in the world frame of the run",
    ..Opt::file(Input, "map", "[NAME=]FILE")
};
pub(crate) static TOPIC: Opt<String> = Opt {
    help: "The topic with the scans, where the log has several; with :FRAME those of one sensor, where several write to one topic",
    ..Opt::text(Input, "topic", "NAME[:FRAME]", "/points", parsed)
};
pub(crate) static POINT_TIME: Opt<TimesOfPoints> = Opt {
    help: "Times of points: `s`, `ms`, `us` or `ns` after the scan's stamp; `absolute-s` … on the clock of the stamps; \
           `first-s` … on another clock, after the scan's first point; or `ignore`. Before it the field, or two with \
           seconds and what is below, where it has no usual name: `curvature:ms`, `sec+nsec:`. Default: detected",
    ..Opt::text(Input, "point-time", "[FIELD:]UNIT", "ns", parsed)
};
/// Which field has the times of points, and what they mean.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TimesOfPoints {
    pub(crate) unit: PointTime,
    /// `None`: that of a usual name.
    pub(crate) field: Option<String>,
}

impl FromStr for TimesOfPoints {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (field, unit) = text.rsplit_once(':').map_or((None, text), |(field, unit)| (Some(field), unit));
        let unit = if field.is_some() && unit.is_empty() { PointTime::Auto } else { unit.parse()? };
        if field.is_some_and(|field| field.trim().is_empty()) {
            return Err(format!("`{text}` names no field before the colon"));
        }
        Ok(Self { unit, field: field.map(str::to_owned) })
    }
}

pub(crate) static BIN_LAYOUT: Opt<BinLayout> = Opt {
    help: "How points of `.bin` files are laid out: names and types, little-endian; `t` are times. Default: found from the \
           values",
    ..Opt::text(Input, "bin-layout", "NAME:TYPE,…", "x:f4,y:f4,z:f4,intensity:f4,ring:u2,t:f4", parsed)
};
pub(crate) static EVERY: Opt<usize> = Opt {
    sets: Some(|config, every| config.every = every),
    help: "Use only every N-th scan, for the map and for the score. Default: 1",
    ..Opt::text(Input, "every", "N", "2", parsed)
};
pub(crate) static STAMP: Opt<StampAt> = Opt {
    help: "Which instant of a scan its stamp is: its first point (`start`), the middle (`mid`) or its last point (`end`). \
           It matters where times of points count from the scan's first point. Default: start",
    ..Opt::text(PlaceAndTime, "stamp", "AT", "end", parsed)
};
pub(crate) static EXTRINSIC: Opt<Named<Extrinsic>> = Opt {
    is_many: true,
    is_signed: true,
    is_short_help: true,
    help: "body_from_sensor, the pose of the sensor on the body that the trajectory moves: X,Y,Z,QX,QY,QZ,QW in metres; \
           `identity`; `calib` or `calib:FILE` (KITTI); `frame:NAME` (/tf_static). Default: `auto`, from /tf_static where \
           messages name the body's frame, from KITTI's calib.txt where the body travels along its z, else identity",
    ..Opt::text(PlaceAndTime, "extrinsic", "[NAME=]EXTRINSIC", "a=0,0,0.28,0,0,0,1", parsed)
};
pub(crate) static MAX_TIME_GAP: Opt<i64> = Opt {
    sets: Some(|config, ns| config.max_time_gap_ns = Some(ns)),
    help: "Do not interpolate between poses further apart than this, seconds. Default: 1, or three times a trajectory's \
           median interval where that is longer",
    ..Opt::text(PlaceAndTime, "max-time-gap", "SECONDS", "500ms", values::interval_ns)
};
pub(crate) static TIME_OFFSET: Opt<Named<Offset>> = Opt {
    is_many: true,
    is_signed: true,
    sets: Some(|config, offset| {
        if let (None, _, Offset(ns)) = offset.parts() {
            config.time_offset_ns = *ns;
        }
    }),
    help: "Added to every stamp of the log before poses are looked up, seconds. Default: 0",
    ..Opt::text(PlaceAndTime, "time-offset", "[NAME=]SECONDS", "a=-0.05", parsed)
};
/// Where it is one for all.
pub(crate) static LOG_OFFSET: Opt<i64> = Opt {
    is_signed: true,
    sets: Some(|config, ns| config.time_offset_ns = ns),
    help: "Added to every stamp of the log before poses are looked up, seconds. Default: 0",
    ..Opt::text(PlaceAndTime, "time-offset", "SECONDS", "-0.05", values::seconds_ns)
};
pub(crate) static POSE_AT: Opt<Named<PoseAt>> = Opt {
    is_many: true,
    is_short_help: true,
    help: "At which instant of its scan a pose holds that has the scan's stamp, or none: `start`, `middle` or `end` of its \
           returns, or `stamp`. Default: stamp",
    ..Opt::text(PlaceAndTime, "pose-at", "[NAME=]INSTANT", "a=end", parsed)
};
pub(crate) static MEND: Opt<bool> = Opt {
    is_short_help: true,
    help: "Fix detected clock, extrinsic and pose-format errors. Default: report them only",
    ..Opt::switch(PlaceAndTime, "mend")
};
pub(crate) static TRUST: Opt<bool> = Opt {
    conflicts: &[&MEND],
    help: "Skip sanity checks; score every run as given",
    ..Opt::switch(PlaceAndTime, "trust")
};
pub(crate) static MADE_WITH: Opt<PathBuf> = Opt {
    help: "For a LAS or LAZ file in world coordinates: the trajectory it was made with. Points are moved back into the \
           sensor's frame",
    ..Opt::path(Input, "made-with", "TRAJECTORY", Role::Read)
};
pub(crate) static SCAN_PERIOD: Opt<i64> = Opt {
    requires: &[&MADE_WITH],
    help: "Length of the scans that such a file is cut into, seconds. Default: 0.1",
    ..Opt::text(Input, "scan-period", "SECONDS", "0.5", values::interval_ns)
};
/// The unit of stamps in a file that is no trajectory.
pub(crate) static TIME_UNIT: Opt<TimeUnit> = Opt {
    requires: &[&KEYFRAMES],
    help: "The unit of the stamps of --keyframes: s, ms, us or ns. Default: detected",
    ..Opt::text(Input, "time-unit", "UNIT", "us", parsed)
};
pub(crate) static KEYFRAMES: Opt<PathBuf> = Opt {
    help: "When the keyframes were: a line for each vertex, `ID SECONDS` or `SECONDS` in the order of the ids, or a TUM \
           trajectory. Default: the n-th scan of the log is the n-th vertex",
    ..Opt::path(Input, "keyframes", "TIMES", Role::Read)
};

/// How the scans of a log are read.
pub(crate) const READING: &[&dyn Entry] = &[&TOPIC, &POINT_TIME, &STAMP, &BIN_LAYOUT];
/// A log and its runs, and when and where their poses hold.
pub(crate) const RUNS_ON_LOG: &[&dyn Entry] = &[
    &LOG,
    &MORE_RUNS,
    &RUNS,
    &POSES_AS,
    &BETWEEN,
    &TOPIC,
    &POINT_TIME,
    &BIN_LAYOUT,
    &STAMP,
    &EXTRINSIC,
    &MAX_TIME_GAP,
    &TIME_OFFSET,
    &POSE_AT,
];
/// The same of one run.
pub(crate) const RUN_ON_LOG: &[&dyn Entry] = &[
    &LOG,
    &RUN,
    &POSES_AS,
    &BETWEEN,
    &TOPIC,
    &POINT_TIME,
    &BIN_LAYOUT,
    &STAMP,
    &EXTRINSIC,
    &MAX_TIME_GAP,
    &TIME_OFFSET,
    &POSE_AT,
];
/// What is done about wrong clocks, extrinsics and formats.
pub(crate) const CHECKS: &[&dyn Entry] = &[&MEND, &TRUST];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_points_have_a_unit_a_field_or_both() {
        let of = |text: &str| text.parse::<TimesOfPoints>();
        let times = |unit, field: Option<&str>| Ok(TimesOfPoints { unit, field: field.map(str::to_owned) });
        assert_eq!(of("ms"), times(PointTime::Relative(TimeUnit::Milliseconds), None));
        assert_eq!(of("curvature:ms"), times(PointTime::Relative(TimeUnit::Milliseconds), Some("curvature")));
        assert_eq!(of("sec + nsec:"), times(PointTime::Auto, Some("sec + nsec")));
        for (wrong, why) in
            [("", "is none of auto"), ("curvature", "is none of auto"), (":ms", "names no field")]
        {
            assert!(of(wrong).unwrap_err().contains(why), "{wrong}");
        }
    }
}
