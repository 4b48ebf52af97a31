//! The arithmetic decoder, and the models it learns.

mod decoder;
mod integer;
mod median;
mod model;

pub(crate) use decoder::Decoder;
pub(crate) use integer::IntegerDecoder;
pub(crate) use median::Median;
pub(crate) use model::{Models, SymbolModel};
