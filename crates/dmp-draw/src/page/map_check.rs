//! What is found of one map alone, as a page.

use dmp_report::{MapCheck, PlanColumn};

use super::html::{Document, bar, figure, keys, list, paragraph, section};
use crate::colour::{Rgb, STEPS, bad_colours, hex, step};
use crate::image::Image;
use crate::plot::escape;
use crate::words::{map_check, not_in_a_cloud};

/// Most pixels of the map's longer side.
const MOST_PX: f64 = 1100.0;
/// After the colours of thickness: surfaces, holes, double layers.
const OTHERS: [Rgb; 3] = [[150, 150, 150], [86, 165, 225], [213, 94, 0]];

/// The page: one file that needs nothing else, without scripts.
///
/// # Errors
/// Where the picture cannot be encoded.
pub fn map_check_page(check: &MapCheck, dmp_version: &str) -> Result<String, png::EncodingError> {
    let items = map_check(check).into_iter().map(|(what, found)| {
        let found: Vec<String> = found.iter().map(|line| escape(line)).collect();
        format!("<strong>{what}</strong>: {}", found.join("; "))
    });
    let mut main = section("found", "What was found", &list("<ul>", items));
    main.push_str(&section("where", "Where", &picture(check)?));
    let notes = list("<ul>", check.notes.iter().map(|note| escape(note)));
    main.push_str(&section(
        "limits",
        "What this does not show",
        &(paragraph(&not_in_a_cloud(check)) + &notes),
    ));
    let document = Document {
        version: dmp_version,
        title: &format!("How good is {}?", check.path.rsplit(['/', '\\']).next().unwrap_or(&check.path)),
        policy: "img-src data:; ",
        lead: "",
        contents: "",
        main: &main,
        footer: "Made by dmp.",
        scripts: "",
    };
    Ok(document.to_html())
}

fn picture(check: &MapCheck) -> Result<String, png::EncodingError> {
    let plan = &check.plan;
    if plan.columns.is_empty() {
        return Ok(String::new());
    }
    let height = plan.columns.len() / plan.width;
    let scale = (MOST_PX / plan.width.max(height) as f64).min(8.0);
    let [wide, high] = [plan.width, height].map(|columns| ((columns as f64 * scale).ceil() as usize).max(1));
    // A picture has fifteen colours at most.
    let thick = STEPS - OTHERS.len();
    let of_thick = (0..thick).map(|k| bad_colours()[k * (STEPS - 1) / (thick - 1)]);
    let colours: Vec<Rgb> = of_thick.chain(OTHERS).collect();
    let [surface, hole, double] = [1, 2, 3].map(|k| (thick + k) as u8);
    let mut image = Image::new(wide, high);
    for row in 0..high {
        for column in 0..wide {
            let [x, y] = [column, high - 1 - row].map(|px| (px as f64 / scale) as usize);
            match plan.columns.get(y.min(height - 1) * plan.width + x.min(plan.width - 1)) {
                Some(PlanColumn::Covered) => image.set(column as i32, row as i32, surface),
                Some(PlanColumn::Hole) => image.set(column as i32, row as i32, hole),
                _ => (),
            }
        }
    }
    let mut mark = |place_m: [f64; 3], half_px: f64, colour: u8| {
        let [x, y] = [0, 1].map(|k| (place_m[k] - plan.corner_m[k]) / plan.column_m * scale);
        let (left, top) = (x - half_px, high as f64 - y - half_px);
        for row in 0..=(2.0 * half_px) as i32 {
            for column in 0..=(2.0 * half_px) as i32 {
                image.set(left as i32 + column, top as i32 + row, colour);
            }
        }
    };
    let top_m = check.thickness.as_ref().map_or(0.1, |found| found.p95_m.max(1e-3));
    for &(place_m, thick_m) in &check.flat {
        mark(place_m, (scale / 2.0).max(1.5), 1 + (step(thick_m / top_m) * thick / STEPS) as u8);
    }
    for place in check.thickness.iter().flat_map(|found| &found.layers.places) {
        mark(place.place_m, 4.0, double);
    }
    let element = format!(
        "<img alt=\"The map from above\" width=\"{wide}\" height=\"{high}\" style=\"max-width:100%;height:auto\" src=\"{}\">",
        image.to_data_url(&colours)?
    );
    let marks = [(OTHERS[0], "surfaces"), (OTHERS[1], "holes"), (OTHERS[2], "double layers farthest apart")];
    let top = format!("{:.1} cm or more", 100.0 * top_m);
    let caption = "The map from above; the flat cells that were measured have the colour of their thickness.";
    Ok(figure(&element, caption)
        + &bar("0 cm", &bad_colours(), &top)
        + &keys(marks.map(|(colour, what)| (hex(colour), what))))
}
