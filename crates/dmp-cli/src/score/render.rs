//! The report for a person.

use std::io::{self, Write};

use dmp::{DriftReport, FreeSpaceReport, Report, SegmentLength};
use dmp_draw::text::{self, Side, Table, counted, percent};
use dmp_draw::{ScoreColumn, drift_beside_scores, drift_in_words, pairs_in_words, promise, ranking};

use crate::say::tell;

use super::{details, pairs, sampling};

/// Writes the report: settings, runs, pairs, warnings.
pub(crate) fn report(out: &mut impl Write, report: &Report, verbose: bool) -> io::Result<()> {
    writeln!(out, "{}", settings(report))?;
    if let Some(note) = report.inputs.without_checksums() {
        writeln!(out, "log: {note}")?;
    }
    if let Some(sample) = sampling::in_words(&report.sampling) {
        tell!(out, "{sample}")?;
    }
    if let Some(free_space) = &report.free_space {
        tell!(out, "{}", left_out(free_space))?;
    }
    for run in &report.inputs.runs {
        for note in &run.map_notes {
            tell!(out, "map of {}: {note}", run.name)?;
        }
    }
    writeln!(out)?;
    runs(out, report)?;
    if !report.pairs.is_empty() {
        writeln!(out)?;
        pairs::verdicts(out, report)?;
    }
    if let Some(drift) = &report.drift {
        writeln!(out)?;
        drift_of_runs(out, report, drift, verbose)?;
    }
    if verbose {
        details::all(out, report)?;
    }
    let warnings = dmp_draw::warnings(report);
    if !warnings.is_empty() {
        writeln!(out, "\nWarnings")?;
        for warning in warnings {
            tell!(out, "  {warning}")?;
        }
    }
    writeln!(out, "\n{}", limits(report))
}

/// How far the runs are off where they come back, in metres.
fn drift_of_runs(
    out: &mut impl Write,
    report: &Report,
    drift: &DriftReport,
    verbose: bool,
) -> io::Result<()> {
    tell!(out, "{}", drift_in_words(drift))?;
    if drift.pairs_measured == 0 {
        return Ok(());
    }
    writeln!(out, "{}", pairs_in_words(drift))?;
    if verbose {
        crate::drift::render::runs(out, drift)?;
    }
    drift_beside_scores(report).iter().try_for_each(|line| tell!(out, "{line}"))
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
    let count = counted(config.segments.count as u64, "segment");
    let segments = match config.segments.length() {
        // Whole metres without a decimal, as everybody writes them.
        Some(SegmentLength::Metres(m)) => format!("{count} of {} m", (10.0 * m).round() / 10.0),
        Some(SegmentLength::Seconds(s)) => format!("{count} of {s} s"),
        Some(SegmentLength::Scans(scans)) => format!("{count} of {}", counted(scans, "scan")),
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

/// A line of a column's head: name, truncation, unit.
fn head_of(column: &ScoreColumn, line: usize) -> String {
    match (line, column.scale_m) {
        (0, _) => column.name.to_owned(),
        (1, Some(scale_m)) => format!("{scale_m} m"),
        (1, None) => column.detail.to_owned(),
        _ => column.unit.to_owned(),
    }
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

fn runs(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let ranking = ranking(report);
    let is_sample = report.is_sample();
    // Behind the first column, how far a sample may be off.
    let row = |first: String, second: &str, mut cells: Vec<String>, error: String| {
        if is_sample {
            cells.insert(1, error);
        }
        cells.splice(0..0, [first, second.to_owned()]);
        cells
    };
    let mut sides = vec![Side::Right, Side::Left];
    sides.resize(2 + ranking.columns.len() + usize::from(is_sample), Side::Right);
    let mut table = Table::new(sides);
    let sure = text::confidence(report.promise.confidence);
    let errors = ["±", &sure, ranking.unit()];
    for (line, (title, error)) in ["run", "", ""].into_iter().zip(errors).enumerate() {
        let heads = ranking.columns.iter().map(|column| head_of(column, line)).collect();
        table.row(row(String::new(), title, heads, error.to_owned()));
    }
    for run in &ranking.rows {
        let error = sampling::half_width(&ranking, run);
        table.row(row(run.rank.clone(), &run.run.name, run.cells.clone(), error));
    }
    table.write(out, "")?;
    for run in &report.left_out {
        tell!(out, "–  {}  left out", run.name)?;
    }
    writeln!(out)?;
    let means = "RMS of measured minus predicted range, cut off at the length above; less is better";
    let scales = report.config.scales;
    let (widest_m, blocked_m) = (scales.lengths().widest_m(), scales.lengths().blocked_m);
    let rates = format!("rays that hit nothing; blocked: that hit something over {blocked_m} m too early");
    let has_depth = report.runs.iter().any(|run| run.dmp_depth_mean_m2.is_some());
    let depth = if has_depth { "; depth: along the optical axis, as cameras measure" } else { "" };
    if report.is_cross_validated() {
        writeln!(out, "R_cv      {means};")?;
        let missing_m = widest_m * report.config.miss_price.sqrt();
        writeln!(
            out,
            "          predicted from other parts of the drive; at {widest_m} m, {missing_m:.*} m off where that is impossible",
            if widest_m >= 10.0 { 1 } else { 2 }
        )?;
        writeln!(out, "R_near    the same with the nearest surfel on the ray, whenever it was seen")?;
        writeln!(out, "DMP       mean square to the first surfel on the ray, not cut off{depth}")?;
        writeln!(
            out,
            "coverage  returns predicted from other parts of the drive; revisit: from another visit"
        )?;
    } else {
        writeln!(out, "R_near    {means};")?;
        writeln!(out, "          predicted by the nearest surfel on the ray")?;
        writeln!(out, "DMP       mean square to the first surfel on the ray, not cut off{depth}")?;
    }
    writeln!(out, "miss      {rates}")?;
    if is_sample {
        writeln!(out, "±         how far the score before it may be off, as sure as is said")?;
    }
    if !report.ties.is_empty() {
        writeln!(out, "=         the run above is not decided to be better")?;
    }
    Ok(())
}

fn limits(report: &Report) -> String {
    let scores = "Scores compare runs of this log under these settings only.";
    promise(report).map_or(scores.to_owned(), |promise| format!("{scores}\n{promise}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example_reports;

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
=         the run above is not decided to be better

Pairs                            decided at           first minus second, m²          interval
truth  undecided against  größe  –                                         –                 –
truth  better than        drift  R_cv 10 m, globally                  -0.254  -0.307 to -0.201
größe  mixed against      drift  R_cv 10 m, globally                  -0.254  -0.307 to -0.201
truth, größe: undecided: no scale shows a difference outside its interval
größe, drift: better on the whole, globally: decided at the 10 m scale, but worse in frames 12–40 at 30 m

Warnings
  3 of 600 scans have no pose in `drift`
  drift: R_cv is not given: coverage is 0.431, below 0.5; pairs are still compared on common returns

Scores compare runs of this log under these settings only.
At most 1 % of commands tell any two equal runs apart: all pairs and 4 scales share that, so each interval is at 99.75 %.
",
        ];
        assert_eq!(text_of(&example_reports::three_runs(), false), expected.concat());
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
        assert_eq!(text_of(&example_reports::one_run(), false), expected.concat());
    }

    #[test]
    fn given_maps_are_ranked_by_the_nearest_surfel() {
        let text = text_of(&example_reports::given_maps(), false);
        assert!(text.contains("every scan a segment"), "{text}");
        assert!(!text.contains("R_cv"), "{text}");
        assert!(text.contains("\n2  b      1.20   0.400    4.00  13.8   2.1     12.3\n"), "{text}");
        assert!(text.contains("R_near 5 m, globally"), "{text}");
    }

    #[test]
    fn a_verbose_report_leaves_nothing_out() {
        let text = text_of(&example_reports::three_runs(), true);
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
