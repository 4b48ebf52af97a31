use dmp_sensor::{Isometry3, Trajectory, Vector3};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Poses further apart in time than this do not belong together, nanoseconds (10 ms, the usual choice).
const MAX_APART_NS: u64 = 10_000_000;
/// Smallest second singular value relative to the first: below, the places lie on a line.
const MIN_SPREAD: f64 = 1e-9;

/// Why one trajectory cannot be laid upon another.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AlignError {
    /// Too few poses belong together.
    #[error(
        "{found} poses of the two trajectories belong together, 3 are needed: are the stamps of one clock?"
    )]
    TooFewPairs {
        /// Pairs found.
        found: usize,
    },
    /// Without stamps poses go line by line.
    #[error("one trajectory has no stamps, and {reference} poses cannot go with {estimate} line by line")]
    Unpaired {
        /// Poses of the reference.
        reference: usize,
        /// Poses of the estimate.
        estimate: usize,
    },
    /// The places lie on a straight line: the rotation around it is anybody's guess.
    #[error("the places of the {pairs} common poses lie on a straight line: no rotation follows from them")]
    Straight {
        /// Pairs found.
        pairs: usize,
    },
}

/// The rigid transform `reference_from_estimate` that brings the places of the estimate closest to those
/// of the reference, in the least squares sense (Umeyama 1991, eq. 34–43, without the scale).
///
/// Poses belong together when their stamps are nearest to each other and at most 10 ms apart; without
/// stamps, line by line.
///
/// # Errors
/// When fewer than three poses belong together, or their places lie on a line.
pub fn alignment(reference: &Trajectory, estimate: &Trajectory) -> Result<Isometry3<f64>, AlignError> {
    let pairs = pairs(reference, estimate)?;
    if pairs.len() < 3 {
        return Err(AlignError::TooFewPairs { found: pairs.len() });
    }
    let n = pairs.len() as f64;
    let mean =
        |of: fn(&Pair) -> Vector3<f64>| pairs.iter().fold(Vector3::zeros(), |sum, pair| sum + of(pair)) / n;
    let (to, from) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let covariance =
        pairs.iter().fold(Matrix3::zeros(), |sum, (r, e)| sum + (r - to) * (e - from).transpose());
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Err(AlignError::Straight { pairs: pairs.len() });
    };
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    // Compares as false for NaN.
    let spread = svd.singular_values[order[1]] > MIN_SPREAD * svd.singular_values[order[0]];
    if !spread {
        return Err(AlignError::Straight { pairs: pairs.len() });
    }
    let mut signs = Matrix3::identity();
    if u.determinant() * v_t.determinant() < 0.0 {
        signs[(order[2], order[2])] = -1.0;
    }
    let rotation = Rotation3::from_matrix_unchecked(u * signs * v_t);
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Ok(Isometry3::from_parts(Translation3::from(to - rotation * from), rotation))
}

/// Two places of one instant: in the reference and in the estimate.
type Pair = (Vector3<f64>, Vector3<f64>);

fn pairs(reference: &Trajectory, estimate: &Trajectory) -> Result<Vec<Pair>, AlignError> {
    let place = |trajectory: &Trajectory, index: usize| trajectory.poses()[index].translation.vector;
    let (Some(to), Some(from)) = (reference.stamps_ns(), estimate.stamps_ns()) else {
        if reference.len() != estimate.len() {
            return Err(AlignError::Unpaired { reference: reference.len(), estimate: estimate.len() });
        }
        return Ok((0..reference.len()).map(|k| (place(reference, k), place(estimate, k))).collect());
    };
    let nearest = |stamps: &[i64], stamp: i64| {
        let after = stamps.partition_point(|&s| s < stamp);
        let candidates = [after.checked_sub(1), Some(after)].into_iter().flatten();
        candidates.filter(|&k| k < stamps.len()).min_by_key(|&k| stamps[k].abs_diff(stamp))
    };
    let mut pairs = Vec::new();
    for (k, &stamp) in from.iter().enumerate() {
        let Some(other) = nearest(to, stamp) else { continue };
        if to[other].abs_diff(stamp) <= MAX_APART_NS && nearest(from, to[other]) == Some(k) {
            pairs.push((place(reference, other), place(estimate, k)));
        }
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(offset_ns: i64, step: usize, moved: &Isometry3<f64>) -> Trajectory {
        let pose = |k: usize| {
            let t = k as f64;
            let here = Isometry3::translation(4e6 + t, 20.0 * (0.1 * t).sin(), 3.0 * (0.2 * t).cos());
            (k as i64 * 100_000_000 + offset_ns, moved * here)
        };
        Trajectory::stamped((0..100).step_by(step).map(pose).collect()).unwrap().trajectory
    }

    #[test]
    fn a_moved_run_is_moved_back() {
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.2, 2.0);
        let moved = Isometry3::from_parts(Translation3::new(-4e6, 30.0, 5.0), turn);
        let reference = run(0, 1, &Isometry3::identity());
        let found = alignment(&reference, &run(3_000_000, 3, &moved)).unwrap();
        for pose in reference.poses() {
            let back = found * (moved * pose);
            assert!((back.translation.vector - pose.translation.vector).norm() < 1e-6);
        }
    }

    #[test]
    fn what_does_not_belong_together_is_told() {
        let reference = run(0, 1, &Isometry3::identity());
        let other_clock = run(1_000_000_000_000, 1, &Isometry3::identity());
        assert_eq!(alignment(&reference, &other_clock), Err(AlignError::TooFewPairs { found: 0 }));
        let line = |k: i64| (k * 100_000_000, Isometry3::translation(k as f64, 2.0 * k as f64, 0.0));
        let straight = Trajectory::stamped((0..50).map(line).collect()).unwrap().trajectory;
        assert_eq!(alignment(&straight, &straight), Err(AlignError::Straight { pairs: 50 }));
        let unstamped = Trajectory::unstamped(vec![Isometry3::identity(); 7]).unwrap();
        let error = AlignError::Unpaired { reference: 100, estimate: 7 };
        assert_eq!(alignment(&reference, &unstamped), Err(error));
    }
}
