//! The columns of a file that a recording of a gyro needs.

use super::query::GyroQuery;
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::clean::clock;
use crate::ingest::clean::clock::TimeColumn;
use crate::ingest::columns::gyro::find_gyro;
use crate::ingest::columns::names::Role;
use crate::ingest::formats::head::{Head, Kind};
use crate::signal::names as channel;

/// Columns of a file that a recording needs.
pub(crate) struct Plan {
    pub gyro: usize,
    pub time: TimeColumn,
    pub temperature: Option<usize>,
    pub supply: Option<usize>,
    pub notes: Vec<String>,
}

impl Plan {
    /// Finds the columns by their names.
    pub(crate) fn of(source: &str, heads: &[Head], query: &GyroQuery) -> Result<Self> {
        let mut notes = Vec::new();
        let gyro = match &query.column {
            Some(name) => clock::find(source, heads, name, "--column")?,
            None => find_gyro(source, heads, query.axis)?,
        };
        if heads[gyro].kind != Kind::Number {
            let found = format!("column {:?} holds {}, not numbers", heads[gyro].name, heads[gyro].type_name);
            return Err(Error::new(ErrorKind::Column, source, found).hint("name a column of numbers with --column"));
        }
        let time = match query.rate_hz {
            Some(_) => TimeColumn::Rows,
            None => clock::choose(source, heads, query.time.as_deref(), false)?,
        };
        if time.index() == Some(gyro) {
            let found = format!("column {:?} cannot be both the time and the rate", heads[gyro].name);
            return Err(Error::new(ErrorKind::Column, source, found).hint("name them with --time and --column"));
        }
        let mut beside = |role: Role, canonical: &str| one_of(heads, role, canonical, &mut notes);
        let temperature = beside(Role::Temperature, channel::TEMPERATURE);
        let supply = beside(Role::Supply, channel::SUPPLY);
        Ok(Self { gyro, time, temperature, supply, notes })
    }

    /// One flag a column.
    pub(crate) fn wanted(&self, columns: usize) -> Vec<bool> {
        let mut wanted = vec![false; columns];
        let time = match self.time {
            TimeColumn::One(i) => [Some(i), None],
            TimeColumn::Parts(a, b) => [Some(a), Some(b)],
            TimeColumn::Rows => [None, None],
        };
        for i in time.into_iter().chain([Some(self.gyro), self.temperature, self.supply]).flatten() {
            wanted[i] = true;
        }
        wanted
    }
}

/// The column of a side channel: the only one of its role, or the one with the canonical name.
fn one_of(heads: &[Head], role: Role, canonical: &str, notes: &mut Vec<String>) -> Option<usize> {
    let numbers = (0..heads.len()).filter(|&i| heads[i].kind == Kind::Number);
    let found: Vec<usize> = numbers.filter(|&i| heads[i].named().role == role).collect();
    match found[..] {
        [] => None,
        [one] => Some(one),
        _ => {
            let named = found.iter().copied().find(|&i| heads[i].name == canonical);
            if named.is_none() {
                let names: Vec<_> = found.iter().map(|&i| heads[i].name.as_str()).collect();
                notes.push(format!("none of {} is used: rename the right one to {canonical}", names.join(", ")));
            }
            named
        }
    }
}
