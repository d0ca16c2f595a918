//! One log, gyro and axis as a row of the results.

use super::source::{Kind, Record, Source};
use crate::identify::{Estimate, Fit, Termination};
use crate::ingest::GyroRecording;
use crate::signal::names;
use crate::validate::Validation;
use serde::{Deserialize, Serialize};

/// One log, gyro and axis: source, options of the reader, and the results of the fit, or its error.
///
/// SI throughout, the unit in the name. `None` (null, an empty cell) is an unknown value: all of a fit that failed, and
/// bounds that the log does not set. `*_std_*` allow for autocorrelated residuals, `*_std_white_*` do not; intervals
/// are profile likelihood.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Row {
    /// The log, and options of the reader, the fit and the validation.
    #[serde(flatten)]
    pub source: Source,
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

impl Record for Row {
    const COMMAND: &'static str = "fit";
    const TYPES: &'static [(&'static str, Kind)] = &[
        ("fit_for_use", Kind::Flag),
        ("warm_up_found", Kind::Flag),
        ("identifiable", Kind::Flag),
        ("white", Kind::Flag),
        ("samples", Kind::Whole),
        ("whiteness_p_values", Kind::Text),
        ("termination", Kind::Text),
        ("notes", Kind::Text),
    ];

    fn source(&self) -> &Source {
        &self.source
    }

    fn source_mut(&mut self) -> &mut Source {
        &mut self.source
    }
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl Row {
    /// Fills in the results.
    pub(super) fn fill(&mut self, recording: &GyroRecording, fit: &Fit, validation: &Validation) {
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
    }

    /// Year and month in which the log began, UTC; none where its clock has no date.
    #[must_use]
    pub(crate) fn month(&self) -> Option<&str> {
        self.source.started.as_deref()?.get(..7)
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
