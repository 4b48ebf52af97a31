//! Scores as cells of a table.

use std::fmt::Write as _;

use dmp::{COLUMNS, MissPrice, RunSums, Scales};

/// The columns of [`scores`].
pub(super) fn columns(scales: Scales) -> String {
    let scores: Vec<String> = COLUMNS.iter().flat_map(|column| column.csv_names(scales)).collect();
    format!("returns,returns_with_z1,returns_with_zc,dmp_sum_m2,{}", scores.join(","))
}

/// How a run is scored.
#[derive(Debug, Clone)]
pub(super) struct RunRows {
    /// Its name, as a cell.
    pub(super) name: String,
    /// Whether its map is fused, so that it is known which surfels are independent of a return.
    pub(super) is_fused: bool,
    pub(super) price: MissPrice,
}

impl RunRows {
    pub(super) fn new(run: &dmp::Run, price: MissPrice) -> Self {
        Self { name: cell(&run.name), is_fused: run.map == dmp::MapSource::Fused, price }
    }
}

/// The cells of some returns' scores with the end of the line. What is not defined is empty; numbers are such that
/// reading them gives the same bits.
pub(super) fn scores(row: &mut String, sums: &RunSums, run: &RunRows) {
    let with_zc = run.is_fused.then(|| sums.with_independent());
    let counts = [Some(sums.returns()), Some(sums.with_first()), with_zc];
    let cells = counts.map(|count| count.map(|count| count.to_string()).unwrap_or_default());
    row.push_str(&cells.join(","));
    let of_columns = COLUMNS.iter().flat_map(|column| column.csv_cells(sums, run.price, run.is_fused));
    for score in std::iter::once(Some(sums.dmp_sum_m2())).chain(of_columns) {
        row.push(',');
        if let Some(score) = score {
            // Writing to a string cannot fail.
            let _ = write!(row, "{score}");
        }
    }
    row.push('\n');
}

/// A text as a cell (RFC 4180). An apostrophe keeps spreadsheets from running it as a formula.
fn cell(text: &str) -> String {
    let text = if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text.to_owned() };
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp::Residuals;

    #[test]
    fn cells_are_as_many_as_columns_and_empty_where_nothing_is_defined() {
        let mut sums = RunSums::default();
        let run = |is_fused| RunRows { name: cell("a,\"b\""), is_fused, price: MissPrice::default() };
        assert_eq!(run(true).name, "\"a,\"\"b\"\"\"");
        assert_eq!(cell("=cmd|' /C calc'!A0"), "'=cmd|' /C calc'!A0");
        assert_eq!((cell("-a,b").as_str(), cell("a=b").as_str()), ("\"'-a,b\"", "a=b"));
        let row = |sums: &RunSums, is_fused| {
            let mut row = String::new();
            scores(&mut row, sums, &run(is_fused));
            row
        };
        assert_eq!(row(&sums, true), "0,0,0,0,,,,,,,,,,,,\n");
        sums.add(&Residuals::all(0.25));
        sums.add(&Residuals::MISS);
        // With the price of the miss, 15 m².
        let expected = "2,1,1,0.0625,0.0625,7.53125,0.0625,0.0625,0.04,0.0625,0.0625,0.0625,0.5,0,0.5,0.5\n";
        let as_numbers =
            |row: &str| -> Vec<f64> { row.trim().split(',').map(|c| c.parse().unwrap()).collect() };
        let (found, expected) = (as_numbers(&row(&sums, true)), as_numbers(expected));
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        assert_eq!(found.len(), columns(Scales::Drive).split(',').count());
        assert_eq!(expected.len(), found.len());
        assert!(row(&sums, false).starts_with("2,1,,0.0625,0.0625,,,,,0.0625,"), "{}", row(&sums, false));
        assert!(row(&sums, false).ends_with(",0.5,0,,\n"));
    }
}
