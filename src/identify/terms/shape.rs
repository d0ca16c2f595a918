//! Shape of the spectrum near the sample rate: the sensor's low-pass, and bands of vibration
//!
//! N is that of the plateau, N² |H(f)|² what is seen. Parameters are ln f_c, and ln f₀, ln Δ and ln σ of each band.

use super::observed::Observed;
use crate::noise::{BandForm, LowPass, TermKind};

/// Step of derivatives by logarithms of frequencies and widths.
const STEP: f64 = 1e-4;

/// Forms, and where their parameters begin.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Shape {
    pub low_pass: Option<LowPass>,
    pub bands: Vec<BandForm>,
    /// Parameters to begin with.
    pub start: Vec<f64>,
}

/// A part of the spectrum and its derivatives.
pub(super) struct Part {
    pub value: Vec<f64>,
    pub slopes: Vec<Vec<f64>>,
}

impl Shape {
    pub(crate) fn parameters(&self) -> usize {
        usize::from(self.low_pass.is_some()) + 3 * self.bands.len()
    }

    /// Parameters of the bands begin after that of the low-pass.
    pub(super) fn first_band(&self) -> usize {
        usize::from(self.low_pass.is_some())
    }

    /// Whether the parameter is the size of a band.
    pub(crate) fn is_size(&self, i: usize) -> bool {
        i >= self.first_band() && (i - self.first_band()) % 3 == 2
    }

    /// |H|² and its derivative by ln f_c; `None` without a low-pass.
    pub(crate) fn gain(&self, x: &[f64], step_s: f64, omega: &[f64]) -> Option<Part> {
        let form = self.low_pass?;
        let at = |h: f64| form.powers((x[0] + h).exp(), step_s, omega);
        let slope = at(STEP).iter().zip(at(-STEP)).map(|(u, d)| (u - d) / (2.0 * STEP)).collect();
        Some(Part { value: at(0.0), slopes: vec![slope] })
    }

    /// The part of each band and its derivatives.
    pub(crate) fn bands<'a>(&'a self, x: &'a [f64], step_s: f64, omega: &'a [f64]) -> impl Iterator<Item = Part> + 'a {
        self.bands.iter().zip(x[self.first_band()..].chunks_exact(3)).map(move |(form, p)| {
            let square = (2.0 * p[2]).exp();
            let at = |center: f64, width: f64| form.unit((p[0] + center).exp(), (p[1] + width).exp(), step_s, omega);
            let by = |up: Vec<f64>, down: Vec<f64>| -> Vec<f64> {
                up.iter().zip(&down).map(|(u, d)| square * (u - d) / (2.0 * STEP)).collect()
            };
            // of a line that is a hundredth of its frequency wide, a step must stay within the line
            let value: Vec<f64> = at(0.0, 0.0).iter().map(|u| square * u).collect();
            let slopes = vec![
                by(at(STEP, 0.0), at(-STEP, 0.0)),
                by(at(0.0, STEP), at(0.0, -STEP)),
                value.iter().map(|v| 2.0 * v).collect(),
            ];
            Part { value, slopes }
        })
    }

    /// Bounds of the parameters.
    pub(crate) fn bounds(&self, log: &Observed) -> Vec<[f64; 2]> {
        let low_pass = self.low_pass.map(|form| form.range_hz(log.step_s, log.span_s()));
        let band = [log.center_range_hz(), log.width_range_hz(), log.range(TermKind::NarrowBandNoise)];
        let all = low_pass.into_iter().chain(self.bands.iter().flat_map(|_| band));
        all.map(|b| b.map(f64::ln)).collect()
    }

    /// ln of the prior probability of the forms: each is as probable as another.
    pub(crate) fn ln_prior(&self) -> f64 {
        let forms = |n: usize| -(n as f64).ln();
        self.low_pass.map_or(0.0, |_| forms(LowPass::ALL.len())) + self.bands.len() as f64 * forms(BandForm::ALL.len())
    }

    /// The terms that it stands for, one for each band.
    pub(crate) fn kinds(&self) -> impl Iterator<Item = TermKind> + '_ {
        let low_pass = self.low_pass.map(|_| TermKind::Bandwidth);
        low_pass.into_iter().chain(self.bands.iter().map(|_| TermKind::NarrowBandNoise))
    }

    pub(super) fn with_low_pass(&self, form: LowPass, cutoff_hz: f64) -> Self {
        let bands = &self.start[self.first_band()..];
        Self { low_pass: Some(form), start: [&[cutoff_hz.ln()][..], bands].concat(), ..self.clone() }
    }

    pub(super) fn with_band(&self, form: BandForm, band: [f64; 3]) -> Self {
        let mut out = self.clone();
        out.bands.push(form);
        out.start.extend(band.map(f64::ln));
        out
    }
}
