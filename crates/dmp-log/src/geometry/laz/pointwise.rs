//! Points of formats up to 5: one stream of symbols, point by point and item by item.

use crate::geometry::laz::coder::Decoder;
use crate::geometry::laz::fields::{
    GPS_TIME_10, GpsTimes, GpsTimesVersion1, Item, ItemKind, Point10, Point10Version1, Skipped, record,
};

#[derive(Debug)]
enum Field {
    Place(Box<Point10>),
    PlaceVersion1(Box<Point10Version1>),
    Time(Box<GpsTimes>),
    TimeVersion1(Box<GpsTimesVersion1>),
    Skipped(Skipped),
}

impl Field {
    /// The decoder of an item of a version that is read, of points after `first`.
    fn new(item: &Item, first: &[u8]) -> Self {
        let time = i64::from_le_bytes(record::get(first, GPS_TIME_10));
        match (item.kind, item.version) {
            (ItemKind::Point10, 1) => Self::PlaceVersion1(Box::new(Point10Version1::new(first))),
            (ItemKind::GpsTime11, 1) => Self::TimeVersion1(Box::new(GpsTimesVersion1::new(time))),
            (ItemKind::GpsTime11, _) => Self::Time(Box::new(GpsTimes::new(time, 0))),
            // Layered items do not come here: the layout is checked.
            _ => Skipped::of(item).map_or_else(|| Self::Place(Box::new(Point10::new(first))), Self::Skipped),
        }
    }
}

/// Decodes places and times of the points of a chunk.
#[derive(Debug)]
pub(super) struct Pointwise {
    decoder: Decoder,
    fields: Vec<Field>,
}

impl Pointwise {
    pub(super) fn new(items: &[Item], first: &[u8], rest: Vec<u8>) -> Self {
        let fields = items.iter().map(|item| Field::new(item, first)).collect();
        Self { decoder: Decoder::new(rest), fields }
    }

    /// Whether points have times.
    pub(super) fn has_times(&self) -> bool {
        self.fields.iter().any(|field| matches!(field, Field::Time(_) | Field::TimeVersion1(_)))
    }

    /// Whether all that was decoded was there, and can have come from an encoder.
    pub(super) fn is_sound(&self) -> bool {
        self.decoder.is_sound()
    }

    /// Bytes that were not needed.
    pub(super) fn left_bytes(&self) -> usize {
        self.decoder.left_bytes()
    }

    pub(super) fn decode(&mut self, record: &mut [u8]) {
        let decoder = &mut self.decoder;
        for field in &mut self.fields {
            match field {
                Field::Place(point) => record::put_place(record, point.decode(decoder)),
                Field::PlaceVersion1(point) => record::put_place(record, point.decode(decoder)),
                Field::Time(times) => record::put(record, GPS_TIME_10, times.decode(decoder).to_le_bytes()),
                Field::TimeVersion1(times) => {
                    record::put(record, GPS_TIME_10, times.decode(decoder).to_le_bytes());
                }
                Field::Skipped(skipped) => skipped.skip(decoder),
            }
        }
    }
}
