//! What both kinds of files with messages share: channels, the largest message, what a pass over a file finds and why
//! a message cannot be read again.

use crate::file::{DamageList, printable};
use std::io;

/// Largest message that is read. One with 128 beams, 4096 columns and 48 bytes a point has 24 MiB; what
/// claims more than ten times that is a lie.
pub(super) const MAX_MESSAGE_BYTES: u64 = 256 << 20;

/// A stream of messages of one type.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Channel {
    pub(crate) topic: String,
    /// As `sensor_msgs/msg/PointCloud2`; empty where the bag does not say.
    pub(crate) message_type: String,
    /// As `cdr`.
    pub(crate) encoding: String,
}

impl Channel {
    /// The texts of a bag, as they may be printed.
    pub(super) fn new(topic: &str, message_type: &str, encoding: &str) -> Self {
        let [topic, message_type, encoding] =
            [topic, message_type, encoding].map(|text| printable(text).into_owned());
        Self { topic, message_type, encoding }
    }
}

/// What a pass over one file finds.
#[derive(Debug, Default)]
pub(super) struct FileFound {
    pub(super) channels: Vec<Channel>,
    pub(super) damage: DamageList,
    pub(super) bytes: u64,
    /// Whether messages were read that no checksum guards.
    pub(super) unguarded: bool,
}

/// Why a message that was there cannot be read again.
#[derive(Debug)]
pub(super) enum MessageFault {
    Io(io::Error),
    /// The file is not what it was; in words.
    Changed(String),
}

impl From<io::Error> for MessageFault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}
