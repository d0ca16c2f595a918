//! The search for the shape near the sample rate: the low-pass and the bands that a log supports
//!
//! Forms and the number of bands are found before the other terms are chosen, beside N, B and K, by the evidence of `select`: first
//! the low-pass, then one band after the other where most power is left, then the low-pass once more, which a band may have
//! hidden. All their parameters stay free in every set of terms after that.

use super::model::Peak;
use super::observed::Observed;
use super::select::{Candidate, candidate};
use super::shape::Shape;
use super::views::Views;
use crate::noise::{BandForm, LowPass, TermKind};

/// Bands at most: a line that is not of one of the two forms takes several.
const MOST_BANDS: usize = 4;

/// Cutoffs that are tried first, as parts of the sample rate.
const CUTOFFS: [f64; 4] = [0.03, 0.12, 0.3, 0.48];

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
