//! The caster: its work as files, and other casters on the same work.

pub(crate) mod peer_modes;
mod peers;
pub(crate) mod scene;
