//! The ranking for a person.

use std::io::{self, Write};

use dmp::ScaleScores;
use dmp_draw::text::{self, NONE, Side, Table, counted, digits, percent};

use crate::console::tell;

use super::result::{AcceptedResult, CandidateResult, LoopsResult};

/// Square centimetres in a square metre.
const CM2: f64 = 1e4;

pub(super) fn result(out: &mut impl Write, result: &LoopsResult) -> anyhow::Result<()> {
    let inputs = &result.inputs;
    let (vertices, edges) = (text::count(inputs.vertices as u64), counted(inputs.edges as u64, "edge"));
    let without = &result.without;
    tell!(
        out,
        "{}: {vertices} vertices, {edges}; optimised: chi² {} to {}",
        inputs.graph,
        digits(without.chi2_before),
        digits(without.chi2)
    )?;
    if let Some(log) = inputs.log.as_ref().and_then(|log| log.patches.as_ref()) {
        let voxel = result.config.voxel_m.map_or(NONE.to_owned(), digits);
        writeln!(
            out,
            "{} of {} keyframes have scans; {} used; voxels {voxel} m; {} cast into each map",
            text::count(log.keyframes_with_scans as u64),
            text::count(inputs.vertices as u64),
            counted(log.returns_used, "return"),
            counted(log.rays as u64, "ray")
        )?;
    }
    let by_map = result.config.ranked_by != "graph";
    match (by_map, &without.r_near_m2) {
        (true, Some(near)) => {
            let scale_m = result.config.scale_m.unwrap_or_default();
            writeln!(out, "without candidates: R_near({scale_m} m) {} cm\n", root_cm(near))?;
        }
        _ => writeln!(out, "no log: ranked by how much the sum of squares grows\n")?,
    }
    table(out, result, by_map)?;
    if !result.skipped.is_empty() {
        writeln!(out, "\nskipped: {}", counted(result.skipped.len() as u64, "candidate"))?;
        for skipped in &result.skipped {
            let ends =
                skipped.from.zip(skipped.to).map_or(String::new(), |(from, to)| format!(" ({from} to {to})"));
            tell!(out, "  {}{ends}: {}", skipped.place, skipped.why)?;
        }
    }
    if let Some(accepted) = &result.accepted {
        writeln!(out)?;
        accepted_ones(out, accepted, by_map)?;
    }
    if let Some(truth) = &result.truth {
        writeln!(
            out,
            "\naverage precision {}: {} true, {} false, {} without a label; recall without a false one {} %",
            digits(truth.average_precision),
            truth.true_candidates,
            truth.false_candidates,
            truth.unlabelled,
            percent(truth.recall_without_false)
        )?;
    }
    if let Some(why) = &result.truth_withheld {
        writeln!(out)?;
        tell!(out, "no precision and recall: {why}")?;
    }
    let timing = &result.timing;
    let accept = if result.accepted.is_some() {
        format!(", accepting {}", text::duration(timing.accept_s))
    } else {
        String::new()
    };
    writeln!(
        out,
        "\n{}: reading {}, ranking {}{accept}",
        text::duration(timing.total_s),
        text::duration(timing.read_s),
        text::duration(timing.rank_s)
    )?;
    Ok(())
}

fn table(out: &mut impl Write, result: &LoopsResult, by_map: bool) -> io::Result<()> {
    let labelled = result.candidates.iter().any(|candidate| candidate.label.is_some());
    let ranks = format!("R_near {} m", result.config.scale_m.unwrap_or_default());
    let mut head = vec!["", "from", "to"];
    let mut units = vec!["", "", ""];
    if by_map {
        head.extend([ranks.as_str(), "change", "99 %"]);
        units.extend(["cm", "cm²", "cm²"]);
    }
    head.extend(["moved", "turned", "chi²", "its own"]);
    units.extend(["m", "deg", "+", ""]);
    if labelled {
        head.push("label");
        units.push("");
    }
    let sides: Vec<Side> =
        (0..head.len()).map(|k| if k == 5 && by_map { Side::Left } else { Side::Right }).collect();
    let mut table = Table::new(sides);
    table.row(head);
    table.row(units);
    for (rank, candidate) in result.candidates.iter().enumerate() {
        table.row(row(rank + 1, candidate, by_map, labelled));
    }
    table.write(out, "")
}

fn row(rank: usize, candidate: &CandidateResult, by_map: bool, labelled: bool) -> Vec<String> {
    let mut row = vec![rank.to_string(), candidate.from.to_string(), candidate.to.to_string()];
    if by_map {
        row.push(candidate.r_near_m2.as_ref().map_or(NONE.to_owned(), root_cm));
        row.push(candidate.change_m2.map_or(NONE.to_owned(), |change| signed(change * CM2)));
        let interval = |[low, high]: [f64; 2]| format!("{} to {}", signed(low * CM2), signed(high * CM2));
        row.push(candidate.change_ci99_m2.map_or(NONE.to_owned(), interval));
    }
    row.extend([
        digits(candidate.largest_move_m),
        digits(candidate.largest_turn_rad.to_degrees()),
        digits(candidate.chi2_change),
        digits(candidate.own_chi2),
    ]);
    if labelled {
        row.push(candidate.label.map_or(NONE, |label| if label { "true" } else { "false" }).to_owned());
    }
    row
}

fn accepted_ones(out: &mut impl Write, accepted: &AcceptedResult, by_map: bool) -> io::Result<()> {
    let of = accepted.decisions.len();
    let score = match (by_map, accepted.r_near_m2) {
        (true, Some(m2)) => format!("R_near {} cm, ", digits(100.0 * m2.sqrt())),
        _ => String::new(),
    };
    writeln!(
        out,
        "accepted {} of {}: {score}chi² {}",
        text::count(accepted.accepted as u64),
        text::count(of as u64),
        digits(accepted.chi2)
    )?;
    for decision in &accepted.decisions {
        let label = decision.label.map_or("", |label| if label { " (true)" } else { " (false)" });
        let what = decision.why_not.as_deref().map_or("accepted".to_owned(), |why| format!("not: {why}"));
        tell!(out, "  {} to {}{label}: {what}", decision.from, decision.to)?;
    }
    if let (Some(precision), Some(recall)) = (accepted.precision, accepted.recall) {
        writeln!(out, "  precision {} %, recall {} %", percent(precision), percent(recall))?;
    }
    Ok(())
}

fn root_cm(near: &ScaleScores) -> String {
    near[1].map_or(NONE.to_owned(), |m2| digits(100.0 * m2.sqrt()))
}

fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", digits(value)) } else { digits(value) }
}
