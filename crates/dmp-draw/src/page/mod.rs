//! The report as one HTML page.

mod explore;
mod html;
mod inputs;
mod map_check;
mod on_map;
mod ranking;
mod reference;
mod suite;
#[cfg(test)]
mod tests;
mod truth;
mod words;

use dmp_reduce::Basis;
use dmp_report::{Report, Verdict};

use crate::pictures::{Pictures, histogram, metre_decimals, profile};
use crate::plot::escape;
use crate::text::{count, counted};
use explore::SCRIPT;
use html::{Document, figure, keys, list, paragraph, section, wide};
pub use map_check::map_check_page;
use on_map::{cloud, drift, maps, places, trajectories};
pub use suite::suite_page;
pub use truth::truth_page;

/// Runs with a line in plots: as many as there are colours.
const LINES: usize = 6;
/// Size of a plot, pixels.
const PLOT_PX: [f64; 2] = [480.0, 300.0];

/// What a page is made of.
#[derive(Debug, Clone, Copy)]
pub struct PageInput<'a> {
    /// What was found.
    pub report: &'a Report,
    /// Where and when; `None` where nobody watched, as of results that were saved.
    pub pictures: Option<&'a Pictures>,
    /// The run that is taken to be true: where it is worse than others has a section of its own.
    pub reference: Option<&'a str>,
    /// Sentences to stand behind the ranking, as of runs that were not compared, or gates that failed.
    pub remarks: &'a [String],
}

/// The page: one file that needs nothing else, light or dark as its reader likes. It can be read without scripts.
///
/// # Errors
/// Where a picture cannot be encoded.
pub fn page(input: &PageInput<'_>) -> Result<String, png::EncodingError> {
    let report = input.report;
    let name = log_name(report);
    let title = match report.order.as_slice() {
        [only] => format!("Map quality of {only} on {name}"),
        _ => format!("Which map of {name} is best?"),
    };
    // Who is best, how the runs compare and where: the first screen. What is behind that comes after.
    let [above, heights] = input.pictures.map(|pictures| ways(report, pictures)).unwrap_or_default();
    let mut main = verdict(input, &above);
    main.push_str(&warnings(report));
    match input.pictures {
        Some(pictures) => {
            main.push_str(&where_and_when(report, pictures)?);
            main.push_str(&section("trajectories", "All trajectories", &heights));
        }
        None => main.push_str(&section("where", "Where", &paragraph(without_pictures(report)))),
    }
    main.push_str(&pairs(input));
    main.push_str(&section("drift", "Drift at revisits", &drift::drift(report, input.pictures)));
    if let (Some(pictures), Some(reference)) = (input.pictures, input.reference) {
        let body = reference::reference(report, pictures, reference);
        main.push_str(&section("reference", "The reference", &body));
    }
    main.push_str(&section("inputs", "Inputs and settings", &inputs::inputs(report)));
    let scripts =
        format!("{}<script>{SCRIPT}</script>\n<script>{}</script>\n", explore::data(report), cloud::SCRIPT);
    let document = Document {
        version: &report.dmp_version,
        title: &title,
        policy: &format!("img-src data:; script-src '{}' '{}'; ", explore::SCRIPT_HASH, cloud::SCRIPT_HASH),
        lead: &extent(report),
        contents: &explore::contents(&main),
        main: &main,
        footer: "Made by dmp: the Dense Map Posterior (Zhang & Chen, ICIP 2021) for LiDARs and depth cameras, without ground \
                 truth. Scores compare runs of this log under these settings only.",
        scripts: &scripts,
    };
    Ok(document.to_html())
}

fn log_name(report: &Report) -> &str {
    let path = report.inputs.log.trim_end_matches(['/', '\\']);
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn extent(report: &Report) -> String {
    let inputs = &report.inputs;
    let scored = format!("{} of {} scans", count(report.sampling.frames_scored), count(inputs.scans as u64));
    let travelled_m = inputs.runs.iter().map(|run| run.segments.travel_m).fold(0.0, f64::max);
    let way = match travelled_m {
        way_m if way_m < 1000.0 => format!("{way_m:.*} m", metre_decimals(report.config.scales)),
        way_m => format!("{:.1} km", way_m / 1e3),
    };
    format!(
        "<p class=\"muted\">{scored} scored, {} returns, {way} travelled</p>\n",
        count(inputs.returns_used)
    )
}

/// The sentence and the table, beside the trajectories.
fn verdict(input: &PageInput<'_>, above: &str) -> String {
    let answer = crate::words::answer(input.report, words::strong);
    let ranking = ranking::ranking(input.report);
    section(
        "verdict",
        "Verdict",
        &format!(
            "<p class=\"answer\">{answer}</p>\n<div class=\"first\"><div>{ranking}</div><div>{above}</div></div>\n"
        ),
    )
}

/// The trajectories of the best runs. Of runs that are the same one is drawn, with the names of all.
fn ways(report: &Report, pictures: &Pictures) -> [String; 2] {
    let mut names: Vec<String> = report.runs.iter().map(|run| run.name.clone()).collect();
    let mut drawn: Vec<usize> = Vec::new();
    for &run in &pictures.order {
        let name = &report.runs[run].name;
        let is_same =
            |other: &&usize| report.verdict_between(name, &report.runs[**other].name) == Some(&Verdict::Same);
        match drawn.iter().find(is_same) {
            Some(&other) => names[other] = format!("{} = {name}", names[other]),
            None => drawn.push(run),
        }
    }
    drawn.truncate(LINES);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    trajectories::trajectories(pictures, &drawn, &names, PLOT_PX)
}

/// The pairs in words, and what failed.
fn pairs(input: &PageInput<'_>) -> String {
    let said = words::pairs(input.report);
    let remarks = input.remarks.iter().map(|remark| escape(remark));
    let list = list("<ul class=\"said\">", said.into_iter().chain(remarks));
    let lengths = words::lengths(input.report).map(paragraph).unwrap_or_default();
    let promise = crate::words::promise(input.report).as_deref().map(paragraph).unwrap_or_default();
    section("pairs", "Pairs", &[list, lengths, promise].concat())
}

/// Warnings, folded to their number.
fn warnings(report: &Report) -> String {
    let warnings = crate::words::warnings(report);
    if warnings.is_empty() {
        return String::new();
    }
    let heading = counted(warnings.len() as u64, "warning");
    let list = list("<ul>", warnings.iter().map(|warning| escape(warning)));
    format!(
        "<section class=\"warnings\" aria-labelledby=\"warnings\">\n<details><summary><h2 id=\"warnings\">{heading}</h2></summary>\n\
         {list}</details></section>\n"
    )
}

fn without_pictures(report: &Report) -> &'static str {
    match report.sampling.quick {
        Some(_) => "A quick score draws no maps. Score the whole log to see where a run is wrong.",
        None => {
            "This page was made from saved results, which hold no maps. `dmp score --report` shows where runs are wrong."
        }
    }
}

fn where_and_when(report: &Report, pictures: &Pictures) -> Result<String, png::EncodingError> {
    let names: Vec<&str> = report.runs.iter().map(|run| run.name.as_str()).collect();
    let lines: Vec<(usize, &str)> = pictures.order.iter().take(LINES).map(|&run| (run, names[run])).collect();
    let key = keys(lines.iter().enumerate().map(|(k, (_, name))| (format!("var(--s{k})"), *name)));
    let mut key = key.replacen("<ul class=\"keys\"", "<ul class=\"keys\" data-runs", 1);
    if let Some(more) = pictures.order.len().checked_sub(LINES).filter(|more| *more > 0) {
        key.push_str(&paragraph(&format!("The best {LINES} runs; {more} more are not drawn.")));
    }
    let score = pictures.order.first().map_or(Basis::CrossValidated, |&best| pictures.bases[best]);
    let [width, height] = PLOT_PX;
    let over_time = explore::with_id(
        &profile::over_time(pictures, &lines, score).to_element(width, height),
        places::TIME_PLOT,
    );
    let over_way = profile::over_way(pictures, &lines, score).to_element(width, height);
    let by_size = histogram::by_size(&pictures.histograms, &lines).to_element(width, height);
    let plots = [
        figure(&over_time, "residuals over time"),
        figure(&over_way, "residuals over the path"),
        figure(&by_size, "negative: the map has the surface behind the return; positive: in front of it"),
    ];
    let drawn = paragraph(&format!(
        "Maps, pictures and the histogram show {} of the {} scored returns, sampled evenly.",
        count(pictures.sampled),
        count(report.inputs.returns_used)
    ));
    let mut sections = section("maps", "Where: residuals from above", &maps::residuals(pictures, &names)?);
    sections.push_str(&section(
        "difference",
        "Where the best two differ",
        &maps::difference(pictures, &names)?,
    ));
    sections.push_str(&section("cloud", "The maps in three dimensions", &cloud::clouds(pictures, &names)?));
    sections.push_str(&section("coverage", "What the maps can show", &maps::coverage(pictures, &names)?));
    sections.push_str(&section("profile", "When, and how much", &(key + &wide(&plots) + &drawn)));
    sections.push_str(&section(
        "places",
        "Worst places",
        &places::places(pictures, &names, report.drift.as_ref())?,
    ));
    Ok(sections)
}
