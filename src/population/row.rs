//! One log, gyro and axis as a row of the results.

use super::axis::AxisChoice;
use crate::error::Error;
use crate::identify::{Estimate, Fit, Termination};
use crate::ingest::{Clock, DATES_S, GyroRecording};
use crate::signal::names;
use crate::validate::Validation;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// One log, gyro and axis: source, options of the reader, and the results of the fit, or its error.
///
/// SI throughout, the unit in the name. `None` (null, an empty cell) is an unknown value: all of a fit that failed, and
/// bounds that the log does not set. `*_std_*` allow for autocorrelated residuals, `*_std_white_*` do not; intervals
/// are profile likelihood.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Row {
    /// Path as it was given, or found in a folder that was.
    pub path: String,
    /// Topic that was asked for, in a log that holds several.
    pub topic: Option<String>,
    /// `x`, `y`, `z`, or `-x`, `-y`, `-z` of one that points the other way.
    pub axis: String,
    /// Column that was fitted, as the file calls it.
    pub column: Option<String>,
    /// Its unit in the file.
    pub unit: Option<String>,
    /// SHA-256 of the file; empty where it could not be read.
    pub sha256: String,
    /// Its size, bytes.
    pub size_bytes: Option<i64>,
    /// When it was last changed, ISO 8601, UTC.
    pub modified: Option<String>,
    /// First sample by the file's clock, ISO 8601, UTC; unknown where the clock tells no date.
    pub started: Option<String>,
    /// Version of gyroid.
    pub gyroid_version: String,
    /// Options of reading, fit and validation that are not defaults, as JSON.
    pub options: String,
    /// Why there is no fit.
    pub error: Option<String>,
    /// Warm-up found, T identifiable, residuals white.
    pub fit_for_use: Option<bool>,
    /// The warm-up beats a constant at the 5 % level.
    pub warm_up_found: Option<bool>,
    /// The interval of T is finite.
    pub identifiable: Option<bool>,
    /// The residuals are white at every averaging time.
    pub white: Option<bool>,
    /// Samples.
    pub samples: Option<i64>,
    /// Samples a second.
    pub sample_rate_hz: Option<f64>,
    /// First time since power-on, s.
    pub first_s: Option<f64>,
    /// Last time less first, s.
    pub span_s: Option<f64>,
    /// C1.
    pub c1_rad_s: Option<f64>,
    /// Its standard deviation; 0 where it was given.
    pub c1_std_rad_s: Option<f64>,
    /// The classical one.
    pub c1_std_white_rad_s: Option<f64>,
    /// Lower end of its 95 % interval.
    pub c1_ci95_low_rad_s: Option<f64>,
    /// Upper end.
    pub c1_ci95_high_rad_s: Option<f64>,
    /// C2.
    pub c2_rad_s: Option<f64>,
    /// Its standard deviation; 0 where it was given.
    pub c2_std_rad_s: Option<f64>,
    /// The classical one.
    pub c2_std_white_rad_s: Option<f64>,
    /// Lower end of its 95 % interval.
    pub c2_ci95_low_rad_s: Option<f64>,
    /// Upper end.
    pub c2_ci95_high_rad_s: Option<f64>,
    /// The part of C2 that is the Earth's rotation, where the latitude was stated.
    pub earth_rate_rad_s: Option<f64>,
    /// T.
    pub time_constant_s: Option<f64>,
    /// Its standard deviation; 0 where it was given.
    pub time_constant_std_s: Option<f64>,
    /// The classical one.
    pub time_constant_std_white_s: Option<f64>,
    /// Lower end of its 95 % interval.
    pub time_constant_ci95_low_s: Option<f64>,
    /// Upper end.
    pub time_constant_ci95_high_s: Option<f64>,
    /// cov(C1, C2), rad²/s².
    pub c1_c2_covariance_rad2_s2: Option<f64>,
    /// cov(C1, T).
    pub c1_time_constant_covariance_rad: Option<f64>,
    /// cov(C2, T).
    pub c2_time_constant_covariance_rad: Option<f64>,
    /// N.
    pub angle_random_walk_rad_sqrt_s: Option<f64>,
    /// Probability of a random walk of the bias.
    pub rate_random_walk_probability: Option<f64>,
    /// K.
    pub rate_random_walk_rad_s_sqrt_s: Option<f64>,
    /// K is below this with 95 % probability.
    pub rate_random_walk_upper95_rad_s_sqrt_s: Option<f64>,
    /// Standard deviation of the residuals, rad/s.
    pub residual_std_rad_s: Option<f64>,
    /// Samples less free parameters.
    pub degrees_of_freedom: Option<f64>,
    /// P value of the warm-up against a constant.
    pub warm_up_p_value: Option<f64>,
    /// Joint p value of whiteness at all averaging times.
    pub whiteness_p_value: Option<f64>,
    /// Level at which it was judged.
    pub whiteness_level: Option<f64>,
    /// The smallest calibrated p value at each averaging time, as JSON: `{"1": 0.4, "10": 0.2}`, times in s.
    pub whiteness_p_values: Option<String>,
    /// Why the search ended.
    pub termination: Option<String>,
    /// Lowest temperature, °C.
    pub temperature_low_c: Option<f64>,
    /// Highest temperature, °C.
    pub temperature_high_c: Option<f64>,
    /// Guesses, omissions and oddities, joined by `; `.
    pub notes: Option<String>,
}

/// Type of a column, for files that have types.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Text,
    Flag,
    Whole,
    Number,
}

impl Kind {
    /// The type of the column called `name`.
    pub(crate) fn of(name: &str) -> Self {
        const TEXT: [&str; 14] = [
            "path",
            "topic",
            "axis",
            "column",
            "unit",
            "sha256",
            "modified",
            "started",
            "gyroid_version",
            "options",
            "error",
            "whiteness_p_values",
            "termination",
            "notes",
        ];
        const FLAGS: [&str; 4] = ["fit_for_use", "warm_up_found", "identifiable", "white"];
        match name {
            n if TEXT.contains(&n) => Self::Text,
            n if FLAGS.contains(&n) => Self::Flag,
            "size_bytes" | "samples" => Self::Whole,
            _ => Self::Number,
        }
    }
}

/// Time of the first sample; none where the file's clock tells no date of this century.
fn started(clock: &Clock) -> Option<Timestamp> {
    let Clock::FirstSample { file_s } = *clock else { return None };
    // milliseconds: a double holds no more than microseconds of today's Unix time
    DATES_S.contains(&file_s).then(|| Timestamp::from_millisecond((file_s * 1e3).round() as i64).ok()).flatten()
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl Row {
    /// A row of which only the file is known yet.
    pub(super) fn of_file(path: &Path, topic: Option<&str>, axis: AxisChoice, options: &str) -> Self {
        let meta = std::fs::metadata(path).ok();
        let modified = meta.as_ref().and_then(|m| m.modified().ok());
        Self {
            path: path.display().to_string(),
            topic: topic.map(str::to_string),
            axis: axis.to_string(),
            size_bytes: meta.as_ref().and_then(|m| i64::try_from(m.len()).ok()),
            modified: modified.and_then(|t| jiff::Timestamp::try_from(t).ok()).map(|t| t.to_string()),
            gyroid_version: env!("CARGO_PKG_VERSION").into(),
            options: options.into(),
            ..Self::default()
        }
    }

    /// The row of a log that could not be fitted.
    pub(super) fn failed(mut self, error: &Error) -> Self {
        self.error = Some(error.to_string());
        self
    }

    /// The row of a log that was fitted.
    pub(super) fn fitted(mut self, recording: &GyroRecording, fit: &Fit, validation: &Validation) -> Self {
        self.column = Some(recording.column.clone());
        self.unit = Some(recording.unit.to_string());
        self.sha256.clone_from(&recording.sha256);
        self.started = started(&recording.clock).map(|t| t.to_string());
        let (found, white) = (fit.warm_up_found(), validation.white);
        self.fit_for_use = Some(found && fit.identifiable && white);
        (self.warm_up_found, self.identifiable, self.white) = (Some(found), Some(fit.identifiable), Some(white));
        self.samples = i64::try_from(fit.samples).ok();
        self.sample_rate_hz = known(fit.sample_rate_hz);
        self.first_s = known(fit.first_s);
        self.span_s = known(fit.span_s);
        let five = |e: &Estimate| [e.estimate, e.std, e.std_white, e.ci95[0], e.ci95[1]].map(known);
        [self.c1_rad_s, self.c1_std_rad_s, self.c1_std_white_rad_s, self.c1_ci95_low_rad_s, self.c1_ci95_high_rad_s] =
            five(&fit.c1_rad_s);
        [self.c2_rad_s, self.c2_std_rad_s, self.c2_std_white_rad_s, self.c2_ci95_low_rad_s, self.c2_ci95_high_rad_s] =
            five(&fit.c2_rad_s);
        [
            self.time_constant_s,
            self.time_constant_std_s,
            self.time_constant_std_white_s,
            self.time_constant_ci95_low_s,
            self.time_constant_ci95_high_s,
        ] = five(&fit.time_constant_s);
        self.c1_c2_covariance_rad2_s2 = known(fit.covariance[0][1]);
        self.c1_time_constant_covariance_rad = known(fit.covariance[0][2]);
        self.c2_time_constant_covariance_rad = known(fit.covariance[1][2]);
        self.angle_random_walk_rad_sqrt_s = known(fit.noise.angle_random_walk_rad_sqrt_s);
        self.rate_random_walk_probability = known(fit.noise.rate_random_walk_probability);
        self.rate_random_walk_rad_s_sqrt_s = known(fit.noise.rate_random_walk_rad_s_sqrt_s);
        self.rate_random_walk_upper95_rad_s_sqrt_s = known(fit.noise.rate_random_walk_upper95_rad_s_sqrt_s);
        self.residual_std_rad_s = known(fit.residual_std_rad_s);
        self.degrees_of_freedom = known(fit.degrees_of_freedom);
        self.warm_up_p_value = fit.comparison.and_then(|c| known(c.against_constant.p_value));
        self.whiteness_p_value = known(validation.joint_p_value);
        self.whiteness_level = known(validation.level);
        let smallest = |p: &[f64; 4]| p.iter().copied().fold(f64::INFINITY, f64::min);
        let levels = validation.levels.iter();
        let p_values: serde_json::Map<String, serde_json::Value> =
            levels.map(|l| (l.averaging_time_s.to_string(), smallest(&l.calibrated_p_values).into())).collect();
        self.whiteness_p_values = Some(serde_json::Value::Object(p_values).to_string());
        self.termination = Some(ended(&fit.termination).to_string());
        let temperature = recording.log.get(names::TEMPERATURE).unwrap_or_default();
        let there = || temperature.iter().copied().filter(|v| v.is_finite());
        self.temperature_low_c = there().min_by(f64::total_cmp);
        self.temperature_high_c = there().max_by(f64::total_cmp);
        let notes: Vec<String> = recording.notes.iter().cloned().chain(recording.audit.findings()).collect();
        self.notes = (!notes.is_empty()).then(|| notes.join("; "));
        self
    }

    /// Estimates of (C1, C2, T) with their covariance, where all are known.
    #[must_use]
    pub(crate) fn estimates(&self) -> Option<([f64; 3], [[f64; 3]; 3])> {
        let value = [self.c1_rad_s?, self.c2_rad_s?, self.time_constant_s?];
        let [a, b, c] = [self.c1_std_rad_s?, self.c2_std_rad_s?, self.time_constant_std_s?].map(|s| s * s);
        let ab = self.c1_c2_covariance_rad2_s2?;
        let (ac, bc) = (self.c1_time_constant_covariance_rad?, self.c2_time_constant_covariance_rad?);
        Some((value, [[a, ab, ac], [ab, b, bc], [ac, bc, c]]))
    }
}

/// The reason as one word of the JSON of `gyroid fit`.
fn ended(termination: &Termination) -> &'static str {
    match termination {
        Termination::Converged { .. } => "converged",
        Termination::StepLimit { .. } => "step_limit",
        Termination::StraightLine => "straight_line",
        Termination::TooFast => "too_fast",
        Termination::Linear => "linear",
    }
}
