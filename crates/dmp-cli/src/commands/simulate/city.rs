//! `dmp simulate city`: a drive of any length.

use std::io::Write as _;

use dmp_draw::text::counted;
use dmp_log::write_tum_poses;
use dmp_sim::{CityOptions, CityRecording};

use super::error::in_words;
use super::recording::{TRUTH_RATE_HZ, lidar, refuse_other_truth, save_scans, truth_path};
use crate::console::{Common, Exit};
use crate::files::{Compression, LogWriter, OutputFormat, save};
use crate::options::{Asked, Out, Spec, simulate};

pub(super) static SPEC: Spec = Spec {
    name: "city",
    about: "Make a log of a drive of any length through an endless city, and its true trajectory",
    more: "The city is generated around the sensor from the seed: streets and avenues with houses, halls, parks and squares on \
           hilly ground, trees, poles and parked cars. Memory does not grow with the length of the drive. The road goes round \
           some blocks, in part twice, and on to new ground.",
    after: "Examples:\n  \
            dmp simulate city --km 1 --beams 64 -o city.mcap\n  \
            dmp simulate city --km 100 --beams 128 --revisit 0.5 -o long.mcap\n  \
            dmp simulate city --km 20 --revisit 0 --seed 7 -o one-way.mcap",
    options: &[&[&simulate::KM, &simulate::REVISIT], simulate::RECORDING],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let output = asked.need(&simulate::DRIVE)?;
    let truth_rate = asked.get(&simulate::TRUTH_RATE).unwrap_or(TRUTH_RATE_HZ);
    let recording = CityRecording::new(&CityOptions {
        seed: asked.get(&simulate::SEED).unwrap_or(1),
        travel_m: asked.need(&simulate::KM)? * 1000.0,
        revisit_share: asked.get(&simulate::REVISIT).unwrap_or(0.3),
        speed_m_s: asked.get(&simulate::SPEED).unwrap_or(10.0),
        lidar: lidar(asked, 64, 1024),
    });
    let recording = recording.map_err(in_words)?;
    let poses = recording.poses(truth_rate).map_err(in_words)?;
    let named = asked.get(&simulate::TRUTH);
    let truth_path = truth_path(&output, named.as_deref());
    let again = recording.poses(truth_rate).map_err(in_words)?;
    refuse_other_truth(&truth_path, named.as_deref(), |out| write_tum_poses(out, again))?;

    let format = OutputFormat::of_name(&output)?;
    let log = LogWriter::create(&output, format, Compression::ZstdFast)?;
    let returns = save_scans(recording.scans(), recording.len(), log, common)?;
    let count = poses.len();
    save(&truth_path, |out| write_tum_poses(out, poses))?;

    let (travel_m, revisited) = recording.travel_and_revisits();
    writeln!(
        out,
        "{}: {}, {}, {:.3} km, {:.0} % of them driven twice",
        output.display(),
        counted(recording.len() as u64, "scan"),
        counted(returns, "return"),
        travel_m / 1000.0,
        revisited * 100.0,
    )?;
    writeln!(out, "{}: {}", truth_path.display(), counted(count as u64, "pose"))?;
    Ok(Exit::Done)
}
