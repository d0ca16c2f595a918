//! Text tables: CSV, TSV and their kin, also packed by gzip.

use super::cell::{self, Cell};
use super::dialect::{self, Delimiter, Dialect};
use super::format::{BATCH_ROWS, Batch, Column, ColumnFacts, Facts, Format, Opened, Source, Take};
use super::input::{Input, broken_gzip};
use super::table::{BadCell, Head, Kind};
use crate::error::{Error, ErrorKind, Result};
use std::cell::Cell as Slot;
use std::io::{self, Read};
use std::path::PathBuf;
use std::rc::Rc;

/// Anything without the zero bytes that every binary format has in its first bytes.
pub(super) const FORMAT: Format = Format {
    name: "CSV or TSV (also gzipped)",
    accepts: |head| !head.contains(&0),
    open: |input| {
        let dialect = dialect::sniff(&input.head, input.head_is_all);
        if dialect.heads.is_empty() {
            return Err(Error::new(
                ErrorKind::TooShort,
                input.path.display(),
                "holds no table, only blank lines or comments",
            )
            .mend("record the log again"));
        }
        Ok(Opened::Table(Box::new(Text { path: input.path.clone(), input, dialect })))
    },
};

/// Values from this size on keep their whole part exactly: seconds since 1970 with nanoseconds need 61 bits.
const LARGE: f64 = 1e8;

struct Text {
    path: PathBuf,
    input: Input,
    dialect: Dialect,
}

impl Source for Text {
    fn heads(&self) -> &[Head] {
        &self.dialect.heads
    }

    /// By the length of the first lines.
    fn rows(&self) -> Option<u64> {
        if self.input.gzipped {
            return None;
        }
        let lines = self.input.head.iter().filter(|b| **b == b'\n').count() as u64;
        let bytes = std::fs::metadata(&self.path).ok().filter(std::fs::Metadata::is_file)?.len();
        (lines > 0).then(|| bytes / (self.input.head.len() as u64 / lines).max(1))
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { path, input, dialect } = *self;
        if !dialect.has_rows {
            let found = "has a header and no rows";
            return Err(Error::new(ErrorKind::TooShort, path.display(), found).mend("record the log again"));
        }
        if dialect.width != dialect.heads.len() {
            let found = format!("the header has {} names, the rows have {} fields", dialect.heads.len(), dialect.width);
            return Err(Error::new(ErrorKind::Format, path.display(), found)
                .at(format!("line {}", dialect.first_line))
                .mend("correct the header, or delete it: columns are then named column_1, column_2, ..."));
        }
        let gzipped = input.gzipped;
        let fail = |e: &io::Error| if gzipped { broken_gzip(&path, e) } else { Error::io(&path, e) };
        let (mut stream, hash) = input.into_stream();
        io::copy(&mut (&mut stream).take(dialect.skip as u64), &mut io::sink()).map_err(|e| fail(&e))?;
        let last = Rc::new(Slot::new(b'\n'));
        let stream = LastByte { inner: stream, last: last.clone() };
        let mut rows = match dialect.delimiter {
            Delimiter::Byte(b) => read_rows(stream, b, &dialect, wanted, &last, take),
            Delimiter::Blanks => read_rows(SingleBlanks::new(stream), b' ', &dialect, wanted, &last, take),
        }
        .map_err(|e| match e {
            RowError::Io(e) => fail(&e),
            RowError::Format(found, line) => Error::new(ErrorKind::Format, path.display(), found)
                .at(format!("line {line}"))
                .mend("correct or delete the line"),
            RowError::Taken(e) => e,
        })?;
        let mut notes = dialect.notes;
        notes.append(&mut rows.notes);
        let packed = if gzipped { ", gzip" } else { "" };
        Ok(Facts {
            source: path.display().to_string(),
            format: format!("text, fields between {}{packed}", dialect.delimiter.name()),
            sha256: hash.hex(),
            columns: rows.columns,
            first_line: rows.unbroken.then_some(dialect.first_line),
            notes,
        })
    }
}

enum RowError {
    Io(io::Error),
    Format(String, u64),
    /// Whoever takes the rows does not want them.
    Taken(Error),
}

struct Rows {
    columns: Vec<ColumnFacts>,
    unbroken: bool,
    notes: Vec<String>,
}

/// A column while it is read.
struct Filling {
    index: usize,
    instant: bool,
    started: bool,
    exact: bool,
    decimals: i32,
    significant: i32,
    largest: f64,
    column: Column,
    bad: Option<(BadCell, usize)>,
}

impl Filling {
    fn take(&mut self, field: &[u8], row: usize, comma: bool) {
        let value = if self.instant {
            match cell::instant_ns(field) {
                Some(ns) => {
                    self.start_at(ns);
                    Cell::Number(ns.wrapping_sub(self.column.origin) as f64)
                }
                None if cell::read(field, comma) == Cell::Missing => Cell::Missing,
                None => Cell::Words,
            }
        } else {
            match cell::read(field, comma) {
                Cell::Number(x) => Cell::Number(self.rebased(x, field, comma)),
                other => other,
            }
        };
        // digits are looked at now and then: they hardly change within a log
        if row < 256 || row.is_multiple_of(64) {
            let (decimals, significant) = cell::digits(field);
            self.decimals = self.decimals.max(decimals);
            self.significant = self.significant.max(significant);
        }
        self.column.values.push(match value {
            Cell::Number(x) => {
                self.largest = if x.is_finite() { self.largest.max(x.abs()) } else { self.largest };
                x
            }
            Cell::Missing => f64::NAN,
            Cell::Words => {
                let text = || String::from_utf8_lossy(field).chars().take(40).collect();
                let (first, count) = self.bad.take().unwrap_or_else(|| (BadCell { row, text: text() }, 0));
                self.bad = Some((first, count + 1));
                f64::NAN
            }
        });
    }

    fn start_at(&mut self, origin: i64) {
        if !self.exact {
            self.exact = true;
            self.column.origin = origin;
        }
    }

    fn rebased(&mut self, x: f64, field: &[u8], comma: bool) -> f64 {
        // only a column that starts large is rebased: the origin has to hold for all of its rows
        let first = !std::mem::replace(&mut self.started, true);
        if !(self.exact || first && x.abs() >= LARGE) {
            return x;
        }
        match cell::split(field, comma) {
            Some((whole, fraction)) => {
                self.start_at(whole);
                whole.wrapping_sub(self.column.origin) as f64 + fraction
            }
            None => x - self.column.origin as f64,
        }
    }

    /// Its rows since the last call.
    fn batch(&mut self) -> Column {
        Column { origin: self.column.origin, values: std::mem::take(&mut self.column.values) }
    }

    fn finish(self) -> (usize, ColumnFacts) {
        let resolution = if self.instant {
            0.0
        } else {
            let largest = self.largest + (self.column.origin as f64).abs();
            let leading = if largest > 0.0 { largest.log10().floor() as i32 + 1 } else { 0 };
            10f64.powi(-self.decimals).max(10f64.powi(leading - self.significant))
        };
        (self.index, ColumnFacts { resolution, bad: self.bad })
    }
}

fn read_rows(
    stream: impl Read,
    delimiter: u8,
    dialect: &Dialect,
    wanted: &[bool],
    last: &Slot<u8>,
    take: Take<'_>,
) -> std::result::Result<Rows, RowError> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .buffer_capacity(256 * 1024)
        .from_reader(stream);
    let mut columns: Vec<Filling> = (0..dialect.width)
        .filter(|&i| wanted[i] && dialect.heads[i].kind != Kind::Other)
        .map(|index| Filling {
            index,
            instant: dialect.heads[index].kind == Kind::Instant,
            started: false,
            exact: false,
            decimals: 0,
            significant: 0,
            largest: 0.0,
            column: Column::default(),
            bad: None,
        })
        .collect();
    let mut record = csv::ByteRecord::new();
    let (mut count, mut line, mut unbroken) = (0, 0, true);
    let mut hand_over = |columns: &mut [Filling], rows: usize| {
        let mut batch = Batch { rows, columns: vec![Column::default(); dialect.width] };
        columns.iter_mut().for_each(|c| batch.columns[c.index] = c.batch());
        take(batch).map_err(RowError::Taken)
    };
    let mut handed = 0;
    let mut notes = Vec::new();
    let mut short: Option<(usize, u64)> = None;
    while reader.read_byte_record(&mut record).map_err(|e| match e.into_kind() {
        csv::ErrorKind::Io(e) => RowError::Io(e),
        other => RowError::Format(format!("{other:?}"), dialect.first_line + line),
    })? {
        if let Some((fields, line)) = short {
            return Err(ragged(fields, dialect.width, line));
        }
        line = record.position().map_or(line, csv::Position::line);
        unbroken &= line == count as u64 + 1;
        let fields = record.len();
        if fields == 1 && record[0].trim_ascii().is_empty() {
            unbroken = false;
            continue; // a line of blanks
        }
        let trailing = fields == dialect.width + 1 && record[fields - 1].is_empty();
        if fields != dialect.width && !trailing {
            // judged when it is known whether the file ends here
            short = Some((fields, dialect.first_line + line - 1));
            continue;
        }
        for column in &mut columns {
            column.take(&record[column.index], count, dialect.comma);
        }
        count += 1;
        if count - handed == BATCH_ROWS {
            hand_over(&mut columns, BATCH_ROWS)?;
            handed = count;
        }
    }
    if let Some((fields, line)) = short {
        // no line end: the recorder was cut off in the middle of its last row
        if last.get() == b'\n' || fields > dialect.width {
            return Err(ragged(fields, dialect.width, line));
        }
        notes.push(format!("line {line}: the last row is cut off after {fields} fields and left out"));
    }
    hand_over(&mut columns, count - handed)?;
    let mut facts = vec![ColumnFacts::default(); dialect.width];
    for (index, column) in columns.into_iter().map(Filling::finish) {
        facts[index] = column;
    }
    Ok(Rows { columns: facts, unbroken, notes })
}

fn ragged(fields: usize, width: usize, line: u64) -> RowError {
    RowError::Format(format!("the row has {fields} fields, the others have {width}"), line)
}

/// Remembers the last byte that passed.
struct LastByte<R> {
    inner: R,
    last: Rc<Slot<u8>>,
}

impl<R: Read> Read for LastByte<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        if n > 0 {
            self.last.set(buffer[n - 1]);
        }
        Ok(n)
    }
}

/// Makes one blank of every run of blanks and tabs, and none at either end of a line.
struct SingleBlanks<R> {
    inner: R,
    pending: bool,
    line_start: bool,
    raw: Vec<u8>,
}

impl<R: Read> SingleBlanks<R> {
    fn new(inner: R) -> Self {
        Self { inner, pending: false, line_start: true, raw: vec![0; 64 * 1024] }
    }
}

impl<R: Read> Read for SingleBlanks<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // each raw byte yields at most one byte, plus one blank held back from before
        if buffer.len() < 2 {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "buffer of less than two bytes"));
        }
        loop {
            let most = (buffer.len() - 1).min(self.raw.len());
            let n = self.inner.read(&mut self.raw[..most])?;
            if n == 0 {
                return Ok(0);
            }
            let mut out = 0;
            for &b in &self.raw[..n] {
                match b {
                    b' ' | b'\t' => self.pending = !self.line_start,
                    b'\n' | b'\r' => {
                        self.pending = false;
                        self.line_start = true;
                        buffer[out] = b;
                        out += 1;
                    }
                    _ => {
                        if std::mem::take(&mut self.pending) {
                            buffer[out] = b' ';
                            out += 1;
                        }
                        self.line_start = false;
                        buffer[out] = b;
                        out += 1;
                    }
                }
            }
            if out > 0 {
                return Ok(out);
            }
        }
    }
}
