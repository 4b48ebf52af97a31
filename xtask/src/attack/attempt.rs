//! One try: damage a seed, run a command on it, judge.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::ensure;
use serde_json::Value;

use super::mutate::damage;
use super::verdict::{Failure, Verdict, accepts, judge, silent};
use crate::trials::{Call, End, Ended, File, Kind, Random, Seed, folder, run, write};

/// Which try: of a kind of input, by its number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Attempt {
    pub(super) kind: usize,
    pub(super) number: u64,
}

/// What became of it.
#[derive(Debug)]
pub(super) struct Outcome {
    pub(super) kind: &'static str,
    pub(super) seed: u64,
    pub(super) number: u64,
    pub(super) command: String,
    pub(super) call: Call,
    pub(super) files: Vec<File>,
    pub(super) ended: Ended,
    pub(super) verdict: Verdict,
}

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
    /// Runs every command on files that are well: each must take them.
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
        ensure!(refused.is_empty(), "sound files were not taken:\n{}", refused.join("\n"));
        Ok(attacker)
    }

    fn sound(&self, kind: &Kind, refused: &mut Vec<String>) -> anyhow::Result<Vec<Vec<Value>>> {
        let mut of_call = |seed: &Seed, call: &Call| -> anyhow::Result<Value> {
            let (ended, verdict) = self.try_on(&seed.files, call)?;
            let line = call.words.join(" ");
            let said = String::from_utf8_lossy(&ended.said);
            if verdict != Verdict::Accepted {
                refused.push(format!("{}: dmp {line}: {verdict:?}: {said}", kind.name));
            }
            let is_score = seed.is_guarded && call.words[0] == "score";
            Ok(if is_score {
                serde_json::from_slice(&ended.printed).unwrap_or_default()
            } else {
                Value::Null
            })
        };
        let mut of_seed = |seed: &Seed| seed.calls.iter().map(|call| of_call(seed, call)).collect();
        kind.seeds.iter().map(&mut of_seed).collect()
    }

    pub(super) fn kinds(&self) -> usize {
        self.kinds.len()
    }

    /// The try; nothing where it was interrupted.
    pub(super) fn attempt(&self, attempt: Attempt) -> anyhow::Result<Option<Outcome>> {
        let Attempt { kind: at, number } = attempt;
        let kind = &self.kinds[at];
        // By its name: what other kinds are tried does not matter.
        let name = kind.name.bytes().fold(0_u64, |hash, byte| hash.wrapping_mul(257) + u64::from(byte));
        let mut random = Random::of(&[self.seed, name, number]);
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
        let call = seed.calls[call_at].clone();
        let (ended, mut verdict) = self.try_on(&files, &call)?;
        if self.stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let sound = &self.sound[at][seed_at][call_at];
        if verdict == Verdict::Accepted && is_guarded && !sound.is_null() {
            verdict = silent(&ended, sound).map_or(verdict, Verdict::Failed);
        }
        let command = call.name();
        Ok(Some(Outcome { kind: kind.name, seed: self.seed, number, command, call, files, ended, verdict }))
    }

    /// Runs a command in a new folder with these files, and another on what it wrote.
    fn try_on(&self, files: &[File], call: &Call) -> anyhow::Result<(Ended, Verdict)> {
        let place = folder()?;
        let (inputs, temporary) = (place.path().join("in"), place.path().join("tmp"));
        std::fs::create_dir(&temporary)?;
        write(files, &inputs)?;
        let ended = run(&self.dmp, &call.words, &inputs, &temporary, &[])?;
        let mut verdict = judge(call, files, &ended, &inputs, &temporary);
        if let (Verdict::Accepted, Some(words)) = (&verdict, &call.then) {
            let read = run(&self.dmp, words, &inputs, &temporary, &[])?;
            if !accepts(call, read.end) || read.end == End::Exit(3) && ended.end == End::Exit(0) {
                let said = String::from_utf8_lossy(&read.said);
                let said = said.lines().next().unwrap_or_default();
                verdict = Verdict::Failed(Failure::NotReadBack(format!("{:?}: {said}", read.end)));
            }
        }
        Ok((ended, verdict))
    }
}
