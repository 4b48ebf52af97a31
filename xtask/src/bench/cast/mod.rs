//! The caster: how fast and how exact it is, beside others on the same work.

mod agreement;
mod arguments;
mod bands;
mod exact;
mod files;
mod own;
mod peers;
mod records;
pub(super) mod scene;
pub(crate) mod serve;
mod speeds;

use std::path::PathBuf;

use anyhow::ensure;
use dmp_cast::Path;

pub(crate) use self::arguments::CastArgs;
use self::exact::Exact;
use self::files::{Files, Work};
use self::own::Own;
use self::records::write_numbers;
use self::speeds::Casters;
use crate::bench::times::circumstances;

pub(crate) fn run(arguments: &CastArgs) -> anyhow::Result<()> {
    if !arguments.only_files {
        println!(
            "one thread on core {}, {} casts in each mode, in turns; {}",
            arguments.core,
            arguments.runs,
            circumstances()
        );
    }
    if let (Some(surfels), Some(rays)) = (&arguments.surfels, &arguments.rays) {
        let segments = arguments.support.clone().zip(arguments.segments.clone()).map(<[PathBuf; 2]>::from);
        let name = surfels.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        return measure(arguments, &Files { name, surfels: surfels.clone(), rays: rays.clone(), segments });
    }
    let kept_nowhere = tempfile::tempdir_in("/var/tmp")?;
    let folder = arguments.folder.as_deref().unwrap_or(kept_nowhere.path());
    for files in scene::files(&arguments.making, folder, &arguments.scenes)? {
        if !arguments.only_files {
            measure(arguments, &files)?;
        }
    }
    Ok(())
}

fn measure(arguments: &CastArgs, files: &Files) -> anyhow::Result<()> {
    let work = Work::read(files)?;
    let (surfels, rays) = (work.surfels.len(), work.rays.len());
    println!("\n{}: {surfels} surfels, {rays} rays{}", files.name, told_changes(&work));
    let folder = tempfile::tempdir_in("/var/tmp")?;
    let mut files = files.clone();
    if work.scaled > 0 || work.origin_m != [0.0; 3] {
        // Others take numbers as they are.
        [files.surfels, files.rays] = ["surfels", "rays"].map(|name| folder.path().join(name));
        work.write(&files)?;
    }
    let mut own = Own::new(Work::read(&files)?)?;
    if let Some(path) = &arguments.ranges {
        let mode = format!("{}-packets", Path::best().name()).parse()?;
        let [first_m, ..] = own.ranges(mode)?;
        let hits = first_m.iter().filter(|range| !range.is_nan()).count();
        write_numbers(path, first_m.iter().map(|&range_m| (range_m as f32).to_le_bytes()))?;
        println!("{}: {hits} ranges, {} misses", path.display(), rays - hits);
    }
    let mut casters = Casters::start(arguments, &files);
    ensure!(
        !casters.rows.is_empty(),
        "{}: no caster has {:?} in its name or modes",
        files.name,
        arguments.only
    );
    if arguments.only.is_empty() {
        match Exact::of(&files) {
            Ok(exact) => agreement::print(&mut own, &work, &mut casters, &exact)?,
            Err(error) => println!("{}: without exact ranges: {error:#}", files.name),
        }
    }
    drop(own);
    println!();
    casters.measure(arguments.runs)?;
    casters.print();
    if arguments.only.is_empty() {
        println!();
        casters.print_ratios(surfels as u64)?;
        speeds::print_two_threads(&files, arguments.runs)?;
        println!();
        speeds::print_limits(&files, arguments.core, arguments.runs, rays as u64)?;
        println!();
        bands::print(&mut casters, &work, arguments.runs)?;
    }
    Ok(())
}

/// What was done to the numbers of the files before anything was cast.
fn told_changes(work: &Work) -> String {
    let scaled = format!("; {} of their vectors brought to length one", work.scaled);
    let moved = format!("; {:?} m subtracted from every place, exactly", work.origin_m);
    let changes = [(scaled, work.scaled > 0), (moved, work.origin_m != [0.0; 3])];
    changes.into_iter().filter(|(_, is_done)| *is_done).map(|(told, _)| told).collect()
}
