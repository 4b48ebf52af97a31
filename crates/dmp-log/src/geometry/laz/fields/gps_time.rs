//! Times of points: up to four sequences of times, each expected to go on by a multiple of its last step.

use crate::geometry::laz::coder::{Decoder, IntegerDecoder, SymbolModel};

/// The largest multiple of a step that has a symbol of its own.
const MAX_MULTIPLE: i32 = 500;
/// The smallest.
const MIN_MULTIPLE: i32 = -10;
/// Symbols behind those of the multiples: the time has not changed, it begins a sequence, and from there on it belongs to
/// another one.
const UNCHANGED: i32 = MAX_MULTIPLE - MIN_MULTIPLE + 1;
const NEW_SEQUENCE: i32 = UNCHANGED + 1;
const SYMBOLS: u16 = NEW_SEQUENCE as u16 + 4;

/// A new step counts from the fourth time that the old one is far off.
const MAX_FAR_OFF: u32 = 3;

/// A change of sequence is followed by a time in it. There are three others.
const MAX_CHANGES: usize = 3;

#[derive(Debug, Clone, Copy, Default)]
struct Sequence {
    /// The last time: the bits of a float64 in seconds.
    time: i64,
    step: i32,
    far_off: u32,
}

#[derive(Debug)]
pub(crate) struct GpsTimes {
    after_no_step: SymbolModel,
    multiple: SymbolModel,
    steps: IntegerDecoder,
    sequences: [Sequence; 4],
    current: usize,
    newest: usize,
    /// 1 where "not changed" has no symbol, because the point's other symbols say so.
    left_out: i32,
}

impl GpsTimes {
    /// Every time is decoded in the item `GPSTIME11`, version 2 (`left_out` 0); in `POINT14` those that have changed (1).
    pub(crate) fn new(first: i64, left_out: i32) -> Self {
        let mut sequences = [Sequence::default(); 4];
        sequences[0].time = first;
        Self {
            after_no_step: SymbolModel::new(6 - left_out as u16),
            multiple: SymbolModel::new(SYMBOLS - left_out as u16),
            steps: IntegerDecoder::new(32, 9),
            sequences,
            current: 0,
            newest: 0,
            left_out,
        }
    }

    /// The next time: the bits of a float64 in seconds.
    pub(crate) fn decode(&mut self, decoder: &mut Decoder) -> i64 {
        for _ in 0..=MAX_CHANGES {
            let ahead = if self.sequences[self.current].step == 0 {
                self.after_no_step(decoder)
            } else {
                self.after_a_step(decoder)
            };
            if ahead == 0 {
                return self.sequences[self.current].time;
            }
            self.current = (self.current + ahead) & 3;
        }
        decoder.refuse();
        0
    }

    /// How many sequences ahead the time belongs to, if not to this one.
    fn after_no_step(&mut self, decoder: &mut Decoder) -> usize {
        match decoder.symbol(&mut self.after_no_step) as i32 + self.left_out {
            0 => {}
            1 => {
                let step = self.steps.decode(decoder, 0, 0);
                let sequence = &mut self.sequences[self.current];
                let time = sequence.time.wrapping_add(step.into());
                *sequence = Sequence { time, step, far_off: 0 };
            }
            2 => self.begin_sequence(decoder),
            other => return other as usize - 2,
        }
        0
    }

    /// The same where the last time was another than the one before it.
    fn after_a_step(&mut self, decoder: &mut Decoder) -> usize {
        let mut symbol = decoder.symbol(&mut self.multiple) as i32;
        if symbol >= UNCHANGED {
            symbol += self.left_out;
        }
        let last_step = self.sequences[self.current].step;
        let (multiple, context) = match symbol {
            0 => (0, 7),
            1 => (1, 1),
            2..10 => (symbol, 2),
            10..MAX_MULTIPLE => (symbol, 3),
            MAX_MULTIPLE => (symbol, 4),
            UNCHANGED => return 0,
            NEW_SEQUENCE => {
                self.begin_sequence(decoder);
                return 0;
            }
            _ if symbol > NEW_SEQUENCE => return (symbol - NEW_SEQUENCE) as usize,
            _ => {
                let multiple = MAX_MULTIPLE - symbol;
                (multiple, if multiple > MIN_MULTIPLE { 5 } else { 6 })
            }
        };
        let step = self.steps.decode(decoder, last_step.wrapping_mul(multiple), context);
        let sequence = &mut self.sequences[self.current];
        sequence.time = sequence.time.wrapping_add(step.into());
        match multiple {
            1 => sequence.far_off = 0,
            0 | MAX_MULTIPLE | MIN_MULTIPLE => {
                sequence.far_off += 1;
                if sequence.far_off > MAX_FAR_OFF {
                    (sequence.step, sequence.far_off) = (step, 0);
                }
            }
            _ => {}
        }
        0
    }

    /// A time that is far from those of all sequences takes the place of the oldest one.
    fn begin_sequence(&mut self, decoder: &mut Decoder) {
        let upper = (self.sequences[self.current].time >> 32) as i32;
        let upper = i64::from(self.steps.decode(decoder, upper, 8));
        self.newest = (self.newest + 1) & 3;
        let time = upper << 32 | i64::from(decoder.bits(32));
        self.sequences[self.newest] = Sequence { time, step: 0, far_off: 0 };
        self.current = self.newest;
    }
}
