//! Rows of results as Parquet or CSV; the polars types stay in this file. What is not known is null, or an empty cell.

use super::source::{Kind, Record};
use crate::error::{Error, ErrorKind, Result};
use crate::files::{OutputFile, parquet};
use polars::prelude::{
    BooleanChunked, Column, DataFrame, Float64Chunked, Int64Chunked, IntoColumn, NewChunkedArray, PolarsResult, Series,
    StringChunked,
};
use serde_json::{Map, Value};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// How results are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    /// `.parquet`
    Parquet,
    /// `.csv`
    Csv,
}

impl Format {
    /// The format that the name of `path` asks for.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for another ending.
    pub(crate) fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        match ending.as_str() {
            "parquet" => Ok(Self::Parquet),
            "csv" => Ok(Self::Csv),
            _ => Err(Error::new(ErrorKind::Usage, path.display(), "results cannot be written with this ending")
                .hint("call the file .parquet or .csv; --json FILE writes the rows as JSON")),
        }
    }
}

/// Names of the columns of the table `path`.
///
/// # Errors
/// [`ErrorKind::Io`], or [`ErrorKind::Format`] for a file that is no table.
pub(crate) fn columns(path: &Path) -> Result<Vec<String>> {
    let format = Format::of(path)?;
    let file = File::open(path).map_err(|e| Error::io(path, &e))?;
    let no_table = |why: &str| Error::new(ErrorKind::Format, path.display(), format!("is no table of results: {why}"));
    match format {
        Format::Parquet => {
            let contents = parquet::Contents::of(&file).map_err(|damage| no_table(&damage.why).at(damage.place))?;
            Ok(contents.schema.iter_names().map(|name| name.to_string()).collect())
        }
        Format::Csv => {
            let mut reader = csv::Reader::from_reader(BufReader::new(file));
            let names = reader.headers().map_err(|e| no_table(&e.to_string()))?;
            Ok(names.iter().map(Into::into).collect())
        }
    }
}

/// Whether rows of this kind have the columns `names`.
#[must_use]
pub(crate) fn are<R: Record>(names: &[String]) -> bool {
    check_names::<R>(names.iter().map(String::as_str)).is_ok()
}

/// Writes `rows` to `path`, whole or not at all.
///
/// # Errors
/// [`ErrorKind::Usage`] for an ending that is not known; [`ErrorKind::Io`] if the place cannot be written.
pub(crate) fn write<R: Record>(path: &Path, rows: &[R]) -> Result<()> {
    let format = Format::of(path)?;
    let mut file = OutputFile::claim(path)?;
    let tables: Vec<_> =
        rows.iter().map(object).collect::<std::result::Result<_, _>>().map_err(|why| cannot(path, &why))?;
    let names = names::<R>().map_err(|why| cannot(path, &why))?;
    match format {
        Format::Parquet => frame::<R>(&names, &tables)
            .and_then(|mut frame| parquet::write(&mut frame, file.file()))
            .map_err(|e| cannot(path, &e.to_string()))?,
        Format::Csv => {
            let text = csv_text(&names, &tables).map_err(|e| cannot(path, &e.to_string()))?;
            file.write_all(&text)?;
        }
    }
    file.commit()
}

/// Reads the rows that [`write()`] wrote.
///
/// # Errors
/// [`ErrorKind::Io`], or [`ErrorKind::Format`] for a file that is damaged or holds something else.
pub(crate) fn read<R: Record>(path: &Path) -> Result<Vec<R>> {
    let format = Format::of(path)?;
    let file = File::open(path).map_err(|e| Error::io(path, &e))?;
    let other = |why: &str| {
        Error::new(ErrorKind::Format, path.display(), format!("is not a file of results of this version: {why}"))
            .hint("name another file with --results, or begin anew without --resume")
    };
    let first_line = |text: String| text.lines().next().unwrap_or_default().to_string();
    let tables = match format {
        Format::Parquet => {
            let damaged = |damage: parquet::Damage| other(&format!("it is damaged: {}", damage.why)).at(damage.place);
            let contents = parquet::Contents::of(&file).map_err(damaged)?;
            // of a table without rows the schema alone has the columns
            check_names::<R>(contents.schema.iter_names().map(|n| n.as_str())).map_err(|why| other(&why))?;
            let frame = contents.frame(&file).map_err(damaged)?;
            from_frame::<R>(&frame).map_err(|e| other(&first_line(e.to_string())))?
        }
        Format::Csv => from_csv::<R>(BufReader::new(file)).map_err(|why| other(&why))?,
    };
    let row = |(at, table): (usize, Map<String, Value>)| {
        serde_json::from_value(Value::Object(table)).map_err(|e| other(&e.to_string()).at(format!("row {}", at + 1)))
    };
    tables.into_iter().enumerate().map(row).collect()
}

fn cannot(path: &Path, why: &str) -> Error {
    Error::new(ErrorKind::Io, path.display(), format!("cannot be written: {why}")).hint("check the disk")
}

/// The row as an object, keys in the order of the fields.
fn object<R: Record>(row: &R) -> std::result::Result<Map<String, Value>, String> {
    match serde_json::to_value(row) {
        Ok(Value::Object(map)) => Ok(map),
        Ok(_) => Err("a row is no object".into()),
        Err(e) => Err(e.to_string()),
    }
}

/// Names of the columns, in their order.
fn names<R: Record>() -> std::result::Result<Vec<String>, String> {
    Ok(object(&R::default())?.into_iter().map(|(name, _)| name).collect())
}

/// Refuses a table of other columns.
fn check_names<'a, R: Record>(found: impl Iterator<Item = &'a str>) -> std::result::Result<(), String> {
    let wanted = names::<R>()?;
    let found: Vec<&str> = found.collect();
    if let Some(other) = found.iter().find(|name| !wanted.iter().any(|w| w == *name)) {
        return Err(format!("no column of `gyroid {}` is called {other:?}", R::COMMAND));
    }
    match wanted.iter().find(|w| !found.contains(&w.as_str())) {
        Some(missing) => Err(format!("the column {missing:?} of `gyroid {}` is missing", R::COMMAND)),
        None => Ok(()),
    }
}

fn frame<R: Record>(names: &[String], tables: &[Map<String, Value>]) -> PolarsResult<DataFrame> {
    let column = |name: &String| -> Column {
        let cells = tables.iter().map(|t| t.get(name).unwrap_or(&Value::Null));
        let name_ = name.as_str().into();
        match R::kind(name) {
            Kind::Text => StringChunked::from_iter_options(name_, cells.map(Value::as_str)).into_column(),
            Kind::Flag => BooleanChunked::from_iter_options(name_, cells.map(Value::as_bool)).into_column(),
            Kind::Whole => Int64Chunked::from_iter_options(name_, cells.map(Value::as_i64)).into_column(),
            Kind::Number => Float64Chunked::from_iter_options(name_, cells.map(Value::as_f64)).into_column(),
        }
    };
    DataFrame::new(tables.len(), names.iter().map(column).collect())
}

fn from_frame<R: Record>(frame: &DataFrame) -> PolarsResult<Vec<Map<String, Value>>> {
    let mut tables = vec![Map::new(); frame.height()];
    for column in frame.columns() {
        let series: &Series = column.as_materialized_series();
        let name = series.name().to_string();
        let cells: Vec<Value> = match R::kind(&name) {
            Kind::Text => series.str()?.iter().map(Value::from).collect(),
            Kind::Flag => series.bool()?.iter().map(Value::from).collect(),
            Kind::Whole => series.i64()?.iter().map(Value::from).collect(),
            Kind::Number => series.f64()?.iter().map(Value::from).collect(),
        };
        for (table, cell) in tables.iter_mut().zip(cells) {
            table.insert(name.clone(), cell);
        }
    }
    Ok(tables)
}

fn csv_text(names: &[String], tables: &[Map<String, Value>]) -> std::result::Result<Vec<u8>, String> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(names).map_err(|e| e.to_string())?;
    for table in tables {
        let cell = |name: &String| match table.get(name) {
            None | Some(Value::Null) => String::new(),
            Some(Value::String(text)) => text.clone(),
            // the shortest digits that read back as the same number
            Some(other) => other.to_string(),
        };
        out.write_record(names.iter().map(cell)).map_err(|e| e.to_string())?;
    }
    out.into_inner().map_err(|e| e.to_string())
}

fn from_csv<R: Record>(file: impl std::io::Read) -> std::result::Result<Vec<Map<String, Value>>, String> {
    let mut reader = csv::Reader::from_reader(file);
    let names = reader.headers().map_err(|e| e.to_string())?.clone();
    check_names::<R>(names.iter())?;
    let mut tables = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| e.to_string())?;
        let mut table = Map::new();
        for (name, cell) in names.iter().zip(&record) {
            table.insert(name.to_string(), parsed::<R>(name, cell)?);
        }
        tables.push(table);
    }
    Ok(tables)
}

fn parsed<R: Record>(name: &str, cell: &str) -> std::result::Result<Value, String> {
    let bad = || format!("{cell:?} in column {name}");
    Ok(match R::kind(name) {
        // these always stand there, if only as an empty text
        Kind::Text if cell.is_empty() && !matches!(name, "path" | "axis" | "sha256" | "gyroid_version" | "options") => {
            Value::Null
        }
        Kind::Text => Value::from(cell),
        _ if cell.is_empty() => Value::Null,
        Kind::Flag => Value::from(cell.parse::<bool>().map_err(|_| bad())?),
        Kind::Whole => Value::from(cell.parse::<i64>().map_err(|_| bad())?),
        Kind::Number => Value::from(cell.parse::<f64>().map_err(|_| bad())?),
    })
}
