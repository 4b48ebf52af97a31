//! `[NAME:]SCORE=LIMIT` on the command line.

use super::scores::{Score, Unit};
use crate::parse::length_m;

/// A limit for a score, of one run or of all.
#[derive(Debug, Clone)]
pub(super) struct Limit {
    /// As it was typed.
    pub(super) text: String,
    pub(super) run: Option<String>,
    pub(super) score: &'static Score,
    /// In the unit of the score.
    pub(super) value: f64,
}

/// On which side of the limit a score fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bound {
    Above,
    Below,
}

/// A limit that a score can be above.
pub(super) fn above(text: &str) -> Result<Limit, String> {
    let limit = limit(text)?;
    let most = limit.score.unit.most();
    if limit.value < most {
        return Ok(limit);
    }
    // What is typed as 15, meaning the table's cm, would never fail.
    let example = match limit.score.unit {
        Unit::Share => "try 5% or 0.05",
        Unit::Root(_) | Unit::Square => "in metres without a unit, as 0.15, or as 15cm",
    };
    let most = limit.score.show(most);
    Err(format!("{} is never above {most}, so this limit cannot fail: {example}", limit.score.title))
}

/// A limit that a score can be below.
pub(super) fn below(text: &str) -> Result<Limit, String> {
    let limit = limit(text)?;
    let most = limit.score.unit.most();
    if limit.value <= 0.0 {
        Err(format!("{} is never below 0, so this limit cannot fail", limit.score.title))
    } else if limit.value > most {
        let most = limit.score.show(most);
        Err(format!("{} is never above {most}, so this limit always fails", limit.score.title))
    } else {
        Ok(limit)
    }
}

/// A name may hold `:` and `=`, the rest does not.
fn limit(text: &str) -> Result<Limit, String> {
    let (what, limit) = text
        .rsplit_once('=')
        .ok_or("a score and its limit are expected, as R_cv=2.5 or NAME:R_cv_0.5=15cm")?;
    let (run, name) = what.rsplit_once(':').map_or((None, what), |(run, name)| (Some(run), name));
    let score =
        Score::find(name).ok_or_else(|| format!("`{name}` is no score; there are {}", Score::names()))?;
    if run == Some("") {
        return Err("the name of a run is expected before the colon".to_owned());
    }
    let value = match score.unit {
        Unit::Root(_) => length_m(limit)?,
        Unit::Square => number(limit.trim_end_matches("m2").trim_end_matches("m²"))
            .ok_or_else(|| format!("`{limit}` is no mean square: try 1.5 (m²)"))?,
        Unit::Share => match limit.strip_suffix('%') {
            Some(percent) => number(percent).map(|percent| percent / 100.0),
            None => number(limit),
        }
        .ok_or_else(|| format!("`{limit}` is no share: try 5% or 0.05"))?,
    };
    if value < 0.0 {
        return Err(format!("{} is never below 0", score.title));
    }
    Ok(Limit { text: text.to_owned(), run: run.map(str::to_owned), score, value })
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_have_the_units_of_their_scores() {
        let cases = [
            ("R_cv=2.5", None, "R_cv_10", 2.5),
            ("r_cv_0.5=15cm", None, "R_cv_0.5", 0.15),
            ("R_cv_0.5=0.15", None, "R_cv_0.5", 0.15),
            ("new:R_near=90cm", Some("new"), "R_near_5", 0.9),
            ("a:b=c:R_near_0.5=30mm", Some("a:b=c"), "R_near_0.5", 0.03),
            ("DMP=1.5", None, "DMP", 1.5),
            ("dmp=1.5m2", None, "DMP", 1.5),
            ("miss=5%", None, "miss", 0.05),
            ("x:Blocked=0.5", Some("x"), "blocked", 0.5),
            ("miss=0", None, "miss", 0.0),
        ];
        for (text, run, score, expected) in cases {
            let limit = above(text).unwrap();
            assert_eq!((limit.run.as_deref(), limit.score.name), (run, score), "{text}");
            assert!((limit.value - expected).abs() < 1e-12, "{text}");
        }
        assert_eq!(below("coverage=50%").unwrap().value, 0.5);
        assert_eq!(below("coverage=100%").unwrap().value, 1.0);
    }

    #[test]
    fn a_limit_that_makes_no_sense_is_refused_with_the_reason() {
        let cases = [
            ("R_cv", "R_cv=2.5 or NAME:R_cv_0.5=15cm"),
            ("ATE=1", "`ATE` is no score; there are R_cv_10, R_cv_2,"),
            (":R_cv=1", "before the colon"),
            ("R_cv=", "`` is no length"),
            ("R_cv=nan", "`nan` is no length"),
            ("R_cv=-1", "never below 0"),
            ("R_cv_0.5=15", "R_cv 0.5 m is never above 50.0 cm, so this limit cannot fail"),
            ("R_cv=10", "R_cv 10 m is never above 10.0 m, so this limit cannot fail"),
            ("miss=5", "miss is never above 100.0 %, so this limit cannot fail: try 5% or 0.05"),
            ("miss=x%", "`x%` is no share"),
            ("DMP=1cm", "`1cm` is no mean square"),
            ("DMP=inf", "`inf` is no mean square"),
        ];
        for (text, words) in cases {
            let error = above(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
        assert!(below("coverage=0").unwrap_err().contains("never below 0, so this limit cannot fail"));
        assert!(below("coverage=101%").unwrap_err().contains("so this limit always fails"));
    }
}
