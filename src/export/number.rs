//! Numbers as they stand in exported files.

/// A number with its 95 % interval, where that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Known {
    /// The number.
    pub value: f64,
    /// Its 95 % interval.
    pub ci95: Option<[f64; 2]>,
}

impl Known {
    /// Stated, not estimated.
    #[must_use]
    pub(crate) fn exact(value: f64) -> Self {
        Self { value, ci95: None }
    }

    /// In another unit, or scaled by an exact number.
    #[must_use]
    pub(crate) fn times(self, factor: f64) -> Self {
        let scaled = self.ci95.map(|[a, b]| [a * factor, b * factor]);
        Self { value: self.value * factor, ci95: scaled.map(|[a, b]| if factor < 0.0 { [b, a] } else { [a, b] }) }
    }

    /// The square of a number that is not negative.
    #[must_use]
    pub(crate) fn squared(self) -> Self {
        Self { value: self.value * self.value, ci95: self.ci95.map(|[a, b]| [a * a, b * b]) }
    }
}

/// Digits that are written: single precision, which several targets read, comes back whole from nine.
const DIGITS: usize = 9;

/// `value` with nine significant digits, trailing zeros cut. There is always a decimal point and a signed exponent:
/// YAML 1.1 reads `1e-4` as text, ROS 2 and OpenCV take `200` for an integer.
#[must_use]
pub fn digits(value: f64) -> String {
    let scientific = format!("{value:.*e}", DIGITS - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |text: &str| {
        let cut = text.trim_end_matches('0');
        if cut.ends_with('.') { format!("{cut}0") } else { cut.to_string() }
    };
    if (-3..7).contains(&power) {
        let decimals = usize::try_from(DIGITS as i32 - 1 - power).unwrap_or(1).max(1);
        trimmed(&format!("{value:.decimals$}"))
    } else {
        format!("{}e{power:+03}", trimmed(mantissa))
    }
}

/// `value` rounded to the digits that the file holds.
#[must_use]
pub(crate) fn written(value: f64) -> f64 {
    digits(value).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn digits_suit_the_parsers() {
        for (value, text) in [
            (1.7e-4, "1.7e-04"),
            (1e-4, "1.0e-04"),
            (0.0, "0.0"),
            (200.0, "200.0"),
            (-2.4e-3, "-0.0024"),
            (1.0 / 3.0, "0.333333333"),
            (0.025_000_000_000_1, "0.025"),
            (1.0e9, "1.0e+09"),
            (-9_999_999.999_9, "-1.0e+07"),
            (123_456_789.0, "1.23456789e+08"),
        ] {
            assert_eq!(digits(value), text);
        }
    }

    #[test]
    fn a_negative_factor_turns_the_interval() {
        let known = Known { value: 2.0, ci95: Some([1.0, 3.0]) };
        assert_eq!(known.times(-2.0).ci95, Some([-6.0, -2.0]));
        assert_eq!(known.squared(), Known { value: 4.0, ci95: Some([1.0, 9.0]) });
    }

    proptest! {
        #[test]
        fn digits_come_back(mantissa in -9.999f64..9.999, power in -30i32..30) {
            let value = mantissa * 10f64.powi(power);
            let back = written(value);
            prop_assert!((back - value).abs() <= 0.500_001e-8 * value.abs());
            prop_assert!(digits(value).contains('.'));
            let single = value as f32;
            prop_assert_eq!(written(f64::from(single)) as f32, single);
        }
    }
}
