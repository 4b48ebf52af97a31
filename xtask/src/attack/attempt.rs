//! One try: damage a seed, run a command on it, judge.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::ensure;
use serde_json::Value;

use super::seeds::{Kind, Seed};
use super::verdict::{accepts, judge, silent};
use crate::trials::damage::damage;
use crate::trials::{Call, End, Ended, Failure, File, Outcome, folder, numbers, run, write};

#[derive(Debug)]
pub(super) struct Attacker {
    dmp: PathBuf,
    kinds: Vec<Kind>,
    /// What the commands of each seed print on the files as they were, by kind, seed and command; null where that is no
    /// JSON or nothing guards it.
    sound: Vec<Vec<Vec<Value>>>,
    seed: u64,
    stop: &'static AtomicBool,
}

impl Attacker {
    /// Runs every command on undamaged files: each must accept them.
    pub(super) fn prepare(
        dmp: PathBuf,
        kinds: Vec<Kind>,
        seed: u64,
        stop: &'static AtomicBool,
    ) -> anyhow::Result<Self> {
        let mut attacker = Self { dmp, kinds, sound: Vec::new(), seed, stop };
        let mut refused = Vec::new();
        attacker.sound = attacker
            .kinds
            .iter()
            .map(|kind| attacker.sound(kind, &mut refused))
            .collect::<anyhow::Result<_>>()?;
        ensure!(refused.is_empty(), "undamaged files were refused:\n{}", refused.join("\n"));
        Ok(attacker)
    }

    fn sound(&self, kind: &Kind, refused: &mut Vec<String>) -> anyhow::Result<Vec<Vec<Value>>> {
        let mut of_call = |seed: &Seed, call: &Call| -> anyhow::Result<Value> {
            let (ended, verdict) = self.try_on(&seed.files, call)?;
            if verdict != Ok(true) {
                let (line, stderr) = (call.words.join(" "), String::from_utf8_lossy(&ended.stderr));
                refused.push(format!("{}: dmp {line}: {verdict:?}: {stderr}", kind.name));
            }
            let is_score = seed.is_guarded && call.words[0] == "score";
            Ok(if is_score { serde_json::from_slice(&ended.stdout).unwrap_or_default() } else { Value::Null })
        };
        let mut of_seed = |seed: &Seed| seed.calls.iter().map(|call| of_call(seed, call)).collect();
        kind.seeds.iter().map(&mut of_seed).collect()
    }

    pub(super) fn kinds(&self) -> usize {
        self.kinds.len()
    }

    /// The try of this number of a kind; nothing where it was interrupted.
    pub(super) fn attempt(&self, kind_at: usize, number: u64) -> anyhow::Result<Option<Outcome>> {
        let kind = &self.kinds[kind_at];
        let mut random = numbers(self.seed, kind.name, number);
        let (seed_at, other_at) = (random.below(kind.seeds.len()), random.below(kind.seeds.len()));
        let (seed, other) = (&kind.seeds[seed_at], &kind.seeds[other_at]);
        let mut files = seed.files.clone();
        let damaged: Vec<usize> = (0..files.len()).filter(|&file| files[file].form.is_some()).collect();
        let file = &mut files[*random.pick(&damaged)];
        let Some(form) = file.form else { return Ok(None) };
        let others: Vec<&File> = other.files.iter().filter(|other| other.form == Some(form)).collect();
        let part = if others.is_empty() { &[][..] } else { &random.pick(&others).bytes };
        let is_guarded = damage(form, &mut file.bytes, part, &mut random) && seed.is_guarded;
        let call_at = random.below(seed.calls.len());
        let call = &seed.calls[call_at];
        let (ended, mut verdict) = self.try_on(&files, call)?;
        if self.stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let sound = &self.sound[kind_at][seed_at][call_at];
        if verdict == Ok(true) && is_guarded && !sound.is_null() {
            verdict = silent(&ended, sound).map_or(verdict, Err);
        }
        Ok(Some(self.outcome(kind.name, number, call, (&files, &ended), verdict)))
    }

    fn outcome(
        &self,
        kind: &str,
        number: u64,
        call: &Call,
        (files, ended): (&[File], &Ended),
        verdict: Result<bool, Failure>,
    ) -> Outcome {
        let line = format!("cd in && dmp {}\n{:?}\n", call.words.join(" "), ended.end);
        let inputs = files.iter().map(|file| (format!("in/{}", file.path), file.bytes.clone()));
        let printed =
            [("command.txt", line.as_bytes()), ("stdout", &ended.stdout), ("stderr", &ended.stderr)];
        let printed = printed.map(|(name, bytes)| (name.to_owned(), bytes.to_vec()));
        let is_failed = verdict.is_err();
        Outcome {
            row: format!("{kind} | `dmp {}`", call.name()),
            counts: vec![1, u64::from(verdict == Ok(true)), u64::from(verdict == Ok(false))],
            hint: String::from_utf8_lossy(&ended.stderr).lines().last().unwrap_or_default().to_owned(),
            again: format!(
                "cargo xtask attack --only '{kind}' --seed {} --first {number} --tries 1",
                self.seed
            ),
            name: format!("{kind}-{}-{number}", self.seed),
            files: if is_failed { inputs.chain(printed).collect() } else { Vec::new() },
            failure: verdict.err(),
        }
    }

    /// Runs a command in a new folder with these files, and another on what it wrote.
    fn try_on(&self, files: &[File], call: &Call) -> anyhow::Result<(Ended, Result<bool, Failure>)> {
        let place = folder()?;
        let (inputs, temporary) = (place.path().join("in"), place.path().join("tmp"));
        std::fs::create_dir(&temporary)?;
        write(files, &inputs)?;
        let ended = run(&self.dmp, &call.words, &inputs, &temporary, &[])?;
        let mut verdict = judge(call, files, &ended, &inputs, &temporary);
        if let (Ok(true), Some(words)) = (&verdict, &call.then) {
            let read = run(&self.dmp, words, &inputs, &temporary, &[])?;
            if !accepts(call, read.end) || read.end == End::Exit(3) && ended.end == End::Exit(0) {
                let line =
                    String::from_utf8_lossy(&read.stderr).lines().next().unwrap_or_default().to_owned();
                verdict = Err(Failure("not read back", format!("{:?}: {line}", read.end)));
            }
        }
        Ok((ended, verdict))
    }
}
