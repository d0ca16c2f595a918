//! One field of a text file: a number, nothing, a date, or words.

/// What a field says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell {
    Number(f64),
    Missing,
    Words,
}

/// Words that stand for a missing value, in lower case.
const MISSING: [&str; 9] = ["null", "none", "na", "n/a", "#n/a", "nil", "-", "--", "?"];

/// Reads a field; `comma` is the decimal separator `,` of tables with `;` between the fields.
#[inline]
pub(super) fn read(field: &[u8], comma: bool) -> Cell {
    let field = field.trim_ascii();
    if field.is_empty() {
        return Cell::Missing;
    }
    let Ok(text) = std::str::from_utf8(field) else { return Cell::Words };
    let parsed = if comma && text.contains(',') { text.replace(',', ".").parse() } else { text.parse::<f64>() };
    match parsed {
        Ok(x) if x.is_nan() => Cell::Missing,
        Ok(x) => Cell::Number(x),
        Err(_) if MISSING.contains(&text.to_ascii_lowercase().as_str()) => Cell::Missing,
        Err(_) => Cell::Words,
    }
}

/// Whole and fractional part of a plain decimal number, so that the whole part keeps all of its digits.
pub(super) fn split(field: &[u8], comma: bool) -> Option<(i64, f64)> {
    let text = std::str::from_utf8(field.trim_ascii()).ok()?;
    let point = if comma { ',' } else { '.' };
    let Some((whole, fraction)) = text.split_once(point) else { return Some((text.parse().ok()?, 0.0)) };
    if !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    let part: f64 = if fraction.is_empty() { 0.0 } else { format!("0.{fraction}").parse().ok()? };
    Some((whole.parse().ok()?, sign * part))
}

/// Decimals and significant digits of a number as it is written: what it is rounded to.
pub(super) fn digits(field: &[u8]) -> (i32, i32) {
    let (mut decimals, mut significant, mut after_point) = (0, 0, false);
    let mut exponent = 0;
    let mut bytes = field.iter();
    while let Some(&b) = bytes.next() {
        match b {
            b'.' | b',' => after_point = true,
            b'0'..=b'9' => {
                decimals += i32::from(after_point);
                significant += i32::from(significant > 0 || b != b'0');
            }
            b'e' | b'E' => {
                exponent = std::str::from_utf8(bytes.as_slice()).ok().and_then(|t| t.trim().parse().ok()).unwrap_or(0);
                break;
            }
            _ => {}
        }
    }
    (i32::saturating_sub(decimals, exponent), significant)
}

/// Nanoseconds since 1970-01-01 UTC of an ISO 8601 date with time; without a zone it is taken as UTC.
pub(super) fn instant_ns(field: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(field.trim_ascii()).ok()?;
    // a bare number or date is not an instant
    if text.len() < 16 || !text.contains(':') {
        return None;
    }
    let stamp = match text.parse::<jiff::Timestamp>() {
        Ok(stamp) => stamp,
        Err(_) => text.parse::<jiff::civil::DateTime>().ok()?.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp(),
    };
    i64::try_from(stamp.as_nanosecond()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_numbers_missing_or_words() {
        for (text, cell) in [
            ("1.5", Cell::Number(1.5)),
            (" -2e-3 ", Cell::Number(-2e-3)),
            ("+7", Cell::Number(7.0)),
            ("", Cell::Missing),
            ("NaN", Cell::Missing),
            ("NULL", Cell::Missing),
            ("N/A", Cell::Missing),
            ("ERR", Cell::Words),
            ("1.2.3", Cell::Words),
            ("1,5", Cell::Words),
        ] {
            assert_eq!(read(text.as_bytes(), false), cell, "{text:?}");
        }
        assert_eq!(read(b"1,5", true), Cell::Number(1.5));
    }

    #[test]
    fn large_numbers_keep_their_digits() {
        assert_eq!(split(b"1700000000123456789", false), Some((1_700_000_000_123_456_789, 0.0)));
        assert_eq!(split(b"1700000000.25", false), Some((1_700_000_000, 0.25)));
        assert_eq!(split(b"-3.5", false), Some((-3, -0.5)));
        assert_eq!(split(b"1e9", false), None);
    }

    #[test]
    fn digits_as_written() {
        assert_eq!(digits(b"0.010068756"), (9, 8));
        assert_eq!(digits(b"12.50"), (2, 4));
        assert_eq!(digits(b"1.5e-3"), (4, 2));
    }

    #[test]
    fn dates_with_and_without_zone() {
        let a = instant_ns(b"2024-05-01T12:00:00.5Z").unwrap();
        assert_eq!(instant_ns(b"2024-05-01 12:00:00.5"), Some(a));
        assert_eq!(instant_ns(b"2024-05-01T14:00:00.5+02:00"), Some(a));
        assert_eq!(a % 1_000_000_000, 500_000_000);
        assert_eq!(instant_ns(b"1700000000000000000"), None);
    }
}
