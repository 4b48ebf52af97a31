//! An option: all that is known of it, and its definition for the parser.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::builder::{OsStringValueParser, PossibleValuesParser, TypedValueParser as _};
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches};
use dmp::Config;

use crate::named::NamedFile;

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
    pub(super) short: Option<char>,
    pub(super) group: Group,
    /// What the value is called; empty of a switch.
    pub(super) value: &'static str,
    /// The value where the option is given without one.
    pub(super) alone: Option<&'static str>,
    /// How many values follow one another, where that is not one.
    pub(super) count: Option<(usize, usize)>,
    pub(super) is_many: bool,
    pub(super) is_needed: bool,
    /// An argument, known by its place.
    pub(super) is_argument: bool,
    /// Whether `-h` shows it; `--help` shows all.
    pub(super) is_short_help: bool,
    pub(super) is_hidden: bool,
    /// Whether a value may begin with a minus.
    pub(super) is_signed: bool,
    pub(super) role: Role,
    pub(super) conflicts: &'static [&'static dyn Entry],
    pub(super) requires: &'static [&'static dyn Entry],
    /// In place of this one the other may be given.
    pub(super) unless: Option<&'static dyn Entry>,
    /// Another spelling of the name.
    pub(super) alias: Option<&'static str>,
    /// A value as an example; the tests parse it.
    pub(super) example: &'static str,
    pub(super) help: &'static str,
    pub(super) parse: Parse<T>,
    pub(super) sets: Option<fn(&mut Config, T)>,
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
    pub(super) const fn new(group: Group, name: &'static str, value: &'static str, parse: Parse<T>) -> Self {
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
    pub(super) const fn text(
        group: Group,
        name: &'static str,
        value: &'static str,
        example: &'static str,
        parse: fn(&str) -> Result<T, String>,
    ) -> Self {
        Self { example, ..Self::new(group, name, value, Parse::Text(parse)) }
    }

    /// An option whose value is one of some words.
    pub(super) const fn words(
        group: Group,
        name: &'static str,
        value: &'static str,
        words: &'static [(&'static str, T)],
    ) -> Self {
        Self { role: Role::Word, example: words[0].0, ..Self::new(group, name, value, Parse::Words(words)) }
    }
}

impl Opt<bool> {
    pub(super) const fn switch(group: Group, name: &'static str) -> Self {
        Self::new(group, name, "", Parse::Text(|_| Ok(true)))
    }
}

impl Opt<PathBuf> {
    pub(super) const fn path(group: Group, name: &'static str, value: &'static str, role: Role) -> Self {
        Self { role, example: "a/b", ..Self::new(group, name, value, Parse::Path(PathBuf::from)) }
    }

    /// What a command makes, `-o`: it must be given.
    pub(super) const fn output(group: Group, value: &'static str) -> Self {
        Self { short: Some('o'), is_needed: true, ..Self::path(group, "output", value, Role::Written) }
    }

    /// An argument that is a path.
    pub(super) const fn argument(name: &'static str, value: &'static str) -> Self {
        Self { is_argument: true, is_needed: true, ..Self::path(Group::Plain, name, value, Role::Read) }
    }
}

impl Opt<NamedFile> {
    pub(super) const fn file(group: Group, name: &'static str, value: &'static str) -> Self {
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
