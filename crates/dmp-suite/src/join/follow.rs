//! Who follows a comparison of kept results.

/// Follows a comparison of kept results and may stop it; called from several threads at once. `()` does neither.
pub trait Follow: Sync {
    /// It begins; this many returns are to be compared.
    fn begin(&self, returns: u64) {
        let _ = returns;
    }

    /// This many more returns are done.
    fn advance(&self, returns: u64) {
        let _ = returns;
    }

    /// Whether to stop: queried before every scan.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Follow for () {}
