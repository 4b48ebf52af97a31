//! Pictures of returns: maps from above, close-ups, profiles.

pub(crate) mod closeup;
pub(crate) mod cloud;
mod ground;
pub(crate) mod histogram;
mod painter;
pub(crate) mod profile;
mod seen;
mod worst;

pub use closeup::DiscInWorld;
pub(crate) use closeup::{COLOURS, Closeup};
pub(crate) use cloud::{Cloud, SURFEL_COLOURS};
pub(crate) use ground::{Grid, cut_m, round_top};
pub use painter::{Painter, Pictures};
pub(crate) use profile::time_of;
pub use seen::{FrameScore, SampledReturn, SeenFrame};
pub(crate) use seen::{judged_by_m, metre_decimals};
pub use worst::{Pass, WorstPlace, worst_places};
pub(crate) use worst::{contests, distance_m, travel_m};
