//! S(f) = Σ terms, all at once: joint estimation of Q, N, B, K, R and Gauss-Markov terms from a log at rest
//!
//! Maximum likelihood on the cosine coefficients of the log (`model`), where random walk and white noise are exactly independent
//! and low frequencies need no differencing; the columns of the warm-up that was fitted are integrated out, so that they
//! cost the random walk information, and no bias. Terms are chosen by evidence (`select`), intervals are profile
//! likelihood (`interval`), the fit is judged on logs drawn from the model (`goodness`), and what the log does not support is
//! refused with the length of a log that would (`advice`). The sensor's low-pass and bands of vibration shape the spectrum near the
//! sample rate (`shape`): N is that of the plateau. Wavelet moments are a second opinion (`wavelet`).
//!
//! ```
//! use gyroid::identify::terms::{TermOptions, noise_model};
//! use gyroid::math::random::Stream;
//! use gyroid::noise::TermKind;
//! use gyroid::signal::TimeAxis;
//!
//! // half an hour at 20 Hz: N = 1e-4 rad/s/√Hz, K = 1e-5 rad/s/√s
//! let (mut draw, mut bias) = (Stream::new(1, 0), 0.0);
//! let rate: Vec<f64> = (0..36_000)
//!     .map(|_| {
//!         bias += 1e-5 * 0.05_f64.sqrt() * draw.normal();
//!         bias + 1e-4 / 0.05_f64.sqrt() * draw.normal()
//!     })
//!     .collect();
//! let time = TimeAxis::Uniform { start_s: 0.0, step_s: 0.05, len: rate.len() };
//! let model = noise_model(&time, &rate, None, &TermOptions { draws: 19, ..TermOptions::default() })?;
//! let n = model.term(TermKind::AngleRandomWalk).unwrap();
//! assert!((n.estimate - 1e-4).abs() < 4.0 * n.std);
//! assert!(model.term(TermKind::RateRandomWalk).is_some());
//! # Ok::<(), gyroid::Error>(())
//! ```

mod advice;
mod drift;
mod goodness;
mod interval;
mod kept;
mod ledger;
mod model;
mod observed;
pub(super) mod plateau;
mod select;
mod shape;
mod shape_search;
mod shaped;
pub(super) mod term;
mod types;
mod views;
mod wavelet;

pub use advice::RecordingAdvice;
pub use drift::{DriftCause, Explanation};
pub use goodness::{Band, Goodness};
pub use ledger::{Ledger, LedgerEntry};
pub(crate) use observed::EvenLog;
pub use observed::SpectralLine;
pub use term::{TermEstimate, TimeEstimate};
pub use types::{NoiseModel, Refusal, SetScore, TermOptions, WarmUpInfluence, WarmUpRemoval};
pub use wavelet::WaveletFit;

use super::{Fit, FitOptions, NoiseEstimate, fit, fit_reduced};
use crate::error::{Error, ErrorKind, Result};
use crate::noise::{Deviation, TermKind};
use crate::signal::{Course, Reduced, TimeAxis};
use kept::Evidence;
use model::{Likelihood, Model, Peak};
use observed::Column;
use select::Candidate;
use shape::Shape;
use shape_search::Found;
use shaped::shaped;
use term::{estimate_of_ln, ordered};
use views::Views;

/// Estimates the noise terms of a log at rest: `values` (rad/s) at `time` (s since power-on), `temperature_c` beside them
/// where it was logged.
///
/// # Errors
/// As [`fit`]; [`ErrorKind::TooShort`] below 128 samples; [`ErrorKind::Usage`] if a limit of the options is not positive;
/// [`ErrorKind::Numeric`] if no set of terms has a mode.
pub fn noise_model(
    time: &TimeAxis,
    values: &[f64],
    temperature_c: Option<&[f64]>,
    options: &TermOptions,
) -> Result<NoiseModel> {
    check(options)?;
    let raw = EvenLog::new(time, values)?;
    let warm_up = match options.warm_up {
        WarmUpRemoval::Never => None,
        _ => Some(nuisance(fit(time, values, &FitOptions::default())?)),
    };
    let temperature = temperature_c.and_then(|t| raw.beside(time, t));
    estimate(&Evidence::Whole(raw), warm_up, temperature.as_deref(), values.len(), options)
}

/// The same of a log of which one pass kept block means and raw stretches; its times count from power-on. What is slow rests
/// on all of the log, what is fast on the stretches, as `Reduced::coarse_from` says.
///
/// # Errors
/// As [`noise_model`].
pub fn noise_model_reduced(log: &Reduced, options: &TermOptions) -> Result<NoiseModel> {
    check(options)?;
    let raw = Evidence::of(log)?;
    let warm_up = match options.warm_up {
        WarmUpRemoval::Never => None,
        _ => Some(nuisance(fit_reduced(log, &FitOptions::default())?)),
    };
    let temperature = log.coarse.temperature_c.as_deref().and_then(kept::bridged);
    estimate(&raw, warm_up, temperature.as_deref(), log.samples(), options)
}

/// The warm-up that is subtracted from a log before its noise is estimated. Where the residuals walk, it is the fit
/// with squares weighed by the walk, which agrees with the terms.
fn nuisance(mut fit: Fit) -> Fit {
    match fit.other_weighting.take() {
        Some(weighed) => *weighed,
        None => fit,
    }
}

/// The terms of `raw`; `temperature_c` is on the lattice of its slow part.
fn estimate(
    raw: &Evidence,
    warm_up: Option<Fit>,
    temperature_c: Option<&[f64]>,
    samples: usize,
    options: &TermOptions,
) -> Result<NoiseModel> {
    // what a straight line explains as well is a ramp, and is left to R
    let found = warm_up.as_ref().is_some_and(|fit| fit.warm_up_found() && fit.identifiable);
    let removed = warm_up.as_ref().filter(|_| found || options.warm_up == WarmUpRemoval::Always);
    let without = removed.map(|fit| raw.without(fit));
    let log = without.as_ref().unwrap_or(raw);
    let views = views(log, removed, options);
    let Found { shape, ln_odds } = shape_search::found(&views, &options.among);
    let all = if options.all_of_them {
        select::candidate(&views, &with_white(&options.among), &shape).into_iter().collect()
    } else {
        select::candidates(&views, &options.among, &shape)
    };
    let Some(best) = all.first() else {
        return Err(Error::new(ErrorKind::Numeric, "log", "no set of noise terms has a likelihood with a maximum")
            .hint("look at the log with gyroid inspect; give fewer terms with --terms"));
    };
    let peak = &best.peak;
    let seen = views.of(&best.kinds);
    let likelihood = Likelihood::new(seen, Model::new(&best.kinds, &best.shape));
    let terms = estimates(&views, &likelihood, best);
    let probabilities = select::probabilities(&all);
    let refused: Vec<Refusal> = options
        .among
        .iter()
        .filter(|kind| !best.kinds.contains(kind) && !best.shape.kinds().any(|k| k == **kind))
        .map(|kind| {
            if kind.shapes() {
                let odds = ln_odds[usize::from(*kind == TermKind::NarrowBandNoise)].exp();
                return Refusal::bare(*kind, odds / (1.0 + odds));
            }
            let share = all.iter().zip(&probabilities).filter(|(c, _)| c.kinds.contains(kind));
            refusal(&views, best, *kind, share.map(|s| s.1).sum())
        })
        .collect();
    let goodness = goodness::goodness(&likelihood, &peak.x, &peak.point, options.draws, options.seed);
    let walk = terms.iter().find(|t| t.id == TermKind::RateRandomWalk).map(|t| t.estimate);
    let bound = refused.iter().find(|r| r.id == TermKind::RateRandomWalk).and_then(|r| r.upper95);
    let warm_up_influence = WarmUpInfluence {
        removed: removed.is_some(),
        found,
        rate_random_walk_removed: walk.or(bound).unwrap_or(f64::NAN),
        removed_is_upper_bound: walk.is_none(),
        rate_random_walk_left_in: left_in(raw, best, options).unwrap_or(f64::NAN),
    };
    let start: Vec<_> = terms.iter().map(|t| (t.estimate.abs(), t.correlation_time_s.map(|c| c.estimate))).collect();
    // octaves of the samples know nothing of a filter or a band
    let unshaped = best.shape == Shape::default();
    let wavelet = if unshaped { wavelet::wavelet_fit(log.slow(), &best.kinds, &start) } else { None };
    let drift = match temperature_c {
        Some(temperature) => {
            drift::drift_cause(raw.slow(), temperature, &likelihood.model.kinds, &peak.x[..likelihood.model.base()])?
        }
        None => None,
    };
    let ledger = ledger::ledger(&terms, removed, options.turn_on_std_rad_s, options.horizon_s);
    let least = |value: fn(&Candidate) -> f64| all.iter().map(value).fold(f64::INFINITY, f64::min);
    let smallest_bic = least(|c| c.bic);
    let selection = all.iter().zip(&probabilities).map(|(c, p)| SetScore {
        terms: c.kinds.iter().copied().chain(c.shape.kinds()).collect(),
        ln_evidence_below_best: best.ln_evidence - c.ln_evidence,
        probability: *p,
        bic_above_best: c.bic - smallest_bic,
    });
    let (deviations, with_warm_up) = family(log, removed.map(|_| raw), &log.grid(options.per_decade));
    Ok(NoiseModel {
        correlation: correlation(&likelihood, peak),
        selection: selection.collect(),
        goodness,
        wavelet,
        deviations,
        with_warm_up,
        warm_up_influence,
        drift,
        ledger,
        lines: views.plain.lines.clone(),
        samples,
        filled: log.filled(),
        step_s: log.step_s(),
        span_s: log.span_s(),
        terms,
        refused,
        warm_up: warm_up.filter(|_| found || options.warm_up == WarmUpRemoval::Always),
    })
}

/// Whether time or temperature explains what is slow in a log at rest, beside white noise and a random walk of the bias that
/// begin at `noise`; `None` where the log is too short, or its temperature constant.
pub(super) fn drift_explained(
    time: &TimeAxis,
    values: &[f64],
    temperature_c: &[f64],
    noise: &NoiseEstimate,
) -> Result<Option<DriftCause>> {
    if values.len() < observed::FEWEST {
        return Ok(None);
    }
    let log = EvenLog::new(time, values)?;
    match log.beside(time, temperature_c) {
        Some(temperature) => explained(&log, &temperature, noise),
        None => Ok(None),
    }
}

/// The same of a log of which one pass kept block means.
pub(super) fn drift_explained_reduced(
    log: &Reduced,
    temperature: &Course,
    noise: &NoiseEstimate,
) -> Result<Option<DriftCause>> {
    match Evidence::of(log) {
        Ok(seen) => explained(seen.slow(), &temperature.values, noise),
        Err(e) if e.kind == ErrorKind::TooShort => Ok(None),
        Err(e) => Err(e),
    }
}

fn explained(log: &EvenLog, temperature_c: &[f64], noise: &NoiseEstimate) -> Result<Option<DriftCause>> {
    let white = noise.angle_random_walk_rad_sqrt_s.max(f64::MIN_POSITIVE);
    // the climb begins at a walk that the log could see: as much as the white noise leaves in its mean
    let walk = noise.rate_random_walk_rad_s_sqrt_s.max(white / log.span_s());
    drift::drift_cause(
        log,
        temperature_c,
        &[TermKind::AngleRandomWalk, TermKind::RateRandomWalk],
        &[white.ln(), walk.ln()],
    )
}

fn check(options: &TermOptions) -> Result<()> {
    let positive = [
        ("--max-frequency", options.max_frequency_hz.unwrap_or(1.0)),
        ("--horizon", options.horizon_s),
        ("--turn-on-std", options.turn_on_std_rad_s.map_or(1.0, |s| s + f64::MIN_POSITIVE)),
    ];
    match positive.iter().find(|(_, v)| !(*v > 0.0 && v.is_finite())) {
        Some((name, value)) => Err(Error::new(ErrorKind::Usage, name, format!("{value} is not positive"))),
        None => Ok(()),
    }
}

fn with_white(kinds: &[TermKind]) -> Vec<TermKind> {
    let sized = kinds.iter().copied().filter(|k| !k.shapes());
    let mut kinds: Vec<TermKind> = sized.chain([TermKind::AngleRandomWalk]).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

/// The log with the columns of the warm-up that was taken out, and a ramp's.
fn views(log: &Evidence, warm_up: Option<&Fit>, options: &TermOptions) -> Views {
    let mut columns: Vec<Column> = Vec::new();
    if let Some(fit) = warm_up {
        let model = fit.model();
        for j in [0, 2] {
            let at = Box::new(move |t: f64| model.gradient(t)[j]);
            columns.push(Column { at, changes_over_s: model.time_constant_s, std: None });
        }
    }
    columns.push(Column { at: Box::new(|t| t), changes_over_s: f64::INFINITY, std: None });
    let mut observed = log.observed(&columns);
    if let Some(limit) = options.max_frequency_hz {
        observed.cut_above(limit);
    }
    Views::new(observed)
}

/// The terms at their mode, with intervals.
fn estimates(views: &Views, likelihood: &Likelihood, best: &Candidate) -> Vec<TermEstimate> {
    let peak = &best.peak;
    let covariance = likelihood.covariance(&peak.point);
    let std = |i: usize| covariance.as_ref().map_or(f64::NAN, |c| c[(i, i)].sqrt());
    let one = |kind: TermKind| {
        let Some(at) = likelihood.model.place(kind) else {
            let (slope, std, ci95) = interval::ramp(views, &likelihood.model, peak);
            return TermEstimate::new(kind, slope, std, ci95, None);
        };
        let ends = |i: usize| interval::interval(likelihood, peak, i, std(i));
        let time =
            (kind == TermKind::GaussMarkov).then(|| estimate_of_ln(peak.x[at + 1].exp(), std(at + 1), ends(at + 1)));
        let size = peak.x[at].exp();
        let mut out = TermEstimate::new(kind, size, size * std(at), ends(at), time);
        let advice = advise(likelihood, &peak.x, kind);
        out.advice = Some(advice).filter(|a| a.longer_by_s.is_none_or(|s| s > 0.0));
        out
    };
    let shapes = shaped(likelihood, best, covariance.as_ref());
    ordered(best.kinds.iter().map(|kind| one(*kind)).chain(shapes).collect())
}

fn advise(likelihood: &Likelihood, x: &[f64], kind: TermKind) -> RecordingAdvice {
    let log = likelihood.log;
    advice::advise(&likelihood.model, x, kind, log.len, log.step_s, log.columns())
}

/// Upper bound of a term that was not chosen, estimated beside those that were, and advice on a longer log.
fn refusal(views: &Views, best: &Candidate, kind: TermKind, probability: f64) -> Refusal {
    let mut out = Refusal::bare(kind, probability);
    if kind == TermKind::RateRamp {
        let likelihood = Likelihood::new(&views.ramp, Model::new(&best.kinds, &best.shape));
        if let Some(peak) = likelihood.climb(&best.peak.x, &vec![true; best.peak.x.len()]) {
            let [slope, std] = views.slope(&peak);
            out.upper95 = Some(slope.abs() + 1.645 * std);
        }
        return out;
    }
    if kind == TermKind::GaussMarkov {
        return out;
    }
    let kinds = with_white(&best.kinds.iter().copied().chain([kind]).collect::<Vec<_>>());
    let likelihood = Likelihood::new(views.of(&kinds), Model::new(&kinds, &best.shape_at_mode()));
    let Some(mut peak) = likelihood.mode() else { return out };
    let upper = interval::upper(&likelihood, &peak, kind);
    out.upper95 = Some(upper).filter(|v| v.is_finite());
    if let (Some(at), Some(upper)) = (likelihood.model.place(kind), out.upper95) {
        // an estimate that is nothing but the floor of its range says nothing: the bound is then assumed
        if peak.x[at] < likelihood.bounds[at][0] + 2.0 || peak.x[at].exp() < 0.2 * upper {
            peak.x[at] = upper.ln();
        }
        out.advice = Some(advise(&likelihood, &peak.x, kind));
    }
    out
}

/// K of the log with its warm-up left in, beside the same terms.
fn left_in(raw: &Evidence, best: &Candidate, options: &TermOptions) -> Option<f64> {
    let views = views(raw, None, options);
    let kinds = with_white(&best.kinds.iter().copied().chain([TermKind::RateRandomWalk]).collect::<Vec<_>>());
    let likelihood = Likelihood::new(views.of(&kinds), Model::new(&kinds, &best.shape_at_mode()));
    let peak = likelihood.mode()?;
    likelihood.model.place(TermKind::RateRandomWalk).map(|at| peak.x[at].exp())
}

fn correlation(likelihood: &Likelihood, peak: &Peak) -> Vec<Vec<f64>> {
    let Some(c) = likelihood.covariance(&peak.point) else { return Vec::new() };
    let n = c.nrows();
    (0..n).map(|i| (0..n).map(|j| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()).collect()).collect()
}

type Family = (Vec<(Deviation, Vec<crate::noise::AllanPoint>)>, Vec<crate::noise::AllanPoint>);

/// The deviations of the log, the overlapping one on `grid`, the others at octaves; and the overlapping one of `raw`.
fn family(log: &Evidence, raw: Option<&Evidence>, grid: &[usize]) -> Family {
    let left_in = raw.map(|raw| raw.deviations(grid, &[Deviation::Overlapping]).swap_remove(0).1);
    (log.deviations(grid, &Deviation::ALL), left_in.unwrap_or_default())
}
