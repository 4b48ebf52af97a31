//! The commands, a module each.

pub(crate) mod calibrate;
pub(crate) mod compare;
pub(crate) mod convert;
pub(crate) mod drift;
pub(crate) mod info;
pub(crate) mod loops;
pub(crate) mod map;
pub(crate) mod repair;
pub(crate) mod score;
pub(crate) mod shard;
pub(crate) mod simulate;
pub(crate) mod suite;
pub(crate) mod truth;
