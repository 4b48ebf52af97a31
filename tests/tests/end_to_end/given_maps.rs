//! Maps that the user gives: clouds and stores.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use dmp::{Basis, Config, EvaluateError, MapSource, Progress, Run, Stage, evaluate};
use dmp_log::NO_CHECKSUMS;
use dmp_sensor::{Ray, Scan, Track, Trajectory, UnitQuaternion, Vector3};

use crate::common::{comparable, dmp, open, score, small_town, text, unwrapped, write_mcap};
use crate::resume::{in_pieces, write_in_small_chunks};

/// A log, its truth, and all its points in the world.
fn town(folder: &Path) -> (PathBuf, Trajectory, Vec<[f64; 3]>) {
    let path = folder.join("town.mcap");
    let (scans, truth) = small_town(40, 180);
    write_mcap(&path, &scans);
    let points = world_points(&scans, &truth);
    (path, truth, points)
}

fn world_points(scans: &[Scan], run: &Trajectory) -> Vec<[f64; 3]> {
    let track = Track::new(run, dmp_sensor::Isometry3::identity(), i64::MAX);
    let mut points = Vec::new();
    for scan in scans {
        for (point, offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            let pose = track.world_from_sensor_at(scan.stamp_ns.unwrap() + offset_ns).unwrap();
            points.push(Ray::of_return(&pose, *point).endpoint_in_world());
        }
    }
    points
}

fn with_map(trajectory: &Trajectory, map: PathBuf) -> Vec<Run> {
    vec![Run { map: MapSource::Given(map), ..Run::new("given", trajectory.clone()) }]
}

fn write_ply(path: &Path, points: &[[f64; 3]]) {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nend_header\n",
        points.len()
    )
    .into_bytes();
    points.iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
    std::fs::write(path, bytes).unwrap();
}

fn write_pcd(path: &Path, points: &[[f64; 3]]) {
    let mut bytes = format!(
        "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA binary\n",
        points.len()
    )
    .into_bytes();
    points.iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
    std::fs::write(path, bytes).unwrap();
}

fn write_las(path: &Path, points: &[[f64; 3]], compressed: bool) {
    write_las_with(path, points, compressed, None);
}

fn write_las_with(path: &Path, points: &[[f64; 3]], compressed: bool, wkt: Option<&str>) {
    let mut builder = las::Builder::from((1, 4));
    builder.vlrs.extend(wkt.map(|text| las::Vlr {
        user_id: "LASF_Projection".into(),
        record_id: 2112,
        description: String::new(),
        data: text.into(),
    }));
    builder.point_format.is_compressed = compressed;
    let scale = las::Transform { scale: 1e-5, offset: 0.0 };
    builder.transforms = las::Vector { x: scale, y: scale, z: scale };
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    for [x, y, z] in points.iter().copied() {
        writer.write_point(las::Point { x, y, z, ..las::Point::default() }).unwrap();
    }
    writer.close().unwrap();
}

#[test]
fn a_cloud_of_the_same_points_gives_the_same_map_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let config = Config { voxel_m: Some(0.3), ego: dmp::Ego::None, ..Config::default() };
    let config = Config { save_maps: Some(folder.path().to_path_buf()), ..config };
    let fused = score(&log, &[Run::new("fused", truth.clone())], &config);
    let store = folder.path().join("fused.dmpmap");
    let [ply, pcd, las, laz] =
        ["map.ply", "map.pcd", "map.las", "map.laz"].map(|name| folder.path().join(name));
    write_ply(&ply, &points);
    write_pcd(&pcd, &points);
    write_las(&las, &points, false);
    write_las(&laz, &points, true);

    let of_fused = &fused.runs[0];
    for map in [store, ply, pcd, las, laz] {
        let report = score(&log, &with_map(&truth, map.clone()), &config);
        let given = &report.runs[0];
        // The same surfels: LAS rounds to 10 µm, where points may change voxels.
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 2e-3;
        assert!(
            close(given.dmp_sum_m2, of_fused.dmp_sum_m2),
            "{map:?}: {} {}",
            given.dmp_sum_m2,
            of_fused.dmp_sum_m2
        );
        assert!(close(given.r_near_m2[2].unwrap(), of_fused.r_near_m2[2].unwrap()), "{map:?}");
        assert_eq!(given.r_cv_m2[0], None);
        assert!(given.r_cv_withheld.as_ref().unwrap().to_string().contains("map was given"), "{given:?}");
        assert_eq!((given.coverage, given.coverage_revisit), (None, None));
        if map.extension().unwrap() != "las" && map.extension().unwrap() != "laz" {
            // The frame is found another way, to the last bits.
            let relative = (given.dmp_sum_m2 / of_fused.dmp_sum_m2 - 1.0).abs();
            assert!(relative < 1e-9, "{map:?}: {relative}");
        }
    }
}

#[test]
fn a_given_cloud_that_is_sparse_or_elsewhere_is_told_with_its_cause() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let turned = UnitQuaternion::new(Vector3::z() * 0.7);
    let elsewhere: Vec<[f64; 3]> = points
        .iter()
        .map(|point| (turned * Vector3::from(*point) + Vector3::new(3.0, 5.0, 10.0)).into())
        .collect();
    let cloud = folder.path().join("cloud.ply");
    let doubt = |points: &[[f64; 3]], voxel_m: f64| -> Option<String> {
        write_ply(&cloud, points);
        let config = Config { voxel_m: Some(voxel_m), ego: dmp::Ego::None, ..Config::default() };
        let report = score(&log, &with_map(&truth, cloud.clone()), &config);
        let mut warnings = report.runs[0].warnings.iter().map(ToString::to_string);
        warnings.find(|warning| warning.contains("are where its map has a surface"))
    };
    let sparse = "of 0.04 m; larger voxels may help";
    let told = doubt(&points, 0.04).unwrap();
    assert!(told.contains("And its points span a surface in only ") && told.ends_with(sparse), "{told}");
    let told = doubt(&elsewhere, 0.3).unwrap();
    assert!(
        told.ends_with("is the map in the trajectory's frame, and its unit right (--map-unit)?"),
        "{told}"
    );
    assert_eq!(doubt(&points, 0.3), None);

    write_ply(&cloud, &points);
    let told = |command: &str| text(&dmp(folder.path(), command).stderr);
    let built = told("map build cloud.ply --voxel 0.04 -o made.dmpmap");
    assert!(built.contains("warning: cloud.ply: its points span a surface in only "), "{built}");
    assert!(built.trim_end().ends_with(&format!("{sparse} (--voxel)")), "{built}");
    assert!(!told("map build cloud.ply --voxel 0.3 -o made.dmpmap").contains("warning"));
}

#[test]
fn runs_with_given_maps_are_compared_on_r_near() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let bent: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1], p[2] + 0.3 * (p[0] * 0.05).sin()]).collect();
    let [good, bad] = ["good.ply", "bad.ply"].map(|name| folder.path().join(name));
    write_ply(&good, &points);
    write_ply(&bad, &bent);
    let runs = [("bad", bad), ("good", good)]
        .map(|(name, map)| Run { map: MapSource::Given(map), ..Run::new(name, truth.clone()) });
    let report = score(&log, &runs, &Config::default());
    assert_eq!(report.order, ["good", "bad"]);
    assert_eq!(
        (report.pairs[0].basis, report.pairs[0].verdict.better()),
        (Basis::Near, Some("good")),
        "{:?}",
        report.pairs[0]
    );
    assert!(report.warnings.iter().any(|w| w.to_string().contains("a map was given")));
}

#[test]
fn a_map_that_cannot_be_read_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, _) = town(folder.path());
    let broken = folder.path().join("broken.ply");
    std::fs::write(&broken, "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n1 two 3\n").unwrap();
    for (map, words) in [(broken, "two"), (folder.path().join("none.las"), "none.las")] {
        let error =
            evaluate(open(&log).as_ref(), &with_map(&truth, map), &Config::default(), ()).unwrap_err();
        let chain = std::iter::successors(Some(&error as &dyn std::error::Error), |cause| cause.source());
        let text = chain.map(ToString::to_string).collect::<Vec<_>>().join(": ");
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn maps_of_different_voxels_are_not_compared() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, _) = town(folder.path());
    let save = |voxel_m: f64, name: &str| {
        let config =
            Config { voxel_m: Some(voxel_m), save_maps: Some(folder.path().into()), ..Config::default() };
        score(&log, &[Run::new(name, truth.clone())], &config);
        let map = MapSource::Given(folder.path().join(format!("{name}.dmpmap")));
        Run { map, ..Run::new(name, truth.clone()) }
    };
    let runs = [save(0.2, "fine"), save(0.5, "coarse")];
    let error = evaluate(open(&log).as_ref(), &runs, &Config::default(), ()).unwrap_err();
    assert!(matches!(error, EvaluateError::DifferentVoxels { .. }), "{error}");
}

#[test]
fn row_08_points_of_a_map_that_are_not_finite_are_dropped_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let holes: Vec<[f64; 3]> =
        points.iter().flat_map(|&p| [p, [f64::NAN, p[1], p[2]], [p[0], p[1], f64::INFINITY]]).collect();
    for (name, write) in [("map.ply", write_ply as fn(&Path, &[[f64; 3]])), ("map.pcd", write_pcd)] {
        let map = folder.path().join(name);
        write(&map, &points);
        let whole = score(&log, &with_map(&truth, map.clone()), &Config::default()).runs.remove(0);
        write(&map, &holes);
        let run = score(&log, &with_map(&truth, map), &Config::default()).runs.remove(0);
        assert_eq!((run.dmp_sum_m2, run.map.surfels), (whole.dmp_sum_m2, whole.map.surfels));
        assert_eq!((whole.map.map_points_dropped, run.map.map_points_dropped), (0, 2 * points.len() as u64));
        assert!(
            run.warnings.iter().any(|w| w.to_string().contains("of the given map are not finite")),
            "{:?}",
            run.warnings
        );
    }
}

/// The voxels are a quarter of a metre, and the shift a whole number of them: nothing may change but by the
/// rounding of coordinates in the millions, which is below 1 nm.
#[test]
fn row_12_a_map_in_utm_coordinates_scores_as_at_the_origin() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let shift = [458_000.0, 5_421_000.0, 110.0];
    let far: Vec<[f64; 3]> = points.iter().map(|p| std::array::from_fn(|k| p[k] + shift[k])).collect();
    let stamped = truth.stamps_ns().unwrap().iter().zip(truth.poses()).map(|(&stamp_ns, pose)| {
        let mut pose = *pose;
        pose.translation.vector += nalgebra::Vector3::from(shift);
        (stamp_ns, pose)
    });
    let far_truth = Trajectory::stamped(stamped.collect()).unwrap().trajectory;
    let [near_map, far_map] = ["near.pcd", "far.pcd"].map(|name| folder.path().join(name));
    write_pcd(&near_map, &points);
    write_pcd(&far_map, &far);
    let config = Config { voxel_m: Some(0.25), ..Config::default() };
    let near = score(&log, &with_map(&truth, near_map), &config).runs.remove(0);
    let far = score(&log, &with_map(&far_truth, far_map), &config).runs.remove(0);
    assert_eq!(near.map.surfels, far.map.surfels);
    assert_eq!((near.miss_rate, near.blocked_rate), (far.miss_rate, far.blocked_rate));
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-5;
    assert!(close(near.dmp_sum_m2, far.dmp_sum_m2), "{} {}", near.dmp_sum_m2, far.dmp_sum_m2);
    assert!(close(near.r_near_m2[2].unwrap(), far.r_near_m2[2].unwrap()));
}

#[test]
fn row_13_a_million_identical_points_make_no_surfel_and_no_trouble() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, mut points) = town(folder.path());
    let map = folder.path().join("map.pcd");
    write_pcd(&map, &points);
    let without = score(&log, &with_map(&truth, map.clone()), &Config::default()).runs.remove(0);
    let alone = vec![[3.0, 4.0, 500.0]; 1_000_000];
    points.extend(&alone);
    write_pcd(&map, &points);
    let with = score(&log, &with_map(&truth, map.clone()), &Config::default()).runs.remove(0);
    assert_eq!((with.dmp_sum_m2, with.map.surfels), (without.dmp_sum_m2, without.map.surfels));
    assert_eq!(with.map.thin_voxels, without.map.thin_voxels.map(|thin| thin + 1));
}

#[test]
fn row_33_a_map_without_a_surfel_is_refused_and_a_fused_one_told() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, _) = town(folder.path());
    let write = |file: &str, points: &[[f64; 3]]| write_ply(&folder.path().join(file), points);
    write("few.ply", &[[0.1, 0.1, 0.1], [9.0, 9.0, 9.0], [90.0, 0.0, 0.0]]);
    write("one.ply", &vec![[3.0, 4.0, 5.0]; 100_000]);
    write("none.ply", &[]);
    write("holes.ply", &[[f64::NAN, 0.0, 0.0]; 7]);
    let told = |command: &str, code: i32| {
        let output = dmp(folder.path(), command);
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{command}: {told}");
        told.lines().last().unwrap_or_default().to_owned()
    };
    std::fs::write(folder.path().join("made.dmpmap"), "made before").unwrap();
    for (file, words, built) in [
        ("none.ply", "it has no points", 1),
        ("holes.ply", "nothing in it is finite, 7 left out", 1),
        ("few.ply", "3 voxels of 0.2 m: are they dense enough", 0),
        ("one.ply", "1 voxel of 0.2 m: are they dense enough", 0),
    ] {
        let score = format!("score @/town.mcap -t a=@/truth.tum --voxel 0.2 --map {file}");
        for (command, code) in [(score, 1), (format!("map build -o made.dmpmap {file}"), built)] {
            let line = told(&command, code);
            assert!(line.contains(&format!("{file}: nothing for a ray to meet: ")), "{line}");
            assert!(line.contains(words), "{line}");
        }
        let kept = std::fs::read(folder.path().join("made.dmpmap")).unwrap() == b"made before";
        assert_eq!(kept, built == 1, "{file}");
    }
    let line = told("map build @/town.mcap -t @/truth.tum --voxel 0.01 -o made.dmpmap", 0);
    let words = "made.dmpmap: nothing for a ray to meet: it has no surfel, with voxels of 0.01 m";
    assert!(line.starts_with("warning: ") && line.contains(words), "{line}");
    // A saved map can be empty all the same, as one of a run whose voxels are too small.
    let config = Config { voxel_m: Some(0.01), save_maps: Some(folder.path().into()), ..Config::default() };
    let report = score(&log, &[Run::new("small", truth.clone())], &config);
    assert_eq!(report.runs[0].map.surfels, 0);
    let warnings: Vec<String> = report.runs[0].warnings.iter().map(ToString::to_string).collect();
    assert!(warnings.len() == 1 && warnings[0].contains("voxels large enough (--voxel)"), "{warnings:?}");
    let saved = with_map(&truth, folder.path().join("small.dmpmap"));
    let refusal = evaluate(open(&log).as_ref(), &saved, &Config::default(), ()).unwrap_err().to_string();
    assert!(refusal.contains("small.dmpmap: ") && refusal.contains("it has no surfel"), "{refusal}");
}

#[test]
fn a_map_in_feet_is_brought_to_metres_and_the_report_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let in_feet: Vec<[f64; 3]> = points.iter().map(|p| p.map(|c| c / 0.3048)).collect();
    let [metres, feet] = ["metres.laz", "feet.laz"].map(|name| folder.path().join(name));
    write_las(&metres, &points, true);
    write_las_with(&feet, &in_feet, true, Some(r#"PROJCS["p",GEOGCS["g"],UNIT["foot",0.3048]]"#));
    let config = Config { voxel_m: Some(0.3), ..Config::default() };
    let [of_metres, of_feet] = [metres, feet].map(|map| score(&log, &with_map(&truth, map), &config));
    let near = |report: &dmp::Report| report.runs[0].r_near_m2[2].unwrap();
    assert!(
        (near(&of_feet) / near(&of_metres) - 1.0).abs() < 1e-2,
        "{} {}",
        near(&of_feet),
        near(&of_metres)
    );
    assert_eq!(of_metres.inputs.runs[0].map_notes, [NO_CHECKSUMS]);
    assert_eq!(
        of_feet.inputs.runs[0].map_notes,
        ["in feet, heights too by its well-known text: brought to metres", NO_CHECKSUMS]
    );
}

#[test]
fn the_command_tells_of_units_and_refuses_degrees() {
    let folder = tempfile::tempdir().unwrap();
    let floor: Vec<[f64; 3]> =
        (0..40_000).map(|k| [f64::from(k % 200) * 0.05, f64::from(k / 200) * 0.05, 0.0]).collect();
    let map = folder.path().join("map.las");
    write_las_with(&map, &floor, false, Some(r#"GEOGCS["WGS 84",UNIT["degree",0.0174532925199433]]"#));
    let score = "score @/town.mcap -t a=@/truth.tum --map map.las";
    let output = dmp(folder.path(), score);
    assert_eq!(output.status.code(), Some(1));
    let refusal = text(&output.stderr);
    let refusal = refusal.lines().last().unwrap();
    assert!(refusal.contains("map.las: ") && refusal.contains("longitude and latitude"), "{refusal}");
    let output = dmp(folder.path(), &format!("{score} --map-unit us-ft"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let told = "in US survey feet, as --map-unit says: brought to metres";
    assert!(text(&output.stderr).contains(&format!("note: map of `a`: {told}")), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    assert!(unwrapped(&table).contains(&format!("map of a: {told}")), "{table}");
}

/// Notes what is begun.
#[derive(Default)]
struct Begun(Mutex<Vec<Stage>>);

impl Progress for Begun {
    fn begin(&self, stage: Stage, _: u64) {
        self.0.lock().unwrap().push(stage);
    }
}

#[test]
fn a_bad_map_is_told_before_the_log_is_read_for_the_maps_of_other_runs() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let path = folder.path().join("map.ply");
    write_ply(&path, &points);
    let runs = || vec![Run::new("fused", truth.clone()), with_map(&truth, path.clone()).remove(0)];
    let begun = |runs: &[Run]| {
        let watch = Begun::default();
        let result = evaluate(open(&log).as_ref(), runs, &Config::default(), &watch);
        (result.map(|report| report.order), watch.0.into_inner().unwrap())
    };
    let (order, stages) = begun(&runs());
    let at = |stage| stages.iter().position(|&begun| begun == stage).unwrap();
    assert!(order.is_ok() && at(Stage::ReadMap) < at(Stage::Fuse), "{order:?}: {stages:?}");

    std::fs::write(&path, &std::fs::read(&path).unwrap()[..1000]).unwrap();
    let (order, stages) = begun(&runs());
    assert!(order.is_err() && stages.contains(&Stage::ReadMap), "{order:?}: {stages:?}");
    assert!(!stages.contains(&Stage::Fuse), "{stages:?}");
}

#[test]
fn a_score_with_a_given_cloud_in_many_pieces_is_the_one_in_one_piece() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("town.mcap");
    let (scans, truth) = small_town(40, 180);
    write_in_small_chunks(&log, &scans);
    let path = folder.path().join("map.ply");
    write_ply(&path, &world_points(&scans, &truth));
    let runs = [Run::new("fused", truth.clone()), with_map(&truth, path).remove(0)];
    let whole = score(&log, &runs, &Config::default());
    let pieces = Config {
        work_folder: folder.path().to_path_buf(),
        checkpoint_every: Some(Duration::ZERO),
        resume: true,
        ..Config::default()
    };
    // The cloud is read first each time, then scans are fused from where that ended.
    let (report, stops) = in_pieces(&log, &runs, &pieces, 40_000);
    assert!(stops > 4, "{stops} stops");
    assert_eq!(comparable(&report), comparable(&whole));
    assert_eq!(folder.path().read_dir().unwrap().count(), 2, "nothing is left behind");
}
