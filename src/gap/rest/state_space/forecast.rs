//! ∫ ŷ dt over the next h rows = step_s Σ_{l<h} (fixed + Σ x β̂ + Σ φ^l ŝ + E level)
//!
//! Sums in closed form: prefix sums of known columns, geometric series of decaying states.

use super::StateSpaceModel;

use super::hypothesis::Dynamics;
use nalgebra::Complex;

type Complex64 = Complex<f64>;

/// Rows at which forecasts are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Horizon {
    /// Length in rows.
    pub rows: usize,
    /// First row.
    pub first: usize,
    /// Rows from one start to the next.
    pub every: usize,
}

/// Precomputed sums for the forecasts of one recording.
pub(super) struct Forecaster<'a> {
    believed: &'a StateSpaceModel,
    coefficients: usize,
    /// Σ_{i<k} of the fixed part, and of each column.
    fixed: Vec<f64>,
    columns: Vec<Vec<f64>>,
    /// Σ_{i<k} of the prior probability that the step has not happened at row i.
    before: Vec<f64>,
    horizons: Vec<Sums>,
}

/// Sums over one horizon.
struct Sums {
    rows: usize,
    /// Contribution of one unit of each state but the coefficients to the sum.
    states: Vec<f64>,
    /// Σ_l λ^l, λ the correlation of the telegraph noise from row to row.
    telegraph: f64,
}

fn prefix(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    std::iter::once(0.0)
        .chain(values.map(|v| {
            sum += v;
            sum
        }))
        .collect()
}

/// Σ_{l<n} r^l.
fn geometric(ratio: f64, n: usize) -> f64 {
    if ratio > 0.0 && ratio < 1.0 {
        // keeps the digits of ratios close to one
        let log = (ratio - 1.0).ln_1p();
        return (n as f64 * log).exp_m1() / (ratio - 1.0);
    }
    if ratio == 1.0 {
        return n as f64;
    }
    (1.0 - ratio.powi(i32::try_from(n).unwrap_or(i32::MAX))) / (1.0 - ratio)
}

impl<'a> Forecaster<'a> {
    pub(super) fn new(believed: &'a StateSpaceModel, dynamics: &Dynamics, horizons: &[Horizon]) -> Self {
        let sums = |horizon: &Horizon| {
            let mut states = vec![0.0; dynamics.stride];
            for (i, m) in believed.markov.iter().enumerate() {
                states[dynamics.coefficients + i] = geometric(m.decay, horizon.rows);
            }
            for (i, o) in believed.oscillators.iter().enumerate() {
                // Σ z^l, z = decay exp(i angle): of a unit real part, and of a unit imaginary part
                let z = Complex64::from_polar(o.decay, o.angle_rad);
                let n = i32::try_from(horizon.rows).unwrap_or(i32::MAX);
                let sum = (Complex64::new(1.0, 0.0) - z.powi(n)) / (Complex64::new(1.0, 0.0) - z);
                let at = dynamics.pairs + 2 * i;
                (states[at], states[at + 1]) = (sum.re, -sum.im);
            }
            if let Some(low_pass) = &believed.low_pass {
                // the response to a unit of each state, up to where it has died away
                for at in dynamics.block..dynamics.len {
                    let mut x = vec![0.0; low_pass.order()];
                    x[at - dynamics.block] = 1.0;
                    for _ in 0..horizon.rows {
                        states[at] += low_pass.ma.iter().zip(&x).map(|(b, x)| b * x).sum::<f64>();
                        low_pass.advance(&mut x);
                        if x.iter().all(|x| x.abs() < f64::MIN_POSITIVE) {
                            break;
                        }
                    }
                }
            }
            let telegraph = believed.telegraph.as_ref().map_or(0.0, |telegraph| {
                let [up, down] = telegraph.leave(believed.step_s);
                geometric(1.0 - up - down, horizon.rows)
            });
            Sums { rows: horizon.rows, states, telegraph }
        };
        Self {
            believed,
            coefficients: dynamics.coefficients,
            fixed: prefix((0..believed.rows).map(|k| believed.fixed_at(k))),
            columns: believed.coefficients.iter().map(|c| prefix(c.column.iter().copied())).collect(),
            before: believed
                .step
                .as_ref()
                .map_or(Vec::new(), |step| prefix((0..believed.rows).map(|k| step.before(k)))),
            horizons: horizons.iter().map(sums).collect(),
        }
    }

    /// Predicted increment of the heading, rad, over the horizon number `at` from `row` on, from the mean state and the
    /// weights of the modes at `row`.
    pub(super) fn increment_rad(&self, at: usize, row: usize, mean: &[f64], weights: &[f64]) -> f64 {
        let Sums { rows, states, telegraph } = &self.horizons[at];
        let span = |sums: &[f64]| sums[row + rows] - sums[row];
        let mut sum = span(&self.fixed);
        sum += self.columns.iter().zip(mean).map(|(c, m)| m * span(c)).sum::<f64>();
        sum += states.iter().zip(mean).skip(self.coefficients).map(|(s, m)| s * m).sum::<f64>();
        let n = *rows as f64;
        if let Some(t) = &self.believed.telegraph {
            // P(high) relaxes from its present value to the stationary one
            let high = weights.iter().skip(1).step_by(2).sum::<f64>();
            let rest = t.high_probability();
            let high_rows = n * rest + (high - rest) * telegraph;
            sum += t.levels_rad_s[0] * (n - high_rows) + t.levels_rad_s[1] * high_rows;
        }
        if let Some(step) = &self.believed.step {
            let now = weights[..weights.len() / 2].iter().sum::<f64>();
            let was = step.before(row);
            let before_rows = if was > 0.0 { now * span(&self.before) / was } else { 0.0 };
            sum += step.size_rad_s * (n - before_rows);
        }
        sum * self.believed.step_s
    }
}
