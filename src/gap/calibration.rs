//! ln p(set | recording) = ln evidence / T + prior(k, m) + constant: k effects of the library, m free forms;
//! p(set) → (1 - ε) p(set) for every set but the empty one
//!
//! What the comparison's evidences are worth, learned from recordings whose truth is known: Laplace's method and the
//! searched part of the hypotheses make an evidence too sure by a factor T, and how often real recordings lack nothing,
//! one thing, or more is no matter of a recording's evidence. The numbers that ship were fitted by `gyroid gap bench
//! calibrate`; their provenance stands in the file. They hold for a world like that of the bench, in which one recording
//! in eight lacks nothing: where gaps are rarer, 'none' deserves more than it is given.
//! ε is the share of the recordings with a gap in which the truth is none of what was compared, however large the evidence:
//! thousands of nats between two wrong models prove neither, and no temperature heals that.

use super::findings::WeightedSet;
use super::search::Prior;
use crate::error::{Error, ErrorKind, Result};
use serde::{Deserialize, Serialize};

/// The files that ship.
const SHIPPED: &str = include_str!("calibration.toml");
const SHIPPED_DRIVES: &str = include_str!("drive/calibration.toml");

/// How evidences become probabilities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// T: above one, evidence counts for less.
    pub temperature: f64,
    /// ln of the prior odds of the first effect of the library over none, and of each further one.
    pub ln_effect: [f64; 2],
    /// The same of free forms.
    pub ln_free: [f64; 2],
    /// ε: where there is a gap, the probability that what causes it is none of what was compared.
    #[serde(default)]
    pub doubt: f64,
}

#[derive(Deserialize)]
struct File {
    calibration: Calibration,
}

impl Calibration {
    /// Evidence as it is, under the prior of the search.
    #[must_use]
    pub fn none(prior: &Prior) -> Self {
        Self { temperature: 1.0, ln_effect: [prior.ln_named; 2], ln_free: [prior.ln_free; 2], doubt: 0.0 }
    }

    /// Reads a calibration that `gyroid gap bench calibrate` wrote.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] for a file that is none, or a temperature that is not positive.
    pub fn from_toml(text: &str, source: &str) -> Result<Self> {
        let mend = "make it again with gyroid gap bench calibrate";
        let file: File =
            toml::from_str(text).map_err(|e| Error::new(ErrorKind::Config, source, e.message()).mend(mend))?;
        let c = file.calibration;
        let finite = c.ln_effect.iter().chain(&c.ln_free).all(|v| v.is_finite());
        if !(c.temperature > 0.0 && c.temperature.is_finite() && finite && (0.0..1.0).contains(&c.doubt)) {
            let found = format!("{c:?} is no calibration");
            return Err(Error::new(ErrorKind::Config, source, found).at("[calibration]").mend(mend));
        }
        Ok(c)
    }

    /// ln prior of `effects` effects of the library and `free` free forms.
    #[must_use]
    pub fn ln_prior(&self, effects: usize, free: usize) -> f64 {
        let one = |ln: [f64; 2], n: usize| if n == 0 { 0.0 } else { ln[0] + (n - 1) as f64 * ln[1] };
        one(self.ln_effect, effects) + one(self.ln_free, free)
    }

    /// ln of the posterior weight of a set whose weight in the search stood under `prior`.
    #[must_use]
    pub fn ln_weight(&self, set: &WeightedSet, prior: &Prior) -> f64 {
        let (effects, free) = counts(set);
        let searched = effects as f64 * prior.ln_named + free as f64 * prior.ln_free;
        (set.ln_weight - searched) / self.temperature + self.ln_prior(effects, free)
    }
}

/// Effects of the library and free forms that a set claims beyond what is read off the numbers.
pub fn counts(set: &WeightedSet) -> (usize, usize) {
    let claimed = || set.parts.iter().filter(|p| !p.certain);
    (claimed().filter(|p| p.named).count(), claimed().filter(|p| !p.named).count())
}

impl Calibration {
    /// The one of drives that ships. Its search stands under `prior`.
    #[must_use]
    pub fn of_drives(prior: &Prior) -> Self {
        Self::from_toml(SHIPPED_DRIVES, "drive/calibration.toml").unwrap_or_else(|_| Self::none(prior))
    }
}

impl Default for Calibration {
    /// The one that ships. A test reads it; were it damaged all the same, evidences stand as they are.
    fn default() -> Self {
        Self::from_toml(SHIPPED, "calibration.toml").unwrap_or_else(|_| Self::none(&Prior::default()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::findings::Part;

    fn set(parts: &[(&str, bool)], ln_weight: f64) -> WeightedSet {
        let part = |(id, named): &(&str, bool)| Part { certain: id.ends_with("lattice"), ..Part::new(id, *named, 1.0) };
        WeightedSet { parts: parts.iter().map(part).collect(), ln_weight, probability: 0.0 }
    }

    #[test]
    fn the_shipped_calibrations_are_sound_and_prefer_less_to_more() {
        for text in [SHIPPED, SHIPPED_DRIVES] {
            let c = Calibration::from_toml(text, "calibration.toml").unwrap();
            assert!((0.8..6.0).contains(&c.temperature), "{c:?}");
            // nothing is likelier than any one thing, and a free form no cheaper than a named effect
            assert!(c.ln_effect[0] < 0.0 && c.ln_free[0] <= c.ln_effect[0], "{c:?}");
            assert!(c.ln_effect[1] < 0.0 && c.ln_free[1] < 0.0, "{c:?}");
        }
    }

    #[test]
    fn the_search_s_prior_is_taken_back_and_what_is_certain_is_free() {
        let prior = Prior { ln_named: -2.0, ln_free: -4.0 };
        let c = Calibration { temperature: 2.0, ln_effect: [-1.0, -3.0], ln_free: [-5.0, -6.0], doubt: 0.0 };
        let s = set(&[("a", true), ("b", true), ("free.c", false), ("gyro.lattice", true)], 10.0);
        // evidence 10 + 2 · 2 + 4 = 18
        assert!((c.ln_weight(&s, &prior) - (9.0 - 1.0 - 3.0 - 5.0)).abs() < 1e-12);
        assert!((Calibration::none(&prior).ln_weight(&s, &prior) - 10.0).abs() < 1e-12);
        assert_eq!(c.ln_weight(&set(&[("free.lattice", false)], 1.0), &prior), 0.5);
    }

    #[test]
    fn a_damaged_file_is_refused_with_its_name() {
        for bad in ["", "[calibration]\ntemperature = -1.0\nln_effect = [0.0, 0.0]\nln_free = [0.0, 0.0]\n"] {
            assert!(Calibration::from_toml(bad, "my.toml").unwrap_err().to_string().contains("my.toml"));
        }
    }
}
