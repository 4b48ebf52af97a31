//! Distances, for a person.

use std::io::{self, Write};

use dmp_draw::text::{NONE, Side, Table, counted, digits, percent};

use super::result::{DistancesResult, SmdResult};

/// Writes the result for a person: a table of distances, a table of shares.
pub(super) fn result(out: &mut impl Write, result: &SmdResult) -> io::Result<()> {
    let (reference, config) = (&result.reference, &result.config);
    let size = if reference.triangles > 0 {
        format!("{}, {} m²", counted(reference.triangles, "triangle"), digits(reference.area_m2))
    } else {
        counted(reference.points, "point")
    };
    writeln!(out, "reference {}: {}, {size}", reference.file, reference.format)?;
    let thinned = config.thin_m.map_or(String::new(), |m| format!("; one point of each voxel of {m} m"));
    let cropped = if config.crop { "; reference cropped to the map" } else { "" };
    writeln!(out, "distances are capped at {} m{thinned}{cropped}\n", config.cap_m)?;

    let mut table = Table::new([vec![Side::Left; 2], vec![Side::Right; 8]].concat());
    table.row(["map", "", "points", "mean", "median", "RMSE", "std", "95 %", "max", "beyond"]);
    table.row(["", "", "", "cm", "cm", "cm", "cm", "cm", "cm", "%"]);
    for map in &result.maps {
        table.row(distances(&map.name, "to the reference", Some(&map.accuracy)));
        table.row(distances("", "from the reference", map.completeness.as_ref()));
    }
    table.write(out, "")?;
    writeln!(out)?;

    let mut table = Table::new([vec![Side::Left], vec![Side::Right; 5]].concat());
    table.row(["map", "within", "accuracy", "their RMSE", "completeness", "F-score"]);
    table.row(["", "cm", "%", "cm", "%", "%"]);
    let share = |share: Option<f64>| share.map_or(NONE.to_owned(), percent);
    for map in &result.maps {
        for (k, at) in map.thresholds.iter().enumerate() {
            let name = if k == 0 { map.name.as_str() } else { "" };
            table.row([
                name.to_owned(),
                digits(100.0 * at.threshold_m),
                percent(at.precision),
                centimetres(at.inlier_rmse_m),
                share(at.recall),
                share(at.f_score),
            ]);
        }
    }
    table.write(out, "")?;
    writeln!(out)?;
    for map in &result.maps {
        writeln!(out, "chamfer distance of {}: {} cm", map.name, centimetres(map.chamfer_m))?;
        if map.dropped > 0 {
            writeln!(
                out,
                "{}: {} excluded: not finite or beyond the world",
                map.name,
                counted(map.dropped, "point")
            )?;
        }
    }
    if reference.dropped > 0 {
        let dropped = counted(reference.dropped, "point or triangle");
        writeln!(out, "reference: {dropped} excluded: not finite or beyond the world")?;
    }
    if !config.crop {
        writeln!(
            out,
            "Completeness is that of the whole reference, also where the map never was; see --crop."
        )?;
    }
    Ok(())
}

fn centimetres(metres: Option<f64>) -> String {
    metres.map_or(NONE.to_owned(), |m| digits(100.0 * m))
}

fn distances(name: &str, direction: &str, given: Option<&DistancesResult>) -> Vec<String> {
    let mut row = vec![name.to_owned(), direction.to_owned()];
    let Some(d) = given else {
        row.extend(vec![NONE.to_owned(); 8]);
        return row;
    };
    row.push(dmp_draw::text::count(d.count));
    row.extend([d.mean_m, d.median_m, d.rmse_m, d.std_m, d.p95_m, d.max_m].map(|m| centimetres(Some(m))));
    row.push(percent(d.beyond_cap_share));
    row
}
