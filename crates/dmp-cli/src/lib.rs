//! The command `dmp`: score LiDAR SLAM runs without ground truth.
//!
//! # Brief overview
//! [`main`] is the whole command, and [`run`] the same with other arguments. [`run_for`] is for programs that run commands
//! beside other work: results go into a writer, lines and progress to a [`Host`], which may stop it, and an error comes
//! back as a [`Failure`].
//! Each subcommand is a module with its `Spec` and a function that does it; `options` has what may be asked of them. Results
//! go to standard output, everything else (progress, notes, errors) to standard error. What a user of the libraries would
//! miss does not belong here.

mod commands;
mod console;
#[cfg(test)]
mod example_reports;
mod files;
mod gates;
mod guard;
mod help;
mod inputs;
mod named;
mod options;

use std::ffi::OsString;
use std::io::{self, Write as _};
use std::process::ExitCode;
use std::sync::Arc;

use anstream::AutoStream;

use console::Common;
use console::Hosted;
use console::Terminal;
pub use console::{Exit, Failure, FailureKind, Host};
use console::{Printed, commands_anywhere};
use console::{is_closed_pipe, one_line, when_printed};
use dmp_log::is_printable;
use guard::Results;
pub use help::{HelpBody, HelpPart, help_parts};
use options::{Asked, Out, Spec, output};

/// The command, with its commands in the order of the help.
static ROOT: Spec = Spec {
    name: "dmp",
    about: "Scores LiDAR SLAM runs without ground truth: which trajectory explains the scans best?",
    after: "Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but input was lost or damaged; 4 a gate failed; \
            5 done, but a file beside the result could not be written; 130 interrupted.",
    options: &[&[&output::QUIET]],
    commands: &[
        &commands::score::SPEC,
        &commands::calibrate::SPEC,
        &commands::compare::SPEC,
        &commands::suite::SPEC,
        &commands::drift::SPEC,
        &commands::repair::SPEC,
        &commands::loops::SPEC,
        &commands::map::SPEC,
        &commands::info::SPEC,
        &commands::shard::SPEC,
        &commands::convert::SPEC,
        &commands::truth::SPEC,
        &commands::simulate::SPEC,
        &help::completions::SPEC,
        &help::manual::SPEC,
    ],
    ..Spec::EMPTY
};

/// The command, with the arguments of this process.
pub fn main() -> ExitCode {
    console::process::begin_again_with_memory_given_back();
    run_process(std::env::args_os()).into()
}

/// The command, with these arguments, in a process that does nothing else: interrupts end it in order, and what is asked a
/// second time ends the process at once.
pub fn run_process(arguments: impl IntoIterator<Item = OsString>) -> Exit {
    console::process::prepare();
    run(arguments)
}

/// The definition of the command, with all that `--help` says.
pub fn command() -> clap::Command {
    ROOT.program()
}

/// Whether a text has characters that end lines or command terminals.
fn has_foreign(text: &str) -> bool {
    text.chars().any(|c| !is_printable(c))
}

/// A command line that the parser has understood.
struct Understood {
    asked: Asked,
    common: Common,
    /// What is wrong with its files is reported when the command begins.
    results: anyhow::Result<Results>,
}

/// What the parser says instead.
enum Answer {
    /// Characters in an argument that cannot be printed in a line.
    Foreign(String),
    /// What is wrong, or help, or the version.
    Parser(clap::Error),
}

impl Understood {
    fn of(arguments: impl IntoIterator<Item = OsString>) -> Result<Self, Answer> {
        let arguments: Vec<OsString> = arguments.into_iter().collect();
        if let Some(foreign) =
            arguments.iter().map(|text| text.to_string_lossy()).find(|text| has_foreign(text))
        {
            return Err(Answer::Foreign(foreign.into_owned()));
        }
        let matches = command().try_get_matches_from(arguments).map_err(Answer::Parser)?;
        let asked = ROOT.called(matches);
        let common = Common { quiet: asked.has(&output::QUIET), ..Common::default() };
        Ok(Self { results: guard::check(&asked), asked, common })
    }

    /// Runs it; what was found before something failed is printed too.
    fn run(self, mut sink: impl io::Write) -> anyhow::Result<Exit> {
        let Self { asked, common, results } = self;
        let mut out: Out<'_> = Printed::new(&mut sink as &mut dyn io::Write);
        out.has_colour = common.terminal.has_colour;
        let done = results.and_then(|_| (asked.spec().run)(&asked, &common, &mut out));
        let printed = out.flush().map_err(Into::into);
        done.and_then(|exit| when_printed(printed, exit))
    }
}

/// The command, with these arguments; the first is the name of the program.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> Exit {
    let mut understood = match Understood::of(arguments) {
        Ok(understood) => understood,
        Err(Answer::Foreign(foreign)) => {
            console::say::line(format_args!("error: {}", foreign_in_words(&foreign)));
            return Exit::WrongUsage;
        }
        Err(Answer::Parser(error)) => {
            let text = error.render().to_string();
            let printed = if error.use_stderr() && commands_anywhere(&text) {
                let mut out = Printed::new(io::stderr());
                out.write_all(text.as_bytes()).and_then(|()| out.flush())
            } else {
                // In colour where that is seen. Help and version are printed here too.
                error.print().and_then(|()| io::stdout().flush())
            };
            return match printed {
                _ if error.use_stderr() => Exit::WrongUsage,
                Err(error) => ended(Err(console::say::of_results(&error).into())),
                Ok(()) => Exit::Done,
            };
        }
    };
    let sink: Box<dyn io::Write> = match &understood.results {
        Ok(Results::Aside) if understood.common.quiet => Box::new(io::sink()),
        Ok(Results::Aside) => Box::new(io::stderr()),
        _ => {
            understood.common.terminal = Terminal::of_stdout();
            if understood.common.terminal.has_colour {
                // Where colours are no text, as in old consoles of Windows, it makes them what they are there.
                Box::new(AutoStream::always(io::stdout().lock()))
            } else {
                Box::new(io::stdout().lock())
            }
        }
    };
    ended(understood.run(sink))
}

/// The command, run by another program: results go into `out`, all else to the host. Commands of several threads go their
/// own ways.
///
/// ```
/// # use std::sync::Arc;
/// #[derive(Debug)]
/// struct Quiet;
/// impl dmp_cli::Host for Quiet {
///     fn say(&self, _: &str) {}
///     fn begin(&self, _: &'static str, _: &'static str, _: Option<u64>) {}
///     fn advance(&self, _: u64) {}
///     fn is_cancelled(&self) -> bool { false }
/// }
///
/// let mut out = Vec::new();
/// let arguments = ["dmp", "info", "/no/such/log.mcap"].map(Into::into);
/// let failure = dmp_cli::run_for(arguments, &mut out, Arc::new(Quiet)).unwrap_err();
/// assert_eq!(failure.kind, dmp_cli::FailureKind::Usage);
/// assert!(failure.line.starts_with("/no/such/log.mcap: "));
/// ```
///
/// # Errors
/// Where the command fails; what it found before is in `out`.
pub fn run_for(
    arguments: impl IntoIterator<Item = OsString>,
    out: &mut impl io::Write,
    host: Arc<dyn Host>,
) -> Result<Exit, Failure> {
    let mut understood = match Understood::of(arguments) {
        Ok(understood) => understood,
        Err(answer) => {
            let help = answer.refused()?.render().to_string();
            let written = out.write_all(help.as_bytes());
            return written.map(|()| Exit::Done).map_err(|error| Failure::of(&error.into()));
        }
    };
    understood.common.host = Hosted::by(host);
    understood.run(out).map_err(|error| Failure::of(&error))
}

/// Whether the parser understands these arguments, and no output takes the place of an input; nothing is done. For programs
/// that have work of their own before they run a command.
///
/// ```
/// let wrong = ["dmp", "info", "a.mcap", "--no-such-option"].map(Into::into);
/// assert_eq!(dmp_cli::check(wrong).unwrap_err().kind, dmp_cli::FailureKind::Usage);
/// assert!(dmp_cli::check(["dmp", "info", "not-there-yet.mcap"].map(Into::into)).is_ok());
/// ```
///
/// # Errors
/// What [`run_for`] fails with at once.
pub fn check(arguments: impl IntoIterator<Item = OsString>) -> Result<(), Failure> {
    match Understood::of(arguments) {
        Ok(Understood { results, .. }) => results.map(|_| ()).map_err(|error| Failure::of(&error)),
        Err(answer) => answer.refused().map(|_| ()),
    }
}

impl Answer {
    /// What is wrong as a failure; else what was asked for, help or the version.
    fn refused(self) -> Result<clap::Error, Failure> {
        match self {
            Self::Foreign(foreign) => {
                Err(Failure::new(FailureKind::Usage, format_args!("{}", foreign_in_words(&foreign))))
            }
            Self::Parser(error) if error.use_stderr() => Err(Failure::refused(&error)),
            Self::Parser(help) => Ok(help),
        }
    }
}

fn foreign_in_words(foreign: &str) -> String {
    format!("`{foreign}`: control characters in a name cannot be printed: rename it")
}

/// How the command ends; prints an error.
fn ended(done: anyhow::Result<Exit>) -> Exit {
    match done {
        Ok(exit) => exit,
        Err(error) if is_closed_pipe(&error) => Exit::Done,
        Err(error) => {
            console::say::line(format_args!("error: {}", one_line(&error)));
            FailureKind::of(&error).into()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exit_of(arguments: &[&str]) -> Exit {
        run(["dmp"].iter().chain(arguments).map(OsString::from))
    }

    #[test]
    fn the_definition_of_the_arguments_is_sound() {
        command().debug_assert();
    }

    #[test]
    fn exit_codes_are_as_promised() {
        assert_eq!(exit_of(&["--version"]), Exit::Done);
        assert_eq!(exit_of(&[]), Exit::WrongUsage);
        assert_eq!(exit_of(&["no-such-command"]), Exit::WrongUsage);
        assert_eq!(exit_of(&["simulate", "errors", "in.tum", "-o", "out.tum"]), Exit::WrongUsage);
        let missing = ["simulate", "errors", "/no/such/file.tum", "--scale", "1.1", "-o", "/no/such/out.tum"];
        assert_eq!(exit_of(&missing), Exit::WrongUsage);
        let exits = [Exit::InputDamaged, Exit::GateFailed, Exit::OutputFailed, Exit::Interrupted];
        assert_eq!(exits.map(|exit| exit as u8), [3, 4, 5, 130]);
    }
}
