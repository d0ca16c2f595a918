//! A hypothesis: the candidates at work in the Gaussian part of a recording, with their parameters.

use super::basis::{ColumnId, SpectralBasis};
use crate::effects::{Noise, NoiseState, Signal};

/// A candidate explanation: an effect of the library or a free form.
pub(crate) struct Candidate {
    /// Identifier of the effect or the free form.
    pub id: String,
    /// Whether it is an effect of the library (else a free form, which stands for 'unknown').
    pub named: bool,
    /// How it enters the Gaussian likelihood.
    pub kind: Kind,
}

/// How a candidate enters the Gaussian likelihood.
pub(crate) enum Kind {
    /// Columns with coefficients.
    Signal(Box<dyn Signal>),
    /// ln variance of the white noise by columns, with a normal prior of the coefficients.
    Variance(Box<dyn Signal>),
    /// Columns of a periodic signal with this number of harmonics, sampled at full rate; the periodogram gives its
    /// frequency.
    Line(Box<dyn Signal>, usize),
    /// A constant with a prior wider than the stated repeatability of C2.
    TurnOn,
    /// Noise whose spectrum is added.
    Noise(Box<dyn Noise>),
    /// A factor on the spectrum of the white noise that depends on frequency.
    Filter(Box<dyn Noise>),
    /// A factor on the spectrum of the white noise, equal at every frequency.
    Level(Box<dyn Noise>),
    /// A factor on the whole spectrum; ln of each parameter has a normal prior about zero instead of a range.
    Shape(Box<dyn Noise>),
}

impl Kind {
    /// Whether it is exponentially correlated (Gauss-Markov) noise, whose spectrum telegraph noise has too.
    #[must_use]
    pub(crate) fn is_exponential(&self) -> bool {
        let Self::Noise(noise) = self else { return false };
        matches!(noise.state(&vec![1.0; noise.names().len()]), Some(NoiseState::Exponential { .. }))
    }
}

/// A signal with fixed shape parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SignalPart {
    /// Index of the candidate.
    pub candidate: usize,
    /// Shape (nonlinear) parameters.
    pub shape: Vec<f64>,
    /// Stored columns, one for each coefficient.
    pub columns: Vec<ColumnId>,
    /// Column added independently of the coefficients; none where the signal has none.
    pub offset: Option<ColumnId>,
    /// Prior standard deviation of each coefficient at scale one.
    pub unit: Vec<f64>,
    /// ln of the prior's scale, the factor on `unit`.
    pub ln_scale: f64,
    /// ln of the mean likelihood over shapes, relative to that of this shape.
    pub ln_shapes: f64,
}

/// A noise or filter with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoisePart {
    /// Index of the candidate.
    pub candidate: usize,
    /// Logarithms of the parameters.
    pub ln_theta: Vec<f64>,
}

/// Candidates at work together, with their parameters.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Hypothesis {
    /// Signals.
    pub signals: Vec<SignalPart>,
    /// Noises and filters.
    pub noises: Vec<NoisePart>,
    /// Logarithm of the white noise's standard deviation over the nominal one.
    pub ln_white: f64,
}

/// Prior standard deviations of the root mean square change of ln variance, equally probable.
pub(crate) const VARIANCE_STDS: [f64; 4] = [0.02, 0.06, 0.2, 0.6];
/// The same of a constant change of ln variance, the level: a small one is as probable as a small change over time, and a
/// level that was read off another unit or bandwidth may be off by ten.
pub(crate) const LEVEL_STDS: [f64; 6] = [0.02, 0.06, 0.2, 0.6, 2.0, 6.0];

impl Kind {
    /// Whether it changes how large the noise is: as a whole, or over time.
    pub(crate) fn is_level(&self) -> bool {
        matches!(self, Self::Variance(_) | Self::Shape(_) | Self::Level(_))
    }
}

impl Hypothesis {
    /// Indices of the candidates at work.
    pub(crate) fn candidates(&self) -> impl Iterator<Item = usize> + '_ {
        self.signals.iter().map(|s| s.candidate).chain(self.noises.iter().map(|n| n.candidate))
    }

    /// Columns that its signals add independently of the coefficients.
    pub(crate) fn offsets(&self) -> Vec<ColumnId> {
        self.signals.iter().filter_map(|s| s.offset).collect()
    }

    /// Numbers of the candidates at work, ascending: the set, whatever the order in which it grew.
    pub(crate) fn key(&self) -> Vec<usize> {
        let mut key: Vec<usize> = self.candidates().collect();
        key.sort_unstable();
        key
    }

    /// The same without `candidate`.
    pub(crate) fn without(&self, candidate: usize) -> Self {
        let mut rest = self.clone();
        rest.signals.retain(|s| s.candidate != candidate);
        rest.noises.retain(|n| n.candidate != candidate);
        rest
    }

    /// Number of signals and noises.
    pub(crate) fn size(&self) -> usize {
        self.signals.len() + self.noises.len()
    }

    /// Variance of the white noise in each block relative to its mean, and that mean relative to the constant variance:
    /// product over all candidates that change the variance. Empty and one where there is none.
    pub(crate) fn level(&self, frame: &SpectralBasis, candidates: &[Candidate]) -> (Vec<f64>, f64) {
        let mut ln: Vec<f64> = Vec::new();
        for part in self.noises.iter().filter(|n| matches!(candidates[n.candidate].kind, Kind::Variance(_))) {
            for (column, by) in frame.variance_columns(part.candidate).iter().zip(&part.ln_theta) {
                ln.resize(column.len(), 0.0);
                ln.iter_mut().zip(column).for_each(|(sum, v)| *sum += by * v);
            }
        }
        let mut profile: Vec<f64> = ln.into_iter().map(|v| v.clamp(-20.0, 20.0).exp()).collect();
        if profile.is_empty() {
            return (profile, 1.0);
        }
        let mean = profile.iter().sum::<f64>() / profile.len() as f64;
        profile.iter_mut().for_each(|v| *v /= mean);
        (profile, mean)
    }

    /// Spectrum in each bin, rad²/s².
    pub(crate) fn spectrum(&self, frame: &SpectralBasis, candidates: &[Candidate]) -> Vec<f64> {
        self.spectra(frame, candidates).iter().map(|[added, white]| added + white).collect()
    }

    /// Spectrum in each bin without the added noises: filtered white noise and dither, rad²/s².
    pub(crate) fn white_spectrum(&self, frame: &SpectralBasis, candidates: &[Candidate]) -> Vec<f64> {
        self.spectra(frame, candidates).iter().map(|s| s[1]).collect()
    }

    /// Spectra of the added noises and of the filtered white noise with dither, in each bin, rad²/s².
    fn spectra(&self, frame: &SpectralBasis, candidates: &[Candidate]) -> Vec<[f64; 2]> {
        let scene = &frame.scene;
        let white = scene.white_std_rad_s.powi(2) * (2.0 * self.ln_white).exp() * self.level(frame, candidates).1;
        let dither = frame.dither_variance();
        let theta: Vec<Vec<f64>> = self.noises.iter().map(|n| n.ln_theta.iter().map(|v| v.exp()).collect()).collect();
        let bands = frame.bins.bands();
        frame
            .bins
            .omega
            .iter()
            .zip(bands)
            .map(|(omega, band)| {
                let (mut total, mut filtered, mut factor) = (0.0, white, 1.0);
                for (part, theta) in self.noises.iter().zip(&theta) {
                    match &candidates[part.candidate].kind {
                        Kind::Noise(n) => total += n.mean_spectrum(scene, theta, *omega, band),
                        Kind::Filter(n) | Kind::Level(n) => filtered *= n.spectrum(scene, theta, *omega),
                        Kind::Shape(n) => factor *= n.spectrum(scene, theta, *omega),
                        Kind::Variance(_) | Kind::Signal(_) | Kind::Line(..) | Kind::TurnOn => {}
                    }
                }
                [factor * total, factor * filtered + dither]
            })
            .collect()
    }
}
