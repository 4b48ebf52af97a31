//! Scan logs in bags: one topic of messages with scans.

mod decide;
mod found;
mod log;
mod open;
mod outline;
mod topic;

pub(crate) use log::BagLog;
pub(crate) use outline::BagOutline;
