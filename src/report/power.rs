//! Power of a log: the smallest size of each effect that would be named, as a table and as curves.

use super::gap::words::{name_and_unit, title};
use super::numbers::significant;
use super::plot::{Axis, Chart, Page, Panel, Picture, palette};
use crate::error::Result;
use crate::gap::answer::Verdict;
use crate::gap::power::{EffectPower, Power};
use crate::units::duration_text;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The power of a log for people.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PowerReport<'a> {
    /// Name of the log.
    pub log: &'a str,
    /// Its power.
    pub power: &'a Power,
}

/// Charts in a row of the picture, and height of a row in pixels.
const COLUMNS: usize = 4;
const ROW: u32 = 300;

impl PowerReport<'_> {
    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let p = self.power;
        let mut out = format!(
            "POWER of {}: {} rows, {} at {:.4} s\n\n  smallest sizes that a diagnosis of such a log names with probability {}, from {} simulated logs each\n",
            self.log,
            p.rows,
            duration_text(p.span_s),
            p.sample_time_s,
            p.probability,
            p.cases
        );
        let _ = write!(out, "\n  {:<37}{:<52}{:<26}evidence there", "effect", "is named from", "95 %");
        for effect in &p.effects {
            let _ = write!(out, "\n  {}", row(effect).trim_end());
        }
        let _ = write!(out, "\n\n  without any effect: no gap in {} of {} logs", p.nominal.none, p.nominal.logs);
        for cannot in &p.cannot_show {
            let _ = write!(out, "\n  not sought: {} ({}), {}", title(&cannot.id), cannot.id, cannot.reason);
        }
        for (i, note) in p.notes.iter().enumerate() {
            let _ = write!(out, "{}\n  note: {note}", if i == 0 { "\n" } else { "" });
        }
        out
    }

    /// The share of simulated logs that name each effect, against its size.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is no effect of which a size is known.
    pub(crate) fn picture(&self) -> Result<Picture> {
        let mut by_id: BTreeMap<usize, Vec<&EffectPower>> = BTreeMap::new();
        let all = &self.power.effects;
        for effect in all {
            let first = all.iter().position(|e| e.id == effect.id).unwrap_or(0);
            by_id.entry(first).or_default().push(effect);
        }
        let panels: Vec<Panel> = by_id.values().map(|effects| self.panel(effects)).collect();
        let rows = panels.len().div_ceil(COLUMNS).max(1);
        let mut page = Page::new(format!("{}: what it could have found", self.log))
            .subtitle(format!(
                "share of simulated logs in which a diagnosis names the effect, against its size; dashed: {}",
                self.power.probability
            ))
            .size(
                if panels.len() < COLUMNS { 500 * panels.len().max(1) as u32 } else { 2000 },
                130 + ROW * rows as u32,
            );
        for row in panels.chunks(COLUMNS) {
            let empty = || Panel::Notice { title: String::new(), text: String::new() };
            let missing = if rows > 1 { COLUMNS - row.len() } else { 0 };
            page = page.row(row.iter().cloned().chain((0..missing).map(|_| empty())));
        }
        page.draw()
    }

    /// One effect, in both directions where it has two.
    fn panel(&self, effects: &[&EffectPower]) -> Panel {
        let first = effects[0];
        if effects.iter().all(|e| e.thresholds.iter().all(Option::is_none)) {
            let text = effects.iter().map(|e| at_no_size(e)).next().unwrap_or_default();
            return Panel::Notice { title: title(&first.id).into(), text };
        }
        let (name, unit) = name_and_unit(&first.parameter);
        let x = Axis::linear(name, unit);
        // where nothing is stated as a size the axis need not reach the nominal value
        let x = if effects.iter().any(|e| is_far(e)) { x } else { x.include(first.null) };
        let mut chart = Chart::new(x, Axis::linear("named", "").limits(0.0, 1.05)).title(title(&first.id));
        for effect in effects {
            let logs = effect.thresholds.len() as f64;
            let mut sizes: Vec<f64> = effect.thresholds.iter().flatten().copied().collect();
            sizes.sort_by(|a, b| (a - effect.null).abs().total_cmp(&(b - effect.null).abs()));
            let steps = sizes.iter().enumerate().flat_map(|(i, size)| {
                let [before, after] = [i, i + 1].map(|n| n as f64 / logs);
                [[*size, before], [*size, after]]
            });
            chart = chart.line("", steps, palette::BLUE.stroke(2.5));
            if let Some(smallest) = effect.smallest {
                let bars = [[smallest, 0.0, self.power.probability]];
                chart = chart.bars("", bars, palette::ORANGE.stroke(2.5)).dots(
                    "",
                    [[smallest, self.power.probability]],
                    palette::ORANGE,
                    6.0,
                );
            }
        }
        chart.at_y("", self.power.probability, palette::GREY.stroke(1.5).dashed()).into()
    }
}

/// Whether the nominal value is far from all sizes, as that of a filter which is open.
fn is_far(effect: &EffectPower) -> bool {
    let most = effect.thresholds.iter().flatten().map(|t| t.abs()).fold(0.0, f64::max);
    effect.null.abs() > 100.0 * most
}

fn row(effect: &EffectPower) -> String {
    let name = title(&effect.id);
    let Some(smallest) = effect.smallest else { return format!("{name:<37}{}", at_no_size(effect)) };
    let (parameter, unit) = name_and_unit(&effect.parameter);
    let side = if effect.sign > 0 { "≥" } else { "≤" };
    let size = format!("{parameter} {side} {} {unit}", significant(smallest, 3));
    let interval = effect.smallest_ci95.map_or_else(String::new, |ends| {
        let [low, high] = ends.map(|end| significant(end, 3));
        format!("{low} to {high}")
    });
    let nats = effect.evidence_nats.map_or_else(String::new, |nats| format!("{nats:.1} nats"));
    let mut out = format!("{name:<37}{size:<52}{interval:<26}{nats:<12}");
    if let Some(checked) = effect.checked {
        let [low, high] = checked.share_ci95;
        let _ = write!(out, "named in {} of {} more (95 %: {low:.2} to {high:.2})  ", checked.named, checked.logs);
    }
    if !effect.parameters.is_empty() {
        let others = effect.parameters.iter().map(|(parameter, value)| {
            let (name, unit) = name_and_unit(parameter);
            format!("{name} {} {unit}", significant(*value, 3)).trim_end().to_string()
        });
        let _ = write!(out, "with {}", others.collect::<Vec<_>>().join(", "));
    }
    out
}

/// Why no size is named so often.
fn at_no_size(effect: &EffectPower) -> String {
    let (parameter, _) = name_and_unit(&effect.parameter);
    let side = if effect.sign > 0 { "above" } else { "below" };
    let null = significant(effect.null, 3);
    let said = effect.instead.iter().map(|i| {
        let verdict = serde_json::from_value(i.answer.as_str().into()).ok();
        let answer = if verdict == Some(Verdict::None) { "no gap" } else { title(&i.answer) };
        format!("{answer} in {} of {}", i.logs, effect.thresholds.len())
    });
    let said: Vec<String> = said.collect();
    let instead = match said.as_slice() {
        [] => "within its bounds".to_string(),
        some => format!("said is {}", some.join(", ")),
    };
    format!("{parameter} {side} {null}: named so often at no size; {instead}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::registry;
    use crate::gap::power::{Cannot, Checked, Instead, Nominal};

    fn power() -> Power {
        let about = registry()[0].about();
        let one = |sign: i8, smallest: Option<f64>| EffectPower {
            id: about.id.into(),
            parameter: about.size().into(),
            null: 0.0,
            sign,
            smallest,
            smallest_ci95: smallest.map(|s| [0.8 * s, 1.2 * s]),
            parameters: [("frequency_hz".to_string(), 1.25)].into(),
            thresholds: vec![smallest.map(|s| 0.8 * s), smallest.map(|s| 0.9 * s), None],
            evidence_nats: smallest.map(|_| 7.25),
            checked: smallest.map(|_| Checked { logs: 20, named: 19, share_ci95: [0.76, 0.99] }),
            instead: vec![Instead { answer: "unknown".into(), logs: 1 }],
        };
        Power {
            probability: 0.9,
            cases: 3,
            seed: 1,
            rows: 6001,
            span_s: 60.0,
            sample_time_s: 0.01,
            nominal: Nominal { logs: 3, none: 3 },
            effects: vec![one(1, Some(0.0125)), one(-1, None)],
            cannot_show: vec![Cannot { id: about.id.into(), reason: "for a reason".into() }],
            notes: vec!["A note.".into()],
        }
    }

    #[test]
    fn the_page_tells_sizes_with_their_units_and_what_has_none() {
        let power = power();
        let text = PowerReport { log: "drive.csv", power: &power }.text();
        for part in [
            "POWER of drive.csv: 6001 rows, 60 s at 0.0100 s",
            "≥ 0.0125 ",
            "0.0100 to 0.0150",
            "7.2 nats",
            "named in 19 of 20 more (95 %: 0.76 to 0.99)",
            "with frequency 1.25 Hz",
            "below 0: named so often at no size; said is unknown in 1 of 3",
            "no gap in 3 of 3 logs",
            "for a reason",
            "note: A note.",
        ] {
            assert!(text.contains(part), "{text} lacks {part}");
        }
    }

    #[test]
    fn the_picture_has_a_panel_for_each_effect() {
        let mut power = power();
        let picture = PowerReport { log: "drive.csv", power: &power }.picture().unwrap();
        assert_eq!(picture.panels.len(), 1);
        assert!(picture.svg().unwrap().contains("what it could have found"));
        // none that is named at some size
        power.effects.remove(0);
        assert!(PowerReport { log: "drive.csv", power: &power }.picture().is_ok());
    }
}
