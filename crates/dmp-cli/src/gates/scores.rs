//! The scores that a gate can speak of.

use dmp::{Basis, RunReport};
use dmp_draw::text::{percent, plain_digits};

/// A score of a run, as the table shows it.
#[derive(Debug)]
pub(super) struct Score {
    /// As it is typed.
    pub(super) name: &'static str,
    /// As it is told.
    pub(super) title: &'static str,
    pub(super) unit: Unit,
    value: Value,
}

/// Where a score stands in a report.
#[derive(Debug)]
enum Value {
    /// Among the scores at several truncations.
    Truncated(Basis),
    /// By itself.
    Single(fn(&RunReport) -> Option<f64>),
}

/// What a score is measured in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unit {
    /// A root mean square, metres: never more than this.
    Root(f64),
    /// A mean square, m².
    Square,
    /// A share of all returns.
    Share,
}

const fn root(name: &'static str, title: &'static str, basis: Basis, most_m: f64) -> Score {
    Score { name, title, unit: Unit::Root(most_m), value: Value::Truncated(basis) }
}

const fn share(name: &'static str, value: fn(&RunReport) -> Option<f64>) -> Score {
    Score { name, title: name, unit: Unit::Share, value: Value::Single(value) }
}

const CV: Basis = Basis::CrossValidated;
const NEAR: Basis = Basis::Near;

const SCORES: [Score; 17] = [
    root("R_cv_10", "R_cv 10 m", CV, 10.0),
    root("R_cv_2", "R_cv 2 m", CV, 2.0),
    root("R_cv_1", "R_cv 1 m", CV, 1.0),
    root("R_cv_0.5", "R_cv 0.5 m", CV, 0.5),
    root("R_cv_0.2", "R_cv 0.2 m", CV, 0.2),
    root("R_cv_0.05", "R_cv 0.05 m", CV, 0.05),
    root("R_cv_0.02", "R_cv 0.02 m", CV, 0.02),
    root("R_near_5", "R_near 5 m", NEAR, 5.0),
    root("R_near_2", "R_near 2 m", NEAR, 2.0),
    root("R_near_0.5", "R_near 0.5 m", NEAR, 0.5),
    root("R_near_0.2", "R_near 0.2 m", NEAR, 0.2),
    root("R_near_0.05", "R_near 0.05 m", NEAR, 0.05),
    Score { name: "DMP", title: "DMP mean", unit: Unit::Square, value: Value::Single(|run| run.dmp_mean_m2) },
    share("miss", |run| run.miss_rate),
    share("blocked", |run| run.blocked_rate),
    share("coverage", |run| run.coverage),
    share("revisit", |run| run.coverage_revisit),
];

/// A family of scores by itself is its largest scale on a drive.
const SHORT: [(&str, &str); 2] = [("R_cv", "R_cv_10"), ("R_near", "R_near_5")];

impl Score {
    /// The score that is called so, in whatever case.
    pub(super) fn find(name: &str) -> Option<&'static Self> {
        let long =
            SHORT.iter().find(|(short, _)| short.eq_ignore_ascii_case(name)).map_or(name, |(_, long)| long);
        SCORES.iter().find(|score| score.name.eq_ignore_ascii_case(long))
    }

    /// All names.
    pub(super) fn names() -> String {
        SCORES.map(|score| score.name).join(", ")
    }

    /// The score of a run in its unit, or why there is none.
    pub(super) fn of(&self, run: &RunReport) -> Result<f64, String> {
        let value = match self.value {
            Value::Single(value) => value(run),
            Value::Truncated(basis) => {
                let (scores, scale_m) = (run.scores(basis), self.unit.most());
                if scores.iter().all(|(there_m, _)| there_m != scale_m) {
                    let there: Vec<String> = scores.iter().map(|(there_m, _)| there_m.to_string()).collect();
                    return Err(format!("the result has none at {scale_m} m, but at {} m", there.join(", ")));
                }
                scores.at(scale_m).map(|square_m2| square_m2.max(0.0).sqrt())
            }
        };
        value.ok_or_else(|| match (&run.r_cv_withheld, &self.value) {
            (Some(why), Value::Truncated(Basis::CrossValidated)) => why.to_string(),
            _ if run.returns > 0 && run.coverage.is_none() => "the map was given".to_owned(),
            _ => "no return tells".to_owned(),
        })
    }

    /// A value of this score for a person: metres, centimetres or millimetres, as in the table.
    pub(super) fn show(&self, value: f64) -> String {
        match self.unit {
            Unit::Share => format!("{} %", percent(value)),
            _ => self.with_unit(value, plain_digits),
        }
    }

    /// The same with every digit.
    pub(super) fn show_exactly(&self, value: f64) -> String {
        self.with_unit(value, |value| value.to_string())
    }

    fn with_unit(&self, value: f64, digits: fn(f64) -> String) -> String {
        match self.unit {
            Unit::Root(most_m) if most_m < 0.1 => format!("{} mm", digits(1000.0 * value)),
            Unit::Root(most_m) if most_m < 2.0 => format!("{} cm", digits(100.0 * value)),
            Unit::Root(_) => format!("{} m", digits(value)),
            Unit::Square => format!("{} m²", digits(value)),
            Unit::Share => format!("{} %", digits(100.0 * value)),
        }
    }
}

impl Unit {
    /// As JSON has it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Root(_) => "m",
            Self::Square => "m2",
            Self::Share => "share",
        }
    }

    /// What no score goes beyond.
    pub(super) fn most(self) -> f64 {
        match self {
            Self::Root(most_m) => most_m,
            Self::Square => f64::INFINITY,
            Self::Share => 1.0,
        }
    }
}
