//! Where the reference run is worse than others.

use dmp_report::Report;

use super::html::{cell, head, list, paragraph, table};
use crate::page::on_map::times;
use crate::pictures::{Pictures, contests, judged_by_m, metre_decimals};
use crate::plot::escape;
use crate::text::NONE;

/// How the other runs compare with the run of this name, and where they are better.
pub(super) fn reference(report: &Report, pictures: &Pictures, name: &str) -> String {
    let Some(one) = report.runs.iter().position(|run| run.name == name) else {
        return paragraph(&format!("{name} is excluded: see the warnings."));
    };
    let contests = contests(&pictures.frames, report.runs.len(), one, pictures.scales);
    let others = || pictures.order.iter().copied().filter(|&run| run != one);
    if others().next().is_none() {
        return paragraph("There is no other run to compare it with.");
    }
    let mut body = paragraph(&format!(
        "{name} is the reference. Published trajectories are wrong in places too: where another run's map predicts its own scans \
         clearly better, doubt the reference first. A stretch of a few {}s is weak evidence.",
        pictures.scales.lengths().reach_units[0]
    ));
    let [fine_m, wide_m] = judged_by_m(pictures.scales);
    let at = format!("at {fine_m} and {wide_m} m");
    let decimals = metre_decimals(pictures.scales);
    let metres = |m: f64| cell(&format!("{m:.decimals$}"), "");
    let row = |run: usize| {
        let contest = &contests[run];
        let [reference, own] = match &contest.worst {
            Some(scores) => scores.each_ref().map(|score| score.misses(pictures.scales)),
            None => [NONE.to_owned(), NONE.to_owned()],
        };
        vec![
            format!("<th scope=\"row\" class=\"name\">{}</th>", escape(&report.runs[run].name)),
            metres(contest.other_m),
            metres(contest.one_m),
            metres(contest.alike_m),
            cell(&reference, ""),
            cell(&own, ""),
        ]
    };
    let heads = [
        head("run", "", "name"),
        head("better than the reference", "m travelled", ""),
        head("worse", "m travelled", ""),
        head("alike", "m travelled", ""),
        head("at the worst, residuals of the reference", &at, ""),
        head("of the run", &at, ""),
    ];
    let rows: Vec<_> = others().map(row).collect();
    body.push_str(&table("Each run against the reference, stretch by stretch", &heads, &rows));
    body.push_str(&worse(report, pictures, one));
    body
}

/// The places where another run is better, with links to their pictures.
fn worse(report: &Report, pictures: &Pictures, one: usize) -> String {
    let places = pictures.places[one].iter().enumerate().filter_map(|(number, place)| {
        let (best, score) = place.best.as_ref()?;
        let when = place.passes.first().map_or_else(String::new, |pass| times(pictures, pass));
        Some(format!(
            "<a href=\"#place-{one}-{}\">{}</a>: residuals of {}, {} has {}",
            number + 1,
            escape(&when),
            place.score.misses(pictures.scales),
            escape(&report.runs[*best].name),
            score.misses(pictures.scales)
        ))
    });
    let list = list("<ul>", places);
    if list.is_empty() { paragraph("Nowhere is another run clearly better.") } else { list }
}
