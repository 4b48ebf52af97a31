//! Points in = points used + points dropped, for a reason each.

use dmp::{Config, Run, evaluate};
use dmp_sensor::{Isometry3, Scan, Trajectory};

use crate::common::{open, plain, small_town, write_mcap};

#[test]
fn every_return_is_accounted_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (mut scans, truth) = small_town(40, 90);
    let nan = f32::NAN;
    for scan in &mut scans {
        let mut add = |point: [f32; 3]| {
            scan.points_in_sensor_m.push(point);
            scan.time_offsets_ns.push(1000);
        };
        [[nan, 1.0, 1.0], [1.0, f32::INFINITY, 0.0]].into_iter().for_each(&mut add);
        [[0.0; 3], [-0.0, 0.0, 0.0], [0.0; 3]].into_iter().for_each(&mut add);
        add([0.5, 0.5, 0.1]);
        [[300.0, 0.0, 0.0], [0.0, 0.0, f32::MAX], [100.1, 0.0, 0.0], [-99.0, 40.0, 0.0]]
            .into_iter()
            .for_each(&mut add);
    }
    // A return long after its scan, and scans after the end of the trajectory.
    scans[18].points_in_sensor_m.push([5.0, 5.0, 0.0]);
    scans[18].time_offsets_ns.push(4_000_000_000);
    let stamps_ns = truth.stamps_ns().unwrap();
    let half = stamps_ns.len() / 2;
    let poses = stamps_ns.iter().copied().zip(truth.poses().iter().copied());
    let half_run = Trajectory::stamped(poses.take(half).collect()).unwrap().trajectory;
    write_mcap(&path, &scans);

    let log = open(&path);
    let runs = [Run::new("whole", truth.clone()), Run::new("half", half_run)];
    let ego = dmp::Ego::BoxMm([-3000, 0, -3000], [3000, 6000, 0]);
    let config = Config { every: 3, ego, per_tile: true, ..plain() };
    let report = evaluate(log.as_ref(), &runs, &config, ()).unwrap();
    let inputs = &report.inputs;
    let total: u64 = scans.iter().map(|scan| scan.len() as u64).sum();
    assert_eq!(inputs.returns, total);
    assert_eq!(inputs.returns_used + inputs.dropped.0.values().sum::<u64>(), total);

    let used_scans = inputs.scans_used as u64;
    assert_eq!(inputs.scans_used, scans.len().div_ceil(3));
    assert_eq!(inputs.dropped.0["non_finite"], 2 * used_scans);
    assert_eq!(inputs.dropped.0["no_return"], 3 * used_scans);
    assert_eq!(inputs.dropped.0["too_near"], used_scans);
    assert_eq!(inputs.dropped.0["too_far"], 4 * used_scans);
    let unselected: u64 = (0..scans.len()).filter(|k| k % 3 != 0).map(|k| scans[k].len() as u64).sum();
    assert_eq!(inputs.dropped.0["scan_not_selected"], unselected);
    assert!(inputs.dropped.0["vehicle"] > 0);
    assert_eq!(report.runs[0].returns + report.runs[0].returns_left_out, inputs.returns_used);
    // Half the drive, half the returns.
    let share = report.runs[1].returns as f64 / inputs.returns_used as f64;
    assert!((0.4..0.6).contains(&share), "{share}");
    assert!(
        report.warnings.iter().any(|w| w.to_string().contains("no pose in `half`")),
        "{:?}",
        report.warnings
    );
    // The tiles hold every return once for each run.
    for run in 0..2 {
        let of_run = report.tiles.iter().filter(|tile| tile.run == run);
        assert_eq!(of_run.map(|tile| tile.sums.returns()).sum::<u64>(), report.runs[run].returns);
    }
}

#[test]
fn a_log_without_usable_returns_is_an_error_with_the_counts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.mcap");
    let scan = |k: i64| Scan {
        stamp_ns: Some(k * 100_000_000),
        points_in_sensor_m: vec![[0.0; 3], [f32::NAN; 3]],
        time_offsets_ns: vec![],
    };
    write_mcap(&path, &(0..5).map(scan).collect::<Vec<_>>());
    let poses = (0..5).map(|k| (k * 100_000_000, Isometry3::identity())).collect();
    let run = Run::new("still", Trajectory::stamped(poses).unwrap().trajectory);
    let error = evaluate(open(&path).as_ref(), &[run], &plain(), ()).unwrap_err();
    assert_eq!(error.to_string(), "no return is used: 5 non_finite, 5 no_return");
}

#[test]
fn a_vehicle_that_stands_most_of_the_time_is_not_the_world() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(40, 90);
    // The first scan again and again, as at a red light, then the drive; a bonnet in every scan.
    let stamps_ns = truth.stamps_ns().unwrap();
    let wait_ns = 500_000_000 * 150;
    let mut waiting: Vec<Scan> = Vec::new();
    for k in 0..150 {
        let stamp_ns = scans[0].stamp_ns.map(|ns| ns + 500_000_000 * k);
        waiting.push(Scan { stamp_ns, ..scans[0].clone() });
    }
    waiting.extend(scans.iter().map(|s| Scan { stamp_ns: s.stamp_ns.map(|ns| ns + wait_ns), ..s.clone() }));
    for scan in &mut waiting {
        scan.points_in_sensor_m.push([2.03, 0.04, -0.51]);
        scan.time_offsets_ns.push(0);
    }
    write_mcap(&path, &waiting);
    let start = (stamps_ns[0], truth.poses()[0]);
    let moved = stamps_ns.iter().map(|ns| ns + wait_ns).zip(truth.poses().iter().copied());
    let run = Trajectory::stamped(std::iter::once(start).chain(moved).collect()).unwrap().trajectory;
    let config = Config { max_time_gap_ns: Some(i64::MAX), ..plain() };
    let report = evaluate(open(&path).as_ref(), &[Run::new("run", run)], &config, ()).unwrap();
    assert!(report.inputs.runs[0].segments.travel_m > 50.0);
    assert_eq!(
        report.inputs.dropped.0["vehicle"],
        waiting.len() as u64,
        "the bonnet, once a scan, and nothing else"
    );
}
