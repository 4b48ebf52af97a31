//! The table of the runs.

use dmp_report::Report;

use super::html::{cell, head, table, terms};
use crate::plot::escape;
use crate::text::{NONE, confidence, digits};
use crate::words::{Ranking, RankingRow, beside, legend, more_is_better};

/// Width of the bars that show a score with its interval, pixels.
const BAR_PX: f64 = 160.0;

/// The table, and what its columns mean.
pub(super) fn ranking(report: &Report) -> String {
    let ranking = crate::ranking(report);
    let top_m2 =
        ranking.rows.iter().filter_map(|row| row.interval_m2).map(|[_, high]| high).fold(0.0, f64::max);
    let mut heads: Vec<String> =
        ranking.columns.iter().map(|column| head(&unbroken(&column.title()), column.unit(), "")).collect();
    let interval_title = format!("{} interval", confidence(report.promise.confidence));
    heads.insert(1, head(&interval_title, ranking.unit(), ""));
    let beside = beside(report);
    let of_beside = beside.iter().map(|column| head(column.name, column.unit, ""));
    heads.splice(0..0, [head("rank", "", ""), head("run", "", "name")].into_iter().chain(of_beside));
    let row = |(place, row): (usize, &RankingRow<'_>)| {
        let mut cells: Vec<String> = row.cells.iter().map(|text| cell(text, "")).collect();
        cells.insert(1, format!("<td>{}</td>", whisker(&ranking, row, top_m2)));
        let name = format!("<th scope=\"row\" class=\"name\">{}</th>", escape(&row.marked_name(report)));
        let of_beside = beside.iter().map(|column| cell(&column.cells[place], ""));
        cells.splice(0..0, [cell(&row.rank, ""), name].into_iter().chain(of_beside));
        cells
    };
    let caption = format!("Best first; less is better, but for {}", more_is_better());
    let rows: Vec<Vec<String>> = ranking.rows.iter().enumerate().map(row).collect();
    let mut shown: Vec<&str> = ranking.columns.iter().map(|column| column.column.name).collect();
    shown.extend(beside.iter().map(|column| column.name));
    let meanings = terms(legend(report, &shown, false));
    table(&caption, &heads, &rows)
        + "<details><summary>What the columns mean</summary>\n"
        + &meanings
        + "</details>\n"
}

/// A number stays on the line of its unit.
fn unbroken(title: &str) -> String {
    title.strip_suffix(" m").map_or_else(|| title.to_owned(), |number| format!("{number}\u{a0}m"))
}

/// A dot at the score, with a line over its interval, and the interval in words.
fn whisker(ranking: &Ranking<'_>, row: &RankingRow<'_>, top_m2: f64) -> String {
    let (Some(value_m2), Some([low_m2, high_m2])) = (row.value_m2, row.interval_m2) else {
        return NONE.to_owned();
    };
    let x =
        |square_m2: f64| 6.0 + (BAR_PX - 12.0) * (square_m2.max(0.0) / top_m2.max(f64::MIN_POSITIVE)).sqrt();
    let [low, high] = [low_m2, high_m2].map(|square_m2| digits(ranking.root_of(square_m2)));
    let unit = ranking.unit();
    let [from, at, to] = [low_m2, value_m2, high_m2].map(x);
    format!(
        "<svg role=\"img\" aria-label=\"{low} to {high} {unit}\" width=\"{BAR_PX:.0}\" height=\"14\" viewBox=\"0 0 {BAR_PX:.0} 14\">\
         <path d=\"M0 7H{BAR_PX:.0}\" stroke=\"var(--line)\"/><path d=\"M{from:.1} 7H{to:.1}M{from:.1} 3v8M{to:.1} 3v8\" \
         stroke=\"var(--ink)\" stroke-width=\"1.5\"/><circle cx=\"{at:.1}\" cy=\"7\" r=\"4\" fill=\"var(--accent)\"/></svg>\
         <br>{low} to {high}"
    )
}
