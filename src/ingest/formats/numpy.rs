//! NumPy: one array in an `.npy`, several in an `.npz`.
//!
//! (NEP 1.) The crates that read the header bring a parser generator and a big-integer library along for one line of text.

use super::arrays;
use super::arrays::{Arrays, Entry, Loaded};
use super::bytes::Unpacked;
use super::format::{Format, Opened};
use super::head::Kind;
use super::input::Input;
use super::numpy_header::{Field, Header, Plain};
use super::source::About;
use crate::error::{Error, ErrorKind, Result};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use zip::ZipArchive;

/// Files that begin with NumPy's magic number.
pub(crate) const ARRAY: Format =
    Format { name: "NumPy array", accepts: |head| head.starts_with(MAGIC), open: |input| open(input, false) };

/// Zip archives whose first file is an array.
pub(crate) const ARCHIVE: Format = Format {
    name: "NumPy archive",
    accepts: |head| {
        let length = |at: usize| head.get(at..at + 2).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]])));
        let name = length(26).and_then(|n| head.get(30..30 + n));
        head.starts_with(b"PK\x03\x04") && name.is_some_and(|n| n.ends_with(b".npy"))
    },
    open: |input| open(input, true),
};

const MAGIC: &[u8] = b"\x93NUMPY";
/// A header longer than this describes no log, and archives of more arrays are none.
const LONGEST_HEADER: usize = 1 << 16;
const MOST_ARRAYS: usize = 4096;

/// One array: in the file, or in a file of the archive.
#[derive(Debug, Clone)]
struct Stored {
    /// Index in the archive.
    index: usize,
    name: String,
    /// Where the numbers begin.
    at: u64,
    items: u64,
    item_bytes: usize,
}

struct Npy {
    file: File,
    archive: Option<ZipArchive<BufReader<File>>>,
    source: String,
    entries: Vec<Entry>,
    /// Array and field of each entry.
    places: Vec<(Stored, Field)>,
}

fn open(input: Input, zipped: bool) -> Result<Opened> {
    let source = input.path.display().to_string();
    let (file, sha256) = input.into_file()?;
    let about = |notes| About {
        source: source.clone(),
        format: if zipped { ARCHIVE.name } else { ARRAY.name },
        sha256: sha256.clone(),
        notes,
    };
    let mut notes = Vec::new();
    let mut npy = Npy { file, archive: None, source: source.clone(), entries: Vec::new(), places: Vec::new() };
    if zipped {
        let file = npy.file.try_clone().map_err(|e| Error::io(&source, &e))?;
        let mut most = Unpacked::of(file.metadata().map_err(|e| Error::io(&source, &e))?.len());
        let mut archive = ZipArchive::new(BufReader::new(file)).map_err(|e| broken(&source, "its index", &e))?;
        for index in 0..archive.len().min(MOST_ARRAYS) {
            let mut member =
                archive.by_index(index).map_err(|e| broken(&source, &format!("file {}", index + 1), &e))?;
            let name = member.name().map_or_else(|_| format!("file_{}", index + 1), |n| n.into_owned());
            let size = member.size();
            let Some(bare) = name.strip_suffix(".npy") else {
                notes.push(format!("{name} in the archive is no array"));
                continue;
            };
            if !most.take(size) {
                return Err(broken(&source, &format!("array {bare:?}"), &Unpacked::BEYOND));
            }
            let header = header(&mut member, size).map_err(|e| broken(&source, &format!("array {bare:?}"), &e))?;
            npy.add(index, bare, &header, size)?;
        }
        npy.archive = Some(archive);
    } else {
        let size = npy.file.metadata().map_err(|e| Error::io(&source, &e))?.len();
        let header = header(&mut npy.file, size).map_err(|e| broken(&source, "its header", &e))?;
        npy.add(0, "", &header, size)?;
    }
    arrays::open(Box::new(npy), about(notes))
}

fn broken(source: &str, place: &str, why: &dyn std::fmt::Display) -> Error {
    Error::new(ErrorKind::Format, source, format!("is damaged or truncated: {why}"))
        .at(place)
        .hint("write the file again with numpy.save or numpy.savez")
}

/// The header, and how many bytes it takes.
fn header(reader: &mut dyn Read, size: u64) -> io::Result<(Header, u64)> {
    let wrong = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what.to_string());
    let mut first = vec![0; 10];
    reader.read_exact(&mut first)?;
    if !first.starts_with(MAGIC) {
        return Err(wrong("it does not begin as an array does"));
    }
    // the length is checked before anything is reserved for it
    let length = match first[6] {
        1 => usize::from(u16::from_le_bytes([first[8], first[9]])),
        2 | 3 => {
            first.extend([0, 0]);
            reader.read_exact(&mut first[10..])?;
            u32::from_le_bytes([first[8], first[9], first[10], first[11]]) as usize
        }
        other => return Err(wrong(&format!("version {other} of the format is not known"))),
    };
    if length > LONGEST_HEADER || (first.len() + length) as u64 > size {
        return Err(wrong(&format!("a header of {length} bytes")));
    }
    let at = first.len();
    first.resize(at + length, 0);
    reader.read_exact(&mut first[at..])?;
    let header = Header::parse(&String::from_utf8_lossy(&first[at..])).map_err(|why| wrong(&why))?;
    Ok((header, first.len() as u64))
}

fn kind(plain: &Plain) -> Kind {
    match (plain.letter, plain.size) {
        ('b', 1) | ('i' | 'u', 1 | 2 | 4 | 8) | ('f', 4 | 8) => Kind::Number,
        ('M', 8) if nanoseconds(plain).is_some() => Kind::Instant,
        _ => Kind::Other,
    }
}

/// Nanoseconds in the unit of a date; `None` for other units.
fn nanoseconds(plain: &Plain) -> Option<i64> {
    Some(match plain.unit.as_str() {
        "s" => 1_000_000_000,
        "ms" => 1_000_000,
        "us" => 1_000,
        "ns" => 1,
        _ => return None,
    })
}

impl Npy {
    fn add(&mut self, index: usize, name: &str, (header, at): &(Header, u64), size: u64) -> Result<()> {
        let items = header.shape.iter().try_fold(1u64, |n, s| n.checked_mul(*s));
        let bytes = items.and_then(|n| n.checked_mul(header.item_bytes as u64)?.checked_add(*at));
        let objects = header.fields.iter().any(|f| f.plain.letter == 'O');
        match (items, bytes) {
            (Some(_), Some(bytes)) if bytes <= size || objects => {}
            (_, bytes) => {
                let needed = bytes.map_or("more than any memory".to_string(), |n| format!("{n} bytes"));
                let place = if name.is_empty() { "its numbers".to_string() } else { format!("array {name:?}") };
                return Err(broken(&self.source, &place, &format!("it needs {needed} and there are {size}")));
            }
        }
        let item_bytes = header.item_bytes;
        let stored = Stored { index, name: name.to_string(), at: *at, items: items.unwrap_or(0), item_bytes };
        for field in &header.fields {
            // an archive's arrays are told apart by their names, a record's fields by theirs
            let full = match (name.is_empty(), field.name.is_empty()) {
                (false, false) => format!("{name}.{}", field.name),
                (false, true) => name.to_string(),
                (true, _) => field.name.clone(),
            };
            let mut shape = header.shape.clone();
            if field.count > 1 {
                shape.push(field.count as u64);
            }
            let first_fastest = field.count == 1 && header.fortran_order;
            // objects of Python are not numbers, nor is what stands beside them in a record
            let kind = if objects { Kind::Other } else { kind(&field.plain) };
            self.entries.push(entry(&full, shape, first_fastest, &field.plain.to_string(), kind));
            self.places.push((stored.clone(), field.clone()));
        }
        Ok(())
    }
}

fn entry(name: &str, shape: Vec<u64>, first_fastest: bool, type_name: &str, kind: Kind) -> Entry {
    let (name, type_name) = (name.to_string(), type_name.to_string());
    Entry { group: String::new(), name, shape, first_fastest, type_name, unit: None, kind }
}

impl Arrays for Npy {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn load(&mut self, entry: usize) -> Result<Loaded> {
        let (stored, field) = self.places[entry].clone();
        let place = if stored.name.is_empty() { "its numbers".to_string() } else { format!("array {:?}", stored.name) };
        let most = stored.items * stored.item_bytes as u64;
        let mut bytes = Vec::new();
        let read = match &mut self.archive {
            None => self
                .file
                .seek(SeekFrom::Start(stored.at))
                .and_then(|_| (&mut self.file).take(most).read_to_end(&mut bytes)),
            Some(archive) => archive.by_index(stored.index).map_err(io::Error::other).and_then(|mut member| {
                io::copy(&mut (&mut member).take(stored.at), &mut io::sink())?;
                let read = (&mut member).take(most).read_to_end(&mut bytes)?;
                // the checksum stands behind the last byte
                let behind = member.size().saturating_sub(stored.at + read as u64);
                if io::copy(&mut (&mut member).take(behind + 1), &mut io::sink())? > behind {
                    return Err(io::Error::new(io::ErrorKind::InvalidData, "it unpacks to more than it should"));
                }
                Ok(read)
            }),
        };
        let read = read.map_err(|e| broken(&self.source, &place, &e))?;
        if (read as u64) < most {
            return Err(broken(&self.source, &place, &format!("{read} bytes of {most}")));
        }
        Ok(numbers(&bytes, stored.item_bytes, &field))
    }
}

/// The numbers of one field of all items.
fn numbers(bytes: &[u8], item_bytes: usize, field: &Field) -> Loaded {
    let size = field.plain.size;
    let big = field.plain.big;
    let cells = bytes.chunks_exact(item_bytes.max(1)).flat_map(|item| {
        (0..field.count).filter_map(move |i| item.get(field.at + i * size..field.at + (i + 1) * size))
    });
    let whole = |bytes: &[u8], signed: bool| {
        let mut wide = [0u8; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        if big {
            wide[..bytes.len()].reverse();
        }
        let bits = u64::from_le_bytes(wide);
        let unused = 64 - 8 * bytes.len() as u32;
        if signed { (bits << unused).cast_signed() >> unused } else { i64::try_from(bits).unwrap_or(i64::MAX) }
    };
    match (field.plain.letter, size) {
        ('f', 4) => Loaded::Single(cells.map(|b| f32::from_bits(whole(b, false) as u32)).collect()),
        ('f', _) => {
            let bits = |b: &[u8]| whole(b, true).cast_unsigned();
            Loaded::Double(cells.map(|b| f64::from_bits(bits(b))).collect())
        }
        ('M', _) => {
            let unit = nanoseconds(&field.plain).unwrap_or(1);
            // not a time is the smallest number
            let date = |x: i64| if x == i64::MIN { x } else { x.saturating_mul(unit) };
            Loaded::Whole(cells.map(|b| date(whole(b, true))).collect())
        }
        ('i', _) => Loaded::Whole(cells.map(|b| whole(b, true)).collect()),
        _ => Loaded::Whole(cells.map(|b| whole(b, false)).collect()),
    }
}
