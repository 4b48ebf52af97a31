//! What went in: files, settings, where every return went.

use dmp_report::{ConfigReport, InputReport, Pairing, PoseAt, Report, RunInputReport};

use super::html::{cell, head, table, terms};
use crate::text::{NONE, bytes, count, counted, digits, duration, segments_in_words};

/// The log, the runs, the settings, the effort.
pub(super) fn inputs(report: &Report) -> String {
    format!(
        "<h3>The log</h3>\n{}<h3>The runs</h3>\n{}<h3>The settings</h3>\n{}<h3>Where the returns went</h3>\n{}<h3>The \
         effort</h3>\n{}",
        log(report),
        runs(&report.inputs),
        settings(report),
        returns(report),
        effort(report)
    )
}

fn log(report: &Report) -> String {
    let inputs = &report.inputs;
    let span = inputs.span_ns.map(|(first_ns, last_ns)| {
        let [first_s, last_s] = [first_ns, last_ns].map(|ns| ns as f64 / 1e9);
        format!("{first_s:.3} to {last_s:.3} s, {}", duration(last_s - first_s))
    });
    let mut lines = vec![
        ("file", inputs.log.clone()),
        ("format", inputs.format.clone()),
        ("length", bytes(inputs.bytes)),
        ("fingerprint", inputs.fingerprint.clone()),
        ("topic", inputs.topic.clone().unwrap_or_default()),
        ("stamps", span.unwrap_or_default()),
        ("times of points", inputs.point_times.clone().unwrap_or_default()),
        ("scans", format!("{} of {} used", count(inputs.scans_used as u64), count(inputs.scans as u64))),
    ];
    let notes = inputs.notes.iter().map(String::as_str).chain(inputs.without_checksums());
    lines.extend(notes.map(|note| ("note", note.to_owned())));
    lines.extend(inputs.damage.iter().map(|damage| ("lost", damage.clone())));
    terms(lines)
}

fn runs(inputs: &InputReport) -> String {
    let heads = [
        "run",
        "trajectory",
        "format",
        "poses",
        "pairing",
        "longest gap",
        "without pose",
        "map",
        "sensor on body",
        "notes",
    ];
    let classes = ["name", "text", "name", "", "name", "", "", "name", "text", "text"];
    let heads: Vec<String> = heads.iter().zip(classes).map(|(title, class)| head(title, "", class)).collect();
    let row = |run: &RunInputReport| {
        let [x, y, z, qx, qy, qz, qw] = run.body_from_sensor;
        let notes: Vec<&str> = run.notes.iter().chain(&run.map_notes).map(String::as_str).collect();
        let texts = [
            run.name.clone(),
            run.file.clone().unwrap_or_else(|| NONE.to_owned()),
            run.format.clone().unwrap_or_else(|| NONE.to_owned()),
            count(run.poses as u64),
            pairing(run),
            run.longest_gap_s.map_or_else(|| NONE.to_owned(), |gap_s| format!("{} s", digits(gap_s))),
            count(run.scans_without_pose as u64),
            run.map.clone(),
            format!("{x} {y} {z} m, {qx} {qy} {qz} {qw} ({})", run.body_from_sensor_source),
            if notes.is_empty() { NONE.to_owned() } else { notes.join("; ") },
        ];
        texts.iter().zip(classes).map(|(text, class)| cell(text, class)).collect()
    };
    table("What was read of every run", &heads, &inputs.runs.iter().map(row).collect::<Vec<_>>())
}

/// How poses are found, and when they hold.
fn pairing(run: &RunInputReport) -> String {
    let how = match run.pairing {
        Pairing::ByStamp => "by stamp",
        Pairing::ByLine => "line by line",
    };
    let instant = (run.pose_at != PoseAt::Stamp).then(|| format!("at the {} of the scan", run.pose_at));
    let clock = (run.time_offset_s != 0.0).then(|| format!("the log's clock {} s on", run.time_offset_s));
    [Some(how.to_owned()), instant, clock].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

fn settings(report: &Report) -> String {
    let config = &report.config;
    // Where none is looked for, there is no line.
    let vehicle = match config.ego.box_m() {
        Some([from, to]) => Some(format!("{}, {from:?} to {to:?} m", config.ego.name())),
        None if config.ego.cells == 0 && !config.scales.lengths().has_vehicle => None,
        None => Some(format!("{}, {}", config.ego.name(), counted(config.ego.cells as u64, "cell"))),
    };
    let sampling = &report.sampling;
    let seed = sampling.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
    let drawn = match sampling.returns_one_in {
        1 => String::new(),
        one_in => format!(", one of {one_in} consecutive returns"),
    };
    let scored = format!("{}{drawn}{seed}", counted(sampling.frames_scored, "scan"));
    let lines = [
        ("dmp", report.dmp_version.clone()),
        ("scored", scored),
        (
            "voxel",
            format!(
                "{:.3} m, discs of {:.3} m, tiles of {:.1} m",
                config.voxel_m, config.disc_radius_m, config.tile_edge_m
            ),
        ),
        ("segments", segments_in_words(report.inputs.runs.iter().map(|run| &run.segments))),
        (
            "ranges",
            format!(
                "{} to {} m, predicted up to {} m",
                config.min_range_m, config.max_range_m, config.horizon_m
            ),
        ),
        (
            "every",
            if config.every == 1 { "all scans".to_owned() } else { format!("one scan of {}", config.every) },
        ),
        ("time offset", format!("{} s", config.time_offset_s)),
        ("range noise", format!("{}, for the raw log-likelihood", noise(config))),
        ("price of a miss", {
            let widest_m = config.scales.lengths().widest_m();
            format!("{} of {} m² in R_cv({widest_m})", config.miss_price, widest_m * widest_m)
        }),
    ];
    terms(lines.into_iter().chain(vehicle.map(|vehicle| ("vehicle", vehicle))))
}

/// The noise of the sensor, in words.
fn noise(config: &ConfigReport) -> String {
    match (config.sigma_m, &config.depth_noise) {
        (None, Some(noise)) => {
            format!("{} m + {} /m · (z − {} m)²", noise.least_m, noise.growth_per_m, noise.nearest_m)
        }
        (sigma_m, _) => format!("{} m", sigma_m.unwrap_or(0.0)),
    }
}

fn returns(report: &Report) -> String {
    let inputs = &report.inputs;
    let row = |what: &str, number: u64| vec![cell(what, "name"), cell(&count(number), "")];
    let mut rows = vec![row("used", inputs.returns_used)];
    let dropped = inputs.dropped.0.iter().filter(|(_, number)| **number > 0);
    rows.extend(
        dropped.map(|(reason, number)| row(&format!("dropped: {}", reason.replace('_', " ")), *number)),
    );
    rows.push(row("all", inputs.returns));
    table("Returns", &[head("what became of them", "", "name"), head("returns", "", "")], &rows)
}

fn effort(report: &Report) -> String {
    let (timing, memory) = (&report.timing, &report.memory);
    terms([
        ("time", format!("{} on {}", duration(timing.total_s), counted(timing.threads as u64, "thread"))),
        (
            "memory",
            format!(
                "{} of {}",
                memory.peak_anon_bytes.map_or(NONE.to_owned(), bytes),
                bytes(memory.budget_bytes as u64)
            ),
        ),
        ("disk", bytes(memory.disk_bytes)),
    ])
}
