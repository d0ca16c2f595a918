//! A column of a text table while it is read.

use super::cell;
use super::cell::Cell;
use super::decimal;
use super::dialect::Dialect;
use crate::ingest::formats::head::{BadCell, Kind};
use crate::ingest::formats::source::{Column, ColumnFacts};

/// Values from this size on keep their whole part exactly: seconds since 1970 with nanoseconds need 61 bits.
const LARGE: f64 = 1e8;
/// Digits are looked at in the first rows, and then now and then: they hardly change within a log.
const DIGITS_OF_FIRST: usize = 256;
const DIGITS_OF_EVERY: usize = 64;

/// A column while it is read.
#[derive(Debug, Clone)]
pub(crate) struct Filling {
    /// Place among the columns of the file.
    pub index: usize,
    instant: bool,
    /// Whether `,` is the decimal separator.
    comma: bool,
    started: bool,
    exact: bool,
    decimals: i32,
    significant: i32,
    largest: f64,
    column: Column,
    bad: Option<(BadCell, usize)>,
}

/// Whether the digits of a row are looked at.
#[inline]
fn shows_digits(row: usize) -> bool {
    row < DIGITS_OF_FIRST || row.is_multiple_of(DIGITS_OF_EVERY)
}

impl Filling {
    /// The columns that are `wanted`.
    pub(crate) fn of(dialect: &Dialect, wanted: &[bool]) -> Vec<Self> {
        let readable = |i: &usize| wanted[*i] && dialect.heads[*i].kind != Kind::Other;
        let empty = |index: usize| Self {
            index,
            instant: dialect.heads[index].kind == Kind::Instant,
            comma: dialect.comma,
            started: false,
            exact: false,
            decimals: 0,
            significant: 0,
            largest: 0.0,
            column: Column::default(),
            bad: None,
        };
        (0..dialect.width).filter(readable).map(empty).collect()
    }

    /// Takes the field of the row `row`, counted from 0.
    pub(crate) fn take(&mut self, field: &[u8], row: usize) {
        let value = if self.instant {
            match cell::instant_ns(field) {
                Some(ns) => {
                    self.start_at(ns);
                    Cell::Number(ns.wrapping_sub(self.column.origin) as f64)
                }
                None if cell::read(field, self.comma) == Cell::Missing => Cell::Missing,
                None => Cell::Words,
            }
        } else {
            match cell::read(field, self.comma) {
                Cell::Number(x) => Cell::Number(self.rebased(x, field)),
                other => other,
            }
        };
        if shows_digits(row) {
            self.look_at_digits(field);
        }
        match value {
            Cell::Number(x) => self.push(x),
            Cell::Missing => self.column.values.push(f64::NAN),
            Cell::Words => {
                let text = || String::from_utf8_lossy(field).chars().take(40).collect();
                let (first, count) = self.bad.take().unwrap_or_else(|| (BadCell { row, text: text() }, 0));
                self.bad = Some((first, count + 1));
                self.column.values.push(f64::NAN);
            }
        }
    }

    /// Whether a field is neither what the column holds nor missing.
    pub(crate) fn is_words(&self, field: &[u8]) -> bool {
        cell::read(field, self.comma) == Cell::Words && !(self.instant && cell::instant_ns(field).is_some())
            || self.instant && matches!(cell::read(field, self.comma), Cell::Number(_))
    }

    /// Takes the number that `text` begins with, if it is one as numbers mostly are and a field ends there; returns its length.
    #[inline]
    pub(crate) fn take_plain(&mut self, text: &[u8], row: usize, delimiter: u8) -> Option<usize> {
        if self.instant || self.comma {
            return None;
        }
        let ends = |length: usize| matches!(text.get(length), Some(&b) if b == delimiter || b == b'\n' || b == b'\r');
        if self.started
            && !self.exact
            && let Some(number) = decimal::parse(text)
            && ends(number.length)
        {
            if shows_digits(row) {
                self.decimals = self.decimals.max(number.decimals as i32);
                self.significant = self.significant.max(number.significant() as i32);
            }
            self.largest = self.largest.max(number.value.abs());
            self.column.values.push(number.value);
            return Some(number.length);
        }
        self.take_float(text, row, ends)
    }

    #[inline(never)]
    fn take_float(&mut self, text: &[u8], row: usize, ends: impl Fn(usize) -> bool) -> Option<usize> {
        let (x, length) = fast_float2::parse_partial::<f64, _>(text).ok()?;
        if !ends(length) || x.is_nan() {
            return None;
        }
        let field = &text[..length];
        let x = if self.exact || !self.started { self.rebased(x, field) } else { x };
        if shows_digits(row) {
            self.look_at_digits(field);
        }
        self.push(x);
        Some(length)
    }

    fn push(&mut self, x: f64) {
        if x.is_finite() {
            self.largest = self.largest.max(x.abs());
        }
        self.column.values.push(x);
    }

    fn look_at_digits(&mut self, field: &[u8]) {
        let (decimals, significant) = cell::digits(field);
        self.decimals = self.decimals.max(decimals);
        self.significant = self.significant.max(significant);
    }

    fn start_at(&mut self, origin: i64) {
        if !self.exact {
            self.exact = true;
            self.column.origin = origin;
        }
    }

    fn rebased(&mut self, x: f64, field: &[u8]) -> f64 {
        // only a column that starts large is rebased: the origin has to hold for all of its rows
        let first = !std::mem::replace(&mut self.started, true);
        if !(self.exact || first && x.abs() >= LARGE) {
            return x;
        }
        match cell::split(field, self.comma) {
            Some((whole, fraction)) => {
                self.start_at(whole);
                whole.wrapping_sub(self.column.origin) as f64 + fraction
            }
            None => x - self.column.origin as f64,
        }
    }

    /// A column like it to read later rows with, with room for so many.
    pub(crate) fn like(&self, rows: usize) -> Self {
        let column = Column { origin: self.column.origin, values: Vec::with_capacity(rows) };
        Self { column, bad: None, ..*self }
    }

    /// Whether `later`, which was begun like this one, was read as it would have been behind it: it did not find an origin of
    /// its own.
    pub(crate) fn agrees(&self, later: &Self) -> bool {
        self.exact == later.exact
    }

    /// Takes note of what was read with a column [like](Self::like) it, `rows` rows after its beginning, and returns the cells.
    pub(crate) fn append(&mut self, later: Self, rows: usize) -> Column {
        self.started |= later.started;
        if later.exact {
            self.start_at(later.column.origin);
        }
        self.decimals = self.decimals.max(later.decimals);
        self.significant = self.significant.max(later.significant);
        self.largest = self.largest.max(later.largest);
        if let Some((bad, count)) = later.bad {
            let (first, before) = self.bad.take().unwrap_or((BadCell { row: bad.row + rows, ..bad }, 0));
            self.bad = Some((first, before + count));
        }
        Column { origin: self.column.origin, values: later.column.values }
    }

    /// Makes cells that were [returned](Self::append) and not handed over its own again.
    pub(crate) fn put_back(&mut self, values: Vec<f64>) {
        self.column.values = values;
    }

    /// Its rows since the last call.
    pub(crate) fn batch(&mut self) -> Column {
        Column { origin: self.column.origin, values: std::mem::take(&mut self.column.values) }
    }

    /// Its index, and its facts once all of it was read.
    pub(crate) fn finish(self) -> (usize, ColumnFacts) {
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
