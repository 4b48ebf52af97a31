//! Arrays of numbers as numpy keeps them: rows of f64, little-endian, in the order of C.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use anyhow::{Context as _, ensure};

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
/// The header, with what is before it, ends at a whole number of these.
const ALIGNED_BYTES: usize = 64;

/// Writes rows of `N` numbers; a single one a row is an array of one dimension.
pub(super) fn write<const N: usize>(path: &Path, rows: &[[f64; N]]) -> anyhow::Result<()> {
    let shape = if N == 1 { format!("({},)", rows.len()) } else { format!("({}, {N})", rows.len()) };
    let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let bytes = MAGIC.len() + 2 + header.len() + 1;
    header.push_str(&" ".repeat(bytes.next_multiple_of(ALIGNED_BYTES) - bytes));
    header.push('\n');
    let at = || path.display().to_string();
    let mut file = BufWriter::new(File::create(path).with_context(at)?);
    file.write_all(MAGIC).with_context(at)?;
    file.write_all(&u16::try_from(header.len())?.to_le_bytes()).with_context(at)?;
    file.write_all(header.as_bytes()).with_context(at)?;
    for number in rows.as_flattened() {
        file.write_all(&number.to_le_bytes()).with_context(at)?;
    }
    file.flush().with_context(at)
}

/// Reads what [`write()`] wrote.
pub(super) fn read<const N: usize>(path: &Path) -> anyhow::Result<Vec<[f64; N]>> {
    let at = || path.display().to_string();
    let bytes = std::fs::read(path).with_context(at)?;
    let rest = bytes.strip_prefix(MAGIC).with_context(|| format!("{}: no array", at()))?;
    let (length, rest) = rest.split_first_chunk::<2>().with_context(|| format!("{}: cut off", at()))?;
    let length = usize::from(u16::from_le_bytes(*length));
    let (header, numbers) = rest.split_at_checked(length).with_context(|| format!("{}: cut off", at()))?;
    let header = String::from_utf8_lossy(header);
    ensure!(
        header.contains("'descr': '<f8'") && header.contains("'fortran_order': False"),
        "{}: {} are not rows of f64",
        at(),
        header.trim_end()
    );
    let (numbers, odd) = numbers.as_chunks::<8>();
    let numbers: Vec<f64> = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let (rows, rest) = numbers.as_chunks::<N>();
    ensure!(odd.is_empty() && rest.is_empty(), "{}: no whole rows of {N}", at());
    Ok(rows.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_what_is_none_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some.npy");
        let rows = [[1.0, -2.5, 1e300], [f64::INFINITY, 0.1, 3.0]];
        write(&path, &rows).unwrap();
        assert_eq!(read::<3>(&path).unwrap(), rows);
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!((bytes.len() - 48) % ALIGNED_BYTES, 0);
        assert!(read::<4>(&path).unwrap_err().to_string().ends_with("some.npy: no whole rows of 4"));
        write(&path, &[[1.5], [2.0]]).unwrap();
        assert_eq!(read::<1>(&path).unwrap(), [[1.5], [2.0]]);
        for (cut, message) in [(5, "no array"), (9, "cut off"), (40, "cut off"), (139, "no whole rows of 1")]
        {
            std::fs::write(&path, &std::fs::read(&path).unwrap()[..cut]).unwrap();
            let error = read::<1>(&path).unwrap_err().to_string();
            assert!(error.ends_with(message), "{error}");
            write(&path, &[[1.5], [2.0]]).unwrap();
        }
    }
}
