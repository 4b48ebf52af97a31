//! `dmp drift`: how far runs are off at revisits, by the surfaces that both visits see.

pub(crate) mod render;

use anyhow::bail;
use dmp::{Config, DriftPairs, MapSource, measure_drift};
use dmp_log::write_pose_edges;

use crate::console::{Common, Exit, Progress, Usage, say, when_printed};
use crate::files::save;
use crate::inputs::{LogInput, OpenedRuns, Runs, vetting};
use crate::options::{Asked, Out, Spec, graph, input, output, scoring};

pub(crate) static SPEC: Spec = Spec {
    name: "drift",
    about: "Measure in metres how far runs are off at revisits",
    more: "Where a run visits a place twice, the scans of both visits are registered by the surfaces that both see. The \
           registration is what the run is off by between the visits. Every run is measured at the same places. No ground \
           truth is needed. A drive without revisits has no result.",
    usage: "dmp drift [OPTIONS] LOG -t [NAME=]RUN.tum [-t [NAME=]RUN2.tum ...]",
    after: "Examples:\n  \
            dmp drift drive.mcap -t run.tum\n  \
            dmp drift drive.mcap -t kiss=kiss_poses.npy -t lio=lio.tum -v\n  \
            dmp drift city.mcap -t run.tum --pairs 50\n  \
            dmp drift drive.mcap -t lost.tum --far\n  \
            dmp drift drive.mcap -t run.tum -o constraints.g2o\n  \
            dmp drift drive.mcap -t run.tum --json > drift.json\n\n\
            Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was \
            excluded.",
    options: &[
        input::RUNS_ON_LOG,
        scoring::RANGES,
        input::CHECKS,
        &[&graph::PAIRS, &graph::FAR],
        scoring::MEANS,
        &[&graph::CONSTRAINTS, &output::JSON, &graph::VISITS],
    ],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let started = Runs::start_some(asked)?;
    let constraints = asked.get(&graph::CONSTRAINTS);
    if constraints.is_some() && started.names().len() > 1 {
        let runs = started.names().len();
        bail!(Usage(format!("-o: constraints are those of one run, not of {runs}: give one -t")));
    }
    // All pairs, where it is not said.
    let config = Config { drift: asked.get(&graph::PAIRS).unwrap_or(DriftPairs::All), ..asked.config() };
    config.check()?;
    let log = LogInput::of(asked)?;
    let fused = std::iter::repeat(MapSource::Fused);
    let opened = OpenedRuns::open(started, fused, &log, asked, config.threads, common)?;
    let (opened, vetted) = vetting::checked(opened, &log, asked, &config, common)?;
    let OpenedRuns { log, runs, damaged, .. } = opened;
    let watch = Progress::new(common);
    let report = measure_drift(log.as_ref(), &runs, &config, &watch)?;
    drop(watch);
    if let (Some(path), [run]) = (&constraints, runs.as_slice()) {
        let body_from_sensor = run.body_from_sensor.unwrap_or(config.body_from_sensor);
        let edges = report.runs[0].constraints(&body_from_sensor);
        save(path, |out| write_pose_edges(out, &edges))?;
    }
    let excluded = vetted.is_some_and(|vetted| vetted.is_kept().contains(&false));
    let exit = if damaged || excluded { Exit::InputDamaged } else { Exit::Done };
    let printed = if asked.has(&output::JSON) {
        say::json(out, &report)
    } else {
        render::report(out, &report, config.scales_on(log.summary()), asked.has(&graph::VISITS))
    };
    when_printed(printed.map_err(Into::into), exit)
}
