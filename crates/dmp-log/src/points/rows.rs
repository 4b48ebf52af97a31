use super::number::{Number, with_number};
use super::{Field, Kind, Layout, RawTime, TimeRule};
use dmp_sensor::Scan;

/// The points of one scan, checked: `data` holds every row that `height`, `width` and the layout promise,
/// but perhaps for the padding behind the last point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) data: &'a [u8],
    /// Points of a row.
    pub(crate) width: usize,
    /// Rows.
    pub(crate) height: usize,
    /// Bytes from row to row.
    pub(crate) row_step: usize,
}

impl<'a> Rows<'a> {
    /// One row of all the points.
    pub(crate) fn one(layout: &'a Layout, data: &'a [u8], points: usize) -> Self {
        Self { layout, data, width: points, height: 1, row_step: data.len() }
    }

    pub(crate) fn len(&self) -> usize {
        self.width * self.height
    }

    fn points(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (data, row_step, step) = (self.data, self.row_step, self.layout.point_step.max(1));
        let row_bytes = self.width * self.layout.point_step;
        let height = if row_bytes == 0 { 0 } else { self.height };
        (0..height)
            .filter_map(move |row| data.get(row * row_step..))
            .flat_map(move |rest| rest.get(..row_bytes).unwrap_or(rest).chunks(step))
    }

    /// Appends the points to `scan`, with their times where a field and its meaning are given. The scan's
    /// stamp must be set.
    pub(crate) fn append_to(&self, time: Option<(Field, TimeRule)>, scan: &mut Scan) {
        let points = &mut scan.points_in_sensor_m;
        // Reserved by what is there, not by what is claimed: both were compared.
        points.reserve(self.len());
        if let Some(offset) = self.layout.packed_xyz() {
            points.extend(self.points().map(|point| packed_f32(point, offset)));
        } else {
            points.extend(self.points().map(|point| self.place(point)));
        }
        let Some((field, rule)) = time else { return };
        // Only rules that count from the scan's first point need to know it.
        let first = if rule.needs_first() { self.first(field) } else { None };
        with_number!(field.kind, T => self.append_times::<T>(field.offset, rule, first, scan));
    }

    fn append_times<T: Number>(
        &self,
        offset: usize,
        rule: TimeRule,
        first: Option<RawTime>,
        scan: &mut Scan,
    ) {
        let stamp_ns = scan.stamp_ns.unwrap_or(0);
        let times = &mut scan.time_offsets_ns;
        times.reserve(self.len());
        let start = scan.points_in_sensor_m.len() - self.len();
        let places = scan.points_in_sensor_m.get_mut(start..).unwrap_or_default();
        let big_endian = self.layout.big_endian;
        times.extend(self.points().zip(places).map(|(point, place)| {
            let raw = T::read(point, offset, big_endian).map(T::raw);
            let offset_ns = raw.and_then(|raw| rule.offset_ns(raw, stamp_ns, first));
            if offset_ns.is_none() {
                *place = [f32::NAN; 3];
            }
            offset_ns.unwrap_or(0)
        }));
    }

    /// Smallest and largest value of a field over the returns that have a place: rows without one often
    /// carry a zero for a time.
    pub(crate) fn extremes(&self, field: Field) -> Option<(f64, f64)> {
        let values = || self.placed(field).map(RawTime::as_f64);
        Some((values().min_by(f64::total_cmp)?, values().max_by(f64::total_cmp)?))
    }

    /// The smallest value of a field over the returns that have a place.
    fn first(&self, field: Field) -> Option<RawTime> {
        self.placed(field).min_by(|a, b| a.as_f64().total_cmp(&b.as_f64()))
    }

    fn placed(&self, field: Field) -> impl Iterator<Item = RawTime> {
        self.points().filter_map(move |point| {
            let raw = self.raw(point, field).filter(|raw| raw.as_f64().is_finite())?;
            let place = self.place(point);
            (place.iter().all(|c| c.is_finite()) && place != [0.0; 3]).then_some(raw)
        })
    }

    #[inline]
    fn raw(&self, point: &[u8], field: Field) -> Option<RawTime> {
        with_number!(field.kind, T => T::read(point, field.offset, self.layout.big_endian).map(T::raw))
    }

    #[inline]
    fn place(&self, point: &[u8]) -> [f32; 3] {
        self.layout.xyz.map(|field| self.raw(point, field).map_or(f32::NAN, |value| value.as_f64() as f32))
    }
}

#[inline]
fn packed_f32(point: &[u8], offset: usize) -> [f32; 3] {
    let Some(&[a, b, c, d, e, f, g, h, i, j, k, l]) = point.get(offset..).and_then(|rest| rest.first_chunk())
    else {
        return [f32::NAN; 3];
    };
    [[a, b, c, d], [e, f, g, h], [i, j, k, l]].map(f32::from_le_bytes)
}
