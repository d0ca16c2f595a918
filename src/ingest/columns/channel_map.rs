//! `CHANNEL=[-]COLUMN[:UNIT]`: which column of a drive is which channel, as the user says it.

use super::channels;
use super::channels::TABLE;
use super::quantity::{Conversion, Quantity, other_unit, stem};
use crate::error::{Error, ErrorKind, Result, nearest};
use crate::ingest::formats::head::{Head, Kind, list};
use crate::signal::names;

/// A column that is to be read as a channel, whatever it is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelMap {
    channel: &'static str,
    column: String,
}

/// A column of a file that a map names.
pub(crate) struct Mapped {
    /// The channel of the map; a wheel's speed in m/s is that over ground.
    pub channel: &'static str,
    pub column: usize,
    /// To SI, with the sign.
    pub conversion: Conversion,
    /// Whether the unit stands neither in the map nor in the file.
    pub unit_assumed: bool,
}

impl ChannelMap {
    /// Reads `gyro_z_rad_s=gy_rad_s`, `gyro_z_rad_s=-wz:deg/s`, `gyro_z_rad_s=gz_raw:1/131 deg/s`. The unit may be left out
    /// where the column's name has it; a minus turns the sign, a factor before the unit counts, and alone it is one to SI.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] without `=`, without a column, or for a channel that no command reads.
    pub fn parse(text: &str) -> Result<Self> {
        let usage = |found: String| Error::new(ErrorKind::Usage, "--map", found);
        let (channel, column) = text.split_once('=').ok_or_else(|| {
            usage(format!("{text:?} has no \"=\"")).hint("write CHANNEL=COLUMN, such as gyro_z_rad_s=-wz:deg/s")
        })?;
        let entry = channels::of(channel.trim()).ok_or_else(|| {
            let all: Vec<_> = TABLE.iter().map(|e| e.channel).collect();
            let meant = nearest(channel, all.iter().copied());
            usage(format!("no channel {:?}", channel.trim())).hint(format!("there are {}", all.join(", "))).meant(meant)
        })?;
        let column = column.trim().to_string();
        if column.trim_start_matches('-').is_empty() {
            return Err(usage(format!("{text:?} names no column")).hint("write CHANNEL=COLUMN"));
        }
        Ok(Self { channel: entry.channel, column })
    }

    /// The channel, as in [`crate::signal::names`].
    #[must_use]
    pub fn channel(&self) -> &'static str {
        self.channel
    }

    /// Whether a column of `channel` is spoken for: that of a wheel in either of its quantities.
    pub(crate) fn claims(&self, channel: &str) -> bool {
        let over_ground = match self.channel {
            names::WHEEL_LEFT => names::WHEEL_LEFT_SPEED,
            names::WHEEL_RIGHT => names::WHEEL_RIGHT_SPEED,
            own => own,
        };
        [self.channel, over_ground].contains(&channel)
    }

    /// Text right of the `=`: sign, column and unit.
    #[must_use]
    pub fn column(&self) -> &str {
        &self.column
    }

    /// The column in a file, if it is there; signs and colons may be part of its name.
    pub(crate) fn find(&self, source: &str, heads: &[Head]) -> Result<Option<Mapped>> {
        let whole = self.column.as_str();
        let bare = whole.strip_prefix('-').map(|rest| (-1.0, rest.trim_start()));
        for (sign, text) in [Some((1.0, whole)), bare].into_iter().flatten() {
            let parted = text.rsplit_once(':').map(|(name, unit)| (name.trim_end(), Some(unit)));
            for (name, unit) in [Some((text, None)), parted].into_iter().flatten() {
                if let Some(column) = position(heads, name) {
                    return self.settle(source, heads, column, sign, unit).map(Some);
                }
            }
        }
        Ok(None)
    }

    fn settle(&self, source: &str, heads: &[Head], column: usize, sign: f64, unit: Option<&str>) -> Result<Mapped> {
        let head = &heads[column];
        let at = |kind: ErrorKind, found: String| Error::new(kind, source, found).at(format!("column {:?}", head.name));
        if head.kind != Kind::Number {
            return Err(at(ErrorKind::Column, format!("holds {}, not numbers", head.type_name))
                .hint(format!("map a column of numbers to {}", self.channel)));
        }
        let (channel, quantity) = self.meant(head, unit);
        let named = stem(&head.name, quantity).unit;
        let written = unit.or(named.as_deref()).or(head.unit.as_deref()).map(|u| u.trim_matches(['(', ')', '[', ']']));
        let hint = || format!("state the unit: --map {}={}:UNIT with {}", self.channel, head.name, quantity.units());
        let conversion = match written {
            Some(text) => quantity
                .parse_scaled(text)
                .ok_or_else(|| at(ErrorKind::Unit, format!("{text:?} is no unit of {}", self.channel)).hint(hint()))?,
            None => match other_unit(&head.name, quantity) {
                Some(other) => {
                    let found = format!("its name ends in {other:?}, which is no unit of {}", self.channel);
                    return Err(at(ErrorKind::Unit, found).hint(hint()));
                }
                None => Conversion { factor: 1.0, offset: 0.0 },
            },
        };
        let conversion = Conversion { factor: sign * conversion.factor, offset: sign * conversion.offset };
        Ok(Mapped { channel, column, conversion, unit_assumed: written.is_none() })
    }

    pub(crate) fn quantity(&self) -> Quantity {
        channels::of(self.channel).map_or(Quantity::Rate, |e| e.quantity)
    }

    /// The channel and its quantity; a wheel in a unit of speed is its speed over ground.
    fn meant(&self, head: &Head, unit: Option<&str>) -> (&'static str, Quantity) {
        let over_ground = match self.channel {
            names::WHEEL_LEFT => names::WHEEL_LEFT_SPEED,
            names::WHEEL_RIGHT => names::WHEEL_RIGHT_SPEED,
            channel => return (channel, self.quantity()),
        };
        let named = stem(&head.name, Quantity::Speed).unit;
        let written = unit.or(named.as_deref()).or(head.unit.as_deref());
        let is_speed = written.is_some_and(|u| Quantity::Speed.parse(u.trim_matches(['(', ')', '[', ']'])).is_some());
        if is_speed { (over_ground, Quantity::Speed) } else { (self.channel, self.quantity()) }
    }

    /// The column without sign and unit; a colon before no unit is part of its name.
    fn bare_column(&self) -> &str {
        let text = self.column.strip_prefix('-').unwrap_or(&self.column).trim_start();
        let quantities = [self.quantity(), Quantity::Speed];
        let is_unit = |unit: &str| quantities.iter().any(|q| q.parse_scaled(unit).is_some());
        text.rsplit_once(':').filter(|(_, unit)| is_unit(unit)).map_or(text, |(name, _)| name.trim_end())
    }

    /// The error for a map whose column is in none of the files.
    pub(crate) fn missing(&self, files: &[(String, &[Head])]) -> Error {
        let sources: Vec<_> = files.iter().map(|f| f.0.as_str()).collect();
        let there: Vec<_> = match files {
            [(_, heads)] => vec![list(heads)],
            _ => files.iter().map(|(source, heads)| format!("{} in {source}", list(heads))).collect(),
        };
        let found = format!("no column {:?} for {}; there are {}", self.bare_column(), self.channel, there.join("; "));
        Error::new(ErrorKind::Column, sources.join(", "), found)
            .hint(format!("name one of them: --map {}=COLUMN[:UNIT]", self.channel))
            .meant(nearest(self.bare_column(), files.iter().flat_map(|f| f.1).map(|h| h.name.as_str())))
    }
}

/// A column as written, or else without regard to case.
fn position(heads: &[Head], name: &str) -> Option<usize> {
    let exact = heads.iter().position(|h| h.name == name);
    exact.or_else(|| heads.iter().position(|h| h.name.trim().eq_ignore_ascii_case(name.trim())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heads(names: &[&str]) -> Vec<Head> {
        let head = |n: &&str| Head::number(*n, "number");
        names.iter().map(head).collect()
    }

    fn found(map: &str, columns: &[&str]) -> Result<Option<(usize, f64, bool)>> {
        let found = ChannelMap::parse(map)?.find("d.csv", &heads(columns))?;
        Ok(found.map(|m| (m.column, m.conversion.factor, m.unit_assumed)))
    }

    #[test]
    fn sign_and_unit_are_read() {
        let deg = std::f64::consts::PI / 180.0;
        assert_eq!(found("gyro_z_rad_s=gy_rad_s", &["gx_rad_s", "gy_rad_s"]), Ok(Some((1, 1.0, false))));
        assert_eq!(found("gyro_z_rad_s=-wz:deg/s", &["wz"]), Ok(Some((0, -deg, false))));
        assert_eq!(found("gyro_z_rad_s=wz_dps", &["wz_dps"]), Ok(Some((0, deg, false))));
        assert_eq!(found("gyro_z_rad_s=-WZ", &["wz"]), Ok(Some((0, -1.0, true))));
        assert_eq!(found("odo_speed_m_s=v:km/h", &["v"]), Ok(Some((0, 1.0 / 3.6, false))));
        assert_eq!(found("x_m=east_m", &["north_m"]), Ok(None));
        assert_eq!(found("gyro_z_rad_s=foo:mrad/s", &["foo"]), Ok(Some((0, 1e-3, false))));
        assert_eq!(found("wheel_left_rad_s=foo:rpm", &["foo"]), Ok(Some((0, std::f64::consts::PI / 30.0, false))));
        assert_eq!(found("gyro_z_rad_s=gz_raw:1/131 deg/s", &["gz_raw"]), Ok(Some((0, 1.0 / 131.0 * deg, false))));
        assert_eq!(found("gyro_z_rad_s=-gz_raw:0.5", &["gz_raw"]), Ok(Some((0, -0.5, false))));
    }

    #[test]
    fn a_wheel_in_m_s_is_its_speed_over_ground() {
        let channel = |map: &str, column: &str| {
            ChannelMap::parse(map).unwrap().find("d.csv", &heads(&[column])).unwrap().map(|m| m.channel)
        };
        assert_eq!(channel("wheel_left_rad_s=vl:m/s", "vl"), Some(names::WHEEL_LEFT_SPEED));
        assert_eq!(channel("wheel_right_rad_s=vr_mm_s", "vr_mm_s"), Some(names::WHEEL_RIGHT_SPEED));
        assert_eq!(channel("wheel_left_rad_s=vl", "vl"), Some(names::WHEEL_LEFT));
    }

    #[test]
    fn signs_and_colons_may_belong_to_the_name() {
        assert_eq!(found("x_m=-a", &["a", "-a"]), Ok(Some((1, 1.0, true))));
        assert_eq!(found("x_m=imu:x", &["imu:x"]), Ok(Some((0, 1.0, true))));
        assert_eq!(found("x_m=-imu:x:mm", &["imu:x"]), Ok(Some((0, -1e-3, false))));
        // and a unit does not, where no such column is there
        for (map, named) in [("gyro_z_rad_s=-fo:mdeg/s", "\"fo\""), ("x_m=imu:x", "\"imu:x\"")] {
            let text = ChannelMap::parse(map).unwrap().missing(&[("d.csv".into(), &heads(&["wz"]))]).to_string();
            assert!(text.contains(&format!("no column {named}")), "{text}");
        }
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        for (map, columns, part) in [
            ("gyro_z_rad_s", &["wz"][..], "\"=\""),
            ("gyro=wz", &["wz"], "there are gyro_z_rad_s"),
            ("x_m=", &["a"], "no column"),
            ("x_m=-", &["a"], "no column"),
            ("gyro_z_rad_s=wz:m/s", &["wz"], "rad/s, mrad/s"),
            ("gyro_z_rad_s=yaw_deg", &["yaw_deg"], "\"deg\""),
        ] {
            let text = found(map, columns).unwrap_err().to_string();
            assert!(text.contains(part), "{map}: {text}");
        }
    }
}
