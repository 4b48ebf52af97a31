//! Exact ranges of every ray, and the casters' agreement with them.

use std::process::Command;

use dmp_cast::{Grouping, Path};

use super::files::{Files, Work, numbers};
use super::own::{BOUND_M, Mode, Own};
use super::peers::{Peer, embree_folder, succeed};

const ANSWERS: [(&str, &str); 3] = [("z1", "first"), ("zn", "nearest"), ("zc", "independent")];

/// Ranges by crossings computed in f64, metres, NaN for a miss: first, nearest to the measured range within 5 m, first
/// independent.
#[derive(Debug)]
pub(super) struct Exact([Vec<f64>; 3]);

impl Exact {
    /// From `check` of `bench/peers/embree`.
    ///
    /// # Errors
    /// In one line, why the machine cannot run it.
    pub(super) fn of(files: &Files) -> anyhow::Result<Self> {
        let out = tempfile::tempdir_in("/var/tmp")?;
        let mut command = Command::new(embree_folder()?.join("check"));
        command.args([&files.surfels, &files.rays, &out.path().join("exact")]);
        command.arg("--support").arg(&files.support).arg("--segments").arg(&files.segments);
        succeed(&mut command)?;
        let mut ranges = [(); 3].map(|()| Vec::new());
        for (ranges, (_, answer)) in ranges.iter_mut().zip(ANSWERS) {
            *ranges = numbers(&out.path().join(format!("exact.{answer}")), f64::from_le_bytes)?;
        }
        Ok(Self(ranges))
    }

    /// The same with everything further than `bound_m` behind the measured ranges a miss.
    fn bounded(&self, measured_m: &[f64], bound_m: f64) -> Self {
        let within = |(&range_m, &measured_m): (&f64, &f64)| {
            if range_m <= measured_m + bound_m { range_m } else { f64::NAN }
        };
        Self(self.0.each_ref().map(|ranges| ranges.iter().zip(measured_m).map(within).collect()))
    }

    /// Prints a table of agreements: the project's own in every mode, the others' single rays.
    pub(super) fn print(&self, own: &mut Own, work: &Work, peers: &mut [Peer]) -> anyhow::Result<()> {
        println!("{:<40}{}", "ranges against exact ones", Agreement::header());
        let row = |name: &str, ranges: &[f64], exact: &[f64]| {
            println!("{name:<40}{}", Agreement::of(ranges, exact).row());
        };
        let measured_m: Vec<f64> = work.rays.iter().map(|ray| f64::from(ray[6])).collect();
        for bounded in [false, true] {
            let exact = self.bounded(&measured_m, if bounded { BOUND_M } else { f64::INFINITY });
            let mut first: Option<[Vec<f64>; 3]> = None;
            for (path, grouping, three) in modes() {
                let (_, ranges) = own.cast(Mode { path, grouping, three, bounded })?;
                let known = first.get_or_insert_with(|| ranges.clone());
                let is_same = (0..if three { 3 } else { 1 }).all(|k| same(&known[k], &ranges[k]));
                anyhow::ensure!(
                    is_same,
                    "{} {grouping:?} {three}: other bits than the first mode",
                    path.name()
                );
            }
            let bound = if bounded { ", bounded" } else { "" };
            for ((answer, _), (ranges, exact)) in ANSWERS.iter().zip(first.iter().flatten().zip(&exact.0)) {
                row(&format!("dmp, all modes{bound}: {answer}"), ranges, exact);
            }
        }
        for peer in peers.iter_mut().filter(|peer| peer.name != "dmp") {
            row(&format!("{} single: z1", peer.name), &peer.ranges()?, &self.0[0]);
        }
        Ok(())
    }
}

/// All that must give the same bits; the first has all three answers.
fn modes() -> impl Iterator<Item = (Path, Grouping, bool)> {
    let groupings = [
        (Grouping::Single, true),
        (Grouping::Single, false),
        (Grouping::Auto, true),
        (Grouping::Auto, false),
    ];
    Path::all().into_iter().flat_map(move |path| groupings.map(|(grouping, three)| (path, grouping, three)))
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
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
        let count = |wanted: &dyn Fn(f64, f64) -> bool| {
            ranges_m.iter().zip(exact_m).filter(|&(&range_m, &exact_m)| wanted(range_m, exact_m)).count()
        };
        Self {
            rays: exact_m.len(),
            both: count(&|a, b| !a.is_nan() && !b.is_nan()),
            off: count(&|a, b| (a - b).abs() > 1e-3),
            extra: count(&|a, b| !a.is_nan() && b.is_nan()),
            missing: count(&|a, b| a.is_nan() && !b.is_nan()),
        }
    }

    #[cfg(test)]
    pub(super) fn is_exact(&self) -> bool {
        self.off + self.extra + self.missing == 0
    }

    fn header() -> String {
        format!(
            "{:>12}{:>14}{:>8}{:>20}{:>20}",
            "both hit", "within 1 mm", "off", "extra hits", "missing hits"
        )
    }

    fn row(&self) -> String {
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
        let bounded = Exact([vec![1.0, 7.0, NAN, 6.0], vec![], vec![]]).bounded(&[1.0; 4], 5.0);
        assert!(same(&bounded.0[0], &[1.0, NAN, NAN, 6.0]));
    }
}
