//! A plan: what a log cannot tell apart, experiments by what they are worth, and the course of the first.

use super::gap::words::{name_and_unit, title};
use super::numbers::significant;
use crate::gap::plan::{Pair, Plan, Rival, Suggestion};
use crate::units::duration_text;
use std::fmt::Write;

/// A plan for people.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlanReport<'a> {
    /// Name of the log.
    pub log: &'a str,
    /// The plan.
    pub plan: &'a Plan,
}

/// Most corners of a course that a terminal shows.
const CORNERS: usize = 12;

impl PlanReport<'_> {
    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let p = self.plan;
        let mut out = format!("PLAN after {}\n\n  ", self.log);
        if p.experiments.is_empty() {
            out.push_str("there are no effects in question that this log cannot tell apart");
        } else {
            out.push_str("effects in question, each as large as the log would have it:");
            p.rivals.iter().for_each(|rival| out.push_str(&of_rival(rival)));
            let name_width = 2 + p.experiments.iter().map(|e| e.name.len()).max().unwrap_or(0);
            let _ = write!(
                out,
                "\n\n  told apart from {} nats on; evidence and probability are those of the pair that an experiment tells worst\n\n  \
                 {:<name_width$}{:<10}{:<14}{:<14}pairs told apart",
                significant(p.resolution_nats, 2),
                "experiment",
                "lasts",
                "evidence",
                "probability"
            );
            p.experiments.iter().for_each(|e| out.push_str(&row(e, p.resolution_nats, name_width)));
        }
        match (p.first(), &p.needed) {
            (Some(first), _) => out.push_str(&course(first, p.load_kg)),
            (None, Some(needed)) => {
                let _ = write!(out, "\n\n  no experiment tells all of them apart. {needed}");
            }
            (None, None) => {}
        }
        for (i, note) in p.notes.iter().enumerate() {
            let _ = write!(out, "{}\n  note: {note}", if i == 0 { "\n" } else { "" });
        }
        out
    }
}

fn of_rival(rival: &Rival) -> String {
    let sizes: Vec<String> = rival
        .parameters
        .iter()
        .map(|(parameter, value)| {
            let (name, unit) = name_and_unit(parameter);
            format!("{name} {} {unit}", significant(*value, 3)).trim_end().to_string()
        })
        .collect();
    format!("\n  {:<58}{}", format!("{} ({})", title(&rival.id), rival.id), sizes.join(", "))
}

fn row(e: &Suggestion, resolution_nats: f64, name_width: usize) -> String {
    let told = e.pairs.iter().filter(|p: &&Pair| p.nats >= resolution_nats).count();
    let nats = format!("{:.1} nats", e.nats);
    let of = e.pairs.len();
    let alone = if e.alone { ", by itself" } else { "" };
    let lasts = duration_text(e.duration_s);
    format!("\n  {:<name_width$}{lasts:<10}{nats:<14}{:<14.2}{told} of {of}{alone}", e.name, e.probability)
}

fn course(first: &Suggestion, carried_kg: f64) -> String {
    let mut out = format!("\n\nFirst: {}\n  {}", first.name, first.how);
    if first.alone {
        out.push_str(" Diagnose the new log by itself.");
    } else {
        let loads = [("LOG", carried_kg), ("NEW", first.load_kg.unwrap_or(0.0))];
        let loads = loads.iter().filter(|(_, kg)| *kg > 0.0).map(|(log, kg)| format!(" --load {log}={kg}"));
        let _ = write!(out, " Diagnose both logs together: --fit LOG --fit NEW{}.", loads.collect::<String>());
    }
    if first.commands.is_empty() {
        return out;
    }
    let _ = write!(out, "\n\n  {:>9}{:>12}{:>16}", "t s", "speed m/s", "yaw rate rad/s");
    for c in first.commands.iter().take(CORNERS) {
        let _ = write!(out, "\n  {:>9.2}{:>12.3}{:>16.3}", c.t_s, c.speed_m_s, c.yaw_rate_rad_s);
    }
    if first.commands.len() > CORNERS {
        let _ = write!(out, "\n  … {} corners in all, linear between them", first.commands.len());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::registry;
    use crate::gap::plan::Command;
    use crate::signal::{Log, TimeAxis};

    fn plan(separates: bool) -> Plan {
        let [a, b] = [0, 1].map(|i| registry()[i].about());
        let rival = |about: &crate::effects::About| Rival {
            id: about.id.into(),
            parameters: [(about.size().to_string(), 0.0125)].into(),
            beside: Vec::new(),
        };
        let pair = |truth: &str, rival: &str, nats: f64| Pair {
            truth: truth.into(),
            rival: rival.into(),
            nats,
            probability: 0.75,
        };
        let corner = |i: u32| Command { t_s: f64::from(i), speed_m_s: 0.5, yaw_rate_rad_s: -0.25 };
        let suggestion = Suggestion {
            name: "spins".into(),
            how: "Turn in place.".into(),
            duration_s: 60.0,
            load_kg: Some(2.8),
            alone: false,
            separates,
            nats: 5.25,
            probability: 0.75,
            shown_nats: f64::INFINITY,
            pairs: vec![pair(a.id, b.id, 5.25), pair(b.id, a.id, if separates { 9.0 } else { 1.0 })],
            commands: (0..20).map(corner).collect(),
            inputs: Log::new("plan", TimeAxis::Uniform { start_s: 0.0, step_s: 0.1, len: 2 }),
        };
        Plan {
            rivals: vec![rival(a), rival(b)],
            resolution_nats: 3.0,
            load_kg: 0.5,
            experiments: vec![suggestion],
            needed: (!separates).then(|| "Log a pose reference.".into()),
            notes: vec!["A note.".into()],
        }
    }

    #[test]
    fn the_page_tells_rivals_experiments_and_the_course() {
        let plan = plan(true);
        let text = PlanReport { log: "drive.csv", plan: &plan }.text();
        for part in [
            "PLAN after drive.csv",
            "effects in question, each",
            "0.0125",
            "from 3.0 nats on",
            "5.2 nats",
            "2 of 2",
            "First: spins",
            "--fit LOG --fit NEW --load LOG=0.5 --load NEW=2.8.",
            "20 corners in all",
            "note: A note.",
        ] {
            assert!(text.contains(part), "{text} lacks {part}");
        }
    }

    #[test]
    fn where_nothing_separates_the_page_says_what_is_needed() {
        let mut plan = plan(false);
        let text = PlanReport { log: "drive.csv", plan: &plan }.text();
        assert!(text.contains("no experiment tells all of them apart. Log a pose reference."), "{text}");
        assert!(text.contains("1 of 2") && !text.contains("First:"), "{text}");
        plan.rivals.clear();
        plan.experiments.clear();
        plan.needed = None;
        let text = PlanReport { log: "drive.csv", plan: &plan }.text();
        assert!(text.contains("no effects in question"), "{text}");
    }
}
