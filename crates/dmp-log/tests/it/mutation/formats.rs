//! Every format, with good files, what is around them, and its reader.

use std::fs;
use std::path::Path;

use super::readers::{self, Answer};
use super::seeds;
use crate::damage::{Form, others};
use crate::{depth_png, mesh, scan_folder};
use dmp_log::McapCompression::{Lz4, None as Unpacked, Zstd};

/// What checksums promise of the scans that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Checksums {
    None,
    /// Each is one that was written, or damage is named: a checksum of zero is none, and damage may make it so.
    OrDamage,
    /// Each is one that was written: what is packed has its own checksums.
    Always,
}

/// A format whose files are damaged.
pub(crate) struct Format {
    pub(crate) name: String,
    pub(crate) form: Form,
    /// Good files. Parts of one get into another.
    pub(crate) seeds: Vec<Vec<u8>>,
    pub(crate) checksums: Checksums,
    /// Where the damaged file is in a folder, and what is beside it.
    file: &'static str,
    beside: Vec<(String, Vec<u8>)>,
    reader: Reader,
}

/// Reads a file in a folder; the number of the run says with which options.
type Reader = fn(&Path, &Path, u64) -> Answer;

/// Name, form, file, good bytes, and what is beside them.
type InFolder<'a> = (&'static str, Form, &'static str, Vec<u8>, &'a [(&'a str, Vec<u8>)]);

impl Format {
    fn new(
        name: impl Into<String>,
        form: Form,
        (file, reader): (&'static str, Reader),
        seeds: Vec<Vec<u8>>,
    ) -> Self {
        Self { name: name.into(), form, seeds, checksums: Checksums::None, file, beside: Vec::new(), reader }
    }

    fn with(self, checksums: Checksums) -> Self {
        Self { checksums, ..self }
    }

    fn beside(self, files: &[(&str, Vec<u8>)]) -> Self {
        Self {
            beside: files.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.clone())).collect(),
            ..self
        }
    }

    /// Puts what is beside the damaged file into the folder.
    pub(crate) fn prepare(&self, folder: &Path) {
        for (name, bytes) in &self.beside {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }

    /// Reads a file in a prepared folder.
    pub(crate) fn read(&self, folder: &Path, bytes: &[u8], run: u64) -> Answer {
        let path = folder.join(self.file);
        fs::write(&path, bytes).unwrap();
        (self.reader)(folder, &path, run)
    }
}

/// One of them, or one whose reader fails.
pub(crate) fn named(name: &str) -> Format {
    if let Some(how) = name.strip_prefix("that_") {
        let reader = ("file", super::failing(how));
        return Format::new(name, Form::Bytes, reader, vec![vec![0; 100]]).with(Checksums::Always);
    }
    all().into_iter().find(|format| format.name == name).unwrap()
}

fn of_others(pattern: &str) -> Vec<Vec<u8>> {
    others(pattern).unwrap().into_iter().map(|(_, bytes)| bytes).collect()
}

/// Every format.
pub(crate) fn all() -> Vec<Format> {
    let mut all = logs();
    all.extend(folders());
    all.extend(clouds_and_meshes());
    all.extend(trajectories());
    all
}

fn logs() -> Vec<Format> {
    let mcap = |name: &str, seeds: Vec<Vec<u8>>| {
        Format::new(format!("mcap_{name}"), Form::Mcap, ("log.mcap", readers::log), seeds)
    };
    let own = |compression, pattern: &str| [seeds::own_mcap(compression), of_others(pattern)].concat();
    let db3 = [of_others("rosbag2/sqlite3/*.db3"), of_others("rosbag2/sqlite3_humble/*.db3")].concat();
    let yaml = ["mcap", "sqlite3"].map(|name| of_others(&format!("rosbag2/{name}/metadata.yaml"))).concat();
    let bags = [
        ("mcap.mcap", of_others("rosbag2/mcap/mcap.mcap").remove(0)),
        ("sqlite3.db3", of_others("rosbag2/sqlite3/sqlite3.db3").remove(0)),
    ];
    vec![
        mcap("zstd", own(Zstd, "mcap/velodyne_zstd.mcap")).with(Checksums::Always),
        mcap("lz4", own(Lz4, "mcap/velodyne_lz4.mcap")).with(Checksums::Always),
        mcap("none", own(Unpacked, "mcap/velodyne_none.mcap")).with(Checksums::OrDamage),
        mcap(
            "without_checksums",
            [seeds::without_checksums(), of_others("mcap/velodyne_no_crc.mcap")].concat(),
        ),
        mcap("of_others", of_others("mcap/*.mcap -two_clouds -poses -velodyne_z -velodyne_l -velodyne_none")),
        mcap("poses", [vec![seeds::log_with_poses()], seeds::ros1()].concat()),
        Format::new("rosbag1_packed", Form::Bytes, ("log.bag", readers::log), of_others("rosbag1/*_lz4.bag")),
        Format::new("rosbag1_bz2", Form::Bytes, ("log.bag", readers::log), of_others("rosbag1/*_bz2.bag")),
        Format::new("rosbag1", Form::Bytes, ("log.bag", readers::log), of_others("rosbag1/*_none.bag")),
        Format::new("db3", Form::Sqlite, ("log.db3", readers::log), db3),
        Format::new("metadata", Form::Text, ("metadata.yaml", readers::log_of_folder), yaml).beside(&bags),
    ]
}

/// A damaged scan behind a good one, and what is beside scans.
fn folders() -> Vec<Format> {
    let second = |name: String, form, file: &'static str, is_packed: bool, seeds: Vec<Vec<u8>>| {
        let reader = if is_packed { readers::second_packed_scan } else { readers::second_scan };
        let first = file.replacen('1', "0", 1);
        let mut beside = vec![(first.as_str(), seeds[0].clone())];
        if file == "1.png" {
            beside.push(("camera.json", depth_png::CAMERA_FILE.into()));
        }
        Format::new(name, form, (file, reader), seeds).beside(&beside)
    };
    let rows = scan_folder::rows();
    let mut all = vec![second("scan_bin".into(), Form::Bytes, "1.bin", false, vec![seeds::bin()])];
    for data in scan_folder::PCD {
        let seeds =
            [vec![scan_folder::pcd(&rows, data)], of_others(&format!("clouds/*_{data}.pcd"))].concat();
        let is_packed = data == "binary_compressed";
        all.push(second(format!("scan_pcd_{data}"), Form::Headed, "1.pcd", is_packed, seeds));
    }
    for format in scan_folder::PLY {
        let seeds =
            [vec![scan_folder::ply(&rows, format)], of_others(&ply_pattern("plyfile", format))].concat();
        all.push(second(format!("scan_ply_{format}"), Form::Headed, "1.ply", false, seeds));
    }
    for (name, file, format) in LAS {
        let file = if file == "las" { "1.las" } else { "1.laz" };
        all.push(second(format!("scan_{name}"), Form::Las, file, true, seeds::las_scan(file, format)));
    }
    all.push(second("scan_own_laz".into(), Form::Las, "1.laz", true, vec![seeds::own_laz_scan()]));
    all.push(second("scan_depth".into(), Form::Png, "1.png", true, depth_png::files()));
    let camera = || depth_png::CAMERA_FILE.as_bytes().to_vec();
    let images =
        [("depth/0.png", depth_png::image()), ("depth/1.png", depth_png::image()), ("camera.json", camera())];
    let scans = [
        ("scans/0.bin", seeds::bin()),
        ("scans/1.bin", seeds::bin()),
        ("times/0.f32", seeds::bin_times()),
        ("times/1.f32", seeds::bin_times()),
    ];
    let list = "# depth maps\r\n0.5 depth/0.png\r\n1.5\tdepth/1.png\r\n";
    let dated = "2011-09-26 13:02:25.964389445\n2011-09-26 13:02:26.067\n";
    let beside: [InFolder<'_>; 5] = [
        ("depth_list", Form::Text, "depth.txt", list.into(), &images),
        ("camera", Form::Json, "camera.json", camera(), &images),
        ("bin_times", Form::Bytes, "times/1.f32", seeds::bin_times(), &scans),
        ("times", Form::Text, "times.txt", "0.000000000e+00\r\n1.036e-01\r\n".into(), &scans),
        ("timestamps", Form::Text, "timestamps.txt", dated.into(), &scans),
    ];
    all.extend(beside.map(|(name, form, file, seed, beside)| {
        Format::new(name, form, (file, readers::log_of_folder), vec![seed]).beside(beside)
    }));
    all
}

/// Name, ending and point format.
const LAS: [(&str, &str, u8); 3] = [("las", "las", 1), ("laz", "laz", 1), ("layered_laz", "laz", 6)];

fn ply_pattern(start: &str, format: &str) -> String {
    let order = match format {
        "binary_little_endian" => "little",
        "binary_big_endian" => "big",
        ascii => ascii,
    };
    format!("clouds/{start}*_{order}.ply -mesh")
}

fn clouds_and_meshes() -> Vec<Format> {
    let mut all = Vec::new();
    for data in scan_folder::PCD {
        let seeds =
            [vec![scan_folder::pcd(&scan_folder::rows(), data)], of_others(&format!("clouds/*_{data}.pcd"))]
                .concat();
        all.push(Format::new(format!("map_pcd_{data}"), Form::Headed, ("map.pcd", readers::cloud), seeds));
    }
    for format in scan_folder::PLY {
        let own = scan_folder::ply(&scan_folder::rows(), format);
        let seeds = [vec![own], of_others(&ply_pattern("", format))].concat();
        all.push(Format::new(format!("map_ply_{format}"), Form::Headed, ("map.ply", readers::cloud), seeds));
    }
    for (name, ending, format) in LAS {
        let file = if ending == "las" { "map.las" } else { "map.laz" };
        let seeds = [seeds::las_scan(file, format), of_others(&format!("clouds/las_*.{ending}"))].concat();
        all.push(Format::new(format!("map_{name}"), Form::Las, (file, readers::cloud), seeds));
        let seeds = seeds::world(file, format);
        all.push(Format::new(format!("world_{name}"), Form::Las, (file, readers::world), seeds));
    }
    all.push(Format::new("map_e57", Form::Headed, ("map.e57", readers::cloud), of_others("clouds/*.e57")));
    all.push(Format::new("map_copc", Form::Las, ("map.laz", readers::cloud), of_others("clouds/*.copc.laz")));
    for (name, own) in mesh::files() {
        let (form, file, pattern) = match name {
            "text.ply" => (Form::Text, "mesh.ply", "mesh/*ascii.ply"),
            "little.ply" => (Form::Headed, "mesh.ply", "mesh/*binary.ply"),
            "big.ply" => (Form::Headed, "mesh.ply", "clouds/mesh*big.ply"),
            _ => (Form::Text, "mesh.obj", "mesh/*.obj"),
        };
        let seeds = [vec![own], of_others(pattern)].concat();
        all.push(Format::new(format!("mesh_{name}"), form, (file, readers::mesh), seeds));
    }
    all
}

fn trajectories() -> Vec<Format> {
    let run = |name: &str, form, own: &[&str], theirs: &str| {
        let own = own.iter().map(|text| text.as_bytes().to_vec());
        let theirs =
            if theirs.is_empty() { Vec::new() } else { of_others(&format!("trajectories/{theirs}")) };
        Format::new(name, form, ("run.txt", readers::trajectory), own.chain(theirs).collect())
    };
    let graph = "VERTEX_SE3:QUAT 7 1 2 3 0 0 0 1\nVERTEX_SE2 9 1 2 3\nEDGE_SE2 7 9 1\n";
    let named = "secs,nsecs,x,y,z,qw,qx,qy,qz\n1,5,1,2,3,1,0,0,0\n2,5,1,2,3,1,0,0,0\n";
    let rostopic = "# made by hand\n#timestamp [ms];tx;ty;tz;qx;qy;qz;qw;frame\n\
        1700000000123;1;2;3;0;0;0;1;map\n1700000000223;1;2;3;0;0;0;1;\n";
    let kitti = "1 0 0 5 0 1 0 6 0 0 1 7\n".repeat(5);
    let redwood = "0 0 1\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n".repeat(5);
    let calib = "P0: 1 2\nTr: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n";
    let labels = "from,to,label,kind\n12,400,true,near\n3\t90 NO # far\n400 12 1\r\n";
    let keyframes = [
        vec![b"id stamp\n7 1.75\n-2 0.5\n3,1.000000001\n".to_vec()],
        of_others("trajectories/times.txt"),
        of_others("trajectories/evo.tum"),
    ];
    let text = |name: &str, reader, seeds| Format::new(name, Form::Text, reader, seeds);
    vec![
        run("tum", Form::Text, &["1.5 1 2 3 0 0 0 1\n2.5 1 2 3 0 0 0 1\n"], "*.tum"),
        run("kitti", Form::Text, &[&kitti], "evo_kitti.txt"),
        run("euroc", Form::Text, &[], "state_groundtruth.csv"),
        run("csv", Form::Text, &[named, rostopic], ""),
        run("redwood", Form::Text, &[&redwood], ""),
        run("npy", Form::Headed, &[], "*.npy -not_poses"),
        run("g2o", Form::Text, &[graph], "*.g2o"),
        text("pose_graph", ("graph.g2o", readers::graph), seeds::pose_graphs()),
        text("loop_labels", ("labels.csv", readers::loop_labels), vec![labels.into()]),
        text("keyframe_times", ("keyframes.txt", readers::keyframe_times), keyframes.concat()),
        text("trajectory_times", ("times.txt", readers::times), vec![b"0\n0.1\n0.2\n0.3\n0.4\n".to_vec()])
            .beside(&[("run.txt", kitti.into_bytes())]),
        text("calib", ("calib.txt", readers::calib), vec![calib.into()]),
    ]
}
