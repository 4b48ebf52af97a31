//! `dmp info`: what is in a log.

mod found;
mod render;

use crate::console::{Common, Exit, say};
use crate::inputs::{LogInput, Runs};
use crate::options::{Asked, Out, Spec, input, output};

pub(crate) static SPEC: Spec = Spec {
    name: "info",
    about: "Print what is in a log: topics, fields, scans, times, damage",
    more: "Also of a log that cannot be scored without more options: several topics with scans, ambiguous times. With \
           trajectories, also how many of the scans they cover.",
    usage: "dmp info [OPTIONS] LOG [-t [NAME=]RUN.tum ...]",
    after: "Examples:\n  \
            dmp info drive.mcap\n  \
            dmp info drive.mcap --topic /front/points -t runs/*.tum\n  \
            dmp info kitti/07/ --json",
    options: &[
        &[&input::LOG, &input::MORE_RUNS, &input::ANY_RUNS, &input::POSES_AS, &input::BETWEEN],
        input::READING,
        &[&input::LOG_OFFSET, &output::JSON],
    ],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, _: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let started = Runs::start(asked)?;
    let survey = LogInput::of(asked)?.survey()?;
    // Of several streams of scans none is the one whose frame moves.
    let frame = match survey.streams.as_slice() {
        [only] => only.log.as_ref().and_then(|log| log.summary().frame_id.clone()),
        _ => None,
    };
    let trajectories = started.finish_in(&survey.path, frame.as_deref())?;
    let info = found::Info::new(survey, &trajectories, asked.get(&input::LOG_OFFSET).unwrap_or_default());
    if asked.has(&output::JSON) {
        say::json(out, &info)?;
    } else {
        render::info(out, &info)?;
    }
    let damaged = info.is_damaged() || trajectories.iter().any(|run| run.damaged);
    Ok(if damaged { Exit::InputDamaged } else { Exit::Done })
}
