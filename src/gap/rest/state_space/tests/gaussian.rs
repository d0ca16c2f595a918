//! Gaussian models, where the filter must be exact.

use super::small;
use crate::ErrorKind;
use crate::bias::WarmUp;
use crate::gap::rest::state_space::*;
use crate::math::random::Stream;
use crate::model::Scene;
use crate::signal::TimeAxis;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Weights of past white noise in the filtered noise: z_k = Σ_l ψ_l w_{k-l}.
fn impulse_response(low_pass: &LowPass, len: usize) -> Vec<f64> {
    let mut psi = vec![0.0; len];
    for l in 0..len {
        psi[l] = low_pass.ma.get(l).copied().unwrap_or(0.0)
            + low_pass.ar.iter().enumerate().filter(|(i, _)| *i < l).map(|(i, a)| a * psi[l - 1 - i]).sum::<f64>();
    }
    psi
}

/// Mean vector and covariance matrix of all rows, written down term by term.
fn dense(b: &StateSpaceModel) -> (DVector<f64>, DMatrix<f64>) {
    let n = b.rows;
    let mut mean = DVector::from_fn(n, |k, _| b.fixed_at(k));
    let mut covariance = DMatrix::zeros(n, n);
    for c in &b.coefficients {
        let x = DVector::from_column_slice(&c.column);
        mean += c.mean * &x;
        covariance += c.std.powi(2) * &x * x.transpose();
    }
    for m in &b.markov {
        let mut variance = m.initial_variance;
        for l in 0..n {
            for k in l..n {
                covariance[(k, l)] += m.decay.powi((k - l) as i32) * variance;
                if k > l {
                    covariance[(l, k)] += m.decay.powi((k - l) as i32) * variance;
                }
            }
            variance = m.decay.powi(2) * variance + m.variance;
        }
    }
    for o in &b.oscillators {
        let lag = |k: usize, l: usize| k.abs_diff(l) as i32;
        let of = |d: i32| o.variance * o.decay.powi(d) * (f64::from(d) * o.angle_rad).cos();
        covariance += DMatrix::from_fn(n, n, |k, l| of(lag(k, l)));
    }
    match &b.low_pass {
        None => (0..n).for_each(|k| covariance[(k, k)] += b.white_std_at(k).powi(2)),
        Some(low_pass) => {
            let past = 3000;
            let psi = impulse_response(low_pass, past + n);
            // white noise before the first row is as strong as in it
            let std = |i: isize| b.white_std_at(i.max(0) as usize);
            for k in 0..n as isize {
                for l in 0..n as isize {
                    covariance[(k as usize, l as usize)] += (-(past as isize)..=k.min(l))
                        .map(|i| psi[(k - i) as usize] * psi[(l - i) as usize] * std(i).powi(2))
                        .sum::<f64>();
                }
            }
        }
    }
    (mean, covariance)
}

/// Log density of the rows that are there.
fn dense_log_density(b: &StateSpaceModel, y: &[f64]) -> f64 {
    let (mean, covariance) = dense(b);
    let there: Vec<usize> = (0..y.len()).filter(|k| y[*k].is_finite()).collect();
    let residual = DVector::from_iterator(there.len(), there.iter().map(|k| y[*k] - mean[*k]));
    let covariance = covariance.select_rows(&there).select_columns(&there);
    let factor = covariance.cholesky().unwrap();
    let log_determinant = 2.0 * factor.l().diagonal().map(f64::ln).sum();
    -0.5 * (there.len() as f64 * TAU.ln() + log_determinant + residual.dot(&factor.solve(&residual)))
}

fn variants() -> Vec<StateSpaceModel> {
    let rows = 90;
    let plain = small(rows);
    let mut growing = plain.clone();
    growing.white_scale = Some((0..rows).map(|k| 1.0 + 0.02 * k as f64).collect());
    growing.fixed_rad_s = Some((0..rows).map(|k| 0.03 * k as f64).collect());
    let mut first_order = plain.clone();
    first_order.low_pass = Some(LowPass { ar: vec![0.8], ma: vec![0.2] });
    let mut arma = growing.clone();
    arma.low_pass = Some(LowPass { ar: vec![1.1, -0.4], ma: vec![0.1, 0.15, 0.05] });
    let mut third_order = plain.clone();
    third_order.low_pass = Some(LowPass { ar: vec![0.6, 0.2, -0.3], ma: vec![0.5] });
    third_order.markov.clear();
    let bare = StateSpaceModel::white(rows, 0.1, 2.0);
    let mut swinging = arma.clone();
    swinging.oscillators.push(Oscillator { decay: 0.97, angle_rad: 0.7, variance: 0.8 });
    swinging.oscillators.push(Oscillator::band(2.6, 0.3, 0.5, 0.1));
    vec![plain, growing, first_order, arma, third_order, bare, swinging]
}

#[test]
fn likelihood_is_the_dense_normal_density() {
    for (at, believed) in variants().iter().enumerate() {
        let mut y = believed.simulate(3, at as u64).unwrap();
        let (a, b) = (believed.score(&y).unwrap().total(), dense_log_density(believed, &y));
        assert!((a - b).abs() < 1e-8, "variant {at}: {a} {b}");
        y[0] = f64::NAN;
        y[30..41].fill(f64::NAN);
        y[77] = f64::NAN;
        let (a, b) = (believed.score(&y).unwrap().total(), dense_log_density(believed, &y));
        assert!((a - b).abs() < 1e-8, "variant {at} with gaps: {a} {b}");
    }
}

#[test]
fn a_block_given_the_rest_is_a_conditional_normal() {
    let believed = &variants()[1];
    let y = believed.simulate(8, 0).unwrap();
    let (mean, covariance) = dense(believed);
    let block = 35..50;
    let inside: Vec<usize> = block.clone().collect();
    let outside: Vec<usize> = (0..y.len()).filter(|k| !block.contains(k)).collect();
    let pick = |rows: &[usize]| DVector::from_iterator(rows.len(), rows.iter().map(|k| y[*k] - mean[*k]));
    let cross = covariance.select_rows(&inside).select_columns(&outside);
    let rest = covariance.select_rows(&outside).select_columns(&outside).cholesky().unwrap();
    let given = covariance.select_rows(&inside).select_columns(&inside) - &cross * rest.solve(&cross.transpose());
    let residual = pick(&inside) - &cross * rest.solve(&pick(&outside));
    let factor = given.cholesky().unwrap();
    let expected = -0.5
        * (inside.len() as f64 * TAU.ln()
            + 2.0 * factor.l().diagonal().map(f64::ln).sum()
            + residual.dot(&factor.solve(&residual)));
    let found = blocked_log_score(believed, &y, &[block]).unwrap()[0];
    assert!((found - expected).abs() < 1e-8, "{found} {expected}");
    assert_eq!(blocked_log_score(believed, &y, std::slice::from_ref(&(80..200))).unwrap_err().kind, ErrorKind::Value);
}

#[test]
fn long_recordings_keep_their_digits() {
    // the nuisances of a real log with one-over-f states, against the same model in other units of the coefficients
    // and with the states in another order: rounding goes other ways, the likelihood is the same
    let rows = 20_000;
    let scene = Scene {
        time: TimeAxis::Uniform { start_s: 5.0, step_s: 0.02, len: rows },
        step_s: 0.02,
        temperature_c: None,
        power_on_temperature_c: None,
        supply_v: None,
        warm_up: WarmUp { c1_rad_s: 3e-3, c2_rad_s: -5e-3, time_constant_s: 180.0 },
        white_std_rad_s: 1.2e-3,
        turn_on_bias_std_rad_s: 1e-2,
        warm_up_relative_std: 0.3,
    };
    let mut a = StateSpaceModel::nominal(&scene);
    a.markov = flicker(2e-5, rows).unwrap().states;
    a.markov.push(Markov::random_walk(1e-6, 0.02));
    let mut b = a.clone();
    b.markov.reverse();
    b.coefficients.reverse();
    for c in &mut b.coefficients {
        c.column.iter_mut().for_each(|x| *x *= 1e3);
        c.std /= 1e3;
    }
    let y = a.simulate(4, 0).unwrap();
    let (la, lb) = (a.score(&y).unwrap().total(), b.score(&y).unwrap().total());
    assert!((la - lb).abs() < 1e-5, "{la} {lb}");
}

#[test]
fn scores_of_simulated_recordings_have_the_expected_mean() {
    // Σ ν²/S is chi-squared with one degree a row: mean and variance of the log density are known
    for (at, believed) in variants().iter().enumerate() {
        let logs = 300;
        let z: Vec<f64> = (0..logs)
            .map(|stream| {
                let y = believed.simulate(21, stream).unwrap();
                let run = believed.score(&y).unwrap();
                let expected: f64 = run.predicted_std_rad_s.iter().map(|s| -0.5 * ((TAU * s * s).ln() + 1.0)).sum();
                (run.total() - expected) / (0.5 * y.len() as f64).sqrt()
            })
            .collect();
        let mean = z.iter().sum::<f64>() / logs as f64;
        let variance = z.iter().map(|z| z * z).sum::<f64>() / logs as f64;
        assert!(mean.abs() < 4.0 / (logs as f64).sqrt(), "variant {at}: {mean}");
        // the variance of a squared near-normal deviate is 2 plus its excess kurtosis, 12/n_rows here
        assert!((variance - 1.0).abs() < 4.0 * (2.2 / logs as f64).sqrt(), "variant {at}: {variance}");
    }
}

#[test]
fn forecasts_are_the_predictions_without_readings() {
    let mut all = variants();
    for b in &mut all {
        b.telegraph = Some(Telegraph { levels_rad_s: [-1.0, 2.0], mean_dwell_s: [2.0, 3.0] });
        b.step = Some(Step { size_rad_s: 3.0, at: 20..70 });
    }
    all.extend(variants());
    for (at, believed) in all.iter().enumerate() {
        let y = believed.simulate(6, at as u64).unwrap();
        let horizons = [Horizon { rows: 1, first: 0, every: 9 }, Horizon { rows: 25, first: 2, every: 7 }];
        let run = believed.run(&y, &horizons).unwrap();
        for (horizon, forecasts) in horizons.iter().zip(&run.forecasts) {
            assert_eq!(forecasts.len(), (believed.rows - horizon.rows - horizon.first) / horizon.every + 1);
            for f in forecasts {
                let mut known = y.clone();
                known[f.row..].fill(f64::NAN);
                let blind = believed.score(&known).unwrap();
                let sum: f64 = blind.predicted_rad_s[f.row..f.row + horizon.rows].iter().sum();
                let error = f.increment_rad - sum * believed.step_s;
                // a refuted piece of the prior is dropped at 1e-8
                assert!(error.abs() < 1e-6, "variant {at}, row {}: {error}", f.row);
            }
        }
    }
}

#[test]
fn a_nominal_scene_is_its_warm_up() {
    let scene = Scene {
        time: TimeAxis::Uniform { start_s: 2.0, step_s: 0.5, len: 400 },
        step_s: 0.5,
        temperature_c: None,
        power_on_temperature_c: None,
        supply_v: None,
        warm_up: WarmUp { c1_rad_s: 3e-3, c2_rad_s: -5e-3, time_constant_s: 60.0 },
        white_std_rad_s: 1e-4,
        turn_on_bias_std_rad_s: 2e-4,
        warm_up_relative_std: 0.03,
    };
    let believed = StateSpaceModel::nominal(&scene);
    let mut draw = Stream::new(2, 0);
    // a unit one standard deviation off in each: linear in C1 and C2, second order in T
    let unit = WarmUp { c1_rad_s: 3e-3 * 1.03, c2_rad_s: -5e-3 + 2e-4, time_constant_s: 60.0 * 1.03 };
    let y: Vec<f64> = (0..400).map(|k| unit.error_rad_s(2.0 + 0.5 * f64::from(k)) + 1e-4 * draw.normal()).collect();
    let run = believed.score(&y).unwrap();
    let chi: f64 = run.innovation_rad_s.iter().zip(&run.predicted_std_rad_s).map(|(v, s)| (v / s).powi(2)).sum();
    assert!((chi - 400.0).abs() < 4.0 * 800f64.sqrt(), "{chi}");
    let last = run.predicted_std_rad_s[399];
    assert!(last < 1.02e-4, "{last}");
}

#[test]
fn senseless_models_are_refused_by_name() {
    let y = vec![0.0; 90];
    let spoil = |change: &dyn Fn(&mut StateSpaceModel)| {
        let mut b = small(90);
        change(&mut b);
        b.score(&y).unwrap_err()
    };
    type Change<'a> = &'a dyn Fn(&mut StateSpaceModel);
    let cases: [(&str, Change<'_>); 9] = [
        ("white_std_rad_s", &|b| b.white_std_rad_s = 0.0),
        ("step_s", &|b| b.step_s = f64::NAN),
        ("coefficients[1].column", &|b| b.coefficients[1].column[3] = f64::NAN),
        ("fixed_rad_s", &|b| b.fixed_rad_s = Some(vec![0.0; 3])),
        ("markov[0].decay", &|b| b.markov[0].decay = 1.1),
        ("low_pass.ar", &|b| b.low_pass = Some(LowPass { ar: vec![1.5, -0.4], ma: vec![1.0] })),
        ("outliers.probability", &|b| b.outliers = Some(Outliers { probability: 1.0, std_rad_s: 1.0 })),
        ("telegraph.mean_dwell_s", &|b| b.telegraph = Some(Telegraph::centred(1.0, [0.01, 3.0]))),
        ("step.at", &|b| b.step = Some(Step { size_rad_s: 1.0, at: 80..91 })),
    ];
    for (place, change) in cases {
        let error = spoil(change);
        assert_eq!((error.kind, error.place.as_deref()), (ErrorKind::Value, Some(place)), "{error}");
    }
    assert!(small(90).score(&y[..80]).is_err());
    assert!(small(90).score(&y).is_ok());
}
