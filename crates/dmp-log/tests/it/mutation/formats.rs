use super::seeds;
use crate::common::{self, Channel, POINTS};
use crate::scan_folder;
use crate::topics::{ODOMETRY, PATH, POSES, TF};
use dmp_log::McapCompression::{Lz4, None as Unpacked, Zstd};
use std::fs;
use std::path::Path;

/// How a file is read.
#[derive(Debug, Clone, Copy)]
pub(super) enum Reader {
    /// A log with this file name, its poses too.
    Log(&'static str),
    /// A message in a log.
    Message(Channel<'static>),
    /// The metadata of a folder with a bag in MCAP and one in `SQLite`.
    Metadata,
    /// The second of two files with a scan each, with this extension. `is_packed`: whether damage may show
    /// only when a scan is read.
    SecondScan {
        extension: &'static str,
        is_packed: bool,
    },
    /// A file of this name beside a folder of two `.bin` scans.
    BesideScans(&'static str),
    /// A file of this name beside a folder of two depth images.
    BesideImages(&'static str),
    /// A LAS file in world coordinates, with this name.
    World(&'static str),
    /// A map with this file name.
    Cloud(&'static str),
    /// A mesh with this file name.
    Mesh(&'static str),
    /// A trajectory with this file name.
    Trajectory(&'static str),
    /// A pose graph, and loop candidates for it or one like it.
    Graph,
    /// Labels of loop candidates.
    LoopLabels,
    /// Times of the vertices of a graph.
    KeyframeTimes,
    /// The `times.txt` of a trajectory.
    Times,
    Calib,
    /// Answers well until a certain run.
    Failing(Failure),
}

/// What a reader should not do.
#[derive(Debug, Clone, Copy)]
pub(super) enum Failure {
    Panics,
    Allocates,
    Hangs,
    IsWrong,
}

/// What checksums promise of the scans that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Checksums {
    None,
    /// Each is one that was written, or damage is named: a checksum of zero is none, and damage may make it so.
    OrDamage,
    /// Each is one that was written: what is packed has checksums of its own.
    Always,
}

/// A format whose files are damaged.
pub(super) struct Format {
    pub(super) name: String,
    /// Good files. Parts of one get into another.
    pub(super) seeds: Vec<Vec<u8>>,
    pub(super) reader: Reader,
    pub(super) checksums: Checksums,
}

impl Format {
    fn new(name: impl Into<String>, reader: Reader, seeds: Vec<Vec<u8>>) -> Self {
        Self { name: name.into(), seeds, reader, checksums: Checksums::None }
    }

    fn with(self, checksums: Checksums) -> Self {
        Self { checksums, ..self }
    }

    /// Puts what stands around the damaged file into the folder.
    pub(super) fn prepare(&self, folder: &Path) {
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        };
        match self.reader {
            Reader::Metadata => {
                for name in ["mcap/mcap.mcap", "sqlite3/sqlite3.db3"] {
                    let file = name.rsplit('/').next().unwrap();
                    write(file, &seeds::of_others(&format!("rosbag2/{name}")));
                }
            }
            Reader::SecondScan { extension, .. } => {
                write(&format!("0.{extension}"), &self.seeds[0]);
                if extension == "png" {
                    write("camera.json", crate::depth_png::CAMERA_FILE.as_bytes());
                }
            }
            Reader::BesideImages(_) => {
                (0..2).for_each(|k| write(&format!("depth/{k}.png"), &crate::depth_png::image()));
                write("camera.json", crate::depth_png::CAMERA_FILE.as_bytes());
            }
            Reader::BesideScans(_) => {
                for k in 0..2 {
                    write(&format!("scans/{k}.bin"), &seeds::bin());
                    write(&format!("times/{k}.f32"), &seeds::bin_times());
                }
            }
            Reader::Times => write("run.txt", "1 0 0 5 0 1 0 6 0 0 1 7\n".repeat(5).as_bytes()),
            _ => {}
        }
    }
}

/// Every format.
pub(super) fn all() -> Vec<Format> {
    let mut all = logs();
    all.extend(messages());
    all.extend(folders());
    all.extend(clouds_and_meshes());
    all.extend(trajectories());
    all
}

/// One of them, or one whose reader fails.
pub(super) fn named(name: &str) -> Format {
    let failing = |failure| Format::new(name, Reader::Failing(failure), vec![vec![0; 100]]);
    match name {
        "that_panics" => failing(Failure::Panics),
        "that_allocates" => failing(Failure::Allocates),
        "that_hangs" => failing(Failure::Hangs),
        "that_is_wrong" => failing(Failure::IsWrong).with(Checksums::Always),
        _ => all().into_iter().find(|format| format.name == name).unwrap(),
    }
}

fn logs() -> Vec<Format> {
    let mcap = |name: &str, seeds| Format::new(format!("mcap_{name}"), Reader::Log("log.mcap"), seeds);
    let theirs = |names: &[&str]| -> Vec<Vec<u8>> {
        names.iter().map(|name| seeds::of_others(&format!("mcap/{name}.mcap"))).collect()
    };
    let with = |mut own: Vec<Vec<u8>>, names: &[&str]| {
        own.extend(theirs(names));
        own
    };
    let bag = |name: &str| seeds::of_others(&format!("rosbag2/{name}"));
    vec![
        mcap("zstd", with(seeds::own_mcap(Zstd), &["velodyne_zstd"])).with(Checksums::Always),
        mcap("lz4", with(seeds::own_mcap(Lz4), &["velodyne_lz4"])).with(Checksums::Always),
        mcap("none", with(seeds::own_mcap(Unpacked), &["velodyne_none"])).with(Checksums::OrDamage),
        mcap("unchunked", theirs(&["velodyne_unchunked"])),
        mcap("without_summary", theirs(&["velodyne_no_summary", "velodyne_unchunked_no_summary"])),
        mcap("without_checksums", with(seeds::without_checksums(), &["velodyne_no_crc"])),
        mcap(
            "of_others",
            theirs(&[
                "big_endian",
                "hesai",
                "livox",
                "livox_custom",
                "ouster_nan",
                "robosense",
                "velodyne_rosbags",
                "velodyne_rosbags_zstd",
            ]),
        ),
        mcap("poses", with(vec![seeds::log_with_poses()], &[])),
        Format::new(
            "db3",
            Reader::Log("log.db3"),
            vec![bag("sqlite3/sqlite3.db3"), bag("sqlite3_humble/sqlite3_humble.db3")],
        ),
        Format::new(
            "metadata",
            Reader::Metadata,
            vec![bag("mcap/metadata.yaml"), bag("sqlite3/metadata.yaml")],
        ),
    ]
}

fn messages() -> Vec<Format> {
    const LIVOX: Channel<'_> = ("/livox", "livox_ros_driver2/msg/CustomMsg", "cdr");
    const ROS1_POINTS: Channel<'_> = ("/points", "sensor_msgs/PointCloud2", "ros1");
    const ROS1_LIVOX: Channel<'_> = ("/livox", "livox_ros_driver/CustomMsg", "ros1");
    const ROS1_ODOMETRY: Channel<'_> = ("/odom", "nav_msgs/Odometry", "ros1");
    let of =
        |name: &str, channel, seeds| Format::new(format!("message_{name}"), Reader::Message(channel), seeds);
    vec![
        of("point_cloud2", POINTS, seeds::messages("PointCloud2")),
        of("livox", LIVOX, seeds::messages("CustomMsg")),
        of("odometry", ODOMETRY, seeds::messages("Odometry")),
        of("pose", POSES, seeds::messages("PoseStamped")),
        of("path", PATH, seeds::messages("Path")),
        of("tf", TF, seeds::messages("TFMessage")),
        of("ros1_point_cloud2", ROS1_POINTS, vec![seeds::ros1_point_cloud2()]),
        of("ros1_livox", ROS1_LIVOX, vec![seeds::ros1_livox()]),
        of("ros1_odometry", ROS1_ODOMETRY, vec![seeds::ros1_odometry()]),
    ]
}

fn folders() -> Vec<Format> {
    let second = |name: &str, extension, is_packed, seeds| {
        Format::new(format!("scan_{name}"), Reader::SecondScan { extension, is_packed }, seeds)
    };
    let rows = scan_folder::rows();
    let mut all = vec![second("bin", "bin", false, vec![seeds::bin()])];
    for data in scan_folder::PCD {
        let mut seeds = vec![scan_folder::pcd(&rows, data)];
        seeds.extend(seeds::clouds_of_others(|name| name.ends_with(&format!("_{data}.pcd"))));
        all.push(second(&format!("pcd_{data}"), "pcd", data == "binary_compressed", seeds));
    }
    for format in scan_folder::PLY {
        let mut seeds = vec![scan_folder::ply(&rows, format)];
        let ending = format!("_{}.ply", format.rsplit('_').nth(1).unwrap_or(format));
        seeds.extend(seeds::clouds_of_others(|name| name.starts_with("plyfile") && name.ends_with(&ending)));
        all.push(second(&format!("ply_{format}"), "ply", false, seeds));
    }
    for kind in seeds::LAS {
        all.push(second(kind.name, kind.extension(), true, seeds::las_scan(kind)));
    }
    let own = seeds::own_laz_scan();
    all.push(second("own_laz", "laz", true, vec![own]));
    all.push(second("depth", "png", true, crate::depth_png::files()));
    let beside = |name: &'static str, seed: &str| {
        Format::new(name.replace('.', "_"), Reader::BesideImages(name), vec![seed.into()])
    };
    all.push(beside("depth.txt", "# depth maps\r\n0.5 depth/0.png\r\n1.5\tdepth/1.png\r\n"));
    all.push(beside("camera.json", crate::depth_png::CAMERA_FILE));
    let beside = |name: &str, file, seed: Vec<u8>| Format::new(name, Reader::BesideScans(file), vec![seed]);
    all.push(beside("bin_times", "times/1.f32", seeds::bin_times()));
    all.push(beside("times", "times.txt", b"0.000000000e+00\r\n1.036e-01\r\n".to_vec()));
    let dated = b"2011-09-26 13:02:25.964389445\n2011-09-26 13:02:26.067\n";
    all.push(beside("timestamps", "timestamps.txt", dated.to_vec()));
    all
}

fn clouds_and_meshes() -> Vec<Format> {
    let mut all = Vec::new();
    for data in scan_folder::PCD {
        let mut seeds = vec![crate::pcd::file(data, 20)];
        seeds.extend(seeds::clouds_of_others(|name| name.ends_with(&format!("{data}.pcd"))));
        all.push(Format::new(format!("map_pcd_{data}"), Reader::Cloud("map.pcd"), seeds));
    }
    for format in scan_folder::PLY {
        let mut seeds = vec![scan_folder::ply(&scan_folder::rows(), format)];
        let ending = format!("_{}.ply", format.rsplit('_').nth(1).unwrap_or(format));
        seeds.extend(seeds::clouds_of_others(|name| name.ends_with(&ending) && !name.contains("mesh")));
        all.push(Format::new(format!("map_ply_{format}"), Reader::Cloud("map.ply"), seeds));
    }
    for kind in seeds::LAS {
        all.push(Format::new(format!("map_{}", kind.name), Reader::Cloud(kind.file), seeds::las(kind)));
        all.push(Format::new(format!("world_{}", kind.name), Reader::World(kind.file), seeds::world(kind)));
    }
    let copc = seeds::clouds_of_others(|name| name.ends_with(".copc.laz"));
    all.push(Format::new("map_copc", Reader::Cloud("map.laz"), copc));
    for (name, own) in crate::mesh::files() {
        let (kind, extension) = name.rsplit_once('.').unwrap();
        let (file, theirs) = match extension {
            "ply" => ("mesh.ply", seeds::meshes_of_others(kind)),
            _ => ("mesh.obj", seeds::meshes_of_others("obj")),
        };
        let seeds = [vec![own], theirs].concat();
        all.push(Format::new(format!("mesh_{extension}_{kind}").to_lowercase(), Reader::Mesh(file), seeds));
    }
    all
}

fn trajectories() -> Vec<Format> {
    let of = |name: &str, own: Vec<Vec<u8>>, theirs: &[&str]| {
        let theirs = theirs.iter().map(|name| seeds::of_others(&format!("trajectories/{name}")));
        Format::new(name, Reader::Trajectory("run.txt"), own.into_iter().chain(theirs).collect())
    };
    let text = |line: &str| vec![line.repeat(5).into_bytes()];
    let graph = "VERTEX_SE3:QUAT 7 1 2 3 0 0 0 1\nVERTEX_SE2 9 1 2 3\nEDGE_SE2 7 9 1\n";
    let npy = ["poses", "poses_big", "poses_f32", "poses_f32_big_fortran", "poses_fortran", "poses_version2"];
    let npy = npy.map(|name| format!("{name}.npy"));
    let named = "secs,nsecs,x,y,z,qw,qx,qy,qz\n1,5,1,2,3,1,0,0,0\n2,5,1,2,3,1,0,0,0\n";
    let rostopic = "# made by hand\n#timestamp [ms];tx;ty;tz;qx;qy;qz;qw;frame\n\
        1700000000123;1;2;3;0;0;0;1;map\n1700000000223;1;2;3;0;0;0;1;\n";
    let calib = "P0: 1 2\nTr: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n";
    let labels = "from,to,label,kind\n12,400,true,near\n3\t90 NO # far\n400 12 1\r\n";
    vec![
        of("tum", text("1.5 1 2 3 0 0 0 1\n"), &["evo.tum", "nine_decimals.tum"]),
        of("kitti", text("1 0 0 5 0 1 0 6 0 0 1 7\n"), &["evo_kitti.txt"]),
        of("euroc", vec![], &["state_groundtruth.csv"]),
        of("csv", vec![named.into(), rostopic.into()], &[]),
        of("redwood", text("0 0 1\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n"), &[]),
        of("npy", vec![], &npy.each_ref().map(String::as_str)),
        of("g2o", vec![graph.into()], &["gtsam.g2o", "gtsam_flat.g2o"]),
        Format::new("pose_graph", Reader::Graph, seeds::pose_graphs()),
        Format::new("loop_labels", Reader::LoopLabels, vec![labels.into()]),
        Format::new("keyframe_times", Reader::KeyframeTimes, seeds::keyframe_times()),
        Format::new("trajectory_times", Reader::Times, vec![b"0\n0.1\n0.2\n0.3\n0.4\n".to_vec()]),
        Format::new("calib", Reader::Calib, vec![calib.into()]),
    ]
}

/// A scan that nothing was damaged in.
pub(super) fn a_scan() -> dmp_sensor::Scan {
    common::scan(0, 3, false)
}
