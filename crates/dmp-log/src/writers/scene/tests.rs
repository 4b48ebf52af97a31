use super::{SceneHead, ScenePlace, ScenePoint, SceneRun, SceneWriter};
use crate::{LogOptions, PoseTopic, open_log, read_topic_trajectory};
use dmp_sensor::{Isometry3, Scan, Translation3, UnitQuaternion};

const START_NS: i64 = 1_700_000_000_123_456_789;

fn pose(k: i64) -> (i64, Isometry3<f64>) {
    let turn = UnitQuaternion::from_euler_angles(0.1, -0.2, k as f64);
    (START_NS + k * 100_000_000, Isometry3::from_parts(Translation3::new(k as f64, 2.5, -1.0), turn))
}

/// What is written is what the readers of this crate find.
#[test]
fn a_scene_is_read_as_a_log_and_as_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.mcap");
    let runs = [SceneRun { name: "a b", with_clouds: true }, SceneRun { name: "one/c", with_clouds: false }];
    let mut writer = SceneWriter::create(&path, &SceneHead { start_ns: START_NS, runs: &runs }).unwrap();
    let point = |k: u8| ScenePoint {
        place_m: [f32::from(k), 0.5, -2.0],
        colour: [k, 20, 30],
        residual_m: Some(0.25),
    };
    let mut map = writer.start_map(2).unwrap();
    map.push_surfel(&point(1), [0.0, 0.0, 1.0]);
    map.push_surfel(&ScenePoint { residual_m: None, ..point(2) }, [1.0, 0.0, 0.0]);
    assert_eq!(writer.map(0, map).unwrap(), 2);
    for run in 0..2 {
        let mut way = writer.start_marks(9).unwrap();
        way.push(&point(7));
        writer.way(run, way, &[pose(0), pose(1)]).unwrap();
        let places = writer.start_marks(0).unwrap();
        let place = ScenePlace { place_in_map_m: [1.0, 2.0, 3.0], text: "ü".into() };
        writer.places(run, places, (&[place], [255, 0, 0])).unwrap();
    }
    for k in 0..3 {
        let (stamp_ns, at) = pose(k);
        writer.pose(0, (stamp_ns, &at), [0.5, 2.0]).unwrap();
        let mut returns = writer.start_returns(0, stamp_ns, 1).unwrap();
        returns.push(&point(k as u8));
        assert_eq!(writer.returns(0, stamp_ns, returns).unwrap(), 1);
    }
    writer.tell(1, START_NS, "place 1").unwrap();
    writer.finish([("map".to_owned(), "a b".to_owned())].into()).unwrap();

    let topic = |topic: &str| PoseTopic { topic: Some(topic.into()), ..PoseTopic::default() };
    for (name, poses) in [("/a b/pose", 3), ("/a b/path", 2), ("/one/c/path", 2)] {
        let run = read_topic_trajectory(&path, &topic(name), None).unwrap();
        assert_eq!(run.trajectory.len(), poses, "{name}");
        let (stamp_ns, expected) = pose(1);
        let found = run.trajectory.world_from_body_at(stamp_ns, 1).unwrap();
        assert!((found.translation.vector - expected.translation.vector).norm() < 1e-12, "{name}");
        assert!(found.rotation.angle_to(&expected.rotation) < 1e-9, "{name}");
    }
    for (name, places) in
        [("/a b/map", [[1.0, 0.5, -2.0], [2.0, 0.5, -2.0]].as_slice()), ("/a b/returns", &[[0.0, 0.5, -2.0]])]
    {
        let options = LogOptions { topic: Some(name.into()), ..LogOptions::default() };
        let log = open_log(&path, &options).unwrap();
        let mut scan = Scan::default();
        log.reader().unwrap().read(0, &mut scan).unwrap();
        assert_eq!(scan.points_in_sensor_m, places, "{name}");
        assert_eq!(scan.stamp_ns, Some(START_NS));
    }
}

#[test]
fn without_its_end_there_is_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.mcap");
    let head = SceneHead { start_ns: i64::MAX, runs: &[] };
    assert!(SceneWriter::create(&path, &head).unwrap_err().to_string().contains("32 bits of seconds"));
    drop(SceneWriter::create(&path, &SceneHead { start_ns: 0, runs: &[] }).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
