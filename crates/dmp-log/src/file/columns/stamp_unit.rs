//! The unit of stamps without a name for it, found by their size and their steps.
//!
//! Stamps since 1970 are of one unit only: of the same instants the numbers are a thousand apart. Stamps of a clock that
//! begins with the log may be of any, and are asked for where they cannot be seconds.

use crate::file::text::lines;
use crate::{ParseError, PlaceInFile, TimeUnit};
use std::ops::Range;

/// The last second that nanoseconds in 64 bits can hold.
const YEAR_2262_S: f64 = 9_223_372_036.0;
/// The years 1990 to 2100.
const OUR_DAYS_S: Range<f64> = 631_152_000.0..4_102_444_800.0;
/// Poses of one trajectory are nearer in time than this, at most of its steps.
const LONGEST_STEP_S: f64 = 100.0;
/// Whole numbers further apart than this are rather milliseconds.
const LONG_STEP_S: f64 = 5.0;

/// The unit in which a number is an instant of our days, counted from 1970.
pub(crate) fn unit_since_1970(stamp: f64) -> Option<TimeUnit> {
    TimeUnit::ALL.into_iter().find(|unit| OUR_DAYS_S.contains(&(stamp * (unit.in_ns() as f64 / 1e9))))
}

/// What the stamps of a file are taken for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FoundUnit {
    pub(crate) unit: TimeUnit,
    /// What its reader should know.
    pub(crate) note: Option<String>,
}

/// The unit of the stamps in the first columns of a file whose format has seconds; where it is open, that which is
/// given for this case. Notes say what was found.
pub(crate) fn unit_of_lines(
    bytes: &[u8],
    otherwise: Option<TimeUnit>,
    notes: &mut Vec<String>,
) -> Result<TimeUnit, ParseError> {
    let (stamps, place) = first_columns(bytes);
    found_or(otherwise, &stamps, place, notes)
}

/// The same of stamps, of which the first is at a place.
pub(crate) fn found_or(
    otherwise: Option<TimeUnit>,
    stamps: &[f64],
    place: PlaceInFile,
    notes: &mut Vec<String>,
) -> Result<TimeUnit, ParseError> {
    match (unit_of(stamps), otherwise) {
        (Ok(found), _) => {
            notes.extend(found.note);
            Ok(found.unit)
        }
        (Err(_), Some(unit)) => Ok(unit),
        (Err(problem), None) => Err(ParseError::new(place, problem)),
    }
}

/// The same of a file whose format has nanoseconds, which may be microseconds where no comment says what they are.
pub(crate) fn unit_of_large_numbers(bytes: &[u8], notes: &mut Vec<String>) -> TimeUnit {
    let (stamps, place) = first_columns(bytes);
    let is_comment = |text: &[u8]| text.trim_ascii().starts_with(b"#");
    let is_before = |line: u64| bytes.split(|&c| c == b'\n').zip(1..line).any(|(text, _)| is_comment(text));
    if matches!(place, PlaceInFile::Line(line) if is_before(line)) {
        return TimeUnit::Nanoseconds;
    }
    // With the state behind the pose it is EuRoC's for sure.
    if lines(bytes).next().is_some_and(|line| line.is_ok_and(|(_, columns)| columns.len() == 8)) {
        notes.push("no line names the columns: quaternions are read as w x y z, as EuRoC has them".into());
    }
    match unit_of(&stamps) {
        Ok(FoundUnit { unit: TimeUnit::Microseconds, note }) => {
            notes.extend(note);
            TimeUnit::Microseconds
        }
        _ => TimeUnit::Nanoseconds,
    }
}

/// The numbers that lines begin with, and where the first one is.
fn first_columns(bytes: &[u8]) -> (Vec<f64>, PlaceInFile) {
    let mut first = None;
    // Lines that are wrong are reported where they are parsed.
    let stamps = lines(bytes).filter_map(|line| {
        let (place, columns) = line.ok()?;
        let stamp = columns.first()?.parse::<f64>().ok().filter(|stamp| stamp.is_finite())?;
        first.get_or_insert(place);
        Some(stamp)
    });
    (stamps.collect(), first.unwrap_or(PlaceInFile::WholeFile))
}

/// The unit of stamps, in the order of their file; why it is open, where it is.
pub(crate) fn unit_of(stamps: &[f64]) -> Result<FoundUnit, String> {
    let seconds = |note| Ok(FoundUnit { unit: TimeUnit::Seconds, note });
    let (Some(&first), Some(&last)) = (stamps.first(), stamps.last()) else { return seconds(None) };
    let step = usual_step(stamps);
    let is_since_1970 = |&unit: &TimeUnit| {
        let unit_s = unit.in_ns() as f64 / 1e9;
        let near = step.is_none_or(|step| step * unit_s < LONGEST_STEP_S);
        near && [first, last].iter().all(|stamp| OUR_DAYS_S.contains(&(stamp * unit_s)))
    };
    let far_apart = step.filter(|step| *step >= LONG_STEP_S);
    let note = far_apart.map(|step| format!("stamps read as seconds: they are {step} apart"));
    match TimeUnit::ALL.into_iter().find(is_since_1970) {
        Some(TimeUnit::Seconds) => return seconds(note),
        Some(unit) => {
            let note = format!("stamps in {}: as seconds they are beyond the year 2262", unit.name());
            return Ok(FoundUnit { unit, note: Some(note) });
        }
        None => {}
    }
    let is_whole = stamps.iter().all(|stamp| stamp.fract() == 0.0);
    if first.min(last) > YEAR_2262_S || (is_whole && far_apart.is_some()) {
        let apart = step.map_or(String::new(), |step| format!(", {step} apart"));
        return Err(format!(
            "stamps from {first} to {last}{apart}: no seconds, and they do not count from 1970, so that they may be \
             milliseconds, microseconds or nanoseconds: the time unit must be given (s, ms, us or ns)"
        ));
    }
    seconds(note)
}

/// The median of the steps from stamp to stamp that are none of zero.
fn usual_step(stamps: &[f64]) -> Option<f64> {
    let steps = stamps.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    let middle = steps.len() / 2;
    (!steps.is_empty()).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stamps at 10 Hz for a minute, in this unit, from this second on.
    fn stamps(unit: TimeUnit, from_s: f64) -> Vec<f64> {
        let per_s = 1e9 / unit.in_ns() as f64;
        (0..600).map(|k| ((from_s + 0.1 * f64::from(k)) * per_s).round()).collect()
    }

    #[test]
    fn stamps_since_1970_are_of_one_unit() {
        for unit in [TimeUnit::Milliseconds, TimeUnit::Microseconds, TimeUnit::Nanoseconds] {
            let found = unit_of(&stamps(unit, 1.7e9)).unwrap();
            assert_eq!(found.unit, unit);
            assert!(found.note.unwrap().contains(unit.name()));
            let halves: Vec<f64> = stamps(unit, 1.7e9).iter().map(|stamp| stamp + 0.5).collect();
            assert_eq!(unit_of(&halves).unwrap().unit, unit);
            assert_eq!(unit_of(&stamps(unit, 1.7e9)[..1]).unwrap().unit, unit);
        }
        // Keyframes a minute apart.
        assert_eq!(unit_of(&[1.7e9, 1.7e9 + 60.0]).unwrap().unit, TimeUnit::Seconds);
        let seconds: Vec<f64> = (0..50).map(|k| 1.7e9 + 0.1 * f64::from(k)).collect();
        assert_eq!(unit_of(&seconds).unwrap(), FoundUnit { unit: TimeUnit::Seconds, note: None });
    }

    #[test]
    fn a_clock_that_begins_with_the_log_is_asked_for() {
        // Of 1000 s and 50 days uptime too: as milliseconds or seconds those would be instants of our days.
        for unit in [TimeUnit::Milliseconds, TimeUnit::Microseconds, TimeUnit::Nanoseconds] {
            for from_s in [0.0, 12.0, 1_000.0, 1_700.0, 4e6] {
                let error = unit_of(&stamps(unit, from_s)).unwrap_err();
                assert!(error.contains("must be given (s, ms, us or ns)"), "{unit:?} {from_s}: {error}");
            }
        }
        let error = unit_of(&[0.0, 1e8, 2e8]).unwrap_err();
        assert!(error.contains("from 0 to 200000000, 100000000 apart"), "{error}");
    }

    #[test]
    fn seconds_stay_seconds() {
        let is_seconds = |stamps: &[f64]| unit_of(stamps).unwrap();
        for stamps in [&[][..], &[5000.0], &[0.0, 1.0, 2.0], &[0.5, 0.6], &[3.0, 1.0, 1.0], &[7.0; 4]] {
            assert_eq!(is_seconds(stamps), FoundUnit { unit: TimeUnit::Seconds, note: None }, "{stamps:?}");
        }
        // A few places that were measured, minutes apart.
        for stamps in [[1.7e9 + 0.5, 1.7e9 + 90.0, 1.7e9 + 200.25], [0.25, 60.0, 130.5]] {
            let note = is_seconds(&stamps).note.unwrap();
            assert!(note.contains("read as seconds"), "{note}");
        }
    }
}
