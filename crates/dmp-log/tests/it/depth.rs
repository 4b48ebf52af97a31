//! Folders of depth images: layouts, cameras, damage.

use crate::common::{assert_says, open, open_error, read_all};
use dmp_log::{
    DepthFolderWriter, LogFormat, LogOptions, PointTime, StampAt, TimeUnit, encode_depth_png, open_log,
};
use dmp_sensor::{Distortion, PinholeCamera, Scan};
use std::fs;
use std::path::Path;

const VGA: [u32; 2] = [640, 480];

/// An image with a plane that leans, a hole and values of one byte and two.
fn values([width, height]: [u32; 2]) -> Vec<u16> {
    let value = |k: u32| if k % 7 == 3 { 0 } else { ((k % width) * 40 + k / width) as u16 };
    (0..width * height).map(value).collect()
}

fn put(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

fn put_images(folder: &Path, names: &[&str], size_px: [u32; 2]) {
    let image = encode_depth_png(size_px, &values(size_px)).unwrap();
    names.iter().for_each(|name| put(&folder.join(name), &image));
}

/// The point that a pixel sees, by the formula.
fn point(camera: &PinholeCamera, pixel: usize, depth_m: f32) -> [f32; 3] {
    if depth_m == 0.0 {
        return [0.0; 3];
    }
    let width = camera.size_px()[0] as usize;
    let ([fx, fy], [cx, cy], z) = (camera.focal_px(), camera.centre_px(), f64::from(depth_m));
    let (u, v) = ((pixel % width) as f64, (pixel / width) as f64);
    [((u - cx) / fx * z) as f32, ((v - cy) / fy * z) as f32, depth_m]
}

fn assert_points(scan: &Scan, camera: &PinholeCamera, values: &[u16], units_per_m: f64) {
    assert_eq!(scan.len(), values.len());
    for (pixel, &value) in values.iter().enumerate() {
        let expected = point(camera, pixel, (f64::from(value) / units_per_m) as f32);
        assert_eq!(scan.points_in_sensor_m[pixel], expected, "pixel {pixel}");
    }
    assert!(scan.time_offsets_ns.is_empty());
}

fn camera_of(path: &Path) -> PinholeCamera {
    open(path).summary().camera.unwrap()
}

#[test]
fn tum_rgbd_is_read_by_its_list() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let names = ["depth/1305031102.160407.png", "depth/1305031102.194330.png"];
    put_images(root, &names, VGA);
    put(&root.join("rgb/1305031102.175304.png"), "colours are not looked at");
    put(&root.join("groundtruth.txt"), "1305031102.1758 0 0 0 0 0 0 1\n");
    let list = format!(
        "# depth maps\r\n# file: 'a.bag'\r\n1305031102.160407\t{}\r\n1305031102.194330 {}\r\n",
        names[0], names[1]
    );
    put(&root.join("depth.txt"), list);
    let log = open(root);
    let summary = log.summary();
    assert_eq!((summary.format, summary.depth_units_per_m), (LogFormat::TumRgbd, Some(5000.0)));
    assert_eq!(
        (summary.returns, summary.point_bytes, summary.period_ns),
        (2 * 640 * 480, 2, Some(33_923_000))
    );
    let camera = PinholeCamera::new(VGA, [525.0, 525.0], [319.5, 239.5], Distortion::NONE).unwrap();
    assert_eq!(summary.camera, Some(camera));
    assert_says(
        &summary.notes.join("; "),
        &["depth.txt, read as TUM RGB-D", "fx 525, fy 525, cx 319.5, cy 239.5"],
    );
    assert_says(
        &summary.notes.join("; "),
        &["guessed: usual for TUM RGB-D", "5000 units of depth a metre, guessed"],
    );
    let scans = read_all(&*log);
    assert_eq!(scans[0].stamp_ns, Some(1_305_031_102_160_407_000));
    assert_points(&scans[1], &camera, &values(VGA), 5000.0);
    // Without its list, and its folder of images alone: the names are stamps.
    fs::remove_file(root.join("depth.txt")).unwrap();
    for path in [root.to_owned(), root.join("depth")] {
        let named = open(&path);
        assert_eq!((named.summary().format, named.frames()), (LogFormat::TumRgbd, log.frames()));
        assert_says(&named.summary().notes.join("; "), &["stamps from the file names"]);
    }
    // Associations in either order.
    let rgb = "1305031102.175304 rgb/1305031102.175304.png";
    let list = format!("{rgb} 1305031102.160407 {}\n1305031102.194330 {} {rgb}\n", names[0], names[1]);
    put(&root.join("associate.txt"), list);
    assert_eq!(open(root).frames(), log.frames());
}

#[test]
fn icl_nuim_is_found_by_its_counters() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    put_images(root, &["depth/10.png", "depth/9.png", "depth/0.png"], VGA);
    let by_name = open(root);
    let seconds = |k: i64| Some(k * 1_000_000_000);
    let stamps =
        |log: &dyn dmp_log::ScanLog| log.frames().iter().map(|frame| frame.stamp_ns).collect::<Vec<_>>();
    assert_eq!(stamps(&*by_name), [seconds(0), seconds(9), seconds(10)]);
    assert_says(
        &by_name.summary().notes.join("; "),
        &["read as ICL-NUIM", "numbers in the file names taken as stamps"],
    );
    put(
        &root.join("associations.txt"),
        "10 depth/10.png 10 rgb/10.png\n0 depth/0.png 0 rgb/0.png\n9 depth/9.png 9 rgb/9.png\n",
    );
    let log = open(root);
    assert_eq!(stamps(&*log), stamps(&*by_name));
    let camera = PinholeCamera::new(VGA, [481.2, -480.0], [319.5, 239.5], Distortion::NONE).unwrap();
    assert_eq!((log.summary().format, log.summary().camera), (LogFormat::IclNuim, Some(camera)));
    assert_says(&log.summary().notes.join("; "), &["usual for ICL-NUIM", "fy -480", "5000 units"]);
    assert_points(&read_all(&*log)[2], &camera, &values(VGA), 5000.0);
}

#[test]
fn redwood_is_found_by_leading_zeros() {
    for place in ["", "depth", "livingroom1-depth-clean"] {
        let folder = tempfile::tempdir().unwrap();
        put_images(&folder.path().join(place), &["00000.png", "00001.png"], VGA);
        put(&folder.path().join("livingroom.ply"), "a map beside the images");
        let log = open(folder.path());
        let summary = log.summary();
        assert_eq!((summary.format, summary.depth_units_per_m), (LogFormat::DepthFolder, Some(1000.0)));
        assert_eq!((summary.span_ns, log.frames()[1].stamp_ns), (None, None));
        assert_says(&summary.notes.join("; "), &["read as Redwood", "no stamps", "1000 units", "fx 525"]);
        assert_points(&read_all(&*log)[1], &summary.camera.unwrap(), &values(VGA), 1000.0);
    }
    let folder = tempfile::tempdir().unwrap();
    for place in ["a-depth-clean", "a-depth-simulated"] {
        put_images(&folder.path().join(place), &["00000.png"], VGA);
    }
    assert_says(
        &open_error(folder.path(), &LogOptions::default()),
        &["several folders", "a-depth-clean, ", "name the one"],
    );
}

#[test]
fn a_camera_beside_the_images_beats_the_guess() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    put_images(root, &["depth/00000.png", "depth/00001.png"], [12, 9]);
    let error = open_error(root, &LogOptions::default());
    assert_says(&error, &["images of 12 x 9 pixels", "a camera.json beside them"]);
    let json =
        |size: &str, more: &str| format!("{{{size},\"intrinsic_matrix\":[10.5,0,0,0,11,0,5.5,4,1]{more}}}");
    put(&root.join("camera.json"), json("\"width\":12,\"height\":9", ",\"depth_scale\":2000"));
    let camera = PinholeCamera::new([12, 9], [10.5, 11.0], [5.5, 4.0], Distortion::NONE).unwrap();
    let log = open(root);
    assert_eq!((log.summary().camera, log.summary().depth_units_per_m), (Some(camera), Some(2000.0)));
    assert_says(&log.summary().notes.join("; "), &["camera.json; 2000 units of depth a metre, from "]);
    assert_points(&read_all(&*log)[0], &camera, &values([12, 9]), 2000.0);
    // The folder of the images alone finds it too.
    assert_eq!(camera_of(&root.join("depth")), camera);

    put(&root.join("camera.json"), json("\"width\":13,\"height\":9", ""));
    let error = open_error(root, &LogOptions::default());
    assert_says(&error, &["no depth image can be read", "00000.png: 12 x 9 pixels, not 13 x 9"]);
    put(&root.join("camera.json"), "{");
    assert_says(&open_error(root, &LogOptions::default()), &["camera.json: the whole file: no JSON"]);
    put(&root.join("camera.json"), json("\"width\":20000,\"height\":9", ""));
    assert_says(&open_error(root, &LogOptions::default()), &["12 x 9 pixels, not 20000 x 9"]);
}

#[test]
fn images_of_other_names_need_to_be_explained() {
    let folder = tempfile::tempdir().unwrap();
    put_images(folder.path(), &["frame-000000.depth.png", "frame-000001.depth.png"], VGA);
    assert_says(&open_error(folder.path(), &LogOptions::default()), &["640 x 480", "a camera.json"]);
    let json = "{\"width\":640,\"height\":480,\"intrinsic_matrix\":[585,0,0,0,585,0,320,240,1]";
    put(&folder.path().join("camera.json"), format!("{json}}}"));
    assert_says(&open_error(folder.path(), &LogOptions::default()), &["camera.json", "depth_scale"]);
    put(&folder.path().join("camera.json"), format!("{json},\"depth_scale\":1000}}"));
    assert_eq!(open(folder.path()).frames().len(), 2);
}

#[test]
fn options_for_other_logs_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    put_images(folder.path(), &["depth/00000.png"], VGA);
    let default = LogOptions::default;
    for (options, said) in [
        (LogOptions { topic: Some("/a".into()), ..default() }, "`topic` /a was given"),
        (
            LogOptions { point_time: PointTime::Relative(TimeUnit::Seconds), ..default() },
            "`point_time` s was given",
        ),
        (LogOptions { stamp_at: StampAt::End, ..default() }, "`stamp_at` end was given"),
    ] {
        let error = open_log(folder.path(), &options).unwrap_err();
        assert!(error.is_usage());
        assert_says(&error.to_string(), &[said]);
    }
    assert!(open_log(folder.path(), &LogOptions { point_time: PointTime::Ignore, ..default() }).is_ok());
}

#[test]
fn what_is_written_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let lens = Distortion { radial: [0.2624, -0.9531, 1.1633], tangential: [-0.0054, 0.0026] };
    let camera = PinholeCamera::new([12, 9], [51.73, -51.65], [5.86, 4.3], lens).unwrap();
    let stamps_ns = [1_305_031_102_160_407_000, 1_305_031_102_194_330_001, 1_305_031_103_000_000_000];
    let image = |k: usize| (0..12 * 9).map(|pixel| (pixel * 601 * (k + 1)) as u16).collect::<Vec<u16>>();
    let write = |name: &str| {
        let path = folder.path().join(name);
        let mut writer = DepthFolderWriter::create(&path, &camera, 5000.0).unwrap();
        for (k, &stamp_ns) in stamps_ns.iter().enumerate() {
            match k {
                1 => writer.write_encoded(stamp_ns, &encode_depth_png([12, 9], &image(k)).unwrap()).unwrap(),
                _ => writer.write_image(stamp_ns, &image(k)).unwrap(),
            }
        }
        let error = writer.write_image(0, &[0; 5]).unwrap_err().to_string();
        assert_says(&error, &[name, "frame 3", "5 values for 12 x 9 pixels"]);
        let error = writer.write_image(stamps_ns[0], &image(0)).unwrap_err().to_string();
        assert_says(&error, &["the stamp 1305031102.160407000 s was there before"]);
        writer.finish().unwrap();
        path
    };
    let [path, again] = ["one", "two"].map(write);
    let list = fs::read_to_string(path.join("depth.txt")).unwrap();
    assert!(list.starts_with("# depth maps\n# file: '") && list.contains("\n# timestamp filename\n"));
    assert!(
        list.contains("\n1305031102.160407 depth/1305031102.160407.png\n1305031102.194330001 depth/"),
        "{list}"
    );
    for file in ["depth.txt", "camera.json", "depth/1305031102.160407.png", "depth/1305031102.194330001.png"]
    {
        assert_eq!(fs::read(path.join(file)).unwrap(), fs::read(again.join(file)).unwrap(), "{file}");
    }
    let log = open(&path);
    assert_eq!((log.summary().camera, log.summary().depth_units_per_m), (Some(camera), Some(5000.0)));
    let bearings = camera.bearings();
    for (k, scan) in read_all(&*log).iter().enumerate() {
        assert_eq!(scan.stamp_ns, Some(stamps_ns[k]));
        for (pixel, value) in image(k).into_iter().enumerate() {
            let depth_m = (f64::from(value) / 5000.0) as f32;
            assert_eq!(scan.points_in_sensor_m[pixel], bearings.point(pixel, depth_m));
        }
    }
    // What is not finished leaves nothing, and nothing is written over.
    assert!(DepthFolderWriter::create(&path, &camera, 5000.0).unwrap_err().is_usage());
    drop(DepthFolderWriter::create(&folder.path().join("three"), &camera, 5000.0).unwrap());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    let error = DepthFolderWriter::create(&folder.path().join("four"), &camera, 0.0).unwrap_err().to_string();
    assert_says(&error, &["0 units of depth a metre"]);
    assert_says(&encode_depth_png([0, 4], &[]).unwrap_err().to_string(), &["PNG"]);
}
