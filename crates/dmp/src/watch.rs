//! Who follows what an evaluation does and finds.

use crate::progress::Progress;
use crate::sink::Sink;

/// Who follows an evaluation: its progress, its results one by one, both or neither.
///
/// Functions take anything that becomes one: `()` for nobody, `&progress`, `(&progress, &sink)` or
/// [`Watch::sink`].
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Hears how far it is, and may stop it.
    pub progress: &'a dyn Progress,
    /// Takes what is found, as it is found.
    pub sink: &'a dyn Sink,
}

impl<'a> Watch<'a> {
    /// Results alone.
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
