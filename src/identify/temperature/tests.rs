use super::*;
use crate::bias::WarmUp;
use crate::identify::terms::Explanation;
use crate::math::random::Stream;
use crate::signal::{Limits, Reducer};
use std::f64::consts::TAU;

const STEP_S: f64 = 1.0;
const SIGMA: f64 = 3e-4;
const TRUE: Thermal =
    Thermal { reference_c: 25.0, bias_rad_s: -4e-3, sensitivity_rad_s_k: 3e-5, curvature_rad_s_k2: 0.0 };

fn axis(len: usize) -> TimeAxis {
    TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len }
}

/// A room that warms and cools the sensor by 10 K and back, three times.
fn room(len: usize) -> Vec<f64> {
    (0..len).map(|i| 25.0 + 5.0 * (3.0 * TAU * i as f64 / len as f64).sin()).collect()
}

fn rates(model: &Thermal, temperature: &[f64], walk: f64, seed: u64) -> Vec<f64> {
    let (mut white, mut steps, mut bias) = (Stream::new(seed, 0), Stream::new(seed, 1), 0.0);
    let noisy = |t: &f64| {
        bias += walk * STEP_S.sqrt() * steps.normal();
        model.error_rad_s(*t) + bias + SIGMA * white.normal()
    };
    temperature.iter().map(noisy).collect()
}

/// The fit without the comparison with elapsed time, which takes most of the time.
fn fitted(values: &[f64], temperature: &[f64]) -> TemperatureFit {
    let time = axis(values.len());
    solve(&blocks(&time, values, temperature), STEP_S, || difference_variance(values)).unwrap()
}

fn covers(e: &Estimate, truth: f64) -> bool {
    (e.ci95[0]..=e.ci95[1]).contains(&truth)
}

#[test]
fn intervals_cover_as_often_as_they_say_and_chance_bends_no_line() {
    const LOGS: u64 = 300;
    let temperature = room(2400);
    let (mut slopes, mut biases, mut curved, mut found) = (0, 0, 0, 0);
    for seed in 0..LOGS {
        let fit = fitted(&rates(&TRUE, &temperature, 0.0, seed), &temperature);
        slopes += usize::from(covers(&fit.sensitivity_rad_s_k, TRUE.sensitivity_rad_s_k));
        biases += usize::from(covers(&fit.bias_rad_s, TRUE.error_rad_s(fit.reference_c)));
        curved += usize::from(fit.curvature_rad_s_k2.is_some());
        let none = Thermal { sensitivity_rad_s_k: 0.0, ..TRUE };
        found += usize::from(fitted(&rates(&none, &temperature, 0.0, LOGS + seed), &temperature).found());
    }
    // binomial, four standard deviations of 3.8 about 285, of 1.7 about 3, of 3.8 about 15; the walk that is allowed for and
    // not there makes intervals a little wider
    assert!((270..=300).contains(&slopes) && (270..=300).contains(&biases), "{slopes} {biases}");
    assert!(curved <= 10 && found <= 30, "{curved} {found}");
}

#[test]
fn a_walk_of_the_bias_widens_the_intervals() {
    const LOGS: u64 = 200;
    let temperature = room(2400);
    // at the frequency of the room the walk is ten times as strong as the white noise
    let walk = 60.0 * SIGMA / 2400.0;
    let (mut allowing, mut white) = (0, 0);
    for seed in 0..LOGS {
        let fit = fitted(&rates(&TRUE, &temperature, walk, seed), &temperature);
        let s = fit.sensitivity_rad_s_k;
        allowing += usize::from(covers(&s, TRUE.sensitivity_rad_s_k));
        white += usize::from((s.estimate - TRUE.sensitivity_rad_s_k).abs() < 1.96 * s.std_white);
        assert!(s.std > s.std_white);
    }
    // four standard deviations of 3.1 about 190
    assert!((178..=200).contains(&allowing), "{allowing}");
    assert!(white < 120, "{white} of white intervals cover: the walk is too weak to test anything");
}

#[test]
fn a_curvature_that_the_log_supports_is_found() {
    let temperature = room(4000);
    let bent = Thermal { curvature_rad_s_k2: 4e-6, ..TRUE };
    let fit = fitted(&rates(&bent, &temperature, 0.0, 7), &temperature);
    let q = fit.curvature_rad_s_k2.unwrap();
    assert!((q.estimate - 4e-6).abs() < 4.0 * q.std && q.std < 1e-6, "{q:?}");
    for t in [20.0, 25.0, 30.0] {
        let off = fit.model().error_rad_s(t) - bent.error_rad_s(t);
        assert!(off.abs() < 4.0 * fit.model_std_rad_s(t), "{off} at {t}");
    }
    assert_eq!(fit.directions().len(), 3);
}

#[test]
fn two_temperatures_hold_no_parabola() {
    // not exact in binary, so that their powers are rounded
    let temperature: Vec<f64> = (0..2400).map(|i| if i / 300 % 2 == 0 { 21.3 } else { 27.9 }).collect();
    let fit = fitted(&rates(&TRUE, &temperature, 0.0, 5), &temperature);
    assert!(fit.curvature_rad_s_k2.is_none() && fit.curvature_p_value.is_none(), "{:?}", fit.curvature_p_value);
    assert!(fit.found() && covers(&fit.sensitivity_rad_s_k, 3e-5), "{:?}", fit.sensitivity_rad_s_k);
}

#[test]
fn noise_of_the_thermometer_is_known_for_what_it_does_to_the_slope() {
    let temperature = room(8000);
    let mut draw = Stream::new(11, 3);
    let read: Vec<f64> = temperature.iter().map(|t| t + 2.0 * draw.normal()).collect();
    let steep = Thermal { sensitivity_rad_s_k: 3e-4, ..TRUE };
    let fit = fitted(&rates(&steep, &temperature, 0.0, 11), &read);
    // one sample a block: 2 K of noise beside a sine of 5 K, its variance known to 4 %
    let share = 4.0 / (4.0 + 12.5);
    assert!((fit.attenuation / share - 1.0).abs() < 0.08, "{} {share}", fit.attenuation);
    let s = fit.sensitivity_rad_s_k;
    assert!((s.estimate - (1.0 - share) * 3e-4).abs() < 5.0 * s.std, "{s:?}");
    assert!((fit.temperature_noise_c / 2.0 - 1.0).abs() < 0.04, "{}", fit.temperature_noise_c);
}

#[test]
fn time_and_temperature_are_told_apart_where_the_log_can() {
    let len = 6000;
    let (time, room) = (axis(len), room(len));
    let decided = |values: &[f64], temperature: &[f64]| {
        let drift = fit_temperature(&time, values, temperature).unwrap().explanation.unwrap();
        (drift.decided, drift.correlation)
    };
    let steep = Thermal { sensitivity_rad_s_k: 3e-4, ..TRUE };
    let by_room = rates(&steep, &room, 0.0, 21);
    assert_eq!(decided(&by_room, &room).0, Some(Explanation::Temperature));

    let warm = WarmUp { c1_rad_s: 4e-3, c2_rad_s: -4e-3, time_constant_s: 800.0 };
    let mut draw = Stream::new(22, 0);
    let by_time: Vec<f64> = (0..len).map(|i| warm.error_rad_s(i as f64) + SIGMA * draw.normal()).collect();
    assert_eq!(decided(&by_time, &room).0, Some(Explanation::ElapsedTime));

    // a sensor that warms itself: the temperature is the exponential
    let own: Vec<f64> = (0..len).map(|i| 40.0 - 15.0 * (-(i as f64) / 800.0).exp()).collect();
    let (found, correlation) = decided(&rates(&steep, &own, 0.0, 23), &own);
    assert_eq!(found, None);
    assert!(correlation.abs() > 0.99, "{correlation}");
}

#[test]
fn a_log_that_was_read_once_gives_the_same() {
    let len = 60_000;
    let temperature = room(len);
    let values = rates(&TRUE, &temperature, 0.0, 31);
    let limits = Limits { blocks: 1 << 12, stretch: 1 << 12, stretches: 4 };
    let mut pass = Reducer::new(STEP_S, values[0], true, limits);
    for (i, (y, t)) in values.iter().zip(&temperature).enumerate() {
        // the thermometer is read now and then
        pass.push(i as f64 * STEP_S, *y, if i % 3 == 0 { *t } else { f64::NAN });
    }
    let reduced = pass.finish().unwrap();
    assert!(reduced.coarse.block > 1);
    let (once, whole) =
        (fit_temperature_reduced(&reduced).unwrap(), fit_temperature(&axis(len), &values, &temperature).unwrap());
    for (a, b) in [(once.bias_rad_s, whole.bias_rad_s), (once.sensitivity_rad_s_k, whole.sensitivity_rad_s_k)] {
        // means over 16 and over 8 samples weigh the same samples: their difference is far below either's error
        assert!((a.estimate - b.estimate).abs() < 0.1 * b.std, "{a:?} {b:?}");
        assert!((a.std / b.std - 1.0).abs() < 0.12);
    }
    assert!((once.residual_std_rad_s / whole.residual_std_rad_s - 1.0).abs() < 1e-3);
    assert_eq!(once.explanation.unwrap().decided, whole.explanation.unwrap().decided);
}

#[test]
fn what_cannot_be_fitted_is_named() {
    let len = 500;
    let (time, room) = (axis(len), room(len));
    let values = rates(&TRUE, &room, 0.0, 41);
    let said = |temperature: &[f64]| fit_temperature(&time, &values, temperature).unwrap_err().to_string();
    assert!(said(&vec![25.0; len]).contains("25.00 °C throughout"));
    assert!(said(&vec![f64::NAN; len]).contains("temperature_c"));
    assert!(said(&room[..10]).contains("10 values"));
    // two temperatures hold a line and no parabola
    let two: Vec<f64> = (0..len).map(|i| if i < 200 { 20.0 } else { 30.0 }).collect();
    let fit = fitted(&rates(&TRUE, &two, 0.0, 42), &two);
    assert!(fit.curvature_rad_s_k2.is_none());
}
