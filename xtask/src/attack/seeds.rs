//! The seeds: small undamaged files of every format that is read, and the commands that read them.

use std::path::Path;

use crate::trials::damage::mcap::{CHUNK, Chunk, DATA_END, FOOTER, Record, file_of, of_file};
use crate::trials::{Call, File, Shop};

/// Files that belong together, and what reads them.
#[derive(Debug)]
pub(super) struct Seed {
    pub(super) files: Vec<File>,
    pub(super) calls: Vec<Call>,
    /// Checksums guard what the scores are made of: a wrong byte changes no score without a warning.
    pub(super) is_guarded: bool,
}

/// A kind of input.
#[derive(Debug)]
pub(super) struct Kind {
    pub(super) name: &'static str,
    pub(super) seeds: Vec<Seed>,
}

/// Seeds of a kind: one for each of `each` (see [`Shop::each`]), which stands for `{}` in all else. `made` are commands that
/// make its files, `files` what [`Shop::files`] reads, `calls` the commands that are tried.
struct Row {
    kind: &'static str,
    each: &'static str,
    made: &'static [&'static str],
    files: &'static str,
    calls: &'static [&'static str],
    is_guarded: bool,
}

impl Row {
    const fn new(
        kind: &'static str,
        each: &'static str,
        files: &'static str,
        calls: &'static [&'static str],
    ) -> Self {
        Self { kind, each, made: &[], files, calls, is_guarded: false }
    }

    const fn made(self, made: &'static [&'static str]) -> Self {
        Self { made, ..self }
    }

    const fn guarded(self) -> Self {
        Self { is_guarded: true, ..self }
    }
}

const MCAP: &[&str] = &[
    "info log.mcap",
    "info log.mcap -t t.tum --json",
    "score log.mcap -t t.tum --json --quiet",
    "score log.mcap -t t.tum",
    "map build log.mcap -t t.tum -o out.dmpmap => map verify out.dmpmap",
    "convert log log.mcap -o out.mcap => info out.mcap",
    "calibrate log.mcap -t t.tum --json",
    "drift log.mcap -t t.tum --json --trust",
];
const INFO: &[&str] = &["info log.mcap", "info log.mcap --json"];
const SCANS: &[&str] =
    &["info scans --json", "convert log scans --point-time ignore -o out --to ply => info out"];
const BUILD: &[&str] = &["map build {} -o out.dmpmap => map verify out.dmpmap"];
const TRAJECTORY: &[&str] = &[
    "info t.mcap -t {}/run.txt --json",
    "score t.mcap -t {}/run.txt --json --quiet",
    "map build t.mcap -t {}/run.txt -o out.dmpmap => map verify out.dmpmap",
    "convert trajectory {}/run.txt -o out.tum --to tum",
];
const MESH: &[&str] = &[
    // A mesh may be as large as it says: memory is what it may not take.
    "map build {} -o out.dmpmap --memory 256MiB => map verify out.dmpmap",
    "truth smd {} map.dmpmap --json",
];

const ROWS: &[Row] = &[
    Row::new("MCAP", "zstd lz4 none zstd-cut lz4-cut none-cut", "{}.mcap=log.mcap: t.tum", MCAP).guarded(),
    Row::new(
        "MCAP, quick",
        "-",
        "r.mcap: r.tum",
        &[
            "score r.mcap -t r.tum --quick --json --quiet",
            "score r.mcap -t r.tum --every 8 --json --quiet --residuals out.ply => writes out.ply",
        ],
    )
    .guarded(),
    Row::new("MCAP of others", "@mcap/*.mcap", "{}=log.mcap:", INFO),
    Row::new(
        "MCAP of others",
        "@mcap/*.mcap -two_clouds",
        "{}=log.mcap:",
        &["convert log log.mcap -o out.mcap => info out.mcap"],
    ),
    Row::new(
        "MCAP of others",
        "@mcap/poses*.mcap",
        "{}=log.mcap:",
        &[
            "score log.mcap -t topic:/odom --json --quiet",
            "info log.mcap -t topic:/tf --json",
            "info log.mcap -t topic:/slam/path --json",
            "score log.mcap -t topic:/slam/pose --extrinsic frame:base_link --json --quiet",
        ],
    ),
    Row::new(
        "rosbag2",
        "sqlite3 sqlite3_split mcap",
        "others/rosbag2/{}/=bag/:",
        &[
            "info bag --json",
            "score bag -t topic:/pose --json --quiet",
            "convert log bag -o out.mcap => info out.mcap",
        ],
    ),
    Row::new(
        "rosbag2",
        "-",
        "others/rosbag2/sqlite3/sqlite3.db3=log.db3:",
        &[
            "info log.db3 --json",
            "score log.db3 -t topic:/pose --json --quiet",
            "convert log log.db3 -o out --to pcd => info out",
        ],
    ),
    Row::new("ROS 1 bag", "@rosbag1/*.bag", "{}=log.bag:", &["info log.bag --json", "info log.bag"]),
    Row::new(
        "ROS 1 bag",
        "@rosbag1/poses*.bag",
        "{}=log.bag:",
        &[
            "score log.bag -t topic:/odom --json --quiet",
            "info log.bag -t topic:/tf --json",
            "convert log log.bag -o out.mcap => info out.mcap",
        ],
    ),
    folder("folder of .bin", "bin"),
    folder("folder of .pcd", "pcd"),
    folder("folder of .ply", "ply"),
    folder("folder of .las", "las"),
    folder("folder of .laz", "laz"),
    Row::new("folder of .pcd", "@clouds/*_compressed.pcd", "{}=scans/0.pcd:", SCANS),
    Row::new("folder of .pcd", "@clouds/open3d_ascii.pcd", "{}=scans/0.pcd:", SCANS),
    Row::new("folder of .ply", "@clouds/*_big.ply -mesh", "{}=scans/0.ply:", SCANS),
    Row::new("folder of .ply", "@clouds/plyfile_float64_ascii.ply", "{}=scans/0.ply:", SCANS),
    Row::new(
        "LAS and LAZ in world coordinates",
        "las laz",
        "world.{}: t.tum",
        &["convert log world.{} --made-with t.tum -o out.mcap => info out.mcap"],
    )
    .made(&["score t.mcap -t t.tum --residuals world.{} --quiet"]),
    Row::new(
        "depth images",
        "-",
        // The surface and the trajectories are kinds of their own.
        "room/depth/: room/depth.txt: room/camera.json: room/groundtruth.txt",
        &[
            "info room --json",
            "score room -t room/groundtruth.txt --json --quiet",
            "map build room -t room/groundtruth.txt -o out.dmpmap => map verify out.dmpmap",
            "convert log room -o out.mcap => info out.mcap",
        ],
    ),
    Row::new("TUM", "tum", "{}/run.txt: t.mcap", TRAJECTORY),
    Row::new(
        "TUM",
        "tum",
        "{}/run.txt: t.tum",
        &[
            "truth ape t.tum {}/run.txt --json",
            "truth rpe t.tum {}/run.txt --json",
            "simulate errors {}/run.txt --drift-ate 1 -o out.tum",
        ],
    ),
    Row::new("EuRoC", "euroc", "{}/run.txt: t.mcap", TRAJECTORY),
    Row::new(
        "trajectory, --between",
        "tum euroc",
        "{}/run.txt: t.mcap t.tum",
        &["score t.mcap -t {}/run.txt -t t.tum --between run=t.tum --json --quiet"],
    ),
    // Their stamps are beside them.
    Row::new("KITTI poses", "kitti", "{}/run.txt: {}/times.txt: t.mcap", TRAJECTORY),
    Row::new("Redwood", "redwood", "{}/run.txt: {}/times.txt: t.mcap", TRAJECTORY),
    Row::new(
        "npy",
        "@trajectories/*.npy -not_poses",
        "{}=run.npy: t.mcap",
        &["convert trajectory run.npy -o out.txt --to kitti", "info t.mcap -t run.npy --json"],
    ),
    Row::new(
        "g2o poses",
        "@trajectories/*.g2o",
        "{}=run.g2o: t.mcap",
        &["convert trajectory run.g2o -o out.txt --to kitti", "info t.mcap -t run.g2o --json"],
    ),
    Row::new(
        "calibration",
        "calib.txt raw.txt",
        "t.mcap t.tum {}:",
        &["score t.mcap -t t.tum --extrinsic calib:{} --json --quiet"],
    ),
    // It is read without being named.
    Row::new("calibration", "calib.txt", "t.mcap t.tum {}:", &["score t.mcap -t t.tum --json --quiet"]),
    Row::new(
        "pose graph",
        "-",
        "q.mcap loops/graph.g2o: loops/candidates.g2o: loops/labels.csv: loops/keyframes.txt:",
        &[
            "loops loops/graph.g2o --candidates loops/candidates.g2o --json --quiet",
            "loops loops/graph.g2o --candidates loops/candidates.g2o --log q.mcap --keyframes loops/keyframes.txt \
             --truth loops/labels.csv --json --quiet",
            "loops loops/graph.g2o --candidates loops/candidates.g2o --accept --save-graph out.g2o => writes out.g2o",
        ],
    ),
    Row::new(
        "saved result",
        "-",
        "t.mcap t.tum one.json: other.json:",
        &[
            "compare one.json other.json --json",
            "compare one.json other.json -v",
            "compare one.json other.json --report out.html => writes out.html",
            "compare one.json --expect R_cv_10<9m",
        ],
    ),
    Row::new(
        ".dmpmap",
        "-",
        "map.dmpmap: t.mcap t.tum reference.ply",
        &[
            "map info map.dmpmap",
            "map info map.dmpmap --json",
            "map verify map.dmpmap",
            "map export map.dmpmap -o out.ply",
            "map export map.dmpmap -o out.las",
            "score t.mcap -t t.tum --map map.dmpmap --json --quiet",
            "truth smd reference.ply map.dmpmap --json",
        ],
    )
    .made(&["map export map.dmpmap -o reference.ply"])
    .guarded(),
    cloud("PCD, PLY map", "cloud.pcd cloud.ply"),
    cloud("LAS map", "cloud.las"),
    cloud("LAZ map", "cloud.laz"),
    Row::new("PCD, PLY map", "cloud.ply", "{}:", &["truth smd {} {} --json"]),
    Row::new("LAS map", "cloud.las", "{}:", &["truth smd {} {} --json"]),
    Row::new("LAZ map", "cloud.laz", "{}:", &["truth smd {} {} --json"]),
    Row::new("PCD, PLY map", "@clouds/*.pcd", "{}:", BUILD),
    Row::new("PCD, PLY map", "@clouds/*.ply -mesh", "{}:", BUILD),
    Row::new("LAS map", "@clouds/*.las", "{}:", BUILD),
    // Degrees are refused whole.
    Row::new("LAZ map", "@clouds/*.laz -degrees", "{}:", BUILD),
    mesh("@mesh/*.obj"),
    mesh("@mesh/*.ply"),
    mesh("@clouds/mesh*.obj"),
    mesh("@clouds/mesh*.ply"),
];

/// The town in a folder.
const fn folder(kind: &'static str, to: &'static str) -> Row {
    let calls = &[
        "info {} --json",
        "score {} -t t.tum --json --quiet",
        "map build {} -t t.tum -o out.dmpmap => map verify out.dmpmap",
        "convert log {} -o out.mcap => info out.mcap",
    ];
    Row::new(kind, to, "{}/: t.tum", calls).made(&["convert log t.mcap -o {} --to {}"])
}

/// A cloud of the town.
const fn cloud(kind: &'static str, each: &'static str) -> Row {
    let calls = &[
        "map build {} -o out.dmpmap => map verify out.dmpmap",
        "score t.mcap -t t.tum --map {} --json --quiet",
    ];
    Row::new(kind, each, "{}: t.mcap t.tum", calls).made(&["score t.mcap -t t.tum --residuals {} --quiet"])
}

/// A mesh, with a map of it to measure.
const fn mesh(each: &'static str) -> Row {
    Row::new("mesh", each, "{}: {}.dmpmap=map.dmpmap", MESH).made(&["map build {} -o {}.dmpmap"])
}

/// The kinds that are wanted, with their seeds.
pub(super) fn kinds(dmp: &Path, wants: impl Fn(&str) -> bool) -> anyhow::Result<Vec<Kind>> {
    let shop = Shop::open(dmp)?;
    make(&shop)?;
    let mut kinds: Vec<Kind> = Vec::new();
    for row in ROWS.iter().filter(|row| wants(row.kind)) {
        let words = if row.each.starts_with('@') { vec![row.each] } else { row.each.split(' ').collect() };
        for each in words.into_iter().map(Shop::each).collect::<anyhow::Result<Vec<_>>>()?.concat() {
            let of = |text: &str| text.replace("{}", &each);
            row.made.iter().try_for_each(|line| shop.make(&of(line)).map(drop))?;
            let calls = row.calls.iter().map(|line| Call::new(&of(line))).collect();
            let seed = Seed { files: shop.files(&of(row.files))?, calls, is_guarded: row.is_guarded };
            match kinds.iter_mut().find(|kind| kind.name == row.kind) {
                Some(kind) => kind.seeds.push(seed),
                None => kinds.push(Kind { name: row.kind, seeds: vec![seed] }),
            }
        }
    }
    Ok(kinds)
}

/// What several rows read, and what no command makes.
fn make(shop: &Shop<'_>) -> anyhow::Result<()> {
    let put = |path: &str, bytes| shop.put(File { path: path.into(), bytes, form: None });
    // As a log is written, and as a killed recorder leaves it: in small chunks without a summary.
    for packing in ["zstd", "lz4", "none"] {
        shop.make(&format!("convert log t.mcap -o {packing}.mcap --compression {packing}"))?;
        put(&format!("{packing}-cut.mcap"), in_chunks(&shop.read(&format!("{packing}.mcap"))?)?)?;
    }
    // A pose for each scan, so that rows without stamps belong to scans.
    shop.make(
        "simulate town -o s.mcap --truth scans.tum --truth-rate 2 --seed 1 --scans 16 --rate 2 --speed 7 --beams 8 \
         --elevation=-14,6 --azimuth-steps 48 --max-range 60 --resolution 0.0625",
    )?;
    for format in ["tum", "euroc", "kitti", "redwood"] {
        // Outputs do not make their folders, pages do.
        shop.make(&format!("man -o {format}"))?;
        shop.make(&format!("convert trajectory scans.tum -o {format}/run.txt --to {format}"))?;
    }
    let result = |run: &str| shop.make(&format!("score t.mcap -t {run} -t again=t.tum --json --quiet"));
    put("one.json", result("one=t.tum")?)?;
    put("other.json", result("other=t.tum")?)?;
    put("calib.txt", b"P0: 718 0 607 0 0 718 185 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n".to_vec())?;
    put("raw.txt", b"calib_time: 15-Mar-2012 11:37:16\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.1 -0.3\n".to_vec())
}

/// A log in chunks of a third, without indexes and summary.
fn in_chunks(file: &[u8]) -> anyhow::Result<Vec<u8>> {
    let mut records = Vec::new();
    for record in of_file(file).unwrap_or_default() {
        match (record.op, Chunk::unpacked(&record)) {
            (1, _) => records.push(record),
            (CHUNK, Some(chunk)) => {
                for part in chunk.split(3) {
                    records.push(part.packed()?);
                }
            }
            _ => {}
        }
    }
    records.push(Record { op: DATA_END, body: vec![0; 4] });
    records.push(Record { op: FOOTER, body: vec![0; 20] });
    Ok(file_of(&records))
}
