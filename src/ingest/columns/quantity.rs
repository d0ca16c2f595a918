//! Quantity of a channel, and the units in which files hold it.

use super::names;
use super::names::Role;
use crate::units::{RateUnit, TimeUnit};
use std::f64::consts::PI;

/// A physical quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// Angular rate.
    Rate,
    /// Speed.
    Speed,
    /// Length.
    Length,
    /// Angle.
    Angle,
    /// Torque.
    Torque,
    /// Temperature.
    Temperature,
    /// Voltage.
    Voltage,
    /// Time.
    Time,
    /// Ticks of an encoder.
    Count,
    /// Electric current.
    Current,
}

/// SI value = factor · value + offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Conversion {
    pub factor: f64,
    pub offset: f64,
}

impl Quantity {
    const ALL: [Self; 10] = [
        Self::Rate,
        Self::Speed,
        Self::Length,
        Self::Angle,
        Self::Torque,
        Self::Temperature,
        Self::Voltage,
        Self::Time,
        Self::Count,
        Self::Current,
    ];

    /// The unit inside.
    pub(crate) fn si(self) -> &'static str {
        match self {
            Self::Rate => "rad/s",
            Self::Speed => "m/s",
            Self::Length => "m",
            Self::Angle => "rad",
            Self::Torque => "N·m",
            Self::Temperature => "°C",
            Self::Voltage => "V",
            Self::Time => "s",
            Self::Count => "ticks",
            Self::Current => "A",
        }
    }

    /// Accepted units, as a list for messages.
    pub(crate) fn units(self) -> &'static str {
        match self {
            Self::Rate => "rad/s, mrad/s, deg/s, mdeg/s, deg/h, rpm, rev/s, deg/min",
            Self::Speed => "m/s, cm/s, mm/s, km/h, mph, kn",
            Self::Length => "m, cm, mm, km",
            Self::Angle => "rad, mrad, deg",
            Self::Torque => "Nm, mNm",
            Self::Temperature => "degC, K, degF",
            Self::Voltage => "V, mV",
            Self::Time => "s, ms, us, ns",
            Self::Count => "ticks, counts",
            Self::Current => "A, mA",
        }
    }

    /// Reads a unit with a factor before it, or a factor alone, which is then one to SI: `1/131 deg/s`, `0.0175`.
    pub(crate) fn parse_scaled(self, text: &str) -> Option<Conversion> {
        let Some((scale, unit)) = factor_and_unit(text) else { return self.parse(text) };
        let Conversion { factor, offset } =
            unit.map_or(Some(Conversion { factor: 1.0, offset: 0.0 }), |u| self.parse(u))?;
        Some(Conversion { factor: scale * factor, offset })
    }

    /// Reads a unit as people write it: `km/h`, `km_h`, `kph`.
    pub(crate) fn parse(self, unit: &str) -> Option<Conversion> {
        let key: String = unit
            .trim()
            .to_lowercase()
            .replace(['°', 'º'], "deg")
            .chars()
            .filter(|&c| c != '^')
            .map(|c| if "/ -.·*".contains(c) { '_' } else { c })
            .collect();
        let key = key.trim_matches('_');
        let factor = match self {
            Self::Rate => match key {
                "rpm" | "rev_min" | "1_min" | "r_min" | "u_min" => 2.0 * PI / 60.0,
                "rev_s" | "turn_s" | "turns_s" => 2.0 * PI,
                "rad_min" => 1.0 / 60.0,
                "deg_min" => PI / 180.0 / 60.0,
                "urad_s" | "µrad_s" => 1e-6,
                _ => RateUnit::parse(unit)?.to_rad_s(),
            },
            Self::Speed => match key {
                "m_s" | "mps" | "m_per_s" | "m_sec" | "m_s_1" | "meters_per_second" => 1.0,
                "cm_s" => 1e-2,
                "mm_s" => 1e-3,
                "km_h" | "kph" | "kmh" | "kmph" | "km_per_h" => 1.0 / 3.6,
                "mph" => 0.447_04,
                "kn" | "kt" | "knots" => 1852.0 / 3600.0,
                _ => return None,
            },
            Self::Length => match key {
                "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
                "cm" => 1e-2,
                "mm" => 1e-3,
                "km" => 1e3,
                _ => return None,
            },
            Self::Angle => match key {
                "rad" | "radian" | "radians" => 1.0,
                "mrad" => 1e-3,
                "deg" | "degree" | "degrees" => PI / 180.0,
                _ => return None,
            },
            Self::Torque => match key {
                "n_m" | "nm" | "newton_meter" | "newton_metre" => 1.0,
                // words of a name part where a capital letter follows a small one: mNm, mA
                "mn_m" | "mnm" | "m_nm" => 1e-3,
                _ => return None,
            },
            Self::Temperature | Self::Voltage => {
                let role = if self == Self::Voltage { Role::Supply } else { Role::Temperature };
                let (factor, offset) = names::environment_factor(role, unit)?;
                return Some(Conversion { factor, offset });
            }
            Self::Time => TimeUnit::parse(unit)?.to_s(),
            Self::Count => match key {
                "ticks" | "tick" | "counts" | "count" => 1.0,
                _ => return None,
            },
            Self::Current => match key {
                "a" | "amp" | "amps" | "ampere" | "amperes" => 1.0,
                "ma" | "m_a" | "milliamp" | "milliamps" => 1e-3,
                _ => return None,
            },
        };
        Some(Conversion { factor, offset: 0.0 })
    }
}

/// A factor at the beginning of `text`, a number or a ratio of two, and the unit behind it: `1/131:deg/s`, `0.5 rad/s`, `2`.
pub(crate) fn factor_and_unit(text: &str) -> Option<(f64, Option<&str>)> {
    let text = text.trim();
    let (factor, unit) = match text.split_once([':', ' ']) {
        Some((factor, unit)) => (factor, Some(unit.trim()).filter(|u| !u.is_empty())),
        None => (text, None),
    };
    let value = match factor.split_once('/') {
        Some((a, b)) => a.trim().parse::<f64>().ok()? / b.trim().parse::<f64>().ok()?,
        None => factor.parse().ok()?,
    };
    value.is_finite().then_some((value, unit))
}

/// A column's name as its words without the unit, joined by `_`, and the unit as written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Stem {
    pub words: String,
    pub unit: Option<String>,
}

/// Takes the unit of `quantity` off a column's name: in brackets, or as the last words.
pub(crate) fn stem(name: &str, quantity: Quantity) -> Stem {
    let (stem, bracketed) = names::split_brackets(name.trim().trim_start_matches(['#', '%', '.', '/']));
    let mut words = names::words_of(&stem);
    let mut unit = bracketed;
    if unit.is_none() {
        // the whole name must not be its unit
        let tail = |n: usize| words[words.len() - n..].join("_");
        let long = (1..=3).rev().filter(|n| *n < words.len()).find(|n| quantity.parse(&tail(*n)).is_some());
        if let Some(n) = long {
            unit = Some(tail(n));
            words.truncate(words.len() - n);
        }
    }
    // recorders put the kind of message first
    while words.len() > 1 && ["field", "data", "msg"].contains(&words[0].as_str()) {
        words.remove(0);
    }
    Stem { words: words.join("_"), unit }
}

/// The unit of another quantity than `quantity` at the end of `name`, if there is one beyond doubt.
pub(crate) fn other_unit(name: &str, quantity: Quantity) -> Option<String> {
    // single letters end many names that are no units
    let found = Quantity::ALL.into_iter().filter(|q| *q != quantity).filter_map(|q| stem(name, q).unit);
    found.filter(|unit| unit.chars().count() > 1 && quantity.parse(unit).is_none()).max_by_key(String::len)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_that_are_offered_can_be_read_and_the_first_is_si() {
        for quantity in Quantity::ALL {
            let mut units = quantity.units().split(", ");
            let first = quantity.parse(units.next().unwrap()).unwrap();
            assert_eq!((first.factor, first.offset), (1.0, 0.0), "{quantity:?}");
            assert_eq!(quantity.parse(quantity.si()), Some(first), "{quantity:?}");
            units.for_each(|u| assert!(quantity.parse(u).is_some(), "{u}"));
            assert_eq!(quantity.parse("furlong"), None);
        }
        assert!((Quantity::Speed.parse("km/h").unwrap().factor * 3.6 - 1.0).abs() < 1e-15);
        assert!((Quantity::Rate.parse("rpm").unwrap().factor * 60.0 - 2.0 * PI).abs() < 1e-15);
        assert_eq!(Quantity::Rate.parse("U/min"), Quantity::Rate.parse("rpm"));
        assert_eq!(Quantity::Temperature.parse("K").unwrap().offset, -273.15);
    }

    #[test]
    fn names_are_parted_from_their_units() {
        for (name, quantity, words, unit) in [
            ("odo_v_m_s", Quantity::Speed, "odo_v", Some("m_s")),
            ("vehicleSpeed [km/h]", Quantity::Speed, "vehicle_speed", Some("km/h")),
            ("truth_yaw_rad", Quantity::Angle, "truth_yaw", Some("rad")),
            ("torque_left_n_m", Quantity::Torque, "torque_left", Some("n_m")),
            ("torque_left_mNm", Quantity::Torque, "torque_left", Some("m_nm")),
            ("current_left_mA", Quantity::Current, "current_left", Some("m_a")),
            ("field.twist.twist.linear.x", Quantity::Speed, "twist_twist_linear_x", None),
            ("m", Quantity::Length, "m", None),
        ] {
            let found = stem(name, quantity);
            assert_eq!((found.words.as_str(), found.unit.as_deref()), (words, unit), "{name}");
        }
        assert_eq!(other_unit("yaw_deg", Quantity::Rate).as_deref(), Some("deg"));
        assert_eq!(other_unit("odo_v", Quantity::Speed), None);
        assert_eq!(other_unit("speed_m_s", Quantity::Speed), None);
    }
}
