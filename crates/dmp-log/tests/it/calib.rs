use crate::common::{assert_says, refusals};
use dmp_log::{find_calib, parse_calib, read_calib};
use dmp_sensor::{Isometry3, Point3};
use std::fs;

/// A LiDAR 0.3 m behind and 0.1 m above a camera, with the camera's z ahead: as KITTI has it.
const ROWS: &str = "0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3";

fn odometry() -> String {
    let camera = "7.0e+02 0 6.0e+02 0 0 7.0e+02 1.8e+02 0 0 0 1 0";
    format!("P0: {camera}\nP1: {camera}\r\nTr: {ROWS}\n")
}

/// A point 10 m ahead of the LiDAR, 2 m to its left and 1 m up.
fn in_camera(camera_from_velodyne: &Isometry3<f64>) -> [f64; 3] {
    (camera_from_velodyne * Point3::new(10.0, 2.0, 1.0)).into()
}

fn near(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
}

#[test]
fn every_kind_of_kitti_says_where_the_lidar_is() {
    let expected = [-2.0, -1.1, 9.7];
    assert!(near(in_camera(&parse_calib(odometry().as_bytes()).unwrap()), expected));
    let raw = "calib_time: 15-Mar-2012 11:37:16\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.1 -0.3\ndelta_f: 0 0\n";
    assert!(near(in_camera(&parse_calib(raw.as_bytes()).unwrap()), expected));
    let without_colons = format!("Tr_velo_cam {ROWS}\n");
    assert!(near(in_camera(&parse_calib(without_colons.as_bytes()).unwrap()), expected));
    // A rectification of a quarter turn about z: the camera's x is its former -y.
    let object = format!("R0_rect: 0 -1 0 1 0 0 0 0 1\nTr_velo_to_cam: {ROWS}\nTr_imu_to_velo: {ROWS}\n");
    assert!(near(in_camera(&parse_calib(object.as_bytes()).unwrap()), [1.1, -2.0, 9.7]));
}

#[test]
fn a_broken_calibration_is_named_with_its_line() {
    refusals(
        |lines| parse_calib(format!("P0: 1 2\n{lines}\n").as_bytes()).unwrap_err().to_string(),
        "line 2: ",
        &[
            ("Tr: 0 -1 0 0 0 0 -1 -0.1 1 0 0", "11 columns | cut?"),
            ("Tr: 0 -1 0 0 0 0 -1 -0.1 1 0 nan -0.3", "`nan`"),
            ("Tr: 0 -2 0 0 0 0 -1 -0.1 1 0 0 -0.3", "no rotation"),
            ("R: 0 -1 0 0 0 1 1 0 0\nT: 0 0 0", "reflection"),
            ("Tr_velo_to_cam: 1 2 3", "3 columns"),
        ],
    );
    let twice = parse_calib(format!("{}Tr: {ROWS}", odometry()).as_bytes()).unwrap_err();
    assert_says(&twice.to_string(), &["line 4", "`Tr:` is there twice"]);
    for none in ["", "P0: 1 2 3\n", "R: 0 -1 0 0 0 -1 1 0 0\n", "T: 0 0 0"] {
        assert_says(&parse_calib(none.as_bytes()).unwrap_err().to_string(), &["no line `Tr:`"]);
    }
}

#[test]
fn the_first_folder_that_has_one_is_taken() {
    let temporary = tempfile::tempdir().unwrap();
    let [none, other, kitti] = ["none", "other", "kitti"].map(|name| temporary.path().join(name));
    for folder in [&none, &other, &kitti] {
        fs::create_dir(folder).unwrap();
    }
    let folders = || [none.as_path(), &other, &kitti];
    assert_eq!(find_calib(folders()).unwrap(), None);
    // Of another kind altogether.
    fs::write(other.join("calib.txt"), b"Camera.fx: 458\n\xff\xfe").unwrap();
    fs::write(kitti.join("calib.txt"), odometry()).unwrap();
    let found = find_calib(folders()).unwrap().unwrap();
    assert_eq!(found.path, kitti.join("calib.txt"));
    assert_eq!(found.camera_from_velodyne, read_calib(&found.path).unwrap());
    fs::write(other.join("calib.txt"), "Tr: 1 2 3").unwrap();
    assert_says(&find_calib(folders()).unwrap_err().to_string(), &["other/calib.txt: line 1: "]);
    assert_says(&read_calib(&none).unwrap_err().to_string(), &["none"]);
    assert!(read_calib(&none.join("calib.txt")).unwrap_err().is_usage());
}
