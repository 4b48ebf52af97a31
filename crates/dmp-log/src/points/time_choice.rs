//! Which field of a log's points holds their times, and what it means there.

use super::find_rule::{Finding, USUAL_PERIOD_NS, find_rule, find_rule_of_most, may_be_times};
use super::time_fields::is_time_name;
use super::{FieldExtremes, Layout, Origin, PointTime, StampAt, TimeFields, TimeRule};
use crate::{LogError, LogOptions, LogSetting};
use std::path::Path;

/// Scans looked at for the meaning of the times of points.
const LOOKED_AT_SCANS: usize = 5;

/// The field with the times, how it is read, and both in words.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct TimeChoice {
    pub(crate) field: String,
    pub(crate) rule: TimeRule,
    pub(crate) words: String,
    /// From the stamp to the middle of a scan, nanoseconds.
    pub(crate) middle_ns: i64,
    /// From the stamp to the first and to the last return, nanoseconds.
    pub(crate) sweep_ns: [i64; 2],
    /// The one scan looked at, by its place in the log, that has other times than the rest.
    pub(crate) odd_frame: Option<usize>,
}

/// The note of such a scan.
pub(crate) fn odd_times(field: &str) -> String {
    format!("the times in field `{field}` are not like those of the other scans; the scan is skipped")
}

/// What is wrong with a scan without the field.
pub(crate) fn no_field(field: &str) -> String {
    format!("no field `{field}`, which the log's first scan has; the scan is skipped")
}

/// The frames to look at: the first three, the middle and the last with returns.
pub(crate) fn frames_to_look_at(returns: impl Iterator<Item = u64>) -> Vec<usize> {
    let filled: Vec<usize> =
        returns.enumerate().filter(|&(_, returns)| returns > 0).map(|(k, _)| k).collect();
    let mut chosen: Vec<usize> = filled.iter().copied().take(LOOKED_AT_SCANS - 2).collect();
    chosen.extend(filled.get(filled.len() / 2));
    chosen.extend(filled.last());
    chosen.dedup();
    chosen
}

/// Finds the field with the times of points and what they mean, or takes what the options say; `None`
/// where there are no times, or none are wanted. `look` gives what a few scans have in each of the layout's
/// [`TimeFields`], all of them.
pub(crate) fn choose_time(
    path: &Path,
    layout: &Layout,
    options: &LogOptions,
    period_ns: Option<i64>,
    notes: &mut Vec<String>,
    look: impl FnOnce() -> Result<Vec<Vec<FieldExtremes>>, LogError>,
) -> Result<Option<TimeChoice>, LogError> {
    let asked = options.point_time_field.as_deref();
    let TimeFields { named: fields, others } = TimeFields::of(layout, asked);
    let given = TimeRule::given(options.point_time);
    if fields.is_empty() {
        let names = layout.names().join(", ");
        if let Some(asked) = asked {
            let problem = format!("was given, but the points have the fields [{names}]");
            return Err(LogError::setting(path, LogSetting::PointTimeField, asked, problem));
        }
        if given.is_some() {
            let problem = format!("was given, but the points have no field for a time among [{names}]");
            return Err(LogError::setting(path, LogSetting::PointTime, options.point_time, problem));
        }
    }
    if options.point_time == PointTime::Ignore {
        if let Some(first_field) = fields.first() {
            notes.push(format!("field `{first_field}`: not used as the time of a point, as was asked"));
        }
        return without_times(path, options);
    }
    if fields.is_empty() && others.is_empty() {
        return without_times(path, options);
    }
    let seen_of_fields = look()?;
    let period_ns = period_ns.unwrap_or_else(|| {
        if given.is_none() && !fields.is_empty() {
            notes.push("too few stamps for the scan period: 0.1 s is used".into());
        }
        USUAL_PERIOD_NS
    });
    let mut unclear = None;
    for (field, seen) in fields.iter().zip(&seen_of_fields) {
        // Two fields that are no one time are looked at one by one.
        if seen.is_empty() && layout.field(field).is_none() {
            continue;
        }
        let given_rule = |rule| (Finding::Rule(rule), None);
        let (found, odd_frame) = given.map_or_else(|| find_rule_of_most(seen, period_ns), given_rule);
        match found {
            Finding::Rule(rule) => {
                let seen = &well(seen, odd_frame);
                let later =
                    fields.iter().zip(&seen_of_fields).skip_while(|(other, _)| *other != field).skip(1);
                let later = later.filter(|(other, _)| is_time_name(other));
                let disagree = || disagreement(rule, seen, later, odd_frame, period_ns);
                if let Some((other, problem)) = given.is_none().then(disagree).flatten() {
                    let field = format!("in fields `{field}` and `{other}`");
                    return Err(LogError::PointTime { path: path.into(), field, problem });
                }
                let evidence = if given.is_some() { "as given" } else { "found from the values" };
                let choice = place_stamp(path, field, rule, options.stamp_at, seen, evidence)?;
                return Ok(Some(TimeChoice { odd_frame, ..choice }));
            }
            Finding::Constant if asked.is_some() => {
                let problem = "was given, but its value is the same for all points of a scan";
                return Err(LogError::setting(path, LogSetting::PointTimeField, field, problem));
            }
            Finding::Constant => {
                notes.push(format!(
                    "field `{field}` is the same for all points of a scan: no times of points"
                ));
            }
            Finding::Unclear(problem) if asked.is_some() || is_time_name(field) => {
                unclear = unclear.or(Some((field, problem)));
            }
            Finding::Unclear(problem) => {
                notes.push(format!("field `{field}` sounds like times of points and is not used: {problem}"));
            }
        }
    }
    match unclear {
        None => {
            for (field, seen) in others.iter().zip(seen_of_fields.iter().skip(fields.len())) {
                if let Some(rule) = may_be_times(seen, period_ns) {
                    notes.push(format!(
                        "field `{field}` may be times of points, as {}, and is not used: if it is, name it with --point-time {field}:",
                        rule.words()
                    ));
                }
            }
            without_times(path, options)
        }
        Some((field, problem)) => {
            let field = format!("in field `{field}`");
            Err(LogError::PointTime { path: path.into(), field, problem })
        }
    }
}

/// What was seen of all scans but the odd one.
fn well(seen: &[FieldExtremes], odd_frame: Option<usize>) -> Vec<FieldExtremes> {
    seen.iter().copied().filter(|scan| Some(scan.frame) != odd_frame).collect()
}

/// Another field whose values are times as well and say that scans take longer or shorter, by more than a tenth of
/// the period: its name, and both spans in words.
fn disagreement<'a>(
    rule: TimeRule,
    seen: &[FieldExtremes],
    later: impl Iterator<Item = (&'a String, &'a Vec<FieldExtremes>)>,
    odd_frame: Option<usize>,
    period_ns: i64,
) -> Option<(&'a str, String)> {
    let span_ns =
        |rule: TimeRule, scan: &FieldExtremes| (scan.largest - scan.smallest) * rule.unit.in_ns() as f64;
    for (other, other_seen) in later {
        let other_seen = well(other_seen, odd_frame);
        let Finding::Rule(other_rule) = find_rule(&other_seen, period_ns) else { continue };
        for (scan, other_scan) in seen.iter().zip(&other_seen) {
            let (a_ns, b_ns) = (span_ns(rule, scan), span_ns(other_rule, other_scan));
            if (a_ns - b_ns).abs() > 0.1 * period_ns as f64 {
                let (a_s, b_s) = (a_ns / 1e9, b_ns / 1e9);
                return Some((
                    other,
                    format!("they disagree: a scan spans {a_s:.4} s by the one, {b_s:.4} s by the other"),
                ));
            }
        }
    }
    None
}

/// Without times a scan is one instant, its stamp, wherever that lies in it.
fn without_times(path: &Path, options: &LogOptions) -> Result<Option<TimeChoice>, LogError> {
    match options.stamp_at {
        StampAt::Start => Ok(None),
        at => {
            let problem = "was given, but the points have no times of their own: to move the stamps, set the time offset";
            Err(LogError::setting(path, LogSetting::StampAt, at.name(), problem))
        }
    }
}

/// Puts times that count from the scan's beginning where the stamp is the middle or the end of it.
pub(crate) fn place_stamp(
    path: &Path,
    field: &str,
    mut rule: TimeRule,
    at: StampAt,
    seen: &[FieldExtremes],
    evidence: &str,
) -> Result<TimeChoice, LogError> {
    let unit_ns = rule.unit.in_ns() as f64;
    // The longest of these scans: the others lack returns at their ends.
    let span_ns = seen.iter().map(|scan| (scan.largest - scan.smallest) * unit_ns).fold(0.0, f64::max);
    let first_ns = seen.iter().map(|scan| scan.smallest * unit_ns).fold(f64::INFINITY, f64::min);
    let from_start = match rule.origin {
        Origin::Stamp => first_ns > -0.1 * span_ns,
        Origin::Clock => false,
        Origin::FirstPoint => true,
    };
    if at != StampAt::Start && !from_start {
        let problem = format!(
            "was given, but the times in `{field}` say themselves where the stamp lies: the first is {:.4} s from it",
            if rule.origin == Origin::Clock {
                seen.first().map_or(f64::NAN, |scan| (scan.smallest * unit_ns - scan.stamp_ns as f64) / 1e9)
            } else {
                first_ns / 1e9
            }
        );
        return Err(LogError::setting(path, LogSetting::StampAt, at.name(), problem));
    }
    rule.shift_ns = match at {
        StampAt::Start => 0,
        StampAt::Mid => -(span_ns / 2.0).round() as i64,
        StampAt::End => -span_ns.round() as i64,
    };
    let stamp = if from_start { format!(", the stamp is its {}", at.name()) } else { String::new() };
    let span = if seen.is_empty() { String::new() } else { format!(", a scan spans {:.4} s", span_ns / 1e9) };
    let words = format!("field `{field}`: {}, {evidence}{span}{stamp}", rule.words());
    let (middle_ns, sweep_ns) = sweep_of(rule, seen);
    Ok(TimeChoice { field: field.into(), rule, words, middle_ns, sweep_ns, odd_frame: None })
}

/// From the stamp to the middle of a scan, and to the first and the last of the returns looked at.
fn sweep_of(rule: TimeRule, seen: &[FieldExtremes]) -> (i64, [i64; 2]) {
    let unit_ns = rule.unit.in_ns() as f64;
    let from_stamp = |scan: &FieldExtremes, value: f64| match rule.origin {
        Origin::Stamp => value * unit_ns,
        Origin::Clock => value * unit_ns - scan.stamp_ns as f64,
        Origin::FirstPoint => (value - scan.smallest) * unit_ns,
    };
    let first_ns = seen.iter().map(|scan| from_stamp(scan, scan.smallest)).fold(f64::INFINITY, f64::min);
    let last_ns = seen.iter().map(|scan| from_stamp(scan, scan.largest)).fold(f64::NEG_INFINITY, f64::max);
    let middle_ns = 0.5 * (first_ns + last_ns);
    if !middle_ns.is_finite() {
        return (0, [0; 2]);
    }
    let from_stamp_ns = |ns: f64| (ns.round() as i64).saturating_add(rule.shift_ns);
    (from_stamp_ns(middle_ns), [first_ns, last_ns].map(from_stamp_ns))
}
