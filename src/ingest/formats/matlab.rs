//! MATLAB files of version 5 to 7: elements with a type and a size, which may be packed by zlib.
//!
//! Vectors and matrices of numbers are read, also those in structs; tables, timetables and other objects are not in any
//! documented form. (MathWorks, *MAT-File Format*.) The crate `matfile` is not used: it passes over structs.

use super::arrays;
use super::arrays::{Arrays, Entry, Loaded};
use super::bytes::{Bytes, Unpacked};
use super::format::{Format, Opened};
use super::head::Kind;
use super::input::Input;
use super::source::About;
use crate::error::{ErrorKind, Result};
use flate2::read::ZlibDecoder;
use std::io::Read;

/// Files that begin as MATLAB's do; those of version 7.3 are HDF5 and tried before.
pub(crate) const FORMAT: Format = Format { name: "MATLAB file", accepts: |head| head.starts_with(b"MATLAB 5.0"), open };

const HEADER_BYTES: u64 = 128;
/// Structs within structs beyond which nobody puts a log.
const DEEPEST: usize = 16;

const INT8: u32 = 1;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// Classes of a matrix: a structure, and numbers.
const STRUCT: u8 = 2;
const NUMBERS: std::ops::RangeInclusive<u8> = 6..=15;
const CLASSES: [&str; 18] = [
    "?", "cell", "struct", "object", "char", "sparse", "double", "single", "int8", "uint8", "int16", "uint16", "int32",
    "uint32", "int64", "uint64", "function", "object",
];

struct Mat {
    entries: Vec<Entry>,
    numbers: Vec<Option<Loaded>>,
}

impl Arrays for Mat {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn load(&mut self, entry: usize) -> Result<Loaded> {
        Ok(self.numbers[entry].clone().unwrap_or(Loaded::Double(Vec::new())))
    }
}

fn open(input: Input) -> Result<Opened> {
    let path = input.path.clone();
    let source = path.display().to_string();
    let big = input.head.get(126..128) == Some(b"MI");
    let known = matches!(input.head.get(124..128), Some([_, _, b'M', b'I'] | [_, _, b'I', b'M']));
    let (file, sha256) = input.into_file()?;
    let mut bytes = Bytes::open(&path, &file, 0)?;
    if !known || !bytes.skip(HEADER_BYTES)? {
        return Err(bytes.damaged(124, "the header of 128 bytes is cut off or damaged").hint(MEND));
    }
    let mut mat = Mat { entries: Vec::new(), numbers: Vec::new() };
    let (mut tag, mut body) = (Vec::new(), Vec::new());
    let mut most = Unpacked::of(bytes.len());
    while bytes.left() > 0 {
        let at = bytes.at();
        let cut = |bytes: &Bytes| {
            bytes
                .damaged(
                    at,
                    format!("the file is cut off or damaged: this variable goes on after byte {}", bytes.len()),
                )
                .hint(MEND)
        };
        if !bytes.next(8, &mut tag)? {
            return Err(cut(&bytes));
        }
        let numbers = Elements { rest: &tag, big };
        let (kind, size) = (numbers.word(0).unwrap_or_default(), numbers.word(4).unwrap_or_default());
        if !bytes.next(u64::from(size), &mut body)? {
            return Err(cut(&bytes));
        }
        let unpacked;
        let found = match kind {
            COMPRESSED => {
                let mut out = Vec::new();
                let end = ZlibDecoder::new(body.as_slice()).take(most.left() + 1).read_to_end(&mut out);
                let why = match end {
                    Err(e) => Some(format!("a variable cannot be unpacked: {e}")),
                    Ok(n) if !most.take(n as u64) => Some(Unpacked::BEYOND.to_string()),
                    Ok(_) => None,
                };
                if let Some(why) = why {
                    return Err(bytes.damaged(at, format!("the file is damaged: {why}")).hint(MEND));
                }
                unpacked = out;
                Elements { rest: &unpacked, big }.next()
            }
            _ => Some((kind, body.as_slice())),
        };
        let done = match found {
            Some((MATRIX, body)) => matrix(body, big, &mut Vec::new(), None, &mut mat),
            // what is no variable is of no use here
            Some(_) => Some(()),
            None => None,
        };
        done.ok_or_else(|| bytes.damaged(at, "the file is damaged: a variable contradicts itself").hint(MEND))?;
    }
    let opened = arrays::open(Box::new(mat), About { source, format: FORMAT.name, sha256, notes: Vec::new() });
    opened.map_err(|e| match e.kind {
        ErrorKind::Column => e.hint(
            "save time and rates as vectors of numbers; of a timetable: t = seconds(tt.Time); gyro = tt.gyro; save('log.mat', 't', 'gyro')",
        ),
        _ => e,
    })
}

const MEND: &str = "save the file again in MATLAB, or copy it again";

/// Elements one after the other.
#[derive(Clone, Copy)]
struct Elements<'a> {
    rest: &'a [u8],
    big: bool,
}

impl<'a> Elements<'a> {
    fn word(&self, at: usize) -> Option<u32> {
        let four: [u8; 4] = self.rest.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if self.big { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) })
    }

    /// Type and content of the next element.
    fn next(&mut self) -> Option<(u32, &'a [u8])> {
        let word = self.word(0)?;
        // up to four bytes stand in the tag itself
        let (kind, body, end) = if word >> 16 != 0 {
            let size = (word >> 16) as usize;
            (word & 0xffff, self.rest.get(4..4 + size).filter(|_| size <= 4)?, 8)
        } else {
            let size = self.word(4)? as usize;
            let end = size.checked_add(8)?;
            (word, self.rest.get(8..end)?, end.checked_next_multiple_of(8)?)
        };
        self.rest = self.rest.get(end..).unwrap_or_default();
        Some((kind, body))
    }
}

/// Reads a variable or a member of a struct, of `name` if the struct says so; none if it contradicts itself.
fn matrix(body: &[u8], big: bool, path: &mut Vec<String>, name: Option<String>, mat: &mut Mat) -> Option<()> {
    // an empty member of a struct
    if body.is_empty() {
        return Some(());
    }
    let mut parts = Elements { rest: body, big };
    let (_, flags) = parts.next()?;
    let class = (Elements { rest: flags, big }).word(0)? as u8;
    // opaque objects have their own layout
    if class == 17 {
        return Some(());
    }
    let (_, sides) = parts.next()?;
    let shape: Vec<u64> = whole(sides, 5, big)?.into_iter().map(|n| u64::try_from(n).ok()).collect::<Option<_>>()?;
    let (_, own) = parts.next()?;
    let name = name.unwrap_or_else(|| String::from_utf8_lossy(own).into_owned());
    let items = shape.iter().try_fold(1u64, |n, s| n.checked_mul(*s))?;
    if class == STRUCT && items == 1 && path.len() < DEEPEST {
        let (_, length) = parts.next()?;
        let length = (Elements { rest: length, big }).word(0)? as usize;
        let (_, names) = parts.next()?;
        path.push(name);
        for field in names.chunks_exact(length.max(1)) {
            let end = field.iter().position(|b| *b == 0).unwrap_or(length);
            let (kind, member) = parts.next()?;
            let field = String::from_utf8_lossy(&field[..end]).into_owned();
            if kind == MATRIX {
                matrix(member, big, path, Some(field), mat)?;
            }
        }
        path.pop();
        return Some(());
    }
    let numbers = match NUMBERS.contains(&class) {
        true => {
            let (kind, body) = parts.next()?;
            let numbers = numbers(class, kind, body, big)?;
            let count = match &numbers {
                Loaded::Double(v) => v.len(),
                Loaded::Single(v) => v.len(),
                Loaded::Whole(v) => v.len(),
            };
            (count as u64 == items).then_some(numbers)?.into()
        }
        false => None,
    };
    mat.entries.push(Entry {
        group: path.join("/"),
        name,
        shape,
        first_fastest: true,
        type_name: CLASSES.get(usize::from(class)).copied().unwrap_or("?").to_string(),
        unit: None,
        kind: if numbers.is_some() { Kind::Number } else { Kind::Other },
    });
    mat.numbers.push(numbers);
    Some(())
}

/// The numbers of a matrix of `class`, written as `kind`: whole numbers are written small, whatever their class.
fn numbers(class: u8, kind: u32, body: &[u8], big: bool) -> Option<Loaded> {
    const DOUBLE: u8 = 6;
    const SINGLE: u8 = 7;
    let floats: Vec<f64> = match kind {
        7 => cells(body, big, |b| f64::from(f32::from_le_bytes(b)))?,
        9 => cells(body, big, f64::from_le_bytes)?,
        _ => {
            let whole = whole(body, kind, big)?;
            match class {
                DOUBLE | SINGLE => whole.into_iter().map(|x| x as f64).collect(),
                _ => return Some(Loaded::Whole(whole)),
            }
        }
    };
    Some(match class {
        SINGLE => Loaded::Single(floats.into_iter().map(|x| x as f32).collect()),
        _ => Loaded::Double(floats),
    })
}

fn whole(body: &[u8], kind: u32, big: bool) -> Option<Vec<i64>> {
    match kind {
        INT8 => cells(body, big, |b| i64::from(i8::from_le_bytes(b))),
        2 => cells(body, big, |b| i64::from(u8::from_le_bytes(b))),
        3 => cells(body, big, |b| i64::from(i16::from_le_bytes(b))),
        4 => cells(body, big, |b| i64::from(u16::from_le_bytes(b))),
        5 => cells(body, big, |b| i64::from(i32::from_le_bytes(b))),
        6 => cells(body, big, |b| i64::from(u32::from_le_bytes(b))),
        12 => cells(body, big, i64::from_le_bytes),
        13 => cells(body, big, |b| i64::try_from(u64::from_le_bytes(b)).unwrap_or(i64::MAX)),
        _ => None,
    }
}

fn cells<const N: usize, T>(body: &[u8], big: bool, read: impl Fn([u8; N]) -> T) -> Option<Vec<T>> {
    let (whole, rest) = body.as_chunks::<N>();
    let one = |bytes: &[u8; N]| {
        let mut bytes = *bytes;
        if big {
            bytes.reverse();
        }
        read(bytes)
    };
    rest.is_empty().then(|| whole.iter().map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element, padded to eight bytes.
    fn element(kind: u32, body: &[u8], big: bool) -> Vec<u8> {
        let word = |x: u32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
        let mut out = [word(kind), word(body.len() as u32)].concat();
        out.extend(body);
        out.resize(out.len().next_multiple_of(8), 0);
        out
    }

    fn variable(name: &str, class: u8, shape: [i32; 2], kind: u32, numbers: &[u8], big: bool) -> Vec<u8> {
        let word = |x: i32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
        let flags = [word(i32::from(class)), word(0)].concat();
        let parts = [
            element(6, &flags, big),
            element(5, &[word(shape[0]), word(shape[1])].concat(), big),
            element(INT8, name.as_bytes(), big),
            element(kind, numbers, big),
        ];
        parts.concat()
    }

    fn read(body: &[u8], big: bool) -> Option<Mat> {
        let mut mat = Mat { entries: Vec::new(), numbers: Vec::new() };
        matrix(body, big, &mut Vec::new(), None, &mut mat)?;
        Some(mat)
    }

    #[test]
    fn doubles_that_were_written_small_are_doubles_again() {
        for big in [false, true] {
            let two = |x: i16| if big { x.to_be_bytes() } else { x.to_le_bytes() };
            let mat = read(&variable("wz", 6, [2, 1], 3, &[two(-2), two(300)].concat(), big), big).unwrap();
            assert_eq!((mat.entries[0].name.as_str(), &mat.entries[0].shape[..]), ("wz", &[2, 1][..]));
            assert!(matches!(&mat.numbers[0], Some(Loaded::Double(v)) if v == &[-2.0, 300.0]));
        }
    }

    #[test]
    fn shapes_and_sizes_must_agree() {
        assert!(read(&variable("wz", 6, [3, 1], 9, &[0; 16], false), false).is_none());
        assert!(read(&variable("wz", 6, [-2, 1], 9, &[0; 16], false), false).is_none());
        assert!(read(&variable("wz", 6, [2, 1], 9, &[0; 15], false), false).is_none());
        let whole = variable("wz", 6, [2, 1], 9, &[0; 16], false);
        for n in 1..whole.len() {
            assert!(read(&whole[..n], false).is_none(), "{n}");
        }
    }
}
