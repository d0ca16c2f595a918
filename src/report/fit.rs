//! The report of a fit: verdict first, then numbers, then evidence.

use super::colour::coloured_text;
use super::numbers::{equals, known_digits, probability, significant};
use super::temperature::{temperature_json, temperature_text};
use crate::bias::{Against, EarthRate};
use crate::identify::{Estimate, Fit, TemperatureFit, Termination, Weighting};
use crate::math::whiteness::Whiteness;
use crate::units::{RAD_S_PER_DEG_S, RateUnit, duration_text};
use crate::validate::Validation;
use serde_json::{Value, json};
use std::fmt::Write;

/// Facts about the log for the report.
#[derive(Debug, Clone, PartialEq)]
pub struct LogFacts {
    /// File name.
    pub name: String,
    /// Column that was fitted, as the file calls it.
    pub column: String,
    /// Its unit in the file.
    pub unit: RateUnit,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Lowest and highest temperature, °C, where the log has it.
    pub temperature_c: Option<[f64; 2]>,
    /// Guesses, omissions and oddities, one sentence each.
    pub notes: Vec<String>,
    /// The audit of the log as JSON; null where there is none.
    pub audit: Value,
}

/// Whether the model is fit for a filter's use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Warm-up found, T known, residuals white.
    FitForUse,
    /// A constant explains the log as well.
    NoWarmUp,
    /// The interval of T is open: the log knows C2 and the slope C1/T.
    NotIdentifiable,
    /// The model is one of the temperature, and that has no effect in this log.
    NoTemperatureEffect,
    /// Something is left in the residuals.
    NotWhite,
}

/// A fit with its validation.
#[derive(Debug, Clone, PartialEq)]
pub struct FitReport {
    /// The log.
    pub log: LogFacts,
    /// The fit.
    pub fit: Fit,
    /// Whiteness of the residuals: of the fit, or of the error by temperature where the model is `against` that.
    pub validation: Validation,
    /// The Earth's rotation as part of C2, where the latitude is known and the axis points up.
    pub earth: Option<EarthRate>,
    /// The same error by temperature, where the log has it.
    pub temperature: Option<TemperatureFit>,
    /// Which of both is the model that is judged, and written into a configuration.
    pub against: Against,
}

impl FitReport {
    /// The report of a fit against elapsed time.
    #[must_use]
    pub fn new(log: LogFacts, fit: Fit, validation: Validation) -> Self {
        Self { log, fit, validation, earth: None, temperature: None, against: Against::Time }
    }

    /// The error by temperature where that is the model.
    #[must_use]
    pub fn thermal(&self) -> Option<&TemperatureFit> {
        self.temperature.as_ref().filter(|_| self.against == Against::Temperature)
    }

    /// The verdict; of several faults the worst.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        if let Some(thermal) = self.thermal() {
            return match (thermal.found(), self.validation.white) {
                (false, _) => Verdict::NoTemperatureEffect,
                (true, false) => Verdict::NotWhite,
                (true, true) => Verdict::FitForUse,
            };
        }
        if !self.fit.warm_up_found() {
            Verdict::NoWarmUp
        } else if !self.fit.identifiable {
            Verdict::NotIdentifiable
        } else if !self.validation.white {
            Verdict::NotWhite
        } else {
            Verdict::FitForUse
        }
    }

    /// The verdict in one line.
    #[must_use]
    pub fn verdict_line(&self) -> String {
        let t = &self.fit.time_constant_s;
        let joint = probability(self.validation.joint_p_value);
        let white = match self.validation.strongest() {
            None => "too few samples to test whiteness".to_string(),
            Some(_) if self.validation.white => {
                format!("residuals white at {} (joint p = {joint})", self.averaging_times())
            }
            Some((level, test, _)) => {
                let at = duration_text(self.validation.levels[level].averaging_time_s);
                format!("residuals not white (joint p {}, most by {test} at {at})", equals(&joint))
            }
        };
        let verdict = self.verdict();
        if let (Verdict::FitForUse, Some(thermal)) = (verdict, self.thermal()) {
            let s = &thermal.sensitivity_rad_s_k;
            let (slope, std) = (known_digits(s.estimate, s.std), significant(s.std, 2));
            return format!("FIT FOR USE by temperature: {slope} ± {std} rad/s/K, {white}");
        }
        match verdict {
            Verdict::NoTemperatureEffect => format!("NOT FIT FOR USE: temperature has no effect in this log; {white}"),
            Verdict::FitForUse if t.std > 0.0 => {
                let relative = 100.0 * 0.5 * (t.ci95[1] - t.ci95[0]) / t.estimate;
                format!("FIT FOR USE: warm-up found, T known to ±{} %, {white}", significant(relative, 2))
            }
            Verdict::FitForUse => format!("FIT FOR USE: {white}"),
            Verdict::NoWarmUp => {
                format!("NOT FIT FOR USE: no warm-up in this log, a constant explains it as well; {white}")
            }
            Verdict::NotIdentifiable => {
                format!("NOT FIT FOR USE: T is not identifiable from this log, C2 and C1/T are; {white}")
            }
            Verdict::NotWhite => format!("NOT FIT FOR USE: {white}"),
        }
    }

    fn averaging_times(&self) -> String {
        let all: Vec<String> = self.validation.levels.iter().map(|l| duration_text(l.averaging_time_s)).collect();
        all.join(", ")
    }

    /// The page for a terminal.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        let fit = &self.fit;
        // writing to a String cannot fail
        let _ = writeln!(out, "{}", self.verdict_line());
        let _ = writeln!(
            out,
            "\n{}, column {} [{}]: {} samples at {} Hz, {} from {} after power-on\n",
            self.log.name,
            self.log.column,
            self.log.unit,
            fit.samples,
            significant(fit.sample_rate_hz, 4),
            duration_text(fit.span_s),
            duration_text(fit.first_s),
        );
        for note in &self.log.notes {
            let _ = writeln!(out, "  note: {note}");
        }
        if !self.log.notes.is_empty() {
            out.push('\n');
        }
        let _ = writeln!(out, "e(t) = C1 (1 - exp(-t/T)) + C2");
        let _ = writeln!(out, "  {:<6}{:>14}{:>12}{:>12}   95 % interval", "", "estimate", "std", "std white");
        row(&mut out, "C1", "rad/s", &fit.c1_rad_s, 1.0 / RAD_S_PER_DEG_S, "deg/s");
        row(&mut out, "C2", "rad/s", &fit.c2_rad_s, 1.0 / RAD_S_PER_DEG_S, "deg/s");
        if let Some(earth) = &self.earth {
            let bias = bias(&fit.c2_rad_s, earth);
            let _ = writeln!(
                out,
                "         = {} rad/s of the gyro, and {} rad/s of the Earth at latitude {}°",
                known_digits(bias.estimate, bias.std),
                significant(earth.vertical_rad_s, 4),
                earth.latitude_deg
            );
        }
        let t = fit.time_constant_s;
        if matches!(fit.termination, Termination::StraightLine | Termination::TooFast) {
            let _ = writeln!(out, "  {:<6}{:>14}", "T", "unknown");
        } else {
            row(&mut out, "T", "s", &t, 1.0 / 60.0, "min");
        }
        let c = &fit.correlation;
        let _ = writeln!(out, "  correlations: C1,C2 {:.3}   C1,T {:.3}   C2,T {:.3}", c[0][1], c[0][2], c[1][2]);
        let _ = writeln!(out, "  {}", termination(&fit.termination));
        self.weighting_text(&mut out);
        self.noise_text(&mut out);
        self.identifiability_text(&mut out);
        if let Some(temperature) = &self.temperature {
            temperature_text(temperature, self.against == Against::Temperature, &mut out);
        }
        whiteness_text(&self.validation, &mut out);
        out
    }

    /// Both weightings where they disagree, and what to do where only the other one knows T.
    pub(super) fn weighting_text(&self, out: &mut String) {
        let Some(other) = self.fit.other_weighting.as_deref() else { return };
        let rescue = !self.fit.identifiable && other.identifiable;
        if !(rescue || self.fit.weightings_disagree()) {
            return;
        }
        let (name, option) = match other.weighting {
            Weighting::Walk => ("squares weighed by the walk that the residuals show", "--weighting walk"),
            Weighting::Uniform => ("ordinary least squares", "--weighting uniform"),
        };
        let value = |e: &Estimate| format!("{} ± {}", known_digits(e.estimate, e.std), significant(e.std, 2));
        let numbers = [&other.c1_rad_s, &other.c2_rad_s, &other.time_constant_s].map(value);
        let [c1, c2, t] = &numbers;
        let word = if rescue { "would know T" } else { "disagree" };
        let _ = writeln!(out, "  {name} {word}: C1 {c1}, C2 {c2} rad/s, T {t} s");
        let _ = match other.weighting {
            Weighting::Walk => writeln!(
                out,
                "  {option} takes them: right where a walk that comes further than the warm-up hides it, too short a T where\n  \
                 what is slow is no walk, such as a second time constant"
            ),
            Weighting::Uniform => writeln!(out, "  {option} takes them"),
        };
    }

    pub(super) fn noise_text(&self, out: &mut String) {
        let n = &self.fit.noise;
        let _ = writeln!(
            out,
            "\nnoise: {} rad/s a sample; angle random walk {} rad/√s ({} deg/√h)",
            significant(self.fit.residual_std_rad_s, 4),
            significant(n.angle_random_walk_rad_sqrt_s, 3),
            significant(n.angle_random_walk_rad_sqrt_s / crate::units::RAD_SQRT_S_PER_DEG_SQRT_H, 3),
        );
        for line in coloured_text(&self.fit.colour) {
            let _ = writeln!(out, "  {line}");
        }
        let _ = if n.rate_random_walk_probability > 0.5 {
            writeln!(
                out,
                "  rate random walk {} rad/s/√s (probability {}); {}",
                significant(n.rate_random_walk_rad_s_sqrt_s, 2),
                probability(n.rate_random_walk_probability),
                match self.fit.weighting {
                    Weighting::Walk => "the fit is weighed by it, and std allows for it",
                    Weighting::Uniform => "std and intervals allow for it",
                }
            )
        } else {
            writeln!(
                out,
                "  rate random walk not supported by this log: below {} rad/s/√s at 95 %",
                significant(n.rate_random_walk_upper95_rad_s_sqrt_s, 2)
            )
        };
    }

    pub(super) fn identifiability_text(&self, out: &mut String) {
        let fit = &self.fit;
        if let Some(c) = &fit.comparison {
            let _ = writeln!(
                out,
                "\nmodels by AICc above the best: constant {:.1}, straight line {:.1}, warm-up {:.1}",
                c.constant.aicc_above_best, c.line.aicc_above_best, c.warm_up.aicc_above_best
            );
            let _ = writeln!(
                out,
                "  warm-up against constant p {}, against straight line p {} (F-type, T searched)",
                equals(&probability(c.against_constant.p_value)),
                equals(&probability(c.against_line.p_value)),
            );
        }
        if !fit.identifiable
            && let Some(line) = &fit.line
        {
            let _ = writeln!(
                out,
                "  what this log knows: rate at its start {} ± {} rad/s, slope C1/T {} ± {} rad/s²",
                known_digits(line.start_rad_s.estimate, line.start_rad_s.std),
                significant(line.start_rad_s.std, 2),
                known_digits(line.slope_rad_s2.estimate, line.slope_rad_s2.std),
                significant(line.slope_rad_s2.std, 2),
            );
        }
        for a in &fit.advice {
            let condition = format!("with T = {}", duration_text(a.if_time_constant_s));
            let _ = match (a.length_s, a.longer_by_s) {
                (Some(length), Some(longer)) if longer > 0.0 => writeln!(
                    out,
                    "  T to ±10 %, {condition}: record {} in all, {} longer",
                    duration_text(length),
                    duration_text(longer)
                ),
                (Some(length), _) => {
                    writeln!(out, "  T to ±10 %, {condition}: {} are enough", duration_text(length))
                }
                (None, _) => writeln!(
                    out,
                    "  T to ±10 %, {condition}: not in one log, however long; {} power-ons of {} each",
                    a.power_ons,
                    duration_text(a.length_each_s)
                ),
            };
        }
    }

    /// The documented JSON of `gyroid fit --json`. A bound that does not exist is null.
    #[must_use]
    pub fn json(&self) -> Value {
        let fit = &self.fit;
        json!({
            "verdict": match self.verdict() {
                Verdict::FitForUse => "fit_for_use",
                Verdict::NoWarmUp => "no_warm_up",
                Verdict::NotIdentifiable => "not_identifiable",
                Verdict::NotWhite => "not_white",
                Verdict::NoTemperatureEffect => "no_temperature_effect",
            },
            "verdict_text": self.verdict_line(),
            "parameters": {
                "c1_rad_s": fit.c1_rad_s,
                "c2_rad_s": fit.c2_rad_s,
                "time_constant_s": fit.time_constant_s,
            },
            "earth": self.earth.map(|earth| json!({
                "latitude_deg": earth.latitude_deg,
                "earth_rate_rad_s": earth.vertical_rad_s,
                "bias_rad_s": bias(&fit.c2_rad_s, &earth),
            })),
            "correlation": fit.correlation,
            "covariance_si": fit.covariance,
            "identifiable": fit.identifiable,
            "warm_up_found": fit.warm_up_found(),
            "white": self.validation.white,
            "termination": fit.termination,
            "loss": fit.loss,
            "weighting": fit.weighting,
            "other_weighting": fit.other_weighting.as_deref().map(|other| json!({
                "weighting": other.weighting,
                "parameters": {
                    "c1_rad_s": other.c1_rad_s,
                    "c2_rad_s": other.c2_rad_s,
                    "time_constant_s": other.time_constant_s,
                },
                "identifiable": other.identifiable,
                "disagrees": fit.weightings_disagree(),
            })),
            "samples": fit.samples,
            "sample_rate_hz": fit.sample_rate_hz,
            "first_s": fit.first_s,
            "span_s": fit.span_s,
            "residual_std_rad_s": fit.residual_std_rad_s,
            "residual_sum_of_squares_rad2_s2": fit.residual_sum_of_squares_rad2_s2,
            "degrees_of_freedom": fit.degrees_of_freedom,
            "noise": fit.noise,
            "colour": fit.colour,
            "comparison": fit.comparison,
            "straight_line": fit.line,
            "advice": fit.advice,
            "validation": whiteness_json(&self.validation),
            "against": self.against,
            "temperature": self.temperature.as_ref().map(temperature_json),
            "log": self.log.json(),
        })
    }
}

/// C2 without the Earth, which is known.
fn bias(c2: &Estimate, earth: &EarthRate) -> Estimate {
    let less = |v: f64| v - earth.vertical_rad_s;
    Estimate { estimate: less(c2.estimate), ci95: c2.ci95.map(less), ..*c2 }
}

/// The table of whiteness tests.
pub(super) fn whiteness_text(v: &Validation, out: &mut String) {
    if v.levels.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "\nwhiteness, p values calibrated by {} permutations; joint p {}",
        v.draws,
        equals(&probability(v.joint_p_value))
    );
    let _ = writeln!(
        out,
        "  {:>10}{:>9}{:>9}{:>14}{:>11}{:>15}{:>8}",
        "averaged", "blocks", "lag 1", "lags outside", "Ljung-Box", "cum. periodog.", "runs"
    );
    for l in &v.levels {
        let p = l.calibrated_p_values.map(probability);
        let _ = writeln!(
            out,
            "  {:>10}{:>9}{:>9.3}{:>14}{:>11}{:>15}{:>8}",
            duration_text(l.averaging_time_s),
            l.whiteness.samples,
            l.whiteness.autocorrelation.get(1).copied().unwrap_or(f64::NAN),
            p[0],
            p[1],
            p[2],
            p[3]
        );
    }
}

/// The whiteness tests as JSON.
pub(super) fn whiteness_json(v: &Validation) -> Value {
    let by_name = |p: [f64; 4]| -> Value {
        let name = |n: &str| n.replace([' ', '-'], "_").to_lowercase();
        Whiteness::TESTS.iter().zip(p).map(|(n, p)| (name(n), json!(p))).collect::<serde_json::Map<_, _>>().into()
    };
    let levels: Vec<Value> = v
        .levels
        .iter()
        .map(|l| {
            let mut value = json!(l);
            value["calibrated_p_values"] = by_name(l.calibrated_p_values);
            value
        })
        .collect();
    json!({
        "joint_p_value": v.joint_p_value,
        "level": v.level,
        "draws": v.draws,
        "seed": v.seed,
        "levels": levels,
    })
}

impl LogFacts {
    /// The log as JSON.
    pub(super) fn json(&self) -> Value {
        json!({
            "name": self.name,
            "column": self.column,
            "unit": self.unit.to_string(),
            "sha256": self.sha256,
            "temperature_c": self.temperature_c,
            "notes": self.notes,
            "audit": self.audit,
        })
    }
}

fn row(out: &mut String, name: &str, unit: &str, e: &Estimate, factor: f64, other: &str) {
    let [low, high] = e.ci95;
    let interval = if e.std > 0.0 {
        let end = |x: f64| if x.is_finite() { known_digits(x, e.std) } else { "unbounded".to_string() };
        let low = if unit == "s" && low <= 0.0 { "unbounded".to_string() } else { end(low) };
        format!("[{low}, {}]", end(high))
    } else {
        "given".to_string()
    };
    let _ = writeln!(
        out,
        "  {:<6}{:>14}{:>12}{:>12}   {interval} {unit}   ({} {other})",
        name,
        known_digits(e.estimate, e.std),
        significant(e.std, 2),
        significant(e.std_white, 2),
        known_digits(e.estimate * factor, e.std * factor),
    );
}

fn termination(t: &Termination) -> String {
    match t {
        Termination::Converged { iterations, polish_steps, last_step } => {
            format!("converged: {iterations} Brent iterations, {polish_steps} Gauss-Newton steps, last {last_step:.0e}")
        }
        Termination::StepLimit { last_step } => {
            format!("not converged: the last Gauss-Newton step still moved T by {last_step:.0e} of itself")
        }
        Termination::StraightLine => "no minimum: the longer T, the better; a straight line fits as well".into(),
        Termination::TooFast => "no minimum: the shorter T, the better; the warm-up is over after a sample".into(),
        Termination::Linear => "T given: the rest is linear".into(),
    }
}
