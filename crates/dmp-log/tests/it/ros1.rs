//! Bags of ROS 1 as rosbag writes them. The tests end to end include it.

use dmp_sensor::Scan;
use std::io::{Read as _, Write as _};
use std::ops::Range;

pub(crate) const ALL: [&str; 3] = ["none", "lz4", "bz2"];

/// A record: fields and data, each behind its length.
pub(crate) fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let field = |(name, value): &(&str, &[u8])| counted(&[name.as_bytes(), b"=", value].concat());
    [counted(&fields.iter().flat_map(field).collect::<Vec<_>>()), counted(data)].concat()
}

fn counted(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn time(stamp_ns: i64) -> Vec<u8> {
    [stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000].map(|part| (part as u32).to_le_bytes()).concat()
}

/// A `sensor_msgs/PointCloud2` in the form of ROS 1.
pub(crate) fn cloud(scan: &Scan) -> Vec<u8> {
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>();
    let field = |(name, offset, kind): &(&str, u32, u8)| {
        [counted(name.as_bytes()), words(&[*offset]), vec![*kind], words(&[1])].concat()
    };
    let fields = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("t", 12, 6)];
    let points = scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns);
    let point = |(point, offset_ns): (&[f32; 3], &i64)| {
        [point.map(f32::to_le_bytes).concat(), words(&[*offset_ns as u32])].concat()
    };
    let data: Vec<u8> = points.flat_map(point).collect();
    let (count, bytes) = (scan.len() as u32, data.len() as u32);
    let head = [words(&[7]), time(scan.stamp_ns.unwrap()), counted(b"lidar")].concat();
    let fields = [words(&[1, count, 4]), fields.iter().flat_map(field).collect()].concat();
    [head, fields, vec![0], words(&[16, bytes]), counted(&data), vec![1]].concat()
}

pub(crate) fn packed(bytes: &[u8], packing: &str) -> Vec<u8> {
    let mut packed = Vec::new();
    match packing {
        "lz4" => {
            let mut lz4 = lz4::EncoderBuilder::new().build(&mut packed).unwrap();
            lz4.write_all(bytes).unwrap();
            lz4.finish().1.unwrap();
        }
        "bz2" => {
            let level = bzip2::Compression::best();
            bzip2::read::BzEncoder::new(bytes, level).read_to_end(&mut packed).map(drop).unwrap();
        }
        _ => packed.extend(bytes),
    }
    packed
}

pub(crate) fn chunk(packing: &str, size: u32, data: &[u8]) -> Vec<u8> {
    record(&[("op", &[5]), ("compression", packing.as_bytes()), ("size", &size.to_le_bytes())], data)
}

pub(crate) fn connection(topic: &str, message_type: &str) -> Vec<u8> {
    let described = [("topic", topic), ("type", message_type), ("md5sum", "*")];
    let field = |(name, value): (&str, &str)| counted(format!("{name}={value}").as_bytes());
    let head: [(&str, &[u8]); 3] = [("op", &[7]), ("conn", &[0; 4]), ("topic", topic.as_bytes())];
    record(&head, &described.into_iter().flat_map(field).collect::<Vec<_>>())
}

pub(crate) fn bag_header(index_at: u64, chunks: u32) -> Vec<u8> {
    let (index_at, chunks) = (index_at.to_le_bytes(), chunks.to_le_bytes());
    let fields: [(&str, &[u8]); 4] =
        [("op", &[3]), ("index_pos", &index_at), ("conn_count", &[1, 0, 0, 0]), ("chunk_count", &chunks)];
    record(&fields, &[b' '; 40])
}

pub(crate) fn message(stamp_ns: i64, body: &[u8]) -> Vec<u8> {
    record(&[("op", &[2]), ("conn", &[0; 4]), ("time", &time(stamp_ns))], body)
}

pub(crate) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Scans in a chunk.
pub(crate) const SCANS: usize = 2;

/// A bag, where its chunks are, without the indexes behind them, and its own index.
pub(crate) struct Bag {
    pub(crate) bytes: Vec<u8>,
    pub(crate) chunks: Vec<Range<usize>>,
    pub(crate) index_at: usize,
}

impl Bag {
    pub(crate) fn new(scans: &[Scan], packing: &str) -> Self {
        let body_of = |scan: &Scan| (scan.stamp_ns.unwrap(), cloud(scan));
        Self::of("sensor_msgs/PointCloud2", &scans.iter().map(body_of).collect::<Vec<_>>(), packing)
    }

    pub(crate) fn of(message_type: &str, messages: &[(i64, Vec<u8>)], packing: &str) -> Self {
        let described = connection("/points", message_type);
        let (mut bytes, mut chunks, mut infos) = (Vec::new(), Vec::new(), Vec::new());
        bytes.extend_from_slice(&[MAGIC, &bag_header(0, 0)].concat());
        for (number, of_chunk) in messages.chunks(SCANS).enumerate() {
            // As rosbag writes it: a topic is described where it comes first.
            let mut records = if number == 0 { described.clone() } else { Vec::new() };
            let mut entries = Vec::new();
            for (stamp_ns, body) in of_chunk {
                entries.extend([time(*stamp_ns), (records.len() as u32).to_le_bytes().into()].concat());
                records.extend(message(*stamp_ns, body));
            }
            let (at, count) = (bytes.len(), (of_chunk.len() as u32).to_le_bytes());
            bytes.extend(chunk(packing, records.len() as u32, &packed(&records, packing)));
            chunks.push(at..bytes.len());
            let index: [(&str, &[u8]); 4] =
                [("op", &[4]), ("ver", &[1, 0, 0, 0]), ("conn", &[0; 4]), ("count", &count)];
            bytes.extend(record(&index, &entries));
            let at = (at as u64).to_le_bytes();
            let info: [(&str, &[u8]); 4] =
                [("op", &[6]), ("ver", &[1, 0, 0, 0]), ("chunk_pos", &at), ("count", &[1, 0, 0, 0])];
            infos.extend(record(&info, &[[0; 4], count].concat()));
        }
        let index_at = bytes.len();
        bytes.extend([described, infos].concat());
        let head = bag_header(index_at as u64, chunks.len() as u32);
        bytes[MAGIC.len()..MAGIC.len() + head.len()].copy_from_slice(&head);
        Self { bytes, chunks, index_at }
    }

    /// As rosbag leaves it while it records: the index that every chunk has, and no index of all.
    pub(crate) fn unfinished(&self) -> Vec<u8> {
        let head = bag_header(0, 0);
        let records = &self.bytes[MAGIC.len() + head.len()..self.index_at];
        [MAGIC, &head, records].concat()
    }
}
