//! Rows 1 to 4, 7, 20 to 22 and 31: logs and maps whose bytes are cut, wrong or lie, that are large, and that change.

use std::fs::{self, File};
use std::process::Stdio;
use std::sync::Mutex;

use dmp::{Config, Progress, Run, Stage, evaluate};
use dmp_log::{FolderFormat, read_trajectory};
use dmp_sensor::Scan;

use super::Town;
use super::raw::{Cloud, bag, bag_of_records, message_record, records_of, zstd_chunk, zstd_zeros};
use super::table::Row;
use crate::common::{dmp_command, ends, open, real_data, scores, text, workspace};
use crate::ros1::Bag;

pub(super) const ROWS: &[Row] = &[
    Row {
        number: 1,
        made: |town| {
            let (whole, records) = sample();
            town.write("half.mcap", &whole[..whole.len() / 2]);
            let bag = Bag::new(town.scans, "lz4").bytes;
            town.write("half.bag", &bag[..bag.len() / 2]);
            let &(end, _, length) = records.iter().find(|record| record.1 == 15).unwrap();
            town.write("no_summary.mcap", &whole[..end + 9 + length as usize]);
            let chunks: Vec<usize> = records.iter().filter(|record| record.1 == 6).map(|record| record.0).collect();
            let middle = chunks[chunks.len() / 2];
            let mut bytes = whole;
            bytes[middle + 1..middle + 9].fill(0xff);
            // The summary knows where the next chunk is; without it, all behind the length is lost.
            town.write("hinted.mcap", &bytes);
            town.write("cut.mcap", &bytes[..*chunks.last().unwrap()]);
            let damage = format!("damage: byte {middle} | 18,446,744,073,709,551,615 bytes; truth first");
            for (log, used) in [("hinted.mcap", "60..100"), ("cut.mcap", "31..60")] {
                town.line(format!("score {log} -t @/truth.tum -t @/drift.tum => 3 scans_used in {used}; {damage}"));
            }
        },
        lines: "
            score half.mcap -t @/truth.tum => 3 scans_used in 20..80; damage: byte; warnings: lost from the log
            score half.mcap -t @/truth.tum => 3 prints: lost from the log
            score half.bag -t truth.tum --voxel 0.5 => 3 damage: byte | the tail is lost; warnings: lost from the log
            score no_summary.mcap -t @/truth.tum => 3 damage: no scan is lost; as score @/town.mcap -t @/truth.tum",
    },
    Row {
        number: 2,
        made: |town| {
            let (mut bytes, records) = sample();
            let middle = bytes.len() / 2;
            let (chunk, ..) = records.iter().rfind(|record| record.1 == 6 && record.0 < middle).unwrap();
            bytes[middle] ^= 0xff;
            town.write("bad.mcap", bytes);
            town.line(format!(
                "score bad.mcap -t @/truth.tum -t @/drift.tum => 3 damage: byte {chunk} | skipped; damage/1 = null; \
                 scans_used in 51..100; truth first"
            ));
        },
        lines: "",
    },
    Row {
        number: 3,
        made: lying_heads,
        lines: "
            [ulimit -v 1500000] score pcd --threads 1 => 3 scans_used = 24; damage: 000005.pcd | 4,000,000,000; truth first
            [ulimit -v 1500000] score lying.mcap --threads 1 => 3 scans_used = 23; damage: message 5 | 4,294,967,295
            [ulimit -v 1500000] score town.mcap -t truth.tum --threads 1 --map map.ply => 1 map.ply | 1,000,000,000,000
            [ulimit -v 1500000] score town.mcap -t truth.tum --threads 1 --map map.pcd => 1 map.pcd | 800,000,000,000
            [ulimit -v 1500000] score town.mcap -t truth.tum --threads 1 --map mesh.ply => 1 mesh.ply | face",
    },
    Row {
        // In files that take no room on the disk: counted from their lengths.
        number: 4,
        made: |town| {
            for k in 0..25 {
                let name = format!("huge/scans/{k:06}.bin");
                town.write(&name, "");
                File::create(town.path(&name)).unwrap().set_len(16 * 200_000_000).unwrap();
            }
        },
        lines: "
            info huge => 0 scans/returns = 5000000000; returns_per_scan/max = 200000000; bytes = 80000000000; scans/scans = 25",
    },
    Row {
        // Every scan in ten parts, a nanosecond apart, and poses far apart: hundreds of files, a hundred tiles, six runs.
        number: 7,
        made: |town| {
            let part = |scan: &Scan, k: usize| Scan {
                stamp_ns: scan.stamp_ns.map(|ns| ns + k as i64),
                points_in_sensor_m: scan.points_in_sensor_m.iter().copied().skip(k).step_by(10).collect(),
                time_offsets_ns: scan.time_offsets_ns.iter().copied().skip(k).step_by(10).collect(),
            };
            let parts: Vec<Scan> = town.scans.iter().flat_map(|scan| (0..10).map(move |k| part(scan, k))).collect();
            town.scans("parts", &parts, FolderFormat::Pcd);
            let far = town.changed("truth.tum", |ns, mut pose| {
                pose.translation.vector *= 50.0;
                Some((ns, pose))
            });
            town.tum("far.tum", &far);
            let score = "score parts -t a=far.tum -t b=far.tum -t c=far.tum -t d=drift.tum -t e=drift.tum \
                         -t f=truth.tum --point-time ns --threads 4 --memory 64MiB --work . --trust";
            town.line(format!("[ulimit -n 24] {score} => 0 runs/0/tiles in 61..; as {score}"));
        },
        lines: "",
    },
    Row { number: 20, made: bombs, lines: "score alone.mcap => 1 alone.mcap | byte | 268,435,456 allowed" },
    Row {
        number: 21,
        made: |town| {
            town.make("map build town.mcap -t truth.tum -o truth.dmpmap --quiet");
            let whole = town.read("truth.dmpmap");
            let refused = |number: usize, map: &[u8], words: &str| {
                town.write(&format!("{number}.dmpmap"), map);
                town.line(format!("score town.mcap -t truth.tum --map {number}.dmpmap => 1 {number}.dmpmap{words}"));
            };
            for (number, length) in [0, 7, 40, whole.len() / 2, whole.len() - 1].into_iter().enumerate() {
                refused(number, &whole[..length], "");
            }
            // Tiles are behind the header, the directory and the footer behind them.
            let places = [80, whole.len() / 4, whole.len() / 2, 10, whole.len() - 60, whole.len() - 10];
            for (number, at) in places.into_iter().enumerate() {
                let mut flipped = whole.clone();
                flipped[at] ^= 0x10;
                refused(10 + number, &flipped, if number < 3 { " | tile " } else { "" });
            }
            let mut newer = whole;
            newer[8] += 1;
            refused(20, &newer, " | version 4");
        },
        lines: "
            score town.mcap -t truth.tum --map truth.dmpmap => 0 runs/0/map = \"truth.dmpmap\"",
    },
    Row {
        number: 31,
        made: logs_without_checksums,
        lines: "
            score town.mcap => 0 has_checksums = true; warnings lacks from the others
            score town.mcap --map truth=map.laz --voxel 1.5 => 0 runs/0/map_notes: no checksums
            score town.mcap --map truth=map.dmpmap => 0 runs/0/map_notes lacks no checksums
            score foreign => 0 warnings: 1 scan differs | scan 12 has | ranges below 1 mm or above 100 km
            score lost => 0 warnings: 1 scan differs | scan 12 has | are usual
            score row-foreign => 0 warnings: 4 scans differ from the others | scans 10 to 13 | have up to
            score row-lost => 0 warnings: 4 scans differ from the others | scans 10 to 13 | have down to | are usual
            score row-far => 0 warnings: 4 scans differ from the others | scans 10 to 13 | have ranges beyond
            score frozen => 0 warnings: scans 12 to 13 hold the same as scan 11 | scan 20 holds the same as scan 3:
            score frozen.mcap => 0 warnings: scans 12 to 13 hold the same as scan 11 | scan 20 holds the same as scan 3:",
    },
];

/// The sample, and where its records begin, their opcode and the length of their body.
fn sample() -> (Vec<u8>, Vec<(usize, u8, u64)>) {
    let whole = fs::read(workspace().join("data-samples/town.mcap")).unwrap();
    let records = records_of(&whole);
    (whole, records)
}

/// Bytes that mean nothing.
pub(super) fn foreign(count: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let mut any = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    (0..count).map(|_| any()).collect()
}

/// Heads that claim far more than is there, among others that are right.
fn lying_heads(town: &Town) {
    town.scans("pcd", town.scans, FolderFormat::Pcd);
    town.change("pcd/scans/000005.pcd", |bytes| {
        let head = bytes.windows(12).position(|window| window == b"DATA binary\n").unwrap();
        let lying = text(&bytes[..head]).replace(&town.scans[5].len().to_string(), "4000000000");
        assert!(lying.contains("POINTS 4000000000"), "{lying}");
        bytes.splice(..head, lying.into_bytes());
    });
    let mut clouds: Vec<Cloud> = town.scans.iter().map(Cloud::of).collect();
    (clouds[5].width, clouds[5].row_step) = (u32::MAX, u32::MAX);
    town.write("lying.mcap", bag(&clouds));
    let ply = "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\nproperty float x\nproperty float y\n\
               property float z\n";
    let faces = "element face 4000000000\nproperty list uchar int vertex_indices\n";
    let mesh = ply.replace("1000000000000", "3") + faces;
    let pcd = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4000000000\nHEIGHT 200\n\
               POINTS 800000000000\nDATA binary\n";
    for (name, head, end) in
        [("map.ply", ply, "end_header\n"), ("mesh.ply", &mesh, "end_header\n"), ("map.pcd", pcd, "")]
    {
        town.write(name, [head.as_bytes(), end.as_bytes(), &[0; 36]].concat());
    }
}

/// Ten kilobytes that unpack to 300 MiB, a frame that claims 2⁶³ bytes, and runs of 255, which a decoder of the arithmetic code
/// of LAZ takes for an escape, again and again.
fn bombs(town: &Town) {
    let bomb = zstd_zeros(2400, None);
    assert!(bomb.len() < 10_000);
    let clouds: Vec<Vec<u8>> = town.scans.iter().map(|scan| message_record(&Cloud::of(scan))).collect();
    let packed = [
        (zstd_chunk(300 << 20, &bomb), "268,435,456 allowed"),
        (zstd_chunk(1 << 20, &bomb), "damaged"),
        (zstd_chunk(u64::MAX, &bomb), "18,446,744,073,709,551,615"),
        (zstd_chunk(1 << 20, &zstd_zeros(2400, Some(1 << 63))), "damaged"),
    ];
    for (number, (chunk, word)) in packed.into_iter().enumerate() {
        let records = [clouds[..12].concat(), chunk, clouds[12..].concat()].concat();
        town.write(&format!("bomb{number}.mcap"), bag_of_records(&records));
        town.line(format!(
            "[ulimit -v 250000] score bomb{number}.mcap --threads 1 => 3 scans_used = 24; damage: byte | {word}; truth first"
        ));
    }
    town.write("alone.mcap", bag_of_records(&zstd_chunk(300 << 20, &bomb)));

    town.make("map build town.mcap -t truth.tum -o map.dmpmap --quiet");
    town.make("map export map.dmpmap -o whole.laz --quiet");
    let whole = town.read("whole.laz");
    let ones = |bytes: &mut Vec<u8>, part: usize| {
        let at = bytes.len() * part / 12;
        let end = bytes.len().min(at + 11);
        bytes[at..end].fill(0xff);
    };
    for part in [2, 5, 9] {
        let (log, map) = (format!("log{part}"), format!("map{part}.laz"));
        town.scans(&log, &town.scans[..4], FolderFormat::Laz);
        town.change(&format!("{log}/scans/000001.laz"), |bytes| ones(bytes, part));
        town.write(&map, &whole);
        town.change(&map, |bytes| ones(bytes, part));
        for command in [
            format!("info {log}"),
            format!("score {log} --json"),
            format!("score town.mcap -t truth.tum --map {map} --json"),
            format!("map build {map} -o built{part}.dmpmap"),
            format!("truth smd {map} whole.laz --json"),
        ] {
            town.line(format!("{command} => 0/1/3"));
        }
    }
}

/// As Python's rosbags writes it: the CRC of every chunk is 0, for none.
fn without_crcs(mut bytes: Vec<u8>) -> Vec<u8> {
    for (at, opcode, _) in records_of(&bytes) {
        if opcode == 6 {
            let crc = &mut bytes[at + 9 + 24..at + 9 + 28];
            assert_ne!(crc, &[0; 4]);
            crc.fill(0);
        }
    }
    bytes
}

/// Logs that nothing vouches for, undamaged ones, and damage that breaks no form.
fn logs_without_checksums(town: &Town) {
    town.write("plain.mcap", without_crcs(town.read("town.mcap")));
    let formats = [FolderFormat::Bin, FolderFormat::Pcd, FolderFormat::Ply, FolderFormat::Laz];
    formats.into_iter().for_each(|format| town.scans(format.extension(), town.scans, format));
    let odd = "from the others | the same as scan | is stamped | no scan for";
    for log in ["plain.mcap", "bin", "pcd", "ply", "laz"] {
        town.line(format!("info {log} => 0 prints: no checksums"));
        town.line(format!(
            "score {log} => 0 has_checksums = false; warnings lacks {odd}; prints: no checksums; page: no checksums"
        ));
    }
    town.make("map build town.mcap -t truth.tum -o map.dmpmap --quiet");
    town.make("map export map.dmpmap -o map.laz --quiet");
    town.make("simulate city --km 0.1 --beams 16 --azimuth-steps 100 -o city/ --truth city.tum --quiet");
    town.make("simulate room -o room --size 80x60 --frames 60 --rate 10 --quiet");
    let undamaged = ["@/town.mcap -t @/truth.tum", "city/ -t city.tum", "room -t room/groundtruth.txt"];
    let real = [("nclt_revisit", "poses_lidar_odometry.txt"), ("rs32_static", "poses_icp_odom.txt")];
    let real = real.into_iter().filter_map(|(log, poses)| {
        let folder = real_data(log)?.display().to_string();
        Some(format!("{folder} -t {folder}/{poses}"))
    });
    for log in undamaged.map(str::to_owned).into_iter().chain(real) {
        town.line(format!("score {log} => 0 warnings lacks {odd}"));
    }

    // A sector with the bytes of another file; half a file that never came to the disk; a bit of the exponents of a sector. Of one
    // scan, and of several in a row, which are like each other.
    let sector = |bytes: &mut Vec<u8>| bytes[1024..5120].copy_from_slice(&foreign(4096));
    let lost = |bytes: &mut Vec<u8>| {
        let quarter = bytes.len() / 4;
        bytes[quarter..].fill(0);
    };
    let far = |bytes: &mut Vec<u8>| {
        let exponents = bytes[1024..5120].iter_mut().skip(3).step_by(4);
        exponents.filter(|byte| **byte & 0x7e == 0x40).for_each(|byte| *byte |= 4);
    };
    let kinds: [(&str, &dyn Fn(&mut Vec<u8>), std::ops::Range<usize>); 5] = [
        ("foreign", &sector, 12..13),
        ("lost", &lost, 12..13),
        ("row-foreign", &sector, 10..14),
        ("row-lost", &lost, 10..14),
        ("row-far", &far, 10..14),
    ];
    for (log, damage, scans) in kinds {
        town.scans(log, town.scans, FolderFormat::Bin);
        scans.for_each(|number| town.change(&format!("{log}/scans/{number:06}.bin"), damage));
    }
    // A driver that has stopped sends its last scan again, with new stamps. Scans without returns are no copies.
    let mut frozen = town.scans.to_vec();
    for (copy, of) in [(12, 11), (13, 11), (20, 3)] {
        frozen[copy] = Scan { stamp_ns: frozen[copy].stamp_ns, ..frozen[of].clone() };
    }
    for empty in [16, 17] {
        frozen[empty] = Scan { stamp_ns: frozen[empty].stamp_ns, ..Scan::default() };
    }
    town.scans("frozen", &frozen, FolderFormat::Bin);
    town.mcap("frozen.mcap", &frozen);
}

/// Changes the log when a stage begins.
struct Meddler<'a> {
    at: fn(Stage) -> bool,
    change: &'a (dyn Fn() + Sync),
    done: Mutex<bool>,
}

impl Progress for Meddler<'_> {
    fn begin(&self, stage: Stage, _: u64) {
        let mut done = self.done.lock().unwrap();
        if (self.at)(stage) && !*done {
            (self.change)();
            *done = true;
        }
    }
}

/// In chunks that are not read whole to open the log: a byte at the start of one, and at its end.
#[test]
fn row_2_a_chunk_found_damaged_late_is_left_out_as_one_found_early() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    ends(folder, "simulate town --scans 60 --beams 64 --azimuth-steps 400 -o town.mcap", 0);
    let whole = fs::read(folder.join("town.mcap")).unwrap();
    let chunks: Vec<_> = records_of(&whole).into_iter().filter(|record| record.1 == 6).collect();
    let (start, _, length) = chunks[2 * chunks.len() / 3];
    let found = [("early", start + 9 + 44), ("late", start + 9 + length as usize - 200)].map(|(name, at)| {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x20;
        fs::write(folder.join("bad.mcap"), bytes).unwrap();
        let output = ends(folder, "score bad.mcap -t town.truth.tum --json", 3);
        assert_eq!(text(&output.stderr).contains("the scores begin again"), name == "late", "{name}");
        let mut scores = scores(&output.stdout);
        assert!(scores["inputs"]["damage"][0].as_str().unwrap().starts_with(&format!("byte {start}")));
        // Why it is damaged differs.
        for part in ["inputs", "warnings"] {
            scores[part] = serde_json::Value::Null;
        }
        scores
    });
    assert_eq!(found[0], found[1]);
}

#[test]
fn row_22_a_log_that_changes_while_it_is_read_is_never_scored() {
    let town = Town::new();
    town.scans("pcd", town.scans, FolderFormat::Pcd);
    let run = Run::new("truth", read_trajectory(&town.path("truth.tum")).unwrap().trajectory);
    let scan = "pcd/scans/000012.pcd";
    let (whole, log_bytes) = (town.read(scan), town.read("town.mcap"));
    // As long as before, and another byte.
    let mut other = whole.clone();
    *other.last_mut().unwrap() ^= 1;
    let changes: [(&str, &(dyn Fn() + Sync), [&str; 2]); 4] = [
        (
            "pcd",
            &|| fs::write(town.folder.path().join(scan), &whole[..whole.len() / 2]).unwrap(),
            ["000012.pcd", "changed since it was opened"],
        ),
        (
            "pcd",
            &|| fs::write(town.folder.path().join(scan), &other).unwrap(),
            ["000012.pcd", "changed since"],
        ),
        ("pcd", &|| fs::remove_file(town.folder.path().join(scan)).unwrap(), ["000012.pcd", "no such file"]),
        (
            "town.mcap",
            &|| fs::write(town.folder.path().join("town.mcap"), &log_bytes[..log_bytes.len() / 3]).unwrap(),
            ["town.mcap", "frame "],
        ),
    ];
    let stages: [fn(Stage) -> bool; 2] =
        [|stage| matches!(stage, Stage::Fuse), |stage| matches!(stage, Stage::Cast)];
    for (at, (log, change, words)) in stages.into_iter().flat_map(|at| changes.map(|change| (at, change))) {
        town.write(scan, &whole);
        town.write("town.mcap", &log_bytes);
        let meddler = Meddler { at, change, done: Mutex::new(false) };
        let log = open(&town.path(log));
        let report = evaluate(log.as_ref(), std::slice::from_ref(&run), &Config::default(), &meddler);
        let error = report.unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{words:?}: {error}");
        assert!(*meddler.done.lock().unwrap());
    }
}

/// A map on a disk that fails under it is an error, not a signal.
#[cfg(target_os = "linux")]
#[test]
fn row_22_a_map_cut_short_while_it_is_read_is_an_error() {
    let town = Town::new();
    town.make("map build town.mcap -t truth.tum -o truth.dmpmap --quiet");
    let whole = town.read("truth.dmpmap");
    let mut cut = 0;
    let commands = [
        "map verify map.dmpmap",
        "map export map.dmpmap -o map.ply",
        "score town.mcap -t truth.tum --map map.dmpmap",
    ];
    for arguments in commands.repeat(4) {
        town.write("map.dmpmap", &whole);
        let mut child = dmp_command(town.root(), arguments);
        let mut child = child.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let handles = format!("/proc/{}/fd", child.id());
        let is_open = || {
            let handles = fs::read_dir(&handles).into_iter().flatten().flatten();
            let mut files = handles.filter_map(|handle| fs::read_link(handle.path()).ok());
            files.any(|file| file.ends_with("map.dmpmap"))
        };
        while child.try_wait().unwrap().is_none() && !is_open() {}
        File::options().write(true).open(town.path("map.dmpmap")).unwrap().set_len(64).unwrap();
        let output = child.wait_with_output().unwrap();
        let (code, stderr) = (output.status.code(), text(&output.stderr));
        // Perhaps all was read before.
        assert!(matches!(code, Some(0 | 1 | 3)), "{arguments}: {code:?}\n{stderr}");
        assert!(code == Some(0) || stderr.contains("map.dmpmap"), "{arguments}\n{stderr}");
        cut += usize::from(code != Some(0));
    }
    assert!(cut > 0, "every map was read before it was cut short");
}
