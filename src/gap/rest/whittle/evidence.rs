//! ln p(z | hypothesis): coefficients integrated exactly, scales and spectra by Laplace's method, shapes by a sum over
//! nodes
//!
//! Priors: the white noise's level is the nominal one to [`WHITE_STD`]; parameters of spectra are uniform in their
//! logarithm over the range that their effect states; changes of ln variance, constant or over time, are normal with one
//! of a few scales; coefficients are normal with a scale that is uniform in its
//! logarithm over [`SCALE_RANGE`].

use super::basis::{ColumnId, Data, SpectralBasis};
use super::gaussian::{DataProducts, Picked, Posterior, columns, spectral};
use super::hypothesis::{Candidate, Hypothesis, Kind, LEVEL_STDS, NoisePart, VARIANCE_STDS};
use super::memo::Memo;
use crate::math::curvature::curvature;
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Relative standard deviation of the prior of the white noise's level about its nominal value: about the precision of
/// a log of 10⁵ samples. A wider prior would let a level that grew by a few percent pass for the nominal one.
pub(crate) const WHITE_STD: f64 = 0.003;
/// Range of ln of a signal's prior scale, in multiples of the standard deviation that white noise gives its
/// coefficient.
pub(crate) const SCALE_RANGE: [f64; 2] = [0.0, 7.0];
/// Step of the finite differences in the coefficients of ln variance.
const STEP: f64 = 0.03;

/// A hypothesis at its posterior mode, with its evidence.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    /// With the parameters at their posterior mode.
    pub hypothesis: Hypothesis,
    /// ln p(z | hypothesis), everything integrated out.
    pub ln_evidence: f64,
    /// ln p(z, parameters) at the mode, coefficients integrated out.
    pub ln_mode: f64,
    /// Standard deviations of [ln white, ln θ…] at the mode.
    pub std: Vec<f64>,
}

/// A candidate's index and the bits of its shape parameters.
type ShapeKey = (usize, Vec<u64>);
/// Columns of a signal at one shape.
#[derive(Clone)]
pub(crate) struct Columns {
    pub ids: Vec<ColumnId>,
    /// Their prior standard deviations at scale one.
    pub unit: Vec<f64>,
    /// Column added independently of the coefficients; none where the signal has none.
    pub offset: Option<ColumnId>,
}

/// The likelihood of one recording.
pub(crate) struct Likelihood<'a> {
    /// Its frame.
    pub frame: &'a SpectralBasis,
    /// The recording.
    pub data: &'a Data,
    /// Candidate explanations.
    pub candidates: &'a [Candidate],
    pub(crate) products: DataProducts,
    pub(crate) nuisance: Vec<(ColumnId, f64)>,
    pub(crate) block_power: (Vec<f64>, f64),
    pub(crate) stored: Memo<ShapeKey, Columns>,
}

/// ln of the mean of exp(v).
pub(crate) fn ln_mean_exp(values: &[f64], count: f64) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !top.is_finite() {
        return top;
    }
    top + (values.iter().map(|v| (v - top).exp()).sum::<f64>() / count).ln()
}

/// ln density of `values`, independent and normal about zero with one standard deviation, which is any of `stds` with
/// equal probability.
fn ln_scale_mixture(stds: &[f64], values: &[f64]) -> f64 {
    let at = |std: &f64| {
        let term = |v: &f64| -0.5 * (v / std).powi(2) - (std * TAU.sqrt()).ln();
        values.iter().map(term).sum::<f64>()
    };
    ln_mean_exp(&stds.iter().map(at).collect::<Vec<_>>(), stds.len() as f64)
}

/// ln(exp(a) + exp(b)).
pub(crate) fn ln_add(a: f64, b: f64) -> f64 {
    let top = a.max(b);
    top + ((a - top).exp() + (b - top).exp()).ln()
}

/// Columns of the warm-up's nuisance parameters (C1, C2, T), with the prior standard deviations of their deviations.
pub(crate) fn nuisances(frame: &SpectralBasis) -> Vec<(ColumnId, f64)> {
    let scene = &frame.coarse;
    let warm = scene.warm_up;
    let gradient: Vec<[f64; 3]> = (0..scene.len()).map(|i| warm.gradient(scene.time.at(i))).collect();
    let column = |j: usize| gradient.iter().map(|g| g[j]).collect::<Vec<_>>();
    let relative = scene.warm_up_relative_std;
    let std = [relative * warm.c1_rad_s.abs(), scene.turn_on_bias_std_rad_s, relative * warm.time_constant_s];
    (0..3).filter(|j| std[*j] > 0.0).map(|j| (frame.store(&column(j)), std[j])).collect()
}

impl<'a> Likelihood<'a> {
    /// The likelihood of `data`; `nuisance` from [`nuisances`] of the same frame.
    pub(crate) fn new(
        frame: &'a SpectralBasis,
        data: &'a Data,
        candidates: &'a [Candidate],
        nuisance: &[(ColumnId, f64)],
    ) -> Self {
        Self {
            frame,
            data,
            candidates,
            products: DataProducts::default(),
            nuisance: nuisance.to_vec(),
            block_power: if frame.block > 1 { frame.block_power(data) } else { (Vec::new(), 0.0) },
            stored: Memo::default(),
        }
    }

    /// Columns of a hypothesis, nuisances first.
    pub(crate) fn column_ids<'h>(&'h self, h: &'h Hypothesis) -> impl Iterator<Item = ColumnId> + 'h {
        self.nuisance.iter().map(|n| n.0).chain(h.signals.iter().flat_map(|s| s.columns.iter().copied()))
    }

    pub(crate) fn pick(&self, h: &Hypothesis) -> Picked {
        Picked::new(self.frame, self.data, &self.products, self.column_ids(h), &h.offsets())
    }

    /// Power in each bin of the recording less the columns `offsets`, rad²/s².
    fn power(&self, offsets: &[ColumnId]) -> Cow<'_, [f64]> {
        let mut power = Cow::Borrowed(self.data.power.as_slice());
        for (i, a) in offsets.iter().enumerate() {
            let with_data = self.products.get(*a, || Arc::new(self.frame.with_data(*a, self.data)));
            power.to_mut().iter_mut().zip(with_data.iter()).for_each(|(p, d)| *p -= 2.0 * d);
            for (j, b) in offsets[..=i].iter().enumerate() {
                let times = if i == j { 1.0 } else { 2.0 };
                power.to_mut().iter_mut().zip(self.frame.gram(*a, *b).iter()).for_each(|(p, g)| *p += times * g);
            }
        }
        power
    }

    /// ln p(z) of the spectrum and ln prior of the white level, nats: without columns and without the prior of the
    /// noises.
    pub(crate) fn spectral_value(&self, h: &Hypothesis, offsets: &[ColumnId], spectrum: &[f64]) -> f64 {
        let white = -0.5 * (h.ln_white / WHITE_STD).powi(2) - (WHITE_STD * TAU.sqrt()).ln();
        spectral(&self.frame.bins.count, &self.power(offsets), spectrum) + white
    }

    pub(crate) fn stds(&self, h: &Hypothesis) -> Vec<f64> {
        let signal = h.signals.iter().flat_map(|s| s.unit.iter().map(|u| u * s.ln_scale.exp()));
        self.nuisance.iter().map(|n| n.1).chain(signal).collect()
    }

    /// ln p(z, parameters), coefficients integrated out; with their posterior if `full`.
    pub(crate) fn value(&self, h: &Hypothesis, picked: &Picked, full: bool) -> (f64, Option<Posterior>) {
        let s = h.spectrum(self.frame, self.candidates);
        let inverse: Vec<f64> = s.iter().map(|v| 1.0 / v).collect();
        let Some(posterior) = columns(picked, &self.stds(h), &inverse, full) else { return (f64::NEG_INFINITY, None) };
        let value = self.spectral_value(h, &h.offsets(), &s) + self.ln_prior(h) + posterior.log_marginal;
        (if value.is_nan() { f64::NEG_INFINITY } else { value }, full.then_some(posterior))
    }

    /// Gain in ln p of the noise level's course over the blocks, against a constant level, nats.
    fn level_gain(&self, h: &Hypothesis) -> f64 {
        let (level, _) = h.level(self.frame, self.candidates);
        let term = |(s, v): (&f64, &f64)| s.ln() + v * (1.0 / s - 1.0);
        -0.5 * self.block_power.1 * level.iter().zip(&self.block_power.0).map(term).sum::<f64>()
    }

    /// ln prior of the noises' parameters, plus the gain of the course of their level, nats.
    pub(crate) fn ln_prior(&self, h: &Hypothesis) -> f64 {
        let one = |n: &NoisePart| match &self.candidates[n.candidate].kind {
            Kind::Noise(k) | Kind::Filter(k) => {
                k.range(&self.frame.scene).iter().map(|r| -(r[1] / r[0]).ln().ln()).sum::<f64>()
            }
            // θ is the factor on the standard deviation: ln variance is 2 ln θ
            Kind::Level(_) => {
                let change = |v: &f64| ln_scale_mixture(&LEVEL_STDS, &[2.0 * v]) + std::f64::consts::LN_2;
                n.ln_theta.iter().map(change).sum()
            }
            // the upper ends of the ranges are prior standard deviations
            Kind::Shape(k) => {
                let ranges = k.range(&self.frame.scene);
                let term = |(v, r): (&f64, &[f64; 2])| -0.5 * (v / r[1].ln()).powi(2) - (r[1].ln() * TAU.sqrt()).ln();
                n.ln_theta.iter().zip(&ranges).map(term).sum()
            }
            Kind::Variance(_) => ln_scale_mixture(&VARIANCE_STDS, &n.ln_theta),
            Kind::Signal(_) | Kind::Line(..) | Kind::TurnOn => 0.0,
        };
        h.noises.iter().map(one).sum::<f64>() + self.level_gain(h)
    }

    /// ln p(z) with the parts (by candidate) for which `keep` holds: spectra at their parameters, coefficients at their
    /// posterior means without the other parts, nuisances integrated out. This is the score of a simulator with these
    /// effects alone.
    pub(crate) fn plug_in(&self, h: &Hypothesis, keep: &dyn Fn(usize) -> bool) -> Option<f64> {
        let mut kept = h.clone();
        kept.signals.retain(|s| keep(s.candidate));
        kept.noises.retain(|n| keep(n.candidate));
        let posterior = self.coefficients(&kept)?;
        let mut z = self.data.z.clone();
        let signals = kept.signals.iter().flat_map(|s| s.columns.iter());
        signals.zip(&posterior.mean[self.nuisance.len()..]).for_each(|(id, b)| self.frame.add_column(&mut z, *id, -b));
        kept.offsets().iter().for_each(|id| self.frame.add_column(&mut z, *id, -1.0));
        kept.signals.clear();
        let power = self.frame.bins.power(&z);
        let spectrum = kept.spectrum(self.frame, self.candidates);
        let inverse: Vec<f64> = spectrum.iter().map(|v| 1.0 / v).collect();
        let data = Data { values_rad_s: Vec::new(), z, power };
        let ids = self.nuisance.iter().map(|n| n.0);
        let picked = Picked::new(self.frame, &data, &DataProducts::default(), ids, &[]);
        let stds: Vec<f64> = self.nuisance.iter().map(|n| n.1).collect();
        let columns = columns(&picked, &stds, &inverse, false)?.log_marginal;
        Some(spectral(&self.frame.bins.count, &data.power, &spectrum) + columns + self.level_gain(&kept))
    }

    /// Posterior of the coefficients, nuisances first.
    pub(crate) fn coefficients(&self, h: &Hypothesis) -> Option<Posterior> {
        self.value(h, &self.pick(h), true).1
    }

    /// The recording less the posterior means of nuisances and signals and the signals' offsets, in the cosine basis.
    pub(crate) fn remainder(&self, h: &Hypothesis) -> Vec<f64> {
        let mut z = self.data.z.clone();
        if let Some(p) = self.coefficients(h) {
            self.column_ids(h).zip(&p.mean).for_each(|(id, b)| self.frame.add_column(&mut z, id, -b));
        }
        h.offsets().iter().for_each(|id| self.frame.add_column(&mut z, *id, -1.0));
        z
    }

    /// Wiener estimate of the added noises in `remainder` (see [`Likelihood::remainder`]), in the cosine basis.
    pub(crate) fn followed(&self, h: &Hypothesis, remainder: &[f64]) -> Vec<f64> {
        let mut z = remainder.to_vec();
        let spectrum = h.spectrum(self.frame, self.candidates);
        let white = h.white_spectrum(self.frame, self.candidates);
        for (b, e) in self.frame.bins.edges.windows(2).enumerate() {
            let share = (1.0 - white[b] / spectrum[b]).max(0.0);
            z[e[0]..e[1]].iter_mut().for_each(|v| *v *= share);
        }
        z
    }

    /// The recording whitened under a hypothesis: independent, of variance one, where it holds.
    pub(crate) fn whitened(&self, h: &Hypothesis) -> Vec<f64> {
        let mut z = self.remainder(h);
        let s = h.spectrum(self.frame, self.candidates);
        for (b, e) in self.frame.bins.edges.windows(2).enumerate() {
            let scale = 1.0 / s[b].sqrt();
            z[e[0]..e[1]].iter_mut().for_each(|v| *v *= scale);
        }
        let mut w = self.frame.series(&z);
        let (profile, _) = h.level(self.frame, self.candidates);
        let long = w.len().div_ceil(profile.len().max(1)).max(1);
        for (block, s) in w.chunks_mut(long).zip(&profile) {
            block.iter_mut().for_each(|v| *v /= s.sqrt());
        }
        w
    }

    pub(crate) fn bounds(&self, h: &Hypothesis) -> Vec<[f64; 2]> {
        let one = |n: &NoisePart| match &self.candidates[n.candidate].kind {
            Kind::Noise(k) | Kind::Filter(k) | Kind::Level(k) => {
                k.range(&self.frame.scene).iter().map(|r| [r[0].ln(), r[1].ln()]).collect::<Vec<_>>()
            }
            Kind::Shape(k) => k.range(&self.frame.scene).iter().map(|r| [-8.0 * r[1].ln(), 8.0 * r[1].ln()]).collect(),
            Kind::Variance(_) => vec![[-5.0, 5.0]; n.ln_theta.len()],
            Kind::Signal(_) | Kind::Line(..) | Kind::TurnOn => Vec::new(),
        };
        let white = [-8.0 * WHITE_STD, 8.0 * WHITE_STD];
        std::iter::once(white).chain(h.noises.iter().flat_map(one)).collect()
    }

    pub(crate) fn parameters(h: &Hypothesis) -> Vec<f64> {
        std::iter::once(h.ln_white).chain(h.noises.iter().flat_map(|n| n.ln_theta.iter().copied())).collect()
    }

    /// Steps of the finite differences at `h`.
    fn steps(&self, h: &Hypothesis) -> Vec<f64> {
        let one = |n: &NoisePart| match &self.candidates[n.candidate].kind {
            Kind::Noise(k) | Kind::Filter(k) | Kind::Level(k) | Kind::Shape(k) => {
                k.steps(&n.ln_theta.iter().map(|v| v.exp()).collect::<Vec<_>>())
            }
            _ => vec![STEP; n.ln_theta.len()],
        };
        std::iter::once(0.2 * WHITE_STD).chain(h.noises.iter().flat_map(one)).collect()
    }

    fn set(h: &mut Hypothesis, x: &[f64]) {
        h.ln_white = x[0];
        let mut at = 1;
        for n in &mut h.noises {
            let len = n.ln_theta.len();
            n.ln_theta.copy_from_slice(&x[at..at + len]);
            at += len;
        }
    }

    /// Newton's method on the parameters of the spectra; returns ln p at the mode and the Hessian of -ln p there.
    pub(crate) fn newton(&self, h: &mut Hypothesis, picked: &Picked, free: &[bool], rounds: usize) -> (f64, Vec<f64>) {
        let bounds = self.bounds(h);
        let mut x = Self::parameters(h);
        let which: Vec<usize> = (0..x.len()).filter(|i| free[*i]).collect();
        let d = which.len();
        let start = h.clone();
        let f = |x: &[f64]| {
            let mut trial = start.clone();
            Self::set(&mut trial, x);
            self.value(&trial, picked, false).0
        };
        let mut best = f(&x);
        let mut damping = 1e-3;
        let mut hessian = vec![0.0; d * d];
        for round in 0..rounds {
            Self::set(h, &x);
            let steps = self.steps(h);
            let beside = |free: &[f64]| {
                let mut y = x.clone();
                which.iter().zip(free).for_each(|(i, v)| y[*i] = *v);
                f(&y)
            };
            let of = |all: &[f64]| which.iter().map(|i| all[*i]).collect::<Vec<f64>>();
            let gradient;
            (gradient, hessian) = curvature(beside, &of(&x), best, &of(&steps));
            if round + 1 == rounds {
                break;
            }
            let mut gained = 0.0;
            let (inside, pull) = within(&hessian, &gradient, |a| (x[which[a]], bounds[which[a]]));
            for _ in 0..8 {
                let Some(delta) = damped(&inside, &pull, damping) else {
                    damping = (damping * 10.0_f64).max(1e-2);
                    continue;
                };
                let mut next = x.clone();
                for (a, &i) in which.iter().enumerate() {
                    next[i] = (x[i] + delta[a].clamp(-1.5, 1.5)).clamp(bounds[i][0], bounds[i][1]);
                }
                let value = f(&next);
                if value > best {
                    gained = value - best;
                    best = value;
                    x = next;
                    damping *= 0.2;
                    break;
                }
                damping = (damping * 8.0).max(1e-3);
            }
            if gained < 1e-3 {
                break;
            }
        }
        Self::set(h, &x);
        (best, hessian)
    }

    /// Scales of the signals' priors at their mode, by MacKay's fixed point.
    fn rescale(&self, h: &mut Hypothesis, picked: &Picked) {
        for _ in 0..4 {
            let (_, Some(p)) = self.value(h, picked, true) else { return };
            let size = p.mean.len();
            let mut at = self.nuisance.len();
            let mut moved: f64 = 0.0;
            for s in &mut h.signals {
                let mut sum = 0.0;
                for (j, u) in s.unit.iter().enumerate() {
                    if *u > 0.0 {
                        sum += (p.mean[at + j].powi(2) + p.covariance[(at + j) * size + at + j]) / (u * u);
                    }
                }
                let used = s.unit.iter().filter(|u| **u > 0.0).count().max(1);
                let next = (0.5 * (sum / used as f64).max(1e-12).ln()).clamp(SCALE_RANGE[0], SCALE_RANGE[1]);
                moved = moved.max((next - s.ln_scale).abs());
                s.ln_scale = next;
                at += s.columns.len();
            }
            if moved < 0.05 {
                return;
            }
        }
    }

    /// ln of the posterior volume of the free parameters, the first excepted (the white noise's level, which every
    /// hypothesis has).
    pub(crate) fn occam(&self, h: &Hypothesis, free: &[bool], mut curvature: Vec<f64>) -> f64 {
        let bounds = self.bounds(h);
        let which: Vec<usize> = (0..free.len()).filter(|i| free[*i]).collect();
        let d = which.len();
        for (a, i) in which.iter().enumerate() {
            let width = bounds[*i][1] - bounds[*i][0];
            curvature[a * d + a] = curvature[a * d + a].max(0.0) + 12.0 / (width * width);
        }
        let level = curvature.first().copied().unwrap_or(1.0);
        0.5 * ((d as f64 - 1.0) * TAU.ln() - ln_det_and_std(&curvature, d).0 + level.ln())
    }

    /// The hypothesis at its mode, with its evidence by Laplace's method.
    pub(crate) fn fit(&self, start: &Hypothesis) -> Fitted {
        let mut h = start.clone();
        let picked = self.pick(&h);
        let free = vec![true; Self::parameters(&h).len()];
        let (mut value, mut hessian) = (f64::NEG_INFINITY, Vec::new());
        for _ in 0..3 {
            if !h.signals.is_empty() {
                self.rescale(&mut h, &picked);
            }
            let before = value;
            (value, hessian) = self.newton(&mut h, &picked, &free, 12);
            if h.signals.is_empty() || h.noises.is_empty() || (value - before).abs() < 0.02 {
                break;
            }
        }
        let bounds = self.bounds(&h);
        let d = bounds.len();
        // a direction in which the data say nothing is as wide as its range: a uniform density of range r has variance
        // r²/12
        let mut curvature = hessian;
        for i in 0..d {
            let width = bounds[i][1] - bounds[i][0];
            curvature[i * d + i] = curvature[i * d + i].max(0.0) + 12.0 / (width * width);
        }
        let (ln_det, std) = ln_det_and_std(&curvature, d);
        let mut ln_evidence = value + 0.5 * (d as f64 * TAU.ln() - ln_det);
        for s in &h.signals {
            // the marginal likelihood has a curvature in ln scale of two a column, where coefficients stand out
            let width = (TAU / (2.0 * s.columns.len() as f64)).sqrt();
            ln_evidence += (width / (SCALE_RANGE[1] - SCALE_RANGE[0])).ln() + s.ln_shapes;
        }
        ln_evidence += self.ln_bounded(&h, &picked);
        // an evidence that is not a number must not rank before all others
        let ln_evidence = if ln_evidence.is_nan() { f64::NEG_INFINITY } else { ln_evidence };
        Fitted { hypothesis: h, ln_evidence, ln_mode: value, std }
    }
}

/// Hessian and gradient for Newton's step: a parameter that the gradient presses against its bound is held. `at` gives
/// value and bounds of a parameter.
fn within(hessian: &[f64], gradient: &[f64], at: impl Fn(usize) -> (f64, [f64; 2])) -> (Vec<f64>, Vec<f64>) {
    let d = gradient.len();
    let (mut hessian, mut gradient) = (hessian.to_vec(), gradient.to_vec());
    for a in 0..d {
        let (x, [low, high]) = at(a);
        if (x <= low && gradient[a] < 0.0) || (x >= high && gradient[a] > 0.0) {
            gradient[a] = 0.0;
            for b in 0..d {
                (hessian[a * d + b], hessian[b * d + a]) = (0.0, 0.0);
            }
            hessian[a * d + a] = 1.0;
        }
    }
    (hessian, gradient)
}

/// Solution of (H + λ diag|H|) x = g; none where the matrix is not positive definite.
pub(crate) fn damped(hessian: &[f64], gradient: &[f64], damping: f64) -> Option<Vec<f64>> {
    let d = gradient.len();
    let diagonal = |i: usize| hessian[i * d + i].abs().max(1e-6);
    let matrix =
        nalgebra::DMatrix::from_fn(d, d, |i, j| hessian[i * d + j] + if i == j { damping * diagonal(i) } else { 0.0 });
    let solved = matrix.cholesky()?.solve(&nalgebra::DVector::from_column_slice(gradient));
    solved.iter().all(|v| v.is_finite()).then(|| solved.as_slice().to_vec())
}

/// ln determinant, and square roots of the diagonal of the inverse; eigenvalues count by their absolute value.
pub(crate) fn ln_det_and_std(curvature: &[f64], d: usize) -> (f64, Vec<f64>) {
    let matrix = nalgebra::DMatrix::from_fn(d, d, |i, j| 0.5 * (curvature[i * d + j] + curvature[j * d + i]));
    let eigen = matrix.symmetric_eigen();
    let least = 1e-3;
    let values: Vec<f64> = eigen.eigenvalues.iter().map(|v| v.abs().max(least)).collect();
    let variance = |i: usize| (0..d).map(|k| eigen.eigenvectors[(i, k)].powi(2) / values[k]).sum::<f64>();
    (values.iter().map(|v| v.ln()).sum(), (0..d).map(|i| variance(i).sqrt()).collect())
}
