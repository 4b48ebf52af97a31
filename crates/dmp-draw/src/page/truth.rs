//! Runs beside ground truth as one HTML page.

use super::html::{
    Document, bar, cell, figure, head, line_keys, list, paragraph, section, table, terms, wide,
};
use super::{LINES, PLOT_PX};
use crate::colour::bad_colours;
use crate::plot::escape;
use crate::text::{count, counted};
use crate::truth::{
    LEVELS, Over, Side, TruthPlots, TruthRun, angles, coloured_way, error_over, errors_of_all, places,
    shares_of_all, ways_of_all,
};

/// Height of a way from above, and of one of three plots that belong together, pixels.
const WAY_PX: f64 = 420.0;
const THIRD_PX: f64 = 190.0;
const REFERENCE: &str = "stroke=\"var(--muted)\" stroke-width=\"1.5\" stroke-dasharray=\"5 3\"";

/// The page: one file that needs nothing else, light or dark as its reader likes, without scripts.
pub fn truth_page(plots: &TruthPlots) -> String {
    let runs = match plots.runs.as_slice() {
        [only] => only.name.clone(),
        runs => counted(runs.len() as u64, "run"),
    };
    let title = format!("{} of {runs} against {}", plots.metric, plots.reference);
    let mut main = section("result", "Result", &(answer(plots) + &statistics(plots)));
    if plots.runs.len() > 1 {
        main.push_str(&section("all", "All runs", &all(plots)));
    }
    for (k, run) in plots.runs.iter().enumerate() {
        main.push_str(&section(&format!("run-{k}"), &run.name, &one(plots, run)));
    }
    main.push_str(&section("what", "What was compared", &compared(plots)));
    let lines: Vec<String> = plots.title.lines().map(escape).collect();
    let document = Document {
        version: &plots.dmp_version,
        title: &title,
        policy: "",
        lead: &format!("<p class=\"muted\">{}</p>\n", lines.join("<br>")),
        contents: "",
        main: &main,
        footer: "Made by dmp. The numbers are those of evo 1.38.1.",
        scripts: "",
    };
    document.to_html()
}

fn answer(plots: &TruthPlots) -> String {
    let errors = |run: &TruthRun| {
        format!(
            "<strong>{}</strong>: rmse {}, {} at most",
            escape(&run.name),
            escape(&plots.with_unit(run.stats.rmse)),
            escape(&plots.with_unit(run.stats.max))
        )
    };
    let mut order: Vec<&TruthRun> = plots.runs.iter().collect();
    order.sort_by(|a, b| a.stats.rmse.total_cmp(&b.stats.rmse));
    let said = match order.as_slice() {
        [] => return String::new(),
        [only] => format!("{}, over {}.", errors(only), counted(only.errors.len() as u64, "error")),
        [best, .., worst] => {
            format!("The smallest root mean square has {}; the largest {}.", errors(best), errors(worst))
        }
    };
    format!("<p class=\"answer\">{said}</p>\n")
}

/// As `evo_res` has it: a line a run, the smallest of each column strong.
fn statistics(plots: &TruthPlots) -> String {
    let names = plots.runs.first().map(|run| run.stats.named().map(|(name, _)| name)).unwrap_or_default();
    let mut heads = vec![head("run", "", "name")];
    heads.extend(names.map(|name| head(name, if name == "sse" { "" } else { &plots.unit }, "")));
    heads.push(head("errors", "", ""));
    let smallest = |k: usize| {
        let values = plots.runs.iter().map(|run| run.stats.named()[k].1);
        values.fold(f64::INFINITY, f64::min)
    };
    let row = |run: &TruthRun| {
        let mut row = vec![format!("<th scope=\"row\" class=\"name\">{}</th>", escape(&run.name))];
        row.extend(run.stats.named().into_iter().enumerate().map(|(k, (_, value))| {
            if plots.runs.len() > 1 && value <= smallest(k) {
                format!("<td><strong>{value:.6}</strong></td>")
            } else {
                cell(&format!("{value:.6}"), "")
            }
        }));
        row.push(cell(&count(run.errors.len() as u64), ""));
        row
    };
    table("Statistics of the errors", &heads, &plots.runs.iter().map(row).collect::<Vec<_>>())
}

/// Several runs in the same plots.
fn all(plots: &TruthPlots) -> String {
    let runs: Vec<&TruthRun> = plots.runs.iter().take(LINES).collect();
    let mut lines: Vec<(String, String)> = runs
        .iter()
        .enumerate()
        .map(|(k, run)| (format!("stroke=\"var(--s{k})\" stroke-width=\"3\""), run.name.clone()))
        .collect();
    lines.push((REFERENCE.to_owned(), "reference".to_owned()));
    let mut body = line_keys(lines);
    if let Some(more) = plots.runs.len().checked_sub(LINES).filter(|more| *more > 0) {
        body.push_str(&paragraph(&format!(
            "The first {LINES} runs; {more} more have plots of their own below."
        )));
    }
    let [width, height] = PLOT_PX;
    let figures = [
        figure(&ways_of_all(plots, &runs, Side::Above).to_map_element(width, WAY_PX), "from above"),
        figure(
            &shares_of_all(plots, &runs).to_element(width, WAY_PX),
            "which part of the errors is at most how large: the further left, the better",
        ),
        figure(&errors_of_all(plots, &runs, Over::Time).to_element(width, height), "errors over time"),
        figure(
            &errors_of_all(plots, &runs, Over::Way).to_element(width, height),
            "errors over the path of the reference",
        ),
    ];
    body + &wide(&figures)
}

fn one(plots: &TruthPlots, run: &TruthRun) -> String {
    let [width, height] = PLOT_PX;
    let top = plots.top();
    let levels = LEVELS.into_iter().zip([run.stats.mean, run.stats.median, run.stats.rmse]).enumerate();
    let mut lines: Vec<(String, String)> = levels
        .map(|(k, ((name, dashes), level))| {
            let line =
                format!("stroke=\"var(--s{})\" stroke-width=\"2\" stroke-dasharray=\"{dashes}\"", k + 1);
            (line, format!("{name} {}", plots.with_unit(level)))
        })
        .collect();
    lines.push((
        "stroke=\"var(--s4)\" stroke-opacity=\"0.3\" stroke-width=\"9\"".to_owned(),
        format!("mean ± std {}", plots.with_unit(run.stats.std)),
    ));
    lines.push((REFERENCE.to_owned(), "reference".to_owned()));
    let mut body = bar("error 0", &bad_colours(), &format!("{} or more", plots.with_unit(top)));
    body.push_str(&line_keys(lines));
    let figures = [
        figure(&coloured_way(plots, run, top, Side::Above).to_map_element(width, WAY_PX), "from above"),
        figure(
            &coloured_way(plots, run, top, Side::Front).to_element(width, WAY_PX),
            "from the side; height has a scale of its own",
        ),
        figure(&error_over(plots, run, Over::Time).to_element(width, height), "error over time"),
        figure(
            &error_over(plots, run, Over::Way).to_element(width, height),
            "error over the path of the reference",
        ),
        figure(&three(|k| places(plots, run, k).to_element(width, THIRD_PX)), "place over time"),
        figure(&three(|k| angles(plots, run, k).to_element(width, THIRD_PX)), "angles over time"),
    ];
    body + &wide(&figures)
}

fn three(element: impl Fn(usize) -> String) -> String {
    (0..3).map(element).collect()
}

fn compared(plots: &TruthPlots) -> String {
    let poses = |run: &TruthRun| format!("{} compared", counted(run.poses.len() as u64, "pose"));
    let mut rows = vec![("reference", plots.reference.clone())];
    rows.extend(plots.runs.iter().map(|run| (run.name.as_str(), poses(run))));
    terms(rows) + &list("<ul class=\"said\">", plots.notes.iter().map(|note| escape(note)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::tests::plots;

    #[test]
    fn a_page_of_one_run_and_of_several() {
        let mut plots = plots();
        let page = truth_page(&plots);
        assert!(page.contains("<h1>APE of kiss against truth.tum</h1>") && !page.contains(">All runs<"));
        assert_eq!(page.matches("<svg xmlns").count(), 10);
        let mut other = plots.runs[0].clone();
        other.name = "<b>lio</b> & \"more\"".into();
        other.stats.rmse *= 2.0;
        plots.runs.push(other);
        let page = truth_page(&plots);
        assert!(page.contains("APE of 2 runs against truth.tum") && page.contains(">All runs<"));
        assert!(!page.contains("<b>") && page.contains("&lt;b&gt;lio&lt;/b&gt;"));
        assert!(page.contains("The smallest root mean square has <strong>kiss</strong>"));
        for outside in ["http:", "https:", "<script", "src=", "@import", "url("] {
            assert!(!page.replace("http://www.w3.org/2000/svg", "").contains(outside), "{outside}");
        }
    }

    #[test]
    fn a_long_run_has_a_small_page() {
        let mut plots = plots();
        let run = &mut plots.runs[0];
        run.poses = run.poses.repeat(20_000);
        run.errors = (0..run.poses.len()).map(|pose| (pose, (pose % 7) as f64)).collect();
        assert!(run.poses.len() >= 200_000);
        let bytes = truth_page(&plots).len();
        assert!(bytes < 1_000_000, "{bytes}");
    }
}
