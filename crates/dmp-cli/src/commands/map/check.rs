//! `dmp map check`: how good one map is, alone.

use std::io::Write as _;

use dmp::{check_cloud, check_store};
use dmp_draw::{map_check, map_check_page, not_in_a_cloud};
use dmp_log::is_mesh;
use dmp_map::{MapError, Store};

use crate::commands::score::outputs::targets::writable;
use crate::console::{Common, Exit, Progress, Usage, say, tell};
use crate::files::save_text;
use crate::options::{Asked, Out, Spec, output, scoring, tools};

pub(super) static SPEC: Spec = Spec {
    name: "check",
    about: "Say how good one cloud is, without a log: thickness of surfaces, double layers, density, holes; of a store, its holes",
    more: "Thickness is the RMS distance of points from the flat surfaces they lie on: noise of the sensor, errors of the poses, \
           and what is not flat. Of a run it is a column of `dmp score`.",
    after: "Examples:\n  \
            dmp map check survey.laz\n  \
            dmp map check survey.laz --report survey.html\n  \
            dmp map check room.ply --voxel 0.1",
    options: &[
        &[&tools::CLOUD, &scoring::MAP_UNIT, &scoring::VOXEL],
        scoring::MEANS,
        &[&output::JSON, &tools::CHECK_REPORT],
    ],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let config = asked.config();
    config.check()?;
    let (cloud, page) = (asked.need(&tools::CLOUD)?, asked.get(&tools::CHECK_REPORT));
    page.as_deref().map_or(Ok(()), writable)?;
    let is_store = !matches!(Store::open(&cloud), Err(MapError::NotAStore { .. } | MapError::Disk(_)));
    let found = if is_store {
        check_store(&cloud)?
    } else if is_mesh(&cloud)? {
        let problem = "a mesh has surfaces without thickness: check the cloud it was made of";
        return Err(Usage(format!("{}: {problem}", cloud.display())).into());
    } else {
        check_cloud(&cloud, &config, &Progress::new(common))?
    };
    if let Some(page) = page {
        save_text(&page, &map_check_page(&found, env!("CARGO_PKG_VERSION"))?)?;
    }
    if asked.has(&output::JSON) {
        say::json(out, &found)?;
        return Ok(Exit::Done);
    }
    tell!(out, "{}", found.path)?;
    for (what, lines) in map_check(&found) {
        for (number, line) in lines.iter().enumerate() {
            writeln!(out, "{:13}  {line}", if number == 0 { what } else { "" })?;
        }
    }
    writeln!(out)?;
    tell!(out, "{}", not_in_a_cloud(&found))?;
    Ok(Exit::Done)
}
