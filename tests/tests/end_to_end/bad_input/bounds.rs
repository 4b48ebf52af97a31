//! Row 29: what is read whole has a bound, whatever a file claims or a device gives.
#![cfg(unix)]

use std::fs;
use std::path::Path;

use dmp_log::FolderFormat;

use super::{dmp_limited, save_tum, town, write_folder};
use crate::common::text;

/// Refused in a line with less memory than the file would need.
fn refused_at_once(folder: &Path, arguments: &str, words: &[&str]) {
    let output = dmp_limited(folder, "ulimit -v 700000", &format!("{arguments} --quiet"));
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments}\n{stderr}");
    let is_line = stderr.lines().count() == 1 && stderr.starts_with("error: ");
    assert!(is_line && words.iter().all(|word| stderr.contains(word)), "{arguments}\n{stderr}");
}

#[test]
fn row_29_texts_without_lines_and_without_end_are_refused_at_once() {
    let (folder, scans) = town();
    let path = folder.path();
    write_folder(&path.join("seq"), &scans, FolderFormat::Bin);
    let sparse = |name: &str, bytes: u64| fs::File::create(path.join(name)).unwrap().set_len(bytes).unwrap();
    sparse("seq/times.txt", 8 << 30);
    refused_at_once(path, "score seq -t truth.tum", &["times.txt", "8,589,934,592 bytes"]);
    refused_at_once(path, "info seq", &["times.txt", "8,589,934,592 bytes"]);
    sparse("seq/times.txt", 400 << 20);
    refused_at_once(path, "info seq", &["times.txt", "line 1: longer than 65536 bytes"]);
    // Numbers by the hundred million, in one line; nothing at all, for ever.
    fs::write(path.join("line.txt"), "1 ".repeat(100 << 20)).unwrap();
    sparse("sparse.tum", 1 << 30);
    // Neither text nor an end; blank lines and no end.
    let letters: Vec<u8> = (0..3_u32 << 20).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    fs::write(path.join("bytes.tum"), letters).unwrap();
    fs::File::options().append(true).open(path.join("bytes.tum")).unwrap().set_len(1 << 30).unwrap();
    fs::write(path.join("blank.tum"), "#\n\n".repeat(20 << 20)).unwrap();
    let endless = "line 1: longer than 65536 bytes";
    for (run, why) in [
        ("line.txt", endless),
        ("sparse.tum", endless),
        ("/dev/zero", "a device"),
        ("/dev/urandom", "a device"),
        ("bytes.tum", "not text"),
        ("blank.tum", "nothing but blank lines and comments"),
    ] {
        let long = [run, why];
        refused_at_once(path, &format!("score town.mcap -t truth.tum -t {run}"), &long);
        refused_at_once(path, &format!("info town.mcap -t {run}"), &long);
        refused_at_once(path, &format!("convert trajectory {run} --to tum -o new.tum"), &long);
        refused_at_once(path, &format!("score town.mcap -t truth.tum --extrinsic calib:{run}"), &[run]);
        refused_at_once(path, &format!("loops {run} --candidates {run}"), &long);
    }
    for other in ["info /dev/zero", "compare /dev/zero", "map info /dev/zero", "map verify /dev/zero"] {
        refused_at_once(path, other, &["/dev/zero"]);
    }
    for map in ["/dev/zero", "sparse.tum"] {
        refused_at_once(path, &format!("score town.mcap -t truth.tum --map {map}"), &[map]);
    }
}

/// What says it is a result is not believed before it is one.
#[test]
fn row_29_results_have_a_largest_size_and_hold_what_results_hold() {
    let (folder, _) = town();
    let path = folder.path();
    let saved = text(&dmp_limited(path, ":", "score town.mcap -t truth.tum --json --quiet").stdout);
    let blanks = saved.replacen('{', &format!("{{{}", " ".repeat(64 << 20)), 1);
    fs::write(path.join("large.json"), blanks).unwrap();
    let many = |what: &str| format!("\"x\": [{}{what}],", format!("{what},").repeat(4 << 20));
    let inputs = "\"inputs\": {";
    let in_inputs = saved.replacen(inputs, &format!("{inputs}{}", many("[]")), 1);
    fs::write(path.join("lists.json"), in_inputs).unwrap();
    for (file, why) in [("large.json", "more than 67108864 bytes"), ("lists.json", "unknown field `x`")] {
        refused_at_once(path, &format!("compare {file}"), &[file, why]);
        refused_at_once(path, &format!("score town.mcap -t truth.tum --like {file}"), &[file, why]);
    }
    // What others put beside the fields of a result is passed over.
    fs::write(path.join("beside.json"), saved.replacen('{', &format!("{{{}", many("{\"a\":0}")), 1)).unwrap();
    let passed = dmp_limited(path, "ulimit -v 700000", "compare beside.json");
    assert_eq!(passed.status.code(), Some(0), "{}", text(&passed.stderr));
}

#[test]
fn row_29_a_bag_names_no_files_outside_its_folder() {
    let (folder, scans) = town();
    let path = folder.path();
    let names = |name: &str| {
        let list = format!("rosbag2_bagfile_information:\n  relative_file_paths:\n    - {name}\n");
        fs::write(path.join("bag/metadata.yaml"), list).unwrap();
    };
    fs::create_dir(path.join("bag")).unwrap();
    for outside in ["../town.mcap", &path.join("town.mcap").display().to_string()] {
        names(outside);
        refused_at_once(path, "info bag", &["metadata.yaml", "line 3", "town.mcap", "is not there"]);
    }
    names("town.mcap");
    crate::common::write_mcap(&path.join("bag/town.mcap"), &scans);
    save_tum(
        &path.join("bag/truth.tum"),
        &dmp_log::read_trajectory(&path.join("truth.tum")).unwrap().trajectory,
    );
    super::scored(path, "score bag -t bag/truth.tum -t drift.tum", 0);
}
