//! Random streams by explicit seed: the same (seed, stream) gives the same numbers on every machine and thread.

use rand::SeedableRng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// A generator of its own for each purpose: `stream` tells apart what is drawn under one `seed`.
#[derive(Debug, Clone)]
pub struct Stream(Pcg64);

impl Stream {
    /// Stream number `stream` of `seed`. Different streams never share state.
    #[must_use]
    pub fn new(seed: u64, stream: u64) -> Self {
        // splitmix64 spreads neighbouring seeds over the whole state (Steele, Lea, Flood 2014)
        let mut state = seed ^ stream.wrapping_mul(0xD1B5_4A32_D192_ED03);
        let mut bytes = [0u8; 32];
        for chunk in bytes.chunks_exact_mut(8) {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            chunk.copy_from_slice(&(z ^ (z >> 31)).to_le_bytes());
        }
        Self(Pcg64::from_seed(bytes))
    }

    /// One standard normal deviate.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// One deviate uniform on [0, 1).
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        rand::RngExt::random(&mut self.0)
    }

    /// One χ² deviate with `degrees` degrees of freedom; not a number where these are not positive.
    pub(crate) fn chi_squared(&mut self, degrees: f64) -> f64 {
        ChiSquared::new(degrees).map_or(f64::NAN, |law| law.sample(&mut self.0))
    }

    /// Shuffles in place (Fisher and Yates).
    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        rand::seq::SliceRandom::shuffle(items, &mut self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |seed, stream| {
            let mut s = Stream::new(seed, stream);
            (0..4).map(|_| s.normal().to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(draw(1, 2), draw(1, 2));
        assert_ne!(draw(1, 2), draw(1, 3));
        assert_ne!(draw(1, 2), draw(2, 2));
    }

    #[test]
    fn normal_has_mean_zero_and_unit_variance() {
        let n = 100_000;
        let mut s = Stream::new(7, 0);
        let draws: Vec<f64> = (0..n).map(|_| s.normal()).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(n);
        let var = draws.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
        // five standard errors: 1/sqrt(n) of the mean, sqrt(2/n) of the variance
        assert!(mean.abs() < 5.0 / f64::from(n).sqrt());
        assert!((var - 1.0).abs() < 5.0 * (2.0 / f64::from(n)).sqrt());
    }
}
