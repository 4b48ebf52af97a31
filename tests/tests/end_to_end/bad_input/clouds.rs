//! Rows 8 to 16: points that are none, clouds that make no sense, coordinates of any size, times of points and stamps.

use dmp_log::FolderFormat;
use dmp_sensor::Scan;

use super::Town;
use super::logs::foreign;
use super::raw::{Cloud, bag};
use super::table::Row;

pub(super) const ROWS: &[Row] = &[
    Row {
        number: 8,
        made: |town| {
            let extra = [[f32::NAN; 3], [1.0, f32::INFINITY, 2.0], [f32::NAN, 5.0, 5.0]];
            extra_is_dropped(town, &extra, "non_finite");
        },
        lines: "",
    },
    Row {
        number: 9,
        made: |town| extra_is_dropped(town, &[[0.0; 3], [0.0, -0.0, 0.0]], "no_return"),
        lines: "",
    },
    Row {
        number: 10,
        made: clouds_that_make_no_sense,
        lines: "
            score pcd => 3 scans_used = 23; damage: 000005.pcd | no field `y`
            score laz => 3 scans = 23; damage: scans/000012.laz, point 0 | cannot decode the points | the scan is skipped
            info laz => 3 damage: scans/000012.laz, point 0 | cannot decode the points | the scan is skipped
            score padded.mcap => 0 as score even.mcap
            score nothing.mcap => 1 no return is used | the scans are empty",
    },
    Row {
        number: 11,
        made: |town| {
            let clouds: Vec<Cloud> = town.scans.iter().map(Cloud::of).collect();
            let swapped = |cloud: &Cloud| {
                let data = cloud.data.chunks_exact(4).flat_map(|c| [c[3], c[2], c[1], c[0]]).collect();
                Cloud { data, is_bigendian: true, ..cloud.clone() }
            };
            town.write("little.mcap", bag(&clouds));
            town.write("big.mcap", bag(&clouds.iter().map(swapped).collect::<Vec<_>>()));
            // The mark alone: of every third scan, and of all.
            let marked = |step| {
                let mut clouds = clouds.clone();
                clouds.iter_mut().step_by(step).for_each(|cloud| cloud.is_bigendian = true);
                bag(&clouds)
            };
            town.write("some.mcap", marked(3));
            town.write("all.mcap", marked(1));
        },
        lines: "
            score big.mcap => 0 as score little.mcap; warnings lacks is_bigendian
            score some.mcap => 0 warnings: of the ranges are below 1 mm or above 100 km | (is_bigendian)
            score all.mcap => 1 no return is used | of the ranges are below 1 mm or above 100 km | (is_bigendian)",
    },
    Row {
        // With a shift by whole tiles nothing changes but the rounding of coordinates in the millions; with another one the
        // voxels are elsewhere in the town, and the scores change as little as that does.
        number: 12,
        made: |town| {
            for (folder, east, north) in [("tiles", 512_000.0, 4_096_000.0), ("utm", 500_000.0, 4_000_000.0)] {
                for run in ["truth.tum", "drift.tum"] {
                    let far = town.changed(run, |ns, mut pose| {
                        pose.translation.vector += nalgebra::Vector3::new(east, north, 0.0);
                        Some((ns, pose))
                    });
                    town.write(&format!("{folder}/{run}"), "");
                    town.tum(&format!("{folder}/{run}"), &far);
                }
            }
        },
        lines: "
            score town.mcap -t tiles/truth.tum -t tiles/drift.tum => 0 near 1e-5 score town.mcap
            score town.mcap -t utm/truth.tum -t utm/drift.tum => 0 near 0.1 score town.mcap",
    },
    Row {
        number: 13,
        made: |town| {
            let pile = |scan: &Scan| {
                let mut scan = scan.clone();
                let (point, time_ns) = (scan.points_in_sensor_m[10], scan.time_offsets_ns[10]);
                scan.points_in_sensor_m.extend(std::iter::repeat_n(point, 50_000));
                scan.time_offsets_ns.extend(std::iter::repeat_n(time_ns, 50_000));
                scan
            };
            let piles: Vec<Scan> = town.scans.iter().map(pile).collect();
            town.mcap("piles.mcap", &piles);
            town.scans("pcd", &piles, FolderFormat::Pcd);
            let alone = |scan: &Scan| Scan {
                points_in_sensor_m: vec![[5.0, 5.0, 0.5]; 50_000],
                time_offsets_ns: vec![0; 50_000],
                ..scan.clone()
            };
            town.mcap("alone.mcap", &town.scans.iter().map(alone).collect::<Vec<_>>());
        },
        lines: "
            score piles.mcap --returns all => 0 returns_used in 1000001..; runs/0/surfels in 101..; as score pcd --returns all
            score alone.mcap --returns all --ego none => 0 returns_used = 1200000; runs/0/r_cv_m2/0.2 = null",
    },
    Row {
        number: 14,
        made: times_of_points,
        lines: "
            score zero => 0 as score plain.mcap; point_times = null; notes: `time` is the same for all points
            score equal => 0 as score plain.mcap; point_times = null; notes: `time` is the same for all points
            score garbage => 1 garbage | `time` | span | --point-time
            score huge => 1 huge | `time` | span | --point-time
            score own => 1 own | `time` | clock | --point-time
            score two => 1 two | `t` and `time` | span | --point-time
            info garbage => 0 problem: garbage | `time` | span | --point-time
            info own => 0 problem: own | `time` | clock | --point-time
            info two => 0 problem: two | `t` and `time` | span | --point-time
            score garbage --point-time ignore => 0 truth first
            score own --point-time first-s => 0 point_times: as given; near 2e-3 score town.mcap
            score two --point-time ns => 0 point_times: as given; near 2e-3 score town.mcap
            score nowhere --point-time ms => 2 nowhere
            score odd => 3 scans = 23; damage: times in field `time` are not like those of the other scans
            info odd => 3 damage: times in field `time` are not like those of the other scans",
    },
    Row {
        number: 15,
        made: |town| {
            for (name, share) in [("mid.mcap", 0.5), ("end.mcap", 1.0)] {
                let moved = |scan: &Scan| {
                    let [first, last] = [scan.time_offsets_ns.iter().min(), scan.time_offsets_ns.iter().max()];
                    let shift_ns = (share * (last.unwrap() - first.unwrap()) as f64).round() as i64;
                    Scan { stamp_ns: scan.stamp_ns.map(|ns| ns + shift_ns), ..scan.clone() }
                };
                town.mcap(name, &town.scans.iter().map(moved).collect::<Vec<_>>());
            }
        },
        lines: "
            score town.mcap => 0 point_times: the stamp is its start
            score mid.mcap --stamp mid => 0 point_times: the stamp is its mid; near 1e-6 score town.mcap
            score end.mcap --stamp end => 0 point_times: the stamp is its end; near 1e-6 score town.mcap
            score mid.mcap => 0 far 0.1 score town.mcap
            score end.mcap => 0 far 0.1 score town.mcap",
    },
    Row {
        number: 16,
        made: stamps,
        lines: "
            score twice.mcap => 0 warnings: 3 scans have the stamp of another
            info twice.mcap => 0 same_stamp = 3
            info short.mcap => 0 steps_back in 2..4
            score short.mcap => 1 0 of 24 scans have a pose | --time-offset
            score one.mcap => 0 warnings: scan 12 is stamped 3599.5 s after the scans around it
            info one.mcap => 0 prints: scan 12 is stamped 3599.5 s after the scans around it
            score pause.mcap => 0 warnings: no scan for 60.5 s after scan 15, where scans are 0.50 s apart
            info pause.mcap => 0 prints: no scan for 60.5 s after scan 15, where scans are 0.50 s apart",
    },
];

/// The scans with `extra` behind every point give the scores of those without, and count the extra points under `reason`: as
/// messages, organised and not, and in folders.
fn extra_is_dropped(town: &Town, extra: &[[f32; 3]], reason: &str) {
    let each = 1 + extra.len();
    let with = |scan: &Scan| {
        let points = scan.points_in_sensor_m.iter();
        let points = points.flat_map(|&point| std::iter::once(point).chain(extra.iter().copied()));
        let times = scan.time_offsets_ns.iter().flat_map(|&time| std::iter::repeat_n(time, each));
        Scan {
            stamp_ns: scan.stamp_ns,
            points_in_sensor_m: points.collect(),
            time_offsets_ns: times.collect(),
        }
    };
    let holes: Vec<Scan> = town.scans.iter().map(with).collect();
    town.mcap("holes.mcap", &holes);
    town.scans("pcd", &holes, FolderFormat::Pcd);
    town.scans("ply", &holes, FolderFormat::Ply);
    // Without times: organised in rows of a point and what is behind it.
    let mut organised: Vec<Cloud> = holes.iter().map(Cloud::of).collect();
    for cloud in &mut organised {
        (cloud.height, cloud.width) = (cloud.width / each as u32, each as u32);
        cloud.row_step = cloud.width * cloud.point_step;
    }
    town.write("organised.mcap", bag(&organised));
    town.write("plain.mcap", bag(&town.scans.iter().map(Cloud::of).collect::<Vec<_>>()));
    let count = extra.len() * town.scans.iter().map(Scan::len).sum::<usize>();
    let same = [("holes.mcap", "town.mcap"), ("pcd", "town.mcap"), ("ply", "town.mcap")];
    for (log, other) in same.into_iter().chain([("organised.mcap", "plain.mcap")]) {
        town.line(format!("score {log} => 0 as score {other}; dropped/{reason} = {count}"));
    }
}

/// Breaks a cloud.
type Spoil = fn(&mut Cloud);

fn clouds_that_make_no_sense(town: &Town) {
    let clouds: Vec<Cloud> = town.scans.iter().map(Cloud::of).collect();
    // The tests of `dmp-log` have more.
    let spoilers: [(Spoil, &str); 4] = [
        (|cloud| cloud.point_step = 0, "point_step is 0"),
        (|cloud| (cloud.height, cloud.row_step) = (u32::MAX, u32::MAX), "4,294,967,295 rows"),
        (|cloud| cloud.fields.retain(|field| field.0 != "y"), "no field `y`"),
        (|cloud| cloud.data.truncate(100), "do not fit in 100 bytes"),
    ];
    for (number, (spoil, words)) in spoilers.into_iter().enumerate() {
        let (one, all) = (format!("one{number}.mcap"), format!("all{number}.mcap"));
        let mut spoiled = clouds.clone();
        spoil(&mut spoiled[5]);
        town.write(&one, bag(&spoiled));
        town.line(format!("score {one} => 3 scans_used = 23; damage: message 5 | {words}; truth first"));
        spoiled = clouds.clone();
        spoiled.iter_mut().for_each(spoil);
        town.write(&all, bag(&spoiled));
        town.line(format!("score {all} => 1 {all} | message 0 | {words}"));
    }
    town.scans("pcd", town.scans, FolderFormat::Pcd);
    town.change("pcd/scans/000005.pcd", |bytes| {
        let fields = bytes.windows(6).position(|window| window == b"x y z ").unwrap();
        bytes[fields + 2] = b'w';
    });
    town.scans("laz", town.scans, FolderFormat::Laz);
    town.change("laz/scans/000012.laz", |bytes| {
        let middle = bytes.len() / 2;
        bytes[middle..middle + 500].copy_from_slice(&foreign(500));
    });

    let mut even = clouds.clone();
    for cloud in &mut even {
        cloud.width -= cloud.width % 2;
        cloud.row_step = 12 * cloud.width;
        cloud.data.truncate(cloud.row_step as usize);
    }
    town.write("even.mcap", bag(&even));
    for cloud in &mut even {
        // Two rows with 20 bytes behind each.
        let row = (cloud.width / 2 * 12) as usize;
        cloud.data = [&cloud.data[..row], &[0xff; 20], &cloud.data[row..], &[0xff; 20]].concat();
        (cloud.height, cloud.width, cloud.row_step) = (2, cloud.width / 2, row as u32 + 20);
    }
    town.write("padded.mcap", bag(&even));
    let mut with_empty = clouds;
    let nothing = Cloud { width: 0, row_step: 0, data: Vec::new(), ..with_empty[5].clone() };
    let stamp_ns = with_empty[7].stamp_ns;
    with_empty[7] = Cloud { fields: Vec::new(), point_step: 0, stamp_ns, ..nothing.clone() };
    with_empty[5] = nothing;
    town.write("empty.mcap", bag(&with_empty));
    let lost = town.scans[5].len() + town.scans[7].len();
    let returns = town.scans.iter().map(Scan::len).sum::<usize>() - lost;
    town.line(format!("score empty.mcap => 0 returns = {returns}; scans = 24; truth first"));
    with_empty.iter_mut().for_each(|cloud| {
        (cloud.width, cloud.row_step) = (0, 0);
        cloud.data.clear();
    });
    town.write("nothing.mcap", bag(&with_empty));
}

/// Name, type, size, and the bytes for a scan's stamp and a point's time after it, nanoseconds.
pub(super) type Field<'a> = (&'a str, char, u8, &'a dyn Fn(i64, i64) -> Vec<u8>);

/// A folder of PCD files called after their stamps, with fields of bytes made of stamp and time.
pub(super) fn timed(town: &Town, log: &str, scans: &[Scan], fields: &[Field<'_>]) {
    let column = |value: &dyn Fn(&Field<'_>) -> String| -> String {
        fields.iter().flat_map(|field| [" ".to_owned(), value(field)]).collect()
    };
    let head = format!(
        "VERSION .7\nFIELDS x y z{}\nSIZE 4 4 4{}\nTYPE F F F{}\nCOUNT 1 1 1{}\n",
        column(&|field| field.0.into()),
        column(&|field| field.2.to_string()),
        column(&|field| field.1.to_string()),
        column(&|_| "1".into())
    );
    for scan in scans {
        let stamp_ns = scan.stamp_ns.unwrap();
        let size = format!("WIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA binary\n", scan.len());
        let mut bytes = format!("{head}{size}").into_bytes();
        for (point, &time_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            bytes.extend(point.iter().flat_map(|c| c.to_le_bytes()));
            fields.iter().for_each(|field| bytes.extend((field.3)(stamp_ns, time_ns)));
        }
        town.write(&format!("{log}/{stamp_ns}.pcd"), bytes);
    }
}

fn f32_of(value: f64) -> Vec<u8> {
    (value as f32).to_le_bytes().into()
}

fn f64_of(value: f64) -> Vec<u8> {
    value.to_le_bytes().into()
}

fn times_of_points(town: &Town) {
    let scans = town.scans;
    let at_end = |scan: &Scan| {
        let last_ns = scan.time_offsets_ns.iter().max().unwrap();
        let times = scan.time_offsets_ns.iter().map(|ns| ns - last_ns).collect();
        Scan { stamp_ns: scan.stamp_ns.map(|ns| ns + last_ns), time_offsets_ns: times, ..scan.clone() }
    };
    let ends: Vec<Scan> = scans.iter().map(at_end).collect();
    let s = |ns: i64| ns as f64 / 1e9;
    let kinds: [(&str, &[Scan], Field<'_>); 8] = [
        ("seconds", scans, ("time", 'F', 4, &|_, ns| f32_of(s(ns)))),
        ("milliseconds", scans, ("time", 'F', 4, &|_, ns| f32_of(1e3 * s(ns)))),
        ("microseconds", scans, ("offset_time", 'U', 4, &|_, ns| ((ns / 1000) as u32).to_le_bytes().into())),
        ("nanoseconds", scans, ("t", 'U', 4, &|_, ns| (ns as u32).to_le_bytes().into())),
        ("seconds", &ends, ("time", 'F', 4, &|_, ns| f32_of(s(ns)))),
        ("nanoseconds", &ends, ("t", 'I', 4, &|_, ns| (ns as i32).to_le_bytes().into())),
        ("seconds", scans, ("timestamp", 'F', 8, &|stamp, ns| f64_of(s(stamp + ns)))),
        ("nanoseconds", scans, ("timestamp", 'U', 8, &|stamp, ns| (stamp + ns).to_le_bytes().into())),
    ];
    for (number, (unit, scans, field)) in kinds.into_iter().enumerate() {
        let words = format!("{unit} | {} | found from the values", field.0);
        timed(town, &format!("timed{number}"), scans, &[field]);
        town.line(format!("score timed{number} => 0 point_times: {words}; near 2e-3 score town.mcap"));
        town.line(format!("info timed{number} => 0 point_times: {words}"));
    }
    let plain = |scan: &Scan| Scan { time_offsets_ns: Vec::new(), ..scan.clone() };
    town.mcap("plain.mcap", &scans.iter().map(plain).collect::<Vec<_>>());
    timed(town, "zero", scans, &[("time", 'F', 4, &|_, _| f32_of(0.0))]);
    timed(town, "equal", scans, &[("time", 'F', 4, &|_, _| f32_of(0.25))]);
    let mixed = |ns: i64| ((ns.wrapping_mul(2_654_435_761) >> 7) & 0xffff) as f64;
    timed(town, "garbage", scans, &[("time", 'F', 4, &|_, ns| f32_of(mixed(ns) / 1.3e4))]);
    timed(town, "huge", scans, &[("time", 'F', 4, &|_, ns| f32_of(mixed(ns) * 1e30))]);
    // The sensor's own clock: seconds since it was switched on.
    let own = |stamp: i64, ns: i64| f64_of(s(stamp - 1_500_000_000_000_000_000 + ns));
    timed(town, "own", scans, &[("time", 'F', 8, &own)]);
    // Two fields, one of which counts half as fast.
    let whole = |_, ns: i64| (ns as u32).to_le_bytes().to_vec();
    timed(town, "two", scans, &[("t", 'U', 4, &whole), ("time", 'F', 4, &|_, ns| f32_of(s(ns) / 2.0))]);
    let odd_ns = scans[1].stamp_ns.unwrap();
    let odd = |stamp, ns| f32_of(s(ns) * if stamp == odd_ns { 3e8 } else { 1.0 });
    timed(town, "odd", scans, &[("time", 'F', 4, &odd)]);
}

fn stamps(town: &Town) {
    let mut scans = town.scans.to_vec();
    scans.reverse();
    scans.swap(3, 9);
    town.mcap("backwards.mcap", &scans);
    town.scans("backwards", &scans, FolderFormat::Pcd);
    let steps = scans.windows(2).filter(|pair| pair[1].stamp_ns < pair[0].stamp_ns).count();
    for log in ["backwards.mcap", "backwards"] {
        let warned = format!("warnings: stamps go backwards {steps} times");
        town.line(format!("score {log} => 0 {warned}; near 1e-9 score town.mcap"));
        town.line(format!("info {log} => 0 steps_back = {steps}"));
    }
    town.mcap("twice.mcap", &[&scans[..], &scans[4..7]].concat());
    let stamped = |name: &str, stamp: &dyn Fn(usize, i64) -> i64| {
        let with = |(k, scan): (usize, &Scan)| Scan {
            stamp_ns: scan.stamp_ns.map(|ns| stamp(k, ns)),
            ..scan.clone()
        };
        town.mcap(name, &town.scans.iter().enumerate().map(with).collect::<Vec<_>>());
    };
    // A counter of nanoseconds in 32 bits starts again every 4.3 s.
    stamped("short.mcap", &|_, ns| ns & 0xffff_ffff);
    stamped("one.mcap", &|k, ns| if k == 12 { ns + 3_600_000_000_000 } else { ns });
    stamped("pause.mcap", &|k, ns| if k >= 16 { ns + 60_000_000_000 } else { ns });
}
