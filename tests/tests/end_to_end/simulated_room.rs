//! `dmp simulate room`: what it writes is a log with its truth, and its estimates score in their order.

use dmp_log::{LogOptions, open_log, read_mesh, read_trajectory};
use dmp_sensor::Scan;
use dmp_sim::ate_rmse_m;
use serde_json::Value;

use crate::common::{dmp, refused, text};

const ESTIMATES: [&str; 5] = ["good", "another", "odometry", "off", "false_loop"];

#[test]
fn a_room_is_read_back_with_its_truth_and_its_estimates_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &str| {
        let output = dmp(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}\n{}", text(&output.stderr));
        text(&output.stdout)
    };
    let make = "simulate room --size 80x60 --frames 200 --rate 10 --seed 2";
    let told = run(&format!("{make} -o room"));
    let at = |name: &str| folder.path().join("room").join(name);

    let log = open_log(&at(""), &LogOptions::default()).unwrap();
    assert_eq!(log.frames().len(), 200);
    assert_eq!(log.summary().camera.unwrap().focal_px(), [65.625; 2]);
    let truth = read_trajectory(&at("groundtruth.txt")).unwrap().trajectory;
    let stamps_ns: Vec<i64> = log.frames().iter().map(|frame| frame.stamp_ns.unwrap()).collect();
    assert_eq!(truth.stamps_ns().unwrap(), stamps_ns);
    let lines: Vec<&str> = told.lines().collect();
    assert!(lines[0].contains("200 images") && lines[1].contains("200 poses"), "{told}");
    for (line, name) in lines[2..].iter().zip(ESTIMATES) {
        let estimate = read_trajectory(&at(&format!("estimates/{name}.txt"))).unwrap().trajectory;
        let ate_m = ate_rmse_m(&estimate, &truth);
        assert!(line.contains(name) && line.contains(&format!("ATE {ate_m:.3} m")), "{line} {ate_m}");
    }

    // What the images show lies within the surface's bounds: camera frame, poses and mesh belong together.
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    let grow = |triangles: &[[[f64; 3]; 3]]| {
        for (vertex, k) in triangles.iter().flatten().flat_map(|vertex| (0..3).map(move |k| (vertex, k))) {
            bounds[k] = [bounds[k][0].min(vertex[k]), bounds[k][1].max(vertex[k])];
        }
        Ok::<(), dmp_log::LogError>(())
    };
    let mesh = read_mesh(&at("room.obj"), grow).unwrap();
    assert!(lines[7].replace(',', "").contains(&format!("room.obj: {} triangles", mesh.triangles)), "{told}");
    let mut reader = log.reader().unwrap();
    let mut scan = Scan::default();
    for index in (0..200).step_by(20) {
        reader.read(index, &mut scan).unwrap();
        for point in scan.points_in_sensor_m.iter().filter(|point| point[2] > 0.0) {
            let point = truth.poses()[index] * dmp_sensor::Point3::from(point.map(f64::from));
            let within = |k: usize| (bounds[k][0] - 0.3..bounds[k][1] + 0.3).contains(&point[k]);
            assert!((0..3).all(within), "{point}");
        }
    }

    let runs: Vec<String> = ESTIMATES.iter().map(|name| format!("-t room/estimates/{name}.txt")).collect();
    let score = format!("score room {} --voxel 0.1 --min-range 0.3 --json -q", runs.join(" "));
    let report: Value = serde_json::from_str(&run(&score)).unwrap();
    let order = report["order"].to_string();
    let place = |name: &str| order.find(&format!("\"{name}\"")).unwrap();
    assert!(place("good") < place("off") && place("another") < place("off"), "{order}");
    assert!(place("odometry") < place("off") && place("off") < place("false_loop"), "{order}");

    // The same numbers, the same bytes.
    run(&format!("{make} -o again"));
    let read = |from: &str, name: &str| std::fs::read(folder.path().join(from).join(name)).unwrap();
    for name in ["depth.txt", "camera.json", "groundtruth.txt", "room.obj", "estimates/false_loop.txt"] {
        assert!(read("room", name) == read("again", name), "{name}");
    }
    let list = String::from_utf8(read("room", "depth.txt")).unwrap();
    let image = list.lines().last().unwrap().split(' ').nth(1).unwrap();
    assert!(read("room", image) == read("again", image));

    // Loops of the walk.
    let told = run("simulate loops room/groundtruth.txt --room -o loops");
    assert!(told.contains("10 true, 10 false, 6 near"), "{told}");
}

#[test]
fn what_no_room_can_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refuse = |arguments: &str, words: &[&str]| {
        refused(folder.path(), &format!("simulate room -o room {arguments}"), 2, words);
        assert!(!folder.path().join("room").exists());
    };
    refuse("--frames 1", &["the number of images", "from 2 to 1000000"]);
    refuse("--room 4x5x2.5", &["the width of the room in m", "from 5 to 12"]);
    refuse("--size 0x480", &["an image of 0 x 480 pixels"]);
    refuse("--rate 0", &["the images per second"]);
    refuse("--depth-scale 0", &["the units per m"]);
    std::fs::create_dir(folder.path().join("there")).unwrap();
    refused(folder.path(), "simulate room -o there --size 16x12", 2, &["there", "not overwritten"]);
}
