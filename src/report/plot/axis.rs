//! Axes: from values to places, and ticks at round numbers.

use super::{LARGEST, bad};
use crate::error::Result;

/// Quantity, unit, scale and limits of an axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    pub(in crate::report) label: String,
    pub(in crate::report) unit: String,
    logarithmic: bool,
    limits: Option<[f64; 2]>,
    included: Vec<f64>,
}

impl Axis {
    /// A linear axis; `unit` stands in brackets after `label`, and is empty for pure numbers.
    #[must_use]
    pub(crate) fn linear(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), logarithmic: false, limits: None, included: Vec::new() }
    }

    /// A logarithmic axis: values must be positive.
    #[must_use]
    pub(crate) fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { logarithmic: true, ..Self::linear(label, unit) }
    }

    /// Shows exactly `low..high`, whatever the data; what lies outside is cut off.
    #[must_use]
    pub(crate) fn limits(mut self, low: f64, high: f64) -> Self {
        self.limits = Some([low, high]);
        self
    }

    /// Shows `value` too, even if no data reach it.
    #[must_use]
    pub(crate) fn include(mut self, value: f64) -> Self {
        self.included.push(value);
        self
    }

    /// Whether the limits do not depend on the data.
    pub(super) fn is_prescribed(&self) -> bool {
        self.limits.is_some()
    }

    pub(in crate::report) fn is_logarithmic(&self) -> bool {
        self.logarithmic
    }

    /// The scale for `data` (finite values and NaN), with `margin` (share of the range) on both sides.
    pub(in crate::report) fn scale(&self, data: impl Iterator<Item = f64>, margin: f64) -> Result<Scale> {
        let place = || format!("axis {:?}", self.label);
        let [low, high] = match self.limits {
            Some(limits) => limits,
            None => range(data.chain(self.included.iter().copied())),
        };
        if low > high {
            return Err(bad(place(), "has no finite value to show"));
        }
        for end in [low, high] {
            if end.is_nan() || end.abs() > LARGEST {
                return Err(bad(place(), format!("{end:e} cannot be shown")));
            }
            if self.logarithmic && end <= 1.0 / LARGEST {
                return Err(bad(place(), format!("{end:e} has no place on a logarithmic axis")));
            }
        }
        let scale = if self.logarithmic {
            let (low, high) = (low.log10(), high.log10());
            let (low, high) = if high - low < 0.1 { (low - 0.5, high + 0.5) } else { (low, high) };
            Scale { low, high, logarithmic: true }
        } else {
            let largest = low.abs().max(high.abs());
            let flat = high - low <= 1e-11 * largest || largest < 1.0 / LARGEST;
            let about = if !flat {
                0.0
            } else if largest < 1.0 / LARGEST {
                1.0
            } else {
                0.05 * largest
            };
            Scale { low: low - about, high: high + about, logarithmic: false }
        };
        Ok(if self.limits.is_some() { scale } else { scale.widened(margin) })
    }

    /// The label with its unit, and with the offset and power of ten that the tick labels omit.
    pub(in crate::report) fn text(&self, left_out: LeftOut) -> String {
        let LeftOut { offset, exponent } = left_out;
        let mut text = self.label.clone();
        if let Some(offset) = offset {
            text = format!("{text} − {offset}").trim_start().to_string();
        }
        let factor = if exponent == 0 { String::new() } else { format!("10{}", superscript(exponent)) };
        let unit = [factor.as_str(), self.unit.as_str()].join(" ");
        if unit.trim().is_empty() { text } else { format!("{text} ({})", unit.trim()).trim_start().to_string() }
    }
}

/// Smallest and largest number, NaN left out; (∞, -∞) where there are none.
pub(super) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.filter(|v| !v.is_nan()).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// Maps values to 0..1. Logarithmic scales hold the decimal logarithms of their ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::report) struct Scale {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Scale {
    /// Share of the way from the low to the high end; beyond them, less than 0 or more than 1.
    pub(crate) fn share(self, value: f64) -> f64 {
        let value = if self.logarithmic { value.log10() } else { value };
        (value - self.low) / (self.high - self.low)
    }

    /// Low and high end, in units of the axis (decades where it is logarithmic).
    pub(crate) fn ends(self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// High end less low end, in units of the axis (decades where it is logarithmic).
    pub(crate) fn span(self) -> f64 {
        self.high - self.low
    }

    /// Wider by `margin` times its span on both sides.
    pub(crate) fn widened(self, margin: f64) -> Self {
        let about = margin * self.span();
        Self { low: self.low - about, high: self.high + about, ..self }
    }

    /// Ticks at round values, about `count` of them.
    pub(crate) fn ticks(self, count: usize) -> Ticks {
        if self.logarithmic { self.log_ticks(count) } else { self.linear_ticks(count) }
    }

    fn linear_ticks(self, count: usize) -> Ticks {
        let step = round_step(self.span() / count.max(1) as f64);
        // counted from a multiple near the low end, so that the counter stays small
        let first = (self.low / step).ceil();
        let at: Vec<f64> = (0..)
            .map(|i| (first + f64::from(i)) * step)
            .take_while(|v| *v <= self.high + 1e-9 * step)
            .take(4 * count.max(1) + 2)
            .collect();
        let (labels, left_out) = linear_labels(&at, step);
        Ticks { major: at.into_iter().zip(labels).collect(), minor: Vec::new(), left_out }
    }

    fn log_ticks(self, count: usize) -> Ticks {
        let (first, last) = (self.low.floor() as i32, self.high.ceil() as i32);
        let inside = |v: f64| (-1e-9..=1.0 + 1e-9).contains(&self.share(v));
        let decades: Vec<i32> = (first..=last).filter(|d| inside(decade(*d))).collect();
        let fine = |digits: &[f64]| -> Vec<f64> {
            let all = (first..=last).flat_map(|d| digits.iter().map(move |m| m * decade(d)));
            all.filter(|v| inside(*v)).collect()
        };
        if decades.len() >= 2 {
            let every = decades.len().div_ceil(count.max(1)) as i32;
            let minor = if every == 1 { fine(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]) } else { Vec::new() };
            let kept = decades.iter().filter(|d| d.rem_euclid(every) == 0);
            let plain = is_plain(first..=last);
            let major = kept.map(|d| (decade(*d), power_label(1, *d, plain))).collect();
            return Ticks { major, minor, left_out: LeftOut::default() };
        }
        // less than two decades: digits within them
        let digits: &[f64] = if self.span() > 0.7 { &[1.0, 2.0, 5.0] } else { &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0] };
        let plain = is_plain(first..=last);
        let major: Vec<(f64, String)> = (first..=last)
            .flat_map(|d| digits.iter().map(move |m| (m * decade(d), power_label(*m as u8, d, plain))))
            .filter(|(v, _)| inside(*v))
            .collect();
        if major.len() >= 2 {
            return Ticks { major, minor: fine(&[3.0, 4.0, 6.0, 7.0, 8.0, 9.0]), left_out: LeftOut::default() };
        }
        // a sliver of a decade looks linear
        let (low, high) = (10f64.powf(self.low), 10f64.powf(self.high));
        Scale { low, high, logarithmic: false }.linear_ticks(count)
    }
}

fn decade(exponent: i32) -> f64 {
    10f64.powi(exponent)
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().find(|d| d * power >= least * (1.0 - 1e-9));
    digit.unwrap_or(10.0) * power
}

/// Offset and power of ten that are taken out of the values that tick labels show.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::report) struct LeftOut {
    /// Subtracted, as text.
    pub offset: Option<String>,
    /// Power of ten that is divided out.
    pub exponent: i32,
}

/// Where an axis has its marks.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::report) struct Ticks {
    /// Value and label.
    pub major: Vec<(f64, String)>,
    /// Values without labels.
    pub minor: Vec<f64>,
    pub left_out: LeftOut,
}

/// Labels of multiples of `step`: few digits, an exponent or offset for the axis where numbers would be long.
fn linear_labels(at: &[f64], step: f64) -> (Vec<String>, LeftOut) {
    const MOST_DIGITS: i32 = 6;
    let largest = at.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if largest <= 0.0 {
        return (at.iter().map(|_| "0".to_string()).collect(), LeftOut::default());
    }
    let digits_of = |v: f64| v.log10().floor() as i32;
    let step_digit = digits_of(step * (1.0 + 1e-9));
    let plain_digits = digits_of(largest).max(0) - step_digit.min(0) + 1;
    let places = |exponent: i32| (exponent - step_digit).max(0) as usize;
    let write = |offset: f64, exponent: i32| -> Vec<String> {
        let unit = 10f64.powi(exponent);
        at.iter().map(|v| number((v - offset) / unit, places(exponent))).collect()
    };
    if plain_digits <= MOST_DIGITS && digits_of(largest) < MOST_DIGITS {
        return (write(0.0, 0), LeftOut::default());
    }
    if digits_of(largest) - step_digit < MOST_DIGITS {
        let exponent = digits_of(largest).div_euclid(3) * 3;
        return (write(0.0, exponent), LeftOut { offset: None, exponent });
    }
    // the ticks differ only in late digits: count them from the first
    let offset = at.iter().copied().fold(f64::INFINITY, f64::min);
    let exponent = if (-3..MOST_DIGITS).contains(&step_digit) { 0 } else { step_digit.div_euclid(3) * 3 };
    let text = if (-3..9).contains(&digits_of(largest)) {
        number(offset, places(0))
    } else {
        let e = digits_of(largest);
        format!("{}·10{}", number(offset / 10f64.powi(e), places(e)), superscript(e))
    };
    // a negative offset in brackets: "− (−5)"
    let text = if offset < 0.0 { format!("({text})") } else { text };
    (write(offset, exponent), LeftOut { offset: Some(text), exponent })
}

/// `value` with a true minus sign, and no minus before zero.
pub(in crate::report) fn number(value: f64, places: usize) -> String {
    let text = format!("{value:.places$}");
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    match text.strip_prefix('-') {
        Some(digits) if zero => digits.to_string(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

fn superscript(exponent: i32) -> String {
    let raised = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(0x2070 + (digit as u32 - u32::from(b'0'))).unwrap_or(digit),
    };
    exponent.to_string().chars().map(raised).collect()
}

/// Whether all powers of ten from first to last are short when they are written out.
fn is_plain(exponents: std::ops::RangeInclusive<i32>) -> bool {
    *exponents.start() >= -3 && *exponents.end() <= 4
}

/// digit · 10^exponent, written out where `plain`.
fn power_label(digit: u8, exponent: i32, plain: bool) -> String {
    if plain {
        let places = (-exponent).max(0) as usize;
        format!("{:.places$}", f64::from(digit) * decade(exponent))
    } else if digit == 1 {
        format!("10{}", superscript(exponent))
    } else {
        format!("{digit}·10{}", superscript(exponent))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn labels(low: f64, high: f64) -> (Vec<String>, String) {
        let axis = Axis::linear("Rate", "rad/s").limits(low, high);
        let ticks = axis.scale(std::iter::empty(), 0.0).unwrap().ticks(5);
        (ticks.major.into_iter().map(|t| t.1).collect(), axis.text(ticks.left_out))
    }

    #[test]
    fn ticks_are_round_and_short() {
        assert_eq!(
            labels(-1.0, 1.0),
            (vec!["−1.0".into(), "−0.5".into(), "0.0".into(), "0.5".into(), "1.0".into()], "Rate (rad/s)".into())
        );
        assert_eq!(labels(0.0, 5600.0).0, ["0", "2000", "4000"]);
        let (ticks, text) = labels(0.0, 1e-7);
        assert_eq!((ticks.join(" "), text), ("0 20 40 60 80 100".into(), "Rate (10⁻⁹ rad/s)".into()));
        let (ticks, text) = labels(2.0, 2.0 + 1e-7);
        assert_eq!((ticks.join(" "), text), ("0 20 40 60 80 100".into(), "Rate − 2.00000000 (10⁻⁹ rad/s)".into()));
    }

    #[test]
    fn log_ticks_are_decades_or_digits() {
        let ticks = |low, high, count| {
            let scale = Axis::log("", "").limits(low, high).scale(std::iter::empty(), 0.0).unwrap();
            scale.ticks(count).major.into_iter().map(|t| t.1).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(ticks(1e-5, 1e-2, 6), "10⁻⁵ 10⁻⁴ 10⁻³ 10⁻²");
        assert_eq!(ticks(1.0, 1e12, 5), "10⁰ 10³ 10⁶ 10⁹ 10¹²");
        assert_eq!(ticks(2e-4, 7e-4, 6), "2·10⁻⁴ 3·10⁻⁴ 4·10⁻⁴ 5·10⁻⁴ 6·10⁻⁴");
        assert_eq!(ticks(0.9, 30.0, 6), "1 10");
    }

    #[test]
    fn values_that_have_no_place_are_refused_by_the_name_of_the_axis() {
        let refused = |axis: Axis, v: &[f64]| axis.scale(v.iter().copied(), 0.0).unwrap_err().to_string();
        assert!(refused(Axis::linear("Rate", ""), &[]).contains("Rate"));
        assert!(refused(Axis::linear("Rate", ""), &[f64::NAN]).contains("no finite value"));
        assert!(refused(Axis::linear("Rate", ""), &[1.0, f64::INFINITY]).contains("inf"));
        assert!(refused(Axis::log("Rate", ""), &[0.0, 1.0]).contains("logarithmic"));
    }

    proptest! {
        #[test]
        fn labels_tell_ticks_apart_and_stay_short(centre in -1e3..1e3, order in -12..12, span in -9.0..3.0_f64) {
            let (centre, half) = (centre * 10f64.powi(order), 10f64.powf(f64::from(order) + span));
            let axis = Axis::linear("Rate", "rad/s").limits(centre - half, centre + half);
            let ticks = axis.scale(std::iter::empty(), 0.0).unwrap().ticks(6).major;
            prop_assert!((2..=8).contains(&ticks.len()), "{ticks:?}");
            for pair in ticks.windows(2) {
                prop_assert!(pair[0].0 < pair[1].0 && pair[0].1 != pair[1].1, "{ticks:?}");
            }
            prop_assert!(ticks.iter().all(|t| t.1.chars().count() <= 9), "{ticks:?}");
        }
    }
}
