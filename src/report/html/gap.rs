//! The page of a diagnosis, at rest and of drives.

use super::document::{Document, Origin, Table, Tone};
use super::fit::lines;
use super::traces;
use crate::error::Result;
use crate::gap::answer::{Answer, EffectAnswer, Verdict};
use crate::gap::rest::predictive::{Curve, Over, Shown};
use crate::gap::trace::{Step, TraceStage};
use crate::report::gap::GapReport;
use crate::report::gap::why::{decision, heading, limit};
use crate::report::gap::words::{
    about_of, capitalised, closed, curve_name, errors, measured_on, metric_cells, over_name, parameter_cells, percent,
    title,
};
use crate::report::numbers::significant;
use crate::report::plot::correction::short;
use crate::report::plot::gap::chart;
use crate::report::plot::{HeatMap, Panel};

/// Curves that are shown beside those of time, spectrum and Allan deviation.
const CURVES: usize = 3;
/// A place that a curve's share or an equation's gain does not reach.
const NONE: f64 = f64::NAN;

/// The page of `report`.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if a number cannot be shown.
pub(crate) fn gap_page(report: &GapReport, origin: &Origin) -> Result<String> {
    let a = report.answer;
    let tone = match a.verdict {
        Verdict::None => Tone::Good,
        Verdict::Identified | Verdict::CannotTell => Tone::Open,
        Verdict::Unknown => Tone::Bad,
    };
    let held_out = report.held_out.map(|name| format!("; held out: {name}")).unwrap_or_default();
    let of = format!("Recording: {}{held_out}", report.recording);
    let verdict = report.verdict_line();
    let mut page = Document::new(&format!("Gap of {}", report.recording), tone, &verdict, &of);
    let figure = report.figure(&verdict);
    let with_effects = a.verdict == Verdict::Identified || !a.together.is_empty();

    page.numbers(numbers(report));
    page.section("Recorded against simulated");
    if report.is_drive() {
        traces::figures(&mut page, report.traces, report.held_out.is_some());
    } else {
        curves(&mut page, report.curves, with_effects);
    }

    page.section("Where the gap lies");
    if let Some(place) = &a.place {
        let time =
            place.time_s.map(|[from, to]| format!(", from {} to {} s", significant(from, 4), significant(to, 4)));
        let band =
            place.frequency_hz.map(|[from, to]| format!(", {} to {} Hz", significant(from, 3), significant(to, 3)));
        let follows = place.condition.as_ref().map(|c| format!(", following {}", c.replace('_', " ")));
        let looks = place.description.as_ref().map(|d| format!(". It looks like this: {d}"));
        page.paragraph(&format!(
            "Channel {}: {}{}{}{}{}.",
            place.channel,
            place.equation,
            time.unwrap_or_default(),
            band.unwrap_or_default(),
            follows.unwrap_or_default(),
            looks.unwrap_or_default(),
        ));
    }
    if let Some(map) = map(report)? {
        page.figure(map, "no cell stands out: what is large says where, and with what, the simulator fails.");
    }
    for panel in figure.corrections() {
        page.figure(panel, "the band holds zero nearly everywhere, and dots show no course.");
    }

    page.section("Which effect causes it");
    page.figure(
        figure.probabilities(),
        "one bar near 1 and all others near 0; several of middling length are effects that this recording cannot tell apart.",
    );
    page.table(&effects(a));
    for effect in report.judged_present().chain(nearest(report)).chain(a.effects.iter().filter(|e| e.idle)) {
        described(&mut page, effect);
    }

    page.section("How far the gap shrinks");
    page.figure(
        figure.how_far(),
        "the bars after are about as short as the floor's, which is the best to be expected.",
    );
    page.table(&measures(a, report.held_out.is_some()));
    if let Some(gain) = &a.navigation {
        page.paragraph(&format!(
            "The navigation filter errs there by {} rms with the nominal model, by {} with the augmented one; its NIS goes from {} \
             to {} (1 is consistent).",
            errors(&gain.before),
            errors(&gain.after),
            significant(gain.before.nis_mean, 3),
            significant(gain.after.nis_mean, 3),
        ));
    }

    page.section("What is left");
    page.list(left(report));

    page.section("What to do about it");
    page.list(lines(|out| report.remedy(out)));

    page.section("What cannot be told");
    page.list(cannot_tell(a).iter().chain(&a.notes));
    if a.cannot_tell_apart.is_empty() && a.time_offsets.is_empty() && a.notes.is_empty() {
        page.paragraph("Nothing: no effects that this recording confounds, no clocks that disagree.");
    }
    trail(&mut page, &a.trace);
    page.folded("The same as text", &report.text());
    page.finish(origin)
}

fn numbers(report: &GapReport) -> Vec<[String; 3]> {
    let a = report.answer;
    let mut all = Vec::new();
    let effect = |id: &str| a.effects.iter().find(|e| e.id == id);
    if let Some(main) = &a.main {
        all.push(["main effect".into(), title(main).to_string(), format!("probability {:.2}", a.main_probability)]);
        if let Some(e) = effect(main).filter(|e| e.gap_closed.is_some()) {
            let interval = e.gap_closed_ci95.map(|[low, high]| format!("95 %: {} to {}", percent(low), percent(high)));
            let share = percent(e.gap_closed.unwrap_or_default());
            all.push(["closes of the gap, alone".into(), share, interval.unwrap_or_default()]);
        }
    }
    if let Some(left) = &a.remainder {
        all.push(["left of the gap".into(), percent(left.share), measured_on(report.held_out.is_some()).into()]);
    }
    all.push(["nothing is lacking".into(), format!("{:.2}", a.none_probability), "probability".into()]);
    all.push(["not in the library".into(), format!("{:.2}", a.unknown_probability), "probability".into()]);
    all
}

/// The recording over the bands of the simulators: over time, spectrum, Allan deviation, then where it leaves them most.
fn curves(page: &mut Document, curves: &[Curve], with_effects: bool) {
    let first =
        [(Over::Time, Shown::Deviation), (Over::Frequency, Shown::Power), (Over::AveragingTime, Shown::AllanDeviation)];
    let is_first = |c: &Curve| first.contains(&(c.over, c.shown));
    let mut others: Vec<&Curve> = curves.iter().filter(|c| !is_first(c) && c.share > 0.0).collect();
    others.sort_by(|a, b| b.share.total_cmp(&a.share));
    let leading = first.iter().filter_map(|f| curves.iter().find(|c| (c.over, c.shown) == *f));
    let mut shown = 0;
    for curve in leading.chain(others.into_iter().take(CURVES)) {
        let good = if with_effects {
            "the recording stays inside the band of the simulator with effects, where it leaves the nominal one."
        } else {
            "the recording stays inside the band, 19 points of 20."
        };
        page.figure(chart(curve, with_effects).into(), good);
        shown += 1;
    }
    if shown == 0 {
        page.paragraph("Not compared with simulated recordings.");
    }
}

/// Channel by condition: of a recording at rest the curves' shares of the excess, of drives the gain of a correction.
fn map(report: &GapReport) -> Result<Option<Panel>> {
    let drives = !report.answer.equations.is_empty();
    let cells: Vec<(String, String, f64)> = if drives {
        let of = |e: &crate::gap::answer::EquationAnswer| {
            (capitalised(short(&e.equation)), e.follows.replace('_', " "), e.gain_nats)
        };
        report.answer.equations.iter().map(of).collect()
    } else {
        let there = report.curves.iter().filter(|c| c.share > 0.0);
        let shown = |c: &Curve| {
            let name = curve_name(c);
            capitalised(name.split(" over ").next().unwrap_or(&name))
        };
        there.map(|c| (shown(c), over_name(c.over).to_string(), c.share)).collect()
    };
    let names = |of: fn(&(String, String, f64)) -> &String| {
        let mut all: Vec<String> = Vec::new();
        cells.iter().map(of).for_each(|name| {
            if !all.contains(name) {
                all.push(name.clone());
            }
        });
        all
    };
    let (rows, columns) = (names(|c| &c.0), names(|c| &c.1));
    if cells.is_empty() {
        return Ok(None);
    }
    let value =
        |row: &String, column: &String| cells.iter().find(|c| c.0 == *row && c.1 == *column).map_or(NONE, |c| c.2);
    let values = rows.iter().flat_map(|row| columns.iter().map(move |column| value(row, column))).collect();
    let map = HeatMap::new(rows, columns, values)?;
    Ok(Some(
        match drives {
            true => map
                .title("What a free correction of each equation gains, nats, by what it follows")
                .labels("equation", "follows")
                .places(0),
            false => map
                .title("Where the recording leaves the nominal simulator: shares of the excess, which overlap")
                .labels("quantity", "over"),
        }
        .into(),
    ))
}

fn effects(a: &Answer) -> Table {
    let mut table = Table::new([
        "effect",
        "id",
        "probability",
        "evidence lost without it, nats",
        "share of what is explained",
        "closes of the gap alone (95 %)",
    ]);
    for e in a.effects.iter().filter(|e| e.probability >= 0.005 || a.together.contains(&e.id)) {
        let idle = if e.idle { ", idle" } else { "" };
        table.row([
            format!("{}{idle}", title(&e.id)),
            e.id.clone(),
            format!("{:.2}", e.probability),
            e.evidence_nats.map_or_else(String::new, |n| format!("{n:.1}")),
            e.share.map_or_else(String::new, percent),
            closed(e).unwrap_or_default(),
        ]);
    }
    table.row(["nothing is lacking".into(), String::new(), format!("{:.2}", a.none_probability)]);
    table.row(["not in the library".into(), String::new(), format!("{:.2}", a.unknown_probability)]);
    table
}

fn nearest<'a>(report: &'a GapReport) -> Option<&'a EffectAnswer> {
    let id = &report.answer.nearest.as_ref()?.id;
    report.answer.effects.iter().find(|e| e.id == *id && !report.answer.together.contains(id))
}

/// An effect with its equation and parameters.
fn described(page: &mut Document, effect: &EffectAnswer) {
    let equation = about_of(&effect.id).map(|about| format!(": {}", about.equation)).unwrap_or_default();
    page.paragraph(&format!("{}{equation}", capitalised(title(&effect.id))));
    let mut table = Table::new(["parameter", "value", "meaning"]);
    parameter_cells(effect).into_iter().for_each(|cells| table.row(cells));
    page.table(&table);
}

fn measures(a: &Answer, held_out: bool) -> Table {
    let mut table = Table::new([measured_on(held_out), "before", "after", "floor"]);
    a.gap.iter().for_each(|m| table.row(metric_cells(m)));
    if let Some(nearest) = &a.nearest {
        for m in &nearest.gap {
            let [name, before, after, floor] = metric_cells(m);
            table.row([format!("{name}, with {} alone", title(&nearest.id)), before, after, floor]);
        }
    }
    table
}

fn left(report: &GapReport) -> Vec<String> {
    let a = report.answer;
    let mut all = Vec::new();
    match &a.remainder {
        Some(left) => {
            let place = left.place.as_ref().filter(|_| left.share >= 0.005);
            let place = place.map(|p| format!(": {}", p.description.as_deref().unwrap_or(&p.equation)));
            all.push(format!("{} of the gap has no name{}.", percent(left.share), place.unwrap_or_default()));
        }
        None if a.verdict == Verdict::None => all.push("Nothing that this recording shows.".into()),
        None => all.push("It was not measured how much is left.".into()),
    }
    for form in a.free_forms.iter().take(3) {
        all.push(format!("probability {:.2}, {}: {}", form.probability, form.id.replace('_', " "), form.description));
    }
    if let Some(nearest) = &a.nearest {
        all.push(format!(
            "Nearest in the library: {}, alone {} of what was explained.",
            title(&nearest.id),
            percent(nearest.share)
        ));
    }
    all
}

fn cannot_tell(a: &Answer) -> Vec<String> {
    let mut all = Vec::new();
    for (i, class) in a.cannot_tell_apart.iter().enumerate() {
        let names: Vec<&str> = class.iter().map(|id| title(id)).collect();
        let by = a.alike.get(i).filter(|alike| !alike.separate_by.is_empty());
        let by =
            by.map(|alike| format!(" (overlap {:.2}); what would separate them: {}", alike.overlap, alike.separate_by));
        all.push(format!("This recording cannot tell apart: {}{}.", names.join(", "), by.unwrap_or_default()));
    }
    for o in &a.time_offsets {
        all.push(format!(
            "Clocks disagree: {} of {} is stamped late by {} ± {} s, which was taken out first.",
            o.channel,
            o.recording,
            significant(o.offset_s, 3),
            significant(o.std_s, 2)
        ));
    }
    all
}

/// Everything that was tried, a folded table a stage.
fn trail(page: &mut Document, trace: &[Step]) {
    let mut stages: Vec<TraceStage> = trace.iter().map(|s| s.stage).collect();
    stages.sort_unstable();
    stages.dedup();
    if !stages.is_empty() {
        page.section("The trail: what was tried, and why it was taken or not");
    }
    for stage in stages {
        let [name, about] = heading(stage);
        let mut table = Table::new(["subject", "decision", "nats", "held against", "reason"]);
        let steps = trace.iter().filter(|s| s.stage == stage);
        let mut count = 0;
        for step in steps {
            count += 1;
            table.row([
                step.subject.clone(),
                decision(step.decision).to_string(),
                step.nats.map_or_else(String::new, |n| format!("{n:.1}")),
                step.limit.as_ref().map_or_else(String::new, limit),
                step.reason.clone(),
            ]);
        }
        page.folded_table(&format!("{name} ({count}): {about}"), &table);
    }
}
