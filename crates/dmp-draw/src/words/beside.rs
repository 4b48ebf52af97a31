//! What a table of runs says of each beside its scores: how far it is from the first, and how near it comes back.

use dmp_report::{Report, Verdict};
use dmp_revisit::apart::short_length;
use dmp_revisit::drift::RunDrift;

use crate::text::NONE;

/// A column of the table that is no score.
#[derive(Debug)]
pub struct BesideColumn {
    /// Its name: one or two words.
    pub name: &'static str,
    /// Of the numbers in it, if all have the same.
    pub unit: &'static str,
    /// What it is, in a sentence.
    pub meaning: &'static str,
    /// What stands in it, run by run in their order.
    pub cells: Vec<String>,
}

/// Of a run so many visits where it is lost are named.
const LOST_LISTED: usize = 2;
/// Begins the cell of a run of which visits do not fit.
const LOST: &str = "lost";

/// The columns that there are numbers for.
pub fn beside(report: &Report) -> Vec<BesideColumn> {
    let mut columns = Vec::new();
    let first = report.order.first().map_or("", String::as_str);
    let apart = |name: &String| {
        let apart = report.pair(first, name).and_then(|pair| pair.apart);
        apart.map_or_else(|| NONE.to_owned(), |apart| short_length(apart.worst().0))
    };
    if report.pairs.iter().any(|pair| pair.apart.is_some()) {
        let cells = report.order.iter().map(apart).collect();
        let meaning = "how far it puts points from where the first does, at worst";
        columns.push(BesideColumn { name: "apart", unit: "", meaning, cells });
    }
    if let Some(drift) = &report.drift {
        let of = |name: &String| drift.runs.iter().find(|run| run.name == *name);
        let cells: Vec<String> =
            report.order.iter().map(|name| of(name).map_or(NONE.to_owned(), back)).collect();
        if cells.iter().any(|cell| cell != NONE) {
            let has = |what: fn(&str) -> bool| cells.iter().any(|cell| what(cell));
            let meaning = match (has(|cell| cell == NONE), has(|cell| cell.starts_with(LOST))) {
                (false, false) => "how far it is off where it comes back to a place (median)",
                (true, false) => "how far it is off where it comes back (median; –: nowhere)",
                (false, true) => "how far it is off where it comes back (lost: nothing fits)",
                (true, true) => "how far it is off there (–: comes back nowhere; lost: no fit)",
            };
            columns.push(BesideColumn { name: "revisit error", unit: "", meaning, cells });
        }
    }
    columns.extend(thick(report));
    columns
}

/// Where to look, by numbers of scans: `Farthest from truth at scans: noise 20 to 31, drift 7 to 9` of the runs that are better
/// or worse than the first (of others their own remark says it), and `Lost where these scans meet: drift 3 and 80, 5 and 82`.
pub fn places(report: &Report, shown: impl Fn(&str) -> String) -> Vec<String> {
    let Some((first, others)) = report.order.split_first() else { return Vec::new() };
    let farthest = |name: &String| {
        let pair = report.pair(first, name)?;
        let is_open = matches!(pair.verdict, Verdict::Same | Verdict::Undecided);
        let apart = pair.apart.filter(|_| !is_open)?;
        // A place that is most of the log says nothing.
        let [from, to] = apart.worst_scans();
        (2 * (to - from) < apart.scans).then(|| format!("{} {from} to {to}", shown(name)))
    };
    let lost = |run: &RunDrift| {
        let visits = run.visits.iter().filter(|visits| visits.at_least_m.is_some());
        let mut scans: Vec<String> =
            visits.map(|visits| format!("{} and {}", visits.first.scan, visits.second.scan)).collect();
        let more = scans.len().saturating_sub(LOST_LISTED);
        scans.truncate(LOST_LISTED);
        scans.extend((more > 0).then(|| format!("{more} more")));
        (!scans.is_empty()).then(|| format!("{} {}", shown(&run.name), scans.join(", ")))
    };
    let farthest: Vec<String> = others.iter().filter_map(farthest).collect();
    let lost: Vec<String> = report.drift.iter().flat_map(|drift| &drift.runs).filter_map(lost).collect();
    let said = [
        (format!("Farthest from {} at scans", shown(first)), farthest),
        ("Lost where these scans meet".to_owned(), lost),
    ];
    said.into_iter()
        .filter(|(_, runs)| !runs.is_empty())
        .map(|(what, runs)| format!("{what}: {}", runs.join("; ")))
        .collect()
}

/// How thick the flat places of each run's map are.
fn thick(report: &Report) -> Option<BesideColumn> {
    let map = |name: &String| report.runs.iter().find(|run| run.name == *name).map(|run| &run.map);
    let thick_m = |name: &String| map(name)?.thickness.as_ref().map(|thickness| thickness.median_m);
    let cells: Vec<Option<f64>> = report.order.iter().map(thick_m).collect();
    cells.iter().any(Option::is_some).then(|| BesideColumn {
        name: "thick",
        unit: "cm",
        meaning: "RMS distance of points from the flat surface they lie on (median)",
        cells: cells.into_iter().map(|m| m.map_or(NONE.to_owned(), in_cm)).collect(),
    })
}

fn back(run: &RunDrift) -> String {
    match run.median_m.value {
        _ if run.pairs_lost > 0 => format!("{LOST} {} of {}", run.pairs_lost, run.pairs_measured),
        Some(median_m) => short_length(median_m),
        None => NONE.to_owned(),
    }
}

fn in_cm(m: f64) -> String {
    let cm = 100.0 * m;
    if cm < 0.995 { format!("{cm:.2}") } else { format!("{cm:.1}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_data::sample;
    use dmp_revisit::drift::{VisitPairReport, VisitReport};

    #[test]
    fn places_are_named_of_runs_that_differ_for_sure_and_where_a_run_is_lost() {
        let mut report = sample();
        let said = |report: &Report| places(report, str::to_owned);
        let all = said(&report);
        assert_eq!(all.len(), 1);
        for name in ["noise", "collapsed", "drift"] {
            let apart = report.pair("truth", name).unwrap().apart.unwrap();
            let [first, last] =
                if apart.worst().1 { apart.between.unwrap() } else { apart.within }.worst_scans;
            assert!(all[0].contains(&format!("{name} {first} to {last}")), "{all:?}");
        }
        for (pair, verdict) in report.pairs.iter_mut().zip([Verdict::Same, Verdict::Undecided].iter().cycle())
        {
            pair.verdict = verdict.clone();
        }
        assert!(said(&report).is_empty());
        let visit = |scan| VisitReport { scan, stamp_ns: None, scans: Vec::new() };
        let lost = |first, second| VisitPairReport {
            first: visit(first),
            second: visit(second),
            apart_m: 1.0,
            way_m: 99.0,
            at_m: [0.0; 3],
            off: None,
            at_least_m: Some(6.0),
            why_not: None,
            first_from_second: None,
            covariance: None,
        };
        let drift = report.drift.as_mut().unwrap().runs.iter_mut().find(|run| run.name == "noise").unwrap();
        drift.visits =
            vec![lost(3, 80), VisitPairReport { at_least_m: None, ..lost(4, 81) }, lost(5, 82), lost(6, 83)];
        assert_eq!(said(&report), ["Lost where these scans meet: noise 3 and 80, 5 and 82, 1 more"]);
    }
}
