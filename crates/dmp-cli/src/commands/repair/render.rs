//! A repair for a person.

use std::io::{self, Write};
use std::path::Path;

use dmp::{Basis, Measured, RunDrift, RunReport, Verdict};
use dmp_draw::metres;
use dmp_draw::text::{NONE, Side, Table, counted};

use super::result::{DriftResult, RepairResult, RoundResult, ScoreResult};
use crate::console::tell;

/// Writes what was done, and both runs beside each other. `recording` is what the log is called: a drive or a recording.
pub(super) fn result(
    out: &mut impl Write,
    result: &RepairResult,
    recording: &str,
    output: &Path,
) -> io::Result<()> {
    tell!(out, "{}", sentence(result, recording))?;
    if let Some(round) = result.shown_round() {
        writeln!(out, "{}", loops(round, result.rounds.len()))?;
    }
    if let (Some(drift), Some(score)) = (&result.drift, &result.score) {
        writeln!(out)?;
        table(out, drift, score)?;
        if let Some(pair) = &score.pair {
            let verdict = match &pair.verdict {
                Verdict::Better { run, .. } => format!("{run} is better"),
                Verdict::Mixed { run, .. } => format!("{run} is better on the whole"),
                Verdict::Same => "both maps are the same".to_owned(),
                Verdict::Undecided => "the scans do not decide which map is better".to_owned(),
            };
            let at = pair.verdict.decided_at_m().map(|m| format!(", decided at {} {m} m", pair.basis));
            writeln!(out)?;
            tell!(out, "By the score of both: {verdict}{}.", at.unwrap_or_default())?;
        }
    }
    if result.is_written {
        tell!(out, "{}: the repaired run", output.display())?;
    } else {
        tell!(out, "The run is not changed; {} is not written.", output.display())?;
    }
    Ok(())
}

fn median(drift: &RunDrift) -> String {
    drift.median_m.value.map_or_else(|| "an unknown length".to_owned(), metres)
}

fn sentence(result: &RepairResult, recording: &str) -> String {
    let run = &result.run;
    match (result.outcome, &result.drift) {
        ("repaired", Some(drift)) => {
            let [before, after] = [&drift.before, &drift.after].map(|drift| match drift.pairs_lost {
                0 => median(drift),
                lost => format!("{} and lost at {lost} of {}", median(drift), drift.pairs_measured),
            });
            format!("At revisits of the {recording}, {run} was off by {before} and is now off by {after}.")
        }
        ("worse", _) => format!("{run} repaired makes a worse map than {run}."),
        ("no revisit", _) => {
            format!("The {recording} has no revisit: there is nothing to repair a run by.")
        }
        ("nothing measured", _) => {
            "No two visits to a place could be registered: how far the run is off is unknown.".to_owned()
        }
        ("nothing to repair", _) => {
            format!(
                "At revisits, {run} is off by no more than the measurement error: there is nothing to repair."
            )
        }
        _ => format!("None of the detected loops makes the map of {run} better."),
    }
}

impl RepairResult {
    /// The last round that put anything into the graph, or the last.
    fn shown_round(&self) -> Option<&RoundResult> {
        self.rounds.iter().rev().find(|round| round.accepted > 0).or(self.rounds.last())
    }
}

fn loops(round: &RoundResult, rounds: usize) -> String {
    let pairs = counted(round.pairs_measured as u64, "pair");
    let answers = format!("{pairs} of visits to the same places, {} with an answer", round.constraints);
    let taken = match (round.consistent, round.accepted) {
        (0, _) => String::new(),
        (agree, accepted) => {
            let rounds = counted(rounds as u64, "round");
            format!(", of which {agree} agree with each other and {accepted} are accepted; in {rounds}")
        }
    };
    let moved = match round.accepted {
        0 => String::new(),
        _ => format!("; poses move by {} at most", metres(round.largest_move_m)),
    };
    answers + &taken + &moved
}

fn table(out: &mut impl Write, drift: &DriftResult, score: &ScoreResult) -> io::Result<()> {
    let scales: Vec<(Basis, f64)> = [Basis::CrossValidated, Basis::Near]
        .into_iter()
        .flat_map(|basis| score.before.scores(basis).iter().map(move |(scale_m, _)| (basis, scale_m)))
        .collect();
    let mut table = Table::new([[Side::Left].as_slice(), &vec![Side::Right; 3 + scales.len()]].concat());
    let heads = ["run", "off, median", "RMS", "pairs"].map(str::to_owned);
    let of_scales = scales.iter().map(|(basis, scale_m)| format!("{basis} {scale_m} m"));
    table.row(heads.into_iter().chain(of_scales));
    for (drift, report) in [(&drift.before, &score.before), (&drift.after, &score.after)] {
        table.row(row(drift, report, &scales));
    }
    table.write(out, "")
}

fn row(drift: &RunDrift, report: &RunReport, scales: &[(Basis, f64)]) -> Vec<String> {
    let or_none = |value: Option<f64>| value.map_or_else(|| NONE.to_owned(), metres);
    let of = |measured: &Measured| or_none(measured.value);
    let mut cells = vec![report.name.clone(), of(&drift.median_m), of(&drift.rms_m), drift.pairs.to_string()];
    let score = |&(basis, scale_m): &(Basis, f64)| or_none(report.scores(basis).at(scale_m).map(f64::sqrt));
    cells.extend(scales.iter().map(score));
    cells
}
