//! Parquet, by polars. Its types stay in this file.

use super::format::{About, Batch, Column, ColumnFacts, Facts, Format, Opened, Source, Take};
use super::input::Input;
use super::table::{Cells, Head, Kind};
use crate::error::{Error, ErrorKind, Result};
use polars::prelude::{
    ArrowDataType, ArrowTimeUnit, DataType, ParquetReader, PolarsError, PolarsResult, SerReader, Series,
};
use std::fs::File;
use std::path::PathBuf;

/// Files that begin with Parquet's magic number.
pub(super) const FORMAT: Format = Format {
    name: "Parquet",
    accepts: |head| head.starts_with(b"PAR1"),
    open: |input| Ok(Opened::Table(Box::new(Parquet::open(input)?))),
};

struct Parquet {
    path: PathBuf,
    file: File,
    sha256: String,
    heads: Vec<Head>,
    types: Vec<ArrowDataType>,
}

impl Parquet {
    fn open(input: Input) -> Result<Self> {
        let path = input.path.clone();
        let (file, sha256) = input.into_file()?;
        let handle = file.try_clone().map_err(|e| Error::io(&path, &e))?;
        let schema = guarded(|| ParquetReader::new(handle).schema()).map_err(|why| damaged(&path, &why))?;
        let mut heads = Vec::new();
        let mut types = Vec::new();
        for field in schema.iter_values() {
            let kind = kind_of(&field.dtype);
            let type_name = format!("{:?}", field.dtype);
            heads.push(Head { name: field.name.to_string(), kind, type_name, unit: None, role: None });
            types.push(field.dtype.clone());
        }
        Ok(Self { path, file, sha256, heads, types })
    }
}

impl Source for Parquet {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { path, file, sha256, heads, types } = *self;
        let columns: Vec<usize> = (0..heads.len()).filter(|&i| wanted[i] && heads[i].kind != Kind::Other).collect();
        let projection = columns.clone();
        let (rows, filled) = guarded(move || {
            let mut reader = ParquetReader::new(file);
            let rows = reader.num_rows()?;
            if projection.is_empty() {
                return Ok((rows, Vec::new()));
            }
            let frame = reader.with_projection(Some(projection.clone())).finish()?;
            let mut filled = Vec::new();
            for (column, &index) in frame.columns().iter().zip(&projection) {
                filled.push(cells_of(column.as_materialized_series(), &types[index])?);
            }
            Ok((rows, filled))
        })
        .map_err(|why| damaged(&path, &why))?;
        if rows == 0 {
            return Err(
                Error::new(ErrorKind::TooShort, path.display(), "has columns and no rows").mend("record the log again")
            );
        }
        let mut batch = Batch { rows, columns: vec![Column::default(); heads.len()] };
        let mut facts = vec![ColumnFacts::default(); heads.len()];
        for (index, cells) in columns.into_iter().zip(filled) {
            facts[index].resolution = cells.resolution;
            batch.columns[index] = Column { origin: cells.origin, values: cells.values };
        }
        take(batch)?;
        let about = About { source: path.display().to_string(), format: FORMAT.name, sha256, notes: Vec::new() };
        Ok(about.facts(None, facts, Vec::new()))
    }
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

/// A column as floats; integers and dates less their first value, so that nanoseconds keep all their digits.
fn cells_of(series: &Series, data_type: &ArrowDataType) -> PolarsResult<Cells> {
    use ArrowDataType as A;
    let mut cells = Cells::default();
    match data_type {
        A::Int64 | A::UInt64 | A::Timestamp(..) => {
            let physical = series.to_physical_repr();
            let whole = physical.cast(&DataType::Int64)?;
            let whole = whole.i64()?;
            let factor = match data_type {
                A::Timestamp(ArrowTimeUnit::Second, _) => 1_000_000_000,
                A::Timestamp(ArrowTimeUnit::Millisecond, _) => 1_000_000,
                A::Timestamp(ArrowTimeUnit::Microsecond, _) => 1_000,
                _ => 1,
            };
            let first = whole.iter().flatten().next().unwrap_or(0);
            cells.origin = first.saturating_mul(factor);
            let offset = |v: i64| (i128::from(v) - i128::from(first)) as f64 * factor as f64;
            cells.values = whole.iter().map(|v| v.map_or(f64::NAN, offset)).collect();
            cells.resolution = factor as f64;
        }
        _ => {
            let float = series.cast(&DataType::Float64)?;
            cells.values = float.f64()?.iter().map(|v| v.unwrap_or(f64::NAN)).collect();
            cells.resolution = match data_type {
                A::Float64 | A::Null => 0.0,
                // half a unit in the last place of the largest value
                A::Float32 => {
                    let largest = cells.values.iter().filter(|v| v.is_finite()).fold(0.0f64, |m, v| m.max(v.abs()));
                    largest * f64::from(f32::EPSILON)
                }
                _ => 1.0,
            };
        }
    }
    Ok(cells)
}

/// Runs the decoder; one that gives up on a damaged file by a panic is an error like any other.
fn guarded<T>(work: impl FnOnce() -> PolarsResult<T>) -> std::result::Result<T, String> {
    match std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)) {
        Ok(done) => done.map_err(|e: PolarsError| e.to_string()),
        Err(_) => Err("the decoder gave up on its content".to_string()),
    }
}

fn damaged(path: &std::path::Path, why: &str) -> Error {
    let why = why.lines().next().unwrap_or_default();
    Error::new(ErrorKind::Format, path.display(), format!("the Parquet file is damaged or truncated: {why}"))
        .mend("copy or write the file again; Parquet has its index at the end and cannot be read in part")
}
