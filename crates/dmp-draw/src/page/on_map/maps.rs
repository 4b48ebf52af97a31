//! Maps from above.

use std::fmt::Write as _;

use dmp_reduce::Basis;

use crate::colour::{Rgb, bad_colours, hex, side_colours};
use crate::image::Image;
use crate::page::explore::{with_data, with_id};
use crate::page::html::{bar, figure, grid, keys, large, paragraph};
use crate::page::on_map::overlay;
use crate::page::on_map::overlay::Frame;
use crate::pictures::{Grid, Pictures, WorstPlace, cut_m, round_top};
use crate::plot::escape;

/// Width of a map in units of its drawing.
const WIDTH: f64 = 400.0;
/// Radius of a mark, in the same units.
const MARK: f64 = 7.0;
/// A map so many times larger than the best run's has a scale of its own.
const FAR_LARGER: f64 = 2.0;
const COVERAGE: [Rgb; 3] = [[0, 158, 115], [86, 165, 225], [222, 110, 30]];

/// A map of residuals for every run, on one scale of colours.
pub(crate) fn residuals(pictures: &Pictures, names: &[&str]) -> Result<String, png::EncodingError> {
    let with_map = || pictures.order.iter().filter_map(|&run| Some((run, pictures.grounds[run].as_ref()?)));
    let drawn = || with_map().filter(|(_, ground)| ground.grid.columns > 0);
    let (cut_m, metre_m) = (cut_m(pictures.scales), pictures.scales.lengths().metre_m);
    let top_m = round_top(drawn().flat_map(|(_, ground)| ground.rms_of_cells()), 0.1 * metre_m, cut_m);
    let Some(size_m) = common_size_m(drawn().map(|(_, ground)| &ground.grid)) else {
        return Ok(paragraph("Too few returns were scored to draw a map of."));
    };
    let mut figures = Vec::new();
    for (run, ground) in drawn() {
        let image = ground.residuals(top_m);
        let label = format!("Map of {} from above, coloured by residual", names[run]);
        let own_m = extent_m(&ground.grid);
        let fits = own_m[0] <= size_m[0] && own_m[1] <= size_m[1];
        let size_m = if fits { size_m } else { own_m };
        let marks = marks(pictures, run);
        let map = map(pictures, (run, &marks), &ground.grid, (&image, &bad_colours()), size_m, &label)?;
        let map = with_id(&map, &format!("map-{run}"));
        let scale = if fits { "" } else { "; far larger than the others, at a scale of its own" };
        let caption =
            format!("<strong>{}</strong>, cells of {} m{scale}", escape(names[run]), ground.grid.cell_m);
        figures.push(figure(&map, &caption));
    }
    let score = pictures.order.first().map_or(Basis::CrossValidated, |&best| pictures.bases[best]);
    let mut text = paragraph(&format!(
        "Each cell has the RMS residual of the returns that lie in it ({score} at {cut_m} m). The line is the path of the sensor, \
         from the dot. The arrow is the y axis of the run's world, north where that is east–north–up. Numbers link to the run's \
         worst places."
    ));
    let left_out = pictures.order.len() - with_map().count();
    if left_out > 0 {
        text.push_str(&paragraph(&format!(
            "The maps of {left_out} more runs, further down the order, are not drawn."
        )));
    }
    text.push_str(&bar("0 m", &bad_colours(), &format!("{top_m} m or more")));
    Ok(text + &grid(&figures))
}

/// The best two runs against each other, on the returns that both predict.
pub(crate) fn difference(pictures: &Pictures, names: &[&str]) -> Result<String, png::EncodingError> {
    let [first, second] = match (&pictures.difference, pictures.order.as_slice()) {
        (Some(_), [first, second, ..]) => [*first, *second],
        _ => return Ok(String::new()),
    };
    let Some(difference) = pictures.difference.as_ref().filter(|difference| difference.grid.columns > 0)
    else {
        return Ok(paragraph("There are too few returns that both predict."));
    };
    let top_m =
        round_top(difference.sizes_m(), 0.05 * pictures.scales.lengths().metre_m, cut_m(pictures.scales));
    let label = format!("Map from above of where {} and {} differ", names[first], names[second]);
    let size_m = extent_m(&difference.grid);
    let image = difference.sides(top_m);
    let map = map(pictures, (first, &[]), &difference.grid, (&image, &side_colours()), size_m, &label)?;
    let caption = format!(
        "<strong>{}</strong> against <strong>{}</strong>: difference of their RMS residuals on the same returns, placed as in {}.",
        escape(names[first]),
        escape(names[second]),
        escape(names[first])
    );
    let better = |run: usize| format!("{} is better by {top_m} m or more", names[run]);
    // Blue stands for the first: it is on the left.
    let key = bar(&better(first), &side_colours(), &better(second));
    Ok(key + &large(&figure(&map, &caption)))
}

/// What the best run's returns are predicted from.
pub(crate) fn coverage(pictures: &Pictures, names: &[&str]) -> Result<String, png::EncodingError> {
    let Some(best) =
        pictures.order.first().copied().filter(|&run| pictures.bases[run] == Basis::CrossValidated)
    else {
        return Ok(String::new());
    };
    let ground = pictures.grounds[best].as_ref().filter(|ground| ground.grid.columns > 0);
    let Some(ground) = ground else { return Ok(String::new()) };
    let label = format!("Map of {} from above, coloured by what predicts the returns", names[best]);
    let image = ground.coverage();
    let map = map(pictures, (best, &[]), &ground.grid, (&image, &COVERAGE), extent_m(&ground.grid), &label)?;
    let text = paragraph(
        "Only revisited places show whether the map fits together as a whole. Where nothing predicts the returns, the map is not \
         tested.",
    );
    let recording = pictures.scales.lengths().recording;
    let from_elsewhere = format!("predicted from other parts of the {recording}");
    let words = [
        "predicted from another visit",
        from_elsewhere.as_str(),
        "not predicted: seen once, or from too few scans",
    ];
    let key = keys(COVERAGE.iter().map(|colour| hex(*colour)).zip(words));
    let caption = format!("<strong>{}</strong>, by what most returns of a cell are", escape(names[best]));
    Ok(text + &key + &large(&figure(&map, &caption)))
}

fn extent_m(grid: &Grid) -> [f64; 2] {
    [grid.columns, grid.rows].map(|cells| cells as f64 * grid.cell_m)
}

/// So large that the map of every run fits, so that all are drawn at one scale; but for those that are far larger than
/// the best one's: a run that flew off does not make dots of the others. `None` where there is none.
fn common_size_m<'a>(mut grids: impl Iterator<Item = &'a Grid>) -> Option<[f64; 2]> {
    let best_m = extent_m(grids.next()?);
    let most_m = FAR_LARGER * best_m[0].max(best_m[1]);
    let like_it = grids.map(extent_m).filter(|[w, h]| w.max(*h) <= most_m);
    Some(like_it.fold(best_m, |[w, h], [x, y]| [w.max(x), h.max(y)]))
}

/// Where the worst places of a run lie, the worst first, and links to them.
fn marks(pictures: &Pictures, run: usize) -> Vec<([f64; 3], String)> {
    let mark = |(number, place): (usize, &WorstPlace)| {
        let number = number + 1;
        // Who comes here by keys or hears the page has the list of places, which leads here.
        let link = format!(
            "<a class=\"place\" href=\"#place-{run}-{number}\" tabindex=\"-1\" aria-hidden=\"true\"><title>Worst place \
             {number}</title><circle r=\"{MARK}\"/><text>{number}</text></a>"
        );
        (place.centre_in_world_m, link)
    };
    pictures.places[run].iter().enumerate().map(mark).collect()
}

/// A map of cells with the way of the run, a bar and an arrow, and those of its marks that lie within and cover no earlier one.
fn map(
    pictures: &Pictures,
    (run, marks): (usize, &[([f64; 3], String)]),
    cells: &Grid,
    (image, colours): (&Image, &[Rgb]),
    size_m: [f64; 2],
    label: &str,
) -> Result<String, png::EncodingError> {
    let scale = WIDTH / size_m[0].max(1e-9);
    let height = scale * size_m[1];
    let own_m = extent_m(cells);
    // In the middle, y upwards.
    let offset_m = [0, 1].map(|axis: usize| (size_m[axis] - own_m[axis]) / 2.0);
    let at = |position: [f64; 3]| {
        let [x, y] = [0, 1].map(|axis: usize| position[axis] - cells.corner_m[axis] + offset_m[axis]);
        [scale * x, height - scale * y]
    };
    let way = overlay::way(pictures.frames.iter().map(|frame| at(frame.position_in_world_m[run])));
    let [x, y] = offset_m.map(|m| scale * m);
    let [w, h] = own_m.map(|m| scale * m);
    let frame = Frame { width: WIDTH, height, units_per_m: scale };
    let picture = format!(
        "<image x=\"{x:.2}\" y=\"{y:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" preserveAspectRatio=\"none\" href=\"{}\"/>",
        image.to_data_url(colours)?
    );
    let mut marked: Vec<[f64; 2]> = Vec::new();
    let mut drawn = String::new();
    for (at_m, mark) in marks {
        let [x, y] = at(*at_m);
        let is_inside = (MARK..WIDTH - MARK).contains(&x) && (MARK..height - MARK).contains(&y);
        let is_free = marked.iter().all(|[a, b]| (a - x).hypot(b - y) > 2.2 * MARK);
        if is_inside && is_free {
            marked.push([x, y]);
            // Writing to a string cannot fail.
            let _ = write!(drawn, "<g transform=\"translate({x:.1} {y:.1})\">{mark}</g>");
        }
    }
    let svg = frame.svg(label, &(picture + &way + &drawn), Some("y"));
    let [left, bottom] = [0, 1].map(|axis: usize| cells.corner_m[axis] - offset_m[axis]);
    Ok(with_data(&svg, "map", &format!("{left:.2} {bottom:.2} {scale:.6} {height:.2}")))
}
