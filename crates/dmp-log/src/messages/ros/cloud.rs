//! A message with a scan, whatever its type.

use crate::points::{Layout, Rows};

/// A message with a scan, checked: `data` holds every point that it promises.
#[derive(Debug)]
pub(crate) struct Cloud<'a> {
    pub(crate) stamp_ns: i64,
    pub(crate) frame_id: &'a str,
    pub(crate) layout: Layout,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) row_step: usize,
    pub(super) data: &'a [u8],
}

impl Cloud<'_> {
    pub(crate) fn returns(&self) -> u64 {
        self.width as u64 * self.height as u64
    }

    pub(crate) fn rows(&self) -> Rows<'_> {
        let Self { layout, data, .. } = self;
        Rows { layout, data, width: self.width, height: self.height, row_step: self.row_step }
    }
}
