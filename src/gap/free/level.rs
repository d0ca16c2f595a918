//! S_white → g² S_white, ln g = ε sinh u, u uniform: the white noise is not what the nominal simulator states
//!
//! The density of ln g is 1/√(ε² + ln² g) over [1/5, 5]: small and large errors of a data sheet are equally probable, factor
//! by factor, down to an error of ε that no recording shows. Uniform in ln g alone, an error of a few per cent would have
//! next to no prior.

use crate::effects::Noise;
use crate::model::Scene;

/// Another level of white noise.
pub struct WhiteLevel;

/// ε
const LEAST: f64 = 0.01;
/// Largest factor on the standard deviation.
const LARGEST: f64 = 5.0;

/// exp(u) for a factor g on the standard deviation.
fn theta(g: f64) -> f64 {
    (g.ln() / LEAST).asinh().exp()
}

impl Noise for WhiteLevel {
    fn names(&self) -> Vec<&'static str> {
        vec!["white_level"]
    }

    fn range(&self, _: &Scene) -> Vec<[f64; 2]> {
        vec![[theta(1.0 / LARGEST), theta(LARGEST)]]
    }

    fn starts(&self, _: &Scene) -> Vec<Vec<f64>> {
        [0.7, 0.9, 0.97, 1.03, 1.1, 1.4].map(|g| vec![theta(g)]).to_vec()
    }

    fn spectrum(&self, _: &Scene, theta: &[f64], _: f64) -> f64 {
        (2.0 * LEAST * theta[0].ln().sinh()).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parameter_says_the_level_and_reaches_both_ends() {
        for g in [0.2, 0.97, 1.0, 1.004, 1.3, 5.0] {
            let s = 2.0 * LEAST * theta(g).ln().sinh();
            assert!((s - 2.0 * g.ln()).abs() < 1e-9, "{g}: {s}");
        }
        assert_eq!(theta(1.0), 1.0);
    }
}
