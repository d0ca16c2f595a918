//! Properties of the fit on logs drawn at random: what the warm-up's equation says of a shift, a scale, another unit of time and a
//! thinned log.
//!
//! e(t) = C1 (1 - exp(-t/T)) + C2. With t' = t + s: T' = T, C1' = C1 exp(s/T), C1' + C2' = C1 + C2.

use gyroid::identify::{Fit, FitOptions, fit};
use gyroid::math::random::Stream;
use gyroid::signal::TimeAxis;
use proptest::prelude::*;

const ROWS: usize = 1200;

/// Numbers of a log: C1/σ, seed, length in time constants.
fn drawn() -> impl Strategy<Value = (f64, u64, f64)> {
    (prop_oneof![-200.0..-20.0f64, 20.0..200.0f64], any::<u64>(), 3.0..8.0f64)
}

/// T = 1, σ = 1: a log of `ROWS` rows over `constants` time constants.
fn log((c1, seed, constants): (f64, u64, f64)) -> (f64, Vec<f64>) {
    let (draw, step) = (&mut Stream::new(seed, 0), constants / ROWS as f64);
    (step, (0..ROWS).map(|k| -c1 * (-step * k as f64).exp_m1() + draw.normal()).collect())
}

fn fitted(start_s: f64, step_s: f64, values: &[f64]) -> Fit {
    fit(&TimeAxis::Uniform { start_s, step_s, len: values.len() }, values, &FitOptions::default()).unwrap()
}

/// C1, C2, T.
fn numbers(fit: &Fit) -> [f64; 3] {
    [fit.c1_rad_s.estimate, fit.c2_rad_s.estimate, fit.time_constant_s.estimate]
}

fn stds(fit: &Fit) -> [f64; 3] {
    [fit.c1_rad_s.std, fit.c2_rad_s.std, fit.time_constant_s.std]
}

/// Within a thousandth of a standard deviation: what the search leaves.
#[track_caller]
fn same(found: &Fit, wanted: [f64; 3]) {
    for ((found, std), wanted) in numbers(found).into_iter().zip(stds(found)).zip(wanted) {
        assert!((found - wanted).abs() < 1e-3 * std, "{found} for {wanted}, standard deviation {std}");
    }
}

#[track_caller]
fn alike(found: [f64; 3], wanted: [f64; 3]) {
    for (found, wanted) in found.into_iter().zip(wanted) {
        assert!((found / wanted - 1.0).abs() < 1e-4, "{found} for {wanted}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn an_offset_is_c2_alone(of in drawn(), offset in -1e3..1e3f64) {
        let (step, values) = log(of);
        let before = fitted(0.0, step, &values);
        let after = fitted(0.0, step, &values.iter().map(|v| v + offset).collect::<Vec<_>>());
        let [c1, c2, t] = numbers(&before);
        same(&after, [c1, c2 + offset, t]);
        alike(stds(&after), stds(&before));
    }

    #[test]
    fn a_unit_of_the_rate_scales_c1_c2_and_their_errors(of in drawn(), unit in prop_oneof![1e-6..1e6f64, -1e6..-1e-6f64]) {
        let (step, values) = log(of);
        let before = fitted(0.0, step, &values);
        let after = fitted(0.0, step, &values.iter().map(|v| v * unit).collect::<Vec<_>>());
        let [c1, c2, t] = numbers(&before);
        same(&after, [c1 * unit, c2 * unit, t]);
        let [s1, s2, st] = stds(&before);
        alike(stds(&after), [s1 * unit.abs(), s2 * unit.abs(), st]);
    }

    #[test]
    fn a_unit_of_time_scales_the_time_constant(of in drawn(), unit in 1e-2..1e4f64) {
        let (step, values) = log(of);
        let (before, after) = (fitted(0.0, step, &values), fitted(0.0, step * unit, &values));
        let [c1, c2, t] = numbers(&before);
        same(&after, [c1, c2, t * unit]);
        let [s1, s2, st] = stds(&before);
        alike(stds(&after), [s1, s2, st * unit]);
    }

    #[test]
    fn a_later_start_is_the_same_curve(of in drawn(), later in 0.0..2.0f64) {
        let (step, values) = log(of);
        let (before, after) = (fitted(0.0, step, &values), fitted(later, step, &values));
        let [c1, c2, t] = numbers(&before);
        let moved = c1 * (later / t).exp();
        same(&after, [moved, c1 + c2 - moved, t]);
    }

    /// Every other sample knows less by what the variances say (Hausman 1978): var(thinned - whole) = var(thinned) - var(whole).
    #[test]
    fn a_thinned_log_differs_by_what_it_lost(of in drawn()) {
        let (step, values) = log(of);
        let whole = fitted(0.0, step, &values);
        let thinned = fitted(0.0, 2.0 * step, &values.iter().step_by(2).copied().collect::<Vec<_>>());
        for j in 0..3 {
            let lost = stds(&thinned)[j].powi(2) - stds(&whole)[j].powi(2);
            let off = numbers(&thinned)[j] - numbers(&whole)[j];
            // one in 2e-9 of a normal number; residuals that chance to look correlated widen one of both
            prop_assert!(off.abs() < 6.0 * lost.max(0.5 * stds(&whole)[j].powi(2)).sqrt(), "{j}: {off}, {lost}");
        }
    }
}
