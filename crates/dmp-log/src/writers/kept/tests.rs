use super::*;
use std::fs;
use std::path::Path;

type Returns = Vec<[u8; RETURN_BYTES]>;

/// Two runs, and scans of different lengths: one without returns, one of more than a message holds.
fn scans() -> Vec<[Returns; 2]> {
    let of = |scan: u32, run: u32, count: u32| -> Returns {
        (0..count)
            .map(|k| ((scan * 7919 + run * 104_729).wrapping_add(k.wrapping_mul(k))).to_le_bytes())
            .collect()
    };
    [3, 0, 70_000, 1]
        .into_iter()
        .zip(0..)
        .map(|(count, scan)| [0, 1].map(|run| of(scan, run, count)))
        .collect()
}

fn write(path: &Path) {
    let mut writer = KeptWriter::create(path, b"{\"a\": 1}", &["one", "x/two"]).unwrap();
    for (scan, runs) in (0..).zip(&scans()) {
        let poses = [[scan as f64; 7], [f64::NAN; 7]];
        writer.scan([scan, 10 * scan, !scan], scan as i64 * 100, (&poses, runs)).unwrap();
    }
    writer.finish().unwrap();
}

/// The result, and the parts with the numbers of their runs.
type Everything = (Vec<u8>, Vec<(usize, KeptPart)>);

fn read(path: &Path) -> Result<Everything, crate::LogError> {
    let (mut reader, result) = KeptReader::open(path)?;
    let (mut parts, mut part) = (Vec::new(), KeptPart::default());
    while let Some(run) = reader.next_part(&mut part)? {
        parts.push((run, part.clone()));
    }
    assert_eq!(reader.runs(), ["one", "x/two"]);
    Ok((result, parts))
}

#[test]
fn what_was_written_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let [path, again] = ["a.dmp", "b.dmp"].map(|name| folder.path().join(name));
    write(&path);
    write(&again);
    assert_eq!(fs::read(&path).unwrap(), fs::read(&again).unwrap());
    assert!(is_kept(&path).unwrap());
    let (result, parts) = read(&path).unwrap();
    assert_eq!(result, b"{\"a\": 1}");
    let mut back: Vec<[Returns; 2]> = vec![Default::default(); 4];
    for (run, part) in &parts {
        let returns = &mut back[part.ordinal as usize][*run];
        let expected = (10 * part.ordinal, !part.ordinal, returns.len() as u64);
        assert_eq!((part.scan, part.mark, part.first), expected);
        let is_posed = part.pose == [part.ordinal as f64; 7];
        assert!(if *run == 0 { is_posed } else { part.pose.iter().all(|c| c.is_nan()) });
        returns.extend(&part.returns);
    }
    assert_eq!(back, scans());
    assert_eq!(parts.len(), 2 * 5);
}

#[test]
fn bytes_that_were_not_written_so_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.dmp");
    write(&path);
    let whole = fs::read(&path).unwrap();
    let expected = read(&path).unwrap();
    for at in (0..whole.len()).step_by(whole.len() / 499).chain(whole.len() - 60..whole.len()) {
        fs::write(&path, &whole[..at]).unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.starts_with(path.to_str().unwrap()) && !error.contains('\n'), "{error}");
        let mut flipped = whole.clone();
        flipped[at] ^= 0x40;
        fs::write(&path, &flipped).unwrap();
        // Indexes behind the data are not read: what is read is right, or refused.
        if let Ok(found) = read(&path) {
            // NaN is equal to none, but its name to itself.
            assert!(format!("{found:?}") == format!("{expected:?}"), "byte {at} of {}", whole.len());
        }
    }
}

#[test]
fn other_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let log = crate::McapScanWriter::create(&path, &crate::McapWriterOptions::default()).unwrap();
    log.finish().unwrap();
    assert!(is_kept(&path).unwrap());
    let error = KeptReader::open(&path).unwrap_err().to_string();
    assert!(error.contains("no result of `dmp score --keep`"), "{error}");
}
