//! The item `POINT14`, versions 3 and 4: what all points of formats from 6 on have, each field in a layer of its own. The
//! versions differ in what follows for other items, not here.

use crate::geometry::laz::coder::{Decoder, IntegerDecoder, Median, Models, SymbolModel};
use crate::geometry::laz::fields::gps_time::GpsTimes;
use crate::geometry::laz::fields::record;
use crate::geometry::laz::fields::record::{GPS_TIME_14, Place};
use crate::geometry::laz::fields::returns::{Return, by_width};

/// The layers that are decoded, among those of a chunk.
pub(crate) const XY_LAYER: usize = 0;
pub(crate) const Z_LAYER: usize = 1;
pub(crate) const GPS_TIME_LAYER: usize = 8;
/// Layers of this item.
pub(crate) const LAYERS: u64 = 9;

/// Channels of a scanner, each of which has its own models.
const CHANNELS: usize = 4;

/// What is expected of the next point of a channel.
#[derive(Debug, Clone, Copy)]
struct Last {
    place: Place,
    which: Return,
    /// The bits of a float64 in seconds.
    gps_time: i64,
    gps_time_changed: bool,
}

#[derive(Debug)]
struct Channel {
    last: Last,
    changed: Models,
    /// To which other channel the scanner changes.
    changes: SymbolModel,
    returns_of: Models,
    return_numbers: Models,
    return_numbers_same_time: SymbolModel,
    dx: IntegerDecoder,
    dy: IntegerDecoder,
    z: IntegerDecoder,
    dx_expected: [Median; 12],
    dy_expected: [Median; 12],
    z_expected: [i32; 8],
    gps_times: GpsTimes,
}

impl Channel {
    fn after(last: Last) -> Self {
        Self {
            last: Last { gps_time_changed: false, ..last },
            changed: Models::new(128, 8),
            changes: SymbolModel::new(CHANNELS as u16 - 1),
            returns_of: Models::new(16, 16),
            return_numbers: Models::new(16, 16),
            return_numbers_same_time: SymbolModel::new(13),
            dx: IntegerDecoder::new(32, 2),
            dy: IntegerDecoder::new(32, 22),
            z: IntegerDecoder::new(32, 20),
            dx_expected: [Median::new(); 12],
            dy_expected: [Median::new(); 12],
            z_expected: [last.place[2]; 8],
            gps_times: GpsTimes::new(last.gps_time, 1),
        }
    }

    /// The context of what has changed: the first and the last return of a pulse, and whether the time changed before.
    fn context(&self) -> usize {
        let Return { number, of } = self.last.which;
        usize::from(number == 1) + 2 * usize::from(number >= of) + 4 * usize::from(self.last.gps_time_changed)
    }

    fn decode_return(&mut self, xy: &mut Decoder, changed: usize, gps_time_changed: bool) -> Return {
        let Return { number, of } = self.last.which;
        let of = if changed >> 2 & 1 == 1 { xy.symbol(self.returns_of.of(of)) } else { of };
        let number = match changed & 3 {
            0 => number,
            1 => number + 1,
            2 => number + 15,
            _ if gps_time_changed => xy.symbol(self.return_numbers.of(number)),
            _ => number + xy.symbol(&mut self.return_numbers_same_time) + 2,
        };
        Return { number: number & 15, of }
    }
}

/// Decodes places and times of the points of a chunk.
#[derive(Debug)]
pub(crate) struct Point14 {
    xy: Decoder,
    /// `None` where all points have the first one's height.
    z: Option<Decoder>,
    /// `None` where all points have the first one's time.
    gps_time: Option<Decoder>,
    channels: [Option<Box<Channel>>; CHANNELS],
    current: usize,
}

impl Point14 {
    pub(crate) fn new(first: &[u8], [xy, z, gps_time]: [Vec<u8>; 3]) -> Self {
        let [returns, flags] = record::get(first, 14).map(usize::from);
        let last = Last {
            place: record::place(first),
            which: Return { number: returns & 15, of: returns >> 4 },
            gps_time: i64::from_le_bytes(record::get(first, GPS_TIME_14)),
            gps_time_changed: false,
        };
        let current = flags >> 4 & 3;
        let mut channels = [const { None }; CHANNELS];
        channels[current] = Some(Box::new(Channel::after(last)));
        let layer = |bytes: Vec<u8>| (!bytes.is_empty()).then(|| Decoder::new(bytes));
        Self { xy: Decoder::new(xy), z: layer(z), gps_time: layer(gps_time), channels, current }
    }

    /// Whether all that was decoded was there, and can have come from an encoder.
    pub(crate) fn is_sound(&self) -> bool {
        self.layers().all(Decoder::is_sound)
    }

    /// Bytes that were not needed.
    pub(crate) fn left_bytes(&self) -> usize {
        self.layers().map(Decoder::left_bytes).sum()
    }

    fn layers(&self) -> impl Iterator<Item = &Decoder> {
        [Some(&self.xy), self.z.as_ref(), self.gps_time.as_ref()].into_iter().flatten()
    }

    pub(crate) fn decode(&mut self, record: &mut [u8]) {
        let xy = &mut self.xy;
        let Some(channel) = &mut self.channels[self.current] else {
            // Not reached: the current channel is made before it becomes that.
            return xy.refuse();
        };
        let changed = xy.symbol(channel.changed.of(channel.context()));
        let mut channel = channel;
        if changed >> 6 & 1 == 1 {
            let last = channel.last;
            self.current = (self.current + xy.symbol(&mut channel.changes) + 1) % CHANNELS;
            channel = self.channels[self.current].get_or_insert_with(|| Box::new(Channel::after(last)));
        }
        let gps_time_changed = changed >> 4 & 1 == 1;
        let which = channel.decode_return(xy, changed, gps_time_changed);
        let (context, single) = (which.context_14() * 2 + usize::from(gps_time_changed), which.single());
        let dx = channel.dx.decode(xy, channel.dx_expected[context].get(), single);
        channel.dx_expected[context].add(dx);
        let width = channel.dx.width();
        let dy = channel.dy.decode(xy, channel.dy_expected[context].get(), by_width(width, 20, single));
        channel.dy_expected[context].add(dy);
        let [x, y, mut z] = channel.last.place;
        if let Some(layer) = &mut self.z {
            let width = u32::midpoint(width, channel.dy.width());
            let level = which.level();
            z = channel.z.decode(layer, channel.z_expected[level], by_width(width, 18, single));
            channel.z_expected[level] = z;
        }
        let mut gps_time = channel.last.gps_time;
        if let Some(layer) = self.gps_time.as_mut().filter(|_| gps_time_changed) {
            gps_time = channel.gps_times.decode(layer);
        }
        let place = [x.wrapping_add(dx), y.wrapping_add(dy), z];
        channel.last = Last { place, which, gps_time, gps_time_changed };
        record::put_place(record, place);
        record::put(record, GPS_TIME_14, gps_time.to_le_bytes());
    }
}
