//! Time, memory and I/O of a whole process.

use std::fs;
use std::io::{Read, Seek};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::Context as _;

/// The resources that a process took.
#[derive(Debug, Default)]
pub(super) struct Taken {
    pub(super) wall_s: f64,
    /// Of all threads, user and system.
    pub(super) on_cores_s: f64,
    pub(super) peak_anon_bytes: u64,
    pub(super) read_bytes: u64,
    pub(super) written_bytes: u64,
}

/// Runs a command to its end; its resources, sampled every few milliseconds, and its output.
pub(super) fn taken_by(command: &mut Command) -> anyhow::Result<(Taken, Vec<u8>)> {
    let mut out = tempfile::tempfile()?;
    let start = Instant::now();
    let mut child = command.stdin(Stdio::null()).stdout(out.try_clone()?).stderr(Stdio::piped()).spawn()?;
    let mut taken = Taken::default();
    let status = loop {
        look(&child, &mut taken);
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    taken.wall_s = start.elapsed().as_secs_f64();
    if !status.success() {
        let mut text = String::new();
        child.stderr.take().context("no stderr")?.read_to_string(&mut text)?;
        anyhow::bail!("{command:?}: {status}: {text}");
    }
    out.rewind()?;
    let mut printed = Vec::new();
    out.read_to_end(&mut printed)?;
    Ok((taken, printed))
}

/// Samples the resources of a process; of one that has ended, the last sample stays.
fn look(child: &Child, taken: &mut Taken) {
    let read = |file: &str| fs::read_to_string(format!("/proc/{}/{file}", child.id())).unwrap_or_default();
    let field = |text: &str, name: &str| -> Option<u64> {
        text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
    };
    if let Some(kib) = field(&read("status"), "RssAnon:") {
        taken.peak_anon_bytes = taken.peak_anon_bytes.max(kib * 1024);
    }
    let io = read("io");
    taken.read_bytes = field(&io, "rchar:").unwrap_or(0).max(taken.read_bytes);
    taken.written_bytes = field(&io, "wchar:").unwrap_or(0).max(taken.written_bytes);
    let stat = read("stat");
    // Behind the name, which ends with a parenthesis: user and system time are the 12th and 13th, in hundredths.
    let times: Option<f64> = stat.rsplit_once(')').and_then(|(_, rest)| {
        let fields: Vec<&str> = rest.split_whitespace().collect();
        Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?)
    });
    taken.on_cores_s = (times.unwrap_or(0.0) / 100.0).max(taken.on_cores_s);
}
