//! Units that read well on an axis.

use crate::units::{RAD_S_PER_DEG_S, RateUnit};

/// A unit of an axis: its name, and what one SI unit is in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::report) struct Quantity {
    pub unit: &'static str,
    pub per_si: f64,
}

impl Quantity {
    /// `si` in this unit.
    pub(crate) fn of(self, si: f64) -> f64 {
        si * self.per_si
    }
}

/// The last unit in which `largest` is 1 or more; the last of all if there is none. `units` go from large to small.
fn readable(units: &[Quantity], largest: f64) -> Quantity {
    // a hair below one still reads as one
    let fits = units.iter().find(|u| u.of(largest.abs()) >= 0.999);
    fits.or(units.last()).copied().unwrap_or(Quantity { unit: "", per_si: 1.0 })
}

/// Angular rates up to `largest_rad_s`: `unit`, or rad/s with the prefix that reads well.
pub(in crate::report) fn rate(largest_rad_s: f64, unit: Option<RateUnit>) -> Quantity {
    let Some(unit) = unit else {
        let units = [
            Quantity { unit: "rad/s", per_si: 1.0 },
            Quantity { unit: "mrad/s", per_si: 1e3 },
            Quantity { unit: "µrad/s", per_si: 1e6 },
            Quantity { unit: "nrad/s", per_si: 1e9 },
        ];
        return if largest_rad_s == 0.0 { units[1] } else { readable(&units, largest_rad_s) };
    };
    let name = match unit {
        RateUnit::RadPerS => "rad/s",
        RateUnit::MilliradPerS => "mrad/s",
        RateUnit::DegPerS => "°/s",
        RateUnit::MillidegPerS => "m°/s",
        RateUnit::DegPerH => "°/h",
    };
    Quantity { unit: name, per_si: 1.0 / unit.to_rad_s() }
}

/// Times up to `largest_s`. Minutes begin where seconds would need four digits.
pub(in crate::report) fn time(largest_s: f64) -> Quantity {
    let largest_s = largest_s.abs();
    if largest_s >= 10.0 * 86_400.0 {
        Quantity { unit: "d", per_si: 1.0 / 86_400.0 }
    } else if largest_s >= 10_800.0 {
        Quantity { unit: "h", per_si: 1.0 / 3600.0 }
    } else if largest_s >= 1000.0 {
        Quantity { unit: "min", per_si: 1.0 / 60.0 }
    } else if largest_s >= 0.2 || largest_s == 0.0 {
        Quantity { unit: "s", per_si: 1.0 }
    } else {
        Quantity { unit: "ms", per_si: 1e3 }
    }
}

/// Angles up to `largest_rad`, in degrees: headings are read on a compass.
pub(in crate::report) fn angle(largest_rad: f64) -> Quantity {
    let per_si = 1.0 / RAD_S_PER_DEG_S;
    if largest_rad.abs() * per_si >= 0.1 {
        Quantity { unit: "°", per_si }
    } else {
        Quantity { unit: "m°", per_si: 1e3 * per_si }
    }
}

/// Lengths up to `largest_m`.
pub(in crate::report) fn length(largest_m: f64) -> Quantity {
    let largest_m = largest_m.abs();
    if largest_m >= 10_000.0 {
        Quantity { unit: "km", per_si: 1e-3 }
    } else if largest_m >= 0.1 {
        Quantity { unit: "m", per_si: 1.0 }
    } else {
        Quantity { unit: "mm", per_si: 1e3 }
    }
}

/// `seconds` in the unit that reads well, with `digits` significant digits: `10.2 min`.
pub(in crate::report) fn duration(seconds: f64, digits: usize) -> String {
    if seconds.is_infinite() {
        return "∞".into();
    }
    // where a duration stands alone, 90 s reads better than 1.5 min, but 300 s worse than 5 min
    let quantity = if seconds.abs() >= 180.0 { time(seconds.abs().max(1000.0)) } else { time(seconds) };
    format!("{} {}", significant(quantity.of(seconds), digits), quantity.unit)
}

/// `value` with `digits` significant digits and no trailing zeros.
pub(in crate::report) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    let places = (digits as i32 - 1 - magnitude).clamp(0, 12) as usize;
    let text = format!("{value:.places$}");
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    short.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_chosen_to_read_well() {
        assert_eq!(rate(2e-3, None).unit, "mrad/s");
        assert_eq!(rate(0.5, None).unit, "mrad/s");
        assert_eq!(rate(2e-12, None).unit, "nrad/s");
        assert_eq!(rate(0.0, None).unit, "mrad/s");
        assert_eq!(rate(2e-3, Some(RateUnit::DegPerH)).unit, "°/h");
        let names: Vec<_> = [0.05, 30.0, 5600.0, 2e4, 1e7].iter().map(|t| time(*t).unit).collect();
        assert_eq!(names, ["ms", "s", "min", "h", "d"]);
        let names: Vec<_> = [0.02, 0.5, 9000.0, 2e4].iter().map(|l| length(*l).unit).collect();
        assert_eq!(names, ["mm", "m", "m", "km"]);
        assert_eq!((angle(1e-4).unit, angle(0.01).unit), ("m°", "°"));
    }

    #[test]
    fn durations_are_short() {
        assert_eq!(duration(612.3, 3), "10.2 min");
        assert_eq!(duration(90.0, 3), "90 s");
        assert_eq!(duration(0.01, 3), "10 ms");
        assert_eq!(duration(f64::INFINITY, 3), "∞");
        assert_eq!(significant(-0.001_234_5, 3), "−0.00123");
    }
}
