//! The noise terms of each of many logs: one row a log, gyro and axis, and how much each term differs from log to log
//!
//! ```text
//! ln s_i ~ N(μ, (σ_i/s_i)² + τ²)      s_i the size of a term in log i, σ_i its standard deviation
//! ```

use super::run::Analysis;
use super::source::{Kind, Record, Source};
use crate::error::Result;
use crate::identify::terms::{NoiseModel, TermOptions, WarmUpRemoval, noise_model};
use crate::ingest::GyroRecording;
use crate::math::random_effects::{Observed, spread};
use crate::noise::TermKind;
use crate::signal::{TimeAxis, names};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// One log, gyro and axis with its noise terms. SI throughout, the unit in the name.
///
/// Of a term that the log supports its size and standard deviation; `*_upper95_*` is the upper end of its 95 % interval, or, of a term that the
/// log does not support, the size that it would have had to have at most.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct NoiseRow {
    /// The log, and options of the reader and the estimate.
    #[serde(flatten)]
    pub source: Source,
    /// The terms explain the log.
    pub fits: Option<bool>,
    /// P value of the goodness of fit.
    pub goodness_p_value: Option<f64>,
    /// Samples.
    pub samples: Option<i64>,
    /// Samples a second.
    pub sample_rate_hz: Option<f64>,
    /// Length, s.
    pub span_s: Option<f64>,
    /// The terms that the log supports, by letter: `N,K`.
    pub terms: Option<String>,
    /// Q.
    pub quantization_rad: Option<f64>,
    pub quantization_std_rad: Option<f64>,
    pub quantization_upper95_rad: Option<f64>,
    /// N.
    pub angle_random_walk_rad_sqrt_s: Option<f64>,
    pub angle_random_walk_std_rad_sqrt_s: Option<f64>,
    pub angle_random_walk_upper95_rad_sqrt_s: Option<f64>,
    /// B.
    pub bias_instability_rad_s: Option<f64>,
    pub bias_instability_std_rad_s: Option<f64>,
    pub bias_instability_upper95_rad_s: Option<f64>,
    /// K.
    pub rate_random_walk_rad_s_sqrt_s: Option<f64>,
    pub rate_random_walk_std_rad_s_sqrt_s: Option<f64>,
    pub rate_random_walk_upper95_rad_s_sqrt_s: Option<f64>,
    /// R.
    pub rate_ramp_rad_s2: Option<f64>,
    pub rate_ramp_std_rad_s2: Option<f64>,
    pub rate_ramp_upper95_rad_s2: Option<f64>,
    /// σ of the Gauss-Markov noise.
    pub gauss_markov_rad_s: Option<f64>,
    pub gauss_markov_std_rad_s: Option<f64>,
    pub gauss_markov_upper95_rad_s: Option<f64>,
    /// Its correlation time.
    pub gauss_markov_correlation_time_s: Option<f64>,
    /// Half-power frequency of the sensor's low-pass.
    pub bandwidth_hz: Option<f64>,
    pub bandwidth_std_hz: Option<f64>,
    pub bandwidth_upper95_hz: Option<f64>,
    /// σ of the noise in a band.
    pub narrow_band_noise_rad_s: Option<f64>,
    pub narrow_band_noise_std_rad_s: Option<f64>,
    pub narrow_band_noise_upper95_rad_s: Option<f64>,
    /// Terms and refused ones with all that `gyroid noise --json` says of them, as JSON.
    pub details: Option<String>,
    /// Guesses, omissions and oddities, joined by `; `.
    pub notes: Option<String>,
}

impl Record for NoiseRow {
    const COMMAND: &'static str = "noise";
    const TYPES: &'static [(&'static str, Kind)] = &[
        ("fits", Kind::Flag),
        ("samples", Kind::Whole),
        ("terms", Kind::Text),
        ("details", Kind::Text),
        ("notes", Kind::Text),
    ];

    fn source(&self) -> &Source {
        &self.source
    }

    fn source_mut(&mut self) -> &mut Source {
        &mut self.source
    }
}

impl NoiseRow {
    /// Size, standard deviation and upper end of a term.
    fn of_term(&mut self, kind: TermKind) -> [&mut Option<f64>; 3] {
        macro_rules! three {
            ($($name:ident),+) => { [$(&mut self.$name),+] };
        }
        match kind {
            TermKind::Quantization => three!(quantization_rad, quantization_std_rad, quantization_upper95_rad),
            TermKind::AngleRandomWalk => three!(
                angle_random_walk_rad_sqrt_s,
                angle_random_walk_std_rad_sqrt_s,
                angle_random_walk_upper95_rad_sqrt_s
            ),
            TermKind::BiasInstability => {
                three!(bias_instability_rad_s, bias_instability_std_rad_s, bias_instability_upper95_rad_s)
            }
            TermKind::RateRandomWalk => three!(
                rate_random_walk_rad_s_sqrt_s,
                rate_random_walk_std_rad_s_sqrt_s,
                rate_random_walk_upper95_rad_s_sqrt_s
            ),
            TermKind::RateRamp => three!(rate_ramp_rad_s2, rate_ramp_std_rad_s2, rate_ramp_upper95_rad_s2),
            TermKind::GaussMarkov => three!(gauss_markov_rad_s, gauss_markov_std_rad_s, gauss_markov_upper95_rad_s),
            TermKind::Bandwidth => three!(bandwidth_hz, bandwidth_std_hz, bandwidth_upper95_hz),
            TermKind::NarrowBandNoise => {
                three!(narrow_band_noise_rad_s, narrow_band_noise_std_rad_s, narrow_band_noise_upper95_rad_s)
            }
        }
    }

    /// Size, standard deviation and upper end of a term, where they are known.
    #[must_use]
    pub(crate) fn term(&self, kind: TermKind) -> [Option<f64>; 3] {
        self.clone().of_term(kind).map(|value| *value)
    }

    fn fill(&mut self, recording: &GyroRecording, model: &NoiseModel, level: f64) {
        let known = |value: f64| value.is_finite().then_some(value);
        self.fits = Some(model.goodness.p_value >= level);
        self.goodness_p_value = known(model.goodness.p_value);
        self.samples = i64::try_from(model.samples).ok();
        self.sample_rate_hz = known(1.0 / model.step_s);
        self.span_s = known(model.span_s);
        let letters: Vec<&str> = model.terms.iter().map(|t| t.id.symbol()).collect();
        self.terms = Some(letters.join(","));
        for term in &model.terms {
            let [size, std, upper] = self.of_term(term.id);
            (*size, *std, *upper) = (known(term.estimate), known(term.std), known(term.ci95[1]));
        }
        for refused in &model.refused {
            *self.of_term(refused.id)[2] = refused.upper95.and_then(known);
        }
        let gauss_markov = model.term(TermKind::GaussMarkov);
        self.gauss_markov_correlation_time_s = gauss_markov.and_then(|t| known(t.correlation_time_s?.estimate));
        self.details = Some(json!({ "terms": model.terms, "refused": model.refused }).to_string());
        let notes: Vec<String> = recording.notes.iter().cloned().chain(recording.audit.findings()).collect();
        self.notes = (!notes.is_empty()).then(|| notes.join("; "));
    }
}

/// How the noise of the logs is estimated: all alike.
#[derive(Debug, Clone)]
pub(crate) struct NoiseTerms {
    pub options: TermOptions,
    /// Probability at which a model that fits is called unfit.
    pub level: f64,
}

impl Analysis for NoiseTerms {
    type Row = NoiseRow;

    fn options(&self) -> Vec<(&'static str, Value)> {
        let (options, usual) = (&self.options, TermOptions::default());
        let among: Vec<&str> = options.among.iter().map(|k| k.symbol()).collect();
        let warm_up = match options.warm_up {
            WarmUpRemoval::Found => None,
            WarmUpRemoval::Always => Some("always"),
            WarmUpRemoval::Never => Some("never"),
        };
        vec![
            ("terms", json!((options.among != usual.among).then_some(among))),
            ("all_of_them", json!(options.all_of_them.then_some(true))),
            ("warm_up", json!(warm_up)),
            ("max_frequency_hz", json!(options.max_frequency_hz)),
            ("draws", json!(Some(options.draws).filter(|v| *v != usual.draws))),
            ("seed", json!(Some(options.seed).filter(|v| *v != usual.seed))),
            ("turn_on_std_rad_s", json!(options.turn_on_std_rad_s)),
            ("level", json!(self.level)),
        ]
    }

    fn fill(&self, row: &mut NoiseRow, recording: &GyroRecording, time: &TimeAxis, rate: &[f64]) -> Result<()> {
        let model = noise_model(time, rate, recording.log.get(names::TEMPERATURE), &self.options)?;
        row.fill(recording, &model, self.level);
        Ok(())
    }
}

/// A term over the logs of an axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TermPopulation {
    pub id: TermKind,
    /// SI unit of the size.
    pub unit: &'static str,
    /// Logs that support it.
    pub found: usize,
    /// Geometric mean of its size over them, and its 95 % interval; unknown for fewer than two.
    pub mean: Option<f64>,
    pub mean_ci95: Option<[f64; 2]>,
    /// Standard deviation of ln size from log to log, net of the logs' own errors, and its 95 % interval.
    pub relative_spread: Option<f64>,
    pub relative_spread_ci95: Option<[f64; 2]>,
    /// Probability of such differences if there were no spread.
    pub p_value: Option<f64>,
}

/// The terms over the logs of one gyro and axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct NoisePopulation {
    pub topic: Option<String>,
    pub axis: String,
    /// Logs whose noise was estimated.
    pub logs: usize,
    /// Of them, those that their terms explain.
    pub fitting: usize,
    /// Terms that a log supports.
    pub terms: Vec<TermPopulation>,
}

/// The populations of `rows`, one a topic and axis. A file that is there twice counts once.
#[must_use]
pub(crate) fn noise_populations(rows: &[NoiseRow]) -> Vec<NoisePopulation> {
    let mut gyros: BTreeMap<(&Option<String>, &str), BTreeMap<&str, &NoiseRow>> = BTreeMap::new();
    for row in rows.iter().filter(|r| r.source.error.is_none()) {
        let of_gyro = gyros.entry((&row.source.topic, &row.source.axis)).or_default();
        of_gyro.entry(&row.source.sha256).or_insert(row);
    }
    let one = |((topic, axis), rows): ((&Option<String>, &str), BTreeMap<&str, &NoiseRow>)| {
        let of_term = |kind: &TermKind| term_population(*kind, &rows);
        NoisePopulation {
            topic: topic.clone(),
            axis: axis.to_string(),
            logs: rows.len(),
            fitting: rows.values().filter(|r| r.fits == Some(true)).count(),
            terms: TermKind::ALL.iter().map(of_term).filter(|t| t.found > 0).collect(),
        }
    };
    gyros.into_iter().map(one).collect()
}

fn term_population(id: TermKind, rows: &BTreeMap<&str, &NoiseRow>) -> TermPopulation {
    let size = |row: &&NoiseRow| {
        let [size, std, _] = row.term(id);
        Some((size?.abs(), std?))
    };
    let sizes: Vec<(f64, f64)> = rows.values().filter_map(size).filter(|(size, _)| *size > 0.0).collect();
    let observed: Vec<_> = sizes.iter().map(|(size, std)| Observed::number(size.ln(), std / size)).collect();
    let s = spread(&observed);
    let ends = |s: &crate::math::random_effects::Spread<1>| {
        let (mean, half) = (s.mean[0], s.mean_half_width[0]);
        [(mean - half).exp(), (mean + half).exp()]
    };
    TermPopulation {
        id,
        unit: id.unit(),
        found: sizes.len(),
        mean: s.map(|s| s.mean[0].exp()),
        mean_ci95: s.as_ref().map(ends),
        relative_spread: s.map(|s| s.std),
        relative_spread_ci95: s.map(|s| s.ci95),
        p_value: s.map(|s| s.p_value),
    }
}
