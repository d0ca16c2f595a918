//! How a text file is written: delimiter, decimal separator, header, units row, comments. All from its first bytes.

use super::cell;
use super::cell::Cell;
use crate::ingest::columns::names;
use crate::ingest::formats::head::{Head, Kind};
use crate::units::{RateUnit, TimeUnit};

/// Separator between two fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Delimiter {
    Byte(u8),
    /// Any run of blanks and tabs.
    Blanks,
}

impl Delimiter {
    /// Name for messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Byte(b',') => "commas",
            Self::Byte(b';') => "semicolons",
            Self::Byte(b'\t') => "tabs",
            Self::Byte(_) => "a delimiter",
            Self::Blanks => "blanks",
        }
    }

    fn split(self, line: &str) -> Vec<String> {
        match self {
            Self::Blanks => line.split_whitespace().map(str::to_string).collect(),
            // a reader for a line takes longer than the line
            Self::Byte(b) if !line.is_empty() && !line.contains(['"', '\r']) => {
                line.split(char::from(b)).map(|f| f.trim().to_string()).collect()
            }
            Self::Byte(b) => {
                let mut reader = csv::ReaderBuilder::new().has_headers(false).delimiter(b).from_reader(line.as_bytes());
                let mut record = csv::StringRecord::new();
                // a line of a `str` is one valid record; anything else counts as no fields
                if reader.read_record(&mut record).unwrap_or(false) {
                    record.iter().map(|f| f.trim().to_string()).collect()
                } else {
                    Vec::new()
                }
            }
        }
    }
}

/// The way in which a text file is written.
#[derive(Debug, Clone)]
pub(crate) struct Dialect {
    pub delimiter: Delimiter,
    /// Whether `,` is the decimal separator.
    pub comma: bool,
    pub heads: Vec<Head>,
    /// Fields of a row.
    pub width: usize,
    /// Bytes before the first row of data.
    pub skip: usize,
    /// Line of the first row of data, counted from 1.
    pub first_line: u64,
    /// Whether there was at least one row of data to look at.
    pub has_rows: bool,
    pub notes: Vec<String>,
}

struct Line<'a> {
    text: &'a str,
    number: u64,
    start: usize,
    end: usize,
}

/// How many rows are looked at.
const SAMPLE: usize = 200;

/// Finds the dialect from the first bytes; the last line counts only if the file ends there.
pub(crate) fn sniff(head: &[u8], head_is_all: bool) -> Dialect {
    let text = String::from_utf8_lossy(head);
    // lossy text has other byte offsets than the file: only valid text is used further on
    let text: &str = match &text {
        std::borrow::Cow::Borrowed(t) => t,
        std::borrow::Cow::Owned(_) => valid_prefix(head),
    };
    let mut comments: Vec<&str> = Vec::new();
    let mut lines: Vec<Line> = Vec::new();
    let mut offset = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    for (number, raw) in text[offset..].split_inclusive('\n').enumerate() {
        let start = offset;
        offset += raw.len();
        let whole = raw.ends_with('\n') || (head_is_all && offset == text.len());
        let line = raw.trim_matches(['\r', '\n']);
        if line.trim().is_empty() {
            continue;
        }
        let comment = line.trim_start().strip_prefix(['#', '%']).or_else(|| line.trim_start().strip_prefix("//"));
        match comment {
            Some(comment) if lines.is_empty() => comments.push(comment.trim()),
            Some(_) => {}
            None if whole || lines.is_empty() => {
                lines.push(Line { text: line, number: number as u64 + 1, start, end: offset });
            }
            None => {}
        }
        if lines.len() > SAMPLE {
            break;
        }
    }
    let (delimiter, comma) = delimiter_of(&lines);
    let before = spoken(delimiter, comma, &lines);
    let mut dialect = layout(delimiter, comma, &comments, &lines[before..], offset);
    if let Some(first) = lines.first().filter(|_| before > 0) {
        let text: String = first.text.chars().take(40).collect();
        let more = if before > 1 { format!(" and {} more", before - 1) } else { String::new() };
        dialect.notes.push(format!("line {} before the table, {text:?}{more}: left out", first.number));
    }
    dialect
}

/// How many lines a device spoke before its table began: up to the header, which has as many fields as the rows have, or up to
/// the first row where a line without any delimiter stands before it. Of several lines with as many fields the header is the
/// first that names a column of a gyro's log, else the first.
fn spoken(delimiter: Delimiter, comma: bool, lines: &[Line]) -> usize {
    let split: Vec<Vec<String>> = lines.iter().map(|l| delimiter.split(l.text)).collect();
    let numbers = |row: &[String]| row.iter().filter(|f| is_number(f, comma)).count();
    let rows: Vec<Vec<String>> = split.iter().filter(|r| numbers(r) > 0).cloned().collect();
    let width = modal_width(&rows);
    let fits =
        |row: &[String]| row.len() == width || row.len() == width + 1 && row.last().is_some_and(String::is_empty);
    if width < 2 {
        return 0;
    }
    // a row of numbers is believed with the one behind it
    let is_row =
        |k: usize| fits(&split[k]) && 2 * numbers(&split[k]) >= width && split.get(k + 1).is_none_or(|r| fits(r));
    let Some(data) = (0..split.len()).find(|&k| is_row(k)) else { return 0 };
    // what the device said with as many delimiters, header, and a row of units
    let first = (0..data).rev().take_while(|&k| fits(&split[k])).last();
    if split.first().is_some_and(|line| fits(line)) && first != Some(0) {
        return 0;
    }
    let names_a_column = |k: &usize| {
        numbers(&split[*k]) == 0 && split[*k].iter().any(|name| names::parse(name).role != names::Role::Other)
    };
    match first {
        Some(first) => (first..data).find(names_a_column).unwrap_or(first),
        None if split[..data].iter().all(|r| r.len() == 1) => data,
        None => 0,
    }
}

/// The part before the first byte that is not UTF-8.
fn valid_prefix(bytes: &[u8]) -> &str {
    let end = match std::str::from_utf8(bytes) {
        Ok(_) => bytes.len(),
        Err(e) => e.valid_up_to(),
    };
    std::str::from_utf8(&bytes[..end]).unwrap_or_default()
}

/// The delimiter under which the lines agree in their number of fields and the fields are numbers.
fn delimiter_of(lines: &[Line]) -> (Delimiter, bool) {
    // the header is one line among many: with data there, data decides
    let sample = if lines.len() > 1 { &lines[1..] } else { lines };
    let mut best = (Delimiter::Byte(b','), false, 0.0);
    for delimiter in [Delimiter::Byte(b','), Delimiter::Byte(b'\t'), Delimiter::Byte(b';'), Delimiter::Blanks] {
        let rows: Vec<Vec<String>> = sample.iter().map(|l| delimiter.split(l.text)).collect();
        let width = modal_width(&rows);
        if width < 2 {
            continue;
        }
        let agree = rows.iter().filter(|r| r.len() == width).count() as f64 / rows.len() as f64;
        for comma in [false, true] {
            if comma && delimiter == Delimiter::Byte(b',') {
                continue;
            }
            let fields: Vec<&String> = rows.iter().flatten().collect();
            let known = fields.iter().filter(|f| is_value(f, comma)).count() as f64 / fields.len().max(1) as f64;
            let score = agree * (0.1 + known);
            if score > best.2 {
                best = (delimiter, comma, score);
            }
        }
    }
    (best.0, best.1)
}

fn modal_width(rows: &[Vec<String>]) -> usize {
    let mut widths: Vec<usize> = rows.iter().map(Vec::len).collect();
    widths.sort_unstable();
    widths.chunk_by(|a, b| a == b).max_by_key(|c| c.len()).map_or(0, |c| c[0])
}

fn is_number(field: &str, comma: bool) -> bool {
    matches!(cell::read(field.as_bytes(), comma), Cell::Number(_))
}

fn is_value(field: &str, comma: bool) -> bool {
    cell::read(field.as_bytes(), comma) != Cell::Words || cell::instant_ns(field.as_bytes()).is_some()
}

/// Header, units row, and the columns with their kinds.
fn layout(delimiter: Delimiter, comma: bool, comments: &[&str], lines: &[Line], end: usize) -> Dialect {
    let split: Vec<Vec<String>> = lines.iter().map(|l| delimiter.split(l.text)).collect();
    let values = |row: &[String]| {
        row.iter().all(|f| is_value(f, comma)) && row.iter().any(|f| cell::read(f.as_bytes(), comma) != Cell::Missing)
    };
    let mut notes = Vec::new();
    let mut data = 0; // index of the first row of data among the lines
    let first = split.first().map(Vec::as_slice).unwrap_or_default();
    let second = split.get(1).map(Vec::as_slice).unwrap_or_default();
    let numbers = |row: &[String]| row.iter().filter(|f| is_number(f, comma)).count();
    // a first row with as many numbers as the second is no header, even where a column of words stands beside them
    let bare = values(first) || (numbers(second) > 0 && 2 * numbers(first) > numbers(second));
    let mut names: Vec<String> = if bare {
        // EuRoC and `rostopic echo -p` write the header as a comment
        let commented = comments.last().map(|c| delimiter.split(c)).unwrap_or_default();
        if commented.len() == first.len() && !values(&commented) {
            commented
        } else {
            notes.push("the file has no header: its columns are named column_1, column_2, ...".to_string());
            (1..=first.len()).map(|i| format!("column_{i}")).collect()
        }
    } else {
        data = 1;
        first.to_vec()
    };
    let mut units: Vec<Option<String>> = vec![None; names.len()];
    if data == 1 && split.len() > 2 && is_units_row(&split[1], comma) && numbers(&split[2]) > 0 {
        units = split[1].iter().map(|u| (!u.is_empty()).then(|| u.clone())).collect();
        units.resize(names.len(), None);
        data = 2;
        notes.push(format!("line {} is taken as a row of units", lines[1].number));
    }
    if comma {
        notes.push("numbers are written with a decimal comma".to_string());
    }
    let rows = &split[data.min(split.len())..];
    let mut width = if rows.is_empty() { names.len() } else { modal_width(rows) };
    // a delimiter at the end of every row
    if width == names.len() + 1 && rows.iter().all(|r| r.last().is_none_or(String::is_empty)) {
        width = names.len();
    } else if names.len() == width + 1 && names.last().is_some_and(String::is_empty) {
        names.pop();
        units.pop();
    }
    let heads: Vec<Head> = unique(names)
        .into_iter()
        .zip(units)
        .enumerate()
        .map(|(i, (name, unit))| {
            let kind = kind_of(rows, i, comma);
            let type_name = match kind {
                Kind::Number => "number",
                Kind::Instant if is_clock(rows, i) => cell::CLOCK_TIME,
                Kind::Instant => "date",
                Kind::Other => "text",
            };
            Head { name, kind, type_name: type_name.to_string(), unit, role: None }
        })
        .collect();
    for (i, head) in heads.iter().enumerate().filter(|(_, h)| h.kind == Kind::Instant) {
        if rows.iter().filter_map(|r| r.get(i)).any(|f| f.contains('/')) {
            notes.push(format!("{:?}: dates are read month first, unless the first number is no month", head.name));
        }
    }
    Dialect {
        delimiter,
        comma,
        heads,
        width,
        skip: lines.get(data).map_or(lines.last().map_or(end, |l| l.end), |l| l.start),
        first_line: lines.get(data).map_or(0, |l| l.number),
        has_rows: !rows.is_empty(),
        notes,
    }
}

/// Words only, and at least one of them a unit of rate or time.
fn is_units_row(row: &[String], comma: bool) -> bool {
    let word = |f: &String| f.trim_matches(['(', ')', '[', ']']).to_string();
    row.iter().all(|f| f.is_empty() || cell::read(f.as_bytes(), comma) == Cell::Words || f == "-")
        && row.iter().any(|f| RateUnit::parse(&word(f)).is_some() || TimeUnit::parse(&word(f)).is_some())
}

/// Kind of most of a column's filled fields; a column of empty fields is one of missing numbers.
fn kind_of(rows: &[Vec<String>], column: usize, comma: bool) -> Kind {
    let (mut numbers, mut instants, mut words) = (0usize, 0usize, 0usize);
    for field in rows.iter().filter_map(|r| r.get(column)) {
        match cell::read(field.as_bytes(), comma) {
            Cell::Number(_) => numbers += 1,
            Cell::Missing => {}
            Cell::Words if cell::instant_ns(field.as_bytes()).is_some() => instants += 1,
            Cell::Words => words += 1,
        }
    }
    if instants > words && instants > numbers {
        Kind::Instant
    } else if words > numbers {
        Kind::Other
    } else {
        Kind::Number
    }
}

/// Whether a column of instants has times of day without dates.
fn is_clock(rows: &[Vec<String>], column: usize) -> bool {
    let first = rows.iter().filter_map(|r| r.get(column)).find_map(|f| cell::instant_ns(f.as_bytes()));
    // no log is of the first day of 1970
    first.is_some_and(|ns| (0..cell::DAY_NS).contains(&ns))
}

/// Names without repetition: the second `a` is told apart as `a#2`; an empty name is told by its place.
fn unique(names: Vec<String>) -> Vec<String> {
    let mut seen = std::collections::HashMap::new();
    names
        .into_iter()
        .enumerate()
        .map(|(i, name)| {
            let name = if name.is_empty() { format!("column_{}", i + 1) } else { name };
            let count = seen.entry(name.clone()).and_modify(|c| *c += 1).or_insert(1);
            if *count > 1 { format!("{name}#{count}") } else { name }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(d: &Dialect) -> Vec<&str> {
        d.heads.iter().map(|h| h.name.as_str()).collect()
    }

    #[test]
    fn delimiters_are_told_apart() {
        for (text, delimiter, comma) in [
            ("t_s,gz\n0,1.5\n1,2.5\n", Delimiter::Byte(b','), false),
            ("t_s\tgz\n0\t1.5\n1\t2.5\n", Delimiter::Byte(b'\t'), false),
            ("t_s;gz\n0;1.5\n1;2.5\n", Delimiter::Byte(b';'), false),
            ("t_s;gz\n0,0;1,5\n1,0;2,5\n", Delimiter::Byte(b';'), true),
            ("t_s gz\n0   1.5\n  1 2.5\n", Delimiter::Blanks, false),
            ("t_s, gz\n0, 1.5\n1, 2.5\n", Delimiter::Byte(b','), false),
        ] {
            let d = sniff(text.as_bytes(), true);
            assert_eq!((d.delimiter, d.comma), (delimiter, comma), "{text:?}");
            assert_eq!(names(&d), ["t_s", "gz"], "{text:?}");
        }
    }

    #[test]
    fn headers_in_comments_units_rows_and_none() {
        let d = sniff(b"# run 7\n#timestamp [ns],w_RS_S_z [rad s^-1]\n1,2\n3,4\n", true);
        assert_eq!(names(&d), ["timestamp [ns]", "w_RS_S_z [rad s^-1]"]);
        assert_eq!(d.first_line, 3);
        let d = sniff(b"# a\n\ntime,gz,note\nms,deg/s,-\n0,1,\n1,2,\n", true);
        assert_eq!(names(&d), ["time", "gz", "note"]);
        assert_eq!(d.heads[1].unit.as_deref(), Some("deg/s"));
        assert_eq!(d.first_line, 5);
        let d = sniff(b"0,1\n1,2\n", true);
        assert_eq!(names(&d), ["column_1", "column_2"]);
        assert_eq!(d.skip, 0);
    }

    #[test]
    fn a_delimiter_at_the_end_of_every_row_is_no_column() {
        let d = sniff(b"a,b\n0,1,\n1,2,\n", true);
        assert_eq!((d.width, d.heads.len()), (2, 2));
        let d = sniff(b"a,b,\n0,1,\n1,2,\n", true);
        assert_eq!(names(&d), ["a", "b", "column_3"]);
    }

    #[test]
    fn what_a_device_says_with_a_delimiter_in_it_is_no_header() {
        for before in ["MPU6050 ready, range 250\n", "boot\nMPU6050 ready, range 250\n"] {
            let d = sniff(format!("{before}t_s,gz_dps\n0,1.5\n1,2.5\n").as_bytes(), true);
            assert_eq!(names(&d), ["t_s", "gz_dps"]);
            assert!(d.notes[0].contains("before the table"), "{:?}", d.notes);
        }
        // names that say nothing, and a row of units under names that do
        assert_eq!(names(&sniff(b"a,b\nfloat,float\n0,1.5\n1,2.5\n", true)), ["a", "b"]);
        assert_eq!(names(&sniff(b"time,gz\ns,deg/s\n0,1.5\n1,2.5\n", true)), ["time", "gz"]);
    }

    #[test]
    fn names_are_made_unique() {
        assert_eq!(names(&sniff(b"a,a,\n0,1,2\n", true)), ["a", "a#2", "column_3"]);
    }
}
