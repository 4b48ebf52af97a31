//! `dmp truth smd`: how far maps lie from a reference surface.

mod maps;
mod render;
mod result;

use std::time::Instant;

use dmp::Config;
use dmp_truth::surface::SurfaceSettings;

use crate::console::{Common, Exit, Progress, say};
use crate::options::{Asked, Out, Spec, input, output, scoring, truth};

pub(super) static SPEC: Spec = Spec {
    name: "smd",
    about: "Surface distance of a map from a reference mesh or cloud",
    more: "Measures from every point of the map to the nearest point of the reference (accuracy; its mean is the surface mean \
           distance) and from the reference to the nearest point of the map (completeness). What the map never saw counts as \
           incomplete; see --crop. Both may be larger than memory; the vertices of a mesh are held in it.",
    usage: "dmp truth smd [OPTIONS] REFERENCE MAP\n       dmp truth smd [OPTIONS] REFERENCE LOG -t [NAME=]RUN.tum ...",
    after: "Examples:\n  \
            dmp truth smd survey.ply map.laz\n  \
            dmp truth smd survey.laz run.dmpmap --thin 0.05 --crop --json\n  \
            dmp truth smd survey.laz map.ply --align truth.tum run.tum\n  \
            dmp truth smd town.obj drive.mcap -t runs/a.tum -t runs/b.tum --align truth.tum",
    options: &[
        truth::SURFACES,
        &[
            &input::MORE_RUNS,
            &input::TOPIC,
            &input::POINT_TIME,
            &input::BIN_LAYOUT,
            &input::EVERY,
            &input::EXTRINSIC,
            &scoring::VOXEL,
        ],
        scoring::MEANS,
        &[&output::JSON],
    ],
    run,
    ..Spec::EMPTY
};

fn settings(asked: &Asked, config: &Config) -> SurfaceSettings {
    let usual = SurfaceSettings::default();
    let cap_m = asked.get(&truth::CAP).unwrap_or(usual.cap_m);
    let within_cap = || usual.thresholds_m.iter().copied().filter(|&t| t <= cap_m).collect();
    SurfaceSettings {
        cap_m,
        thresholds_m: asked.get(&truth::THRESHOLDS).unwrap_or_else(within_cap),
        thin_m: asked.get(&truth::THIN),
        crop: asked.has(&truth::CROP),
        spacing_m: asked.get(&truth::SPACING).unwrap_or(usual.spacing_m),
        memory_bytes: config.memory_bytes,
        threads: config.threads,
        work_folder: config.work_folder.clone(),
        ..usual
    }
}

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let start = Instant::now();
    let config = asked.config();
    config.check()?;
    let settings = settings(asked, &config);
    settings.check()?;
    let progress = Progress::new(common);
    let measured = maps::measure(asked, &config, &settings, &progress, common)?;
    drop(progress);
    let result = result::SmdResult::new(asked, &settings, &measured, start.elapsed().as_secs_f64());
    if asked.has(&output::JSON) {
        say::json(out, &result)?;
    } else {
        render::result(out, &result)?;
    }
    Ok(if measured.damaged { Exit::InputDamaged } else { Exit::Done })
}
