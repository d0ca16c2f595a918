//! The report of a model held against another log.

use super::fit::{LogFacts, whiteness_json, whiteness_text};
use super::numbers::{probability, significant};
use crate::bias::Against;
use crate::config::{Config, Temperature};
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Course, Reduced, TimeAxis};
use crate::validate::{Residuals, Validation};
use serde_json::{Value, json};
use std::fmt::Write;

/// A model held against a log it was not fitted to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModelCheck {
    /// The log.
    pub log: LogFacts,
    /// Whether the configuration carries a checksum.
    pub signed: bool,
    /// Samples.
    pub samples: usize,
    /// Mean residual: how far this turn-on lies from the model, rad/s.
    pub offset_rad_s: f64,
    /// Standard deviation of it that the configuration expects, rad/s: from the covariance of the fit, the turn-on
    /// spread where it is stated, and the residuals' own scatter.
    pub offset_expected_std_rad_s: f64,
    /// Whether the configuration states a turn-on spread.
    pub turn_on_stated: bool,
    /// Root mean square of the residuals about their mean, rad/s.
    pub residual_std_rad_s: f64,
    /// Standard deviation of the residuals by the configuration's angle random walk at this log's sample time, rad/s.
    pub expected_std_rad_s: f64,
    /// Whether the model is that of the warm-up by elapsed time, or `[gyro.temperature]`.
    pub against: Against,
    /// Whether the log lies in the span of time that the model was fitted on; none for one of the temperature.
    pub inside_valid_time: Option<bool>,
    /// Whether the log lies in the temperatures that the model was fitted on, a tenth of their range aside; none for one of
    /// elapsed time.
    pub inside_valid_temperature: Option<bool>,
    /// Whiteness of the residuals.
    pub validation: Validation,
}

/// Statistics of the residuals.
struct Seen {
    samples: usize,
    offset_rad_s: f64,
    variance: f64,
    against: Against,
    /// Mean gradient over the log: the offset that errors of the model's parameters together make.
    gradient: [f64; 3],
    span_s: [f64; 2],
    step_s: f64,
}

impl Seen {
    fn whole(against: Against, time: &TimeAxis, residual_rad_s: &[f64], gradient: [f64; 3]) -> Self {
        let n = residual_rad_s.len() as f64;
        let offset_rad_s = residual_rad_s.iter().sum::<f64>() / n;
        let variance = residual_rad_s.iter().map(|r| (r - offset_rad_s).powi(2)).sum::<f64>() / (n - 1.0);
        let span_s = if time.is_empty() { [f64::NAN; 2] } else { [time.at(0), time.at(time.len() - 1)] };
        let (samples, step_s) = (residual_rad_s.len(), time.median_step_s());
        Self { samples, offset_rad_s, variance, against, gradient, span_s, step_s }
    }

    fn reduced(against: Against, log: &Reduced, residuals: &Residuals, gradient: [f64; 3]) -> Self {
        Self {
            samples: log.samples(),
            offset_rad_s: residuals.mean_rad_s,
            variance: residuals.variance,
            against,
            gradient,
            span_s: [log.moments.first_s, log.last_s],
            step_s: log.coarse.step_s,
        }
    }
}

fn mean_gradient(all: impl ExactSizeIterator<Item = [f64; 3]>) -> [f64; 3] {
    let n = all.len() as f64;
    all.fold([0.0; 3], |sum, g| std::array::from_fn(|i| sum[i] + g[i] / n))
}

fn table(config: &Config) -> Result<&Temperature> {
    config.require_gyro()?.temperature.as_ref().ok_or_else(|| {
        Error::new(ErrorKind::Config, "configuration", "the table [gyro.temperature] is missing")
            .hint("write it with gyroid fit --against temperature")
    })
}

impl ModelCheck {
    /// Holds the residuals of `log` at `time` (since power-on) against the configuration.
    ///
    /// # Errors
    /// [`ErrorKind::TooShort`] with fewer than three samples, [`ErrorKind::Config`] without `[gyro]`.
    pub(crate) fn new(
        log: LogFacts,
        config: &Config,
        time: &TimeAxis,
        residual_rad_s: &[f64],
        validation: Validation,
    ) -> Result<Self> {
        let model = config.require_gyro()?.warm_up();
        let gradient = mean_gradient((0..time.len()).map(|i| model.gradient(time.at(i))));
        Self::of(log, config, &Seen::whole(Against::Time, time, residual_rad_s, gradient), validation)
    }

    /// The same under `[gyro.temperature]`, with the temperature of each sample, °C.
    ///
    /// # Errors
    /// As [`Self::new`]; [`ErrorKind::Config`] without `[gyro.temperature]`.
    pub(crate) fn by_temperature(
        log: LogFacts,
        config: &Config,
        time: &TimeAxis,
        temperature_c: &[f64],
        residual_rad_s: &[f64],
        validation: Validation,
    ) -> Result<Self> {
        let model = table(config)?.thermal();
        let gradient = mean_gradient(temperature_c.iter().map(|t| model.gradient(*t)));
        Self::of(log, config, &Seen::whole(Against::Temperature, time, residual_rad_s, gradient), validation)
    }

    /// The same of a log of which one pass kept block means: `reduced`, whose times count from power-on, has `residuals`
    /// under the configuration's model.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn of_reduced(
        log: LogFacts,
        config: &Config,
        reduced: &Reduced,
        residuals: &Residuals,
        validation: Validation,
    ) -> Result<Self> {
        let model = config.require_gyro()?.warm_up();
        let (times, _) = residuals.coarse();
        let gradient = mean_gradient(times.iter().map(|t| model.gradient(*t)));
        Self::of(log, config, &Seen::reduced(Against::Time, reduced, residuals, gradient), validation)
    }

    /// The same under `[gyro.temperature]`, with the course of the temperature.
    ///
    /// # Errors
    /// As [`Self::by_temperature`].
    pub(crate) fn of_reduced_by_temperature(
        log: LogFacts,
        config: &Config,
        reduced: &Reduced,
        temperature_c: &Course,
        residuals: &Residuals,
        validation: Validation,
    ) -> Result<Self> {
        let model = table(config)?.thermal();
        let (times, _) = residuals.coarse();
        let gradient = mean_gradient(times.iter().map(|t| model.gradient(temperature_c.at(*t))));
        Self::of(log, config, &Seen::reduced(Against::Temperature, reduced, residuals, gradient), validation)
    }

    fn of(log: LogFacts, config: &Config, seen: &Seen, validation: Validation) -> Result<Self> {
        let gyro = config.require_gyro()?;
        if seen.samples < 3 || !seen.offset_rad_s.is_finite() {
            let found = format!("{} samples", seen.samples);
            return Err(Error::new(ErrorKind::TooShort, &log.name, found).hint("record a longer log"));
        }
        let g = &seen.gradient;
        let covariance = match seen.against {
            Against::Time => gyro.covariance.map(|c| c.to_matrix()),
            Against::Temperature => table(config)?.covariance.map(|c| c.to_matrix()),
        };
        let fitted: f64 = covariance.map_or(0.0, |c| {
            (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| g[i] * c[i][j] * g[j]).sum()
        });
        let spread = gyro.turn_on_bias_std_rad_s.unwrap_or(0.0).powi(2);
        let step_s = seen.step_s;
        let valid = config.validation.as_ref();
        let inside_time = valid.filter(|_| seen.against == Against::Time).map(|v| {
            let [first, last] = seen.span_s;
            v.valid_from_s <= first + step_s && last <= v.valid_to_s + step_s
        });
        let temperatures = valid.and_then(|v| v.valid_from_temperature_c.zip(v.valid_to_temperature_c));
        let inside_temperature = temperatures
            .zip(log.temperature_c)
            .filter(|_| seen.against == Against::Temperature)
            .map(|((from, to), [low, high])| {
                let slack = 0.1 * (to - from);
                from - slack <= low && high <= to + slack
            });
        Ok(Self {
            log,
            signed: config.is_signed(),
            samples: seen.samples,
            offset_rad_s: seen.offset_rad_s,
            offset_expected_std_rad_s: (fitted.max(0.0) + spread + seen.variance / seen.samples as f64).sqrt(),
            turn_on_stated: gyro.turn_on_bias_std_rad_s.is_some(),
            residual_std_rad_s: seen.variance.sqrt(),
            expected_std_rad_s: gyro.angle_random_walk_rad_sqrt_s / step_s.sqrt(),
            against: seen.against,
            inside_valid_time: inside_time,
            inside_valid_temperature: inside_temperature,
            validation,
        })
    }

    /// Offset over its expected standard deviation.
    #[must_use]
    pub(crate) fn offset_in_std(&self) -> f64 {
        self.offset_rad_s / self.offset_expected_std_rad_s
    }

    /// Whether the model explains the log: white residuals, and, where the spread from turn-on to turn-on is stated,
    /// an offset within four of its standard deviations.
    #[must_use]
    pub(crate) fn passed(&self) -> bool {
        self.validation.white && (!self.turn_on_stated || self.offset_in_std().abs() <= 4.0)
    }

    /// The verdict in one line.
    #[must_use]
    pub(crate) fn verdict_line(&self) -> String {
        let verdict = match (self.passed(), self.validation.white) {
            (true, _) => "EXPLAINED: residuals white under the model",
            (_, false) => "NOT EXPLAINED: the residuals are not white under the model",
            _ => "NOT EXPLAINED: the offset lies outside the stated turn-on repeatability",
        };
        format!("{verdict} (joint p {})", probability(self.validation.joint_p_value))
    }

    /// Remarks on the configuration and this log, a sentence each.
    pub(super) fn remarks(&self) -> Vec<String> {
        let all = [
            (!self.signed, "the configuration is unsigned (written by hand)"),
            (
                self.inside_valid_time == Some(false),
                "the log reaches beyond the time since power-on that the model was fitted on",
            ),
            (
                self.inside_valid_temperature == Some(false),
                "the log reaches beyond the temperatures that the model was fitted on",
            ),
        ];
        all.into_iter().filter(|(holds, _)| *holds).map(|(_, remark)| remark.to_string()).collect()
    }

    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let mut out = String::new();
        let _ = writeln!(out, "{}\n\n{}: {} samples", self.verdict_line(), self.log.name, self.samples);
        for note in self.log.notes.iter().chain(&self.remarks()) {
            let _ = writeln!(out, "  note: {note}");
        }
        if self.against == Against::Temperature {
            let _ = writeln!(out, "  model     by temperature, [gyro.temperature]");
        }
        let expected = if self.turn_on_stated {
            format!("{:.1} standard deviations of what is expected", self.offset_in_std())
        } else {
            "the configuration does not state how much it varies from one power-on to the next".to_string()
        };
        let _ = writeln!(out, "  offset    {} rad/s: {expected}", significant(self.offset_rad_s, 3));
        let _ = writeln!(
            out,
            "  residuals {} rad/s a sample; the configuration's angle random walk gives {}",
            significant(self.residual_std_rad_s, 3),
            significant(self.expected_std_rad_s, 3)
        );
        whiteness_text(&self.validation, &mut out);
        out
    }

    /// The JSON of `gyroid validate --json`.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        json!({
            "explained": self.passed(),
            "white": self.validation.white,
            "signed": self.signed,
            "samples": self.samples,
            "offset_rad_s": self.offset_rad_s,
            "offset_expected_std_rad_s": self.offset_expected_std_rad_s,
            "turn_on_stated": self.turn_on_stated,
            "residual_std_rad_s": self.residual_std_rad_s,
            "expected_std_rad_s": self.expected_std_rad_s,
            "against": self.against,
            "inside_valid_time": self.inside_valid_time,
            "inside_valid_temperature": self.inside_valid_temperature,
            "validation": whiteness_json(&self.validation),
            "log": self.log.json(),
        })
    }
}
