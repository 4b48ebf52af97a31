//! A scanner measures what casts against each form and the ground give.

use super::*;
use crate::city::block;
use crate::city::blocks::cells_around;
use crate::city::plan::Plan;
use crate::lidar_options::NoReturn;
use crate::parts::solid::Solid;

const PLAN: Plan = Plan { seed: 11 };
const SPEED_M_S: f64 = 12.0;

fn scanner(options: LidarOptions) -> Scanner {
    Scanner::new(Lidar::new(options).unwrap())
}

/// Without noise, every beam a row.
fn exact(beams: usize, azimuth_steps: usize) -> LidarOptions {
    LidarOptions {
        azimuth_steps,
        range_noise_m: 0.0,
        drop_out: 0.0,
        resolution_m: 0.0,
        no_return: NoReturn::Zero,
        ..LidarOptions::with_beams(beams)
    }
}

fn drive() -> CityDrive {
    CityDrive::new(PLAN, 2000.0, 0.3, SPEED_M_S)
}

fn scan(scanner: &Scanner, drive: &CityDrive, index: usize) -> Scan {
    let reach_m = scanner.reach_m(SPEED_M_S);
    let mut blocks = Blocks::new(PLAN);
    blocks.keep_around([drive.place(scanner.stamp_ns(index))].into_iter(), reach_m);
    scanner.scan(drive, &blocks, reach_m, index)
}

/// Where a ray first comes below the ground, in small steps and by bisection.
fn ground_range_m(
    drive: &CityDrive,
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    far_m: f64,
) -> Option<f64> {
    let above = |range_m: f64| {
        let at = origin + direction * range_m;
        at.z - drive.terrain.at(at.x, at.y).0
    };
    let step_m = 0.5;
    let after =
        (1..(far_m / step_m) as usize).map(|k| k as f64 * step_m).find(|&range_m| above(range_m) < 0.0)?;
    let (mut low, mut high) = (after - step_m, after);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        (low, high) = if above(middle) < 0.0 { (low, middle) } else { (middle, high) };
    }
    Some(low)
}

/// The first hit among all solids of all cells in reach and a ring around them, one by one and in doubles.
fn brute_force(
    drive: &CityDrive,
    solids: &[Solid],
    origin: Vector3<f64>,
    direction: Vector3<f64>,
) -> Option<Hit> {
    let ground = ground_range_m(drive, origin, direction, 100.0).map(|range_m| {
        let at = origin + direction * range_m;
        let [x, y] = drive.terrain.at(at.x, at.y).1;
        let cos_incidence = -direction.dot(&Vector3::new(-x, -y, 1.0).normalize());
        Hit { range_m, cos_incidence, reflectivity: GROUND_REFLECTIVITY, surface: Surface::Ground }
    });
    let met = solids.iter().filter_map(|solid| {
        let entry = solid.shape.entry(origin, direction)?;
        let cos_incidence = -entry.normal.dot(&direction);
        let Solid { reflectivity, surface, .. } = *solid;
        Some(Hit { range_m: entry.range_m, cos_incidence, reflectivity, surface })
    });
    met.chain(ground).min_by(|a, b| a.range_m.total_cmp(&b.range_m))
}

#[test]
fn every_beam_meets_what_a_search_through_all_meets() {
    let drive = drive();
    for (beams, index) in [(64, 5), (64, 400), (16, 777), (13, 1201)] {
        let scanner = scanner(exact(beams, 90));
        let scan = scan(&scanner, &drive, index);
        assert_eq!(scan.len(), beams * 90);
        let place = drive.place(scanner.stamp_ns(index));
        let [east, north] = cells_around(place, 110.0);
        let cells = east.flat_map(|i| north.clone().map(move |j| [i, j]));
        let solids: Vec<Solid> = cells.flat_map(|cell| block::build(PLAN, cell)).collect();
        let (mut returns, mut off) = (0, 0);
        for (row, point) in scan.points_in_sensor_m.iter().enumerate() {
            let pose = drive.world_from_body_at(scan.stamp_ns.unwrap() + scan.time_offsets_ns[row]);
            let azimuth = TAU * ((row / beams) as f64 / 90.0) - PI;
            let (sin, cos) = libm::sincos(azimuth);
            let (up, level) = scanner.beams.elevations[row % beams];
            let direction = pose.rotation * Vector3::new(level * cos, level * sin, up);
            let hit = brute_force(&drive, &solids, pose.translation.vector, direction);
            let expected = hit.filter(|hit| scanner.lidar.sees(hit)).map_or(0.0, |hit| hit.range_m);
            let got = Vector3::from(point.map(f64::from)).norm();
            returns += usize::from(expected > 0.0);
            off += usize::from((got - expected).abs() > 1e-3);
        }
        assert!(returns > scan.len() / 2, "{returns} of {} return", scan.len());
        // At edges and where the light just suffices, single precision may decide otherwise.
        assert!(off * 1000 <= scan.len() * 2, "scan {index}: {off} of {} are off", scan.len());
    }
}

#[test]
fn scans_do_not_depend_on_what_else_is_at_hand() {
    let (drive, scanner) =
        (drive(), scanner(LidarOptions { azimuth_steps: 60, ..LidarOptions::with_beams(32) }));
    let reach_m = scanner.reach_m(SPEED_M_S);
    let mut many = Blocks::new(PLAN);
    many.keep_around((0..60).map(|index| drive.place(scanner.stamp_ns(index * 5))), reach_m + 60.0);
    for index in [0, 33, 150, 299] {
        assert_eq!(scanner.scan(&drive, &many, reach_m, index), scan(&scanner, &drive, index));
    }
}

#[test]
fn noise_and_drop_outs_are_as_asked() {
    let drive = drive();
    let quiet = LidarOptions { no_return: NoReturn::Zero, azimuth_steps: 200, ..exact(64, 200) };
    let noisy = LidarOptions { range_noise_m: 0.02, drop_out: 0.05, ..quiet.clone() };
    let [quiet, noisy] = [quiet, noisy].map(|options| scan(&scanner(options), &drive, 50));
    let range_m = |point: &[f32; 3]| Vector3::from(point.map(f64::from)).norm();
    let (mut lost, mut returns, mut squares) = (0.0, 0.0, 0.0);
    for (a, b) in quiet.points_in_sensor_m.iter().zip(&noisy.points_in_sensor_m) {
        if range_m(a) == 0.0 {
            continue;
        }
        returns += 1.0;
        if range_m(b) == 0.0 {
            lost += 1.0;
        } else {
            squares += (range_m(a) - range_m(b)).powi(2);
        }
    }
    assert!((lost / returns - 0.05_f64).abs() < 0.01, "{}", lost / returns);
    let sigma_m: f64 = (squares / (returns - lost)).sqrt();
    assert!((sigma_m - 0.02).abs() < 0.001, "{sigma_m}");
}

#[test]
fn an_instant_sweep_has_no_times_and_points_are_multiples_of_the_resolution() {
    let coarse = LidarOptions { sweep: Sweep::Instant, resolution_m: 0.25, ..LidarOptions::with_beams(16) };
    let scan = scan(&scanner(coarse), &drive(), 20);
    assert!(scan.time_offsets_ns.is_empty() && !scan.is_empty());
    assert!(scan.points_in_sensor_m.as_flattened().iter().all(|c| (c * 4.0).fract() == 0.0));
}
