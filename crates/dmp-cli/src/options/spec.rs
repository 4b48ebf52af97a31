//! A command: what it is called, which options it has, what it does; and its options with their values.

use std::fmt;
use std::io::Write;
use std::time::Duration;

use clap::parser::ValueSource;
use clap::{ArgMatches, Command};
use dmp::Config;

use super::option::{Entry, Opt};
use super::{output, scoring};
use crate::console::{Common, Exit, Printed, Usage};

/// How often an evaluation keeps what was done, where `--resume` does not say.
const KEEP_EVERY: Duration = Duration::from_secs(30);

/// Where results of a command go.
pub(crate) type Out<'a> = Printed<&'a mut (dyn Write + 'a)>;

/// What a command does.
type Run = fn(&Asked, &Common, &mut Out<'_>) -> anyhow::Result<Exit>;

/// A command.
pub(crate) struct Spec {
    pub(crate) name: &'static str,
    /// A sentence, for lists of commands.
    pub(crate) about: &'static str,
    /// What `--help` says besides.
    pub(crate) more: &'static str,
    /// How it is called, where the parser cannot derive it.
    pub(crate) usage: &'static str,
    /// Examples, files, exit codes.
    pub(crate) after: &'static str,
    /// Its options, in lists that commands share.
    pub(crate) options: &'static [&'static [&'static dyn Entry]],
    /// Options of other commands that it refuses, each with the reason.
    pub(crate) refused: &'static [(&'static dyn Entry, &'static str)],
    /// Adds what is not in the registry: the gates.
    pub(crate) extend: fn(Command) -> Command,
    /// Whether `-h` shows only the options that most people need.
    pub(crate) has_short_help: bool,
    pub(crate) commands: &'static [&'static Spec],
    pub(crate) run: Run,
}

impl fmt::Debug for Spec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Spec").field(&self.name).finish()
    }
}

impl Spec {
    /// A command without anything: what others differ from.
    pub(crate) const EMPTY: Self = Self {
        name: "",
        about: "",
        more: "",
        usage: "",
        after: "",
        options: &[],
        refused: &[],
        extend: |command| command,
        has_short_help: false,
        commands: &[],
        run: |_, _, _| Ok(Exit::WrongUsage),
    };

    /// Its options, without those that it refuses.
    pub(crate) fn entries(&self) -> impl Iterator<Item = &'static dyn Entry> {
        self.options.iter().flat_map(|list| list.iter().copied())
    }

    /// Its definition for the parser.
    pub(crate) fn clap(&'static self) -> Command {
        let mut command = Command::new(self.name);
        if !self.usage.is_empty() {
            command = command.override_usage(self.usage);
        }
        if self.has_short_help {
            let line = format!("`dmp {} --help` shows all options, and examples.", self.name);
            command = command.after_help(line).after_long_help(self.after);
        } else if !self.after.is_empty() {
            command = command.after_help(self.after);
        }
        let known = |name: &str| self.entries().any(|entry| entry.facts().name == name);
        for entry in self.entries() {
            command = command.arg(entry.arg(&known).hide_short_help(self.hides(entry.facts().is_short_help)));
        }
        for (entry, _) in self.refused {
            command = command.arg(entry.arg(&|_| false).hide(true));
        }
        // The gates would replace the description by their own.
        command = (self.extend)(command).about(self.about);
        if !self.more.is_empty() {
            command = command.long_about(format!("{}\n\n{}", self.about, self.more));
        }
        if self.has_short_help {
            let is_gate = |id: &str| !known(id) && !self.refuses(id);
            command =
                command.mut_args(|arg| match (is_gate(arg.get_id().as_str()), arg.get_id() == "expect") {
                    (true, false) => arg.hide_short_help(true),
                    _ => arg,
                });
        }
        if !self.commands.is_empty() {
            command = command.subcommand_required(true).arg_required_else_help(true);
        }
        command.subcommands(self.commands.iter().map(|spec| spec.clap()))
    }

    fn hides(&self, is_short_help: bool) -> bool {
        self.has_short_help && !is_short_help
    }

    fn refuses(&self, id: &str) -> bool {
        self.refused.iter().any(|(entry, _)| entry.facts().name == id)
    }

    /// Its definition for the parser, as the whole program.
    pub(crate) fn program(&'static self) -> Command {
        let command = self.clap().version(env!("CARGO_PKG_VERSION")).max_term_width(100);
        command.mut_arg(output::QUIET.name, |quiet| quiet.global(true))
    }

    /// The command of this program that was called, with its values.
    pub(crate) fn called(&'static self, mut matches: ArgMatches) -> Asked {
        let mut spec = self;
        while let Some((name, below)) = matches.remove_subcommand() {
            let Some(found) = spec.commands.iter().find(|spec| spec.name == name) else { break };
            (spec, matches) = (found, below);
        }
        Asked { program: self, spec, matches }
    }
}

/// A command line that was understood: the options of one command, and their values.
#[derive(Debug, Clone)]
pub(crate) struct Asked {
    program: &'static Spec,
    spec: &'static Spec,
    matches: ArgMatches,
}

impl Asked {
    /// The whole program, with all its commands.
    pub(crate) fn program(&self) -> Command {
        self.program.program()
    }

    pub(crate) fn spec(&self) -> &'static Spec {
        self.spec
    }

    /// For what is not in the registry: the gates.
    pub(crate) fn matches(&self) -> &ArgMatches {
        &self.matches
    }

    /// The value of an option, where it was given and the command has it.
    pub(crate) fn get<T: Clone + Send + Sync + 'static>(&self, option: &Opt<T>) -> Option<T> {
        self.matches.try_get_one::<T>(option.name).ok().flatten().cloned()
    }

    /// The values of an option that may be given several times.
    pub(crate) fn all<T: Clone + Send + Sync + 'static>(&self, option: &Opt<T>) -> Vec<T> {
        let values = self.matches.try_get_many::<T>(option.name).ok().flatten();
        values.into_iter().flatten().cloned().collect()
    }

    /// Whether a switch was given.
    pub(crate) fn has(&self, option: &Opt<bool>) -> bool {
        self.get(option) == Some(true)
    }

    /// The value of an option that the parser asks for.
    pub(crate) fn need<T: Clone + Send + Sync + 'static>(&self, option: &Opt<T>) -> Result<T, Usage> {
        self.get(option).ok_or_else(|| Usage(format!("{} is missing", option.name)))
    }

    /// The first option given that the command refuses, and the reason.
    pub(crate) fn refused(&self) -> Option<(&'static str, &'static str)> {
        let named = self.spec.refused.iter().map(|(entry, why)| (entry.facts().name, *why));
        named.into_iter().find(|(name, _)| self.matches.value_source(name) == Some(ValueSource::CommandLine))
    }

    /// An option with its values, as a command takes them.
    pub(crate) fn as_arguments(&self, entry: &dyn Entry) -> Vec<String> {
        let name = entry.facts().name;
        let values = self.matches.try_get_raw(name).ok().flatten();
        values.into_iter().flatten().map(|value| format!("--{name}={}", value.to_string_lossy())).collect()
    }

    fn knows(&self, name: &str) -> bool {
        self.spec.entries().any(|entry| entry.facts().name == name)
    }

    /// The settings: the defaults, and what the options set.
    pub(crate) fn config(&self) -> Config {
        let mut config = Config::default();
        if self.knows(scoring::MEMORY.name)
            && let Some(bytes) = dmp::machine_memory_bytes()
        {
            config.memory_bytes = (bytes / 4) as usize;
        }
        if self.knows(scoring::RESUME.name) {
            config.checkpoint_every = Some(KEEP_EVERY);
        }
        self.spec.entries().for_each(|entry| entry.set(&self.matches, &mut config));
        config
    }
}

#[cfg(test)]
mod tests {
    use clap::Command;

    use super::*;
    use crate::ROOT;

    fn walk(spec: &'static Spec, found: &mut Vec<&'static Spec>) {
        found.push(spec);
        spec.commands.iter().for_each(|spec| walk(spec, found));
    }

    /// Every option of every command: it says what it is, and the value that it parses is one that the command reads.
    #[test]
    fn every_option_parses_its_example() {
        let mut specs = Vec::new();
        walk(&ROOT, &mut specs);
        for spec in specs {
            for entry in spec.entries() {
                let facts = entry.facts();
                let place = format!("dmp {} {}", spec.name, facts.name);
                let arg = entry.arg(&|_| false).required(false);
                assert!(arg.get_help().is_some_and(|help| !help.to_string().is_empty()), "{place}");
                let mut words = vec!["dmp".to_owned()];
                match (facts.is_argument, facts.is_switch) {
                    (true, _) => words.extend(facts.example.split(' ').map(str::to_owned)),
                    (_, true) => words.push(format!("--{}", facts.name)),
                    _ if facts.example.contains(' ') => {
                        words.push(format!("--{}", facts.name));
                        words.extend(facts.example.split(' ').map(str::to_owned));
                    }
                    _ => words.push(format!("--{}={}", facts.name, facts.example)),
                }
                let matches = Command::new("dmp").arg(arg).try_get_matches_from(words);
                assert!(matches.is_ok_and(|matches| entry.is_typed(&matches)), "{place}");
            }
        }
    }

    #[test]
    fn short_help_shows_what_most_people_need() {
        let options =
            || crate::commands::score::SPEC.entries().map(Entry::facts).filter(|facts| !facts.is_argument);
        // Those for gates, and --quiet and --help.
        assert!(options().count() + 2 + 2 <= 45);
        assert!(options().filter(|facts| facts.is_short_help).count() <= 10);
        let short = crate::commands::score::SPEC.clap().render_help().to_string();
        assert!(short.contains("--report") && !short.contains("--voxel"), "{short}");
        assert!(short.contains("`dmp score --help` shows all options"), "{short}");
        assert!(short.starts_with("Score runs on a log, and rank them"), "{short}");
    }
}
