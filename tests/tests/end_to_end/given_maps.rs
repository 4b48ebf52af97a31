//! Maps that the user gives: clouds and stores.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};
use std::time::Duration;

use dmp::{Basis, Config, EvaluateError, MapSource, Progress, Run, Stage, evaluate};
use dmp_log::NO_CHECKSUMS;
use dmp_sensor::{Isometry3, Ray, Track, Trajectory, Translation3, UnitQuaternion, Vector3};

use crate::common::{
    SCORE, SMALL_CHUNK, comparable, ends, has, open, plain, refused, score, small_town, text, write_chunks,
    write_mcap,
};
use crate::resume::in_pieces;

type Points = Vec<[f64; 3]>;

/// A log, its truth, and all its points in the world.
fn town(folder: &Path) -> (PathBuf, Trajectory, Points) {
    static POINTS: OnceLock<Points> = OnceLock::new();
    let path = folder.join("town.mcap");
    let (scans, truth) = small_town(40, 180);
    write_mcap(&path, &scans);
    let points = POINTS.get_or_init(|| {
        let track = Track::new(&truth, Isometry3::identity(), i64::MAX);
        let returns = scans.iter().flat_map(|scan| {
            let stamp_ns = scan.stamp_ns.unwrap();
            let times_ns = scan.time_offsets_ns.iter().map(move |offset_ns| stamp_ns + offset_ns);
            scan.points_in_sensor_m.iter().zip(times_ns)
        });
        returns
            .map(|(point, ns)| {
                Ray::of_return(&track.world_from_sensor_at(ns).unwrap(), *point).endpoint_in_world()
            })
            .collect()
    });
    (path, truth, points.clone())
}

fn with_map(trajectory: &Trajectory, map: PathBuf) -> Vec<Run> {
    vec![Run { map: MapSource::Given(map), ..Run::new("given", trajectory.clone()) }]
}

/// Writes points as what the name ends in: PLY, PCD, LAS or LAZ.
fn write_cloud(path: &Path, points: &[[f64; 3]]) {
    let count = points.len();
    let head = match path.extension().unwrap().to_str().unwrap() {
        "ply" => format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty double x\nproperty double y\n\
             property double z\nend_header\n"
        ),
        "pcd" => format!(
            "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH {count}\nHEIGHT 1\nPOINTS {count}\nDATA binary\n"
        ),
        _ => return write_las(path, points, None),
    };
    let mut bytes = head.into_bytes();
    points.iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
    std::fs::write(path, bytes).unwrap();
}

fn write_las(path: &Path, points: &[[f64; 3]], wkt: Option<&str>) {
    let mut builder = las::Builder::from((1, 4));
    builder.vlrs.extend(wkt.map(|text| las::Vlr {
        user_id: "LASF_Projection".into(),
        record_id: 2112,
        description: String::new(),
        data: text.into(),
    }));
    builder.point_format.is_compressed = path.extension().unwrap() == "laz";
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
    let config = Config { voxel_m: Some(0.3), ego: dmp::Ego::None, ..plain() };
    let config = Config { save_maps: Some(folder.path().to_path_buf()), ..config };
    let fused = score(&log, &[Run::new("fused", truth.clone())], &config);
    let mut reference = fused.runs[0].clone();
    for name in ["fused.dmpmap", "map.ply", "map.pcd", "map.las", "map.laz"] {
        let map = folder.path().join(name);
        if name != "fused.dmpmap" {
            write_cloud(&map, &points);
        }
        let report = score(&log, &with_map(&truth, map), &config);
        let given = &report.runs[0];
        assert!(given.map.thickness.is_none(), "how thick a given map is says nothing of the run");
        // What moves stays in a given cloud.
        if name == "map.ply" {
            assert!(given.dmp_sum_m2 > reference.dmp_sum_m2);
            reference = given.clone();
        }
        // The same surfels. The frame is found another way, to the last bits; LAS rounds to 10 µm, where points may change
        // voxels.
        let most = if name.contains(".la") { 2e-3 } else { 1e-9 };
        assert!((given.dmp_sum_m2 / reference.dmp_sum_m2 - 1.0).abs() < most, "{name}");
        let [a, b] = [given, &reference].map(|run| run.r_near_m2[2].unwrap());
        assert!((a / b - 1.0).abs() < most, "{name}: {a} {b}");
        assert!(given.r_cv_m2[0].is_none() && given.r_cv_withheld.is_some(), "{given:?}");
        assert_eq!((given.coverage, given.coverage_revisit), (None, None));
    }
}

#[test]
fn a_given_cloud_that_is_sparse_or_elsewhere_is_warned_of_with_its_cause() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let turned = UnitQuaternion::new(Vector3::z() * 0.7);
    let elsewhere: Vec<[f64; 3]> = points
        .iter()
        .map(|point| (turned * Vector3::from(*point) + Vector3::new(3.0, 5.0, 10.0)).into())
        .collect();
    let cloud = folder.path().join("cloud.ply");
    let doubt = |points: &[[f64; 3]], voxel_m: f64| -> Option<String> {
        write_cloud(&cloud, points);
        let config = Config { voxel_m: Some(voxel_m), ego: dmp::Ego::None, ..plain() };
        let report = score(&log, &with_map(&truth, cloud.clone()), &config);
        let mut warnings = report.runs[0].warnings.iter().map(ToString::to_string);
        warnings.find(|warning| warning.contains("are where its map has a surface"))
    };
    let sparse = "of 0.04 m; larger voxels may help";
    has(&doubt(&points, 0.04).unwrap(), &["span a surface in only ", sparse]);
    has(&doubt(&elsewhere, 0.3).unwrap(), &["check the map's frame and unit"]);
    assert_eq!(doubt(&points, 0.3), None);
    let built = ends(folder.path(), "map build cloud.ply --voxel 0.04 -o made.dmpmap", 0);
    has(&text(&built.stderr), &["warning: cloud.ply: its points span a surface in only ", sparse]);
}

#[test]
fn runs_with_given_maps_are_compared_on_r_near() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let bent: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1], p[2] + 0.3 * (p[0] * 0.05).sin()]).collect();
    let [good, bad] = ["good.ply", "bad.ply"].map(|name| folder.path().join(name));
    write_cloud(&good, &points);
    write_cloud(&bad, &bent);
    let runs = [("bad", bad), ("good", good)]
        .map(|(name, map)| Run { map: MapSource::Given(map), ..Run::new(name, truth.clone()) });
    let report = score(&log, &runs, &plain());
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
fn maps_of_different_voxels_are_not_compared() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, _) = town(folder.path());
    let save = |voxel_m: f64, name: &str| {
        let config = Config { voxel_m: Some(voxel_m), save_maps: Some(folder.path().into()), ..plain() };
        score(&log, &[Run::new(name, truth.clone())], &config);
        let map = MapSource::Given(folder.path().join(format!("{name}.dmpmap")));
        Run { map, ..Run::new(name, truth.clone()) }
    };
    let runs = [save(0.2, "fine"), save(0.5, "coarse")];
    let error = evaluate(open(&log).as_ref(), &runs, &plain(), ()).unwrap_err();
    assert!(matches!(error, EvaluateError::DifferentVoxels { .. }), "{error}");
}

/// What `row_*` compare: the score of a given cloud.
fn scored(folder: &Path, points: &[[f64; 3]], config: &Config) -> dmp::RunReport {
    let (log, truth, _) = town(folder);
    let map = folder.join("map.pcd");
    write_cloud(&map, points);
    score(&log, &with_map(&truth, map), config).runs.remove(0)
}

#[test]
fn row_08_points_of_a_map_that_are_not_finite_are_dropped_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let (_, _, points) = town(folder.path());
    let holes: Points =
        points.iter().flat_map(|&p| [p, [f64::NAN, p[1], p[2]], [p[0], p[1], f64::INFINITY]]).collect();
    let [whole, run] = [&points, &holes].map(|points| scored(folder.path(), points, &plain()));
    assert_eq!((run.dmp_sum_m2, run.map.surfels), (whole.dmp_sum_m2, whole.map.surfels));
    assert_eq!((whole.map.map_points_dropped, run.map.map_points_dropped), (0, 2 * points.len() as u64));
    let warnings = run.warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    has(&warnings, &["of the given map are not finite"]);
}

/// The voxels are a quarter of a metre, and the shift a whole number of them: nothing may change but by the
/// rounding of coordinates in the millions, which is below 1 nm.
#[test]
fn row_12_a_map_in_utm_coordinates_scores_as_at_the_origin() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let shift = [458_000.0, 5_421_000.0, 110.0];
    let far: Points = points.iter().map(|p| std::array::from_fn(|k| p[k] + shift[k])).collect();
    let far_truth =
        truth.moved(&Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::identity()));
    let config = Config { voxel_m: Some(0.25), ..plain() };
    let [near, far] =
        [("near.pcd", points, truth), ("far.pcd", far, far_truth)].map(|(name, points, truth)| {
            let map = folder.path().join(name);
            write_cloud(&map, &points);
            score(&log, &with_map(&truth, map), &config).runs.remove(0)
        });
    assert_eq!(near.map.surfels, far.map.surfels);
    assert_eq!((near.miss_rate, near.blocked_rate), (far.miss_rate, far.blocked_rate));
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-5;
    assert!(close(near.dmp_sum_m2, far.dmp_sum_m2), "{} {}", near.dmp_sum_m2, far.dmp_sum_m2);
    assert!(close(near.r_near_m2[2].unwrap(), far.r_near_m2[2].unwrap()));
}

#[test]
fn row_13_a_million_identical_points_make_no_surfel_and_no_trouble() {
    let folder = tempfile::tempdir().unwrap();
    let (_, _, mut points) = town(folder.path());
    let without = scored(folder.path(), &points, &plain());
    points.extend(vec![[3.0, 4.0, 500.0]; 1_000_000]);
    let with = scored(folder.path(), &points, &plain());
    assert_eq!((with.dmp_sum_m2, with.map.surfels), (without.dmp_sum_m2, without.map.surfels));
    assert_eq!(with.map.thin_voxels, without.map.thin_voxels.map(|thin| thin + 1));
}

#[test]
fn row_33_a_map_without_a_surfel_is_refused_and_a_fused_one_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (file, points, words, built) in [
        ("none.ply", vec![], "it has no points", 1),
        ("holes.ply", vec![[f64::NAN, 0.0, 0.0]; 7], "none of its 7 points is finite", 1),
        ("few.ply", vec![[0.1; 3], [9.0; 3], [90.0, 0.0, 0.0]], "3 voxels of 0.2 m", 0),
        ("one.ply", vec![[3.0, 4.0, 5.0]; 100_000], "1 voxel of 0.2 m", 0),
    ] {
        write_cloud(&path.join(file), &points);
        std::fs::write(path.join("made.dmpmap"), "made before").unwrap();
        let words = [&format!("{file}: the map is empty: "), words];
        refused(path, &format!("{SCORE} -t a=@/truth.tum --voxel 0.2 --map {file}"), 1, &words);
        has(&text(&ends(path, &format!("map build -o made.dmpmap {file}"), built).stderr), &words);
        let kept = std::fs::read(path.join("made.dmpmap")).unwrap() == b"made before";
        assert_eq!(kept, built == 1, "{file}");
    }
    // A saved map can be empty all the same, as one of a run whose voxels are too small.
    let built = ends(path, "map build @/town.mcap -t @/truth.tum --voxel 0.01 -o small.dmpmap", 0);
    has(&text(&built.stderr), &["warning: ", "small.dmpmap: the map is empty: it has no surfel"]);
    let score = &format!("{SCORE} -t @/truth.tum --map small.dmpmap");
    refused(path, score, 1, &["small.dmpmap: ", "it has no surfel"]);
}

#[test]
fn a_map_in_feet_is_converted_to_metres_and_the_report_notes_it() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let in_feet: Vec<[f64; 3]> = points.iter().map(|p| p.map(|c| c / 0.3048)).collect();
    let [metres, feet] = ["metres.laz", "feet.laz"].map(|name| folder.path().join(name));
    write_las(&metres, &points, None);
    write_las(&feet, &in_feet, Some(r#"PROJCS["p",GEOGCS["g"],UNIT["foot",0.3048]]"#));
    let config = Config { voxel_m: Some(0.3), ..plain() };
    let [of_metres, of_feet] = [metres, feet].map(|map| score(&log, &with_map(&truth, map), &config));
    let near = |report: &dmp::Report| report.runs[0].r_near_m2[2].unwrap();
    assert!(
        (near(&of_feet) / near(&of_metres) - 1.0).abs() < 1e-2,
        "{} {}",
        near(&of_feet),
        near(&of_metres)
    );
    assert_eq!(of_metres.inputs.runs[0].map_notes, [NO_CHECKSUMS]);
    has(&of_feet.inputs.runs[0].map_notes[0], &["in feet", "well-known text"]);

    // Degrees are no lengths.
    let floor: Points =
        (0..40_000).map(|k| [f64::from(k % 200) * 0.05, f64::from(k / 200) * 0.05, 0.0]).collect();
    let degrees = Some(r#"GEOGCS["WGS 84",UNIT["degree",0.0174532925199433]]"#);
    write_las(&folder.path().join("map.las"), &floor, degrees);
    let score = &format!("{SCORE} -t a=@/truth.tum --map map.las");
    refused(folder.path(), score, 1, &["map.las: ", "longitude and latitude"]);
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
fn a_bad_map_is_an_error_before_the_log_is_read_for_the_maps_of_other_runs() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth, points) = town(folder.path());
    let path = folder.path().join("map.ply");
    write_cloud(&path, &points);
    let runs = || vec![Run::new("fused", truth.clone()), with_map(&truth, path.clone()).remove(0)];
    let begun = |runs: &[Run]| {
        let watch = Begun::default();
        let result = evaluate(open(&log).as_ref(), runs, &plain(), &watch);
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
    let (log, truth, points) = town(folder.path());
    write_chunks(&log, &small_town(40, 180).0, SMALL_CHUNK);
    let path = folder.path().join("map.ply");
    write_cloud(&path, &points);
    let runs = [Run::new("fused", truth.clone()), with_map(&truth, path).remove(0)];
    let whole = score(&log, &runs, &plain());
    let pieces = Config {
        work_folder: folder.path().to_path_buf(),
        checkpoint_every: Some(Duration::ZERO),
        resume: true,
        ..plain()
    };
    // The cloud is read first each time, then scans are fused from where that ended.
    let (report, stops) = in_pieces(&log, &runs, &pieces, 40_000);
    assert!(stops > 4, "{stops} stops");
    assert_eq!(comparable(&report), comparable(&whole));
    assert_eq!(folder.path().read_dir().unwrap().count(), 2, "nothing is left behind");
}
