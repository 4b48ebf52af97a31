//! The verdicts of a suite in words, for tables and a page.

use dmp_report::Verdict;
use dmp_suite::{EffectReport, Outcome, SuitePairReport, SuiteReport};

use crate::text::{self, NONE, digits};

/// A pair of versions, the better one first; where none is, the one that was named first.
#[derive(Debug, Clone, Copy)]
pub struct OrderedVersions<'a> {
    /// The pair.
    pub pair: &'a SuitePairReport,
    /// The name of the version that stands first.
    pub first: &'a str,
    /// The name of the other.
    pub second: &'a str,
}

/// Every pair of a suite.
pub fn ordered_versions(report: &SuiteReport) -> Vec<OrderedVersions<'_>> {
    report.pairs.iter().map(OrderedVersions::of).collect()
}

impl<'a> OrderedVersions<'a> {
    fn of(pair: &'a SuitePairReport) -> Self {
        let is_turned = pair.better.as_deref() == Some(pair.b.as_str());
        let (first, second) = if is_turned { (&pair.b, &pair.a) } else { (&pair.a, &pair.b) };
        Self { pair, first, second }
    }

    /// What is decided, as `new is better than old`.
    pub fn verdict(&self) -> String {
        let Self { first, second, .. } = self;
        match self.pair.outcome {
            Outcome::Better => format!("{first} is better than {second}"),
            Outcome::Undecided => format!("{first} and {second}: no significant difference"),
            Outcome::TooFewLogs => format!("{first} and {second}: not decided"),
        }
    }

    /// Logs on which the first, and on which the second is better.
    pub fn wins(&self) -> [u64; 2] {
        let wins = [self.pair.a_better, self.pair.b_better];
        if self.is_turned() { [wins[1], wins[0]] } else { wins }
    }

    /// First minus second in centimetres: the median, and its interval.
    pub fn effect_cm(&self, effect: &EffectReport) -> [String; 2] {
        let sign = if self.is_turned() { -1.0 } else { 1.0 };
        let cm = |m: f64| signed(100.0 * sign * m);
        let interval = effect.interval_m.map(|[low, high]| {
            let [low, high] = if self.is_turned() { [high, low] } else { [low, high] };
            format!("{} to {}", cm(low), cm(high))
        });
        [effect.median_m.map(cm), interval].map(|text| text.unwrap_or_else(|| NONE.to_owned()))
    }

    fn is_turned(&self) -> bool {
        self.first != self.pair.a
    }
}

/// Three digits, with a true minus.
fn signed(value: f64) -> String {
    if value < 0.0 { format!("−{}", digits(-value)) } else { digits(value) }
}

/// What the suite says, in a sentence.
pub fn suite_answer(report: &SuiteReport) -> String {
    let is_better = |name: &str| {
        let mut pairs = report.pairs.iter().filter(|pair| pair.a == name || pair.b == name);
        pairs.all(|pair| pair.better.as_deref() == Some(name))
    };
    let logs = text::counted(report.scored().count() as u64, "log");
    let of_all = |outcome| report.pairs.iter().all(|pair| pair.outcome == outcome);
    match report.versions.iter().find(|name| is_better(name)) {
        Some(best) if report.versions.len() == 2 => {
            let other = report.versions.iter().find(|name| *name != best).map_or("", String::as_str);
            format!("{best} is better than {other}, over {logs}.")
        }
        Some(best) => format!("{best} is better than every other version, over {logs}."),
        None if of_all(Outcome::TooFewLogs) => format!("Too few logs to decide anything: {logs}."),
        None if report.pairs.iter().all(|pair| pair.outcome != Outcome::Better) => {
            format!("No significant difference between versions, over {logs}.")
        }
        None => format!("No version is better than every other, over {logs}."),
    }
}

/// What the verdicts promise, and what they rest on.
pub fn suite_promise(report: &SuiteReport) -> String {
    let error = text::left(report.promise.confidence);
    let rate = match report.pairs.len() {
        1 => format!("Error rate {error}"),
        pairs => format!(
            "Family-wise error rate {error} over {pairs} pairs (Holm); each interval is at {}",
            text::confidence(report.promise.interval_confidence)
        ),
    };
    format!(
        "{rate}. Mixed, same and undecided logs do not count. Logs are assumed independent: drives of one place on one day are \
         not."
    )
}

/// What a log says of a pair, in a word or two: the better version, `mixed`, `same`, `undecided`, or which one fails.
pub fn log_word(pair: &SuitePairReport, log: &str) -> String {
    match pair.on(log).map(|on| &on.verdict) {
        None => pair.failing_on(log).map_or_else(|| NONE.to_owned(), |version| format!("{version} fails")),
        Some(Verdict::Better { run, .. }) => run.clone(),
        Some(verdict) => verdict.to_string(),
    }
}

/// A chance, as a table has it.
pub fn p_value(pair: &SuitePairReport) -> String {
    if pair.p_value < 1e-4 { "< 0.0001".to_owned() } else { format!("{:.4}", pair.p_value) }
}
