//! The columns of a gyro among those of a file.

use super::names;
use super::names::{Axis, Role, tells_motion};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::formats::head::{Head, Kind, list};

/// Whether there is a gyro among the columns.
pub(crate) fn has_gyro(heads: &[Head]) -> bool {
    heads.iter().any(|h| matches!(h.named().role, Role::Gyro(_)) && !tells_motion(&h.name))
}

/// The rate column of `axis`.
pub(crate) fn find_gyro(source: &str, heads: &[Head], axis: Axis) -> Result<usize> {
    let roles: Vec<(usize, Option<Axis>)> = (0..heads.len())
        .filter(|&i| heads[i].kind == Kind::Number)
        .filter_map(|i| match heads[i].named().role {
            Role::Gyro(axis) => Some((i, axis)),
            _ => None,
        })
        .collect();
    let mut candidates: Vec<usize> = roles.iter().filter(|r| r.1 == Some(axis)).map(|r| r.0).collect();
    // a gyro of one axis, whose name says no axis
    if roles.iter().all(|r| r.1.is_none()) {
        candidates = roles.iter().map(|r| r.0).collect();
    }
    // counts beside numbers with a unit are those that the unit was made of
    let raw = |i: &usize| heads[*i].named().unit.is_some_and(|u| names::is_raw(&u)) && heads[*i].unit.is_none();
    if !candidates.iter().all(raw) {
        candidates.retain(|i| !raw(i));
    }
    match candidates[..] {
        [one] => Ok(one),
        [] => {
            let found = format!("no column of the gyro's {axis} axis; there are {}", list(heads));
            Err(Error::new(ErrorKind::Column, source, found)
                .hint("name the column with --column, or the axis with --axis"))
        }
        _ => {
            let names: Vec<_> = candidates.iter().map(|&i| heads[i].name.as_str()).collect();
            let found = format!("several columns could be the gyro's {axis} axis: {}", names.join(", "));
            Err(Error::new(ErrorKind::Column, source, found).hint(format!("name one: --column {:?}", names[0])))
        }
    }
}
