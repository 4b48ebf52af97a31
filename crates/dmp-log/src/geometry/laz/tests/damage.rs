//! Any bytes make points or an error, and soon.

use super::files::{Made, Random, check, decode};

/// A file of some format, small enough to be decoded thousands of times, with where its points and its table begin.
pub(super) fn small(format: u8, points: usize, chunk: u32) -> (Vec<u8>, usize, usize) {
    let made = Made { chunk: Some(chunk), ..Made::new(format, 2, points, 3) };
    let file = made.file();
    let data_at = check(&file).unwrap().data_at as usize;
    let table_at = u64::from_le_bytes(file[data_at..data_at + 8].try_into().unwrap()) as usize;
    (file, data_at, table_at)
}

/// Eleven bytes of this are a change of the sequence of times without end: a decoder that calls itself for each has no stack
/// left after some hundred thousand.
#[test]
fn sequences_of_times_that_change_without_end_are_refused() {
    for format in [1, 6] {
        let (file, data_at, _) = small(format, 200, 100);
        let mut refused = 0;
        for at in data_at..file.len() - 11 {
            let mut changed = file.clone();
            changed[at..at + 11].fill(0xff);
            refused += usize::from(decode(&changed).is_err());
        }
        let tried = file.len() - 11 - data_at;
        println!("format {format}: {refused} of {tried} refused");
        assert!(refused > tried / 4);
    }
    // A layer, and a stream, of nothing else.
    for format in [1, 6] {
        let (mut file, data_at, table_at) = small(format, 200, 100);
        let record_bytes = if format == 1 { 30 } else { 32 + 4 + 11 * 4 };
        file[data_at + 8 + record_bytes..table_at].fill(0xff);
        let problem = decode(&file).unwrap_err();
        assert!(problem.contains("chunk"), "{problem}");
    }
}

pub(super) fn change(random: &mut Random, file: &mut Vec<u8>, data_at: usize, table_at: usize) {
    let below = |random: &mut Random, end: usize| random.below(end as u64) as usize;
    let at = data_at + below(random, file.len() - data_at);
    let run = (at + 1 + below(random, 40)).min(file.len());
    match random.below(8) {
        0 => file[at] = random.next() as u8,
        1 => file[at..run].fill(0xff),
        2 => file[at..run].fill(0),
        3 => file[at..run].iter_mut().for_each(|byte| *byte = random.next() as u8),
        4 => file.truncate(at),
        // Sizes of layers of the first chunk, or what is there in other formats.
        5 => {
            let size_at = data_at + 8 + 32 + 4 * below(random, 12);
            let size = [0, 1, 7, 1000, u32::MAX, 1 << 30][below(random, 6)];
            file[size_at..size_at + 4].copy_from_slice(&size.to_le_bytes());
        }
        // The table, its number of chunks and what says where it is.
        6 => {
            let at = table_at + below(random, file.len() - table_at);
            file[at] = random.next() as u8;
        }
        _ => {
            let place = data_at as u64 + random.below(table_at as u64);
            file[data_at..data_at + 8].copy_from_slice(&place.to_le_bytes());
        }
    }
}

#[test]
fn no_damage_makes_a_decoder_panic() {
    let mut random = Random(9);
    for format in [0, 1, 3, 5, 6, 7, 8] {
        let (file, data_at, table_at) = small(format, 300, 150);
        let mut refused = 0;
        for _ in 0..1500 {
            let mut changed = file.clone();
            for _ in 0..=random.below(3) {
                if changed.len() > table_at + 12 {
                    change(&mut random, &mut changed, data_at, table_at);
                }
            }
            match decode(&changed) {
                Ok(records) => assert_eq!(records.len() % 300, 0),
                Err(problem) => {
                    refused += 1;
                    assert!(problem.contains("byte"), "{problem}");
                }
            }
        }
        println!("format {format}: {refused} of 1500 refused");
    }
}

/// There is no checksum; but what is decoded from other bits takes another number of them.
#[test]
fn a_changed_byte_is_noticed_mostly() {
    for format in [1, 6] {
        let (file, data_at, table_at) = small(format, 4000, 2000);
        let mut random = Random(5);
        let mut refused = 0;
        for _ in 0..200 {
            // Within the first chunk, behind its first point and sizes.
            let mut changed = file.clone();
            let place = random.below((table_at - data_at) as u64 / 4) as usize;
            changed[data_at + 100 + place] ^= 1 << random.below(8);
            refused += usize::from(decode(&changed).is_err());
        }
        println!("format {format}: {refused} of 200 refused");
        assert!(refused > 150, "{refused}");
    }
}

/// What a table claims is compared with the file before anything is allocated.
#[test]
fn chunks_larger_than_the_file_are_refused() {
    let made = Made { chunk: None, ..Made::new(6, 0, 3000, 3) };
    let file = made.file();
    let data_at = check(&file).unwrap().data_at as usize;
    let table_at = u64::from_le_bytes(file[data_at..data_at + 8].try_into().unwrap()) as usize;
    for count in [u32::MAX, 1 << 20, 0, 1] {
        let mut changed = file.clone();
        changed[table_at + 4..table_at + 8].copy_from_slice(&count.to_le_bytes());
        let problem = decode(&changed).unwrap_err();
        assert!(problem.contains("chunk"), "{problem}");
    }
    let mut noise = Random(6);
    for _ in 0..300 {
        let mut changed = file.clone();
        changed[table_at + 8..].iter_mut().for_each(|byte| *byte = noise.next() as u8);
        assert!(decode(&changed).is_err());
    }
}
