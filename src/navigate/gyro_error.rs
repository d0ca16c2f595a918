//! de/dt = λ (s - e),  s = C1 + C2,  with e, s and ln T as states of the filter
//!
//! e(t) = s - C1 exp(-λ t), t from power-on. In the exact discretisation λ = 1/T; a discretised model that multiplies
//! e - s by `decay` once every Ts has λ = -ln(decay)/Ts: backward Euler ln(1 + Ts/T)/Ts, forward Euler
//! -ln(1 - Ts/T)/Ts. Over a step dt the filter multiplies by exp(-λ dt), so that uneven steps agree with the
//! recursion that the configuration states, and two half steps with a whole one.
//!
//! # Joint covariance at the start
//!
//! The fit's covariance Σ of (C1, C2, T), plus what varies from power-on to power-on (variances (ρ C1)², σ², (ρ T)²),
//! is carried to (e, s, ln T) at the start t0 by J Σ Jᵀ (delta method), with E = exp(-λ t0), λ' = ∂λ/∂ln T:
//!
//! ```text
//!     ∂/∂      C1      C2    T
//!     e        1 - E   1     C1 t0 E λ'/T
//!     s        1       1     0
//!     ln T     0       0     1/T
//! ```
//!
//! Switched on again before it was cold, the gyro lacks the share m = 1 - h0 of its warm-up ([`crate::bias::Restart`]),
//! so that e = s - C1 m E with m' = ∂m/∂ln T. Only the row of e changes; with m = 1 it is the one above:
//!
//! ```text
//!     e        1 - m E     1     C1 E (m t0 λ' - m')/T
//! ```
//!
//! The same T holds in both runs and, where no cooling time constant is stated, in between; a discretised model's is
//! 1/λ. t0 counts from the new power-on, and so does what is new with it: random walk, spread from power-on to power-on.
//!
//! A rate random walk is a walk of C2: it moves e and s alike and leaves e - s alone, so that e and s share the
//! process noise K² dt exactly, and K² t0 at the start.

use crate::bias::{Lack, Restart, Scheme};
use crate::config::{Config, Gyro};
use crate::error::{Error, ErrorKind, Result};
use nalgebra::Matrix3;

/// Standard deviation of ln T beyond which linearisation means nothing: T then lies, at 95 %, within a factor 2.7.
///
/// A fit that knows T less well is narrowed to this as by a measurement of T, which keeps what the fit knows of
/// combinations, such as C1/T from a log much shorter than T.
pub(crate) const LN_TIME_CONSTANT_STD_LIMIT: f64 = 0.5;

/// ln T stays this close to its first value: four of the largest standard deviations.
pub(crate) const LN_TIME_CONSTANT_REACH: f64 = 4.0 * LN_TIME_CONSTANT_STD_LIMIT;

/// Floor of the error's standard deviations, so that the covariance of a model without any uncertainty is positive
/// definite: 2e-4 °/h.
const ERROR_STD_FLOOR_RAD_S: f64 = 1e-9;
const LN_TIME_CONSTANT_STD_FLOOR: f64 = 1e-6;

/// How the error approaches its asymptote.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decay {
    scheme: Scheme,
    sample_time_s: f64,
}

impl Decay {
    /// The configuration's discretisation; exact where it states none.
    pub(crate) fn new(config: &Config) -> Result<Self> {
        let gyro = config.require_gyro()?;
        let Some(discrete) = &gyro.discrete else {
            return Ok(Self { scheme: Scheme::Exact, sample_time_s: 0.0 });
        };
        let shortest_s = gyro.time_constant_s * (-LN_TIME_CONSTANT_REACH).exp();
        if discrete.scheme == Scheme::ForwardEuler && discrete.sample_time_s >= shortest_s {
            let found =
                format!("forward Euler at {} s with T = {} s oscillates", discrete.sample_time_s, gyro.time_constant_s);
            return Err(Error::new(ErrorKind::Config, "configuration", found)
                .at("`gyro.discrete.scheme`")
                .hint(format!("export the exact scheme, or a sample time below {shortest_s:.3} s")));
        }
        Ok(Self { scheme: discrete.scheme, sample_time_s: discrete.sample_time_s })
    }

    /// λ (1/s) and ∂λ/∂ln T (1/s) at time constant `t_s`.
    #[inline]
    pub(crate) fn rate(&self, t_s: f64) -> (f64, f64) {
        let h = self.sample_time_s / t_s;
        match self.scheme {
            Scheme::Exact => (1.0 / t_s, -1.0 / t_s),
            Scheme::BackwardEuler => (h.ln_1p() / self.sample_time_s, -1.0 / (t_s * (1.0 + h))),
            Scheme::ForwardEuler => (-(-h).ln_1p() / self.sample_time_s, -1.0 / (t_s * (1.0 - h))),
        }
    }
}

/// (e, s, ln T) at the start of a drive.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prior {
    pub mean: [f64; 3],
    pub covariance: Matrix3<f64>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

impl Prior {
    /// The state of knowledge `since_power_on_s` after power-on, cold or as `restart` says.
    pub(crate) fn new(gyro: &Gyro, decay: &Decay, restart: Option<&Restart>, since_power_on_s: f64) -> Self {
        let model = gyro.warm_up();
        let (c1, t) = (model.c1_rad_s, model.time_constant_s);
        let (rate, rate_by_ln_t) = decay.rate(t);
        let left = (-rate * since_power_on_s).exp();
        // by ln(1/λ), of which the scheme makes a little less or more than ln T
        let lack = restart.map_or(Lack::COLD, |r| r.lack(1.0 / rate));
        let lack_by_ln_t = -lack.by_ln_time_constant * rate_by_ln_t / rate;
        let by_t = c1 * left * (lack.share * since_power_on_s * rate_by_ln_t - lack_by_ln_t) / t;
        let left = lack.share * left;
        let jacobian = Matrix3::new(1.0 - left, 1.0, by_t, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0 / t);

        let mut notes = Vec::new();
        let (sigma, stated) = parameter_covariance(gyro);
        if !stated {
            notes.push(
                "the configuration states no uncertainty of the gyro model: taken as exact (add \
                 turn_on_bias_std_rad_s, or fit it anew)"
                    .to_string(),
            );
        }
        match (restart, gyro.last_run) {
            (Some(r), _) => notes.push(format!(
                "warm restart: at power-on the gyro was as warm as {:.0} s after a cold one{}",
                r.age_s(t),
                if gyro.cooling_time_constant_s.is_some() {
                    ""
                } else {
                    " (cooling_time_constant_s is not stated: taken as time_constant_s)"
                }
            )),
            (None, Some(last)) => notes.push(format!(
                "taken as a cold power-on, although the last run ended {:.0} s warm: say with --off-time how long the \
                 gyro was off",
                last.warm_up_age_s
            )),
            (None, None) => {}
        }
        let mut covariance = jacobian * sigma * jacobian.transpose();
        let walk = gyro.noise.as_ref().and_then(|n| n.rate_random_walk_rad_s_sqrt_s).unwrap_or(0.0);
        for i in 0..2 {
            for j in 0..2 {
                covariance[(i, j)] += walk * walk * since_power_on_s;
            }
        }
        for (i, floor) in [ERROR_STD_FLOOR_RAD_S, ERROR_STD_FLOOR_RAD_S, LN_TIME_CONSTANT_STD_FLOOR].iter().enumerate()
        {
            covariance[(i, i)] += floor * floor;
        }
        if let Some(std) = narrow_time_constant(&mut covariance) {
            notes.push(format!(
                "T is known to a factor {:.1} only: taken to a factor {:.1}",
                (2.0 * std).exp(),
                (2.0 * LN_TIME_CONSTANT_STD_LIMIT).exp()
            ));
        }
        let mean = [model.warm_error_rad_s() - c1 * left, model.warm_error_rad_s(), t.ln()];
        Self { mean, covariance, notes }
    }
}

/// Covariance of (C1, C2, T), and whether the configuration states any.
fn parameter_covariance(gyro: &Gyro) -> (Matrix3<f64>, bool) {
    let mut sigma = Matrix3::zeros();
    if let Some(c) = &gyro.covariance {
        let m = c.to_matrix();
        sigma = Matrix3::from_fn(|i, j| m[i][j]);
    }
    let relative = gyro.warm_up_relative_std.unwrap_or(0.0);
    let turn_on = gyro.turn_on_bias_std_rad_s.unwrap_or(0.0);
    let varies = [relative * gyro.c1_rad_s, turn_on, relative * gyro.time_constant_s];
    for (i, std) in varies.iter().enumerate() {
        sigma[(i, i)] += std * std;
    }
    (sigma, sigma.diagonal().amax() > 0.0)
}

/// Conditions on a measurement of ln T that leaves it the largest allowed variance; returns the std it had.
fn narrow_time_constant(p: &mut Matrix3<f64>) -> Option<f64> {
    let variance = p[(2, 2)];
    let allowed = LN_TIME_CONSTANT_STD_LIMIT * LN_TIME_CONSTANT_STD_LIMIT;
    if variance <= allowed {
        return None;
    }
    let column = p.column(2).into_owned();
    *p -= column * column.transpose() * ((1.0 - allowed / variance) / variance);
    Some(variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bias::{Discrete, WarmUp};
    use crate::config::{Covariance, SCHEMA};
    use crate::math::random::Stream;

    fn gyro() -> Gyro {
        Gyro { c1_rad_s: -2.4e-3, c2_rad_s: 8e-3, angle_random_walk_rad_sqrt_s: 1.5e-4, ..Gyro::without_error(240.0) }
    }

    fn config(gyro: Gyro) -> Config {
        let text = format!("schema = {SCHEMA}\n");
        Config { gyro: Some(gyro), ..Config::parse(&text, "x").unwrap() }
    }

    fn exact() -> Decay {
        Decay { scheme: Scheme::Exact, sample_time_s: 0.0 }
    }

    #[test]
    fn many_steps_agree_with_the_exported_recursion() {
        for scheme in Scheme::ALL {
            let mut g = gyro();
            let discrete = Discrete::new(&g.warm_up(), 2.0, scheme).unwrap();
            g.discrete = Some(discrete);
            let decay = Decay::new(&config(g.clone())).unwrap();
            let e = (0..100).fold(discrete.initial, |e, _| discrete.step(e));
            // the prior's mean 200 s after power-on is the recursion's hundredth value
            let prior = Prior::new(&g, &decay, None, 200.0);
            assert!((prior.mean[0] - e).abs() < 1e-15, "{scheme}: {} {e}", prior.mean[0]);
            let (rate, by_ln_t) = decay.rate(240.0);
            let eps = 1e-5f64;
            let (up, down) = (decay.rate(240.0 * eps.exp()).0, decay.rate(240.0 * (-eps).exp()).0);
            // truncation eps²/6, rounding machine precision over eps
            assert!(((up - down) / (2.0 * eps) / by_ln_t - 1.0).abs() < 1e-9, "{scheme}");
            assert!((rate / -by_ln_t - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn forward_euler_that_would_oscillate_is_refused() {
        let mut g = gyro();
        g.discrete = Some(Discrete::new(&g.warm_up(), 100.0, Scheme::ForwardEuler).unwrap());
        assert!(Decay::new(&config(g)).unwrap_err().to_string().contains("oscillates"));
    }

    #[test]
    fn the_joint_covariance_is_that_of_drawn_parameters() {
        // parameters drawn from Σ; with relative spreads of 0.1 % the map is linear to 1e-3
        let mut g = gyro();
        let draws = 20_000;
        let (s1, s2, st, r) = (2.4e-6, 8e-6, 0.24, 0.7);
        g.covariance = Some(Covariance::from_matrix(&[
            [s1 * s1, 0.0, r * s1 * st],
            [0.0, s2 * s2, 0.0],
            [r * s1 * st, 0.0, st * st],
        ]));
        let t0 = 150.0;
        let prior = Prior::new(&g, &exact(), None, t0);
        assert!(prior.notes.is_empty());
        let mut stream = Stream::new(3, 0);
        let mut sum = Matrix3::<f64>::zeros();
        for _ in 0..draws {
            let n = [stream.normal(), stream.normal(), stream.normal()];
            let c1 = g.c1_rad_s + s1 * n[0];
            let t = g.time_constant_s + st * (r * n[0] + (1.0 - r * r).sqrt() * n[2]);
            let m = WarmUp { c1_rad_s: c1, c2_rad_s: g.c2_rad_s + s2 * n[1], time_constant_s: t };
            let d = nalgebra::Vector3::new(
                m.error_rad_s(t0) - prior.mean[0],
                m.warm_error_rad_s() - prior.mean[1],
                t.ln() - prior.mean[2],
            );
            sum += d * d.transpose();
        }
        for i in 0..3 {
            for j in 0..3 {
                let expected = prior.covariance[(i, j)];
                let scale = (prior.covariance[(i, i)] * prior.covariance[(j, j)]).sqrt();
                // five standard errors of a sample covariance, at most sqrt(2/n) of the scale
                let error = (sum[(i, j)] / f64::from(draws) - expected).abs() / scale;
                assert!(error < 5.0 * (2.0 / f64::from(draws)).sqrt() + 1e-3, "{i} {j}: {error}");
            }
        }
    }

    #[test]
    fn a_restart_agrees_with_differences_in_every_parameter() {
        // the prior's covariance with one uncertain parameter at a time is that column of J, squared
        let steps = [1e-9, 1e-9, 1e-4];
        for scheme in Scheme::ALL {
            for cooling in [None, Some(900.0)] {
                let with = |change: [f64; 3]| {
                    let mut g = gyro();
                    g.c1_rad_s += change[0];
                    g.c2_rad_s += change[1];
                    g.time_constant_s += change[2];
                    g.cooling_time_constant_s = cooling;
                    g.last_run = Some(crate::config::LastRun { warm_up_age_s: 600.0 });
                    g.discrete = Some(Discrete::new(&g.warm_up(), 2.0, scheme).unwrap());
                    g
                };
                let prior = |g: &Gyro| {
                    let decay = Decay::new(&config(g.clone())).unwrap();
                    Prior::new(g, &decay, Some(&g.restart(300.0).unwrap()), 40.0)
                };
                for (k, step) in steps.into_iter().enumerate() {
                    let moved =
                        |sign: f64| prior(&with(std::array::from_fn(|i| if i == k { sign * step } else { 0.0 }))).mean;
                    let (up, down) = (moved(1.0), moved(-1.0));
                    let differences: [f64; 3] = std::array::from_fn(|i| (up[i] - down[i]) / (2.0 * step));
                    // large against the floors under the variances
                    let std = 1e3 * step;
                    let mut g = with([0.0; 3]);
                    let mut sigma = [[0.0; 3]; 3];
                    sigma[k][k] = std * std;
                    g.covariance = Some(Covariance::from_matrix(&sigma));
                    let p = prior(&g).covariance;
                    for i in 0..3 {
                        for j in 0..=i {
                            let floor = if i < 2 { ERROR_STD_FLOOR_RAD_S } else { LN_TIME_CONSTANT_STD_FLOOR };
                            let found = p[(i, j)] - if i == j { floor * floor } else { 0.0 };
                            let expected = differences[i] * differences[j] * std * std;
                            let scale = std * std * (differences[i].abs().max(1e-9) * differences[j].abs().max(1e-9));
                            // rounding of the means over 2 steps, and of the floors taken off again
                            assert!(
                                (found - expected).abs() < 1e-3 * scale,
                                "{scheme} {k} {i} {j}: {found} {expected}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_restart_without_a_pause_is_the_same_run_going_on() {
        for scheme in Scheme::ALL {
            let mut g = gyro();
            g.discrete = Some(Discrete::new(&g.warm_up(), 2.0, scheme).unwrap());
            g.warm_up_relative_std = Some(0.03);
            g.last_run = Some(crate::config::LastRun { warm_up_age_s: 150.0 });
            let decay = Decay::new(&config(g.clone())).unwrap();
            let on = Prior::new(&g, &decay, Some(&g.restart(0.0).unwrap()), 50.0);
            let through = Prior::new(&g, &decay, None, 200.0);
            assert!((on.mean[0] - through.mean[0]).abs() < 1e-17, "{scheme}");
            assert!((on.covariance - through.covariance).abs().max() < 1e-12 * through.covariance.max(), "{scheme}");
            // and after a long one it is cold
            let cold = Prior::new(&g, &decay, Some(&g.restart(1e5).unwrap()), 50.0);
            assert!((cold.mean[0] - Prior::new(&g, &decay, None, 50.0).mean[0]).abs() < 1e-17, "{scheme}");
        }
    }

    #[test]
    fn the_random_walk_counts_from_the_new_power_on() {
        let mut g = gyro();
        let k = 1e-5;
        g.noise = Some(crate::config::Noise { rate_random_walk_rad_s_sqrt_s: Some(k), ..Default::default() });
        g.last_run = Some(crate::config::LastRun { warm_up_age_s: 600.0 });
        let p = Prior::new(&g, &exact(), Some(&g.restart(300.0).unwrap()), 40.0).covariance;
        assert!((p[(0, 0)] / (k * k * 40.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_poor_time_constant_is_narrowed_and_keeps_what_is_known_of_the_slope() {
        // a short log: C1 and T only known as C1/T, here to 1e-3 relatively, T to a factor e²
        let mut g = gyro();
        let (c1, t) = (g.c1_rad_s, g.time_constant_s);
        let (spread, slope) = (2.0, 1e-3);
        g.covariance = Some(Covariance::from_matrix(&[
            [c1 * c1 * (spread * spread + slope * slope), 0.0, c1 * t * spread * spread],
            [0.0, 1e-12, 0.0],
            [c1 * t * spread * spread, 0.0, t * t * spread * spread],
        ]));
        let prior = Prior::new(&g, &exact(), None, 0.0);
        assert_eq!(prior.notes.len(), 1);
        let p = prior.covariance;
        assert!((p[(2, 2)].sqrt() - LN_TIME_CONSTANT_STD_LIMIT).abs() < 1e-12);
        // at t0 = 0: s - e = C1, so that (s - e)/C1 - ln T is the slope's relative error
        let combination = nalgebra::Vector3::new(-1.0 / c1, 1.0 / c1, -1.0);
        let variance = (combination.transpose() * p * combination)[0];
        assert!((variance.sqrt() / slope - 1.0).abs() < 1e-3, "{}", variance.sqrt());
    }

    #[test]
    fn without_any_uncertainty_the_covariance_is_still_definite_and_said_to_be_assumed() {
        let prior = Prior::new(&gyro(), &exact(), None, 1e6);
        assert!(prior.notes[0].contains("no uncertainty"));
        assert!(prior.covariance.cholesky().is_some());
    }
}
