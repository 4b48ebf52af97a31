//! What is made from the definition of the command: manual pages, completions.

mod after_help;
pub(crate) mod completions;
pub(crate) mod manual;

pub use after_help::{HelpBody, HelpPart, help_parts};
