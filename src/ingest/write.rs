//! Logs as files: `t_s` first, then the channels; missing values are null. Whole or not at all.

use super::assemble::drive::{TIME, check_names};
use crate::error::{Error, ErrorKind, Result};
use crate::files::{OutputFile, memory, parquet};
use crate::progress;
use crate::signal::Log;
use flate2::{Compression, write::GzEncoder};
use polars::prelude::{
    Column, DataFrame, Float32Chunked, Float64Chunked, IntoColumn, NamedFrom, NewChunkedArray, PolarsResult, Series,
};
use std::io::{self, BufWriter, Write};
use std::path::Path;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Target {
    Parquet,
    Csv,
    GzippedCsv,
    /// A place in memory, for [`held`](super::held).
    Memory,
}

/// A claimed place for a log.
#[derive(Debug)]
pub struct LogWriter {
    target: Target,
    file: OutputFile,
}

impl LogWriter {
    /// Claims `path` before the work begins; its extension (`.parquet`, `.csv`, `.csv.gz`) chooses the format.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for another extension; [`ErrorKind::Io`] if the place cannot be written.
    pub fn claim(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
        let target = if memory::is_place(path) {
            Target::Memory
        } else if name.ends_with(".parquet") {
            Target::Parquet
        } else if name.ends_with(".csv.gz") {
            Target::GzippedCsv
        } else if name.ends_with(".csv") {
            Target::Csv
        } else {
            return Err(Error::new(ErrorKind::Usage, path.display(), "a log cannot be written with this extension")
                .hint("call it .parquet, .csv or .csv.gz"));
        };
        Ok(Self { target, file: OutputFile::claim(path)? })
    }

    /// Writes `log` and puts the file in its place.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the disk refuses; [`ErrorKind::Column`] for a channel that is called `t_s`.
    pub fn write(mut self, log: &Log) -> Result<()> {
        check_names(log)?;
        let path = self.file.target().to_path_buf();
        let fail = |e: &io::Error| Error::io(&path, e);
        match self.target {
            Target::Memory => {
                memory::put(&path, log.clone());
                return Ok(());
            }
            Target::Parquet => frame(log)
                .and_then(|mut frame| parquet::write(&mut frame, self.file.file()))
                .map_err(|e| Error::new(ErrorKind::Io, path.display(), e.to_string()).hint("check the disk"))?,
            Target::Csv => csv(log, BufWriter::new(self.file.file())).map_err(|e| fail(&e)).map(drop)?,
            Target::GzippedCsv => {
                let packer = GzEncoder::new(BufWriter::new(self.file.file()), Compression::default());
                csv(log, packer).and_then(|packer| packer.finish()?.flush()).map_err(|e| fail(&e))?;
            }
        }
        self.file.commit()
    }
}

/// Writes `log` to `path`; see [`LogWriter`], which claims the place before the log is made.
///
/// # Errors
/// As [`LogWriter::claim`] and [`LogWriter::write`].
pub fn write_log(path: impl AsRef<Path>, log: &Log) -> Result<()> {
    LogWriter::claim(path)?.write(log)
}

fn csv<W: Write>(log: &Log, mut out: W) -> io::Result<W> {
    let mut header = csv::WriterBuilder::new().from_writer(Vec::new());
    header.write_record(std::iter::once(TIME).chain(log.channels.iter().map(|c| c.name.as_str())))?;
    out.write_all(&header.into_inner().map_err(|e| io::Error::other(e.to_string()))?)?;
    for i in 0..log.len() {
        progress::tell(i, log.len());
        write!(out, "{}", log.time.at(i))?;
        for channel in &log.channels {
            let value = channel.values[i];
            // the shortest digits that read back as the same number
            if value.is_nan() { out.write_all(b",")? } else { write!(out, ",{value}")? }
        }
        out.write_all(b"\n")?;
    }
    out.flush()?;
    Ok(out)
}

fn frame(log: &Log) -> PolarsResult<DataFrame> {
    let mut columns: Vec<Column> = vec![Series::new(TIME.into(), log.time.to_vec()).into_column()];
    for channel in &log.channels {
        let name = channel.name.as_str().into();
        let there = |v: &f64| (!v.is_nan()).then_some(*v);
        // in half the space where nothing is lost, as sensors are logged
        let single = channel.values.iter().filter_map(there).all(|v| f64::from(v as f32) == v);
        let values = channel.values.iter().map(there);
        columns.push(match single {
            true => Float32Chunked::from_iter_options(name, values.map(|v| v.map(|v| v as f32))).into_column(),
            false => Float64Chunked::from_iter_options(name, values).into_column(),
        });
    }
    DataFrame::new(log.len(), columns)
}
