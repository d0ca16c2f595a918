//! The answer from the sets compared: verdict, effects, effects named together, effects that cannot be told apart.

use super::{Alike, Answer, EffectAnswer, FreeFormAnswer, Place, Verdict};
use crate::effects::{Parameters, by_id};
use crate::gap::selection::findings::Findings;
use crate::gap::selection::sets::{Main, Part};

/// Effects less probable than this are not listed.
const LISTED: f64 = 0.01;
/// Least probability of a rival main effect, relative to the main one, that cannot be told apart from it.
pub(crate) const RIVAL: f64 = 0.05;
/// Free forms are ranked by their probabilities rounded to one over this.
const PERCENT: f64 = 100.0;
/// The answer that follows from `findings`; `place`: where an effect shows, none: a cause without a name.
pub(crate) fn answer(findings: &Findings, place: impl Fn(Option<&str>) -> Option<Place>) -> Answer {
    let mains = findings.mains();
    let probability = |m: &Main| mains.iter().find(|x| x.0 == *m).map_or(0.0, |x| x.1);
    let (none, unknown) = (probability(&Main::None), probability(&Main::Unknown));
    let rivals: Vec<(String, f64)> = mains
        .iter()
        .filter_map(|(m, p)| match m {
            Main::Effect(id) => Some((id.clone(), *p)),
            _ => None,
        })
        .collect();
    let (verdict, main) = match findings.top() {
        Main::None => (Verdict::None, None),
        Main::Unknown => (Verdict::Unknown, None),
        Main::Effect(id) => (Verdict::Identified, Some(id)),
    };
    let mut effects = Vec::new();
    let mut free_forms = Vec::new();
    for (id, named, presence) in findings.ids() {
        let as_main = findings.best_with(&id, true).is_some();
        let Some(part) = findings.best_with(&id, as_main).and_then(|s| s.part(&id)) else { continue };
        if named && presence >= LISTED {
            effects.push(EffectAnswer {
                parameters: part.parameters.clone(),
                std: part.std.clone(),
                share: share(findings, &id),
                evidence_nats: part.missed_nats,
                ..EffectAnswer::new(&id, presence)
            });
        } else if !named && presence >= LISTED {
            free_forms.push(FreeFormAnswer {
                id,
                probability: presence,
                share_nats: part.share,
                description: part.description.clone(),
            });
        }
    }
    // of free forms equally probable to a percent, the one with the largest share first
    let closes = |f: &FreeFormAnswer| share(findings, &f.id).unwrap_or(0.0);
    free_forms.sort_by(|a, b| {
        let rank = |f: &FreeFormAnswer| (PERCENT * f.probability).round();
        rank(b).total_cmp(&rank(a)).then(closes(b).total_cmp(&closes(a)))
    });
    let idle = |(part, presence): &(Part, f64)| EffectAnswer {
        idle: true,
        parameters: part.parameters.clone(),
        std: part.std.clone(),
        ..EffectAnswer::new(&part.id, *presence)
    };
    effects.extend(findings.idle.iter().map(idle));
    // the main effect first, whatever its rank by presence
    if let Some(at) = main.as_ref().and_then(|m| effects.iter().position(|e| e.id == *m)) {
        let first = effects.remove(at);
        effects.insert(0, first);
    }
    let mut together = if verdict == Verdict::None { Vec::new() } else { findings.together(main.as_deref()) };
    // an effect whose loss the other effects make up for is not named
    let worth = |e: &EffectAnswer| findings.is_worth_naming(e.evidence_nats, e.probability);
    together.retain(|id| effects.iter().any(|e| e.id == *id && worth(e)));
    if let Some(m) = &main {
        // it comes first, and is one of them
        together.retain(|id| id != m);
        together.insert(0, m.clone());
    }
    let (cannot_tell_apart, alike) = classes(findings, &rivals);
    Answer {
        verdict,
        main_probability: rivals.first().map_or(0.0, |r| r.1),
        none_probability: none,
        unknown_probability: unknown,
        place: if verdict == Verdict::None { None } else { place(main.as_deref()) },
        main,
        effects,
        together,
        remainder: None,
        time_offsets: Vec::new(),
        nearest: None,
        cannot_tell_apart,
        alike,
        free_forms,
        equations: Vec::new(),
        gap: Vec::new(),
        navigation: None,
        notes: findings.notes.clone(),
        trace: findings.trace.clone(),
    }
}

/// The effects judged present, each with its parameters.
pub(crate) fn found(findings: &Findings) -> Vec<(String, Parameters)> {
    let one = |id: String| {
        let parameters = findings.best_with(&id, false)?.part(&id)?.parameters.clone();
        Some((id, parameters))
    };
    answer(findings, |_| None).together.into_iter().filter_map(one).collect()
}

/// Share of the effect in the most probable set that holds it, 0 to 1; none where that set gains nothing.
fn share(findings: &Findings, id: &str) -> Option<f64> {
    let set = findings.best_with(id, false)?;
    let total: f64 = set.parts.iter().map(|p| p.share.max(0.0)).sum();
    (total > 0.0).then(|| set.part(id).map_or(0.0, |p| p.share.max(0.0)) / total)
}

/// Main effects of similar probability, which this recording cannot tell apart: at most one class, with its
/// description.
fn classes(findings: &Findings, rivals: &[(String, f64)]) -> (Vec<Vec<String>>, Vec<Alike>) {
    // main effects too improbable to be listed form no class
    let Some((first, p)) = rivals.first().filter(|r| r.1 >= LISTED) else { return Default::default() };
    let class: Vec<String> = rivals.iter().filter(|r| r.1 >= RIVAL * p).take(3).map(|r| r.0.clone()).collect();
    if class.len() < 2 {
        return Default::default();
    }
    let none = findings.sets.iter().find(|s| s.parts.is_empty()).map(|s| s.ln_weight);
    let weight = |id: &String| findings.best_with(id, true).map(|s| s.ln_weight);
    let overlap = class[1..]
        .iter()
        .filter_map(|id| {
            let (a, b) = (weight(first)?, weight(id)?);
            // share of the evidence over no effect that the rival reaches too
            let base = none.unwrap_or(a.min(b) - 10.0);
            Some(((b - base).max(0.0) / (a - base).max(1e-9)).clamp(0.0, 1.0))
        })
        .fold(1.0, f64::min);
    let separate_by = separate(&class);
    (vec![class.clone()], vec![Alike { ids: class, overlap, separate_by }])
}

fn separate(class: &[String]) -> String {
    let mut what: Vec<&str> = Vec::new();
    for one in class.iter().filter_map(|id| by_id(id)?.separated_by()) {
        if !what.contains(&one) {
            what.push(one);
        }
    }
    if what.is_empty() {
        what.push("a longer recording");
    }
    what.join("; ")
}
