//! Logs byte by byte: what no writer would write.

use dmp_sensor::Scan;

/// A `sensor_msgs/msg/PointCloud2` whose parts need not fit each other.
#[derive(Debug, Clone)]
pub(super) struct Cloud {
    pub(super) stamp_ns: i64,
    pub(super) frame_id: &'static str,
    pub(super) height: u32,
    pub(super) width: u32,
    /// Name, offset and type, 7 for float32.
    pub(super) fields: Vec<(&'static str, u32, u8)>,
    pub(super) is_bigendian: bool,
    pub(super) point_step: u32,
    pub(super) row_step: u32,
    pub(super) data: Vec<u8>,
}

impl Cloud {
    /// The points of a scan, without their times.
    pub(super) fn of(scan: &Scan) -> Self {
        let points = scan.points_in_sensor_m.iter().flatten().flat_map(|c| c.to_le_bytes());
        let width = scan.len() as u32;
        Self {
            stamp_ns: scan.stamp_ns.unwrap(),
            frame_id: "lidar",
            height: 1,
            width,
            fields: vec![("x", 0, 7), ("y", 4, 7), ("z", 8, 7)],
            is_bigendian: false,
            point_step: 12,
            row_step: 12 * width,
            data: points.collect(),
        }
    }

    /// The message in CDR, little-endian.
    fn message(&self) -> Vec<u8> {
        let mut cdr = Cdr(Vec::new());
        cdr.u32(self.stamp_ns.div_euclid(1_000_000_000) as u32);
        cdr.u32(self.stamp_ns.rem_euclid(1_000_000_000) as u32);
        cdr.string(self.frame_id);
        cdr.u32(self.height);
        cdr.u32(self.width);
        cdr.u32(self.fields.len() as u32);
        for &(name, offset, kind) in &self.fields {
            cdr.string(name);
            cdr.u32(offset);
            cdr.0.push(kind);
            cdr.u32(1);
        }
        cdr.0.push(u8::from(self.is_bigendian));
        cdr.u32(self.point_step);
        cdr.u32(self.row_step);
        cdr.u32(self.data.len() as u32);
        cdr.0.extend(&self.data);
        cdr.0.push(1);
        [&[0, 1, 0, 0], cdr.0.as_slice()].concat()
    }
}

struct Cdr(Vec<u8>);

impl Cdr {
    fn u32(&mut self, value: u32) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        self.0.extend(value.to_le_bytes());
    }

    fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }
}

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], (body.len() as u64).to_le_bytes().as_slice(), body].concat()
}

fn string(text: &str) -> Vec<u8> {
    [(text.len() as u32).to_le_bytes().as_slice(), text.as_bytes()].concat()
}

/// An MCAP file with one topic of clouds, `/points`, without chunks and without a summary.
pub(super) fn bag(clouds: &[Cloud]) -> Vec<u8> {
    let messages: Vec<Vec<u8>> = clouds.iter().map(message_record).collect();
    bag_of_records(&messages.concat())
}

pub(super) fn message_record(cloud: &Cloud) -> Vec<u8> {
    let time = cloud.stamp_ns.to_le_bytes();
    record(5, &[&[1, 0, 0, 0, 0, 0], time.as_slice(), &time, &cloud.message()].concat())
}

/// The same with these records after its channel.
pub(super) fn bag_of_records(records: &[u8]) -> Vec<u8> {
    let kind = string("sensor_msgs/msg/PointCloud2");
    let schema = [&[1, 0], kind.as_slice(), &string("ros2msg"), &[0; 4]].concat();
    let channel = [&[1, 0, 1, 0], string("/points").as_slice(), &string("cdr"), &[0; 4]].concat();
    let header = [string("ros2"), string("by hand")].concat();
    [
        MAGIC,
        &record(1, &header),
        &record(3, &schema),
        &record(4, &channel),
        records,
        &record(15, &[0; 4]),
        &record(2, &[0; 20]),
        MAGIC,
    ]
    .concat()
}

/// The records of a `/tf_static` on which so many frames hang on the frame `lidar`.
pub(super) fn static_frames(count: u32) -> Vec<u8> {
    let kind = string("tf2_msgs/msg/TFMessage");
    let schema = [&[2, 0], kind.as_slice(), &string("ros2msg"), &[0; 4]].concat();
    let channel = [&[2, 0, 2, 0], string("/tf_static").as_slice(), &string("cdr"), &[0; 4]].concat();
    let mut cdr = Cdr(Vec::new());
    cdr.u32(count);
    for child in 0..count {
        cdr.u32(1);
        cdr.u32(0);
        cdr.string("lidar");
        cdr.string(&format!("frame {child}"));
        cdr.0.resize(cdr.0.len().next_multiple_of(8), 0);
        [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0_f64].iter().for_each(|number| cdr.0.extend(number.to_le_bytes()));
    }
    let message = [&[2, 0], [0; 20].as_slice(), &[0, 1, 0, 0], &cdr.0].concat();
    [record(3, &schema), record(4, &channel), record(5, &message)].concat()
}

/// A chunk packed with zstd that says it unpacks to `claimed` bytes.
pub(super) fn zstd_chunk(claimed: u64, packed: &[u8]) -> Vec<u8> {
    let (claimed, length) = (claimed.to_le_bytes(), (packed.len() as u64).to_le_bytes());
    let body = [&[0; 16], claimed.as_slice(), &[0; 4], &string("zstd"), &length, packed];
    record(6, &body.concat())
}

/// Four bytes of zstd for every 128 KiB of zeros; `content_size` is what the frame says of it, if anything.
pub(super) fn zstd_zeros(blocks: u32, content_size: Option<u64>) -> Vec<u8> {
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, if content_size.is_some() { 0xc0 } else { 0 }, 0x58];
    frame.extend(content_size.map(u64::to_le_bytes).into_iter().flatten());
    for block in 1..=blocks {
        // Of 128 KiB, each of them the one byte that follows; the lowest bit marks the last block.
        let head = (131_072 << 3) | (1 << 1) | u32::from(block == blocks);
        frame.extend(&head.to_le_bytes()[..3]);
        frame.push(0);
    }
    frame
}

/// The records of an MCAP file outside chunks: where they begin, their opcode and the length of their body.
pub(super) fn records_of(mcap: &[u8]) -> Vec<(usize, u8, u64)> {
    let mut records = Vec::new();
    let mut at = MAGIC.len();
    while at + 9 <= mcap.len() - MAGIC.len() {
        let length = u64::from_le_bytes(mcap[at + 1..at + 9].try_into().unwrap());
        records.push((at, mcap[at], length));
        at += 9 + length as usize;
    }
    records
}
