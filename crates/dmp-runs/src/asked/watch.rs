//! The watcher of an evaluation.

use crate::asked::progress::Progress;
use crate::asked::sink::Sink;

/// The watcher of an evaluation: of its progress, its individual results, both or neither.
///
/// Functions accept anything that converts into one: `()` for none, `&progress`, `(&progress, &sink)` or
/// [`Watch::sink`].
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Receives the progress and may stop the evaluation.
    pub progress: &'a dyn Progress,
    /// Receives results as they are computed.
    pub sink: &'a dyn Sink,
}

impl<'a> Watch<'a> {
    /// Receives results only.
    pub fn sink(sink: &'a dyn Sink) -> Self {
        Self { progress: &(), sink }
    }
}

impl std::fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").finish_non_exhaustive()
    }
}

impl From<()> for Watch<'_> {
    fn from((): ()) -> Self {
        Self { progress: &(), sink: &() }
    }
}

impl<'a, P: Progress> From<&'a P> for Watch<'a> {
    fn from(progress: &'a P) -> Self {
        Self { progress, sink: &() }
    }
}

impl<'a> From<&'a dyn Progress> for Watch<'a> {
    fn from(progress: &'a dyn Progress) -> Self {
        Self { progress, sink: &() }
    }
}

impl<'a, P: Progress, S: Sink> From<(&'a P, &'a S)> for Watch<'a> {
    fn from((progress, sink): (&'a P, &'a S)) -> Self {
        Self { progress, sink }
    }
}
