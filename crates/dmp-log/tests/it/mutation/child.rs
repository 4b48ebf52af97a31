use super::formats::{self, Checksums, Format};
use super::mutator::mutate;
use super::readers::{Answer, read};
use crate::common::Random;
use dmp_sensor::Scan;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind, set_hook};
use std::sync::{Arc, Mutex};

/// Damaged files of each format.
const RUNS: u64 = 2000;

/// Reads the damaged files of a format, or that of one run. Says before each which one it is.
pub(super) fn read_all(name: &str, only: Option<u64>) {
    // A panic is told below, with the run that it came in.
    let last = Arc::new(Mutex::new(String::new()));
    let told = Arc::clone(&last);
    set_hook(Box::new(move |panic| *told.lock().unwrap() = panic.to_string()));
    let done = catch_unwind(AssertUnwindSafe(|| runs(name, only)));
    if let Err(panic) = done {
        eprintln!("{}", last.lock().unwrap());
        resume_unwind(panic);
    }
}

fn runs(name: &str, only: Option<u64>) {
    let format = formats::named(name);
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    format.prepare(folder);
    println!();
    let mut good = Vec::new();
    for (number, seed) in format.seeds.iter().enumerate() {
        println!("run on good file {number}");
        // Without times: what they mean may be left open.
        let answer = read(&format, folder, seed, 1);
        assert!(answer.refused.is_none(), "the good file {number} is refused: {:?}", answer.refused);
        good.extend(answer.scans);
    }
    let (mut whole, mut refused, mut scans) = (0, 0, 0);
    for run in 0..RUNS {
        if only.is_some_and(|only| only != run) {
            continue;
        }
        println!("run {run}");
        let answer = read(&format, folder, &damaged(&format, run), run);
        compare(&format, &answer, &good);
        scans += answer.scans.len();
        *(if answer.refused.is_some() { &mut refused } else { &mut whole }) += 1;
        if only.is_some() {
            println!("{answer:?}");
        }
    }
    let peak = fs::read_to_string("/proc/self/status").unwrap();
    let peak = peak.lines().find(|line| line.starts_with("VmPeak")).unwrap_or_default();
    println!("counted: {whole} read, {refused} refused in part or whole, {scans} scans, {peak}");
    // Damage that does nothing, or leaves nothing, finds nothing.
    assert!(only.is_some() || (whole > 0 && refused >= RUNS / 50));
}

fn damaged(format: &Format, run: u64) -> Vec<u8> {
    let name = format.name.bytes().fold(0_u64, |sum, c| sum.wrapping_mul(31).wrapping_add(c.into()));
    let mut random = Random(name.wrapping_add(run << 32));
    let mut pick = || &format.seeds[(random.next() % format.seeds.len() as u64) as usize];
    let (seed, other) = (pick(), pick());
    mutate(seed, other, &mut random)
}

/// Whole scans, and, where checksums cover them, those that were written.
fn compare(format: &Format, answer: &Answer, good: &[Scan]) {
    let promised = match format.checksums {
        Checksums::None => false,
        Checksums::OrDamage => answer.refused.is_none(),
        Checksums::Always => true,
    };
    for scan in &answer.scans {
        assert!(scan.time_offsets_ns.is_empty() || scan.time_offsets_ns.len() == scan.len());
        if promised {
            let same = |good: &Scan| {
                let bits = |scan: &Scan| -> Vec<u32> {
                    scan.points_in_sensor_m.as_flattened().iter().map(|c| c.to_bits()).collect()
                };
                good.stamp_ns == scan.stamp_ns && bits(good) == bits(scan)
            };
            assert!(good.iter().any(same), "it is no scan of the good files");
        }
    }
}
