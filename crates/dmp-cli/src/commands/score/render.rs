//! The report for a person.

use std::io::{self, Write};

use dmp::{DriftReport, QuickReport, Report};
use dmp_draw::text::{self, counted, shortened};
use dmp_draw::{answer, drift_beside_scores, drift_in_words, legend, pairs_in_words, places, promise};

use super::ranked::Ranked;
use super::{details, pairs};
use crate::console::{Terminal, Tone};

/// Columns of a name in the answer.
const NAME: usize = 40;

/// Writes the report: the answer, the runs, drift, warnings, what went in.
pub(crate) fn report(
    out: &mut impl Write,
    report: &Report,
    verbose: bool,
    terminal: Terminal,
) -> io::Result<()> {
    terminal.tell_in(out, Tone::Strong, &answer(report, |name| shortened(name, NAME)))?;
    writeln!(out)?;
    runs(out, report, verbose, terminal)?;
    if let Some(drift) = &report.drift {
        drift_of_runs(out, report, drift, verbose, terminal)?;
    }
    if verbose {
        details::all(out, report, terminal)?;
    }
    let warnings = dmp_draw::warnings(report);
    if !warnings.is_empty() {
        writeln!(out)?;
    }
    for warning in warnings {
        terminal.tell(out, "", &format!("warning: {warning}"))?;
    }
    writeln!(out)?;
    what_went_in(report).iter().try_for_each(|line| terminal.tell(out, "", line))?;
    terminal.tell(out, "", &what_it_is_good_for(report, verbose))
}

/// What may be compared, and how sure the verdicts are.
fn what_it_is_good_for(report: &Report, verbose: bool) -> String {
    let only = "Compare within this log and settings only";
    let is_decided = report.pairs.iter().any(|pair| pair.verdict.ahead().is_some());
    match promise(report) {
        Some(promise) if verbose => format!("{only}. {promise}"),
        Some(_) if is_decided => {
            let sure = text::confidence(report.promise.confidence);
            let by_drift = report.pairs.iter().any(|pair| pair.verdict.is_by_drift());
            let [of, too] = if by_drift { [" by scores", ", and all by drift"] } else { ["", ""] };
            format!("{only}; all verdicts{of} together are {sure} sure{too}.")
        }
        _ => format!("{only}."),
    }
}

/// The table of the runs, what its columns mean, and what is not shown.
fn runs(out: &mut impl Write, report: &Report, verbose: bool, terminal: Terminal) -> io::Result<()> {
    let table = Ranked::new(report, terminal);
    table.write(out, verbose)?;
    writeln!(out)?;
    let legend = legend(report, &table.names(verbose), !verbose);
    let width = legend.iter().fold(8, |width, (term, _)| width.max(term.len()));
    for (term, meaning) in legend {
        terminal.tell(out, &format!("{term:<width$}  "), &meaning)?;
    }
    for said in places(report, |name| shortened(name, NAME)) {
        terminal.tell(out, "", &said)?;
    }
    if verbose {
        return Ok(());
    }
    let mut remarks = Vec::new();
    pairs::remarks(&mut remarks, report, terminal)?;
    if !remarks.is_empty() {
        writeln!(out)?;
    }
    let (columns, has_short_names) = table.hidden();
    let counts = [(pairs::others(report), "more pair"), (columns, "more column")];
    let counts = counts.into_iter().filter(|(count, _)| *count > 0);
    let mut more: Vec<String> = counts.map(|(count, what)| counted(count as u64, what)).collect();
    if has_short_names {
        more.push("whole names".to_owned());
    }
    if !more.is_empty() {
        terminal.tell(&mut remarks, "", &format!("{}: -v or --json", more.join(", ")))?;
    }
    out.write_all(&remarks)
}

/// The drift of the runs at revisits, in metres; in short that there is none.
fn drift_of_runs(
    out: &mut impl Write,
    report: &Report,
    drift: &DriftReport,
    verbose: bool,
    terminal: Terminal,
) -> io::Result<()> {
    if drift.is_measured() && !verbose {
        return Ok(());
    }
    writeln!(out)?;
    terminal.tell(out, "", &drift_in_words(drift, report.config.scales))?;
    if !drift.is_measured() {
        return Ok(());
    }
    terminal.tell(out, "", &pairs_in_words(drift))?;
    crate::commands::drift::render::runs(drift).write_within(out, terminal.width)?;
    drift_beside_scores(report).iter().try_for_each(|line| terminal.tell(out, "", line))
}

/// What was scored, and how: a line each.
fn what_went_in(report: &Report) -> Vec<String> {
    let mut lines = vec![settings(report)];
    lines.extend(report.inputs.without_checksums().map(|note| format!("log: {note}")));
    lines.extend(report.sampling.quick.map(|quick| quick_in_words(&quick, report.inputs.bytes)));
    for run in &report.inputs.runs {
        lines.extend(run.map_notes.iter().map(|note| format!("map of {}: {note}", run.name)));
    }
    lines
}

/// What a quick score took.
fn quick_in_words(quick: &QuickReport, log_bytes: u64) -> String {
    let percent = 100.0 * quick.bytes as f64 / log_bytes.max(1) as f64;
    format!("a quick score: look {} of {}, on {percent:.0} % of the log's bytes", quick.look, quick.looks)
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
    let segments = text::segments_in_words(inputs.runs.iter().map(|run| &run.segments));
    let returns = of(inputs.returns_used, inputs.returns, "return");
    let drawn = match report.sampling.returns_one_in {
        1 => String::new(),
        one_in => format!(" cast, one of {one_in} consecutive"),
    };
    format!(
        "{}, {returns}{drawn}; voxel {} m, {segments}, ranges {} to {} m",
        of(inputs.scans_used as u64, inputs.scans as u64, "scan"),
        // The edge is a multiple of 2^-13 m: shown in millimetres, as it was asked for.
        (1e3 * config.voxel_m).round() / 1e3,
        config.min_range_m,
        config.max_range_m
    )
}

#[cfg(test)]
mod tests {
    use dmp::Verdict;
    use dmp_draw::text::width_of;

    use super::*;
    use crate::example_reports;

    fn text_at(given: &Report, verbose: bool, terminal: Terminal) -> String {
        let mut text = Vec::new();
        report(&mut text, given, verbose, terminal).unwrap();
        String::from_utf8(text).unwrap()
    }

    fn text_of(given: &Report, verbose: bool) -> String {
        text_at(given, verbose, Terminal::default())
    }

    fn terminal(width: usize) -> Terminal {
        Terminal { width, ..Terminal::default() }
    }

    #[test]
    fn three_runs_look_like_this() {
        let expected = "\
truth and größe share the first rank. drift is worse. But only 43.1 % of the
returns of drift meet what other scans saw: see the warnings.

   run    verdict                thick  R_cv   R_cv   R_cv  coverage  revisit
                                        10 m    2 m  0.5 m
                                    cm     m      m     cm         %        %
1  truth  undecided               0.47  1.50  0.400   10.0      81.2     34.5
1  größe  undecided               0.47  1.57  0.420   10.5      81.2     34.5
3  drift  12.0 cm worse at 10 m   0.47     –      –      –      43.1     34.5

rank      shared by runs that are the same, or undecided against each other
verdict   RMS error above the first's, capped as named, on common returns
thick     RMS distance of points from the flat surface they lie on (median)
R_cv      RMS range error, capped as headed, to what other scans saw
coverage  share of returns on what other scans saw, too (more is better)
revisit   share of returns on surfaces that another visit saw

truth against größe: undecided: the residuals differ by no more than may be
chance (at 0.2 m größe is 1.69 cm worse, and may be 1.36 to 2.03 cm worse)
1 more pair, 5 more columns: -v or --json

warning: 3 of 600 scans have no pose in `drift`
warning: drift: R_cv is not given: coverage is 43.1 %, below 50 %; pairs are
still compared on common returns

597 of 600 scans, 1,200,000 of 1,234,567 returns; voxel 0.2 m, 29 segments of
12 m, ranges 1.5 to 100 m
Compare within this log and settings only; all verdicts together are 99 % sure.
";
        assert_eq!(text_of(&example_reports::three_runs(), false), expected);
    }

    #[test]
    fn a_run_alone_has_no_pairs() {
        let text = text_of(&example_reports::one_run(), false);
        assert!(text.starts_with("truth was scored alone. "), "{text}");
        assert!(
            text.contains("\n1  truth   0.47  1.50  0.400   10.0      81.2     34.5    2.00  3.46   2.1\n"),
            "{text}"
        );
        assert!(!text.contains("verdict") && !text.contains("pair"), "{text}");
    }

    #[test]
    fn two_runs_are_compared_in_a_sentence() {
        let mut report = example_reports::many_runs(2);
        let mut said = |verdict: Verdict| {
            report.pairs[0].verdict = verdict;
            text_of(&report, false).lines().next().unwrap().to_owned()
        };
        let (run, decided_at_m) = ("run 1".to_owned(), 10.0);
        assert_eq!(
            said(Verdict::Mixed { run, decided_at_m }),
            "run 1 is better than run 0 on the whole, but worse at some places."
        );
        assert_eq!(said(Verdict::Same), "run 0 and run 1 are the same.");
        assert_eq!(said(Verdict::Undecided), "Nothing is decided between run 0 and run 1.");
    }

    #[test]
    fn what_is_not_shown_of_many_runs_is_counted() {
        let report = example_reports::many_runs(12);
        let text = text_of(&report, false);
        assert!(text.starts_with("run 0 is best: better than all 11 others.\n"), "{text}");
        let more = "\n55 more pairs, 5 more columns: -v or --json\n";
        assert!(text.contains(more), "{text}");
        let verbose = text_of(&report, true);
        assert_eq!(verbose.lines().filter(|line| line.contains(" against run ")).count(), 66);
        assert!(verbose.contains(" R_near ") && !verbose.contains("-v or --json"), "{verbose}");
        // A wide terminal has room for all columns.
        let wide = text_at(&report, false, terminal(140));
        assert!(wide.contains("\n55 more pairs: -v or --json\n") && wide.contains("blocked"), "{wide}");
    }

    #[test]
    fn every_line_fits() {
        let mut long = example_reports::many_runs(12);
        let json = serde_json::to_string(&long).unwrap();
        let name = format!("\"{} run ", "地図/größe_".repeat(12));
        long = serde_json::from_str(&json.replace("\"run ", &name)).unwrap();
        let mut three = example_reports::three_runs();
        three.warnings.push("a long warning of some words ".repeat(9));
        for report in [long, three, example_reports::given_maps(), example_reports::one_run()] {
            for width in [60, 80, 140] {
                for verbose in [false, true] {
                    let text = text_at(&report, verbose, terminal(width));
                    let wide = text.lines().find(|line| width_of(line) > width.max(80));
                    assert_eq!(wide, None, "{width}\n{text}");
                }
            }
        }
    }

    #[test]
    fn only_columns_that_are_shown_are_explained() {
        let mut seen = [false; 2];
        for report in [example_reports::three_runs(), example_reports::one_run()] {
            for width in 60..140 {
                let text = text_at(&report, false, terminal(width));
                let head = text.lines().find(|line| line.contains("   run ")).unwrap();
                for (column, meaning) in [("revisit", "that another visit saw"), ("blocked", "m too early")] {
                    let shown = head.contains(column);
                    seen[usize::from(shown)] = true;
                    let words: Vec<&str> = text.split_whitespace().collect();
                    assert_eq!(words.join(" ").contains(meaning), shown, "{width}\n{text}");
                }
            }
        }
        assert_eq!(seen, [true; 2]);
    }

    #[test]
    fn names_that_are_cut_are_whole_in_the_verbose_report() {
        let mut report = example_reports::many_runs(2);
        let name = "a/very/long/folder/of/runs/from/monday/".repeat(2) + "kiss";
        let json = serde_json::to_string(&report).unwrap().replace("run 0", &name);
        report = serde_json::from_str(&json).unwrap();
        let text = text_of(&report, false);
        assert!(text.contains("\n1  a/very/long…") && text.contains("monday/kiss  best "), "{text}");
        assert!(text.contains(" more columns, whole names: "), "{text}");
        assert!(text_of(&report, true).contains(&format!("\n1  {}", &name[..70])));
    }

    #[test]
    fn colours_change_no_word() {
        let report = example_reports::three_runs();
        let text = text_at(&report, true, Terminal { has_colour: true, ..Terminal::default() });
        let first = text.lines().next().unwrap();
        assert!(first.starts_with("\u{1b}[1mtruth and") && first.ends_with("\u{1b}[0m"), "{first}");
        assert!(
            text.contains("\u{1b}[33mundecided\u{1b}[0m") && text.contains(" worse at 10 m\u{1b}[0m"),
            "{text}"
        );
        let plain = anstream::adapter::strip_str(&text).to_string();
        assert_eq!(plain, text_of(&report, true));
    }

    #[test]
    fn equal_runs_share_a_rank() {
        let mut report = example_reports::many_runs(3);
        report.pairs.iter_mut().for_each(|pair| pair.verdict = Verdict::Undecided);
        report.ties = [["run 0", "run 1"], ["run 1", "run 2"]].map(|pair| pair.map(str::to_owned)).to_vec();
        let text = text_of(&report, false);
        assert!(text.starts_with("run 0, run 1 and run 2 share the first rank.\n"), "{text}");
        assert!(text.contains("\n1  run 0  undecided ") && text.contains("\n1  run 2  undecided "), "{text}");
        assert!(text.contains("\nrun 0 against run 1: better globally"), "{text}");
    }

    #[test]
    fn given_maps_are_ranked_by_the_nearest_surfel() {
        let text = text_of(&example_reports::given_maps(), false);
        assert!(text.contains("every scan a\nsegment"), "{text}");
        assert!(!text.contains("R_cv"), "{text}");
        assert!(text.contains("\n2  b    8.47 cm worse at 5 m "), "{text}");
        assert!(text.contains("R_near    RMS range error to the nearest surface"), "{text}");
    }

    #[test]
    fn a_verbose_report_shows_everything() {
        let text = text_of(&example_reports::three_runs(), true);
        for part in [
            "\ntruth against drift: better, decided at R_cv 10 m: globally\n",
            "\n  R_cv 0.2 m   0.141   0.158     -0.00508  -0.00614 to -0.00402  876,543\n",
            "  99 % interval        2.00 to 2.50    2.20 to 2.75                –\n",
            "dropped: too near     30,000\n",
            "Memory  peak 300 MiB of 2.00 GiB; 0 B of scratch files, 182 tile loads for 182\nvisits of 160 tiles\n",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert!(!text.contains("vehicle"), "{text}");
    }
}
