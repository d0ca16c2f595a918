//! JSON lines: one object a line; keys of objects in it are joined by dots, places of lists by their number.

use super::csv::Skipped;
use super::csv::cell;
use super::csv::cell::Cell;
use super::fill::{Fill, Number};
use super::format::{Format, Opened};
use super::head::{BadCell, Head, Kind};
use super::input::{Input, broken_gzip};
use super::source::{Facts, Source, Take};
use crate::error::{Error, ErrorKind, Result};
use serde_json::Value;
use std::collections::HashMap;
use std::io::{BufRead, BufReader};

/// Text that begins with an object.
pub(crate) const FORMAT: Format = Format {
    name: "JSON lines (also gzipped)",
    accepts: |head| matches!(head.trim_ascii_start(), [b'{', ..] | [b'[', b'\n' | b'\r' | b' ' | b'{', ..]),
    open: |input| {
        let keys = Keys::of(&input)?;
        Ok(Opened::Table(Box::new(JsonLines { input, keys })))
    },
};

/// Cells that lines may leave empty: a million, and 32 for each byte that was read.
const EMPTY_ANYWAY: u64 = 1 << 20;
const EMPTY_TIMES: u64 = 32;
/// Objects nested deeper than this are not looked into.
const DEEPEST: usize = 16;

/// The columns, and where a key's is.
struct Keys {
    heads: Vec<Head>,
    places: HashMap<String, usize>,
}

impl Keys {
    /// The columns of the objects in the first bytes.
    fn of(input: &Input) -> Result<Self> {
        let name = input.path.display();
        let hint = "write one object a line: jq -c . FILE, or jq -c '.[]' FILE where it is one list";
        if input.head.trim_ascii_start().starts_with(b"[") {
            return Err(Error::new(ErrorKind::Format, name, "is one list of JSON").at("line 1").hint(hint));
        }
        let mut kinds: Vec<(String, [usize; 3])> = Vec::new();
        let mut places: HashMap<String, usize> = HashMap::new();
        let lines: Vec<&[u8]> = input.head.split(|b| *b == b'\n').collect();
        // the last line may be cut off
        let whole = if input.head_is_all { lines.len() } else { lines.len().saturating_sub(1) };
        let mut first_error = None;
        for (number, line) in lines[..whole].iter().enumerate().filter(|(_, l)| !l.trim_ascii().is_empty()) {
            let object = match serde_json::from_slice::<Value>(line) {
                Ok(object @ Value::Object(_)) => object,
                Ok(_) | Err(_) if input.skip_bad_rows && !places.is_empty() => continue,
                other => {
                    let why = other.err().map_or("is no object".to_string(), |e| e.to_string());
                    first_error.get_or_insert((number + 1, why));
                    continue;
                }
            };
            flatten(&object, &mut String::new(), 0, &mut |key, value| {
                let place = *places.entry(key.to_string()).or_insert_with(|| {
                    kinds.push((key.to_string(), [0; 3]));
                    kinds.len() - 1
                });
                let kind = match read(value) {
                    Read::Number(_) => 0,
                    Read::Instant(_) => 1,
                    Read::Words => 2,
                    Read::Missing => return,
                };
                kinds[place].1[kind] += 1;
            });
        }
        if places.is_empty() {
            let (line, why) = first_error.unwrap_or((1, "holds no object".to_string()));
            return Err(Error::new(ErrorKind::Format, name, why).at(format!("line {line}")).hint(hint));
        }
        let head = |(name, [numbers, instants, words]): (String, [usize; 3])| {
            let (kind, type_name) = match () {
                () if instants > words && instants > numbers => (Kind::Instant, "date"),
                () if words > numbers => (Kind::Other, "text"),
                () => (Kind::Number, "number"),
            };
            Head { kind, ..Head::number(name, type_name) }
        };
        Ok(Self { heads: kinds.into_iter().map(head).collect(), places })
    }
}

/// Content of a JSON value.
enum Read {
    Number(Number),
    /// ns since 1970, or since midnight.
    Instant(i64),
    Missing,
    Words,
}

fn read(value: &Value) -> Read {
    match value {
        Value::Number(n) => match n.as_i64() {
            Some(whole) => Read::Number(Number::Whole(whole)),
            None => n.as_f64().map_or(Read::Missing, |x| Read::Number(Number::Double(x))),
        },
        Value::Null => Read::Missing,
        Value::Bool(b) => Read::Number(Number::Whole(i64::from(*b))),
        Value::String(text) => match cell::read(text.as_bytes(), false) {
            Cell::Number(x) => Read::Number(Number::Double(x)),
            Cell::Missing => Read::Missing,
            Cell::Words => cell::instant_ns(text.as_bytes()).map_or(Read::Words, Read::Instant),
        },
        Value::Array(_) | Value::Object(_) => Read::Words,
    }
}

/// Gives each value of `value` with its key.
fn flatten(value: &Value, key: &mut String, depth: usize, give: &mut dyn FnMut(&str, &Value)) {
    let length = key.len();
    let mut inside = |part: &str, value: &Value| {
        // members of a list are told by their place: gyro[2]
        if length > 0 && !part.starts_with('[') {
            key.push('.');
        }
        key.push_str(part);
        flatten(value, key, depth + 1, give);
        key.truncate(length);
    };
    match value {
        Value::Object(map) if depth < DEEPEST => map.iter().for_each(|(part, value)| inside(part, value)),
        Value::Array(list) if depth < DEEPEST => {
            list.iter().enumerate().for_each(|(i, value)| inside(&format!("[{i}]"), value));
        }
        _ => give(key, value),
    }
}

struct JsonLines {
    input: Input,
    keys: Keys,
}

impl Source for JsonLines {
    fn heads(&self) -> &[Head] {
        &self.keys.heads
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { input, keys } = *self;
        let (path, gzipped, skips) = (input.path.clone(), input.gzipped, input.skip_bad_rows);
        let (stream, hash) = input.into_stream();
        let mut stream = BufReader::new(stream);
        let mut fill = Fill::new(wanted);
        let mut bad: Vec<Option<(BadCell, usize)>> = vec![None; wanted.len()];
        let mut skipped = Skipped::default();
        let (mut line, mut number, mut rows) = (Vec::new(), 0_u64, 0_usize);
        let (mut bytes, width) = (0, wanted.iter().filter(|w| **w).count() as u64);
        loop {
            line.clear();
            let read_bytes = stream
                .read_until(b'\n', &mut line)
                .map_err(|e| if gzipped { broken_gzip(&path, &e) } else { Error::io(&path, &e) })?;
            if read_bytes == 0 {
                break;
            }
            number += 1;
            bytes += read_bytes as u64;
            if rows as u64 * width > EMPTY_ANYWAY + EMPTY_TIMES * bytes {
                let found = format!("its lines leave nearly all of {width} keys open");
                return Err(Error::new(ErrorKind::Format, path.display(), found)
                    .at(format!("line {number}"))
                    .hint("write one object a line, each with the keys of the others: jq -c '{t, gyro}' FILE"));
            }
            if line.trim_ascii().is_empty() {
                continue;
            }
            let why = match serde_json::from_slice::<Value>(&line) {
                Ok(object @ Value::Object(_)) => {
                    let mut words = None;
                    flatten(&object, &mut String::new(), 0, &mut |key, value| {
                        let Some(place) = keys.places.get(key).copied().filter(|p| wanted[*p]) else { return };
                        let instants = keys.heads[place].kind == Kind::Instant;
                        match (read(value), instants) {
                            (Read::Number(number), false) => fill.put(place, number),
                            (Read::Instant(ns), true) => fill.put(place, Number::Whole(ns)),
                            (Read::Missing, _) => {}
                            _ => drop(words.get_or_insert((place, value.to_string()))),
                        }
                    });
                    match words {
                        Some((place, text)) if skips => Some(format!("{text} in {:?}", keys.heads[place].name)),
                        Some((place, text)) => {
                            let (first, count) = bad[place].take().unwrap_or((BadCell { row: rows, text }, 0));
                            bad[place] = Some((first, count + 1));
                            None
                        }
                        None => None,
                    }
                }
                Ok(_) => Some("no object".to_string()),
                Err(_) if line.last() != Some(&b'\n') && rows > 0 => {
                    skipped.cut_off(number);
                    break;
                }
                Err(e) => Some(e.to_string()),
            };
            match why {
                None => {
                    rows += 1;
                    fill.end_row(take)?;
                }
                Some(why) if skips => {
                    fill.clear_row();
                    skipped.add(number, why);
                }
                Some(why) => {
                    return Err(Error::new(ErrorKind::Format, path.display(), why)
                        .at(format!("line {number}"))
                        .hint("correct or delete the line, or leave out such lines with --skip-bad-rows"));
                }
            }
        }
        let mut columns = fill.finish(take)?;
        columns.iter_mut().zip(bad).for_each(|(column, bad)| column.bad = bad);
        Ok(Facts {
            source: path.display().to_string(),
            format: format!("JSON lines{}", if gzipped { ", gzip" } else { "" }),
            sha256: hash.hex(),
            columns,
            first_line: None,
            notes: skipped.notes(&path.display().to_string(), rows)?,
        })
    }
}
