//! `dmp simulate town`: a drive through a small town.

use std::io::Write as _;

use dmp_draw::text::counted;
use dmp_sim::{Recording, RecordingOptions, Route, Scenery};

use super::error::in_words;
use super::recording::{TRUTH_RATE_HZ, lidar, refuse_other_truth, save_scans, truth_path};
use crate::console::{Common, Exit, Usage};
use crate::files::{Compression, LogWriter, OutputFormat, save_trajectory, write_trajectory};
use crate::options::simulate::{self, Streets};
use crate::options::{Asked, Out, Spec};

/// From one house to the next where they are alike, metres.
const PERIOD_M: f64 = 8.0;

pub(super) static SPEC: Spec = Spec {
    name: "town",
    about: "Make a log of a drive through a simulated town, and its true trajectory",
    more: "The town is generated from the seed: streets of 14 m with houses on both sides, hills, trees, poles, parked and moving \
           cars. The sensor turns while it moves; every return has its own time. World, body and sensor have z up; the \
           trajectory is the sensor's. Other scenery makes registration of revisits ambiguous: streets that look the same \
           everywhere, and a tunnel without structure along it.",
    after: "Examples:\n  \
            dmp simulate town -o town.mcap\n  \
            dmp simulate town -o drive/ --beams 64 --azimuth-steps 2048 --scans 1000 --route out-and-back\n  \
            dmp simulate town -o traffic.mcap --traffic 20 --scans 600 --seed 7\n  \
            dmp simulate town -o queue.mcap --company ahead=15m,oncoming\n  \
            dmp simulate town -o alike.mcap --scenery alike --period 8m\n  \
            dmp simulate town -o tunnel.mcap --scenery tunnel --truth tunnel.tum",
    options: &[
        simulate::RECORDING,
        &[
            &simulate::SCANS,
            &simulate::SCENERY,
            &simulate::PERIOD,
            &simulate::ROUTE,
            &simulate::TRAFFIC,
            &simulate::COMPANY,
        ],
    ],
    run,
    ..Spec::EMPTY
};

fn streets(asked: &Asked) -> Streets {
    asked.get(&simulate::SCENERY).unwrap_or(Streets::Varied)
}

fn scenery(asked: &Asked) -> Result<Scenery, Usage> {
    match (streets(asked), asked.get(&simulate::PERIOD)) {
        (Streets::Alike, period) => Ok(Scenery::Alike { period_m: period.unwrap_or(PERIOD_M) }),
        (_, Some(_)) => Err(Usage("--period is for --scenery alike only".to_owned())),
        (Streets::Varied, None) => Ok(Scenery::Varied),
        (Streets::Tunnel, None) => Ok(Scenery::Tunnel),
    }
}

fn options(asked: &Asked) -> RecordingOptions {
    let usual = if streets(asked) == Streets::Varied { Route::Loop } else { Route::Straight };
    RecordingOptions {
        seed: asked.get(&simulate::SEED).unwrap_or(1),
        scans: asked.get(&simulate::SCANS).unwrap_or(600),
        route: asked.get(&simulate::ROUTE).unwrap_or(usual),
        speed_m_s: asked.get(&simulate::SPEED).unwrap_or(6.0),
        traffic: asked.get(&simulate::TRAFFIC).unwrap_or(0),
        lidar: lidar(asked, 16, 900),
    }
}

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let output = asked.need(&simulate::DRIVE)?;
    let options = options(asked);
    let town = options.town_of(scenery(asked)?).map_err(in_words)?;
    let companions = asked.get(&simulate::COMPANY).unwrap_or_default();
    let recording = Recording::new(&town, &options).map_err(in_words)?.among(companions);
    let named = asked.get(&simulate::TRUTH);
    let truth_path = truth_path(&output, named.as_deref());
    let truth = if truth_path.extension().is_some_and(|extension| extension == "txt") {
        recording.pose_per_scan()?
    } else {
        let rate_hz = asked.get(&simulate::TRUTH_RATE).unwrap_or(TRUTH_RATE_HZ);
        recording.drive().trajectory(rate_hz).map_err(in_words)?
    };
    refuse_other_truth(&truth_path, named.as_deref(), |out| write_trajectory(out, &truth))?;

    let format = OutputFormat::of_name(&output)?;
    let log = LogWriter::create(&output, format, Compression::Zstd)?;
    let returns = save_scans(recording.scans(), recording.len(), log, common)?;
    save_trajectory(&truth_path, &truth)?;

    let (travel_m, revisits) = recording.travel_and_revisits();
    writeln!(
        out,
        "{}: {}, {}, {travel_m:.1} m of travel, {:.0} % of the scans are revisits",
        output.display(),
        counted(recording.len() as u64, "scan"),
        counted(returns, "return"),
        revisits * 100.0,
    )?;
    writeln!(out, "{}: {}", truth_path.display(), counted(truth.len() as u64, "pose"))?;
    Ok(Exit::Done)
}
