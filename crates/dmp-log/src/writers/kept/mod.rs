//! Results that are kept to be compared with others: what `dmp score --json` prints, and four bytes a return, as MCAP.

mod part;
mod reader;
#[cfg(test)]
mod tests;
mod writer;

pub use part::{KeptPart, RETURN_BYTES};
pub use reader::{KeptReader, is_kept};
pub use writer::KeptWriter;
