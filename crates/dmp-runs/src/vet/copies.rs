//! Runs that are copies of one estimate: in another frame or format, with the same motion from pose to pose.

use dmp_sensor::Trajectory;

use crate::asked::Run;

/// Steps of copies differ by no more than files round: metres and radians, root of the mean square.
const SAME_M: f64 = 1e-3;
const SAME_RAD: f64 = 1e-4;
/// As many steps of each run are compared at most.
const STEPS: usize = 1000;

/// Lengths and angles of steps, which no frame changes.
fn steps(trajectory: &Trajectory) -> impl Iterator<Item = [f64; 2]> + '_ {
    let poses = trajectory.poses();
    let every = (poses.len() / STEPS).max(1);
    poses.windows(2).step_by(every).map(|pair| {
        let step = pair[0].inv_mul(&pair[1]);
        [step.translation.vector.norm(), step.rotation.angle()]
    })
}

fn are_copies(a: &Trajectory, b: &Trajectory) -> bool {
    if a.len() != b.len() || a.len() < 3 {
        return false;
    }
    let (mut squares, mut count) = ([0.0; 2], 0.0);
    for (one, other) in steps(a).zip(steps(b)) {
        for k in 0..2 {
            squares[k] += (one[k] - other[k]) * (one[k] - other[k]);
        }
        count += 1.0;
    }
    (squares[0] / count).sqrt() < SAME_M && (squares[1] / count).sqrt() < SAME_RAD
}

/// Groups of runs: each run is in one, with its copies.
pub(super) fn groups(runs: &[Run]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let first = |group: &&mut Vec<usize>| are_copies(&runs[group[0]].trajectory, &run.trajectory);
        match groups.iter_mut().find(first) {
            Some(group) => group.push(number),
            None => groups.push(vec![number]),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::{Isometry3, Vector3};

    #[test]
    fn a_run_in_another_frame_is_a_copy_and_another_run_is_not() {
        let pose = |k: usize| {
            let s = k as f64;
            Isometry3::new(Vector3::new(s, 0.1 * s * s, 0.0), Vector3::new(0.0, 0.0, 0.05 * s))
        };
        let world = Isometry3::new(Vector3::new(500.0, -7.0, 3.0), Vector3::new(0.1, 0.2, 2.0));
        let run = |name: &str, of: &dyn Fn(usize) -> Isometry3<f64>| {
            Run::new(name, Trajectory::unstamped((0..50).map(of).collect()).unwrap())
        };
        let runs = [
            run("a", &pose),
            run("in another frame", &|k| world * pose(k)),
            run("noise", &|k| pose(k) * Isometry3::translation(0.01 * (k as f64).sin(), 0.0, 0.0)),
            run("rounded", &|k| Isometry3::translation(4e-4 * (7.0 * k as f64).sin(), 0.0, 0.0) * pose(k)),
        ];
        assert_eq!(groups(&runs), [vec![0, 1, 3], vec![2]]);
    }
}
