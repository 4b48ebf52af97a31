//! The options of the command: one value for each, and all that is known of an option is in that value.
//!
//! An [`Opt`] names an option, its group, its help, how its value is parsed, whether it names a file, and which field of
//! [`Config`] it sets. Help, manual pages, completions, the Python keywords, the options of a suite and the files that
//! [`guard`](crate::guard) protects all come from there. A [`Spec`] is a command: a list of options and a function.
//! A new option that sets a field of [`Config`] is one [`Opt`], and its name in the list of a command.

pub(crate) mod extrinsic;
pub(crate) mod graph;
pub(crate) mod input;
pub(crate) mod output;
pub(crate) mod scoring;
pub(crate) mod simulate;
mod spec;
pub(crate) mod tools;
pub(crate) mod truth;
pub(crate) mod values;

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{OsStringValueParser, PossibleValuesParser, TypedValueParser as _};
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command};
use dmp::Config;

use crate::exit::Usage;
use crate::named::NamedFile;
pub(crate) use spec::{Out, Spec};

/// How often an evaluation keeps what was done, where `--resume` does not say.
pub(crate) const KEEP_EVERY: Duration = Duration::from_secs(30);

/// Where options stand in the help.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Group {
    /// Without a heading: those of small commands, and arguments.
    Plain,
    Input,
    PlaceAndTime,
    ReturnsAndMap,
    Verdicts,
    Sampling,
    Resources,
    Output,
    Cache,
    Graph,
    Acceptance,
    Speed,
    Alignment,
    Error,
    Time,
    Pairs,
    Measure,
}

impl Group {
    fn heading(self) -> Option<&'static str> {
        Some(match self {
            Self::Plain => return None,
            Self::Input => "Input",
            Self::PlaceAndTime => "Place and time",
            Self::ReturnsAndMap => "Returns and map",
            Self::Verdicts => "Verdicts",
            Self::Sampling => "Sampling",
            Self::Resources => "Resources",
            Self::Output => "Output",
            Self::Cache => "Cache",
            Self::Graph => "Graph",
            Self::Acceptance => "Acceptance",
            Self::Speed => "Speed",
            Self::Alignment => "Alignment",
            Self::Error => "Error",
            Self::Time => "Time",
            Self::Pairs => "Pairs",
            Self::Measure => "Measure",
        })
    }

    /// Whether its options change what is scored; those of other groups choose what is written, and by which means.
    pub(crate) fn changes_scores(self) -> bool {
        use Group::{Input, PlaceAndTime, ReturnsAndMap, Sampling, Verdicts};
        matches!(self, Input | PlaceAndTime | ReturnsAndMap | Verdicts | Sampling)
    }
}

/// What a value is to the file system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// It is no path. It may hold one all the same, as `calib:FILE`.
    Value,
    /// One of some words, whatever file has that name.
    Word,
    /// A file that is read.
    Read,
    /// A file that is written.
    Written,
    /// A file of each run, `FILE` becoming `FILE` with the name of the run in it.
    WrittenByRun,
    /// A folder of pictures.
    Pictures,
    /// A folder for the command's own files.
    Scratch,
}

/// How the text of a value becomes a `T`.
pub(crate) enum Parse<T: 'static> {
    Text(fn(&str) -> Result<T, String>),
    Path(fn(OsString) -> T),
    /// One of some words.
    Words(&'static [(&'static str, T)]),
}

/// An option or an argument.
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of the table")]
pub(crate) struct Opt<T: 'static> {
    /// The long name; of an argument what it is called.
    pub(crate) name: &'static str,
    short: Option<char>,
    group: Group,
    /// What the value is called; empty of a switch.
    value: &'static str,
    /// The value where the option is given without one.
    alone: Option<&'static str>,
    /// How many values follow one another, where that is not one.
    count: Option<(usize, usize)>,
    is_many: bool,
    is_needed: bool,
    /// An argument, known by its place.
    is_argument: bool,
    /// Whether `-h` shows it; `--help` shows all.
    is_short_help: bool,
    /// Whether `--like` sets it.
    is_set_by_like: bool,
    is_hidden: bool,
    /// Whether a value may begin with a minus.
    is_signed: bool,
    role: Role,
    conflicts: &'static [&'static dyn Entry],
    requires: &'static [&'static dyn Entry],
    /// In place of this one the other may be given.
    unless: Option<&'static dyn Entry>,
    /// Another spelling of the name.
    alias: Option<&'static str>,
    /// A value as an example; the tests parse it.
    example: &'static str,
    help: &'static str,
    parse: Parse<T>,
    sets: Option<fn(&mut Config, T)>,
}

/// What is known of an option whatever the type of its value.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of the table")]
pub(crate) struct Facts {
    pub(crate) name: &'static str,
    pub(crate) group: Group,
    pub(crate) role: Role,
    pub(crate) is_switch: bool,
    pub(crate) is_argument: bool,
    pub(crate) is_short_help: bool,
    pub(crate) is_set_by_like: bool,
    /// Whether the value is optional.
    pub(crate) may_be_alone: bool,
    #[cfg_attr(not(test), expect(dead_code, reason = "examples are for the tests"))]
    pub(crate) example: &'static str,
}

/// An option, whatever the type of its value.
pub(crate) trait Entry: Sync {
    fn facts(&self) -> Facts;
    /// For the parser. Of `known` are the options of the command: others are not spoken of.
    fn arg(&self, known: &dyn Fn(&str) -> bool) -> Arg;
    /// Sets what it sets, where it was given.
    fn set(&self, matches: &ArgMatches, config: &mut Config);
    /// Whether a value of its type was given.
    #[cfg(test)]
    fn is_typed(&self, matches: &ArgMatches) -> bool;
}

impl<T: Clone + Send + Sync + 'static> Opt<T> {
    const fn new(group: Group, name: &'static str, value: &'static str, parse: Parse<T>) -> Self {
        Self {
            name,
            short: None,
            group,
            value,
            alone: None,
            count: None,
            is_many: false,
            is_needed: false,
            is_argument: false,
            is_short_help: false,
            is_set_by_like: false,
            is_hidden: false,
            is_signed: false,
            role: Role::Value,
            conflicts: &[],
            requires: &[],
            unless: None,
            alias: None,
            example: "",
            help: "",
            parse,
            sets: None,
        }
    }

    /// An option with a value that is parsed from text, and an example of such a text.
    const fn text(
        group: Group,
        name: &'static str,
        value: &'static str,
        example: &'static str,
        parse: fn(&str) -> Result<T, String>,
    ) -> Self {
        Self { example, ..Self::new(group, name, value, Parse::Text(parse)) }
    }

    /// An option whose value is one of some words.
    const fn words(
        group: Group,
        name: &'static str,
        value: &'static str,
        words: &'static [(&'static str, T)],
    ) -> Self {
        Self { role: Role::Word, example: words[0].0, ..Self::new(group, name, value, Parse::Words(words)) }
    }
}

impl Opt<bool> {
    const fn switch(group: Group, name: &'static str) -> Self {
        Self::new(group, name, "", Parse::Text(|_| Ok(true)))
    }
}

impl Opt<PathBuf> {
    const fn path(group: Group, name: &'static str, value: &'static str, role: Role) -> Self {
        Self { role, example: "a/b", ..Self::new(group, name, value, Parse::Path(PathBuf::from)) }
    }

    /// What a command makes, `-o`: it must be given.
    const fn output(group: Group, value: &'static str) -> Self {
        Self { short: Some('o'), is_needed: true, ..Self::path(group, "output", value, Role::Written) }
    }

    /// An argument that is a path.
    const fn argument(name: &'static str, value: &'static str) -> Self {
        Self { is_argument: true, is_needed: true, ..Self::path(Group::Plain, name, value, Role::Read) }
    }
}

impl Opt<NamedFile> {
    const fn file(group: Group, name: &'static str, value: &'static str) -> Self {
        let parse = Parse::Path(NamedFile::from);
        Self { role: Role::Read, example: "a=b.tum", ..Self::new(group, name, value, parse) }
    }
}

impl<T: Clone + Send + Sync + 'static> Entry for Opt<T> {
    fn facts(&self) -> Facts {
        Facts {
            name: self.name,
            group: self.group,
            role: self.role,
            is_switch: self.value.is_empty(),
            is_argument: self.is_argument,
            is_short_help: self.is_short_help || self.is_argument,
            is_set_by_like: self.is_set_by_like,
            may_be_alone: self.alone.is_some(),
            example: self.example,
        }
    }

    fn arg(&self, known: &dyn Fn(&str) -> bool) -> Arg {
        let mut arg = Arg::new(self.name).help(self.help).hide(self.is_hidden);
        arg = if self.is_argument { arg } else { arg.long(self.name) };
        arg = self.group.heading().map_or(arg.clone(), |heading| arg.help_heading(heading));
        arg = self.alias.map_or(arg.clone(), |alias| arg.alias(alias));
        arg = self.short.map_or(arg.clone(), |short| arg.short(short));
        let names = |entries: &[&'static dyn Entry]| -> Vec<&'static str> {
            entries.iter().map(|entry| entry.facts().name).filter(|name| known(name)).collect()
        };
        arg = arg.conflicts_with_all(names(self.conflicts));
        arg = names(self.requires).into_iter().fold(arg, Arg::requires);
        arg = match self.unless.map(|other| other.facts().name).filter(|name| known(name)) {
            Some(other) => arg.required_unless_present(other),
            None => arg.required(self.is_needed),
        };
        if self.value.is_empty() {
            return arg.action(ArgAction::SetTrue);
        }
        arg = arg.action(if self.is_many { ArgAction::Append } else { ArgAction::Set });
        arg = match self.value.split_once(' ') {
            Some((first, second)) if self.count.is_some() && !self.is_argument => {
                arg.value_names([first, second])
            }
            _ => arg.value_name(self.value),
        };
        arg = arg.allow_hyphen_values(self.is_signed);
        if let Some(alone) = self.alone {
            arg = arg.num_args(0..=1).require_equals(true).default_missing_value(alone);
        }
        match self.count {
            Some((least, usize::MAX)) => arg = arg.num_args(least..),
            Some((least, most)) => arg = arg.num_args(least..=most),
            None if self.is_argument && self.is_many => arg = arg.num_args(1..),
            None => {}
        }
        match self.parse {
            Parse::Text(parse) => arg.value_parser(parse),
            Parse::Path(path) => arg.value_parser(OsStringValueParser::new().map(path)),
            Parse::Words(words) => {
                let known = PossibleValuesParser::new(words.iter().map(|(word, _)| *word));
                let meaning = move |given: String| {
                    words.iter().find(|(word, _)| *word == given).map(|(_, meaning)| meaning.clone())
                };
                arg.value_parser(known.try_map(move |given| meaning(given).ok_or("unknown")))
            }
        }
    }

    fn set(&self, matches: &ArgMatches, config: &mut Config) {
        let Some(sets) = self.sets else { return };
        if matches.value_source(self.name) == Some(ValueSource::CommandLine) {
            let values = matches.try_get_many::<T>(self.name).ok().flatten();
            values.into_iter().flatten().for_each(|value| sets(config, value.clone()));
        }
    }

    #[cfg(test)]
    fn is_typed(&self, matches: &ArgMatches) -> bool {
        matches.try_get_one::<T>(self.name).is_ok_and(|value| value.is_some())
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
