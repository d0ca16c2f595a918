//! A score as text and as JSON.

use super::bands::Band;
use super::intervals::{Middle, Rate};
use super::score::{ByEffect, Score};
use serde_json::{Value, json};
use std::fmt::Write;

impl Score {
    /// The score as JSON; every rate with counts and its Wilson interval.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        let rates: Vec<Value> = self.rates.iter().map(|(what, rate)| json!({"what": what, "rate": rate})).collect();
        let unlisted: Vec<Value> = self.unlisted.iter().map(|(id, rate)| json!({"id": id, "rate": rate})).collect();
        json!({
            "cases": self.cases,
            "missing": self.missing,
            "rates": rates,
            "by_nats": self.by_nats,
            "pairs_by_nats": self.pairs_by_nats,
            "by_effect": self.by_effect,
            "unlisted": unlisted,
            "calibration": self.calibration,
            "unknown_roc": self.unknown_roc,
            "gap_closed_right": self.gap_closed_right,
            "gap_closed_wrong": self.gap_closed_wrong,
            "gap_closed_of_oracle": self.of_oracle,
            "parameter_error_relative": self.parameter_error,
            "seconds_per_case": self.seconds.map(|[median, p95]| json!({"median": median, "p95": p95})),
            "confusion": self.confusion,
            "misses": self.misses,
        })
    }

    /// The score for people: tables first, then every miss with its cause.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let mut out = String::new();
        self.write_rates(&mut out);
        self.write_effects(&mut out);
        self.write_misses(&mut out);
        out
    }

    fn write_rates(&self, out: &mut String) {
        let _ = writeln!(out, "{} cases, {} without an answer; intervals hold 95 %\n", self.cases, self.missing);
        for (what, rate) in &self.rates {
            let _ = writeln!(out, "{what:64} {}", words(rate));
        }
        let c = &self.calibration;
        let _ = writeln!(out, "{:64} {}", "confidence of 0.9 and more: right", words(&c.confident));
        if let (Some(ece), Some(perfect)) = (c.ece, c.ece_perfect_p95) {
            let _ = writeln!(
                out,
                "{:64} {ece:.3} over {}; 95 % of perfectly calibrated methods stay below {perfect:.3}",
                "calibration error (ECE)", c.of
            );
        }
        if let Some(roc) = &self.unknown_roc {
            let [low, high] = roc.area_ci95;
            let _ = writeln!(
                out,
                "{:64} {:.3} ({low:.3} to {high:.3})",
                "unlisted or not by unknown_probability: area under ROC", roc.area
            );
        }
        for (what, middle) in [
            ("share of the gap closed, main effect right", &self.gap_closed_right),
            ("share of the gap closed, main effect wrong", &self.gap_closed_wrong),
            ("gain on the recording held out, share of an oracle's", &self.of_oracle.as_ref().map(|o| o.share)),
            ("relative error of a parameter", &self.parameter_error),
        ] {
            if let Some(Middle { median, quartiles: [low, high], of }) = middle {
                let _ = writeln!(out, "{what:64} median {median:.3}, quartiles {low:.3} and {high:.3}, over {of}");
            }
        }
        if let Some([median, p95]) = self.seconds {
            let _ = writeln!(out, "{:64} median {median:.2}, 95th percentile {p95:.2}", "seconds a case");
        }
    }

    fn write_effects(&self, out: &mut String) {
        write_bands(out, "one effect: named", &self.by_nats);
        write_bands(out, "two, the weaker's nats: both", &self.pairs_by_nats);
        if !self.by_effect.is_empty() {
            let _ = writeln!(
                out,
                "\n{:32} {:>7} {:>7} {:>7} {:>7}   relative error of parameters, median",
                "one effect: named", "weak", "medium", "strong", "all"
            );
        }
        for ByEffect { id, all, strengths, parameter_errors } in &self.by_effect {
            let short = |rate: &Rate| format!("{}/{}", rate.right, rate.of);
            let of = |s: &str| strengths.get(s).map_or_else(String::new, short);
            let errors: Vec<String> =
                parameter_errors.iter().map(|(name, m)| format!("{name} {:.3}", m.median)).collect();
            let _ = writeln!(
                out,
                "{id:32} {:>7} {:>7} {:>7} {:>7}   {}",
                of("weak"),
                of("medium"),
                of("strong"),
                short(all),
                errors.join(", ")
            );
        }
        if !self.unlisted.is_empty() {
            let _ = writeln!(out, "\n{:32} said unknown", "unlisted effect");
        }
        for (id, rate) in &self.unlisted {
            let _ = writeln!(out, "{id:32} {}", words(rate));
        }
    }

    fn write_misses(&self, out: &mut String) {
        if !self.misses.is_empty() {
            let _ = writeln!(out, "\nmisses");
        }
        for miss in &self.misses {
            let j = &miss.judged;
            let truth = if j.truth.is_empty() { "none".into() } else { j.truth.join(" + ") };
            let shown = |p: Option<f64>| p.map_or_else(|| "-".into(), |p| format!("{p:.2}"));
            let given: Vec<String> =
                j.truth.iter().filter_map(|t| Some(format!("{t} {:.2}", j.truth_probability.get(t)?))).collect();
            let _ = writeln!(
                out,
                "{:20} {:6} {:5} {truth}: {}; answered {} at {}{}{}",
                j.name,
                j.strength,
                if j.messy { "messy" } else { "" },
                miss.cause,
                j.answered,
                shown(j.confidence),
                if given.is_empty() { "" } else { ", truth at " },
                given.join(", ")
            );
        }
    }
}

/// `12/20 = 0.600 (0.387 to 0.781)`
fn words(rate: &Rate) -> String {
    match (rate.rate, rate.ci95) {
        (Some(p), Some([low, high])) => format!("{}/{} = {p:.3} ({low:.3} to {high:.3})", rate.right, rate.of),
        _ => "0/0".into(),
    }
}

/// Bands under the heading `what`; nothing where there are none.
fn write_bands(out: &mut String, what: &str, bands: &[Band]) {
    if !bands.is_empty() {
        let _ = writeln!(out, "\n{what:30} {:>8} {:>12} {:>17}", "alone", "with others", "an oracle names");
    }
    for Band { from_nats, to_nats, alone, with_others, oracle } in bands {
        let range = to_nats.map_or_else(|| format!("from {from_nats} nats"), |to| format!("{from_nats} to {to} nats"));
        let [alone, with_others] = [alone, with_others].map(|rate| format!("{}/{}", rate.right, rate.of));
        let _ = writeln!(out, "{range:30} {alone:>8} {with_others:>12} {oracle:>17.3}");
    }
}
