//! `dmp simulate errors`: a trajectory made worse by a known amount.

use std::io::Write as _;

use clap::ArgGroup;
use dmp_draw::text::counted;
use dmp_log::read_trajectory;
use dmp_sim::{Noise, SlamErrors, ate_rmse_m};

use super::error::in_words;
use crate::console::{Common, Exit, say};
use crate::files::save_trajectory;
use crate::options::{Asked, Out, Spec, simulate};

pub(super) static SPEC: Spec = Spec {
    name: "errors",
    about: "Make a wrong trajectory from a true one",
    more: "The errors are those that SLAM systems make, of known size. Several are applied in the order of this help. The same \
           seed gives the same errors.",
    after: "Examples:\n  \
            dmp simulate errors truth.tum --drift-ate 1 -o drift.tum\n  \
            dmp simulate errors truth.tum --noise 0.03,0.1deg -o noise.tum\n  \
            dmp simulate errors truth.tum --false-loop 20 --noise 2cm -o both.tum",
    options: &[
        &[&simulate::TRAJECTORY, &simulate::WRONG],
        simulate::ERRORS,
        &[&simulate::NOISE_INTERVAL, &simulate::SEED],
    ],
    extend: |command| {
        let names = simulate::ERRORS.iter().map(|entry| entry.facts().name);
        command.group(ArgGroup::new("error").required(true).multiple(true).args(names))
    },
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let (path, output) = (asked.need(&simulate::TRAJECTORY)?, asked.need(&simulate::WRONG)?);
    let file = read_trajectory(&path)?;
    if !common.quiet {
        for note in &file.notes {
            say!(common.host, "note: {}: {note}", path.display());
        }
    }
    let interval_ns = asked.get(&simulate::NOISE_INTERVAL).unwrap_or(100_000_000);
    let noise =
        asked.get(&simulate::NOISE).map(|(sigma_m, sigma_rad)| Noise { sigma_m, sigma_rad, interval_ns });
    let errors = SlamErrors {
        seed: asked.get(&simulate::SEED).unwrap_or(1),
        scale: asked.get(&simulate::SCALE),
        bend_m: asked.get(&simulate::BEND),
        drift_ate_m: asked.get(&simulate::DRIFT_ATE),
        false_loop_m: asked.get(&simulate::FALSE_LOOP),
        collapse_share: asked.get(&simulate::COLLAPSE),
        noise,
    };
    let wrong = errors.apply(&file.trajectory).map_err(in_words)?;
    save_trajectory(&output, &wrong)?;
    let ate_m = ate_rmse_m(&wrong, &file.trajectory);
    writeln!(out, "{}: {}, ATE {ate_m:.3} m", output.display(), counted(wrong.len() as u64, "pose"))?;
    Ok(Exit::Done)
}
