//! Lines of numbers, as people's files have them.

use super::reads::refuse_device;
use crate::{LogError, ParseError, PlaceInFile};
use dmp_lengths::thousands;
use std::fs::File;
use std::io::{self, BufRead, Read as _};
use std::path::Path;

/// Longest line of a text, of a header, and of a vertex in text.
pub(crate) const MAX_LINE_BYTES: u64 = 64 * 1024;
/// Read at a time.
const PIECE_BYTES: u64 = 1 << 20;
/// So far into a text there is data: more of blank lines and comments is no text of ours.
const MAX_BLANK_BYTES: usize = 1 << 20;
/// The first bytes of a file packed by gzip.
const GZIP_MAGIC: &[u8] = b"\x1f\x8b";
/// The first bytes of a text in UTF-16, little and big endian.
const UTF16_MARKS: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];

/// The bytes of a text that is not too large to be `what`, as UTF-8 where a mark says that it is UTF-16. What has no lines, no data or is not text shows in the first piece:
/// no more is read of it, however large the file claims to be.
pub(crate) fn read_text(path: &Path, what: &str, most_bytes: u64) -> Result<Vec<u8>, LogError> {
    let (mut line, mut begins, mut has_data) = (1, 0, false);
    let mut check = |bytes: &[u8], from: usize| {
        if bytes.starts_with(GZIP_MAGIC) {
            let problem = "packed by gzip, which is not read here: `gunzip` unpacks it";
            return Err(ParseError::new(PlaceInFile::WholeFile, problem));
        }
        let ends = bytes[from..].iter().enumerate().filter(|(_, byte)| **byte == b'\n');
        for end in ends.map(|(k, _)| from + k).chain([bytes.len()]) {
            if (end - begins) as u64 > MAX_LINE_BYTES {
                let problem = format!("longer than {MAX_LINE_BYTES} bytes: no line of a {what}");
                return Err(ParseError::new(PlaceInFile::Line(line), problem));
            }
            if end < bytes.len() {
                has_data |= !data_of(&bytes[begins..end], PlaceInFile::Line(line))?.trim_ascii().is_empty();
                (line, begins) = (line + 1, end + 1);
            }
        }
        if !has_data && bytes.len() > MAX_BLANK_BYTES {
            let problem =
                format!("only blank lines and comments in {} bytes: no {what}", thousands(bytes.len()));
            return Err(ParseError::new(PlaceInFile::WholeFile, problem));
        }
        Ok(())
    };
    let marked = |bytes: &[u8]| UTF16_MARKS.iter().any(|mark| bytes.starts_with(mark));
    let bytes = read_checked(path, what, most_bytes, &mut |bytes, from| {
        if marked(bytes) { Ok(()) } else { check(bytes, from) }
    })?;
    if !marked(&bytes) {
        return Ok(bytes);
    }
    let text = of_utf16(&bytes).and_then(|text| check(&text, 0).map(|()| text));
    text.map_err(|e| e.in_file(path))
}

/// Text in UTF-16 with a mark of the order of its bytes, as UTF-8.
fn of_utf16(bytes: &[u8]) -> Result<Vec<u8>, ParseError> {
    let big_endian = bytes.starts_with(UTF16_MARKS[1]);
    let (units, rest) = bytes.get(2..).unwrap_or_default().as_chunks::<2>();
    let unit =
        |unit: &[u8; 2]| if big_endian { u16::from_be_bytes(*unit) } else { u16::from_le_bytes(*unit) };
    let text: Result<String, _> = char::decode_utf16(units.iter().map(unit)).collect();
    match text {
        Ok(text) if rest.is_empty() => Ok(text.into_bytes()),
        _ => Err(ParseError::new(PlaceInFile::WholeFile, "begins as UTF-16 and is none: save it as UTF-8")),
    }
}

/// The bytes of a file that is not too large to be `what`.
pub(crate) fn read_bytes(path: &Path, what: &str, most_bytes: u64) -> Result<Vec<u8>, LogError> {
    read_checked(path, what, most_bytes, &mut |_, _| Ok(()))
}

/// Looks at all that was read of a file, of which the last piece begins here.
type CheckPiece<'a> = dyn FnMut(&[u8], usize) -> Result<(), ParseError> + 'a;

/// Reads a file piece by piece, each of which is checked.
fn read_checked(
    path: &Path,
    what: &str,
    most_bytes: u64,
    check: &mut CheckPiece<'_>,
) -> Result<Vec<u8>, LogError> {
    let too_large = |found: String| {
        let problem = format!("{found} are no {what}, at most {} are read", thousands(most_bytes));
        LogError::malformed(path, PlaceInFile::WholeFile, problem)
    };
    refuse_device(path)?;
    let mut file = File::open(path).map_err(|e| LogError::io(path, "open", e))?;
    let length = file.metadata().map_err(|e| LogError::io(path, "open", e))?.len();
    if length > most_bytes {
        return Err(too_large(format!("{} bytes", thousands(length))));
    }
    let mut bytes = Vec::new();
    loop {
        let from = bytes.len();
        let piece = file.by_ref().take(PIECE_BYTES).read_to_end(&mut bytes);
        if piece.map_err(|e| LogError::io(path, "read", e))? == 0 {
            return Ok(bytes);
        }
        // Devices and pipes do not say how long they are.
        if bytes.len() as u64 > most_bytes {
            return Err(too_large(format!("more than {} bytes", thousands(most_bytes))));
        }
        check(&bytes, from).map_err(|e| e.in_file(path))?;
    }
}

/// The lines with data: their places (from line 1) and columns. Blank lines and what follows a `#` are
/// left out; columns are parted by blanks, tabs, commas or semicolons; a byte order mark and carriage returns are
/// passed over.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = Result<(PlaceInFile, Vec<&str>), ParseError>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    bytes.split(|&c| c == b'\n').zip(1..).filter_map(|(line, number)| {
        let place = PlaceInFile::Line(number);
        match data_of(line, place) {
            Err(error) => Some(Err(error)),
            Ok(text) => {
                let columns: Vec<&str> = text
                    .split(|c: char| c.is_ascii_whitespace() || c == ',' || c == ';')
                    .filter(|column| !column.is_empty())
                    .collect();
                (!columns.is_empty()).then_some(Ok((place, columns)))
            }
        }
    })
}

/// What stands in a line in front of a comment.
pub(crate) fn data_of(line: &[u8], place: PlaceInFile) -> Result<&str, ParseError> {
    let data = line.split(|&c| c == b'#').next().unwrap_or_default();
    match std::str::from_utf8(data) {
        Ok(text) if !data.contains(&0) => Ok(text),
        _ => {
            let start = data.get(..16).unwrap_or(data);
            let is_zero = |from: usize| data.iter().skip(from).step_by(2).all(|&byte| byte == 0);
            if data.len() > 3 && (is_zero(0) || is_zero(1)) {
                let problem =
                    format!("UTF-16 without a mark, which is not read: save it as UTF-8 ({start:02x?})");
                return Err(ParseError::new(place, problem));
            }
            Err(ParseError::new(place, format!("not text: {start:02x?}")))
        }
    }
}

/// Whether a line has the names of columns where others have numbers: neither of its first two columns is one.
pub(crate) fn is_header(columns: &[&str]) -> bool {
    columns.iter().take(2).all(|column| column.parse::<f64>().is_err())
}

/// Whether the last line has data but no line end, as in a file that is cut.
pub(crate) fn is_cut(bytes: &[u8]) -> bool {
    let last = bytes.rsplit(|&c| c == b'\n').next().unwrap_or_default();
    last.iter().any(|c| !c.is_ascii_whitespace())
}

/// One line, without its end, of at most [`MAX_LINE_BYTES`]; `None` at the end of the file.
pub(crate) fn read_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<Option<u64>> {
    line.clear();
    let count = input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', line)? as u64;
    if count == 0 {
        return Ok(None);
    }
    if count == MAX_LINE_BYTES && line.last() != Some(&b'\n') {
        return Err(io::Error::new(
            io::ErrorKind::InvalidData,
            format!("a line longer than {MAX_LINE_BYTES} bytes"),
        ));
    }
    while line.last().is_some_and(u8::is_ascii_whitespace) {
        line.pop();
    }
    Ok(Some(count))
}
