//! A table whose gyro is turned into the frame of the robot: the rate about an axis of the robot becomes a column.

use super::gravity::{Accelerometer, Gravity};
use super::gyro::find_gyro;
use super::mounting::Mounting;
use super::names::{Axis, Role};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::assemble::query::GyroQuery;
use crate::ingest::formats::head::{Head, Kind};
use crate::ingest::formats::source::{Batch, Column, ColumnFacts, Facts, Source, Take};

/// A table with the rate about an axis of the robot in the place of the sensor's rates.
pub(crate) struct Mounted {
    inner: Box<dyn Source>,
    /// Heads of the table, and after them that of the rate.
    heads: Vec<Head>,
    /// Columns of the sensor's rates that count, and their weights.
    parts: Vec<(usize, f64)>,
    /// The accelerometer, which shows gravity while the sensor rests; `None` without one.
    accelerometer: Option<Accelerometer>,
    gravity: Gravity,
}

impl Mounted {
    /// The table `inner` of the file `source`, whose gyro is mounted as the query says. With what there is to tell.
    pub(crate) fn new(
        source: &str,
        inner: Box<dyn Source>,
        mounting: &Mounting,
        query: &GyroQuery,
    ) -> Result<(Self, Option<String>)> {
        if query.column.is_some() {
            return Err(Error::new(ErrorKind::Usage, "--column", "names one column, and a mounting turns three")
                .hint("leave out --column, or --mounting"));
        }
        let mut heads = inner.heads().to_vec();
        let aligned = *mounting == Mounting::ALIGNED;
        let parts = if aligned {
            vec![(find_gyro(source, &heads, query.axis)?, 1.0)]
        } else {
            parts(source, &heads, mounting.axis(query.axis))?
        };
        let unit = unit(source, &heads, &parts, query)?;
        // readers of the name learn the axis from it: that of the robot
        let (own, told) = if aligned {
            (heads[parts[0].0].name.clone(), None)
        } else {
            let own = format!("robot_gyro_{}", query.axis);
            let told = format!("{own} = {}, as the mounting has it", formula(&heads, &parts));
            (own, Some(told))
        };
        // the rates of the sensor's axes are nobody else's business
        for head in heads.iter_mut().filter(|h| matches!(h.named().role, Role::Gyro(_))) {
            (head.role, head.kind) = (Some(Role::Other), Kind::Other);
        }
        let accelerometer = Accelerometer::find(&heads);
        let mut head = Head::number(own, "number").with_role(Role::Gyro(Some(query.axis)));
        head.unit = unit;
        heads.push(head);
        let gravity = Gravity::new(mounting, query.axis == Axis::Z && query.reversed);
        Ok((Self { inner, heads, parts, accelerometer, gravity }, told))
    }

    /// The table of a drive with the rate about the robot's z axis. The accelerometer is not asked: a robot that drives also
    /// accelerates.
    pub(crate) fn of_drive(
        source: &str,
        inner: Box<dyn Source>,
        mounting: &Mounting,
    ) -> Result<(Self, Option<String>)> {
        let (turned, told) = Self::new(source, inner, mounting, &GyroQuery::default())?;
        if let Some(Head { unit: None, .. }) = turned.heads.last() {
            return Err(Error::new(
                ErrorKind::Unit,
                source,
                "the columns of the gyro that is to be turned name no unit",
            )
            .hint("name it in all of them, such as gyro_x_rad_s or gx_dps"));
        }
        Ok((Self { accelerometer: None, ..turned }, told))
    }
}

/// The columns of the gyro's axes and their weights in the rate. Axes of weight zero need not be there.
fn parts(source: &str, heads: &[Head], weights: [f64; 3]) -> Result<Vec<(usize, f64)>> {
    let mut parts: Vec<(usize, f64)> = Vec::new();
    let needed: Vec<String> =
        Axis::ALL.iter().zip(weights).filter(|(_, w)| *w != 0.0).map(|(a, _)| a.to_string()).collect();
    let hint = format!(
        "this mounting needs the rates of the sensor's axes {}, in columns whose names say so, such as gyro_x",
        needed.join(", ")
    );
    for (axis, weight) in Axis::ALL.into_iter().zip(weights).filter(|(_, w)| *w != 0.0) {
        let column = find_gyro(source, heads, axis).map_err(|e| e.hint(&hint))?;
        if parts.iter().any(|p| p.0 == column) {
            let found = format!("column {:?} is the only gyro, and its name says no axis", heads[column].name);
            return Err(Error::new(ErrorKind::Column, source, found).hint(&hint));
        }
        parts.push((column, weight));
    }
    Ok(parts)
}

/// The one unit of all parts.
fn unit(source: &str, heads: &[Head], parts: &[(usize, f64)], query: &GyroQuery) -> Result<Option<String>> {
    let of = |part: &(usize, f64)| heads[part.0].named().unit.or_else(|| heads[part.0].unit.clone());
    let first = parts.first().and_then(of);
    match parts.iter().find(|p| of(p) != first) {
        Some(other) if query.unit.is_none() => {
            let said = |unit: Option<String>| unit.unwrap_or_else(|| "none".into());
            let (a, b) = (&heads[parts[0].0].name, &heads[other.0].name);
            let found = format!("{a:?} and {b:?} name different units: {} and {}", said(first), said(of(other)));
            Err(Error::new(ErrorKind::Unit, source, found)
                .hint("a mounting adds them: name the same unit in all three columns, or state it with --unit"))
        }
        _ => Ok(first),
    }
}

fn formula(heads: &[Head], parts: &[(usize, f64)]) -> String {
    let mut out = String::new();
    for (i, (column, weight)) in parts.iter().enumerate() {
        let sign = match (i, *weight < 0.0) {
            (0, false) => "",
            (0, true) => "-",
            (_, false) => " + ",
            (_, true) => " - ",
        };
        let size = weight.abs();
        let times = if size == 1.0 { String::new() } else { format!("{size:.6} ") };
        out += &format!("{sign}{times}{}", heads[*column].name);
    }
    out
}

/// The rate of the rows of `batch`; missing where a part is.
fn turned(batch: &Batch, parts: &[(usize, f64)]) -> Column {
    let mut values = vec![0.0; batch.rows];
    for (column, weight) in parts {
        let part = &batch.columns[*column];
        let origin = part.origin as f64;
        values.iter_mut().zip(&part.values).for_each(|(sum, v)| *sum += weight * (v + origin));
    }
    Column { origin: 0, values }
}

impl Source for Mounted {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn rows(&self) -> Option<u64> {
        self.inner.rows()
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { inner, parts, accelerometer, mut gravity, .. } = *self;
        let columns = inner.heads().len();
        let mut needed = wanted[..columns].to_vec();
        let turns = wanted[columns];
        if turns {
            parts.iter().for_each(|p| needed[p.0] = true);
            accelerometer.iter().flat_map(|a| a.columns).for_each(|c| needed[c] = true);
        }
        let mut facts = inner.read(&needed, &mut |mut batch| {
            let rate = if turns { turned(&batch, &parts) } else { Column::default() };
            if let (true, Some(accelerometer)) = (turns, accelerometer) {
                gravity.add(&batch, accelerometer);
            }
            // what was read for the rate alone is not held
            for (column, _) in batch.columns.iter_mut().zip(wanted).filter(|(_, w)| !**w) {
                *column = Column::default();
            }
            batch.columns.push(rate);
            take(batch)
        })?;
        let bad = parts.iter().filter_map(|p| facts.columns[p.0].bad.clone()).min_by_key(|b| b.0.row);
        facts.columns.push(ColumnFacts { resolution: 0.0, bad });
        facts.notes.extend(gravity.text());
        Ok(facts)
    }
}
