//! Floor 2: logs from and to files (stand-in with canonical names only).

use crate::error::{Error, ErrorKind, Result};
use crate::files::OutputFile;
use crate::signal::{Log, TimeAxis};
use polars::prelude::{
    Column, DataFrame, DataType, NamedFrom, ParquetCompression, ParquetReader, ParquetWriter, SerReader, Series,
};
use std::fs::File;
use std::path::Path;

/// Reads a CSV or Parquet log with canonical channel names and `t_s`.
///
/// # Errors
/// [`ErrorKind::Io`] or [`ErrorKind::Format`].
pub fn read_log(path: &Path) -> Result<Log> {
    let name = path.display().to_string();
    let bad = |e: &dyn std::fmt::Display| Error::new(ErrorKind::Format, &name, e);
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    if is_parquet(path) {
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        let frame = ParquetReader::new(file).finish().map_err(|e| bad(&e))?;
        for column in frame.columns() {
            let cast = column.cast(&DataType::Float64).map_err(|e| bad(&e))?;
            let values = cast.f64().map_err(|e| bad(&e))?.iter().map(|v| v.unwrap_or(f64::NAN)).collect();
            columns.push((column.name().to_string(), values));
        }
    } else {
        let mut reader = csv::Reader::from_path(path).map_err(|e| bad(&e))?;
        for name in reader.headers().map_err(|e| bad(&e))? {
            columns.push((name.to_string(), Vec::new()));
        }
        for record in reader.records() {
            for (field, column) in record.map_err(|e| bad(&e))?.iter().zip(&mut columns) {
                column.1.push(if field.is_empty() { f64::NAN } else { field.parse().map_err(|e| bad(&e))? });
            }
        }
    }
    let at = columns.iter().position(|c| c.0 == "t_s").ok_or_else(|| bad(&"no column t_s"))?;
    let mut log = Log::new(name.clone(), TimeAxis::Explicit(columns.remove(at).1).compact(1e-6));
    for (name, values) in columns {
        log.push(name, values)?;
    }
    Ok(log)
}

/// Writes a log as CSV or Parquet, by extension.
///
/// # Errors
/// [`ErrorKind::Io`] or [`ErrorKind::Format`].
pub fn write_log(path: &Path, log: &Log) -> Result<()> {
    let mut out = OutputFile::claim(path)?;
    let name = path.display().to_string();
    let bad = |e: &dyn std::fmt::Display| Error::new(ErrorKind::Format, &name, e);
    if is_parquet(path) {
        let mut series: Vec<Column> = vec![Series::new("t_s".into(), log.time.to_vec()).into()];
        for c in &log.channels {
            let values: Vec<Option<f64>> = c.values.iter().map(|v| (!v.is_nan()).then_some(*v)).collect();
            series.push(Series::new(c.name.as_str().into(), values).into());
        }
        let mut frame = DataFrame::new(log.len(), series).map_err(|e| bad(&e))?;
        ParquetWriter::new(out.file())
            .with_compression(ParquetCompression::Uncompressed)
            .finish(&mut frame)
            .map_err(|e| bad(&e))?;
    } else {
        let header: Vec<_> = std::iter::once("t_s").chain(log.channels.iter().map(|c| c.name.as_str())).collect();
        let mut text = header.join(",") + "\n";
        for i in 0..log.len() {
            let values = log.channels.iter().map(|c| c.values[i]);
            let row: Vec<_> = std::iter::once(log.time.at(i))
                .chain(values)
                .map(|v| if v.is_nan() { String::new() } else { v.to_string() })
                .collect();
            text += &(row.join(",") + "\n");
        }
        out.write_all(text.as_bytes())?;
    }
    out.commit()
}

fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet"))
}
