//! Fields that nobody asks for and that are in the way: their symbols are decoded and forgotten. What the symbols mean never
//! changes which models the next ones have.

use crate::geometry::laz::coder::{Decoder, IntegerDecoder, Models, SymbolModel};
use crate::geometry::laz::fields::items::{Item, ItemKind};

/// An item of a point that is not wanted.
#[derive(Debug)]
pub(crate) enum Skipped {
    /// `RGB12`, version 2: which bytes of the colour have changed, and how.
    Rgb { changed: SymbolModel, bytes: Models },
    /// `RGB12`, version 1: the same, with integers.
    RgbVersion1 { changed: SymbolModel, bytes: IntegerDecoder },
    /// `BYTE`, version 2.
    Bytes { models: Models, count: usize },
    /// `WAVEPACKET13`.
    Wavepacket(Box<Wavepacket>),
}

impl Skipped {
    /// The decoder of an item; `None` where it is wanted.
    pub(crate) fn of(item: &Item) -> Option<Self> {
        Some(match (item.kind, item.version) {
            (ItemKind::Rgb12, 1) => {
                Self::RgbVersion1 { changed: SymbolModel::new(64), bytes: IntegerDecoder::new(8, 6) }
            }
            (ItemKind::Rgb12, _) => Self::Rgb { changed: SymbolModel::new(128), bytes: Models::new(256, 6) },
            (ItemKind::Wavepacket13, _) => Self::Wavepacket(Box::new(Wavepacket::new())),
            (ItemKind::Byte, _) => {
                let count = item.bytes.into();
                Self::Bytes { models: Models::new(256, count), count }
            }
            _ => return None,
        })
    }

    pub(crate) fn skip(&mut self, decoder: &mut Decoder) {
        match self {
            Self::Rgb { changed, bytes } => {
                let changed = decoder.symbol(changed);
                // Bit 6 says that green and blue are not as red is. All bits of bytes are in the order of the symbols,
                // but for those of green and blue, of which the lower bytes come first.
                let is_coloured = changed >> 6 & 1 == 1;
                for byte in [0, 1, 2, 4, 3, 5] {
                    if changed >> byte & 1 == 1 && (byte < 2 || is_coloured) {
                        decoder.symbol(bytes.of(byte));
                    }
                }
            }
            Self::RgbVersion1 { changed, bytes } => {
                let changed = decoder.symbol(changed);
                for byte in (0..6).filter(|byte| changed >> byte & 1 == 1) {
                    bytes.skip(decoder, byte);
                }
            }
            Self::Bytes { models, count } => {
                for byte in 0..*count {
                    decoder.symbol(models.of(byte));
                }
            }
            Self::Wavepacket(wavepacket) => wavepacket.skip(decoder),
        }
    }
}

/// Where a return's waveform is.
#[derive(Debug)]
pub(crate) struct Wavepacket {
    descriptor: SymbolModel,
    offset_kinds: Models,
    offset_kind: usize,
    offset: IntegerDecoder,
    size: IntegerDecoder,
    return_point: IntegerDecoder,
    direction: IntegerDecoder,
}

impl Wavepacket {
    fn new() -> Self {
        Self {
            descriptor: SymbolModel::new(256),
            offset_kinds: Models::new(4, 4),
            offset_kind: 0,
            offset: IntegerDecoder::new(32, 1),
            size: IntegerDecoder::new(32, 1),
            return_point: IntegerDecoder::new(32, 1),
            direction: IntegerDecoder::new(32, 3),
        }
    }

    fn skip(&mut self, decoder: &mut Decoder) {
        decoder.symbol(&mut self.descriptor);
        self.offset_kind = decoder.symbol(self.offset_kinds.of(self.offset_kind));
        match self.offset_kind {
            // Where the last one was, or behind it.
            0 | 1 => {}
            2 => self.offset.skip(decoder, 0),
            _ => {
                decoder.bits_64();
            }
        }
        self.size.skip(decoder, 0);
        self.return_point.skip(decoder, 0);
        for axis in 0..3 {
            self.direction.skip(decoder, axis);
        }
    }
}
