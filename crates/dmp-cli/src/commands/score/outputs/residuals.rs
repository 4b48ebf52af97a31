//! Scored returns: gathered while they are scored, written when all are.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use dmp::{HitKind, Residuals, Scales, ScoredReturns};
use dmp_log::{ResidualFormat, ResidualHead, ResidualWriter, ScoredPoint, ScoredScan};
use dmp_sensor::{Isometry3, Quaternion, Ray, Translation3, UnitQuaternion};

use super::spool::Spool;
use super::targets::ResidualFile;

/// Rows of a piece at most.
const PIECE_ROWS: usize = 1 << 13;
/// The scan's stamp and pose, in front of the rows of a piece.
const HEAD_BYTES: usize = 8 * 8;

/// The returns of one run that are to be written.
#[derive(Debug)]
pub(super) struct RunReturns {
    pub(super) run: usize,
    pub(super) name: String,
    pub(super) file: ResidualFile,
    /// Whether the map is fused: then what predicts a return is the first independent surfel, else the nearest one.
    pub(super) is_fused: bool,
    /// What is blocked, and what is beyond.
    pub(super) scales: Scales,
    pub(super) spool: Spool,
}

/// The scan that returns are of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    /// The number of the frame in the log.
    pub(super) frame: u32,
    /// The stamp of the log's first scan, and of this one, nanoseconds; 0 in a log without stamps.
    pub(super) start_ns: i64,
    pub(super) stamp_ns: i64,
}

/// Buffers that threads take from and give back.
#[derive(Debug, Default)]
pub(super) struct Buffers(Mutex<Vec<Vec<u8>>>);

impl Buffers {
    /// Does something with an empty buffer.
    pub(super) fn with<T>(&self, what: impl FnOnce(&mut Vec<u8>) -> T) -> T {
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut buffer = lock().pop().unwrap_or_default();
        let done = what(&mut buffer);
        buffer.clear();
        lock().push(buffer);
        done
    }
}

impl RunReturns {
    /// Keeps the returns of a part of a frame.
    pub(super) fn keep(
        &self,
        scored: &ScoredReturns<'_>,
        origin: Origin,
        buffers: &Buffers,
    ) -> std::io::Result<()> {
        let Some(Some(run)) = scored.runs.get(self.run) else { return Ok(()) };
        let pose = run.own_from_sensor;
        let mut first = 0;
        let pieces = run.rays.chunks(PIECE_ROWS).zip(run.residuals.chunks(PIECE_ROWS));
        for ((rays, residuals), offsets_ns) in pieces.zip(scored.offsets_ns.chunks(PIECE_ROWS)) {
            buffers.with(|piece| {
                piece.extend_from_slice(&origin.stamp_ns.to_le_bytes());
                let (place, turn) = (pose.translation.vector, pose.rotation.coords);
                piece.extend(place.iter().chain(turn.iter()).flat_map(|number| number.to_le_bytes()));
                let after_start_ns = origin.stamp_ns.saturating_sub(origin.start_ns);
                for index in (0..rays.len()).filter(|index| run.is_posed[first + index]) {
                    let time_ns = after_start_ns.saturating_add(offsets_ns[index]);
                    let ray = &run.own_ray(first + index);
                    let kind = (self.is_fused, self.scales);
                    let point = scored_point(ray, &residuals[index], kind, origin.frame, time_ns);
                    piece.extend_from_slice(&point.to_bytes());
                }
                self.spool.add(origin.frame, piece)
            })?;
            first += rays.len();
        }
        Ok(())
    }
}

/// The numbers of those returns of a scan, among these, that are drawn: one of every so many, each as likely as any other.
/// Not the n-th, n-th but one and so on, which would be those of a few beams.
pub(super) fn drawn(frame: u32, every: u64, returns: Range<u64>) -> impl Iterator<Item = u64> {
    let every = every.max(1);
    let groups = returns.start / every..returns.end.div_ceil(every);
    let of_group = move |group: u64| group * every + mixed((u64::from(frame) << 32) ^ group) % every;
    groups.map(of_group).filter(move |number| returns.contains(number))
}

/// The finaliser of `SplitMix64` (Steele, Lea & Flood 2014), one step on.
pub(super) fn mixed(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn scored_point(
    ray: &Ray,
    residuals: &Residuals,
    (is_fused, scales): (bool, Scales),
    frame: u32,
    time_ns: i64,
) -> ScoredPoint {
    // What is not a number is a miss, as it is for the scores.
    let length = |m: Option<f64>| m.filter(|m| m.is_finite()).map_or(f32::NAN, |m| m as f32);
    let own = if is_fused { residuals.independent_m } else { residuals.nearest_m };
    ScoredPoint {
        point_in_world_m: ray.endpoint_in_world(),
        signed_residual_m: length(own),
        map_range_m: length(own.map(|residual_m| ray.range_m - residual_m)),
        range_m: ray.range_m as f32,
        first_residual_m: length(residuals.first_m),
        nearest_residual_m: length(residuals.nearest_m),
        time_s: time_ns as f64 / 1e9,
        frame: frame as i32,
        kind: match residuals.hit_kind(scales) {
            HitKind::Miss => 0,
            HitKind::Hit => 1,
            HitKind::Blocked => 2,
            HitKind::Beyond => 3,
            HitKind::LeftOut => 4,
        },
        revisited: residuals.revisited,
    }
}

/// Writes what was kept of a run in order of the log; tells how many returns that are. `go_on` fails where it is to stop; `step` is called after each scan.
/// `start_ns` is the stamp of the log's first scan, where it has stamps.
pub(super) fn write(
    returns: RunReturns,
    start_ns: Option<i64>,
    (go_on, step): (&dyn Fn() -> Result<(), dmp::EvaluateError>, &dyn Fn()),
) -> anyhow::Result<u64> {
    let RunReturns { name, file, spool, .. } = returns;
    let kept = spool.sorted();
    let rows = |bytes: usize| (bytes.saturating_sub(HEAD_BYTES) / ScoredPoint::BYTES) as u64;
    let points = kept.pieces().map(rows).sum();
    let create = |near_m| {
        let head = ResidualHead { run: &name, points, near_m, start_ns };
        ResidualWriter::create(&file.path, file.format, &head)
    };
    let in_parts = matches!(file.format, ResidualFormat::Cloud(_));
    let mut writer = None;
    let mut scan: Vec<ScoredPoint> = Vec::new();
    kept.each(|piece, is_last| {
        go_on()?;
        let (head, rows) = piece.split_at(HEAD_BYTES.min(piece.len()));
        scan.extend(rows.as_chunks().0.iter().map(ScoredPoint::of_bytes));
        if is_last || in_parts {
            let head = head_of(head, start_ns.is_some());
            let near_m = scan
                .first()
                .map_or(head.world_from_sensor.translation.vector.into(), |point| point.point_in_world_m);
            let writer = match &mut writer {
                Some(writer) => writer,
                none => none.insert(create(near_m)?),
            };
            writer.write_scan(&head, &scan)?;
            scan.clear();
        }
        if is_last {
            step();
        }
        Ok(())
    })?;
    // A log without a return to be written makes a file without points.
    writer.map_or_else(|| create([0.0; 3]), Ok)?.finish()?;
    Ok(points)
}

fn head_of(bytes: &[u8], has_stamp: bool) -> ScoredScan {
    let mut numbers = [[0; 8]; 8];
    for (number, bytes) in numbers.iter_mut().zip(bytes.as_chunks().0) {
        *number = *bytes;
    }
    let [stamp_ns, pose @ ..] = numbers;
    let [x, y, z, qx, qy, qz, qw] = pose.map(f64::from_le_bytes);
    // As it was before it became bytes.
    let turn = UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz));
    ScoredScan {
        stamp_ns: has_stamp.then_some(i64::from_le_bytes(stamp_ns)),
        world_from_sensor: Isometry3::from_parts(Translation3::new(x, y, z), turn),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_return_of_every_group_is_drawn_and_each_as_often() {
        for every in [2, 3, 7] {
            let mut places = vec![0_u32; every as usize];
            for frame in 0..300 {
                // In two parts, as a scan comes.
                let mut taken: Vec<u64> = drawn(frame, every, 0..50).collect();
                taken.extend(drawn(frame, every, 50..10 * every + 100));
                let groups: Vec<u64> = taken.iter().map(|number| number / every).collect();
                assert!(groups.windows(2).all(|pair| pair[0] < pair[1]), "{groups:?}");
                assert!(groups.len() as u64 >= (10 * every + 100) / every, "{groups:?}");
                taken.iter().for_each(|number| places[(number % every) as usize] += 1);
            }
            let mean = f64::from(places.iter().sum::<u32>()) / every as f64;
            assert!(places.iter().all(|&n| (f64::from(n) - mean).abs() < 6.0 * mean.sqrt()), "{places:?}");
        }
        assert!(drawn(3, 1, 0..9).eq(0..9));
    }

    #[test]
    fn the_map_given_predicts_by_its_nearest_surfel() {
        let ray =
            Ray { origin_in_world: [1.0, 2.0, 3.0], direction_in_world: [0.0, 1.0, 0.0], range_m: 10.0 };
        let residuals = Residuals {
            first_m: Some(4.0),
            nearest_m: Some(-0.5),
            independent_m: Some(0.25),
            revisited: true,
            ..Residuals::MISS
        };
        let fused = scored_point(&ray, &residuals, (true, Scales::Drive), 7, 1_500_000_000);
        assert_eq!((fused.signed_residual_m, fused.map_range_m, fused.time_s), (0.25, 9.75, 1.5));
        assert_eq!((fused.point_in_world_m, fused.kind, fused.frame), ([1.0, 12.0, 3.0], 2, 7));
        let given = scored_point(&ray, &residuals, (false, Scales::Drive), 7, 0);
        assert_eq!((given.signed_residual_m, given.map_range_m), (-0.5, 10.5));
        let miss = scored_point(&ray, &Residuals::MISS, (true, Scales::Drive), 7, 0);
        assert!(miss.signed_residual_m.is_nan() && miss.map_range_m.is_nan() && miss.kind == 0);
        let not_finite = Residuals { first_m: Some(f64::INFINITY), ..residuals };
        assert!(scored_point(&ray, &not_finite, (true, Scales::Drive), 7, 0).first_residual_m.is_nan());
    }
}
