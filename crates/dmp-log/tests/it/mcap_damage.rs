//! Damaged MCAP files: what is lost is named, all else is read, by the whole log, by its index, and in several threads.

use crate::common::{
    Message, POINTS, Random, assert_says, chunks, in_threads, open, open_error, read_all, records, scans,
    write_mcap, write_with,
};
use crate::parts::{bits, scans_of, sorted};
use dmp_log::{LogOptions, McapCompression, open_log, outline_log};
use dmp_sensor::Scan;
use mcap::records::op;
use std::fs;
use std::path::{Path, PathBuf};

const ALL: [McapCompression; 3] = [McapCompression::Zstd, McapCompression::Lz4, McapCompression::None];

/// A file in a folder of its own, with two or three scans a chunk.
pub(crate) struct File {
    _folder: tempfile::TempDir,
    pub(crate) path: PathBuf,
    bytes: Vec<u8>,
    written: Vec<Scan>,
}

impl File {
    fn new(count: usize, compression: McapCompression) -> Self {
        let written = scans(count, 300, true);
        let mut file = Self::with("log.mcap", Vec::new(), written);
        write_mcap(&file.path, &file.written, compression);
        file.bytes = fs::read(&file.path).unwrap();
        file
    }

    pub(crate) fn with(name: &str, bytes: Vec<u8>, written: Vec<Scan>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        Self { _folder: folder, path, bytes, written }
    }

    /// The damage once the file has these bytes, and `kept` of its scans are read: by the whole log, in threads, and,
    /// where `by_index`, by the index.
    #[track_caller]
    pub(crate) fn damage(&self, bytes: &[u8], kept: &[Scan], by_index: bool) -> Vec<String> {
        fs::write(&self.path, bytes).unwrap();
        let (found, damage) = in_threads(|| {
            let log = open(&self.path);
            (read_all(&*log), sorted(&log.summary().damage))
        });
        assert!(found == kept, "{} scans, not {}", found.len(), kept.len());
        if by_index {
            let outline = outline_log(&self.path, &LogOptions::default()).unwrap();
            let part = outline.open(&(0..outline.scans().len()).collect::<Vec<_>>()).unwrap();
            assert!(scans_of(&*part).iter().map(bits).eq(kept.iter().map(bits)));
            assert_eq!(sorted(&part.summary().damage), damage);
        }
        damage
    }
}

#[test]
fn a_file_cut_anywhere_keeps_the_whole_chunks_before_the_cut() {
    for compression in ALL {
        let file = File::new(16, compression);
        let groups = open(&file.path).groups();
        let ends: Vec<usize> = chunks(&file.bytes).iter().map(|chunk| chunk.end).collect();
        assert_eq!(groups.len(), ends.len());
        let (middle, last) = (file.bytes.len() / 2, *ends.last().unwrap());
        // At the end of a chunk, in one, in the index behind it, in the summary.
        for cut in
            [ends[0], ends[0] + 1, ends[2] + 5, ends[2] + 20, middle, ends[3] - 1, last - 1, last, last + 40]
        {
            let kept = groups[ends.iter().filter(|&&end| end <= cut).count() - 1].end;
            let damage = file.damage(&file.bytes[..cut], &file.written[..kept], true);
            let [damage] = damage.as_slice() else { panic!("{damage:?}") };
            assert_says(damage, &["byte ", &format!("ends at byte {cut}"), "lost"]);
        }
        // Cut in the end of the summary, no scan is lost, but the file is not whole.
        let damage = file.damage(&file.bytes[..file.bytes.len() - 3], &file.written, true);
        assert_says(&damage[0], &["inside its summary", "no scan is lost"]);
        // Cut before the first whole chunk, there is nothing.
        fs::write(&file.path, &file.bytes[..ends[0] - 1]).unwrap();
        let error = open_error(&file.path, &LogOptions::default());
        assert_says(&error, &["log.mcap", "no scan can be read", "byte"]);
        assert_eq!(outline_log(&file.path, &LogOptions::default()).unwrap_err().to_string(), error);
    }
}

#[test]
fn one_flipped_byte_costs_one_chunk() {
    for compression in ALL {
        let file = File::new(16, compression);
        let groups = open(&file.path).groups();
        for (index, chunk) in chunks(&file.bytes).into_iter().enumerate() {
            let head = chunk.start + 9;
            let middle = usize::midpoint(chunk.start, chunk.end);
            for at in [head + 16, head + 24, head + 32, chunk.start + 80, middle, chunk.end - 20] {
                let mut flipped = file.bytes.clone();
                flipped[at] ^= 0x10;
                let mut kept = file.written.clone();
                kept.drain(groups[index].clone());
                let damage = file.damage(&flipped, &kept, at >= chunk.start + 80);
                let [damage] = damage.as_slice() else { panic!("{damage:?}") };
                assert_says(damage, &[&format!("byte {}: ", chunk.start), "chunk", "skipped"]);
            }
        }
    }
}

/// A part meets the damage that lies in its chunks.
#[test]
fn a_damaged_chunk_costs_the_parts_that_need_it() {
    let file = File::new(150, McapCompression::Lz4);
    let lost = open(&file.path).groups()[20].clone();
    let chunk = chunks(&file.bytes)[20].clone();
    let mut broken = file.bytes.clone();
    broken[usize::midpoint(chunk.start, chunk.end)] ^= 0x10;
    fs::write(&file.path, &broken).unwrap();
    let outline = outline_log(&file.path, &LogOptions::default()).unwrap();
    assert_eq!((outline.scans().len(), outline.damage()), (150, [].as_slice()));
    for (wanted, damaged) in [([lost.start - 1, lost.end, 100], 0), ([3, lost.start, lost.end], 1)] {
        let part = outline.open(&wanted).unwrap();
        let kept: Vec<usize> = wanted.into_iter().filter(|number| !lost.contains(number)).collect();
        let numbers = (0..part.frames().len()).map(|frame| part.number_in_log(frame));
        assert_eq!((numbers.collect::<Vec<_>>(), part.scans_in_log()), (kept.clone(), 150));
        assert!(scans_of(&*part).iter().map(bits).eq(kept.iter().map(|&number| bits(&file.written[number]))));
        let damage = &part.summary().damage;
        assert_eq!(damage.len(), damaged);
        damage.iter().for_each(|damage| assert_eq!(damage.place, format!("byte {}", chunk.start)));
    }
    // Nothing is left of a part in that chunk alone.
    let error = outline.open(&[lost.start]).unwrap_err().to_string();
    assert_says(&error, &["log.mcap", "no scan that can be read", &format!("byte {}", chunk.start)]);
}

#[test]
fn the_summary_helps_past_a_broken_length() {
    let file = File::new(16, McapCompression::Zstd);
    let groups = open(&file.path).groups();
    let start = chunks(&file.bytes)[2].start;
    let mut kept = file.written.clone();
    kept.drain(groups[2].clone());
    for length in [u64::MAX, 1 << 40, 30_000, 0] {
        let mut broken = file.bytes.clone();
        broken[start + 1..start + 9].copy_from_slice(&length.to_le_bytes());
        assert_says(&file.damage(&broken, &kept, false)[0], &[&format!("byte {start}: ")]);
        // Without the summary the tail is lost, and the damage says so.
        if length > broken.len() as u64 {
            broken.truncate(broken.len() - 8);
            let damage = file.damage(&broken, &file.written[..groups[1].end], false);
            assert_says(&damage[0].replace(',', ""), &[&length.to_string(), "the tail is lost"]);
        }
    }
}

#[test]
fn messages_outside_chunks_are_read_and_checked_by_the_data_crc() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let message = Message::of(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]).encode();
    let messages: Vec<_> = (0..10).map(|_| (0, message.clone())).collect();
    write_with(&path, mcap::WriteOptions::new().use_chunks(false), &[POINTS], &messages);
    let log = open(&path);
    assert_eq!((read_all(&*log).len(), log.summary().damage.as_slice()), (10, &[][..]));
    assert_eq!(log.groups(), [0..8, 8..10]);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.windows(4).position(|w| w == 5_f32.to_le_bytes()).unwrap();
    bytes[middle] ^= 1;
    fs::write(&path, bytes).unwrap();
    let log = open(&path);
    assert_eq!(log.frames().len(), 10);
    assert_says(&log.summary().damage[0].what, &["CRC of the data"]);
}

#[test]
fn a_file_that_changes_after_opening_is_noticed() {
    let mut file = File::new(16, McapCompression::Zstd);
    let log = open(&file.path);
    let chunk = chunks(&file.bytes)[1].clone();
    let frame = log.groups()[1].start;
    let error = || log.reader().unwrap().read(frame, &mut Scan::default()).unwrap_err().to_string();
    file.bytes[usize::midpoint(chunk.start, chunk.end)] ^= 1;
    fs::write(&file.path, &file.bytes).unwrap();
    assert_says(&error(), &["log.mcap", &format!("frame {frame}"), &format!("byte {}", chunk.start)]);
    fs::write(&file.path, &file.bytes[..100]).unwrap();
    assert_says(&error(), &["log.mcap", &format!("frame {frame}"), "shorter than it was"]);
}

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], &(body.len() as u64).to_le_bytes()[..], body].concat()
}

fn chunk(uncompressed: u64, compression: &str, claimed: u64, data: &[u8]) -> Vec<u8> {
    let (uncompressed, claimed) = (uncompressed.to_le_bytes(), claimed.to_le_bytes());
    let name = [&(compression.len() as u32).to_le_bytes(), compression.as_bytes()].concat();
    record(op::CHUNK, &[&[0; 16], &uncompressed[..], &[0; 4], &name, &claimed, data].concat())
}

/// Sizes that no file keeps are refused record by record; the good chunks around stay.
#[test]
fn forged_sizes_are_refused() {
    let file = File::new(8, McapCompression::Lz4);
    // Behind the magic and the header record.
    let header = records(&file.bytes)[0].1.end;
    // The summary's offsets do not hold any more: the file has none.
    let with =
        |forged: &[u8]| [&file.bytes[..header], forged, &file.bytes[header..file.bytes.len() - 8]].concat();
    let endless = [&[5, 255, 255, 255, 255, 255, 255, 255, 255][..], &[0; 21]].concat();
    for (forged, why) in [
        (chunk(u64::MAX, "zstd", 4, &[1; 4]), "claims 18,446,744,073,709,551,615 bytes unpacked"),
        (chunk(300 << 20, "zstd", 4, &[1; 4]), "more than the 268,435,456 allowed"),
        (chunk(100, "zstd", u64::MAX, &[1; 4]), "claims 18,446,744,073,709,551,615 bytes of 4"),
        (chunk(100, "brotli", 4, &[1; 4]), "unknown compression `brotli`"),
        (chunk(100, &"x".repeat(40), 4, &[1; 4]), "claims 40 bytes"),
        (chunk(100, "", 4, &[1; 4]), "not compressed"),
        (chunk(100, "zstd", 4, &[1; 4]), "damaged"),
        (chunk(100, "lz4", 4, &[1; 4]), "damaged"),
        (record(op::CHUNK, &[0; 39]), "39 bytes, fewer than its header"),
        (record(op::MESSAGE, &[0; 21]), "a message of 21 bytes"),
        (chunk(30, "", 30, &endless), "last 30 bytes"),
        (record(op::SCHEMA, &[1, 0, 255, 255, 255, 255]), "byte"),
        (record(op::CHANNEL, &[255; 12]), "byte"),
    ] {
        let damage = file.damage(&with(&forged), &file.written, false);
        let place = format!("byte {header}: ");
        assert!(
            damage.iter().any(|line| line.starts_with(&place) && line.contains(why)),
            "{why}: {damage:?}"
        );
    }
    // A hundred thousand messages that are lost are a short list.
    let damage = file.damage(&with(&record(op::MESSAGE, &[0; 21]).repeat(100_000)), &file.written, false);
    assert!(damage.len() < 120 && damage.iter().any(|line| line == "99,900 more places: a message of …"));

    // A kilobyte of zstd that claims, and has, far more than is allowed is not unpacked beyond the limit.
    let options = mcap::WriteOptions::new().chunk_size(None);
    write_with(&file.path, options, &[POINTS], &[(0, vec![0; 300 << 20])]);
    assert!(fs::metadata(&file.path).unwrap().len() < 100_000);
    let error = open_error(&file.path, &LogOptions::default());
    assert_says(&error, &["log.mcap", "no scan that can be read", "268,435,456 allowed"]);
}

/// Clouds of points that compress badly.
fn clouds(path: &Path, options: mcap::WriteOptions, count: i64, points: usize) {
    let mut random = Random(5);
    let mut message = |k: i64| {
        let mut coordinate = || (random.next() % 100_000) as f32 / 1000.0;
        let points: Vec<[f32; 3]> = (0..points).map(|_| std::array::from_fn(|_| coordinate())).collect();
        (0, Message { stamp_ns: 1_000_000_000 * (k + 1), ..Message::of(&points) }.encode())
    };
    write_with(path, options, &[POINTS], &(0..count).map(&mut message).collect::<Vec<_>>());
}

/// Messages between chunks are read between them; chunks that take more than what waits for each thread are read all the same.
#[test]
fn chunks_are_unpacked_in_threads_in_their_order() {
    let folder = tempfile::tempdir().unwrap();
    let [path, loose] = ["log.mcap", "loose.mcap"].map(|name| folder.path().join(name));
    let found = |path: &Path| {
        in_threads(|| {
            let log = open_log(path, &LogOptions::default()).unwrap();
            (format!("{:?} {:?}", log.summary(), log.frames()), read_all(&*log))
        })
    };
    clouds(&path, mcap::WriteOptions::new().chunk_size(Some(4000)), 37, 200);
    clouds(&loose, mcap::WriteOptions::new().use_chunks(false), 3, 200);
    let (chunked, loose) = (fs::read(&path).unwrap(), fs::read(&loose).unwrap());
    let between =
        records(&loose).into_iter().filter(|(op, _)| [op::CHANNEL, op::SCHEMA, op::MESSAGE].contains(op));
    let between: Vec<u8> = between.flat_map(|(_, place)| loose[place].to_vec()).collect();
    let mut bytes = chunked[..8].to_vec();
    for (number, (_, place)) in records(&chunked).into_iter().enumerate() {
        bytes.extend_from_slice(&chunked[place]);
        if number % 20 == 12 {
            bytes.extend_from_slice(&between);
        }
    }
    fs::write(&path, &bytes).unwrap();
    let (summary, scans) = found(&path);
    assert!(scans.len() > 40 && summary.contains("the file ends at byte"), "{summary}");

    clouds(&path, mcap::WriteOptions::new().chunk_size(Some(4_500_000)), 10, 200_000);
    assert_eq!(found(&path).1.len(), 10);
    let mut bytes = fs::read(&path).unwrap();
    let quarter = bytes.len() / 4;
    bytes[quarter..quarter + 1000].iter_mut().for_each(|byte| *byte ^= 0x5a);
    fs::write(&path, bytes).unwrap();
    let (summary, scans) = found(&path);
    assert!(summary.contains("damaged and skipped") && scans.len() < 10, "{summary}");
}
