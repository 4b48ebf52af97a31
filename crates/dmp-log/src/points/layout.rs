//! Where in a row of bytes the fields of a point are.

use super::time_fields::two_of;
use super::{NumberType, RawTime, TimeUnit};
use crate::{FieldInfo, FieldMeaning};

/// A field of a point that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) offset: usize,
    pub(crate) kind: NumberType,
}

impl Field {
    /// The coordinate in a row; NaN where the row is too short.
    pub(crate) fn coordinate(self, row: &[u8], big_endian: bool) -> f64 {
        self.kind.read(row, self.offset, big_endian).map_or(f64::NAN, RawTime::as_f64)
    }
}

/// The field with the time of a point: seconds, where another one has what is below a second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TimeField {
    pub(super) field: Field,
    pub(super) rest: Option<(Field, TimeUnit)>,
}

impl TimeField {
    /// The time in a row; of two fields in nanoseconds, and none where the one is not whole or the other a second or more.
    pub(super) fn read(self, row: &[u8], big_endian: bool) -> Option<RawTime> {
        let time = self.field.kind.read(row, self.field.offset, big_endian)?;
        let Some((rest, unit)) = self.rest else { return Some(time) };
        let whole = |time: RawTime| match time {
            RawTime::Integer(value) => Some(value),
            RawTime::Float(value) => (value.fract() == 0.0 && value.abs() < 1e15).then_some(value as i64),
        };
        let rest = whole(rest.kind.read(row, rest.offset, big_endian)?)?;
        let second = TimeUnit::Seconds.in_ns();
        let rest_ns = (0..second / unit.in_ns()).contains(&rest).then(|| rest * unit.in_ns())?;
        whole(time)?.checked_mul(second)?.checked_add(rest_ns).map(RawTime::Integer)
    }
}

/// How the points of a scan are stored: rows of `point_step` bytes with named fields in them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Layout {
    named: Vec<(String, Field)>,
    pub(super) xyz: [Field; 3],
    pub(super) big_endian: bool,
    pub(super) point_step: usize,
}

impl Layout {
    /// A layout that holds together: a step, every field within it, and coordinates that are floats. What
    /// is wrong is said with its value.
    pub(crate) fn new(
        named: Vec<(String, Field)>,
        big_endian: bool,
        point_step: u32,
    ) -> Result<Self, String> {
        if point_step == 0 {
            return Err("point_step is 0".into());
        }
        for (name, field) in &named {
            let end = field.offset as u64 + u64::from(field.kind.bytes());
            if end > u64::from(point_step) {
                return Err(format!("field `{name}` ends at byte {end} of a point of {point_step} bytes"));
            }
        }
        let coordinate = |wanted: &str| match find(&named, wanted) {
            Some(field) if field.kind.is_float() => Ok(field),
            Some(field) => Err(format!("field `{wanted}` is {}, not float32 or float64", field.kind.name())),
            None => {
                let names: Vec<&str> = named.iter().map(|(name, _)| name.as_str()).take(20).collect();
                Err(format!("no field `{wanted}` among [{}]", names.join(", ")))
            }
        };
        let xyz = [coordinate("x")?, coordinate("y")?, coordinate("z")?];
        Ok(Self { named, xyz, big_endian, point_step: point_step as usize })
    }

    /// The layout of a scan without points: drivers send those without any fields.
    pub(crate) fn of_nothing(named: Vec<(String, Field)>, big_endian: bool, point_step: u32) -> Self {
        let nowhere = Field { offset: 0, kind: NumberType::F32 };
        let xyz = ["x", "y", "z"].map(|name| find(&named, name).unwrap_or(nowhere));
        Self { named, xyz, big_endian, point_step: point_step as usize }
    }

    pub(crate) fn field(&self, name: &str) -> Option<Field> {
        find(&self.named, name)
    }

    /// The field with this name, or the two that it is made of.
    pub(crate) fn time_field(&self, name: &str) -> Option<TimeField> {
        if let Some(field) = self.field(name) {
            return Some(TimeField { field, rest: None });
        }
        let (seconds, rest, unit) = two_of(name)?;
        Some(TimeField { field: self.field(seconds)?, rest: Some((self.field(rest)?, unit)) })
    }

    pub(crate) fn names(&self) -> Vec<&str> {
        self.named.iter().map(|(name, _)| name.as_str()).collect()
    }

    pub(crate) fn point_bytes(&self) -> u32 {
        self.point_step as u32
    }

    /// The fields for people; `time` is the one with the times of the points.
    pub(crate) fn field_infos(&self, time: Option<&str>) -> Vec<FieldInfo> {
        let two = time.filter(|name| self.field(name).is_none()).and_then(two_of);
        let meaning = |name: &str| match name {
            "x" | "y" | "z" => FieldMeaning::Coordinate,
            name if time == Some(name) || two.is_some_and(|(a, b, _)| [a, b].contains(&name)) => {
                FieldMeaning::Time
            }
            _ => FieldMeaning::NotUsed,
        };
        let info = |(name, field): &(String, Field)| FieldInfo {
            name: name.clone(),
            kind: field.kind.name(),
            offset_bytes: field.offset as u32,
            meaning: meaning(name),
        };
        self.named.iter().map(info).collect()
    }

    /// Whether x, y and z are float32 one behind the other in this machine's usual order.
    pub(super) fn packed_xyz(&self) -> Option<usize> {
        let [x, y, z] = self.xyz;
        let packed = !self.big_endian
            && self.xyz.iter().all(|field| field.kind == NumberType::F32)
            && y.offset == x.offset + 4
            && z.offset == x.offset + 8;
        packed.then_some(x.offset)
    }
}

fn find(named: &[(String, Field)], wanted: &str) -> Option<Field> {
    named.iter().find(|(name, _)| name == wanted).map(|&(_, field)| field)
}
