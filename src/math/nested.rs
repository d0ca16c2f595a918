//! y_i = μ + β (x_i - x̄) + Σ_k u_k + e_i,   u_k ~ N(0, τ_k²),   e_i ~ N(0, s_i²), s_i known:  differences of nested groups
//!
//! ```text
//! Q_k(τ²) = Σ_g Σ_(j in g) (m_j - m_g(τ²))²/(v_j + τ²),   m_g, v_g: weighted mean of group g and its variance, items of level k + 1
//! ```
//!
//! Level 0 has the numbers themselves, v = s²; the last level has one group. At the true τ's each Q_k is χ² with as many degrees of freedom as
//! it has items less groups (Paule and Mandel, J. Res. NBS 87 (1982) 377, with one mean a group; `super::random_effects` has the case of
//! one group). τ_k is where Q_k has its mean. β is estimated within the groups of level 0, beside their means, and costs it a degree.
//!
//! Intervals are generalised ones (Weerahandi, J. American Statistical Association 88 (1993) 899): a draw solves Q_0 = χ² for τ_0, draws β, with
//! these solves Q_1 = χ² for τ_1, and so on up to μ. What is not known of a lower level so widens the intervals of the higher ones.
//! For level 0 the quantiles are those of χ²: exact. P values: probability of so large a Q_k without τ_k, mean over the draws.

use super::distributions::chi_squared_interval95;
use super::random::Stream;
use super::random_effects::{FLOOR, variance_where};
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Draws of an interval.
const DRAWS: u64 = 1999;
/// Relative tolerance of τ²: within the draws, and of the estimate.
const TOLERANCES: [f64; 2] = [1e-4, 1e-9];

/// Items of a level: numbers, or means of groups.
#[derive(Debug, Clone, PartialEq)]
struct Items {
    y: Vec<f64>,
    /// The covariate; 0 where there is none.
    x: Vec<f64>,
    /// Variance of the error of y.
    variance: Vec<f64>,
}

/// Which group an item belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Grouping {
    /// Index of the group of each item.
    pub group: Vec<usize>,
    /// Number of groups.
    pub groups: usize,
}

impl Grouping {
    fn degrees(&self) -> usize {
        self.group.len() - self.groups
    }
}

/// Spread of the items of a level in their groups.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct LevelSpread {
    /// τ.
    pub std: f64,
    /// Its 95 % interval; the upper end is infinite if no τ is too large.
    pub ci95: [f64; 2],
    /// Probability of differences like these without τ.
    pub p_value: f64,
}

/// A number with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Interval {
    /// The estimate.
    pub value: f64,
    /// Its interval.
    pub ci95: [f64; 2],
}

/// Spreads of all levels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Nested {
    /// One a level, the finest first.
    pub levels: Vec<LevelSpread>,
    /// μ, at the mean of x.
    pub mean: Interval,
    /// β; none where x does not vary within the groups of level 0.
    pub slope: Option<Interval>,
    /// Mean and variance of the items of each level at the estimates, without τ of that level itself; level 0 first.
    pub items: Vec<Vec<[f64; 2]>>,
}

/// Q, β and the means of the groups of a level at some τ.
struct Within {
    /// Q and its derivative by τ².
    q: [f64; 2],
    /// β and its variance.
    slope: [f64; 2],
    means: Items,
}

/// Numbers and their groups.
struct Model<'a> {
    numbers: Items,
    levels: &'a [Grouping],
    has_slope: bool,
}

/// The τ's, β and the items of one draw, or of the estimate.
struct Solved {
    std: Vec<f64>,
    slope: f64,
    p_values: Vec<f64>,
    mean: f64,
    /// Those of each level; none in a draw.
    items: Vec<Items>,
}

/// Spreads of `numbers` (value and standard deviation of its error) in nested groups. `levels[0]` groups the numbers, `levels[k]` the groups
/// of `levels[k - 1]`, and the last one has one group. `covariate`: x, one a number. The draws are those of `seed`.
///
/// `None` where a level has no group of two, numbers are not finite, or neither errors nor differences are positive.
#[must_use]
pub(crate) fn nested(
    numbers: &[[f64; 2]],
    covariate: Option<&[f64]>,
    levels: &[Grouping],
    seed: u64,
) -> Option<Nested> {
    let n = numbers.len();
    let fits = |k: usize| levels[k].group.len() == if k == 0 { n } else { levels[k - 1].groups };
    let finite = numbers.iter().flatten().chain(covariate.unwrap_or_default()).all(|v| v.is_finite());
    if !finite || levels.last()?.groups != 1 || !(0..levels.len()).all(|k| fits(k) && levels[k].degrees() > 0) {
        return None;
    }
    let mut x = covariate.map_or_else(|| vec![0.0; n], <[f64]>::to_vec);
    let centre = x.iter().sum::<f64>() / n as f64;
    x.iter_mut().for_each(|x| *x -= centre);
    let has_slope = levels[0].degrees() > 1 && varies(&x, &levels[0]);
    if !has_slope {
        x.fill(0.0);
    }
    let [y, variance] = [0, 1].map(|k| numbers.iter().map(|v| if k == 0 { v[0] } else { v[1] * v[1] }).collect());
    let model = Model { numbers: Items { y, x, variance }, levels, has_slope };
    let estimate = model.solved(None)?;
    let draws = (0..DRAWS).into_par_iter().map(|draw| model.solved(Some(Stream::new(seed, draw))));
    let draws: Vec<Solved> = draws.collect::<Option<_>>()?;
    let interval = |of: &dyn Fn(&Solved) -> f64| {
        let mut values: Vec<f64> = draws.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        // of 1999 draws the 50th from either end
        let tail = (DRAWS as usize + 1) / 40 - 1;
        [values[tail], values[values.len() - 1 - tail]]
    };
    let spread = |k: usize| {
        let drawn = draws.iter().map(|d| d.p_values[k]).sum::<f64>() / draws.len() as f64;
        let exact = if k == 0 { model.exact()? } else { (interval(&|d| d.std[k]), drawn) };
        Some(LevelSpread { std: estimate.std[k], ci95: exact.0, p_value: exact.1 })
    };
    Some(Nested {
        levels: (0..levels.len()).map(spread).collect::<Option<_>>()?,
        mean: Interval { value: estimate.mean, ci95: interval(&|d| d.mean) },
        slope: has_slope.then(|| Interval { value: estimate.slope, ci95: interval(&|d| d.slope) }),
        items: estimate.items.iter().map(|i| i.y.iter().zip(&i.variance).map(|(y, v)| [*y, *v]).collect()).collect(),
    })
}

/// Whether x differs within a group.
fn varies(x: &[f64], grouping: &Grouping) -> bool {
    let mut ends = vec![[f64::INFINITY, f64::NEG_INFINITY]; grouping.groups];
    for (x, g) in x.iter().zip(&grouping.group) {
        ends[*g] = [ends[*g][0].min(*x), ends[*g][1].max(*x)];
    }
    let size = x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    ends.iter().any(|[low, high]| high - low > 1e-9 * size)
}

impl Model<'_> {
    /// All levels, from below: at the estimates, or at those of a draw.
    fn solved(&self, mut draw: Option<Stream>) -> Option<Solved> {
        let mut own = self.numbers.clone();
        let (mut std, mut p_values, mut slope, mut items) = (Vec::new(), Vec::new(), 0.0, Vec::new());
        for k in 0..self.levels.len() {
            let (tau, p_value, mut within) = self.level(k, &own, &mut draw)?;
            if k == 0 {
                slope = within.slope[0];
                if let Some(stream) = &mut draw {
                    slope += stream.normal() * within.slope[1].sqrt();
                }
                let Items { y, x, .. } = &mut within.means;
                y.iter_mut().zip(x.iter()).for_each(|(y, x)| *y -= slope * x);
                x.fill(0.0);
            }
            std.push(tau);
            p_values.push(p_value);
            let below = std::mem::replace(&mut own, within.means);
            // two thousand draws of ten thousand numbers would be half a gigabyte
            if draw.is_none() {
                items.push(below);
            }
        }
        let mut mean = own.y[0];
        if let Some(stream) = &mut draw {
            mean += stream.normal() * own.variance[0].sqrt();
        }
        Some(Solved { std, slope, p_values, mean, items })
    }

    /// τ of level k whose items are `own`, the probability of such a Q without it, and what is above it.
    fn level(&self, k: usize, own: &Items, draw: &mut Option<Stream>) -> Option<(f64, f64, Within)> {
        let degrees = self.degrees(k);
        let law = ChiSquared::new(degrees).ok()?;
        let (target, tolerance) = match draw {
            Some(stream) => (stream.chi_squared(degrees), TOLERANCES[0]),
            None => (degrees, TOLERANCES[1]),
        };
        let grouping = &self.levels[k];
        let scale = own.scale(grouping)?;
        let at = |variance: f64| own.within(grouping, variance.max(FLOOR * scale));
        // without a bound nothing is known of the levels above either
        let q = |variance: f64| Some(at(variance).q);
        let variance = variance_where(q, target, scale, tolerance).filter(|v| v.is_finite())?;
        Some((variance.sqrt(), law.sf(at(0.0).q[0]), at(variance)))
    }

    fn degrees(&self, k: usize) -> f64 {
        (self.levels[k].degrees() - usize::from(k == 0 && self.has_slope)) as f64
    }

    /// Interval and p value of level 0, without draws.
    fn exact(&self) -> Option<([f64; 2], f64)> {
        let degrees = self.degrees(0);
        let (own, grouping) = (&self.numbers, &self.levels[0]);
        let scale = own.scale(grouping)?;
        let q = |variance: f64| Some(own.within(grouping, variance.max(FLOOR * scale)).q);
        let [low, high] = chi_squared_interval95(degrees);
        let end = |target: f64| variance_where(q, target, scale, TOLERANCES[1]).map(f64::sqrt);
        Some(([end(high)?, end(low)?], ChiSquared::new(degrees).ok()?.sf(q(0.0)?[0])))
    }
}

impl Items {
    /// Mean square of the differences in the groups and of the errors.
    fn scale(&self, grouping: &Grouping) -> Option<f64> {
        let plain = Self { variance: vec![1.0; self.y.len()], ..self.clone() }.within(grouping, 0.0).q[0];
        let scale = (plain + self.variance.iter().sum::<f64>()) / self.y.len() as f64;
        (scale > 0.0).then_some(scale)
    }

    /// At τ² = `added`.
    fn within(&self, grouping: &Grouping, added: f64) -> Within {
        let weight = |i: usize| 1.0 / (self.variance[i] + added);
        let n = self.y.len();
        // Σ w, Σ w y, Σ w x of each group, then its means
        let mut sums = vec![[0.0; 3]; grouping.groups];
        for (i, g) in grouping.group.iter().enumerate() {
            let w = weight(i);
            let s = &mut sums[*g];
            *s = [s[0] + w, s[1] + w * self.y[i], s[2] + w * self.x[i]];
        }
        sums.iter_mut().for_each(|s| *s = [s[0], s[1] / s[0], s[2] / s[0]]);
        let from_mean = |i: usize| {
            let [_, y, x] = sums[grouping.group[i]];
            [self.y[i] - y, self.x[i] - x]
        };
        let (mut sxx, mut sxy) = (0.0, 0.0);
        for i in 0..n {
            let [y, x] = from_mean(i);
            sxx += weight(i) * x * x;
            sxy += weight(i) * x * y;
        }
        let slope = if sxx > 0.0 { [sxy / sxx, 1.0 / sxx] } else { [0.0; 2] };
        let mut q = [0.0; 2];
        for i in 0..n {
            let [y, x] = from_mean(i);
            let (w, r) = (weight(i), y - slope[0] * x);
            q = [q[0] + w * r * r, q[1] - (w * r).powi(2)];
        }
        let [y, x, variance] = [1, 2, 0].map(|k| sums.iter().map(|s| if k == 0 { 1.0 / s[0] } else { s[k] }).collect());
        Within { q, slope, means: Self { y, x, variance } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cases::cases;

    /// Groups of `sizes` items each.
    fn groups(sizes: &[usize]) -> Grouping {
        let group = sizes.iter().enumerate().flat_map(|(g, size)| vec![g; *size]).collect();
        Grouping { group, groups: sizes.len() }
    }

    fn one(items: usize) -> Grouping {
        groups(&[items])
    }

    /// Calcium of turnip greens: four plants, three leaves of each, two samples of a leaf (Snedecor and Cochran, Statistical Methods, 1967, page 286).
    /// The components of variance and F tests are those of SAS/STAT's PROC NESTED.
    #[test]
    fn balanced_groups_are_those_of_an_analysis_of_variance() {
        let calcium = [
            3.28, 3.09, 3.52, 3.48, 2.88, 2.80, 2.46, 2.44, 1.87, 1.92, 2.19, 2.19, 2.77, 2.66, 3.74, 3.44, 2.55, 2.55,
            3.78, 3.87, 4.07, 4.12, 3.31, 3.31,
        ];
        let levels = [groups(&[2; 12]), groups(&[3; 4]), one(4)];
        let found = nested(&calcium.map(|v| [v, 0.0]), None, &levels, 1).unwrap();
        for (level, component) in found.levels.iter().zip([0.006_654, 0.161_060, 0.365_223]) {
            assert!((level.std.powi(2) - component).abs() < 1e-6, "{level:?}");
            assert!(level.ci95[0] < level.std && level.std < level.ci95[1], "{level:?}");
        }
        assert!((found.mean.value - calcium.iter().sum::<f64>() / 24.0).abs() < 1e-9);
        // 0.079850/χ²: exact
        for (end, quantile) in found.levels[0].ci95.iter().zip([23.336_664, 4.403_789]) {
            assert!((end * end - 0.079_85 / quantile).abs() < 1e-6, "{end}");
        }
        // F = 7.67, p = 0.0097, which the mean over draws is; and Student's interval of the mean with three degrees of freedom
        assert!((found.levels[2].p_value - 0.0097).abs() < 0.002, "{:?}", found.levels[2]);
        let half = 3.182_446 * (2.520_115_f64 / 24.0).sqrt();
        assert!((0.5 * (found.mean.ci95[1] - found.mean.ci95[0]) / half - 1.0).abs() < 0.15, "{:?}", found.mean);
        assert!(found.slope.is_none());
    }

    #[test]
    fn a_covariate_is_taken_out_within_groups() {
        // two groups on lines of slope 2, 10 apart; x of the second is larger by 100
        let x: Vec<f64> = [0.0, 1.0, 2.0, 3.0, 100.0, 101.0, 102.0, 103.0].into();
        let numbers: Vec<[f64; 2]> = (0..8)
            .map(|i| [2.0 * x[i] + if i < 4 { 0.0 } else { 10.0 } + if i % 2 == 0 { 1e-3 } else { -1e-3 }, 0.0])
            .collect();
        let levels = [groups(&[4, 4]), one(2)];
        let found = nested(&numbers, Some(&x), &levels, 1).unwrap();
        let slope = found.slope.unwrap();
        assert!((slope.value - 2.0).abs() < 1e-3 && slope.ci95[0] < 2.0 && 2.0 < slope.ci95[1], "{slope:?}");
        // two groups whose means are 10 apart: std 10/√2
        assert!((found.levels[1].std - 10.0 / 2.0_f64.sqrt()).abs() < 0.1, "{found:?}");
        let without = nested(&numbers, Some(&[20.0; 8]), &levels, 1).unwrap();
        assert!(without.slope.is_none() && without.levels[0].std > 2.0);
    }

    #[test]
    fn what_is_no_nesting_gives_nothing() {
        let numbers = [[1.0, 0.1]; 4];
        assert!(nested(&numbers, None, &[groups(&[1; 4]), one(4)], 1).is_none());
        assert!(nested(&numbers, None, &[groups(&[2, 2])], 1).is_none());
        assert!(nested(&numbers, None, &[groups(&[2, 2]), one(3)], 1).is_none());
        assert!(nested(&[[1.0, 0.0]; 4], None, &[one(4)], 1).is_none());
        assert!(nested(&[[f64::NAN, 1.0]; 4], None, &[one(4)], 1).is_none());
        assert!(nested(&numbers, None, &[], 1).is_none());
    }

    /// Unequal groups with errors that differ fourfold: shares of simulated populations whose intervals hold the spreads, the mean and the slope.
    fn coverage(std: [f64; 3], runs: u64) -> [f64; 5] {
        let levels = [groups(&[2, 5, 3, 1, 4, 3, 2, 6, 3, 3, 2, 4]), groups(&[3, 1, 2, 2, 1, 3]), one(6)];
        let held = |seed: u64| {
            let mut draw = Stream::new(seed, 5);
            let top: Vec<f64> = (0..6).map(|_| 3.0 + std[2] * draw.normal()).collect();
            let middle: Vec<f64> = levels[1].group.iter().map(|g| top[*g] + std[1] * draw.normal()).collect();
            let mut x = Vec::new();
            let numbers: Vec<[f64; 2]> = (0..levels[0].group.len())
                .map(|i| {
                    let error = 0.2 * f64::from(1 + i as u32 % 4);
                    x.push(20.0 + 5.0 * draw.normal());
                    let y = middle[levels[0].group[i]] + std[0] * draw.normal() + error * draw.normal();
                    [y + 0.1 * (x[i] - 20.0), error]
                })
                .collect();
            let found = nested(&numbers, Some(&x), &levels, seed).unwrap();
            // the mean is told at the mean of x
            let mean = 3.0 + 0.1 * (x.iter().sum::<f64>() / x.len() as f64 - 20.0);
            let holds = |ci: [f64; 2], truth: f64| ci[0] <= truth && truth <= ci[1];
            let of = |k: usize| holds(found.levels[k].ci95, std[k]);
            [of(0), of(1), of(2), holds(found.mean.ci95, mean), holds(found.slope.unwrap().ci95, 0.1)]
        };
        let all: Vec<[bool; 5]> = (0..runs).map(held).collect();
        std::array::from_fn(|k| all.iter().filter(|h| h[k]).count() as f64 / runs as f64)
    }

    fn covers(all: &[[f64; 3]], runs: u64) {
        // three binomial standard deviations; generalised intervals may hold more often than they say
        let bound = 3.0 * (0.95 * 0.05 / runs as f64).sqrt();
        for std in all {
            let shares = coverage(*std, runs);
            assert!(shares.iter().all(|s| *s >= 0.95 - bound), "{std:?}: {shares:?}");
            // exact, where there is a spread
            assert!(std[0] == 0.0 || shares[0] <= 0.95 + bound, "{std:?}: {shares:?}");
        }
    }

    #[test]
    fn intervals_cover() {
        covers(&[[1.0, 0.7, 2.0], [0.5, 0.0, 1.0]], 60);
    }

    #[test]
    #[ignore = "battery: two minutes"]
    fn battery_intervals_cover() {
        let mixed = [[1.0, 0.7, 2.0], [0.5, 0.0, 1.0], [1.0, 1.0, 0.0], [0.1, 2.0, 0.3], [0.0; 3], [3.0, 0.5, 0.5]];
        covers(&mixed, cases(1000));
    }
}
