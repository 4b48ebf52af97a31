//! Rows 1, 2, 3, 20 and 31: logs whose bytes are cut, wrong or lie.

use std::fs;

use dmp_log::FolderFormat;

use super::raw::{Cloud, bag, bag_of_records, message_record, records_of, zstd_chunk, zstd_zeros};
use super::{dmp_limited, report_of, says, scored, scores, town, write_folder};
use crate::common::{dmp, refused, text, unwrapped, workspace};

#[test]
fn row_01_a_log_cut_short_is_scored_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fs::read(workspace().join("data-samples/town.mcap")).unwrap();
    fs::write(folder.path().join("half.mcap"), &whole[..whole.len() / 2]).unwrap();
    let arguments = "score half.mcap -t @/truth.tum -t @/collapsed.tum";
    let report = scored(folder.path(), arguments, 3);
    let used = report["inputs"]["scans_used"].as_u64().unwrap();
    assert!((20..80).contains(&used), "{used}");
    assert!(says(&report["inputs"]["damage"], &["byte"]), "{report}");
    assert!(says(&report["warnings"], &["lost from the log"]), "{report}");
    let table = dmp(folder.path(), arguments);
    assert_eq!(table.status.code(), Some(3));
    assert!(unwrapped(&text(&table.stdout)).contains("lost from the log"), "{}", text(&table.stdout));

    // Where the cut lies in the summary, no scan is lost, and the scores are those of the whole.
    let (_, _, summary) = records_of(&whole).into_iter().find(|&(_, opcode, _)| opcode == 15).unwrap();
    let end_of_data = records_of(&whole).into_iter().find(|&(_, opcode, _)| opcode == 15).unwrap().0;
    fs::write(folder.path().join("no_summary.mcap"), &whole[..end_of_data + 9 + summary as usize]).unwrap();
    let runs = "-t @/truth.tum -t @/collapsed.tum";
    let cut = scored(folder.path(), &format!("score no_summary.mcap {runs}"), 3);
    let all = scored(folder.path(), &format!("score @/town.mcap {runs}"), 0);
    assert_eq!(scores(&cut), scores(&all));
    assert!(says(&cut["inputs"]["damage"], &["no scan is lost"]), "{cut}");
}

#[test]
fn row_01_a_chunk_length_beyond_the_file_ends_what_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = fs::read(workspace().join("data-samples/town.mcap")).unwrap();
    let chunks: Vec<usize> =
        records_of(&bytes).into_iter().filter(|&(_, opcode, _)| opcode == 6).map(|record| record.0).collect();
    let middle = chunks[chunks.len() / 2];
    bytes[middle + 1..middle + 9].fill(0xff);
    let runs = "-t @/truth.tum -t @/drift.tum";
    // The summary knows where the next chunk is; without it, all behind the length is lost.
    fs::write(folder.path().join("hinted.mcap"), &bytes).unwrap();
    let hinted = scored(folder.path(), &format!("score hinted.mcap {runs}"), 3);
    bytes.truncate(*chunks.last().unwrap());
    fs::write(folder.path().join("cut.mcap"), &bytes).unwrap();
    let cut = scored(folder.path(), &format!("score cut.mcap {runs}"), 3);
    for report in [&hinted, &cut] {
        let place = format!("byte {middle}");
        assert!(says(&report["inputs"]["damage"], &[&place, "18,446,744,073,709,551,615 bytes"]), "{report}");
        assert_eq!(report["order"][0], "truth");
    }
    let used = |report: &serde_json::Value| report["inputs"]["scans_used"].as_u64().unwrap();
    assert!(used(&cut) > 30 && used(&cut) < used(&hinted) && used(&hinted) < 100);
}

#[test]
fn row_02_one_bad_chunk_is_named_and_the_rest_is_scored() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = fs::read(workspace().join("data-samples/town.mcap")).unwrap();
    let middle = bytes.len() / 2;
    let records = records_of(&bytes);
    let (chunk, ..) = records.iter().rfind(|&&(at, opcode, _)| opcode == 6 && at < middle).unwrap();
    bytes[middle] ^= 0xff;
    fs::write(folder.path().join("bad.mcap"), bytes).unwrap();
    let report = scored(folder.path(), "score bad.mcap -t @/truth.tum -t @/drift.tum", 3);
    assert_eq!(report["order"], serde_json::json!(["truth", "drift"]));
    let used = report["inputs"]["scans_used"].as_u64().unwrap();
    assert!(used > 50 && used < 100, "{used}");
    assert_eq!(report["inputs"]["damage"].as_array().unwrap().len(), 1);
    assert!(says(&report["inputs"]["damage"], &[&format!("byte {chunk}"), "skipped"]), "{report}");
}

/// What heads claim is compared with what is there, under a limit that the claims would break.
#[cfg(unix)]
#[test]
fn row_03_claims_of_heads_are_not_believed() {
    let (folder, scans) = town();
    let path = folder.path();
    write_folder(&path.join("pcd"), &scans, FolderFormat::Pcd);
    let lying = path.join("pcd/scans/000005.pcd");
    let whole = fs::read(&lying).unwrap();
    let head_bytes = whole.windows(12).position(|window| window == b"DATA binary\n").unwrap();
    let head = text(&whole[..head_bytes]);
    let points = scans[5].len().to_string();
    let told = head.replace(&points, "4000000000");
    assert!(told.contains("POINTS 4000000000"), "{told}");
    fs::write(&lying, [told.as_bytes(), &whole[head_bytes..]].concat()).unwrap();
    // A message that claims four thousand million points, among others that are well.
    let mut clouds: Vec<Cloud> = scans.iter().map(Cloud::of).collect();
    clouds[5].width = u32::MAX;
    clouds[5].row_step = u32::MAX;
    fs::write(path.join("lying.mcap"), bag(&clouds)).unwrap();
    for (log, used, words) in
        [("pcd", 24, ["000005.pcd", "4,000,000,000"]), ("lying.mcap", 23, ["message 5", "4,294,967,295"])]
    {
        let arguments = format!("score {log} -t truth.tum -t drift.tum --threads 1 --json --quiet");
        let output = dmp_limited(path, "ulimit -v 1500000", &arguments);
        let report = report_of(&output, &arguments, 3);
        assert_eq!(report["inputs"]["scans_used"], used);
        assert!(says(&report["inputs"]["damage"], &words), "{report}");
        assert_eq!(report["order"][0], "truth");
    }
}

/// Ten kilobytes that unpack to 300 MiB, and a frame that claims 2⁶³ bytes: neither is unpacked beyond what its
/// chunk says, and what the chunk says has a limit. The memory of the whole command is limited meanwhile.
#[cfg(unix)]
#[test]
fn row_20_bombs_are_not_unpacked_and_forged_sizes_not_believed() {
    let (folder, scans) = town();
    let path = folder.path();
    let bomb = zstd_zeros(2400, None);
    assert!(bomb.len() < 10_000);
    let clouds: Vec<Vec<u8>> = scans.iter().map(|scan| message_record(&Cloud::of(scan))).collect();
    let packed = [
        (zstd_chunk(300 << 20, &bomb), "268,435,456 allowed"),
        (zstd_chunk(1 << 20, &bomb), "damaged"),
        (zstd_chunk(u64::MAX, &bomb), "18,446,744,073,709,551,615"),
        (zstd_chunk(1 << 20, &zstd_zeros(2400, Some(1 << 63))), "damaged"),
    ];
    for (chunk, word) in packed {
        let records = [clouds[..12].concat(), chunk, clouds[12..].concat()].concat();
        fs::write(path.join("bomb.mcap"), bag_of_records(&records)).unwrap();
        let arguments = "score bomb.mcap -t truth.tum -t drift.tum --threads 1 --json --quiet";
        let output = dmp_limited(path, "ulimit -v 250000", arguments);
        let report = report_of(&output, arguments, 3);
        assert_eq!(report["inputs"]["scans_used"], 24);
        assert!(says(&report["inputs"]["damage"], &["byte ", word]), "{word}: {report}");
        assert_eq!(report["order"][0], "truth");
    }
    fs::write(path.join("alone.mcap"), bag_of_records(&zstd_chunk(300 << 20, &bomb))).unwrap();
    refused(path, "score alone.mcap -t truth.tum", 1, &["alone.mcap", "byte ", "268,435,456 allowed"]);
}

/// As Python's rosbags writes it: the CRC of every chunk is 0, for none.
fn without_crcs(mut bytes: Vec<u8>) -> Vec<u8> {
    for (at, opcode, _) in records_of(&bytes) {
        if opcode == 6 {
            let crc_at = at + 9 + 24;
            assert_ne!(&bytes[crc_at..crc_at + 4], &[0; 4]);
            bytes[crc_at..crc_at + 4].fill(0);
        }
    }
    bytes
}

/// Where no checksum guards a log, that is said; and scans unlike those around them are named.
#[test]
fn row_31_logs_without_checksums_say_so_and_name_odd_scans() {
    let (folder, scans) = town();
    let path = folder.path();
    let runs = "-t truth.tum -t drift.tum";
    let odd = |report: &serde_json::Value| says(&report["warnings"], &["unlike the others"]);
    let guarded = scored(path, &format!("score town.mcap {runs}"), 0);
    assert_eq!((&guarded["inputs"]["has_checksums"], odd(&guarded)), (&true.into(), false));
    let info = dmp(path, "info town.mcap");
    assert!(!text(&info.stdout).contains("no checksums"), "{}", text(&info.stdout));

    fs::write(path.join("plain.mcap"), without_crcs(fs::read(path.join("town.mcap")).unwrap())).unwrap();
    // A quick score reads few chunks, and the heads of all.
    let long = fs::read(workspace().join("data-samples/town.mcap")).unwrap();
    fs::write(path.join("long.mcap"), without_crcs(long)).unwrap();
    for (log, is_guarded) in [("@/town.mcap", true), ("long.mcap", false)] {
        let report = scored(path, &format!("score {log} -t @/truth.tum -t @/drift.tum --quick=100%"), 0);
        assert_eq!(report["inputs"]["has_checksums"], is_guarded, "{log}");
    }
    for (name, format) in [
        ("bin", FolderFormat::Bin),
        ("pcd", FolderFormat::Pcd),
        ("ply", FolderFormat::Ply),
        ("laz", FolderFormat::Laz),
    ] {
        write_folder(&path.join(name), &scans, format);
    }
    for log in ["plain.mcap", "bin", "pcd", "ply", "laz"] {
        let info = dmp(path, &format!("info {log}"));
        assert!(text(&info.stdout).contains("no checksums"), "{log}\n{}", text(&info.stdout));
        let output = dmp(path, &format!("score {log} {runs}"));
        assert!(text(&output.stderr).contains("no checksums"), "{log}\n{}", text(&output.stderr));
        let report = scored(path, &format!("score {log} {runs}"), 0);
        assert_eq!((&report["inputs"]["has_checksums"], odd(&report)), (&false.into(), false), "{log}");
        // Where nothing is said beside the scores, it stands with them.
        let output = dmp(path, &format!("score {log} {runs} --quiet --report page.html"));
        assert!(text(&output.stdout).contains("log: no checksums"), "{log}\n{}", text(&output.stdout));
        assert!(fs::read_to_string(path.join("page.html")).unwrap().contains("no checksums"), "{log}");
    }

    // A cloud that is given as a map.
    assert_eq!(dmp(path, "map build town.mcap -t truth.tum -o map.dmpmap").status.code(), Some(0));
    assert_eq!(dmp(path, "map export map.dmpmap -o map.laz").status.code(), Some(0));
    // It has one point in each voxel of the map: larger ones hold enough for surfels.
    let report = scored(path, &format!("score town.mcap {runs} --map truth=map.laz --voxel 1.5"), 0);
    assert!(says(&report["inputs"]["runs"][0]["map_notes"], &["no checksums"]), "{}", report["inputs"]);
    let report = scored(path, &format!("score town.mcap {runs} --map truth=map.dmpmap"), 0);
    assert!(!says(&report["inputs"]["runs"][0]["map_notes"], &["no checksums"]), "{}", report["inputs"]);

    // A sector with the bytes of another file; half a file that never came to the disk.
    let file = path.join("bin/scans/000012.bin");
    let whole = fs::read(&file).unwrap();
    let mut state = 1u64;
    let mut any = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    let mut foreign = whole.clone();
    foreign[1024..5120].iter_mut().for_each(|byte| *byte = any());
    let mut lost = whole.clone();
    lost[whole.len() / 4..].fill(0);
    for (bytes, words) in [(foreign, "ranges below 1 mm or above 100 km"), (lost, "are usual")] {
        fs::write(&file, bytes).unwrap();
        let report = scored(path, &format!("score bin {runs}"), 0);
        assert!(
            says(&report["warnings"], &["1 scan is unlike", "scan 12 has", words]),
            "{}",
            report["warnings"]
        );
    }
}
