//! What `dmp drift` measures on every other scan of a log is what it measures on the rest.

use dmp::{Config, DriftPairs, DriftReport, Run, VisitPairReport, measure_drift};
use dmp_log::{MemoryLog, ScanLog};
use dmp_sensor::{Scan, Trajectory};

use crate::common::{dmp, open, real_data, text};

/// Every `step`-th scan from the `first` on, each with the stamp of the pose in its line.
fn some(log: &dyn ScanLog, run: &Trajectory, first: usize, step: usize) -> MemoryLog {
    let stamps_ns = run.stamps_ns().unwrap();
    let mut reader = log.reader().unwrap();
    let taken = (first..log.frames().len()).step_by(step).map(|frame| {
        let mut scan = Scan::default();
        reader.read(frame, &mut scan).unwrap();
        Scan { stamp_ns: Some(stamps_ns[frame]), ..scan }
    });
    MemoryLog::new("some", taken.collect()).unwrap()
}

fn measured(log: &dyn ScanLog, runs: &[Run], every: usize) -> DriftReport {
    let config = Config { drift: DriftPairs::All, every, ..Config::default() };
    measure_drift(log, runs, &config, ()).unwrap()
}

/// How far the stamps of two pairs of visits are from each other, nanoseconds.
fn between_ns(a: &VisitPairReport, b: &VisitPairReport) -> u64 {
    let ns = |a: Option<i64>, b: Option<i64>| a.unwrap().abs_diff(b.unwrap());
    ns(a.first.stamp_ns, b.first.stamp_ns) + ns(a.second.stamp_ns, b.second.stamp_ns)
}

/// The parts of the displacement, along, sideways and upwards, that both reports know of the same places: by how much they
/// differ, metres, and their standard deviation.
fn differences(a: &DriftReport, b: &DriftReport, most_ns: u64) -> Vec<[f64; 2]> {
    let mut differences = Vec::new();
    for pair in &a.visits {
        let Some(same) = b.visits.iter().min_by_key(|other| between_ns(pair, other)) else { continue };
        let (Some(a), Some(b)) = (pair.runs[0].off, same.runs[0].off) else { continue };
        if between_ns(pair, same) > most_ns {
            continue;
        }
        let parts = [(a.along_m, b.along_m), (a.sideways_m, b.sideways_m), (a.up_m, b.up_m)];
        for (k, (a_m, b_m)) in parts.into_iter().enumerate() {
            let Some((a_m, b_m)) = a_m.zip(b_m) else { continue };
            differences.push([(a_m - b_m).abs(), a.sigma_m[k].hypot(b.sigma_m[k])]);
        }
    }
    differences.sort_by(|a, b| a[0].total_cmp(&b[0]));
    differences
}

/// Thin scans a metre apart: half of them see half as much, and both halves say the same of the run, pair by pair within what
/// they say of themselves and mostly to a centimetre.
#[test]
fn odd_and_even_scans_of_a_real_run_say_the_same() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let log = open(&data);
    let odometry = dmp_log::read_trajectory(&data.join("poses_lidar_odometry.txt")).unwrap().trajectory;
    let run = Run::new("odometry", odometry);
    let [even, odd, all] = [(0, 2), (1, 2), (0, 1)].map(|(first, step)| {
        measured(&some(log.as_ref(), &run.trajectory, first, step), std::slice::from_ref(&run), 1)
    });
    let rms_m = [&even, &odd, &all].map(|report| report.runs[0].rms_m.value.unwrap());
    println!("RMS of even, odd and all scans: {rms_m:?} m");
    // A centimetre is what is wanted of all three. The odd ones, of which a visit has three or four, miss it.
    let [even_m, odd_m, all_m] = rms_m;
    assert!((even_m - all_m).abs() < 0.01 && (odd_m - all_m).abs() < 0.01, "{rms_m:?}");
    assert!((even_m - odd_m).abs() < 0.02, "{rms_m:?}");
    // Visits are a few scans apart, as their middle one is in one half only.
    for (name, other) in [("odd", &odd), ("all", &all)] {
        let differences = differences(&even, other, 12_000_000_000);
        println!("even and {name}: difference and deviation, m: {differences:.4?}");
        let median_m = differences[differences.len() / 2][0];
        assert!(differences.len() >= 6 && median_m < 0.01, "{name}: {median_m} m of {}", differences.len());
        assert!(differences.iter().all(|[off_m, sigma_m]| *off_m < 3.0 * sigma_m), "{differences:?}");
    }
}

/// A camera comes back in a room: half of its images say the same of a run as the rest, pair by pair to a centimetre, and a run that is
/// measured by itself is off by as much as beside others, where it starts from what these claim too.
#[test]
fn odd_and_even_images_of_a_room_say_the_same_also_from_the_starts_of_other_runs() {
    let folder = tempfile::tempdir().unwrap();
    let made = dmp(folder.path(), "simulate room --size 320x240 -q -o room");
    assert_eq!(made.status.code(), Some(0), "{}", text(&made.stderr));
    let room = folder.path().join("room");
    let run = |name: &str| {
        let file = room.join("estimates").join(format!("{name}.txt"));
        Run::new(name, dmp_log::read_trajectory(&file).unwrap().trajectory)
    };
    let [good, odometry] = ["good", "odometry"].map(run);
    let alone = |run: &Run, every: usize| measured(open(&room).as_ref(), std::slice::from_ref(run), every);
    let (all, even) = (alone(&good, 1), alone(&good, 2));
    let beside = measured(open(&room).as_ref(), &[good.clone(), odometry], 1);
    // Without its first line the list begins with the odd images.
    let list = std::fs::read_to_string(room.join("depth.txt")).unwrap();
    let first = list.lines().find(|line| !line.starts_with('#')).unwrap();
    std::fs::write(room.join("depth.txt"), list.replace(&format!("{first}\n"), "")).unwrap();
    let odd = alone(&good, 2);
    for (what, other) in [("odd and even", &odd), ("all and even", &all)] {
        let differences = differences(&even, other, 200_000_000);
        println!("{what} images: difference and deviation, m: {differences:.4?}");
        assert!(differences.len() >= 3, "{what}: {differences:?}");
        assert!(differences.iter().all(|[off_m, _]| *off_m < 0.01), "{what}: {differences:?}");
    }
    let differences = differences(&all, &beside, 200_000_000);
    println!("alone and beside another run: {differences:.4?}");
    assert!(differences.len() >= 3 && differences.iter().all(|[off_m, _]| *off_m < 0.005), "{differences:?}");
}
