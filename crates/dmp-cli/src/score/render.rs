//! The report for a person.

use std::io::{self, Write};

use dmp::{FreeSpaceReport, Report, RunReport};

use super::{details, pairs, sampling};
use crate::text::{self, NONE, Side, Table, counted, digits, percent};

/// A column of the table of runs.
struct Column {
    head: [&'static str; 3],
    value: fn(&RunReport) -> Option<f64>,
    show: fn(f64) -> String,
}

const fn root_m(name: &'static str, scale: &'static str, value: fn(&RunReport) -> Option<f64>) -> Column {
    Column { head: [name, scale, "m"], value, show: |square_m2| digits(square_m2.sqrt()) }
}

const fn root_cm(name: &'static str, scale: &'static str, value: fn(&RunReport) -> Option<f64>) -> Column {
    Column { head: [name, scale, "cm"], value, show: |square_m2| digits(100.0 * square_m2.sqrt()) }
}

const fn share(name: &'static str, value: fn(&RunReport) -> Option<f64>) -> Column {
    Column { head: [name, "", "%"], value, show: percent }
}

const DMP_MEAN: Column = Column { head: ["DMP", "mean", "m²"], value: |run| run.dmp_mean_m2, show: digits };
const MISS: Column = share("miss", |run| run.miss_rate);
const BLOCKED: Column = share("blocked", |run| run.blocked_rate);

/// Where at least one run's map was fused from the scans.
const CROSS_VALIDATED: [Column; 9] = [
    root_m("R_cv", "10 m", |run| run.r_cv_m2.at_10),
    root_m("R_cv", "2 m", |run| run.r_cv_m2.at_2),
    root_cm("R_cv", "0.5 m", |run| run.r_cv_m2.at_0_5),
    root_cm("R_near", "0.5 m", |run| run.r_near_m2.at_0_5),
    DMP_MEAN,
    share("coverage", |run| run.coverage),
    share("revisit", |run| run.coverage_revisit),
    MISS,
    BLOCKED,
];

/// Where all maps were given: no crossing is known to be independent.
const NEAREST: [Column; 6] = [
    root_m("R_near", "5 m", |run| run.r_near_m2.at_5),
    root_m("R_near", "2 m", |run| run.r_near_m2.at_2),
    root_cm("R_near", "0.5 m", |run| run.r_near_m2.at_0_5),
    DMP_MEAN,
    MISS,
    BLOCKED,
];

/// Writes the report: settings, runs, pairs, warnings.
pub(crate) fn report(out: &mut impl Write, report: &Report, verbose: bool) -> io::Result<()> {
    writeln!(out, "{}", settings(report))?;
    if let Some(sample) = sampling::in_words(&report.sampling) {
        writeln!(out, "{sample}")?;
    }
    if let Some(free_space) = &report.free_space {
        writeln!(out, "{}", left_out(free_space))?;
    }
    for run in &report.inputs.runs {
        for note in &run.map_notes {
            writeln!(out, "map of {}: {note}", run.name)?;
        }
    }
    writeln!(out)?;
    runs(out, report)?;
    if !report.pairs.is_empty() {
        writeln!(out)?;
        pairs::verdicts(out, report)?;
    }
    if verbose {
        details::all(out, report)?;
    }
    let warnings = report.all_warnings();
    if !warnings.is_empty() {
        writeln!(out, "\nWarnings")?;
        for warning in warnings {
            writeln!(out, "  {warning}")?;
        }
    }
    writeln!(out, "\n{}", limits(report))
}

fn settings(report: &Report) -> String {
    let (inputs, config) = (&report.inputs, &report.config);
    let of = |used: u64, all: u64, what: &str| {
        if used == all {
            counted(all, what)
        } else {
            format!("{} of {}", text::count(used), counted(all, what))
        }
    };
    let segments = match config.segments.length_m {
        // Whole metres without a decimal, as everybody writes them.
        Some(length_m) => {
            let segments = counted(config.segments.count as u64, "segment");
            format!("{segments} of {} m", (10.0 * length_m).round() / 10.0)
        }
        None => "every scan a segment".to_owned(),
    };
    let returns = match report.sampling.places {
        Some(_) => format!("{} scored", counted(inputs.returns_used, "return")),
        None => of(inputs.returns_used, inputs.returns, "return"),
    };
    format!(
        "{}, {returns}; voxel {} m, {segments}, ranges {} to {} m",
        of(inputs.scans_used as u64, inputs.scans as u64, "scan"),
        // The edge is a multiple of 2^-13 m: shown in millimetres, as it was asked for.
        (1e3 * config.voxel_m).round() / 1e3,
        config.min_range_m,
        config.max_range_m
    )
}

/// What was kept out of the maps, and by whose word.
fn left_out(free_space: &FreeSpaceReport) -> String {
    let share = free_space.returns_left_out as f64 / free_space.returns_fused.max(1) as f64;
    format!(
        "in no map: {} ({} %) on trails, which rays pass through in {}",
        counted(free_space.returns_left_out, "return"),
        percent(share),
        free_space.votes.join(", ")
    )
}

fn is_cross_validated(report: &Report) -> bool {
    report.runs.iter().any(|run| run.coverage.is_some())
}

fn runs(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let cross_validated = is_cross_validated(report);
    let columns: &[Column] = if cross_validated { &CROSS_VALIDATED } else { &NEAREST };
    let is_sample = sampling::is_sample(report);
    // Behind the first column, how far a sample may be off.
    let with_error = |mut cells: Vec<String>, error: String| {
        if is_sample {
            cells.insert(3, error);
        }
        cells
    };
    let mut sides = vec![Side::Right, Side::Left];
    sides.resize(2 + columns.len() + usize::from(is_sample), Side::Right);
    let mut table = Table::new(sides);
    for (line, (title, error)) in [("run", "±"), ("", "99 %"), ("", "m")].into_iter().enumerate() {
        let heads = columns.iter().map(|column| column.head[line].to_owned());
        let cells = [String::new(), title.to_owned()].into_iter().chain(heads).collect();
        table.row(with_error(cells, error.to_owned()));
    }
    for (place, name) in report.order.iter().enumerate() {
        let Some(run) = report.runs.iter().find(|run| run.name == *name) else { continue };
        let above = place.checked_sub(1).and_then(|above| report.order.get(above));
        let tied = above.is_some_and(|above| report.ties.iter().any(|[a, b]| a == above && b == name));
        let rank = if tied { "=".to_owned() } else { (place + 1).to_string() };
        let show = |column: &Column| (column.value)(run).map_or(NONE.to_owned(), column.show);
        let error = sampling::half_width(run, cross_validated);
        table.row(with_error(
            [rank, name.clone()].into_iter().chain(columns.iter().map(show)).collect(),
            error,
        ));
    }
    table.write(out, "")?;
    writeln!(out)?;
    let means = "RMS of measured minus predicted range, cut off at the length above; less is better";
    let rates = "rays that hit nothing; blocked: that hit something over 0.5 m too early";
    if is_cross_validated(report) {
        writeln!(out, "R_cv      {means};")?;
        let missing_m = 10.0 * report.config.miss_price.sqrt();
        writeln!(
            out,
            "          predicted from other parts of the drive; at 10 m, {missing_m:.1} m off where that is impossible"
        )?;
        writeln!(out, "R_near    the same with the nearest surfel on the ray, whenever it was seen")?;
        writeln!(out, "DMP       mean square to the first surfel on the ray, not cut off")?;
        writeln!(
            out,
            "coverage  returns predicted from other parts of the drive; revisit: from another visit"
        )?;
    } else {
        writeln!(out, "R_near    {means};")?;
        writeln!(out, "          predicted by the nearest surfel on the ray")?;
        writeln!(out, "DMP       mean square to the first surfel on the ray, not cut off")?;
    }
    writeln!(out, "miss      {rates}")?;
    if sampling::is_sample(report) {
        writeln!(out, "±         how far the score before it may be, at 99 %, from that of all scans")?;
    }
    if !report.ties.is_empty() {
        writeln!(out, "=         not decided against the run above")?;
    }
    Ok(())
}

fn limits(report: &Report) -> String {
    let scores = "Scores compare runs of this log under these settings only.";
    match report.pairs.iter().map(|pair| pair.scales.len()).max() {
        Some(scales) => {
            let confidence = (1e4 * report.sampling.confidence).round() / 1e2;
            let sample = if sampling::is_sample(report) {
                "\nOf a sample, better means: all scans would show the smaller value. Whether that is beyond chance, only all \
                 scans tell."
            } else {
                ""
            };
            format!(
                "{scores}{sample}\nA verdict takes up to {scales} looks, one at each scale, each at {confidence} %."
            )
        }
        None => scores.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::sample;

    fn text_of(given: &Report, verbose: bool) -> String {
        let mut text = Vec::new();
        report(&mut text, given, verbose).unwrap();
        String::from_utf8(text).unwrap()
    }

    const LEGEND: &str = "
R_cv      RMS of measured minus predicted range, cut off at the length above; less is better;
          predicted from other parts of the drive; at 10 m, 3.9 m off where that is impossible
R_near    the same with the nearest surfel on the ray, whenever it was seen
DMP       mean square to the first surfel on the ray, not cut off
coverage  returns predicted from other parts of the drive; revisit: from another visit
miss      rays that hit nothing; blocked: that hit something over 0.5 m too early
";

    #[test]
    fn three_runs_look_like_this() {
        let expected = [
            "\
597 of 600 scans, 1,200,000 of 1,234,567 returns; voxel 0.2 m, 29 segments of 12 m, ranges 1.5 to 100 m

   run    R_cv   R_cv   R_cv  R_near   DMP  coverage  revisit  miss  blocked
          10 m    2 m  0.5 m   0.5 m  mean
             m      m     cm      cm    m²         %        %     %        %
1  truth  1.50  0.400   10.0    2.00  3.46      81.2     34.5   2.1     12.3
=  größe  1.57  0.420   10.5    2.10  3.80      81.2     34.5   2.1     12.3
3  drift     –      –      –    2.83  6.91      43.1     34.5   2.1     12.3
",
            LEGEND,
            "\
=         not decided against the run above

Pairs                            decided at           first minus second, m²     99 % interval
truth  undecided against  größe  –                                         –                 –
truth  better than        drift  R_cv 10 m, globally                  -0.254  -0.307 to -0.201
größe  mixed against      drift  R_cv 10 m, globally                  -0.254  -0.307 to -0.201
truth, größe: undecided: no scale shows a difference outside its interval
größe, drift: better on the whole, globally: decided at the 10 m scale, but worse in frames 12–40 at 30 m

Warnings
  3 of 600 scans have no pose in `drift`
  drift: R_cv is not given: coverage is 0.431, below 0.5; pairs are still compared on common returns

Scores compare runs of this log under these settings only.
A verdict takes up to 4 looks, one at each scale, each at 99 %.
",
        ];
        assert_eq!(text_of(&sample::three_runs(), false), expected.concat());
    }

    #[test]
    fn a_run_alone_has_no_pairs() {
        let expected = [
            "\
597 of 600 scans, 1,200,000 of 1,234,567 returns; voxel 0.2 m, 29 segments of 12 m, ranges 1.5 to 100 m

   run    R_cv   R_cv   R_cv  R_near   DMP  coverage  revisit  miss  blocked
          10 m    2 m  0.5 m   0.5 m  mean
             m      m     cm      cm    m²         %        %     %        %
1  truth  1.50  0.400   10.0    2.00  3.46      81.2     34.5   2.1     12.3
",
            LEGEND,
            "
Scores compare runs of this log under these settings only.
",
        ];
        assert_eq!(text_of(&sample::one_run(), false), expected.concat());
    }

    #[test]
    fn given_maps_are_ranked_by_the_nearest_surfel() {
        let text = text_of(&sample::given_maps(), false);
        assert!(text.contains("every scan a segment"), "{text}");
        assert!(!text.contains("R_cv"), "{text}");
        assert!(text.contains("\n2  b      1.20   0.400    4.00  13.8   2.1     12.3\n"), "{text}");
        assert!(text.contains("R_near 5 m, globally"), "{text}");
    }

    #[test]
    fn a_verbose_report_leaves_nothing_out() {
        let text = text_of(&sample::three_runs(), true);
        for part in [
            "truth   größe  R_cv 0.2 m        -0.00508  -0.00614 to -0.00402         876,543\n",
            "  99 % interval      2.00 to 2.50  2.20 to 2.75             –\n",
            "dropped: too near     30,000\n",
            "Memory  peak 300 MiB of 2.00 GiB; 0 B of scratch files, 182 tile loads for 182 visits of 160 tiles\n",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert!(!text.contains("vehicle"), "{text}");
    }
}
