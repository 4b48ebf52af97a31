use super::formats::{Failure, Format, Reader, a_scan};
use crate::common::write_with;
use crate::parts::bits;
use dmp_log::{
    KeyframeTimes, LogError, LogOptions, MadeWith, PointTime, PoseGraphFile, PoseTopic, RawTrajectory,
    ScanLog, open_log, outline_log, parse_loop_candidates, parse_pose_graph, read_calib, read_keyframe_times,
    read_loop_labels, read_mesh, read_pose_graph, read_raw_trajectory, read_topic_trajectory,
    read_trajectory, survey_log, write_pose_graph,
};
use dmp_sensor::{Isometry3, PoseGraph, Scan, Trajectory};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::thread;
use std::time::Duration;

/// What became of a file.
#[derive(Debug, Default)]
pub(super) struct Answer {
    /// Why it is not read, or what of it is not.
    pub(super) refused: Option<String>,
    pub(super) scans: Vec<Scan>,
}

impl Answer {
    fn of<T>(read: Result<T, LogError>) -> Self {
        Self { refused: read.err().map(|error| one_line(&error.to_string())), scans: Vec::new() }
    }
}

/// Messages go into logs and terminals.
fn one_line(text: &str) -> String {
    assert!(!text.contains('\n') && text.len() < 10_000, "{text}");
    text.to_owned()
}

/// Reads a file of a format that lies in a prepared folder.
pub(super) fn read(format: &Format, folder: &Path, bytes: &[u8], run: u64) -> Answer {
    let write = |name: &str| {
        let path = folder.join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    match format.reader {
        Reader::Log(name) => log(&write(name), run),
        Reader::Message(channel) => {
            let path = folder.join("log.mcap");
            let options = mcap::WriteOptions::new().compression(None).use_chunks(false);
            let good = format.seeds[0].clone();
            write_with(&path, options, &[channel], &[(0, good), (0, bytes.to_vec())]);
            if channel.1.contains("Point") || channel.1.contains("Custom") {
                return log(&path, run);
            }
            poses(&path, channel.0)
        }
        Reader::Metadata => {
            write("metadata.yaml");
            log(folder, run)
        }
        Reader::SecondScan { extension, is_packed } => {
            write(&format!("1.{extension}"));
            second_scan(folder, is_packed, run)
        }
        Reader::BesideScans(name) | Reader::BesideImages(name) => {
            write(name);
            log(folder, run)
        }
        Reader::World(name) => world(&write(name)),
        Reader::Cloud(name) => Answer::of(crate::cloud::read(&write(name))),
        Reader::Mesh(name) => Answer::of(read_mesh(&write(name), |batch| {
            assert!(!batch.is_empty());
            Ok::<(), LogError>(())
        })),
        Reader::Trajectory(name) => trajectory(&write(name)),
        Reader::Graph => graph(&write("graph.g2o")),
        Reader::LoopLabels => Answer::of(loop_labels(&write("labels.csv"))),
        Reader::KeyframeTimes => Answer::of(keyframe_times(&write("keyframes.txt"))),
        Reader::Times => {
            write("times.txt");
            trajectory(&folder.join("run.txt"))
        }
        Reader::Calib => Answer::of(read_calib(&write("calib.txt"))),
        Reader::Failing(failure) => failing(failure, run),
    }
}

/// Reads every scan. What was found whole on opening is whole, but for the frame `may_fail`.
fn scans(log: &dyn ScanLog, may_fail: impl Fn(usize) -> bool) -> Answer {
    let first = log.summary().damage.first();
    let refused = first.map(|damage| one_line(&format!("{}: {}", damage.place, damage.what)));
    let mut answer = Answer { refused, scans: Vec::new() };
    let mut reader = log.reader().unwrap();
    for (frame, info) in log.frames().iter().enumerate() {
        let mut scan = Scan::default();
        match reader.read(frame, &mut scan) {
            Ok(()) => {
                assert_eq!((scan.len() as u64, scan.stamp_ns), (info.returns, info.stamp_ns));
                answer.scans.push(scan);
            }
            Err(error) => {
                assert!(may_fail(frame), "{error}");
                answer.refused = Some(one_line(&error.to_string()));
            }
        }
    }
    answer
}

/// A log, and one run in eight what else it holds.
fn log(path: &Path, run: u64) -> Answer {
    if run % 8 == 1 {
        if let Ok(survey) = survey_log(path, &LogOptions::default()) {
            survey.damage.iter().for_each(|damage| drop(one_line(&damage.what)));
        }
        drop(poses(path, "/odom"));
    }
    // Opening goes from row to row, reading looks for the row by its number.
    let is_db3 = path.extension().is_some_and(|extension| extension == "db3");
    match open_log(path, &with_times(run)) {
        Ok(log) => {
            let answer = scans(&*log, |_| is_db3);
            if run % 4 == 3 {
                parts(path, &with_times(run), &answer, is_db3);
            }
            answer
        }
        Err(error) => Answer::of::<()>(Err(error)),
    }
}

/// What is opened by its index is what the whole log has, or damage is named.
fn parts(path: &Path, options: &LogOptions, whole: &Answer, is_db3: bool) {
    let Ok(outline) = outline_log(path, options) else { return };
    let all: Vec<usize> = (0..outline.scans().len()).collect();
    let third: Vec<usize> = all.iter().copied().filter(|number| number % 3 == 1).collect();
    for wanted in [all, third].into_iter().filter(|wanted| !wanted.is_empty()) {
        let Ok(part) = outline.open(&wanted) else { continue };
        let read = scans(&*part, |_| is_db3);
        let known = whole.scans.iter().map(bits).collect::<Vec<_>>();
        assert!(is_db3 || read.scans.iter().all(|scan| known.contains(&bits(scan))), "no scan of the log");
        assert!(is_db3 || read.refused.is_some() || read.scans.len() == wanted.len(), "lost in silence");
        for frame in 0..part.frames().len() {
            assert!(wanted.contains(&part.number_in_log(frame)));
        }
    }
}

/// Damaged times may leave open what they mean: every second time they are not used.
fn with_times(run: u64) -> LogOptions {
    let point_time = if run.is_multiple_of(2) { PointTime::Auto } else { PointTime::Ignore };
    LogOptions { point_time, ..LogOptions::default() }
}

fn poses(path: &Path, topic: &str) -> Answer {
    let body = (topic == "/tf").then(|| "lidar".to_owned());
    let wanted = PoseTopic { topic: Some(topic.into()), body, ..PoseTopic::default() };
    let read = read_topic_trajectory(path, &wanted, Some("base_link"));
    if let Ok(run) = &read {
        check(&run.trajectory);
    }
    Answer::of(read)
}

/// The second of two scans is damaged; the first is read whatever becomes of it.
fn second_scan(folder: &Path, is_packed: bool, run: u64) -> Answer {
    let options = with_times(run);
    match open_log(folder, &options) {
        Ok(log) => scans(&*log, |frame| is_packed && frame == 1),
        Err(error) => {
            assert!(options.point_time == PointTime::Auto, "the file beside it was to be read: {error}");
            Answer::of::<()>(Err(error))
        }
    }
}

fn world(path: &Path) -> Answer {
    let pose = |s: i64| (s * 1_000_000_000, Isometry3::translation(s as f64, 0.0, 0.0));
    let run = Trajectory::stamped((0..=20).map(pose).collect()).unwrap().trajectory;
    let options = LogOptions { made_with: Some(MadeWith::new(run)), ..LogOptions::default() };
    // Opening goes through the chunks one after the other, reading by the table of chunks.
    let is_packed = path.extension().is_some_and(|extension| extension == "laz");
    match open_log(path, &options) {
        Ok(log) => scans(&*log, |_| is_packed),
        Err(error) => Answer::of::<()>(Err(error)),
    }
}

fn trajectory(path: &Path) -> Answer {
    if let Ok(RawTrajectory { positions_m, rotations, stamps_s, .. }) = read_raw_trajectory(path, None) {
        assert_eq!(positions_m.len(), rotations.len());
        assert!(stamps_s.is_none_or(|stamps| stamps.len() == positions_m.len()));
    }
    let read = read_trajectory(path);
    if let Ok(run) = &read {
        check(&run.trajectory);
    }
    Answer::of(read)
}

/// A graph is what it promises to be and is written to the same bits; candidates are what the graph takes.
fn graph(path: &Path) -> Answer {
    let bytes = fs::read(path).unwrap();
    let read = read_pose_graph(path);
    if let Ok(file) = &read {
        let graph = &file.graph;
        assert!(graph.edges().iter().all(|edge| graph.check_edge(edge).is_ok()));
        assert_eq!(graph.components(&[]).iter().map(|part| part.vertices).sum::<usize>(), graph.ids().len());
        let mut again = Vec::new();
        write_pose_graph(&mut again, graph).unwrap();
        assert_eq!(&parse_pose_graph(&again).unwrap().graph, graph);
    }
    // Every edge of the file as a candidate of a graph that has none.
    let pose = |id| (id, Isometry3::translation(id as f64, 0.0, 0.0));
    let bare = PoseGraph::new((-1..20).map(pose).collect(), vec![], BTreeSet::new()).unwrap();
    let bare = PoseGraphFile {
        graph: bare,
        has_information: false,
        repeated_vertices: 0,
        other_records: BTreeMap::new(),
    };
    if let Ok(found) = parse_loop_candidates(&bytes, &bare) {
        assert!(found.candidates.iter().all(|candidate| bare.graph.check_edge(&candidate.edge).is_ok()));
        found.skipped.iter().for_each(|skipped| drop(one_line(&skipped.fault.to_string())));
    }
    Answer::of(read)
}

/// Every loop is known by both of its directions.
fn loop_labels(path: &Path) -> Result<(), LogError> {
    let found = read_loop_labels(path)?;
    assert!(found.labels.iter().all(|(&(a, b), &label)| a < b && found.of(b, a) == Some(label)));
    Ok(())
}

/// Times increase with the vertices.
fn keyframe_times(path: &Path) -> Result<(), LogError> {
    let KeyframeTimes { ids, stamps_ns, .. } = read_keyframe_times(path)?;
    assert!(!stamps_ns.is_empty() && stamps_ns.is_sorted_by(|a, b| a < b));
    assert!(ids.is_none_or(|ids| ids.len() == stamps_ns.len() && ids.is_sorted_by(|a, b| a < b)));
    Ok(())
}

/// Poses are poses, and in order of time.
fn check(run: &Trajectory) {
    for pose in run.poses() {
        assert!(pose.translation.vector.amax() <= 1e9, "{pose}");
        assert!((pose.rotation.coords.norm() - 1.0).abs() < 1e-9, "{pose}");
    }
    let stamps_ns = run.stamps_ns().unwrap_or_default();
    assert!(stamps_ns.is_sorted_by(|a, b| a < b));
}

fn failing(failure: Failure, run: u64) -> Answer {
    let mut answer = Answer { refused: None, scans: vec![a_scan()] };
    if run == 7 {
        match failure {
            Failure::Panics => panic!("a reader panicked on purpose"),
            Failure::Allocates => assert!(std::hint::black_box(vec![1_u8; 2 << 30]).len() > 1),
            Failure::Hangs => loop {
                thread::sleep(Duration::from_secs(1));
            },
            Failure::IsWrong => answer.scans[0].points_in_sensor_m[0][0] += 1.0,
        }
    }
    answer
}
