//! How far runs are off where they come back: a table, and arrows on their ways.

use std::collections::HashMap;
use std::fmt::Write as _;

use dmp_reduce::Scales;
use dmp_report::Report;
use dmp_revisit::drift::{Displacement, DriftReport, VisitReport};

use crate::colour::{bad_colours, hex, step};
use crate::page::html::{bar, cell, figure, grid, head, list, paragraph, table};
use crate::page::on_map::overlay;
use crate::page::on_map::overlay::Frame;
use crate::pictures::{Pictures, WorstPlace, distance_m};
use crate::plot::escape;
use crate::words::{
    DRIFT_HEADS, drift_beside_scores, drift_in_words, drift_row, metres, pairs_in_words, which_way,
};

/// Runs whose ways are drawn.
const WAYS: usize = 6;
/// Width of a drawing in its units, and the space around the way.
const WIDTH: f64 = 400.0;
const AROUND: f64 = 24.0;
/// The longest arrows are about as long as this, in the same units.
const ARROW: f64 = 48.0;
/// Times that arrows may be too long.
const FACTORS: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Colours go from the one to the other, alike for each factor, metres of a drive.
const COLOURS_M: [f64; 2] = [0.01, 10.0];
/// The smallest ratio of displacement to standard deviation for which a place has it.
const SIGMAS: f64 = 3.0;
/// Visits within this of a worst place tell of it, metres of a drive beyond its radius.
const NEAR_M: f64 = 5.0;

/// The section: what is said first, the table, and the ways where somebody watched.
pub(crate) fn drift(report: &Report, pictures: Option<&Pictures>) -> String {
    let Some(drift) = &report.drift else { return String::new() };
    let mut body = paragraph(&drift_in_words(drift, report.config.scales));
    if !drift.is_measured() {
        return body;
    }
    body.push_str(&list("<ul class=\"said\">", drift_beside_scores(report).iter().map(|said| escape(said))));
    let heads = [vec![head("run", "", "name")], DRIFT_HEADS.map(|title| head(title, "", "")).to_vec()];
    let row = |run: &dmp_revisit::drift::RunDrift| {
        let name = format!("<th scope=\"row\" class=\"name\">{}</th>", escape(&run.name));
        std::iter::once(name).chain(drift_row(run).iter().map(|text| cell(text, ""))).collect()
    };
    let ordered = report.order.iter().filter_map(|name| drift.runs.iter().find(|run| run.name == *name));
    let caption = format!("{}; less is better", pairs_in_words(drift));
    body.push_str(&table(&caption, &heads.concat(), &ordered.map(row).collect::<Vec<_>>()));
    body.push_str(&paragraph(
        "Where a run visits a place twice, both visits see the same surfaces. The motion that aligns them is the drift between the \
         visits.",
    ));
    let is_any_off = (0..drift.runs.len()).any(|run| offs(drift, run).next().is_some());
    if let Some(pictures) = pictures.filter(|_| is_any_off) {
        body.push_str(&ways(drift, pictures));
    }
    body
}

/// By the number of a scan its index among the frames.
pub(crate) type FrameOf = HashMap<usize, usize>;

pub(crate) fn frame_of(pictures: &Pictures) -> FrameOf {
    pictures.frames.iter().enumerate().map(|(index, frame)| (frame.number, index)).collect()
}

/// The drift of a run at the pairs of visits that have an answer.
fn offs(drift: &DriftReport, run: usize) -> impl Iterator<Item = ([&VisitReport; 2], &Displacement)> {
    let visits = drift.runs.get(run).map_or(&[][..], |run| &run.visits);
    visits.iter().filter_map(|visit| Some(([&visit.first, &visit.second], visit.off.as_ref()?)))
}

fn length_m(off: &Displacement) -> f64 {
    off.distance_m.unwrap_or_else(|| off.in_world_m.iter().map(|m| m * m).sum::<f64>().sqrt())
}

/// The ways of the best runs with an arrow for each pair of visits.
fn ways(drift: &DriftReport, pictures: &Pictures) -> String {
    let drawn: Vec<usize> = pictures.order.iter().copied().take(WAYS).collect();
    let frame_of = frame_of(pictures);
    let figures: Vec<String> = drawn.iter().filter_map(|&run| way(drift, pictures, &frame_of, run)).collect();
    let mut text = paragraph(
        "Compared visits are coloured by the drift between them. An arrow leads from where a surface is to where the later visit \
         has it, exaggerated; hover for numbers.",
    );
    let metre_m = pictures.scales.lengths().metre_m;
    let [least, most] =
        [format!("{} cm", 100.0 * COLOURS_M[0] * metre_m), format!("{} m", COLOURS_M[1] * metre_m)];
    text.push_str(&bar(&format!("{least} or less"), &bad_colours(), &format!("{most} or more")));
    text + &grid(&figures)
}

/// The colour of a length.
fn colour(length_m: f64, scales: Scales) -> String {
    let [least_m, most_m] = COLOURS_M.map(|m| m * scales.lengths().metre_m);
    let share = libm::log(length_m.max(least_m) / least_m) / libm::log(most_m / least_m);
    hex(bad_colours()[step(share)])
}

/// The way of a run with its arrows, as a figure.
fn way(drift: &DriftReport, pictures: &Pictures, frame_of: &FrameOf, run: usize) -> Option<String> {
    let name = &drift.runs.get(run)?.name;
    let places: Vec<[f64; 3]> = pictures.frames.iter().map(|frame| frame.position_in_world_m[run]).collect();
    let low: [f64; 2] =
        [0, 1].map(|k: usize| places.iter().map(|place| place[k]).fold(f64::INFINITY, f64::min));
    let high: [f64; 2] =
        [0, 1].map(|k: usize| places.iter().map(|place| place[k]).fold(f64::NEG_INFINITY, f64::max));
    let size_m = [high[0] - low[0], high[1] - low[1]];
    let longest_m = size_m[0].max(size_m[1]);
    if places.is_empty() || longest_m == 0.0 {
        return None;
    }
    let units_per_m = (WIDTH - 2.0 * AROUND) / longest_m;
    let height = units_per_m * size_m[1] + 2.0 * AROUND;
    let beside = (WIDTH - units_per_m * size_m[0]) / 2.0;
    let at = |place: [f64; 3]| {
        [beside + units_per_m * (place[0] - low[0]), height - AROUND - units_per_m * (place[1] - low[1])]
    };
    let longest_m = offs(drift, run).map(|(_, off)| length_m(off)).fold(0.0, f64::max);
    let fits = |factor: &f64| factor * longest_m * units_per_m <= ARROW;
    let factor = FACTORS.into_iter().rev().find(fits).unwrap_or(1.0);
    let mut drawing = overlay::way(places.iter().map(|place| at(*place)));
    let mut arrows = String::new();
    for (visits, off) in offs(drift, run) {
        let colour = colour(length_m(off), pictures.scales);
        for visit in visits {
            let scans = visit.scans.iter().filter_map(|scan| frame_of.get(scan));
            let points: Vec<String> = scans
                .map(|&frame| {
                    let [x, y] = at(places[frame]);
                    format!("{x:.1},{y:.1}")
                })
                .collect();
            // Writing to a string cannot fail.
            let _ = write!(
                drawing,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"4\" stroke-linecap=\"round\"/>",
                points.join(" ")
            );
        }
        let Some(&frame) = frame_of.get(&visits[1].scan) else { continue };
        let tip = at(places[frame]);
        let shift = [off.in_world_m[0], -off.in_world_m[1]].map(|m| factor * units_per_m * m);
        arrows.push_str(&arrow(tip, shift, &colour, &in_numbers(visits, off)));
    }
    let frame = Frame { width: WIDTH, height, units_per_m };
    let svg = frame.svg(&format!("Path of {name} from above, with drift"), &(drawing + &arrows), Some("y"));
    let times = if factor > 1.0 { format!("; arrows exaggerated {factor} times") } else { String::new() };
    let caption = format!("<strong>{}</strong>{times}", escape(name));
    Some(figure(&svg, &caption))
}

/// An arrow that ends at `tip`, with words for who hovers.
fn arrow([x, y]: [f64; 2], [dx, dy]: [f64; 2], colour: &str, words: &str) -> String {
    let length = (dx * dx + dy * dy).sqrt();
    let mut text =
        format!("<g stroke=\"{colour}\" fill=\"none\" stroke-width=\"2\"><title>{}</title>", escape(words));
    if length < 1.0 {
        let _ = write!(text, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/></g>");
        return text;
    }
    let barb = (0.35 * length).min(6.0) / length;
    let _ = write!(
        text,
        "<path d=\"M{:.1} {:.1}L{x:.1} {y:.1}M{:.1} {:.1}L{x:.1} {y:.1}L{:.1} {:.1}\"/></g>",
        x - dx,
        y - dy,
        x - barb * (dx - 0.6 * dy),
        y - barb * (dy + 0.6 * dx),
        x - barb * (dx + 0.6 * dy),
        y - barb * (dy - 0.6 * dx),
    );
    text
}

/// `scans 12 and 480: drift 59 cm: 58 cm to the left; rotation 0.2°`.
fn in_numbers([first, second]: [&VisitReport; 2], off: &Displacement) -> String {
    let whole = off.distance_m.map_or_else(String::new, |m| format!("drift {}: ", metres(m)));
    let angle = crate::text::digits(off.angle_deg);
    format!("scans {} and {}: {whole}{}; rotation {angle}°", first.scan, second.scan, which_way(off))
}

/// Which way a run is off at one of its places, by the visits there; the pair that is off by most.
pub(crate) fn at_place(
    drift: &DriftReport,
    pictures: &Pictures,
    frame_of: &FrameOf,
    place: &WorstPlace,
) -> Option<String> {
    let (run, near_m) = (place.run, NEAR_M * pictures.scales.lengths().metre_m);
    let is_near = |visit: &VisitReport| {
        frame_of.get(&visit.scan).is_some_and(|&frame| {
            let at_m = pictures.frames[frame].position_in_world_m[run];
            distance_m(at_m, place.centre_in_world_m) <= place.radius_m + near_m
        })
    };
    let is_known = |off: &Displacement| {
        length_m(off) > SIGMAS * off.sigma_m.iter().map(|sigma| sigma * sigma).sum::<f64>().sqrt()
    };
    let near =
        offs(drift, run).filter(|(visits, off)| is_known(off) && visits.iter().any(|visit| is_near(visit)));
    let (visits, off) = near.max_by(|a, b| length_m(a.1).total_cmp(&length_m(b.1)))?;
    Some(format!("Drift between scans {} and {} here: {}.", visits[0].scan, visits[1].scan, which_way(off)))
}
