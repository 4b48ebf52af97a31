//! What the columns of the table of the runs mean.

use dmp::Report;
use dmp_draw::{ranking, text};

/// A term and its meaning for each column that is shown, some with another one.
pub(super) fn legend(report: &Report, shown: &[&str]) -> Vec<(&'static str, String)> {
    let if_shown = |name, meaning: String| if shown.contains(&name) { meaning } else { String::new() };
    let mut all = vec![("verdict", verdict(report, shown.contains(&"interval")))];
    let near =
        "RMS range residual: how far each return is from the nearest surface on its ray; less is better.";
    if report.is_cross_validated() {
        all.push(("R_cv", cross_validated(report)));
        all.push((
            "R_near",
            "the same, to the nearest surface on the ray, whoever measured it: sharpness alone".into(),
        ));
    } else {
        let lengths = report.config.scales.lengths();
        all.push(("R_near", format!("{near} {}", truncated(&lengths.near_m))));
    }
    let depth = if_shown("DMP depth", "; depth: along the optical axis, as cameras measure".to_owned());
    let dmp = "mean square of the distance to the first surface on the ray, not truncated: outliers rule it";
    all.push(("DMP", format!("{dmp}{depth}")));
    let lengths = report.config.scales.lengths();
    let (recording, blocked_m) = (lengths.recording, lengths.blocked_m);
    let revisit = if_shown("revisit", "; revisit: that another visit measured".to_owned());
    let of_coverage = "share of returns whose ray meets a surface that other parts of the";
    all.push(("coverage", format!("{of_coverage} {recording} measured{revisit}")));
    let blocked = format!(
        "; blocked: that meet one over {blocked_m} m too early, as trails of what moved and doubled walls"
    );
    all.push(("miss", format!("share of rays that meet no surface{}", if_shown("blocked", blocked))));
    let sure = text::confidence(report.promise.confidence);
    all.push(("±", format!("how far the score before it may be off, as a sample was scored ({sure} sure)")));
    all.retain(|(term, _)| shown.contains(term));
    if ranking(report).rows.iter().any(|row| !row.has_a_rank_of_its_own()) {
        all.push(("=", "shares the rank above: no run of that rank is decided to be better".to_owned()));
    }
    all
}

fn verdict(report: &Report, has_interval: bool) -> String {
    let sure = text::confidence(report.promise.interval_confidence);
    let interval = if has_interval { format!("; interval: of that, {sure} sure") } else { String::new() };
    format!(
        "against the first run: how much larger the RMS residual is over the returns that both maps predict, and the \
         largest truncation at which that is certain{interval}"
    )
}

fn cross_validated(report: &Report) -> String {
    let lengths = report.config.scales.lengths();
    let widest_m = lengths.widest_m();
    let missing_m = widest_m * report.config.miss_price.sqrt();
    format!(
        "RMS range residual: how far each return is from the first surface on its ray, of those that other parts of the \
         {} measured; less is better. {} A ray that meets no such surface counts {missing_m:.*} m at {widest_m} m; \
         the columns below {widest_m} m leave it out.",
        lengths.recording,
        truncated(&lengths.cv_m[1..4]),
        if widest_m >= 10.0 { 1 } else { 2 }
    )
}

/// What the truncations are there for, the largest first.
fn truncated(scales_m: &[f64]) -> String {
    let [widest_m, .., finest_m] = scales_m else { return String::new() };
    format!(
        "Residuals are truncated at the length in the head: {widest_m} m shows whether the map fits together, {finest_m} m \
         how sharp it is."
    )
}
