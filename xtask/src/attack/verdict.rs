//! Judges what a command did with damaged files.

use std::path::Path;

use serde_json::Value;

use crate::trials::{Call, End, Ended, Failure, File, TOO_LONG_A_FILE, paths};

/// A refusal is a line or a few.
const MOST_LINES: usize = 20;

/// Judges what a command did in `folder`, which held `files`; `temporary` must be empty now. True where it accepted them, false
/// where it refused them.
pub(super) fn judge(
    call: &Call,
    files: &[File],
    ended: &Ended,
    folder: &Path,
    temporary: &Path,
) -> Result<bool, Failure> {
    let is_accepted = accepts(call, ended.end);
    let left = || paths(temporary).into_iter().next();
    let failure = of_process(call, ended)
        .or_else(|| left().map(|path| Failure("file left", format!("$TMPDIR/{path}"))))
        .or_else(|| changes(call, files, folder, is_accepted));
    failure.map_or(Ok(is_accepted), Err)
}

/// Exit code 0 or 3, or 4 where there are gates.
pub(super) fn accepts(call: &Call, end: End) -> bool {
    let has_gate = call.words.iter().any(|word| word.starts_with("--fail") || word.starts_with("--expect"));
    matches!(end, End::Exit(0 | 3)) || has_gate && end == End::Exit(4)
}

/// What is wrong with how it ended, or with what it printed.
fn of_process(call: &Call, ended: &Ended) -> Option<Failure> {
    let is_accepted = accepts(call, ended.end);
    if ended.end == End::Signal(TOO_LONG_A_FILE) {
        return Some(Failure::new("disk"));
    }
    let by_itself = Failure::of_process(ended).or(match ended.end {
        End::Exit(code @ (..0 | 4..)) if !is_accepted => Some(Failure("exit code", code.to_string())),
        _ => None,
    });
    let control = || control(&ended.stdout).or_else(|| control(&ended.stderr));
    let odd = by_itself.or_else(|| control().map(|c| Failure("control character", c)));
    let lines = String::from_utf8_lossy(&ended.stderr).lines().count();
    odd.or_else(|| match (is_accepted, lines) {
        (false, 0) => Some(Failure::new("refusal without a reason")),
        (false, _) if lines > MOST_LINES => Some(Failure("long refusal", format!("{lines} lines"))),
        (true, _) if call.is_json() && serde_json::from_slice::<Value>(&ended.stdout).is_err() => {
            Some(Failure::new("no JSON"))
        }
        _ => None,
    })
}

/// The first character that should not be printed: controls, marks of direction, other ends of lines.
fn control(text: &[u8]) -> Option<String> {
    let Ok(text) = std::str::from_utf8(text) else { return Some("no UTF-8".into()) };
    let is_odd = |c: char| {
        c.is_control() && c != '\n' && c != '\t'
            || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
            || matches!(c, '\u{2028}' | '\u{2029}')
    };
    text.chars().find(|&c| is_odd(c)).map(|c| c.escape_unicode().to_string())
}

/// What the command did to the files of its folder that it should not have done.
fn changes(call: &Call, files: &[File], folder: &Path, is_accepted: bool) -> Option<Failure> {
    let is_same =
        |file: &&File| std::fs::read(folder.join(&file.path)).is_ok_and(|bytes| bytes == file.bytes);
    if let Some(file) = files.iter().find(|file| !is_same(file)) {
        return Some(Failure("input changed", file.path.clone()));
    }
    let output = call.output.as_deref().filter(|_| is_accepted);
    let is_input = |path: &str| files.iter().any(|file| file.path == path);
    let is_output = |path: &str| output.is_some_and(|output| Path::new(path).starts_with(output));
    let left = paths(folder).into_iter().find(|path| !is_input(path) && !is_output(path));
    let missing = output.filter(|output| !folder.join(output).exists());
    left.map(|path| Failure("file left", path))
        .or_else(|| missing.map(|output| Failure("nothing written", output.to_owned())))
}

/// What a report says of damage: counts, notes, warnings.
const WARNED: [&str; 10] = [
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

/// Whether the scores differ from `sound`, those of the undamaged files, without a warning.
pub(super) fn silent(ended: &Ended, sound: &Value) -> Option<Failure> {
    let report = serde_json::from_slice::<Value>(&ended.stdout).ok()?;
    let is_warned = WARNED.iter().any(|path| report.pointer(path) != sound.pointer(path));
    if ended.end != End::Exit(0) || is_warned {
        return None;
    }
    let fields = ["dmp_mean_m2", "r_near_m2", "r_cv_m2", "returns", "surfels"];
    let of = |report: &Value, field: &str| report["runs"][0][field].clone();
    let field = fields.iter().find(|field| of(&report, field) != of(sound, field))?;
    let details = format!("{field} {} instead of {}", of(&report, field), of(sound, field));
    Some(Failure("other scores without a warning", details))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(end: End, stdout: &str, stderr: &str) -> Ended {
        Ended { end, stdout: stdout.into(), stderr: stderr.into() }
    }

    #[test]
    fn each_failure_is_found() {
        let call = Call::new("info a.mcap --json");
        let long = "x\n".repeat(30);
        for (end, stdout, stderr, expected) in [
            (End::Exit(0), "{}", "", None),
            (End::Exit(1), "", "error: x\n", None),
            (End::Exit(0), "{", "", Some("no JSON")),
            (End::Exit(1), "", "", Some("refusal without a reason")),
            (End::Exit(1), "", &long, Some("long refusal")),
            (End::Exit(4), "", "x", Some("exit code")),
            (End::Exit(101), "", "x", Some("panic")),
            (End::Exit(3), "{}", "thread 'a' panicked at b", Some("panic")),
            (End::Exit(1), "", "a\u{1b}[2J", Some("control character")),
            (End::TooLong, "", "", Some("hang")),
        ] {
            let failure = of_process(&call, &ended(end, stdout, stderr));
            assert_eq!(failure.map(|failure| failure.0), expected, "{end:?}");
        }
    }

    #[test]
    fn files_are_compared() {
        let folder = tempfile::tempdir().unwrap();
        let file = File { path: "a/b".into(), bytes: b"1".into(), form: None };
        let call = Call::new("convert log a/b -o out");
        let changes = |is_accepted| {
            changes(&call, std::slice::from_ref(&file), folder.path(), is_accepted).map(|failure| failure.0)
        };
        assert_eq!(changes(false), Some("input changed"));
        std::fs::create_dir(folder.path().join("a")).unwrap();
        std::fs::write(folder.path().join("a/b"), "1").unwrap();
        assert_eq!((changes(false), changes(true)), (None, Some("nothing written")));
        std::fs::create_dir(folder.path().join("out")).unwrap();
        assert_eq!((changes(true), changes(false)), (None, Some("file left")));
    }

    #[test]
    fn other_scores_need_a_warning() {
        let report = |score: f64, damage: &str| serde_json::json!({"inputs": {"damage": damage}, "runs": [{"returns": score}]});
        let sound = report(1.0, "");
        let of = |report: Value| silent(&ended(End::Exit(0), &report.to_string(), ""), &sound).is_some();
        assert!(!of(report(1.0, "")) && !of(report(2.0, "a chunk")) && of(report(2.0, "")));
    }
}
