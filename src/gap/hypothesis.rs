//! A hypothesis: which candidates are at work in the slow and coloured part of a recording, with their parameters.

use super::frame::{ColumnId, Frame};
use crate::effects::{Noise, NoiseState, Signal};

/// What may be at work.
pub struct Candidate {
    /// Identifier of the effect or the free form.
    pub id: String,
    /// Whether it is an effect of the library (else a free form, which stands for 'unknown').
    pub named: bool,
    /// How it enters.
    pub kind: Kind,
}

/// How a candidate enters the Gaussian likelihood.
pub enum Kind {
    /// Columns with coefficients.
    Signal(Box<dyn Signal>),
    /// ln variance of the white noise by columns, with a normal prior of the coefficients.
    Variance(Box<dyn Signal>),
    /// Columns of something periodic of so many harmonics, at full rate; its frequency is searched in the periodogram.
    Line(Box<dyn Signal>, usize),
    /// C2 anywhere.
    TurnOn,
    /// A spectrum added.
    Noise(Box<dyn Noise>),
    /// A factor on the white noise's spectrum.
    Filter(Box<dyn Noise>),
    /// The same factor at every frequency.
    Level(Box<dyn Noise>),
    /// A factor on the whole spectrum, with a normal prior of the parameters around null instead of a range.
    Shape(Box<dyn Noise>),
}

impl Kind {
    /// Whether it is exponentially correlated noise: what two levels look like to whoever sees the spectrum alone.
    #[must_use]
    pub fn is_exponential(&self) -> bool {
        let Self::Noise(noise) = self else { return false };
        matches!(noise.state(&vec![1.0; noise.names().len()]), Some(NoiseState::Exponential { .. }))
    }
}

/// A signal at one shape.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalPart {
    /// Number of the candidate.
    pub candidate: usize,
    /// Nonlinear parameters.
    pub shape: Vec<f64>,
    /// Columns.
    pub columns: Vec<ColumnId>,
    /// What it adds whatever the coefficients are.
    pub offset: Option<ColumnId>,
    /// Prior standard deviation of each coefficient at scale one.
    pub unit: Vec<f64>,
    /// Logarithm of the prior's scale.
    pub ln_scale: f64,
    /// ln of the mean over shapes of the likelihood, relative to this shape's.
    pub ln_shapes: f64,
}

/// A noise or filter with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct NoisePart {
    /// Number of the candidate.
    pub candidate: usize,
    /// Logarithms of the parameters.
    pub ln_theta: Vec<f64>,
}

/// Candidates at work together.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Hypothesis {
    /// Signals.
    pub signals: Vec<SignalPart>,
    /// Noises and filters.
    pub noises: Vec<NoisePart>,
    /// Logarithm of the white noise's standard deviation over the nominal one.
    pub ln_white: f64,
}

/// Standard deviations of ln variance, root mean square, that the prior holds equally probable.
pub const VARIANCE_STDS: [f64; 4] = [0.02, 0.06, 0.2, 0.6];

impl Kind {
    /// Whether it changes how large the noise is: as a whole, or over time.
    pub fn is_level(&self) -> bool {
        matches!(self, Self::Variance(_) | Self::Shape(_) | Self::Level(_))
    }
}

impl Hypothesis {
    /// Numbers of the candidates at work.
    pub fn candidates(&self) -> impl Iterator<Item = usize> + '_ {
        self.signals.iter().map(|s| s.candidate).chain(self.noises.iter().map(|n| n.candidate))
    }

    /// What its signals add whatever the coefficients are.
    pub fn offsets(&self) -> Vec<ColumnId> {
        self.signals.iter().filter_map(|s| s.offset).collect()
    }

    /// Whether `candidate` is at work.
    pub fn holds(&self, candidate: usize) -> bool {
        self.candidates().any(|c| c == candidate)
    }

    /// The same without `candidate`.
    pub fn without(&self, candidate: usize) -> Self {
        let mut rest = self.clone();
        rest.signals.retain(|s| s.candidate != candidate);
        rest.noises.retain(|n| n.candidate != candidate);
        rest
    }

    /// Number of parts.
    pub fn size(&self) -> usize {
        self.signals.len() + self.noises.len()
    }

    /// Factor on the variance of the white noise in each block over its mean, and that mean: of all that makes it vary together. Empty
    /// and one where nothing does.
    pub fn level(&self, frame: &Frame, candidates: &[Candidate]) -> (Vec<f64>, f64) {
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
    pub fn spectrum(&self, frame: &Frame, candidates: &[Candidate]) -> Vec<f64> {
        self.spectra(frame, candidates).iter().map(|[added, white]| added + white).collect()
    }

    /// What is left of the spectrum in each bin without the noises that are added: the white noise, filtered, rad²/s².
    pub fn white_spectrum(&self, frame: &Frame, candidates: &[Candidate]) -> Vec<f64> {
        self.spectra(frame, candidates).iter().map(|s| s[1]).collect()
    }

    /// Added noises, and the white noise with its filters, in each bin.
    fn spectra(&self, frame: &Frame, candidates: &[Candidate]) -> Vec<[f64; 2]> {
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
