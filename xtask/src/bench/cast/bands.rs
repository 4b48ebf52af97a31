//! How fast casters are on rays of different lengths.

use dmp_cast::Path;

use super::files::Work;
use super::records::write_records;
use super::speeds::{Casters, Row, measure};

/// Bands of the measured range, metres.
const BANDS_M: [[f32; 2]; 5] =
    [[0.0, 10.0], [10.0, 20.0], [20.0, 50.0], [50.0, f32::INFINITY], [20.0, f32::INFINITY]];
/// A timing casts at least for so long, seconds.
const LEAST_S: f64 = 0.2;

/// Prints a table of Embree's fastest single rays and the project's own on the rays of each band alone. The casters
/// have the rays of the last band then.
pub(super) fn print(casters: &mut Casters, work: &Work, runs: u32) -> anyhow::Result<()> {
    let best = Path::best().name();
    let own_modes = ["single", "packets-bounded"].map(|mode| format!("{best}-{mode}"));
    let Some(own) = casters.place("dmp") else { return Ok(()) };
    let reference = casters.references().map(|[_, fastest]| casters.name(fastest).to_owned());
    let reference = reference.and_then(|name| casters.place(&name));
    let mut of_rows: Vec<(usize, &str)> = vec![(own, &own_modes[0]), (own, &own_modes[1])];
    of_rows.extend(reference.map(|place| (place, "single")));

    let speed = "M rays/s (least – largest)";
    println!(
        "{:<10}{:>10}{:>30}{:>30}{:>8}{:>30}{:>8}",
        "band", "rays", "embree single", own_modes[0], "", own_modes[1], ""
    );
    println!("{:<10}{:>10}{speed:>30}{speed:>30}{:>8}{speed:>30}{:>8}", "m", "", "to it", "to it");
    let folder = tempfile::tempdir_in("/var/tmp")?;
    for [low_m, high_m] in BANDS_M {
        let rays = || work.rays.iter().filter(|ray| (low_m..high_m).contains(&ray[6]));
        let count = rays().count() as u64;
        let band = if high_m.is_finite() { format!("{low_m} – {high_m}") } else { format!("> {low_m}") };
        if count == 0 {
            println!("{band:<10}{count:>10}");
            continue;
        }
        let path = folder.path().join("rays");
        write_records(&path, rays())?;
        for &(caster, _) in &of_rows[1..] {
            casters.peers[caster].change_rays(&path)?;
        }
        let mut rows: Vec<Row> = of_rows.iter().map(|&(caster, mode)| Row::new(caster, mode)).collect();
        measure(&mut casters.peers, &mut rows, runs, LEAST_S)?;
        let told = |row: &Row| {
            let [median, least, largest] = row.millions_per_s(count);
            format!("{median:.2} ({least:.2} – {largest:.2})")
        };
        let embree = rows.get(2);
        let ratio = |row: &Row| {
            embree.map_or_else(
                || "-".to_owned(),
                |embree| format!("{:.2}x", embree.median_s() / row.median_s()),
            )
        };
        println!(
            "{band:<10}{count:>10}{:>30}{:>30}{:>8}{:>30}{:>8}",
            embree.map_or_else(|| "-".to_owned(), told),
            told(&rows[0]),
            ratio(&rows[0]),
            told(&rows[1]),
            ratio(&rows[1])
        );
    }
    Ok(())
}
