//! Dates and times of day as nanoseconds since 1970.

use crate::file::seconds_to_ns;

/// Nanoseconds since 1970 of a date and a time of day, UTC: `2011-09-26`, `13:02:25.964389445`.
pub(super) fn stamp_ns(date: &str, time: &str) -> Result<i64, String> {
    let wrong = || format!("not a date and time like `2011-09-26 13:02:25.964389445`: `{date} {time}`");
    let number = |text: &str| text.parse::<i64>().ok().filter(|_| text.bytes().all(|c| c.is_ascii_digit()));
    let three = |text: &str, by: char| -> Option<[String; 3]> {
        let parts: Vec<String> = text.split(by).map(str::to_owned).collect();
        parts.try_into().ok()
    };
    let [year, month, day] = three(date, '-').ok_or_else(wrong)?;
    let [hour, minute, second] = three(time, ':').ok_or_else(wrong)?;
    let part = |text: &str, low: i64, high: i64| {
        number(text).filter(|value| (low..=high).contains(value)).ok_or_else(wrong)
    };
    let days = days_from_1970(part(&year, 1, 9999)?, part(&month, 1, 12)?, part(&day, 1, 31)?);
    let minutes = days * 1440 + part(&hour, 0, 23)? * 60 + part(&minute, 0, 59)?;
    let within = seconds_to_ns(&second).map_err(|_| wrong())?;
    // A leap second is the first one of the next minute.
    if !(0..61_000_000_000).contains(&within) {
        return Err(wrong());
    }
    minutes.checked_mul(60_000_000_000).and_then(|ns| ns.checked_add(within)).ok_or_else(wrong)
}

/// Days from 1970-01-01 to a day of the Gregorian calendar. Years begin in March, so that the leap day is the
/// last (`days_from_civil` of Howard Hinnant, <https://howardhinnant.github.io/date_algorithms.html>).
fn days_from_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counting day by day.
    #[test]
    fn every_day_of_five_centuries_follows_the_one_before() {
        let mut expected = days_from_1970(1600, 1, 1);
        for year in 1600..2100 {
            let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
            let lengths = [31, if leap { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
            for (month, length) in (1..).zip(lengths) {
                for day in 1..=length {
                    assert_eq!(days_from_1970(year, month, day), expected, "{year}-{month}-{day}");
                    expected += 1;
                }
            }
        }
        assert_eq!(days_from_1970(1970, 1, 1), 0);
    }

    #[test]
    fn dates_are_read_and_nonsense_is_named() {
        // `date -u -d '2011-09-26 13:02:25' +%s`
        assert_eq!(stamp_ns("2011-09-26", "13:02:25.964389445"), Ok(1_317_042_145_964_389_445));
        assert_eq!(stamp_ns("2000-02-29", "00:00:00"), Ok(951_782_400_000_000_000));
        assert_eq!(stamp_ns("1969-12-31", "23:59:59.5"), Ok(-500_000_000));
        let dates =
            ["2011-13-01", "2011-00-01", "2011-01-32", "2011-01", "2011-01-01-", "9999-01-01", "+2011-01-01"];
        let times = ["24:00:00", "00:60:00", "00:00:61", "00:00:-1", "00:00"];
        let wrong = dates.map(|date| (date, "00:00:00")).into_iter();
        for (date, time) in wrong.chain(times.map(|time| ("2011-01-01", time))) {
            assert!(stamp_ns(date, time).unwrap_err().contains(date), "{date} {time}");
        }
    }
}
