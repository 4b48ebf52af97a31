//! The gallery of what goes wrong: each wrong input is made, and the command prints what the page quotes.

use std::fs;
use std::path::Path;

use dmp_sensor::{Isometry3, Point3, Quaternion, Scan, Trajectory, UnitQuaternion};

use crate::common::{
    SCORE, dmp, done, has, json, open, sample, save_tum, text, trajectory, unwrapped, workspace, write,
    write_mcap,
};

fn page() -> String {
    fs::read_to_string(workspace().join("docs/guide/gallery.md")).unwrap()
}

/// What the page quotes, each under the name in bold type that its paragraph begins with.
fn quotes(page: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for (before, quoted) in page.split("```text,wrap\n").zip(page.split("```text,wrap\n").skip(1)) {
        let name = before.rsplit("\n**").next().and_then(|named| named.split("**").next());
        found.push((name.unwrap().to_owned(), quoted.split("\n```").next().unwrap().to_owned()));
    }
    found
}

fn truth() -> Trajectory {
    trajectory(&sample("truth.tum"))
}

/// The lines of the true trajectory, in columns.
fn lines() -> Vec<Vec<String>> {
    let all = fs::read_to_string(sample("truth.tum")).unwrap();
    all.lines().map(|line| line.split(' ').map(str::to_owned).collect()).collect()
}

/// The truth with each of its poses changed.
fn keep(folder: &Path, name: &str, change: impl Fn(i64, &Isometry3<f64>) -> (i64, Isometry3<f64>)) {
    let truth = truth();
    let poses = truth.stamps_ns().unwrap().iter().zip(truth.poses());
    let changed = Trajectory::stamped(poses.map(|(&ns, pose)| change(ns, pose)).collect()).unwrap();
    save_tum(&folder.join(name), &changed.trajectory);
}

/// The sample's scans with their points moved to where the sensor was at their stamps.
fn corrected() -> Vec<Scan> {
    let truth = truth();
    let log = open(&sample("town.mcap"));
    let mut reader = log.reader().unwrap();
    let corrected = |number: usize| {
        let mut scan = Scan::default();
        reader.read(number, &mut scan).unwrap();
        let stamp_ns = scan.stamp_ns.unwrap();
        let at = |ns: i64| truth.world_from_body_at(ns, i64::MAX).unwrap();
        for (point, after_ns) in scan.points_in_sensor_m.iter_mut().zip(&scan.time_offsets_ns) {
            let world_from_sensor = at(stamp_ns + after_ns);
            let place = at(stamp_ns).inverse() * (world_from_sensor * Point3::from(point.map(f64::from)));
            *point = [place.x as f32, place.y as f32, place.z as f32];
        }
        scan
    };
    (0..log.frames().len()).map(corrected).collect()
}

/// The arguments behind `dmp` that make the command print what is quoted under this name.
fn arguments(folder: &Path, name: &str) -> String {
    let beside_truth = |rest: &str| format!("score @/town.mcap -t @/truth.tum {rest}");
    let made = |arguments: &str| drop(done(folder, arguments));
    match name {
        "Another clock" => beside_truth("-t run=@/drift.tum --time-offset run=-18"),
        "A lag of 50 ms" => {
            keep(folder, "late.tum", |ns, pose| (ns + 50_000_000, *pose));
            beside_truth("-t late.tum")
        }
        "The wrong instant of the scan" => beside_truth("-t run=@/noise.tum --pose-at run=end"),
        "A mounting that is not there" => {
            beside_truth("-t run=@/truth.tum --extrinsic run=0.9,0,0,0,0,0.01745,0.99985")
        }
        "A camera's axes" => {
            // Of x right, y down, z ahead, seen by x ahead, y left, z up.
            let axes = UnitQuaternion::new_normalize(Quaternion::new(0.5, -0.5, 0.5, -0.5));
            keep(folder, "camera.tum", |ns, pose| (ns, pose * axes));
            beside_truth("-t camera.tum")
        }
        "Millimetres" => {
            keep(folder, "mm.tum", |ns, pose| {
                (ns, Isometry3::from_parts((pose.translation.vector * 1000.0).into(), pose.rotation))
            });
            beside_truth("-t run=mm.tum")
        }
        "A line that was cut" => {
            let mut lines = lines();
            lines[50].truncate(5);
            let cut: Vec<String> = lines.iter().map(|line| line.join(" ")).collect();
            write(folder, "cut.tum", &cut.join("\n"));
            beside_truth("-t cut.tum")
        }
        "Keyframes alone" => {
            let few: Vec<String> = lines().iter().skip(1).step_by(60).map(|line| line.join(" ")).collect();
            write(folder, "keyframes.tum", &few.join("\n"));
            beside_truth("-t run=keyframes.tum")
        }
        "Log and trajectory swapped" => {
            for name in ["truth.tum", "town.mcap"] {
                fs::copy(sample(name), folder.join(name)).unwrap();
            }
            "score truth.tum -t town.mcap".to_owned()
        }
        "Motion-corrected twice" => {
            write_mcap(&folder.join("corrected.mcap"), &corrected());
            "score corrected.mcap -t @/truth.tum".to_owned()
        }
        "Cut short" => {
            let whole = fs::read(sample("town.mcap")).unwrap();
            fs::write(folder.join("cut.mcap"), &whole[..1_200_000]).unwrap();
            "score cut.mcap -t @/truth.tum".to_owned()
        }
        "Half of it is missing" => {
            let lines = lines();
            let half: Vec<String> =
                lines[..lines.len().div_ceil(2)].iter().map(|line| line.join(" ")).collect();
            write(folder, "half.tum", &half.join("\n"));
            beside_truth("-t half.tum")
        }
        "Collapsed" => {
            made("simulate errors @/truth.tum --collapse 0.5 -o run.tum");
            beside_truth("-t run.tum")
        }
        "No revisit" => {
            made(
                "simulate town --route one-way --scans 100 --rate 2 --azimuth-steps 300 -o way.mcap --truth way.tum",
            );
            "score way.mcap -t truth=way.tum".to_owned()
        }
        other => panic!("no input is made here for `{other}`, which the gallery has"),
    }
}

fn the_command_prints(is_chosen: impl Fn(&str) -> bool) {
    let quotes = quotes(&page());
    assert_eq!(quotes.len(), page().matches("```text").count());
    let mut wrong = Vec::new();
    for (name, quoted) in quotes.iter().filter(|(name, _)| is_chosen(name)) {
        let folder = tempfile::tempdir().unwrap();
        let output = dmp(folder.path(), &arguments(folder.path(), name));
        let printed = text(&output.stderr) + &text(&output.stdout);
        if !unwrapped(&printed).contains(&unwrapped(quoted)) {
            wrong.push(format!("{name}: the page has\n{quoted}\nand the command printed\n{printed}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_command_prints_some_of_what_the_gallery_quotes() {
    the_command_prints(|name| {
        ["A line that was cut", "A mounting that is not there", "Log and trajectory swapped", "Cut short"]
            .contains(&name)
    });
}

#[test]
#[ignore = "nightly: fifteen scores"]
fn the_command_prints_all_that_the_gallery_quotes() {
    the_command_prints(|_| true);
}

#[test]
fn the_numbers_of_a_collapsed_run_are_those_of_the_gallery() {
    let report = json(Path::new("."), &format!("{SCORE} -t @/truth.tum -t @/collapsed.tum"));
    let percent =
        |run: usize, field: &str| format!("{:.1}", 100.0 * report["runs"][run][field].as_f64().unwrap());
    let numbers = ["coverage_revisit", "blocked_rate"].map(|field| [percent(1, field), percent(0, field)]);
    has(&unwrapped(&page()), &[numbers[0][0].as_str(), &numbers[0][1], &numbers[1][0], &numbers[1][1]]);
}
