//! `dmp truth smd`: how far maps lie from a reference surface.

mod args;
mod maps;
mod render;
mod result;

use std::io::Write;
use std::time::Instant;

use crate::common::Common;
use crate::exit::Exit;
use crate::progress::Progress;
pub(crate) use args::SmdArgs;

pub(crate) fn run(arguments: &SmdArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let start = Instant::now();
    let config = arguments.config();
    config.check()?;
    let settings = arguments.settings(&config);
    settings.check()?;
    let progress = Progress::new(common);
    let measured = maps::measure(arguments, &config, &settings, &progress, common)?;
    drop(progress);
    let result = result::SmdResult::new(arguments, &settings, &measured, start.elapsed().as_secs_f64());
    if arguments.json {
        serde_json::to_writer_pretty(&mut *out, &result).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        render::result(out, &result)?;
    }
    Ok(if measured.damaged { Exit::InputDamaged } else { Exit::Done })
}
