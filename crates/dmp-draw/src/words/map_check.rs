//! What is found of one map alone, in words.

use dmp_report::{Layers, MapCheck};

use crate::text::{count, counted, digits, percent};
use dmp_revisit::apart::short_length;

/// A line for each thing that was measured: what it is, and what was found.
pub fn map_check(check: &MapCheck) -> Vec<(&'static str, Vec<String>)> {
    let cell = short_length(2.0 * check.voxel_m);
    let mut lines = Vec::new();
    let Some(points) = check.points else {
        let why = "not known: a store holds one disc for each voxel, not the points; `dmp score` prints it";
        lines.push(("surfels", vec![count(check.surfels)]));
        lines.push(("thickness", vec![why.to_owned()]));
        lines.push(("holes", holes(check)));
        return lines;
    };
    let mut points = vec![counted(points, "point")];
    if check.points_dropped > 0 {
        points.push(format!("{} not finite, excluded", counted(check.points_dropped, "point")));
    }
    lines.push(("points", points));
    match &check.thickness {
        None => lines.push((
            "thickness",
            vec![format!(
                "not known: too few flat cells of {cell} with 20 points; larger cells may help (--voxel)"
            )],
        )),
        Some(found) => {
            let of_map = percent(found.share_flat);
            lines.push((
                "thickness",
                vec![
                    format!(
                        "{} (median), 95 % of the flat cells below {}",
                        short_length(found.median_m),
                        short_length(found.p95_m)
                    ),
                    format!(
                        "{} of {cell} were measured, {of_map} % of those with enough points",
                        counted(found.cells, "flat cell")
                    ),
                ],
            ));
            lines.push((
                "density",
                vec![format!(
                    "{} points on a square metre (median of the flat cells)",
                    count(found.points_per_m2.round() as u64)
                )],
            ));
        }
    }
    if let Some(found) = &check.thickness {
        lines.push(("double layers", layers(&found.layers)));
    }
    lines.push(("holes", holes(check)));
    lines
}

fn layers(layers: &Layers) -> Vec<String> {
    let Some(median_m) = layers.median_m else {
        return match layers.cells {
            0 => vec!["not known: too few points for it".to_owned()],
            cells => vec![format!("none in {}", counted(cells, "cell"))],
        };
    };
    let share = percent(layers.doubled as f64 / layers.cells.max(1) as f64);
    let mut lines = vec![format!(
        "{share} % ({} of {}), {} apart (median)",
        count(layers.doubled),
        counted(layers.cells, "cell"),
        short_length(median_m)
    )];
    lines.extend(layers.places.iter().map(|place| {
        let [x, y, z] = place.place_m;
        format!("{} at ({x:.1}, {y:.1}, {z:.1})", short_length(place.layers_m))
    }));
    lines
}

fn holes(check: &MapCheck) -> Vec<String> {
    let holes = &check.holes;
    let m2 = |m2: f64| format!("{} m²", digits(m2));
    match holes.largest {
        None => vec![format!("none in {} with surfaces, seen from above", m2(holes.covered_m2))],
        Some(([x, y], largest_m2)) => vec![
            format!(
                "{}, {} beside {} with surfaces, seen from above",
                counted(holes.count, "hole"),
                m2(holes.area_m2),
                m2(holes.covered_m2)
            ),
            format!("the largest, {}, at ({x:.1}, {y:.1})", m2(largest_m2)),
        ],
    }
}

/// What a cloud alone does not show.
pub fn not_in_a_cloud(check: &MapCheck) -> String {
    let cell = short_length(2.0 * check.voxel_m);
    format!(
        "A cloud alone does not show bends, scale, or layers farther apart than {cell}. A thin wall that was seen from both sides \
         looks like a double layer, and a house like a hole. With the log, `dmp score` shows more."
    )
}
