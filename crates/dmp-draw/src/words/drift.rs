//! Drift in metres, in words and as a table: for terminals and pages alike.

use dmp_reduce::Scales;
use dmp_report::Report;
use dmp_revisit::drift::{Displacement, DriftComparison, DriftReport, Measured, RunDrift};

use crate::text::{NONE, confidence, count, counted, digits};

/// The part this much larger than either of the others is named.
const MOSTLY: f64 = 1.5;
/// What no displacement is known better than, voxels of a visit.
const FLOOR_VOXELS: f64 = 0.02;
/// The smallest part of a displacement that is named, as a share of the whole.
const NAMED: f64 = 0.2;

/// Runs that are listed one by one; of more, the best and the worst.
const MOST_LISTED: usize = 4;

/// Heads of the table of the runs.
pub const DRIFT_HEADS: [&str; 10] = [
    "median",
    "RMS",
    "interval",
    "95 % below",
    "along",
    "sideways",
    "up",
    "rotation",
    "of the path",
    "pairs",
];

/// A length: below a metre in centimetres.
pub fn metres(length_m: f64) -> String {
    if length_m.abs() < 1.0 {
        format!("{} cm", digits(100.0 * length_m))
    } else {
        format!("{} m", digits(length_m))
    }
}

/// By how much something is worse: `1.69 cm worse`, `0.0689 cm better`.
pub fn worse_by(m: f64) -> String {
    format!("{} {}", metres(m.abs()), if m < 0.0 { "better" } else { "worse" })
}

/// As [`worse_by`], of an interval: `1.36 to 2.03 cm worse`, `0.475 cm better to 0.321 cm worse`.
pub fn worse_between([low_m, high_m]: [f64; 2]) -> String {
    if low_m < 0.0 && high_m > 0.0 {
        format!("{} to {}", worse_by(low_m), worse_by(high_m))
    } else {
        let (near_m, far_m) = (low_m.abs().min(high_m.abs()), low_m.abs().max(high_m.abs()));
        format!("{} {}", metres_between([near_m, far_m]), if high_m <= 0.0 { "better" } else { "worse" })
    }
}

/// Two lengths with one unit, that of the larger: `0.93 to 1.75 m`.
pub(crate) fn metres_between([low_m, high_m]: [f64; 2]) -> String {
    if low_m.abs().max(high_m.abs()) < 1.0 {
        format!("{} to {} cm", digits(100.0 * low_m), digits(100.0 * high_m))
    } else {
        format!("{} to {} m", digits(low_m), digits(high_m))
    }
}

fn or_none(value: Option<f64>, shown: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| NONE.to_owned(), shown)
}

/// The first sentence: `Drift at revisits: kiss 59 cm (0.4 % of the path), mostly sideways; lio 1 cm.`
pub fn drift_in_words(report: &DriftReport, scales: Scales) -> String {
    if !report.is_measured() {
        let runs = report.runs.len();
        return format!(
            "{} no place of the {} ({} m travelled), so drift cannot be measured.",
            if runs == 1 {
                "The run revisits".to_owned()
            } else {
                format!("Each of the {runs} runs revisits")
            },
            scales.lengths().recording,
            digits(report.runs.iter().map(|run| run.travel_m).fold(0.0, f64::max)),
        );
    }
    // A centimetre on a drive.
    let floor_m = report.voxel_m * FLOOR_VOXELS;
    let in_words = |runs: &[&RunDrift]| -> String {
        runs.iter().map(|run| run_in_words(run, floor_m)).collect::<Vec<_>>().join("; ")
    };
    let mut known: Vec<(f64, &RunDrift)> =
        report.runs.iter().filter_map(|run| Some((run.median_m.value?, run))).collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    match known[..] {
        // The table has all.
        [(_, best), .., (_, worst)] if report.runs.len() > MOST_LISTED => format!(
            "Drift at revisits, the best and the worst of {} runs: {}.",
            report.runs.len(),
            in_words(&[best, worst])
        ),
        _ => format!("Drift at revisits: {}.", in_words(&report.runs.iter().collect::<Vec<_>>())),
    }
}

/// What was looked at: `12 of 30 pairs of visits to the same places, 1200 m travelled`; of several runs the most of any.
pub fn pairs_in_words(report: &DriftReport) -> String {
    let Some(run) = report.runs.iter().max_by_key(|run| run.pairs_measured) else { return String::new() };
    let pairs = counted(run.pairs_found as u64, "pair");
    let pairs = if run.pairs_measured == run.pairs_found {
        pairs
    } else {
        format!("{} of {pairs}", count(run.pairs_measured as u64))
    };
    let up_to = if report.runs.len() > 1 { "up to " } else { "" };
    format!("{up_to}{pairs} of visits to the same places, {} m travelled", digits(run.travel_m))
}

/// `kiss 59 cm (0.4 % of the path), mostly sideways`, and at how many visits, unless at all. Where it is lost, that comes
/// first: `kiss lost at 4 of 14 visits (surfaces do not fit there), median at least 28.0 cm`.
fn run_in_words(run: &RunDrift, floor_m: f64) -> String {
    let name = &run.name;
    if let (1.., Some(median_m)) = (run.pairs_lost, run.median_m.value) {
        return format!(
            "{name} lost at {} of {} visits (surfaces do not fit there), median at least {}",
            run.pairs_lost,
            run.pairs_measured,
            metres(median_m)
        );
    }
    let answered = run.pairs + run.pairs_in_part;
    let at = if answered < run.pairs_measured {
        format!(", measured at {answered} of {} visits", run.pairs_measured)
    } else {
        String::new()
    };
    let parts = [(run.along_m, "along the path"), (run.sideways_m, "sideways"), (run.up_m, "in height")];
    let mut known: Vec<(f64, &str)> =
        parts.into_iter().filter_map(|(part_m, part)| Some((part_m?, part))).collect();
    let Some(median_m) = run.median_m.value else {
        if run.pairs_measured == 0 {
            return format!("{name} revisits no place");
        }
        if known.is_empty() {
            return format!("{name} has no answer at {}", counted(run.pairs_measured as u64, "visit"));
        }
        let known: Vec<String> =
            known.iter().map(|(part_m, part)| format!("{} {part}", metres(*part_m))).collect();
        return format!("{name} {}{at}, the rest is not observable", known.join(", "));
    };
    if median_m < floor_m {
        return format!("{name} {}, within measurement error{at}", metres(median_m));
    }
    let share = run.of_the_way_percent.map(|percent| format!(" ({} % of the path)", digits(percent)));
    known.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mostly = match known[..] {
        [(most, part), (next, _), ..] if most > MOSTLY * next => format!(", mostly {part}"),
        _ => String::new(),
    };
    format!("{name} {}{}{mostly}{at}", metres(median_m), share.unwrap_or_default())
}

/// The row of a run, under [`DRIFT_HEADS`].
pub fn drift_row(run: &RunDrift) -> Vec<String> {
    let interval = |of: &Measured| of.interval.map_or_else(|| NONE.to_owned(), metres_between);
    let others =
        [(run.pairs_in_part, " in part"), (run.pairs_lost, " lost"), (run.pairs_refused, " refused")];
    let at_least = |length_m: f64| {
        let sign = if run.pairs_lost > 0 { "≥ " } else { "" };
        format!("{sign}{}", metres(length_m))
    };
    let counts = others.iter().filter(|(count, _)| *count > 0);
    let counts: Vec<String> =
        [(run.pairs, "")].iter().chain(counts).map(|(count, what)| format!("{count}{what}")).collect();
    vec![
        or_none(run.median_m.value, at_least),
        or_none(run.rms_m.value, at_least),
        interval(&run.rms_m),
        or_none(run.p95_m.value, at_least),
        or_none(run.along_m, metres),
        or_none(run.sideways_m, metres),
        or_none(run.up_m, metres),
        or_none(run.angle_deg, |deg| format!("{}°", digits(deg))),
        or_none(run.of_the_way_percent, |percent| format!("{} %", digits(percent))),
        counts.join(", "),
    ]
}

/// Two runs compared at revisits.
pub fn drift_compared(pair: &DriftComparison, level: f64) -> String {
    let DriftComparison { a, b, pairs, rms_a_m, rms_b_m, better, .. } = pair;
    let of_run = |name: &str, rms_m: &Option<f64>| format!("{name} {}", or_none(*rms_m, metres));
    let verdict = match better {
        Some(better) => format!("{better} drifts less ({} sure)", confidence(level)),
        None if pair.difference_m2.interval.is_none() => "too few pairs of visits to decide".to_owned(),
        None => "not decided".to_owned(),
    };
    let common = counted(*pairs as u64, "pair");
    format!(
        "{a} and {b}: {verdict}; RMS on {common} in common: {}, {}",
        of_run(a, rms_a_m),
        of_run(b, rms_b_m)
    )
}

/// Where a displacement leads: `58 cm to the left, 12 cm down`; parts that matter, the largest first.
pub(crate) fn which_way(off: &Displacement) -> String {
    let parts = [
        (off.along_m, ["ahead", "behind"]),
        (off.sideways_m, ["to the left", "to the right"]),
        (off.up_m, ["up", "down"]),
    ];
    let mut parts: Vec<(f64, &str)> = parts
        .into_iter()
        .filter_map(|(part_m, [to, back])| part_m.map(|m| (m.abs(), if m < 0.0 { back } else { to })))
        .collect();
    let whole_m = parts.iter().map(|(m, _)| m * m).sum::<f64>().sqrt();
    parts.retain(|(m, _)| *m >= NAMED * whole_m);
    parts.sort_by(|a, b| b.0.total_cmp(&a.0));
    parts.iter().map(|(m, to)| format!("{} {to}", metres(*m))).collect::<Vec<_>>().join(", ")
}

/// Whether drift decides between pairs of runs as the scores do: how often they agree, and each pair where they do not, with
/// what that means. Nothing where not both decide about any pair.
pub fn drift_beside_scores(report: &Report) -> Vec<String> {
    let Some(drift) = &report.drift else { return Vec::new() };
    let (mut agree, mut lines) = (0, Vec::new());
    for pair in &drift.comparisons {
        let by_score = report.pair(&pair.a, &pair.b).filter(|pair| !pair.verdict.is_by_drift());
        let by_score = by_score.and_then(|pair| pair.verdict.better());
        let (Some(by_score), Some(by_drift)) = (by_score, &pair.better) else { continue };
        if by_score == by_drift {
            agree += 1;
            continue;
        }
        let [of_score_m, of_drift_m] =
            if *by_score == pair.a { [pair.rms_a_m, pair.rms_b_m] } else { [pair.rms_b_m, pair.rms_a_m] };
        lines.push(format!(
            "{by_score} and {by_drift}: {by_score} has the better map, but {by_drift} drifts less ({} against {}): scores also \
             see noise and bending within a visit",
            or_none(of_drift_m, metres),
            or_none(of_score_m, metres),
        ));
    }
    if agree > 0 {
        let all = counted((agree + lines.len()) as u64, "pair");
        lines.insert(0, format!("scores and drift agree on {agree} of {all} of runs that both decide"));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_better_is_not_said_to_be_worse_by_less_than_nothing() {
        assert_eq!([0.0169, -0.000_689].map(worse_by), ["1.69 cm worse", "0.0689 cm better"]);
        let intervals = [[0.0136, 0.0203], [-0.0203, -0.0136], [-0.00475, 0.00321]];
        let said = ["1.36 to 2.03 cm worse", "1.36 to 2.03 cm better", "0.475 cm better to 0.321 cm worse"];
        assert_eq!(intervals.map(worse_between), said);
    }

    fn off(parts_m: [Option<f64>; 3]) -> Displacement {
        let [along_m, sideways_m, up_m] = parts_m;
        let json = serde_json::json!({
            "along_m": along_m, "sideways_m": sideways_m, "up_m": up_m, "sigma_m": [0.01, 0.01, 0.01],
            "distance_m": null, "roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "angle_deg": 0.0,
            "in_world_m": [0.0, 0.0, 0.0], "allowance_m": 0.0, "overlap": 0.5, "held": 0.2
        });
        serde_json::from_value(json).unwrap()
    }

    #[test]
    fn two_lengths_have_one_unit() {
        assert_eq!(metres_between([0.927, 1.75]), "0.927 to 1.75 m");
        assert_eq!(metres_between([-0.02, 0.0004]), "-2.00 to 0.0400 cm");
        assert_eq!(metres_between([-2.0, 0.5]), "-2.00 to 0.500 m");
    }

    #[test]
    fn a_displacement_says_where_it_leads() {
        assert_eq!(
            which_way(&off([Some(0.02), Some(0.58), Some(-0.12)])),
            "58.0 cm to the left, 12.0 cm down"
        );
        assert_eq!(which_way(&off([Some(-3.0), None, Some(0.1)])), "3.00 m behind");
        assert_eq!(which_way(&off([None, None, None])), "");
    }
}
