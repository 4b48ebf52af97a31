//! What is in a log, for a person.

use std::io::{self, Write};

use dmp::Pairing;
use dmp_draw::text::{self, NONE, Side, Table, count, counted, digits, seconds};

use super::found::{Camera, Frame, Info, Scans, Stream, Topic, TrajectoryInfo};
use crate::console::tell;

/// Writes what is in a log for a person.
pub(super) fn info(out: &mut impl Write, info: &Info) -> io::Result<()> {
    tell!(out, "{}", info.log)?;
    let mut table = Table::new([Side::Left, Side::Left]);
    table.row(["format", info.format]);
    table.row(["size".to_owned(), format!("{}, {}", text::bytes(info.bytes), info.fingerprint)]);
    table.write(out, "  ")?;
    if !info.topics.is_empty() {
        writeln!(out, "\nTopics")?;
        let mut table = Table::new([Side::Left, Side::Left, Side::Right, Side::Right, Side::Left]);
        for topic in &info.topics {
            let rate = topic.rate_hz.map_or_else(|| NONE.to_owned(), |hz| format!("{} Hz", digits(hz)));
            let (name, kind) = (topic.name.clone(), topic.message_type.clone());
            table.row([name, kind, counted(topic.messages, "message"), rate, recorded(topic)]);
        }
        table.write(out, "  ")?;
    }
    if info.streams.is_empty() {
        writeln!(out, "\nNo scans that can be read")?;
    }
    for scans in &info.streams {
        stream(out, scans)?;
    }
    list(out, "\nFrames (/tf_static), child in parent: x,y,z,qx,qy,qz,qw", info.frames.iter().map(frame))?;
    let scans = info.streams.iter().find_map(|stream| stream.scans.as_ref()).map_or(0, |scans| scans.scans);
    for run in &info.trajectories {
        trajectory(out, run, scans)?;
    }
    list(out, "\nDamage", info.damage.iter().map(|lost| format!("{}: {}", lost.place, lost.what)))
}

/// A frame as `--extrinsic` would take it.
fn frame(frame: &Frame) -> String {
    let numbers: Vec<String> = frame.parent_from_child.iter().map(f64::to_string).collect();
    format!("{} in {}: {}", frame.child, frame.parent, numbers.join(","))
}

/// When a topic was recorded.
fn recorded(topic: &Topic) -> String {
    let Some([first, last]) = topic.span_ns else { return String::new() };
    let s = |ns: u64| ns as f64 / 1e9;
    format!("{:.3} to {:.3} s", s(first), s(last))
}

fn stream(out: &mut impl Write, stream: &Stream) -> io::Result<()> {
    writeln!(out)?;
    match &stream.topic {
        Some(topic) => tell!(out, "Scans of {topic}")?,
        None => writeln!(out, "Scans")?,
    }
    let mut table = Table::new([Side::Left, Side::Left]);
    if let Some(problem) = &stream.problem {
        table.row(["problem", problem.as_str()]);
    }
    if let Some(scans) = &stream.scans {
        scan_rows(&mut table, scans, stream.problem.is_some());
    }
    table.write(out, "  ")?;
    let lost = stream.damage.iter().map(|lost| format!("{}: {}", lost.place, lost.what));
    list(out, "  lost", lost)
}

fn scan_rows(table: &mut Table, scans: &Scans, has_problem: bool) {
    if let Some(frame_id) = &scans.frame_id {
        table.row(["frame", frame_id]);
    }
    let fields: Vec<String> = scans
        .fields
        .iter()
        .map(|field| {
            let unused = if field.meaning == "not_used" { ", not used" } else { "" };
            format!("{} ({}{unused})", field.name, field.kind)
        })
        .collect();
    table.row(["point".to_owned(), format!("{}; {} bytes", fields.join(" "), scans.point_bytes)]);
    let none = if has_problem { "not understood" } else { "none" };
    table.row(["point times", scans.point_times.as_deref().unwrap_or(none)]);
    if let Some(camera) = &scans.camera {
        table.row(["camera".to_owned(), camera_text(camera)]);
    }
    table.row(["scans".to_owned(), count(scans.scans as u64)]);
    table.row(["returns".to_owned(), returns(scans)]);
    table.row(["stamps".to_owned(), stamps(scans.span_ns, scans.period_ns)]);
    if scans.steps_back > 0 {
        table.row([
            "out of order".to_owned(),
            format!("stamps go backwards {} times", count(scans.steps_back as u64)),
        ]);
    }
    if scans.same_stamp > 0 {
        table.row([
            "repeated".to_owned(),
            format!("{} with the stamp of another", counted(scans.same_stamp as u64, "scan")),
        ]);
    }
    for note in &scans.notes {
        table.row(["note", note.as_str()]);
    }
}

fn camera_text(camera: &Camera) -> String {
    let ([width, height], [fx, fy], [cx, cy]) = (camera.size_px, camera.focal_px, camera.centre_px);
    let [k1, k2, p1, p2, k3] = camera.distortion;
    let lens = if camera.distortion == [0.0; 5] {
        String::new()
    } else {
        format!(", k1 {k1}, k2 {k2}, p1 {p1}, p2 {p2}, k3 {k3}")
    };
    let units = camera.units_per_m.map_or(String::new(), |units| format!("; {units} units a metre"));
    format!("{width} x {height} pixels, fx {fx}, fy {fy}, cx {cx}, cy {cy}{lens}{units}")
}

fn returns(scans: &Scans) -> String {
    let each = scans.returns_per_scan.map_or(String::new(), |each| {
        let [min, median, max] = [each.min, each.median, each.max].map(count);
        format!("; {min} to {max} a scan, median {median}")
    });
    format!("{}{each}", count(scans.returns))
}

/// First and last stamp, the time between them, the time from one to the next.
fn stamps(span_ns: Option<[i64; 2]>, period_ns: Option<i64>) -> String {
    let Some([first, last]) = span_ns else { return "none".to_owned() };
    let (from, to) = (seconds(first), seconds(last));
    let every = period_ns.filter(|&ns| ns > 0).map_or(String::new(), |period_ns| {
        let period_s = seconds(period_ns);
        format!(", one every {} ({} Hz)", text::duration(period_s), digits(1.0 / period_s))
    });
    let span = text::duration(seconds(last.saturating_sub(first)));
    format!("{from:.3} to {to:.3} s: {span}{every}")
}

fn trajectory(out: &mut impl Write, run: &TrajectoryInfo, scans: usize) -> io::Result<()> {
    writeln!(out)?;
    tell!(out, "Trajectory {} ({})", run.name, run.file)?;
    let mut table = Table::new([Side::Left, Side::Left]);
    table.row(["format".to_owned(), format!("{}, {}", run.format, run.fingerprint)]);
    table.row(["poses".to_owned(), count(run.poses as u64)]);
    table.row(["stamps".to_owned(), stamps(run.span_ns, run.period_ns)]);
    let share =
        if scans == 0 { NONE.to_owned() } else { text::percent(run.scans_within as f64 / scans as f64) };
    let within = count(run.scans_within as u64);
    let scans_text = counted(scans as u64, "scan");
    let pairing = if run.pairing == Pairing::ByStamp {
        format!("by stamp: {within} of {scans_text} ({share} %) lie within its time")
    } else if run.poses == scans {
        "line by line: the n-th pose belongs to the n-th scan".to_owned()
    } else {
        let poses = counted(run.poses as u64, "pose");
        format!("impossible: {poses} for {scans_text}, and without stamps there must be as many")
    };
    table.row(["pairing".to_owned(), pairing]);
    for (title, number) in [("sorted", run.out_of_order), ("repeated", run.repeated)] {
        if number > 0 {
            table.row([title.to_owned(), counted(number as u64, "pose")]);
        }
    }
    for note in &run.notes {
        table.row(["note", note]);
    }
    table.write(out, "  ")
}

fn list(out: &mut impl Write, title: &str, lines: impl ExactSizeIterator<Item = String>) -> io::Result<()> {
    if lines.len() > 0 {
        writeln!(out, "{title}")?;
    }
    lines.into_iter().try_for_each(|line| tell!(out, "  {line}"))
}
