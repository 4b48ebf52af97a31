//! Readers of a file in a prepared folder, and what each promises.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use dmp_log::{
    KeyframeTimes, LogError, LogOptions, MadeWith, PointTime, PoseGraphFile, PoseTopic, RawTrajectory,
    ScanLog, open_log, outline_log, parse_loop_candidates, parse_pose_graph, read_calib, read_keyframe_times,
    read_loop_labels, read_pose_graph, read_raw_trajectory, read_topic_trajectory, read_trajectory,
    survey_log, write_pose_graph,
};
use dmp_sensor::{Isometry3, PoseGraph, Scan, Trajectory};

pub(super) use crate::parts::bits;

/// What became of a file.
#[derive(Debug, Default)]
pub(crate) struct Answer {
    /// Why it is not read, or what of it is not.
    pub(crate) refused: Option<String>,
    pub(crate) scans: Vec<Scan>,
}

impl From<Result<(), String>> for Answer {
    fn from(read: Result<(), String>) -> Self {
        Self { refused: read.err().map(|error| one_line(&error)), scans: Vec::new() }
    }
}

fn answer<T>(read: Result<T, LogError>) -> Answer {
    Answer::from(read.map(drop).map_err(|error| error.to_string()))
}

/// Messages go into logs and terminals.
fn one_line(text: &str) -> String {
    assert!(!text.contains('\n') && text.len() < 10_000, "{text}");
    text.to_owned()
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

/// A log: its scans, and in some runs what else it holds, its parts, and the same in several threads.
pub(super) fn log(_: &Path, path: &Path, run: u64) -> Answer {
    let options = with_times(run);
    if run % 8 == 1 {
        if let Ok(survey) = survey_log(path, &LogOptions::default()) {
            survey.damage.iter().for_each(|damage| drop(one_line(&damage.what)));
        }
        for topic in [None, Some("/odom"), Some("/pose"), Some("/path"), Some("/tf")] {
            let body = (topic == Some("/tf")).then(|| "lidar".to_owned());
            let wanted = PoseTopic { topic: topic.map(str::to_owned), body, ..PoseTopic::default() };
            let read = read_topic_trajectory(path, &wanted, Some("base_link"));
            read.iter().for_each(|run| check(&run.trajectory));
            answer(read);
        }
    }
    // Opening goes from row to row, reading looks for the row by its number.
    let is_db3 = path.extension().is_some_and(|extension| extension == "db3");
    let found = match open_log(path, &options) {
        Ok(log) => scans(&*log, |_| is_db3),
        Err(error) => return answer::<()>(Err(error)),
    };
    if run % 4 == 3 && path.is_file() {
        parts(path, &options, &found, is_db3);
    }
    if run % 16 == 2 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let again = pool.install(|| open_log(path, &options).map(|log| scans(&*log, |_| is_db3))).unwrap();
        assert!(again.scans.iter().map(bits).eq(found.scans.iter().map(bits)), "other scans in threads");
        assert_eq!(again.refused, found.refused);
    }
    found
}

pub(super) fn log_of_folder(folder: &Path, _: &Path, run: u64) -> Answer {
    log(folder, folder, run)
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

/// Damaged times may leave their meaning open: every second time they are not used.
fn with_times(run: u64) -> LogOptions {
    let point_time = if run.is_multiple_of(2) { PointTime::Auto } else { PointTime::Ignore };
    LogOptions { point_time, ..LogOptions::default() }
}

/// The second of two scans is damaged; the first is read whatever becomes of it. `is_packed`: damage may show only when a scan
/// is read.
fn second(folder: &Path, run: u64, is_packed: bool) -> Answer {
    let options = with_times(run);
    match open_log(folder, &options) {
        Ok(log) => scans(&*log, |frame| is_packed && frame == 1),
        Err(error) => {
            assert!(options.point_time == PointTime::Auto, "the file beside it was to be read: {error}");
            answer::<()>(Err(error))
        }
    }
}

pub(super) fn second_scan(folder: &Path, _: &Path, run: u64) -> Answer {
    second(folder, run, false)
}

pub(super) fn second_packed_scan(folder: &Path, _: &Path, run: u64) -> Answer {
    second(folder, run, true)
}

pub(super) fn world(_: &Path, path: &Path, _: u64) -> Answer {
    let pose = |s: i64| (s * 1_000_000_000, Isometry3::translation(s as f64, 0.0, 0.0));
    let run = Trajectory::stamped((0..=20).map(pose).collect()).unwrap().trajectory;
    let options = LogOptions { made_with: Some(MadeWith::new(run)), ..LogOptions::default() };
    // Opening goes through the chunks one after the other, reading by the table of chunks.
    let is_packed = path.extension().is_some_and(|extension| extension == "laz");
    match open_log(path, &options) {
        Ok(log) => scans(&*log, |_| is_packed),
        Err(error) => answer::<()>(Err(error)),
    }
}

pub(super) fn cloud(_: &Path, path: &Path, _: u64) -> Answer {
    answer(crate::cloud::read(path))
}

pub(super) fn mesh(_: &Path, path: &Path, _: u64) -> Answer {
    answer(crate::mesh::read(path))
}

pub(super) fn trajectory(_: &Path, path: &Path, _: u64) -> Answer {
    if let Ok(RawTrajectory { positions_m, rotations, stamps_s, .. }) = read_raw_trajectory(path, None) {
        assert_eq!(positions_m.len(), rotations.len());
        assert!(stamps_s.is_none_or(|stamps| stamps.len() == positions_m.len()));
    }
    let read = read_trajectory(path);
    read.iter().for_each(|run| check(&run.trajectory));
    answer(read)
}

/// The stamps beside a trajectory.
pub(super) fn times(folder: &Path, _: &Path, run: u64) -> Answer {
    trajectory(folder, &folder.join("run.txt"), run)
}

pub(super) fn calib(_: &Path, path: &Path, _: u64) -> Answer {
    answer(read_calib(path))
}

/// A graph is what it promises to be and is written to the same bits; candidates are what the graph takes.
pub(super) fn graph(_: &Path, path: &Path, _: u64) -> Answer {
    let bytes = fs::read(path).unwrap();
    let read = read_pose_graph(path);
    if let Ok(PoseGraphFile { graph, .. }) = &read {
        assert!(graph.edges().iter().all(|edge| graph.check_edge(edge).is_ok()));
        assert_eq!(graph.components(&[]).iter().map(|part| part.vertices).sum::<usize>(), graph.ids().len());
        let mut again = Vec::new();
        write_pose_graph(&mut again, graph).unwrap();
        assert_eq!(&parse_pose_graph(&again).unwrap().graph, graph);
    }
    // Every edge of the file as a candidate of a graph that has none.
    let pose = |id| (id, Isometry3::translation(id as f64, 0.0, 0.0));
    let graph = PoseGraph::new((-1..20).map(pose).collect(), vec![], BTreeSet::new()).unwrap();
    let other_records = BTreeMap::new();
    let bare = PoseGraphFile { graph, has_information: false, repeated_vertices: 0, other_records };
    if let Ok(found) = parse_loop_candidates(&bytes, &bare) {
        assert!(found.candidates.iter().all(|candidate| bare.graph.check_edge(&candidate.edge).is_ok()));
        found.skipped.iter().for_each(|skipped| drop(one_line(&skipped.fault.to_string())));
    }
    answer(read)
}

/// Every loop is known by both of its directions.
pub(super) fn loop_labels(_: &Path, path: &Path, _: u64) -> Answer {
    let read = read_loop_labels(path);
    if let Ok(found) = &read {
        assert!(found.labels.iter().all(|(&(a, b), &label)| a < b && found.of(b, a) == Some(label)));
    }
    answer(read)
}

/// Times increase with the vertices.
pub(super) fn keyframe_times(_: &Path, path: &Path, _: u64) -> Answer {
    let read = read_keyframe_times(path);
    if let Ok(KeyframeTimes { ids, stamps_ns, .. }) = &read {
        assert!(!stamps_ns.is_empty() && stamps_ns.is_sorted_by(|a, b| a < b));
        let are_ids = |ids: &Vec<i64>| ids.len() == stamps_ns.len() && ids.is_sorted_by(|a, b| a < b);
        assert!(ids.as_ref().is_none_or(are_ids));
    }
    answer(read)
}

/// Poses are poses, and in order of time.
fn check(run: &Trajectory) {
    for pose in run.poses() {
        assert!(pose.translation.vector.amax() <= 1e9, "{pose}");
        assert!((pose.rotation.coords.norm() - 1.0).abs() < 1e-9, "{pose}");
    }
    assert!(run.stamps_ns().unwrap_or_default().is_sorted_by(|a, b| a < b));
}
