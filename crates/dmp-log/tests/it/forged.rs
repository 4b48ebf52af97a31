use crate::common::{assert_says, open, scans, write_mcap};
use dmp_log::{LogOptions, McapCompression, open_log};
use std::fs;

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![opcode];
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
    bytes
}

fn chunk(uncompressed: u64, compression: &str, claimed: u64, data: &[u8]) -> Vec<u8> {
    let mut body = vec![0; 16];
    body.extend(uncompressed.to_le_bytes());
    body.extend(0_u32.to_le_bytes());
    body.extend((compression.len() as u32).to_le_bytes());
    body.extend(compression.as_bytes());
    body.extend(claimed.to_le_bytes());
    body.extend(data);
    record(0x06, &body)
}

/// Sizes that no file keeps are refused chunk by chunk; the good chunks around stay.
#[test]
fn forged_sizes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    write_mcap(&path, &scans(8, 300, false), McapCompression::Lz4);
    let good = fs::read(&path).unwrap();
    let frames = open(&path).frames().len();
    // Behind the magic and the header record.
    let header = 8 + 9 + u64::from_le_bytes(good[9..17].try_into().unwrap()) as usize;
    let cases = [
        (chunk(u64::MAX, "zstd", 4, &[1; 4]), "claims 18,446,744,073,709,551,615 bytes unpacked"),
        (chunk(300 << 20, "zstd", 4, &[1; 4]), "more than the 268,435,456 allowed"),
        (chunk(100, "zstd", u64::MAX, &[1; 4]), "claims 18,446,744,073,709,551,615 bytes of 4"),
        (chunk(100, "brotli", 4, &[1; 4]), "unknown compression `brotli`"),
        (chunk(100, &"x".repeat(40), 4, &[1; 4]), "claims 40 bytes"),
        (chunk(100, "", 4, &[1; 4]), "not compressed"),
        (chunk(100, "zstd", 4, &[1; 4]), "damaged"),
        (chunk(100, "lz4", 4, &[1; 4]), "damaged"),
        (record(0x06, &[0; 39]), "39 bytes, fewer than its header"),
        (record(0x05, &[0; 21]), "a message of 21 bytes"),
        (
            chunk(30, "", 30, &[&[5, 255, 255, 255, 255, 255, 255, 255, 255][..], &[0; 21]].concat()),
            "last 30 bytes",
        ),
        (record(0x03, &[1, 0, 255, 255, 255, 255]), "byte"),
        (record(0x04, &[255; 12]), "byte"),
    ];
    for (forged, why) in cases {
        let mut bytes = good[..header].to_vec();
        bytes.extend(&forged);
        // The summary's offsets do not hold any more: the file has none.
        bytes.extend(&good[header..good.len() - 8]);
        fs::write(&path, &bytes).unwrap();
        let log = open_log(&path, &LogOptions::default()).unwrap();
        assert_eq!(log.frames().len(), frames, "{why}");
        let damage =
            log.summary().damage.iter().find(|damage| damage.place == format!("byte {header}")).unwrap();
        assert_says(&format!("{}: {}", damage.place, damage.what), &[why]);
    }
}

/// A kilobyte of zstd that claims, and has, far more than is allowed is not unpacked beyond the limit.
#[test]
fn a_bomb_is_not_unpacked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let options = mcap::WriteOptions::new().chunk_size(None);
    let zeros = vec![0; 300 << 20];
    crate::common::write_with(&path, options, &[crate::common::POINTS], &[(0, zeros)]);
    assert!(fs::metadata(&path).unwrap().len() < 100_000);
    let error = open_log(&path, &LogOptions::default()).unwrap_err().to_string();
    assert_says(&error, &["log.mcap", "no scan that can be read", "268,435,456 allowed"]);
}

/// A hundred thousand messages that are lost are a short list.
#[test]
fn much_damage_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    write_mcap(&path, &scans(8, 300, false), McapCompression::Lz4);
    let good = fs::read(&path).unwrap();
    let header = 8 + 9 + u64::from_le_bytes(good[9..17].try_into().unwrap()) as usize;
    let short_messages = record(0x05, &[0; 21]).repeat(100_000);
    fs::write(&path, [&good[..header], &short_messages, &good[header..good.len() - 8]].concat()).unwrap();
    let log = open_log(&path, &LogOptions::default()).unwrap();
    assert_eq!(log.frames().len(), 8);
    let damage = &log.summary().damage;
    assert!(damage.len() < 120);
    let counted = damage.iter().find(|lost| lost.what == "a message of …").unwrap();
    assert_eq!(counted.place, "99,900 more places");
}
