//! One try: a command on a disk that fails, or killed and run again, and what came of it.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{bail, ensure};
use tempfile::TempDir;

use super::calls::Tried;
use super::crash::{Loss, lose};
use super::journal::{self, Operation};
use super::shim::{Mode, Place, Plan, Shim};
use super::verdict::{Failure, Files, Found, OLD, Outcome, Sound, comparable, may_be_old, of_process};
use crate::trials::{End, Ended, Random, folder, paths, run, write};

/// Of so many tries of a command, the last is with kills.
const KILLS_ONE_IN: u64 = 8;
/// At most so many kills come before the command is let finish.
const MOST_KILLS: usize = 3;

/// What became of a try.
#[derive(Debug, Default)]
pub(super) struct Told {
    /// Operations that were made to fail.
    pub(super) injected: u64,
    pub(super) kills: u64,
    pub(super) outcome: Option<Outcome>,
    pub(super) failure: Option<Failure>,
    /// What was done, for whoever repeats it.
    pub(super) steps: Vec<String>,
    pub(super) said: Vec<u8>,
    pub(super) printed: Vec<u8>,
    /// The first operation that failed: its name and path.
    pub(super) at: String,
}

/// What tries the commands.
#[derive(Debug)]
pub(super) struct Breaker {
    dmp: PathBuf,
    shim: Shim,
    calls: Vec<Tried>,
    sound: Vec<Sound>,
    seed: u64,
    ignores_syncs: bool,
    stop: &'static AtomicBool,
}

/// The folder of a try.
struct Bench {
    _folder: TempDir,
    root: PathBuf,
}

impl Bench {
    fn new(tried: &Tried) -> anyhow::Result<Self> {
        let folder = folder()?;
        let root = folder.path().canonicalize()?;
        let bench = Self { _folder: folder, root };
        for inside in ["work", "tmp"] {
            std::fs::create_dir_all(bench.under().join(inside))?;
        }
        write(&tried.files, &bench.under())?;
        Ok(bench)
    }

    fn under(&self) -> PathBuf {
        self.root.join("in")
    }

    /// Something else in the place of each output.
    fn put_old(&self, sound: &Sound) -> std::io::Result<()> {
        let mut outputs = sound.outputs.keys().filter(|output| may_be_old(output));
        outputs.try_for_each(|output| std::fs::write(self.under().join(output), OLD))
    }

    /// What is there, without the empty folders that are always there.
    fn files(&self) -> anyhow::Result<Files> {
        let under = self.under();
        let found = paths(&under).into_iter().filter(|path| path != "work" && path != "tmp");
        let read = |path: String| {
            let is_file = under.join(&path).is_file();
            let bytes = if is_file { std::fs::read(under.join(&path))? } else { Vec::new() };
            Ok((path.clone(), without_times(&path, bytes)))
        };
        found.map(read).collect()
    }
}

impl Breaker {
    /// Runs every command on a disk that works: what it makes must be the same each time.
    pub(super) fn prepare(
        dmp: PathBuf,
        calls: Vec<Tried>,
        (seed, ignores_syncs): (u64, bool),
        stop: &'static AtomicBool,
    ) -> anyhow::Result<Self> {
        let (shim, sound) = (Shim::build()?, Vec::new());
        let mut breaker = Self { dmp, shim, calls, sound, seed, ignores_syncs, stop };
        for tried in &breaker.calls {
            let sound = breaker.sound(tried)?;
            breaker.sound.push(sound);
        }
        Ok(breaker)
    }

    fn sound(&self, tried: &Tried) -> anyhow::Result<Sound> {
        let mut before: Option<Sound> = None;
        let mut operations = 0;
        // The second time what changes nothing is not counted.
        for mode in [Mode::None, Mode::Kill] {
            let bench = Bench::new(tried)?;
            let plan = Plan { mode, at: u64::MAX, draw: 0 };
            let (ended, log) = self.run(&tried.words, &bench, plan)?;
            let said = String::from_utf8_lossy(&ended.said);
            ensure!(ended.end == End::Exit(0), "{}: {:?}: {said}", tried.name, ended.end);
            let inputs = inputs(tried);
            let mut outputs = bench.files()?;
            outputs.retain(|path, _| !inputs.contains_key(path));
            let changes = log.last().map_or(0, |operation| operation.number);
            if mode == Mode::None {
                operations = changes;
            }
            let printed = comparable(&ended.printed);
            let sound = Sound { printed, outputs, operations, changes, takes_places: true };
            if let Some(before) = before {
                for (path, bytes) in &sound.outputs {
                    ensure!(before.outputs.get(path) == Some(bytes), "{}: {path} differs", tried.name);
                }
                ensure!(before.printed == sound.printed, "{}: what is printed differs", tried.name);
            }
            before = Some(sound);
        }
        let Some(mut sound) = before else { bail!("{}: it was not run", tried.name) };
        // Some commands take no place that is taken.
        let bench = Bench::new(tried)?;
        bench.put_old(&sound)?;
        sound.takes_places = self.run(&tried.words, &bench, Plan::NOTHING)?.0.end == End::Exit(0);
        Ok(sound)
    }

    pub(super) fn calls(&self) -> &[Tried] {
        &self.calls
    }

    /// How many operations a command has on a disk that works.
    pub(super) fn operations(&self, call: usize) -> u64 {
        self.sound[call].operations
    }

    /// The try of this number of a command; nothing where it was interrupted.
    pub(super) fn attempt(&self, call: usize, number: u64) -> anyhow::Result<Option<Told>> {
        let (tried, sound) = (&self.calls[call], &self.sound[call]);
        let name = tried.name.bytes().fold(0_u64, |hash, byte| hash.wrapping_mul(257) + u64::from(byte));
        let mut random = Random::of(&[self.seed, name, number]);
        let is_killed = number % KILLS_ONE_IN == KILLS_ONE_IN - 1;
        let mut told = Told::default();
        let bench = Bench::new(tried)?;
        let had_old = random.once_in(2) && (sound.takes_places || !is_killed);
        if had_old {
            bench.put_old(sound)?;
        }
        let one = One { breaker: self, tried, sound, inputs: inputs(tried), bench, had_old };
        let result = if is_killed {
            one.kill(number / KILLS_ONE_IN, &mut random, &mut told)?
        } else {
            one.fail(number - number / KILLS_ONE_IN, &mut random, &mut told)?
        };
        match result {
            Ok(outcome) => told.outcome = Some(outcome),
            Err(failure) => told.failure = Some(failure),
        }
        Ok((!self.stop.load(Ordering::Relaxed)).then_some(told))
    }

    fn run(&self, words: &[String], bench: &Bench, plan: Plan) -> anyhow::Result<(Ended, Vec<Operation>)> {
        let (log, keep) = (bench.root.join("log"), bench.root.join("keep"));
        let _ = std::fs::remove_file(&log);
        let _ = std::fs::remove_dir_all(&keep);
        if plan.mode == Mode::Kill {
            std::fs::create_dir(&keep)?;
        }
        let under = bench.under();
        let place = Place { under: &under, log: &log, keep: &keep };
        let mut ended = run(&self.dmp, words, &under, &bench.root, &self.shim.surroundings(&place, plan))?;
        // Some of what is printed names whole paths.
        if let (Ok(printed), Some(root)) = (std::str::from_utf8(&ended.printed), bench.root.to_str()) {
            ended.printed = printed.replace(root, "").into_bytes();
        }
        Ok((ended, journal::read(&log)?))
    }
}

fn inputs(tried: &Tried) -> Files {
    tried.files.iter().map(|file| (file.path.clone(), file.bytes.clone())).collect()
}

/// One command in one folder.
struct One<'a> {
    breaker: &'a Breaker,
    tried: &'a Tried,
    sound: &'a Sound,
    inputs: Files,
    bench: Bench,
    had_old: bool,
}

impl One<'_> {
    /// A disk that fails at one operation, or from there on.
    fn fail(&self, k: u64, random: &mut Random, told: &mut Told) -> anyhow::Result<Result<Outcome, Failure>> {
        let mode = match random.below(8) {
            0 => Mode::Full,
            1 => Mode::Broken,
            _ => Mode::Once,
        };
        let plan = Plan { mode, at: spread(k, self.sound.operations), draw: random.next() % 60 };
        let (ended, log) = self.run(&self.tried.words, plan, told)?;
        let injected: Vec<Operation> =
            log.into_iter().filter(|operation| operation.fault.is_some()).collect();
        told.injected = injected.len() as u64;
        if let Some(Operation { name, path, fault, .. }) = injected.first() {
            told.at = format!(
                "{name} {} {fault:?}",
                path.strip_prefix(self.bench.under()).unwrap_or(path).display()
            );
        }
        let is_place_taken = self.had_old && !self.sound.takes_places;
        let outcome = match of_process(&ended, self.sound, &injected, &self.bench.under(), self.may_tell()) {
            // It is there already.
            Err(Failure::Code(2) | Failure::NoFault(_) | Failure::NoReason(_)) if is_place_taken => {
                Outcome::Refused
            }
            Ok(outcome) => outcome,
            Err(failure) => return Ok(Err(failure)),
        };
        // What could not be looked at or removed stays until the next one.
        let looks = ["unlink", "rmdir", "list", "next", "open", "stat", "lock"];
        let could_not_remove =
            mode == Mode::Broken || injected.iter().any(|operation| looks.contains(&operation.name.as_str()));
        let is_kept = |path: &str| {
            could_not_remove
                || self.tried.keeps_work() && outcome == Outcome::Refused && path.starts_with("work/")
        };
        let files = self.bench.files()?;
        let found = self.found(&files);
        let checked = found
            .names()
            .and_then(|()| found.nothing_left(is_kept))
            .and_then(|()| if outcome == Outcome::Same { found.outputs() } else { Ok(()) });
        if let Err(failure) = checked {
            return Ok(Err(failure));
        }
        if is_place_taken {
            let was_taken = Failure::OldGone("a place that was taken".into());
            return Ok(if outcome == Outcome::Same { Err(was_taken) } else { Ok(outcome) });
        }
        let is_clean = found.nothing_left(|_| false).is_ok();
        if is_clean && !random.once_in(4) {
            return Ok(Ok(outcome));
        }
        Ok(self.finish(told)?.map(|_| outcome))
    }

    /// Kills, each with what it loses, and then a disk that works.
    fn kill(&self, k: u64, random: &mut Random, told: &mut Told) -> anyhow::Result<Result<Outcome, Failure>> {
        for kill in 0..=random.below(MOST_KILLS) {
            let at = if kill == 0 {
                spread(k, self.sound.changes)
            } else {
                1 + random.next() % self.sound.changes.max(1)
            };
            let plan = Plan { mode: Mode::Kill, at, draw: random.next() % 60 };
            let words = if kill == 0 { self.tried.words.clone() } else { self.tried.again() };
            let (ended, mut log) = self.run(&words, plan, told)?;
            log.retain(|operation| !self.breaker.ignores_syncs || operation.name != "sync");
            match ended.end {
                End::Signal(9) => told.kills += 1,
                // It had less to do.
                End::Exit(0 | 1) => {}
                _ => {
                    let failure = of_process(&ended, self.sound, &[], &self.bench.under(), false);
                    return Ok(failure);
                }
            }
            let loss = *random.pick(&Loss::ALL);
            if ended.end == End::Signal(9) {
                told.steps.push(format!("lost: {loss:?}"));
                lose(loss, &log, &self.bench.under(), random)?;
                told.at =
                    log.last().map_or_else(String::new, |operation| format!("kill after {}", operation.name));
            }
            let files = self.bench.files()?;
            if let Err(failure) = self.found(&files).names() {
                return Ok(Err(failure));
            }
        }
        self.finish(told)
    }

    /// On a disk that works, the command ends with the same bits, and nothing is left; or it refuses with a line what was
    /// kept, and does so without.
    fn finish(&self, told: &mut Told) -> anyhow::Result<Result<Outcome, Failure>> {
        let mut outcome = Outcome::Same;
        for words in [self.tried.again(), self.tried.words.clone()] {
            let (ended, _) = self.run(&words, Plan::NOTHING, told)?;
            let files = self.bench.files()?;
            let found = self.found(&files);
            if let Err(failure) = found.names() {
                return Ok(Err(failure));
            }
            let said = String::from_utf8_lossy(&ended.said);
            let first = said.lines().next().unwrap_or_default().to_owned();
            match ended.end {
                End::Exit(0) if comparable(&ended.printed) == self.sound.printed => {
                    let checked = found.outputs().and_then(|()| found.nothing_left(|_| false));
                    return Ok(checked.map(|()| outcome));
                }
                End::Exit(0) => return Ok(Err(Failure::OtherBits)),
                // What is there already, and whole.
                End::Exit(1 | 2) if first.contains("already") && found.outputs().is_ok() => {
                    return Ok(found.nothing_left(|_| false).map(|()| Outcome::Refused));
                }
                End::Exit(1) if !first.is_empty() => outcome = Outcome::Refused,
                _ => return Ok(Err(Failure::NotAgain(format!("{:?}: {first}", ended.end)))),
            }
            told.steps.push(first);
        }
        Ok(Err(Failure::NotAgain(told.steps.last().cloned().unwrap_or_default())))
    }

    fn may_tell(&self) -> bool {
        self.tried.words[0] == "info"
    }

    fn found<'a>(&'a self, files: &'a Files) -> Found<'a> {
        Found { files, inputs: &self.inputs, sound: self.sound, had_old: self.had_old }
    }

    fn run(&self, words: &[String], plan: Plan, told: &mut Told) -> anyhow::Result<(Ended, Vec<Operation>)> {
        let (ended, log) = self.breaker.run(words, &self.bench, plan)?;
        let Plan { mode, at, draw } = plan;
        told.said.clone_from(&ended.said);
        told.printed.clone_from(&ended.printed);
        told.steps.push(format!("{mode:?} at {at}, {draw}: dmp {}: {:?}", words.join(" "), ended.end));
        Ok((ended, log))
    }
}

/// An output without how long its making took, and in how much memory.
fn without_times(path: &str, bytes: Vec<u8>) -> Vec<u8> {
    let (begins, ends) = match path.rsplit('.').next() {
        Some("xml") => ("time=\"", '"'),
        Some("html") => ("<dd>", '<'),
        _ => return bytes,
    };
    let text = String::from_utf8_lossy(&bytes);
    let mut parts = text.split(begins);
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let value = part.split(ends).next().unwrap_or_default();
        let differs = ends == '"' || value.contains(" s on ") || value.contains("iB of ");
        kept += begins;
        kept += if differs { &part[value.len()..] } else { part };
    }
    kept.into_bytes()
}

/// The numbers from 1 to `n`, each once before any comes again, far from each other.
fn spread(k: u64, n: u64) -> u64 {
    let n = n.max(1);
    let mut step = (n as f64 * 0.618_034) as u64 + 1;
    while gcd(step, n) != 1 {
        step += 1;
    }
    1 + (k % n).wrapping_mul(step) % n
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operation_has_its_turn() {
        for n in [1, 2, 3, 10, 97, 100] {
            let mut found: Vec<u64> = (0..n).map(|k| spread(k, n)).collect();
            found.sort_unstable();
            assert_eq!(found, (1..=n).collect::<Vec<_>>());
        }
    }
}
