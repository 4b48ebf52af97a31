//! What every pass over a file of records does with a record: what a chunk, a message, a description is, and what is damage
//! in it, is said once, here.

use super::ahead::Ahead;
use super::channels::Channels;
use super::chunk::{ChunkDecoder, ChunkFault};
use super::framing::{Framing, Kind};
use super::last_message::StartIsEnough;
use super::message_index::Heads;
use super::records::{MAX_RECORD_BYTES, RecordPlace, Records, Source};
use crate::Damage;
use crate::file::DamageList;
use crate::messages::bag::basics::{Channel, FileFound};
use dmp_lengths::thousands;
use std::io;

/// Largest schema or channel record outside a chunk that is read.
const MAX_DESCRIPTION_BYTES: u64 = 16 << 20;

/// What is done with a message: its channel, the time it was recorded, its place, its body. Where only heads
/// are read the body is empty, and the place of a message in a chunk lacks its length.
pub(super) type Each<'a> = dyn FnMut(&Channel, u64, RecordPlace, &[u8]) + 'a;

/// A pass, and what it has found so far.
pub(super) struct Pass<'a, 'b> {
    pub(super) framing: Framing,
    pub(super) channels: Channels,
    pub(super) damage: DamageList,
    pub(super) decoder: ChunkDecoder,
    /// Of these messages, where they end a chunk of MCAP, no more is unpacked than a start, with zeros behind it.
    pub(super) start_is_enough: Option<fn(&Channel) -> bool>,
    /// Where chunks are unpacked on several threads.
    pub(super) ahead: Option<Ahead>,
    pub(super) each: &'a mut Each<'b>,
    /// Messages handed over, also those of unknown channels.
    pub(super) messages: u64,
    /// Where chunks are passed over.
    pub(super) heads: Option<Heads>,
    pub(super) unchunked_messages: bool,
    /// Whether the checksum over all data was compared: the only one of messages outside the chunks.
    pub(super) data_crc_compared: bool,
}

impl<'a, 'b> Pass<'a, 'b> {
    pub(super) fn new(framing: Framing, channels: Channels, each: &'a mut Each<'b>) -> Self {
        Self {
            framing,
            channels,
            damage: DamageList::default(),
            decoder: ChunkDecoder::default(),
            start_is_enough: None,
            ahead: None,
            each,
            messages: 0,
            heads: None,
            unchunked_messages: false,
            data_crc_compared: false,
        }
    }

    /// What was found in a file that was gone through, and the channels by number.
    pub(super) fn found(mut self, source: &Source) -> (FileFound, Channels) {
        for (id, count) in self.channels.unknown() {
            let what = format!(
                "{} messages of a channel that is not described before them are lost",
                thousands(count)
            );
            self.damage.push(Damage::new(format!("channel {id}"), what));
        }
        let found = FileFound {
            channels: self.channels.described(),
            damage: self.damage,
            bytes: source.length(),
            unguarded: self.unchunked_messages && !self.data_crc_compared || self.decoder.met_no_crc(),
        };
        (found, self.channels)
    }
}

impl Pass<'_, '_> {
    pub(super) fn lost(&mut self, at: u64, what: String) {
        if let Some(heads) = &mut self.heads {
            heads.doubt();
        }
        self.damage.push(Damage::new(format!("byte {at}"), what));
    }

    /// Reads a chunk; whether it is whole.
    pub(super) fn chunk(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<bool> {
        // Lent to this chunk: its records are looked at while the pass takes note of them.
        let mut decoder = std::mem::take(&mut self.decoder);
        let decoded = self.with_starts(|enough| {
            decoder.read(source, at, body_bytes, enough)?;
            decoder.unpack(enough)
        });
        let decoded = decoded.map(|()| self.records_of(decoder.records(), at, body_bytes));
        self.decoder = decoder;
        self.is_whole(decoded, at, body_bytes)
    }

    /// Reads a chunk that may wait for others; [`Self::take_ahead`] takes those that do.
    pub(super) fn chunk_ahead(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        let Some(mut ahead) = self.ahead.take() else { return self.chunk(source, at, body_bytes).map(drop) };
        let are_enough = self.with_starts(|enough| ahead.read(source, at, body_bytes, enough));
        self.ahead = Some(ahead);
        if are_enough? { self.take_ahead() } else { Ok(()) }
    }

    /// Calls `decode` with what says of which messages a start is enough.
    fn with_starts<T>(&self, decode: impl FnOnce(Option<StartIsEnough<'_>>) -> T) -> T {
        let of_channel = self.start_is_enough.filter(|_| self.framing == Framing::Mcap);
        let Some(is_enough) = of_channel else { return decode(None) };
        let channels = &self.channels;
        let of_number = |id: u32| channels.get(id).is_some_and(is_enough);
        decode(Some(&of_number))
    }

    /// Takes the chunks that wait, before anything that lies behind them.
    pub(super) fn take_ahead(&mut self) -> io::Result<()> {
        let Some(mut ahead) = self.ahead.take() else { return Ok(()) };
        for chunk in self.with_starts(|enough| ahead.unpack(enough)) {
            let decoded = chunk.fault.take().map_or(Ok(()), Err);
            if decoded.is_ok() {
                self.records_of(chunk.decoder.records(), chunk.at, chunk.body_bytes);
            }
            self.decoder.learn_from(&chunk.decoder);
            self.is_whole(decoded, chunk.at, chunk.body_bytes)?;
        }
        ahead.trim();
        self.ahead = Some(ahead);
        Ok(())
    }

    /// Whether a chunk gave its records; what is wrong with it is reported.
    fn is_whole(&mut self, decoded: Result<(), ChunkFault>, at: u64, body_bytes: u64) -> io::Result<bool> {
        match decoded {
            Ok(()) => Ok(true),
            Err(ChunkFault::Io(error)) => Err(error),
            Err(ChunkFault::Damaged(problem)) => {
                let bytes = thousands(body_bytes);
                self.lost(at, format!("a chunk of {bytes} bytes is damaged and skipped: {problem}"));
                Ok(false)
            }
        }
    }

    fn records_of(&mut self, records: &[u8], at: u64, body_bytes: u64) {
        let mut whole = Records::of(self.framing, records);
        for (opcode, place, body) in &mut whole {
            match self.framing.kind(opcode) {
                Kind::Description => {
                    if let Err(problem) = self.channels.describe(self.framing, opcode, body) {
                        self.lost(at, format!("in the chunk: {problem}"));
                    }
                }
                Kind::Message => {
                    let place = RecordPlace {
                        record_at: at,
                        record_bytes: body_bytes,
                        in_chunk: Some(place),
                        body_bytes: body.len() as u64,
                    };
                    self.add(place, body);
                }
                _ => {}
            }
        }
        let rest = whole.rest();
        if rest > 0 {
            let rest = thousands(rest);
            self.lost(at, format!("the last {rest} bytes of the chunk are no whole record and are lost"));
        }
    }

    pub(super) fn message(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        self.message_up_to(source, at, body_bytes, body_bytes)
    }

    /// Reads a message outside the chunks as far as its first `read_bytes` bytes.
    pub(super) fn message_up_to(
        &mut self,
        source: &mut Source,
        at: u64,
        body_bytes: u64,
        read_bytes: u64,
    ) -> io::Result<()> {
        self.unchunked_messages = true;
        if !(self.framing.message_head_bytes().unwrap_or(0)..=MAX_RECORD_BYTES).contains(&body_bytes) {
            self.lost(at, format!("a message of {} bytes is not read", thousands(body_bytes)));
            return Ok(());
        }
        let mut body = Vec::new();
        source.read_into(at + self.framing.head_bytes(), read_bytes, &mut body)?;
        let place = RecordPlace { record_at: at, record_bytes: body_bytes, in_chunk: None, body_bytes };
        self.add(place, &body);
        Ok(())
    }

    fn add(&mut self, place: RecordPlace, body: &[u8]) {
        let Some(message) = self.framing.split_message(body) else {
            let what = format!("a message of {} bytes has no whole header", body.len());
            return self.lost(place.record_at, what);
        };
        self.messages += 1;
        if let Some(channel) = self.channels.of_message(message.channel_id) {
            (self.each)(channel, message.log_time_ns, place, message.data);
        }
    }

    pub(super) fn description(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        if body_bytes > MAX_DESCRIPTION_BYTES {
            self.lost(at, format!("a channel or schema of {} bytes is not read", thousands(body_bytes)));
            return Ok(());
        }
        let mut body = Vec::new();
        source.read_into(at + self.framing.head_bytes(), body_bytes, &mut body)?;
        let (opcode, _) = source.head_at(at)?;
        if let Err(problem) = self.channels.describe(self.framing, opcode, &body) {
            self.lost(at, problem);
        }
        Ok(())
    }
}
