//! A hypothesis with one more candidate, at its best shape or from its best start.

use super::basis::ColumnId;
use super::evidence::{Columns, Fitted, Likelihood, ln_mean_exp};
use super::gaussian::{Picked, solve};
use super::hypothesis::{Hypothesis, Kind, NoisePart, SignalPart};
use crate::effects::{Peak, Signal};

/// A hypothesis with fixed parameters, to which a signal is added.
struct Base<'a> {
    h: &'a Hypothesis,
    spectrum: Vec<f64>,
    inverse: Vec<f64>,
    /// ln p of the spectrum alone, plus the ln prior of the noises, nats.
    value: f64,
    ln_prior: f64,
    columns: Vec<ColumnId>,
    offsets: Vec<ColumnId>,
    stds: Vec<f64>,
}

/// A signal at one node of a grid of shapes.
pub(crate) struct AtShape {
    /// Posterior probability of the node.
    pub weight: f64,
    /// Shape parameter.
    pub shape: f64,
    /// Posterior means of the signal's coefficients at this shape.
    pub mean: Vec<f64>,
}

/// Nodes of the grid over a shape parameter.
const SHAPES: usize = 9;
/// Depth of ln p below its maximum at which the grid ends, nats.
const FALLEN: f64 = 4.0;
const MOST_DOUBLINGS: usize = 5;
/// Most rounds of Newton's method for the white noise's level alone.
const WHITE_ROUNDS: usize = 10;
/// Most rounds in which the shapes of a set are looked for again, and the gain in ln p that ends them, nats.
const SHAPE_ROUNDS: usize = 4;
const SHAPES_SETTLED: f64 = 0.05;
/// Most rounds of Newton's method for a variance: a level far from constant takes many, and one not converged gains
/// nothing.
const UNTIL_SETTLED: usize = 40;
/// Most peaks of the spectrum at which a noise of free frequency is started.
const MOST_PEAKS: usize = 6;

impl Likelihood<'_> {
    /// Columns of a signal at a shape.
    pub(crate) fn signal_columns(&self, candidate: usize, signal: &dyn Signal, shape: &[f64]) -> Columns {
        let key = (candidate, shape.iter().map(|v| v.to_bits()).collect::<Vec<_>>());
        self.stored.get(key, || {
            let made = signal.columns(&self.frame.coarse, shape);
            let ids: Vec<_> = made.iter().map(|c| self.frame.store(&c.values)).collect();
            // standard deviation, by white noise, of the coefficient of a column of this size
            let noise = self.frame.scene.white_std_rad_s / (self.frame.len() as f64).sqrt();
            let unit = |id: &ColumnId, relative: f64| {
                let rms = self.frame.rms(*id);
                if rms > 0.0 { relative * noise / rms } else { 0.0 }
            };
            let unit = ids.iter().zip(&made).map(|(id, c)| unit(id, c.relative_scale)).collect();
            let offset = signal.offset(&self.frame.coarse, shape).map(|values| self.frame.store(&values));
            Columns { ids, unit, offset }
        })
    }

    /// `base` with C2 set free, at the best of 13 prior scales, and its ln p.
    pub(crate) fn add_turn_on(&self, base: &Hypothesis, candidate: usize) -> (Hypothesis, f64) {
        let scene = &self.frame.coarse;
        let columns = vec![self.frame.store(&vec![1.0; scene.len()])];
        let unit = vec![scene.turn_on_bias_std_rad_s.max(1e-12)];
        let mut h = base.clone();
        h.signals.push(SignalPart {
            candidate,
            shape: Vec::new(),
            columns,
            offset: None,
            unit,
            ln_scale: 0.0,
            ln_shapes: 0.0,
        });
        let picked = self.pick(&h);
        let last = h.signals.len() - 1;
        let mut best = (h.clone(), f64::NEG_INFINITY);
        for half in 1..14 {
            h.signals[last].ln_scale = 0.5 * f64::from(half);
            let value = self.value(&h, &picked, false).0;
            if value > best.1 {
                best = (h.clone(), value);
            }
        }
        best
    }

    /// `base` with a periodic signal added, its frequency in `shape`.
    pub(crate) fn add_line(
        &self,
        base: &Hypothesis,
        candidate: usize,
        signal: &dyn Signal,
        shape: &[f64],
        ln_shapes: f64,
    ) -> Hypothesis {
        let made = signal.columns(&self.frame.scene, shape);
        let columns: Vec<_> = made.iter().map(|c| self.frame.store_whole(&c.values)).collect();
        let noise = self.frame.scene.white_std_rad_s / (self.frame.len() as f64).sqrt();
        let unit = columns.iter().zip(&made).map(|(id, c)| c.relative_scale * noise / self.frame.rms(*id).max(1e-300));
        let unit = unit.collect();
        let mut h = base.clone();
        h.signals.push(SignalPart {
            candidate,
            shape: shape.to_vec(),
            columns,
            offset: None,
            unit,
            ln_scale: 2.0,
            ln_shapes,
        });
        h
    }

    /// `base` with ln variance of the white noise following `signal`, and its ln p; none where it has no columns.
    pub(crate) fn add_variance(
        &self,
        base: &Hypothesis,
        candidate: usize,
        signal: &dyn Signal,
    ) -> Option<(Hypothesis, f64)> {
        if self.frame.variance_columns(candidate).is_empty() {
            let shape = signal.shapes(&self.frame.coarse).into_iter().nth(1).unwrap_or_default();
            self.frame.store_variance(candidate, &signal.columns(&self.frame.coarse, &shape));
        }
        let size = self.frame.variance_columns(candidate).len();
        if size == 0 || self.block_power.0.is_empty() {
            return None;
        }
        let before = Self::parameters(base).len();
        let mut h = base.clone();
        h.noises.push(NoisePart { candidate, ln_theta: vec![0.0; size] });
        let mut free = vec![false; before];
        free[0] = true;
        free.extend((0..size).map(|_| true));
        let picked = self.pick(base);
        let (value, hessian) = self.newton(&mut h, &picked, &free, UNTIL_SETTLED);
        let value = value + self.occam(&h, &free, hessian);
        Some((h, value))
    }

    /// `base` with a signal added at its best shape, all else fixed, and its ln p; none where it has no shapes.
    pub(crate) fn add_signal(
        &self,
        base: &Hypothesis,
        candidate: usize,
        signal: &dyn Signal,
    ) -> Option<(Hypothesis, f64)> {
        let nodes = signal.shapes(&self.frame.coarse);
        let fixed = self.base(base);
        let at = |shape: &[f64]| self.try_shape(&fixed, candidate, signal, shape);
        let values: Vec<(f64, f64)> = nodes.iter().map(|n| at(n)).collect();
        let best = (0..nodes.len()).max_by(|a, b| values[*a].0.total_cmp(&values[*b].0))?;
        let (mut shape, mut top) = (nodes[best].clone(), values[best]);
        let mut all: Vec<f64> = values.iter().map(|v| v.0).collect();
        if let (Some(range), 1) = (signal.refine(&self.frame.coarse), shape.len()) {
            // the peak may be narrower than the distance between nodes
            let around = |k: usize| nodes.get(k).map(|n| n[0]);
            let low = best.checked_sub(1).and_then(around).unwrap_or(range[0][0]);
            let high = around(best + 1).unwrap_or(range[0][1]);
            /// Intervals of the finer grid about the best node.
            const FINE: usize = 16;
            let mut fine = Vec::with_capacity(FINE + 1);
            let mid = nodes[best][0];
            for k in 0..=FINE {
                let u = k as f64 / FINE as f64;
                let x = if u < 0.5 { low + (mid - low) * 2.0 * u } else { mid + (high - mid) * (2.0 * u - 1.0) };
                let v = at(&[x]);
                fine.push((x, v));
                if v.0 > top.0 {
                    (shape, top) = (vec![x], v);
                }
            }
            let mut width = (high - low) / FINE as f64;
            for _ in 0..5 {
                for x in [shape[0] - 0.5 * width, shape[0] + 0.5 * width] {
                    if x > range[0][0] && x < range[0][1] {
                        let v = at(&[x]);
                        if v.0 > top.0 {
                            (shape, top) = (vec![x], v);
                        }
                    }
                }
                width *= 0.5;
            }
            // sixteen pieces over two node distances stand for the node and half of each neighbour
            let piece = (2.0 / FINE as f64).ln();
            all[best] = f64::NEG_INFINITY;
            all.extend(fine.iter().map(|(_, v)| v.0 + piece));
            if best > 0 {
                all[best - 1] -= std::f64::consts::LN_2;
            }
            if best + 1 < nodes.len() {
                all[best + 1] -= std::f64::consts::LN_2;
            }
        }
        let ln_shapes = (ln_mean_exp(&all, nodes.len() as f64) - top.0).min(0.0);
        let Columns { ids: columns, unit, offset } = self.signal_columns(candidate, signal, &shape);
        let mut h = base.clone();
        h.signals.push(SignalPart { candidate, shape, columns, offset, unit, ln_scale: top.1, ln_shapes });
        Some((h, top.0))
    }

    /// `h` with its white noise's level at the mode, and its ln p: a level that made up for what a signal explains is no
    /// longer needed beside it. Noises are added with the level free; the gains of both are compared.
    pub(crate) fn with_white(&self, mut h: Hypothesis) -> (Hypothesis, f64) {
        let free: Vec<bool> = (0..Self::parameters(&h).len()).map(|i| i == 0).collect();
        let picked = self.pick(&h);
        let (value, _) = self.newton(&mut h, &picked, &free, WHITE_ROUNDS);
        (h, value)
    }

    /// ln p with the signal at `shape` and at the best of a few prior scales, and ln of that scale.
    fn try_shape(&self, base: &Base, candidate: usize, signal: &dyn Signal, shape: &[f64]) -> (f64, f64) {
        let added = self.signal_columns(candidate, signal, shape);
        let (picked, value) = self.picked(base, &added);
        let normal = picked.normal(&base.inverse);
        let mut stds = base.stds.clone();
        let mut best = (f64::NEG_INFINITY, 0.0);
        for ln_scale in [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5] {
            stds.truncate(base.stds.len());
            stds.extend(added.unit.iter().map(|u| u * f64::exp(ln_scale)));
            let v = solve(&normal, &stds, false).map_or(f64::NEG_INFINITY, |p| value + p.log_marginal);
            if v > best.0 {
                best = (v, ln_scale);
            } else {
                break;
            }
        }
        best
    }

    /// Precomputed terms of `h` that do not depend on the signal added.
    fn base<'h>(&self, h: &'h Hypothesis) -> Base<'h> {
        let spectrum = h.spectrum(self.frame, self.candidates);
        let (offsets, ln_prior) = (h.offsets(), self.ln_prior(h));
        Base {
            h,
            inverse: spectrum.iter().map(|v| 1.0 / v).collect(),
            value: self.spectral_value(h, &offsets, &spectrum) + ln_prior,
            ln_prior,
            columns: self.column_ids(h).collect(),
            offsets,
            stds: self.stds(h),
            spectrum,
        }
    }

    /// Products of the columns of `base` and `added`, and ln p of the spectrum with the ln prior of the noises.
    fn picked(&self, base: &Base, added: &Columns) -> (Picked, f64) {
        let ids = base.columns.iter().chain(&added.ids).copied();
        let Some(offset) = added.offset else {
            return (Picked::new(self.frame, self.data, &self.products, ids, &base.offsets), base.value);
        };
        let offsets = [&base.offsets[..], &[offset]].concat();
        let picked = Picked::new(self.frame, self.data, &self.products, ids, &offsets);
        (picked, self.spectral_value(base.h, &offsets, &base.spectrum) + base.ln_prior)
    }

    /// Posterior of a signal's single shape parameter, all else in `h` but the coefficients fixed; empty where the
    /// shape is no single continuous parameter.
    pub(crate) fn over_shape(&self, h: &Hypothesis, part: &SignalPart, signal: &dyn Signal) -> Vec<AtShape> {
        let ([x], Some(range)) = (part.shape.as_slice(), signal.refine(&self.frame.coarse)) else { return Vec::new() };
        let [low, high] = range[0];
        let others = h.without(part.candidate);
        let base = self.base(&others);
        let at = |x: f64| {
            let x = x.clamp(low, high);
            let added = self.signal_columns(part.candidate, signal, &[x]);
            let (picked, value) = self.picked(&base, &added);
            let scaled = added.unit.iter().map(|u| u * part.ln_scale.exp());
            let stds: Vec<f64> = base.stds.iter().copied().chain(scaled).collect();
            let found = solve(&picked.normal(&base.inverse), &stds, true);
            found.map(|p| {
                (value + p.log_marginal, AtShape { weight: 0.0, shape: x, mean: p.mean[base.stds.len()..].to_vec() })
            })
        };
        let value = |x: f64| at(x).map_or(f64::NEG_INFINITY, |a| a.0);
        let top = value(*x);
        let first = (0.02 * x.abs()).max(1e-3 * (high - low).min(x.abs().max(1.0)));
        let reach = |sign: f64| {
            // to where the density has fallen by FALLEN nats, to a fiftieth
            let mut by = first;
            let curved = 2.0 * (top - value(x + sign * first)) / (first * first);
            if curved > 0.0 {
                by = 3.0 / curved.sqrt();
            }
            for _ in 0..MOST_DOUBLINGS {
                let end = x + sign * by;
                if end <= low || end >= high || top - value(end) > FALLEN {
                    break;
                }
                by *= 2.0;
            }
            (x + sign * by).clamp(low, high)
        };
        let (from, to) = (reach(-1.0), reach(1.0));
        let grid = (0..SHAPES).map(|k| from + (to - from) * k as f64 / (SHAPES - 1) as f64);
        let mut all: Vec<(f64, AtShape)> = grid.filter_map(at).collect();
        let top = all.iter().map(|a| a.0).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = all.iter().map(|a| (a.0 - top).exp()).sum();
        all.iter_mut().for_each(|(v, a)| a.weight = (*v - top).exp() / total);
        all.into_iter().map(|a| a.1).collect()
    }

    /// The hypothesis at its mode, the shapes of its signals included, with its evidence.
    ///
    /// A signal has the shape that was best beside what it was added to. With a random walk in its place a warm-up's time
    /// constant is loose, and it stays where it was found when the walk goes: each shape is looked for again beside the
    /// others, until none of them gains.
    pub(crate) fn fit_with_shapes(&self, start: &Hypothesis) -> Fitted {
        let mut fitted = self.fit(start);
        for _ in 0..SHAPE_ROUNDS {
            let mut h = fitted.hypothesis.clone();
            let (mut gained, mut ln_shapes) = (0.0, 0.0);
            for at in 0..h.signals.len() {
                let Some((part, gain)) = self.reshaped(&h, at) else { continue };
                gained += gain;
                ln_shapes += part.ln_shapes - h.signals[at].ln_shapes;
                h.signals[at] = part;
            }
            if gained < SHAPES_SETTLED {
                return Fitted { hypothesis: h, ln_evidence: fitted.ln_evidence + ln_shapes, ..fitted };
            }
            let again = self.fit(&h);
            if again.ln_mode <= fitted.ln_mode {
                break;
            }
            fitted = again;
        }
        fitted
    }

    /// The signal `at` of `h` at its best shape beside everything else in `h`, and the gain in ln p over its shape in `h`;
    /// none where it has no shape.
    fn reshaped(&self, h: &Hypothesis, at: usize) -> Option<(SignalPart, f64)> {
        let part = h.signals.get(at).filter(|part| !part.shape.is_empty())?;
        let Kind::Signal(signal) = &self.candidates[part.candidate].kind else { return None };
        let others = h.without(part.candidate);
        let (mut moved, top) = self.add_signal(&others, part.candidate, signal.as_ref())?;
        let moved = moved.signals.pop()?;
        let gain = top - self.try_shape(&self.base(&others), part.candidate, signal.as_ref(), &part.shape).0;
        if gain > SHAPES_SETTLED {
            return Some((moved, gain));
        }
        Some((SignalPart { ln_shapes: (moved.ln_shapes + gain).min(0.0), ..part.clone() }, 0.0))
    }

    /// `base` with a noise or filter added at the best of its starts, everything else fixed, and its ln p.
    pub(crate) fn add_noise(&self, base: &Hypothesis, candidate: usize) -> Option<(Hypothesis, f64)> {
        let (Kind::Noise(kind) | Kind::Filter(kind) | Kind::Level(kind) | Kind::Shape(kind)) =
            &self.candidates[candidate].kind
        else {
            return None;
        };
        let before = Self::parameters(base).len();
        let picked = self.pick(base);
        let mut best: Option<(Hypothesis, f64)> = None;
        let mut starts = kind.starts(&self.frame.scene);
        starts.extend(kind.starts_at(&self.frame.scene, &self.peaks(base)));
        let mut starts: Vec<(f64, Hypothesis, usize)> = starts
            .iter()
            .map(|start| {
                let mut h = base.clone();
                h.noises.push(NoisePart { candidate, ln_theta: start.iter().map(|v| v.ln()).collect() });
                (self.value(&h, &picked, false).0, h, start.len())
            })
            .collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        starts.truncate(3);
        for (_, mut h, size) in starts {
            let mut free = vec![false; before];
            free[0] = true;
            free.extend((0..size).map(|_| true));
            let (value, hessian) = self.newton(&mut h, &picked, &free, 10);
            let value = value + self.occam(&h, &free, hessian);
            if best.as_ref().is_none_or(|b| value > b.1) {
                best = Some((h, value));
            }
        }
        best
    }

    /// Peaks of the recording's spectrum above that of `base`, the most significant first.
    fn peaks(&self, base: &Hypothesis) -> Vec<Peak> {
        let bins = &self.frame.bins;
        let spectrum = base.spectrum(self.frame, self.candidates);
        let left = bins.power(&self.remainder(base));
        let bands: Vec<[f64; 2]> = bins.bands().collect();
        let excess: Vec<f64> = left.iter().zip(&bins.count).zip(&spectrum).map(|((p, n), s)| p / n / s - 1.0).collect();
        // ln likelihood ratio of the variance 1 + excess over one, of n squared deviates
        let beyond =
            |b: usize| if excess[b] > 0.0 { 0.5 * bins.count[b] * (excess[b] - excess[b].ln_1p()) } else { 0.0 };
        let mut order: Vec<usize> = (1..bins.len()).collect();
        order.sort_by(|a, b| beyond(*b).total_cmp(&beyond(*a)));
        let mut taken = vec![false; bins.len()];
        let mut peaks = Vec::new();
        for top in order {
            if peaks.len() == MOST_PEAKS {
                break;
            }
            if taken[top] {
                continue;
            }
            let high = |b: &usize| excess[*b] > 0.5 * excess[top] && !taken[*b];
            let from = (1..=top).rev().take_while(high).last().unwrap_or(top);
            let to = (top..bins.len()).take_while(high).last().unwrap_or(top);
            taken[from..=to].fill(true);
            let variance: f64 = (from..=to).map(|b| excess[b] * spectrum[b] * bins.count[b]).sum::<f64>();
            let [low, high] = [bands[from][0], bands[to][1]];
            peaks.push(Peak {
                omega: 0.5 * (low + high),
                width: high - low,
                variance: variance / self.frame.len().max(1) as f64,
            });
        }
        peaks
    }
}

#[cfg(test)]
mod tests {
    use super::super::basis::SpectralBasis;
    use super::super::evidence::nuisances;
    use super::*;
    use crate::bias::WarmUp;
    use crate::effects::ids;
    use crate::gap::rest::model_selection::candidates;
    use crate::math::random::Stream;
    use crate::model::Scene;
    use crate::signal::TimeAxis;

    /// A time constant that was found beside a random walk is not kept when the walk goes.
    #[test]
    fn shapes_follow_the_set() {
        let (len, step_s, c1_rad_s, time_constant_s) = (60_000, 0.03, 2e-3, 150.0);
        let scene = Scene {
            time: TimeAxis::Uniform { start_s: 0.0, step_s, len },
            step_s,
            temperature_c: None,
            power_on_temperature_c: None,
            supply_v: None,
            warm_up: WarmUp { c1_rad_s: 0.0, c2_rad_s: 0.0, time_constant_s: 300.0 },
            white_std_rad_s: 6e-4,
            turn_on_bias_std_rad_s: 2e-4,
            warm_up_relative_std: 0.03,
        };
        let mut draw = Stream::new(1, 0);
        let noisy = |i: usize| {
            let rise = -(-(i as f64) * step_s / time_constant_s).exp_m1();
            c1_rad_s * rise + scene.white_std_rad_s * draw.normal()
        };
        let frame = SpectralBasis::new(&scene);
        let data = frame.data((0..len).map(noisy).collect());
        let all = candidates(crate::effects::registry(), &frame.scene);
        let nuisance = nuisances(&frame);
        let l = Likelihood::new(&frame, &data, &all, &nuisance);
        let index = |id: &str| all.iter().position(|c| c.id == id).unwrap();
        let (walk, warm_up) = (index(ids::rate_random_walk()), index(ids::warm_up()));
        let Kind::Signal(signal) = &all[warm_up].kind else { panic!("a warm-up is a signal") };
        let nothing = Hypothesis::default();
        let direct = l.fit(&l.add_signal(&nothing, warm_up, signal.as_ref()).unwrap().0);
        let walking = l.fit(&l.add_noise(&nothing, walk).unwrap().0).hypothesis;
        let both = l.fit(&l.add_signal(&walking, warm_up, signal.as_ref()).unwrap().0).hypothesis;
        let stale = l.fit(&both.without(walk));
        assert!(direct.ln_evidence - stale.ln_evidence > 1.0, "the walk misleads nothing here");
        let again = l.fit_with_shapes(&both.without(walk));
        assert!((again.ln_evidence - direct.ln_evidence).abs() < 0.2, "{} {}", again.ln_evidence, direct.ln_evidence);
        let found_s = again.hypothesis.signals[0].shape[0];
        assert!((found_s - direct.hypothesis.signals[0].shape[0]).abs() < 0.5, "{found_s}");
    }
}
