//! A quick score: few scans of the log, and more until all pairs of runs are decided.

use dmp_log::LogOutline;
use dmp_report::{PairReport, QuickReport, Report, Verdict};
use dmp_runs::{Config, DriftPairs, EvaluateError, Run, SettingName, Watch};

use crate::evaluate::evaluate_look;

/// Every so many scans are scored at the looks, one after the other. All looks together score less than half of the scans.
const STEPS: [usize; 4] = [32, 16, 8, 4];

/// With fewer scans verdicts are rare.
const FEWEST_SCANS: usize = 100;

/// Where no run has this share of its returns on what other scans saw, the scans are too far apart for the sensor.
const LEAST_COVERAGE: f64 = 0.1;

/// Every so many scans of a log of `scans` scans are scored by the looks of [`evaluate_quick`]; none where it has too few.
///
/// ```
/// assert_eq!(dmp::quick_steps(12_000), [32, 16, 8, 4]);
/// assert_eq!(dmp::quick_steps(1000), [8, 4]);
/// assert!(dmp::quick_steps(399).is_empty());
/// ```
pub fn quick_steps(scans: usize) -> Vec<usize> {
    STEPS.into_iter().filter(|step| scans / step >= FEWEST_SCANS).collect()
}

/// Scores `runs` on every 32nd scan of the log that `outline` describes, then on every 16th, 8th and 4th, until all pairs of
/// runs are decided, mixed or the same, and a run has a tenth of its returns on what other scans saw. Scans that are not scored
/// are not read, unless they are packed together with others.
///
/// A look is the [`evaluate`](crate::evaluate) of [`Config::every`], without drift: its maps are made of the scans that it
/// scores; `watch` follows one after the other. Each has the scans of the one before. The looks share the error rate in
/// equal parts (Bonferroni's inequality). `docs/accuracy.md` compares it with all scans.
///
/// # Errors
/// As [`evaluate`](crate::evaluate); when the log has too few scans ([`quick_steps`]), and for settings that choose scans
/// themselves or keep what one look has done.
pub fn evaluate_quick<'a>(
    outline: &'a LogOutline,
    runs: &'a [Run],
    config: &Config,
    watch: impl Into<Watch<'a>>,
) -> Result<Report, EvaluateError> {
    let watch = watch.into();
    let scans = outline.scans().len();
    let steps = quick_steps(scans);
    check(config, scans, &steps)?;
    let looks = steps.len() as u32;
    let mut last = None;
    for (number, &every) in (1..).zip(&steps) {
        let wanted: Vec<usize> = (0..scans).step_by(every).collect();
        let log = outline.open(&wanted)?;
        let config = Config { every, drift: DriftPairs::None, ..config.clone() };
        let mut report = evaluate_look(log.as_ref(), runs, &config, looks, watch)?;
        let bytes = bytes_of(outline, &wanted);
        report.inputs.scans = scans;
        report.sampling.quick = Some(QuickReport { look: number, looks, bytes });
        let is_enough = is_enough(&report);
        last = Some(report);
        if is_enough {
            break;
        }
    }
    last.ok_or_else(|| too_few(scans))
}

/// Whether all pairs are decided, and by enough returns.
fn is_enough(report: &Report) -> bool {
    let is_open = |pair: &PairReport| pair.verdict == Verdict::Undecided;
    !report.pairs.iter().any(is_open) && report.runs.iter().any(|run| run.coverage >= Some(LEAST_COVERAGE))
}

/// Bytes of what these scans are packed in.
fn bytes_of(outline: &LogOutline, wanted: &[usize]) -> u64 {
    let scans = outline.scans();
    let groups = wanted.chunk_by(|&a, &b| scans[a].group == scans[b].group);
    groups.map(|group| scans[group[0]].bytes).sum()
}

fn check(config: &Config, scans: usize, steps: &[usize]) -> Result<(), EvaluateError> {
    let bad = |value: &str, why| Err(EvaluateError::setting(SettingName::Quick, value, why));
    if steps.is_empty() {
        return Err(too_few(scans));
    }
    if config.every != 1 {
        return bad("with a number of scans", "it chooses them itself");
    }
    if config.save_maps.is_some() || config.checkpoint_every.is_some() || config.resume {
        return bad("with a setting that keeps work", "it scores several times");
    }
    Ok(())
}

fn too_few(scans: usize) -> EvaluateError {
    let value = format!("on {scans} scans");
    EvaluateError::setting(SettingName::Quick, value, "they are too few to choose among: score all")
}
