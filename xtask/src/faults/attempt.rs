//! The tries: which command meets which fault, or is killed where.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{bail, ensure};

use super::bench::{Bench, Runner, inputs};
use super::calls::Tried;
use super::one::{One, Steps};
use super::shim::{Mode, Plan, Shim};
use super::verdict::{Ending, Sound, comparable};
use crate::trials::{End, Outcome, numbers};

/// Of so many tries of a command, the last is with kills.
const KILLS_ONE_IN: u64 = 8;

/// What tries the commands.
#[derive(Debug)]
pub(super) struct Breaker {
    runner: Runner,
    calls: Vec<Tried>,
    sound: Vec<Sound>,
    seed: u64,
    ignores_syncs: bool,
    stop: &'static AtomicBool,
}

impl Breaker {
    /// Runs every command on a disk that works: what it makes must be the same each time.
    pub(super) fn prepare(
        dmp: PathBuf,
        calls: Vec<Tried>,
        (seed, ignores_syncs): (u64, bool),
        stop: &'static AtomicBool,
    ) -> anyhow::Result<Self> {
        let (runner, sound) = (Runner { dmp, shim: Shim::build()? }, Vec::new());
        let mut breaker = Self { runner, calls, sound, seed, ignores_syncs, stop };
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
            let (ended, log) = self.runner.run(&tried.words, &bench, plan)?;
            let stderr = String::from_utf8_lossy(&ended.stderr);
            ensure!(ended.end == End::Exit(0), "{}: {:?}: {stderr}", tried.name, ended.end);
            let inputs = inputs(tried);
            let mut outputs = bench.files()?;
            outputs.retain(|path, _| !inputs.contains_key(path));
            let changes = log.last().map_or(0, |operation| operation.number);
            if mode == Mode::None {
                operations = changes;
            }
            let stdout = comparable(&ended.stdout);
            let sound = Sound { stdout, outputs, operations, changes, takes_places: true };
            if let Some(before) = before {
                for (path, bytes) in &sound.outputs {
                    ensure!(before.outputs.get(path) == Some(bytes), "{}: {path} differs", tried.name);
                }
                ensure!(before.stdout == sound.stdout, "{}: the printed text differs", tried.name);
            }
            before = Some(sound);
        }
        let Some(mut sound) = before else { bail!("{}: it was not run", tried.name) };
        // Some commands take no place that is taken.
        let bench = Bench::new(tried)?;
        bench.put_old(&sound)?;
        sound.takes_places = self.runner.run(&tried.words, &bench, Plan::NOTHING)?.0.end == End::Exit(0);
        Ok(sound)
    }

    pub(super) fn calls(&self) -> usize {
        self.calls.len()
    }

    /// The rows of the table, and how many operations each command has on a disk that works.
    pub(super) fn operations(&self) -> impl Iterator<Item = (String, u64)> {
        self.calls.iter().zip(&self.sound).map(|(tried, sound)| (row(tried.name), sound.operations))
    }

    /// The try of this number of a command; nothing where it was interrupted.
    pub(super) fn attempt(&self, call: usize, number: u64) -> anyhow::Result<Option<Outcome>> {
        let (tried, sound) = (&self.calls[call], &self.sound[call]);
        let mut random = numbers(self.seed, tried.name, number);
        let is_killed = number % KILLS_ONE_IN == KILLS_ONE_IN - 1;
        let mut steps = Steps::default();
        let bench = Bench::new(tried)?;
        let had_old = random.once_in(2) && (sound.takes_places || !is_killed);
        if had_old {
            bench.put_old(sound)?;
        }
        let (runner, ignores_syncs, inputs) = (&self.runner, self.ignores_syncs, inputs(tried));
        let one = One { runner, ignores_syncs, tried, sound, inputs, bench, had_old };
        let result = if is_killed {
            one.kill(number / KILLS_ONE_IN, &mut random, &mut steps)?
        } else {
            one.fail(number - number / KILLS_ONE_IN, &mut random, &mut steps)?
        };
        let counts = [0, u64::from(steps.injected > 0), steps.kills]
            .into_iter()
            .chain([Ending::Same, Ending::Refused].map(|ending| u64::from(result == Ok(ending))));
        let text = format!("{}\n{}\n", steps.at, steps.lines.join("\n"));
        let files = [("steps.txt", text.into_bytes()), ("stdout", steps.stdout), ("stderr", steps.stderr)];
        let outcome = Outcome {
            row: row(tried.name),
            counts: counts.collect(),
            failure: result.err(),
            hint: steps.at,
            again: format!(
                "cargo xtask faults --only '{}' --seed {} --first {number} --tries 1",
                tried.name, self.seed
            ),
            name: format!("{}-{}-{number}", tried.name, self.seed),
            files: files.map(|(name, bytes)| (name.to_owned(), bytes)).into(),
        };
        Ok((!self.stop.load(Ordering::Relaxed)).then_some(outcome))
    }
}

/// What stands behind a comma says more of the command.
fn row(name: &str) -> String {
    name.split_once(", ")
        .map_or_else(|| format!("`dmp {name}`"), |(command, more)| format!("`dmp {command}`, {more}"))
}
