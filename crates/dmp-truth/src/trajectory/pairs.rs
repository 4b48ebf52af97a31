//! Which pairs of poses a relative error is taken over.

use super::path::turn_between;
use super::rotation::{angle_of_quaternion_rad, to_quaternion};
use super::{CompareError, DeltaUnit, Pose};

/// With all pairs: how far a pair may be from the distance asked for, as a share of it (the default of evo).
pub const DELTA_TOLERANCE: f64 = 0.1;

/// How far apart the poses of a pair are, and which pairs there are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairOptions {
    /// The distance of a pair, in `unit`.
    pub delta: f64,
    /// Unit of `delta`.
    pub unit: DeltaUnit,
    /// A pair from every pose, not only from where the last pair ended.
    pub all_pairs: bool,
}

impl Default for PairOptions {
    fn default() -> Self {
        Self { delta: 1.0, unit: DeltaUnit::Frames, all_pairs: false }
    }
}

impl PairOptions {
    /// # Errors
    /// When `delta` is negative, not whole though frames are counted, or no angle between 0 and half a turn.
    pub fn check(&self) -> Result<(), CompareError> {
        let Self { delta, unit, .. } = *self;
        let good = delta >= 0.0
            && match unit {
                DeltaUnit::Frames => delta == delta.trunc() && (delta >= 1.0 || self.all_pairs),
                DeltaUnit::Meters => delta.is_finite(),
                DeltaUnit::Degrees => delta <= 180.0,
                DeltaUnit::Radians => delta <= std::f64::consts::PI,
            };
        if good { Ok(()) } else { Err(CompareError::Delta { delta, unit }) }
    }
}

/// The pairs `(i, j)`, `i <= j`, of indices of poses.
///
/// # Errors
/// When `options` are wrong, there are no pairs, or a rotation that is needed is none.
pub fn pairs(poses: &[Pose], options: &PairOptions) -> Result<Vec<(usize, usize)>, CompareError> {
    options.check()?;
    let PairOptions { delta, unit, all_pairs } = *options;
    let tolerance = delta * DELTA_TOLERANCE;
    let found = match (unit, all_pairs) {
        (DeltaUnit::Frames, _) => by_index(poses.len(), delta as usize, all_pairs),
        (DeltaUnit::Meters, false) => by_distance(poses, delta),
        (DeltaUnit::Meters, true) => all_by_distance(&path_lengths_m(poses), delta, tolerance),
        (DeltaUnit::Degrees, false) => by_turn(poses, delta.to_radians())?,
        (DeltaUnit::Radians, false) => by_turn(poses, delta)?,
        (DeltaUnit::Degrees, true) => all_by_turn(poses, delta.to_radians(), tolerance.to_radians())?,
        (DeltaUnit::Radians, true) => all_by_turn(poses, delta, tolerance)?,
    };
    if found.is_empty() { Err(CompareError::NoPairs { delta, unit }) } else { Ok(found) }
}

fn by_index(count: usize, delta: usize, all_pairs: bool) -> Vec<(usize, usize)> {
    let step = if all_pairs { 1 } else { delta };
    (0..count)
        .step_by(step)
        .map_while(|i| i.checked_add(delta).filter(|&j| j < count).map(|j| (i, j)))
        .collect()
}

fn step_m(from: &Pose, to: &Pose) -> f64 {
    (to.position_m - from.position_m).norm()
}

fn path_lengths_m(poses: &[Pose]) -> Vec<f64> {
    let mut travelled_m = 0.0;
    let steps = poses.windows(2).map(|pair| step_m(&pair[0], &pair[1]));
    let lengths = steps.map(|step| {
        travelled_m += step;
        travelled_m
    });
    std::iter::once(0.0).chain(lengths).collect()
}

/// Pairs one behind the other: a pair ends with the pose at which the path length since its start reaches
/// `delta_m`, and the next starts there.
fn by_distance(poses: &[Pose], delta_m: f64) -> Vec<(usize, usize)> {
    let steps = poses.windows(2).map(|pair| Ok(step_m(&pair[0], &pair[1])));
    accumulate(steps, delta_m).unwrap_or_default()
}

/// As [`by_distance`], for the turns between neighbours, which add up.
fn by_turn(poses: &[Pose], delta_rad: f64) -> Result<Vec<(usize, usize)>, CompareError> {
    accumulate((1..poses.len()).map(|k| turn_between(poses, k - 1, k)), delta_rad)
}

fn accumulate(
    steps: impl Iterator<Item = Result<f64, CompareError>>,
    delta: f64,
) -> Result<Vec<(usize, usize)>, CompareError> {
    let (mut start, mut since_start) = (0, 0.0);
    let mut found = Vec::new();
    for (step, end) in steps.zip(1..) {
        since_start += step?;
        if since_start >= delta {
            found.push((start, end));
            (start, since_start) = (end, 0.0);
        }
    }
    Ok(found)
}

/// From every pose the later one whose path length from it is nearest to `delta_m` (the first of several), if
/// that is near enough. What is left to `delta_m` only grows along the path, so its change of sign is
/// found by bisection: `O(n log n)`.
fn all_by_distance(path_lengths_m: &[f64], delta_m: f64, tolerance_m: f64) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    for (i, &here_m) in path_lengths_m.iter().enumerate() {
        let later = &path_lengths_m[i + 1..];
        let beyond = |travelled_m: f64| (travelled_m - here_m) - delta_m;
        let reached = later.partition_point(|&travelled_m| beyond(travelled_m) < 0.0);
        let short = reached.checked_sub(1).map(|last| beyond(later[last]));
        let far = later.get(reached).map(|&travelled_m| beyond(travelled_m));
        let (index, off_m) = match (short, far) {
            (Some(short), far) if far.is_none_or(|far| -short <= far) => {
                (later.partition_point(|&travelled_m| beyond(travelled_m) < short), -short)
            }
            (_, Some(far)) => (reached, far),
            _ => continue,
        };
        if off_m <= tolerance_m {
            found.push((i, i + 1 + index));
        }
    }
    found
}

/// All pairs whose direct turn is within `delta_rad ± tolerance_rad`. Every pair is looked at, but only
/// those near a bound need the angle itself: for the others the product of their quaternions decides.
fn all_by_turn(
    poses: &[Pose],
    delta_rad: f64,
    tolerance_rad: f64,
) -> Result<Vec<(usize, usize)>, CompareError> {
    let (low, high) = (delta_rad - tolerance_rad, delta_rad + tolerance_rad);
    if let Some(index) = poses.iter().position(|pose| pose.rotation.determinant() <= 0.0) {
        return Err(CompareError::NotARotation { index });
    }
    let quaternions: Vec<[f64; 4]> = poses.iter().map(|pose| to_quaternion(&pose.rotation)).collect();
    // |cos(angle / 2)| falls with the angle; rounding is far below the margin.
    let cosine = |angle_rad: f64| libm::cos(angle_rad.clamp(0.0, std::f64::consts::PI) / 2.0);
    let margin = 1e-12;
    let (surely_above, surely_below) = (cosine(low), cosine(high));
    let mut found = Vec::new();
    for (i, a) in quaternions.iter().enumerate() {
        for (j, b) in quaternions.iter().enumerate().skip(i + 1) {
            let dot = (a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]).abs();
            if dot > surely_above + margin || dot < surely_below - margin {
                continue;
            }
            let surely_in = dot < surely_above - margin && dot > surely_below + margin;
            if surely_in || (low..=high).contains(&angle_of_quaternion_rad(&relative(a, b))) {
                found.push((i, j));
            }
        }
    }
    Ok(found)
}

/// `a⁻¹ b` of unit quaternions `(x, y, z, w)`.
fn relative(a: &[f64; 4], b: &[f64; 4]) -> [f64; 4] {
    let ([ax, ay, az, aw], [bx, by, bz, bw]) = ([-a[0], -a[1], -a[2], a[3]], *b);
    [
        aw * bx + bw * ax + (ay * bz - az * by),
        aw * by + bw * ay + (az * bx - ax * bz),
        aw * bz + bw * az + (ax * by - ay * bx),
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    fn at(x: f64, yaw_deg: f64) -> Pose {
        Pose {
            rotation: Rotation3::from_euler_angles(0.0, 0.0, yaw_deg.to_radians()).into_inner(),
            position_m: Vector3::new(x, 0.0, 0.0),
        }
    }

    fn options(delta: f64, unit: DeltaUnit, all_pairs: bool) -> PairOptions {
        PairOptions { delta, unit, all_pairs }
    }

    #[test]
    fn frames_are_counted() {
        let poses = [at(0.0, 0.0); 6];
        let of = |delta, all| pairs(&poses, &options(delta, DeltaUnit::Frames, all)).unwrap();
        assert_eq!(of(2.0, false), [(0, 2), (2, 4)]);
        assert_eq!(of(4.0, true), [(0, 4), (1, 5)]);
        assert_eq!(of(0.0, true).len(), 6);
        for (delta, all) in
            [(6.0, false), (6.0, true), (0.0, false), (1.5, true), (-1.0, false), (f64::NAN, true)]
        {
            assert!(pairs(&poses, &options(delta, DeltaUnit::Frames, all)).is_err(), "{delta}");
        }
    }

    #[test]
    fn way_and_turn_add_up_and_start_again() {
        let poses = [0.0, 1.0, 3.0, 2.0, 2.5, 9.0, 9.5].map(|x| at(x, 10.0 * x));
        let of = |delta, unit| pairs(&poses, &options(delta, unit, false)).unwrap();
        // Distances between neighbours: 1, 2, 1, 0.5, 6.5, 0.5.
        assert_eq!(of(3.0, DeltaUnit::Meters), [(0, 2), (2, 5)]);
        assert_eq!(of(29.9, DeltaUnit::Degrees), [(0, 2), (2, 5)]);
        assert_eq!(of(0.5, DeltaUnit::Radians), [(0, 2), (2, 5)]);
        assert!(pairs(&poses, &options(181.0, DeltaUnit::Degrees, false)).is_err());
        let too_long = pairs(&poses, &options(100.0, DeltaUnit::Meters, false));
        assert_eq!(too_long, Err(CompareError::NoPairs { delta: 100.0, unit: DeltaUnit::Meters }));
    }

    #[test]
    fn bisection_finds_what_a_search_through_all_finds() {
        let mut state = 5_u64;
        for round in 0..300 {
            // Quarters and standstills: ties and plateaus.
            let mut lengths_m = vec![0.0];
            for _ in 0..round % 40 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                lengths_m.push(lengths_m[lengths_m.len() - 1] + ((state >> 40) % 4) as f64 * 0.25);
            }
            for (delta, tolerance) in [(0.0, 0.0), (1.0, 0.25), (1.1, 0.05), (2.0, 100.0), (0.625, 0.125)] {
                let mut brute = Vec::new();
                for i in 0..lengths_m.len() {
                    let mut best: Option<(f64, usize)> = None;
                    for j in i + 1..lengths_m.len() {
                        let off = ((lengths_m[j] - lengths_m[i]) - delta).abs();
                        if best.is_none_or(|(least, _)| off < least) {
                            best = Some((off, j));
                        }
                    }
                    brute.extend(best.filter(|(off, _)| *off <= tolerance).map(|(_, j)| (i, j)));
                }
                assert_eq!(
                    all_by_distance(&lengths_m, delta, tolerance),
                    brute,
                    "round {round} delta {delta}"
                );
            }
        }
    }

    #[test]
    fn every_pair_of_the_right_turn_is_found() {
        let poses: Vec<Pose> = (0..60)
            .map(|k| {
                let k = f64::from(k);
                let rotation = Rotation3::from_euler_angles(0.1 * k, 0.05 * k * k, 1.3 * k).into_inner();
                Pose { rotation, position_m: Vector3::zeros() }
            })
            .collect();
        for (delta, tolerance) in [(0.0, 0.0), (0.5, 0.05), (1.5, 0.3), (3.0, 0.3), (3.1, 1.0)] {
            let mut brute = Vec::new();
            for i in 0..poses.len() {
                for j in i + 1..poses.len() {
                    let turn = turn_between(&poses, i, j).unwrap();
                    if turn >= delta - tolerance && turn <= delta + tolerance {
                        brute.push((i, j));
                    }
                }
            }
            assert_eq!(all_by_turn(&poses, delta, tolerance).unwrap(), brute);
        }
    }
}
