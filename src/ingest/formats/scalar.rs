//! Numbers of fixed size, as messages of robots hold them.

use super::bytes::Little;
use super::fill::Number;

/// How a number is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scalar {
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

impl Scalar {
    /// Its bytes.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number at byte `at`, its least byte first, or last if `big`; none beyond the end.
    pub(crate) fn read(self, bytes: &[u8], at: usize, big: bool) -> Option<Number> {
        fn taken<const N: usize>(bytes: &[u8], at: usize, big: bool) -> Option<[u8; N]> {
            let mut number: [u8; N] = bytes.array(at)?;
            if big {
                number.reverse();
            }
            Some(number)
        }
        Some(match self {
            Self::I8 => Number::Whole(i64::from(i8::from_le_bytes(taken(bytes, at, big)?))),
            Self::U8 => Number::Whole(i64::from(bytes.u8(at)?)),
            Self::I16 => Number::Whole(i64::from(i16::from_le_bytes(taken(bytes, at, big)?))),
            Self::U16 => Number::Whole(i64::from(u16::from_le_bytes(taken(bytes, at, big)?))),
            Self::I32 => Number::Whole(i64::from(i32::from_le_bytes(taken(bytes, at, big)?))),
            Self::U32 => Number::Whole(i64::from(u32::from_le_bytes(taken(bytes, at, big)?))),
            Self::I64 => Number::Whole(i64::from_le_bytes(taken(bytes, at, big)?)),
            Self::U64 => Number::unsigned(u64::from_le_bytes(taken(bytes, at, big)?)),
            Self::F32 => Number::Single(f32::from_le_bytes(taken(bytes, at, big)?)),
            Self::F64 => Number::Double(f64::from_le_bytes(taken(bytes, at, big)?)),
        })
    }
}
