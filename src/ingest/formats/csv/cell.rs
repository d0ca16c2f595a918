//! One field of a text file: a number, nothing, a date, or words.

/// Content of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cell {
    Number(f64),
    Missing,
    Words,
}

/// Words that stand for a missing value, in lower case.
const MISSING: [&str; 9] = ["null", "none", "na", "n/a", "#n/a", "nil", "-", "--", "?"];

/// Reads a field; `comma` is the decimal separator `,` of tables with `;` between the fields.
#[inline]
pub(crate) fn read(field: &[u8], comma: bool) -> Cell {
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
pub(crate) fn split(field: &[u8], comma: bool) -> Option<(i64, f64)> {
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
pub(crate) fn digits(field: &[u8]) -> (i32, i32) {
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

/// Type of a column of times of day without a date.
pub(crate) const CLOCK_TIME: &str = "clock time";
/// Nanoseconds of a day.
pub(crate) const DAY_NS: i64 = 86_400_000_000_000;

/// Nanoseconds since 1970-01-01 UTC of a date with time, ISO 8601 or as [`date_day`] reads it, or since midnight of a time
/// alone; without a zone it is taken as UTC.
pub(crate) fn instant_ns(field: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(field.trim_ascii()).ok()?;
    // a bare number or date is not an instant
    if !text.contains(':') {
        return None;
    }
    if let Some(ns) = clock_ns(text) {
        return Some(ns);
    }
    if let Some((date, time)) = text.split_once(' ')
        && let Some(day) = date_day(date)
    {
        return clock_ns(time)?.checked_add(day.checked_mul(DAY_NS)?);
    }
    let stamp = match text.parse::<jiff::Timestamp>() {
        Ok(stamp) => stamp,
        Err(_) if text.len() < 16 => return None,
        Err(_) => text.parse::<jiff::civil::DateTime>().ok()?.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp(),
    };
    i64::try_from(stamp.as_nanosecond()).ok()
}

/// Nanoseconds since midnight of `12:34:56.789`, `1:02:03 PM`.
fn clock_ns(text: &str) -> Option<i64> {
    let upper = text.trim().to_ascii_uppercase();
    let (time, half) = match upper.strip_suffix("AM").map(|t| (t, 0)).or(upper.strip_suffix("PM").map(|t| (t, 12))) {
        Some((time, hours)) => (time.trim_end(), Some(hours)),
        None => (upper.as_str(), None),
    };
    let mut parts = time.split(':');
    let (hour, minute, seconds) = (parts.next()?, parts.next()?, parts.next()?);
    let (second, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, ""));
    let digits = |t: &str| t.bytes().all(|b| b.is_ascii_digit());
    let few = |t: &str| (1..=2).contains(&t.len()) && digits(t);
    if parts.next().is_some() || ![hour, minute, second].iter().all(|t| few(t)) || !digits(fraction) {
        return None;
    }
    let (mut hour, minute, second) =
        (hour.parse::<i64>().ok()?, minute.parse::<i64>().ok()?, second.parse::<i64>().ok()?);
    if let Some(half) = half {
        if !(1..=12).contains(&hour) {
            return None;
        }
        hour = hour % 12 + half;
    }
    if hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    let ns: i64 = format!("{fraction:0<9}").get(..9)?.parse().ok()?;
    Some(((hour * 60 + minute) * 60 + second) * 1_000_000_000 + ns)
}

/// Days since 1970-01-01 of `11/23/2026` (month first, unless that is no month) and `23.11.2026`.
fn date_day(text: &str) -> Option<i64> {
    let point = text.contains('.');
    let mut parts = text.split(if point { '.' } else { '/' });
    let (first, second, year) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() || year.len() != 4 {
        return None;
    }
    let (first, second, year): (i8, i8, i16) = (first.parse().ok()?, second.parse().ok()?, year.parse().ok()?);
    let (month, day) = if point || first > 12 { (second, first) } else { (first, second) };
    let date = jiff::civil::Date::new(year, month, day).ok()?;
    Some(date.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp().as_second().div_euclid(86_400))
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
    fn clock_times_and_dates_of_both_worlds() {
        let s = 1_000_000_000;
        assert_eq!(instant_ns(b"12:34:56.789"), Some((12 * 3600 + 34 * 60 + 56) * s + 789_000_000));
        assert_eq!(instant_ns(b"1:02:03 PM"), Some((13 * 3600 + 2 * 60 + 3) * s));
        assert_eq!(instant_ns(b"12:00:00 AM"), Some(0));
        let iso = instant_ns(b"2026-11-23T22:11:12Z");
        for text in ["11/23/2026 10:11:12 PM", "11/23/2026 22:11:12", "23/11/2026 22:11:12.000", "23.11.2026 22:11:12"]
        {
            assert_eq!(instant_ns(text.as_bytes()), iso, "{text}");
        }
        for text in
            ["12:34", "25:00:00", "13:00:00 PM", "1:2:3:4", "a:b:c", "1.5", "99/99/2026 10:00:00", "00:11:22:33:44:55"]
        {
            assert_eq!(instant_ns(text.as_bytes()), None, "{text}");
        }
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
