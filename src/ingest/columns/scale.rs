//! `NAME=FACTOR[:UNIT]`: numbers of a column that count something of the sensor's own, made numbers of a unit.

use super::channels;
use super::gyro::find_gyro;
use super::names::{Axis, Named, Role, is_raw};
use super::quantity;
use crate::error::{Error, ErrorKind, Result, nearest};
use crate::ingest::formats::head::{Head, Kind, list};
use crate::ingest::formats::source::{Column, Facts, Source, Take};

/// A factor on a column, or on the column that is a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    name: String,
    factor: f64,
    unit: Option<String>,
}

impl Scale {
    /// Reads `gz_raw=1/131:deg/s`, `gz_raw=1/131 deg/s`, `gyro_z_rad_s=1.02`. Without a unit the column keeps its own; counts,
    /// which are then no counts any more, have none.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] without `=`, or where no number other than zero stands behind it.
    pub fn parse(text: &str) -> Result<Self> {
        let usage = |found: String| {
            Error::new(ErrorKind::Usage, "--scale", found).hint("write NAME=FACTOR[:UNIT], such as gz_raw=1/131:deg/s")
        };
        let (name, value) = text.rsplit_once('=').ok_or_else(|| usage(format!("{text:?} has no \"=\"")))?;
        let (factor, unit) = quantity::factor_and_unit(value)
            .filter(|(factor, _)| *factor != 0.0)
            .ok_or_else(|| usage(format!("{value:?} begins with no factor")))?;
        if name.trim().is_empty() {
            return Err(usage(format!("{text:?} names no column")));
        }
        Ok(Self { name: name.trim().to_string(), factor, unit: unit.map(str::to_string) })
    }

    /// The column of a file, by its own name or that of its channel.
    fn find(&self, heads: &[Head]) -> Option<usize> {
        let by_name = heads.iter().position(|h| h.name == self.name);
        let by_name = by_name.or_else(|| heads.iter().position(|h| h.name.trim().eq_ignore_ascii_case(&self.name)));
        let by_axis = || {
            let axis = Axis::ALL.into_iter().find(|axis| self.name == format!("gyro_{axis}_rad_s"))?;
            find_gyro("", heads, axis).ok()
        };
        let by_channel = || {
            let found = channels::recognise(heads, &|_| false, &mut Vec::new());
            found.iter().find(|f| f.channel == self.name).map(|f| f.column)
        };
        by_name.or_else(by_axis).or_else(by_channel).filter(|&i| heads[i].kind == Kind::Number)
    }

    /// The error for a factor whose column is in none of the files.
    pub(crate) fn missing(&self, source: &str, heads: &[Head]) -> Error {
        let found = format!("no column of numbers {:?}; there are {}", self.name, list(heads));
        Error::new(ErrorKind::Column, source, found)
            .hint("name one of them: --scale COLUMN=FACTOR:UNIT")
            .meant(nearest(&self.name, heads.iter().map(|h| h.name.as_str())))
    }
}

/// A table with factors on some of its columns.
pub(crate) struct Scaled {
    inner: Box<dyn Source>,
    heads: Vec<Head>,
    factors: Vec<(usize, f64)>,
}

impl Scaled {
    /// The table `inner` with those of `scales` that are in it, which are marked in `used`.
    pub(crate) fn of(inner: Box<dyn Source>, scales: &[Scale], used: &mut [bool]) -> Box<dyn Source> {
        let mut heads = inner.heads().to_vec();
        let mut factors = Vec::new();
        for (scale, used) in scales.iter().zip(used) {
            let Some(column) = scale.find(inner.heads()) else { continue };
            *used = true;
            factors.push((column, scale.factor));
            let head = &mut heads[column];
            let Named { role, unit } = head.named();
            if scale.unit.is_some() || unit.as_deref().is_some_and(is_raw) {
                head.unit.clone_from(&scale.unit);
                // the name has a unit no more
                head.role = (role != Role::Other).then_some(role);
            }
        }
        if factors.is_empty() { inner } else { Box::new(Self { inner, heads, factors }) }
    }
}

impl Source for Scaled {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn rows(&self) -> Option<u64> {
        self.inner.rows()
    }

    fn hold(&mut self) {
        self.inner.hold();
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { inner, factors, .. } = *self;
        let mut facts = inner.read(wanted, &mut |mut batch| {
            for (column, factor) in &factors {
                let Column { origin, values } = &mut batch.columns[*column];
                let from = std::mem::take(origin) as f64;
                values.iter_mut().for_each(|v| *v = factor * (*v + from));
            }
            take(batch)
        })?;
        for (column, factor) in &factors {
            facts.columns[*column].resolution *= factor.abs();
        }
        Ok(facts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_and_units_are_read() {
        for (text, name, factor, unit) in [
            ("gz_raw=1/131:deg/s", "gz_raw", 1.0 / 131.0, Some("deg/s")),
            ("gz_raw=1/131 deg/s", "gz_raw", 1.0 / 131.0, Some("deg/s")),
            ("gyro_z_rad_s=-1.02", "gyro_z_rad_s", -1.02, None),
            ("a=b=2e-3:rad/s", "a=b", 2e-3, Some("rad/s")),
        ] {
            let scale = Scale { name: name.into(), factor, unit: unit.map(str::to_string) };
            assert_eq!(Scale::parse(text), Ok(scale), "{text}");
        }
        for text in ["gz_raw", "gz=", "gz=0", "gz=deg/s", "=2", "gz=1/0", "gz=nan"] {
            let error = Scale::parse(text).unwrap_err();
            assert!(
                error.kind == ErrorKind::Usage && error.to_string().contains("gz_raw=1/131:deg/s"),
                "{text}: {error}"
            );
        }
    }

    #[test]
    fn columns_are_found_by_their_name_and_by_their_channel() {
        let heads: Vec<Head> = ["t", "gz_raw", "vel_left_mm_s"].map(|n| Head::number(n, "number")).into();
        let find = |text: &str| Scale::parse(text).unwrap().find(&heads);
        assert_eq!(find("GZ_raw=2"), Some(1));
        assert_eq!(find("gyro_z_rad_s=2"), Some(1));
        assert_eq!(find("wheel_left_m_s=2"), Some(2));
        assert_eq!(find("gy_raw=2"), None);
        let error = Scale::parse("gz_rwa=2").unwrap().missing("d.csv", &heads).to_string();
        assert!(error.contains("did you mean \"gz_raw\""), "{error}");
    }
}
