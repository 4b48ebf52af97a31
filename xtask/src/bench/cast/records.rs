//! Numbers as bytes in files.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use anyhow::{Context as _, ensure};

/// Centre, normal, radius; or origin, direction, measured range.
pub(super) type Record = [f32; 7];

/// Bytes of a record.
pub(super) const RECORD_BYTES: u64 = size_of::<Record>() as u64;

/// The records of a file, which must hold some.
pub(super) fn records(path: &Path) -> anyhow::Result<Vec<Record>> {
    let records: Vec<Record> = numbers(path, |bytes: [u8; RECORD_BYTES as usize]| {
        std::array::from_fn(|k| {
            f32::from_le_bytes([bytes[4 * k], bytes[4 * k + 1], bytes[4 * k + 2], bytes[4 * k + 3]])
        })
    })?;
    ensure!(!records.is_empty(), "{}: empty", path.display());
    Ok(records)
}

/// The little-endian records of a file.
pub(super) fn numbers<const N: usize, T>(path: &Path, record: fn([u8; N]) -> T) -> anyhow::Result<Vec<T>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let (records, rest) = bytes.as_chunks::<N>();
    ensure!(rest.is_empty(), "{}: {} bytes are no whole records of {N}", path.display(), bytes.len());
    Ok(records.iter().copied().map(record).collect())
}

/// Writes records of f32.
pub(super) fn write_records<'a>(
    path: &Path,
    records: impl Iterator<Item = &'a Record>,
) -> anyhow::Result<()> {
    write_numbers(path, records.flatten().map(|x| x.to_le_bytes()))
}

/// Writes the bytes of numbers one after the other.
pub(super) fn write_numbers<const N: usize>(
    path: &Path,
    numbers: impl Iterator<Item = [u8; N]>,
) -> anyhow::Result<()> {
    let at = || path.display().to_string();
    let mut file = BufWriter::new(File::create(path).with_context(at)?);
    for bytes in numbers {
        file.write_all(&bytes).with_context(at)?;
    }
    file.flush().with_context(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_what_is_cut_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some");
        let some = [[1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.16], [f32::NAN; 7]];
        write_records(&path, some.iter()).unwrap();
        assert_eq!(format!("{:?}", records(&path).unwrap()), format!("{some:?}"));
        std::fs::write(&path, [0; 30]).unwrap();
        let error = records(&path).unwrap_err().to_string();
        assert!(error.ends_with("some: 30 bytes are no whole records of 28"), "{error}");
        std::fs::write(&path, []).unwrap();
        let error = records(&path).unwrap_err().to_string();
        assert!(error.ends_with("some: empty"), "{error}");
    }
}
