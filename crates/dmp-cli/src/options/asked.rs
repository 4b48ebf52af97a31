//! The options of a command, with their values.

use std::time::Duration;

use clap::parser::ValueSource;
use clap::{ArgMatches, Command};
use dmp::Config;

use super::option::{Entry, Opt};
use super::{Spec, scoring};
use crate::exit::Usage;

/// How often an evaluation keeps what was done, where `--resume` does not say.
pub(crate) const KEEP_EVERY: Duration = Duration::from_secs(30);

/// A command line that was understood: the options of one command, and their values.
#[derive(Debug, Clone)]
pub(crate) struct Asked {
    program: &'static Spec,
    spec: &'static Spec,
    matches: ArgMatches,
}

impl Asked {
    fn new(program: &'static Spec, spec: &'static Spec, matches: ArgMatches) -> Self {
        Self { program, spec, matches }
    }

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
