//! A message with a scan, whatever its type.

use crate::file::unit_since_1970;
use crate::points::{Layout, NumberType, Origin, Rows, TimeFields, TimeRule};

/// A message with a scan, checked: `data` holds every point that it promises.
#[derive(Debug)]
pub(crate) struct Cloud<'a> {
    /// That of the header; where that is 0, the time of the first point, if that counts from 1970.
    pub(crate) stamp_ns: i64,
    pub(crate) is_stamped_by_points: bool,
    pub(crate) frame_id: &'a str,
    pub(crate) layout: Layout,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) row_step: usize,
    pub(super) data: &'a [u8],
}

impl Cloud<'_> {
    /// The same with a stamp, if its header has none and its points do.
    pub(super) fn stamped(mut self) -> Self {
        if let Some(stamp_ns) = (self.stamp_ns == 0).then(|| self.first_since_1970()).flatten() {
            (self.stamp_ns, self.is_stamped_by_points) = (stamp_ns, true);
        }
        self
    }

    fn first_since_1970(&self) -> Option<i64> {
        let rows = self.rows();
        TimeFields::of(&self.layout, None).named.iter().find_map(|name| {
            // A float32 has no second of our days.
            let is_coarse = self.layout.field(name).is_some_and(|field| field.kind == NumberType::F32);
            let first = rows.first(self.layout.time_field(name).filter(|_| !is_coarse)?)?;
            TimeRule::new(unit_since_1970(first.as_f64())?, Origin::Clock).offset_ns(first, 0, None)
        })
    }

    pub(crate) fn returns(&self) -> u64 {
        self.width as u64 * self.height as u64
    }

    pub(crate) fn rows(&self) -> Rows<'_> {
        let Self { layout, data, .. } = self;
        Rows { layout, data, width: self.width, height: self.height, row_step: self.row_step }
    }
}
