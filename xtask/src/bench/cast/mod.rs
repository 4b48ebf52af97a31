//! The caster: its work as files.

pub(crate) mod scene;
