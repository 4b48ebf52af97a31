//! The layouts of points without a header.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::points::{Field, Layout, NumberType};

/// How the points of a file without a header are laid out: names and types in their order, as
/// `x:f4,y:f4,z:f4,intensity:f4,ring:u2,t:f4`. Types are those of `NumPy`: `f4`, `f8`, `i1` to `i8`, `u1` to `u8`, little-endian. x, y and
/// z are floats, metres.
///
/// ```
/// use dmp_log::BinLayout;
///
/// let layout: BinLayout = "x:f4,y:f4,z:f4,intensity:f4,ring:u2".parse()?;
/// assert_eq!(layout.point_bytes(), 18);
/// assert!("x:f4,y:f4".parse::<BinLayout>().is_err());
/// # Ok::<(), dmp_log::BinLayoutError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct BinLayout {
    text: String,
    layout: Layout,
}

/// What is wrong with the text of a layout.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}; as x:f4,y:f4,z:f4,intensity:f4")]
pub struct BinLayoutError(String);

impl BinLayout {
    /// Bytes of a point.
    pub fn point_bytes(&self) -> u32 {
        self.layout.point_bytes()
    }

    pub(crate) fn layout(&self) -> &Layout {
        &self.layout
    }
}

impl FromStr for BinLayout {
    type Err = BinLayoutError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (mut named, mut offset) = (Vec::new(), 0);
        for part in text.split(',') {
            let (name, kind) = part
                .trim()
                .split_once(':')
                .ok_or_else(|| BinLayoutError(format!("`{part}` is no name and type")))?;
            let kind = kind_of(kind).ok_or_else(|| BinLayoutError(format!("`{kind}` is no type")))?;
            named.push((name.to_owned(), Field { offset, kind }));
            offset += kind.bytes() as usize;
        }
        let layout = Layout::new(named, false, offset as u32).map_err(BinLayoutError)?;
        Ok(Self { text: text.to_owned(), layout })
    }
}

fn kind_of(kind: &str) -> Option<NumberType> {
    Some(match kind {
        "f4" => NumberType::F32,
        "f8" => NumberType::F64,
        "i1" => NumberType::I8,
        "i2" => NumberType::I16,
        "i4" => NumberType::I32,
        "i8" => NumberType::I64,
        "u1" => NumberType::U8,
        "u2" => NumberType::U16,
        "u4" => NumberType::U32,
        "u8" => NumberType::U64,
        _ => return None,
    })
}

impl fmt::Display for BinLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl From<BinLayout> for String {
    fn from(layout: BinLayout) -> Self {
        layout.text
    }
}

impl TryFrom<String> for BinLayout {
    type Error = BinLayoutError;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

/// The layouts that are known, and whose they are; of those with points of one length the first whose values fit is taken.
pub(super) const KNOWN: [(&str, &str); 14] = [
    ("KITTI", "x:f4,y:f4,z:f4,intensity:f4"),
    ("places alone", "x:f4,y:f4,z:f4"),
    ("nuScenes", "x:f4,y:f4,z:f4,intensity:f4,ring:f4"),
    ("KITTI with times", "x:f4,y:f4,z:f4,intensity:f4,t:f4"),
    ("Boreas", "x:f4,y:f4,z:f4,intensity:f4,ring:f4,t:f4"),
    ("HeLiPR's Ouster", "x:f4,y:f4,z:f4,intensity:f4,t:u4,reflectivity:u2,ring:u2,ambient:u2"),
    ("HeLiPR's Velodyne", "x:f4,y:f4,z:f4,intensity:f4,ring:u2,t:f4"),
    ("HeLiPR's Avia", "x:f4,y:f4,z:f4,reflectivity:u1,tag:u1,ring:u1,offset_time:u4"),
    ("HeLiPR's Aeva", "x:f4,y:f4,z:f4,reflectivity:f4,velocity:f4,time_offset_ns:i4,ring:u1"),
    ("HeLiPR's Aeva", "x:f4,y:f4,z:f4,reflectivity:f4,velocity:f4,time_offset_ns:i4,ring:u1,intensity:f4"),
    ("VBR", "x:f4,y:f4,z:f4,intensity:f4,t:u4,reflectivity:u2,ring:u1,ambient:u2,range:u4"),
    ("KITTI with ring", "x:f4,y:f4,z:f4,intensity:f4,ring:u2"),
    ("KITTI with ring and time", "x:f4,y:f4,z:f4,intensity:f4,ring:u2,t:f8"),
    ("places in double precision", "x:f8,y:f8,z:f8,intensity:f8"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_read_and_written() {
        for (_, text) in KNOWN {
            let layout: BinLayout = text.parse().unwrap();
            assert_eq!(layout.to_string(), text);
            let json = serde_json::to_string(&layout).unwrap();
            assert_eq!(serde_json::from_str::<BinLayout>(&json).unwrap(), layout);
        }
        for (text, word) in [
            ("", "`` is no name and type"),
            ("x:f4,y:f4,z:f3", "`f3` is no type"),
            ("x:f4,y:f4,z:u2", "field `z` is uint16"),
            ("x:f4,y:f4,i:f4", "no field `z`"),
        ] {
            let error = text.parse::<BinLayout>().unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
