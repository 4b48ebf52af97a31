//! The header of a PCD file: which fields a point has, how many points there are, and how they are kept.

use crate::points::{Field, NumberType};
use crate::{ParseError, PlaceInFile};
use dmp_lengths::thousands;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PcdField {
    /// Its name; `_` is padding.
    pub(crate) name: String,
    /// Its first number in a point of binary data.
    pub(crate) place: Field,
    /// First column in a line of text.
    pub(crate) column: usize,
    /// How many numbers of the kind.
    pub(crate) count: usize,
}

impl PcdField {
    pub(crate) fn bytes(&self) -> usize {
        self.place.kind.bytes() as usize * self.count
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PcdData {
    /// A line each.
    Ascii,
    /// One behind the other, little-endian.
    Binary,
    /// Field by field, all of them compressed together: see [`PcdHeader::columns`].
    BinaryCompressed,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PcdHeader {
    /// Padding included, in order.
    pub(crate) fields: Vec<PcdField>,
    /// Bytes of a point of binary data.
    pub(crate) point_bytes: usize,
    pub(crate) points: u64,
    pub(crate) data: PcdData,
    /// Lines in front of the data.
    pub(crate) lines: u64,
    /// Bytes in front of the data.
    pub(crate) bytes: u64,
}

impl PcdHeader {
    pub(crate) fn field(&self, name: &str) -> Option<&PcdField> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// x, y and z, each one float32 or float64.
    pub(crate) fn xyz(&self) -> Result<[&PcdField; 3], ParseError> {
        let wrong = |problem: String| ParseError::new(PlaceInFile::Line(self.lines), problem);
        let axis = |name: &str| {
            let field =
                self.field(name).ok_or_else(|| wrong(format!("the points lack the field `{name}`")))?;
            match (field.place.kind, field.count) {
                (NumberType::F32 | NumberType::F64, 1) => Ok(field),
                (kind, 1) => Err(wrong(format!("field `{name}` is {}, not float32 or float64", kind.name()))),
                (_, count) => Err(wrong(format!("field `{name}` has {count} numbers, not one"))),
            }
        };
        Ok([axis("x")?, axis("y")?, axis("z")?])
    }

    /// Compares the data's size with the `length` of the file, bytes.
    pub(crate) fn check_length(&self, length: u64) -> Result<(), ParseError> {
        let left = length.saturating_sub(self.bytes);
        let needed = match self.data {
            // A digit and a blank or a line's end for each number, but for the last.
            PcdData::Ascii => {
                let numbers: usize = self.fields.iter().map(|field| field.count).sum();
                self.points.checked_mul(2 * numbers as u64).map(|bytes| bytes.saturating_sub(1))
            }
            PcdData::Binary => self.points.checked_mul(self.point_bytes as u64),
            PcdData::BinaryCompressed => Some(8),
        };
        if needed.is_some_and(|needed| needed <= left) {
            return Ok(());
        }
        let problem = format!(
            "{} points of {} do not fit in the {} bytes behind the header",
            thousands(self.points),
            match self.data {
                PcdData::Ascii => "text".to_owned(),
                _ => format!("{} bytes", self.point_bytes),
            },
            thousands(left)
        );
        Err(ParseError::new(PlaceInFile::Byte(self.bytes), problem))
    }

    /// Where the numbers of each field begin in the unpacked bytes of compressed data, all points of one
    /// field after all of the one before. `claimed` is the unpacked size as the file has it: writers leave
    /// padding out, some keep it.
    pub(crate) fn columns(&self, claimed: u64) -> Result<Vec<(&PcdField, u64)>, ParseError> {
        let size = |padded: bool| {
            let fields = self.fields.iter().filter(|field| padded || field.name != "_");
            let point: u64 = fields.map(|field| field.bytes() as u64).sum();
            self.points.checked_mul(point)
        };
        let padded = match (size(false), size(true)) {
            (Some(bytes), _) if bytes == claimed => false,
            (_, Some(bytes)) if bytes == claimed => true,
            _ => {
                let problem = format!(
                    "{} bytes unpacked, for {} points of {} bytes",
                    thousands(claimed),
                    thousands(self.points),
                    self.point_bytes
                );
                return Err(ParseError::new(PlaceInFile::Byte(self.bytes + 4), problem));
            }
        };
        let mut at = 0;
        let mut columns = Vec::new();
        for field in self.fields.iter().filter(|field| padded || field.name != "_") {
            columns.push((field, at));
            at += self.points * field.bytes() as u64;
        }
        Ok(columns)
    }
}

/// The bytes of compressed points, packed and unpacked, that stand before them.
pub(crate) fn packed_sizes([a, b, c, d, e, f, g, h]: [u8; 8]) -> [u64; 2] {
    [[a, b, c, d], [e, f, g, h]].map(|bytes| u32::from_le_bytes(bytes).into())
}

/// Whether a file that begins like this is a PCD file; `#` alone may begin any other.
pub(crate) fn starts_like_pcd(start: &[u8]) -> bool {
    let text = start.strip_prefix(b"#").unwrap_or(start).trim_ascii_start();
    text.starts_with(b".PCD") || text.starts_with(b"VERSION") || text.starts_with(b"FIELDS")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::pcd::header_lines::read_header;

    fn header(text: &str) -> Result<PcdHeader, String> {
        read_header(&mut text.as_bytes()).map_err(|error| error.to_string())
    }

    const FULL: &str = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z _ rgb normal t\n\
        SIZE 8 4 4 1 4 4 8\nTYPE F F F U U F I\nCOUNT 1 1 1 3 1 3 1\nWIDTH 4\nHEIGHT 2\n\
        VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 8\nDATA binary\n";

    #[test]
    fn fields_have_their_places() {
        let header = header(&format!("{FULL}xyz")).unwrap();
        let places: Vec<_> = header
            .fields
            .iter()
            .map(|f| (f.name.as_str(), f.place.kind, f.place.offset, f.column, f.count))
            .collect();
        assert_eq!(
            places,
            [
                ("x", NumberType::F64, 0, 0, 1),
                ("y", NumberType::F32, 8, 1, 1),
                ("z", NumberType::F32, 12, 2, 1),
                ("_", NumberType::U8, 16, 3, 3),
                ("rgb", NumberType::U32, 19, 6, 1),
                ("normal", NumberType::F32, 23, 7, 3),
                ("t", NumberType::I64, 35, 10, 1),
            ]
        );
        assert_eq!((header.point_bytes, header.points, header.data), (43, 8, PcdData::Binary));
        assert_eq!((header.lines, header.bytes), (11, FULL.len() as u64));
        assert_eq!(header.xyz().unwrap().map(|field| field.place.offset), [0, 8, 12]);
        assert!(header.check_length(header.bytes + 344).is_ok());
        assert!(header.check_length(header.bytes + 343).is_err());
        // Compressed, the padding is left out, or kept.
        let at = |claimed| -> Vec<u64> { header.columns(claimed).unwrap().iter().map(|c| c.1).collect() };
        assert_eq!(at(8 * 40), [0, 64, 96, 128, 160, 256]);
        assert_eq!(at(8 * 43), [0, 64, 96, 128, 152, 184, 280]);
        assert!(header.columns(8 * 41).is_err());
    }

    #[test]
    fn old_and_short_headers_are_read() {
        let old = "COLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 5\nDATA ascii\n";
        assert_eq!(header(old).unwrap().points, 5);
        let text = "FIELDS x y z\r\nSIZE 4 4 4\r\nTYPE F F F\r\nWIDTH 7\r\nDATA ascii\r\n";
        assert_eq!(header(text).unwrap().points, 7);
    }

    #[test]
    fn lies_are_named() {
        let cases = [
            ("POINTS 8", "POINTS 9", "9 POINTS, but WIDTH times HEIGHT is 8"),
            ("HEIGHT 2", "HEIGHT 18446744073709551615", "is too large"),
            ("POINTS 8", "POINTS -8", "line 10: POINTS of `-8` is no count"),
            ("COUNT 1 1 1 3 1 3 1", "COUNT 1 1 1 3", "7 FIELDS, but 4 entries in COUNT"),
            ("COUNT 1 1 1 3", "COUNT 1 1 1 x", "`_` has a COUNT of `x`"),
            ("COUNT 1 1 1 3", "COUNT 1 1 1 18446744073709551615", "a COUNT of `18446744073709551615`"),
            ("COUNT 1 1 1 3 1 3", "COUNT 1 1 1 3 1 1000000", "a point of 4000023 bytes"),
            ("SIZE 8 4", "SIZE 3 4", "`x` has the unknown type F of 3 bytes"),
            ("DATA binary", "DATA zip", "line 11: data kept as `zip`"),
            ("VIEWPOINT", "VIEW", "not a line of a PCD header"),
            ("DATA binary\n", "", "line 11: the file ends in the header"),
            ("WIDTH 4\n", "", "HEIGHT 2 without WIDTH"),
        ];
        for (from, to, problem) in cases {
            assert!(FULL.contains(from), "{from}");
            let error = header(&FULL.replace(from, to)).unwrap_err();
            assert!(error.contains(problem), "{error}");
        }
        let lacks = |from, to| header(&FULL.replace(from, to)).unwrap().xyz().unwrap_err().to_string();
        assert!(lacks("FIELDS x", "FIELDS X").contains("lack the field `x`"));
        assert!(lacks("TYPE F F F", "TYPE F F I").contains("field `z` is int32"));
        assert!(lacks("COUNT 1 1 1", "COUNT 1 1 2").contains("field `z` has 2 numbers"));
    }
}
