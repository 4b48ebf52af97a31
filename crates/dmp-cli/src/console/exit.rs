//! How the command ends: exit codes, and errors in a line.

use std::process::ExitCode;
use std::{fmt, io};

use dmp::{EvaluateError, SettingName};
use dmp_log::{LogError, LogSetting};
use dmp_suite::JoinError;
use dmp_truth::surface::SurfaceError;

use super::say::as_line;

/// How a command ended. Scripts rely on the codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Exit {
    /// 0: done.
    Done,
    /// 1: failed; standard error says why.
    Failed,
    /// 2: the command line is wrong.
    WrongUsage,
    /// 3: done, but input was lost or damaged; the output names it.
    InputDamaged,
    /// 4: done, and a gate that was asked for failed.
    GateFailed,
    /// 5: done, and the result is printed, but a file beside it could not be written.
    OutputFailed,
    /// 130: stopped by Ctrl-C or a request to end, nothing left behind.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Something wrong with the command line that its parser cannot see. Ends with [`Exit::WrongUsage`].
#[derive(Debug)]
pub(crate) struct Usage(pub(crate) String);

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// A file that was given and is not what it was given for.
#[derive(Debug)]
pub(crate) struct Unreadable(pub(crate) anyhow::Error);

impl fmt::Display for Unreadable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Unreadable {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source()
    }
}

/// Whether the command was used wrongly, rather than the data or the machine being at fault.
fn is_usage(error: &anyhow::Error) -> bool {
    error.is::<Usage>()
        || error.downcast_ref::<EvaluateError>().is_some_and(EvaluateError::is_usage)
        || error.downcast_ref::<JoinError>().is_some_and(JoinError::is_usage)
        || error.downcast_ref::<LogError>().is_some_and(LogError::is_usage)
        || error.downcast_ref::<SurfaceError>().is_some_and(SurfaceError::is_usage)
}

/// Whether somebody stopped the command.
pub(crate) fn is_interrupt(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(EvaluateError::Cancelled))
        || matches!(error.downcast_ref(), Some(SurfaceError::Cancelled))
}

/// Why a command failed, for a program that runs it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    /// What is at fault.
    pub kind: FailureKind,
    /// What the command prints after `error: `, one line.
    pub line: String,
}

/// What is at fault where a command fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FailureKind {
    /// The command line: exit code 2.
    Usage,
    /// A file that cannot be read as what it was given for: exit code 1.
    Input,
    /// Anything else, such as a full disk: exit code 1.
    Failed,
    /// Somebody asked to stop: exit code 130.
    Interrupted,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.line)
    }
}

impl std::error::Error for Failure {}

impl Failure {
    pub(crate) fn new(kind: FailureKind, text: fmt::Arguments<'_>) -> Self {
        Self { kind, line: as_line(text) }
    }

    /// What the parser says of a wrong command line, up to its hints, in one line.
    pub(crate) fn refused(error: &clap::Error) -> Self {
        let text = error.render().to_string();
        let text = text.strip_prefix("error: ").unwrap_or(&text);
        let first = text.lines().take_while(|line| !line.trim().is_empty()).map(str::trim);
        Self::new(FailureKind::Usage, format_args!("{}", first.collect::<Vec<_>>().join(" ")))
    }

    pub(crate) fn of(error: &anyhow::Error) -> Self {
        Self::new(FailureKind::of(error), format_args!("{}", one_line(error)))
    }
}

impl FailureKind {
    pub(crate) fn of(error: &anyhow::Error) -> Self {
        if is_interrupt(error) {
            Self::Interrupted
        } else if is_usage(error) {
            Self::Usage
        } else if is_of_input(error) {
            Self::Input
        } else {
            Self::Failed
        }
    }
}

impl From<FailureKind> for Exit {
    fn from(kind: FailureKind) -> Self {
        match kind {
            FailureKind::Usage => Self::WrongUsage,
            FailureKind::Input | FailureKind::Failed => Self::Failed,
            FailureKind::Interrupted => Self::Interrupted,
        }
    }
}

/// Whether a file that was given could not be understood.
fn is_of_input(error: &anyhow::Error) -> bool {
    let is_of_file = |cause: &(dyn std::error::Error + 'static)| {
        let of_log = match cause.downcast_ref() {
            Some(EvaluateError::Log(error)) => Some(error),
            _ => cause.downcast_ref::<LogError>(),
        };
        let of_returns = matches!(cause.downcast_ref(), Some(JoinError::Returns { .. }));
        cause.is::<Unreadable>() || of_returns || of_log.is_some_and(|error| !error.is_of_writing())
    };
    error.chain().any(is_of_file)
}

/// The error and its causes in one line, joined by `: `. A cause that its error repeats is printed once.
pub(crate) fn one_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain() {
        let text = in_words(cause).replace(['\n', '\r'], " ");
        if line.is_empty() {
            line = text;
        } else if !line.ends_with(&text) {
            line = format!("{line}: {text}");
        }
    }
    line
}

/// What an error says; settings are called by the options of the command line.
fn in_words(cause: &(dyn std::error::Error + 'static)) -> String {
    match (cause.downcast_ref(), cause.downcast_ref::<LogError>()) {
        (Some(EvaluateError::Log(error)), _) | (_, Some(error)) => error.message_with(&option_of_log),
        (Some(error @ EvaluateError::SameName { .. }), _) => format!("{error}, as NAME=FILE"),
        (Some(error), _) => error.message_with(&option_of),
        (None, None) => cause.to_string(),
    }
}

/// The option that a setting is called by.
pub(crate) fn option_of(setting: SettingName) -> String {
    match setting {
        SettingName::WorkFolder => "--work".into(),
        SettingName::SaveMaps => "-o".into(),
        SettingName::Ranges => "--min-range and --max-range".into(),
        SettingName::StampAt => "--stamp".into(),
        other => format!("--{other}"),
    }
}

fn option_of_log(setting: LogSetting) -> String {
    match setting {
        LogSetting::Topic => "--topic".into(),
        LogSetting::PointTime | LogSetting::PointTimeField => "--point-time".into(),
        LogSetting::StampAt => "--stamp".into(),
        LogSetting::BinLayout => "--bin-layout".into(),
        LogSetting::MadeWith => "`dmp convert log --made-with`".into(),
        LogSetting::TimeOffset => "--time-offset".into(),
        other => other.to_string(),
    }
}

/// How a command ends whose output was printed, or was to be: what was found stands where nobody reads on.
pub(crate) fn when_printed(printed: anyhow::Result<()>, exit: Exit) -> anyhow::Result<Exit> {
    match printed {
        Err(error) if !is_closed_pipe(&error) => Err(error),
        _ => Ok(exit),
    }
}

/// Whether whoever read the output has read enough (`dmp … | head`). Reading stops; that is no failure.
pub(crate) fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context as _;

    #[test]
    fn causes_are_printed_once_in_one_line() {
        let cause = std::io::Error::other("disk\nfull");
        let error = anyhow::Error::new(cause).context("a.tum: cannot write: disk full").context("saving");
        assert_eq!(one_line(&error), "saving: a.tum: cannot write: disk full");
        let plain = Err::<(), _>(Usage("no poses".into())).context("a.tum").unwrap_err();
        assert_eq!(one_line(&plain), "a.tum: no poses");
    }

    #[test]
    fn a_full_disk_is_no_fault_of_the_input() {
        let of = |doing, kind: std::io::ErrorKind| {
            let error = LogError::Io { path: "a.mcap".into(), doing, source: kind.into() };
            let evaluated = EvaluateError::Log(error);
            FailureKind::of(&anyhow::Error::new(evaluated).context("a"))
        };
        assert_eq!(of("write", std::io::ErrorKind::StorageFull), FailureKind::Failed);
        assert_eq!(of("create", std::io::ErrorKind::PermissionDenied), FailureKind::Failed);
        assert_eq!(of("read", std::io::ErrorKind::Other), FailureKind::Input);
        let unreadable = anyhow::Error::new(Unreadable(anyhow::anyhow!("no `schema`"))).context("a.json");
        assert_eq!(FailureKind::of(&unreadable), FailureKind::Input);
        assert_eq!(one_line(&unreadable), "a.json: no `schema`");
    }

    #[test]
    fn settings_are_called_by_their_options() {
        let error = || LogError::SeveralTopics { path: "a.mcap".into(), topics: "/a, /b".into() };
        let line = "a.mcap: several topics hold scans, name one with --topic: /a, /b";
        assert_eq!(one_line(&error().into()), line);
        assert_eq!(one_line(&EvaluateError::Log(error()).into()), line);
        assert!(error().to_string().contains("name one with `topic`: /a"));
        let error = EvaluateError::SameName { name: "a".into() };
        assert_eq!(one_line(&error.into()), "two runs are named `a`: give each its own name, as NAME=FILE");
    }
}
