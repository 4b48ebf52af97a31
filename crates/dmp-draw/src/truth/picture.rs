//! Runs beside ground truth as one picture.

use std::fmt::Write as _;

use super::{LEVELS, Over, Side, TruthPlots, TruthRun, angles, coloured_way, error_over, places};
use crate::colour::{STEPS, bad_colours, hex};
use crate::plot::{Plot, SERIES_COLOURS, cut, escape, text};

/// Width of a plot and space between two runs, pixels.
const WIDTH_PX: f64 = 480.0;
const BETWEEN_PX: f64 = 24.0;
const MARGIN_PX: f64 = 20.0;
/// Height of the statistics and of each row of plots, pixels.
const STATS_PX: f64 = 86.0;
const WAY_PX: f64 = 420.0;
const SIDE_PX: f64 = 240.0;
const ERROR_PX: f64 = 260.0;
const THIRD_PX: f64 = 180.0;

/// The picture: a column of plots a run, as an SVG document. The same plots give the same bytes.
pub fn truth_picture(plots: &TruthPlots) -> String {
    let lines = plots.title.lines().count() as f64;
    let head_px = 96.0 + 18.0 * lines;
    let columns = plots.runs.len().max(1) as f64;
    // The legend and the colours need some width.
    let width = (2.0 * MARGIN_PX + columns * (WIDTH_PX + BETWEEN_PX)).max(720.0);
    let height = head_px + STATS_PX + WAY_PX + SIDE_PX + 2.0 * ERROR_PX + 6.0 * THIRD_PX + MARGIN_PX;
    let title = format!("{} against {}", plots.metric, plots.reference);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} \
         {height:.0}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#222\">\n<title>{}</title>\n\
         <rect width=\"{width:.0}\" height=\"{height:.0}\" fill=\"#fff\"/>\n",
        escape(&title)
    );
    // Writing to a string cannot fail.
    let _ = draw_head(&mut svg, plots, &title);
    for (k, run) in plots.runs.iter().enumerate() {
        let _ = draw_run(&mut svg, plots, run, [MARGIN_PX + k as f64 * (WIDTH_PX + BETWEEN_PX), head_px]);
    }
    svg.push_str("</svg>\n");
    svg
}

fn draw_head(svg: &mut String, plots: &TruthPlots, title: &str) -> std::fmt::Result {
    let mut y = 30.0;
    text(svg, (MARGIN_PX, y), r#"font-size="16" font-weight="bold""#, title)?;
    for line in plots.title.lines() {
        y += 18.0;
        text(svg, (MARGIN_PX, y), r##"fill="#555""##, line)?;
    }
    y += 26.0;
    let mut x = MARGIN_PX;
    let bands = [("reference", "#555", "5 3", 1.5, 1.0), ("mean ± std", SERIES_COLOURS[4], "", 9.0, 0.3)];
    let levels = LEVELS
        .iter()
        .zip(&SERIES_COLOURS[1..])
        .map(|((name, dashes), colour)| (*name, *colour, *dashes, 2.0, 1.0));
    for (name, colour, dashes, width, opacity) in levels.chain(bands) {
        writeln!(
            svg,
            r#"<path d="M{x:.0} {:.0}h30" stroke="{colour}" stroke-width="{width}" stroke-opacity="{opacity}" stroke-dasharray="{dashes}"/>"#,
            y - 4.0
        )?;
        text(svg, (x + 36.0, y), "", name)?;
        x += 120.0;
    }
    y += 24.0;
    text(svg, (MARGIN_PX, y), "", "error 0")?;
    for (k, colour) in bad_colours().into_iter().enumerate() {
        let x = MARGIN_PX + 50.0 + 14.0 * k as f64;
        writeln!(
            svg,
            r#"<rect x="{x:.0}" y="{:.0}" width="14" height="10" fill="{}"/>"#,
            y - 9.0,
            hex(colour)
        )?;
    }
    let worst = format!("{} or more", plots.with_unit(plots.top()));
    text(svg, (MARGIN_PX + 58.0 + 14.0 * STEPS as f64, y), "", &worst)
}

/// The column of a run.
fn draw_run(svg: &mut String, plots: &TruthPlots, run: &TruthRun, [x, mut y]: [f64; 2]) -> std::fmt::Result {
    text(svg, (x, y + 14.0), r#"font-size="14" font-weight="bold""#, &cut(&run.name))?;
    for (k, (name, value)) in run.stats.named().into_iter().enumerate() {
        let (column, row) = ((k % 3) as f64, (k / 3) as f64);
        let at = (x + 160.0 * column, y + 34.0 + 17.0 * row);
        text(svg, at, r##"fill="#555""##, name)?;
        text(svg, (at.0 + 60.0, at.1), "", &format!("{value:.6}"))?;
    }
    y += STATS_PX;
    let mut draw = |plot: &Plot, height: f64, as_map: bool| {
        svg.push_str(&plot.to_part([x, y], [WIDTH_PX, height], as_map));
        y += height;
    };
    let top = plots.top();
    draw(&coloured_way(plots, run, top, Side::Above), WAY_PX, true);
    draw(&coloured_way(plots, run, top, Side::Front), SIDE_PX, false);
    draw(&error_over(plots, run, Over::Time), ERROR_PX, false);
    draw(&error_over(plots, run, Over::Way), ERROR_PX, false);
    (0..3).for_each(|k| draw(&places(plots, run, k), THIRD_PX, false));
    (0..3).for_each(|k| draw(&angles(plots, run, k), THIRD_PX, false));
    Ok(())
}
