//! The estimates of each drive: the truth, and twenty wrong trajectories of known kind.

use anyhow::Context as _;
use dmp_log::read_trajectory;
use dmp_sensor::Trajectory;
use dmp_sim::{Noise, Scenery, SimError, SlamErrors, ate_rmse_m, close_loop};

use super::drives::DriveSpec;

/// The two configurations of the odometry whose runs lie in `xtask/odometry`.
pub(super) const ODOMETRY: [&str; 2] = ["default", "coarse"];

/// What is wrong with an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum EstimateKind {
    /// Nothing.
    Truth,
    /// White noise of every scan's pose.
    Noise,
    /// Smooth drift.
    Drift,
    /// Drift whose end was pulled back to the truth.
    LoopClosed,
    /// Two distinct places mapped onto each other.
    FalseLoop,
    /// A stretch of the path lost.
    Collapsed,
    /// All distances too long.
    Scale,
    /// The whole bent upwards.
    Bend,
    /// Drift and noise.
    Mixed,
    /// What an odometry made of the scans.
    Odometry,
}

/// A trajectory to be scored.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Estimate {
    /// Its kind and size.
    pub(super) name: String,
    /// What is wrong with it.
    pub(super) kind: EstimateKind,
    /// The poses.
    pub(super) trajectory: Trajectory,
}

/// All estimates of a drive, the truth first. The same drive gives the same estimates, to the bit.
pub(super) fn estimates(spec: &DriveSpec, truth: &Trajectory) -> anyhow::Result<Vec<Estimate>> {
    let mut estimates = simulated(spec, truth)?;
    // None is kept of drives whose places look alike.
    let kept = if spec.scenery == Scenery::default() { &ODOMETRY[..] } else { &[] };
    for config in kept {
        estimates.push(Estimate {
            name: format!("odometry-{config}"),
            kind: EstimateKind::Odometry,
            trajectory: odometry(spec, config, truth)?,
        });
    }
    Ok(estimates)
}

/// Those that are made from the truth.
pub(super) fn simulated(spec: &DriveSpec, truth: &Trajectory) -> anyhow::Result<Vec<Estimate>> {
    let mut made = Making { spec, truth, estimates: Vec::new() };
    made.keep("truth".into(), EstimateKind::Truth, truth.clone());
    for (sigma_m, sigma_deg) in [(0.01, 0.05), (0.03, 0.1), (0.1, 0.3), (0.3, 1.0)] {
        let noise = Some(made.noise(sigma_m, sigma_deg));
        made.wrong(format!("noise-{sigma_m}m"), EstimateKind::Noise, &SlamErrors { noise, ..made.errors() })?;
    }
    for ate_m in [0.1, 0.3, 1.0, 3.0] {
        let errors = SlamErrors { drift_ate_m: Some(ate_m), ..made.errors() };
        made.wrong(format!("drift-{ate_m}m"), EstimateKind::Drift, &errors)?;
    }
    made.largest_drift(&[10.0, 6.0, 4.0])?;
    for ate_m in [1.0, 3.0] {
        let drifted = SlamErrors { drift_ate_m: Some(ate_m), ..made.errors() }.apply(truth)?;
        made.keep(format!("closed-{ate_m}m"), EstimateKind::LoopClosed, close_loop(&drifted, truth)?);
    }
    for jump_m in [10.0, 30.0] {
        let errors = SlamErrors { false_loop_m: Some(jump_m), ..made.errors() };
        made.wrong(format!("false-loop-{jump_m}m"), EstimateKind::FalseLoop, &errors)?;
    }
    for share in [0.1, 0.3] {
        let errors = SlamErrors { collapse_share: Some(share), ..made.errors() };
        made.wrong(format!("collapsed-{share}"), EstimateKind::Collapsed, &errors)?;
    }
    made.wrong("scale-1.01".into(), EstimateKind::Scale, &SlamErrors { scale: Some(1.01), ..made.errors() })?;
    made.wrong("bend-2m".into(), EstimateKind::Bend, &SlamErrors { bend_m: Some(2.0), ..made.errors() })?;
    let noise = Some(made.noise(0.03, 0.1));
    let mixed = SlamErrors { drift_ate_m: Some(0.3), noise, ..made.errors() };
    made.wrong("mixed-0.3m".into(), EstimateKind::Mixed, &mixed)?;
    Ok(made.estimates)
}

/// Estimates in the making.
struct Making<'a> {
    spec: &'a DriveSpec,
    truth: &'a Trajectory,
    estimates: Vec<Estimate>,
}

impl Making<'_> {
    /// No errors yet, with a seed for the next estimate alone: no two drifts bend alike.
    fn errors(&self) -> SlamErrors {
        SlamErrors {
            seed: self.spec.options.seed * 100 + self.estimates.len() as u64,
            ..SlamErrors::default()
        }
    }

    fn noise(&self, sigma_m: f64, sigma_deg: f64) -> Noise {
        Noise { sigma_m, sigma_rad: sigma_deg.to_radians(), interval_ns: self.spec.scan_period_ns() }
    }

    fn keep(&mut self, name: String, kind: EstimateKind, trajectory: Trajectory) {
        self.estimates.push(Estimate { name, kind, trajectory });
    }

    fn wrong(&mut self, name: String, kind: EstimateKind, errors: &SlamErrors) -> anyhow::Result<()> {
        let wrong = errors.apply(self.truth).with_context(|| format!("{}: {name}", self.spec.name))?;
        self.keep(name, kind, wrong);
        Ok(())
    }

    /// The first of these drifts, largest first, that the drive is long enough for.
    fn largest_drift(&mut self, ates_m: &[f64]) -> anyhow::Result<()> {
        for &ate_m in ates_m {
            let errors = SlamErrors { drift_ate_m: Some(ate_m), ..self.errors() };
            match errors.apply(self.truth) {
                Ok(wrong) => {
                    self.keep(format!("drift-{ate_m}m"), EstimateKind::Drift, wrong);
                    return Ok(());
                }
                Err(SimError::DriftNotReached { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        anyhow::bail!("{}: none of the drifts of {ates_m:?} m is reached", self.spec.name)
    }
}

/// The kept run of an odometry, moved so that its first pose is the true one: an odometry starts anywhere.
pub(super) fn odometry(spec: &DriveSpec, config: &str, truth: &Trajectory) -> anyhow::Result<Trajectory> {
    let file = format!("xtask/odometry/{}-{config}.tum", spec.name);
    let path = crate::workspace::root().join(file);
    let run = read_trajectory(&path)
        .context("a run of the odometry is missing; xtask/odometry/README.md says how to make it")?
        .trajectory;
    let (Some(stamps_ns), Some(first)) = (run.stamps_ns(), run.poses().first()) else {
        anyhow::bail!("{}: the run has no stamps", path.display());
    };
    let Some(true_first) = truth.world_from_body_at(stamps_ns[0], i64::MAX) else {
        anyhow::bail!("{}: the first stamp, {} ns, is not within the drive", path.display(), stamps_ns[0]);
    };
    let motion = true_first * first.inverse();
    let poses = stamps_ns.iter().copied().zip(run.poses().iter().map(|pose| motion * pose));
    Ok(Trajectory::stamped(poses.collect())?.trajectory)
}

/// Absolute trajectory error of an estimate against the truth at the estimate's own stamps, metres.
pub(super) fn ate_m(estimate: &Trajectory, truth: &Trajectory) -> anyhow::Result<f64> {
    let stamps_ns = estimate.stamps_ns().context("an estimate has stamps")?;
    let common = stamps_ns.iter().zip(estimate.poses()).filter_map(|(&stamp_ns, pose)| {
        Some(((stamp_ns, *pose), (stamp_ns, truth.world_from_body_at(stamp_ns, i64::MAX)?)))
    });
    let (ours, theirs) = common.unzip();
    Ok(ate_rmse_m(&Trajectory::stamped(ours)?.trajectory, &Trajectory::stamped(theirs)?.trajectory))
}

#[cfg(test)]
mod tests {
    use super::super::drives::drives;
    use super::*;
    use dmp_sim::Recording;
    use std::collections::BTreeSet;

    fn truth(spec: &DriveSpec) -> Trajectory {
        let town = spec.town().unwrap();
        spec.truth(&Recording::new(&town, &spec.options).unwrap()).unwrap()
    }

    #[test]
    fn errors_are_of_the_size_in_their_names() {
        for spec in drives() {
            let truth = truth(&spec);
            let made = simulated(&spec, &truth).unwrap();
            assert_eq!(made, simulated(&spec, &truth).unwrap());
            let names: BTreeSet<_> = made.iter().map(|estimate| &estimate.name).collect();
            assert_eq!((made.len(), names.len()), (19, 19));
            for Estimate { name, kind, trajectory } in &made {
                let ate_m = ate_m(trajectory, &truth).unwrap();
                let size = name.trim_end_matches('m').rsplit('-').next().and_then(|size| size.parse().ok());
                let asked: f64 = size.unwrap_or(0.0);
                let expected = match kind {
                    EstimateKind::Truth => 0.0..1e-9,
                    // Three axes.
                    EstimateKind::Noise => asked * 1.6..asked * 1.9,
                    EstimateKind::Drift => asked * 0.99..asked * 1.01,
                    EstimateKind::Mixed => asked * 0.99..asked * 1.05,
                    EstimateKind::LoopClosed => 0.03..asked * 1.2,
                    _ => 0.05..100.0,
                };
                assert!(expected.contains(&ate_m), "{}: {name} has an ATE of {ate_m} m", spec.name);
                assert_eq!(trajectory.stamps_ns(), truth.stamps_ns());
                if *kind == EstimateKind::LoopClosed {
                    let [ours, theirs] = [trajectory, &truth].map(|run| *run.poses().last().unwrap());
                    assert!(ours.inv_mul(&theirs).translation.vector.norm() < 1e-7);
                }
            }
        }
    }
    #[test]
    fn the_odometry_was_run_on_every_drive_and_starts_where_the_drive_does() {
        for spec in drives() {
            let truth = truth(&spec);
            let start_ns = truth.stamps_ns().unwrap()[0];
            let made = estimates(&spec, &truth).unwrap();
            let runs: Vec<_> =
                made.iter().filter(|estimate| estimate.kind == EstimateKind::Odometry).collect();
            assert_eq!((made.len(), runs.len()), (21, 2));
            for Estimate { name, trajectory, .. } in runs {
                let stamps_ns = trajectory.stamps_ns().unwrap();
                let scan = |stamp_ns: &i64| (stamp_ns - start_ns).div_euclid(spec.scan_period_ns());
                let scans: BTreeSet<_> = stamps_ns.iter().map(scan).collect();
                let covered = scans.range(0..spec.options.scans as i64).count();
                assert!(covered * 100 >= spec.options.scans * 95, "{} {name}: {covered} scans", spec.name);
                let first = truth.world_from_body_at(stamps_ns[0], i64::MAX).unwrap();
                assert!(first.inv_mul(&trajectory.poses()[0]).translation.vector.norm() < 1e-6);
            }
            let [fine, poor] = ODOMETRY.map(|config| odometry(&spec, config, &truth).unwrap());
            assert_ne!(fine.poses(), poor.poses());
        }
    }
}
