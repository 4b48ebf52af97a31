//! The options of commands, for keywords of the same names.

use clap::builder::PossibleValue;
use clap::{Arg, ArgAction, Command};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;

/// An option: its name, the name of its value or `None` for a switch, whether its value is optional, whether it is repeatable,
/// and its help.
type Described = (String, Option<String>, bool, bool, String);

/// The options of a command, given by its words, such as `["truth", "ape"]`.
#[pyfunction]
pub(crate) fn options(words: Vec<String>) -> PyResult<Vec<Described>> {
    let mut command = dmp_cli::command();
    command.build();
    let mut found: &Command = &command;
    for word in &words {
        found = found.find_subcommand(word).ok_or_else(|| PyKeyError::new_err(word.clone()))?;
    }
    Ok(found.get_arguments().filter_map(described).collect())
}

fn described(argument: &Arg) -> Option<Described> {
    let name =
        argument.get_long().filter(|name| !["help", "version"].contains(name) && !argument.is_hide_set())?;
    let takes_value = argument.get_action().takes_values();
    let range = argument.get_num_args().unwrap_or_default();
    let value = takes_value.then(|| values(argument));
    let repeats = matches!(argument.get_action(), ArgAction::Append | ArgAction::Count);
    let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
    Some((name.to_owned(), value, takes_value && range.min_values() == 0, repeats, help))
}

/// The words that a value may be, or its name.
fn values(argument: &Arg) -> String {
    let words = argument.get_possible_values();
    if !words.is_empty() {
        return words.iter().map(PossibleValue::get_name).collect::<Vec<_>>().join("|");
    }
    let names = argument.get_value_names().unwrap_or_default();
    names.iter().map(clap::builder::Str::as_str).collect::<Vec<_>>().join(" ")
}
