//! Says whether what a command did is as it should be.

use std::fmt;
use std::path::Path;

use serde_json::Value;

use crate::trials::{Call, End, Ended, File, TOO_LONG_A_FILE, paths};

/// A refusal is a line or a few.
const MOST_LINES: usize = 20;

/// What no input may lead to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Failure {
    Signal(i32),
    Panic,
    /// An exit code that means nothing.
    Code(i32),
    Hang,
    Memory,
    /// A file of more than any output of such inputs.
    Disk,
    /// A refusal without a reason.
    Mute,
    /// A refusal with so many lines.
    Long(usize),
    NotJson,
    /// A character that commands a terminal, or no text at all.
    Control(String),
    InputChanged(String),
    /// A file that nobody asked for, or that a failed command left.
    Left(String),
    /// What was to be written is not there.
    Missing(String),
    /// What was written is not read back.
    NotReadBack(String),
    /// Other scores than those of the file as it was, and no word of it.
    Silent(String),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Signal(signal) => write!(f, "signal {signal}"),
            Self::Panic => f.write_str("panic"),
            Self::Code(code) => write!(f, "exit code {code}"),
            Self::Hang => f.write_str("hang"),
            Self::Memory => f.write_str("memory"),
            Self::Disk => f.write_str("disk"),
            Self::Mute => f.write_str("refusal without a reason"),
            Self::Long(lines) => write!(f, "refusal of {lines} lines"),
            Self::NotJson => f.write_str("no JSON"),
            Self::Control(what) => write!(f, "control character: {what}"),
            Self::InputChanged(path) => write!(f, "input changed: {path}"),
            Self::Left(path) => write!(f, "file left: {path}"),
            Self::Missing(path) => write!(f, "nothing written: {path}"),
            Self::NotReadBack(what) => write!(f, "not read back: {what}"),
            Self::Silent(what) => write!(f, "other scores without a word: {what}"),
        }
    }
}

impl Failure {
    /// The failure without its details, for the table.
    pub(super) fn kind(&self) -> String {
        let text = self.to_string();
        let kind = text.split(": ").next().unwrap_or_default();
        if matches!(self, Self::Long(_)) { "long refusal".into() } else { kind.to_owned() }
    }
}

/// What became of a try.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Exit code 0 or 3, or 4 where gates were asked for.
    Accepted,
    /// Exit code 1 or 2.
    Refused,
    Failed(Failure),
}

/// Judges what a command did in `folder`, which held `files`; `temporary` must be empty now.
pub(super) fn judge(call: &Call, files: &[File], ended: &Ended, folder: &Path, temporary: &Path) -> Verdict {
    let of_files =
        || first_left(temporary).or_else(|| changes(call, files, folder, accepts(call, ended.end)));
    match of_process(call, ended).or_else(of_files) {
        Some(failure) => Verdict::Failed(failure),
        None if accepts(call, ended.end) => Verdict::Accepted,
        None => Verdict::Refused,
    }
}

pub(super) fn accepts(call: &Call, end: End) -> bool {
    let has_gate = call.words.iter().any(|word| word.starts_with("--fail") || word.starts_with("--expect"));
    matches!(end, End::Exit(0 | 3)) || has_gate && end == End::Exit(4)
}

/// What is wrong with the way it ended, or with what it printed.
fn of_process(call: &Call, ended: &Ended) -> Option<Failure> {
    let said = String::from_utf8_lossy(&ended.said);
    let is_accepted = accepts(call, ended.end);
    match ended.end {
        End::Signal(TOO_LONG_A_FILE) => return Some(Failure::Disk),
        End::Signal(signal) => return Some(Failure::Signal(signal)),
        End::TooLong => return Some(Failure::Hang),
        End::TooLarge => return Some(Failure::Memory),
        End::Exit(101) => return Some(Failure::Panic),
        End::Exit(code @ (..0 | 4..)) if !is_accepted => return Some(Failure::Code(code)),
        End::Exit(_) => {}
    }
    // Also where a panic was caught.
    if said.contains("panicked at") {
        return Some(Failure::Panic);
    }
    if let Some(control) = control(&ended.printed).or_else(|| control(&ended.said)) {
        return Some(Failure::Control(control));
    }
    let lines = said.lines().count();
    if !is_accepted && lines == 0 {
        Some(Failure::Mute)
    } else if !is_accepted && lines > MOST_LINES {
        Some(Failure::Long(lines))
    } else if is_accepted && call.is_json() && serde_json::from_slice::<Value>(&ended.printed).is_err() {
        Some(Failure::NotJson)
    } else {
        None
    }
}

/// The first character that should not be printed.
fn control(text: &[u8]) -> Option<String> {
    let Ok(text) = std::str::from_utf8(text) else { return Some("no UTF-8".into()) };
    // Controls, marks of direction, other ends of lines.
    let is_odd = |c: char| {
        c.is_control() && c != '\n' && c != '\t'
            || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
            || matches!(c, '\u{2028}' | '\u{2029}')
    };
    text.chars().find(|&c| is_odd(c)).map(|c| c.escape_unicode().to_string())
}

/// What the command did to the files of its folder that it should not have done.
fn changes(call: &Call, files: &[File], folder: &Path, is_accepted: bool) -> Option<Failure> {
    for file in files {
        if !std::fs::read(folder.join(&file.path)).is_ok_and(|bytes| bytes == file.bytes) {
            return Some(Failure::InputChanged(file.path.clone()));
        }
    }
    let is_input = |path: &str| files.iter().any(|file| file.path == path);
    let is_output = |path: &str| {
        is_accepted && call.outputs.iter().any(|output| Path::new(path).starts_with(output.as_str()))
    };
    if let Some(left) = paths(folder).into_iter().find(|path| !is_input(path) && !is_output(path)) {
        return Some(Failure::Left(left));
    }
    let is_missing = |output: &&String| is_accepted && !folder.join(output.as_str()).exists();
    call.outputs.iter().find(is_missing).map(|output| Failure::Missing(output.clone()))
}

/// The first file or folder in a folder that should be empty.
fn first_left(temporary: &Path) -> Option<Failure> {
    let entry = std::fs::read_dir(temporary).ok()?.flatten().next()?;
    Some(Failure::Left(format!("$TMPDIR/{}", entry.file_name().to_string_lossy())))
}

/// Whether the scores are others than `sound`, those of the files as they were, and nothing tells.
pub(super) fn silent(ended: &Ended, sound: &Value) -> Option<Failure> {
    let report = serde_json::from_slice::<Value>(&ended.printed).ok()?;
    // What tells: damage, counts of what was dropped, notes, warnings.
    let told = [
        "/inputs/damage",
        "/inputs/dropped",
        "/inputs/notes",
        "/inputs/scans",
        "/warnings",
        "/left_out",
        "/inputs/runs/0/map_notes",
        "/inputs/runs/0/notes",
        "/inputs/runs/0/scans_without_pose",
        "/runs/0/warnings",
    ];
    if ended.end != End::Exit(0) || told.iter().any(|path| report.pointer(path) != sound.pointer(path)) {
        return None;
    }
    let fields = ["dmp_mean_m2", "r_near_m2", "r_cv_m2", "returns", "surfels"];
    let field = fields.iter().find(|field| report["runs"][0][field] != sound["runs"][0][field])?;
    Some(Failure::Silent(format!(
        "{field} {} instead of {}",
        report["runs"][0][field], sound["runs"][0][field]
    )))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn ended(end: End, printed: &str, said: &str) -> Ended {
        Ended { end, printed: printed.into(), said: said.into(), taken: Duration::ZERO }
    }

    #[test]
    fn what_a_command_may_not_do_is_told() {
        let call = Call::new("info a.mcap --json");
        let failure = |end, printed: &str, said: &str| of_process(&call, &ended(end, printed, said));
        assert_eq!(failure(End::Exit(0), "{}", ""), None);
        assert_eq!(failure(End::Exit(0), "{", ""), Some(Failure::NotJson));
        assert_eq!(failure(End::Exit(1), "", "error: x\n"), None);
        assert_eq!(failure(End::Exit(1), "", ""), Some(Failure::Mute));
        let long = "x\n".repeat(30);
        assert_eq!(failure(End::Exit(1), "", &long), Some(Failure::Long(30)));
        assert_eq!(failure(End::Exit(4), "", "x"), Some(Failure::Code(4)));
        assert_eq!(failure(End::Exit(101), "", "x"), Some(Failure::Panic));
        assert_eq!(failure(End::Exit(3), "{}", "thread 'a' panicked at b"), Some(Failure::Panic));
        assert!(matches!(failure(End::Exit(1), "", "a\u{1b}[2J"), Some(Failure::Control(_))));
    }

    #[test]
    fn files_are_compared() {
        let folder = tempfile::tempdir().unwrap();
        let file = File { path: "a/b".into(), bytes: b"1".into(), form: None };
        let call = Call::new("convert log a/b -o out");
        let changes = |is_accepted| changes(&call, std::slice::from_ref(&file), folder.path(), is_accepted);
        assert_eq!(changes(false), Some(Failure::InputChanged("a/b".into())));
        std::fs::create_dir(folder.path().join("a")).unwrap();
        std::fs::write(folder.path().join("a/b"), "1").unwrap();
        assert_eq!(changes(false), None);
        assert_eq!(changes(true), Some(Failure::Missing("out".into())));
        std::fs::create_dir(folder.path().join("out")).unwrap();
        assert_eq!(changes(true), None);
        assert_eq!(changes(false), Some(Failure::Left("out".into())));
    }

    #[test]
    fn other_scores_need_a_word() {
        let report = |score: f64, damage: &str| serde_json::json!({"inputs": {"damage": damage}, "runs": [{"returns": score}]});
        let sound = report(1.0, "");
        let of = |report: Value| silent(&ended(End::Exit(0), &report.to_string(), ""), &sound);
        assert_eq!(of(report(1.0, "")), None);
        assert_eq!(of(report(2.0, "a chunk")), None);
        assert!(matches!(of(report(2.0, "")), Some(Failure::Silent(_))));
    }
}
