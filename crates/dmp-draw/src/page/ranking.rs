//! The table of the runs.

use dmp::{Report, RunReport};

use super::html::{cell, head, table, terms};
use crate::columns::{ScoreColumn, columns, is_cross_validated};
use crate::plot::escape;
use crate::text::{NONE, confidence, digits};

/// Width of the bars that show a score with its interval, pixels.
const BAR_PX: f64 = 160.0;

/// The runs in their order, best first.
pub(super) fn in_order(report: &Report) -> impl Iterator<Item = &RunReport> {
    report.order.iter().filter_map(|name| report.runs.iter().find(|run| run.name == *name))
}

/// The table, and what its columns mean.
pub(super) fn ranking(report: &Report) -> String {
    let cross_validated = is_cross_validated(report);
    let columns = columns(report);
    let interval =
        |run: &RunReport| if cross_validated { run.r_cv_interval_m2 } else { run.r_near_interval_m2 };
    let top_m2 = report.runs.iter().filter_map(interval).map(|[_, high]| high).fold(0.0, f64::max);
    let mut heads = vec![head("rank", "", ""), head("run", "", "name")];
    heads.extend(columns.iter().take(1).map(|column| head(&column.title(), column.unit, "")));
    let (unit, per_metre) = columns.first().map_or(("m", 1.0), |column| (column.unit, column.per_metre()));
    let interval_title = format!("{} interval", confidence(report.promise.confidence));
    heads.push(head(&interval_title, unit, ""));
    heads.extend(columns.iter().skip(1).map(|column| head(&column.title(), column.unit, "")));
    let mut rows = Vec::new();
    for (place, run) in in_order(report).enumerate() {
        let above = place.checked_sub(1).and_then(|above| report.order.get(above));
        let tied = above.is_some_and(|above| report.ties.iter().any(|[a, b]| a == above && *b == run.name));
        let rank = if tied { "=".to_owned() } else { (place + 1).to_string() };
        let show = |column: &ScoreColumn| cell(&column.show(run).unwrap_or_else(|| NONE.to_owned()), "");
        let value_m2 = if cross_validated { run.r_cv_m2[0] } else { run.r_near_m2[0] };
        let mut row =
            vec![cell(&rank, ""), format!("<th scope=\"row\" class=\"name\">{}</th>", escape(&run.name))];
        row.extend(columns.iter().take(1).map(show));
        row.push(format!("<td>{}</td>", whisker(value_m2, interval(run), top_m2, (unit, per_metre))));
        row.extend(columns.iter().skip(1).map(show));
        rows.push(row);
    }
    let caption = if report.ties.is_empty() {
        "Best first; less is better, but for coverage and revisit"
    } else {
        "Best first; less is better, but for coverage and revisit; = the run above is not decided to be better"
    };
    table(caption, &heads, &rows) + &meanings(report, cross_validated)
}

/// A dot at the score, with a line over its interval, and the interval in words.
fn whisker(
    value_m2: Option<f64>,
    interval_m2: Option<[f64; 2]>,
    top_m2: f64,
    (unit, per_metre): (&str, f64),
) -> String {
    let (Some(value_m2), Some([low_m2, high_m2])) = (value_m2, interval_m2) else { return NONE.to_owned() };
    let x =
        |square_m2: f64| 6.0 + (BAR_PX - 12.0) * (square_m2.max(0.0) / top_m2.max(f64::MIN_POSITIVE)).sqrt();
    let [low, high] = [low_m2, high_m2].map(|square_m2| digits(per_metre * square_m2.max(0.0).sqrt()));
    let [from, at, to] = [low_m2, value_m2, high_m2].map(x);
    format!(
        "<svg role=\"img\" aria-label=\"{low} to {high} {unit}\" width=\"{BAR_PX:.0}\" height=\"14\" viewBox=\"0 0 {BAR_PX:.0} 14\">\
         <path d=\"M0 7H{BAR_PX:.0}\" stroke=\"var(--line)\"/><path d=\"M{from:.1} 7H{to:.1}M{from:.1} 3v8M{to:.1} 3v8\" \
         stroke=\"var(--ink)\" stroke-width=\"1.5\"/><circle cx=\"{at:.1}\" cy=\"7\" r=\"4\" fill=\"var(--accent)\"/></svg>\
         <br>{low} to {high}"
    )
}

fn meanings(report: &Report, cross_validated: bool) -> String {
    let rms = "root mean square of measured minus predicted range, cut off at the length beside it";
    let scales = report.config.scales;
    let (widest_m, blocked_m) = (scales.lengths().widest_m(), scales.lengths().blocked_m);
    let missing_m = widest_m * report.config.miss_price.sqrt();
    let mut meanings = Vec::new();
    if cross_validated {
        meanings.push((
            "R_cv",
            format!(
                "{rms}; predicted from other parts of the drive, so that no scan vouches for itself; at {widest_m} m a return counts \
                 {} m where that is impossible",
                digits(missing_m)
            ),
        ));
        meanings
            .push(("R_near", "the same with the nearest surfel on the ray, whenever it was seen".to_owned()));
    } else {
        meanings.push(("R_near", format!("{rms}; predicted by the nearest surfel on the ray")));
    }
    meanings.push((
        "DMP",
        "mean square to the first surfel on the ray, not cut off (Zhang & Chen 2021)".to_owned(),
    ));
    if cross_validated {
        meanings.push((
            "coverage",
            "returns predicted from other parts of the drive; revisit: from another visit to the place"
                .to_owned(),
        ));
    }
    meanings.push((
        "miss",
        format!("rays that hit nothing; blocked: that hit something over {blocked_m} m too early"),
    ));
    terms(meanings)
}
