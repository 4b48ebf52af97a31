//! Scan logs in bags: one topic of messages with scans.

mod decide;
mod found;
mod index;
mod log;
mod open;
mod outline;
mod packets;
mod scans;
mod topic;

pub(crate) use log::BagLog;
pub(crate) use outline::BagOutline;
pub(crate) use scans::BagScans;
