//! The maps of the best runs in three dimensions: a picture, and the points for who turns them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::colour::hex;
use crate::page::html::{keys, large, paragraph};
use crate::pictures::{Cloud, Pictures, SURFEL_COLOURS};
use crate::plot::escape;
use crate::text::count;

/// The script. Without it, or without WebGL, the picture stays.
pub(crate) const SCRIPT: &str = include_str!("../assets/cloud.js");
/// Its SHA-256: `openssl dgst -sha256 -binary cloud.js | base64`.
pub(crate) const SCRIPT_HASH: &str = "sha256-l4jSJQCe2CkLH1H5SkOBHPhUJGZ6lcUnlOh9nbn4PuE=";

/// Size of the picture, pixels.
const SIZE_PX: [usize; 2] = [720, 440];

/// The best run as a picture, and the points of all that have any. `names` are those of all runs.
pub(crate) fn clouds(pictures: &Pictures, names: &[&str]) -> Result<String, png::EncodingError> {
    let of_run =
        |&run: &usize| Some((run, pictures.clouds[run].as_ref()?)).filter(|(_, cloud)| cloud.len() > 0);
    let drawn: Vec<(usize, &Cloud)> = pictures.order.iter().filter_map(of_run).collect();
    let Some(&(best, first)) = drawn.first() else { return Ok(String::new()) };
    let metre_m = pictures.scales.lengths().metre_m;
    let [fits, large_cm, largest_cm] = crate::colour::SIZES_M.map(|m| 100.0 * f64::from(m) * metre_m);
    let said: Vec<String> = drawn
        .iter()
        .map(|(run, cloud)| {
            let [all, shown] = cloud.surfels;
            format!("{} of {} surfels of {}", count(shown), count(all), names[*run])
        })
        .collect();
    let text = paragraph(&format!(
        "Surfels of the map, and in colour the returns that it predicts more than {fits:.0} cm off, darker from {large_cm:.0} and \
         {largest_cm:.0} cm on, for a sample: {}. Numbers are the worst places.",
        said.join(", ")
    ));
    let key = keys([
        (hex(SURFEL_COLOURS[7]), "surfels of the map, level"),
        (hex(SURFEL_COLOURS[0]), "steep"),
        (hex(SURFEL_COLOURS[9]), "the map has it behind the return"),
        (hex(SURFEL_COLOURS[12]), "the map has something in front of it"),
    ]);
    let [width, height] = SIZE_PX;
    let picture = first.picture(width, height).to_data_url(&SURFEL_COLOURS)?;
    let points: String =
        drawn.iter().map(|(run, cloud)| points(pictures, *run, names[*run], cloud)).collect();
    let colours: Vec<String> = SURFEL_COLOURS.iter().map(|colour| hex(*colour)).collect();
    let figure = format!(
        "<figure class=\"cloud\" data-colours=\"{}\" data-metre=\"{metre_m}\">\n<img width=\"{width}\" height=\"{height}\" \
         alt=\"Map of {} from the south-west and above\" src=\"{picture}\">\n<figcaption><strong>{}</strong>, from the \
         south-west and above</figcaption>\n{points}</figure>\n",
        colours.join(" "),
        escape(names[best]),
        escape(names[best]),
    );
    Ok(text + &key + &large(&figure))
}

/// The points of a run, with its worst places, in steps from its corner.
fn points(pictures: &Pictures, run: usize, name: &str, cloud: &Cloud) -> String {
    let steps = |at_m| cloud.steps(at_m).map(|[x, y, z]| format!("{x} {y} {z}"));
    let place = |(number, place): (usize, &crate::pictures::WorstPlace)| {
        Some(format!("{} {}", number + 1, steps(place.centre_in_world_m)?))
    };
    let places: Vec<String> = pictures.places[run].iter().enumerate().filter_map(place).collect();
    // What is above the sensor at its highest may be cut off.
    let highest = pictures.frames.iter().filter_map(|frame| cloud.steps(frame.position_in_world_m[run]));
    let highest = highest.map(|steps| steps[2]).max().unwrap_or(u16::MAX);
    let ends = cloud.ends().unwrap_or_default().as_flattened().iter().map(u16::to_string).collect::<Vec<_>>();
    format!(
        "<script type=\"application/octet-stream\" data-run=\"{run}\" data-name=\"{}\" data-step=\"{}\" data-ends=\"{}\" \
         data-highest=\"{highest}\" data-places=\"{}\">{}</script>\n",
        escape(name),
        cloud.step_m(),
        ends.join(" "),
        places.join(";"),
        STANDARD.encode(cloud.to_bytes())
    )
}
