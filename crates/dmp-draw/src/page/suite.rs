//! The report of a suite as one HTML page.

use dmp_report::Verdict;
use dmp_suite::{Outcome, SuitePairReport, SuiteReport};

use super::html::{Document, cell, head, list, paragraph, section, table};
use crate::plot::escape;
use crate::text::{NONE, count, counted};
use crate::words::{OrderedVersions, log_word, ordered_versions, p_value, suite_answer, suite_promise};

/// The page: one file that needs nothing else, light or dark as its reader likes, without scripts. `remarks` are sentences to
/// stand behind the verdicts, as of gates that failed.
pub fn suite_page(report: &SuiteReport, remarks: &[String]) -> String {
    let title = match report.versions.as_slice() {
        [old, new] => format!("{old} or {new}: which makes the better maps?"),
        _ => "Which version makes the better maps?".to_owned(),
    };
    let pairs = ordered_versions(report);
    let mut main = verdict(report, &pairs, remarks);
    let warnings =
        section("warnings", "Warnings", &list("<ul>", report.warnings.iter().map(|text| escape(text))));
    main.push_str(&warnings.replacen("<section", "<section class=\"warnings\"", 1));
    main.push_str(&section("overall", "Over all logs", &(counts(&pairs) + &effects(report, &pairs))));
    main.push_str(&section("logs", "Every log, worst first", &matrix(report)));
    main.push_str(&section("what", "What was scored", &scored(report)));
    let document = Document {
        version: &report.dmp_version,
        title: &title,
        policy: "",
        lead: &extent(report),
        contents: "",
        main: &main,
        footer: "Made by dmp: the Dense Map Posterior (Zhang & Chen, ICIP 2021) for LiDARs and depth cameras, without ground \
                 truth. On each log all versions were scored together.",
        scripts: "",
    };
    document.to_html()
}

fn extent(report: &SuiteReport) -> String {
    let runs: usize = report.logs.iter().map(|log| log.order.len()).sum();
    let scored = report.scored().count() as u64;
    format!(
        "<p class=\"muted\">{} of {}, {}, {}</p>\n",
        count(scored),
        counted(report.logs.len() as u64, "log"),
        counted(report.versions.len() as u64, "version"),
        counted(runs as u64, "run")
    )
}

fn verdict(report: &SuiteReport, pairs: &[OrderedVersions<'_>], remarks: &[String]) -> String {
    let said = pairs.iter().map(|ordered| {
        let verdict = escape(&ordered.verdict());
        let strong = if ordered.pair.outcome == Outcome::Better {
            format!("<strong>{verdict}</strong>")
        } else {
            verdict
        };
        format!("{strong}: {}", escape(&ordered.pair.reason))
    });
    let remarks = remarks.iter().map(|remark| escape(remark));
    let list = list("<ul class=\"said\">", said.chain(remarks));
    let answer = format!("<p class=\"answer\">{}</p>\n", escape(&suite_answer(report)));
    section("verdict", "Verdict", &(answer + &list + &paragraph(&suite_promise(report))))
}

fn counts(pairs: &[OrderedVersions<'_>]) -> String {
    let heads = [
        head("first", "", "name"),
        head("second", "", "name"),
        head("first better", "logs", ""),
        head("second better", "logs", ""),
        head("mixed", "logs", ""),
        head("same", "logs", ""),
        head("undecided", "logs", ""),
        head("p", "sign test", ""),
    ];
    let row = |ordered: &OrderedVersions<'_>| {
        let [first, second] = ordered.wins();
        let counts = [first, second, ordered.pair.mixed, ordered.pair.same, ordered.pair.undecided];
        let mut row = vec![cell(ordered.first, "name"), cell(ordered.second, "name")];
        row.extend(counts.map(|number| cell(&count(number), "")));
        row.push(cell(&p_value(ordered.pair), ""));
        row
    };
    table("On how many logs", &heads, &pairs.iter().map(row).collect::<Vec<_>>())
}

fn effects(report: &SuiteReport, pairs: &[OrderedVersions<'_>]) -> String {
    let scale =
        report.pairs.iter().find_map(|pair| pair.scale_m).map_or(String::new(), |m| format!(" {m} m"));
    let heads = [
        head("first", "", "name"),
        head("second", "", "name"),
        head(&format!("residual{scale}"), "cm", ""),
        head("interval", "cm", ""),
        head("drift", "cm", ""),
        head("interval", "cm", ""),
    ];
    let row = |ordered: &OrderedVersions<'_>| {
        let mut row = vec![cell(ordered.first, "name"), cell(ordered.second, "name")];
        for effect in [&ordered.pair.rms_difference, &ordered.pair.drift_difference] {
            row.extend(ordered.effect_cm(effect).map(|text| cell(&text, "")));
        }
        row
    };
    let rows: Vec<_> = pairs.iter().map(row).collect();
    table(
        "First minus second, root mean squares, median over the logs: negative where the first is better",
        &heads,
        &rows,
    )
}

/// Logs and pairs: what is better on each, in words, and by how much.
fn matrix(report: &SuiteReport) -> String {
    let mut heads = vec![head("log", "", "name")];
    heads.extend(
        report
            .pairs
            .iter()
            .map(|pair| head(&format!("{} / {}", pair.a, pair.b), "better; residual, drift in cm", "text")),
    );
    let row = |log: &String| {
        let mut row = vec![cell(log, "name")];
        row.extend(report.pairs.iter().map(|pair| on_log(pair, log)));
        row
    };
    let rows: Vec<_> = report.worst_first.iter().map(row).collect();
    table("The better version on each log; first minus second of the pair", &heads, &rows)
}

fn on_log(pair: &SuitePairReport, log: &str) -> String {
    let word = log_word(pair, log);
    let Some(on) = pair.on(log) else { return cell(&word, "text") };
    let word = escape(&word);
    let cm = |m: Option<f64>| m.map_or(NONE.to_owned(), |m| format!("{:+.1}", 100.0 * m).replace('-', "−"));
    let word = match on.verdict {
        Verdict::Better { .. } => format!("<strong>{word}</strong>"),
        _ => word,
    };
    format!(
        "<td class=\"text\">{word}<br><small class=\"muted\">{}, {}</small></td>",
        cm(on.rms_difference_m),
        cm(on.drift_difference_m)
    )
}

fn scored(report: &SuiteReport) -> String {
    let heads = [
        head("log", "", "name"),
        head("scans", "", ""),
        head("distance", "m", ""),
        head("versions", "best first", "text"),
        head("not compared", "", "text"),
    ];
    let row = |log: &dmp_suite::SuiteLogReport| {
        let missing = log.missing.iter().map(|run| format!("{}: {}", run.version, run.reason));
        let damage = log.damaged.then(|| "part of the log is lost".to_owned());
        let problems: Vec<String> = log.problem.clone().into_iter().chain(missing).chain(damage).collect();
        vec![
            cell(&log.name, "name"),
            cell(&log.scans.map_or(NONE.to_owned(), |scans| count(scans as u64)), ""),
            cell(&log.travel_m.map_or(NONE.to_owned(), |m| format!("{m:.0}")), ""),
            cell(&log.order.join(", "), "text"),
            cell(&problems.join("; "), "text"),
        ]
    };
    table("Logs in the order given", &heads, &report.logs.iter().map(row).collect::<Vec<_>>())
}
