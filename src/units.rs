//! Units at the border: everything inside is SI `f64`; names and factors of what logs come in and reports go out in.

use std::f64::consts::PI;
use std::fmt;

/// rad/s of one °/s.
pub const RAD_S_PER_DEG_S: f64 = PI / 180.0;
/// rad/s of one °/h.
pub const RAD_S_PER_DEG_H: f64 = PI / 180.0 / 3600.0;
/// rad/√s of one °/√h (angle random walk).
pub const RAD_SQRT_S_PER_DEG_SQRT_H: f64 = PI / 180.0 / 60.0;
/// Standard gravity, m/s² (ISO 80000-3).
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// Unit of an angular rate column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RateUnit {
    /// rad/s
    RadPerS,
    /// mrad/s
    MilliradPerS,
    /// °/s
    DegPerS,
    /// m°/s
    MillidegPerS,
    /// °/h
    DegPerH,
}

impl RateUnit {
    /// All units, in the order in which they are offered to the user.
    pub const ALL: [Self; 5] = [Self::RadPerS, Self::MilliradPerS, Self::DegPerS, Self::MillidegPerS, Self::DegPerH];

    /// Factor to rad/s.
    #[must_use]
    pub fn to_rad_s(self) -> f64 {
        match self {
            Self::RadPerS => 1.0,
            Self::MilliradPerS => 1e-3,
            Self::DegPerS => RAD_S_PER_DEG_S,
            Self::MillidegPerS => 1e-3 * RAD_S_PER_DEG_S,
            Self::DegPerH => RAD_S_PER_DEG_H,
        }
    }

    /// Reads what a user writes after `--unit` or in a column name: `rad/s`, `rad_s`, `dps`, `deg/s`, `mdps`, `deg/h` ...
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let key: String = text
            .trim()
            .to_lowercase()
            .replace(['°', 'º'], "deg")
            .chars()
            .filter(|&c| c != '^')
            .map(|c| if c == '/' || c == ' ' || c == '-' || c == '.' { '_' } else { c })
            .collect();
        Some(match key.trim_matches('_') {
            "rad_s" | "rads" | "radps" | "rps" | "rad_per_s" | "rad_per_sec" | "rad_sec" | "rad_s_1" | "radians_s"
            | "radian_s" | "radians_per_second" | "rad_second" => Self::RadPerS,
            "mrad_s" | "mradps" | "mrad_s_1" => Self::MilliradPerS,
            "deg_s" | "degs" | "dps" | "degps" | "deg_per_s" | "deg_per_sec" | "deg_sec" | "deg_s_1" | "degree_s"
            | "degrees_s" | "degrees_per_second" | "deg_second" => Self::DegPerS,
            "mdps" | "mdeg_s" => Self::MillidegPerS,
            "deg_h" | "dph" | "deg_hr" | "deg_per_h" | "deg_hour" => Self::DegPerH,
            _ => return None,
        })
    }
}

impl fmt::Display for RateUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::RadPerS => "rad/s",
            Self::MilliradPerS => "mrad/s",
            Self::DegPerS => "deg/s",
            Self::MillidegPerS => "mdeg/s",
            Self::DegPerH => "deg/h",
        })
    }
}

/// Unit of a time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TimeUnit {
    /// seconds
    S,
    /// milliseconds
    Ms,
    /// microseconds
    Us,
    /// nanoseconds
    Ns,
}

impl TimeUnit {
    /// Factor to seconds.
    #[must_use]
    pub fn to_s(self) -> f64 {
        match self {
            Self::S => 1.0,
            Self::Ms => 1e-3,
            Self::Us => 1e-6,
            Self::Ns => 1e-9,
        }
    }

    /// Reads `s`, `sec`, `ms`, `us`, `µs`, `ns` and their usual spellings.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        Some(match text.trim().to_lowercase().as_str() {
            "s" | "sec" | "secs" | "second" | "seconds" => Self::S,
            "ms" | "msec" | "millis" | "milliseconds" => Self::Ms,
            "us" | "usec" | "µs" | "μs" | "micros" | "microseconds" => Self::Us,
            "ns" | "nsec" | "nanos" | "nanosec" | "nanoseconds" => Self::Ns,
            _ => return None,
        })
    }
}

impl fmt::Display for TimeUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::S => "s",
            Self::Ms => "ms",
            Self::Us => "us",
            Self::Ns => "ns",
        })
    }
}

/// A duration for people: `0 s`, `100 ms`, `12.3 s`, `4.2 min`, `1.5 h`, `2.3 d`.
#[must_use]
pub(crate) fn duration_text(seconds: f64) -> String {
    let s = seconds.abs();
    if !seconds.is_finite() {
        return "unbounded".into();
    }
    let (value, unit) = match s {
        0.0 => (0.0, "s"),
        _ if s < 1e-3 => (seconds * 1e6, "us"),
        _ if s < 1.0 => (seconds * 1e3, "ms"),
        _ if s < 120.0 => (seconds, "s"),
        _ if s < 7200.0 => (seconds / 60.0, "min"),
        _ if s < 172_800.0 => (seconds / 3600.0, "h"),
        _ => (seconds / 86_400.0, "d"),
    };
    let text = format!("{value:.1}");
    format!("{} {unit}", text.strip_suffix(".0").unwrap_or(&text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_reads_back_its_own_name() {
        for unit in RateUnit::ALL {
            assert_eq!(RateUnit::parse(&unit.to_string()), Some(unit));
        }
        for unit in [TimeUnit::S, TimeUnit::Ms, TimeUnit::Us, TimeUnit::Ns] {
            assert_eq!(TimeUnit::parse(&unit.to_string()), Some(unit));
        }
    }

    #[test]
    fn durations_read_well() {
        let cases =
            [(0.0, "0 s"), (0.1, "100 ms"), (1.0, "1 s"), (93.25, "93.2 s"), (5599.0, "93.3 min"), (1e5, "27.8 h")];
        for (seconds, text) in cases {
            assert_eq!(duration_text(seconds), text);
        }
    }

    #[test]
    fn factors_agree_with_their_definitions() {
        assert!((180.0 * RateUnit::DegPerS.to_rad_s() - PI).abs() < 1e-15);
        assert!((RateUnit::DegPerH.to_rad_s() * 3600.0 - RateUnit::DegPerS.to_rad_s()).abs() < 1e-18);
        assert_eq!(RateUnit::parse("°/s"), Some(RateUnit::DegPerS));
        assert_eq!(RateUnit::parse("rad s^-1"), Some(RateUnit::RadPerS));
        assert_eq!(RateUnit::parse("furlong"), None);
    }
}
