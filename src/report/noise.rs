//! The report of the noise model: verdict first, then terms in SI and in datasheets' units, refusals, evidence, ledger.

use super::fit::LogFacts;
use super::numbers::{known_digits, probability, significant};
use super::plot::Picture;
use super::plot::noise::NoiseFigure;
use super::temperature::{drift_json, drift_text};
use crate::error::Result;
use crate::identify::terms::{NoiseModel, RecordingAdvice, Refusal, TermEstimate};
use crate::noise::datasheet::{Datasheet, Stated};
use crate::noise::{AllanPoint, BandForm, Deviation, TermKind};
use crate::units::{RAD_S_PER_DEG_H, RAD_S_PER_DEG_S, duration_text};
use serde_json::{Value, json};
use std::fmt::Write;

/// The noise model of a log, and references to compare it with.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseReport {
    /// The log.
    pub log: LogFacts,
    /// The model.
    pub model: NoiseModel,
    /// The datasheet to compare with.
    pub datasheet: Option<Datasheet>,
    /// A model that fits fails with this probability.
    pub level: f64,
}

/// A number of a datasheet and the same of this log, in the datasheet's unit.
struct Compared {
    stated: Stated,
    measured: f64,
    ci95: [f64; 2],
}

impl NoiseReport {
    /// Whether the model fits the log.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.model.goodness.p_value > self.level
    }

    /// The verdict in one line.
    #[must_use]
    pub fn verdict_line(&self) -> String {
        let names: Vec<String> = self.model.terms.iter().map(name).collect();
        let one = names.len() == 1;
        let (names, p) = (names.join(" + "), equals(self.model.goodness.p_value));
        if self.fits() {
            let explain = if one { "alone explains" } else { "explain" };
            return format!("FIT FOR USE: {names} {explain} the log (goodness of fit p {p})");
        }
        let place = self.model.goodness.worst().map_or(String::new(), |b| {
            let more = if b.ratio > 1.0 { "more" } else { "less" };
            format!(
                ": at {} to {} Hz there is {} times the power that they make, {more} than chance \
                 allows; --max-frequency leaves out what is above a frequency",
                significant(b.from_hz, 2),
                significant(b.to_hz, 2),
                significant(b.ratio, 3)
            )
        });
        let explain = if one { "alone does not" } else { "do not" };
        format!("NOT FIT FOR USE: {names} {explain} explain the log (goodness of fit p {p}){place}")
    }

    /// The page for a terminal.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        let m = &self.model;
        // writing to a String cannot fail
        let _ = writeln!(out, "{}", self.verdict_line());
        let _ = writeln!(
            out,
            "\n{}, column {} [{}]: {} samples at {} Hz, {}\n",
            self.log.name,
            self.log.column,
            self.log.unit,
            m.samples,
            significant(1.0 / m.step_s, 4),
            duration_text(m.span_s),
        );
        for note in &self.log.notes {
            let _ = writeln!(out, "  note: {note}");
        }
        if m.filled > 0 {
            let _ = writeln!(out, "  note: {} missing samples were filled with noise about their neighbours", m.filled);
        }
        if !m.lines.is_empty() {
            let all = m.lines.iter().take(5);
            let all: Vec<String> = all.map(|l| significant(l.frequency_hz, 4)).collect();
            let more = if m.lines.len() > 5 { format!(" and {} more", m.lines.len() - 5) } else { String::new() };
            let _ = writeln!(out, "  note: lines at {} Hz{more} are left out of the fit", all.join(", "));
        }
        let _ = writeln!(out, "terms, estimated together (two-sided densities)");
        let _ = writeln!(out, "  {:<24}{:>12}{:>11}   95 % interval", "", "estimate", "std");
        m.terms.iter().for_each(|t| term_text(t, &mut out));
        if !m.refused.is_empty() {
            let _ = writeln!(out, "\nnot supported by this log");
            self.refusals_text(&mut out);
        }
        self.warm_up_text(&mut out);
        self.evidence_text(&mut out);
        self.deviations_text(&mut out);
        self.datasheet_text(&mut out);
        if let Some(drift) = &m.drift {
            drift_text(drift, &mut out);
        }
        self.ledger_text(&mut out);
        out
    }

    /// Terms that the log does not support, and how long to record for them.
    pub(super) fn refusals_text(&self, out: &mut String) {
        self.model.refused.iter().for_each(|r| refusal_text(r, self.model.span_s, out));
    }

    pub(super) fn warm_up_text(&self, out: &mut String) {
        let w = &self.model.warm_up_influence;
        let Some(fit) = &self.model.warm_up else {
            let why = if w.removed { "" } else { ": none with a known time constant was found, or it was to stay" };
            let _ = writeln!(out, "\nwarm-up: not removed{why}");
            return;
        };
        let below = if w.removed_is_upper_bound { "below " } else { "" };
        let _ = writeln!(
            out,
            "\nwarm-up: removed first (C1 {} rad/s, T {}); left in, it would make K {}, removed K is {below}{} rad/s²/√Hz",
            known_digits(fit.c1_rad_s.estimate, fit.c1_rad_s.std),
            duration_text(fit.time_constant_s.estimate),
            significant(w.rate_random_walk_left_in, 3),
            significant(w.rate_random_walk_removed, 3),
        );
    }

    fn evidence_text(&self, out: &mut String) {
        let m = &self.model;
        let _ = writeln!(out, "\nsets of terms by evidence");
        for set in m.selection.iter().take(4) {
            let names: Vec<_> = set.terms.iter().map(|k| k.symbol()).collect();
            let _ = writeln!(
                out,
                "  {:<20} probability {:<8} ln evidence {:>8} BIC {:>+9.1}",
                names.join(" + "),
                probability(set.probability),
                format!("-{:.1}", set.ln_evidence_below_best),
                set.bic_above_best
            );
        }
        let g = &m.goodness;
        let _ = writeln!(
            out,
            "goodness of fit: p {} by {} logs drawn from the model, {} bands of frequency",
            equals(g.p_value),
            g.draws,
            g.bands.len()
        );
        if !g.not_judged_hz.is_empty() {
            let all =
                g.not_judged_hz.iter().map(|[a, b]| format!("{} to {} Hz", significant(*a, 3), significant(*b, 3)));
            let _ = writeln!(
                out,
                "  not judged: {}, where the bands make more than a hundredth of the power",
                all.collect::<Vec<_>>().join(", ")
            );
        }
        if let Some(w) = &m.wavelet {
            let terms: Vec<String> = w
                .terms
                .iter()
                .map(|t| format!("{} {} ± {}", t.id.symbol(), known_digits(t.estimate, t.std), significant(t.std, 2)))
                .collect();
            let _ = writeln!(out, "by {} wavelet moments: {} (p {})", w.moments, terms.join(", "), equals(w.p_value));
        }
    }

    fn deviations_text(&self, out: &mut String) {
        let of = |d: Deviation| self.model.deviations.iter().find(|f| f.0 == d).map(|f| f.1.as_slice());
        let (Some(total), Some(modified), Some(hadamard)) =
            (of(Deviation::Total), of(Deviation::Modified), of(Deviation::Hadamard))
        else {
            return;
        };
        let Some(allan) = of(Deviation::Overlapping) else { return };
        let _ =
            writeln!(out, "\ndeviations, °/h, of the log without its warm-up (terms: Allan deviation of the model)");
        let _ = writeln!(
            out,
            "  {:>10}{:>12}  {:<24}{:>10}{:>10}{:>10}{:>10}",
            "averaged", "Allan", "95 % interval", "modified", "Hadamard", "total", "terms"
        );
        for t in total {
            let Some(p) = allan.iter().find(|p| p.m == t.m) else { continue };
            let beside = |points: &[AllanPoint]| {
                points.iter().find(|q| q.m == t.m).map_or("-".to_string(), |q| deg_h(q.deviation_rad_s))
            };
            let _ = writeln!(
                out,
                "  {:>10}{:>12}  {:<24}{:>10}{:>10}{:>10}{:>10}",
                duration_text(t.tau_s),
                deg_h(p.deviation_rad_s),
                format!("[{}, {}]", deg_h(p.ci95[0]), deg_h(p.ci95[1])),
                beside(modified),
                beside(hadamard),
                deg_h(t.deviation_rad_s),
                deg_h(self.model.allan_deviation(t.tau_s)),
            );
        }
    }

    /// The lowest point of the overlapping Allan deviation: what datasheets call in-run bias stability.
    fn lowest(&self) -> Option<&AllanPoint> {
        let points = &self.model.deviations.iter().find(|f| f.0 == Deviation::Overlapping)?.1;
        // the last few points are known to half of themselves, and dip by chance
        let known = points.iter().filter(|p| p.degrees_of_freedom > 8.0);
        known.min_by(|a, b| a.deviation_rad_s.total_cmp(&b.deviation_rad_s))
    }

    fn compared(&self) -> Vec<Compared> {
        let stated = self.datasheet.map(|d| d.stated()).unwrap_or_default();
        let one = |stated: Stated| -> Option<Compared> {
            let per_si = stated.value / stated.size_si;
            let (measured, ci95) = match stated.id {
                TermKind::BiasInstability => {
                    let lowest = self.lowest()?;
                    let flicker = TermKind::BiasInstability.allan_variance(1.0, 0.0).sqrt();
                    let scale = per_si / flicker;
                    (lowest.deviation_rad_s * scale, lowest.ci95.map(|v| v * scale))
                }
                id => {
                    let term = self.model.term(id)?;
                    (term.estimate * per_si, term.ci95.map(|v| v * per_si))
                }
            };
            Some(Compared { stated, measured, ci95 })
        };
        stated.into_iter().filter_map(one).collect()
    }

    pub(super) fn datasheet_text(&self, out: &mut String) {
        let Some(sheet) = &self.datasheet else { return };
        let _ = writeln!(out, "\ndatasheet {} ({})", sheet.name, sheet.source);
        for c in self.compared() {
            let ratio = c.measured / c.stated.value;
            let _ = writeln!(
                out,
                "  {:<24} stated {} {}, this log {} [{}, {}]: {} times",
                c.stated.name,
                c.stated.value,
                c.stated.unit,
                significant(c.measured, 3),
                significant(c.ci95[0], 3),
                significant(c.ci95[1], 3),
                significant(ratio, 2),
            );
        }
    }

    fn ledger_text(&self, out: &mut String) {
        let l = &self.model.ledger;
        let _ = writeln!(
            out,
            "\nheading error over {} without correction, by cause (bias known at its start)",
            duration_text(l.horizon_s)
        );
        for e in &l.entries {
            let size = e.heading_std_rad.map_or("not known".to_string(), |v| {
                let share = if e.counted { format!("{:>5.1} %", 100.0 * e.share) } else { "  beside".to_string() };
                format!("{:>10} °  {share}", significant(v.to_degrees(), 3))
            });
            let _ = writeln!(out, "  {size:<22} {}", e.cause);
        }
        let _ = writeln!(
            out,
            "  {:>10} °  all that count: a filter without bias state should assume {} rad/s/√Hz, {} times N",
            significant(l.heading_std_rad.to_degrees(), 3),
            significant(l.noise_density_rad_s_sqrt_hz, 3),
            significant(l.factor, 3),
        );
        let _ = writeln!(
            out,
            "  {:>13} with a bias state that walks by K: {} rad/s/√Hz",
            "",
            significant(l.noise_density_with_bias_state_rad_s_sqrt_hz, 3)
        );
    }

    /// The documented JSON of `gyroid noise --json`. A bound that does not exist is null.
    #[must_use]
    pub fn json(&self) -> Value {
        let m = &self.model;
        let terms: Vec<Value> = m.terms.iter().map(term_json).collect();
        let deviations: serde_json::Map<String, Value> =
            m.deviations.iter().map(|(d, points)| (d.id().to_string(), json!(points))).collect();
        let datasheet = self.datasheet.map(|sheet| {
            let rows = self.compared().into_iter().map(|c| {
                json!({
                    "id": c.stated.id,
                    "name": c.stated.name,
                    "stated": c.stated.value,
                    "measured": c.measured,
                    "ci95": c.ci95,
                    "ratio": c.measured / c.stated.value,
                    "unit": c.stated.unit,
                })
            });
            json!({ "name": sheet.name, "source": sheet.source, "compared": rows.collect::<Vec<_>>() })
        });
        json!({
            "verdict": if self.fits() { "fit_for_use" } else { "does_not_fit" },
            "verdict_text": self.verdict_line(),
            "terms": terms,
            "correlation": m.correlation,
            "refused": m.refused,
            "selection": m.selection,
            "goodness": m.goodness,
            "wavelet_moments": m.wavelet,
            "deviations": deviations,
            "allan_with_warm_up": m.with_warm_up,
            "warm_up": m.warm_up.as_ref().map(|f| json!({
                "c1_rad_s": f.c1_rad_s,
                "c2_rad_s": f.c2_rad_s,
                "time_constant_s": f.time_constant_s,
            })),
            "warm_up_influence": m.warm_up_influence,
            "temperature": m.drift.as_ref().map(drift_json),
            "ledger": m.ledger,
            "datasheet": datasheet,
            "lines": m.lines,
            "samples": m.samples,
            "filled_samples": m.filled,
            "sample_rate_hz": 1.0 / m.step_s,
            "span_s": m.span_s,
            "log": self.log.json(),
        })
    }

    /// Allan deviation with intervals, the terms and their sum.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if nothing can be shown.
    pub fn picture(&self) -> Result<Picture> {
        let title = format!("{}, {}", self.log.name, self.log.column);
        NoiseFigure { title: &title, verdict: &self.verdict_line(), model: &self.model }.draw()
    }
}

fn deg_h(rate_rad_s: f64) -> String {
    significant(rate_rad_s / RAD_S_PER_DEG_H, 3)
}

fn equals(p: f64) -> String {
    let text = probability(p);
    if text.starts_with('<') { text } else { format!("= {text}") }
}

/// A term in one line.
fn name(t: &TermEstimate) -> String {
    match t.center_hz {
        Some(center) => format!("band at {} Hz", significant(center.estimate, 3)),
        None if t.id == TermKind::Bandwidth => format!("low-pass at {} Hz", significant(t.estimate, 3)),
        None => t.id.symbol().to_string(),
    }
}

/// Size in the units of datasheets.
pub(super) fn in_datasheet_units(kind: TermKind, size: f64) -> String {
    let one = |u: &crate::noise::Unit| format!("{} {}", significant(size * u.per_si, 3), u.name);
    kind.datasheet_units().iter().map(one).collect::<Vec<_>>().join(", ")
}

fn term_text(t: &TermEstimate, out: &mut String) {
    let end = |v: f64| if v > 0.0 || t.id == TermKind::RateRamp { known_digits(v, t.std) } else { "0".into() };
    let beside = match t.low_pass {
        Some(form) => format!("{}; N is that below it", form.title()),
        None => in_datasheet_units(t.id, t.estimate),
    };
    let _ = writeln!(
        out,
        "  {:<24}{:>12}{:>11}   [{}, {}] {}   ({beside})",
        format!("{} {}", t.id.symbol(), t.id.title()),
        known_digits(t.estimate, t.std),
        significant(t.std, 2),
        end(t.ci95[0]),
        end(t.ci95[1]),
        t.unit,
    );
    let form = t.band.map_or("", BandForm::title);
    for (name, value, note) in [("   centre", t.center_hz, ""), ("   width at half power", t.bandwidth_hz, form)] {
        let Some(v) = value else { continue };
        let [low, high] = v.ci95.map(|end| known_digits(end, v.std));
        let (estimate, std) = (known_digits(v.estimate, v.std), significant(v.std, 2));
        let note = if note.is_empty() { String::new() } else { format!("   ({note})") };
        let _ = writeln!(out, "  {name:<24}{estimate:>12}{std:>11}   [{low}, {high}] Hz{note}");
    }
    if let (Some(time), Some(drive)) = (&t.correlation_time_s, t.drive()) {
        let _ = writeln!(
            out,
            "  {:<24}{:>12}{:>11}   [{}, {}] s   (drive q {} rad/s/√s)",
            "   correlation time",
            known_digits(time.estimate, time.std),
            significant(time.std, 2),
            known_digits(time.ci95[0], time.std),
            known_digits(time.ci95[1], time.std),
            significant(drive, 3)
        );
    }
    if t.id == TermKind::BiasInstability {
        let flat = t.estimate * TermKind::BiasInstability.allan_variance(1.0, 0.0).sqrt();
        let _ = writeln!(out, "  {:<24}{:>12}   flat Allan deviation 0.664 B ({} °/h)", "", "", deg_h(flat));
    }
    if let Some(a) = &t.advice {
        let _ = writeln!(out, "  {:<24}   {}", "", advice_text(a, t.id));
    }
}

fn advice_text(a: &RecordingAdvice, kind: TermKind) -> String {
    let percent = 100.0 * a.wanted_relative;
    let symbol = kind.symbol();
    match (a.length_s, a.longer_by_s) {
        (Some(_), Some(longer)) if longer > 0.0 => {
            format!("record {} more to know {symbol} to ±{percent:.0} %", duration_text(longer))
        }
        (Some(_), _) => format!("this log is long enough to know such a {symbol} to ±{percent:.0} %"),
        _ => format!("no log of a usable length knows {symbol} to ±{percent:.0} %"),
    }
}

fn refusal_text(r: &Refusal, span_s: f64, out: &mut String) {
    let name = format!("{} {}", r.id.symbol(), r.id.title());
    let bound = r.upper95.map_or(String::new(), |u| {
        format!("below {} {} ({}) at 95 %, ", significant(u, 2), r.unit, in_datasheet_units(r.id, u))
    });
    let _ = writeln!(out, "  {name:<24} {bound}probability {}", probability(r.probability));
    if let Some(a) = &r.advice {
        let _ =
            writeln!(out, "  {:<24} if it is {} {}: {}", "", significant(a.if_size, 2), r.unit, advice_text(a, r.id));
    } else if r.id == TermKind::RateRamp {
        let _ = writeln!(out, "  {:<24} a log twice as long as {} divides the bound by 2.8", "", duration_text(span_s));
    }
}

fn term_json(t: &TermEstimate) -> Value {
    let mut value = json!(t);
    value["symbol"] = json!(t.id.symbol());
    let units =
        t.id.datasheet_units().iter().map(
            |u| json!({ "unit": u.name, "estimate": t.estimate * u.per_si, "ci95": t.ci95.map(|v| v * u.per_si) }),
        );
    value["datasheet_units"] = units.collect();
    if let Some(drive) = t.drive() {
        value["drive_rad_s_sqrt_s"] = json!(drive);
    }
    if t.id == TermKind::AngleRandomWalk {
        value["deg_s_sqrt_hz"] = json!(t.estimate / RAD_S_PER_DEG_S);
    }
    value
}
