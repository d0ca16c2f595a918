//! The report of a model held against another log.

use super::fit::{LogFacts, whiteness_json, whiteness_text};
use super::numbers::{probability, significant};
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Reduced, TimeAxis};
use crate::validate::{Residuals, Validation};
use serde_json::{Value, json};
use std::fmt::Write;

/// A model held against a log it was not fitted to.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelCheck {
    /// The log.
    pub log: LogFacts,
    /// Whether the configuration carries a checksum.
    pub signed: bool,
    /// Samples.
    pub samples: usize,
    /// Mean residual: how far this turn-on lies from the model, rad/s.
    pub offset_rad_s: f64,
    /// What the configuration expects of it: the covariance of the fit, and the turn-on spread where it is stated.
    pub offset_expected_std_rad_s: f64,
    /// Whether the configuration states a turn-on spread.
    pub turn_on_stated: bool,
    /// Root mean square of the residuals about their mean, rad/s.
    pub residual_std_rad_s: f64,
    /// What the angle random walk of the configuration gives at this log's sample time, rad/s.
    pub expected_std_rad_s: f64,
    /// Whether the log lies in the span of time that the model was fitted on.
    pub inside_valid_time: Option<bool>,
    /// Whiteness of the residuals.
    pub validation: Validation,
}

/// What the residuals say of themselves.
struct Seen {
    samples: usize,
    offset_rad_s: f64,
    variance: f64,
    /// Mean gradient over the log: the offset that errors of C1, C2 and T together make.
    gradient: [f64; 3],
    span_s: [f64; 2],
    step_s: f64,
}

impl ModelCheck {
    /// Holds the residuals of `log` at `time` (since power-on) against the configuration.
    ///
    /// # Errors
    /// [`ErrorKind::TooShort`] with fewer than three samples, [`ErrorKind::Config`] without `[gyro]`.
    pub fn new(
        log: LogFacts,
        config: &Config,
        time: &TimeAxis,
        residual_rad_s: &[f64],
        validation: Validation,
    ) -> Result<Self> {
        let gyro = config.require_gyro()?;
        if residual_rad_s.len() < 3 {
            let found = format!("{} samples", residual_rad_s.len());
            return Err(Error::new(ErrorKind::TooShort, &log.name, found).mend("record a longer log"));
        }
        let n = residual_rad_s.len() as f64;
        let offset = residual_rad_s.iter().sum::<f64>() / n;
        let variance = residual_rad_s.iter().map(|r| (r - offset).powi(2)).sum::<f64>() / (n - 1.0);
        let mut gradient = [0.0; 3];
        for i in 0..time.len() {
            let here = gyro.warm_up().gradient(time.at(i));
            gradient.iter_mut().zip(here).for_each(|(g, h)| *g += h / n);
        }
        let seen = Seen {
            samples: residual_rad_s.len(),
            offset_rad_s: offset,
            variance,
            gradient,
            span_s: [time.at(0), time.at(time.len() - 1)],
            step_s: time.median_step_s(),
        };
        Self::of(log, config, &seen, validation)
    }

    /// The same of a log of which one pass kept block means: `reduced`, whose times count from power-on, has `residuals`
    /// under the configuration's model.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_reduced(
        log: LogFacts,
        config: &Config,
        reduced: &Reduced,
        residuals: &Residuals,
        validation: Validation,
    ) -> Result<Self> {
        let model = config.require_gyro()?.warm_up();
        let (times, _) = residuals.coarse();
        if reduced.samples() < 3 || times.is_empty() {
            let found = format!("{} samples", reduced.samples());
            return Err(Error::new(ErrorKind::TooShort, &log.name, found).mend("record a longer log"));
        }
        let mut gradient = [0.0; 3];
        for t in &times {
            gradient.iter_mut().zip(model.gradient(*t)).for_each(|(g, h)| *g += h / times.len() as f64);
        }
        let seen = Seen {
            samples: reduced.samples(),
            offset_rad_s: residuals.mean_rad_s,
            variance: residuals.variance,
            gradient,
            span_s: [reduced.moments.first_s, reduced.last_s],
            step_s: reduced.coarse.step_s,
        };
        Self::of(log, config, &seen, validation)
    }

    fn of(log: LogFacts, config: &Config, seen: &Seen, validation: Validation) -> Result<Self> {
        let gyro = config.require_gyro()?;
        let g = &seen.gradient;
        let fitted: f64 = gyro.covariance.map_or(0.0, |c| {
            let c = c.to_matrix();
            (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| g[i] * c[i][j] * g[j]).sum()
        });
        let spread = gyro.turn_on_bias_std_rad_s.unwrap_or(0.0).powi(2);
        let step_s = seen.step_s;
        let inside = config.validation.as_ref().map(|v| {
            let [first, last] = seen.span_s;
            v.valid_from_s <= first + step_s && last <= v.valid_to_s + step_s
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
            inside_valid_time: inside,
            validation,
        })
    }

    /// Offset in standard deviations of what is expected.
    #[must_use]
    pub fn offset_in_std(&self) -> f64 {
        self.offset_rad_s / self.offset_expected_std_rad_s
    }

    /// Whether the model explains the log: white residuals, and, where the spread from turn-on to turn-on is stated,
    /// an offset within four of its standard deviations.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.validation.white && (!self.turn_on_stated || self.offset_in_std().abs() <= 4.0)
    }

    /// The page for a terminal.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        let verdict = match (self.passed(), self.validation.white) {
            (true, _) => "EXPLAINED: residuals white under the model",
            (_, false) => "NOT EXPLAINED: the residuals are not white under the model",
            _ => "NOT EXPLAINED: the offset lies outside the stated turn-on repeatability",
        };
        let joint = probability(self.validation.joint_p_value);
        let _ = writeln!(out, "{verdict} (joint p {joint})\n\n{}: {} samples", self.log.name, self.samples);
        for note in &self.log.notes {
            let _ = writeln!(out, "  note: {note}");
        }
        if !self.signed {
            let _ = writeln!(out, "  note: the configuration is unsigned (written by hand)");
        }
        if self.inside_valid_time == Some(false) {
            let _ =
                writeln!(out, "  note: the log reaches beyond the time since power-on that the model was fitted on");
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
    pub fn json(&self) -> Value {
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
            "inside_valid_time": self.inside_valid_time,
            "validation": whiteness_json(&self.validation),
            "log": self.log.json(),
        })
    }
}
