//! h = exp-transform of the folded cepstrum of ½ ln |H|²: the causal filter of a given gain whose delay is least
//!
//! The real cepstrum `c` of ln |H| is even; the minimum-phase one is `c[0]`, `2c[1]`, `2c[2]`, ... (Oppenheim and Schafer,
//! Discrete-Time Signal Processing, chapter on the cepstrum).

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;
use std::f64::consts::PI;

/// Gains below this are raised to it: a zero has no logarithm.
const FLOOR: f64 = 1e-12;
/// The response ends where the power of what follows is below this part of the whole.
const TAIL: f64 = 1e-12;

/// Impulse response of the minimum-phase filter whose power gain at angular frequency ω (rad/sample, 0 to π) is
/// `power(ω)`, cut where nothing of it is left, at most `2^ceil(log2(len))` samples long. `len` should be many times the
/// filter's memory. Empty if a gain is not a number.
#[must_use]
pub(crate) fn minimum_phase(power: impl Fn(f64) -> f64, len: usize) -> Vec<f64> {
    let size = len.max(8).next_power_of_two();
    let half = size / 2;
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, back) = (planner.plan_fft_forward(size), planner.plan_fft_inverse(size));
    let gain = |k: usize| {
        let power = power(PI * k as f64 / half as f64);
        // not f64::max, which would hide what is not a number
        Complex::new(0.5 * if power < FLOOR { FLOOR } else { power }.ln(), 0.0)
    };
    let mut spectrum: Vec<Complex<f64>> = (0..=half).map(gain).collect();
    if spectrum.iter().any(|z| !z.re.is_finite()) {
        return Vec::new();
    }
    let mut series = back.make_output_vec();
    if back.process(&mut spectrum, &mut series).is_err() {
        return Vec::new();
    }
    for (k, c) in series.iter_mut().enumerate() {
        let fold = match k {
            0 => 1.0,
            _ if k < half => 2.0,
            _ if k == half => 1.0,
            _ => 0.0,
        };
        *c *= fold / size as f64;
    }
    if forward.process(&mut series, &mut spectrum).is_err() {
        return Vec::new();
    }
    spectrum.iter_mut().for_each(|z| *z = z.exp());
    // real by symmetry, but for rounding
    spectrum[0].im = 0.0;
    spectrum[half].im = 0.0;
    if back.process(&mut spectrum, &mut series).is_err() {
        return Vec::new();
    }
    series.iter_mut().for_each(|h| *h /= size as f64);
    let mut left: f64 = series.iter().map(|h| h * h).sum();
    let enough = TAIL * left;
    let needed = series.iter().position(|h| {
        left -= h * h;
        left <= enough
    });
    series.truncate(needed.map_or(size, |k| k + 1));
    series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_filters_come_back() {
        // (1 - a)/(1 - a/z): h = (1 - a) a^k
        let a: f64 = 0.9;
        let one_pole = minimum_phase(|w| (1.0 - a).powi(2) / (1.0 - 2.0 * a * w.cos() + a * a), 4096);
        for (k, h) in one_pole.iter().enumerate() {
            assert!((h - (1.0 - a) * a.powi(k as i32)).abs() < 1e-12, "{k}: {h}");
        }
        assert!(one_pole.len() > 100 && one_pole.len() < 200, "{}", one_pole.len());
        // a zero inside the circle: 1 - b/z
        let b: f64 = 0.5;
        let zero = minimum_phase(|w| 1.0 - 2.0 * b * w.cos() + b * b, 1024);
        assert!((zero[0] - 1.0).abs() < 1e-12 && (zero[1] + b).abs() < 1e-12 && zero.len() == 2, "{zero:?}");
        assert_eq!(minimum_phase(|_| f64::NAN, 64), Vec::<f64>::new());
    }
}
