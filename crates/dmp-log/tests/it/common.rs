use dmp_log::{LogOptions, McapCompression, McapScanWriter, McapWriterOptions, ScanLog, open_log};
use dmp_sensor::Scan;
use std::ops::Range;
use std::path::Path;

pub(crate) const STAMP_NS: i64 = 1_690_309_709_285_305_500;

/// A scan with points that compress badly and, if asked, times over 0.1 s.
pub(crate) fn scan(number: usize, points: usize, with_times: bool) -> Scan {
    let mut random = Random(number as u64 + 1);
    let coordinate = |random: &mut Random| (random.next() % 200_000) as f32 / 1000.0 - 100.0;
    let points_in_sensor_m =
        (0..points).map(|_| std::array::from_fn(|_| coordinate(&mut random))).collect::<Vec<[f32; 3]>>();
    let times = if with_times { points as i64 } else { 0 };
    let time_offsets_ns = (0..times).map(|k| k * 99_000_000 / points.max(2) as i64).collect();
    Scan { stamp_ns: Some(STAMP_NS + number as i64 * 100_000_000), points_in_sensor_m, time_offsets_ns }
}

pub(crate) fn scans(count: usize, points: usize, with_times: bool) -> Vec<Scan> {
    (0..count).map(|number| scan(number, points, with_times)).collect()
}

pub(crate) fn write_mcap(path: &Path, scans: &[Scan], compression: McapCompression) {
    let options = McapWriterOptions { compression, chunk_bytes: 10_000, ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(path, &options).unwrap();
    for scan in scans {
        writer.write_scan(scan).unwrap();
    }
    writer.finish().unwrap();
}

pub(crate) fn open(path: &Path) -> Box<dyn ScanLog> {
    open_log(path, &LogOptions::default()).unwrap()
}

pub(crate) fn open_error(path: &Path, options: &LogOptions) -> String {
    open_log(path, options).unwrap_err().to_string()
}

pub(crate) fn read_all(log: &dyn ScanLog) -> Vec<Scan> {
    let mut reader = log.reader().unwrap();
    let read = |frame| {
        let mut scan = Scan::default();
        reader.read(frame, &mut scan).unwrap();
        assert_eq!(scan.len() as u64, log.frames()[frame].returns);
        assert_eq!(scan.stamp_ns, log.frames()[frame].stamp_ns);
        scan
    };
    (0..log.frames().len()).map(read).collect()
}

/// What `work` gives, without a pool and in pools of several sizes: always the same.
#[track_caller]
pub(crate) fn in_threads<R: Send + PartialEq>(work: impl Fn() -> R + Sync) -> R {
    let alone = work();
    for threads in [2, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(&work) == alone, "in {threads} threads");
    }
    alone
}

/// The records of an MCAP file up to the end of its data: their types, and where they are.
pub(crate) fn records(bytes: &[u8]) -> Vec<(u8, Range<usize>)> {
    let (mut at, mut found) = (8, Vec::new());
    while bytes[at] != mcap::records::op::DATA_END {
        let end = at + 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        found.push((bytes[at], at..end));
        at = end;
    }
    found
}

/// Where its chunks are.
pub(crate) fn chunks(bytes: &[u8]) -> Vec<Range<usize>> {
    let chunks = records(bytes).into_iter().filter(|(op, _)| *op == mcap::records::op::CHUNK);
    chunks.map(|(_, place)| place).collect()
}

/// Whether `text` holds every part, or a message that says which it lacks.
pub(crate) fn assert_says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
    assert!(!text.contains('\n'), "more than one line: {text}");
}

/// Each of some inputs is refused in a line with `start` and all the words of its text, ` | ` between them.
#[track_caller]
pub(crate) fn refusals(error: impl Fn(&str) -> String, start: &str, cases: &[(&str, &str)]) {
    for (input, words) in cases {
        let error = error(input);
        assert_says(&error, &[start]);
        assert_says(&error, &words.split(" | ").collect::<Vec<_>>());
    }
}

/// `SplitMix64`: the same numbers everywhere.
#[derive(Debug, Clone)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

/// A `PointCloud2` with every part open to change.
#[derive(Debug, Clone)]
pub(crate) struct Message {
    pub(crate) big_endian_cdr: bool,
    pub(crate) big_endian_data: bool,
    pub(crate) stamp_ns: i64,
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) fields: Vec<(&'static str, u32, u8)>,
    pub(crate) point_step: u32,
    pub(crate) row_step: u32,
    pub(crate) data: Vec<u8>,
}

pub(crate) const F32: u8 = 7;
pub(crate) const F64: u8 = 8;
pub(crate) const U32: u8 = 6;

impl Message {
    /// One row of points, x, y, z as float32.
    pub(crate) fn of(points: &[[f32; 3]]) -> Self {
        let data: Vec<u8> = points.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        Self {
            big_endian_cdr: false,
            big_endian_data: false,
            stamp_ns: STAMP_NS,
            height: 1,
            width: points.len() as u32,
            fields: vec![("x", 0, F32), ("y", 4, F32), ("z", 8, F32)],
            point_step: 12,
            row_step: data.len() as u32,
            data,
        }
    }

    pub(crate) fn encode(&self) -> Vec<u8> {
        let mut bytes = vec![0, u8::from(!self.big_endian_cdr), 0, 0];
        let big = self.big_endian_cdr;
        let word = |bytes: &mut Vec<u8>, value: u32| {
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            bytes.extend(if big { value.to_be_bytes() } else { value.to_le_bytes() });
        };
        word(&mut bytes, self.stamp_ns.div_euclid(1_000_000_000) as i32 as u32);
        word(&mut bytes, self.stamp_ns.rem_euclid(1_000_000_000) as u32);
        let text = |bytes: &mut Vec<u8>, text: &str| {
            word(bytes, text.len() as u32 + 1);
            bytes.extend(text.as_bytes());
            bytes.push(0);
        };
        text(&mut bytes, "lidar");
        word(&mut bytes, self.height);
        word(&mut bytes, self.width);
        word(&mut bytes, self.fields.len() as u32);
        for &(name, offset, datatype) in &self.fields {
            text(&mut bytes, name);
            word(&mut bytes, offset);
            bytes.push(datatype);
            word(&mut bytes, 1);
        }
        bytes.push(u8::from(self.big_endian_data));
        word(&mut bytes, self.point_step);
        word(&mut bytes, self.row_step);
        word(&mut bytes, self.data.len() as u32);
        bytes.extend(&self.data);
        bytes.push(1);
        bytes
    }
}

/// A channel of a test file: topic, type, encoding.
pub(crate) type Channel<'a> = (&'a str, &'a str, &'a str);
pub(crate) const POINTS: Channel<'static> = ("/points", "sensor_msgs/msg/PointCloud2", "cdr");

/// Writes messages of any kind, each to one of the channels.
pub(crate) fn write_messages(path: &Path, channels: &[Channel<'_>], messages: &[(usize, Vec<u8>)]) {
    write_with(path, mcap::WriteOptions::new().chunk_size(Some(2000)), channels, messages);
}

pub(crate) fn write_with(
    path: &Path,
    options: mcap::WriteOptions,
    channels: &[Channel<'_>],
    messages: &[(usize, Vec<u8>)],
) {
    let timed = messages.iter().enumerate();
    let timed: Vec<_> = timed.map(|(k, (channel, data))| (*channel, k as u64, data.as_slice())).collect();
    write_timed(path, options, channels, &timed);
}

/// The same with the times at which the messages were recorded.
pub(crate) fn write_timed(
    path: &Path,
    options: mcap::WriteOptions,
    channels: &[Channel<'_>],
    messages: &[(usize, u64, &[u8])],
) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut writer = options.create(file).unwrap();
    let ids: Vec<u16> = channels
        .iter()
        .map(|(topic, kind, encoding)| {
            let schema = writer.add_schema(kind, "ros2msg", b"").unwrap();
            writer.add_channel(schema, topic, encoding, &std::collections::BTreeMap::new()).unwrap()
        })
        .collect();
    for (sequence, &(channel, log_time, data)) in messages.iter().enumerate() {
        let header = mcap::records::MessageHeader {
            channel_id: ids[channel],
            sequence: sequence as u32,
            log_time,
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
}
