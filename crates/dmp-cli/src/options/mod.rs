//! The options of the command: one value for each, and all that is known of an option is in that value.
//!
//! An [`Opt`] names an option, its group, its help, how its value is parsed, whether it names a file, and which field of
//! [`Config`] it sets. Help, manual pages, completions, the Python keywords, the options of a suite and the files that
//! [`guard`](crate::guard) protects all come from there. A [`Spec`] is a command: a list of options and a function.
//! A new option that sets a field of [`Config`] is one [`Opt`], and its name in the list of a command.

pub(crate) mod extrinsic;
pub(crate) mod graph;
pub(crate) mod input;
mod option;
pub(crate) mod output;
pub(crate) mod scoring;
pub(crate) mod simulate;
mod spec;
pub(crate) mod tools;
pub(crate) mod truth;
pub(crate) mod values;

pub(crate) use option::{Entry, Facts, Group, Opt, Role};
pub(crate) use spec::{Asked, Out, Spec};
