//! `sensor_msgs/msg/PointCloud2`: its header, the layout of its points, and the points themselves.

use crate::FieldInfo;
use crate::cdr::{CdrError, CdrReader};
use crate::point_time::{RawTime, TimeRule};
use dmp_sensor::Scan;

/// The types a field may have, as numbered by `sensor_msgs/msg/PointField`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn from_datatype(datatype: u8) -> Option<Self> {
        Some(match datatype {
            1 => Self::I8,
            2 => Self::U8,
            3 => Self::I16,
            4 => Self::U16,
            5 => Self::I32,
            6 => Self::U32,
            7 => Self::F32,
            8 => Self::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> u32 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::I8 => "int8",
            Self::U8 => "uint8",
            Self::I16 => "int16",
            Self::U16 => "uint16",
            Self::I32 => "int32",
            Self::U32 => "uint32",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    /// The value at the start of `bytes`; `None` where they are too few.
    #[inline]
    fn read(self, bytes: &[u8], big_endian: bool) -> Option<RawTime> {
        macro_rules! number {
            ($type:ty) => {{
                let array = *bytes.first_chunk()?;
                if big_endian { <$type>::from_be_bytes(array) } else { <$type>::from_le_bytes(array) }
            }};
        }
        Some(match self {
            Self::I8 => RawTime::Integer(number!(i8).into()),
            Self::U8 => RawTime::Integer(number!(u8).into()),
            Self::I16 => RawTime::Integer(number!(i16).into()),
            Self::U16 => RawTime::Integer(number!(u16).into()),
            Self::I32 => RawTime::Integer(number!(i32).into()),
            Self::U32 => RawTime::Integer(number!(u32).into()),
            Self::F32 => RawTime::Float(number!(f32).into()),
            Self::F64 => RawTime::Float(number!(f64)),
        })
    }
}

/// A field of a point that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Field {
    offset: usize,
    kind: Kind,
}

/// How points are stored in a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Layout {
    named: Vec<(String, Field)>,
    xyz: [Field; 3],
    big_endian: bool,
    point_step: usize,
}

impl Layout {
    pub(crate) fn field(&self, name: &str) -> Option<Field> {
        self.named.iter().find(|(field, _)| field == name).map(|&(_, field)| field)
    }

    pub(crate) fn names(&self) -> Vec<&str> {
        self.named.iter().map(|(name, _)| name.as_str()).collect()
    }

    pub(crate) fn point_bytes(&self) -> u32 {
        self.point_step as u32
    }

    pub(crate) fn field_infos(&self) -> Vec<FieldInfo> {
        let info = |(name, field): &(String, Field)| FieldInfo {
            name: name.clone(),
            kind: field.kind.name(),
            offset_bytes: field.offset as u32,
        };
        self.named.iter().map(info).collect()
    }
}

/// A message, checked: `data` holds every row that `height`, `width` and the layout promise.
#[derive(Debug)]
pub(crate) struct Cloud<'a> {
    pub(crate) stamp_ns: i64,
    pub(crate) frame_id: &'a str,
    pub(crate) layout: Layout,
    width: usize,
    height: usize,
    row_step: usize,
    data: &'a [u8],
}

impl<'a> Cloud<'a> {
    /// Reads and checks a message. What is wrong is said with its value.
    pub(crate) fn parse(message: &'a [u8]) -> Result<Self, String> {
        Self::parse_cdr(message).map_err(|CdrError(problem)| problem)
    }

    fn parse_cdr(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut cdr = CdrReader::new(message)?;
        let seconds = cdr.i32("stamp")?;
        let nanoseconds = cdr.u32("stamp")?;
        if nanoseconds >= 1_000_000_000 {
            return Err(CdrError(format!("the stamp has {nanoseconds} nanoseconds, more than a second")));
        }
        let frame_id = cdr.string("frame_id")?;
        let height = cdr.u32("height")?;
        let width = cdr.u32("width")?;
        let mut fields = Vec::new();
        for _ in 0..cdr.u32("fields")? {
            let name = cdr.string("a field's name")?;
            let offset = cdr.u32("a field's offset")?;
            let datatype = cdr.u8("a field's type")?;
            let _count = cdr.u32("a field's count")?;
            fields.push((name, offset, datatype));
        }
        let big_endian = cdr.u8("is_bigendian")? != 0;
        let point_step = cdr.u32("point_step")?;
        let row_step = cdr.u32("row_step")?;
        let data = cdr.bytes("data")?;
        // `is_dense` is often wrong; whether a point is finite is seen from the point.
        let returns = u64::from(height) * u64::from(width);
        let layout = layout_of(&fields, big_endian, point_step, returns == 0).map_err(CdrError)?;
        let row_step =
            check_size(height, width, point_step, row_step, data.len() as u64).map_err(CdrError)?;
        Ok(Self {
            stamp_ns: i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds),
            frame_id,
            layout,
            width: width as usize,
            height: height as usize,
            row_step,
            data,
        })
    }

    pub(crate) fn returns(&self) -> u64 {
        self.width as u64 * self.height as u64
    }

    fn points(&self) -> impl Iterator<Item = &'a [u8]> {
        let (data, row_step, step) = (self.data, self.row_step, self.layout.point_step.max(1));
        let row_bytes = self.width * self.layout.point_step;
        let height = if row_bytes == 0 { 0 } else { self.height };
        (0..height)
            .filter_map(move |row| data.get(row * row_step..)?.get(..row_bytes))
            .flat_map(move |row| row.chunks_exact(step))
    }

    /// Appends the points to `scan`, whose stamp it sets, with their times where a field and its
    /// meaning are given.
    pub(crate) fn append_to(&self, time: Option<(Field, TimeRule)>, scan: &mut Scan) {
        scan.stamp_ns = Some(self.stamp_ns);
        let points = &mut scan.points_in_sensor_m;
        // Reserved by what is there, not by what is claimed: both were compared.
        points.reserve(self.returns() as usize);
        let [x, y, z] = self.layout.xyz;
        let packed = !self.layout.big_endian
            && self.layout.xyz.iter().all(|field| field.kind == Kind::F32)
            && y.offset == x.offset + 4
            && z.offset == x.offset + 8;
        if packed {
            points.extend(self.points().map(|point| packed_f32(point, x.offset)));
        } else {
            points.extend(
                self.points().map(|point| self.layout.xyz.map(|field| self.coordinate(point, field))),
            );
        }
        let Some((field, rule)) = time else { return };
        scan.time_offsets_ns.reserve(self.returns() as usize);
        for (point, place) in self.points().zip(points.iter_mut()) {
            let raw = self.raw(point, field);
            let offset_ns = raw.and_then(|raw| rule.offset_ns(raw, self.stamp_ns));
            if offset_ns.is_none() {
                *place = [f32::NAN; 3];
            }
            scan.time_offsets_ns.push(offset_ns.unwrap_or(0));
        }
    }

    /// Smallest and largest value of a field over the returns that have a place: rows without one often
    /// carry a zero for a time.
    pub(crate) fn extremes(&self, field: Field) -> Option<(f64, f64)> {
        let mut extremes: Option<(f64, f64)> = None;
        for point in self.points() {
            let place = self.layout.xyz.map(|field| self.coordinate(point, field));
            let value = self.raw(point, field).map(RawTime::as_f64);
            let Some(value) = value.filter(|value| value.is_finite()) else { continue };
            if place.iter().all(|c| c.is_finite()) && place != [0.0; 3] {
                let (low, high) = extremes.unwrap_or((value, value));
                extremes = Some((low.min(value), high.max(value)));
            }
        }
        extremes
    }

    #[inline]
    fn raw(&self, point: &[u8], field: Field) -> Option<RawTime> {
        field.kind.read(point.get(field.offset..)?, self.layout.big_endian)
    }

    #[inline]
    fn coordinate(&self, point: &[u8], field: Field) -> f32 {
        self.raw(point, field).map_or(f32::NAN, |value| value.as_f64() as f32)
    }
}

#[inline]
fn packed_f32(point: &[u8], offset: usize) -> [f32; 3] {
    let Some(&[a, b, c, d, e, f, g, h, i, j, k, l]) = point.get(offset..).and_then(|rest| rest.first_chunk())
    else {
        return [f32::NAN; 3];
    };
    [[a, b, c, d], [e, f, g, h], [i, j, k, l]].map(f32::from_le_bytes)
}

fn layout_of(
    fields: &[(&str, u32, u8)],
    big_endian: bool,
    point_step: u32,
    empty: bool,
) -> Result<Layout, String> {
    let named: Vec<(String, Field)> = fields
        .iter()
        .filter_map(|&(name, offset, datatype)| {
            let field = Field { offset: offset as usize, kind: Kind::from_datatype(datatype)? };
            Some((name.to_owned(), field))
        })
        .collect();
    let coordinate = |wanted: &str| -> Result<Field, String> {
        let Some(&(_, _, datatype)) = fields.iter().find(|(name, ..)| *name == wanted) else {
            let names: Vec<&str> = fields.iter().map(|&(name, ..)| name).take(20).collect();
            return Err(format!("no field `{wanted}` among [{}]", names.join(", ")));
        };
        match named.iter().find(|(name, _)| name == wanted).map(|&(_, field)| field) {
            Some(field) if matches!(field.kind, Kind::F32 | Kind::F64) => Ok(field),
            Some(field) => Err(format!("field `{wanted}` is {}, not float32 or float64", field.kind.name())),
            None => Err(format!("field `{wanted}` has the unknown type {datatype}")),
        }
    };
    if empty {
        // Drivers send empty clouds without any layout.
        let nowhere = Field { offset: 0, kind: Kind::F32 };
        let xyz = ["x", "y", "z"].map(|name| coordinate(name).unwrap_or(nowhere));
        return Ok(Layout { named, xyz, big_endian, point_step: point_step as usize });
    }
    if point_step == 0 {
        return Err("point_step is 0".into());
    }
    for (name, field) in &named {
        let end = field.offset as u64 + u64::from(field.kind.bytes());
        if end > u64::from(point_step) {
            return Err(format!("field `{name}` ends at byte {end} of a point of {point_step} bytes"));
        }
    }
    let xyz = [coordinate("x")?, coordinate("y")?, coordinate("z")?];
    Ok(Layout { named, xyz, big_endian, point_step: point_step as usize })
}

/// Compares the claimed size with the bytes that are there; the bytes from row to row.
fn check_size(height: u32, width: u32, point_step: u32, row_step: u32, data: u64) -> Result<usize, String> {
    let row_bytes = u64::from(width) * u64::from(point_step);
    // One row needs no step to the next, and drivers leave it 0.
    let row_step = if height <= 1 { row_bytes } else { u64::from(row_step) };
    if row_step < row_bytes {
        return Err(format!("row_step is {row_step}, less than {width} points of {point_step} bytes"));
    }
    let needed = match u64::from(height) {
        0 => Some(0),
        height => row_step.checked_mul(height - 1).and_then(|before| before.checked_add(row_bytes)),
    };
    match needed {
        Some(needed) if needed <= data => Ok(row_step as usize),
        _ => Err(format!(
            "{height} rows of {width} points of {point_step} bytes do not fit in {data} bytes of data"
        )),
    }
}
