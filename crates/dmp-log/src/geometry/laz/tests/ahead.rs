//! Chunks that are decoded ahead give the points and the errors of chunks that are decoded one by one.

use super::damage::{change, small};
use super::files::{Made, Random, check};
use crate::geometry::laz::reader::LazReader;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::io::Cursor;

pub(super) fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// What is read of a file, batch by batch: the number of the first point, and records or an error. After an error reading goes
/// on behind the chunk that it is in.
fn read_as(file: &[u8], batch: u64, is_ahead: bool) -> Vec<(u64, Result<Vec<u8>, String>)> {
    let header = match check(file) {
        Ok(header) => header,
        Err(problem) => return vec![(0, Err(problem))],
    };
    let (points, record_bytes) = (header.points, usize::from(header.record_bytes));
    let layout = header.laz.unwrap();
    let mut reader = LazReader::new(Cursor::new(file), layout.clone());
    if is_ahead {
        reader.go_ahead();
    }
    let (mut found, mut next) = (Vec::new(), 0);
    while next < points {
        let count = batch.min(points - next);
        let mut records = vec![0; count as usize * record_bytes];
        reader.seek(next);
        let read = reader.read(&mut records).map_err(|e| e.to_string());
        let after = if read.is_ok() { next + count } else { layout.end_of_chunk(next).unwrap_or(points) };
        found.push((next, read.map(|()| records)));
        next = after;
    }
    found
}

#[track_caller]
fn compare(file: &[u8], pool: &ThreadPool, what: &str) -> usize {
    let mut errors = 0;
    for batch in [70, 1000, 65_536] {
        let one_by_one = read_as(file, batch, false);
        let ahead = pool.install(|| read_as(file, batch, true));
        assert!(one_by_one == ahead, "{what}, in batches of {batch}");
        errors += one_by_one.iter().filter(|(_, read)| read.is_err()).count();
    }
    errors
}

#[test]
fn points_of_every_format_are_the_same() {
    let pools = [1, 2, 3].map(pool);
    for format in 0..=8 {
        for points in [0, 1, 2, 1000, 12_345] {
            for chunk in [Some(1000), Some(50_000), None] {
                let made = Made { chunk, ..Made::new(format, 3, points, 5 + u64::from(format)) };
                let what = format!("format {format}, {points} points, chunks of {chunk:?}");
                let file = made.file();
                for pool in &pools {
                    assert_eq!(compare(&file, pool, &what), 0);
                }
            }
        }
    }
}

/// A chunk that is too large is decoded batch by batch, those behind it are not.
#[test]
fn large_chunks_are_not_set_aside() {
    let made = Made { chunk: Some(300_000), ..Made::new(6, 0, 310_000, 5) };
    assert_eq!(compare(&made.file(), &pool(2), "a large chunk"), 0);
}

/// One chunk in the middle is damaged: what comes before and behind it is read.
#[test]
fn a_broken_chunk_costs_the_same_points() {
    for format in [1, 6] {
        let file = Made::new(format, 0, 9500, 3).file();
        let layout = check(&file).unwrap().laz.unwrap();
        for number in 0..10 {
            let (_, bytes) = layout.chunk(number).unwrap();
            for at in [bytes.start + 60, bytes.start + 400, u64::midpoint(bytes.start, bytes.end)] {
                let mut changed = file.clone();
                changed[at as usize..at as usize + 11].fill(0xff);
                compare(&changed, &pool(2), &format!("format {format}, chunk {number}, byte {at}"));
            }
        }
    }
}

#[test]
fn damage_is_named_in_the_same_words() {
    let (pool, mut random) = (pool(2), Random(12));
    for format in [0, 1, 3, 6, 7, 8] {
        let (file, data_at, table_at) = small(format, 3000, 700);
        let mut errors = 0;
        for number in 0..150 {
            let mut changed = file.clone();
            for _ in 0..=random.below(3) {
                if changed.len() > table_at + 12 {
                    change(&mut random, &mut changed, data_at, table_at);
                }
            }
            errors += compare(&changed, &pool, &format!("format {format}, change {number}"));
        }
        println!("format {format}: {errors} errors");
        assert!(errors > 50);
    }
}
