//! Integers, decoded as how far they are from what was expected.

use crate::geometry::laz::coder::decoder::Decoder;
use crate::geometry::laz::coder::model::{BitModel, Models, SymbolModel};

/// Of a longer difference the bits above these are modelled, the others are as they come.
const MODELLED_BITS: u32 = 8;

/// Decodes integers of a number of bits, by a context each.
#[derive(Debug)]
pub(crate) struct IntegerDecoder {
    /// How many bits the difference has.
    widths: Models,
    one_bit: BitModel,
    /// The differences of each width.
    differences: Box<[Option<SymbolModel>]>,
    width: u32,
}

impl IntegerDecoder {
    pub(crate) fn new(bits: u16, contexts: usize) -> Self {
        Self {
            widths: Models::new(bits + 1, contexts),
            one_bit: BitModel::new(),
            differences: (0..bits).map(|_| None).collect(),
            width: 0,
        }
    }

    /// How many bits the last difference had: choosing contexts goes by it.
    pub(crate) fn width(&self) -> u32 {
        self.width
    }

    /// The next integer where `expected` was expected. Integers of less than 32 bits are not brought into their range:
    /// nobody asks for their values.
    #[inline]
    pub(crate) fn decode(&mut self, decoder: &mut Decoder, expected: i32, context: usize) -> i32 {
        expected.wrapping_add(self.difference(decoder, context))
    }

    /// Decodes an integer that nobody asks for.
    pub(crate) fn skip(&mut self, decoder: &mut Decoder, context: usize) {
        self.difference(decoder, context);
    }

    #[inline]
    fn difference(&mut self, decoder: &mut Decoder, context: usize) -> i32 {
        self.width = decoder.symbol(self.widths.of(context)) as u32;
        let width = self.width;
        if width == 0 {
            return decoder.bit(&mut self.one_bit).into();
        }
        if width == 32 {
            return i32::MIN;
        }
        let modelled = width.min(MODELLED_BITS);
        let model =
            self.differences[width as usize - 1].get_or_insert_with(|| SymbolModel::new(1 << modelled));
        let mut code = decoder.symbol(model) as u32;
        let plain = width - modelled;
        if plain > 0 {
            code = code << plain | decoder.bits(plain);
        }
        // The lower half stands for negative differences; what fewer bits can say is left out in the middle.
        let difference =
            if code >> (width - 1) == 1 { code.wrapping_add(1) } else { code.wrapping_sub((1 << width) - 1) };
        difference.cast_signed()
    }
}
