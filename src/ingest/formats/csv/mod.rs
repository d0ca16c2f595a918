//! Text tables: CSV, TSV and their kin, also packed by gzip.

pub(crate) mod cell;
pub(crate) mod decimal;
pub(crate) mod dialect;
pub(crate) mod lines;
pub(crate) mod text_column;
use self::dialect::{Delimiter, Dialect};
use super::format::{Format, Opened};
use super::input::{Input, broken_gzip};
use super::source::{BATCH_ROWS, Batch, Column, ColumnFacts, Facts, Source, Take};

use self::lines::{Progress, Stop};
use self::text_column::Filling;
use super::head::Head;
use crate::error::{Error, ErrorKind, Result};
use std::io::{self, Read};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Zero bytes among the first ones of a text, at most one in so many: a serial line that drops out leaves some.
const ZEROS: usize = 1000;

/// Anything without the many zero bytes that every binary format has in its first bytes.
pub(crate) const FORMAT: Format = Format {
    name: "CSV or TSV (also gzipped)",
    accepts: |head| ZEROS * head.iter().filter(|b| **b == 0).count() <= head.len(),
    open: |input| {
        let dialect = dialect::sniff(&input.head, input.head_is_all);
        if dialect.heads.is_empty() {
            return Err(Error::new(
                ErrorKind::TooShort,
                input.path.display(),
                "holds no table, only blank lines or comments",
            )
            .hint("record the log again"));
        }
        Ok(Opened::Table(Box::new(Text { path: input.path.clone(), input, dialect })))
    },
};

struct Text {
    path: PathBuf,
    input: Input,
    dialect: Dialect,
}

impl Source for Text {
    fn heads(&self) -> &[Head] {
        &self.dialect.heads
    }

    /// Number of rows, estimated from the length of the first lines.
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
            return Err(Error::new(ErrorKind::TooShort, path.display(), found).hint("record the log again"));
        }
        if dialect.width != dialect.heads.len() {
            let found = format!("the header has {} names, the rows have {} fields", dialect.heads.len(), dialect.width);
            return Err(Error::new(ErrorKind::Format, path.display(), found)
                .at(format!("line {}", dialect.first_line))
                .hint("correct the header, or delete it: columns are then named column_1, column_2, ..."));
        }
        let (gzipped, skip_bad_rows) = (input.gzipped, input.skip_bad_rows);
        // a quotation mark in the noise of a serial line begins no field
        let quotes = !skip_bad_rows || input.head.contains(&b'"');
        let fail = |e: &io::Error| if gzipped { broken_gzip(&path, e) } else { Error::io(&path, e) };
        let (mut stream, hash) = input.into_stream();
        io::copy(&mut (&mut stream).take(dialect.skip as u64), &mut io::sink()).map_err(|e| fail(&e))?;
        let ends = Arc::new(Mutex::new(Ends::default()));
        let stream = Watched { inner: stream, ends: ends.clone() };
        let mut skipped = skip_bad_rows.then(Skipped::default);
        let how = How { dialect: &dialect, wanted, ends: &ends, quotes };
        let mut rows = match dialect.delimiter {
            Delimiter::Byte(b) => read_rows(stream, b, how, &mut skipped, take),
            Delimiter::Blanks => {
                // which is not for reading a byte at a time
                let stream = io::BufReader::with_capacity(64 * 1024, SingleBlanks::new(stream));
                read_rows(stream, b' ', how, &mut skipped, take)
            }
        }
        .map_err(|e| match e {
            RowError::Io(e) => fail(&e),
            RowError::Format(found, line) => Error::new(ErrorKind::Format, path.display(), found)
                .at(format!("line {line}"))
                .hint("correct or delete the line, or leave out such lines with --skip-bad-rows"),
            RowError::Taken(e) => e,
        })?;
        let mut notes = dialect.notes;
        notes.append(&mut rows.notes);
        if let Some(skipped) = skipped {
            notes.extend(skipped.notes(&path.display().to_string(), rows.count)?);
        }
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
    count: usize,
    unbroken: bool,
    notes: Vec<String>,
}

/// Rows that do not parse and are left out.
#[derive(Debug, Default)]
pub(crate) struct Skipped {
    count: usize,
    first: Vec<String>,
    cut_off: Option<u64>,
}

impl Skipped {
    /// Rows that are told one by one.
    const TOLD: usize = 5;

    /// Takes note of a row in line `line`, counted from 1.
    pub(crate) fn add(&mut self, line: u64, why: impl std::fmt::Display) {
        self.count += 1;
        if self.first.len() < Self::TOLD {
            self.first.push(format!("line {line} ({why})"));
        }
    }

    /// Takes note of a last line without an end that does not parse.
    pub(crate) fn cut_off(&mut self, line: u64) {
        self.cut_off = Some(line);
    }

    /// Notes on the rows that were left out, beside `rows` that were read.
    ///
    /// # Errors
    /// [`ErrorKind::Format`] where more rows do not parse than do: that is no table.
    pub(crate) fn notes(self, source: &str, rows: usize) -> Result<Vec<String>> {
        let more = if self.count > self.first.len() { ", ..." } else { "" };
        let told = format!("{}{more}", self.first.join(", "));
        if self.count > rows {
            let found = format!("{} rows do not parse, and {rows} do: {told}", self.count);
            return Err(Error::new(ErrorKind::Format, source, found).hint("correct the file, or record the log again"));
        }
        let cut = self.cut_off.map(|line| format!("line {line}: the last row is cut off and left out"));
        let left = (self.count > 0).then(|| {
            let plural = if self.count == 1 { "row that does" } else { "rows that do" };
            format!("{} {plural} not parse left out: {told}", self.count)
        });
        Ok(cut.into_iter().chain(left).collect())
    }
}

/// How the rows of a file are read.
#[derive(Clone, Copy)]
struct How<'a> {
    dialect: &'a Dialect,
    wanted: &'a [bool],
    /// Of what was read.
    ends: &'a Mutex<Ends>,
    /// Whether a field may stand in quotation marks.
    quotes: bool,
}

fn read_rows(
    stream: impl Read + Send,
    delimiter: u8,
    how: How<'_>,
    skipped: &mut Option<Skipped>,
    take: Take<'_>,
) -> std::result::Result<Rows, RowError> {
    let How { dialect, wanted, ends, quotes } = how;
    let mut columns = Filling::of(dialect, wanted);
    let places: Vec<usize> = columns.iter().map(|c| c.index).collect();
    let mut handed = 0;
    let clock = |place: &usize| dialect.heads[*place].type_name == cell::CLOCK_TIME;
    let mut clocks: Vec<(usize, Midnights)> =
        places.iter().copied().filter(clock).map(|place| (place, Midnights::default())).collect();
    let mut hand_over = |cells: &mut dyn Iterator<Item = Column>, rows: usize, least: usize| {
        if rows - handed < least {
            return Ok(());
        }
        let mut batch = Batch { rows: rows - handed, columns: vec![Column::default(); dialect.width] };
        places.iter().zip(cells).for_each(|(place, column)| batch.columns[*place] = column);
        clocks.iter_mut().for_each(|(place, midnights)| midnights.pass(&mut batch.columns[*place].values));
        handed = rows;
        take(batch)
    };
    let mut progress = Progress { rows: 0, lines: 0, unbroken: true };
    let full =
        |cells: &mut [Column], rows: usize| hand_over(&mut cells.iter_mut().map(std::mem::take), rows, BATCH_ROWS);
    let rest: Box<dyn Read + Send + '_> = if skipped.is_some() {
        // one row after the other: each is looked at before it is taken
        Box::new(stream)
    } else {
        let plain = lines::read(stream, delimiter, dialect.width, &mut columns, &mut progress, full);
        plain.map_err(|stop| match stop {
            Stop::Io(e) => RowError::Io(e),
            Stop::Ragged(fields, line) => ragged(fields, dialect.width, dialect.first_line + line - 1),
            Stop::Taken(e) => RowError::Taken(e),
        })?
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .quoting(quotes)
        .flexible(true)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .buffer_capacity(256 * 1024)
        .from_reader(rest);
    let mut record = csv::ByteRecord::new();
    let Progress { rows: mut count, lines: before, mut unbroken } = progress;
    let mut line = before;
    let mut notes = Vec::new();
    let mut short: Option<(usize, u64)> = None;
    while reader.read_byte_record(&mut record).map_err(|e| match e.into_kind() {
        csv::ErrorKind::Io(e) => RowError::Io(e),
        other => RowError::Format(format!("{other:?}"), dialect.first_line + line),
    })? {
        if let Some((fields, line)) = short {
            return Err(ragged(fields, dialect.width, line));
        }
        line = record.position().map_or(line, |p| before + p.line());
        unbroken &= line == count as u64 + 1;
        let fields = record.len();
        if fields == 1 && record[0].trim_ascii().is_empty() {
            unbroken = false;
            continue; // a line of blanks
        }
        let trailing = fields == dialect.width + 1 && record[fields - 1].is_empty();
        if let Some(skipped) = skipped.as_mut() {
            let odd = || columns.iter().find(|c| c.is_words(&record[c.index]));
            let why = if fields != dialect.width && !trailing {
                Some(ragged_text(fields, dialect.width))
            } else {
                let text = |c: &Filling| String::from_utf8_lossy(&record[c.index]).chars().take(40).collect::<String>();
                odd().map(|c| format!("{:?} in column {:?}", text(c), dialect.heads[c.index].name))
            };
            if let Some(why) = why {
                unbroken = false;
                skipped.add(dialect.first_line + line - 1, why);
                continue;
            }
        }
        if fields != dialect.width && !trailing {
            // judged when it is known whether the file ends here
            short = Some((fields, dialect.first_line + line - 1));
            continue;
        }
        for column in &mut columns {
            column.take(&record[column.index], count);
        }
        count += 1;
        hand_over(&mut columns.iter_mut().map(Filling::batch), count, BATCH_ROWS).map_err(RowError::Taken)?;
    }
    let ends = *ends.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((fields, line)) = short {
        // no line end: the recorder was cut off in the middle of its last row
        if ends.last == 0 || fields > dialect.width {
            return Err(ragged(fields, dialect.width, line));
        }
        notes.push(format!("line {line}: the last row is cut off after {fields} fields and left out"));
    } else if count > 1 && (1..ends.before).contains(&ends.last) {
        notes.push(
            "the last row has no line end and is shorter than the row before: its last value may be cut off"
                .to_string(),
        );
    }
    hand_over(&mut columns.iter_mut().map(Filling::batch), count, 0).map_err(RowError::Taken)?;
    let mut facts = vec![ColumnFacts::default(); dialect.width];
    for (index, column) in columns.into_iter().map(Filling::finish) {
        facts[index] = column;
    }
    for (place, midnights) in clocks.iter().filter(|(_, m)| m.days > 0.0) {
        let name = &dialect.heads[*place].name;
        let days = if midnights.days == 1.0 { "a day is".into() } else { format!("{} days are", midnights.days) };
        notes.push(format!("{name:?} has no date and passes midnight: {days} added"));
    }
    Ok(Rows { columns: facts, count, unbroken, notes })
}

fn ragged_text(fields: usize, width: usize) -> String {
    format!("the row has {fields} fields, the others have {width}")
}

fn ragged(fields: usize, width: usize, line: u64) -> RowError {
    RowError::Format(ragged_text(fields, width), line)
}

/// Times of day that run on over midnight.
#[derive(Debug, Clone, Copy, Default)]
struct Midnights {
    last: f64,
    days: f64,
}

impl Midnights {
    /// Adds the days that have passed to the next times of day, ns: one each time they go back by half a day and more.
    fn pass(&mut self, times: &mut [f64]) {
        let day = cell::DAY_NS as f64;
        for t in times.iter_mut().filter(|t| t.is_finite()) {
            if *t < self.last - 0.5 * day {
                self.days += 1.0;
            }
            self.last = *t;
            *t += self.days * day;
        }
    }
}

/// Lengths of the last lines, bytes without their ends.
#[derive(Debug, Clone, Copy, Default)]
struct Ends {
    /// Behind the last line end: 0 in a file that ends with one.
    last: usize,
    before: usize,
}

impl Ends {
    fn pass(&mut self, bytes: &[u8]) {
        let Some(end) = memchr::memrchr(b'\n', bytes) else {
            self.last += bytes.len();
            return;
        };
        let line = &bytes[..end];
        self.before = match memchr::memrchr(b'\n', line) {
            Some(begin) => end - begin - 1,
            None => self.last + end,
        };
        self.before -= usize::from(self.before > 0 && line.last() == Some(&b'\r'));
        self.last = bytes.len() - end - 1;
    }
}

/// Takes note of the ends of the lines that pass.
struct Watched<R> {
    inner: R,
    ends: Arc<Mutex<Ends>>,
}

impl<R: Read> Read for Watched<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.ends.lock().unwrap_or_else(PoisonError::into_inner).pass(&buffer[..n]);
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

#[cfg(test)]
mod tests;
