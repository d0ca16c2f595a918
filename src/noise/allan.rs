//! σ²(τ) = ½ ⟨(ȳ(t+τ) - ȳ(t))²⟩, ȳ the mean of the rate over τ, and its relatives
//!
//! With θ the integrated rate and m samples averaged, τ = mΔt, over all i that exist:
//!
//! ```text
//! overlapping Allan     ⟨(θ[i+2m] - 2θ[i+m] + θ[i])²⟩ / 2τ²
//! modified Allan        the same of means of θ over m
//! overlapping Hadamard  ⟨(θ[i+3m] - 3θ[i+2m] + 3θ[i+m] - θ[i])²⟩ / 6τ²     (a ramp changes nothing)
//! total                 ⟨(θ*[i+m] - 2θ*[i] + θ*[i-m])²⟩ / 2τ², θ* continued by its point images at both ends
//! ```
//!
//! Definitions: Riley, NIST SP 1065 (2008), equations 11, 17, 20, 25. Each costs one pass over θ for each τ. The total
//! deviation is not corrected for its bias (-2.4 % at τ a tenth of the log under flicker noise, -3.8 % under a random walk).

use super::confidence::{
    NoiseExponent, degrees_of_freedom, interval95, noise_exponent, total_degrees_of_freedom,
    white_rate_degrees_of_freedom,
};
use rayon::prelude::*;
use serde::Serialize;

/// Up to here the total deviation has the degrees of freedom of the overlapping one, and white rates their exact ones.
const FEW_AVERAGED: usize = 16;

/// A member of the Allan family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Deviation {
    /// Overlapping Allan deviation.
    Overlapping,
    /// Modified Allan deviation: tells white noise of the angle from its flicker noise.
    Modified,
    /// Overlapping Hadamard deviation: blind to a ramp.
    Hadamard,
    /// Total deviation: steadier at the longest averaging times.
    Total,
}

/// A deviation at one averaging time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AllanPoint {
    /// Samples averaged.
    #[serde(rename = "samples")]
    pub m: usize,
    /// Averaging time, s.
    pub tau_s: f64,
    /// Deviation, rad/s.
    pub deviation_rad_s: f64,
    /// 95 % interval by the noise type found at this averaging time, rad/s.
    pub ci95: [f64; 2],
    /// Equivalent degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Exponent of the noise type, S ∝ f^α.
    pub noise_exponent: NoiseExponent,
}

impl Deviation {
    /// All members.
    pub const ALL: [Self; 4] = [Self::Overlapping, Self::Modified, Self::Hadamard, Self::Total];

    /// Key in JSON.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Overlapping => "overlapping_allan",
            Self::Modified => "modified_allan",
            Self::Hadamard => "overlapping_hadamard",
            Self::Total => "total",
        }
    }

    /// Most samples that can be averaged in a log of `rates`.
    #[must_use]
    pub fn longest(self, rates: usize) -> usize {
        match self {
            Self::Overlapping | Self::Total => rates / 2,
            Self::Modified => (rates + 1) / 3,
            Self::Hadamard => rates / 3,
        }
    }

    fn differences(self) -> usize {
        if self == Self::Hadamard { 3 } else { 2 }
    }

    /// Equivalent degrees of freedom with `m` of `rates` samples averaged.
    #[must_use]
    pub(crate) fn degrees_of_freedom(self, alpha: NoiseExponent, m: usize, rates: usize) -> f64 {
        // an average of one sample is modified by nothing
        let modified = self == Self::Modified && m > 1;
        match self {
            _ if alpha == 0 && m <= FEW_AVERAGED && !modified => {
                white_rate_degrees_of_freedom(self.differences(), m, rates + 1)
            }
            // the published coefficients are those of many samples averaged; with few it is all but the overlapping one
            Self::Total if m > FEW_AVERAGED && alpha <= 0 => total_degrees_of_freedom(alpha, m, rates),
            Self::Total => degrees_of_freedom(alpha, 2, m, rates + 1, false),
            _ => degrees_of_freedom(alpha, self.differences(), m, rates + 1, modified),
        }
    }

    /// Sum of squares and its divisor, without Δt².
    fn variance(self, theta: &[f64], m: usize) -> Option<f64> {
        let n = theta.len();
        let last = |reach: usize| n.checked_sub(reach).filter(|count| *count > 0);
        let mm = (m * m) as f64;
        match self {
            Self::Overlapping => overlapping(theta, &[m]).pop(),
            Self::Hadamard => {
                let count = last(3 * m)?;
                let (a, b, c, d) =
                    (&theta[..count], &theta[m..m + count], &theta[2 * m..2 * m + count], &theta[3 * m..]);
                let sum = sum_of_squares(count, |i| d[i] - 3.0 * (c[i] - b[i]) - a[i]);
                Some(sum / (6.0 * mm * count as f64))
            }
            Self::Modified => {
                let count = last(3 * m - 1)?;
                let second = |i: usize| theta[i + 2 * m] - 2.0 * theta[i + m] + theta[i];
                let mut window: f64 = (0..m).map(second).sum();
                let mut sum = window * window;
                for i in 1..count {
                    // in at i + m - 1, out at i - 1
                    window += second(i + m - 1) - second(i - 1);
                    sum += window * window;
                }
                Some(sum / (2.0 * mm * mm * count as f64))
            }
            Self::Total => {
                let inner = last(2)?;
                if m > inner {
                    return None;
                }
                let at = |i: isize| -> f64 {
                    let end = n as isize - 1;
                    match i {
                        _ if i < 0 => 2.0 * theta[0] - theta[(-i) as usize],
                        _ if i > end => 2.0 * theta[n - 1] - theta[(2 * end - i) as usize],
                        _ => theta[i as usize],
                    }
                };
                let reach = m as isize;
                let sum = sum_of_squares(inner, |i| {
                    let i = i as isize + 1;
                    at(i - reach) - 2.0 * at(i) + at(i + reach)
                });
                Some(sum / (2.0 * mm * inner as f64))
            }
        }
    }
}

/// Rows of a block.
const ROWS: usize = 16_384;

/// Overlapping variances of `averaged`, none longer than half of `theta`, without Δt²: block by block, all of them while the
/// block is in the cache, and neighbouring blocks' far ends with it.
fn overlapping(theta: &[f64], averaged: &[usize]) -> Vec<f64> {
    let arch = pulp::Arch::new();
    let starts: Vec<usize> = (0..theta.len()).step_by(ROWS).collect();
    let count = |m: usize| theta.len() - 2 * m;
    let of_block = |start: &usize| -> Vec<f64> {
        let of = |m: &usize| {
            let rows = count(*m).saturating_sub(*start).min(ROWS);
            let from = |at: usize| if rows > 0 { &theta[start + at..start + at + rows] } else { &[] };
            let (a, b, c) = (from(0), from(*m), from(2 * m));
            arch.dispatch(
                #[inline(always)]
                || second_differences(a, b, c),
            )
        };
        averaged.iter().map(of).collect()
    };
    let blocks: Vec<Vec<f64>> = starts.par_iter().map(of_block).collect();
    // in their order, so that the result is the same on any number of cores
    let total = |at: usize| blocks.iter().map(|b| b[at]).sum::<f64>();
    averaged.iter().enumerate().map(|(at, m)| total(at) / (2.0 * (m * m) as f64 * count(*m) as f64)).collect()
}

/// Sums of this many terms keep their digits.
const RUN: usize = 1024;
/// Sums side by side, which the widest registers hold: the same on every processor.
const LANES: usize = 16;

/// Σ (c - 2b + a)² of three slices of one length.
#[inline(always)]
fn second_differences(a: &[f64], b: &[f64], c: &[f64]) -> f64 {
    let runs = a.chunks(RUN).zip(b.chunks(RUN)).zip(c.chunks(RUN));
    let of_run = |((a, b), c): ((&[f64], &[f64]), &[f64])| {
        let ((a, a_rest), (b, b_rest), (c, c_rest)) =
            (a.as_chunks::<LANES>(), b.as_chunks::<LANES>(), c.as_chunks::<LANES>());
        let mut lanes = [0.0; LANES];
        for ((a, b), c) in a.iter().zip(b).zip(c) {
            for (((sum, a), b), c) in lanes.iter_mut().zip(a).zip(b).zip(c) {
                let v = c - 2.0 * b + a;
                *sum += v * v;
            }
        }
        let rest = a_rest.iter().zip(b_rest).zip(c_rest).map(|((a, b), c)| (c - 2.0 * b + a).powi(2));
        lanes.iter().sum::<f64>() + rest.sum::<f64>()
    };
    runs.map(of_run).sum()
}

/// Σ f(i)² in runs of a thousand, so that long sums keep their digits and the compiler may add side by side.
fn sum_of_squares(count: usize, f: impl Fn(usize) -> f64) -> f64 {
    let run = |start: usize| {
        let end = (start + RUN).min(count);
        let mut four = [0.0; 4];
        let whole = start + (end - start) / 4 * 4;
        for i in (start..whole).step_by(4) {
            for (j, s) in four.iter_mut().enumerate() {
                let v = f(i + j);
                *s += v * v;
            }
        }
        let rest: f64 = (whole..end).map(|i| f(i).powi(2)).sum();
        four.iter().sum::<f64>() + rest
    };
    (0..count).step_by(RUN).map(run).sum()
}

/// The integrated rate about its mean, in samples: one more than rates, from zero.
#[must_use]
pub fn angles(rates: &[f64]) -> Vec<f64> {
    const PIECE: usize = 1 << 16;
    let sums: Vec<f64> = rates.par_chunks(PIECE).map(|piece| piece.iter().sum()).collect();
    let mean = sums.iter().sum::<f64>() / rates.len().max(1) as f64;
    // where each piece begins
    let begin = |sum: &mut f64, (own, piece): (&f64, &[f64])| {
        let begin = *sum;
        *sum += own - mean * piece.len() as f64;
        Some(begin)
    };
    let begins: Vec<f64> = sums.iter().zip(rates.chunks(PIECE)).scan(0.0, begin).collect();
    let mut out = vec![0.0; rates.len() + 1];
    out[1..].par_chunks_mut(PIECE).zip(rates.par_chunks(PIECE)).zip(begins).for_each(|((to, piece), begin)| {
        let mut sum = begin;
        for (to, y) in to.iter_mut().zip(piece) {
            sum += y - mean;
            *to = sum;
        }
    });
    out
}

/// Samples to average: powers of two up to `longest`.
#[must_use]
pub fn octaves(longest: usize) -> Vec<usize> {
    (0..usize::BITS).map(|i| 1usize << i).take_while(|m| *m <= longest).collect()
}

/// Samples to average: about `per_decade` in a decade, rounded, each once, up to `longest`.
#[must_use]
pub fn decades(longest: usize, per_decade: usize) -> Vec<usize> {
    let per = per_decade.max(1) as f64;
    let mut all: Vec<usize> =
        (0..).map(|i| 10f64.powf(f64::from(i) / per).round() as usize).take_while(|m| *m <= longest).collect();
    all.dedup();
    all
}

/// `deviation` of `rates` (rad/s, `step_s` apart, none missing) at each number of samples averaged, in the order given;
/// those that the log is too short for are left out.
#[must_use]
pub fn deviations(rates: &[f64], step_s: f64, averaged: &[usize], deviation: Deviation) -> Vec<AllanPoint> {
    of_angles(rates, &angles(rates), step_s, averaged, deviation)
}

/// The same where the integrated rate ([`angles`]) is there already.
#[must_use]
pub(crate) fn of_angles(
    rates: &[f64],
    theta: &[f64],
    step_s: f64,
    averaged: &[usize],
    deviation: Deviation,
) -> Vec<AllanPoint> {
    let possible = |m: &usize| *m > 0 && *m <= deviation.longest(rates.len());
    let there: Vec<usize> = averaged.iter().copied().filter(possible).collect();
    let variances: Vec<Option<f64>> = match deviation {
        Deviation::Overlapping => overlapping(theta, &there).into_iter().map(Some).collect(),
        _ => there.par_iter().map(|m| deviation.variance(theta, *m)).collect(),
    };
    let one = |(m, variance): (&usize, Option<f64>)| -> Option<AllanPoint> {
        let (m, deviation_rad_s) = (*m, variance?.sqrt());
        Some(AllanPoint {
            m,
            tau_s: m as f64 * step_s,
            deviation_rad_s,
            ci95: [f64::NAN; 2],
            degrees_of_freedom: f64::NAN,
            noise_exponent: 0,
        })
    };
    let mut points: Vec<AllanPoint> = there.iter().zip(variances).filter_map(one).collect();
    // where there are too few means to know the noise, it is as at the last averaging time where it was known
    let found: Vec<Option<NoiseExponent>> =
        points.par_iter().map(|p| noise_exponent(theta, p.m, deviation.differences() - 1)).collect();
    // noise of the angle falls faster with the averaging time than white noise, which every gyro has: where it no longer rules, it
    // never does again. Thirty means call white noise one of the angle one time in five, and that has four times the degrees
    let (mut alpha, mut bluest) = (0, 2);
    for (point, found) in points.iter_mut().zip(found) {
        alpha = found.unwrap_or(alpha).clamp(-4, bluest);
        bluest = alpha.max(0);
        point.noise_exponent = alpha.max(2 - 2 * deviation.differences() as i32);
        point.degrees_of_freedom = deviation.degrees_of_freedom(point.noise_exponent, point.m, rates.len()).max(1.0);
        point.ci95 = interval95(point.deviation_rad_s, point.degrees_of_freedom);
    }
    points
}
