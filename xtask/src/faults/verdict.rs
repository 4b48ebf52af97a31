//! Says whether what a command did on a disk that fails is as it should be.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fmt;
use std::path::{Component, Path};

use serde_json::Value;

use super::journal::{Fault, Operation};
use crate::trials::{End, Ended};

/// What stood in place of an output before.
pub(super) const OLD: &[u8] = b"what was there before\n";

/// What no failing disk may lead to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Failure {
    Signal(i32),
    Panic,
    Code(i32),
    Hang,
    Memory,
    /// A refusal without a reason.
    Mute,
    /// A refusal that does not say what the system said.
    NoReason(String),
    /// A refusal that does not say which file.
    NoFile(String),
    /// A refusal of what is none: a call that was interrupted, or did half.
    NoFault(String),
    InputChanged(String),
    /// Under an output's name stands neither what was there nor all of what was to come.
    Half(String),
    /// With exit code 0, an output that is missing.
    Missing(String),
    /// What was there before is gone, and nothing came in its place.
    OldGone(String),
    /// With exit code 0, something else was printed.
    OtherBits,
    /// A file that nobody asked for.
    Left(String),
    /// The command does not work any more once the disk does.
    NotAgain(String),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Signal(signal) => write!(f, "signal {signal}"),
            Self::Panic => f.write_str("panic"),
            Self::Code(code) => write!(f, "exit code {code}"),
            Self::Hang => f.write_str("hang"),
            Self::Memory => f.write_str("memory"),
            Self::Mute => f.write_str("mute refusal"),
            Self::NoReason(said) => write!(f, "no reason told: {said}"),
            Self::NoFile(said) => write!(f, "no file told: {said}"),
            Self::NoFault(said) => write!(f, "refused without need: {said}"),
            Self::InputChanged(path) => write!(f, "input changed: {path}"),
            Self::Half(path) => write!(f, "half written: {path}"),
            Self::Missing(path) => write!(f, "nothing written: {path}"),
            Self::OldGone(path) => write!(f, "old output gone: {path}"),
            Self::OtherBits => f.write_str("other bits"),
            Self::Left(path) => write!(f, "file left: {path}"),
            Self::NotAgain(said) => write!(f, "not gone on: {said}"),
        }
    }
}

impl Failure {
    /// Without its details, for the table.
    pub(super) fn kind(&self) -> String {
        self.to_string().split(": ").next().unwrap_or_default().to_owned()
    }
}

/// How a command ends that is as it should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Exit code 0, and what it made is what it makes on a disk that works.
    Same,
    /// Exit code 1, or 3, and a line that says why.
    Refused,
}

/// Files by their paths below the folder of a try.
pub(super) type Files = BTreeMap<String, Vec<u8>>;

/// What a command makes on a disk that works.
#[derive(Debug, Default)]
pub(super) struct Sound {
    pub(super) printed: Vec<u8>,
    pub(super) outputs: Files,
    /// How many operations there are, and how many of them change something.
    pub(super) operations: u64,
    pub(super) changes: u64,
    /// Whether it replaces what stands in the place of an output.
    pub(super) takes_places: bool,
}

/// What was printed, without what differs from run to run.
pub(super) fn comparable(printed: &[u8]) -> Vec<u8> {
    let Ok(mut value) = serde_json::from_slice::<Value>(printed) else { return printed.to_vec() };
    if let Some(object) = value.as_object_mut() {
        object.remove("timing");
        object.remove("memory");
    }
    value.to_string().into_bytes()
}

/// Judges the process by itself. `may_tell`: a command that tells what is wrong with its input in what it prints.
pub(super) fn of_process(
    ended: &Ended,
    sound: &Sound,
    injected: &[Operation],
    under: &Path,
    may_tell: bool,
) -> Result<Outcome, Failure> {
    let said = String::from_utf8_lossy(&ended.said);
    let first = || said.lines().find(|line| line.starts_with("error")).unwrap_or(&said).trim().to_owned();
    match ended.end {
        End::Signal(signal) => return Err(Failure::Signal(signal)),
        End::TooLong => return Err(Failure::Hang),
        End::TooLarge => return Err(Failure::Memory),
        End::Exit(101) => return Err(Failure::Panic),
        _ if said.contains("panicked at") => return Err(Failure::Panic),
        End::Exit(0) if comparable(&ended.printed) == sound.printed => return Ok(Outcome::Same),
        End::Exit(0 | 3) if may_tell && is_told(&String::from_utf8_lossy(&ended.printed), injected) => {
            return Ok(Outcome::Refused);
        }
        End::Exit(0) => return Err(Failure::OtherBits),
        End::Exit(1 | 3) => {}
        End::Exit(code) => return Err(Failure::Code(code)),
    }
    if said.trim().is_empty() {
        return Err(Failure::Mute);
    }
    if !injected.iter().any(|operation| operation.fault.and_then(Fault::reason).is_some()) {
        return Err(Failure::NoFault(first()));
    }
    if !is_told(&said, injected) {
        return Err(Failure::NoReason(first()));
    }
    if !injected.iter().any(|operation| is_named(operation, under, &said)) {
        return Err(Failure::NoFile(first()));
    }
    Ok(Outcome::Refused)
}

/// Whether a text says what the system said.
fn is_told(text: &str, injected: &[Operation]) -> bool {
    // `SQLite` has its own words.
    let of_library = ["disk I/O error", "unable to open database file", "database disk image is malformed"];
    let mut reasons = injected.iter().filter_map(|operation| operation.fault.and_then(Fault::reason));
    reasons.any(|reason| text.contains(&reason)) || of_library.iter().any(|reason| text.contains(reason))
}

/// Whether a text names the file of an operation, its target where it is in the making, or a folder that it is in.
fn is_named(operation: &Operation, under: &Path, said: &str) -> bool {
    let Ok(below) = operation.path.strip_prefix(under) else { return true };
    let parts: Vec<&OsStr> = below
        .components()
        .filter_map(|part| if let Component::Normal(part) = part { Some(part) } else { None })
        .collect();
    parts.is_empty()
        || parts.iter().any(|part| {
            let part = part.to_string_lossy();
            // `.out.ply.Ab3xYz.dmp-tmp` will be `out.ply`.
            let target = part.strip_prefix('.').and_then(|rest| rest.strip_suffix(".dmp-tmp"));
            let target = target.and_then(|rest| rest.rsplit_once('.')).map(|(target, _)| target);
            // In the folder `.dmp-map-out.dmpmap` the map `out.dmpmap` is made.
            said.contains(target.or_else(|| part.strip_prefix(".dmp-map-")).unwrap_or(&part))
        })
        // What has no name yet is in its folder.
        || parts.len() == 1 && parts[0].to_string_lossy().starts_with('#')
}

/// What is in the folder of a try, and what should be.
#[derive(Debug)]
pub(super) struct Found<'a> {
    pub(super) files: &'a Files,
    pub(super) inputs: &'a Files,
    pub(super) sound: &'a Sound,
    /// Whether something stood in the place of outputs.
    pub(super) had_old: bool,
}

impl Found<'_> {
    /// What must hold whatever happened: inputs as they were, outputs that are the old ones, the new ones or none.
    pub(super) fn names(&self) -> Result<(), Failure> {
        for (path, bytes) in self.inputs {
            if self.files.get(path) != Some(bytes) {
                return Err(Failure::InputChanged(path.clone()));
            }
        }
        for (path, bytes) in &self.sound.outputs {
            let may_be_old = self.had_old && may_be_old(path);
            match self.files.get(path) {
                Some(found) if found == bytes || may_be_old && found == OLD => {}
                None if !may_be_old => {}
                None => return Err(Failure::OldGone(path.clone())),
                Some(_) => return Err(Failure::Half(path.clone())),
            }
        }
        Ok(())
    }

    /// That every output is there.
    pub(super) fn outputs(&self) -> Result<(), Failure> {
        let missing = self.sound.outputs.iter().find(|(path, bytes)| self.files.get(*path) != Some(*bytes));
        missing.map_or(Ok(()), |(path, _)| Err(Failure::Missing(path.clone())))
    }

    /// That nothing else is there, but what may be left.
    pub(super) fn nothing_left(&self, may_be_left: impl Fn(&str) -> bool) -> Result<(), Failure> {
        let is_known = |path: &str| self.inputs.contains_key(path) || self.sound.outputs.contains_key(path);
        let left = self.files.keys().find(|path| !is_known(path) && !may_be_left(path));
        left.map_or(Ok(()), |path| Err(Failure::Left(path.clone())))
    }
}

/// Outputs in folders of their own have nothing in their place: such folders must be new.
pub(super) fn may_be_old(output: &str) -> bool {
    !output.contains('/')
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::time::Duration;

    use super::*;

    fn injected(fault: Fault) -> Vec<Operation> {
        let (path, to) = (PathBuf::from("/in/.out.ply.Ab3xYz.dmp-tmp"), PathBuf::new());
        let fault = Some(fault);
        vec![Operation {
            number: 1,
            name: "write".into(),
            inode: 1,
            offset: 0,
            length: 0,
            fault,
            path,
            to,
            link: None,
        }]
    }

    #[test]
    fn a_refusal_names_the_file_and_the_reason() {
        let of = |code, said: &str, fault| {
            let ended =
                Ended { end: End::Exit(code), printed: vec![], said: said.into(), taken: Duration::ZERO };
            of_process(&ended, &Sound::default(), &injected(fault), Path::new("/in"), false)
        };
        let full = Fault::Error(28);
        assert_eq!(of(0, "", full), Ok(Outcome::Same));
        assert_eq!(of(1, "error: out.ply: No space left on device", full), Ok(Outcome::Refused));
        assert!(matches!(of(1, "error: out.ply: cannot", full), Err(Failure::NoReason(_))));
        assert!(matches!(of(1, "error: No space left on device", full), Err(Failure::NoFile(_))));
        assert!(matches!(of(1, "error: out.ply: short", Fault::Half), Err(Failure::NoFault(_))));
        assert_eq!(of(1, "", full), Err(Failure::Mute));
        assert_eq!(of(101, "", full), Err(Failure::Panic));
    }

    #[test]
    fn outputs_are_old_or_new() {
        let files = |text: &[(&str, &[u8])]| -> Files {
            text.iter().map(|(path, bytes)| ((*path).to_owned(), bytes.to_vec())).collect()
        };
        let inputs = files(&[("a", b"1")]);
        let sound = Sound { outputs: files(&[("o", b"new")]), ..Sound::default() };
        let names = |found: &[(&str, &[u8])], had_old| {
            Found { files: &files(found), inputs: &inputs, sound: &sound, had_old }.names()
        };
        assert_eq!(names(&[("a", b"1"), ("o", b"new")], true), Ok(()));
        assert_eq!(names(&[("a", b"1"), ("o", OLD)], true), Ok(()));
        assert_eq!(names(&[("a", b"1")], false), Ok(()));
        assert_eq!(names(&[("a", b"1")], true), Err(Failure::OldGone("o".into())));
        assert_eq!(names(&[("a", b"1"), ("o", b"ne")], true), Err(Failure::Half("o".into())));
        assert_eq!(names(&[("a", b"2")], false), Err(Failure::InputChanged("a".into())));
    }
}
