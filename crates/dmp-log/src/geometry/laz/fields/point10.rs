//! The item `POINT10`, version 2: what all points of formats up to 5 have.

use crate::geometry::laz::coder::{Decoder, IntegerDecoder, Median, Models, SymbolModel};
use crate::geometry::laz::fields::record;
use crate::geometry::laz::fields::record::Place;
use crate::geometry::laz::fields::returns::{Return, by_width};

/// Decodes places of points, and passes over their other fields.
#[derive(Debug)]
pub(crate) struct Point10 {
    changed: SymbolModel,
    flags_models: Models,
    intensities: IntegerDecoder,
    classes: Models,
    scan_angles: Models,
    user_data_models: Models,
    sources: IntegerDecoder,
    dx: IntegerDecoder,
    dy: IntegerDecoder,
    z: IntegerDecoder,
    dx_expected: [Median; 16],
    dy_expected: [Median; 16],
    z_expected: [i32; 8],
    last: Place,
    /// Of the other fields those that models are chosen by.
    flags: usize,
    class: usize,
    user_data: usize,
}

impl Point10 {
    pub(crate) fn new(first: &[u8]) -> Self {
        let [flags, class, _, user_data] = record::get(first, 14).map(usize::from);
        Self {
            changed: SymbolModel::new(64),
            flags_models: Models::new(256, 256),
            intensities: IntegerDecoder::new(16, 4),
            classes: Models::new(256, 256),
            scan_angles: Models::new(256, 2),
            user_data_models: Models::new(256, 256),
            sources: IntegerDecoder::new(16, 1),
            dx: IntegerDecoder::new(32, 2),
            dy: IntegerDecoder::new(32, 22),
            z: IntegerDecoder::new(32, 20),
            dx_expected: [Median::new(); 16],
            dy_expected: [Median::new(); 16],
            z_expected: [0; 8],
            last: record::place(first),
            flags,
            class,
            user_data,
        }
    }

    pub(crate) fn decode(&mut self, decoder: &mut Decoder) -> Place {
        let changed = decoder.symbol(&mut self.changed);
        if changed >> 5 & 1 == 1 {
            self.flags = decoder.symbol(self.flags_models.of(self.flags));
        }
        let which = Return { number: self.flags & 7, of: self.flags >> 3 & 7 };
        let context = which.context_10();
        if changed & 0x1f != 0 {
            self.skip_other_fields(decoder, changed, context);
        }
        let single = which.single();
        let dx = self.dx.decode(decoder, self.dx_expected[context].get(), single);
        self.dx_expected[context].add(dx);
        let width = self.dx.width();
        let dy = self.dy.decode(decoder, self.dy_expected[context].get(), by_width(width, 20, single));
        self.dy_expected[context].add(dy);
        let width = u32::midpoint(width, self.dy.width());
        let level = which.level();
        let z = self.z.decode(decoder, self.z_expected[level], by_width(width, 18, single));
        self.z_expected[level] = z;
        self.last = [self.last[0].wrapping_add(dx), self.last[1].wrapping_add(dy), z];
        self.last
    }

    fn skip_other_fields(&mut self, decoder: &mut Decoder, changed: usize, context: usize) {
        if changed >> 4 & 1 == 1 {
            self.intensities.skip(decoder, context.min(3));
        }
        if changed >> 3 & 1 == 1 {
            self.class = decoder.symbol(self.classes.of(self.class));
        }
        if changed >> 2 & 1 == 1 {
            let scan_direction = self.flags >> 6 & 1;
            decoder.symbol(self.scan_angles.of(scan_direction));
        }
        if changed >> 1 & 1 == 1 {
            self.user_data = decoder.symbol(self.user_data_models.of(self.user_data));
        }
        if changed & 1 == 1 {
            self.sources.skip(decoder, 0);
        }
    }
}
