//! Rows of points, made into a scan.

use super::number::{Number, with_number};
use super::{Field, Layout, NumberType, RawTime, TimeField, TimeRule};
use dmp_sensor::Scan;

/// The points of one scan, checked: `data` holds every row that `height`, `width` and the layout promise,
/// but perhaps for the padding behind the last point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) data: &'a [u8],
    pub(crate) width: usize,
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

    /// The rows of points. In the last, the padding behind the last point may be missing.
    fn rows(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (data, row_step, row_bytes) = (self.data, self.row_step, self.width * self.layout.point_step);
        let height = if row_bytes == 0 { 0 } else { self.height };
        (0..height).map(move |row| {
            let rest = data.get(row * row_step..).unwrap_or_default();
            rest.get(..row_bytes).unwrap_or(rest)
        })
    }

    fn points(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let step = self.layout.point_step.max(1);
        self.rows().flat_map(move |row| row.chunks(step))
    }

    /// Appends the points to `scan`, with their times where a field and its meaning are given. The scan's
    /// stamp must be set.
    pub(crate) fn append_to(&self, time: Option<(TimeField, TimeRule)>, scan: &mut Scan) {
        let step = self.layout.point_step.max(1);
        let points = &mut scan.points_in_sensor_m;
        let start = points.len();
        // Reserved by what is there, not by what is claimed: both were compared.
        points.reserve(self.len());
        // Row by row: an iterator over all points at once does not know its length, and costs twice the time.
        for row in self.rows() {
            if let Some(offset) = self.layout.packed_xyz() {
                points.extend(row.chunks(step).map(|point| packed_f32(point, offset)));
            } else {
                points.extend(row.chunks(step).map(|point| self.place(point)));
            }
        }
        let Some((time, rule)) = time else { return };
        let (field, big_endian) = (time.field, self.layout.big_endian);
        let places = points.get_mut(start..).unwrap_or_default();
        scan.time_offsets_ns.reserve(places.len());
        let times = &mut scan.time_offsets_ns;
        let stamp_ns = scan.stamp_ns.unwrap_or(0);
        // Only rules that count from the scan's first point need to know it.
        let first = if rule.needs_first() { self.first(time) } else { None };
        if time.rest.is_some() {
            let ns_of = |point: &[u8]| rule.offset_ns(time.read(point, big_endian)?, stamp_ns, first);
            return self.append_times(ns_of, places, times);
        }
        if let (NumberType::U32, Some(ns_of)) = (field.kind, rule.of_u32()) {
            for row in self.rows() {
                let value = |point| u32::read(point, field.offset, big_endian).unwrap_or(0);
                times.extend(row.chunks(step).map(|point| ns_of(value(point))));
            }
            return;
        }
        if let (NumberType::F32, Some(ns_of)) = (field.kind, rule.of_f32()) {
            let ns_of = |point: &[u8]| f32::read(point, field.offset, big_endian).and_then(&ns_of);
            return self.append_times(ns_of, places, times);
        }
        with_number!(field.kind, T => {
            let raw = |point: &[u8]| T::read(point, field.offset, big_endian).map(T::raw);
            self.append_times(|point| rule.offset_ns(raw(point)?, stamp_ns, first), places, times);
        });
    }

    fn append_times(
        &self,
        ns_of: impl Fn(&[u8]) -> Option<i64>,
        mut places: &mut [[f32; 3]],
        times: &mut Vec<i64>,
    ) {
        let step = self.layout.point_step.max(1);
        for row in self.rows() {
            let (now, later) = places.split_at_mut_checked(self.width).unwrap_or_default();
            places = later;
            times.extend(row.chunks(step).zip(now).map(|(point, place)| {
                let offset_ns = ns_of(point);
                if offset_ns.is_none() {
                    *place = [f32::NAN; 3];
                }
                offset_ns.unwrap_or(0)
            }));
        }
    }

    /// The place of every point and its values of two fields, where there are such.
    pub(crate) fn values(
        &self,
        fields: [Option<Field>; 2],
    ) -> impl Iterator<Item = ([f64; 3], [Option<f64>; 2])> {
        let value =
            move |point: &'a [u8], field: Field| self.raw(point, field).map_or(f64::NAN, RawTime::as_f64);
        self.points().filter(|point| point.len() == self.layout.point_step).map(move |point| {
            let place = self.layout.xyz.map(|field| value(point, field));
            (place, fields.map(|field| field.map(|field| value(point, field))))
        })
    }

    /// Smallest and largest value of a field over the returns that have a place: rows without one often
    /// carry a zero for a time.
    pub(crate) fn extremes(&self, field: TimeField) -> Option<(f64, f64)> {
        let values = || self.placed(field).map(RawTime::as_f64);
        Some((values().min_by(f64::total_cmp)?, values().max_by(f64::total_cmp)?))
    }

    /// The smallest value of a field over the returns that have a place.
    pub(crate) fn first(&self, field: TimeField) -> Option<RawTime> {
        self.placed(field).min_by(|a, b| a.as_f64().total_cmp(&b.as_f64()))
    }

    fn placed(&self, field: TimeField) -> impl Iterator<Item = RawTime> {
        self.points().filter_map(move |point| {
            let raw = field.read(point, self.layout.big_endian).filter(|raw| raw.as_f64().is_finite())?;
            let place = self.place(point);
            (place.iter().all(|c| c.is_finite()) && place != [0.0; 3]).then_some(raw)
        })
    }

    #[inline]
    fn raw(&self, point: &[u8], field: Field) -> Option<RawTime> {
        field.kind.read(point, field.offset, self.layout.big_endian)
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
