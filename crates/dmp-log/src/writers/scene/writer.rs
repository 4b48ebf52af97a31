//! Writing a scene.

use super::cloud::SceneCloud;
use crate::LogError;
use crate::messages::{
    CdrWriter, LOG_SCHEMA, MARKER_ARRAY_SCHEMA, McapCompression, McapFile, PATH_SCHEMA, POINT_CLOUD2_SCHEMA,
    POSE_STAMPED_SCHEMA, RANGE_SCHEMA, RosStamp, TF_MESSAGE_SCHEMA, TextMarker, write_log, write_path,
    write_pose, write_range, write_texts, write_transform,
};
use dmp_sensor::Isometry3;
use std::collections::BTreeMap;
use std::path::Path;

/// The frame that all runs are laid into, as REP 105 has it.
const MAP: &str = "map";
/// Size from which a chunk is closed, not packed.
const CHUNK_BYTES: u64 = 1 << 20;
/// How high texts are, metres.
const TEXT_M: f64 = 1.5;

/// What a scene is of.
#[derive(Debug, Clone, Copy)]
pub struct SceneHead<'a> {
    /// The stamp of the log's first scan, nanoseconds: when maps and ways are there.
    pub start_ns: i64,
    /// The runs, whose numbers are their places here.
    pub runs: &'a [SceneRun<'a>],
}

/// A run of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SceneRun<'a> {
    /// Its name: that of the sensor's frame, and what its topics begin with.
    pub name: &'a str,
    /// Whether its map and its returns are shown.
    pub with_clouds: bool,
}

/// A place with a text.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePlace {
    /// Where it is in the common frame, metres.
    pub place_in_map_m: [f64; 3],
    /// Its text.
    pub text: String,
}

/// Topics of a run, by their numbers.
#[derive(Debug)]
struct Topics {
    name: String,
    map: Option<u16>,
    returns: Option<u16>,
    way: u16,
    path: u16,
    places: u16,
    labels: u16,
    pose: u16,
    residual: u16,
}

/// Writes a scene as MCAP with messages of ROS 2 alone. The same calls give the same bytes. The file gets its name in
/// [`SceneWriter::finish`]; without it nothing is left behind. Its topics are those of `docs/guide/viewers.md`.
#[derive(Debug)]
pub struct SceneWriter {
    file: McapFile,
    runs: Vec<Topics>,
    transforms: u16,
    worst: u16,
    start: (i64, RosStamp),
    scans: u64,
    texts: u64,
    message: CdrWriter,
}

impl SceneWriter {
    /// Starts a file that will be at `path`, in place of what may be there.
    ///
    /// # Errors
    /// When the file cannot be created, or the stamp is beyond what ROS 2 can say.
    pub fn create(path: &Path, head: &SceneHead<'_>) -> Result<Self, LogError> {
        let start = RosStamp::of_ns(head.start_ns).map_err(|problem| unwritable(path, 0, problem))?;
        let mut file = McapFile::create(path, McapCompression::ZstdFast, CHUNK_BYTES)?;
        let transforms = file.topic("/tf", "tf2_msgs/msg/TFMessage", TF_MESSAGE_SCHEMA)?;
        let worst = file.topic("/worst_places", "rcl_interfaces/msg/Log", LOG_SCHEMA)?;
        let mut runs = Vec::new();
        for run in head.runs {
            let mut topic = |what: &str, kind: &str, schema: &str| {
                file.topic(&format!("/{}/{what}", run.name), kind, schema)
            };
            let mut cloud = |what: &str| topic(what, "sensor_msgs/msg/PointCloud2", POINT_CLOUD2_SCHEMA);
            runs.push(Topics {
                name: run.name.to_owned(),
                map: run.with_clouds.then(|| cloud("map")).transpose()?,
                returns: run.with_clouds.then(|| cloud("returns")).transpose()?,
                way: cloud("way")?,
                places: cloud("places")?,
                path: topic("path", "nav_msgs/msg/Path", PATH_SCHEMA)?,
                labels: topic("labels", "visualization_msgs/msg/MarkerArray", MARKER_ARRAY_SCHEMA)?,
                pose: topic("pose", "geometry_msgs/msg/PoseStamped", POSE_STAMPED_SCHEMA)?,
                residual: topic("residual", "sensor_msgs/msg/Range", RANGE_SCHEMA)?,
            });
        }
        let (start, message) = ((head.start_ns, start), CdrWriter::default());
        Ok(Self { file, runs, transforms, worst, start, scans: 0, texts: 0, message })
    }

    /// Starts a cloud of about so many surfels, in the common frame.
    ///
    /// # Errors
    /// When they are more than a message can hold.
    pub fn start_map(&mut self, points: usize) -> Result<SceneCloud, LogError> {
        self.start_cloud(self.start.1, None, points, true)
    }

    /// Writes the map of a run, one of those that are shown with clouds; returns how many surfels it has.
    ///
    /// # Errors
    /// When the disk is full, or the surfels are more than a message can hold.
    pub fn map(&mut self, run: usize, cloud: SceneCloud) -> Result<u32, LogError> {
        self.write_cloud(self.runs[run].map, self.start.0, cloud)
    }

    /// Starts a cloud of about so many points in the common frame: those of a way, or of places.
    ///
    /// # Errors
    /// When they are more than a message can hold.
    pub fn start_marks(&mut self, points: usize) -> Result<SceneCloud, LogError> {
        self.start_cloud(self.start.1, None, points, false)
    }

    /// Writes the way of a run: where its sensor was, as points and as a path of stamps with poses in the common frame.
    ///
    /// # Errors
    /// When the disk is full, or a stamp is beyond what ROS 2 can say.
    pub fn way(
        &mut self,
        run: usize,
        cloud: SceneCloud,
        poses: &[(i64, Isometry3<f64>)],
    ) -> Result<(), LogError> {
        self.write_cloud(Some(self.runs[run].way), self.start.0, cloud)?;
        let stamped = poses.iter().map(|(stamp_ns, pose)| Ok((RosStamp::of_ns(*stamp_ns)?, *pose)));
        let poses = stamped.collect::<Result<Vec<_>, String>>();
        let poses = poses.map_err(|problem| self.unwritable(problem))?;
        write_path(&mut self.message, self.start.1, MAP, &poses);
        self.file.write(self.runs[run].path, 0, self.start.0, self.message.message())
    }

    /// Writes the worst places of a run as points, and their texts.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn places(
        &mut self,
        run: usize,
        cloud: SceneCloud,
        (texts, colour): (&[ScenePlace], [u8; 3]),
    ) -> Result<(), LogError> {
        let Topics { name, places, labels, .. } = &self.runs[run];
        let texts: Vec<TextMarker<'_>> = texts
            .iter()
            .map(|place| TextMarker { place_m: place.place_in_map_m, text: &place.text })
            .collect();
        let (places, labels) = (*places, *labels);
        write_texts(&mut self.message, self.start.1, [MAP, name], (TEXT_M, colour), &texts);
        self.file.write(labels, 0, self.start.0, self.message.message())?;
        self.write_cloud(Some(places), self.start.0, cloud).map(drop)
    }

    /// Writes where the sensor of a run is at a stamp, and the root of its mean residual up to `most_m`, metres; NaN where nothing is
    /// predicted.
    ///
    /// # Errors
    /// When the disk is full, or the stamp is beyond what ROS 2 can say.
    pub fn pose(
        &mut self,
        run: usize,
        (stamp_ns, map_from_sensor): (i64, &Isometry3<f64>),
        [residual_m, most_m]: [f32; 2],
    ) -> Result<(), LogError> {
        let stamp = self.stamp(stamp_ns)?;
        let (file, message, number) = (&mut self.file, &mut self.message, self.scans);
        let Topics { name, pose, residual, .. } = &self.runs[run];
        write_transform(message, stamp, [MAP, name], map_from_sensor);
        file.write(self.transforms, number, stamp_ns, message.message())?;
        write_pose(message, stamp, MAP, map_from_sensor);
        file.write(*pose, number, stamp_ns, message.message())?;
        write_range(message, stamp, name, [residual_m, most_m]);
        file.write(*residual, number, stamp_ns, message.message())?;
        self.scans += 1;
        Ok(())
    }

    /// Starts a cloud of about so many returns of a scan, in the frame of the run's sensor.
    ///
    /// # Errors
    /// When they are more than a message can hold, or the stamp is beyond what ROS 2 can say.
    pub fn start_returns(
        &mut self,
        run: usize,
        stamp_ns: i64,
        points: usize,
    ) -> Result<SceneCloud, LogError> {
        let stamp = self.stamp(stamp_ns)?;
        self.start_cloud(stamp, Some(run), points, false)
    }

    /// Writes the returns of a scan of a run, one of those that are shown with clouds; returns how many they are.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn returns(&mut self, run: usize, stamp_ns: i64, cloud: SceneCloud) -> Result<u32, LogError> {
        self.write_cloud(self.runs[run].returns, stamp_ns, cloud)
    }

    /// Tells something of a run at a stamp.
    ///
    /// # Errors
    /// When the disk is full, or the stamp is beyond what ROS 2 can say.
    pub fn tell(&mut self, run: usize, stamp_ns: i64, text: &str) -> Result<(), LogError> {
        let stamp = self.stamp(stamp_ns)?;
        write_log(&mut self.message, stamp, &self.runs[run].name, text);
        self.texts += 1;
        self.file.write(self.worst, self.texts, stamp_ns, self.message.message())
    }

    /// Writes what is to be known of the file, in words by names, makes it safe on disk and gives it its name.
    ///
    /// # Errors
    /// When the disk is full or the file cannot be renamed; what was at the path is then untouched.
    pub fn finish(mut self, about: BTreeMap<String, String>) -> Result<(), LogError> {
        self.file.about("dmp scene", about)?;
        self.file.finish()
    }

    fn unwritable(&self, problem: String) -> LogError {
        unwritable(self.file.target(), self.scans, problem)
    }

    fn stamp(&self, stamp_ns: i64) -> Result<RosStamp, LogError> {
        RosStamp::of_ns(stamp_ns).map_err(|problem| self.unwritable(problem))
    }

    /// In the common frame, or in that of the sensor of a run.
    fn start_cloud(
        &mut self,
        stamp: RosStamp,
        run: Option<usize>,
        points: usize,
        with_normals: bool,
    ) -> Result<SceneCloud, LogError> {
        let message = std::mem::take(&mut self.message);
        let frame = run.map_or(MAP, |run| &self.runs[run].name);
        SceneCloud::start(message, (stamp, frame), points, with_normals)
            .map_err(|problem| self.unwritable(problem))
    }

    fn write_cloud(&mut self, topic: Option<u16>, stamp_ns: i64, cloud: SceneCloud) -> Result<u32, LogError> {
        let closed = cloud.finish();
        let (mut message, points) = closed.map_err(|problem| self.unwritable(problem))?;
        if let Some(topic) = topic {
            self.file.write(topic, self.scans, stamp_ns, message.message())?;
        }
        self.message = message;
        Ok(points)
    }
}

fn unwritable(path: &Path, frame: u64, problem: String) -> LogError {
    LogError::Unwritable { path: path.into(), frame, problem }
}
