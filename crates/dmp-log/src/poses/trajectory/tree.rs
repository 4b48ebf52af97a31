//! Frames that move on one another, as `/tf` has them.

use crate::file::shorten;
use crate::messages::{StaticFrames, frame_name};
use dmp_lengths::thousands;
use dmp_sensor::{Isometry3, Trajectory};
use std::collections::{BTreeMap, BTreeSet};

/// Most links that a message names.
const MOST_NAMED: usize = 50;
const SECOND_NS: i64 = 1_000_000_000;

/// The frames of `/tf`, each with its poses in its parent.
#[derive(Debug, Default)]
pub(super) struct MovingFrames {
    /// By child.
    links: BTreeMap<String, Link>,
}

#[derive(Debug)]
struct Link {
    parent: String,
    poses: Vec<(i64, Isometry3<f64>)>,
}

/// The poses of a body in a world.
#[derive(Debug)]
pub(super) struct Chain {
    pub(super) body: String,
    pub(super) poses: Vec<(i64, Isometry3<f64>)>,
    pub(super) notes: Vec<String>,
}

/// A link of a chain, `parent_from_child`.
enum Step {
    Fixed(Isometry3<f64>),
    Moving { run: Trajectory, max_gap_ns: i64 },
}

impl Step {
    fn at(&self, stamp_ns: i64) -> Option<Isometry3<f64>> {
        match self {
            Self::Fixed(pose) => Some(*pose),
            Self::Moving { run, max_gap_ns } => run.world_from_body_at(stamp_ns, *max_gap_ns),
        }
    }
}

impl MovingFrames {
    pub(super) fn add(
        &mut self,
        parent: &str,
        child: &str,
        stamp_ns: i64,
        parent_from_child: Isometry3<f64>,
    ) -> Result<(), String> {
        if let Some(link) = self.links.get_mut(child) {
            if link.parent != parent {
                let [child, one, other] = [child, &link.parent, parent].map(shorten);
                return Err(format!("the frame `{child}` hangs on `{one}` and on `{other}`"));
            }
            link.poses.push((stamp_ns, parent_from_child));
            return Ok(());
        }
        let link = Link { parent: parent.to_owned(), poses: vec![(stamp_ns, parent_from_child)] };
        self.links.insert(child.to_owned(), link);
        Ok(())
    }

    /// The poses of the wanted body in the wanted world, at the stamps of the moving link with the most.
    pub(super) fn chain(
        &self,
        fixed: &StaticFrames,
        wanted_world: Option<&str>,
        wanted_body: Option<&str>,
    ) -> Result<Chain, String> {
        let asked = "name world and body, as /tf:WORLD:BODY";
        let body = wanted_body.map(frame_name);
        let body = body.ok_or_else(|| format!("the scans name no frame that could move: {asked}"))?;
        let wanted_world = wanted_world.map(frame_name);
        let (mut steps, mut stamps, mut frame) = (Vec::new(), Stamps::default(), body);
        let mut met = BTreeSet::from([frame]);
        while wanted_world != Some(frame) {
            let parent = if let Some(link) = self.links.get(frame) {
                steps.push(link.step(&mut stamps).map_err(|e| format!("the frame `{frame}`: {e}"))?);
                link.parent.as_str()
            } else if let Some((parent, parent_from_frame)) = fixed.parent(frame) {
                steps.push(Step::Fixed(*parent_from_frame));
                parent
            } else {
                break;
            };
            // Before its poses are taken once more.
            if !met.insert(parent) {
                let [body, parent] = [body, parent].map(shorten);
                return Err(format!("the frames above `{body}` go round in a loop through `{parent}`"));
            }
            frame = parent;
        }
        let world = frame;
        if wanted_world.is_some_and(|wanted| wanted != world) || steps.is_empty() {
            let missing = wanted_world.unwrap_or("no frame");
            return Err(format!(
                "`{missing}` is not above `{body}` in /tf and /tf_static, whose links are {}; {asked}",
                self.in_words()
            ));
        }
        if stamps.of_link.is_empty() {
            return Err(format!("nothing moves between `{world}` and `{body}`; {asked}"));
        }
        let at = |stamp_ns: i64| {
            // From the body up: the last link is the outermost.
            let mut world_from_body = Isometry3::identity();
            for step in &steps {
                world_from_body = step.at(stamp_ns)? * world_from_body;
            }
            Some((stamp_ns, world_from_body))
        };
        let poses: Vec<(i64, Isometry3<f64>)> = stamps.of_link.iter().copied().filter_map(at).collect();
        let mut notes = vec![format!("`{body}` in `{world}`, {} frames in between", steps.len() - 1)];
        let without = stamps.of_link.len() - poses.len();
        if without > 0 {
            notes.push(format!(
                "{} stamps excluded, at which not every frame in between has a pose",
                thousands(without)
            ));
        }
        Ok(Chain { body: body.to_owned(), poses, notes })
    }

    fn in_words(&self) -> String {
        let link =
            |(child, link): (&String, &Link)| format!("{} to {}", shorten(&link.parent), shorten(child));
        let named = self.links.iter().take(MOST_NAMED).map(link).collect::<Vec<_>>().join(", ");
        match self.links.len().saturating_sub(MOST_NAMED) {
            0 => named,
            more => format!("{named} and {more} more"),
        }
    }
}

/// The stamps of the link that has most of those that move; of those that stand, where none moves.
#[derive(Debug, Default)]
struct Stamps {
    moves: bool,
    of_link: Vec<i64>,
}

impl Link {
    fn step(&self, stamps: &mut Stamps) -> Result<Step, String> {
        let run = Trajectory::stamped(self.poses.clone()).map_err(|e| e.to_string())?.trajectory;
        let found = run.stamps_ns().unwrap_or_default();
        let first = run.poses().first().copied().unwrap_or_else(Isometry3::identity);
        let moves = run.poses().iter().any(|pose| *pose != first);
        if (moves, found.len()) > (stamps.moves, stamps.of_link.len()) {
            *stamps = Stamps { moves, of_link: found.to_vec() };
        }
        if !moves {
            // A part that is fixed and sent again and again.
            return Ok(Step::Fixed(first));
        }
        let mut steps_ns: Vec<i64> = found.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
        steps_ns.sort_unstable();
        let median_ns = steps_ns.get(steps_ns.len() / 2).copied().unwrap_or(0);
        // As for trajectories: a second, or three times the median interval where that is longer.
        Ok(Step::Moving { max_gap_ns: median_ns.saturating_mul(3).max(SECOND_NS), run })
    }
}
