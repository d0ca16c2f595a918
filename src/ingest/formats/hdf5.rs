//! HDF5, and MATLAB files of version 7.3, which are HDF5: datasets of numbers in groups.

use super::arrays;
use super::arrays::{Arrays, Entry, Loaded};
use super::bytes::Unpacked;
use super::format::{Format, Opened};
use super::head::Kind;
use super::input::Input;
use super::source::About;
use crate::error::{Error, ErrorKind, Result};
use crate::unwind;
use hdf5_pure::{AttrValue, DType, Dataset, File, Group};

/// Files with HDF5's magic number, at their beginning or after MATLAB's header.
pub(crate) const FORMAT: Format = Format {
    name: "HDF5 or MATLAB 7.3 file",
    accepts: |head| head.starts_with(MAGIC) || (head.starts_with(b"MATLAB 7.3") || head.get(512..520) == Some(MAGIC)),
    open,
};

const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Groups within groups, and datasets, beyond which there is no log.
const DEEPEST: usize = 8;
const MOST_DATASETS: usize = 2048;
/// Groups that are looked into: a group may be in itself, by a link.
const MOST_GROUPS: usize = 256;

struct Hdf5 {
    source: String,
    file: File,
    /// Numbers that may still be read.
    most: Unpacked,
    entries: Vec<Entry>,
}

fn open(input: Input) -> Result<Opened> {
    let path = input.path.clone();
    let source = path.display().to_string();
    let (handle, sha256) = input.into_file()?;
    let bytes = handle.metadata().map_err(|e| Error::io(&path, &e))?.len();
    let file = guarded(|| File::open_streaming(&path)).map_err(|why| damaged(&source, "the header", &why))?;
    let mut hdf5 = Hdf5 { source: source.clone(), file, most: Unpacked::of(bytes), entries: Vec::new() };
    let listed = guarded(|| {
        let mut entries = Vec::new();
        let skipped = list(&hdf5.file.root(), "", &mut (0, 0), &mut entries)?;
        Ok((entries, skipped))
    });
    let (entries, notes) = listed.map_err(|why| damaged(&source, "the list of datasets", &why))?;
    hdf5.entries = entries;
    arrays::open(Box::new(hdf5), About { source, format: FORMAT.name, sha256, notes })
}

/// Appends the datasets of a group and of those in it; with what there is to tell. `met`: how deep it is, and groups before it.
fn list(
    group: &Group,
    path: &str,
    met: &mut (usize, usize),
    entries: &mut Vec<Entry>,
) -> std::result::Result<Vec<String>, hdf5_pure::Error> {
    let mut notes = Vec::new();
    for name in group.datasets()? {
        if entries.len() >= MOST_DATASETS {
            notes.push(format!("only the first {MOST_DATASETS} datasets are looked at"));
            return Ok(notes);
        }
        let dataset = group.dataset(&name)?;
        let dtype = dataset.dtype()?;
        let (unit, is_text) = about(&dataset);
        entries.push(Entry {
            group: path.to_string(),
            kind: if is_number(&dtype) && !is_text { Kind::Number } else { Kind::Other },
            name,
            shape: dataset.shape()?,
            first_fastest: false,
            type_name: dtype.to_string(),
            unit,
        });
    }
    for name in group.groups()? {
        // MATLAB's own
        if name.starts_with('#') || met.0 >= DEEPEST {
            continue;
        }
        if met.1 >= MOST_GROUPS || entries.len() >= MOST_DATASETS {
            break;
        }
        let full = if path.is_empty() { name.clone() } else { format!("{path}/{name}") };
        *met = (met.0 + 1, met.1 + 1);
        let inside = list(&group.group(&name)?, &full, met, entries)?;
        met.0 -= 1;
        notes.extend(inside.into_iter().filter(|note| !notes.contains(note)).collect::<Vec<_>>());
    }
    if met.0 == 0 && met.1 >= MOST_GROUPS {
        notes.push(format!("only the first {MOST_GROUPS} groups are looked at"));
    }
    Ok(notes)
}

/// The unit that a dataset states, and whether its numbers are letters.
fn about(dataset: &Dataset) -> (Option<String>, bool) {
    let attributes = dataset.attrs().unwrap_or_default();
    let text = |name: &str| match attributes.get(name) {
        Some(
            AttrValue::String(value)
            | AttrValue::AsciiString(value)
            | AttrValue::StringSized { value, .. }
            | AttrValue::AsciiStringSized { value, .. },
        ) => Some(value.trim_end_matches('\0').trim().to_string()),
        _ => None,
    };
    let unit = ["units", "unit", "Units", "Unit"].iter().find_map(|n| text(n)).filter(|u| !u.is_empty());
    (unit, text("MATLAB_class").is_some_and(|c| c == "char"))
}

fn is_number(dtype: &DType) -> bool {
    use DType as D;
    matches!(dtype, D::F32 | D::F64 | D::I8 | D::I16 | D::I32 | D::I64 | D::U8 | D::U16 | D::U32 | D::U64)
}

impl Arrays for Hdf5 {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn load(&mut self, entry: usize) -> Result<Loaded> {
        let entry = &self.entries[entry];
        let path = if entry.group.is_empty() { entry.name.clone() } else { format!("{}/{}", entry.group, entry.name) };
        let place = format!("dataset {path:?}");
        let items = entry.shape.iter().try_fold(size_of::<f64>() as u64, |n, s| n.checked_mul(*s));
        if !items.is_some_and(|n| self.most.take(n)) {
            return Err(damaged(&self.source, &place, Unpacked::BEYOND));
        }
        let read = guarded(|| {
            let dataset = self.file.dataset(&path)?;
            Ok(match dataset.dtype()? {
                DType::F32 => Loaded::Single(dataset.read_f32()?),
                DType::F64 => Loaded::Double(dataset.read_f64()?),
                DType::U64 => {
                    let whole = dataset.read_u64()?;
                    Loaded::Whole(whole.into_iter().map(|x| i64::try_from(x).unwrap_or(i64::MAX)).collect())
                }
                _ => Loaded::Whole(dataset.read_i64()?),
            })
        });
        read.map_err(|why| damaged(&self.source, &place, &why))
    }
}

/// Runs the decoder; one that gives up on a damaged file by a panic is an error like any other.
fn guarded<T>(work: impl FnOnce() -> std::result::Result<T, hdf5_pure::Error>) -> std::result::Result<T, String> {
    match unwind::caught(work) {
        Some(done) => done.map_err(|e| e.to_string()),
        None => Err("the decoder gave up on its content".to_string()),
    }
}

fn damaged(source: &str, place: &str, why: &str) -> Error {
    let why = why.lines().next().unwrap_or_default();
    Error::new(ErrorKind::Format, source, format!("is damaged, truncated, or not read: {why}"))
        .at(place)
        .hint("copy the file again; in MATLAB, save('log.mat', 't', 'gyro', '-v7') writes the older format")
}
