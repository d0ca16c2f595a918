//! Lattice and outliers: with one static coefficient the likelihood is an integral over it.

use super::{log_sum_exp, negligible};
use crate::gap::rest::state_space::quantization::Cell;
use crate::gap::rest::state_space::*;

/// White noise of one and a constant of `std`.
fn constant(rows: usize, std: f64) -> StateSpaceModel {
    let mut believed = StateSpaceModel::white(rows, 0.1, 1.0);
    believed.coefficients.push(Coefficient { column: vec![1.0; rows], mean: 0.4, std });
    believed
}

/// ln ∫ N(β; mean, std²) p(y | β) dβ by the trapezoidal rule, which is all but exact for smooth densities.
fn integral(believed: &StateSpaceModel, log_likelihood: impl Fn(f64) -> f64) -> f64 {
    let Coefficient { mean, std, .. } = believed.coefficients[0];
    let (n, reach) = (600, 6.0);
    let logs: Vec<f64> = (0..=n)
        .map(|i| reach * (2.0 * f64::from(i) / f64::from(n) - 1.0))
        .map(|z| -0.5 * z * z + log_likelihood(mean + std * z))
        .collect();
    log_sum_exp(&logs) + (2.0 * reach / f64::from(n)).ln() - 0.5 * std::f64::consts::TAU.ln()
}

/// Total scores minus exact ones, for several simulated recordings.
fn errors(believed: &StateSpaceModel, exact: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    (0..5)
        .map(|stream| {
            let y = believed.simulate(5, stream).unwrap();
            believed.score(&y).unwrap().total() - exact(&y)
        })
        .collect()
}

#[test]
fn a_lattice_is_scored_as_the_integral_over_cells() {
    for rows in [40, 1000] {
        for lsb in [0.01, 0.5, 2.0, 4.0] {
            let mut believed = constant(rows, 0.4);
            believed.lattice_lsb_rad_s = Some(lsb);
            let y = believed.simulate(5, 0).unwrap();
            assert!(y.iter().all(|y| (y / lsb - (y / lsb).round()).abs() < 1e-9));
            let found = errors(&believed, |y| {
                integral(&believed, |beta| {
                    y.iter().map(|y| Cell::new(y - beta, 0.5 * lsb).log_probability - lsb.ln()).sum()
                })
            });
            assert!(negligible(&found), "{rows} {lsb}: {found:?}");
        }
    }
}

#[test]
fn a_fine_lattice_is_no_lattice() {
    let plain = constant(100, 2.0);
    let mut fine = plain.clone();
    fine.lattice_lsb_rad_s = Some(1e-5);
    let y = fine.simulate(1, 0).unwrap();
    let (a, b) = (plain.score(&y).unwrap().total(), fine.score(&y).unwrap().total());
    assert!((a - b).abs() < 1e-6, "{a} {b}");
}

fn log_normal(r: f64, s: f64) -> f64 {
    -0.5 * ((std::f64::consts::TAU * s * s).ln() + r * r / (s * s))
}

#[test]
fn outliers_are_scored_as_the_integral_over_the_mixture() {
    for (rows, prior) in [(60, 0.4), (60, 3.0), (1000, 0.4), (1000, 3.0)] {
        for (probability, std) in [(0.002, 10.0), (0.02, 10.0), (0.1, 4.0), (0.2, 20.0)] {
            let mut believed = constant(rows, prior);
            believed.outliers = Some(Outliers { probability, std_rad_s: std });
            let wide = f64::hypot(1.0, std);
            let found = errors(&believed, |y| {
                integral(&believed, |beta| {
                    let mixture = |r: f64| {
                        (1.0 - probability) * log_normal(r, 1.0).exp() + probability * log_normal(r, wide).exp()
                    };
                    y.iter().map(|y| mixture(y - beta).ln()).sum()
                })
            });
            assert!(negligible(&found), "{rows} {prior} {probability} {std}: {found:?}");
        }
    }
}

#[test]
fn a_telegraph_is_scored_as_the_integral_over_hidden_chains() {
    for (rows, prior) in [(60, 0.4), (60, 3.0), (1000, 0.4), (1000, 3.0)] {
        for (spacing, dwell_s) in [(0.5, 10.0), (1.0, 20.0), (2.0, 5.0), (2.0, 1.0), (6.0, 5.0)] {
            let mut believed = constant(rows, prior);
            let telegraph = Telegraph::centred(spacing, [dwell_s, 1.5 * dwell_s]);
            believed.telegraph = Some(telegraph);
            let [up, down] = telegraph.leave(believed.step_s);
            let high = telegraph.high_probability();
            let found = errors(&believed, |y| {
                integral(&believed, |beta| {
                    // forward algorithm of the hidden chain, scaled in each row
                    let (mut p, mut log) = ([1.0 - high, high], 0.0);
                    for (k, y) in y.iter().enumerate() {
                        if k > 0 {
                            p = [p[0] * (1.0 - up) + p[1] * down, p[0] * up + p[1] * (1.0 - down)];
                        }
                        for (p, level) in p.iter_mut().zip(telegraph.levels_rad_s) {
                            *p *= log_normal(y - beta - level, 1.0).exp().max(1e-300);
                        }
                        let sum = p[0] + p[1];
                        log += sum.ln();
                        p = p.map(|p| p / sum);
                    }
                    log
                })
            });
            assert!(negligible(&found), "{rows} {prior} {spacing} {dwell_s}: {found:?}");
        }
    }
}

#[test]
fn a_step_is_scored_as_the_integral_over_its_rows() {
    for (rows, prior) in [(60, 0.4), (60, 3.0), (1000, 0.4), (1000, 3.0)] {
        for size in [0.2, 0.5, 1.0, 2.0, 6.0] {
            let mut believed = constant(rows, prior);
            believed.step = Some(Step { size_rad_s: size, at: rows / 10..rows - rows / 10 });
            let found = errors(&believed, |y| {
                integral(&believed, |beta| {
                    // all rows before the step, then one after the other behind it
                    let mut log: f64 = y.iter().map(|y| log_normal(y - beta, 1.0)).sum();
                    let mut logs = Vec::new();
                    for row in (0..rows - rows / 10).rev() {
                        let r = y[row] - beta;
                        if row + 1 == rows - rows / 10 {
                            log += y[row + 1..]
                                .iter()
                                .map(|y| log_normal(y - beta - size, 1.0) - log_normal(y - beta, 1.0))
                                .sum::<f64>();
                        }
                        log += log_normal(r - size, 1.0) - log_normal(r, 1.0);
                        if row >= rows / 10 {
                            logs.push(log);
                        }
                    }
                    log_sum_exp(&logs) - (logs.len() as f64).ln()
                })
            });
            assert!(negligible(&found), "{rows} {prior} {size}: {found:?}");
        }
    }
}

#[test]
fn a_wild_reading_counts_as_unlikely_not_as_impossible() {
    let mut believed = constant(50, 2.0);
    believed.lattice_lsb_rad_s = Some(0.1);
    let mut y = believed.simulate(2, 0).unwrap();
    y[20] = 500.0;
    let row = believed.score(&y).unwrap().log_density[20];
    assert!(row < -1e5 && row.is_finite(), "{row}");
    believed.outliers = Some(Outliers { probability: 1e-3, std_rad_s: 300.0 });
    let run = believed.score(&y).unwrap();
    assert!(run.log_density[20] > -20.0, "{}", run.log_density[20]);
    // and the estimate did not move
    assert!((run.predicted_rad_s[21] - run.predicted_rad_s[20]).abs() < 0.1);
}
