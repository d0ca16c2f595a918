//! Block moments: a sufficient summary of a log for models that are smooth in time, in one pass.
//!
//! The time axis is cut into blocks, the samples of each are projected on eight Legendre polynomials in
//! x = (t - mid)/half. A function f = Σ c_k P_k(x) then has Σ f y = c·m and Σ f² = cᵀ G c over the block, with the
//! moments m and the Gram matrix G: any number of fits cost no second look at the samples.
//!
//! Blocks grow with the time from the first sample (half width at most 1/16 of it) and start with single samples,
//! so that exp(-t/T) is exact to 7e-13 of its size at t = 0 for *every* T: (s/16)⁸ exp(-s)/15!! at its worst s = 8.

use super::log::TimeAxis;
use crate::error::{Error, ErrorKind, Result};
use crate::math::legendre::{self, COUNT};
use rayon::prelude::*;
use std::ops::Range;

/// Blocks of equal count and width share a Gram matrix.
#[derive(Debug, Clone)]
pub struct Class {
    /// Half the width from first to last sample, s.
    pub half_s: f64,
    /// Samples in a block.
    pub count: usize,
    /// Σ P_j P_k over the samples of a block.
    pub gram: [[f64; COUNT]; COUNT],
}

/// One block of consecutive samples.
#[derive(Debug, Clone)]
pub struct Block {
    /// Middle, counted from the log's first sample, s.
    pub mid_s: f64,
    /// Index into [`Moments::classes`].
    pub class: usize,
    /// Σ y P_k over the samples, y counted from [`Moments::reference`].
    pub moments: [f64; COUNT],
}

/// The moments of a series.
#[derive(Debug, Clone)]
pub struct Moments {
    /// Time of the first sample, s.
    pub first_s: f64,
    /// Last time minus first, s.
    pub span_s: f64,
    /// Median interval between samples, s.
    pub step_s: f64,
    /// Value that was subtracted from every sample, so that sums of squares keep their digits.
    pub reference: f64,
    /// Number of samples.
    pub count: usize,
    /// Σ y², y counted from `reference`.
    pub square_sum: f64,
    /// Kinds of blocks.
    pub classes: Vec<Class>,
    /// Blocks in order of time.
    pub blocks: Vec<Block>,
}

/// Number of blocks aimed at: enough to see noise colour, few enough that a fit costs microseconds.
const BLOCKS: usize = 512;
/// Stamps that are looked at together.
const PIECE: usize = 64;

impl Moments {
    /// Moments of `values` on `time`.
    ///
    /// # Errors
    /// [`ErrorKind::TooShort`] on an empty series, [`ErrorKind::Value`] if a value is not finite (with its row),
    /// [`ErrorKind::Time`] if times do not increase, [`ErrorKind::Column`] if the lengths differ.
    pub fn new(time: &TimeAxis, values: &[f64]) -> Result<Self> {
        if values.len() != time.len() {
            let found = format!("{} values on {} times", values.len(), time.len());
            return Err(Error::new(ErrorKind::Column, "log", found));
        }
        if values.is_empty() {
            return Err(Error::new(ErrorKind::TooShort, "log", "no samples").hint("record a longer log"));
        }
        let head = &values[..values.len().min(4096)];
        let reference = head.iter().sum::<f64>() / head.len() as f64;
        let mut out = Self {
            first_s: time.at(0),
            span_s: time.span_s(),
            step_s: time.median_step_s(),
            reference,
            count: values.len(),
            square_sum: 0.0,
            classes: Vec::new(),
            blocks: Vec::with_capacity(BLOCKS * 5 / 2),
        };
        let cap = (values.len() / BLOCKS).max(1).next_power_of_two();
        match time {
            TimeAxis::Uniform { step_s, .. } => out.uniform(*step_s, values, cap),
            TimeAxis::Explicit(t) => out.uneven(t, values, cap)?,
        }
        // a single look at the result finds what is not finite anywhere in the pass
        if !out.square_sum.is_finite() {
            return Err(not_finite(values));
        }
        Ok(out)
    }

    fn uniform(&mut self, step_s: f64, values: &[f64], cap: usize) {
        let (mut start, mut spans, mut tables) = (0, Vec::new(), Vec::new());
        while start < values.len() {
            let len = grown(start, cap).min(values.len() - start);
            if self.classes.last().is_none_or(|c| c.count != len) {
                let half_s = 0.5 * step_s * (len - 1) as f64;
                let table: Vec<_> = (0..len).map(|i| legendre::polynomials(lattice(i, len))).collect();
                self.classes.push(Class { half_s, count: len, gram: gram(&table) });
                tables.push(table);
            }
            spans.push((start, self.classes.len() - 1));
            start += len;
        }
        let of_span = |&(start, class): &(usize, usize)| {
            let len = self.classes[class].count;
            let (moments, squares) = project(&values[start..start + len], &tables[class], self.reference);
            (Block { mid_s: step_s * (start as f64 + 0.5 * (len - 1) as f64), class, moments }, squares)
        };
        let blocks: Vec<(Block, f64)> = spans.par_iter().map(of_span).collect();
        for (block, squares) in blocks {
            self.square_sum += squares;
            self.blocks.push(block);
        }
    }

    fn uneven(&mut self, t: &[f64], values: &[f64], cap: usize) -> Result<()> {
        let (mut start, mut spans) = (0, Vec::new());
        while start < values.len() {
            let widest = (t[start] - t[0]) / 8.0;
            let mut end = start + 1;
            while end < values.len() && end - start < cap && t[end] - t[start] <= widest {
                end += 1;
            }
            if let Some(i) = (start.max(1)..end).find(|&i| t[i] <= t[i - 1] || !t[i].is_finite()) {
                let found = format!("time {} s follows {} s", t[i], t[i - 1]);
                return Err(Error::new(ErrorKind::Time, "log", found)
                    .at(format!("sample {}", i + 1))
                    .hint("times must increase: sort the log, or cut it at the jump"));
            }
            spans.push(start..end);
            start = end;
        }
        let of_span = |table: &mut Vec<[f64; COUNT]>, span: &Range<usize>| {
            Uneven::new(&t[span.clone()], &values[span.clone()], t[0], self.reference, table)
        };
        let found: Vec<Uneven> = spans.par_iter().map_init(|| Vec::with_capacity(cap), of_span).collect();
        found.into_iter().for_each(|block| self.push(block));
        Ok(())
    }

    /// Adds the next block, the log beginning at `first_s`. Blocks of even times share their class, so that a log with a
    /// steady clock has a dozen of them.
    pub(super) fn add_block(&mut self, t: &[f64], values: &[f64], first_s: f64, last: &mut LastTable) {
        let Some(half_s) = even_half_s(t) else {
            last.class = None;
            return self.push(Uneven::new(t, values, first_s, self.reference, &mut last.table));
        };
        let alike = |c: &Class| c.count == t.len() && (c.half_s - half_s).abs() <= rounding_s(t);
        let class = last.class.filter(|k| alike(&self.classes[*k])).unwrap_or_else(|| {
            last.table.clear();
            last.table.extend((0..t.len()).map(|i| legendre::polynomials(lattice(i, t.len()))));
            self.classes.push(Class { half_s, count: t.len(), gram: gram(&last.table) });
            self.classes.len() - 1
        });
        last.class = Some(class);
        let (moments, squares) = project(values, &last.table, self.reference);
        self.square_sum += squares;
        self.blocks.push(Block { mid_s: 0.5 * (t[0] + t[t.len() - 1]) - first_s, class, moments });
    }

    fn push(&mut self, Uneven { class, mid_s, moments, squares }: Uneven) {
        self.square_sum += squares;
        self.classes.push(class);
        self.blocks.push(Block { mid_s, class: self.classes.len() - 1, moments });
    }

    /// The moments of the same log in another unit, `factor` times as large in numbers.
    pub(super) fn scale(&mut self, factor: f64) {
        self.reference *= factor;
        self.square_sum *= factor * factor;
        self.blocks.iter_mut().flat_map(|b| &mut b.moments).for_each(|m| *m *= factor);
    }
}

/// The polynomials at the samples of the block that was added last, and its class where its times were even.
#[derive(Debug, Default)]
pub(super) struct LastTable {
    table: Vec<[f64; COUNT]>,
    class: Option<usize>,
}

/// By how much the rounding of stamps as large as those of `t` can move an interval between two of them, s.
fn rounding_s(t: &[f64]) -> f64 {
    2.0 * f64::EPSILON * t[0].abs().max(t[t.len() - 1].abs())
}

/// Half the width of a block whose times are evenly spaced up to the rounding of its stamps, s.
fn even_half_s(t: &[f64]) -> Option<f64> {
    let (first, last, most) = (t[0], t[t.len() - 1], rounding_s(t));
    let step_s = if t.len() > 1 { (last - first) / (t.len() - 1) as f64 } else { 0.0 };
    // pieces, so that an uneven block is left early and the rest has no branches
    let even = |(piece, times): (usize, &[f64])| {
        let off = |(i, t): (usize, &f64)| (t - (first + step_s * (PIECE * piece + i) as f64)).abs();
        times.iter().enumerate().map(off).fold(0.0, f64::max) <= most
    };
    t.chunks(PIECE).enumerate().all(even).then_some(0.5 * (last - first))
}

/// A block of any times, with a class of its own.
struct Uneven {
    class: Class,
    mid_s: f64,
    moments: [f64; COUNT],
    squares: f64,
}

impl Uneven {
    fn new(t: &[f64], values: &[f64], first_s: f64, reference: f64, table: &mut Vec<[f64; COUNT]>) -> Self {
        let (first, last) = (t[0], t[t.len() - 1]);
        let (mid, half) = (0.5 * (first + last), 0.5 * (last - first));
        table.clear();
        table.extend(t.iter().map(|x| {
            let x = if half > 0.0 { (x - mid) / half } else { 0.0 };
            legendre::polynomials(x)
        }));
        let (moments, squares) = project(values, table, reference);
        let class = Class { half_s: half, count: values.len(), gram: gram(table) };
        Self { class, mid_s: mid - first_s, moments, squares }
    }
}

/// Length of the block that begins at sample `start`: a power of two up to an eighth of the way come so far.
fn grown(start: usize, cap: usize) -> usize {
    let eighth = (start / 8).max(1);
    let power = if eighth.is_power_of_two() { eighth } else { eighth.next_power_of_two() / 2 };
    power.min(cap)
}

/// Position of sample `i` of `len` on [-1, 1].
fn lattice(i: usize, len: usize) -> f64 {
    if len == 1 { 0.0 } else { (2.0 * i as f64 - (len - 1) as f64) / (len - 1) as f64 }
}

fn gram(table: &[[f64; COUNT]]) -> [[f64; COUNT]; COUNT] {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || summed(table),
    )
}

#[inline(always)]
fn summed(table: &[[f64; COUNT]]) -> [[f64; COUNT]; COUNT] {
    let mut g = [[0.0; COUNT]; COUNT];
    for p in table {
        for (row, a) in g.iter_mut().zip(p) {
            for (cell, b) in row.iter_mut().zip(p) {
                *cell += a * b;
            }
        }
    }
    g
}

/// Σ y P_k and Σ y² of one block. Even polynomials see the sum of mirrored samples, odd ones the difference:
/// half the multiplications.
fn project(values: &[f64], table: &[[f64; COUNT]], reference: f64) -> ([f64; COUNT], f64) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || projected(values, table, reference),
    )
}

#[inline(always)]
fn projected(values: &[f64], table: &[[f64; COUNT]], reference: f64) -> ([f64; COUNT], f64) {
    let n = values.len();
    let mut acc = [0.0; COUNT];
    let mut squares = 0.0;
    let symmetric = n > 1 && table[0][1] == -table[n - 1][1] && table[n / 2][1] == -table[n - 1 - n / 2][1];
    if !symmetric {
        for (y, p) in values.iter().zip(table) {
            let y = y - reference;
            squares += y * y;
            for (a, p) in acc.iter_mut().zip(p) {
                *a += y * p;
            }
        }
        return (acc, squares);
    }
    let half = n / 2;
    let (left, right) = (&values[..half], &values[n - half..]);
    for ((a, b), p) in left.iter().zip(right.iter().rev()).zip(&table[..half]) {
        let (a, b) = (a - reference, b - reference);
        squares += a * a + b * b;
        let pair = [a + b, a - b];
        for k in 0..COUNT {
            acc[k] += pair[k % 2] * p[k];
        }
    }
    if n % 2 == 1 {
        let y = values[half] - reference;
        squares += y * y;
        for (a, p) in acc.iter_mut().zip(&table[half]) {
            *a += y * p;
        }
    }
    (acc, squares)
}

fn not_finite(values: &[f64]) -> Error {
    match values.iter().position(|v| !v.is_finite()) {
        Some(i) => Error::new(ErrorKind::Value, "log", format!("{} is not finite", values[i]))
            .at(format!("sample {}", i + 1))
            .hint("remove the sample"),
        None => Error::new(ErrorKind::Value, "log", "values are too large to square").hint("check the unit"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;
    use crate::signal::{Limits, Reducer};

    /// Σ exp(-t/T) y and Σ exp(-2t/T) by moments.
    fn by_moments(m: &Moments, time_constant: f64) -> (f64, f64) {
        let (mut ey, mut ee) = (0.0, 0.0);
        for b in &m.blocks {
            let class = &m.classes[b.class];
            if (b.mid_s - class.half_s) / time_constant > 700.0 {
                continue; // nothing is left of the exponential, and a block as wide has no series of it
            }
            let q = legendre::exponential(class.half_s / time_constant).plain;
            let e = (-b.mid_s / time_constant).exp();
            ey += e * (legendre::dot(&q, &b.moments) + m.reference * legendre::dot(&q, &class.gram[0]));
            ee += e * e * class.gram.iter().zip(&q).map(|(row, a)| a * legendre::dot(row, &q)).sum::<f64>();
        }
        (ey, ee)
    }

    fn directly(t: &[f64], y: &[f64], time_constant: f64) -> (f64, f64) {
        let e: Vec<f64> = t.iter().map(|t| (-t / time_constant).exp()).collect();
        (e.iter().zip(y).map(|(e, y)| e * y).sum(), e.iter().map(|e| e * e).sum())
    }

    #[test]
    fn moments_replace_the_samples_at_every_time_constant() {
        let n = 60_000;
        let mut draw = Stream::new(3, 0);
        let y: Vec<f64> = (0..n).map(|_| 5.0 + draw.normal()).collect();
        let mut t = 0.0;
        let uneven: Vec<f64> = (0..n)
            .map(|_| {
                let now = t;
                t += 0.01 * (0.5 + draw.uniform());
                now
            })
            .collect();
        let even: Vec<f64> = (0..n).map(|i| 0.01 * f64::from(i)).collect();
        let cases = [
            (TimeAxis::Uniform { start_s: 0.0, step_s: 0.01, len: n as usize }, even),
            (TimeAxis::Explicit(uneven.clone()), uneven),
        ];
        for (axis, t) in cases {
            let at_once = Moments::new(&axis, &y).unwrap();
            let mut pass = Reducer::new(0.01, 5.0, false, Limits::default());
            t.iter().zip(&y).for_each(|(t, y)| pass.push(*t, *y, f64::NAN));
            let in_one_pass = pass.finish().unwrap().moments;
            // blocks of even times share a class, one for each of their lengths
            let classes = if matches!(axis, TimeAxis::Uniform { .. }) { 120 } else { 3 * BLOCKS };
            for m in [at_once, in_one_pass] {
                assert!(m.blocks.len() < 3 * BLOCKS && m.classes.len() < classes, "{}", m.classes.len());
                for time_constant in [0.01, 0.1, 1.0, 10.0, 100.0, 1e3, 1e6] {
                    let (ey, ee) = by_moments(&m, time_constant);
                    let (ey0, ee0) = directly(&t, &y, time_constant);
                    assert!((ey / ey0 - 1.0).abs() < 1e-11, "{time_constant}: {ey} {ey0}");
                    assert!((ee / ee0 - 1.0).abs() < 1e-11, "{time_constant}: {ee} {ee0}");
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_summed_is_named() {
        let axis = |len| TimeAxis::Uniform { start_s: 0.0, step_s: 1.0, len };
        assert_eq!(Moments::new(&axis(0), &[]).unwrap_err().kind, ErrorKind::TooShort);
        let error = Moments::new(&axis(3), &[1.0, f64::NAN, 2.0]).unwrap_err();
        assert!(error.to_string().contains("sample 2"), "{error}");
        assert_eq!(Moments::new(&axis(2), &[1e300, -1e300]).unwrap_err().kind, ErrorKind::Value);
        let back = TimeAxis::Explicit(vec![0.0, 2.0, 1.0]);
        assert!(Moments::new(&back, &[1.0, 2.0, 3.0]).unwrap_err().to_string().contains("sample 3"));
    }
}
