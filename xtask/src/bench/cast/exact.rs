//! Exact ranges of every ray, and how far those of casters agree with them.

use std::path::Path;
use std::process::Command;

use super::files::Files;
use super::peers::{embree_folder, succeed};
use super::records::numbers;

/// Ranges by crossings computed in f64, metres, NaN for a miss: first, nearest to the measured range within 5 m,
/// and, where segments are known, first independent.
#[derive(Debug)]
pub(super) struct Exact(pub(super) Vec<Vec<f64>>);

impl Exact {
    /// Asks `check` of `bench/peers/embree`.
    ///
    /// # Errors
    /// In one line, why it cannot be had on this machine, or what is wrong with the files.
    pub(super) fn of(files: &Files) -> anyhow::Result<Self> {
        let check = embree_folder()?.join("check");
        let out = tempfile::tempdir_in("/var/tmp")?;
        let mut command = Command::new(&check);
        command.args([&files.surfels, &files.rays, &out.path().join("exact")]).arg("--f64");
        let mut answers = vec!["first", "nearest"];
        if let Some([support, segments]) = &files.segments {
            command.arg("--support").arg(support).arg("--segments").arg(segments);
            answers.push("independent");
        }
        succeed(&mut command)?;
        let ranges = |answer: &&str| read(&out.path().join(format!("exact.{answer}64")));
        Ok(Self(answers.iter().map(ranges).collect::<anyhow::Result<_>>()?))
    }

    /// The same with everything further than `bound_m` behind the measured ranges a miss.
    pub(super) fn bounded(&self, measured_m: &[f64], bound_m: f64) -> Self {
        let within = |(&range_m, &measured_m): (&f64, &f64)| {
            if range_m <= measured_m + bound_m { range_m } else { f64::NAN }
        };
        Self(self.0.iter().map(|ranges| ranges.iter().zip(measured_m).map(within).collect()).collect())
    }
}

fn read(path: &Path) -> anyhow::Result<Vec<f64>> {
    numbers(path, f64::from_le_bytes)
}

/// How far some ranges agree with the exact ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Agreement {
    rays: usize,
    /// Hit by both.
    both: usize,
    /// Of these, further than 1 mm from the exact range.
    off: usize,
    /// Hit where nothing is.
    extra: usize,
    /// Missed though something is there.
    missing: usize,
}

impl Agreement {
    pub(super) fn of(ranges_m: &[f64], exact_m: &[f64]) -> Self {
        let pairs = || ranges_m.iter().copied().zip(exact_m.iter().copied());
        Self {
            rays: exact_m.len(),
            both: pairs().filter(|(a, b)| !a.is_nan() && !b.is_nan()).count(),
            off: pairs().filter(|(a, b)| (a - b).abs() > 1e-3).count(),
            extra: pairs().filter(|(a, b)| !a.is_nan() && b.is_nan()).count(),
            missing: pairs().filter(|(a, b)| a.is_nan() && !b.is_nan()).count(),
        }
    }

    /// Whether nothing is off, extra or missing.
    #[cfg(test)]
    pub(super) fn is_exact(&self) -> bool {
        self.off + self.extra + self.missing == 0
    }

    pub(super) fn header() -> String {
        format!(
            "{:>12}{:>14}{:>8}{:>20}{:>20}",
            "both hit", "within 1 mm", "off", "extra hits", "missing hits"
        )
    }

    pub(super) fn row(&self) -> String {
        let within = 100.0 * (self.both - self.off) as f64 / self.both.max(1) as f64;
        let share = |count: usize| format!("{count} ({:.1e})", count as f64 / self.rays.max(1) as f64);
        format!(
            "{:>12}{:>14}{:>8}{:>20}{:>20}",
            self.both,
            format!("{within:.5} %"),
            self.off,
            share(self.extra),
            share(self.missing)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAN: f64 = f64::NAN;

    #[test]
    fn agreement_counts_what_is_off_extra_and_missing() {
        let agreement = Agreement::of(&[1.0, 2.01, NAN, 4.0, NAN, NAN], &[1.0005, 2.0, 3.0, NAN, NAN, 6.0]);
        assert_eq!(agreement, Agreement { rays: 6, both: 2, off: 1, extra: 1, missing: 2 });
        assert!(agreement.row().contains("50.00000 %"), "{}", agreement.row());
    }

    #[test]
    fn a_bound_makes_misses_of_what_is_behind_it() {
        let exact = Exact(vec![vec![1.0, 7.0, NAN, 6.0]]).bounded(&[1.0; 4], 5.0);
        assert_eq!(
            exact.0[0].iter().map(|range| range.is_nan()).collect::<Vec<_>>(),
            [false, true, true, false]
        );
    }
}
