//! The types of numbers that fields have, and how one is read.

use super::RawTime;

/// The numbers a field may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl NumberType {
    pub(crate) fn bytes(self) -> u32 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::I8 => "int8",
            Self::U8 => "uint8",
            Self::I16 => "int16",
            Self::U16 => "uint16",
            Self::I32 => "int32",
            Self::U32 => "uint32",
            Self::I64 => "int64",
            Self::U64 => "uint64",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The value at `offset` of a row; `None` where the row is too short.
    #[inline]
    pub(crate) fn read(self, row: &[u8], offset: usize, big_endian: bool) -> Option<RawTime> {
        with_number!(self, T => T::read(row, offset, big_endian).map(T::raw))
    }
}

/// A number in a row of bytes.
pub(super) trait Number: Copy {
    /// The value at `offset`; `None` where the row is too short.
    fn read(row: &[u8], offset: usize, big_endian: bool) -> Option<Self>;

    fn raw(self) -> RawTime;
}

macro_rules! number {
    ($($type:ty => $raw:expr),*) => {$(
        impl Number for $type {
            #[inline]
            fn read(row: &[u8], offset: usize, big_endian: bool) -> Option<Self> {
                let bytes = *row.get(offset..)?.first_chunk()?;
                Some(if big_endian { Self::from_be_bytes(bytes) } else { Self::from_le_bytes(bytes) })
            }

            #[inline]
            fn raw(self) -> RawTime {
                $raw(self)
            }
        }
    )*};
}

number!(
    i8 => |value| RawTime::Integer(i64::from(value)),
    u8 => |value| RawTime::Integer(i64::from(value)),
    i16 => |value| RawTime::Integer(i64::from(value)),
    u16 => |value| RawTime::Integer(i64::from(value)),
    i32 => |value| RawTime::Integer(i64::from(value)),
    u32 => |value| RawTime::Integer(i64::from(value)),
    i64 => RawTime::Integer,
    u64 => RawTime::of_u64,
    f32 => |value| RawTime::Float(f64::from(value)),
    f64 => RawTime::Float
);

/// Does something with the type `$number` that a [`NumberType`] stands for, so that the kind is looked at once
/// and not for every point.
macro_rules! with_number {
    ($kind:expr, $number:ident => $body:expr) => {
        with_number!($kind, $number => $body; I8 i8, U8 u8, I16 i16, U16 u16, I32 i32, U32 u32, I64 i64, U64 u64, F32 f32, F64 f64)
    };
    ($kind:expr, $number:ident => $body:expr; $($variant:ident $type:ty),*) => {
        match $kind {
            $(NumberType::$variant => {
                type $number = $type;
                $body
            })*
        }
    };
}
pub(crate) use with_number;
