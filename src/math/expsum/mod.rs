//! y(x) = b + Σ_k a_k exp(-r_k x), k = 1..m, r_k > 0: sums of exponentials, fitted without starting values.
//!
//! The amplitudes and the offset are linear and are eliminated (variable projection, Golub and Pereyra 1973), so only
//! the m rates are searched, as logarithms. Every combination of rates on a logarithmic grid is tried; the best that
//! are apart from each other are refined by Levenberg-Marquardt; scaled Gauss-Newton steps on the whole problem set
//! the last digits and give the covariance.
//!
//! ```
//! use gyroid::math::expsum::{Shape, fit};
//!
//! let x: Vec<f64> = (0..40).map(|i| 0.1 * f64::from(i)).collect();
//! let y: Vec<f64> = x.iter().map(|x| 0.5 + 2.0 * (-0.8 * x).exp() - (-4.0 * x).exp()).collect();
//! let sum = fit(&x, &y, Shape { terms: 2, offset: true })?;
//! assert!((sum.rates[0] - 0.8).abs() < 1e-10 && (sum.rates[1] - 4.0).abs() < 1e-10);
//! # Ok::<(), gyroid::Error>(())
//! ```

mod projection;
mod scan;

pub use super::lsq::Termination;
pub use scan::Scan;

use super::lsq::{self, Polished};
use crate::error::{Error, ErrorKind, Result};

/// Most terms that [`fit`] takes: the condition of the problem grows tenfold to a thousandfold with each.
pub const MAX_TERMS: usize = 5;

/// Gauss-Newton steps allowed at the end; four to eight are usual.
const POLISH_STEPS: usize = 40;

const INPUT: &str = "sum of exponentials";

/// Form of the sum that is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Number of exponentials, 1 to [`MAX_TERMS`].
    pub terms: usize,
    /// Whether a constant is added.
    pub offset: bool,
}

impl Shape {
    /// Number of parameters: two a term, and the offset.
    #[must_use]
    pub fn parameters(self) -> usize {
        2 * self.terms + usize::from(self.offset)
    }
}

/// A fitted sum of exponentials. Parameters are ordered: offset if there is one, amplitudes, rates.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpSum {
    /// b, in the unit of y, if it was fitted.
    pub offset: Option<f64>,
    /// a_k at x = 0, in the unit of y, in the order of the rates.
    pub amplitudes: Vec<f64>,
    /// r_k, in 1/unit of x, ascending.
    pub rates: Vec<f64>,
    /// Sum of the squared residuals.
    pub rss: f64,
    /// Samples less parameters.
    pub degrees_of_freedom: usize,
    /// rss/dof (JᵀJ)⁻¹: the classical covariance, which holds for white residuals.
    pub covariance: Vec<Vec<f64>>,
    /// Why the last iteration stopped.
    pub termination: Termination,
    /// The search that led to the start.
    pub scan: Scan,
}

impl ExpSum {
    /// The sum at `x`.
    #[must_use]
    pub fn value(&self, x: f64) -> f64 {
        let terms = self.amplitudes.iter().zip(&self.rates).map(|(a, r)| a * (-r * x).exp());
        self.offset.unwrap_or(0.0) + terms.sum::<f64>()
    }

    /// Offset if there is one, amplitudes, rates.
    #[must_use]
    pub fn parameters(&self) -> Vec<f64> {
        self.offset.iter().chain(&self.amplitudes).chain(&self.rates).copied().collect()
    }

    /// Classical standard deviation of each parameter, in the order of [`ExpSum::parameters`].
    #[must_use]
    pub fn standard_deviations(&self) -> Vec<f64> {
        self.covariance.iter().enumerate().map(|(j, row)| row[j].sqrt()).collect()
    }

    /// √(rss/dof), in the unit of y.
    #[must_use]
    pub fn residual_std(&self) -> f64 {
        (self.rss / self.degrees_of_freedom as f64).sqrt()
    }
}

/// Fits `shape` to samples `y` at `x`, in any order, from no starting values.
///
/// The cost grows with the number of samples times some hundred; average a long log into some thousand blocks first.
/// A fit that does not come down to rounding is a result: see [`ExpSum::termination`]. So is one with more terms than
/// the data hold, as long as it has a minimum: the standard deviation of a rate is then larger than the rate.
///
/// # Errors
/// - [`ErrorKind::Usage`]: no terms, too many, or x and y of different lengths;
/// - [`ErrorKind::Value`]: a sample that is not finite, a range that overflows, or a constant y;
/// - [`ErrorKind::TooShort`]: no more samples than parameters, or fewer different x;
/// - [`ErrorKind::Numeric`]: the data do not support so many terms (rates merge or run away), or the answer
///   overflows.
pub fn fit(x: &[f64], y: &[f64], shape: Shape) -> Result<ExpSum> {
    let samples = Samples::new(x, y, shape)?;
    let (scan, starts) = scan::starts(&samples, shape)?;
    let mut refined: Vec<(Vec<f64>, f64)> =
        starts.iter().filter_map(|start| projection::refine(&samples, shape, start)).collect();
    refined.sort_by(|a, b| a.1.total_cmp(&b.1));
    let Some(least) = refined.first().map(|(_, rss)| *rss) else {
        return Err(unsupported(shape));
    };
    let rounding = (1e-10 * lsq::norm(&samples.y)).powi(2);
    let mut polished: Vec<(&[f64], Polished)> = Vec::new();
    for (log_rates, _) in refined.iter().take_while(|(_, rss)| *rss <= least * (1.0 + 1e-6) + rounding) {
        // starts that came to the same minimum need polishing once
        let near = |(other, _): &(&[f64], Polished)| other.iter().zip(log_rates).all(|(a, b)| (a - b).abs() < 1e-4);
        if !polished.iter().filter(|(_, p)| p.termination.converged()).any(near) {
            polished.extend(samples.polish(shape, log_rates).ok().map(|p| (log_rates.as_slice(), p)));
        }
    }
    let best = polished.iter().map(|(_, p)| p).min_by(|a, b| {
        let failed = |p: &Polished| !p.termination.converged();
        failed(a).cmp(&failed(b)).then(a.rss.total_cmp(&b.rss))
    });
    samples.unscale(best.ok_or_else(|| unsupported(shape))?, shape, scan)
}

fn unsupported(shape: Shape) -> Error {
    let found = format!("the data do not support {} exponentials: rates merge or run away", shape.terms);
    Error::new(ErrorKind::Numeric, INPUT, found).hint("fit fewer exponentials, or give a longer or cleaner record")
}

/// The samples by ascending x, both axes scaled to order one.
struct Samples {
    /// (x - x_first) / x_span, in [0, 1].
    x: Vec<f64>,
    /// y / y_unit.
    y: Vec<f64>,
    x_first: f64,
    x_span: f64,
    y_unit: f64,
}

impl Samples {
    fn new(x: &[f64], y: &[f64], shape: Shape) -> Result<Self> {
        let refuse = |kind, found: String| Err(Error::new(kind, INPUT, found));
        if shape.terms == 0 || shape.terms > MAX_TERMS {
            return refuse(
                ErrorKind::Usage,
                format!("{} exponentials asked for, 1 to {MAX_TERMS} can be", shape.terms),
            );
        }
        if x.len() != y.len() {
            return refuse(ErrorKind::Usage, format!("{} values of x, {} of y", x.len(), y.len()));
        }
        for (axis, values) in [("x", x), ("y", y)] {
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let found = format!("{} is not finite", values[i]);
                return Err(Error::new(ErrorKind::Value, INPUT, found)
                    .at(format!("{axis}, sample {}", i + 1))
                    .hint("leave the sample out"));
            }
        }
        let need = shape.parameters();
        if x.len() <= need {
            return Err(Error::new(ErrorKind::TooShort, INPUT, format!("{} samples for {need} parameters", x.len()))
                .hint("give more samples or fit fewer exponentials"));
        }
        let mut pairs: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
        // by y too, so that the order given never shows in the last digit
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let different = 1 + pairs.windows(2).filter(|w| w[0].0 < w[1].0).count();
        if different < need {
            return Err(Error::new(
                ErrorKind::TooShort,
                INPUT,
                format!("{different} different x for {need} parameters"),
            )
            .hint("give samples at more places or fit fewer exponentials"));
        }
        let (x_first, x_span) = (pairs[0].0, pairs[pairs.len() - 1].0 - pairs[0].0);
        let y_unit = pairs.iter().fold(0.0_f64, |m, (_, y)| m.max(y.abs()));
        if !x_span.is_finite() {
            return refuse(ErrorKind::Value, "the range of x overflows".into());
        }
        if pairs.iter().all(|(_, y)| *y == pairs[0].1) {
            return refuse(ErrorKind::Value, format!("y is constant, {}: there is nothing to fit", pairs[0].1));
        }
        let (x, y) = pairs.iter().map(|(x, y)| ((x - x_first) / x_span, y / y_unit)).unzip();
        Ok(Self { x, y, x_first, x_span, y_unit })
    }

    /// Gauss-Newton on offset, amplitudes and logarithms of the rates together, all scaled.
    fn polish(&self, shape: Shape, log_rates: &[f64]) -> Result<Polished> {
        let mut start = projection::linear(self, shape, log_rates)?;
        start.extend(log_rates);
        let (m, first) = (shape.terms, usize::from(shape.offset));
        lsq::polish(
            &start,
            &mut |p, residual, jacobian| {
                let rates: Vec<f64> = p[first + m..].iter().map(|log| log.exp()).collect();
                let decays = projection::decays(self, &rates);
                residual.extend(self.y.iter().enumerate().map(|(i, y)| {
                    let terms: f64 = decays.iter().zip(&p[first..]).map(|(d, a)| a * d[i]).sum();
                    (if shape.offset { p[0] } else { 0.0 }) + terms - y
                }));
                if shape.offset {
                    jacobian.push(vec![1.0; self.y.len()]);
                }
                jacobian.extend(decays.iter().cloned());
                for ((decay, rate), a) in decays.iter().zip(&rates).zip(&p[first..]) {
                    jacobian.push(decay.iter().zip(&self.x).map(|(d, x)| -a * rate * x * d).collect());
                }
            },
            POLISH_STEPS,
        )
    }

    /// Parameters and covariance in the units given, by ascending rate.
    fn unscale(&self, fit: &Polished, shape: Shape, scan: Scan) -> Result<ExpSum> {
        let (m, first, n) = (shape.terms, usize::from(shape.offset), shape.parameters());
        let degrees_of_freedom = self.y.len() - n;
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by(|&a, &b| fit.parameters[first + m + a].total_cmp(&fit.parameters[first + m + b]));
        // each new parameter is a function of few scaled ones: value, and derivatives by (index of the old, value)
        let mut values = Vec::with_capacity(n);
        let mut rows: Vec<Vec<(usize, f64)>> = Vec::with_capacity(n);
        if shape.offset {
            values.push(self.y_unit * fit.parameters[0]);
            rows.push(vec![(0, self.y_unit)]);
        }
        for &k in &order {
            // a = a' exp(r x_first)
            let rate = fit.parameters[first + m + k].exp() / self.x_span;
            let carried = self.y_unit * (rate * self.x_first).exp();
            let amplitude = carried * fit.parameters[first + k];
            values.push(amplitude);
            rows.push(vec![(first + k, carried), (first + m + k, amplitude * self.x_first * rate)]);
        }
        for &k in &order {
            let rate = fit.parameters[first + m + k].exp() / self.x_span;
            values.push(rate);
            rows.push(vec![(first + m + k, rate)]);
        }
        let variance = fit.rss / degrees_of_freedom as f64;
        let covariance: Vec<Vec<f64>> = rows
            .iter()
            .map(|a| {
                let entry = |b: &Vec<(usize, f64)>| {
                    let pairs = a.iter().flat_map(|p| b.iter().map(move |q| (p, q)));
                    pairs.map(|((i, da), (j, db))| (da * variance) * (fit.inverse_normal[*i][*j] * db)).sum()
                };
                rows.iter().map(entry).collect()
            })
            .collect();
        let rss = (fit.rss * self.y_unit) * self.y_unit;
        if !values.iter().chain(covariance.iter().flatten()).chain([&rss]).all(|v| v.is_finite()) {
            return Err(Error::new(ErrorKind::Numeric, INPUT, "the answer overflows")
                .hint("bring y nearer to 1, and count x from the first sample: amplitudes are those at x = 0"));
        }
        let rates = values.split_off(first + m);
        let amplitudes = values.split_off(first);
        Ok(ExpSum {
            offset: values.first().copied(),
            amplitudes,
            rates,
            rss,
            degrees_of_freedom,
            covariance,
            termination: fit.termination,
            scan,
        })
    }
}

#[cfg(test)]
mod tests;
