//! Damage to the records of an MCAP file, and to the messages in its chunks, with checksums that are right.

use super::bytes::{self, odd_number, set_number};
use super::cdr;
use crate::attack::mcap::{CHUNK, Chunk, DATA_END, FOOTER, MESSAGE, Record, file_of, of_file};
use crate::trials::Random;

/// One damage; false where the file is none that can be taken apart.
pub(super) fn damage(file: &mut Vec<u8>, random: &mut Random) -> bool {
    let Some(mut records) = of_file(file).filter(|records| !records.is_empty()) else { return false };
    let chunks: Vec<usize> = (0..records.len()).filter(|&at| records[at].op == CHUNK).collect();
    if !chunks.is_empty() && random.below(10) < 6 {
        let at = *random.pick(&chunks);
        let Some(mut chunk) = Chunk::unpacked(&records[at]) else { return false };
        for _ in 0..=random.below(3) {
            damage_records(&mut chunk.records, random);
        }
        let Ok(packed) = chunk.packed() else { return false };
        records[at] = packed;
    } else {
        damage_records(&mut records, random);
    }
    mend(&mut records, random);
    *file = file_of(&records);
    if random.once_in(12) {
        file.truncate(random.below(file.len()));
    }
    if random.once_in(12) {
        // The length of a record, which nothing guards.
        let at =
            8 + records.iter().take(random.below(records.len())).map(|r| 9 + r.body.len()).sum::<usize>();
        set_number(file, at + 1, 8, false, random);
    }
    true
}

fn damage_records(records: &mut Vec<Record>, random: &mut Random) {
    let (one, other) = (random.below(records.len()), random.below(records.len()));
    let Some(record) = records.get_mut(one) else { return };
    match random.below(16) {
        0 => record.op = odd_number(random) as u8,
        1 => drop(records.remove(one)),
        2 => {
            let again = record.clone();
            let times = (*random.pick(&[1, 1, 1, 200])).min((1 << 22) / again.body.len().max(1));
            records.splice(other..other, vec![again; times]);
        }
        3 => records.swap(one, other),
        4 => bytes::damage(&mut record.body, b"", random),
        5 => record.body.truncate(random.below(record.body.len() + 1)),
        6 => {
            if let Ok(bomb) = Chunk::bomb(random) {
                records.insert(other, bomb);
            }
        }
        7..=10 => damage_message(records, random),
        _ => {
            let numbers = record.numbers();
            if !numbers.is_empty() {
                let (at, width) = *random.pick(&numbers);
                set_number(&mut record.body, at, width, false, random);
            }
        }
    }
}

/// What a message says, behind the 22 bytes of its head.
fn damage_message(records: &mut [Record], random: &mut Random) {
    let messages: Vec<usize> = (0..records.len()).filter(|&at| records[at].op == MESSAGE).collect();
    if messages.is_empty() {
        return;
    }
    // The same damage in all messages goes further than in one, which is left out.
    let (one, is_all, again) = (*random.pick(&messages), random.once_in(3), random.next());
    for at in if is_all { messages } else { vec![one] } {
        let body = &mut records[at].body;
        if let Some(said) = body.get(22..) {
            let mut said = said.to_vec();
            cdr::damage(&mut said, &mut Random::of(&[again]));
            body.truncate(22);
            body.extend(said);
        }
    }
}

/// Checksums of the whole are left out, which is allowed; often the summary too, whose places are wrong now.
fn mend(records: &mut [Record], random: &mut Random) {
    let drop_summary = random.once_in(2);
    for record in records {
        match (record.op, record.body.len()) {
            (DATA_END, 4) => record.body.fill(0),
            (FOOTER, 20) => record.body[if drop_summary { 0 } else { 16 }..].fill(0),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_file_can_be_damaged_again() {
        let message = Record { op: MESSAGE, body: vec![0; 60] };
        let mut random = Random::of(&[5]);
        for _ in 0..100 {
            let footer = Record { op: FOOTER, body: vec![1; 20] };
            let mut file = file_of(&[message.clone(), footer]);
            for _ in 0..4 {
                if !damage(&mut file, &mut random) || file.len() > 1 << 20 {
                    break;
                }
            }
        }
        assert!(!damage(&mut b"no magic".to_vec(), &mut random));
    }
}
