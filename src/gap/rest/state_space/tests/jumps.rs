//! Telegraph and step against the sum over all histories, each an exact Gaussian model.

use super::{log_sum_exp, negligible, small};
use crate::gap::rest::state_space::*;

/// ln Σ_path P(path) p(y | path) over all 2^rows paths of the telegraph.
fn all_paths(believed: &StateSpaceModel, y: &[f64]) -> f64 {
    let telegraph = believed.telegraph.unwrap();
    let leave = telegraph.leave(believed.step_s);
    let high = telegraph.high_probability();
    let logs: Vec<f64> = (0..1u32 << believed.rows)
        .map(|path| {
            let at = |k: usize| (path >> k & 1) as usize;
            let mut log = [1.0 - high, high][at(0)].ln();
            for k in 1..believed.rows {
                let p = leave[at(k - 1)];
                log += if at(k) == at(k - 1) { 1.0 - p } else { p }.ln();
            }
            let mut known = believed.clone();
            known.telegraph = None;
            known.fixed_rad_s =
                Some((0..believed.rows).map(|k| believed.fixed_at(k) + telegraph.levels_rad_s[at(k)]).collect());
            log + known.score(y).unwrap().total()
        })
        .collect();
    log_sum_exp(&logs)
}

#[test]
fn a_telegraph_is_close_to_the_sum_over_all_paths() {
    // the white noise is 0.7
    for spacing in [0.3, 1.4, 5.0, 20.0] {
        let mut believed = small(12);
        believed.coefficients[0].std = 0.3;
        believed.telegraph = Some(Telegraph::centred(spacing, [0.4, 0.6]));
        let errors: Vec<f64> = (0..12)
            .map(|stream| {
                let y = believed.simulate(13, stream).unwrap();
                believed.score(&y).unwrap().total() - all_paths(&believed, &y)
            })
            .collect();
        assert!(negligible(&errors), "{spacing}: {errors:?}");
    }
}

/// ln of the mean over all rows at which the step may be.
fn all_rows(believed: &StateSpaceModel, y: &[f64]) -> f64 {
    let step = believed.step.clone().unwrap();
    let logs: Vec<f64> = step
        .at
        .clone()
        .map(|row| {
            let mut known = believed.clone();
            known.step = None;
            known.fixed_rad_s = Some(
                (0..believed.rows)
                    .map(|k| believed.fixed_at(k) + if k >= row { step.size_rad_s } else { 0.0 })
                    .collect(),
            );
            known.score(y).unwrap().total()
        })
        .collect();
    log_sum_exp(&logs) - (step.at.len() as f64).ln()
}

#[test]
fn a_step_is_close_to_the_mean_over_all_rows() {
    // sizes in units of the white noise
    for size in [0.5, 2.0, 8.0] {
        let mut believed = small(300);
        believed.markov.truncate(1);
        believed.coefficients[0].std = 0.3;
        believed.step = Some(Step { size_rad_s: 0.7 * size, at: 30..270 });
        let errors: Vec<f64> = (0..12)
            .map(|stream| {
                let y = believed.simulate(17, stream).unwrap();
                believed.score(&y).unwrap().total() - all_rows(&believed, &y)
            })
            .collect();
        assert!(negligible(&errors), "{size}: {errors:?}");
    }
}

#[test]
fn jumps_without_height_change_nothing() {
    let plain = small(80);
    let mut idle = plain.clone();
    idle.telegraph = Some(Telegraph::centred(0.0, [1.0, 2.0]));
    idle.step = Some(Step { size_rad_s: 0.0, at: 0..80 });
    let mut y = plain.simulate(3, 0).unwrap();
    y[12..20].fill(f64::NAN);
    let (a, b) = (plain.score(&y).unwrap().total(), idle.score(&y).unwrap().total());
    assert!((a - b).abs() < 1e-9, "{a} {b}");
}

#[test]
fn a_sure_step_is_a_known_one() {
    let mut known = small(80);
    known.coefficients[0].std = 0.2; // narrow enough not to be cut into pieces
    known.coefficients[1].std = 0.2;
    let y = known.simulate(4, 0).unwrap();
    let mut sure = known.clone();
    sure.step = Some(Step { size_rad_s: 2.5, at: 33..34 });
    known.fixed_rad_s = Some((0..80).map(|k| if k >= 33 { 2.5 } else { 0.0 }).collect());
    let (a, b) = (known.score(&y).unwrap().total(), sure.score(&y).unwrap().total());
    assert!((a - b).abs() < 1e-9, "{a} {b}");
}
