//! y(t) = β₀ + β₁ x(t - τ(t)) + e:   τ a random walk over knots, read by the forward and backward recursion of a hidden
//! chain
//!
//! A clock that runs unevenly against another, as do stamps that were made of a nominal rate while rows were lost. The
//! size of the walk from knot to knot is chosen by evidence, with no walk among the choices (Rabiner 1989); gains and
//! walk are fitted in turn.

use super::offset::{Integral, Lag, WINDOWS_APART, fitted, independent, window_s};

/// Distance of knots, s.
const KNOT_S: f64 = 4.0;
/// Largest distance of τ from its mean, s, and step of its grid.
const FAR_S: f64 = 3.0;
const STEP_S: f64 = 0.04;
/// Sizes of the walk from one knot to the next that are tried, s.
const WALKS_S: [f64; 7] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4];
/// Rounds in which gains and walk are fitted in turn.
const TURNS: usize = 4;
/// Most windows that are compared between two knots, and in all.
const BETWEEN: f64 = 40.0;
const MOST: f64 = 6000.0;
/// Least range of a walk, in steps of the grid.
const FEWEST_STATES: f64 = 2.0;
/// Nats by which a walk has to be more likely than none.
const SURE: f64 = 3.0;

/// A lag that varies with time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Track {
    /// Times of the knots, s, by the late stream's stamps.
    times_s: Vec<f64>,
    /// Lags at the knots, s.
    pub(crate) lags_s: Vec<f64>,
}

impl Track {
    /// The lag at `t_s`, linear between knots.
    pub(crate) fn at(&self, t_s: f64) -> f64 {
        let next = self.times_s.partition_point(|t| *t < t_s);
        let last = self.times_s.len() - 1;
        if next == 0 || next > last {
            return self.lags_s[next.min(last)];
        }
        let share = (t_s - self.times_s[next - 1]) / (self.times_s[next] - self.times_s[next - 1]);
        self.lags_s[next - 1] + share * (self.lags_s[next] - self.lags_s[next - 1])
    }

    /// Mean lag, and root mean square about it, s.
    pub(crate) fn mean_and_spread_s(&self) -> [f64; 2] {
        let n = self.lags_s.len() as f64;
        let mean = self.lags_s.iter().sum::<f64>() / n;
        [mean, (self.lags_s.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / n).sqrt()]
    }
}

/// Lag of `of` against `by` as it wanders about a constant one; none where it does not.
pub(crate) fn track(of: &Integral, by: &Integral, about: &Lag) -> Option<Track> {
    let [begin_s, end_s] = of.span_s()?;
    let knots = ((end_s - begin_s) / KNOT_S).floor() as usize;
    if knots < 3 {
        return None;
    }
    let window_s = window_s(of, std::slice::from_ref(by));
    let apart_s = (WINDOWS_APART * window_s).max(KNOT_S / BETWEEN).max((end_s - begin_s) / MOST);
    let half = (FAR_S / STEP_S).round() as usize;
    let tried = 2 * half + 1;
    let lag_of = |state: f64| about.lag_s + (state - half as f64) * STEP_S;
    // where x has stopped for longer than a lag may wander, no lag can be told
    let [low_s, high_s] = by.span_s()?;
    let from_s = if begin_s - about.lag_s < low_s - FAR_S { low_s } else { f64::NEG_INFINITY };
    let to_s = if end_s - about.lag_s > high_s + FAR_S { high_s } else { f64::INFINITY };
    // windows with a reading of y, and x at every lag
    let count = ((end_s - begin_s) / apart_s) as usize;
    let windows: Vec<(f64, f64)> = (0..=count)
        .map(|i| begin_s + i as f64 * apart_s)
        .map(|t| (t, of.mean(t, window_s)))
        .filter(|w| w.1.is_finite() && (from_s..=to_s).contains(&(w.0 - about.lag_s)))
        .collect();
    let there: Vec<Vec<f64>> =
        windows.iter().map(|(t, _)| (0..tried).map(|j| by.mean(t - lag_of(j as f64), window_s)).collect()).collect();
    let knot_of = |t: f64| (((t - begin_s) / KNOT_S) as usize).min(knots - 1);
    let mut states = vec![half as f64; knots];
    let between = |states: &[f64], t: f64| {
        let u = ((t - begin_s) / KNOT_S - 0.5).clamp(0.0, (knots - 1) as f64);
        let k = (u as usize).min(knots - 2);
        states[k] + (u - k as f64) * (states[k + 1] - states[k])
    };
    let x_at = |row: &[f64], state: f64| {
        let j = (state as usize).min(tried - 2);
        row[j] + (state - j as f64) * (row[j + 1] - row[j])
    };
    let mut walks = false;
    for _ in 0..TURNS {
        let pairs: Vec<[f64; 2]> = windows
            .iter()
            .zip(&there)
            .map(|((t, y), row)| [x_at(row, between(&states, *t)), *y])
            .filter(|p| p[0].is_finite())
            .collect();
        let ([b0, b1], errors) = fitted(&pairs)?;
        let variance = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        let total = {
            let mean = pairs.iter().map(|p| p[1]).sum::<f64>() / pairs.len() as f64;
            pairs.iter().map(|p| (p[1] - mean).powi(2)).sum::<f64>() / pairs.len() as f64
        };
        let weight = 0.5 * independent(&errors, &errors).0 / variance;
        let mut likelihood = vec![vec![0.0; tried]; knots];
        for ((t, y), row) in windows.iter().zip(&there) {
            for (ln, x) in likelihood[knot_of(*t)].iter_mut().zip(row) {
                let square = if x.is_finite() { (y - b0 - b1 * x).powi(2) } else { total };
                *ln -= weight * square;
            }
        }
        let chains: Vec<(f64, Vec<f64>)> = WALKS_S.iter().map(|walk_s| chain(&likelihood, walk_s / STEP_S)).collect();
        let best = (0..chains.len()).max_by(|a, b| chains[*a].0.total_cmp(&chains[*b].0))?;
        walks = chains[best].0 > chains[0].0 + SURE + (WALKS_S.len() as f64).ln();
        states.clone_from(&chains[best].1);
    }
    // within a state of the grid a walk cannot be told from errors of interpolation
    let [least, most] =
        [f64::min as fn(f64, f64) -> f64, f64::max].map(|of| states.iter().copied().fold(half as f64, of));
    (walks && most - least > FEWEST_STATES).then(|| Track {
        times_s: (0..knots).map(|k| begin_s + (k as f64 + 0.5) * KNOT_S).collect(),
        lags_s: states.into_iter().map(lag_of).collect(),
    })
}

/// ln evidence of a chain that walks by `walk` states from knot to knot, and the mean state at each knot.
fn chain(likelihood: &[Vec<f64>], walk: f64) -> (f64, Vec<f64>) {
    let tried = likelihood[0].len();
    let reach = (4.0 * walk).ceil() as usize;
    let kernel: Vec<f64> = (0..=reach)
        .map(|d| if walk > 0.0 { (-0.5 * (d as f64 / walk).powi(2)).exp() } else { f64::from(u8::from(d == 0)) })
        .collect();
    let norm = kernel[0] + 2.0 * kernel[1..].iter().sum::<f64>();
    let spread = |p: &[f64]| -> Vec<f64> {
        let one = |j: usize| {
            let near = j.saturating_sub(reach)..(j + reach + 1).min(tried);
            near.map(|i| p[i] * kernel[i.abs_diff(j)]).sum::<f64>() / norm
        };
        (0..tried).map(one).collect()
    };
    // at each knot relative to the likeliest state there
    let tops: Vec<f64> = likelihood.iter().map(|l| l.iter().copied().fold(f64::NEG_INFINITY, f64::max)).collect();
    let odds = |k: usize, p: &[f64]| -> (f64, Vec<f64>) {
        let p: Vec<f64> = p.iter().zip(&likelihood[k]).map(|(p, l)| p * (l - tops[k]).exp()).collect();
        let sum = p.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        (sum.ln() + tops[k], p.into_iter().map(|p| p / sum).collect())
    };
    let even = vec![1.0 / tried as f64; tried];
    let mut evidence = 0.0;
    let mut forward: Vec<Vec<f64>> = Vec::with_capacity(likelihood.len());
    for k in 0..likelihood.len() {
        let ahead = forward.last().map_or_else(|| even.clone(), |p| spread(p));
        let (ln, p) = odds(k, &ahead);
        evidence += ln;
        forward.push(p);
    }
    let mut back = vec![1.0; tried];
    let mut states = vec![0.0; likelihood.len()];
    for k in (0..likelihood.len()).rev() {
        let both: Vec<f64> = forward[k].iter().zip(&back).map(|(f, b)| f * b).collect();
        let sum = both.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        states[k] = both.iter().enumerate().map(|(j, p)| j as f64 * p).sum::<f64>() / sum;
        back = spread(&odds(k, &back).1);
    }
    (evidence, states)
}
