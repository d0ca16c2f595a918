//! The bytes of a ROS message, walked along its definition.
//!
//! ROS 1 packs its fields. ROS 2 writes CDR (OMG DDS-RTPS, 10): four bytes say the byte order, and each number is aligned
//! to its own size, counted from there.

use super::definition::{Field, LONGEST_ARRAY, Primitive, Shape, numbers};
use crate::ingest::formats::fill::Number;
use crate::ingest::formats::scalar::Scalar;

/// How the bytes are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::ingest) enum Encoding {
    /// ROS 1.
    Packed,
    /// ROS 2.
    Cdr,
}

/// The message ends before its definition does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Short;

/// Names and types of the numbers that [`walk`] hands over, in their order.
pub(super) fn leaves(fields: &[Field]) -> Vec<(String, Primitive)> {
    fn of(name: &str, shape: &Shape, out: &mut Vec<(String, Primitive)>) {
        match shape {
            Shape::Number(primitive) => out.push((name.to_string(), *primitive)),
            Shape::Struct(fields) => fields.iter().for_each(|f| of(&format!("{name}.{}", f.name), &f.shape, out)),
            // short arrays of types of short arrays, without a number in the end, would be walked through for nothing
            Shape::Array(element, n) if *n <= LONGEST_ARRAY && numbers(element) > 0 => {
                (0..*n).for_each(|i| of(&format!("{name}[{i}]"), element, out));
            }
            Shape::Array(..) | Shape::Sequence(_) | Shape::Text | Shape::Wide => {}
        }
    }
    let mut out = Vec::new();
    fields.iter().for_each(|f| of(&f.name, &f.shape, &mut out));
    out
}

/// A message in the making.
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    aligned: bool,
    big: bool,
}

impl<'a> Cursor<'a> {
    /// Begins at a message's first field; the error says why it cannot be read.
    pub(crate) fn new(message: &'a [u8], encoding: Encoding) -> Result<Self, String> {
        let (bytes, aligned, big) = match encoding {
            Encoding::Packed => (message, false, false),
            Encoding::Cdr => {
                let header = message.get(..4).ok_or_else(|| format!("{} bytes are no message", message.len()))?;
                if header == [0x28, 0xb5, 0x2f, 0xfd] {
                    return Err("is packed by zstd; unpack the bag with `ros2 bag convert`".into());
                }
                match header[..2] {
                    [0, 0] => (&message[4..], true, true),
                    [0, 1] => (&message[4..], true, false),
                    _ => {
                        return Err(format!("begins with {:02x} {:02x}, which is not plain CDR", header[0], header[1]));
                    }
                }
            }
        };
        Ok(Self { bytes, at: 0, aligned, big })
    }

    fn align(&mut self, size: usize) {
        if self.aligned {
            self.at = self.at.next_multiple_of(size);
        }
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Short> {
        self.align(N);
        let end = self.at.checked_add(N).ok_or(Short)?;
        let mut bytes: [u8; N] = self.bytes.get(self.at..end).and_then(|b| b.try_into().ok()).ok_or(Short)?;
        self.at = end;
        if self.big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn u32(&mut self) -> Result<u32, Short> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn skip(&mut self, n: usize) -> Result<(), Short> {
        self.at = self.at.checked_add(n).filter(|end| *end <= self.bytes.len()).ok_or(Short)?;
        Ok(())
    }

    fn scalar(&mut self, scalar: Scalar) -> Result<Number, Short> {
        self.align(scalar.size());
        let number = scalar.read(self.bytes, self.at, self.big).ok_or(Short)?;
        self.at += scalar.size();
        Ok(number)
    }

    fn number(&mut self, primitive: Primitive) -> Result<Number, Short> {
        use Primitive as P;
        Ok(match primitive {
            P::Bool => self.scalar(Scalar::U8)?,
            P::Scalar(scalar) => self.scalar(scalar)?,
            P::Time | P::Duration => {
                let seconds = i64::from(i32::from_le_bytes(self.array()?));
                // ROS 1 counts its seconds without a sign: past 2038
                let unsigned = !self.aligned && primitive == P::Time && seconds < 0;
                let seconds = if unsigned { seconds + (1 << 32) } else { seconds };
                Number::Whole(seconds * 1_000_000_000 + i64::from(self.u32()?))
            }
        })
    }

    /// Hands every number of [`leaves`] to `put`.
    pub(crate) fn walk(&mut self, fields: &[Field], put: &mut dyn FnMut(Number)) -> Result<(), Short> {
        // an empty struct has a member in CDR, for C's sake
        if fields.is_empty() && self.aligned {
            return self.skip(1);
        }
        fields.iter().try_for_each(|f| self.shape(&f.shape, put))
    }

    fn shape(&mut self, shape: &Shape, put: &mut dyn FnMut(Number)) -> Result<(), Short> {
        match shape {
            Shape::Number(primitive) => {
                put(self.number(*primitive)?);
                Ok(())
            }
            Shape::Text => {
                let n = self.u32()?;
                self.skip(n as usize)
            }
            Shape::Wide => {
                let n = self.u32()? as usize;
                self.skip(n.checked_mul(2).ok_or(Short)?)
            }
            Shape::Struct(fields) => self.walk(fields, put),
            Shape::Array(element, n) => {
                let mut nothing = |_| ();
                let put: &mut dyn FnMut(Number) = if *n <= LONGEST_ARRAY { put } else { &mut nothing };
                for _ in 0..*n {
                    let before = self.at;
                    self.shape(element, put)?;
                    // elements without bytes have no numbers, and there may be any number of them
                    if self.at == before {
                        break;
                    }
                }
                Ok(())
            }
            Shape::Sequence(element) => {
                let n = self.u32()?;
                // every element takes a byte at least: a count beyond that is damage
                if n as usize > self.bytes.len().saturating_sub(self.at) {
                    return Err(Short);
                }
                (0..n).try_for_each(|_| self.shape(element, &mut |_| ()))
            }
        }
    }

    /// Bytes after the last field that was read.
    pub(crate) fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ingest::formats::ros::definition::{Generation, parse};

    const TEXT: &str = "uint8 a\nfloat64 b\nstring s\nint16[2] c\nfloat32[] d\nfloat64[9] covariance\nint64 e";

    fn numbers(message: &[u8], encoding: Encoding, generation: Generation) -> Result<Vec<f64>, String> {
        let fields = parse("p/T", Some(TEXT), generation).unwrap();
        let mut cursor = Cursor::new(message, encoding)?;
        let mut out = Vec::new();
        cursor.walk(&fields, &mut |n| out.push(n.to_f64())).map_err(|Short| "short".to_string())?;
        assert_eq!((cursor.left(), out.len()), (0, leaves(&fields).len()));
        Ok(out)
    }

    /// The message as the definition has it, aligned or not, in either byte order.
    fn message(aligned: bool, big: bool) -> Vec<u8> {
        let mut body: Vec<u8> = Vec::new();
        let mut put = |bytes: &[u8]| {
            if aligned {
                while !body.len().is_multiple_of(bytes.len()) {
                    body.push(0);
                }
            }
            let mut bytes = bytes.to_vec();
            if big {
                bytes.reverse();
            }
            body.extend(bytes);
        };
        put(&[7]);
        put(&1.5f64.to_le_bytes());
        put(&3u32.to_le_bytes());
        b"ab\0".iter().for_each(|b| put(&[*b]));
        put(&(-2i16).to_le_bytes());
        put(&3i16.to_le_bytes());
        put(&1u32.to_le_bytes());
        put(&9f32.to_le_bytes());
        (0..9).for_each(|_| put(&0f64.to_le_bytes()));
        put(&(-5i64).to_le_bytes());
        let header: &[u8] = match (aligned, big) {
            (false, _) => &[],
            (true, big) => &[0, u8::from(!big), 0, 0],
        };
        [header, &body].concat()
    }

    #[test]
    fn packed_and_aligned_messages_give_the_same_numbers() {
        let expected = Ok(vec![7.0, 1.5, -2.0, 3.0, -5.0]);
        assert_eq!(numbers(&message(false, false), Encoding::Packed, Generation::One), expected);
        assert_eq!(numbers(&message(true, false), Encoding::Cdr, Generation::Two), expected);
        assert_eq!(numbers(&message(true, true), Encoding::Cdr, Generation::Two), expected);
    }

    #[test]
    fn messages_cut_anywhere_are_short() {
        let whole = message(true, false);
        for n in 0..whole.len() {
            assert!(numbers(&whole[..n], Encoding::Cdr, Generation::Two).is_err(), "{n}");
        }
        assert!(numbers(&[9, 9, 0, 0], Encoding::Cdr, Generation::Two).unwrap_err().contains("09 09"));
        assert!(numbers(&[0x28, 0xb5, 0x2f, 0xfd], Encoding::Cdr, Generation::Two).unwrap_err().contains("zstd"));
    }

    #[test]
    fn a_sequence_longer_than_its_message_is_short_at_once() {
        let fields = parse("p/T", Some("p/E[] a\n===\nMSG: p/E\n"), Generation::One).unwrap();
        let mut cursor = Cursor::new(&[255, 255, 255, 255], Encoding::Packed).unwrap();
        assert_eq!(cursor.walk(&fields, &mut |_| ()), Err(Short));
    }

    #[test]
    fn elements_without_bytes_are_passed_over_at_once() {
        let text =
            "p/E[1000000000000] a\np/F[1000000000000] b\nint8 c\n===\nMSG: p/E\n===\nMSG: p/F\np/E[1000000000] a\n";
        let fields = parse("p/T", Some(text), Generation::One).unwrap();
        let mut out = Vec::new();
        Cursor::new(&[7, 8], Encoding::Packed).unwrap().walk(&fields, &mut |n| out.push(n)).unwrap();
        assert_eq!(out, [Number::Whole(7)]);
    }

    #[test]
    fn arrays_of_arrays_of_nothing_have_no_names() {
        let deep: String = (0..11).map(|i| format!("===\nMSG: p/A{i}\nA{}[8] a\n", i + 1)).collect();
        for last in ["", "string s\n", "int8[] s\n"] {
            let text = format!("A0 a\nfloat64 gyro\n{deep}===\nMSG: p/A11\n{last}");
            let fields = parse("p/T", Some(&text), Generation::One).unwrap();
            assert_eq!(leaves(&fields).len(), 1, "{last}");
            let walked = Cursor::new(&[0; 64], Encoding::Packed).unwrap().walk(&fields, &mut |_| ());
            // texts and sequences take bytes, of which there are too few
            assert_eq!(walked.is_ok(), last.is_empty());
        }
    }

    #[test]
    fn stamps_are_nanoseconds() {
        let fields = parse("p/T", Some("time t"), Generation::One).unwrap();
        let bytes = [3_000_000_000u32.to_le_bytes(), 5u32.to_le_bytes()].concat();
        let mut out = None;
        Cursor::new(&bytes, Encoding::Packed).unwrap().walk(&fields, &mut |n| out = Some(n)).unwrap();
        assert_eq!(out, Some(Number::Whole(3_000_000_000_000_000_005)));
    }
}
