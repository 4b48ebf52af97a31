//! Trajectories in messages: what bad ones get, and what the frames say.

use crate::common::{assert_says, write_messages};
use dmp_log::{LogOptions, PoseTopic, TopicTrajectory, open_log, read_topic_trajectory};
use dmp_sensor::{Isometry3, Vector3};
use std::path::PathBuf;

pub(crate) const ODOMETRY: (&str, &str, &str) = ("/odom", "nav_msgs/msg/Odometry", "cdr");
pub(crate) const POSES: (&str, &str, &str) = ("/pose", "geometry_msgs/msg/PoseStamped", "cdr");
pub(crate) const PATH: (&str, &str, &str) = ("/path", "nav_msgs/msg/Path", "cdr");
pub(crate) const TF: (&str, &str, &str) = ("/tf", "tf2_msgs/msg/TFMessage", "cdr");
pub(crate) const TF_STATIC: (&str, &str, &str) = ("/tf_static", "tf2_msgs/msg/TFMessage", "cdr");
const TEXT: (&str, &str, &str) = ("/chatter", "std_msgs/msg/String", "cdr");

/// Little-endian CDR.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    fn align(&mut self, bytes: usize) {
        while !(self.0.len() - 4).is_multiple_of(bytes) {
            self.0.push(0);
        }
    }

    fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    /// Header, perhaps a child, seven numbers.
    fn pose(&mut self, stamp_ms: i64, frame: &str, child: Option<&str>, numbers: [f64; 7]) {
        self.u32((stamp_ms / 1000) as u32);
        self.u32((stamp_ms % 1000) as u32 * 1_000_000);
        self.text(frame);
        if let Some(child) = child {
            self.text(child);
        }
        for number in numbers {
            self.align(8);
            self.0.extend(number.to_le_bytes());
        }
    }
}

fn seven(pose: &Isometry3<f64>) -> [f64; 7] {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
}

fn at_x(x: f64) -> [f64; 7] {
    [x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
}

pub(crate) fn odometry(stamp_ms: i64, numbers: [f64; 7]) -> Vec<u8> {
    let mut message = Cdr::new();
    message.pose(stamp_ms, "odom", Some("base_link"), numbers);
    message.0
}

fn pose(stamp_ms: i64, numbers: [f64; 7]) -> Vec<u8> {
    let mut message = Cdr::new();
    message.pose(stamp_ms, "map", None, numbers);
    message.0
}

pub(crate) fn path(poses: &[(i64, f64)]) -> Vec<u8> {
    let mut message = Cdr::new();
    message.u32(9);
    message.u32(0);
    message.text("map");
    message.u32(poses.len() as u32);
    for (stamp_ms, x) in poses {
        message.pose(*stamp_ms, "map", None, at_x(*x));
    }
    message.0
}

pub(crate) fn transforms(transforms: &[(i64, &str, &str, Isometry3<f64>)]) -> Vec<u8> {
    let mut message = Cdr::new();
    message.u32(transforms.len() as u32);
    for (stamp_ms, parent, child, pose) in transforms {
        message.pose(*stamp_ms, parent, Some(child), seven(pose));
    }
    message.0
}

struct Bag {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn bag(channels: &[(&str, &str, &str)], messages: &[(usize, Vec<u8>)]) -> Bag {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    write_messages(&path, channels, messages);
    Bag { _folder: folder, path }
}

impl Bag {
    fn read(&self, topic: &str) -> Result<TopicTrajectory, String> {
        let mut parts = topic.split(':').map(str::to_owned);
        let wanted = PoseTopic {
            topic: parts.next().filter(|t| !t.is_empty()),
            world: parts.next(),
            body: parts.next(),
        };
        read_topic_trajectory(&self.path, &wanted, Some("lidar")).map_err(|error| error.to_string())
    }

    fn refused(&self, topic: &str, parts: &[&str]) {
        let error = self.read(topic).unwrap_err();
        assert_says(&error, &["run.mcap: "]);
        assert_says(&error, parts);
    }
}

#[test]
fn row_18_bad_poses_of_messages_are_named() {
    let cases = [
        ([0.0; 7], "is zero"),
        ([f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], "not finite"),
        ([0.0, 0.0, 0.0, 0.0, f64::INFINITY, 0.0, 1.0], "not finite"),
        ([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.3], "norm 1.3"),
        ([2e8, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], "2e8 m"),
    ];
    for (numbers, problem) in cases {
        let messages = [(0, odometry(1000, at_x(0.0))), (1, vec![]), (0, odometry(1100, numbers))];
        bag(&[ODOMETRY, TEXT], &messages).refused("/odom", &["message 1: topic /odom (byte ", problem]);
    }
    let mut cut = odometry(1100, at_x(1.0));
    cut.truncate(cut.len() - 3);
    bag(&[ODOMETRY], &[(0, cut)]).refused("/odom", &["message 0: ", "qw takes 8 bytes", "5 left"]);
    // A length that lies.
    let mut forged = path(&[(1000, 0.0)]);
    forged[20..24].copy_from_slice(&u32::MAX.to_le_bytes());
    bag(&[PATH], &[(0, forged)]).refused("/path", &["message 0: "]);
    let two_runs = [(0, pose(1000, at_x(0.0))), (0, pose(1000, at_x(5.0)))];
    bag(&[POSES], &two_runs).refused("/pose", &["two runs", "5.000 m"]);
    bag(&[POSES], &[]).refused("/pose", &["no poses"]);
}

#[test]
fn row_18_messages_out_of_order_and_again_are_counted() {
    let messages = [1200, 1000, 1100, 1100].map(|ms| (0, pose(ms, at_x(ms as f64))));
    let run = bag(&[POSES], &messages).read("/pose").unwrap();
    assert_eq!((run.out_of_order, run.repeated, run.trajectory.len()), (1, 1, 3));
    assert_eq!((run.message_type, run.body_frame), ("PoseStamped", None));
}

#[test]
fn the_path_with_most_poses_is_taken_and_the_last_of_these() {
    let messages = [
        (0, path(&[(1000, 0.0)])),
        (0, path(&[(1000, 0.1), (1100, 1.0), (1200, 2.0)])),
        (0, path(&[(1000, 0.2), (1100, 1.2), (1200, 2.2)])),
        (0, path(&[(1300, 9.0)])),
    ];
    let run = bag(&[PATH], &messages).read("/path").unwrap();
    let x: Vec<f64> = run.trajectory.poses().iter().map(|pose| pose.translation.x).collect();
    assert_eq!(x, [0.2, 1.2, 2.2]);
}

#[test]
fn a_topic_that_is_not_named_must_be_the_only_one() {
    let messages = [(0, odometry(1000, at_x(0.0))), (1, pose(1000, at_x(0.0))), (2, vec![])];
    bag(&[ODOMETRY, POSES, TEXT], &messages).refused("", &["several topics hold poses", "/odom, /pose"]);
    bag(&[ODOMETRY, POSES, TEXT], &messages)
        .refused("/chatter", &["no topic `/chatter` with poses", "/pose ["]);
    bag(&[TEXT], &[(0, vec![])]).refused("", &["no topic with poses", "/chatter ["]);
    bag(&[], &[]).refused("", &["it has no topics"]);
    let moved = ("/vicon", "geometry_msgs/msg/TransformStamped", "cdr");
    let messages = [1000, 1100].map(|ms| (0, odometry(ms, at_x(ms as f64))));
    let transform = bag(&[moved], &messages).read("/vicon").unwrap();
    let odometry_of = bag(&[ODOMETRY], &messages).read("/odom").unwrap();
    assert_eq!(
        (transform.trajectory, transform.body_frame),
        (odometry_of.trajectory, odometry_of.body_frame)
    );
    assert_eq!(transform.message_type, "TransformStamped");
    let only = bag(&[TEXT, ODOMETRY], &[(1, odometry(1000, at_x(0.0)))]).read("").unwrap();
    assert_eq!((only.topic.as_str(), only.body_frame.as_deref()), ("/odom", Some("base_link")));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.tum");
    std::fs::write(&path, "1 0 0 0 0 0 0 1\n").unwrap();
    let error = read_topic_trajectory(&path, &PoseTopic::default(), None).unwrap_err();
    assert!(error.is_usage());
    assert_says(&error.to_string(), &["run.tum", "no bag"]);
}

fn isometry(x: f64, yaw: f64) -> Isometry3<f64> {
    Isometry3::new(Vector3::new(x, 0.2 * x, 0.0), Vector3::new(0.0, 0.1 * yaw, yaw))
}

/// A correction of the map once a second, odometry at 20 Hz, a joint sent again and again that stands, and
/// a fixed sensor.
fn robot() -> Bag {
    let mut messages = vec![(1, transforms(&[(0, "mast", "lidar", isometry(0.3, 1.0))]))];
    for ms in (0..=3000).step_by(50) {
        let s = ms as f64 / 1000.0;
        let mut now = vec![(ms, "odom", "base_link", isometry(5.0 * s, 0.3 * s))];
        if ms % 1000 == 0 {
            now.push((ms, "map", "odom", isometry(0.1 * s, 0.01 * s)));
        }
        if ms % 100 == 0 {
            now.push((ms, "base_link", "mast", isometry(-0.4, 0.5)));
        }
        messages.push((0, transforms(&now)));
    }
    bag(&[TF, TF_STATIC], &messages)
}

#[test]
fn a_chain_of_frames_is_walked_at_the_stamps_of_its_fastest_link() {
    let robot = robot();
    for topic in ["/tf", "/tf:map", "/tf:map:lidar", "/tf:/map:/lidar"] {
        let run = robot.read(topic).unwrap();
        assert_eq!((run.trajectory.len(), run.body_frame.as_deref()), (61, Some("lidar")), "{topic}");
        for ms in (0..=3000_i64).step_by(50) {
            let s = ms as f64 / 1000.0;
            // The correction between its neighbours: place and rotation evenly.
            let second = (s.floor()).min(2.0);
            let [before, after] = [second, second + 1.0].map(|s| isometry(0.1 * s, 0.01 * s));
            let place = before.translation.vector.lerp(&after.translation.vector, s - second);
            let correction =
                Isometry3::from_parts(place.into(), before.rotation.slerp(&after.rotation, s - second));
            let expected = correction * isometry(5.0 * s, 0.3 * s) * isometry(-0.4, 0.5) * isometry(0.3, 1.0);
            let found = run.trajectory.world_from_body_at(1_000_000 * ms, 0).unwrap();
            assert!((found.to_homogeneous() - expected.to_homogeneous()).amax() < 1e-12, "{topic} at {s} s");
        }
    }
    let run = robot.read("/tf:odom:base_link").unwrap();
    let expected = isometry(5.0 * 0.65, 0.3 * 0.65).to_homogeneous();
    let found = run.trajectory.world_from_body_at(650_000_000, 0).unwrap().to_homogeneous();
    assert!((found - expected).amax() < 1e-12);
    // The correction alone comes once a second.
    assert_eq!(robot.read("/tf:map:odom").unwrap().trajectory.len(), 4);
    assert_eq!(run.static_frames.beside("lidar"), ["mast"]);
}

#[test]
fn frames_that_do_not_hang_together_are_named() {
    let robot = robot();
    robot.refused(
        "/tf:base_link:odom",
        &["`base_link` is not above `odom`", "odom to base_link", "/tf:WORLD:BODY"],
    );
    robot.refused("/tf:map:camera", &["`map` is not above `camera`"]);
    robot.refused("/tf:lidar:lidar", &["is not above `lidar`"]);
    robot.refused("/tf:mast:lidar", &["nothing moves between `mast` and `lidar`"]);
    let two =
        [(0, transforms(&[(0, "a", "lidar", isometry(0.0, 0.0)), (0, "b", "lidar", isometry(0.0, 0.0))]))];
    bag(&[TF], &two).refused("/tf", &["message 0: ", "`lidar` hangs on `a` and on `b`"]);
    let round =
        [(0, transforms(&[(0, "a", "lidar", isometry(0.0, 0.0)), (0, "lidar", "a", isometry(0.0, 0.0))]))];
    bag(&[TF], &round).refused("/tf", &["round in a loop"]);
}

#[test]
fn row_18_a_gap_in_a_link_leaves_stamps_out() {
    let mut messages = Vec::new();
    for ms in (0..=9000).step_by(100) {
        let x = ms as f64 / 1000.0;
        let mut now = vec![(ms, "odom", "lidar", isometry(x, 0.0))];
        if ms <= 2000 || ms >= 8000 {
            now.push((ms, "map", "odom", isometry(0.1 * x, 0.0)));
        }
        messages.push((0, transforms(&now)));
    }
    let run = bag(&[TF], &messages).read("/tf").unwrap();
    assert_eq!(run.trajectory.len(), 91 - 59);
    assert_says(&run.notes.join("; "), &["59 stamps excluded"]);
}

#[test]
fn a_log_has_its_static_frames() {
    let scan = crate::common::Message::of(&[[1.0, 2.0, 3.0]; 8]).encode();
    let broken = transforms(&[(0, "base_link", "lidar", isometry(1.0, 0.5))]);
    let messages = [
        (1, broken[..broken.len() - 1].to_vec()),
        (
            1,
            transforms(&[
                (0, "base_link", "lidar", isometry(0.3, 1.0)),
                (0, "base_link", "imu", isometry(0.0, 0.0)),
            ]),
        ),
        (0, scan),
    ];
    let bag = bag(&[crate::common::POINTS, TF_STATIC], &messages);
    let log = open_log(&bag.path, &LogOptions::default()).unwrap();
    let base_from_lidar = log.static_frames().a_from_b("base_link", "lidar").unwrap();
    assert!((base_from_lidar.to_homogeneous() - isometry(0.3, 1.0).to_homogeneous()).amax() < 1e-12);
    assert_eq!(log.static_frames().beside("lidar"), ["base_link", "imu"]);
    let [lost] = log.summary().damage.as_slice() else { panic!("{:?}", log.summary().damage) };
    assert_says(
        &format!("{}: {}", lost.place, lost.what),
        &["/tf_static (byte ", "qw takes 8 bytes", "skipped"],
    );
}
