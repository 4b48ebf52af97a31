//! Trajectories in the messages of a bag.

use dmp_lengths::thousands;
use dmp_sensor::{Isometry3, Trajectory, TrajectoryRepairs};

use super::error::TrajectoryParseError;
use super::tree::MovingFrames;
use crate::file::{DamageList, pose_of};
use crate::logs::{bag_at, has_bag_name};
use crate::messages::{
    BagFound, Message, PoseCoding, PoseType, STATIC_TOPIC, StampedPose, StaticFrames, frame_name, in_words,
};
use crate::{Damage, LogError, ParseError, PlaceInFile};
use std::path::Path;

/// Which poses of a bag are meant.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PoseTopic {
    /// The topic; `None` where the bag has only one with poses.
    pub topic: Option<String>,
    /// In `/tf`: the frame that stands still; `None`: the root of the tree.
    pub world: Option<String>,
    /// In `/tf`: the frame that moves; `None`: that of the scans.
    pub body: Option<String>,
}

/// A trajectory read from the messages of a bag.
#[derive(Debug, Clone, PartialEq)]
pub struct TopicTrajectory {
    /// The topic.
    pub topic: String,
    /// The type of its messages, as `Odometry`.
    pub message_type: &'static str,
    /// The poses, `world_from_body`, in order of time.
    pub trajectory: Trajectory,
    /// The frame that moves, where the messages name it.
    pub body_frame: Option<String>,
    /// Poses whose stamp was smaller than the one before them; they were put in order.
    pub out_of_order: usize,
    /// Repeated poses that were left out.
    pub repeated: usize,
    /// The frames of the bag's own `/tf_static`.
    pub static_frames: StaticFrames,
    /// What was guessed.
    pub notes: Vec<String>,
    /// What of the bag is lost.
    pub damage: Vec<Damage>,
    /// Identifies the bag, as `crc32:1a2b3c4d`.
    pub fingerprint: String,
}

/// Reads a trajectory from a bag (MCAP, rosbag2, ROS 1): the poses of `Odometry`, `PoseStamped`,
/// `PoseWithCovarianceStamped`, `TransformStamped`, of the `Path` with the most poses (the last of these), or, of `/tf`, the
/// chain from the world to the body at the stamps of its moving link that has most. Stamps are those of
/// the headers. `scan_frame` is what moves in `/tf` where nothing else is asked for.
///
/// Passes over the whole bag once.
///
/// # Errors
/// When it is no bag or cannot be read; when the topic is not there, holds no poses, or is not named and
/// not the only one; when a pose is no pose; when the frames of `/tf` do not hang together.
pub fn read_topic_trajectory(
    path: &Path,
    wanted: &PoseTopic,
    scan_frame: Option<&str>,
) -> Result<TopicTrajectory, LogError> {
    let Some(bag) = bag_at(path)? else {
        let problem = "no bag (MCAP, rosbag2, ROS 1), so it has no topics with poses".to_owned();
        if has_bag_name(path) {
            return Err(LogError::malformed(path, PlaceInFile::WholeFile, problem));
        }
        return Err(LogError::Option { path: path.into(), problem });
    };
    let mut found = Found::default();
    let bag_found = bag.read_whole(&mut |message| found.take(wanted.topic.as_deref(), message))?;
    let (topic, coding) = choose(path, &bag_found, wanted.topic.as_deref())?;
    if let Some((place, problem)) = found.first_faults.remove(&topic) {
        return Err(LogError::malformed(path, place, problem));
    }
    if coding.pose_type != PoseType::Transforms && (wanted.world.is_some() || wanted.body.is_some()) {
        let problem =
            format!("{topic} holds {}: world and body are chosen in /tf only", coding.pose_type.name());
        return Err(LogError::Option { path: path.into(), problem });
    }
    // Of a bag whose topic was not named, all that could be it were read.
    let poses = found.topics.remove(&topic).unwrap_or_default();
    let mut lost = bag_found.damage;
    lost.append(&mut found.damage.into_vec());
    let fingerprint = bag.fingerprint()?;
    let trajectory_of = |poses| {
        Trajectory::stamped(poses).map_err(|source| TrajectoryParseError::Poses(source).in_file(path))
    };
    let mut notes = Vec::new();
    let (repairs, body_frame) = if coding.pose_type == PoseType::Transforms {
        let (world, body) = (wanted.world.as_deref(), wanted.body.as_deref().or(scan_frame));
        let chain = poses.frames.chain(&found.static_frames, world, body);
        let chain = chain.map_err(|problem| LogError::Option { path: path.into(), problem })?;
        notes.extend(chain.notes);
        (trajectory_of(chain.poses)?, Some(chain.body))
    } else {
        if poses.other_frames > 0 {
            notes.push(format!(
                "{} poses are of another frame or in another than the first",
                thousands(poses.other_frames)
            ));
        }
        (trajectory_of(poses.stamped)?, poses.child)
    };
    let TrajectoryRepairs { trajectory, out_of_order, repeated } = repairs;
    Ok(TopicTrajectory {
        topic,
        message_type: coding.pose_type.name(),
        trajectory,
        body_frame,
        out_of_order,
        repeated,
        static_frames: found.static_frames,
        notes,
        damage: lost,
        fingerprint,
    })
}

/// What a pass over the bag finds.
#[derive(Debug, Default)]
struct Found {
    topics: std::collections::BTreeMap<String, Poses>,
    static_frames: StaticFrames,
    first_faults: std::collections::BTreeMap<String, (PlaceInFile, String)>,
    /// What of `/tf_static` is lost.
    damage: DamageList,
}

#[derive(Debug, Default)]
struct Poses {
    messages: u64,
    /// With their stamps.
    stamped: Vec<(i64, Isometry3<f64>)>,
    /// Of the first pose.
    frame: String,
    child: Option<String>,
    other_frames: u64,
    /// Of `/tf`.
    frames: MovingFrames,
}

impl Found {
    fn take(&mut self, wanted: Option<&str>, message: Message<'_>) {
        let Some(coding) = PoseCoding::of(message.channel) else { return };
        let topic = message.channel.topic.as_str();
        if topic == STATIC_TOPIC {
            // The poses are well without it; whoever needs the frame will miss it.
            if let Err(problem) = self.static_frames.add_message(coding, message.body) {
                let place = format!("topic {topic} ({})", message.location.in_words());
                self.damage.push(Damage::new(place, problem));
            }
            return;
        }
        let (place, fault) = if wanted.is_none_or(|wanted| wanted == topic) {
            if !self.topics.contains_key(topic) {
                self.topics.insert(topic.to_owned(), Poses::default());
            }
            let Some(poses) = self.topics.get_mut(topic) else { return };
            poses.messages += 1;
            (PlaceInFile::Message(poses.messages - 1), poses.add(coding, message.body).err())
        } else {
            return;
        };
        if let Some(problem) = fault {
            let problem = format!("topic {topic} ({}): {problem}", message.location.in_words());
            self.first_faults.entry(topic.to_owned()).or_insert((place, problem));
        }
    }
}

impl Poses {
    fn add(&mut self, coding: PoseCoding, message: &[u8]) -> Result<(), String> {
        let stamped = coding.parse(message)?;
        if coding.pose_type == PoseType::Path {
            // The same poses come again in every message, corrected and with more behind them.
            if stamped.len() < self.stamped.len() {
                return Ok(());
            }
            self.stamped.clear();
            self.other_frames = 0;
        }
        for stamped in stamped {
            let StampedPose { stamp_ns, frame, child, position_m, quaternion } = stamped;
            let pose = pose_of(PlaceInFile::WholeFile, position_m, quaternion)
                .map_err(|ParseError { problem, .. }| problem)?;
            let [frame, child] = [Some(frame), child].map(|name| name.map(frame_name));
            if coding.pose_type == PoseType::Transforms {
                self.frames.add(frame.unwrap_or_default(), child.unwrap_or_default(), stamp_ns, pose)?;
                continue;
            }
            if self.stamped.is_empty() {
                frame.unwrap_or_default().clone_into(&mut self.frame);
                self.child = child.filter(|name| !name.is_empty()).map(str::to_owned);
            } else {
                let other = Some(self.frame.as_str()) != frame
                    || self.child.as_deref() != child.filter(|name| !name.is_empty());
                self.other_frames += u64::from(other);
            }
            self.stamped.push((stamp_ns, pose));
        }
        Ok(())
    }
}

/// The topic that is meant.
fn choose(path: &Path, bag_found: &BagFound, wanted: Option<&str>) -> Result<(String, PoseCoding), LogError> {
    let option = |problem: String| LogError::Option { path: path.into(), problem };
    let all = bag_found.topics.infos();
    if all.is_empty() {
        return Err(LogError::malformed(path, PlaceInFile::WholeFile, "it has no topics"));
    }
    let with_poses = |channel: &&crate::messages::Channel| {
        PoseCoding::of(channel).is_some() && channel.topic != STATIC_TOPIC
    };
    let mut channels = bag_found.topics.channels().filter(with_poses);
    let channel = match wanted {
        Some(wanted) => channels.find(|channel| channel.topic == wanted).ok_or_else(|| {
            option(format!("no topic `{wanted}` with poses that can be read; there are {}", in_words(&all)))
        })?,
        None => match (channels.next(), channels.next()) {
            (Some(only), None) => only,
            (None, _) => return Err(option(format!("no topic with poses; there are {}", in_words(&all)))),
            (Some(first), Some(second)) => {
                let mut names = vec![first.topic.as_str(), &second.topic];
                names.extend(channels.map(|channel| channel.topic.as_str()));
                names.dedup();
                return Err(option(format!(
                    "several topics hold poses, name one behind a colon: {}",
                    names.join(", ")
                )));
            }
        },
    };
    let coding =
        PoseCoding::of(channel).ok_or_else(|| option(format!("{} holds no poses", channel.topic)))?;
    Ok((channel.topic.clone(), coding))
}

/// The bag at a path, where there is one; for callers that choose between files and bags.
///
/// # Errors
/// When the path cannot be looked at.
pub fn is_bag(path: &Path) -> Result<bool, LogError> {
    Ok(bag_at(path)?.is_some())
}
