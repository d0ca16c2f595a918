//! Report of the error by temperature, and of time against temperature.

use super::numbers::{equals, known_digits, probability, significant};
use crate::identify::terms::{DriftCause, Explanation};
use crate::identify::{Estimate, TemperatureFit};
use crate::units::RAD_S_PER_DEG_S;
use serde_json::{Value, json};
use std::fmt::Write;

/// The slope is said to be flattened from this share on.
const FLATTENED: f64 = 0.01;

pub(super) fn drift_text(d: &DriftCause, out: &mut String) {
    let verdict = match d.decided {
        Some(e) => format!("{} explains what drifts", e.title()),
        None => "this log cannot tell what the drift follows".into(),
    };
    let _ =
        writeln!(out, "\ntime or temperature ({} °C in this log): {verdict}", significant(d.temperature_range_c, 2));
    let all: Vec<String> =
        d.explanations.iter().map(|(e, _, p)| format!("{} {}", e.title(), probability(*p))).collect();
    let _ = writeln!(
        out,
        "  probability: {}; temperature and warm-up are correlated by {:.3}",
        all.join(", "),
        d.correlation
    );
    if d.decided.is_none() {
        let _ = writeln!(out, "  record a warm restart, or a log in which the surroundings warm and cool the sensor");
    }
}

pub(super) fn drift_json(d: &DriftCause) -> Value {
    let all: Vec<Value> = d
        .explanations
        .iter()
        .map(|(e, ln, p)| json!({ "explanation": e, "ln_evidence_below_best": -ln, "probability": p }))
        .collect();
    json!({
        "decided": d.decided,
        "explanations": all,
        "temperature_range_c": d.temperature_range_c,
        "correlation": d.correlation,
    })
}

/// Writes time against temperature, the fitted polynomial, and advice; `used` where the configuration gets this model.
pub(super) fn temperature_text(fit: &TemperatureFit, used: bool, out: &mut String) {
    if let Some(drift) = &fit.explanation {
        drift_text(drift, out);
    }
    let square = if fit.curvature_rad_s_k2.is_some() { " + q (temperature - r)²" } else { "" };
    let _ = writeln!(
        out,
        "\ne(temperature) = b + s (temperature - r){square}, r = {} °C, over {} to {} °C",
        significant(fit.reference_c, 4),
        significant(fit.range_c[0], 4),
        significant(fit.range_c[1], 4),
    );
    row(out, "b", "rad/s", &fit.bias_rad_s, "deg/s");
    row(out, "s", "rad/s/K", &fit.sensitivity_rad_s_k, "deg/s/K");
    match (&fit.curvature_rad_s_k2, fit.curvature_p_value) {
        (Some(q), _) => row(out, "q", "rad/s/K²", q, "deg/s/K²"),
        (None, Some(p)) => {
            let _ = writeln!(out, "  q is not supported by this log (p {})", equals(&probability(p)));
        }
        (None, None) => {}
    }
    let effect = if fit.found() { "temperature has an effect" } else { "no effect of temperature" };
    let _ = writeln!(
        out,
        "  {effect}: p {}; {} rad/s a sample is left",
        equals(&probability(fit.p_value)),
        significant(fit.residual_std_rad_s, 4)
    );
    if fit.attenuation > FLATTENED {
        let _ = writeln!(
            out,
            "  the thermometer's noise ({} °C) makes the slope about {} % too flat",
            significant(fit.temperature_noise_c, 2),
            significant(100.0 * fit.attenuation, 2)
        );
    }
    let decided = fit.explanation.as_ref().and_then(|e| e.decided);
    if let (false, Some(Explanation::Temperature)) = (used, decided) {
        let _ = writeln!(out, "  --against temperature makes it the model of the configuration");
    }
    if let (true, Some(Explanation::ElapsedTime)) = (used, decided) {
        let _ = writeln!(out, "  elapsed time is the better explanation: --against time");
    }
}

/// The same as JSON.
pub(super) fn temperature_json(fit: &TemperatureFit) -> Value {
    json!({
        "explanation": fit.explanation.as_ref().map(drift_json),
        "reference_c": fit.reference_c,
        "parameters": {
            "bias_rad_s": fit.bias_rad_s,
            "sensitivity_rad_s_k": fit.sensitivity_rad_s_k,
            "curvature_rad_s_k2": fit.curvature_rad_s_k2,
        },
        "covariance_si": fit.covariance,
        "found": fit.found(),
        "p_value": fit.p_value,
        "curvature_p_value": fit.curvature_p_value,
        "range_c": fit.range_c,
        "temperature_noise_c": fit.temperature_noise_c,
        "attenuation": fit.attenuation,
        "residual_std_rad_s": fit.residual_std_rad_s,
        "noise": fit.noise,
    })
}

fn row(out: &mut String, name: &str, unit: &str, e: &Estimate, other: &str) {
    let [low, high] = e.ci95.map(|x| known_digits(x, e.std));
    let _ = writeln!(
        out,
        "  {name:<6}{:>14}{:>12}{:>12}   [{low}, {high}] {unit}   ({} {other})",
        known_digits(e.estimate, e.std),
        significant(e.std, 2),
        significant(e.std_white, 2),
        known_digits(e.estimate / RAD_S_PER_DEG_S, e.std / RAD_S_PER_DEG_S),
    );
}
