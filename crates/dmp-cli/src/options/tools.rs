//! Options of `dmp map`, `shard`, `suite`, `compare`, `convert`, `info`, `man` and `completions`.

use std::path::PathBuf;

use clap_complete::Shell;
use dmp_log::MetricCrs;
use dmp_sensor::Isometry3;
use dmp_shard::{Part, ShardStage};
use dmp_suite::Failures;

use super::Group::{Cache, Input, Output, PlaceAndTime, Plain, Resources, Verdicts};
use super::values::{self, from_one, parsed};
use super::{Entry, Opt, Role, input, output};
use crate::files::{Compression, OutputFormat};
use crate::named::NamedFile;

pub(crate) static MAP: Opt<PathBuf> = Opt { help: "The map", ..Opt::argument("map", "MAP") };
pub(crate) static CLOUD: Opt<PathBuf> =
    Opt { help: "The cloud: .las, .laz, .copc.laz, .ply, .pcd or .e57", ..Opt::argument("cloud", "CLOUD") };
pub(crate) static CHECK_REPORT: Opt<PathBuf> = Opt {
    help: "Write a page, FILE.html: what was found, and where, on the map from above",
    ..Opt::path(Output, "report", "FILE", Role::Written)
};
pub(crate) static RUN_OF_MAP: Opt<NamedFile> = Opt {
    short: Some('t'),
    help: "The trajectory of a log, as for `dmp score`. Without one, LOG is a cloud or a mesh",
    ..Opt::file(Input, "trajectory", "RUN")
};
pub(crate) static BUILT: Opt<PathBuf> =
    Opt { help: "The map to write, FILE.dmpmap", ..Opt::output(Output, "MAP") };
pub(crate) static EXPORTED: Opt<PathBuf> =
    Opt { help: "The cloud to write: FILE.laz, .las, .ply or .pcd", ..Opt::output(Output, "FILE") };
pub(crate) static CRS: Opt<MetricCrs> = Opt {
    help: "The coordinate system that a .las or .laz names: `EPSG:CODE` or a well-known text, in metres. No coordinate changes",
    ..Opt::text(Plain, "crs", "CRS", "EPSG:32632", values::parsed)
};
pub(crate) static BOX: Opt<[f64; 4]> = Opt {
    is_signed: true,
    help: "Only surfels whose centres lie in this box, metres in the frame of the run's trajectory",
    ..Opt::text(Plain, "box", "XMIN,YMIN,XMAX,YMAX", "-20,-20,40,40", values::rectangle)
};

pub(crate) static PLAN: Opt<PathBuf> =
    Opt { help: "The folder of a plan, or its plan.json", ..Opt::argument("plan", "PLAN") };
pub(crate) static STAGE: Opt<ShardStage> = Opt {
    is_argument: true,
    is_needed: true,
    help: "The stage",
    ..Opt::words(
        Plain,
        "stage",
        "STAGE",
        &[
            ("fuse", ShardStage::Fuse),
            ("merge", ShardStage::Merge),
            ("cast", ShardStage::Cast),
            ("drift", ShardStage::Drift),
        ],
    )
};
pub(crate) static PART: Opt<Part> = Opt {
    is_needed: true,
    help: "Which part: `3/8` is the third of eight",
    ..Opt::text(Plain, "part", "I/N", "3/8", parsed)
};
pub(crate) static MOVED_LOG: Opt<PathBuf> = Opt {
    help: "The path of the log now. Default: the one it was planned at",
    ..Opt::path(Input, "log", "LOG", Role::Read)
};
pub(crate) static PLAN_FOLDER: Opt<PathBuf> = Opt {
    help: "Folder for the plan, and for the files of its parts; it is created if missing",
    ..Opt::output(Output, "FOLDER")
};
pub(crate) static CORES: Opt<u32> = Opt {
    help: "Cores for the parts, of all machines together: the plan suggests a number of parts for them. Default: 8",
    ..Opt::text(Resources, "cores", "N", "256", cores)
};

pub(crate) static SUITE: Opt<PathBuf> = Opt {
    unless: Some(&EXAMPLE),
    help: "The suite: a TOML file with versions, logs and options. docs/suite.md has every key",
    ..Opt::argument("suite", "SUITE")
};
pub(crate) static EXAMPLE: Opt<bool> = Opt {
    conflicts: &[&SUITE, &LIST, &output::JSON],
    help: "Print an example of a suite, and exit",
    ..Opt::switch(Plain, "example")
};
pub(crate) static FAILURES: Opt<Failures> = Opt {
    help: "What becomes of a version without a run on a log, or whose run is excluded, where another has one: `worse` (it loses \
           there) or `skip` (the log is not counted). Default: worse",
    ..Opt::text(Verdicts, "failures", "HOW", "skip", parsed)
};
pub(crate) static CACHE: Opt<PathBuf> = Opt {
    help: "The folder for results; it is created if missing. Default: .dmp-suite beside the suite",
    ..Opt::path(Cache, "cache", "FOLDER", Role::Scratch)
};
pub(crate) static LIST: Opt<bool> = Opt {
    conflicts: &[&output::JSON, &output::REPORT],
    help: "Score nothing: print as JSON the logs without a result in the cache, each with the command that scores it and the \
           file for its output",
    ..Opt::switch(Cache, "list")
};
pub(crate) static CACHED: Opt<bool> = Opt {
    conflicts: &[&LIST],
    help: "Score nothing: report the results in the cache, and skip logs without one",
    ..Opt::switch(Cache, "cached")
};
pub(crate) static DASK: Opt<String> = Opt {
    conflicts: &[&LIST, &CACHED],
    help: "Score on the Dask cluster whose scheduler has this address, several logs at once and large ones in parts. All workers \
           must see logs, runs and --work, which may be a URL (s3://); --memory and --threads are those of a task. Needs \
           pip install 'dmp-slam[dask]'",
    ..Opt::text(Resources, "dask", "ADDRESS", "tcp://HOST:8786", parsed)
};

pub(crate) static RESULTS: Opt<NamedFile> = Opt {
    is_argument: true,
    is_many: true,
    is_needed: true,
    help: "A result of `dmp score --keep` or `--json`. NAME (default: that of the file) is put before the name of a run that \
           another result has with other scores, as NAME/RUN",
    ..Opt::file(Plain, "results", "[NAME=]RESULT")
};
pub(crate) static COMPARE_THREADS: Opt<usize> = Opt {
    help: "Threads that compare returns of kept results. Default: one for each core",
    ..Opt::text(Resources, "threads", "N", "4", threads)
};

/// Of `dmp convert log`, for points in world coordinates.
pub(crate) static MAPPED_FROM: Opt<Isometry3<f64>> = Opt {
    requires: &[&input::MADE_WITH],
    is_signed: true,
    help: "With --made-with: body_from_sensor, metres and a quaternion. Default: identity",
    ..Opt::text(PlaceAndTime, "extrinsic", "X,Y,Z,QX,QY,QZ,QW", "0,0,1,0,0,0,1", values::transform)
};
pub(crate) static MAPPED_AT: Opt<i64> = Opt {
    requires: &[&input::MADE_WITH],
    is_signed: true,
    help: "With --made-with: added to the times of points before poses are looked up, seconds. Default: 0",
    ..Opt::text(PlaceAndTime, "time-offset", "SECONDS", "-18", values::seconds_ns)
};
pub(crate) static LOG_OUTPUT: Opt<PathBuf> =
    Opt { help: "FILE.mcap, or a folder; it must not exist", ..Opt::output(Output, "OUTPUT") };
pub(crate) static LOG_FORMAT: Opt<OutputFormat> = Opt {
    help: "The format: an MCAP file, or a folder of KITTI .bin, PCD, PLY, LAZ or LAS. Default: mcap where OUTPUT ends in .mcap, \
           else bin",
    ..Opt::words(
        Output,
        "to",
        "FORMAT",
        &[
            ("mcap", OutputFormat::Mcap),
            ("bin", OutputFormat::Bin),
            ("pcd", OutputFormat::Pcd),
            ("ply", OutputFormat::Ply),
            ("laz", OutputFormat::Laz),
            ("las", OutputFormat::Las),
        ],
    )
};
pub(crate) static COMPRESSION: Opt<Compression> = Opt {
    help: "Compression of an MCAP file: zstd makes the smallest, zstd-fast half the time for nearly the same, lz4 is faster to \
           write, none is fastest to read. Default: zstd",
    ..Opt::words(
        Output,
        "compression",
        "KIND",
        &[
            ("zstd", Compression::Zstd),
            ("zstd-fast", Compression::ZstdFast),
            ("lz4", Compression::Lz4),
            ("none", Compression::None),
        ],
    )
};
/// The formats of trajectories that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RunFormat {
    Tum,
    Kitti,
    Euroc,
    Redwood,
}
pub(crate) static RUN_FORMAT: Opt<RunFormat> = Opt {
    is_needed: true,
    help: "The format: TUM lines, KITTI rows, EuRoC lines, or Redwood .log blocks. Stamps of KITTI and Redwood go into times.txt \
           beside it",
    ..Opt::words(
        Output,
        "to",
        "FORMAT",
        &[
            ("tum", RunFormat::Tum),
            ("kitti", RunFormat::Kitti),
            ("euroc", RunFormat::Euroc),
            ("redwood", RunFormat::Redwood),
        ],
    )
};
pub(crate) static RUN_OUTPUT: Opt<PathBuf> =
    Opt { help: "The file to write", ..Opt::output(Output, "OUTPUT") };
pub(crate) static CONVERTED_RUN: Opt<PathBuf> = Opt {
    help: "The trajectory: TUM, KITTI rows, EuRoC, .npy, g2o, Redwood or csv with names of columns",
    ..Opt::argument("run", "RUN")
};

pub(crate) static SHELL: Opt<Shell> = Opt {
    is_argument: true,
    is_needed: true,
    help: "The shell",
    ..Opt::words(
        Plain,
        "shell",
        "SHELL",
        &[
            ("bash", Shell::Bash),
            ("elvish", Shell::Elvish),
            ("fish", Shell::Fish),
            ("powershell", Shell::PowerShell),
            ("zsh", Shell::Zsh),
        ],
    )
};
pub(crate) static COMMAND: Opt<String> = Opt {
    is_argument: true,
    is_many: true,
    help: "The command, as `score` or `map build`. Default: `dmp` itself",
    ..Opt::text(Plain, "command", "COMMAND", "score", parsed)
};
pub(crate) static PAGES: Opt<PathBuf> = Opt {
    short: Some('o'),
    conflicts: &[&COMMAND],
    help: "Write the pages of all commands into this folder, as dmp-score.1; it is created if missing",
    ..Opt::path(Plain, "output", "FOLDER", Role::Written)
};

/// A plan, and the log that it is of.
pub(crate) const PLANNED: &[&dyn Entry] = &[&PLAN, &MOVED_LOG];

fn cores(text: &str) -> Result<u32, String> {
    let cores = from_one(text).ok().filter(|cores| *cores <= 1_000_000);
    cores.ok_or_else(|| format!("`{text}` is not a number of cores from 1 to 1000000"))
}

fn threads(text: &str) -> Result<usize, String> {
    let threads = from_one(text).ok().filter(|threads| *threads <= 1024);
    threads.ok_or_else(|| format!("`{text}` is not a number of threads from 1 to 1024"))
}
