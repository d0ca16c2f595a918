//! Shape of the spectrum near the sample rate: the sensor's low-pass, and bands of vibration
//!
//! N is that of the plateau, N² |H(f)|² what is seen. Parameters are ln f_c, and ln f₀, ln Δ and ln σ of each band. Forms and
//! the number of bands are found before the other terms are chosen, beside N, B and K, by the evidence of `select`: first the
//! low-pass, then one band after the other where most power is left, then the low-pass once more, which a band may have
//! hidden. All their parameters stay free in every set of terms after that.

use super::model::{Model, Peak};
use super::observed::Observed;
use super::select::{Candidate, Views, candidate};
use crate::noise::{BandForm, LowPass, TermKind};

/// Bands at most: a line that is not of one of the two forms takes several.
const MOST_BANDS: usize = 4;
/// Step of derivatives by logarithms of frequencies and widths.
const STEP: f64 = 1e-4;
/// Cutoffs that are tried first, as parts of the sample rate.
const CUTOFFS: [f64; 4] = [0.03, 0.12, 0.3, 0.48];

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
    fn first_band(&self) -> usize {
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

    fn with_low_pass(&self, form: LowPass, cutoff_hz: f64) -> Self {
        let bands = &self.start[self.first_band()..];
        Self { low_pass: Some(form), start: [&[cutoff_hz.ln()][..], bands].concat(), ..self.clone() }
    }

    fn with_band(&self, form: BandForm, band: [f64; 3]) -> Self {
        let mut out = self.clone();
        out.bands.push(form);
        out.start.extend(band.map(f64::ln));
        out
    }
}

/// The shape that was chosen, and ln of the odds of a low-pass and of one more band.
#[derive(Debug, Clone, Default)]
pub(super) struct Found {
    pub shape: Shape,
    pub ln_odds: [f64; 2],
}

/// The shape that the log supports, of the terms in `among`.
pub(super) fn found(views: &Views, among: &[TermKind]) -> Found {
    let base: Vec<TermKind> = [TermKind::AngleRandomWalk, TermKind::BiasInstability, TermKind::RateRandomWalk]
        .into_iter()
        .filter(|k| *k == TermKind::AngleRandomWalk || among.contains(k))
        .collect();
    let mut search = Search { views, base, odds: [f64::NEG_INFINITY; 2], best: None };
    search.best = candidate(views, &search.base, &Shape::default());
    // a rounded angle has most of its power near half the sample rate, where it is no band
    if among.contains(&TermKind::Quantization) {
        let quantised = [&search.base[..], &[TermKind::Quantization]].concat();
        let other = candidate(views, &quantised, &Shape::default());
        let ln_evidence = |c: &Option<Candidate>| c.as_ref().map_or(f64::NEG_INFINITY, |c| c.ln_evidence);
        if ln_evidence(&other) > ln_evidence(&search.best) {
            (search.base, search.best) = (quantised, other);
        }
    }
    let (filters, bands) = (among.contains(&TermKind::Bandwidth), among.contains(&TermKind::NarrowBandNoise));
    if filters {
        search.low_pass();
    }
    if bands {
        while search.best.as_ref().is_some_and(|b| b.shape.bands.len() < MOST_BANDS) && search.band() {}
    }
    if filters && search.best.as_ref().is_some_and(|b| !b.shape.bands.is_empty()) {
        search.low_pass();
        search.without_low_pass();
    }
    let (ln_odds, best) = (search.odds, search.best);
    let Some(best) = best else { return Found::default() };
    Found { shape: best.shape_at_mode(), ln_odds }
}

struct Search<'a> {
    views: &'a Views,
    base: Vec<TermKind>,
    odds: [f64; 2],
    best: Option<Candidate>,
}

impl Search<'_> {
    /// The shape at the best set's mode.
    fn now(&self) -> Option<(Shape, f64)> {
        self.best.as_ref().map(|best| (best.shape_at_mode(), best.ln_evidence))
    }

    /// The most probable of `shapes` in place of the best, if it is more probable; ln of its odds.
    fn improve(&mut self, shapes: Vec<Shape>) -> f64 {
        let Some((_, before)) = self.now() else { return f64::NEG_INFINITY };
        let tried = shapes.iter().filter_map(|s| candidate(self.views, &self.base, s));
        let Some(top) = tried.max_by(|a, b| a.ln_evidence.total_cmp(&b.ln_evidence)) else { return f64::NEG_INFINITY };
        let odds = top.ln_evidence - before;
        if odds > 0.0 {
            self.best = Some(top);
        }
        odds
    }

    /// Tries every form of low-pass, from several cutoffs.
    fn low_pass(&mut self) {
        let Some((now, _)) = self.now() else { return };
        let rate_hz = 1.0 / self.views.plain.step_s;
        let had = now.low_pass.is_some();
        let shapes = LowPass::ALL.iter().flat_map(|form| CUTOFFS.map(|c| now.with_low_pass(*form, c * rate_hz)));
        let odds = self.improve(shapes.collect());
        if !had {
            self.odds[0] = odds;
        }
    }

    /// Drops a low-pass that stood for the bands found after it.
    fn without_low_pass(&mut self) {
        let Some((now, _)) = self.now() else { return };
        if now.low_pass.is_some() {
            let start = now.start[now.first_band()..].to_vec();
            self.odds[0] = -self.improve(vec![Shape { low_pass: None, start, ..now }]);
        }
    }

    /// Tries one more band where most power is left; whether there is one.
    fn band(&mut self) -> bool {
        let (Some((now, _)), Some(best)) = (self.now(), &self.best) else { return false };
        let Some(start) = excess(&self.views.plain, &best.peak) else { return false };
        let odds = self.improve(BandForm::ALL.map(|form| now.with_band(form, start)).to_vec());
        self.odds[1] = odds;
        odds > 0.0
    }
}

/// Centre, width and size of the band of frequencies whose power is most improbable under `peak`.
fn excess(log: &Observed, peak: &Peak) -> Option<[f64; 3]> {
    let [low, high] = log.center_range_hz();
    let [_, widest] = log.width_range_hz();
    let bins: Vec<usize> = (0..log.k.len())
        .filter(|b| log.count[*b] > 0.0 && log.frequency_hz(*b) >= low && log.frequency_hz(*b) <= high)
        .collect();
    let mut best: Option<(f64, [f64; 3])> = None;
    for (first, from) in bins.iter().enumerate() {
        let (mut count, mut sum, mut power) = (0.0, 0.0, 0.0);
        for bin in &bins[first..] {
            let width = log.frequency_hz(*bin) - log.frequency_hz(*from);
            if width > widest {
                break;
            }
            count += log.count[*bin];
            sum += peak.point.left[*bin] / peak.point.spectrum[*bin];
            power += peak.point.left[*bin] - log.count[*bin] * peak.point.spectrum[*bin];
            let ratio = sum / count;
            let gain = 0.5 * count * (ratio - 1.0 - ratio.ln());
            if ratio > 1.0 && best.is_none_or(|b| gain > b.0) {
                let center = 0.5 * (log.frequency_hz(*from) + log.frequency_hz(*bin));
                let [thinnest, _] = log.width_range_hz();
                // of kept stretches there are fewer coefficients than the log has
                let whole = 2.0 * log.span_s() * (width + log.bin_width_hz(*bin));
                let std = (power.max(0.0) / count * whole / log.len as f64).sqrt();
                best = Some((gain, [center, (0.6 * width).max(1.1 * thinnest), std]));
            }
        }
    }
    best.map(|b| b.1).filter(|b| b[2] > 0.0)
}

/// Share of the power that bands make, by bins.
pub(super) fn share_of_bands(model: &Model, x: &[f64], log: &Observed, spectrum: &[f64]) -> Vec<f64> {
    let mut made = vec![0.0; spectrum.len()];
    let omega = log.omega();
    for part in model.shape.bands(&x[model.base()..], log.step_s, &omega) {
        made.iter_mut().zip(&part.value).for_each(|(m, v)| *m += v);
    }
    made.iter().zip(spectrum).map(|(m, s)| m / s).collect()
}
