//! The arithmetic decoder over bytes in memory: Said, "Introduction to Arithmetic Coding" (HP Labs report 2004-76), as
//! `LASzip` has it.
//!
//! No symbol is an error by itself, so that none must be checked: behind the last byte zeros are read, and what no encoder
//! writes is noted. Whoever decodes a point asks afterwards whether [`Decoder::is_sound`].

use crate::geometry::laz::coder::model::{BIT_PLACES_LOG2, BitModel, PLACES_LOG2, SymbolModel};

/// Below this the interval is widened by a byte.
const MIN_LENGTH: u32 = 1 << 24;

/// Bits that are read in one step, at most.
const MAX_BITS_AT_ONCE: u32 = 19;

/// What is left of a stream of symbols.
///
/// The value stays below the interval's length, and the length never below `MIN_LENGTH`, whatever the bytes are: models
/// give every symbol a part of the interval.
#[derive(Debug, Default)]
pub(crate) struct Decoder {
    bytes: Vec<u8>,
    at: usize,
    value: u32,
    length: u32,
    broken: bool,
}

impl Decoder {
    pub(crate) fn new(bytes: Vec<u8>) -> Self {
        let mut decoder = Self { bytes, at: 0, value: 0, length: u32::MAX, broken: false };
        for _ in 0..4 {
            decoder.take_byte();
        }
        if decoder.value == u32::MAX {
            // No interval holds it.
            decoder.value = 0;
            decoder.broken = true;
        }
        decoder
    }

    /// Whether all that was decoded was there, and can have come from an encoder.
    pub(crate) fn is_sound(&self) -> bool {
        self.at <= self.bytes.len() && !self.broken
    }

    /// Bytes that were not needed. An encoder writes as many as its decoder takes.
    pub(crate) fn left_bytes(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    /// Notes that what was decoded cannot have come from an encoder.
    pub(crate) fn refuse(&mut self) {
        self.broken = true;
    }

    #[inline]
    fn take_byte(&mut self) {
        let byte = self.bytes.get(self.at).copied().unwrap_or(0);
        self.at += 1;
        self.value = self.value << 8 | u32::from(byte);
    }

    #[inline]
    fn widen(&mut self) {
        while self.length < MIN_LENGTH {
            self.take_byte();
            self.length <<= 8;
        }
    }

    #[inline]
    pub(crate) fn bit(&mut self, model: &mut BitModel) -> bool {
        let zeros = model.zero_places() * (self.length >> BIT_PLACES_LOG2);
        let bit = self.value >= zeros;
        if bit {
            self.value -= zeros;
            self.length -= zeros;
        } else {
            self.length = zeros;
        }
        self.widen();
        model.count(bit);
        bit
    }

    /// The next symbol of a model, less than its number of symbols.
    #[inline]
    pub(crate) fn symbol(&mut self, model: &mut SymbolModel) -> usize {
        let step = self.length >> PLACES_LOG2;
        let place = self.value.checked_div(step).unwrap_or(0);
        let (symbol, start, end) = model.find(place);
        let low = start * step;
        self.value -= low;
        // The last symbol has what the division left over, too.
        self.length = end.map_or(self.length, |end| end * step) - low;
        self.widen();
        model.count(symbol);
        symbol
    }

    /// Up to 32 bits that no model foretells.
    #[inline]
    pub(crate) fn bits(&mut self, count: u32) -> u32 {
        if count <= MAX_BITS_AT_ONCE {
            return self.few_bits(count);
        }
        let low = self.few_bits(16);
        self.few_bits(count - 16) << 16 | low
    }

    #[inline]
    fn few_bits(&mut self, count: u32) -> u32 {
        self.length >>= count;
        let bits = self.value.checked_div(self.length).unwrap_or(0);
        self.value -= bits * self.length;
        self.widen();
        self.broken |= bits >> count != 0;
        bits & ((1 << count) - 1)
    }

    pub(crate) fn bits_64(&mut self) -> u64 {
        let low = u64::from(self.bits(32));
        u64::from(self.bits(32)) << 32 | low
    }
}
