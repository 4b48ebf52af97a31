//! The table of the runs.

use dmp_report::Report;

use super::html::{cell, head, table, terms};
use crate::plot::escape;
use crate::text::{NONE, confidence, digits};
use crate::words::{Mood, Ranking, RankingRow, Standing, beside, legend, more_is_better, places, standing};

/// Width of the bars that show a score with its interval, pixels.
const BAR_PX: f64 = 160.0;

/// The table of the runs as a terminal has it, and folded all scores and what the columns mean.
pub(super) fn ranking(report: &Report) -> String {
    let ranking = crate::ranking(report);
    let (beside, first) = (beside(report), report.order.first().map_or("", String::as_str));
    // As in a terminal of 80 columns: the first two scores, and coverage.
    let is_shown = |k: &usize| *k < 2 || ranking.columns[*k].column.name == "coverage";
    let shown: Vec<usize> = (0..ranking.columns.len()).filter(is_shown).collect();
    let head_of = |k: usize| head(&unbroken(&ranking.columns[k].title()), ranking.columns[k].unit(), "");
    let [mut heads, mut all_heads] = [0, 1].map(|_| vec![head("rank", "", ""), head("run", "", "name")]);
    let many = report.order.len() > 1;
    heads.extend(many.then(|| head("verdict", "", "name")));
    heads.extend(beside.iter().map(|column| head(column.name, column.unit, "")));
    heads.extend(shown.iter().map(|&k| head_of(k)));
    all_heads.extend((0..ranking.columns.len()).map(head_of));
    let interval = format!("{} interval", confidence(report.promise.confidence));
    all_heads.insert(3, head(&interval, ranking.unit(), ""));
    let named = |row: &RankingRow<'_>| {
        let name = format!("<th scope=\"row\" class=\"name\">{}</th>", escape(&row.marked_name(report)));
        vec![cell(&row.rank, ""), name]
    };
    let row = |(place, row): (usize, &RankingRow<'_>)| {
        let mut cells = named(row);
        cells.extend(many.then(|| verdict(&standing(report, first, &row.run.name))));
        cells.extend(beside.iter().map(|column| cell(&column.cells[place], "")));
        cells.extend(shown.iter().map(|&k| cell(&row.cells[k], "")));
        cells
    };
    let top_m2 =
        ranking.rows.iter().filter_map(|row| row.interval_m2).map(|[_, high]| high).fold(0.0, f64::max);
    let all_of = |row: &RankingRow<'_>| {
        let mut cells = named(row);
        cells.extend(row.cells.iter().map(|text| cell(text, "")));
        cells.insert(3, format!("<td>{}</td>", whisker(&ranking, row, top_m2)));
        cells
    };
    let rows: Vec<Vec<String>> = ranking.rows.iter().enumerate().map(row).collect();
    let all_rows: Vec<Vec<String>> = ranking.rows.iter().map(all_of).collect();
    let mut names: Vec<&str> = ranking.columns.iter().map(|column| column.column.name).collect();
    names.extend(beside.iter().map(|column| column.name));
    names.extend(many.then_some("verdict"));
    let caption = format!("Best first; less is better, but for {}", more_is_better());
    let places = places(report, str::to_owned);
    [
        table("Best first", &heads, &rows).as_str(),
        &places.iter().map(|said| format!("<p>{}.</p>\n", escape(said))).collect::<Vec<_>>().concat(),
        "<details><summary>All scores, and what the columns mean</summary>\n",
        &table(&caption, &all_heads, &all_rows),
        &terms(legend(report, &names, false)),
        "</details>\n",
    ]
    .concat()
}

fn verdict(standing: &Standing) -> String {
    let class = match standing.mood {
        Some(Mood::Good) => "verdict good",
        Some(Mood::Bad) => "verdict bad",
        _ => "verdict",
    };
    cell(&standing.text, class)
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
