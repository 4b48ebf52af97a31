//! The items `POINT10` and `GPSTIME11` in version 1: files of `LASzip` before 2.0, of 2011.

use crate::geometry::laz::coder::{Decoder, IntegerDecoder, Models, SymbolModel};
use crate::geometry::laz::fields::record;
use crate::geometry::laz::fields::record::Place;

/// Decodes places of points, and passes over their other fields.
#[derive(Debug)]
pub(crate) struct Point10Version1 {
    dx: IntegerDecoder,
    dy: IntegerDecoder,
    z: IntegerDecoder,
    changed: SymbolModel,
    intensities: IntegerDecoder,
    flags_models: Models,
    classes: Models,
    scan_angles: IntegerDecoder,
    user_data_models: Models,
    sources: IntegerDecoder,
    last: Place,
    /// The last three differences of x and of y: the middle one is expected.
    differences: [[i32; 3]; 2],
    oldest: usize,
    flags: usize,
    class: usize,
    user_data: usize,
}

impl Point10Version1 {
    pub(crate) fn new(first: &[u8]) -> Self {
        let [flags, class, _, user_data] = record::get(first, 14).map(usize::from);
        Self {
            dx: IntegerDecoder::new(32, 1),
            dy: IntegerDecoder::new(32, 20),
            z: IntegerDecoder::new(32, 20),
            changed: SymbolModel::new(64),
            intensities: IntegerDecoder::new(16, 1),
            flags_models: Models::new(256, 256),
            classes: Models::new(256, 256),
            scan_angles: IntegerDecoder::new(8, 2),
            user_data_models: Models::new(256, 256),
            sources: IntegerDecoder::new(16, 1),
            last: record::place(first),
            differences: [[0; 3]; 2],
            oldest: 0,
            flags,
            class,
            user_data,
        }
    }

    pub(crate) fn decode(&mut self, decoder: &mut Decoder) -> Place {
        let [expected_x, expected_y] = self.differences.map(|[a, b, c]| a.max(b).min(c).max(a.min(b)));
        let dx = self.dx.decode(decoder, expected_x, 0);
        let width = self.dx.width();
        let dy = self.dy.decode(decoder, expected_y, width.min(19) as usize);
        let width = u32::midpoint(width, self.dy.width());
        let z = self.z.decode(decoder, self.last[2], width.min(19) as usize);
        self.last = [self.last[0].wrapping_add(dx), self.last[1].wrapping_add(dy), z];
        (self.differences[0][self.oldest], self.differences[1][self.oldest]) = (dx, dy);
        self.oldest = (self.oldest + 1) % 3;
        self.skip_other_fields(decoder, width);
        self.last
    }

    fn skip_other_fields(&mut self, decoder: &mut Decoder, width: u32) {
        let changed = decoder.symbol(&mut self.changed);
        if changed >> 5 & 1 == 1 {
            self.intensities.skip(decoder, 0);
        }
        if changed >> 4 & 1 == 1 {
            self.flags = decoder.symbol(self.flags_models.of(self.flags));
        }
        if changed >> 3 & 1 == 1 {
            self.class = decoder.symbol(self.classes.of(self.class));
        }
        if changed >> 2 & 1 == 1 {
            self.scan_angles.skip(decoder, usize::from(width < 3));
        }
        if changed >> 1 & 1 == 1 {
            self.user_data = decoder.symbol(self.user_data_models.of(self.user_data));
        }
        if changed & 1 == 1 {
            self.sources.skip(decoder, 0);
        }
    }
}

/// Multiples of a step that have a symbol; behind them a time as it is, and one that has not changed.
const MULTIPLES: i32 = 510;

/// Decodes times, which are expected to go on by a multiple of the last step.
#[derive(Debug)]
pub(crate) struct GpsTimesVersion1 {
    after_no_step: SymbolModel,
    multiple: SymbolModel,
    steps: IntegerDecoder,
    /// The bits of a float64 in seconds.
    time: i64,
    step: i32,
    far_off: u32,
}

impl GpsTimesVersion1 {
    pub(crate) fn new(first: i64) -> Self {
        let (after_no_step, multiple) = (SymbolModel::new(3), SymbolModel::new(MULTIPLES as u16 + 2));
        Self { after_no_step, multiple, steps: IntegerDecoder::new(32, 6), time: first, step: 0, far_off: 0 }
    }

    pub(crate) fn decode(&mut self, decoder: &mut Decoder) -> i64 {
        if self.step == 0 {
            match decoder.symbol(&mut self.after_no_step) {
                0 => {}
                1 => {
                    self.step = self.steps.decode(decoder, 0, 0);
                    self.time = self.time.wrapping_add(self.step.into());
                }
                _ => self.time = decoder.bits_64().cast_signed(),
            }
            return self.time;
        }
        let multiple = decoder.symbol(&mut self.multiple) as i32;
        let (expected, context) = match multiple {
            0 => (self.step / 4, 2),
            1 => (self.step, 1),
            2..10 => (self.step.wrapping_mul(multiple), 3),
            10..50 => (self.step.wrapping_mul(multiple), 4),
            50..MULTIPLES => (self.step.wrapping_mul(multiple), 5),
            MULTIPLES => {
                self.time = decoder.bits_64().cast_signed();
                return self.time;
            }
            _ => return self.time,
        };
        let step = self.steps.decode(decoder, expected, context);
        self.time = self.time.wrapping_add(step.into());
        self.far_off += u32::from(multiple == 0 || multiple == MULTIPLES - 1);
        if multiple == 1 || self.far_off > 3 {
            (self.step, self.far_off) = (step, 0);
        }
        self.time
    }
}
