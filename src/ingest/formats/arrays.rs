//! Files of named arrays (NumPy, MATLAB, HDF5) as tables: the arrays of one group that are as long as each other.
//!
//! A column is a vector, or one column of a matrix: `gyro` of 400 × 3 (or 3 × 400) is `gyro[0]`, `gyro[1]`, `gyro[2]`.

use super::fill::Number;
use super::format::Opened;
use super::head::{Head, Kind};
use super::source::{About, Batch, Column, ColumnFacts, Facts, Source, Take};
use super::topics::{Container, Listing, Stamp, Topic, has_gyro};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::columns::names;
use crate::ingest::columns::names::Role;
use std::collections::BTreeMap;

/// Matrices with more columns than this are pictures and covariances.
const MOST_COLUMNS: usize = 64;

/// An array before its numbers are read.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// Names of what holds it, joined by `/`; empty at the top.
    pub group: String,
    pub name: String,
    pub shape: Vec<u64>,
    /// Whether the first index runs fastest.
    pub first_fastest: bool,
    pub type_name: String,
    pub unit: Option<String>,
    pub kind: Kind,
}

/// The numbers of an array in the file's order.
#[derive(Debug, Clone)]
pub enum Loaded {
    /// Of double precision.
    Double(Vec<f64>),
    /// Of single precision.
    Single(Vec<f32>),
    /// Keep all digits; `i64::MIN` is missing, as in NumPy's dates.
    Whole(Vec<i64>),
}

impl Loaded {
    fn len(&self) -> usize {
        match self {
            Self::Double(v) => v.len(),
            Self::Single(v) => v.len(),
            Self::Whole(v) => v.len(),
        }
    }

    fn get(&self, i: usize) -> Number {
        match self {
            Self::Double(v) => Number::Double(v[i]),
            Self::Single(v) => Number::Single(v[i]),
            Self::Whole(v) if v[i] == i64::MIN => Number::Missing,
            Self::Whole(v) => Number::Whole(v[i]),
        }
    }
}

/// A file of arrays.
pub(crate) trait Arrays {
    /// All arrays.
    fn entries(&self) -> &[Entry];
    /// The numbers of one of them, of kind [`Kind::Number`] or [`Kind::Instant`].
    fn load(&mut self, entry: usize) -> Result<Loaded>;
    /// The hash of what was loaded, where it is not known before.
    fn sha256(&mut self) -> Option<String> {
        None
    }
}

/// Where the numbers of a column lie.
#[derive(Debug, Clone, Copy)]
struct Place {
    entry: usize,
    first: usize,
    stride: usize,
}

/// The table of a group.
#[derive(Debug, Clone, Default)]
struct Layout {
    rows: usize,
    heads: Vec<Head>,
    places: Vec<Option<Place>>,
    notes: Vec<String>,
}

/// The arrays as one table, or as one for each group.
pub(crate) fn open(arrays: Box<dyn Arrays>, about: About) -> Result<Opened> {
    let mut groups: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (i, entry) in arrays.entries().iter().enumerate() {
        groups.entry(&entry.group).or_default().push(i);
    }
    let tables: Vec<(String, Layout)> = groups
        .into_iter()
        .map(|(group, members)| (group.to_string(), layout(arrays.entries(), &members)))
        .filter(|(_, l)| l.rows > 1)
        .collect();
    match <[_; 1]>::try_from(tables) {
        Ok([(_, layout)]) => Ok(Opened::Table(Box::new(Group { arrays, about, layout, name: None }))),
        Err(tables) if tables.is_empty() => {
            let there: Vec<String> = arrays.entries().iter().map(described).collect();
            let there = if there.is_empty() { "nothing".to_string() } else { there.join(", ") };
            Err(Error::new(ErrorKind::Column, &about.source, format!("holds no columns of numbers; there is {there}"))
                .hint("save time and rates as vectors of numbers of one length"))
        }
        Err(tables) => {
            let topics = tables.iter().map(|(name, layout)| Topic {
                name: if name.is_empty() { "/".to_string() } else { name.clone() },
                type_name: format!("{} columns", layout.heads.iter().filter(|h| h.kind != Kind::Other).count()),
                messages: layout.rows as u64,
                rate_hz: None,
                gyro: has_gyro(&layout.heads),
            });
            let listing = Listing { about, topics: topics.collect() };
            Ok(Opened::Topics(Box::new(Groups { arrays, listing, tables })))
        }
    }
}

fn described(entry: &Entry) -> String {
    let shape: Vec<String> = entry.shape.iter().map(ToString::to_string).collect();
    let group = if entry.group.is_empty() { String::new() } else { format!("{}/", entry.group) };
    format!("{group}{} ({} {})", entry.name, shape.join(" × "), entry.type_name)
}

/// Rows and columns of an array whose longest side is its rows; none if it has more than two sides.
fn sides(entry: &Entry) -> Option<(usize, usize)> {
    let mut sides: Vec<usize> = Vec::new();
    for n in &entry.shape {
        let n = usize::try_from(*n).ok()?;
        if n != 1 {
            sides.push(n);
        }
    }
    match sides[..] {
        [] => Some((1, 1)),
        [n] => Some((n, 1)),
        // a damaged file may state sides whose product is beyond all numbers
        [a, b] => a.checked_mul(b).map(|_| (a.max(b), a.min(b))),
        _ => None,
    }
}

fn layout(entries: &[Entry], members: &[usize]) -> Layout {
    let usable =
        |i: &&usize| entries[**i].kind != Kind::Other && sides(&entries[**i]).is_some_and(|(n, k)| n > 1 && k > 0);
    let usable: Vec<usize> = members.iter().filter(usable).copied().collect();
    let rows_of = |i: usize| sides(&entries[i]).map_or(0, |s| s.0);
    let is = |i: usize, role: &dyn Fn(Role) -> bool| {
        let name = &entries[i].name;
        role(names::parse(name).role) || role(names::parse(&format!("{name}[0]")).role)
    };
    let gyros: Vec<usize> = usable.iter().copied().filter(|&i| is(i, &|r| matches!(r, Role::Gyro(_)))).collect();
    let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
    for &i in if gyros.is_empty() { &usable } else { &gyros } {
        *lengths.entry(rows_of(i)).or_default() += 1;
    }
    let rows = lengths.into_iter().max_by_key(|(rows, count)| (*count, *rows)).map_or(0, |l| l.0);
    let mut out = Layout { rows, ..Layout::default() };
    let mut left_out = Vec::new();
    for &i in members {
        let entry = &entries[i];
        let Some((n, k)) = sides(entry).filter(|(n, k)| *n == rows && *k <= MOST_COLUMNS && usable.contains(&i)) else {
            left_out.push(described(entry));
            continue;
        };
        let mut push = |name: String, place: Place| {
            let head = Head { kind: entry.kind, unit: entry.unit.clone(), ..Head::number(name, &entry.type_name) };
            out.heads.push(head);
            out.places.push(Some(place));
        };
        if k == 1 {
            push(entry.name.clone(), Place { entry: i, first: 0, stride: 1 });
            continue;
        }
        // which of the two sides the rows are, and whether they run fastest
        let rows_first = entry.shape.iter().find(|s| **s != 1).is_some_and(|s| *s == n as u64);
        let rows_fastest = rows_first == entry.first_fastest;
        for j in 0..k {
            let name = if entry.name.is_empty() { format!("column_{}", j + 1) } else { format!("{}[{j}]", entry.name) };
            let (first, stride) = if rows_fastest { (j * n, 1) } else { (j, k) };
            push(name, Place { entry: i, first, stride });
        }
    }
    if !left_out.is_empty() {
        out.notes.push(format!("not in a table of {rows} rows: {}", left_out.join(", ")));
    }
    out
}

struct Groups {
    arrays: Box<dyn Arrays>,
    listing: Listing,
    tables: Vec<(String, Layout)>,
}

impl Container for Groups {
    fn listing(&self) -> &Listing {
        &self.listing
    }

    fn open(self: Box<Self>, topic: usize, _: Stamp) -> Result<Box<dyn Source>> {
        let Self { arrays, listing, mut tables } = *self;
        let (_, layout) = tables.swap_remove(topic);
        let name = Some(listing.topics[topic].name.clone());
        Ok(Box::new(Group { arrays, about: listing.about, layout, name }))
    }
}

struct Group {
    arrays: Box<dyn Arrays>,
    about: About,
    layout: Layout,
    name: Option<String>,
}

impl Source for Group {
    fn heads(&self) -> &[Head] {
        &self.layout.heads
    }

    fn rows(&self) -> Option<u64> {
        Some(self.layout.rows as u64)
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { mut arrays, about, layout, name } = *self;
        let mut batch = Batch { rows: layout.rows, columns: vec![Column::default(); layout.heads.len()] };
        let mut columns = vec![ColumnFacts::default(); layout.heads.len()];
        // the columns of a matrix stand beside each other: it is read once
        let mut last: Option<(usize, Loaded)> = None;
        for (i, place) in layout.places.iter().enumerate().filter(|(i, _)| wanted[*i]) {
            let Some(Place { entry, first, stride }) = *place else { continue };
            let loaded = match last.take().filter(|(e, _)| *e == entry) {
                Some((_, loaded)) => loaded,
                None => arrays.load(entry)?,
            };
            if layout.rows > 0 && loaded.len() <= first + (layout.rows - 1) * stride {
                let found = format!("{} numbers, its shape has more", loaded.len());
                return Err(Error::new(ErrorKind::Format, &about.source, found)
                    .at(format!("array {:?}", layout.heads[i].name))
                    .hint("write the file again"));
            }
            match loaded {
                // one column that is all there is of its array is not copied
                Loaded::Double(values) if stride == 1 && values.len() == layout.rows => {
                    batch.columns[i].values = values;
                }
                loaded => {
                    (batch.columns[i], columns[i].resolution) = column(&loaded, first, stride, layout.rows);
                    last = Some((entry, loaded));
                }
            }
        }
        take(batch)?;
        let mut notes = about.notes.clone();
        notes.extend(layout.notes);
        let about = About { sha256: arrays.sha256().unwrap_or(about.sha256.clone()), ..about };
        Ok(about.facts(name.as_deref(), columns, notes))
    }
}

/// A column's numbers, whole ones less their first, and their resolution.
fn column(loaded: &Loaded, first: usize, stride: usize, rows: usize) -> (Column, f64) {
    let numbers = (0..rows).map(|i| loaded.get(first + i * stride));
    let mut origin = None;
    let values: Vec<f64> = numbers
        .map(|number| match number {
            Number::Whole(x) => (i128::from(x) - i128::from(*origin.get_or_insert(x))) as f64,
            other => other.to_f64(),
        })
        .collect();
    let largest = values.iter().filter(|v| v.is_finite()).fold(0.0f64, |m, v| m.max(v.abs()));
    let resolution = match loaded {
        Loaded::Double(_) => 0.0,
        Loaded::Single(_) => largest * f64::from(f32::EPSILON),
        Loaded::Whole(_) => 1.0,
    };
    (Column { origin: origin.unwrap_or(0), values }, resolution)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Made(Vec<Entry>, Vec<Loaded>);

    impl Arrays for Made {
        fn entries(&self) -> &[Entry] {
            &self.0
        }

        fn load(&mut self, entry: usize) -> Result<Loaded> {
            Ok(self.1[entry].clone())
        }
    }

    fn made(all: &[(&str, &str, &[u64], bool)]) -> Box<Made> {
        let entry = |&(group, name, shape, first_fastest): &(&str, &str, &[u64], bool)| Entry {
            group: group.to_string(),
            name: name.to_string(),
            shape: shape.to_vec(),
            first_fastest,
            type_name: "double".to_string(),
            unit: None,
            kind: Kind::Number,
        };
        let loaded = |e: &Entry| Loaded::Double((0..e.shape.iter().product()).map(|i| i as f64).collect());
        let entries: Vec<Entry> = all.iter().map(entry).collect();
        let numbers = entries.iter().map(loaded).collect();
        Box::new(Made(entries, numbers))
    }

    fn about() -> About {
        About { source: "f".into(), format: "F", sha256: String::new(), notes: Vec::new() }
    }

    fn table(opened: Opened) -> (Vec<String>, Vec<Vec<f64>>, Vec<String>) {
        let Opened::Table(source) = opened else { panic!("topics") };
        let names = source.heads().iter().map(|h| h.name.clone()).collect();
        let wanted = vec![true; source.heads().len()];
        let table = crate::ingest::formats::table::collect(source, &wanted).unwrap();
        (names, table.cells.into_iter().map(|c| c.values).collect(), table.notes)
    }

    #[test]
    fn matrices_are_read_along_their_long_side_in_either_order() {
        for (shape, first_fastest, second) in [
            (&[4, 3][..], false, [1.0, 4.0, 7.0, 10.0]),
            (&[4, 3], true, [4.0, 5.0, 6.0, 7.0]),
            (&[3, 4], false, [4.0, 5.0, 6.0, 7.0]),
            (&[3, 4], true, [1.0, 4.0, 7.0, 10.0]),
        ] {
            let all = made(&[("", "t", &[4, 1], true), ("", "gyro", shape, first_fastest), ("", "fs", &[1, 1], true)]);
            let (names, columns, notes) = table(open(all, about()).unwrap());
            assert_eq!(names, ["t", "gyro[0]", "gyro[1]", "gyro[2]"]);
            assert_eq!(columns[2], second, "{shape:?} {first_fastest}");
            assert!(notes[0].contains("fs (1 × 1 double)"), "{notes:?}");
        }
    }

    #[test]
    fn the_gyros_length_counts() {
        let all = made(&[
            ("", "gps", &[2], true),
            ("", "gps_t", &[2], true),
            ("", "gyro", &[5, 3], true),
            ("", "t", &[5], true),
        ]);
        let (names, ..) = table(open(all, about()).unwrap());
        assert_eq!(names, ["gyro[0]", "gyro[1]", "gyro[2]", "t"]);
    }

    #[test]
    fn groups_are_topics() {
        let all = made(&[("imu", "t", &[5], true), ("imu", "wz", &[5], true), ("gps", "t", &[3], true)]);
        let Opened::Topics(groups) = open(all, about()).unwrap() else { panic!("one table") };
        let seen: Vec<(&str, bool)> = groups.listing().topics.iter().map(|t| (t.name.as_str(), t.gyro)).collect();
        assert_eq!(seen, [("gps", false), ("imu", true)]);
        assert_eq!(groups.open(1, Stamp::Header).unwrap().heads().len(), 2);
    }

    #[test]
    fn sides_without_bounds_are_no_columns() {
        let sides: [&[u64]; 3] = [&[1 << 63, 3], &[3, u64::MAX], &[1 << 62, 1 << 62]];
        for shape in sides {
            let all = Made(
                made(&[("", "gyro", &[2], true)]).0.into_iter().map(|e| Entry { shape: shape.to_vec(), ..e }).collect(),
                Vec::new(),
            );
            assert!(open(Box::new(all), about()).is_err(), "{shape:?}");
        }
    }

    #[test]
    fn a_file_without_columns_says_what_it_holds() {
        let error = open(made(&[("", "fs", &[1, 1], true), ("", "cube", &[2, 2, 2], true)]), about()).err().unwrap();
        assert!(error.to_string().contains("fs (1 × 1 double), cube (2 × 2 × 2 double)"), "{error}");
        assert!(open(made(&[]), about()).err().unwrap().to_string().contains("there is nothing"));
    }
}
