//! nats = E ln p(log | effect) / p(log | nominal): how much an effect shows in one recording
//!
//! Three forms, each against the nominal simulator's white noise σ² and its warm-up with the stated repeatability:
//!
//! ```text
//! a signal a s:            a² s' Σ⁻¹ s / 2,  Σ = σ² I + U U',  U = ∂e/∂(c1, c2, T) times their standard deviations
//! a noise of PSD S(f):     Σ_k [r - ln(1 + r)] / 2 over f_k = k/(2 n dt),  r = S(f_k) / (σ² dt)
//! a noise level g(t):      Σ_t [g² - 1 - ln g²] / 2;  the same over frequencies for a filter, g² = |H|²
//! ```

use super::run::Run;
use nalgebra::{Matrix3, Vector3};

/// s' Σ⁻¹ s of a signal of unit amplitude, s²/rad².
pub(super) fn signal_energy(run: &Run, signal: &[f64]) -> f64 {
    let unit = &run.unit;
    let variance = unit.white_std_rad_s().powi(2);
    let scales = [unit.turn_on_std_rad_s, unit.relative_std * unit.c1_rad_s, unit.relative_std * unit.c1_rad_s];
    let (mut gram, mut cross, mut square) = (Matrix3::identity() * variance, Vector3::zeros(), 0.0);
    for (t, s) in run.times_s().zip(signal) {
        let x = t / unit.time_constant_s;
        let decay = (-x).exp();
        let u = Vector3::new(scales[0], scales[1] * (1.0 - decay), -scales[2] * x * decay);
        gram += u * u.transpose();
        cross += u * *s;
        square += s * s;
    }
    let explained = gram.cholesky().map_or(0.0, |c| cross.dot(&c.solve(&cross)));
    ((square - explained) / variance).max(0.0)
}

/// Number of the lowest frequencies that warm-up and level take.
const TAKEN: usize = 2;
/// Frequencies that are summed one by one; above, the sum is an integral over ln k.
const SINGLE: usize = 40;
const NODES: usize = 160;

/// Nats of a Gaussian noise whose two-sided PSD is `psd(f_hz)`, rad²/s²/Hz.
pub(super) fn noise(run: &Run, psd: impl Fn(f64) -> f64) -> f64 {
    let white = run.unit.white_std_rad_s().powi(2) * run.step_s();
    let one = |k: f64| {
        let r = psd(k / (2.0 * run.span_s())) / white;
        0.5 * (r - r.ln_1p())
    };
    let single: f64 = (TAKEN + 1..=SINGLE).map(|k| one(k as f64)).sum();
    let (low, high) = ((SINGLE as f64 + 0.5).ln(), (run.len as f64 - 0.5).max(SINGLE as f64 + 1.0).ln());
    let width = (high - low) / NODES as f64;
    let rest: f64 = (0..NODES)
        .map(|i| {
            let k = (low + (i as f64 + 0.5) * width).exp();
            one(k) * k * width
        })
        .sum();
    single + rest
}

/// Nats of one row whose standard deviation is `g` times the nominal one.
pub(super) fn level(g: f64) -> f64 {
    let v = g * g;
    0.5 * (v - 1.0 - v.ln())
}

/// The strength at which `nats` reaches `target`; an end of the range where it does not. `nats` must grow.
pub(super) fn solve(target: f64, [low, high]: [f64; 2], nats: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (low.ln(), high.ln());
    for _ in 0..44 {
        let middle = 0.5 * (a + b);
        if nats(middle.exp()) < target { a = middle } else { b = middle }
    }
    (0.5 * (a + b)).exp()
}
