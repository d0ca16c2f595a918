//! y_k = μ + m + ε:  earlier power-ons of a gyro, of which those of one calendar month are alike
//!
//! ```text
//! Cov(y) = σ² V,   V = I + ρ J,   J_kl = 1 where k and l are of one month:   μ, slopes and predictions by generalised least squares
//! ```
//!
//! ρ is the variance between the months of a unit over that between the power-ons of a month. It comes from all gyros: σ² from within the months,
//! ρ where the sum of squares of the months' means about a line of each gyro has its mean (Paule and Mandel, J. Res. NBS 87 (1982) 377).
//! About lines, so that a gyro that drifts steadily does not pass for one whose months differ. From three months on; else ρ is 0.
//!
//! Student's t has as many degrees of freedom as its variance is known by: σ² (ρ + 1/n), n power-ons a month, by those of the months about
//! their lines, the rest of it by those within the months (Satterthwaite, Biometrics Bulletin 2 (1946) 110).

use super::variance_prior::VariancePrior;
use crate::math::mean;
use crate::math::random_effects::variance_where;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Fewest earlier power-ons against which one is held.
pub(super) const FEWEST: usize = 3;
/// Relative tolerance of ρ.
const TOLERANCE: f64 = 1e-6;

/// A power-on: when it was, in which month, its value and the standard deviation of its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PowerOn {
    /// Days, or its number.
    pub at: f64,
    /// Number of the month, from 0; its own where dates are not known.
    pub month: usize,
    /// Value and standard deviation.
    pub seen: [f64; 2],
}

/// A value held against earlier ones.
pub(super) struct Held {
    /// Its prediction.
    pub expected: f64,
    pub half_width: f64,
    pub t: f64,
    pub degrees: f64,
    pub p_value: f64,
    pub outside: bool,
}

/// Power-ons with their V.
struct Correlated<'a> {
    all: &'a [PowerOn],
    rho: f64,
    /// V⁻¹ 1.
    weights: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<'a> Correlated<'a> {
    fn new(all: &'a [PowerOn], rho: f64) -> Self {
        let mut own = Self { all, rho, weights: Vec::new() };
        own.weights = own.solve(&vec![1.0; all.len()]);
        own
    }

    /// V⁻¹ a: of each month, a less ρ/(1 + ρ n) of its sum.
    fn solve(&self, a: &[f64]) -> Vec<f64> {
        let months = self.all.iter().map(|p| p.month + 1).max().unwrap_or(0);
        let mut sums = vec![[0.0; 2]; months];
        for (p, a) in self.all.iter().zip(a) {
            let [sum, n] = sums[p.month];
            sums[p.month] = [sum + a, n + 1.0];
        }
        let less = |p: &PowerOn| self.rho * sums[p.month][0] / (1.0 + self.rho * sums[p.month][1]);
        self.all.iter().zip(a).map(|(p, a)| a - less(p)).collect()
    }

    fn mean(&self, a: &[f64]) -> f64 {
        dot(&self.weights, a) / self.weights.iter().sum::<f64>()
    }

    fn of(&self, value: impl Fn(&PowerOn) -> f64) -> Vec<f64> {
        self.all.iter().map(value).collect()
    }

    /// Values less their mean.
    fn centred(&self, value: impl Fn(&PowerOn) -> f64) -> Vec<f64> {
        let values = self.of(value);
        let mean = self.mean(&values);
        values.into_iter().map(|v| v - mean).collect()
    }
}

/// Sum of squares of the values about their mean, weighted by V⁻¹, and its degrees of freedom.
pub(super) fn squares(all: &[PowerOn], rho: f64) -> (f64, f64) {
    let own = Correlated::new(all, rho);
    let left = own.centred(|p| p.seen[0]);
    (dot(&left, &own.solve(&left)), all.len() as f64 - 1.0)
}

/// Prediction of a power-on of `month` by `all`, and its variance over σ².
fn predicted(all: &[PowerOn], month: usize, rho: f64) -> [f64; 2] {
    let own = Correlated::new(all, rho);
    // covariance of today's with the earlier ones
    let with = own.of(|p| if p.month == month { rho } else { 0.0 });
    let weight: f64 = own.weights.iter().sum();
    let expected = own.mean(&own.of(|p| p.seen[0])) + dot(&with, &own.solve(&own.centred(|p| p.seen[0])));
    let unknown_mean = (1.0 - dot(&with, &own.weights)).powi(2) / weight;
    [expected, 1.0 + rho - dot(&with, &own.solve(&with)) + unknown_mean]
}

/// `today` held against those of `earlier`; none where these are too few.
pub(super) fn held(
    earlier: &[PowerOn],
    today: &PowerOn,
    prior: &VariancePrior,
    months: &Months,
    level: f64,
) -> Option<Held> {
    if earlier.len() < FEWEST {
        return None;
    }
    let rho = months.ratio;
    let [expected, unit] = predicted(earlier, today.month, rho);
    let (squares, own_degrees) = squares(earlier, rho);
    let (variance, degrees) = prior.moderated(squares, own_degrees);
    let degrees = degrees.min(months.known_by(unit, |rho| predicted(earlier, today.month, rho)[1]));
    // the variance holds the errors of the earlier estimates; a shorter log today errs by more
    let more = (today.seen[1].powi(2) - mean(earlier.iter().map(|p| p.seen[1].powi(2)))).max(0.0);
    let scale = (variance * unit + more).sqrt();
    let t = (today.seen[0] - expected) / scale;
    let (p_value, quantile) = student(t, degrees, level)?;
    Some(Held { expected, half_width: quantile * scale, t, degrees, p_value, outside: p_value < level })
}

/// Two-sided probability of as large a t, and its quantile at `level`.
fn student(t: f64, degrees: f64, level: f64) -> Option<(f64, f64)> {
    let law = StudentsT::new(0.0, 1.0, degrees).ok()?;
    Some((2.0 * law.sf(t.abs()), -law.inverse_cdf(0.5 * level))).filter(|(p, _)| p.is_finite())
}

/// Slope over time, its standard deviation and the probability of as steep a one by chance; none where all are of one time.
pub(super) fn slope(all: &[PowerOn], prior: &VariancePrior, months: &Months) -> Option<[f64; 3]> {
    let fitted = |rho: f64| {
        let own = Correlated::new(all, rho);
        let [x, y] = [own.centred(|p| p.at), own.centred(|p| p.seen[0])];
        let weighted = own.solve(&x);
        let sxx = dot(&weighted, &x);
        let slope = dot(&weighted, &y) / sxx;
        let left: Vec<f64> = x.iter().zip(&y).map(|(x, y)| y - slope * x).collect();
        [slope, 1.0 / sxx, dot(&left, &own.solve(&left))]
    };
    let [slope, unit, squares] = fitted(months.ratio);
    let (variance, degrees) = prior.moderated(squares, all.len() as f64 - 2.0);
    let std = (variance * unit).sqrt();
    let degrees = degrees.min(months.known_by(unit, |rho| fitted(rho)[1]));
    let (p_value, _) = student(slope / std, degrees, 0.5)?;
    Some([slope, std, p_value])
}

/// By how much the months of a unit differ, and how well that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Months {
    /// ρ.
    pub ratio: f64,
    /// Degrees of freedom within the months, and of the months about their lines; unbounded where there are no months.
    degrees: [f64; 2],
    /// 1/n: the mean of the months' reciprocal numbers of power-ons.
    share: f64,
}

impl Months {
    /// Power-ons are independent.
    pub(super) const NONE: Self = Self { ratio: 0.0, degrees: [f64::INFINITY; 2], share: 0.0 };

    /// Of the power-ons of all gyros.
    pub(super) fn of<'a>(gyros: impl Iterator<Item = &'a [PowerOn]>) -> Self {
        let (mut squares, mut within) = (0.0, 0.0);
        // time, value and number of power-ons of each month of each gyro
        let mut months: Vec<Vec<[f64; 3]>> = Vec::new();
        for all in gyros {
            let parts = all.chunk_by(|a, b| a.month == b.month);
            let own: Vec<[f64; 3]> = parts
                .clone()
                .map(|month| {
                    [mean(month.iter().map(|p| p.at)), mean(month.iter().map(|p| p.seen[0])), month.len() as f64]
                })
                .collect();
            if own.len() < 3 {
                continue;
            }
            // about one slope of all months: that of a drift
            let mut sums = [0.0; 3];
            for (month, [at, y, _]) in parts.zip(&own) {
                for p in month {
                    let [x, y] = [p.at - at, p.seen[0] - y];
                    sums = [sums[0] + x * x, sums[1] + x * y, sums[2] + y * y];
                }
            }
            let degrees = all.len() as f64 - own.len() as f64 - 1.0;
            if degrees > 0.0 && sums[0] > 0.0 {
                squares += (sums[2] - sums[1] * sums[1] / sums[0]).max(0.0);
                within += degrees;
            }
            months.push(own);
        }
        let about = months.iter().map(|own| own.len() as f64 - 2.0).sum::<f64>();
        if !(within > 0.0 && squares > 0.0 && about > 0.0) {
            return Self::NONE;
        }
        let variance = squares / within;
        let q = |rho: f64| {
            let all = months.iter().map(|own| about_a_line(own, rho));
            Some(all.fold([0.0; 2], |[q, by], [own, own_by]| [q + own / variance, by + own_by / variance]))
        };
        let ratio = variance_where(q, about, 1.0, TOLERANCE).filter(|rho| rho.is_finite()).unwrap_or(0.0);
        let shares: Vec<f64> = months.iter().flatten().map(|m| 1.0 / m[2]).collect();
        Self { ratio, degrees: [within, about], share: mean(shares.iter().copied()) }
    }

    /// Degrees of freedom of a variance `unit` σ², which is `unit_at(ρ)` σ².
    fn known_by(&self, unit: f64, unit_at: impl Fn(f64) -> f64) -> f64 {
        if self.degrees[0].is_infinite() {
            return f64::INFINITY;
        }
        let step = 1e-4 * (1.0 + self.ratio);
        let growth = (unit_at(self.ratio + step) - unit) / step;
        let between = growth * (self.ratio + self.share);
        unit * unit / ((unit - between).powi(2) / self.degrees[0] + between * between / self.degrees[1])
    }
}

/// Squares of months about their line, weighted by 1/(1/n + ρ), and the derivative by ρ.
fn about_a_line(months: &[[f64; 3]], rho: f64) -> [f64; 2] {
    let weight = |m: &[f64; 3]| 1.0 / (1.0 / m[2] + rho);
    let sum: f64 = months.iter().map(weight).sum();
    let [x, y] = [0, 1].map(|k| months.iter().map(|m| weight(m) * m[k]).sum::<f64>() / sum);
    let sxx: f64 = months.iter().map(|m| weight(m) * (m[0] - x).powi(2)).sum();
    let slope = months.iter().map(|m| weight(m) * (m[0] - x) * (m[1] - y)).sum::<f64>() / sxx;
    months.iter().fold([0.0; 2], |[q, by], m| {
        let (w, left) = (weight(m), m[1] - y - slope * (m[0] - x));
        [q + w * left * left, by - (w * left).powi(2)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    /// A gyro with so many power-ons a month, whose months differ by √ρ, and today's in the last month or in a new one.
    fn gyro(counts: &[usize], same_month: bool, rho: f64, draw: &mut Stream) -> (Vec<PowerOn>, PowerOn) {
        let (mut all, mut off) = (Vec::new(), 0.0);
        let power_on = |month: usize, part: f64, off: f64, draw: &mut Stream| PowerOn {
            at: 30.0 * (month as f64 + part),
            month,
            seen: [off + draw.normal(), 0.01],
        };
        for (month, n) in counts.iter().enumerate() {
            off = rho.sqrt() * draw.normal();
            all.extend((0..*n).map(|k| power_on(month, (k as f64 + 0.5) / (*n as f64 + 1.0), off, draw)));
        }
        let last = counts.len() - 1;
        let today = match same_month {
            true => power_on(last, 0.99, off, draw),
            false => power_on(last + 1, 0.0, rho.sqrt() * draw.normal(), draw),
        };
        (all, today)
    }

    /// One gyro alone, whose ρ is known by few degrees of freedom: no more often outside than all eight tests together may be.
    #[test]
    fn a_ratio_that_is_known_badly_raises_no_false_alarms() {
        let (runs, level) = (2000, 0.05);
        let once = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2];
        let cases: [(&[usize], bool, f64); 6] = [
            (&once, true, 0.0),
            (&once, true, 1.0),
            (&once, false, 1.0),
            (&[5, 5, 5], false, 4.0),
            (&[5, 5, 2], true, 4.0),
            (&[5, 5, 5], false, 0.0),
        ];
        for (counts, same_month, rho) in cases {
            let outside = (0..runs).filter(|seed| {
                let (earlier, today) = gyro(counts, same_month, rho, &mut Stream::new(*seed, 9));
                let months = Months::of([earlier.as_slice()].into_iter());
                held(&earlier, &today, &VariancePrior::NONE, &months, level / 8.0).is_some_and(|h| h.outside)
            });
            let (n, outside) = (runs as f64, outside.count() as f64);
            let bound = n * level + 3.0 * (n * level * (1.0 - level)).sqrt();
            assert!(outside <= bound, "{counts:?}, {same_month}, {rho}: {outside} of {runs}");
        }
    }

    #[test]
    fn a_steady_drift_of_one_gyro_leaves_the_ratio() {
        let mut ratios = [0.0; 2];
        for seed in 0..40 {
            let mut draw = Stream::new(seed, 10);
            let mut gyros: Vec<Vec<PowerOn>> = (0..6).map(|_| gyro(&[5; 12], false, 1.0, &mut draw).0).collect();
            for (k, ratio) in ratios.iter_mut().enumerate() {
                gyros[0].iter_mut().for_each(|p| p.seen[0] += 0.3 * k as f64 * p.at);
                *ratio += Months::of(gyros.iter().map(Vec::as_slice)).ratio / 40.0;
            }
        }
        assert!(ratios.iter().all(|r| (r - 1.0).abs() < 0.2), "{ratios:?}");
    }

    #[test]
    fn without_months_a_prediction_is_the_mean() {
        let (all, today) = gyro(&[4, 4], true, 0.0, &mut Stream::new(1, 11));
        let [expected, unit] = predicted(&all, today.month, 0.0);
        assert!((expected - mean(all.iter().map(|p| p.seen[0]))).abs() < 1e-12 && (unit - 1.125).abs() < 1e-12);
        assert_eq!(Months::of([all.as_slice()].into_iter()), Months::NONE);
        // with them it is drawn to its own month, and knows it better
        assert!(predicted(&all, today.month, 4.0)[1] < predicted(&all, today.month + 1, 4.0)[1]);
    }
}
