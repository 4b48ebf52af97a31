//! The commands that are tried, and the small files that they read.

use std::path::Path;

use crate::trials::{Call, File, Shop};

/// A command with its files, a row of the table.
#[derive(Debug)]
pub(super) struct Tried {
    pub(super) name: &'static str,
    pub(super) files: Vec<File>,
    pub(super) words: Vec<String>,
}

impl Tried {
    /// The command without what another one left for it.
    pub(super) fn without_kept_work(&self) -> Vec<String> {
        self.words.iter().filter(|word| !word.starts_with("--resume=0")).cloned().collect()
    }

    /// Whether it leaves its work for the next one, which resumes it.
    pub(super) fn keeps_work(&self) -> bool {
        self.words.iter().any(|word| word.starts_with("--resume=0"))
    }
}

/// What the inputs are made of beside what every [`Shop`] has, in order.
const MADE: [&str; 7] = [
    // More than fits in the least memory.
    "simulate town -o l.mcap --truth l.tum --truth-rate 4 --seed 2 --scans 60 --rate 2 --speed 7 --beams 16 \
     --azimuth-steps 180 --max-range 60",
    "simulate errors t.tum --drift-ate 1 -o d.tum",
    "convert log t.mcap -o scans --to pcd",
    "convert log t.mcap -o kitti --to bin",
    "convert trajectory t.tum -o t.txt --to euroc",
    "map export map.dmpmap -o cloud.ply",
    "map export map.dmpmap -o cloud.laz",
];

/// Every command: its name, its inputs (see [`Shop::files`]), its words.
const CALLS: [(&str, &str, &str); 32] = [
    ("score", "t.mcap t.tum d.tum", "score t.mcap -t t.tum -t d.tum --json --resume=none"),
    (
        "score, every output",
        "t.mcap t.tum d.tum",
        "score t.mcap -t t.tum -t d.tum --json --resume=none --report r.html --scene s.mcap \
         --residuals o.ply --per-frame f.csv --per-tile g.csv --expect miss<99% --junit j.xml",
    ),
    (
        "score, LAZ and MCAP out",
        "t.mcap t.tum",
        "score t.mcap -t t.tum --residuals o.laz --residuals t=o.mcap",
    ),
    (
        "score, beyond memory",
        "l.mcap l.tum",
        "score l.mcap -t l.tum --json --resume=none --memory 32MiB --residuals o.las",
    ),
    ("score --resume", "t.mcap t.tum d.tum", "score t.mcap -t t.tum -t d.tum --json --resume=0.001"),
    (
        "score --resume, beyond memory",
        "l.mcap l.tum",
        "score l.mcap -t l.tum --json --resume=0.001 --memory 32MiB",
    ),
    ("score --quick", "r.mcap r.tum", "score r.mcap -t r.tum --quick --json"),
    ("score --map", "t.mcap t.tum map.dmpmap", "score t.mcap -t t.tum --map map.dmpmap --json"),
    ("score, folder of scans", "scans/ t.tum", "score scans -t t.tum --json"),
    ("score, KITTI", "kitti/ t.tum", "score kitti -t t.tum --json"),
    ("score, rosbag2", "others/rosbag2/sqlite3/=bag/", "score bag -t topic:/pose --json"),
    ("info, rosbag2", "others/rosbag2/sqlite3/=bag/", "info bag --json"),
    ("map build", "t.mcap t.tum", "map build t.mcap -t t.tum -o out.dmpmap"),
    ("map build --resume", "t.mcap t.tum", "map build t.mcap -t t.tum -o out.dmpmap --resume=0.001"),
    ("map build, cloud", "cloud.ply", "map build cloud.ply -o out.dmpmap"),
    ("map export", "map.dmpmap", "map export map.dmpmap -o out.ply"),
    ("map export, LAZ", "map.dmpmap", "map export map.dmpmap -o out.laz"),
    ("map verify", "map.dmpmap", "map verify map.dmpmap"),
    ("convert log", "t.mcap", "convert log t.mcap -o out.mcap"),
    ("convert log, folder", "t.mcap", "convert log t.mcap -o out --to laz"),
    ("convert log, depth images", "room/", "convert log room -o out.mcap"),
    ("convert trajectory", "t.txt", "convert trajectory t.txt -o out.txt --to kitti"),
    ("compare", "a.json", "compare a.json --report r.html --expect miss<99% --junit j.xml"),
    (
        "loops",
        "q.mcap loops/",
        "loops loops/graph.g2o --candidates loops/candidates.g2o --log q.mcap --keyframes loops/keyframes.txt \
         --accept --save-graph out.g2o --save-trajectory out.tum --json",
    ),
    ("drift", "q.mcap q.tum", "drift q.mcap -t q.tum --json -o out.g2o"),
    ("repair", "q.mcap q.tum", "repair q.mcap -t q.tum -o out.tum --save-graph out.g2o --json"),
    ("suite", "t.mcap t.tum d.tum s.toml", "suite s.toml --json --cache cache"),
    ("truth smd", "cloud.ply map.dmpmap", "truth smd cloud.ply map.dmpmap --json"),
    (
        "simulate city",
        "",
        "simulate city -o c.mcap --truth c.tum --km 0.05 --beams 4 --azimuth-steps 36 --rate 1",
    ),
    ("simulate room", "", "simulate room -o out --size 40x30 --frames 4 --rate 1"),
    ("simulate errors", "t.tum", "simulate errors t.tum --drift-ate 1 -o out.tum"),
    ("simulate loops", "q.tum", "simulate loops q.tum -o out --spacing 3 --true 1 --false 0 --near 0"),
];

/// The commands that are wanted, with their files.
pub(super) fn calls(dmp: &Path, wants: impl Fn(&str) -> bool) -> anyhow::Result<Vec<Tried>> {
    let shop = Shop::open(dmp)?;
    MADE.iter().try_for_each(|line| shop.make(line).map(drop))?;
    let put = |path: &str, bytes| shop.put(File { path: path.into(), bytes, form: None });
    put("a.json", shop.make("score t.mcap -t t.tum -t d.tum --json --quiet")?)?;
    let turned = b"P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3\n";
    put("kitti/calib.txt", turned.to_vec())?;
    let suite = "versions = [\"t\", \"d\"]\ntrajectories = \"{version}.tum\"\n[[log]]\nname = \"a\"\npath = \"t.mcap\"\n";
    put("s.toml", suite.into())?;
    let tried = |&(name, inputs, line): &(&'static str, &str, &str)| -> anyhow::Result<Tried> {
        let mut words = Call::new(line).words;
        let works = ["score", "loops", "drift", "repair", "suite"].contains(&words[0].as_str())
            || ["build", "smd"].contains(&words[1].as_str());
        // One thread: the same operations in the same order each time.
        let more = if works { "--quiet --work work --threads 1" } else { "--quiet" };
        words.extend(more.split(' ').map(str::to_owned));
        Ok(Tried { name, files: shop.files(inputs)?, words })
    };
    CALLS.iter().filter(|(name, ..)| wants(name)).map(tried).collect()
}
