//! What the names of files say: their order, and perhaps their stamps.

use crate::TimeUnit;
use crate::file::to_ns;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// The stamp in a stem, and its unit: seconds with a fraction (`1690309709.285305500`), or by the digits of a date of
/// today's, 13, 16 or 19 of them; behind a name as well (`cloud_1690309709_285305500`, `LIDAR_TOP__1690309709285305.pcd`).
/// Numbers that begin with a zero are counters.
fn stamp_in(stem: &str) -> Option<(Cow<'_, str>, TimeUnit)> {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit());
    let stem = stem.strip_suffix(".pcd").unwrap_or(stem);
    if let Some((name, nanoseconds)) =
        stem.rsplit_once('_').filter(|(_, last)| last.len() == 9 && digits(last))
    {
        let seconds = name.rsplit('_').next().filter(|seconds| seconds.len() == 10 && digits(seconds))?;
        return Some((format!("{seconds}.{nanoseconds}").into(), TimeUnit::Seconds));
    }
    let stamp = stem.rsplit('_').next().unwrap_or(stem);
    if let Some((whole, fraction)) = stamp.split_once('.') {
        return (digits(whole) && digits(fraction)).then_some((stamp.into(), TimeUnit::Seconds));
    }
    let unit = match stamp.len() {
        _ if !digits(stamp) || stamp.starts_with('0') => return None,
        13 => TimeUnit::Milliseconds,
        16 => TimeUnit::Microseconds,
        19 => TimeUnit::Nanoseconds,
        _ => return None,
    };
    Some((stamp.into(), unit))
}

fn stem(file: &Path) -> Option<&str> {
    file.file_stem()?.to_str()
}

/// The stamps that all the files are named by, nanoseconds, and their unit in words; `None` where a name is
/// none, or one of another unit.
pub(crate) fn stamps_ns(files: &[PathBuf]) -> Option<(Vec<i64>, &'static str)> {
    let (_, unit) = stamp_in(stem(files.first()?)?)?;
    let stamp = |file: &PathBuf| {
        let (stamp, _) = stamp_in(stem(file)?).filter(|(_, of_file)| *of_file == unit)?;
        to_ns(&stamp, unit).ok()
    };
    Some((files.iter().map(stamp).collect::<Option<_>>()?, unit.name()))
}

/// Puts files in the order of the stamps or numbers that all of them are named by, written with leading
/// zeros or without (by name alone, 10 comes before 2), else in that of their names. Says which.
pub(crate) fn put_in_order(files: &mut [PathBuf]) -> &'static str {
    files.sort();
    let stamp = |file: &PathBuf| stamps_ns(std::slice::from_ref(file))?.0.first().copied();
    if stamps_ns(files).is_some() {
        files.sort_by_cached_key(stamp);
        return "scans in the order of the stamps in their file names";
    }
    let number = |file: &PathBuf| {
        let stem = stem(file)?.trim_start_matches('0').to_owned();
        stem.bytes().all(|c| c.is_ascii_digit()).then_some((stem.len(), stem))
    };
    if files.iter().all(|file| number(file).is_some()) {
        files.sort_by_cached_key(number);
    }
    "scans in the order of their file names"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(|name| PathBuf::from(format!("/a/{name}.pcd"))).collect()
    }

    #[test]
    fn stamps_are_known_by_their_digits() {
        type Expected = Option<(i64, &'static str)>;
        let cases: [(&[&str], Expected); 13] = [
            (&["cloud_1690309709_285305500"], Some((1_690_309_709_285_305_500, "seconds"))),
            (
                &["n015-2018__LIDAR_TOP__1690309709285305.pcd"],
                Some((1_690_309_709_285_305_000, "microseconds")),
            ),
            (&["scan_12"], None),
            (&["cloud_12_285305500"], None),
            (&["1690309709.285305500"], Some((1_690_309_709_285_305_500, "seconds"))),
            (&["1690309709285305500"], Some((1_690_309_709_285_305_500, "nanoseconds"))),
            (&["1690309709285305"], Some((1_690_309_709_285_305_000, "microseconds"))),
            (&["1690309709285"], Some((1_690_309_709_285_000_000, "milliseconds"))),
            (&["000017"], None),
            (&["0000000000000017"], None),
            (&["1690309709.2", "scan"], None),
            (&["1690309709.2", "1690309709285"], None),
            (&["12.5.3"], None),
        ];
        for (names, expected) in cases {
            let found = stamps_ns(&files(names)).map(|(stamps, unit)| (stamps[0], unit));
            assert_eq!(found, expected, "{names:?}");
        }
        assert_eq!(stamps_ns(&[]), None);
        // A date beyond what a stamp can hold.
        assert_eq!(stamps_ns(&files(&["9999999999999999999"])), None);
    }

    #[test]
    fn order_is_that_of_what_the_names_are() {
        let ordered = |names: &[&str]| {
            let mut files = files(names);
            put_in_order(&mut files);
            files.iter().map(|file| stem(file).unwrap().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(ordered(&["10", "9", "007"]), ["007", "9", "10"]);
        assert_eq!(ordered(&["10.5", "9.25", "9.3"]), ["9.25", "9.3", "10.5"]);
        assert_eq!(ordered(&["b10", "b9", "a"]), ["a", "b10", "b9"]);
    }
}
