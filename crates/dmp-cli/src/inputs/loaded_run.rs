//! A run's trajectory, from a file or from messages.

use dmp_draw::text::counted;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::PosesAs;
use dmp_log::{StaticFrames, TopicTrajectory, TrajectoryFile, shown_path};
use dmp_sensor::Trajectory;

/// A run's trajectory, read.
#[derive(Debug, Clone)]
pub(crate) struct LoadedRun {
    pub(crate) name: String,
    /// Where it is from, as it was given.
    pub(crate) given: String,
    /// The file or bag that it is in.
    pub(crate) path: PathBuf,
    /// The file's format, or the type of the messages.
    pub(crate) format: &'static str,
    pub(crate) trajectory: Trajectory,
    pub(crate) out_of_order: usize,
    pub(crate) repeated: usize,
    /// The frame that moves, where messages name it.
    pub(crate) body_frame: Option<String>,
    /// Those of a bag of its own.
    pub(crate) static_frames: StaticFrames,
    pub(crate) notes: Vec<String>,
    /// Whether part of a bag of its own is lost; the notes say what.
    pub(crate) damaged: bool,
    pub(crate) fingerprint: String,
    /// Whether an odometry lies between its own poses.
    pub(crate) is_carried: bool,
}

impl LoadedRun {
    /// Where it is from, as results say it.
    pub(crate) fn shown(&self) -> String {
        match self.given.strip_prefix(&self.path.display().to_string()) {
            Some(topic) => shown_path(&self.path) + topic,
            None => self.given.clone(),
        }
    }

    /// With its poses read as they are meant.
    pub(crate) fn read_as(mut self, poses: PosesAs) -> anyhow::Result<Self> {
        let read = poses.read(&self.trajectory);
        self.trajectory = read.with_context(|| format!("{}: its poses cannot be {poses}", self.given))?;
        self.notes.push(format!("poses read as {poses}"));
        Ok(self)
    }

    /// With the poses of an odometry of the same body between its own.
    pub(crate) fn carried_by(mut self, odometry: &Trajectory) -> anyhow::Result<Self> {
        let carried = self.trajectory.carried_by(odometry, odometry.usual_gap_ns());
        let own = counted(self.trajectory.len() as u64, "pose");
        self.trajectory = carried.with_context(|| {
            format!(
                "{}: --between has no pose between its poses: they must be further apart than those of the odometry, with stamps of the same clock",
                self.given
            )
        })?;
        self.is_carried = true;
        self.notes.push(format!("{own}, carried by an odometry between them"));
        Ok(self)
    }

    /// Of a file.
    pub(crate) fn of_file(name: String, given: String, path: &Path, file: TrajectoryFile) -> Self {
        let TrajectoryFile { format, trajectory, out_of_order, repeated, notes, fingerprint } = file;
        Self {
            name,
            given,
            path: path.to_owned(),
            format: format.name(),
            trajectory,
            out_of_order,
            repeated,
            body_frame: None,
            static_frames: StaticFrames::default(),
            notes,
            damaged: false,
            fingerprint,
            is_carried: false,
        }
    }

    /// Of messages: of a bag of its own, or of the log itself.
    pub(crate) fn of_topic(
        name: String,
        given: String,
        path: &Path,
        read: TopicTrajectory,
        own_bag: bool,
    ) -> Self {
        let mut notes = read.notes;
        if own_bag {
            notes.insert(0, format!("topic {}", read.topic));
            notes.extend(read.damage.iter().map(|lost| format!("lost: {}: {}", lost.place, lost.what)));
        }
        Self {
            name,
            given,
            path: path.to_owned(),
            format: read.message_type,
            trajectory: read.trajectory,
            out_of_order: read.out_of_order,
            repeated: read.repeated,
            body_frame: read.body_frame,
            static_frames: read.static_frames,
            // What of the log itself is lost is reported with the log.
            damaged: own_bag && !read.damage.is_empty(),
            notes,
            fingerprint: read.fingerprint,
            is_carried: false,
        }
    }
}
