//! How well a deviation is known: equivalent degrees of freedom ν by noise type, ν s²/σ² ~ χ²(ν)
//!
//! Greenhall and Riley, *Uncertainty of stability variances based on finite differences*, Proc. 35th PTTI (2003) 267, whose
//! equation and table numbers are cited; the total deviation by NIST SP 1065 (Riley 2008), table 7. The type of the noise
//! at an averaging time is found from the lag-1 autocorrelation: Riley and Greenhall, 18th EFTF (2004).

use crate::math::distributions::chi_squared_interval95;

/// Exponent α of the spectrum of the rate, S ∝ f^α: 2 quantisation, 1 flicker of the angle, 0 white, -1 flicker, -2 random
/// walk, -3 and -4 beyond.
pub(crate) type NoiseExponent = i32;

/// Beyond this many terms sums are replaced by their limits.
const MOST_TERMS: f64 = 100.0;

/// Two-sided 95 % interval of a deviation with `degrees` of freedom.
#[must_use]
pub(crate) fn interval95(deviation: f64, degrees: f64) -> [f64; 2] {
    let [low, high] = chi_squared_interval95(degrees.max(1e-3));
    [deviation * (degrees / high).sqrt(), if low > 0.0 { deviation * (degrees / low).sqrt() } else { f64::INFINITY }]
}

/// Equation (7): generalised autocovariance of the noise.
fn s_w(t: f64, alpha: NoiseExponent) -> f64 {
    let t = t.abs();
    let logarithmic = |power: i32| if t > 0.0 { t.powi(power) * t.ln() } else { 0.0 };
    match alpha {
        2 => -t,
        1 => logarithmic(2),
        0 => t.powi(3),
        -1 => logarithmic(4),
        -2 => t.powi(5),
        -3 => logarithmic(6),
        _ => t.powi(7),
    }
}

/// Equation (8): after the filter of width 1/F; F = ∞ differentiates.
fn s_x(t: f64, f: f64, alpha: NoiseExponent) -> f64 {
    if f.is_infinite() {
        return s_w(t, alpha + 2);
    }
    f * f * (2.0 * s_w(t, alpha) - s_w(t - 1.0 / f, alpha) - s_w(t + 1.0 / f, alpha))
}

/// Equation (9): after d differences.
fn s_z(t: f64, f: f64, alpha: NoiseExponent, d: usize) -> f64 {
    const BINOMIALS: [&[f64]; 3] = [&[2.0, -1.0], &[6.0, -4.0, 1.0], &[20.0, -15.0, 6.0, -1.0]];
    let terms = BINOMIALS[d.clamp(1, 3) - 1].iter().enumerate();
    terms
        .map(|(j, c)| match j {
            0 => c * s_x(t, f, alpha),
            _ => c * (s_x(t - j as f64, f, alpha) + s_x(t + j as f64, f, alpha)),
        })
        .sum()
}

/// Equation (10).
fn basic_sum(j: f64, m: f64, s: f64, f: f64, alpha: NoiseExponent, d: usize) -> f64 {
    let square = |t: f64| s_z(t, f, alpha, d).powi(2);
    let inner: f64 = (1..j as usize).map(|i| 2.0 * (1.0 - i as f64 / m) * square(i as f64 / s)).sum();
    square(0.0) + (1.0 - j / m) * square(j / s) + inner
}

/// Degrees of freedom of an overlapping deviation of `d` differences of the angle (2: Allan, 3: Hadamard), `m` samples
/// averaged, of `angles` angles (one more than rates); `modified` averages the angle too.
///
/// NaN where the deviation does not exist: no whole window, or noise too red for it (α ≤ 1 - 2d).
#[must_use]
pub fn degrees_of_freedom(alpha: NoiseExponent, d: usize, m: usize, angles: usize, modified: bool) -> f64 {
    let (mf, n) = (m as f64, angles as f64);
    let alpha = alpha.clamp(-4, 2);
    let length = if modified { mf + mf * d as f64 } else { 1.0 + mf * d as f64 };
    if alpha + 2 * d as i32 <= 1 || n < length || !(2..=3).contains(&d) {
        return f64::NAN;
    }
    let count = 1.0 + (n - length).floor();
    let terms = count.min((d as f64 + 1.0) * mf);
    let r = count / mf;
    let of = |sum: f64, scale: f64, terms: f64| scale.powi(2) * terms / sum;
    let table = |rows: &[[[f64; 2]; 2]; 7]| rows[(2 - alpha) as usize][d - 2];
    let long = r > d as f64 + 1.0;
    if modified {
        return match () {
            () if terms <= MOST_TERMS => of(basic_sum(terms, count, mf, 1.0, alpha, d), s_z(0.0, 1.0, alpha, d), count),
            () if long => by_table(r, table(&MODIFIED)),
            () => {
                let sum = basic_sum(MOST_TERMS, MOST_TERMS, MOST_TERMS / r, 1.0, alpha, d);
                of(sum, s_z(0.0, 1.0, alpha, d), MOST_TERMS)
            }
        };
    }
    match alpha {
        2 => white_angle(count, r, d),
        1 if terms <= MOST_TERMS => of(basic_sum(terms, count, mf, mf, 1, d), s_z(0.0, mf, 1, d), count),
        1 => {
            let [b0, b1] = if d == 2 { [15.23, 12.0] } else { [47.8, 40.0] };
            let scale = b0 + b1 * mf.ln();
            if long {
                let [a0, a1] = table(&UNMODIFIED);
                scale.powi(2) * r / (a0 - a1 / r)
            } else {
                let window = MOST_TERMS / r;
                of(basic_sum(MOST_TERMS, MOST_TERMS, window, window, 1, d), scale, MOST_TERMS)
            }
        }
        _ if terms <= MOST_TERMS => {
            let f = if mf * (d as f64 + 1.0) <= MOST_TERMS { mf } else { f64::INFINITY };
            of(basic_sum(terms, count, mf, f, alpha, d), s_z(0.0, f, alpha, d), count)
        }
        _ if long => by_table(r, table(&UNMODIFIED)),
        _ => {
            let sum = basic_sum(MOST_TERMS, MOST_TERMS, MOST_TERMS / r, f64::INFINITY, alpha, d);
            of(sum, s_z(0.0, f64::INFINITY, alpha, d), MOST_TERMS)
        }
    }
}

/// Degrees of freedom of an overlapping deviation of `d` differences (2: Allan, 3: Hadamard) of white rates, `m` averaged, of
/// `angles` angles: exact, as the sum of 2 Cov² over all pairs of differences.
///
/// Equation (7) onwards take the angle as averaged over a sample, as a counter's phase is. Angles here are sums of
/// independent rates: at m = 1 that leaves a sixth fewer degrees of freedom.
#[must_use]
pub(super) fn white_rate_degrees_of_freedom(d: usize, m: usize, angles: usize) -> f64 {
    // autocovariance at lags of whole windows, linear between them
    let nodes: &[f64] = if d == 2 { &[2.0, -1.0, 0.0] } else { &[6.0, -4.0, 1.0, 0.0] };
    let count = angles.saturating_sub(d * m) as f64;
    let correlation = |lag: usize| {
        let (whole, part) = (lag / m, (lag % m) as f64 / m as f64);
        ((1.0 - part) * nodes[whole] + part * nodes[whole + 1]) / nodes[0]
    };
    let lags = (1..d * m).map(|lag| 2.0 * (1.0 - lag as f64 / count).max(0.0) * correlation(lag).powi(2));
    count / (1.0 + lags.sum::<f64>())
}

fn by_table(r: f64, [a0, a1]: [f64; 2]) -> f64 {
    r / (a0 - a1 / r)
}

/// White noise of the angle: differences at lags of whole windows alone are correlated, by C(2d, d-j)/C(2d, d).
fn white_angle(count: f64, r: f64, d: usize) -> f64 {
    let shares: &[f64] = if d == 2 { &[4.0 / 6.0, 1.0 / 6.0] } else { &[15.0 / 20.0, 6.0 / 20.0, 1.0 / 20.0] };
    let lags = shares.iter().enumerate().map(|(j, s)| 2.0 * s * s * (1.0 - (j as f64 + 1.0) / r).max(0.0));
    count / (1.0 + lags.sum::<f64>())
}

const NONE: [f64; 2] = [f64::NAN; 2];
/// Table 1, modified: α from 2 to -4, d = 2 and 3.
const MODIFIED: [[[f64; 2]; 2]; 7] = [
    [[7.0 / 9.0, 0.5], [22.0 / 25.0, 2.0 / 3.0]],
    [[0.997, 0.616], [1.141, 0.843]],
    [[1.033, 0.607], [1.184, 0.848]],
    [[1.048, 0.534], [1.180, 0.816]],
    [[1.302, 0.535], [1.175, 0.777]],
    [NONE, [1.194, 0.703]],
    [NONE, [1.489, 0.702]],
];
/// Table 2, unmodified.
const UNMODIFIED: [[[f64; 2]; 2]; 7] = [
    [[35.0 / 18.0, 1.0], [231.0 / 100.0, 1.5]],
    [[790.0, 410.0], [9950.0, 6520.0]],
    [[2.0 / 3.0, 1.0 / 3.0], [7.0 / 9.0, 0.5]],
    [[0.852, 0.375], [0.997, 0.617]],
    [[1.079, 0.368], [1.033, 0.607]],
    [NONE, [1.053, 0.553]],
    [NONE, [1.302, 0.535]],
];

/// Degrees of freedom of the total deviation of `rates` rates, `m` averaged: b n/m - c; for α outside 0 to -2, where no
/// coefficients are published, those of the nearest.
#[must_use]
pub fn total_degrees_of_freedom(alpha: NoiseExponent, m: usize, rates: usize) -> f64 {
    let (b, c) = match alpha {
        0.. => (1.50, 0.0),
        -1 => (1.17, 0.22),
        _ => (0.93, 0.36),
    };
    b * rates as f64 / m as f64 - c
}

/// Fewest means from which the noise type is found.
const FEWEST: usize = 30;
/// So many tell the autocorrelation to a hundredth, and the exponents lie a tenth apart: those beyond are not asked.
const MOST: usize = 1 << 14;

/// Exponent α of the noise that dominates at `m` samples averaged, from the lag-1 autocorrelation of the means of the rates
/// whose integral is `theta` ([`super::allan::angles`]), without their straight line, differenced until they are stationary, `most_differences` times at most (1 for Allan
/// variances, 2 for Hadamard's). `None` with fewer than 30 means.
#[must_use]
pub fn noise_exponent(theta: &[f64], m: usize, most_differences: usize) -> Option<NoiseExponent> {
    let ends: Vec<f64> = theta.iter().step_by(m).take(MOST + 1).copied().collect();
    let means: Vec<f64> = ends.windows(2).map(|w| (w[1] - w[0]) / m as f64).collect();
    if means.len() < FEWEST {
        return None;
    }
    let mut x = without_line(&means);
    for d in 0..=most_differences {
        let r1 = lag_one(&x);
        let rho = r1 / (1.0 + r1);
        if rho < 0.25 || d == most_differences {
            return Some(-(2.0 * rho).round() as i32 - 2 * d as i32);
        }
        x = x.windows(2).map(|w| w[1] - w[0]).collect();
    }
    None
}

fn without_line(x: &[f64]) -> Vec<f64> {
    let n = x.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = x.iter().sum::<f64>() / n;
    let (mut xt, mut tt) = (0.0, 0.0);
    for (i, v) in x.iter().enumerate() {
        let t = i as f64 - middle;
        xt += t * (v - mean);
        tt += t * t;
    }
    let slope = xt / tt;
    x.iter().enumerate().map(|(i, v)| v - mean - slope * (i as f64 - middle)).collect()
}

fn lag_one(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let product: f64 = x.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    product / x.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    /// ν = 2 E² / Var of the mean square of all differences, by simulation; the published one is off by one part in m.
    #[test]
    fn white_rates_have_the_degrees_of_freedom_of_their_differences() {
        let (logs, rates) = (4000, 200);
        for (d, m) in [(2, 1), (2, 3), (3, 1), (3, 4)] {
            let square = |log: u64| {
                let mut draw = Stream::new(12, log);
                let mut angle = 0.0;
                let mut x = vec![0.0];
                x.extend((0..rates).map(|_| {
                    angle += draw.normal();
                    angle
                }));
                for _ in 0..d {
                    x = x.iter().zip(&x[m..]).map(|(a, b)| b - a).collect();
                }
                x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64
            };
            let squares: Vec<f64> = (0..logs).map(square).collect();
            let mean = squares.iter().sum::<f64>() / logs as f64;
            let variance = squares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (logs - 1) as f64;
            let found = white_rate_degrees_of_freedom(d, m, rates + 1);
            let simulated = 2.0 * mean * mean / variance;
            // a variance of n nearly normal numbers is known to a share of sqrt(2 / n); and a little for their tail
            let bound = 4.0 * (2.0 / logs as f64).sqrt();
            assert!((found / simulated - 1.0).abs() < bound, "d {d}, m {m}: {found}, simulated {simulated}");
        }
        for m in [4, 16] {
            let published = degrees_of_freedom(0, 2, m, 4097, false);
            let found = white_rate_degrees_of_freedom(2, m, 4097);
            assert!((found / published - 1.0).abs() < 1.0 / m as f64, "{found}, published {published}");
        }
    }
}
