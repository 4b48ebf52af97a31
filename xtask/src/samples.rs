//! The sample data: a small town, its truth and three wrong trajectories, all made by the command itself.

use std::ffi::OsString;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, ensure};
use clap::Args;
use dmp::{Config, Run, evaluate};
use dmp_log::{LogOptions, open_log, read_trajectory};

/// The commands that make the samples, each in the folder that `{}` stands for.
///
/// 100 scans, 200 m, once and a half round a block: a map of 0.3 m voxels is filled, and most returns are
/// predicted by another part of the drive. Coordinates in steps of 2⁻⁸ m keep the log small; 16 poses a
/// second are 8 a scan, and interpolate to 1 mm.
const COMMANDS: [&str; 4] = [
    "simulate town -o {}/town.mcap --truth {}/truth.tum --truth-rate 16 --seed 1 --scans 100 --rate 2 --speed 7 \
     --beams 16 --elevation=-14,6 --azimuth-steps 240 --max-range 80 --resolution 0.00390625",
    "simulate errors {}/truth.tum -o {}/drift.tum --drift-ate 1",
    "simulate errors {}/truth.tum -o {}/noise.tum --noise 3cm,0.1deg --noise-interval 500ms",
    "simulate errors {}/truth.tum -o {}/collapsed.tum --collapse 0.25",
];

/// What they make, and the scores of it.
const FILES: [&str; 6] = ["town.mcap", "truth.tum", "drift.tum", "noise.tum", "collapsed.tum", SCORES];

/// The scores of the samples, to the last bit: the same on every machine, or `--check` fails.
const SCORES: &str = "scores.json";
const RUNS: [&str; 4] = ["truth", "drift", "noise", "collapsed"];

/// All of it may have this many bytes: it is part of every clone of the repository.
const MOST_BYTES: u64 = 3_000_000;

/// Make the sample data in `data-samples/`
#[derive(Debug, Args)]
pub(crate) struct SamplesArgs {
    /// Only compare: fail where a sample differs in a bit from what the command makes
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &SamplesArgs) -> anyhow::Result<()> {
    let samples = crate::workspace::root().join("data-samples");
    let fresh = tempfile::tempdir()?;
    make(fresh.path())?;
    fs::write(fresh.path().join(SCORES), score(fresh.path())?)?;
    let mut total_bytes = 0;
    for file in FILES {
        let made = fs::read(fresh.path().join(file))?;
        total_bytes += made.len() as u64;
        println!("{file:<14} {:>9} bytes", made.len());
        let kept = samples.join(file);
        if arguments.check {
            compare(&kept, &made)?;
        } else {
            fs::create_dir_all(&samples)?;
            fs::write(&kept, made).with_context(|| format!("{}: cannot write", kept.display()))?;
        }
    }
    println!("{:<14} {total_bytes:>9} bytes", "together");
    ensure!(total_bytes <= MOST_BYTES, "{total_bytes} bytes of samples, {MOST_BYTES} are allowed");
    Ok(())
}

/// Runs the commands, in this process.
fn make(folder: &Path) -> anyhow::Result<()> {
    let folder = folder.to_str().context("the temporary folder's name is not UTF-8")?;
    for command in COMMANDS {
        let arguments = command.split_whitespace().map(|argument| argument.replace("{}", folder));
        let exit = dmp_cli::run(["dmp".into()].into_iter().chain(arguments).map(OsString::from));
        ensure!(exit == dmp_cli::Exit::Done, "`dmp {command}` ended with {exit:?}");
    }
    Ok(())
}

/// The report of the samples as JSON, without fields of this machine, folder or version.
fn score(folder: &Path) -> anyhow::Result<String> {
    let log = open_log(&folder.join("town.mcap"), &LogOptions::default())?;
    let run = |name: &str| -> anyhow::Result<Run> {
        Ok(Run::new(name, read_trajectory(&folder.join(name).with_extension("tum"))?.trajectory))
    };
    let runs = RUNS.into_iter().map(run).collect::<anyhow::Result<Vec<_>>>()?;
    let report = evaluate(log.as_ref(), &runs, &Config::default(), ())?;
    let mut json = serde_json::to_value(report)?;
    let top = json.as_object_mut().context("a report is an object")?;
    for of_the_moment in ["timing", "memory", "dmp_version"] {
        top.remove(of_the_moment);
    }
    top.get_mut("inputs")
        .and_then(|inputs| inputs.as_object_mut())
        .context("a report has inputs")?
        .remove("log");
    top.get_mut("drift")
        .and_then(|drift| drift.as_object_mut())
        .context("the samples come back to places")?
        .remove("dmp_version");
    Ok(serde_json::to_string_pretty(&json)? + "\n")
}

fn compare(path: &Path, made: &[u8]) -> anyhow::Result<()> {
    let kept = fs::read(path).with_context(|| format!("{}: cannot read", path.display()))?;
    if kept == made {
        return Ok(());
    }
    let same = kept.iter().zip(made).take_while(|(a, b)| a == b).count();
    anyhow::bail!(
        "{} has {} bytes and is made with {}; the first difference is at byte {same}. \
         If that is intended, run `cargo xtask samples` and commit the samples",
        path.display(),
        kept.len(),
        made.len(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let kept = folder.path().join("a.tum");
        fs::write(&kept, b"1 2 3").unwrap();
        assert!(compare(&kept, b"1 2 3").is_ok());
        let changed = compare(&kept, b"1 2 4").unwrap_err().to_string();
        assert!(changed.contains("a.tum has 5 bytes") && changed.contains("at byte 4"), "{changed}");
        assert!(compare(&kept, b"1 2 3 4").unwrap_err().to_string().contains("at byte 5"));
        assert!(compare(&folder.path().join("b.tum"), b"").is_err());
    }
}
