//! What the drives and their estimates are like, in numbers.

use std::time::Instant;

use dmp_sensor::Vector3;
use dmp_sim::{Recording, Surface};

use super::drives::DriveSpec;
use super::estimates::{ate_m, estimates};

/// Every so many scans, the surfaces of the returns are looked up.
const EVERY: usize = 20;
const SURFACES: [Surface; 7] = [
    Surface::Ground,
    Surface::Building,
    Surface::Stairs,
    Surface::Pole,
    Surface::Plant,
    Surface::ParkedCar,
    Surface::MovingCar,
];

/// Simulates a drive and tells its size, what its returns lie on, and the error of each estimate.
pub(super) fn print(spec: &DriveSpec) -> anyhow::Result<()> {
    let town = spec.town()?;
    let recording = Recording::new(&town, &spec.options)?;
    let drive = recording.drive();
    let (travel_m, revisits) = recording.travel_and_revisits();
    let start = Instant::now();
    let (mut returns, mut on) = (0, [0_usize; SURFACES.len()]);
    for (n, scan) in recording.scans().enumerate() {
        returns += scan.len();
        let (Some(stamp_ns), true) = (scan.stamp_ns, n % EVERY == 0) else { continue };
        for (point, offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            let at_ns = stamp_ns + offset_ns;
            let pose = drive.world_from_body_at(at_ns);
            let bearing = pose.rotation * Vector3::from(point.map(f64::from)).normalize();
            let time_s = (at_ns - drive.options().start_ns) as f64 * 1e-9;
            let hit = town.cast(pose.translation.vector, bearing, time_s);
            if let Some(k) = hit.and_then(|hit| SURFACES.iter().position(|&surface| surface == hit.surface)) {
                on[k] += 1;
            }
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{} ({:?}): {}; {travel_m:.0} m, {} scans, {returns} returns, {:.0} % revisits, {seconds:.1} s",
        spec.name,
        spec.half,
        spec.about,
        recording.len(),
        revisits * 100.0,
    );
    let all = on.iter().sum::<usize>().max(1) as f64;
    let shares = SURFACES.iter().zip(on).filter(|(_, count)| *count > 0);
    let shares = shares.map(|(surface, count)| format!("{surface:?} {:.1} %", 100.0 * count as f64 / all));
    println!("  returns on {}", shares.collect::<Vec<_>>().join(", "));
    let truth = spec.truth(&recording)?;
    for estimate in estimates(spec, &truth)? {
        let ate_m = ate_m(&estimate.trajectory, &truth)?;
        println!("  {:<18} {:<10} ATE {ate_m:.3} m", estimate.name, format!("{:?}", estimate.kind));
    }
    Ok(())
}
