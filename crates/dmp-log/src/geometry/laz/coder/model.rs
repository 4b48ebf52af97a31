//! How likely symbols are, learnt from those that came: the adaptive models of the arithmetic decoder (Said 2004).

/// Places that the symbols of a model share, as a power of two.
pub(crate) const PLACES_LOG2: u32 = 15;
/// The same of a model of bits.
pub(crate) const BIT_PLACES_LOG2: u32 = 13;

/// Counts are halved when there are more than that many.
const MAX_TOTAL: u32 = 1 << PLACES_LOG2;
const MAX_BIT_TOTAL: u32 = 1 << BIT_PLACES_LOG2;

/// What stands for the end of the last symbol's places, more than any place.
const END: u16 = u16::MAX;

#[derive(Debug, Clone, Copy)]
struct Symbol {
    /// The first of its places.
    start: u16,
    count: u16,
}

/// A model of up to 1024 symbols.
#[derive(Debug)]
pub(crate) struct SymbolModel {
    /// All symbols, and an end that no place reaches.
    symbols: Box<[Symbol]>,
    /// The symbol that has the first place of each run of 2^shift places. Places are those of a rounded division, so there
    /// may be some more than there should be: one run more.
    table: Box<[u16]>,
    shift: u32,
    total: u32,
    cycle: u32,
    until_update: u32,
}

impl SymbolModel {
    pub(crate) fn new(symbols: u16) -> Self {
        // Two runs a symbol: most places are found without a step.
        let table_log2 = (u32::from(symbols).next_power_of_two().ilog2() + 1).min(10);
        let cycle = u32::from(symbols);
        let mut model = Self {
            symbols: vec![Symbol { start: END, count: 1 }; usize::from(symbols) + 1].into(),
            table: vec![0; (1 << table_log2) + 1].into(),
            shift: PLACES_LOG2 - table_log2,
            total: 0,
            cycle,
            until_update: 0,
        };
        model.update();
        model.cycle = (cycle + 6) >> 1;
        model.until_update = model.cycle;
        model
    }

    /// The symbol of a place, where its places begin, and where they end, if it is not the last symbol.
    #[inline]
    pub(crate) fn find(&self, place: u32) -> (usize, u32, Option<u32>) {
        let run = (place >> self.shift) as usize;
        let mut symbol = self.table.get(run).copied().map_or(0, usize::from);
        let mut start = self.symbols[symbol].start;
        let mut end = self.symbols[symbol + 1].start;
        while u32::from(end) <= place {
            symbol += 1;
            (start, end) = (end, self.symbols[symbol + 1].start);
        }
        (symbol, start.into(), (end != END).then_some(end.into()))
    }

    #[inline]
    pub(crate) fn count(&mut self, symbol: usize) {
        self.symbols[symbol].count += 1;
        self.until_update -= 1;
        if self.until_update == 0 {
            self.update();
        }
    }

    fn update(&mut self) {
        let [symbols @ .., _end] = &mut *self.symbols else { return };
        self.total += self.cycle;
        if self.total > MAX_TOTAL {
            self.total = 0;
            for symbol in &mut *symbols {
                symbol.count = (symbol.count + 1) >> 1;
                self.total += u32::from(symbol.count);
            }
        }
        let scale = (1 << 31) / self.total;
        let (mut sum, mut runs) = (0, 0);
        for (number, symbol) in symbols.iter_mut().enumerate() {
            let place = (scale * sum) >> (31 - PLACES_LOG2);
            sum += u32::from(symbol.count);
            symbol.start = place as u16;
            let first_run = place.div_ceil(1 << self.shift) as usize;
            self.table[runs..first_run].fill(number.saturating_sub(1) as u16);
            runs = first_run;
        }
        self.table[runs..].fill(symbols.len() as u16 - 1);
        self.cycle = ((5 * self.cycle) >> 2).min((symbols.len() as u32 + 6) << 3);
        self.until_update = self.cycle;
    }
}

/// Models with the same number of symbols, one for each context, made when they are first needed.
#[derive(Debug)]
pub(crate) struct Models {
    symbols: u16,
    models: Box<[Option<SymbolModel>]>,
}

impl Models {
    pub(crate) fn new(symbols: u16, contexts: usize) -> Self {
        Self { symbols, models: (0..contexts).map(|_| None).collect() }
    }

    /// The model of a context that there is.
    #[inline]
    pub(crate) fn of(&mut self, context: usize) -> &mut SymbolModel {
        self.models[context].get_or_insert_with(|| SymbolModel::new(self.symbols))
    }
}

#[derive(Debug)]
pub(crate) struct BitModel {
    zeros: u32,
    total: u32,
    zero_places: u32,
    cycle: u32,
    until_update: u32,
}

impl BitModel {
    pub(crate) fn new() -> Self {
        Self { zeros: 1, total: 2, zero_places: MAX_BIT_TOTAL / 2, cycle: 4, until_update: 4 }
    }

    /// How many of the places are those of 0, neither none nor all.
    #[inline]
    pub(crate) fn zero_places(&self) -> u32 {
        self.zero_places
    }

    #[inline]
    pub(crate) fn count(&mut self, bit: bool) {
        self.zeros += u32::from(!bit);
        self.until_update -= 1;
        if self.until_update == 0 {
            self.update();
        }
    }

    fn update(&mut self) {
        self.total += self.cycle;
        if self.total > MAX_BIT_TOTAL {
            self.total = (self.total + 1) >> 1;
            self.zeros = (self.zeros + 1) >> 1;
            if self.zeros == self.total {
                self.total += 1;
            }
        }
        let scale = (1 << 31) / self.total;
        self.zero_places = (self.zeros * scale) >> (31 - BIT_PLACES_LOG2);
        self.cycle = ((5 * self.cycle) >> 2).min(64);
        self.until_update = self.cycle;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever comes, each symbol keeps a place, and the table leads to the symbol that has it.
    #[test]
    fn every_symbol_has_places_and_is_found_by_them() {
        for symbols in [2, 3, 16, 17, 33, 64, 128, 256, 516] {
            let mut model = SymbolModel::new(symbols);
            for k in 0..20_000_u32 {
                let skewed = if k % 7 == 0 { k as usize * 31 % usize::from(symbols) } else { 0 };
                model.count(skewed);
            }
            let starts: Vec<u32> =
                model.symbols[..symbols.into()].iter().map(|symbol| symbol.start.into()).collect();
            assert!(starts.is_sorted_by(|a, b| a < b) && starts[0] == 0);
            for place in 0..(1 << PLACES_LOG2) + 64 {
                let expected = starts.partition_point(|&start| start <= place) - 1;
                let (symbol, start, end) = model.find(place);
                assert_eq!((symbol, start), (expected, starts[expected]));
                assert_eq!(end, starts.get(symbol + 1).copied());
            }
        }
    }

    #[test]
    fn both_bits_keep_places() {
        for bit in [false, true] {
            let mut model = BitModel::new();
            for _ in 0..100_000 {
                model.count(bit);
                assert!((1..MAX_BIT_TOTAL).contains(&model.zero_places()));
            }
        }
    }
}
