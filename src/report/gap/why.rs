//! The trail of a diagnosis as Markdown: stage by stage, everything that was tried and why it was taken or not.

use super::{GapReport, significant};
use crate::files::mark;
use crate::gap::trace::{Decision, Limit, Step, TraceStage};
use std::fmt::Write;

/// Heading of a stage, and what its table compares.
pub(in crate::report) fn heading(stage: TraceStage) -> [&'static str; 2] {
    match stage {
        TraceStage::Data => ["Data", "Rows and readings that are used, filled in or removed."],
        TraceStage::Clocks => ["Clocks", "Time offsets between the streams of a recording."],
        TraceStage::Screening => [
            "Screening",
            "Each effect of the library and each free form, added alone to the nominal simulator: gain in ln weight, prior odds \
             included.",
        ],
        TraceStage::Readings => ["Readings", "Noise levels as the innovations have them, and single readings far off."],
        TraceStage::Preprocessing => ["Preprocessing", "The same recording, read in other ways."],
        TraceStage::Samples => [
            "Distribution of the samples",
            "The series without the set's spectrum: heavy tails, bursts, events, a level that varies.",
        ],
        TraceStage::Sets => [
            "Sets",
            "Effects together, most probable first; nats are the ln odds against the first. All keep their probability.",
        ],
        TraceStage::Additions => [
            "Additions",
            "Each further effect and free form that is still considered, added to the best set of correlated terms.",
        ],
        TraceStage::LeaveOneOut => [
            "Leaving one out",
            "Each effect of the best set is taken out, and the others are fitted again where the loss is not beyond doubt. An \
             effect that is not missed has no name.",
        ],
        TraceStage::Probabilities => ["Probabilities", "The largest part of the gap, by all sets."],
        TraceStage::HoldOut => ["Hold-out", "Gain in log score on the recording on which the gap is measured."],
        TraceStage::Naming => ["Names", "Effects that lead, or that are not told after all."],
    }
}

pub(in crate::report) fn decision(decision: Decision) -> &'static str {
    match decision {
        Decision::Taken => "taken",
        Decision::Rejected => "rejected",
        Decision::Removed => "removed",
        Decision::Estimated => "estimated",
        Decision::Noted => "noted",
    }
}

/// A cell of a table: no bar ends it early.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

pub(in crate::report) fn limit(Limit { name, value, unit }: &Limit) -> String {
    format!("{name}: {} {unit}", significant(*value, 3)).trim_end().to_owned()
}

/// A column of a table: its heading, and its cells. What is the same in all rows is said once, above.
struct Column {
    heading: &'static str,
    cells: Vec<String>,
}

impl Column {
    fn of(heading: &'static str, steps: &[&Step], text: impl Fn(&Step) -> String) -> Self {
        Self { heading, cells: steps.iter().map(|step| cell(&text(step))).collect() }
    }

    /// The text of all rows, where there are several and it is the same in all.
    fn common(&self) -> Option<&str> {
        let first = self.cells.first().filter(|_| self.cells.len() > 1)?;
        self.cells.iter().all(|c| c == first).then_some(first)
    }
}

/// The steps of a stage as a table.
fn table(out: &mut String, steps: &[&Step]) {
    let nats = |step: &Step| step.nats.map_or_else(String::new, |n| format!("{n:.1}"));
    let mut columns = vec![
        Column::of("decision", steps, |step| decision(step.decision).into()),
        Column::of("subject", steps, |step| step.subject.clone()),
        Column::of("nats", steps, nats),
    ];
    let against = Column::of("held against", steps, |step| step.limit.as_ref().map_or_else(String::new, limit));
    let reason = Column::of("reason", steps, |step| step.reason.clone());
    let has_nats = steps.iter().any(|step| step.nats.is_some());
    for (column, title) in [(reason, if has_nats { "Nats" } else { "Reason" }), (against, "Held against")] {
        match column.common() {
            Some("") => {}
            Some(text) => _ = writeln!(out, "{title}: {}.\n", text.trim_end_matches('.')),
            None => columns.push(column),
        }
    }
    let headings: Vec<&str> = columns.iter().map(|c| c.heading).collect();
    let rules: Vec<&str> = headings.iter().map(|h| if *h == "nats" { "---:" } else { "---" }).collect();
    let _ = writeln!(out, "| {} |\n|{}|", headings.join(" | "), rules.join("|"));
    for row in 0..steps.len() {
        let cells: Vec<&str> = columns.iter().map(|c| c.cells[row].as_str()).collect();
        let _ = writeln!(out, "| {} |", cells.join(" | "));
    }
}

impl GapReport<'_> {
    /// The trail as Markdown: a table for each stage at which something was tried.
    #[must_use]
    pub(crate) fn why(&self) -> String {
        let mut out = String::new();
        // writing to a String cannot fail
        let _ = writeln!(out, "# Why: {}\n\nRecording: {}.", self.verdict_line(), self.recording);
        if let Some(name) = self.held_out {
            let _ = writeln!(out, "Hold-out: {name}.");
        }
        let _ = writeln!(
            out,
            "\nNats are natural logarithms of odds: 3 nats are 20 to 1, 7 nats are 1100 to 1. Each table says what its nats compare. \
             Ids that begin with `free.` are free forms: corrections that stand for causes outside the library."
        );
        // by it gyroid knows the file, and replaces it unasked
        let _ = writeln!(out, "\n<!-- {} -->", mark::text());
        let mut stages: Vec<TraceStage> = self.answer.trace.iter().map(|s| s.stage).collect();
        stages.sort_unstable();
        stages.dedup();
        for (i, stage) in stages.into_iter().enumerate() {
            let [title, about] = heading(stage);
            let _ = writeln!(out, "\n## {}. {title}\n\n{about}\n", i + 1);
            let steps: Vec<&Step> = self.answer.trace.iter().filter(|s| s.stage == stage).collect();
            table(&mut out, &steps);
        }
        out
    }
}
