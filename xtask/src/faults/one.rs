//! A command in a folder: on a disk that fails, or killed and run again, and what came of it.

use super::bench::{Bench, Runner};
use super::calls::Tried;
use super::crash::{Loss, lose};
use super::journal::Operation;
use super::shim::{Mode, Plan};
use super::verdict::{Ending, Files, Found, Sound, comparable, of_process};
use crate::trials::{End, Ended, Failure, Random};

/// At most so many kills come before the command may finish.
const MOST_KILLS: usize = 3;

/// What was done in a try, for whoever repeats it.
#[derive(Debug, Default)]
pub(super) struct Steps {
    /// Operations that were made to fail.
    pub(super) injected: u64,
    pub(super) kills: u64,
    pub(super) lines: Vec<String>,
    pub(super) stderr: Vec<u8>,
    pub(super) stdout: Vec<u8>,
    /// The first operation that failed: its name and path.
    pub(super) at: String,
}

/// One command in one folder.
pub(super) struct One<'a> {
    pub(super) runner: &'a Runner,
    pub(super) ignores_syncs: bool,
    pub(super) tried: &'a Tried,
    pub(super) sound: &'a Sound,
    pub(super) inputs: Files,
    pub(super) bench: Bench,
    pub(super) had_old: bool,
}

impl One<'_> {
    /// A disk that fails at one operation, or from there on.
    pub(super) fn fail(
        &self,
        k: u64,
        random: &mut Random,
        steps: &mut Steps,
    ) -> anyhow::Result<Result<Ending, Failure>> {
        let mode = match random.below(8) {
            0 => Mode::Full,
            1 => Mode::Broken,
            _ => Mode::Once,
        };
        let plan = Plan { mode, at: spread(k, self.sound.operations), draw: random.next() % 60 };
        let (ended, log) = self.run(&self.tried.words, plan, steps)?;
        let injected: Vec<Operation> =
            log.into_iter().filter(|operation| operation.fault.is_some()).collect();
        steps.injected = injected.len() as u64;
        if let Some(Operation { name, path, fault, .. }) = injected.first() {
            steps.at = format!(
                "{name} {} {fault:?}",
                path.strip_prefix(self.bench.under()).unwrap_or(path).display()
            );
        }
        let is_place_taken = self.had_old && !self.sound.takes_places;
        let outcome = match of_process(&ended, self.sound, &injected, &self.bench.under(), self.may_print()) {
            // It is there already.
            Err(Failure("exit code" | "refused without need" | "no reason given", _)) if is_place_taken => {
                Ending::Refused
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
                || self.tried.keeps_work() && outcome == Ending::Refused && path.starts_with("work/")
        };
        let files = self.bench.files()?;
        let found = self.found(&files);
        let checked = found
            .names()
            .and_then(|()| found.nothing_left(is_kept))
            .and_then(|()| if outcome == Ending::Same { found.outputs() } else { Ok(()) });
        if let Err(failure) = checked {
            return Ok(Err(failure));
        }
        if is_place_taken {
            let was_taken = Failure("old output gone", "a place that was taken".into());
            return Ok(if outcome == Ending::Same { Err(was_taken) } else { Ok(outcome) });
        }
        let is_clean = found.nothing_left(|_| false).is_ok();
        if is_clean && !random.once_in(4) {
            return Ok(Ok(outcome));
        }
        Ok(self.finish(steps)?.map(|_| outcome))
    }

    /// Kills, each with what it loses, and then a disk that works.
    pub(super) fn kill(
        &self,
        k: u64,
        random: &mut Random,
        steps: &mut Steps,
    ) -> anyhow::Result<Result<Ending, Failure>> {
        for kill in 0..=random.below(MOST_KILLS) {
            let at = if kill == 0 {
                spread(k, self.sound.changes)
            } else {
                1 + random.next() % self.sound.changes.max(1)
            };
            let plan = Plan { mode: Mode::Kill, at, draw: random.next() % 60 };
            let words = &self.tried.words;
            let (ended, mut log) = self.run(words, plan, steps)?;
            log.retain(|operation| !self.ignores_syncs || operation.name != "sync");
            match ended.end {
                End::Signal(9) => steps.kills += 1,
                // It had less to do, or its output is there already; the next run shows whether it is whole.
                End::Exit(0..=2) => {}
                _ => {
                    let failure = of_process(&ended, self.sound, &[], &self.bench.under(), false);
                    return Ok(failure);
                }
            }
            let loss = *random.pick(&Loss::ALL);
            if ended.end == End::Signal(9) {
                steps.lines.push(format!("lost: {loss:?}"));
                lose(loss, &log, &self.bench.under(), random)?;
                steps.at =
                    log.last().map_or_else(String::new, |operation| format!("kill after {}", operation.name));
            }
            let files = self.bench.files()?;
            if let Err(failure) = self.found(&files).names() {
                return Ok(Err(failure));
            }
        }
        self.finish(steps)
    }

    /// On a disk that works, the command ends with the same bits, and nothing is left; or it refuses with a line what was
    /// kept, and ends so without.
    fn finish(&self, steps: &mut Steps) -> anyhow::Result<Result<Ending, Failure>> {
        let mut outcome = Ending::Same;
        for words in [self.tried.words.clone(), self.tried.without_kept_work()] {
            let (ended, _) = self.run(&words, Plan::NOTHING, steps)?;
            let files = self.bench.files()?;
            let found = self.found(&files);
            if let Err(failure) = found.names() {
                return Ok(Err(failure));
            }
            let stderr = String::from_utf8_lossy(&ended.stderr);
            let first = stderr.lines().next().unwrap_or_default().to_owned();
            match ended.end {
                End::Exit(0) if comparable(&ended.stdout) == self.sound.stdout => {
                    let checked = found.outputs().and_then(|()| found.nothing_left(|_| false));
                    return Ok(checked.map(|()| outcome));
                }
                End::Exit(0) => return Ok(Err(Failure::new("other bits"))),
                // What is there already, and whole.
                End::Exit(1 | 2)
                    if ["already", "not overwritten"].iter().any(|word| first.contains(word))
                        && found.outputs().is_ok() =>
                {
                    return Ok(found.nothing_left(|_| false).map(|()| Ending::Refused));
                }
                End::Exit(1) if !first.is_empty() => outcome = Ending::Refused,
                _ => return Ok(Err(Failure("not resumed", format!("{:?}: {first}", ended.end)))),
            }
            steps.lines.push(first);
        }
        Ok(Err(Failure("not resumed", steps.lines.last().cloned().unwrap_or_default())))
    }

    /// `dmp info` may print what is wrong with its input.
    fn may_print(&self) -> bool {
        self.tried.words[0] == "info"
    }

    fn found<'a>(&'a self, files: &'a Files) -> Found<'a> {
        Found { files, inputs: &self.inputs, sound: self.sound, had_old: self.had_old }
    }

    fn run(
        &self,
        words: &[String],
        plan: Plan,
        steps: &mut Steps,
    ) -> anyhow::Result<(Ended, Vec<Operation>)> {
        let (ended, log) = self.runner.run(words, &self.bench, plan)?;
        let Plan { mode, at, draw } = plan;
        steps.stderr.clone_from(&ended.stderr);
        steps.stdout.clone_from(&ended.stdout);
        steps.lines.push(format!("{mode:?} at {at}, {draw}: dmp {}: {:?}", words.join(" "), ended.end));
        Ok((ended, log))
    }
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
