//! Entries of the battery: each effect of a gyro at rest brings its own.

use super::about::{About, Parameters};

/// Parameters with which the battery tries an effect, each spelled as users know it.
#[derive(Debug, Clone, Default)]
pub struct Tried {
    /// Plain sizes; those of signals and of a varying noise level state all that is otherwise drawn anew.
    pub sizes: Vec<Parameters>,
    /// Parameters with which two runs differ, as something is drawn anew in each; none where all runs are alike.
    pub drawn: Option<Parameters>,
    /// Of a noise or a filter: coordinates at which its spectrum is compared with simulated power.
    pub spectra: Vec<Spectrum>,
    /// Whether a signal is told up to a constant, which C2 takes.
    pub up_to_constant: bool,
}

/// A noise or a filter whose spectrum is compared with the power of simulated logs.
#[derive(Debug, Clone)]
pub struct Spectrum {
    /// θ
    pub theta: Vec<f64>,
    /// First coefficient of the cosine transform that is compared.
    pub lowest: usize,
    /// Relative error that the ends of a log, or an approximation, may leave.
    pub error: f64,
}

impl Tried {
    /// One size.
    pub fn size(pairs: &[(&str, f64)]) -> Self {
        Self { sizes: vec![of(pairs)], ..Self::default() }
    }

    /// One more size.
    pub(crate) fn or_size(mut self, pairs: &[(&str, f64)]) -> Self {
        self.sizes.push(of(pairs));
        self
    }

    /// Parameters with which two runs differ.
    pub fn drawn(self, pairs: &[(&str, f64)]) -> Self {
        Self { drawn: Some(of(pairs)), ..self }
    }

    /// One more spectrum.
    pub fn spectrum(mut self, theta: &[f64], lowest: usize, error: f64) -> Self {
        self.spectra.push(Spectrum { theta: theta.to_vec(), lowest, error });
        self
    }

    /// Told up to a constant.
    pub(crate) fn up_to_constant(self) -> Self {
        Self { up_to_constant: true, ..self }
    }
}

/// Asserts that each id has the form `place.effect`, and stands once in `all`.
pub(super) fn assert_ids_stand_once(all: &[&About]) {
    for (i, about) in all.iter().enumerate() {
        let well_formed = |part: &str| !part.is_empty() && part.bytes().all(|c| c.is_ascii_lowercase() || c == b'_');
        assert!(about.id.split_once('.').is_some_and(|(on, of)| well_formed(on) && well_formed(of)), "{}", about.id);
        assert!(all[..i].iter().all(|other| other.id != about.id), "{} twice", about.id);
    }
}

fn of(pairs: &[(&str, f64)]) -> Parameters {
    pairs.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
}
