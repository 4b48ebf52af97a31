//! `dmp simulate room`: what it writes is a log with its truth, and its estimates score in their order.

use dmp_log::read_mesh;
use dmp_sensor::{Point3, Scan};
use dmp_sim::ate_rmse_m;

use crate::common::{done, has, json, once, open, refused, trajectory};

const ESTIMATES: [&str; 5] = ["good", "another", "odometry", "off", "false_loop"];
const MAKE: &str = "simulate room --size 80x60 --frames 200 --rate 10 --seed 2 -o room";

#[test]
fn a_room_is_read_back_with_its_truth_and_its_estimates_score_in_their_order() {
    let folder = tempfile::tempdir().unwrap();
    let made = once(MAKE);
    let room = made.folder.join("room");
    let printed = made.stdout();
    let lines: Vec<&str> = printed.lines().collect();
    let log = open(&room);
    assert_eq!(log.frames().len(), 200);
    assert_eq!(log.summary().camera.unwrap().focal_px(), [65.625; 2]);
    let truth = trajectory(&room.join("groundtruth.txt"));
    let stamps_ns: Vec<i64> = log.frames().iter().map(|frame| frame.stamp_ns.unwrap()).collect();
    assert_eq!(truth.stamps_ns().unwrap(), stamps_ns);
    for (line, name) in lines[2..].iter().zip(ESTIMATES) {
        let ate_m = ate_rmse_m(&trajectory(&room.join(format!("estimates/{name}.txt"))), &truth);
        has(line, &[name, &format!("ATE {ate_m:.3} m")]);
    }

    // What the images show lies within the surface's bounds: camera frame, poses and mesh belong together.
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    let grow = |triangles: &[[[f64; 3]; 3]]| {
        for (vertex, k) in triangles.iter().flatten().flat_map(|vertex| (0..3).map(move |k| (vertex, k))) {
            bounds[k] = [bounds[k][0].min(vertex[k]), bounds[k][1].max(vertex[k])];
        }
        Ok::<(), dmp_log::LogError>(())
    };
    let mesh = read_mesh(&room.join("room.obj"), grow).unwrap();
    has(&lines[7].replace(',', ""), &[&format!("room.obj: {} triangles", mesh.triangles)]);
    let (mut reader, mut scan) = (log.reader().unwrap(), Scan::default());
    for index in (0..200).step_by(20) {
        reader.read(index, &mut scan).unwrap();
        for point in scan.points_in_sensor_m.iter().filter(|point| point[2] > 0.0) {
            let point = truth.poses()[index] * Point3::from(point.map(f64::from));
            let within = |k: usize| (bounds[k][0] - 0.3..bounds[k][1] + 0.3).contains(&point[k]);
            assert!((0..3).all(within), "{point}");
        }
    }

    let runs: Vec<String> = ESTIMATES.iter().map(|name| format!("-t room/estimates/{name}.txt")).collect();
    let report = json(
        &made.folder,
        &format!("score room {} --voxel 0.1 --min-range 0.3 --trust --drift=none -q", runs.join(" ")),
    );
    let order = report["order"].to_string();
    let place = |name: &str| order.find(&format!("\"{name}\"")).unwrap();
    assert!(place("good") < place("off") && place("another") < place("off"), "{order}");
    assert!(place("odometry") < place("off") && place("odometry") < place("false_loop"), "{order}");

    // The same numbers, the same bytes.
    done(folder.path(), MAKE);
    for name in ["depth.txt", "camera.json", "groundtruth.txt", "room.obj", "estimates/false_loop.txt"] {
        let [a, b] =
            [&made.folder, folder.path()].map(|at| std::fs::read(at.join("room").join(name)).unwrap());
        assert!(a == b, "{name}");
    }
    // Loops of the walk.
    has(
        &done(folder.path(), "simulate loops room/groundtruth.txt --room -o loops"),
        &["10 true, 10 false, 6 near"],
    );
}

/// Three people walk around while the camera does: the good estimate is the better one.
#[test]
fn people_who_walk_change_no_verdict() {
    let made = once(&format!("{MAKE} --people 3"));
    let runs = ["good", "off", "false_loop"].map(|name| format!("-t room/estimates/{name}.txt")).join(" ");
    let score = format!("score room {runs} --voxel 0.1 --min-range 0.3 --drift=none -q");
    let report = json(&made.folder, &score);
    let pairs = report["pairs"].as_array().unwrap();
    let of_good = || pairs.iter().filter(|pair| pair["a"] == "good" || pair["b"] == "good");
    assert_eq!(of_good().count(), 2);
    for pair in of_good() {
        assert_eq!(pair["verdict"], "good", "{pair}");
    }
    let runs = report["runs"].as_array().unwrap();
    let good = runs.iter().find(|run| run["name"] == "good").unwrap();
    assert!(!good["warnings"].to_string().contains("blocked"), "{good}");
}

#[test]
fn what_no_room_can_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        ("--frames 1", ["the number of images", "from 2 to 1000000"]),
        ("--room 4x5x2.5", ["the width of the room in m", "from 5 to 12"]),
        ("--size 0x480", ["an image of 0 x 480 pixels", ""]),
        ("--rate 0", ["the images per second", ""]),
        ("--depth-scale 0", ["the units per m", ""]),
    ] {
        refused(folder.path(), &format!("simulate room -o room {arguments}"), 2, &words);
        assert!(!folder.path().join("room").exists());
    }
    std::fs::create_dir(folder.path().join("there")).unwrap();
    refused(folder.path(), "simulate room -o there --size 16x12", 2, &["there", "not overwritten"]);
}

#[test]
fn guessed_units_of_depth_that_do_not_fit_the_poses_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (units, is_right) in [(1000, false), (5000, true)] {
        let room = format!("room{units}");
        done(path, &format!("simulate room -o {room} --frames 24 --rate 10 --depth-scale {units} --quiet"));
        std::fs::remove_file(path.join(&room).join("camera.json")).unwrap();
        let score = format!(
            "score {room} -t {room}/estimates/good.txt -t {room}/estimates/odometry.txt --voxel 0.05"
        );
        if is_right {
            done(path, &format!("{score} --quiet"));
        } else {
            let words = ["5000 units of depth a metre were guessed, and 1000 fit", "`\"depth_scale\": 1000`"];
            refused(path, &score, 1, &words);
        }
    }
}
