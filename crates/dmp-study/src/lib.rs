//! The scores of one log's runs beside ground truth and other metrics.
//!
//! # Brief overview
//! [`peers`] has the map metrics without ground truth that others use: MME, MPV, MOM.

pub mod peers;
