//! `--expect WHAT`, as it is typed.

use dmp::ColumnUnit;

use super::scores::Score;
use crate::options::values::length_m;

/// What must hold.
#[derive(Debug, Clone)]
pub(super) struct Expect {
    /// As it was typed.
    pub(super) text: String,
    pub(super) what: What,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum What {
    /// The run is decided to be better than each other.
    Best(String),
    /// No run is decided to be better than this.
    Unbeaten(String),
    /// Two runs are the same, or all of them.
    Same(Option<(String, String)>),
    /// A score is on the right side of a limit.
    Limit(Limit),
}

/// A limit for a score, of one run or of all.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Limit {
    pub(super) run: Option<String>,
    pub(super) score: Score,
    pub(super) bound: Bound,
    /// In the unit of the score.
    pub(super) value: f64,
}

/// What a limit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bound {
    /// The largest value that passes: `<`.
    Most,
    /// The smallest: `>`.
    Least,
}

/// `best:NAME`, `unbeaten:NAME`, `same`, `same:A,B`, or a limit. Names may hold any of the signs.
pub(super) fn parse(text: &str) -> Result<Expect, String> {
    let what = match limit(text) {
        Some(limit) => What::Limit(limit?),
        None => match text.split_once(':') {
            Some(("best", name)) if !name.is_empty() => What::Best(name.to_owned()),
            Some(("unbeaten", name)) if !name.is_empty() => What::Unbeaten(name.to_owned()),
            Some(("same", names)) => What::Same(crate::options::values::pair(names)?),
            None if text == "same" => What::Same(None),
            _ => {
                return Err(format!(
                    "`{text}` is no gate: try best:NAME, unbeaten:NAME, same, same:A,B, [NAME:]SCORE<LIMIT or \
                     [NAME:]SCORE>LIMIT; the scores are {}",
                    Score::names()
                ));
            }
        },
    };
    Ok(Expect { text: text.to_owned(), what })
}

/// A name, a sign and a number, as `x:R_cv<2.5`, `<=` among the signs; `None` without a sign.
pub(super) fn sides(text: &str) -> Option<(&str, Bound, &str)> {
    let at = text.rfind(['<', '>'])?;
    let bound = if text[at..].starts_with('<') { Bound::Most } else { Bound::Least };
    let value = &text[at + 1..];
    Some((text[..at].trim_end(), bound, value.strip_prefix('=').unwrap_or(value).trim_start()))
}

/// The limit of a score; `None` where this is none, as where the name of a run holds the sign.
fn limit(text: &str) -> Option<Result<Limit, String>> {
    let (what, bound, value) = sides(text)?;
    let (run, name) = what.rsplit_once(':').map_or((None, what), |(run, name)| (Some(run), name));
    let Some(score) = Score::find(name) else {
        let is_name = run.is_some_and(|word| ["best", "unbeaten", "same"].contains(&word));
        return (!is_name).then(|| Err(format!("`{name}` is no score; the scores are {}", Score::names())));
    };
    if run == Some("") {
        return Some(Err("the name of a run is expected before the colon".to_owned()));
    }
    let limit = value_of(score, bound, value);
    Some(limit.map(|value| Limit { run: run.map(str::to_owned), score, bound, value }))
}

/// The value of a limit, which must be one that some score keeps and another does not.
fn value_of(score: Score, bound: Bound, text: &str) -> Result<f64, String> {
    let number = |text: &str| text.trim().parse().ok().filter(|value: &f64| value.is_finite());
    let value = match score.column.unit {
        ColumnUnit::Root => length_m(text)?,
        ColumnUnit::Square => number(text.trim_end_matches("m2").trim_end_matches("m²"))
            .ok_or_else(|| format!("`{text}` is no mean square: try 1.5 (m²)"))?,
        ColumnUnit::Share => match text.strip_suffix('%') {
            Some(percent) => number(percent).map(|percent| percent / 100.0),
            None => number(text),
        }
        .ok_or_else(|| format!("`{text}` is no share: try 5% or 0.05"))?,
    };
    let (title, most) = (score.title(), score.most());
    if value < 0.0 || (bound == Bound::Least && value == 0.0) {
        return Err(format!("{title} is never below 0, so this limit cannot fail"));
    }
    if value > most || (bound == Bound::Most && value == most) {
        let result = if bound == Bound::Most { "cannot fail" } else { "always fails" };
        // What is typed as 15, meaning the table's cm, would never fail.
        let example = match score.column.unit {
            ColumnUnit::Share => "try 5% or 0.05",
            ColumnUnit::Root | ColumnUnit::Square => "in metres without a unit, as 0.15, or as 15cm",
        };
        let most = score.show(most);
        return Err(format!("{title} is never above {most}, so this limit {result}: {example}"));
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_is_understood() {
        let name = |name: &str| Some(name.to_owned());
        for (text, run, score, value) in [
            ("R_cv<2.5", None, "R_cv_10", 2.5),
            ("r_cv_0.5<=15cm", None, "R_cv_0.5", 0.15),
            ("R_cv_0.5 < 0.15", None, "R_cv_0.5", 0.15),
            ("new:R_near<90cm", name("new"), "R_near_5", 0.9),
            ("a:b<c:R_near_0.5<30mm", name("a:b<c"), "R_near_0.5", 0.03),
            ("best:R_cv<1", name("best"), "R_cv_10", 1.0),
            ("DMP<1.5", None, "DMP", 1.5),
            ("dmp<1.5m2", None, "DMP", 1.5),
            ("miss<5%", None, "miss", 0.05),
            ("x:Blocked<0.5", name("x"), "blocked", 0.5),
            ("miss<0", None, "miss", 0.0),
            ("coverage>50%", None, "coverage", 0.5),
            ("coverage>=100%", None, "coverage", 1.0),
        ] {
            let What::Limit(limit) = parse(text).unwrap().what else { panic!("{text}") };
            assert_eq!((&limit.run, limit.score.name().as_str()), (&run, score), "{text}");
            assert!((limit.value - value).abs() < 1e-12, "{text}");
            assert_eq!(limit.bound, if text.contains('>') { Bound::Least } else { Bound::Most });
        }
        let owned = |text: &str| text.to_owned();
        for (text, what) in [
            ("best:a", What::Best(owned("a"))),
            ("best:a<b", What::Best(owned("a<b"))),
            ("unbeaten:a:b", What::Unbeaten(owned("a:b"))),
            ("same", What::Same(None)),
            ("same:a,b", What::Same(Some((owned("a"), owned("b"))))),
        ] {
            assert_eq!(parse(text).unwrap().what, what, "{text}");
        }
    }

    #[test]
    fn what_makes_no_sense_is_rejected_with_the_reason() {
        for (text, words) in [
            ("R_cv", "try best:NAME, unbeaten:NAME, same, same:A,B, [NAME:]SCORE<LIMIT"),
            ("best", "the scores are R_cv_10, R_cv_2,"),
            ("best:", "is no gate"),
            ("same:a", "the names of two runs"),
            ("ATE<1", "`ATE` is no score; the scores are R_cv_10, R_cv_2,"),
            (":R_cv<1", "before the colon"),
            ("R_cv<", "`` is no length"),
            ("R_cv<nan", "`nan` is no length"),
            ("R_cv<-1", "never below 0"),
            ("R_cv_0.5<15", "R_cv 0.5 m is never above 50.0 cm, so this limit cannot fail"),
            ("R_cv<10", "R_cv 10 m is never above 10.0 m, so this limit cannot fail"),
            ("miss<5", "miss is never above 100.0 %, so this limit cannot fail: try 5% or 0.05"),
            ("miss<x%", "`x%` is no share"),
            ("DMP<1cm", "`1cm` is no mean square"),
            ("DMP<inf", "`inf` is no mean square"),
            ("coverage>0", "never below 0, so this limit cannot fail"),
            ("coverage>101%", "so this limit always fails"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
