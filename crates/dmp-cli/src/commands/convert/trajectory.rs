//! `dmp convert trajectory`: a trajectory in another format.

use std::io::Write as _;

use anyhow::Context as _;
use dmp_draw::text::counted;
use dmp_log::{read_trajectory_as, write_euroc, write_kitti, write_redwood_log, write_times, write_tum};

use crate::console::{Common, Exit, Usage, say};
use crate::files::{SavedTogether, is_same_place, may_be_file};
use crate::options::tools::RunFormat;
use crate::options::values::Poses;
use crate::options::{Asked, Out, Spec, input, tools};

pub(super) static SPEC: Spec = Spec {
    name: "trajectory",
    about: "Write a trajectory in another format",
    more: "Poses are written in order of time, repeated ones once.",
    usage: "dmp convert trajectory [OPTIONS] RUN -o OUTPUT --to FORMAT",
    after: "Example:\n  dmp convert trajectory kiss_poses.npy -o kiss.txt --to kitti",
    options: &[&[&tools::CONVERTED_RUN, &input::FILE_AS, &tools::RUN_OUTPUT, &tools::RUN_FORMAT]],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let (run, output) = (asked.need(&tools::CONVERTED_RUN)?, asked.need(&tools::RUN_OUTPUT)?);
    let to = asked.need(&tools::RUN_FORMAT)?;
    let (mut format, mut unit, mut poses_as) = (None, None, Vec::new());
    for poses in asked.all(&input::FILE_AS) {
        match poses {
            Poses::Format(given) => format = Some(given),
            Poses::Stamps(given) => unit = Some(given),
            Poses::As(given) => poses_as.push(given),
        }
    }
    let file = read_trajectory_as(&run, format, unit)?;
    if !common.quiet {
        let counts = [
            ("were sorted by their stamps", file.out_of_order),
            ("are there twice, written once", file.repeated),
        ];
        for (what, count) in counts.into_iter().filter(|(_, count)| *count > 0) {
            say!(common.host, "note: {}: {} {what}", run.display(), counted(count as u64, "pose"));
        }
        file.notes.iter().for_each(|note| say!(common.host, "note: {}: {note}", run.display()));
    }
    let mut trajectory = file.trajectory;
    for poses in poses_as {
        let read = poses.read(&trajectory);
        trajectory = read.with_context(|| format!("{}: its poses cannot be {poses}", run.display()))?;
    }
    let without_stamps = matches!(to, RunFormat::Kitti | RunFormat::Redwood);
    if trajectory.stamps_ns().is_none() && !without_stamps {
        let problem = "its poses have no stamps: they can only be written as KITTI rows or Redwood blocks";
        return Err(Usage(format!("{}: {problem}", run.display())).into());
    }
    let times = output.with_file_name("times.txt");
    // Beside a pipe or a device nothing is made.
    let stamps_ns = trajectory.stamps_ns().filter(|_| without_stamps && may_be_file(&output));
    if stamps_ns.is_some() && is_same_place(&times, &output) {
        let problem = "the output and its stamps would have this name";
        return Err(Usage(format!("{}: {problem}", times.display())).into());
    }
    let mut files = SavedTogether::default();
    files.add(&output, |out| match to {
        RunFormat::Tum => write_tum(out, &trajectory),
        RunFormat::Kitti => write_kitti(out, &trajectory),
        RunFormat::Euroc => write_euroc(out, &trajectory),
        RunFormat::Redwood => write_redwood_log(out, &trajectory),
    })?;
    if let Some(stamps_ns) = stamps_ns {
        files.add_unnamed(&times, |out| write_times(out, stamps_ns))?;
    }
    files.commit()?;
    writeln!(out, "{}: {}", output.display(), counted(trajectory.len() as u64, "pose"))?;
    if stamps_ns.is_some() {
        writeln!(out, "{}: their stamps", times.display())?;
    }
    Ok(Exit::Done)
}
