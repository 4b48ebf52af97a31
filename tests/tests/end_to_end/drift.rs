//! `dmp drift`: what is measured where a drive comes back is what is wrong there.

use dmp::{Config, DriftPairs, DriftReach, DriftReport, FrameOrder, Run, VisitPairReport, measure_drift};
use dmp_log::{MemoryLog, ScanLog};
use dmp_sensor::{Isometry3, Scan, Trajectory, Translation3, UnitQuaternion, Vector3};
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route, Scenery};

use crate::common::{dmp, drift, noise, open, real_data, recorded, refused, runs_of, text, write_mcap};

/// A lap and a half round a block.
fn laps() -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 450, rate_hz: 5.0, ..LidarOptions::with_beams(16) };
    recorded(&RecordingOptions { seed: 4, scans: 420, route: Route::Loop, speed_m_s: 6.0, traffic: 2, lidar })
}

fn measured(log: &dyn ScanLog, runs: &[Run], config: &Config) -> DriftReport {
    measure_drift(log, runs, &Config { drift: DriftPairs::All, ..config.clone() }, ()).unwrap()
}

/// Where the run has the second visit as seen from the first, less where the truth has it, metres: how long that is.
fn true_distance_m(log: &dyn ScanLog, visit: &VisitPairReport, run: &Trajectory, truth: &Trajectory) -> f64 {
    let between = |of: &Trajectory| {
        let pose =
            |scan: usize| of.world_from_body_at(log.frames()[scan].stamp_ns.unwrap(), i64::MAX).unwrap();
        pose(visit.first.scan).inv_mul(&pose(visit.second.scan)).translation.vector
    };
    (between(run) - between(truth)).norm()
}

#[test]
fn a_right_run_is_off_by_nothing_and_a_wrong_one_by_what_is_wrong() {
    let (scans, truth) = laps();
    let log = MemoryLog::new("laps", scans).unwrap();
    for ate_m in [0.3, 2.0] {
        let runs = runs_of(&truth, &[("drift", drift(ate_m)), ("noise", noise(0.02, 0.1))]);
        let report = measured(&log, &runs, &Config::default());
        assert!(report.pairs_measured == report.pairs_found && report.pairs_found >= 8, "{report:?}");
        let [right, wrong, noisy] = [0, 1, 2].map(|run| &report.runs[run]);
        assert!(right.pairs * 10 >= report.pairs_found * 8 && right.p95_m.value.unwrap() < 0.02, "{right:?}");
        assert!(wrong.pairs * 10 >= report.pairs_found * 8, "{wrong:?}");
        assert!(noisy.rms_m.value.unwrap() < 0.06, "{noisy:?}");
        for visit in &report.visits {
            let Some(off) = &visit.runs[1].off else { continue };
            let expected_m = true_distance_m(&log, visit, &runs[1].trajectory, &truth);
            let found_m = off.distance_m.unwrap();
            assert!((found_m - expected_m).abs() < 0.02_f64.max(0.05 * expected_m), "{found_m} {expected_m}");
        }
        let pair = report.comparisons.iter().find(|pair| pair.a == "truth" && pair.b == "drift").unwrap();
        assert!(pair.difference_m2.value.unwrap() < 0.0, "{pair:?}");
        assert_eq!(pair.better.as_deref(), Some("truth"), "{pair:?}");
    }
}

/// Alone, from its own poses.
#[test]
fn a_run_alone_is_measured_as_well() {
    let (scans, truth) = laps();
    let log = MemoryLog::new("laps", scans).unwrap();
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let alone = measured(&log, &runs[1..], &Config::default());
    assert!(alone.runs[0].pairs >= 6, "{alone:?}");
    for visit in &alone.visits {
        let Some(off) = &visit.runs[0].off else { continue };
        let expected_m = true_distance_m(&log, visit, &runs[1].trajectory, &truth);
        let found_m = off.distance_m.unwrap();
        assert!((found_m - expected_m).abs() < 0.05 * expected_m, "{found_m} {expected_m}");
    }
}

/// What comes after the first lap is put 20 m aside: no visit of it lies near enough otherwise.
#[test]
fn a_run_that_lost_its_way_is_measured_further_off() {
    let (scans, truth) = laps();
    let log = MemoryLog::new("laps", scans).unwrap();
    let stamps_ns = truth.stamps_ns().unwrap();
    let aside = Translation3::new(16.0, -12.0, 0.0);
    let poses = truth
        .poses()
        .iter()
        .enumerate()
        .map(|(k, pose)| if 2 * k < stamps_ns.len() { *pose } else { aside * pose });
    let lost = Trajectory::stamped(stamps_ns.iter().copied().zip(poses).collect()).unwrap().trajectory;
    let runs = [Run::new("lost", lost)];
    let near = measured(&log, &runs, &Config::default());
    let far = measured(&log, &runs, &Config { drift_reach: DriftReach::Far, ..Config::default() });
    let [near, answers] = [&near, &far].map(|report| report.runs[0].pairs);
    assert!(near == 0 && answers >= 3, "{near} {answers}");
    for off in far.visits.iter().filter_map(|visit| visit.runs[0].off.as_ref()) {
        assert!((off.distance_m.unwrap() - 20.0).abs() < 0.05, "{off:?}");
    }
}

#[test]
fn the_report_is_the_same_for_any_threads_memory_order_and_frame() {
    let (scans, truth) = laps();
    let log = MemoryLog::new("laps", scans).unwrap();
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let reference = measured(&log, &runs, &Config { threads: 1, ..Config::default() });
    for (threads, memory_bytes, order) in [
        (2, 64 << 20, FrameOrder::Log),
        (3, 48 << 20, FrameOrder::Shuffled(5)),
        (2, 1 << 30, FrameOrder::Shuffled(6)),
    ] {
        let config = Config { threads, memory_bytes, order, ..Config::default() };
        assert_eq!(
            measured(&log, &runs, &config),
            reference,
            "{threads} threads, {memory_bytes} bytes, {order:?}"
        );
    }
    // A run's own world may be anywhere.
    let turn = UnitQuaternion::from_euler_angles(0.02, -0.03, 2.0);
    let away = Isometry3::from_parts(Translation3::new(500_000.0, 4_649_776.0, 100.0), turn);
    let moved: Vec<Run> =
        runs.iter().map(|run| Run { trajectory: run.trajectory.moved(&away), ..run.clone() }).collect();
    let elsewhere = measured(&log, &moved, &Config::default());
    for (a, b) in reference.visits.iter().zip(&elsewhere.visits) {
        for (a, b) in a.runs.iter().zip(&b.runs) {
            let (Some(a), Some(b)) = (&a.off, &b.off) else { continue };
            assert!((a.distance_m.unwrap() - b.distance_m.unwrap()).abs() < 1e-4, "{a:?} {b:?}");
            let turned = away.rotation * Vector3::from(a.in_world_m);
            assert!((turned - Vector3::from(b.in_world_m)).norm() < 1e-4, "{a:?} {b:?}");
        }
    }
}

/// Out and back on one path: what was published of this recording fits to 6 to 9 mm at two scans of one place.
#[test]
fn a_real_run_is_off_by_little_and_a_worse_one_by_what_was_added() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let log = open(&data);
    let odometry = dmp_log::read_trajectory(&data.join("poses_lidar_odometry.txt")).unwrap().trajectory;
    // The way back is put 40 cm to the side and 10 cm too high.
    let half = odometry.poses().len() / 2;
    let shift = Translation3::new(0.3, -0.26, 0.1);
    let poses = odometry.poses().iter().enumerate();
    let poses: Vec<_> = poses.map(|(k, pose)| if k < half { *pose } else { shift * pose }).collect();
    let stamps_ns = odometry.stamps_ns().unwrap().iter().copied();
    let worse = Trajectory::stamped(stamps_ns.zip(poses).collect()).unwrap().trajectory;
    let runs = [Run::new("odometry", odometry), Run::new("worse", worse)];
    let together = measured(log.as_ref(), &runs, &Config::default());
    let [odometry, worse] = [0, 1].map(|run| &together.runs[run]);
    assert!(odometry.pairs >= 5 && odometry.median_m.value.unwrap() < 0.02, "{odometry:?}");
    let added_m = shift.vector.norm();
    assert!((worse.median_m.value.unwrap() - added_m).abs() < 0.02, "{worse:?}");
    // From its own poses alone the same, to a centimetre, pair by pair.
    let alone = measured(log.as_ref(), &runs[1..], &Config::default());
    let mut compared = 0;
    for visit in &alone.visits {
        let same =
            together.visits.iter().find(|other| other.first == visit.first && other.second == visit.second);
        let Some((a, b)) = same.and_then(|same| Some((same.runs[1].off?, visit.runs[0].off?))) else {
            continue;
        };
        assert!((Vector3::from(a.in_world_m) - Vector3::from(b.in_world_m)).norm() < 0.01, "{a:?} {b:?}");
        compared += 1;
    }
    assert!(compared >= 5, "{compared}");
}

/// Out along a street and back.
fn there_and_back(scenery: Scenery) -> (MemoryLog, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 300, rate_hz: 5.0, ..LidarOptions::with_beams(32) };
    let options =
        RecordingOptions { seed: 2, scans: 320, route: Route::Straight, speed_m_s: 6.0, traffic: 0, lidar };
    let town = options.town_of(scenery).unwrap();
    let recording = Recording::new(&town, &options).unwrap();
    let log = MemoryLog::new("street", recording.scans().collect()).unwrap();
    (log, recording.drive().trajectory(20.0).unwrap())
}

/// Every house is the same again after 8 m: what is told is right, and where another house would do as well, that is said.
#[test]
fn a_street_that_looks_the_same_everywhere_tells_nothing_wrong() {
    let (log, truth) = there_and_back(Scenery::Alike { period_m: 8.0 });
    let runs = runs_of(&truth, &[("drift", drift(1.0)), ("noise", noise(0.02, 0.1))]);
    let (mut answers, mut ambiguous) = (0, 0);
    for group in [&runs[..], &runs[..1], &runs[1..2], &runs[2..]] {
        for visit in measured(&log, group, &Config::default()).visits {
            for (of_run, run) in visit.runs.iter().zip(group) {
                ambiguous +=
                    usize::from(of_run.why_not.as_ref().is_some_and(|why| why.contains("nearly as well")));
                let Some(found_m) = of_run.off.and_then(|off| off.distance_m) else { continue };
                // Scans of a run with noise lie about its middle one.
                let expected_m = true_distance_m(&log, &visit, &run.trajectory, &truth);
                assert!(
                    (found_m - expected_m).abs() < 0.15_f64.max(0.1 * expected_m),
                    "{found_m} {expected_m}"
                );
                answers += 1;
            }
        }
    }
    assert!(answers >= 6 && ambiguous >= 20, "{answers} answers, {ambiguous} ambiguous");
}

/// Nothing holds a place along a tunnel: sideways and upwards are told, how far along is not.
#[test]
fn along_a_bare_tunnel_nothing_is_told() {
    let (log, truth) = there_and_back(Scenery::Tunnel);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let report = measured(&log, &runs, &Config::default());
    assert!(report.pairs_found >= 6, "{report:?}");
    let mut told = 0;
    for visit in &report.visits {
        for of_run in &visit.runs {
            let Some(off) = of_run.off else { continue };
            assert!(off.along_m.is_none() && off.distance_m.is_none(), "{off:?}");
            told += usize::from(off.up_m.or(off.sideways_m).is_some());
        }
        // Nothing is wrong with the truth: what is told is nothing, as well as it is known.
        let right = visit.runs[0].off.unwrap();
        for (part_m, sigma_m) in
            [right.sideways_m, right.up_m].into_iter().zip([1, 2].map(|k| right.sigma_m[k]))
        {
            assert!(part_m.is_none_or(|m| m.abs() < 3.0 * sigma_m && sigma_m <= 0.1), "{right:?}");
        }
    }
    // Along it nothing is known to 50 m, so a direction that is a little askew to it is not known either.
    assert!(told >= report.pairs_found / 2, "{told} of {}", report.pairs_found);
    assert!(report.runs.iter().all(|run| run.pairs == 0 && run.along_m.is_none()), "{report:?}");
}

#[test]
fn the_command_says_it_in_metres_and_what_there_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let told = dmp(path, "drift @/town.mcap -t truth=@/truth.tum -t drift=@/drift.tum -v --quiet");
    let stdout = text(&told.stdout);
    assert_eq!(told.status.code(), Some(0), "{}", text(&told.stderr));
    assert!(stdout.starts_with("Where the drive comes back, truth is off by 0."), "{stdout}");
    assert!(stdout.contains("truth and drift: ") && stdout.contains("scan  and"), "{stdout}");

    let json = dmp(path, "drift @/town.mcap -t truth=@/truth.tum --pairs 3 --json --quiet");
    let report: DriftReport = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!((report.schema.as_str(), report.pairs_measured), (DriftReport::SCHEMA, 3));
    assert!(report.pairs_found > 3);

    let lidar = LidarOptions { azimuth_steps: 200, rate_hz: 2.0, ..LidarOptions::with_beams(16) };
    let options =
        RecordingOptions { seed: 4, scans: 60, route: Route::OneWay, speed_m_s: 6.0, traffic: 0, lidar };
    let (scans, truth) = recorded(&options);
    write_mcap(&path.join("straight.mcap"), &scans);
    let mut file = std::fs::File::create(path.join("t.tum")).unwrap();
    dmp_log::write_tum(&mut file, &truth).unwrap();
    let nothing = dmp(path, "drift straight.mcap -t t.tum --quiet");
    assert_eq!(nothing.status.code(), Some(0), "{}", text(&nothing.stderr));
    assert!(
        text(&nothing.stdout).starts_with("The drive comes back to no place"),
        "{}",
        text(&nothing.stdout)
    );

    let none = dmp(path, "drift straight.mcap -t t.tum --pairs 0");
    assert_eq!(none.status.code(), Some(2));
    assert!(
        text(&none.stderr).contains("it must be a number of pairs of 1 or more"),
        "{}",
        text(&none.stderr)
    );
    refused(path, "drift straight.mcap -t none.tum", 2, &["none.tum"]);
}

/// Beside the scores stands what `dmp drift` says of as many pairs; the page draws it.
#[test]
fn a_score_has_the_drift_of_some_pairs_or_of_as_many_as_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let runs = "-t truth=@/truth.tum -t drift=@/drift.tum --quiet --json";
    let drift: DriftReport =
        serde_json::from_slice(&dmp(path, &format!("drift @/town.mcap {runs} --pairs 3")).stdout).unwrap();
    let score = |more: &str| -> dmp::Report {
        let told = dmp(path, &format!("score @/town.mcap {runs} {more}"));
        assert_eq!(told.status.code(), Some(0), "{}", text(&told.stderr));
        serde_json::from_slice(&told.stdout).unwrap()
    };
    // The single visits are left to `dmp drift`.
    assert_eq!(score("--drift=3").drift, Some(DriftReport { visits: Vec::new(), ..drift.clone() }));
    let few = score("").drift.unwrap();
    assert!(few.pairs_measured > 3 && few.pairs_measured <= few.segments.div_ceil(2), "{few:?}");
    assert_eq!(score("--drift").drift.map(|all| all.pairs_measured), Some(drift.pairs_found));
    for nothing in ["--drift=none", "--sample 20"] {
        assert_eq!(score(nothing).drift, None, "{nothing}");
    }
    assert_eq!(score("--sample 20 --drift=3").drift, score("--drift=3").drift);

    let told =
        dmp(path, "score @/town.mcap -t @/truth.tum -t @/drift.tum --drift --report page.html --quiet");
    let said = text(&told.stdout);
    assert!(said.contains("\nWhere the drive comes back, truth is off by 0."), "{said}");
    let page = std::fs::read_to_string(path.join("page.html")).unwrap();
    let section = page.split("<h2 id=\"drift\">").nth(1).unwrap().split("</section>").next().unwrap();
    let answers = |name: &str| drift.runs.iter().find(|run| run.name == name).unwrap().pairs;
    assert!(answers("drift") > 0 && section.matches("<title>scans ").count() >= 2, "{section}");
    assert!(section.contains("Way of drift from above, with drift"), "{section}");
    // Where the run is worst, it says which way.
    assert!(page.contains("both see, the run has the later ones displaced: "), "{page}");
    for (wrong, words) in
        [("--drift=0", "1 or more, `all` or `none`"), ("--drift=3 --quick", "cannot be used with")]
    {
        let told = dmp(path, &format!("score @/town.mcap -t @/truth.tum {wrong}"));
        assert!(told.status.code() == Some(2) && text(&told.stderr).contains(words), "{wrong}: {told:?}");
    }
}

/// The edges that are written lie where the truth is, as near as they say, and not where a run that drifts is.
#[test]
fn constraints_are_those_of_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (scans, truth) = laps();
    write_mcap(&path.join("laps.mcap"), &scans);
    // The body is not the sensor.
    let body_from_sensor = Isometry3::from_parts(
        Translation3::new(0.5, -0.3, 1.2),
        UnitQuaternion::from_euler_angles(0.0, 0.1, 1.5),
    );
    let body = |run: &Trajectory| {
        let poses = run.poses().iter().map(|pose| pose * body_from_sensor.inverse());
        Trajectory::stamped(run.stamps_ns().unwrap().iter().copied().zip(poses).collect()).unwrap().trajectory
    };
    let wrong = body(&drift(1.0).apply(&truth).unwrap());
    let truth = body(&truth);
    dmp_log::write_tum(&mut std::fs::File::create(path.join("drift.tum")).unwrap(), &wrong).unwrap();
    let q = body_from_sensor.rotation.coords;
    let extrinsic = format!("0.5,-0.3,1.2,{},{},{},{}", q.x, q.y, q.z, q.w);
    let call = format!("drift laps.mcap -t drift.tum --extrinsic {extrinsic} --trust -o edges.g2o --quiet");
    let told = dmp(path, &call);
    assert_eq!(told.status.code(), Some(0), "{}", text(&told.stderr));

    // As whoever optimises a graph reads them: vertices are scans by their numbers.
    let log = open(&path.join("laps.mcap"));
    let at = |run: &Trajectory, scan: usize| {
        run.world_from_body_at(log.frames()[scan].stamp_ns.unwrap(), i64::MAX).unwrap()
    };
    let edges = std::fs::read_to_string(path.join("edges.g2o")).unwrap();
    assert!(
        edges.lines().count() >= 8 && edges.lines().all(|line| line.starts_with("EDGE_SE3:QUAT ")),
        "{edges}"
    );
    let mut chi2 = [0.0; 2];
    for line in edges.lines() {
        let numbers: Vec<f64> = line.split(' ').skip(1).map(|number| number.parse().unwrap()).collect();
        let [from, to] = [numbers[0] as usize, numbers[1] as usize];
        let turn = UnitQuaternion::new_normalize(dmp_sensor::Quaternion::new(
            numbers[8], numbers[5], numbers[6], numbers[7],
        ));
        let measured = Isometry3::from_parts(Translation3::new(numbers[2], numbers[3], numbers[4]), turn);
        for (run, chi2) in [&truth, &wrong].into_iter().zip(&mut chi2) {
            let off = measured.inverse() * (at(run, from).inverse() * at(run, to));
            let q = off.rotation.quaternion();
            let turn = q.imag() * q.w.signum();
            let place = off.translation.vector;
            let error = [place.x, place.y, place.z, turn.x, turn.y, turn.z];
            let mut upper = numbers[9..].iter();
            for row in 0..6 {
                for column in row..6 {
                    let twice = if row == column { 1.0 } else { 2.0 };
                    *chi2 += twice * upper.next().unwrap() * error[row] * error[column];
                }
            }
        }
    }
    let [truth, wrong] = chi2.map(|chi2| chi2 / edges.lines().count() as f64);
    // Six numbers an edge; what is allowed for bent visits makes it less.
    assert!(truth < 12.0 && wrong > 100.0, "{truth} {wrong}");

    refused(path, "drift laps.mcap -t a=drift.tum -t b=drift.tum -o edges.g2o", 2, &["-o", "one run"]);
}
