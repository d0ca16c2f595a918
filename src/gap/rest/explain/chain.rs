//! y_k = Σ_j β_j x_jk ± Δ/2 + noise, the sign a two-state Markov chain: ln p(y | β, Δ, dwell times), its mode and
//! curvature
//!
//! The forward recursion over every sample (Rabiner, Proc. IEEE 77 (1989) 257) sums over all paths. Dwell times that
//! are not long against the sample time, and levels that overlap in the noise, are therefore not biased. The nuisances
//! β (turn-on bias and warm-up) keep their priors: a level and a turn-on bias look alike where flips are few.

use super::interval::{Estimate, maximum};

/// Readings and noise model of the recording beside the chain.
pub(super) struct Beside<'a> {
    /// Readings less everything but nuisances and the chain, in standard deviations of the white noise.
    pub y: &'a [f64],
    /// Columns of the nuisances, in the same unit, scaled to prior standard deviations of one.
    pub columns: &'a [Vec<f64>],
    /// Standard deviation of the white noise, rad/s.
    pub white_std_rad_s: f64,
    /// Sample time, s.
    pub step_s: f64,
}

/// Estimated parameters of the chain.
pub(super) struct Chain {
    /// Distance of the levels, rad/s.
    pub spacing_rad_s: Estimate,
    /// Mean of the two dwell times, s.
    pub mean_dwell_s: Estimate,
    /// Dwell time at the upper level over that at the lower.
    pub dwell_ratio: Estimate,
}

/// Prior standard deviation of ln dwell ratio: a factor of seven.
const LN_RATIO_STD: f64 = 2.0;
/// Steps of the finite differences of ln parameters: a fraction of their uncertainty with hundreds of flips.
const STEP: f64 = 0.02;

impl Beside<'_> {
    /// ln p(y, β | x), x = β…, ln(Δ/σ), ln(mean dwell/s), ln ratio.
    fn ln_posterior(&self, x: &[f64]) -> f64 {
        let (beta, chain) = x.split_at(self.columns.len());
        let &[ln_spacing, ln_dwell, ln_ratio] = chain else { return f64::NEG_INFINITY };
        let (spacing, dwell_s, ratio) = (ln_spacing.exp(), ln_dwell.exp(), ln_ratio.exp());
        let upper = ratio / (1.0 + ratio);
        // mean dwell times 2 τ p and 2 τ (1 - p): the correlation decays with the sum of the leaving rates
        let stays = (-self.step_s / (2.0 * dwell_s * upper * (1.0 - upper))).exp();
        let mut p = upper;
        let mut sum = 0.0;
        // the logarithm of the product of norms is taken only when it leaves its range
        let mut norm: f64 = 1.0;
        for (k, y) in self.y.iter().enumerate() {
            let nuisance: f64 = beta.iter().zip(self.columns).map(|(b, c)| b * c[k]).sum();
            let off = y - nuisance;
            // density at the upper level over that at the lower: exp(Δ off); the factor common to both is -(off² +
            // Δ²/4)/2
            let half = (0.5 * spacing * off).clamp(-300.0, 300.0).exp();
            let (low, high) = ((1.0 - p) / half, p * half);
            let total = low + high;
            norm *= total;
            if !(1e-200..1e200).contains(&norm) {
                sum += norm.ln();
                norm = 1.0;
            }
            sum -= 0.5 * off * off;
            p = upper + (high / total - upper) * stays;
        }
        let prior = beta.iter().map(|b| b * b).sum::<f64>() + (ln_ratio / LN_RATIO_STD).powi(2);
        sum + norm.ln() - 0.125 * spacing * spacing * self.y.len() as f64 - 0.5 * prior
    }

    /// The chain's parameters from a start: spacing in rad/s, dwell times at the lower and the upper level in s.
    pub(super) fn fit(&self, spacing_rad_s: f64, dwell_s: [f64; 2]) -> Option<Chain> {
        let n = self.columns.len();
        let mut x = vec![0.0; n];
        let [low, high] = dwell_s.map(|d| d.max(0.5 * self.step_s));
        x.extend([(spacing_rad_s / self.white_std_rad_s).ln(), (0.5 * (low + high)).ln(), (high / low).ln()]);
        let start = self.start(&x);
        x[..n].copy_from_slice(&start);
        // nuisances are known to a fraction of the white noise over √n
        let fine = 0.3 / (self.y.len() as f64).sqrt();
        let reach = |c: &Vec<f64>| (c.iter().map(|v| v * v).sum::<f64>() / c.len().max(1) as f64).sqrt();
        let mut steps: Vec<f64> = self.columns.iter().map(|c| (fine / reach(c).max(1e-12)).min(0.1)).collect();
        steps.extend([0.1 * STEP, STEP, STEP]);
        let covariance = maximum(|x| self.ln_posterior(x), &mut x, &steps)?;
        let told = |i: usize, unit: f64| {
            let value = unit * x[n + i].exp();
            Estimate::normal(value, value * covariance[(n + i, n + i)].max(0.0).sqrt(), true)
        };
        Some(Chain {
            spacing_rad_s: told(0, self.white_std_rad_s),
            mean_dwell_s: told(1, 1.0),
            dwell_ratio: told(2, 1.0),
        })
    }

    /// Nuisances by least squares with their prior, the chain replaced by its mean and variance.
    fn start(&self, x: &[f64]) -> Vec<f64> {
        let n = self.columns.len();
        let ratio = x[n + 2].exp();
        let mean = x[n].exp() * (ratio / (1.0 + ratio) - 0.5);
        let dot = |a: &[f64], b: &mut dyn Iterator<Item = f64>| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // the chain's own scatter counts as noise
        let noise = 1.0 + x[n].exp().powi(2) / 4.0;
        let gram = nalgebra::DMatrix::from_fn(n, n, |i, j| {
            dot(&self.columns[i], &mut self.columns[j].iter().copied()) / noise + f64::from(u8::from(i == j))
        });
        let right =
            nalgebra::DVector::from_fn(n, |i, _| dot(&self.columns[i], &mut self.y.iter().map(|y| y - mean)) / noise);
        gram.cholesky().map_or_else(|| vec![0.0; n], |c| c.solve(&right).as_slice().to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn the_recursion_is_the_sum_over_all_paths() {
        let y = [0.3, -1.1, 2.0, 0.7, -0.2];
        let columns = [vec![1.0, 1.0, 1.0, 1.0, 1.0]];
        let chain = Beside { y: &y, columns: &columns, white_std_rad_s: 1.0, step_s: 0.5 };
        let (beta, spacing, dwell, ratio) = (0.2, 1.3_f64, 0.9_f64, 1.7_f64);
        let upper = ratio / (1.0 + ratio);
        // leaving rates 1/(2 τ p) and 1/(2 τ (1 - p)); a two-state chain in continuous time
        let (down, up) = (1.0 / (2.0 * dwell * upper), 1.0 / (2.0 * dwell * (1.0 - upper)));
        let stays = (-0.5 * (up + down)).exp();
        let to_high = [upper * (1.0 - stays), upper + (1.0 - upper) * stays];
        let mut total = 0.0;
        for path in 0..32_u32 {
            let at = |k: usize| (path >> k & 1) as usize;
            let mut p = if at(0) == 1 { upper } else { 1.0 - upper };
            for k in 0..5 {
                if k > 0 {
                    p *= if at(k) == 1 { to_high[at(k - 1)] } else { 1.0 - to_high[at(k - 1)] };
                }
                let level = if at(k) == 1 { 0.5 * spacing } else { -0.5 * spacing };
                p *= (-0.5 * (y[k] - beta - level).powi(2)).exp();
            }
            total += p;
        }
        let prior = 0.5 * (beta * beta + (ratio.ln() / LN_RATIO_STD).powi(2));
        let found = chain.ln_posterior(&[beta, spacing.ln(), dwell.ln(), ratio.ln()]);
        assert!((found - (total.ln() - prior)).abs() < 1e-12, "{found} {}", total.ln() - prior);
    }

    #[test]
    fn overlapping_levels_keep_their_distance_and_short_dwells_their_length() {
        let mut draw = Stream::new(8, 0);
        let (n, spacing, dwell) = (20_000, 1.2, 4.0);
        let stays = (-1.0_f64 / dwell * 2.0).exp();
        let mut high = false;
        let y: Vec<f64> = (0..n)
            .map(|_| {
                high = draw.uniform() < 0.5 + if high { 0.5 * stays } else { -0.5 * stays };
                draw.normal() + 0.4 + if high { 0.5 * spacing } else { -0.5 * spacing }
            })
            .collect();
        let columns = [vec![1.0; n]];
        let beside = Beside { y: &y, columns: &columns, white_std_rad_s: 1.0, step_s: 1.0 };
        let found = beside.fit(0.8, [9.0, 9.0]).unwrap();
        for (e, truth) in [(found.spacing_rad_s, spacing), (found.mean_dwell_s, dwell), (found.dwell_ratio, 1.0)] {
            assert!((e.estimate / truth).ln().abs() < 3.5 * e.std / e.estimate, "{e:?}, true {truth}");
            assert!(e.std < 0.1 * truth, "{e:?}");
        }
    }
}
