//! S_b = Σ_i s_i² u_i(b), ln p = -½ Σ [n ln 2πS + p/S] + columns: a set of terms, its likelihood, and the climb to its mode
//!
//! Coefficients of the columns are integrated out, so that the warm-up that was fitted costs the random walk the low
//! frequencies that it explains, and no bias: the restricted likelihood (Patterson and Thompson, Biometrika 58 (1971) 545). The
//! derivative by S_b is ½ (p̃/S² - n/S), with p̃ the power that is left of a bin under the posterior of the coefficients.
//! That the rows of z are independent is exact for white noise and random walk, and nearly so for the others, whose
//! expected squares are exact (Sykulski et al., *The debiased Whittle likelihood*, Biometrika 106 (2019) 251).

use super::observed::Observed;
use super::shape::Shape;
use crate::math::binned::{solve, spectral};
use crate::noise::TermKind;
use nalgebra::{DMatrix, DVector};

/// Terms that make a spectrum. Parameters are ln size of each, and after a Gauss-Markov size ln of its correlation time; at
/// the end those of the shape.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Model {
    pub kinds: Vec<TermKind>,
    pub shape: Shape,
}

/// Step of the derivative by the logarithm of a correlation time.
const TIME_STEP: f64 = 1e-4;
/// Largest move of a logarithm at once.
const LARGEST_MOVE: f64 = 1.5;

/// The likelihood at one point.
#[derive(Clone)]
pub(super) struct Point {
    pub value: f64,
    pub spectrum: Vec<f64>,
    /// Residual power by bins, the share of the columns' uncertainty included.
    pub left: Vec<f64>,
    pub gradient: Vec<f64>,
    pub information: DMatrix<f64>,
    /// Posterior means of the columns' coefficients, and their covariance row by row.
    pub coefficients: Vec<f64>,
    pub covariance: Vec<f64>,
}

/// Where a climb ended.
#[derive(Clone)]
pub(super) struct Peak {
    pub x: Vec<f64>,
    pub point: Point,
}

impl Model {
    pub(crate) fn new(kinds: &[TermKind], shape: &Shape) -> Self {
        let sized = |k: &TermKind| *k != TermKind::RateRamp && !k.shapes();
        let mut kinds: Vec<TermKind> = kinds.iter().copied().filter(sized).collect();
        kinds.sort_unstable();
        Self { kinds, shape: shape.clone() }
    }

    /// Place of each term's size among the parameters.
    pub(crate) fn places(&self) -> impl Iterator<Item = (TermKind, usize)> + '_ {
        let mut next = 0;
        self.kinds.iter().map(move |kind| {
            let at = next;
            next += 1 + usize::from(*kind == TermKind::GaussMarkov);
            (*kind, at)
        })
    }

    pub(crate) fn place(&self, kind: TermKind) -> Option<usize> {
        self.places().find(|p| p.0 == kind).map(|p| p.1)
    }

    pub(crate) fn parameters(&self) -> usize {
        self.base() + self.shape.parameters()
    }

    /// Parameters before those of the shape.
    pub(crate) fn base(&self) -> usize {
        self.kinds.len() + usize::from(self.kinds.contains(&TermKind::GaussMarkov))
    }

    /// The bounds of the parameters for a log, logarithms.
    fn bounds(&self, log: &Observed) -> Vec<[f64; 2]> {
        let ln = |r: [f64; 2]| [r[0].ln(), r[1].ln()];
        let all = self.kinds.iter().flat_map(|kind| {
            let time = (*kind == TermKind::GaussMarkov).then(|| ln(log.time_range()));
            std::iter::once(ln(log.range(*kind))).chain(time)
        });
        all.chain(self.shape.bounds(log)).collect()
    }

    /// The spectrum at angular frequencies `omega`, rad/sample, and its derivatives by the parameters: of a size twice its
    /// part. `unit` gives a term's part per squared size, of a Gauss-Markov term at ln of its correlation time.
    pub(crate) fn spectrum(
        &self,
        x: &[f64],
        step_s: f64,
        omega: &[f64],
        unit: impl Fn(usize, TermKind, f64) -> Vec<f64>,
    ) -> (Vec<f64>, Vec<Vec<f64>>) {
        let shape = &x[self.base()..];
        let gain = self.shape.gain(shape, step_s, omega);
        let mut spectrum = vec![0.0; omega.len()];
        let (mut slopes, mut by_cutoff) = (Vec::with_capacity(x.len()), None);
        for (i, (kind, at)) in self.places().enumerate() {
            let square = (2.0 * x[at]).exp();
            let time = if kind == TermKind::GaussMarkov { x[at + 1] } else { 0.0 };
            let mut part: Vec<f64> = unit(i, kind, time).iter().map(|u| square * u).collect();
            if let (TermKind::AngleRandomWalk, Some(gain)) = (kind, &gain) {
                by_cutoff = Some(part.iter().zip(&gain.slopes[0]).map(|(p, s)| p * s).collect());
                part.iter_mut().zip(&gain.value).for_each(|(p, g)| *p *= g);
            }
            spectrum.iter_mut().zip(&part).for_each(|(s, p)| *s += p);
            slopes.push(part.iter().map(|p| 2.0 * p).collect());
            if kind == TermKind::GaussMarkov {
                let (up, down) = (unit(i, kind, time + TIME_STEP), unit(i, kind, time - TIME_STEP));
                let by = |(u, d): (&f64, &f64)| square * (u - d) / (2.0 * TIME_STEP);
                slopes.push(up.iter().zip(&down).map(by).collect());
            }
        }
        if gain.is_some() {
            slopes.push(by_cutoff.unwrap_or_else(|| vec![0.0; omega.len()]));
        }
        for part in self.shape.bands(shape, step_s, omega) {
            spectrum.iter_mut().zip(&part.value).for_each(|(s, p)| *s += p);
            slopes.extend(part.slopes);
        }
        (spectrum, slopes)
    }
}

/// Share of the power that bands make, by bins.
pub(super) fn share_of_bands(model: &Model, x: &[f64], log: &Observed, spectrum: &[f64]) -> Vec<f64> {
    let mut made = vec![0.0; spectrum.len()];
    let omega = log.omega();
    for part in model.shape.bands(&x[model.base()..], log.step_s, &omega) {
        made.iter_mut().zip(&part.value).for_each(|(m, v)| *m += v);
    }
    made.iter().zip(spectrum).map(|(m, s)| m / s).collect()
}

/// A model of a log, with the spectra that do not depend on parameters.
pub(super) struct Likelihood<'a> {
    pub log: &'a Observed,
    pub model: Model,
    units: Vec<Vec<f64>>,
    omega: Vec<f64>,
    pub bounds: Vec<[f64; 2]>,
}

impl<'a> Likelihood<'a> {
    pub(crate) fn new(log: &'a Observed, model: Model) -> Self {
        let fixed = |kind: &TermKind| match kind {
            TermKind::GaussMarkov => Vec::new(),
            _ => log.unit(*kind, 0.0),
        };
        let units = model.kinds.iter().map(fixed).collect();
        Self { log, units, omega: log.omega(), bounds: model.bounds(log), model }
    }

    /// The spectrum, and its derivative by each parameter.
    fn slopes(&self, x: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        self.model.spectrum(x, self.log.step_s, &self.omega, |i, kind, ln_time| match kind {
            TermKind::GaussMarkov => self.log.unit(kind, ln_time.exp()),
            _ => self.units[i].clone(),
        })
    }

    /// The likelihood at `x` with its derivatives; `None` where it is not finite.
    pub(crate) fn at(&self, x: &[f64]) -> Option<Point> {
        let (spectrum, slopes) = self.slopes(x);
        let log = self.log;
        let inverse: Vec<f64> = spectrum.iter().map(|s| s.recip()).collect();
        let sum = |products: &Vec<f64>| products.iter().zip(&inverse).map(|(g, w)| g * w).sum::<f64>();
        let normal = (log.gram.iter().map(sum).collect::<Vec<_>>(), log.with_data.iter().map(sum).collect::<Vec<_>>());
        let columns = solve(&normal, &log.prior_std, true)?;
        let value = spectral(&log.count, &log.power, &spectrum) + columns.log_marginal;
        if !value.is_finite() {
            return None;
        }
        let p = log.columns();
        let (mut left, mut known) = (log.power.clone(), log.count.clone());
        let mut at = 0;
        for i in 0..p {
            left.iter_mut().zip(&log.with_data[i]).for_each(|(l, d)| *l -= 2.0 * columns.mean[i] * d);
            for j in 0..=i {
                let twice = if i == j { 1.0 } else { 2.0 };
                let spread = twice * columns.covariance[i * p + j];
                let factor = twice * columns.mean[i] * columns.mean[j] + spread;
                for (b, g) in log.gram[at].iter().enumerate() {
                    left[b] += factor * g;
                    known[b] -= spread * g * inverse[b];
                }
                at += 1;
            }
        }
        let d = x.len();
        let weight: Vec<f64> =
            (0..left.len()).map(|b| 0.5 * (left[b] * inverse[b] - log.count[b]) * inverse[b]).collect();
        let gradient = slopes.iter().map(|s| s.iter().zip(&weight).map(|(s, w)| s * w).sum()).collect();
        let mut information = DMatrix::zeros(d, d);
        for i in 0..d {
            for j in 0..=i {
                let term = |b: usize| known[b].max(0.0) * slopes[i][b] * slopes[j][b] * inverse[b] * inverse[b];
                let sum = 0.5 * (0..left.len()).map(term).sum::<f64>();
                information[(i, j)] = sum;
                information[(j, i)] = sum;
            }
        }
        let (coefficients, covariance) = (columns.mean, columns.covariance);
        Some(Point { value, spectrum, left, gradient, information, coefficients, covariance })
    }

    /// Sizes that share the power, by the multiplicative updates that never lower the likelihood (Févotte and Idier, Neural
    /// Computation 23 (2011) 2421), correlation times as given.
    pub(crate) fn start(&self, time_s: Option<f64>, rounds: usize) -> Vec<f64> {
        let log = self.log;
        let base = self.model.base();
        let mut x = vec![0.0; base];
        let shape = &self.model.shape;
        x.extend(&shape.start);
        let gain = shape.gain(&shape.start, log.step_s, &self.omega);
        let mut units = Vec::new();
        for ((kind, at), unit) in self.model.places().zip(&self.units) {
            let mut unit = if kind == TermKind::GaussMarkov {
                let time = time_s.unwrap_or(10.0 * log.step_s);
                x[at + 1] = time.ln();
                log.unit(kind, time)
            } else {
                unit.clone()
            };
            if let (TermKind::AngleRandomWalk, Some(gain)) = (kind, &gain) {
                unit.iter_mut().zip(&gain.value).for_each(|(u, g)| *u *= g);
            }
            // so that every term alone would make all the power, in the mean of the logarithm
            let (mut sum, mut bins) = (0.0, 0.0);
            for (b, u) in unit.iter().enumerate() {
                if log.count[b] > 0.0 && log.power[b] > 0.0 {
                    sum += (log.power[b] / log.count[b] / u).ln();
                    bins += 1.0;
                }
            }
            x[at] = 0.5 * sum / f64::max(bins, 1.0);
            units.push((at, unit));
        }
        let sizes = (0..shape.parameters()).filter(|i| shape.is_size(*i)).map(|i| base + i);
        for (at, part) in sizes.zip(shape.bands(&shape.start, log.step_s, &self.omega)) {
            let square = (2.0 * x[at]).exp();
            units.push((at, part.value.iter().map(|v| v / square).collect()));
        }
        for _ in 0..rounds {
            let Some(point) = self.at(&x) else { break };
            for (at, unit) in &units {
                let (mut top, mut bottom) = (0.0, 0.0);
                for (b, u) in unit.iter().enumerate() {
                    top += u * point.left[b].max(0.0) / point.spectrum[b].powi(2);
                    bottom += u * log.count[b] / point.spectrum[b];
                }
                x[*at] += 0.5 * (top / bottom).max(1e-6).ln();
                x[*at] = x[*at].clamp(self.bounds[*at][0], self.bounds[*at][1]);
            }
        }
        x
    }

    /// Climbs from `start` by Fisher scoring; parameters that are not `free` keep their values.
    pub(crate) fn climb(&self, start: &[f64], free: &[bool]) -> Option<Peak> {
        let d = start.len();
        let inside = |i: usize, v: f64| v.clamp(self.bounds[i][0], self.bounds[i][1]);
        let mut x: Vec<f64> = start.iter().enumerate().map(|(i, v)| if free[i] { inside(i, *v) } else { *v }).collect();
        let mut point = self.at(&x)?;
        let mut damping = 1e-4;
        for _ in 0..80 {
            // at a bound that it is pushed against, a parameter rests
            let moves: Vec<usize> = (0..d)
                .filter(|i| free[*i])
                .filter(|i| {
                    let g = point.gradient[*i];
                    !(x[*i] <= self.bounds[*i][0] && g < 0.0 || x[*i] >= self.bounds[*i][1] && g > 0.0)
                })
                .collect();
            if moves.is_empty() {
                break;
            }
            let m = moves.len();
            let gradient = DVector::from_fn(m, |i, _| point.gradient[moves[i]]);
            let mut gained = None;
            for _ in 0..12 {
                let damped = DMatrix::from_fn(m, m, |i, j| {
                    let v = point.information[(moves[i], moves[j])];
                    if i == j { v * (1.0 + damping) + 1e-9 } else { v }
                });
                let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                    damping = (damping * 10.0f64).max(1e-3);
                    continue;
                };
                let mut next = x.clone();
                for (a, i) in moves.iter().enumerate() {
                    next[*i] = inside(*i, x[*i] + step[a].clamp(-LARGEST_MOVE, LARGEST_MOVE));
                }
                match self.at(&next) {
                    Some(there) if there.value > point.value => {
                        gained = Some(there.value - point.value);
                        (x, point) = (next, there);
                        damping = (damping * 0.2).max(1e-9);
                        break;
                    }
                    _ => damping = (damping * 8.0).max(1e-3),
                }
            }
            if gained.is_none_or(|g| g < 1e-7) {
                break;
            }
        }
        Some(Peak { x, point })
    }

    /// The mode: from several correlation times where there is one.
    pub(crate) fn mode(&self) -> Option<Peak> {
        let free = vec![true; self.model.parameters()];
        if self.model.place(TermKind::GaussMarkov).is_none() {
            return self.climb(&self.start(None, 25), &free);
        }
        const TIMES: usize = 9;
        let [low, high] = self.log.time_range();
        let time = |i: usize| low * (high / low).powf((i as f64 + 0.5) / TIMES as f64);
        let starts = (0..TIMES).filter_map(|i| {
            let x = self.start(Some(time(i)), 12);
            self.at(&x).map(|p| (p.value, x))
        });
        let mut starts: Vec<_> = starts.collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let peaks = starts.iter().take(2).filter_map(|(_, x)| self.climb(x, &free));
        peaks.max_by(|a, b| a.point.value.total_cmp(&b.point.value))
    }

    /// Covariance of the parameters by the information; directions of which the log knows nothing are as wide as their
    /// bounds.
    pub(crate) fn covariance(&self, point: &Point) -> Option<DMatrix<f64>> {
        self.curvature(point).cholesky().map(|c| c.inverse())
    }

    /// The information, with that of a uniform density over each parameter's bounds.
    pub(crate) fn curvature(&self, point: &Point) -> DMatrix<f64> {
        let mut c = point.information.clone();
        for (i, [low, high]) in self.bounds.iter().enumerate() {
            c[(i, i)] += 12.0 / (high - low).powi(2);
        }
        c
    }
}
