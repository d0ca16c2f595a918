//! Parquet: data frames out, columns in.

mod checks;
mod write;

pub(crate) use write::write;
#[cfg(test)]
pub(crate) use write::write_as;

use crate::unwind;
use polars::prelude::{ArrowField, ArrowSchema, DataFrame, IntoColumn, PolarsError, PolarsResult, Series};
use polars_arrow::array::Array;
use polars_buffer::Buffer;
use polars_parquet::parquet::metadata::ColumnChunkMetadata;
use polars_parquet::read::{
    BasicDecompressor, FileMetadata, Filter, PageReader, RowGroupMetadata, column_iter_to_arrays, infer_schema,
    read_metadata,
};
use polars_utils::mmap::MMapSemaphore;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Cursor};
use std::ops::Range;

/// A fault of a file, with its place.
#[derive(Debug)]
pub(crate) struct Damage {
    /// Row group and column, or the footer.
    pub place: String,
    /// One line.
    pub why: String,
}

impl Damage {
    pub(crate) fn new(place: impl Into<String>, why: impl ToString) -> Self {
        let why = why.to_string();
        Self { place: place.into(), why: why.lines().next().unwrap_or_default().to_string() }
    }
}

/// Runs a decoder of polars on this thread. It gives up on some damaged files by a panic.
pub(crate) fn decoded<T>(place: &str, work: impl FnOnce() -> PolarsResult<T>) -> Result<T, Damage> {
    match unwind::caught(work) {
        Some(done) => done.map_err(|e| Damage::new(place, e)),
        None => Err(Damage::new(place, "the decoder gave up on its content")),
    }
}

/// Metadata and schema of a Parquet file.
pub(crate) struct Contents {
    pub metadata: FileMetadata,
    pub schema: ArrowSchema,
    /// Whether the footer has a checksum, and so each page.
    checked: bool,
}

impl Contents {
    pub(crate) fn of(file: &File) -> Result<Self, Damage> {
        decoded("footer", || {
            let checksum = checks::footer(&mut &*file)?;
            if checksum.as_ref().is_some_and(|footer| !footer.fits) {
                return Err(changed("it does not fit its checksum: its bytes were changed".into()));
            }
            let metadata = read_metadata(&mut &*file)?;
            let chunks = metadata.row_groups.iter().flat_map(|group| group.parquet_columns());
            let end = chunks.map(|chunk| chunk.byte_range().end).max();
            if let (Some(footer), Some(end)) = (&checksum, end)
                && footer.at != end
            {
                return Err(changed(format!("bytes were put in or left out before it: it should begin at byte {end}")));
            }
            let schema = infer_schema(&metadata)?;
            Ok(Self { metadata, schema, checked: checksum.is_some() })
        })
    }

    /// The field of a column.
    fn field(&self, column: usize) -> Result<&ArrowField, Damage> {
        let field = self.schema.get_at_index(column).map(|(_, field)| field);
        field.ok_or_else(|| Damage::new("footer", format!("it lacks column {}", column + 1)))
    }

    /// `rows` of `column`, one array or more for each row group; decoded on all cores.
    pub(crate) fn arrays(
        &self,
        file: &File,
        column: usize,
        rows: &Range<usize>,
    ) -> Result<Vec<Box<dyn Array>>, Damage> {
        let field = self.field(column)?;
        let mut from = 0;
        let mut parts = Vec::new();
        for (ordinal, group) in self.metadata.row_groups.iter().enumerate() {
            let to = from + group.num_rows();
            let part = rows.start.max(from)..rows.end.min(to);
            if !part.is_empty() {
                parts.push((place(ordinal, &field.name), group, part.start - from..part.end - from));
            }
            from = to;
        }
        let decode = |(place, group, part): (String, &RowGroupMetadata, Range<usize>)| {
            decoded(&place, || self.part(file, field, group, part))
        };
        let arrays: Result<Vec<_>, Damage> = parts.into_par_iter().map(decode).collect();
        Ok(arrays?.into_iter().flatten().collect())
    }

    fn part(
        &self,
        file: &File,
        field: &ArrowField,
        group: &RowGroupMetadata,
        part: Range<usize>,
    ) -> PolarsResult<Vec<Box<dyn Array>>> {
        let lacking = || PolarsError::ColumnNotFound("it is not there".into());
        let whole = part.len() == group.num_rows();
        let (mut pages, mut types) = (Vec::new(), Vec::new());
        for chunk in group.columns_under_root_iter(&field.name).ok_or_else(lacking)? {
            let bytes = bytes(file, chunk, whole)?;
            // in nested columns values are not rows
            let checked = if chunk.descriptor().descriptor.max_rep_level == 0 { &part } else { &(0..usize::MAX) };
            self.check(chunk, &bytes, checked).map_err(changed)?;
            let reader = PageReader::new(Cursor::new(bytes), chunk, Vec::new(), usize::MAX);
            pages.push(BasicDecompressor::new(reader, Vec::new()));
            types.push(&chunk.descriptor().descriptor.primitive_type);
        }
        Ok(column_iter_to_arrays(pages, types, field.clone(), Some(Filter::new_ranged(part.start, part.end)))?.0)
    }

    /// Checks the pages of `chunk` that hold any of its `rows`.
    pub(crate) fn check(&self, chunk: &ColumnChunkMetadata, bytes: &[u8], rows: &Range<usize>) -> Result<(), String> {
        checks::pages(chunk, bytes, rows, self.checked)
    }

    /// All columns, all rows.
    pub(crate) fn frame(&self, file: &File) -> Result<DataFrame, Damage> {
        let rows = 0..self.metadata.num_rows;
        if rows.is_empty() {
            // no row group holds cells that a column could be made of
            return Ok(DataFrame::empty());
        }
        let column = |i: usize| {
            let (field, arrays) = (self.field(i)?, self.arrays(file, i, &rows)?);
            decoded(&format!("column {:?}", field.name), || Ok(Series::try_from((field, arrays))?.into_column()))
        };
        let columns: Result<Vec<_>, Damage> = (0..self.schema.len()).map(column).collect();
        DataFrame::new(rows.end, columns?).map_err(|e| Damage::new("footer", e))
    }
}

/// Where a column lies in a row group, for messages.
pub(crate) fn place(row_group: usize, column: &str) -> String {
    format!("row group {}, column {column:?}", row_group + 1)
}

fn changed(why: String) -> PolarsError {
    PolarsError::ComputeError(why.into())
}

/// The bytes of `chunk`. All of them are read where all are wanted, for others may cut the file off in the meantime. Of a
/// larger one they are mapped into memory, and those that were read are given back.
fn bytes(file: &File, chunk: &ColumnChunkMetadata, whole: bool) -> PolarsResult<Buffer<u8>> {
    let Range { start, end } = chunk.byte_range();
    if end > file.metadata()?.len() {
        return Err(changed(format!("it should end at byte {end}, behind the end of the file")));
    }
    if whole && cfg!(unix) {
        let mut bytes = vec![0; (end - start) as usize];
        read_at(file, &mut bytes, start)?;
        return Ok(bytes.into());
    }
    Ok(Buffer::from_owner(MMapSemaphore::new_from_file(file)?).sliced(start as usize..end as usize))
}

/// Fills `buffer` with what lies at byte `at`.
#[cfg(unix)]
pub(crate) fn read_at(file: &File, buffer: &mut [u8], at: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, at)
}

/// Others would move the place at which the file is read.
#[cfg(not(unix))]
pub(crate) fn read_at(_: &File, _: &mut [u8], _: u64) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}
