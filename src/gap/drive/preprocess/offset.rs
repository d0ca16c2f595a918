//! y(t) ≈ β₀ + Σ_j β_j x_j(t - τ):   τ̂ = argmax R²(τ),   var τ̂ = Σ_kl s_k e_k e_l s_l / (Σ s²)²,  s = ∂(fit)/∂τ
//! beyond the β
//!
//! Time offset of one stream against another. All gains are free, so that a wrong radius, track or gyro gain has no
//! influence. Streams of any rates are compared by means over the same window, taken from their running integrals: that
//! is symmetric in time, and no reading is held or resampled. The variance allows for correlated residuals (Newey and
//! West, 1987).

use crate::math::robust::median;

/// Longest offset that is looked for, s; no more than half of the shorter stream, either.
const LONGEST_S: f64 = 60.0;
/// Step of the first look, s, and most steps of a drive.
const COARSE_S: f64 = 0.05;
const MOST_STEPS: f64 = 6000.0;
/// Least length of a window, s: the influence of one reading's noise then depends little on where between rows τ lies.
const WINDOW_S: f64 = 0.1;
/// Distance of windows, in their lengths: overlapping by three quarters, they hold all information.
pub(crate) const WINDOWS_APART: f64 = 0.25;
/// Most laps of a course that are compared.
const MOST_LAPS: usize = 8;
/// Shifts that are tried on either side, and number of refinements.
const BESIDE: i32 = 8;
const FINER: usize = 3;
/// Distance beyond which residuals are independent, s.
const LASTING_S: f64 = 2.0;
/// Nats by which an offset has to be more likely than chance, or than another offset.
const SURE: f64 = 3.0;
/// Multiple of the usual distance of readings that counts as a gap.
const GAP: f64 = 4.0;
/// Most signals x.
const MOST: usize = 2;
/// Columns: constant, signals, y.
const WIDTH: usize = MOST + 2;
/// Fewest windows that are compared.
const FEWEST: usize = 32;

/// A signal as its running integral, linear between its nodes.
#[derive(Debug, Clone)]
pub(crate) struct Integral {
    times_s: Vec<f64>,
    sums: Vec<f64>,
    step_s: f64,
}

impl Integral {
    /// Integral of values read at these times; NaN is no reading.
    pub(crate) fn of(times_s: &[f64], values: &[f64]) -> Self {
        let there: Vec<(f64, f64)> =
            times_s.iter().copied().zip(values.iter().copied()).filter(|r| r.1.is_finite()).collect();
        let mut sum = 0.0;
        let mut sums = vec![0.0; there.len().min(1)];
        sums.extend(there.windows(2).map(|w| {
            sum += 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0);
            sum
        }));
        Self::nodes(there.into_iter().map(|r| r.0).collect(), sums)
    }

    /// Integral of values that hold from their row to the next.
    pub(crate) fn held(times_s: &[f64], values: &[f64]) -> Self {
        let mut sum = 0.0;
        let rows = times_s.windows(2).zip(values);
        let after = rows.map(|(w, v)| {
            sum += if v.is_finite() { v * (w[1] - w[0]) } else { 0.0 };
            sum
        });
        let sums = std::iter::once(0.0).take(times_s.len()).chain(after).collect();
        Self::nodes(times_s.to_vec(), sums)
    }

    /// From readings of the integral itself, such as a heading.
    pub(crate) fn nodes(times_s: Vec<f64>, sums: Vec<f64>) -> Self {
        let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
        let step_s = median(&mut steps);
        Self { times_s, sums, step_s }
    }

    /// Median time between readings, s.
    pub(crate) fn step_s(&self) -> f64 {
        self.step_s
    }

    /// First and last time, s.
    pub(crate) fn span_s(&self) -> Option<[f64; 2]> {
        Some([*self.times_s.first()?, *self.times_s.last()?])
    }

    fn at(&self, t_s: f64) -> Option<f64> {
        let next = self.times_s.partition_point(|t| *t < t_s);
        if next == 0 {
            return (self.times_s.first() == Some(&t_s)).then(|| self.sums[0]);
        }
        let (to, from) = (*self.times_s.get(next)?, self.times_s[next - 1]);
        let there = to - from <= GAP * self.step_s;
        let share = (t_s - from) / (to - from);
        there.then(|| self.sums[next - 1] + share * (self.sums[next] - self.sums[next - 1]))
    }

    /// Mean over a window about `t_s`; NaN where the window is not covered.
    pub(crate) fn mean(&self, t_s: f64, window_s: f64) -> f64 {
        let ends = [0.5, -0.5].map(|half| self.at(t_s + half * window_s));
        let whole = self.at(t_s).is_some();
        match ends {
            [Some(end), Some(begin)] if whole => (end - begin) / window_s,
            _ => f64::NAN,
        }
    }
}

/// Time offset of one stream against another; positive: stamped late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lag {
    /// τ, s.
    pub(crate) lag_s: f64,
    /// Its standard deviation, s.
    pub(crate) std_s: f64,
    /// √R² with the sign of β₁.
    pub(crate) correlation: f64,
    /// β₁.
    pub(crate) slope: f64,
}

/// Sums of squares and products of constant, signals and y.
#[derive(Clone, Copy, Default)]
struct Products {
    count: usize,
    sums: [[f64; WIDTH]; WIDTH],
}

impl Products {
    /// Adds a row: one, signals, y; missing signals are zero.
    fn add(&mut self, row: &[f64; WIDTH]) {
        self.count += 1;
        for (sums, by) in self.sums.iter_mut().zip(row) {
            sums.iter_mut().zip(row).for_each(|(sum, v)| *sum += by * v);
        }
    }

    /// β and 1 - R²; none where the signals are constant.
    fn solved(&self, signals: usize) -> Option<([f64; WIDTH - 1], f64)> {
        let mut m = self.sums;
        let y = WIDTH - 1;
        let total = m[y][y] - m[0][y] * m[0][y] / m[0][0];
        // the sweep of each column leaves β in the last one and the residual in the corner
        for i in 0..=signals {
            let pivot = m[i][i];
            if !(pivot > 1e-12 * self.sums[i][i]) {
                return None;
            }
            let row = m[i].map(|v| v / pivot);
            for other in &mut m {
                let by = other[i];
                other.iter_mut().zip(row).for_each(|(o, r)| *o -= by * r);
            }
            m[i] = row;
        }
        let left = m[y][y] / total;
        (total > 0.0 && left.is_finite()).then(|| (std::array::from_fn(|i| m[i][y]), left.clamp(1e-15, 1.0)))
    }
}

/// Length of the windows, s: no less than two readings of each stream.
pub(crate) fn window_s(of: &Integral, by: &[Integral]) -> f64 {
    by.iter().map(|x| 2.0 * x.step_s).fold((2.0 * of.step_s).max(WINDOW_S), f64::max)
}

/// β₀, β₁ and the residuals of y, for pairs of x and y.
pub(crate) fn fitted(pairs: &[[f64; 2]]) -> Option<([f64; 2], Vec<f64>)> {
    let mut products = Products::default();
    for [x, y] in pairs {
        let mut row = [0.0; WIDTH];
        (row[0], row[1], row[WIDTH - 1]) = (1.0, *x, *y);
        products.add(&row);
    }
    let (beta, _) = products.solved(1)?;
    Some(([beta[0], beta[1]], pairs.iter().map(|[x, y]| y - beta[0] - beta[1] * x).collect()))
}

/// Time offset of `of` against `by`; none where they do not have enough in common to tell.
pub(crate) fn lag(of: &Integral, by: &[Integral]) -> Option<Lag> {
    let by = &by[..by.len().min(MOST)];
    let slowest_s = by.iter().map(|x| x.step_s).fold(of.step_s, f64::max);
    let spans = [of, by.first()?].map(Integral::span_s);
    let [[a0, a1], [b0, b1]] = [spans[0]?, spans[1]?];
    let shorter_s = (a1 - a0).min(b1 - b0);
    let step_s = slowest_s.max(COARSE_S).max((a1 - a0).max(b1 - b0) / MOST_STEPS);
    let window_s = window_s(of, by);
    if !(shorter_s > 2.0 * FEWEST as f64 * step_s) {
        return None;
    }
    let first_s = a0.min(b0);
    let grid = |x: &Integral| -> Vec<f64> {
        let rows = ((a1.max(b1) - first_s) / step_s) as usize + 1;
        (0..rows).map(|i| x.mean(first_s + i as f64 * step_s, step_s.max(window_s))).collect()
    };
    let (y, xs): (Vec<f64>, Vec<Vec<f64>>) = (grid(of), by.iter().map(grid).collect());
    let most = (LONGEST_S.min(0.5 * shorter_s) / step_s) as i64;
    let (common, width) = independent(&y, &xs[0]);
    // log-likelihood of an offset, for the rows that it leaves in common and their 1 - R²
    let nats = |count: usize, left: f64| -0.5 * common * count as f64 * left.ln();
    let weigh = |shift: i64| {
        let mut products = Products::default();
        for (k, value) in y.iter().enumerate() {
            let Some(from) = usize::try_from(k as i64 - shift).ok().filter(|from| *from < y.len()) else { continue };
            let mut row = [0.0; WIDTH];
            (row[0], row[WIDTH - 1]) = (1.0, *value);
            row[1..].iter_mut().zip(&xs).for_each(|(to, x)| *to = x[from]);
            if row.iter().all(|v| v.is_finite()) {
                products.add(&row);
            }
        }
        let enough = products.count >= FEWEST;
        let left = enough.then(|| products.solved(xs.len())).flatten().map_or(1.0, |s| s.1);
        Top { lag_s: shift as f64 * step_s, count: products.count, nats: nats(products.count, left) }
    };
    let mut tops: Vec<Top> = (-most..=most).map(weigh).collect();
    let chance = (tops.len() as f64 / width as f64).max(1.0).ln();
    tops.sort_by(|a, b| b.nats.total_cmp(&a.nats));
    let highest = tops.first()?.nats;
    if highest < chance + SURE {
        return None;
    }
    // where a course repeats itself every lap has a top, and one between two shifts is higher than at either
    let pairs = Pairs::of(of, by, window_s);
    let mut laps: Vec<Top> = Vec::new();
    while let Some(top) = tops.first().filter(|t| t.nats > 0.5 * highest - SURE && laps.len() < MOST_LAPS).copied() {
        tops.retain(|t| (t.lag_s - top.lag_s).abs() > (width as f64 + 0.5) * step_s);
        let [lag_s, left] = pairs.best_near(top.lag_s, 0.5 * step_s, BESIDE / 4)?;
        laps.push(Top { lag_s, nats: nats(top.count, left).max(top.nats), ..top });
    }
    laps.sort_by(|a, b| b.nats.total_cmp(&a.nats));
    let sure = laps.get(1).is_none_or(|next| laps[0].nats > next.nats + SURE);
    if sure { pairs.fine(laps[0].lag_s, step_s) } else { None }
}

/// Independent values per row of two series (Bartlett: n/(1 + 2 Σ ρ_x ρ_y)), and the rows from one to the next.
pub(crate) fn independent(y: &[f64], x: &[f64]) -> (f64, usize) {
    let centred = |v: &[f64]| -> Vec<f64> {
        let there: Vec<f64> = v.iter().copied().filter(|v| v.is_finite()).collect();
        let mean = there.iter().sum::<f64>() / there.len().max(1) as f64;
        v.iter().map(|v| if v.is_finite() { v - mean } else { 0.0 }).collect()
    };
    let (y, x) = (centred(y), centred(x));
    let rho = |v: &[f64], lag: usize| {
        let product: f64 = v.iter().zip(v.iter().skip(lag)).map(|(a, b)| a * b).sum();
        product / v.iter().map(|a| a * a).sum::<f64>().max(f64::MIN_POSITIVE)
    };
    let mut sum = 0.0;
    let mut width = y.len() / 4;
    for lag in 1..y.len() / 4 {
        let product = rho(&y, lag) * rho(&x, lag);
        if product < 0.05 {
            width = lag;
            break;
        }
        sum += product;
    }
    (1.0 / (1.0 + 2.0 * sum), width)
}

/// An offset at which two streams agree, with the rows in common and its log-likelihood above chance.
#[derive(Clone, Copy)]
struct Top {
    lag_s: f64,
    count: usize,
    nats: f64,
}

/// Means of y over windows, to be compared with those of the signals at any offset.
struct Pairs<'a> {
    by: &'a [Integral],
    /// Times s, and means.
    read: Vec<(f64, f64)>,
    window_s: f64,
}

impl<'a> Pairs<'a> {
    fn of(of: &Integral, by: &'a [Integral], window_s: f64) -> Self {
        let mut times_s: Vec<f64> = Vec::new();
        for t in &of.times_s {
            if times_s.last().is_none_or(|last| t - last >= WINDOWS_APART * window_s) {
                times_s.push(*t);
            }
        }
        let read = times_s.iter().map(|t| (*t, of.mean(*t, window_s))).filter(|r| r.1.is_finite()).collect();
        Self { by, read, window_s }
    }

    fn row(&self, (t, y): (f64, f64), tau_s: f64) -> Option<[f64; WIDTH]> {
        let mut row = [0.0; WIDTH];
        (row[0], row[WIDTH - 1]) = (1.0, y);
        row[1..].iter_mut().zip(self.by).for_each(|(to, x)| *to = x.mean(t - tau_s, self.window_s));
        row.iter().all(|v| v.is_finite()).then_some(row)
    }

    /// β and 1 - R² at an offset.
    fn solved(&self, tau_s: f64) -> Option<([f64; WIDTH - 1], f64)> {
        let mut products = Products::default();
        self.read.iter().filter_map(|r| self.row(*r, tau_s)).for_each(|row| products.add(&row));
        (products.count >= FEWEST).then(|| products.solved(self.by.len())).flatten()
    }

    fn left(&self, tau_s: f64) -> f64 {
        self.solved(tau_s).map_or(1.0, |s| s.1)
    }

    /// Offset of the least 1 - R² among those `beside` steps on either side, and that.
    fn best_near(&self, about_s: f64, step_s: f64, beside: i32) -> Option<[f64; 2]> {
        let tried = (-beside..=beside).map(|i| about_s + f64::from(i) * step_s);
        tried.map(|tau_s| [tau_s, self.left(tau_s)]).min_by(|a, b| a[1].total_cmp(&b[1]))
    }

    /// Refined offset near `about_s`.
    fn fine(&self, about_s: f64, step_s: f64) -> Option<Lag> {
        let (by, window_s) = (self.by, self.window_s);
        let (mut here, mut step_s) = (about_s, step_s / f64::from(BESIDE) * 2.0);
        for _ in 0..FINER {
            [here, _] = self.best_near(here, step_s, BESIDE)?;
            step_s *= 2.0 / f64::from(BESIDE);
        }
        // the vertex of the parabola, wide enough that rounding does not bend it
        let wide_s = 0.1 * window_s;
        let [below, middle, above] = [-wide_s, 0.0, wide_s].map(|by| self.left(here + by).ln());
        let bend = below + above - 2.0 * middle;
        let lag_s =
            here + if bend > 0.0 { (0.5 * wide_s * (below - above) / bend).clamp(-wide_s, wide_s) } else { 0.0 };
        let (beta, left) = self.solved(lag_s)?;
        // influence of τ beyond that of the β
        let beside_s = 0.25 * window_s;
        let slope = |r: (f64, f64)| {
            let [later, sooner] = [beside_s, -beside_s].map(|by| self.row(r, lag_s + by));
            let (later, sooner, here) = (later?, sooner?, self.row(r, lag_s)?);
            let moved: f64 = (1..=by.len()).map(|j| beta[j] * (later[j] - sooner[j])).sum::<f64>() / (2.0 * beside_s);
            let error = here[WIDTH - 1] - (0..=by.len()).map(|j| beta[j] * here[j]).sum::<f64>();
            Some((r.0, here, moved, error))
        };
        let slopes: Vec<_> = self.read.iter().filter_map(|r| slope(*r)).collect();
        let mut products = Products::default();
        for (_, here, moved, _) in &slopes {
            let mut row = *here;
            row[WIDTH - 1] = *moved;
            products.add(&row);
        }
        let (of_slope, _) = products.solved(by.len())?;
        let own = |here: &[f64; WIDTH], moved: f64| moved - (0..=by.len()).map(|j| of_slope[j] * here[j]).sum::<f64>();
        let scores: Vec<(f64, f64, f64)> = slopes.iter().map(|(t, h, m, e)| (*t, own(h, *m), *e)).collect();
        let information: f64 = scores.iter().map(|s| s.1 * s.1).sum();
        let lasting_s = LASTING_S.max(2.0 * window_s);
        let mut variance = 0.0;
        for (k, (t, s, e)) in scores.iter().enumerate() {
            variance += (s * e).powi(2);
            for (later, next, error) in scores[k + 1..].iter().take_while(|n| n.0 - t < lasting_s) {
                variance += 2.0 * (1.0 - (later - t) / lasting_s) * s * e * next * error;
            }
        }
        let mut std_s = variance.max(0.0).sqrt() / information;
        // Where a robot stands at each of its rare readings no offset within the stand shows, and a slope over a window does
        // not see that: two standard deviations away the likelihood must have fallen by half a nat at least (by two, were it
        // a parabola). Windows that do not overlap count as independent.
        let [first, last] = [self.read.first()?.0, self.read.last()?.0];
        let count = ((last - first) / window_s).min(self.read.len() as f64);
        let as_likely = |by_s: f64| 0.5 * count * (self.left(lag_s + by_s) / left).ln() < 0.5;
        while std_s < window_s && (as_likely(2.0 * std_s) || as_likely(-2.0 * std_s)) {
            std_s = (2.0 * std_s).max(1e-3 * window_s);
        }
        std_s.is_finite().then(|| Lag {
            lag_s,
            std_s,
            correlation: (1.0 - left).sqrt().copysign(beta[1]),
            slope: beta[1],
        })
    }
}
