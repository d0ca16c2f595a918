//! Parquet as a log.

use super::bytes::Unpacked;
use super::format::{Format, Opened};
use super::head::{Head, Kind};
use super::input::{Input, PendingHash};
use super::parquet_plain;
use super::source::{About, Batch, Column, ColumnFacts, Facts, Source, Take};
use crate::error::{Error, ErrorKind, Result};
use crate::files::parquet::{Contents, Damage, decoded};
use polars::prelude::{ArrowDataType, ArrowTimeUnit, PolarsError, PolarsResult};
use polars_arrow::array::{Array, PrimitiveArray};
use polars_arrow::types::NativeType;
use rayon::prelude::*;
use std::fs::File;
use std::path::PathBuf;

/// Files that begin with Parquet's magic number.
pub(crate) const FORMAT: Format = Format {
    name: "Parquet",
    accepts: |head| head.starts_with(b"PAR1"),
    open: |input| Ok(Opened::Table(Box::new(Parquet::open(input)?))),
};

struct Parquet {
    path: PathBuf,
    file: File,
    hash: PendingHash,
    contents: Contents,
    heads: Vec<Head>,
    /// Whether all rows may be handed over at once.
    held: bool,
}

/// Rows that are decoded at once, as far as the file's row groups allow; no row group needs to be held whole.
const ROWS_AT_ONCE: usize = 1 << 20;

impl Parquet {
    fn open(input: Input) -> Result<Self> {
        let path = input.path.clone();
        let (file, hash) = input.into_file_at_once()?;
        let contents = Contents::of(&file).map_err(|damage| damaged(&path, damage))?;
        let mut heads = Vec::new();
        for field in contents.schema.iter_values() {
            let kind = kind_of(&field.dtype);
            let type_name = format!("{:?}", field.dtype);
            heads.push(Head { name: field.name.to_string(), kind, type_name, unit: None, role: None });
        }
        Ok(Self { path, file, hash, contents, heads, held: false })
    }
}

impl Source for Parquet {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn rows(&self) -> Option<u64> {
        Some(self.contents.metadata.num_rows as u64)
    }

    fn hold(&mut self) {
        self.held = true;
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { path, file, hash, contents, heads, held } = *self;
        let rows = contents.metadata.num_rows;
        if rows == 0 {
            return Err(
                Error::new(ErrorKind::TooShort, path.display(), "has columns and no rows").hint("record the log again")
            );
        }
        let columns: Vec<usize> = (0..heads.len()).filter(|&i| wanted[i] && heads[i].kind != Kind::Other).collect();
        accounted(&file, &contents, &columns.iter().map(|&i| heads[i].name.as_str()).collect::<Vec<_>>())
            .map_err(|damage| damaged(&path, damage))?;
        let types: Vec<&ArrowDataType> = contents.schema.iter_values().map(|field| &field.dtype).collect();
        let mut filling: Vec<Filling> =
            columns.iter().map(|&i| Filling { data_type: types[i], origin: None, largest: 0.0 }).collect();
        let floats = |i: &usize| matches!(types[*i], ArrowDataType::Float32 | ArrowDataType::Float64);
        let plain = if held && columns.iter().all(floats) {
            let names: Vec<&str> = columns.iter().map(|&i| heads[i].name.as_str()).collect();
            // what is damaged is told by the decoder below
            parquet_plain::read(&file, &contents, &names)
        } else {
            None
        };
        let plain = plain.map(|plain| {
            let mut batch = Batch { rows, columns: vec![Column::default(); heads.len()] };
            for ((&index, filling), floats) in columns.iter().zip(&mut filling).zip(plain) {
                filling.largest = floats.largest;
                batch.columns[index] = Column { origin: 0, values: floats.values };
            }
            batch
        });
        let groups: Vec<usize> = contents.metadata.row_groups.iter().map(|g| g.num_rows()).collect();
        let mut decode = |(from, count): (usize, usize)| -> Result<Batch> {
            let cells = |(&column, filling): (&usize, &mut Filling)| {
                let arrays = contents.arrays(&file, column, &(from..from + count))?;
                decoded(&format!("column {:?}", heads[column].name), || filling.cells(&arrays))
            };
            let decoded: std::result::Result<Vec<Vec<f64>>, Damage> =
                columns.par_iter().zip(&mut filling).map(cells).collect();
            let decoded = decoded.map_err(|damage| damaged(&path, damage))?;
            let mut batch = Batch { rows: count, columns: vec![Column::default(); heads.len()] };
            for ((&index, filling), values) in columns.iter().zip(&filling).zip(decoded) {
                batch.columns[index] =
                    Column { origin: filling.origin.unwrap_or(0).saturating_mul(filling.factor()), values };
            }
            Ok(batch)
        };
        match plain {
            Some(batch) => take(batch)?,
            // the next slice is decoded while one is taken, and no further ones
            None => std::thread::scope(|scope| {
                let (send, receive) = std::sync::mpsc::sync_channel(0);
                scope.spawn(move || {
                    for slice in slices(&groups) {
                        let batch = decode(slice);
                        let failed = batch.is_err();
                        // whoever takes them may have had enough
                        if send.send(batch).is_err() || failed {
                            break;
                        }
                    }
                });
                receive.into_iter().try_for_each(|batch| take(batch?))
            })?,
        }
        let mut facts = vec![ColumnFacts::default(); heads.len()];
        for (&index, filling) in columns.iter().zip(&filling) {
            facts[index].resolution = filling.resolution();
        }
        let about =
            About { source: path.display().to_string(), format: FORMAT.name, sha256: hash.hex()?, notes: Vec::new() };
        Ok(about.facts(None, facts, Vec::new()))
    }
}

/// Checks that the file may hold what its footer promises of the columns of these `names`: their numbers, and their pages.
fn accounted(file: &File, contents: &Contents, names: &[&str]) -> std::result::Result<(), Damage> {
    let bytes = file.metadata().map_err(|e| Damage::new("the file", e))?.len();
    let groups = &contents.metadata.row_groups;
    let sum = |all: &mut dyn Iterator<Item = u64>| all.fold(0, u64::saturating_add);
    let rows = sum(&mut groups.iter().map(|g| g.num_rows() as u64)).max(contents.metadata.num_rows as u64);
    let chunks =
        groups.iter().flat_map(|g| names.iter().filter_map(move |name| g.columns_under_root_iter(name)).flatten());
    let pages = sum(&mut chunks.map(|chunk| chunk.uncompressed_size().unsigned_abs()));
    let numbers = rows.saturating_mul((size_of::<f64>() * names.len().max(1)) as u64);
    if Unpacked::of(bytes).take(numbers.max(pages)) {
        return Ok(());
    }
    let why = format!("{rows} rows of {} columns in {bytes} bytes: {}", names.len(), Unpacked::BEYOND);
    Err(Damage::new("footer", why))
}

/// First row and number of rows of what is decoded at once: whole row groups, or parts of a large one.
fn slices(groups: &[usize]) -> Vec<(usize, usize)> {
    let mut out: Vec<(usize, usize)> = Vec::new();
    let mut from = 0;
    for &rows in groups {
        match out.last_mut() {
            Some((_, count)) if *count + rows <= ROWS_AT_ONCE => *count += rows,
            _ => {
                let parts = rows.div_ceil(4 * ROWS_AT_ONCE).max(1);
                let part = rows.div_ceil(parts);
                out.extend((0..parts).map(|i| (from + i * part, part.min(rows - i * part))).filter(|s| s.1 > 0));
            }
        }
        from += rows;
    }
    out
}

fn kind_of(data_type: &ArrowDataType) -> Kind {
    use ArrowDataType as A;
    match data_type {
        A::Int8 | A::Int16 | A::Int32 | A::Int64 | A::UInt8 | A::UInt16 | A::UInt32 | A::UInt64 => Kind::Number,
        A::Float32 | A::Float64 | A::Null => Kind::Number,
        A::Timestamp(..) => Kind::Instant,
        _ => Kind::Other,
    }
}

/// A column while it is read: integers and dates less their first value, so that nanoseconds keep all their digits.
struct Filling<'a> {
    data_type: &'a ArrowDataType,
    /// First value, before it is in nanoseconds.
    origin: Option<i64>,
    largest: f64,
}

impl Filling<'_> {
    /// Nanoseconds in a unit of a date; 1 for numbers.
    fn factor(&self) -> i64 {
        match self.data_type {
            ArrowDataType::Timestamp(ArrowTimeUnit::Second, _) => 1_000_000_000,
            ArrowDataType::Timestamp(ArrowTimeUnit::Millisecond, _) => 1_000_000,
            ArrowDataType::Timestamp(ArrowTimeUnit::Microsecond, _) => 1_000,
            _ => 1,
        }
    }

    fn whole(&self) -> bool {
        use ArrowDataType as A;
        matches!(self.data_type, A::Int64 | A::UInt64 | A::Timestamp(..))
    }

    /// The next cells as floats; NaN where there is none.
    fn cells(&mut self, arrays: &[Box<dyn Array>]) -> PolarsResult<Vec<f64>> {
        use ArrowDataType as A;
        let mut cells = Vec::with_capacity(arrays.iter().map(|a| a.len()).sum());
        for array in arrays {
            let array = array.as_ref();
            match self.data_type {
                A::Null => cells.resize(cells.len() + array.len(), f64::NAN),
                A::Int64 | A::Timestamp(..) => {
                    self.offsets(primitive(array)?.iter().map(|v: Option<&i64>| v.copied()), &mut cells);
                }
                A::UInt64 => self.offsets(
                    primitive(array)?.iter().map(|v: Option<&u64>| v.and_then(|v| i64::try_from(*v).ok())),
                    &mut cells,
                ),
                A::Int8 => extend::<i8>(&mut cells, array, f64::from)?,
                A::Int16 => extend::<i16>(&mut cells, array, f64::from)?,
                A::Int32 => extend::<i32>(&mut cells, array, f64::from)?,
                A::UInt8 => extend::<u8>(&mut cells, array, f64::from)?,
                A::UInt16 => extend::<u16>(&mut cells, array, f64::from)?,
                A::UInt32 => extend::<u32>(&mut cells, array, f64::from)?,
                A::Float32 => extend::<f32>(&mut cells, array, f64::from)?,
                _ => extend::<f64>(&mut cells, array, |v| v)?,
            }
        }
        if *self.data_type == A::Float32 {
            self.largest = cells.iter().filter(|v| v.is_finite()).fold(self.largest, |m, v| m.max(v.abs()));
        }
        Ok(cells)
    }

    /// Whole numbers less the first one of all.
    fn offsets(&mut self, whole: impl Iterator<Item = Option<i64>> + Clone, cells: &mut Vec<f64>) {
        if self.origin.is_none() {
            self.origin = whole.clone().flatten().next();
        }
        let (first, factor) = (self.origin.unwrap_or(0), self.factor() as f64);
        let offset = |v: i64| (i128::from(v) - i128::from(first)) as f64 * factor;
        cells.extend(whole.map(|v| v.map_or(f64::NAN, offset)));
    }

    /// Rounding of the values in their unit, 0 if unknown; valid once all were read.
    fn resolution(&self) -> f64 {
        match self.data_type {
            _ if self.whole() => self.factor() as f64,
            ArrowDataType::Float64 | ArrowDataType::Null => 0.0,
            // half a unit in the last place of the largest value
            ArrowDataType::Float32 => self.largest * f64::from(f32::EPSILON),
            _ => 1.0,
        }
    }
}

fn primitive<T: NativeType>(array: &dyn Array) -> PolarsResult<&PrimitiveArray<T>> {
    let other = || PolarsError::SchemaMismatch(format!("cells are {:?}", array.dtype()).into());
    array.as_any().downcast_ref().ok_or_else(other)
}

fn extend<T: NativeType>(cells: &mut Vec<f64>, array: &dyn Array, float: fn(T) -> f64) -> PolarsResult<()> {
    let array = primitive::<T>(array)?;
    match array.null_count() {
        0 => cells.extend(array.values_iter().copied().map(float)),
        _ => cells.extend(array.iter().map(|v| v.copied().map_or(f64::NAN, float))),
    }
    Ok(())
}

fn damaged(path: &std::path::Path, damage: Damage) -> Error {
    let found = format!("the Parquet file is damaged or truncated: {}", damage.why);
    Error::new(ErrorKind::Format, path.display(), found)
        .at(damage.place)
        .hint("copy or write the file again; Parquet has its index at the end and cannot be read in part")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_hold_whole_row_groups_and_parts_of_large_ones() {
        let m = ROWS_AT_ONCE;
        assert_eq!(slices(&[5]), [(0, 5)]);
        assert_eq!(slices(&[m / 2, m / 2, m / 2]), [(0, m), (m, m / 2)]);
        for groups in [vec![100 * m + 7, 3], vec![4 * m, 1, 0, 2 * m]] {
            let mut next = 0;
            for (from, count) in slices(&groups) {
                assert_eq!(from, next);
                assert!(count > 0 && count <= 4 * m);
                next += count;
            }
            assert_eq!(next, groups.iter().sum::<usize>());
        }
    }
}
