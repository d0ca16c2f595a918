//! Envelope of a long log: its extremes and means in slices of time, in one pass.

use super::{LARGEST, bad};
use crate::error::Result;
use crate::signal::TimeAxis;
use std::cmp::Ordering;

/// Samples that fall into one slice of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slice {
    /// Which slice, counted from the first sample.
    pub index: u64,
    /// Begin and end, s.
    pub from_s: f64,
    pub to_s: f64,
    pub low: f64,
    pub high: f64,
    pub mean: f64,
    pub count: u64,
}

/// Cuts `values` at `time` into slices of `width_s`. Slices without values are left out; NaN counts as missing.
///
/// # Errors
/// An infinite value, by its row and `name`; times that are not finite or run backwards.
pub(super) fn slices(name: &str, time: &TimeAxis, values: &[f64], width_s: f64) -> Result<Vec<Slice>> {
    let mut out: Vec<Slice> = Vec::new();
    if time.is_empty() {
        return Ok(out);
    }
    let start = time.at(0);
    // rounding must not push a sample that begins a slice into the one before
    const HAIR: f64 = 1e-6;
    let mut sum = 0.0;
    for (i, value) in values.iter().enumerate() {
        if value.is_nan() {
            continue;
        }
        let index = ((time.at(i) - start) / width_s + HAIR) as u64;
        match out.last_mut() {
            Some(slice) if slice.index == index => {
                slice.low = slice.low.min(*value);
                slice.high = slice.high.max(*value);
                slice.count += 1;
                sum += value;
                slice.mean = sum;
            }
            _ => {
                let from_s = start + index as f64 * width_s;
                sum = *value;
                out.push(Slice { index, from_s, to_s: from_s + width_s, low: sum, high: sum, mean: sum, count: 1 });
            }
        }
    }
    out.iter_mut().for_each(|slice| slice.mean /= slice.count as f64);
    if out.iter().any(|s| s.low < -LARGEST || s.high > LARGEST) {
        let row = values.iter().position(|v| v.abs() > LARGEST).unwrap_or(0);
        return Err(bad(format!("{name}, sample {row}"), format!("{:e} cannot be shown", values[row])));
    }
    Ok(out)
}

/// Refuses a time axis that cannot be drawn: not finite, or not increasing.
pub(super) fn check_time(time: &TimeAxis) -> Result<()> {
    let ends = match time {
        TimeAxis::Uniform { start_s, step_s, .. } if !(step_s.is_finite() && *step_s > 0.0 && start_s.is_finite()) => {
            return Err(bad("time", format!("start {start_s} s and step {step_s} s make no time axis")));
        }
        TimeAxis::Explicit(t) => {
            if let Some(i) = t.windows(2).position(|w| w[0].partial_cmp(&w[1]) != Some(Ordering::Less)) {
                return Err(bad(format!("time, sample {}", i + 1), format!("{} s after {} s", t[i + 1], t[i])));
            }
            [t.first(), t.last()].into_iter().flatten().copied().collect()
        }
        TimeAxis::Uniform { .. } if time.is_empty() => Vec::new(),
        TimeAxis::Uniform { .. } => vec![time.at(time.len() - 1)],
    };
    match ends.into_iter().find(|t| t.is_nan() || t.abs() > LARGEST) {
        Some(end) => Err(bad("time", format!("{end:e} s cannot be shown"))),
        None => Ok(()),
    }
}

/// Extremes as a band [t, low, high] whose steps are the slices; NaN where slices are missing between.
pub(super) fn extremes(slices: &[Slice]) -> Vec<[f64; 3]> {
    let mut band = Vec::with_capacity(2 * slices.len());
    for (i, slice) in slices.iter().enumerate() {
        if i > 0 && slices[i - 1].index + 1 != slice.index {
            band.push([f64::NAN; 3]);
        }
        band.push([slice.from_s, slice.low, slice.high]);
        band.push([slice.to_s, slice.low, slice.high]);
    }
    band
}

/// Means as a line [t, mean] through the middles of the slices; NaN where slices are missing between.
pub(super) fn means(slices: &[Slice]) -> Vec<[f64; 2]> {
    let mut line = Vec::with_capacity(slices.len());
    for (i, slice) in slices.iter().enumerate() {
        if i > 0 && slices[i - 1].index + 1 != slice.index {
            line.push([f64::NAN; 2]);
        }
        line.push([0.5 * (slice.from_s + slice.to_s), slice.mean]);
    }
    line
}

/// A line that looks like the one through `at(0) … at(rows - 1)`, with at most four points in each of `columns` equal
/// parts of the rows: the first, the extremes, the last. NaN stays where it fills a part.
pub(in crate::report) fn outline(rows: usize, at: impl Fn(usize) -> [f64; 2], columns: usize) -> Vec<[f64; 2]> {
    let size = rows.div_ceil(columns.max(1)).max(1);
    if size <= 4 {
        return (0..rows).map(at).collect();
    }
    let mut line = Vec::with_capacity(4 * columns);
    for begin in (0..rows).step_by(size) {
        let part = begin..rows.min(begin + size);
        let mut there = part.map(|i| (i, at(i))).filter(|(_, p)| !p[1].is_nan());
        let Some(first) = there.next() else {
            line.push([f64::NAN; 2]);
            continue;
        };
        let [mut low, mut high, mut last] = [first; 3];
        for row in there {
            low = if row.1[1] < low.1[1] { row } else { low };
            high = if row.1[1] > high.1[1] { row } else { high };
            last = row;
        }
        let (earlier, later) = if low.0 < high.0 { (low, high) } else { (high, low) };
        let mut kept = vec![first, earlier, later, last];
        kept.dedup_by_key(|row| row.0);
        line.extend(kept.into_iter().map(|row| row.1));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_hold_extremes_and_means_and_skip_gaps() {
        let time = TimeAxis::Explicit(vec![0.0, 1.0, 2.0, 3.0, 8.0, 9.0]);
        let out = slices("rate", &time, &[1.0, 3.0, f64::NAN, -2.0, 5.0, 7.0], 2.0).unwrap();
        let told: Vec<_> = out.iter().map(|s| (s.index, s.low, s.high, s.mean, s.count)).collect();
        assert_eq!(told, [(0, 1.0, 3.0, 2.0, 2), (1, -2.0, -2.0, -2.0, 1), (4, 5.0, 7.0, 6.0, 2)]);
        assert_eq!(extremes(&out).iter().filter(|b| b[0].is_nan()).count(), 1);
        assert_eq!(means(&out).len(), 4);
    }

    #[test]
    fn every_slice_of_a_uniform_log_has_its_share() {
        // 0.1 has no exact representation: the products round both ways
        let time = TimeAxis::Uniform { start_s: 3.7, step_s: 0.1, len: 10_000 };
        let out = slices("rate", &time, &vec![1.0; 10_000], 1.0).unwrap();
        assert!(out.len() == 1000 && out.iter().all(|s| s.count == 10));
    }

    #[test]
    fn what_cannot_be_drawn_is_named() {
        let time = TimeAxis::Uniform { start_s: 0.0, step_s: 1.0, len: 3 };
        let error = slices("rate", &time, &[0.0, f64::INFINITY, 0.0], 1.0).unwrap_err().to_string();
        assert!(error.contains("rate, sample 1") && error.contains("inf"), "{error}");
        assert!(check_time(&TimeAxis::Explicit(vec![0.0, 2.0, 1.0])).unwrap_err().to_string().contains("sample 2"));
        assert!(check_time(&TimeAxis::Explicit(vec![0.0, f64::NAN])).is_err());
        assert!(check_time(&TimeAxis::Explicit(vec![f64::NEG_INFINITY, 0.0])).is_err());
        assert!(check_time(&TimeAxis::Uniform { start_s: 0.0, step_s: 0.0, len: 3 }).is_err());
        assert!(check_time(&TimeAxis::Explicit(vec![])).is_ok());
    }

    #[test]
    fn an_outline_keeps_the_extremes() {
        let xs: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut ys: Vec<f64> = xs.iter().map(|x| (x * 1e-3).sin()).collect();
        (ys[777], ys[5001]) = (9.0, -9.0);
        let line = outline(xs.len(), |i| [xs[i], ys[i]], 500);
        assert!(line.len() <= 2000);
        assert!(line.contains(&[777.0, 9.0]) && line.contains(&[5001.0, -9.0]));
    }
}
