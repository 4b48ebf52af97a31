//! A field of a point, as the log stores it.

/// A field of a point as the log stores it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldInfo {
    /// Its name.
    pub name: String,
    /// Its type, as `float32`.
    pub kind: &'static str,
    /// Its place in the point's record.
    pub offset_bytes: u32,
    /// What it is taken for.
    pub meaning: FieldMeaning,
}

impl FieldInfo {
    pub(crate) fn new(name: &str, kind: &'static str, offset_bytes: u32, meaning: FieldMeaning) -> Self {
        Self { name: name.to_owned(), kind, offset_bytes, meaning }
    }
}

/// What a field of a point is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FieldMeaning {
    /// A coordinate in the sensor's frame, metres.
    Coordinate,
    /// The time of the point.
    Time,
    /// It is not used.
    NotUsed,
}

impl FieldMeaning {
    /// Its name in machine output: `coordinate`, `time`, `not_used`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Coordinate => "coordinate",
            Self::Time => "time",
            Self::NotUsed => "not_used",
        }
    }
}
