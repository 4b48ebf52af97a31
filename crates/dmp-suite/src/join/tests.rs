use dmp_report::{Report, ScaleScores, Verdict};
use serde_json::{Value, json};

use super::*;
use crate::sample_data::{scores as whole, scores_json as samples};

/// A report as if only these runs had been scored, named by their first letters.
fn only(runs: &[&str]) -> NamedReport {
    let mut report = whole();
    let among = |name: &String| runs.contains(&name.as_str());
    report.runs.retain(|run| among(&run.name));
    report.inputs.runs.retain(|run| among(&run.name));
    report.order.retain(among);
    report.pairs.retain(|pair| among(&pair.a) && among(&pair.b));
    let name: String = runs.iter().map(|run| &run[..1]).collect();
    NamedReport { file: format!("{name}.json"), name, report }
}

fn joined(reports: &[NamedReport]) -> JoinedReport {
    join_reports(reports).unwrap()
}

fn refusal(reports: &[NamedReport]) -> String {
    join_reports(reports).unwrap_err().to_string()
}

#[test]
fn parts_that_hold_every_pair_make_the_whole() {
    let parts = [["truth", "drift"], ["noise", "collapsed"], ["truth", "noise"], ["collapsed", "truth"]];
    let more = [["drift", "noise"], ["drift", "collapsed"]];
    let parts: Vec<NamedReport> = parts.iter().chain(&more).map(|runs| only(runs)).collect();
    let JoinedReport { mut report, runs_of, not_compared } = joined(&parts);
    assert_eq!(not_compared, Vec::<[String; 2]>::new());
    assert_eq!(runs_of[1], ["noise", "collapsed"]);
    assert_eq!((report.timing.total_s, report.memory.peak_anon_bytes), (6.0 * 4.0, Some(10)));
    let whole = whole();
    report
        .pairs
        .sort_by_key(|pair| whole.pairs.iter().position(|other| (&other.a, &other.b) == (&pair.a, &pair.b)));
    assert_eq!((&report.runs, &report.inputs), (&whole.runs, &whole.inputs));
    assert_eq!((&report.pairs, &report.order, &report.ties), (&whole.pairs, &whole.order, &whole.ties));
    // A single report is unchanged.
    let alone = joined(&[NamedReport { name: "all".into(), file: String::new(), report: whole.clone() }]);
    assert_eq!(alone.report, whole);
}

#[test]
fn where_no_report_holds_a_pair_the_first_column_orders() {
    let parts = [only(&["drift", "collapsed"]), only(&["noise"]), only(&["truth"])];
    let JoinedReport { report, not_compared, .. } = joined(&parts);
    // The two that are mixed share a rank, and are listed by name.
    assert_eq!(report.order, ["truth", "noise", "collapsed", "drift"]);
    let expected = [
        ["truth", "noise"],
        ["truth", "collapsed"],
        ["truth", "drift"],
        ["noise", "collapsed"],
        ["noise", "drift"],
    ];
    assert_eq!(not_compared, expected);
    assert_eq!((report.pairs.len(), report.ties), (1, vec![["collapsed".to_owned(), "drift".to_owned()]]));
    // A verdict takes precedence over the column.
    let mut parts = [only(&["drift", "collapsed"]), only(&["drift", "noise"]), only(&["truth"])];
    parts[1].report.runs[1].r_cv_m2 = ScaleScores::new([(10.0, Some(15.0))]);
    assert_eq!(joined(&parts).report.order, ["truth", "noise", "collapsed", "drift"]);
    // An undecided pair is a tie.
    parts[0].report.pairs[0].verdict = Verdict::Undecided;
    parts[1] = only(&["drift", "noise"]);
    let report = joined(&parts).report;
    assert_eq!(report.order, ["truth", "noise", "collapsed", "drift"]);
    assert_eq!(report.ties, [["collapsed", "drift"]]);
}

#[test]
fn runs_with_one_name_and_two_scores_get_the_names_of_their_reports() {
    let mut parts = [only(&["truth", "drift"]), only(&["truth", "noise"]), only(&["truth"])];
    parts[1].name = "new".into();
    parts[1].report.runs[0].r_cv_m2 = ScaleScores::new([(10.0, Some(3.0))]);
    let JoinedReport { report, runs_of, .. } = joined(&parts);
    assert_eq!(runs_of, [vec!["td/truth", "drift"], vec!["new/truth", "noise"], vec!["td/truth"]]);
    assert_eq!(report.order, ["new/truth", "td/truth", "noise", "drift"]);
    let verdict = report.verdict_between("new/truth", "noise").unwrap();
    assert_eq!((verdict.better(), verdict.decided_at_m()), (Some("new/truth"), Some(2.0)));
    assert!(report.inputs.runs.iter().map(|run| &run.name).eq(report.runs.iter().map(|run| &run.name)));
    // Equal descriptions do not make two runs one.
    let mut twice = [only(&["truth"]), only(&["truth"])];
    twice[1].report.runs[0].warnings.push("slow".into());
    assert_eq!(joined(&twice).report.order, ["truth"]);
    parts[1].name = "td".into();
    assert_eq!(refusal(&parts), "two runs would be called `td/truth`: give each result its own name");
    assert_eq!(refusal(&[]), "no result to compare");
}

#[test]
fn what_only_some_reports_warn_of_has_their_names() {
    let mut parts = [only(&["truth"]), only(&["drift"])];
    let warnings = |words: [&str; 2]| words.map(str::to_owned).to_vec();
    parts[0].report.warnings = warnings(["both", "one"]);
    parts[1].report.warnings = warnings(["both", "other"]);
    parts[1].report.inputs.damage = vec!["byte 7".into()];
    let report = joined(&parts).report;
    assert_eq!(
        report.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        ["both", "t: one", "d: other"]
    );
    assert_eq!(report.inputs.damage, ["byte 7"]);
}

/// Fields that may differ: they belong to the runs.
const OF_THE_RUNS: [&str; 2] = ["config.body_from_sensor", "config.voxel_filled_share"];

#[test]
fn a_difference_in_any_setting_is_reported() {
    let mut fields: Vec<String> =
        samples()["config"].as_object().unwrap().keys().map(|field| format!("config.{field}")).collect();
    fields.extend(samples()["sampling"].as_object().unwrap().keys().map(|field| format!("sampling.{field}")));
    fields.retain(|field| !OF_THE_RUNS.contains(&field.as_str()) && field != "sampling.quick");
    let of_the_log = ["fingerprint", "bytes", "topic", "point_times", "span_ns", "scans", "returns"];
    fields.extend(of_the_log.map(|field| format!("inputs.{field}")));
    fields.push("dmp_version".into());
    assert!(fields.len() > 25, "{fields:?}");
    for field in fields {
        let mut json = samples();
        if field == "config.ego_box_m" {
            json["config"]["ego"] = "box".into();
            json["config"]["ego_box_m"] = json!([[0.0, 0.0, 0.0], [2.0, 2.0, 2.0]]);
        }
        let here = json.clone();
        let path = format!("/{}", field.replace('.', "/"));
        let value = json.pointer_mut(&path).unwrap();
        *value = match (value.clone(), field.as_str()) {
            (_, "config.ego_box_m") => json!([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]),
            (_, "config.ego") => json!("none"),
            (_, "config.scales") => json!("room"),
            (_, "config.depth_noise") => json!({ "least_m": 0.001, "growth_per_m": 0.002, "nearest_m": 0.4 }),
            (_, "config.segment") => json!({ "metres": 5.0 }),
            (_, "sampling.seed") => json!(3),
            (Value::Number(number), _) if number.is_u64() => json!(number.as_u64().unwrap() + 1),
            (Value::Number(number), _) => json!(number.as_f64().unwrap() + 0.001),
            (Value::String(text), _) => json!(text + "'"),
            (Value::Bool(yes), _) => json!(!yes),
            (Value::Array(mut list), _) => {
                list[1] = json!(list[1].as_u64().unwrap() + 1);
                list.into()
            }
            (other, _) => panic!("{field} is {other}"),
        };
        let named =
            |name: &str, report| NamedReport { name: name.into(), file: format!("{name}.json"), report };
        let [here, other] = [here, json].map(|json| serde_json::from_value(json).unwrap());
        let text = refusal(&[named("a", here), named("b", other)]);
        let words = [format!(": {field} is "), format!(": {field}[1] is ")];
        assert!(words.iter().any(|words| text.contains(words)), "{field}: {text}");
        assert!(text.starts_with("a.json and b.json were not made with the same "), "{text}");
    }
}

#[test]
fn a_report_that_contradicts_itself_is_refused() {
    let forged = |change: &dyn Fn(&mut Report)| {
        let mut named = only(&["truth", "drift"]);
        change(&mut named.report);
        refusal(&[named])
    };
    let better = |run: &str| Verdict::Better { run: run.to_owned(), decided_at_m: Some(2.0) };
    let text = |field: &str, name: &str| {
        format!("td.json: {field} names `{name}`, which is not the name of one run")
    };
    assert_eq!(forged(&|report| report.pairs[0].a = "x".into()), text("pairs[0]", "x"));
    assert_eq!(forged(&|report| report.pairs[0].verdict = better("x")), text("pairs[0]", "x"));
    assert_eq!(forged(&|report| report.order[1] = "x".into()), text("order[1]", "x"));
    assert_eq!(forged(&|report| report.order.push("truth".into())), text("order[0]", "truth"));
    assert_eq!(forged(&|report| report.runs[1].name = "truth".into()), text("runs[0]", "truth"));
    assert_eq!(forged(&|report| report.inputs.runs.truncate(1)), text("runs[1]", "drift"));
}
