//! Cutting the points of a LAS file into scans by their times.

use super::clock::gps_ns;
use super::made_with::MadeWith;
use crate::file::first_in_words;
use crate::geometry::cloud::las_points::LasPoints;
use crate::{Damage, LogError, PlaceInFile};
use dmp_lengths::thousands;
use std::collections::BTreeMap;
use std::ops::Range;

/// Most scans that a file is cut into: four days of 0.1 s.
const MAX_CUTS: usize = 1 << 22;
/// How often a point may be decoded, on the whole, to read every scan once.
const MAX_OVERLAP: u64 = 8;

/// Chunks that may be broken before the rest is given up.
const MAX_LOST_CHUNKS: usize = 100;

/// The points of one scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Cut {
    /// Its beginning, nanoseconds.
    pub(super) stamp_ns: i64,
    length_ns: i64,
    /// Where in the file its points are, among others perhaps.
    pub(super) points: Range<u64>,
    pub(super) returns: u64,
}

impl Cut {
    /// Whether a time is in it.
    pub(super) fn holds(&self, time_ns: i64) -> bool {
        time_ns.checked_sub(self.stamp_ns).is_some_and(|offset| (0..self.length_ns).contains(&offset))
    }
}

#[derive(Debug)]
pub(super) struct Cuts {
    /// In order of time.
    pub(super) scans: Vec<Cut>,
    pub(super) returns: u64,
    /// Points of those at times without a pose.
    pub(super) without_pose: u64,
    /// Smallest and largest time, nanoseconds.
    pub(super) span_ns: (i64, i64),
    /// Points that cannot be decoded, chunk by chunk.
    pub(super) lost: Vec<Range<u64>>,
    pub(super) damage: Vec<Damage>,
}

/// Where a scan's points are, as they are met.
struct Met {
    points: Range<u64>,
    returns: u64,
}

impl Cuts {
    /// Reads all points, from the first on.
    pub(super) fn of(points: &mut LasPoints, made_with: &MadeWith) -> Result<Self, LogError> {
        let path = points.path().to_owned();
        let total = points.header().points;
        let period_ns = made_with.scan_period_ns.max(1);
        let mut posed = Posed::new(made_with);
        let mut met: BTreeMap<i64, Met> = BTreeMap::new();
        let (mut origin_ns, mut span_ns) = (None, (i64::MAX, i64::MIN));
        let (mut index, mut no_number, mut without_pose) = (0_u64, 0_u64, 0_u64);
        let (mut damage, mut lost) = (Vec::<Damage>::new(), Vec::<Range<u64>>::new());
        while index < total {
            let chunk_end = points.end_of_chunk(index);
            points.seek(index);
            let batch = match points.read(chunk_end.max(index + 1) - index) {
                Ok(batch) => batch,
                Err(LogError::Malformed { place, problem, .. }) => {
                    let chunk_end = if lost.len() < MAX_LOST_CHUNKS { chunk_end } else { total };
                    let count = chunk_end - index;
                    let what = format!("{problem}; {} points are lost", thousands(count));
                    damage.push(Damage::new(place.to_string(), what));
                    lost.push(index..chunk_end);
                    index = chunk_end;
                    continue;
                }
                Err(error) => return Err(error),
            };
            let Some(times) = batch.gps_time() else { break };
            for (time_s, point) in times.zip(index..) {
                let Some(time_ns) = gps_ns(time_s) else {
                    no_number += 1;
                    continue;
                };
                let origin_ns = *origin_ns.get_or_insert(time_ns);
                // Times of hundreds of years are further apart than 63 bits.
                let Some(after_ns) = time_ns.checked_sub(origin_ns) else {
                    no_number += 1;
                    continue;
                };
                span_ns = (span_ns.0.min(time_ns), span_ns.1.max(time_ns));
                without_pose += u64::from(!posed.has_pose(time_ns));
                let met = met
                    .entry(after_ns.div_euclid(period_ns))
                    .or_insert(Met { points: point..point, returns: 0 });
                met.points.end = point + 1;
                met.returns += 1;
            }
            index += batch.len() as u64;
            if met.len() > MAX_CUTS {
                let problem = format!(
                    "times from {} to {} s make more than {MAX_CUTS} scans of {} s: are they seconds?",
                    span_ns.0 as f64 / 1e9,
                    span_ns.1 as f64 / 1e9,
                    period_ns as f64 / 1e9
                );
                return Err(LogError::malformed(&path, PlaceInFile::Point(index), problem));
            }
        }
        if no_number > 0 {
            let what = format!(
                "{} points have a gps_time that is no number or beyond all dates: they are dropped",
                thousands(no_number)
            );
            damage.push(Damage::new("the whole file", what));
        }
        let Some(origin_ns) = origin_ns else {
            let problem =
                format!("no point with a time that is a number can be read{}", first_in_words(&damage));
            return Err(LogError::malformed(&path, PlaceInFile::WholeFile, problem));
        };
        let cut = |(number, met): (i64, Met)| Cut {
            stamp_ns: origin_ns.saturating_add(number.saturating_mul(period_ns)),
            length_ns: period_ns,
            points: met.points,
            returns: met.returns,
        };
        let cuts: Vec<Cut> = met.into_iter().map(cut).collect();
        let returns = cuts.iter().map(|cut| cut.returns).sum();
        let spread: u64 =
            cuts.iter().map(|cut| cut.points.end - cut.points.start).fold(0, u64::saturating_add);
        if spread > index.saturating_mul(MAX_OVERLAP) {
            let times = spread.checked_div(index).unwrap_or(0);
            let problem = format!(
                "the points are not in order of time: to read {} scans, each would be decoded {times} times; sort the file by gps_time (las2las, pdal or laspy do)",
                thousands(cuts.len())
            );
            return Err(LogError::malformed(&path, PlaceInFile::WholeFile, problem));
        }
        Ok(Self { scans: cuts, returns, without_pose, span_ns, lost, damage })
    }
}

/// Says whether there is a pose at a time, without making it.
struct Posed<'a> {
    stamps_ns: &'a [i64],
    max_gap_ns: i64,
    time_offset_ns: i64,
    /// Times of the last answer, the ends included, and the answer.
    known: Option<(i64, i64, bool)>,
}

impl<'a> Posed<'a> {
    fn new(made_with: &'a MadeWith) -> Self {
        let stamps_ns = made_with.trajectory.stamps_ns().unwrap_or_default();
        let (max_gap_ns, time_offset_ns) = (made_with.gap_ns(), made_with.time_offset_ns);
        Self { stamps_ns, max_gap_ns, time_offset_ns, known: None }
    }

    fn has_pose(&mut self, time_ns: i64) -> bool {
        let Some(stamp_ns) = time_ns.checked_add(self.time_offset_ns) else { return false };
        if let Some((low, high, answer)) = self.known
            && (low..=high).contains(&stamp_ns)
        {
            return answer;
        }
        let after = self.stamps_ns.partition_point(|&s| s <= stamp_ns);
        let before_ns = after.checked_sub(1).and_then(|before| self.stamps_ns.get(before));
        match (before_ns, self.stamps_ns.get(after)) {
            (Some(&before_ns), _) if before_ns == stamp_ns => true,
            (Some(&before_ns), Some(&after_ns)) => {
                let answer = after_ns.checked_sub(before_ns).is_some_and(|gap_ns| gap_ns <= self.max_gap_ns);
                self.known = Some((before_ns + 1, after_ns - 1, answer));
                answer
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::{Isometry3, Track, Trajectory};

    #[test]
    fn a_pose_is_there_where_the_track_has_one() {
        let stamps_ns = [0, 10, 20, 50, 60, 61];
        let poses = stamps_ns.map(|stamp_ns| (stamp_ns, Isometry3::identity()));
        let run = Trajectory::stamped(poses.into()).unwrap().trajectory;
        let mut made_with = MadeWith::new(run);
        (made_with.max_gap_ns, made_with.time_offset_ns) = (Some(20), 5);
        let track = Track::new(&made_with.trajectory, made_with.body_from_sensor, 20);
        let mut posed = Posed::new(&made_with);
        for time_ns in (-20..80).chain((-20..80).rev()).chain([i64::MAX, i64::MIN]) {
            let expected = time_ns.checked_add(5).and_then(|ns| track.world_from_sensor_at(ns)).is_some();
            assert_eq!(posed.has_pose(time_ns), expected, "{time_ns}");
        }
    }
}
