//! ln p(set | recording) = ln evidence / T + prior(k, m) + constant: k effects of the library, m free forms;
//! p(set) → (1 - ε) p(set) for every set but the empty one,  ε = q ε₁ + (1 - q) ε₀
//!
//! Calibration of evidences, learned from recordings whose truth is known. Laplace's method and the search over sets
//! make evidences too confident by a factor T. How often real recordings lack nothing, one effect or more is a prior,
//! which no evidence tells. The numbers that ship were fitted by `gyroid gap bench calibrate`; the file states their
//! provenance. They hold for recordings like those of the bench, of which one in eight lacks nothing: where gaps are
//! rarer, 'none' is more probable than stated.
//! ε is the share of the recordings with a gap whose cause is none of the candidates, however large the evidence:
//! thousands of nats between two wrong models prove neither, and no temperature corrects that. It is larger where the
//! candidates are divided: q is the share of the most probable main cause in all sets but the empty one. For sets whose
//! main cause has no name it may be another: a free form stands where a known effect was not fitted well more often than a
//! named one where another is true.

use crate::error::{Error, ErrorKind, Result};
use crate::gap::selection::prior::Prior;
use crate::gap::selection::sets::WeightedSet;
use serde::{Deserialize, Serialize};

/// The files that ship: for recordings at rest and for drives.
const SHIPPED: &str = include_str!("calibration.toml");
const SHIPPED_DRIVES: &str = include_str!("../drive/calibration.toml");

/// Calibration of evidences to probabilities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// T: above one, evidence counts for less.
    pub temperature: f64,
    /// ln of the prior odds of the first effect of the library over none, and of each further one.
    pub ln_effect: [f64; 2],
    /// The same of free forms.
    pub ln_free: [f64; 2],
    /// ε₁ and ε₀: probability, given a gap, that its cause is none of the candidates, where one of them has all of the
    /// weight and where none has any.
    #[serde(default)]
    pub doubt: [f64; 2],
    /// ε of sets whose main cause has no name, where it is another than ε₁ and ε₀ say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub doubt_unknown: Option<f64>,
}

#[derive(Deserialize)]
struct File {
    calibration: Calibration,
}

impl Calibration {
    /// No calibration: evidences as they are, under the prior of the search.
    #[must_use]
    pub(crate) fn none(prior: &Prior) -> Self {
        Self {
            temperature: 1.0,
            ln_effect: [prior.ln_named; 2],
            ln_free: [prior.ln_free; 2],
            doubt: [0.0; 2],
            doubt_unknown: None,
        }
    }

    /// Reads a calibration that `gyroid gap bench calibrate` wrote.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] for a file that is no calibration, or values out of range.
    pub(crate) fn from_toml(text: &str, source: &str) -> Result<Self> {
        let hint = "make it again with gyroid gap bench calibrate";
        let file: File =
            toml::from_str(text).map_err(|e| Error::new(ErrorKind::Config, source, e.message()).hint(hint))?;
        let c = file.calibration;
        let finite = c.ln_effect.iter().chain(&c.ln_free).all(|v| v.is_finite());
        let doubt = c.doubt.iter().chain(&c.doubt_unknown).all(|v| (0.0..1.0).contains(v));
        if !(c.temperature > 0.0 && c.temperature.is_finite() && finite && doubt) {
            let found = format!("{c:?} is no calibration");
            return Err(Error::new(ErrorKind::Config, source, found).at("[calibration]").hint(hint));
        }
        Ok(c)
    }

    /// ln prior of `effects` effects of the library and `free` free forms.
    #[must_use]
    pub(crate) fn ln_prior(&self, effects: usize, free: usize) -> f64 {
        let one = |ln: [f64; 2], n: usize| if n == 0 { 0.0 } else { ln[0] + (n - 1) as f64 * ln[1] };
        one(self.ln_effect, effects) + one(self.ln_free, free)
    }

    /// ε where the main causes other than none have these weights, up to a factor.
    #[must_use]
    pub(crate) fn doubt_of(&self, gaps: impl Iterator<Item = f64> + Clone) -> f64 {
        let first = gaps.clone().fold(0.0, f64::max) / gaps.sum::<f64>().max(f64::MIN_POSITIVE);
        first * self.doubt[0] + (1.0 - first) * self.doubt[1]
    }

    /// ln posterior weight of a set; its weight in the search includes the prior odds `prior`.
    #[must_use]
    pub(crate) fn ln_weight(&self, set: &WeightedSet, prior: &Prior) -> f64 {
        let (effects, free) = counts(set);
        let searched = effects as f64 * prior.ln_named + free as f64 * prior.ln_free;
        (set.ln_weight - searched) / self.temperature + self.ln_prior(effects, free)
    }
}

/// Numbers of effects and of free forms that a set claims, without those read directly off the readings.
pub(crate) fn counts(set: &WeightedSet) -> (usize, usize) {
    let claimed = || set.parts.iter().filter(|p| !p.certain);
    (claimed().filter(|p| p.named).count(), claimed().filter(|p| !p.named).count())
}

impl Calibration {
    /// The calibration for drives that ships; `prior` is that of their search.
    #[must_use]
    pub(crate) fn of_drives(prior: &Prior) -> Self {
        Self::from_toml(SHIPPED_DRIVES, "drive/calibration.toml").unwrap_or_else(|_| Self::none(prior))
    }
}

impl Default for Calibration {
    /// The calibration for recordings at rest that ships. A test reads it; if it were damaged, evidences are used as
    /// they are.
    fn default() -> Self {
        Self::from_toml(SHIPPED, "calibration.toml").unwrap_or_else(|_| Self::none(&Prior::default()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::selection::sets::Part;

    fn set(parts: &[(&str, bool)], ln_weight: f64) -> WeightedSet {
        let part = |(id, named): &(&str, bool)| Part { certain: id.ends_with("lattice"), ..Part::new(id, *named, 1.0) };
        WeightedSet { parts: parts.iter().map(part).collect(), ln_weight, probability: 0.0 }
    }

    #[test]
    fn the_shipped_calibrations_are_sound_and_prefer_less_to_more() {
        for text in [SHIPPED, SHIPPED_DRIVES] {
            let c = Calibration::from_toml(text, "calibration.toml").unwrap();
            assert!((0.8..6.0).contains(&c.temperature), "{c:?}");
            // every effect has prior odds below one, and a free form no better ones than a named effect
            assert!(c.ln_effect[0] < 0.0 && c.ln_free[0] <= c.ln_effect[0], "{c:?}");
            assert!(c.ln_effect[1] < 0.0 && c.ln_free[1] < 0.0, "{c:?}");
        }
    }

    #[test]
    fn the_search_s_prior_is_taken_back_and_what_is_certain_is_free() {
        let prior = Prior { ln_named: -2.0, ln_free: -4.0 };
        let c = Calibration {
            temperature: 2.0,
            ln_effect: [-1.0, -3.0],
            ln_free: [-5.0, -6.0],
            ..Calibration::none(&Prior::default())
        };
        let s = set(&[("a", true), ("b", true), ("free.c", false), ("lattice", true)], 10.0);
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
