//! Rows 8 to 13: points that are none, clouds that make no sense, and coordinates of any size.

use std::fs;

use dmp_log::{FolderFormat, read_trajectory};
use dmp_sensor::{Scan, Trajectory};
use serde_json::Value;

use super::raw::{Cloud, bag};
use super::{assert_close, save_tum, says, scored, scores, town, write_folder};
use crate::common::{refused, write_mcap};

const RUNS: &str = "-t truth.tum -t drift.tum";

/// The scans with `extra` behind every point, at the same time.
fn with_extra(scans: &[Scan], extra: &[[f32; 3]]) -> Vec<Scan> {
    let with = |scan: &Scan| {
        let points = scan.points_in_sensor_m.iter();
        let points = points.flat_map(|&point| std::iter::once(point).chain(extra.iter().copied()));
        let times = scan.time_offsets_ns.iter();
        let times = times.flat_map(|&time| std::iter::repeat_n(time, 1 + extra.len()));
        Scan {
            stamp_ns: scan.stamp_ns,
            points_in_sensor_m: points.collect(),
            time_offsets_ns: times.collect(),
        }
    };
    scans.iter().map(with).collect()
}

/// The scans with `extra` give the scores of those without, and count the extra points under `reason`: as
/// messages, organised and not, and in folders.
fn extra_is_dropped(extra: &[[f32; 3]], reason: &str) {
    let (folder, scans) = town();
    let path = folder.path();
    let wanted = scores(&scored(path, &format!("score town.mcap {RUNS}"), 0));
    let holes = with_extra(&scans, extra);
    let count: usize = scans.iter().map(|scan| extra.len() * scan.len()).sum();
    write_mcap(&path.join("holes.mcap"), &holes);
    for (name, format) in [("pcd", FolderFormat::Pcd), ("ply", FolderFormat::Ply)] {
        write_folder(&path.join(name), &holes, format);
    }
    for log in ["holes.mcap", "pcd", "ply"] {
        let report = scored(path, &format!("score {log} {RUNS}"), 0);
        assert_eq!(scores(&report), wanted, "{log}");
        assert_eq!(report["inputs"]["dropped"][reason].as_u64(), Some(count as u64), "{log}");
    }
    // Without times: organised in rows of a point and what is behind it; and .bin.
    let mut organised: Vec<Cloud> = holes.iter().map(Cloud::of).collect();
    for cloud in &mut organised {
        (cloud.height, cloud.width) = (cloud.width / (1 + extra.len() as u32), 1 + extra.len() as u32);
        cloud.row_step = cloud.width * cloud.point_step;
    }
    fs::write(path.join("organised.mcap"), bag(&organised)).unwrap();
    fs::write(path.join("plain.mcap"), bag(&scans.iter().map(Cloud::of).collect::<Vec<_>>())).unwrap();
    let plain = scored(path, &format!("score plain.mcap {RUNS}"), 0);
    let report = scored(path, &format!("score organised.mcap {RUNS}"), 0);
    assert_eq!(scores(&report), scores(&plain));
    assert_eq!(report["inputs"]["dropped"][reason].as_u64(), Some(count as u64));
}

#[test]
fn row_08_points_that_are_not_finite_are_dropped_and_counted() {
    extra_is_dropped(&[[f32::NAN; 3], [1.0, f32::INFINITY, 2.0], [f32::NAN, 5.0, 5.0]], "non_finite");
}

#[test]
fn row_09_returns_of_no_range_are_no_returns() {
    extra_is_dropped(&[[0.0; 3], [0.0, -0.0, 0.0]], "no_return");
}

/// Breaks a cloud.
type Spoil = fn(&mut Cloud);

#[test]
fn row_10_a_cloud_that_makes_no_sense_is_named_and_the_rest_is_scored() {
    let (folder, scans) = town();
    let path = folder.path();
    let clouds: Vec<Cloud> = scans.iter().map(Cloud::of).collect();
    let spoilers: [(Spoil, &str); 8] = [
        (|cloud| cloud.point_step = 0, "point_step is 0"),
        (|cloud| (cloud.width, cloud.height) = (u32::MAX, u32::MAX), "4,294,967,295"),
        (|cloud| (cloud.height, cloud.row_step) = (u32::MAX, u32::MAX), "4,294,967,295 rows"),
        (|cloud| (cloud.height, cloud.row_step) = (2, 3), "row_step is 3"),
        (|cloud| cloud.fields[2].1 = 9, "field `z` ends at byte 13 of a point of 12 bytes"),
        (|cloud| cloud.fields.retain(|field| field.0 != "y"), "no field `y`"),
        (|cloud| cloud.fields[0].2 = 5, "field `x` is int32"),
        (|cloud| cloud.data.truncate(100), "do not fit in 100 bytes"),
    ];
    for (spoil, words) in spoilers {
        let mut spoiled = clouds.clone();
        spoil(&mut spoiled[5]);
        fs::write(path.join("one.mcap"), bag(&spoiled)).unwrap();
        let report = scored(path, &format!("score one.mcap {RUNS}"), 3);
        assert_eq!(report["inputs"]["scans_used"], 23, "{words}");
        assert!(says(&report["inputs"]["damage"], &["message 5", words]), "{words}: {report}");
        assert_eq!(report["order"][0], "truth");
        spoiled.iter_mut().for_each(spoil);
        fs::write(path.join("all.mcap"), bag(&spoiled)).unwrap();
        refused(path, &format!("score all.mcap {RUNS}"), 1, &["all.mcap", "message 0", words]);
    }
    write_folder(&path.join("pcd"), &scans, FolderFormat::Pcd);
    let spoiled = path.join("pcd/scans/000005.pcd");
    let mut bytes = fs::read(&spoiled).unwrap();
    let fields = bytes.windows(6).position(|window| window == b"x y z ").unwrap();
    bytes[fields + 2] = b'w';
    fs::write(&spoiled, bytes).unwrap();
    let report = scored(path, &format!("score pcd {RUNS}"), 3);
    assert_eq!(report["inputs"]["scans_used"], 23);
    assert!(says(&report["inputs"]["damage"], &["000005.pcd", "no field `y`"]), "{report}");
}

#[test]
fn row_10_empty_clouds_and_padded_rows_are_well() {
    let (folder, scans) = town();
    let path = folder.path();
    let clouds: Vec<Cloud> = scans.iter().map(Cloud::of).collect();
    let mut padded = clouds.clone();
    for cloud in &mut padded {
        // Two rows with 20 bytes behind each, but for a point that is left over.
        let row = (cloud.width / 2 * 12) as usize;
        cloud.data = [&cloud.data[..row], &[0xff; 20], &cloud.data[row..2 * row], &[0xff; 20]].concat();
        (cloud.height, cloud.width, cloud.row_step) = (2, cloud.width / 2, row as u32 + 20);
    }
    let mut even = clouds.clone();
    for cloud in &mut even {
        cloud.width -= cloud.width % 2;
        cloud.row_step = 12 * cloud.width;
        cloud.data.truncate(cloud.row_step as usize);
    }
    fs::write(path.join("padded.mcap"), bag(&padded)).unwrap();
    fs::write(path.join("even.mcap"), bag(&even)).unwrap();
    let wanted = scores(&scored(path, &format!("score even.mcap {RUNS}"), 0));
    assert_eq!(scores(&scored(path, &format!("score padded.mcap {RUNS}"), 0)), wanted);
    let mut with_empty = clouds;
    let nothing = Cloud { width: 0, row_step: 0, data: Vec::new(), ..with_empty[5].clone() };
    with_empty[7] =
        Cloud { fields: Vec::new(), point_step: 0, stamp_ns: with_empty[7].stamp_ns, ..nothing.clone() };
    with_empty[5] = nothing;
    fs::write(path.join("empty.mcap"), bag(&with_empty)).unwrap();
    let report = scored(path, &format!("score empty.mcap {RUNS}"), 0);
    let returns: usize = scans.iter().map(Scan::len).sum();
    let without = (returns - scans[5].len() - scans[7].len()) as u64;
    assert_eq!(report["inputs"]["returns"].as_u64(), Some(without));
    assert_eq!((&report["inputs"]["scans"], &report["order"][0]), (&24.into(), &"truth".into()));
    with_empty.iter_mut().for_each(|cloud| (cloud.width, cloud.row_step) = (0, 0));
    with_empty.iter_mut().for_each(|cloud| cloud.data.clear());
    fs::write(path.join("nothing.mcap"), bag(&with_empty)).unwrap();
    refused(path, &format!("score nothing.mcap {RUNS}"), 1, &["no return is used", "the scans are empty"]);
}

#[test]
fn row_11_either_order_of_bytes_is_read_and_a_wrong_one_is_told() {
    let (folder, scans) = town();
    let path = folder.path();
    let clouds: Vec<Cloud> = scans.iter().map(Cloud::of).collect();
    let swapped = |cloud: &Cloud| {
        let data = cloud.data.chunks_exact(4).flat_map(|c| [c[3], c[2], c[1], c[0]]).collect();
        Cloud { data, is_bigendian: true, ..cloud.clone() }
    };
    let right: Vec<Cloud> = clouds.iter().map(swapped).collect();
    fs::write(path.join("little.mcap"), bag(&clouds)).unwrap();
    fs::write(path.join("big.mcap"), bag(&right)).unwrap();
    let wanted = scored(path, &format!("score little.mcap {RUNS}"), 0);
    assert_eq!(scores(&scored(path, &format!("score big.mcap {RUNS}"), 0)), scores(&wanted));
    assert!(!wanted["warnings"].to_string().contains("is_bigendian"));
    // The mark alone: of every third scan, and of all.
    let mut some = clouds.clone();
    some.iter_mut().step_by(3).for_each(|cloud| cloud.is_bigendian = true);
    fs::write(path.join("some.mcap"), bag(&some)).unwrap();
    let report = scored(path, &format!("score some.mcap {RUNS}"), 0);
    let words = ["of the ranges are below 1 mm or above 100 km", "(is_bigendian)"];
    assert!(says(&report["warnings"], &words), "{}", report["warnings"]);
    some.iter_mut().for_each(|cloud| cloud.is_bigendian = true);
    fs::write(path.join("all.mcap"), bag(&some)).unwrap();
    refused(path, &format!("score all.mcap {RUNS}"), 1, &["no return is used", words[0], words[1]]);
}

fn moved(trajectory: &Trajectory, shift_m: [f64; 3]) -> Trajectory {
    let stamped = trajectory.stamps_ns().unwrap().iter().zip(trajectory.poses()).map(|(&stamp_ns, pose)| {
        let mut pose = *pose;
        pose.translation.vector += nalgebra::Vector3::from(shift_m);
        (stamp_ns, pose)
    });
    Trajectory::stamped(stamped.collect()).unwrap().trajectory
}

/// Places in UTM: with a shift by whole tiles nothing changes but the rounding of coordinates in the millions;
/// with any other one the voxels lie elsewhere in the town, and the scores change as little as that does.
#[test]
fn row_12_a_drive_in_utm_coordinates_is_scored_as_at_the_origin() {
    let (folder, _) = town();
    let path = folder.path();
    let near = scored(path, &format!("score town.mcap {RUNS}"), 0);
    let edge_m = near["config"]["tile_edge_m"].as_f64().unwrap();
    let whole_tiles = [500_000.0_f64, 4_000_000.0, 0.0].map(|c| (c / edge_m).round() * edge_m);
    let verdicts = |report: &Value| {
        let pairs = report["pairs"].as_array().unwrap();
        (report["order"].clone(), pairs.iter().map(|pair| pair["verdict"].clone()).collect::<Vec<_>>())
    };
    for (shift_m, tolerance) in [(whole_tiles, 1e-5), ([500_000.0, 4_000_000.0, 0.0], 0.1)] {
        for name in ["truth", "drift"] {
            let run = read_trajectory(&path.join(format!("{name}.tum"))).unwrap().trajectory;
            fs::create_dir_all(path.join("far")).unwrap();
            save_tum(&path.join(format!("far/{name}.tum")), &moved(&run, shift_m));
        }
        let far = scored(path, "score town.mcap -t far/truth.tum -t far/drift.tum", 0);
        assert_eq!(verdicts(&far), verdicts(&near));
        assert_close(&far, &near, tolerance);
    }
}

#[test]
fn row_13_a_million_identical_points_are_scored() {
    let (folder, scans) = town();
    let path = folder.path();
    let pile = |scan: &Scan| {
        let mut scan = scan.clone();
        let (point, time_ns) = (scan.points_in_sensor_m[10], scan.time_offsets_ns[10]);
        scan.points_in_sensor_m.extend(std::iter::repeat_n(point, 50_000));
        scan.time_offsets_ns.extend(std::iter::repeat_n(time_ns, 50_000));
        scan
    };
    let piles: Vec<Scan> = scans.iter().map(pile).collect();
    write_mcap(&path.join("piles.mcap"), &piles);
    write_folder(&path.join("pcd"), &piles, FolderFormat::Pcd);
    let report = scored(path, &format!("score piles.mcap {RUNS}"), 0);
    assert_eq!(scores(&scored(path, &format!("score pcd {RUNS}"), 0)), scores(&report));
    let used = report["inputs"]["returns_used"].as_u64().unwrap();
    assert!(used > 1_000_000, "{used}");
    for run in report["runs"].as_array().unwrap() {
        assert!(run["dmp_sum_m2"].as_f64().unwrap() >= 0.0, "{run}");
        assert!(run["surfels"].as_u64().unwrap() > 100 && run["r_near_m2"]["0.5"].is_number(), "{run}");
    }
    // Nothing but one point, a million times.
    let alone = |scan: &Scan| Scan {
        points_in_sensor_m: vec![[5.0, 5.0, 0.5]; 50_000],
        time_offsets_ns: vec![0; 50_000],
        ..scan.clone()
    };
    write_mcap(&path.join("alone.mcap"), &scans.iter().map(alone).collect::<Vec<_>>());
    let report = scored(path, &format!("score alone.mcap {RUNS} --ego none"), 0);
    assert_eq!(report["inputs"]["returns_used"].as_u64(), Some(24 * 50_000));
    assert_eq!(report["runs"][0]["r_cv_m2"]["0.2"], Value::Null);
}
