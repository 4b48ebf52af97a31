//! Pages of the sample data, and of reports that hold less.

use dmp_reduce::{Basis, Residuals, RunSums, Scales};
use dmp_report::Verdict;

use super::*;
use crate::pictures::{FrameScore, Painter, SampledReturn, SeenFrame};
use crate::sample_data::sample;

/// What a drive along a street of houses shows, each run missing it by so much.
fn pictures(report: &Report, bases: &[Basis], missed_m: &[f32]) -> Pictures {
    let score = |missed_m: f32| {
        let mut sums = RunSums::default();
        (0..200).for_each(|_| sums.add(&Residuals::all(f64::from(missed_m))));
        FrameScore::of(&sums, Basis::CrossValidated, Scales::Drive)
    };
    let frame = |number: usize| SeenFrame {
        number,
        stamp_ns: Some(number as i64 * 100_000_000),
        position_in_world_m: vec![[2.0 * number as f64, 0.0, 1.8]; bases.len()],
        scores: missed_m.iter().map(|&missed_m| score(missed_m)).collect(),
    };
    let order = report.order.iter().filter_map(|name| report.runs.iter().position(|run| run.name == *name));
    let mut painter = Painter::new(
        Scales::Drive,
        (0..60).map(frame).collect(),
        Some(0),
        bases.to_vec(),
        order.take(bases.len()).collect(),
        60 * 40,
    );
    for index in 0..60 {
        for k in 0..40_u8 {
            let side = if k % 2 == 0 { 6.0 } else { -6.0 };
            let of_run = |missed_m: &f32| SampledReturn {
                from_sensor_m: [f32::from(k) - 20.0, side, 0.1 * f32::from(k)],
                direction: [0.0, side.signum(), 0.0],
                residual_m: (k % 7 > 0).then_some(*missed_m),
                revisited: k > 20,
            };
            painter.sampled(index, &missed_m.iter().map(of_run).collect::<Vec<_>>());
        }
    }
    painter.finish()
}

/// What there is to read, without scripts and data.
fn page_of(report: &Report, pictures: Option<&Pictures>, remarks: &[String]) -> String {
    let whole = page(&PageInput { report, pictures, reference: None, remarks }).unwrap();
    let mut pieces = whole.split("<script");
    let read = pieces.next().unwrap().to_owned();
    pieces.fold(read, |read, piece| read + piece.split_once("</script>").unwrap().1)
}

#[test]
fn the_only_script_is_its_own_and_the_data_are_whole() {
    let mut report = sample();
    report.inputs.log = "</script><script>x()</script>".into();
    let pictures = pictures(&report, &[Basis::CrossValidated; 4], &[0.05, 0.4, 0.2, 1.5]);
    let input = PageInput { report: &report, pictures: Some(&pictures), reference: None, remarks: &[] };
    let whole = page(&input).unwrap();
    // Two that run; the points of three runs, as the best misses nothing, and the data.
    assert_eq!(whole.matches("<script>").count(), 2);
    assert_eq!((whole.matches("<script").count(), whole.matches("</script").count()), (6, 6));
    assert!(!whole.contains("src=\"http") && whole.contains("script-src 'sha256-"));
    let data = whole.split("id=\"dmp-report\">").nth(1).unwrap().split("</script>").next().unwrap();
    assert_eq!(serde_json::from_str::<Report>(data).unwrap(), report);
    assert!(whole.contains("<li><a href=\"#places\">Worst places</a></li>"));
}

#[test]
fn a_reference_is_worse_where_another_run_is_better() {
    let report = sample();
    let pictures = pictures(&report, &[Basis::CrossValidated; 4], &[0.05, 0.4, 0.2, 1.5]);
    let with = |name: &str| {
        let input =
            PageInput { report: &report, pictures: Some(&pictures), reference: Some(name), remarks: &[] };
        page(&input).unwrap()
    };
    let section = |text: &str| {
        let from = text.find("<h2 id=\"reference\">").unwrap();
        text[from..].split("</section>").next().unwrap().to_owned()
    };
    let names: Vec<&str> = report.runs.iter().map(|run| run.name.as_str()).collect();
    let best = section(&with(names[0]));
    assert!(best.contains("Nowhere is another run clearly better."), "{best}");
    let second = section(&with(names[1]));
    let anchor = second.split("href=\"#").nth(1).unwrap().split('"').next().unwrap().to_owned();
    assert!(with(names[1]).contains(&format!("id=\"{anchor}\"")), "{anchor}");
    assert!(
        second.contains(&format!("residuals of 40.0 and 40.0 cm, {} has 5.00 and 5.00 cm", names[0])),
        "{second}"
    );
    // Of the whole way of 118 m the first run is better, the last worse.
    let row = |name: &str| {
        let from = second.find(&format!("class=\"name\">{name}</th>")).unwrap();
        second[from..].split("</tr>").next().unwrap().to_owned()
    };
    assert!(row(names[0]).contains("<td>118</td><td>0</td><td>0</td>"), "{}", row(names[0]));
    assert!(row(names[3]).contains("<td>0</td><td>118</td><td>0</td>"), "{}", row(names[3]));
    assert!(section(&with("gone")).contains("gone is excluded"));
    assert!(!page_of(&report, Some(&pictures), &[]).contains("id=\"reference\""));
}

#[test]
fn every_part_is_there() {
    let report = sample();
    let bases = [Basis::CrossValidated; 4];
    let pictures = pictures(&report, &bases, &[0.05, 0.4, 0.2, 1.5]);
    let text = page_of(&report, Some(&pictures), &["Gate failed: <x>".to_owned()]);
    for part in [
        "<strong>truth</strong> (revisit error 0.4 cm) is best: better than <strong>noise</strong>, <strong>",
        "is better than <strong>",
        "Gate failed: &lt;x&gt;",
        "aria-label=\"Map of truth from above, coloured by residual\"",
        "Where the best two differ",
        "predicted from another visit",
        "seconds after the first scan",
        "aria-label=\"Trajectories of all runs from above\"",
        "height over the path",
        "Worst places of collapsed",
        "from the side",
        &report.inputs.fingerprint,
        &report.config.miss_price.to_string(),
        "@media (prefers-color-scheme: dark)",
    ] {
        assert!(text.contains(part), "{part}");
    }
    assert!(text.matches("data:image/png;base64,").count() >= 4 + 2 + 8);
    assert_eq!(
        text,
        page_of(
            &report,
            Some(&self::pictures(&report, &bases, &[0.05, 0.4, 0.2, 1.5])),
            &["Gate failed: <x>".to_owned()]
        )
    );
}

#[test]
fn saved_results_have_no_maps_and_say_so() {
    let mut report = sample();
    let text = page_of(&report, None, &[]);
    assert!(text.contains("saved results, which hold no maps") && !text.contains("<figure"), "{text}");
    report.order.truncate(1);
    report.pairs.clear();
    let text = page_of(&report, None, &[]);
    assert!(text.contains("was scored alone") && !text.contains("looks"), "{text}");
}

#[test]
fn given_maps_are_ranked_by_the_nearest_surfel() {
    let mut report = sample();
    for run in &mut report.runs {
        (run.coverage, run.coverage_revisit) = (None, None);
    }
    let pictures = pictures(&report, &[Basis::Near; 4], &[0.05, 0.4, 0.2, 1.5]);
    let text = page_of(&report, Some(&pictures), &[]);
    assert!(text.contains("R_near 2 m [m]") && !text.contains("What the maps can show"), "{text}");
    assert!(!text.contains("R_cv</dt>"));
}

#[test]
fn what_is_not_decided_is_not_claimed() {
    let mut report = sample();
    for pair in &mut report.pairs {
        pair.verdict = Verdict::Undecided;
        pair.reason = "undecided: too few".into();
    }
    report.ties = report.order.windows(2).map(|pair| [pair[0].clone(), pair[1].clone()]).collect();
    let text = page_of(&report, None, &[]);
    let first = |text: &str| {
        text.contains("<strong>truth</strong>, <strong>") && text.contains("share the first rank")
    };
    assert!(first(&text), "{text}");
    assert!(!text.contains("is better than"));
    let mut mixed = sample();
    let best = mixed.order[0].clone();
    let ahead = |run: &str| Verdict::Mixed { run: run.to_owned(), decided_at_m: 10.0 };
    mixed.pairs.iter_mut().for_each(|pair| pair.verdict = ahead(&best));
    assert!(
        page_of(&mixed, None, &[]).contains("stands first: better at some places and worse at others than")
    );
    // Of two, the better on the whole may stand second.
    let second = mixed.order[1].clone();
    mixed.order.truncate(2);
    mixed.pairs.iter_mut().for_each(|pair| pair.verdict = ahead(&second));
    let said = format!(
        "<strong>{second}</strong> is better than <strong>{best}</strong> on the whole, but worse at"
    );
    assert!(page_of(&mixed, None, &[]).contains(&said));
}

#[test]
fn a_page_without_a_predicted_return_is_a_page() {
    let report = sample();
    let order: Vec<usize> = (0..4).collect();
    for frames in [
        Vec::new(),
        vec![SeenFrame {
            number: 0,
            stamp_ns: None,
            position_in_world_m: vec![[1.0, 2.0, 3.0]; 4],
            scores: vec![FrameScore::default(); 4],
        }],
    ] {
        let painter =
            Painter::new(Scales::Drive, frames, None, vec![Basis::CrossValidated; 4], order.clone(), 0);
        let text = page_of(&report, Some(&painter.finish()), &[]);
        assert!(text.contains("Too few returns were scored") && text.contains("too few returns that both"));
        assert!(!text.contains("NaN"), "{text}");
    }
}

#[test]
fn names_of_files_and_runs_cannot_break_the_page() {
    let mut report = sample();
    let text = serde_json::to_string(&report).unwrap().replace("\"truth\"", "\"<img src=x onerror=y>\"");
    report = serde_json::from_str(&text).unwrap();
    report.inputs.log = "/data/<b>&.mcap".into();
    report.warnings = vec!["</main><i>".into()];
    let pictures = pictures(&report, &[Basis::CrossValidated; 4], &[0.05, 0.4, 0.2, 1.5]);
    let text = page_of(&report, Some(&pictures), &[]);
    assert!(!text.contains("<img src=x") && !text.contains("<b>") && !text.contains("<i>"));
    assert!(text.contains("Which map of &lt;b&gt;&amp;.mcap is best?"));
}
