//! Numbers for people: as many digits as the standard deviation supports.

/// `value` to the second digit of `std`: (-1.753e-3, 1.9e-4) is `-1.75e-3`.
pub(super) fn known_digits(value: f64, std: f64) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "unknown".into() } else { "unbounded".into() };
    }
    if value == 0.0 {
        return "0".into();
    }
    let digits = if std > 0.0 && std.is_finite() {
        (value.abs().log10().floor() - std.log10().floor() + 1.0).clamp(1.0, 12.0)
    } else {
        5.0
    };
    significant(value, digits as usize + 1)
}

/// `value` with `digits` significant ones; exponents as `e-3`, plain between 0.01 and 100 000.
pub(super) fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "unknown".into() } else { "unbounded".into() };
    }
    if value == 0.0 {
        return "0".into();
    }
    let magnitude = value.abs().log10().floor() as i32;
    if (-2..5).contains(&magnitude) {
        let decimals = (digits as i32 - 1 - magnitude).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.*e}", digits.saturating_sub(1))
    }
}

/// A probability: `0.042`, `< 0.001`.
pub(super) fn probability(p: f64) -> String {
    match p {
        p if p.is_nan() => "unknown".into(),
        p if p < 0.001 => "< 0.001".into(),
        p => format!("{p:.3}"),
    }
}

/// A probability of [`probability`] behind its sign: "= 0.03", "< 0.001".
pub(super) fn equals(p: &str) -> String {
    if p.starts_with('<') { p.to_string() } else { format!("= {p}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_standard_deviation() {
        assert_eq!(known_digits(-1.7529e-3, 1.9e-4), "-1.75e-3");
        assert_eq!(known_digits(611.449, 110.0), "611");
        assert_eq!(known_digits(0.0, 1.0), "0");
        assert_eq!(known_digits(5.0, 0.0), "5.00000");
        assert_eq!(known_digits(f64::INFINITY, 1.0), "unbounded");
        assert_eq!(significant(12345.678, 3), "12346");
        assert_eq!(probability(0.0001), "< 0.001");
    }
}
