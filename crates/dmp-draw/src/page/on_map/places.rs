//! The worst places of every run.

use dmp_revisit::drift::DriftReport;

use crate::colour::hex;
use crate::image::Image;
use crate::page::html::{figure, grid, keys, list, paragraph};
use crate::page::on_map::drift::{FrameOf, at_place, frame_of};
use crate::page::on_map::overlay;
use crate::page::on_map::overlay::Frame;
use crate::pictures::{
    COLOURS, Closeup, FrameScore, Pass, Pictures, WorstPlace, judged_by_m, metre_decimals, time_of,
};
use crate::plot::escape;

/// The plot over time, to which places lead.
pub(crate) const TIME_PLOT: &str = "over-time";
/// Passes listed of a place.
const PASSES: usize = 4;
/// So many runs have their places shown at once; those of others are behind a click.
const OPEN: usize = 2;

/// The places of all runs, in the order of the runs.
pub(crate) fn places(
    pictures: &Pictures,
    names: &[&str],
    drift: Option<&DriftReport>,
) -> Result<String, png::EncodingError> {
    if pictures.places.iter().all(Vec::is_empty) {
        return Ok(String::new());
    }
    let mut body = paragraph(
        "Stretches of the path where a run predicts worse than another one, or where it is worst if no run is clearly better. \
         Times count from the first scan of the log. Of several passes, the one with the largest residuals stands first.",
    );
    let fits = format!("returns predicted to {} cm", 10.0 * pictures.scales.lengths().metre_m);
    let words = [
        (1, "surfels of the map, level"),
        (2, "steep"),
        (4, fits.as_str()),
        (6, "the map has it behind the return"),
        (9, "the map has something in front of it"),
        (3, "some of the rays"),
    ];
    body.push_str(&keys(words.map(|(colour, words)| (hex(COLOURS[colour - 1]), words))));
    let frame_of = frame_of(pictures);
    for (place, &run) in pictures.order.iter().enumerate() {
        let open = if place < OPEN { " open" } else { "" };
        let mut articles = Vec::new();
        for (number, place) in pictures.places[run].iter().enumerate() {
            articles.push(article(pictures, names, number, place, drift.map(|drift| (drift, &frame_of)))?);
        }
        if articles.is_empty() {
            continue;
        }
        let (name, articles) = (escape(names[run]), grid(&articles));
        let summary = format!("<details{open}><summary>Worst places of {name}</summary>\n");
        body.push_str(&[summary, articles, "</details>\n".to_owned()].concat());
    }
    Ok(body)
}

fn article(
    pictures: &Pictures,
    names: &[&str],
    number: usize,
    place: &WorstPlace,
    drift: Option<(&DriftReport, &FrameOf)>,
) -> Result<String, png::EncodingError> {
    let name = names[place.run];
    let [x, y, _] = place.centre_in_world_m;
    let when = place.passes.first().map_or_else(String::new, |pass| times(pictures, pass));
    let decimals = metre_decimals(pictures.scales);
    let heading = format!("{}. {when}", number + 1);
    let id = format!("place-{}-{}", place.run, number + 1);
    let basis = pictures.bases[place.run];
    let [fine_m, wide_m] = judged_by_m(pictures.scales);
    let misses = |score: &FrameScore| score.misses(pictures.scales);
    let own = format!("Residuals of {} ({basis} at {fine_m} and {wide_m} m)", misses(&place.score));
    let best = match &place.best {
        Some((best, score)) => {
            format!("{own}; <strong>{}</strong> has {}.", escape(names[*best]), misses(score))
        }
        None if names.len() > 1 => format!("{own}; no other run is clearly better."),
        None => format!("{own}."),
    };
    let mut text = format!("<p>{best} At x {x:.decimals$} m, y {y:.decimals$} m.</p>\n");
    text.push_str(&jumps(pictures, number, place));
    let which_way = drift.and_then(|(drift, frame_of)| at_place(drift, pictures, frame_of, place));
    text.push_str(&which_way.map_or_else(String::new, |said| paragraph(&said)));
    if place.passes.len() > 1 {
        let pass = |pass: &Pass| format!("{}: {}", escape(&times(pictures, pass)), misses(&pass.score));
        text.push_str(&list("<ul>", place.passes.iter().take(PASSES).map(pass)));
        if let Some(more) = place.passes.len().checked_sub(PASSES).filter(|more| *more > 0) {
            text.push_str(&paragraph(&format!("and {more} more passes")));
        }
    }
    if let Some(closeup) = pictures.closeups[place.run].get(number) {
        text.push_str(&views(pictures, place, closeup, name, number)?);
    }
    Ok(format!(
        "<article aria-labelledby=\"{id}\">\n<h3 id=\"{id}\">{}</h3>\n{text}</article>\n",
        escape(&heading)
    ))
}

/// Links to where else the page shows the place: see the scripts.
fn jumps(pictures: &Pictures, number: usize, place: &WorstPlace) -> String {
    let (run, number) = (place.run, number + 1);
    let [x, y, _] = place.centre_in_world_m;
    let mut jumps = Vec::new();
    if pictures.grounds[run].as_ref().is_some_and(|ground| ground.grid.columns > 0) {
        let at = format!("{x:.2} {y:.2} {:.2}", place.radius_m);
        jumps.push(format!("<a href=\"#map-{run}\" data-at=\"{at}\">on the map</a>"));
    }
    if pictures.clouds[run].as_ref().is_some_and(|cloud| cloud.len() > 0) {
        jumps.push(format!("<a href=\"#cloud\" data-cloud=\"{run} {number}\">in three dimensions</a>"));
    }
    if let Some(pass) = place.passes.first() {
        let [from, to] = pass.frames.map(|frame| time_of(&pictures.frames[frame], pictures.start_ns));
        jumps.push(format!("<a href=\"#{TIME_PLOT}\" data-span=\"{from} {to}\">in time</a>"));
    }
    format!("<p>See it {}.</p>\n", jumps.join(", "))
}

/// When the sensor was there: times, and scans of the log.
pub(crate) fn times(pictures: &Pictures, pass: &Pass) -> String {
    let frames = &pictures.frames;
    let numbers = pass.frames.map(|frame| frames[frame].number);
    let scans = if numbers[0] == numbers[1] {
        format!("scan {}", numbers[0])
    } else {
        format!("scans {} to {}", numbers[0], numbers[1])
    };
    if pictures.start_ns.is_none() {
        return scans;
    }
    let [from, to] = pass.frames.map(|frame| clock(time_of(&frames[frame], pictures.start_ns)));
    if from == to { format!("{from} ({scans})") } else { format!("{from} to {to} ({scans})") }
}

/// Minutes, seconds and tenths.
fn clock(seconds: f64) -> String {
    let tenths = (10.0 * seconds).round() as i64;
    let (sign, tenths) = if tenths < 0 { ("-", -tenths) } else { ("", tenths) };
    format!("{sign}{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10)
}

/// From above and from the side.
fn views(
    pictures: &Pictures,
    place: &WorstPlace,
    closeup: &Closeup,
    name: &str,
    number: usize,
) -> Result<String, png::EncodingError> {
    let ways = |at: &dyn Fn([f64; 3]) -> [f64; 2]| {
        let way = |pass: &Pass| {
            let frames = &pictures.frames[pass.frames[0]..=pass.frames[1]];
            overlay::way(frames.iter().map(|frame| at(frame.position_in_world_m[place.run])))
        };
        place.passes.iter().take(PASSES).map(way).collect::<String>()
    };
    let number = number + 1;
    let view = |image: &Image, way: String, label: &str, arrow| {
        let [width, height] = [image.width, image.height].map(|px| px as f64);
        let frame = Frame { width, height, units_per_m: width / (2.0 * closeup.half_m) };
        let picture = format!(
            "<image width=\"{width}\" height=\"{height}\" href=\"{}\"/>{way}",
            image.to_data_url(&COLOURS)?
        );
        Ok::<String, png::EncodingError>(frame.svg(label, &picture, arrow))
    };
    let above = view(
        &closeup.above,
        ways(&|at_m| closeup.above_px(at_m)),
        &format!("Place {number} of {name} from above"),
        Some("y"),
    )?;
    let side = view(
        &closeup.side,
        ways(&|at_m| closeup.side_px(at_m).0),
        &format!("Place {number} of {name} from the side"),
        None,
    )?;
    Ok(figure(&above, "from above") + &figure(&side, "from the side, travelling to the right"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_are_read_as_clocks() {
        assert_eq!(
            [0.0, 9.96, 59.96, 61.25, 3725.0].map(clock),
            ["0:00.0", "0:10.0", "1:00.0", "1:01.3", "62:05.0"]
        );
        assert_eq!(clock(-1.5), "-0:01.5");
    }
}
