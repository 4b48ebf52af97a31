//! Says whether what a command did on a disk that fails is as it should be.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Component, Path};

use serde_json::Value;

use super::journal::{Fault, Operation};
use crate::trials::{End, Ended, Failure};

/// What stood in place of an output before.
pub(super) const OLD: &[u8] = b"what was there before\n";

/// How a command may end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
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
    pub(super) stdout: Vec<u8>,
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

/// Judges the process by itself. `may_print`: a command that prints what is wrong with its input.
pub(super) fn of_process(
    ended: &Ended,
    sound: &Sound,
    injected: &[Operation],
    under: &Path,
    may_print: bool,
) -> Result<Ending, Failure> {
    if let Some(failure) = Failure::of_process(ended) {
        return Err(failure);
    }
    let stderr = String::from_utf8_lossy(&ended.stderr);
    let first = || stderr.lines().find(|line| line.starts_with("error")).unwrap_or(&stderr).trim().to_owned();
    match ended.end {
        End::Exit(0) if comparable(&ended.stdout) == sound.stdout => return Ok(Ending::Same),
        End::Exit(0 | 3) if may_print && has_reason(&String::from_utf8_lossy(&ended.stdout), injected) => {
            return Ok(Ending::Refused);
        }
        End::Exit(0) => return Err(Failure::new("other bits")),
        // Scores are complete, but not a file beside them.
        End::Exit(5) if comparable(&ended.stdout) != sound.stdout => return Err(Failure::new("other bits")),
        End::Exit(code) if ![1, 3, 5].contains(&code) => return Err(Failure("exit code", code.to_string())),
        _ => {}
    }
    if stderr.trim().is_empty() {
        return Err(Failure::new("refusal without a line"));
    }
    if !injected.iter().any(|operation| operation.fault.and_then(Fault::reason).is_some()) {
        return Err(Failure("refused without need", first()));
    }
    if !has_reason(&stderr, injected) {
        return Err(Failure("no reason given", first()));
    }
    if !injected.iter().any(|operation| is_named(operation, under, &stderr)) {
        return Err(Failure("no file named", first()));
    }
    Ok(Ending::Refused)
}

/// Whether a text has the system's reason.
fn has_reason(text: &str, injected: &[Operation]) -> bool {
    // `SQLite` has its own words.
    let of_library = ["disk I/O error", "unable to open database file", "database disk image is malformed"];
    let mut reasons = injected.iter().filter_map(|operation| operation.fault.and_then(Fault::reason));
    reasons.any(|reason| text.contains(&reason)) || of_library.iter().any(|reason| text.contains(reason))
}

/// Whether a text names the file of an operation, its target where it is in the making, or a folder that it is in.
fn is_named(operation: &Operation, under: &Path, text: &str) -> bool {
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
            text.contains(target.or_else(|| part.strip_prefix(".dmp-map-")).unwrap_or(&part))
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
                return Err(Failure("input changed", path.clone()));
            }
        }
        for (path, bytes) in &self.sound.outputs {
            let may_be_old = self.had_old && may_be_old(path);
            match self.files.get(path) {
                Some(found) if found == bytes || may_be_old && found == OLD => {}
                None if !may_be_old => {}
                None => return Err(Failure("old output gone", path.clone())),
                Some(_) => return Err(Failure("half written", path.clone())),
            }
        }
        Ok(())
    }

    /// That every output is there.
    pub(super) fn outputs(&self) -> Result<(), Failure> {
        let missing = self.sound.outputs.iter().find(|(path, bytes)| self.files.get(*path) != Some(*bytes));
        missing.map_or(Ok(()), |(path, _)| Err(Failure("nothing written", path.clone())))
    }

    /// That nothing else is there, but what may be left.
    pub(super) fn nothing_left(&self, may_be_left: impl Fn(&str) -> bool) -> Result<(), Failure> {
        let is_known = |path: &str| self.inputs.contains_key(path) || self.sound.outputs.contains_key(path);
        let left = self.files.keys().find(|path| !is_known(path) && !may_be_left(path));
        left.map_or(Ok(()), |path| Err(Failure("file left", path.clone())))
    }
}

/// Outputs in folders of their own have nothing in their place: such folders must be new.
pub(super) fn may_be_old(output: &str) -> bool {
    !output.contains('/')
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn a_refusal_names_the_file_and_the_reason() {
        let of = |code, stderr: &str, fault| {
            let operation = Operation {
                number: 1,
                name: "write".into(),
                path: PathBuf::from("/in/.out.ply.Ab3xYz.dmp-tmp"),
                fault: Some(fault),
                ..Operation::default()
            };
            let ended = Ended { end: End::Exit(code), stdout: vec![], stderr: stderr.into() };
            let judged = of_process(&ended, &Sound::default(), &[operation], Path::new("/in"), false);
            judged.map_err(|failure| failure.0)
        };
        let full = Fault::Error(28);
        for (code, stderr, fault, expected) in [
            (0, "", full, Ok(Ending::Same)),
            (1, "error: out.ply: No space left on device", full, Ok(Ending::Refused)),
            (1, "error: out.ply: cannot", full, Err("no reason given")),
            (1, "error: No space left on device", full, Err("no file named")),
            (1, "error: out.ply: short", Fault::Half, Err("refused without need")),
            (1, "", full, Err("refusal without a line")),
            (101, "", full, Err("panic")),
        ] {
            assert_eq!(of(code, stderr, fault), expected, "{stderr}");
        }
    }

    #[test]
    fn outputs_are_old_or_new() {
        let files = |text: &[(&str, &[u8])]| -> Files {
            text.iter().map(|(path, bytes)| ((*path).to_owned(), bytes.to_vec())).collect()
        };
        let inputs = files(&[("a", b"1")]);
        let sound = Sound { outputs: files(&[("o", b"new")]), ..Sound::default() };
        for (found, had_old, expected) in [
            (&[("a", &b"1"[..]), ("o", b"new")][..], true, None),
            (&[("a", b"1"), ("o", OLD)], true, None),
            (&[("a", b"1")], false, None),
            (&[("a", b"1")], true, Some("old output gone")),
            (&[("a", b"1"), ("o", b"ne")], true, Some("half written")),
            (&[("a", b"2")], false, Some("input changed")),
        ] {
            let found = files(found);
            let found = Found { files: &found, inputs: &inputs, sound: &sound, had_old };
            assert_eq!(found.names().err().map(|failure| failure.0), expected);
        }
    }
}
