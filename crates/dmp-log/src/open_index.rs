//! Opening a log by what was written down of it.

use crate::bag_log::BagLog;
use crate::log_index::{IndexedScans, LogIndex};
use crate::{LogError, PlaceInFile, ScanLog, open_log};
use dmp_lengths::thousands;
use std::path::Path;

impl LogIndex {
    /// Opens the log at `path`, which may be elsewhere now. Its summary is what was found in it when it was indexed.
    ///
    /// # Errors
    /// When it is not there, or is another one: of another length or with other ends. That single scans are not what they were
    /// shows when they are read.
    pub fn open(&self, path: &Path) -> Result<Box<dyn ScanLog>, LogError> {
        match &self.scans {
            IndexedScans::Bag(scans) => Ok(Box::new(BagLog::of_scans(scans, path, &self.summary)?)),
            IndexedScans::Whole(options) => {
                let log = open_log(path, options)?;
                let (now, then) = (log.summary(), &self.summary);
                if (&now.fingerprint, now.returns) != (&then.fingerprint, then.returns) {
                    let problem = format!(
                        "it is {} with {} returns, and the log that was indexed is {} with {}",
                        now.fingerprint,
                        thousands(now.returns),
                        then.fingerprint,
                        thousands(then.returns)
                    );
                    return Err(LogError::malformed(path, PlaceInFile::WholeFile, problem));
                }
                Ok(log)
            }
        }
    }

    /// The log without its files, for what follows from its scans alone: when they were, how many returns they have. None can be
    /// read. `None` where only the log itself has it.
    ///
    /// # Errors
    /// When the index is none.
    pub fn unopened(&self) -> Result<Option<Box<dyn ScanLog>>, LogError> {
        let IndexedScans::Bag(scans) = &self.scans else { return Ok(None) };
        Ok(Some(Box::new(BagLog::unopened(scans, &self.summary)?)))
    }
}
