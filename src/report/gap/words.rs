//! Names, units and figures of a diagnosis in words.

use crate::effects::{About, about, unit_of_own};
use crate::gap::answer::{Answer, Correction, EffectAnswer, FilterFigures, Metric, Verdict};
use crate::gap::rest::predictive::{Curve, Over, Shown};
use crate::report::numbers::{equals, known_digits, probability, significant};
use crate::units::{RAD_S_PER_DEG_S, duration_text};
use std::fmt::Write;

/// Description of an effect, at rest or in drives; `None` where the library does not know it.
pub(in crate::report) fn about_of(id: &str) -> Option<&'static About> {
    about(id)
}

/// Title of an effect, or its id where the library does not know it.
pub(in crate::report) fn title(id: &str) -> &str {
    about_of(id).map_or(id, |about| about.title)
}

/// Quantity of a curve and its independent variable, in words.
pub(in crate::report) fn curve_name(curve: &Curve) -> String {
    let shown = match curve.shown {
        Shown::Deviation => "deviation",
        Shown::Power => "spectrum",
        Shown::LargestPower => "largest spectral line",
        Shown::AllanDeviation => "Allan deviation",
        Shown::ShareOfSamples => "share of samples",
        Shown::NoiseLevel => "noise",
    };
    format!("{shown} over {}", over_name(curve.over))
}

/// Independent variable of a curve, in words.
pub(in crate::report) fn over_name(over: Over) -> &'static str {
    match over {
        Over::Time => "time",
        Over::Frequency => "frequency",
        Over::AveragingTime => "averaging time",
        Over::Amplitude => "amplitude",
        Over::TemperatureC => "temperature",
        Over::TemperatureRate => "temperature rate",
        Over::SupplyV => "supply",
        Over::ElapsedTime => "elapsed time",
    }
}

/// Units by the ends of parameter names, longer ones before those that they end in.
const UNITS: [(&str, &str); 23] = [
    ("_rad_s_per_m2_s2", "rad/s per m²/s²"),
    ("_rad_s_per_m3_s3", "rad/s per m³/s³"),
    ("_rad_per_m2_s2", "rad per m²/s²"),
    ("_s3_per_m", "s³/m"),
    ("_s_per_m", "s/m"),
    ("_rad_s_sqrt_s", "rad/s/√s"),
    ("_rad_s_per_c2", "rad/s/°C²"),
    ("_rad_s_per_v2", "rad/s/V²"),
    ("_rad_s_per_c", "rad/s/°C"),
    ("_rad_s_per_v", "rad/s/V"),
    ("_rad_s2", "rad/s²"),
    ("_s2", "s²"),
    ("_rad_s", "rad/s"),
    ("_rad", "rad"),
    ("_hz", "Hz"),
    ("_per_sample", "per sample"),
    ("_per_c2", "1/°C²"),
    ("_per_c", "1/°C"),
    ("_per_v", "1/V"),
    ("_c", "°C"),
    ("_v", "V"),
    ("_m", "m"),
    ("_s", "s"),
];

/// `level_spacing_rad_s` is (`level spacing`, `rad/s`).
pub(in crate::report) fn name_and_unit(parameter: &str) -> (String, &'static str) {
    let found = UNITS.iter().find_map(|(end, unit)| parameter.strip_suffix(end).map(|name| (name, *unit)));
    let (name, unit) = found.unwrap_or((parameter, ""));
    (name.replace('_', " "), unit)
}

/// The same of a parameter of the effect `id`: an effect of the user's own states the unit beside the name.
pub(in crate::report) fn name_and_unit_of(id: &str, parameter: &str) -> (String, &'static str) {
    let (name, unit) = name_and_unit(parameter);
    match unit_of_own(id, parameter) {
        Some(stated) if stated != unit => (parameter.replace('_', " "), stated),
        _ => (name, unit),
    }
}

/// A share as percent: `97 %`, `99.6 %`.
pub(in crate::report) fn percent(share: f64) -> String {
    let digits = usize::from((0.985..1.0).contains(&share));
    let text = format!("{:.digits$} %", 100.0 * share);
    if text == "-0 %" { "0 %".into() } else { text }
}

/// Horizon of a heading drift, s.
pub(in crate::report) fn heading_horizon_s(metric: &Metric) -> Option<f64> {
    metric.metric.strip_prefix("heading_drift_rms_rad_")?.strip_suffix('s')?.parse().ok()
}

/// An error of the predicted pose: `filter_heading_rms_rad_5s`.
pub(in crate::report) struct PoseError {
    /// Of the filter, and not of the simulator alone.
    filter: bool,
    /// Of the heading, rad, and not of the position, m.
    pub heading: bool,
    /// Time of prediction, s.
    pub horizon_s: f64,
}

impl PoseError {
    /// `filter: heading`.
    pub(in crate::report) fn what(&self) -> String {
        format!("{}{}", if self.filter { "filter: " } else { "" }, if self.heading { "heading" } else { "position" })
    }

    /// Name in the table, with its unit, and the factor to it.
    fn in_table(&self) -> (String, f64) {
        let (unit, factor) = if self.heading { ("deg", degrees(1.0)) } else { ("m", 1.0) };
        (format!("{} off after {}, rms, {unit}", self.what(), duration_text(self.horizon_s)), factor)
    }
}

/// The error of the predicted pose that a metric is, if it is one.
pub(in crate::report) fn pose_horizon(metric: &str) -> Option<PoseError> {
    let (filter, rest) = metric.strip_prefix("filter_").map_or((false, metric), |rest| (true, rest));
    let after = |quantity: &str| rest.strip_prefix(quantity)?.strip_suffix('s')?.parse().ok();
    let [position, heading] = ["position_rms_m_", "heading_rms_rad_"].map(after);
    position.or(heading).map(|horizon_s| PoseError { filter, heading: heading.is_some(), horizon_s })
}

/// A correction of which a state or an input has less than this goes with nothing that was tried.
pub(in crate::report) const LITTLE: f64 = 0.1;

/// The name of an equation without what kind it is.
pub(in crate::report) fn without_kind(equation: &str) -> &str {
    equation.split(": ").last().unwrap_or(equation)
}

/// Correction that an equation needs, in one line.
pub(super) fn correction(equation: &str, c: &Correction) -> String {
    let name = without_kind(equation);
    let rms = (c.values.iter().map(|v| v * v).sum::<f64>() / c.values.len().max(1) as f64).sqrt();
    let (rms, unit) = (significant(rms, 3), &c.unit);
    if c.diffusion == 0.0 {
        let level = if c.about_mean { String::new() } else { format!(", {rms} {unit}") };
        return format!("{name}: none, a constant is enough{level}");
    }
    let best = c.regressors.first().filter(|r| r.share >= LITTLE);
    let goes =
        best.map_or_else(String::new, |r| format!(", {} of it with {}", percent(r.share), r.name.replace('_', " ")));
    let p = equals(&probability(c.p_value));
    format!("{name}: {} {unit}/√s (p {p}); {rms} {unit} rms{goes}", significant(c.diffusion, 2))
}

pub(super) fn degrees(rad: f64) -> f64 {
    rad / RAD_S_PER_DEG_S
}

/// Writes the measures of the gap on the recording `on`; `after` heads their values with the explanation.
pub(super) fn metrics(out: &mut String, on: &str, after: &str, gap: &[Metric]) {
    let _ = writeln!(out, "  {on:<38}{:>12}{:>12}{:>12}", "before", after, "floor");
    for [name, before, after, floor] in gap.iter().map(metric_cells) {
        let _ = writeln!(out, "  {name:<38}{before:>12}{after:>12}{floor:>12}");
    }
}

/// Name of a measure, and its values before, after, and at the floor.
pub(in crate::report) fn metric_cells(metric: &Metric) -> [String; 4] {
    let (name, factor) = match (heading_horizon_s(metric), metric.metric.as_str()) {
        (Some(horizon_s), _) => (format!("heading drift in {}, rms, deg", duration_text(horizon_s)), degrees(1.0)),
        (None, "log_score") => ("log score, nats".into(), 1.0),
        (None, "allan_deviation_ln_rms") => ("Allan deviation off by, ln, rms".into(), 1.0),
        (None, "spectrum_ln_rms") => ("spectrum off by, ln, rms".into(), 1.0),
        (None, other) => pose_horizon(other).map_or_else(|| (other.to_string(), 1.0), |p| p.in_table()),
    };
    // scores differ in the third decimal place
    let score = metric.metric == "log_score";
    let shown = |v: f64| if score { format!("{v:.4}") } else { significant(factor * v, 4) };
    [name, shown(metric.before), shown(metric.after), shown(metric.floor)]
}

/// `0.12 m and 3.4°`.
pub(in crate::report) fn errors(figures: &FilterFigures) -> String {
    let heading = figures.heading_rms_rad.map(|rad| format!(" and {}°", significant(degrees(rad), 3)));
    format!("{} m{}", significant(figures.position_rms_m, 3), heading.unwrap_or_default())
}

/// `97 % (95 %: 95 to 99 %)`.
pub(in crate::report) fn closed(effect: &EffectAnswer) -> Option<String> {
    let share = effect.gap_closed?;
    let interval = effect.gap_closed_ci95.map(|[low, high]| format!(" (95 %: {} to {})", percent(low), percent(high)));
    Some(percent(share) + &interval.unwrap_or_default())
}

/// Relative standard deviation below which a parameter is printed without it.
const KNOWN: f64 = 1e-8;

pub(super) fn parameters(out: &mut String, effect: &EffectAnswer) {
    let cells = parameter_cells(effect);
    let wide = cells.iter().map(|[name, ..]| name.chars().count() + 1).max().unwrap_or(0).max(21);
    for [name, value, meaning] in cells {
        let _ = writeln!(out, "    {name:<wide$} {value:<29} {meaning}");
    }
}

/// Name, value with its unit, and meaning of each parameter that was found.
pub(in crate::report) fn parameter_cells(effect: &EffectAnswer) -> Vec<[String; 3]> {
    let about: Option<&About> = about_of(&effect.id);
    let mut cells = Vec::new();
    for (parameter, value) in &effect.parameters {
        // a part of the form that was not found
        if *value == 0.0 && effect.std.get(parameter).is_none_or(|std| *std == 0.0) {
            continue;
        }
        let (name, unit) = name_and_unit_of(&effect.id, parameter);
        let std = effect.std.get(parameter).copied();
        let meaning = about.and_then(|a| a.parameters.iter().find(|p| p.name == parameter)).map_or("", |p| p.meaning);
        // a symbol alone reads as a unit
        let symbol = if !meaning.is_empty() && meaning.chars().count() <= 2 { " of the equation" } else { "" };
        let shown = match std {
            // known to the last digit, as a lattice is
            Some(std) if std < KNOWN * value.abs() => significant(*value, 7),
            Some(std) => format!("{} ± {}", known_digits(*value, std), significant(std, 2)),
            None => significant(*value, 4),
        };
        cells.push([name, format!("{shown} {unit}"), format!("{meaning}{symbol}")]);
    }
    cells
}

/// Recording that the gap was measured on, in words.
pub(in crate::report) fn measured_on(held_out: bool) -> &'static str {
    if held_out { "on the recording held out" } else { "on this very recording" }
}

/// With a capital letter at its beginning.
pub(in crate::report) fn capitalised(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
/// Share of the gap that an effect closes, for a headline; empty where it closes none. Where it closes nothing for
/// certain alone, that of all that were found together: two effects may hide each other.
pub(in crate::report) fn closes(answer: &Answer, id: &str) -> String {
    let of = |id: &str| answer.effects.iter().find(|e| e.id == id);
    // beside an unknown cause without a remainder the share is one of what was found, and not of the gap
    if answer.verdict == Verdict::Unknown && answer.remainder.is_none() {
        return String::new();
    }
    let alone = of(id).and_then(|e| e.gap_closed_ci95).is_some_and(|[low, _]| low > 0.0);
    let others: Vec<&str> = answer.together.iter().map(String::as_str).filter(|other| *other != id).collect();
    let all = answer.remainder.as_ref().map(|left| 1.0 - left.share).filter(|all| *all > 0.0);
    if let (false, [first, rest @ ..], Some(all), Verdict::Identified) = (alone, &others[..], all, answer.verdict) {
        let rest = if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
        return format!("; with {} ({first}){rest} it closes {} of the gap", title(first), percent(all));
    }
    let effect = of(id).filter(|e| e.gap_closed.is_some_and(|share| share > 0.0));
    match effect.and_then(|e| e.gap_closed.zip(e.gap_closed_ci95)) {
        // the interval stands in the section on how far the gap shrinks
        Some((share, [low, _])) if low <= 0.0 => {
            format!("; it closes {} of the gap, and its 95 % interval holds zero", percent(share))
        }
        _ => effect.and_then(closed).map(|c| format!("; it closes {c} of the gap")).unwrap_or_default(),
    }
}
