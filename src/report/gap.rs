//! The page of a diagnosis: where does the gap lie, which effect causes it, how far does it shrink, what to do about it.

use super::numbers::{known_digits, significant};
use super::plot::Picture;
use super::plot::gap::GapFigure;
use crate::error::Result;
use crate::gap::DriveTraces;
use crate::gap::answer::{Answer, EffectAnswer, Verdict};
use crate::gap::rest::predictive::Curve;
use crate::units::duration_text;
use std::fmt::Write;
use words::{
    about_of, closed, closes, correction, curve_name, degrees, errors, heading_horizon_s, measured_on, metrics,
    parameters, percent, title,
};

#[path = "gap/why.rs"]
pub(in crate::report) mod why;
#[path = "gap/words.rs"]
pub(in crate::report) mod words;

/// Probability from which on nothing is lacking without reserve.
const CERTAIN: f64 = 0.9;
/// Curves and effects that the page lists.
const LISTED: usize = 6;
/// From this part of the drift before on, the heading hardly gains.
const HARDLY: f64 = 0.95;
/// Less probable effects are not listed.
const LEAST_PROBABILITY: f64 = 0.005;

/// A diagnosis for people.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GapReport<'a> {
    /// Name of the recording that was diagnosed.
    pub recording: &'a str,
    /// Name of the recording that was held out, where there is one.
    pub held_out: Option<&'a str>,
    /// The answer.
    pub answer: &'a Answer,
    /// Deviations of the recording from simulated ones.
    pub curves: &'a [Curve],
    /// The drives on which the gap was measured, as recorded and simulated; none at rest, and where they were not asked for.
    pub traces: &'a [DriveTraces],
}

impl GapReport<'_> {
    /// The verdict in one line.
    #[must_use]
    pub(crate) fn verdict_line(&self) -> String {
        let a = self.answer;
        match (a.verdict, a.main.as_deref()) {
            (Verdict::Identified, Some(main)) => format!(
                "IDENTIFIED: {} ({main}), probability {:.2}{}",
                title(main),
                a.main_probability,
                closes(a, main)
            ),
            (Verdict::None, _) if self.is_open() => {
                format!("NO GAP THAT THIS RECORDING PROVES: probability that there is none {:.2}", a.none_probability)
            }
            (Verdict::None, _) => {
                format!("NO GAP: the nominal simulator explains the recording, probability {:.2}", a.none_probability)
            }
            (Verdict::CannotTell, _) => {
                let reason = a.place.as_ref().and_then(|p| p.description.as_deref());
                let nothing_twice = "the channels that are there say nothing twice, so that nothing is tested";
                format!("CANNOT TELL: {}", reason.unwrap_or(nothing_twice))
            }
            (_, main) => format!(
                "UNKNOWN: there is a gap, and no effect of the library explains most of it, probability {:.2}{}",
                a.unknown_probability,
                main.map(|id| format!("; nearest: {} ({id}){}", title(id), closes(a, id))).unwrap_or_default()
            ),
        }
    }

    /// Whether a gap is more probable than none, and too little for a claim.
    fn is_open(&self) -> bool {
        self.answer.verdict == Verdict::None && self.answer.none_probability < 0.5
    }

    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        // writing to a String cannot fail
        let mut out = String::new();
        let held_out = self.held_out.map(|name| format!(", hold-out: {name}")).unwrap_or_default();
        let _ = writeln!(out, "{}\n\nrecording: {}{held_out}", self.verdict_line(), self.recording);
        let _ = writeln!(out, "\n1. Where does the gap lie?\n");
        self.place(&mut out);
        let _ = writeln!(out, "\n2. Which effect causes it?\n");
        self.which(&mut out);
        let _ = writeln!(out, "\n3. How far does it shrink?\n");
        self.how_far(&mut out);
        let _ = writeln!(out, "\n4. What to do about it\n");
        self.remedy(&mut out);
        if !self.answer.notes.is_empty() {
            out.push('\n');
        }
        for note in &self.answer.notes {
            let _ = writeln!(out, "  note: {note}");
        }
        out.truncate(out.trim_end().len());
        out
    }

    /// The figure.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if a number cannot be shown.
    pub(crate) fn picture(&self) -> Result<Picture> {
        self.figure(&self.verdict_line()).draw()
    }

    /// The figure before it is drawn, with this verdict.
    pub(super) fn figure<'a>(&'a self, verdict: &'a str) -> GapFigure<'a> {
        GapFigure {
            title: self.recording,
            held_out: self.held_out.is_some(),
            verdict,
            answer: self.answer,
            curves: self.curves,
            traces: self.traces,
        }
    }

    fn effect(&self, id: &str) -> Option<&EffectAnswer> {
        self.answer.effects.iter().find(|e| e.id == id)
    }

    /// The main effect, then what else was judged present.
    pub(super) fn judged_present(&self) -> impl Iterator<Item = &EffectAnswer> {
        let main = self.answer.main.as_ref();
        let others = self.answer.together.iter().filter(move |id| Some(*id) != main);
        main.into_iter().chain(others).filter_map(|id| self.effect(id))
    }

    /// Whether the answer is of a drive: its measures tell.
    pub(super) fn is_drive(&self) -> bool {
        self.answer.gap.iter().any(|m| m.metric.starts_with("filter_")) || !self.answer.equations.is_empty()
    }

    /// Which equations a free correction would correct.
    fn equations(&self, out: &mut String) {
        if self.answer.equations.is_empty() {
            let _ = writeln!(
                out,
                "  No equation of the nominal model asks for a correction beyond what chance would gain."
            );
            return;
        }
        let _ =
            writeln!(out, "  {:<58}{:>12}   following", "a free correction of the nominal model, in", "gains, nats");
        for e in &self.answer.equations {
            let _ = writeln!(out, "  {:<58}{:>12.0}   {}", e.equation, e.gain_nats, e.follows.replace('_', " "));
        }
        if self.answer.equations.iter().any(|e| e.correction.is_some()) {
            let _ = writeln!(out, "\n  the process noise that they need, and the correction as a random walk:");
        }
        for e in &self.answer.equations {
            if let Some(c) = &e.correction {
                let _ = writeln!(out, "  {}", correction(&e.equation, c));
            }
        }
    }

    fn place(&self, out: &mut String) {
        if let Some(place) = &self.answer.place {
            let _ = writeln!(out, "  channel {}; {}", place.channel, place.equation);
            if let Some([from, to]) = place.time_s {
                let _ = writeln!(out, "  time {} to {} s", significant(from, 4), significant(to, 4));
            }
            if let Some([from, to]) = place.frequency_hz {
                let _ = writeln!(out, "  frequency {} to {} Hz", significant(from, 3), significant(to, 3));
            }
            if let Some(condition) = &place.condition {
                let _ = writeln!(
                    out,
                    "  it follows {}",
                    condition.trim_end_matches("_c").trim_end_matches("_v").replace('_', " ")
                );
            }
            if let Some(description) = &place.description {
                let _ = writeln!(out, "  it looks like: {description}");
            }
            out.push('\n');
        }
        if !self.answer.equations.is_empty() || (self.curves.is_empty() && self.is_drive()) {
            return self.equations(out);
        }
        let mut there: Vec<&Curve> = self.curves.iter().filter(|c| c.excess_before > 0.0).collect();
        there.sort_by(|a, b| b.share.total_cmp(&a.share));
        match (there.is_empty(), self.curves.is_empty()) {
            (_, true) => {
                let _ = writeln!(out, "  Not compared with simulated recordings.");
            }
            (true, _) => {
                let _ = writeln!(
                    out,
                    "  No curve leaves the 95 % band of simulated recordings further than chance would: {} were compared.",
                    self.curves.len()
                );
                if self.answer.verdict != Verdict::None {
                    let _ = writeln!(out, "  It is too weak for that: only the whole recording together tells.");
                }
            }
            _ => {
                let changed = self.judged_present().next().is_some();
                let with_effects = |text: String| if changed { format!("{text:>15}") } else { String::new() };
                let head = with_effects("with effects".into());
                let _ = writeln!(out, "  {:<36}{:>7}{:>18}{head}   most of it", "", "share", "outside nominal");
                for c in there.iter().take(LISTED) {
                    let most = c.most_in.map_or_else(String::new, |[from, to]| {
                        format!("{} to {} {}", significant(from, 3), significant(to, 3), c.x_unit)
                    });
                    let _ = writeln!(
                        out,
                        "  {:<36}{:>7.2}{:>18}{}   {most}",
                        curve_name(c),
                        c.share,
                        percent(c.outside_before),
                        with_effects(percent(c.outside_after)),
                    );
                }
                let _ = writeln!(
                    out,
                    "\n  share: of the excess over all curves, which overlap; outside: points of the recording beyond the 95 % \
                     band of simulated ones"
                );
            }
        }
    }

    fn which(&self, out: &mut String) {
        let a = self.answer;
        match (a.verdict, a.main.as_deref()) {
            (Verdict::Identified, Some(main)) => {
                let _ = writeln!(out, "  {} ({main}), probability {:.2}", title(main), a.main_probability);
                if let Some(about) = about_of(main) {
                    let _ = writeln!(out, "    {}", about.equation);
                }
                if let Some(effect) = self.effect(main) {
                    parameters(out, effect);
                }
            }
            (Verdict::None, _) if self.is_open() => {
                let _ = writeln!(
                    out,
                    "  None that is proven; that the nominal simulator suffices has probability {:.2}",
                    a.none_probability
                );
            }
            (Verdict::None, _) => {
                let _ = writeln!(out, "  None: the nominal simulator suffices, probability {:.2}", a.none_probability);
            }
            (Verdict::CannotTell, _) => {
                let _ = writeln!(out, "  This log cannot tell.");
            }
            _ => {
                let _ = writeln!(out, "  None of the library, probability {:.2}", a.unknown_probability);
                for form in a.free_forms.iter().take(3) {
                    let _ = writeln!(
                        out,
                        "    {:.2} {}: {}",
                        form.probability,
                        form.id.replace('_', " "),
                        form.description
                    );
                }
            }
        }
        let told = |e: &&EffectAnswer| a.verdict == Verdict::Identified && Some(&e.id) == a.main.as_ref();
        for effect in self.judged_present().filter(|e| !told(e)) {
            let _ =
                writeln!(out, "\n  also {} ({}), probability {:.2}", title(&effect.id), effect.id, effect.probability);
            parameters(out, effect);
        }
        for effect in a.effects.iter().filter(|e| e.idle) {
            let _ =
                writeln!(out, "\n  idle: {} ({}), there, and closing nothing of the gap", title(&effect.id), effect.id);
            parameters(out, effect);
        }
        if let Some(left) = &a.remainder {
            // of nothing there is no place
            let place = left.place.as_ref().filter(|_| left.share >= 0.005);
            let place = place.map(|p| format!(": {}", p.description.as_deref().unwrap_or(&p.equation)));
            let _ = writeln!(out, "\n  left over: {} of the gap{}", percent(left.share), place.unwrap_or_default());
        }
        if !a.time_offsets.is_empty() {
            let _ = writeln!(out, "\n  clocks that disagree, taken out before anything else:");
        }
        for offset in &a.time_offsets {
            let late = known_digits(offset.offset_s, offset.std_s);
            let _ = writeln!(
                out,
                "    {}, {}: stamped late by {late} ± {} s",
                offset.channel,
                offset.recording,
                significant(offset.std_s, 2)
            );
        }
        self.nearest(out);
        self.runners_up(out);
        // signatures that have nothing in common are told apart, only too weak to be told from nothing
        let alike = |i: usize| a.alike.get(i).is_none_or(|alike| alike.overlap >= LEAST_PROBABILITY);
        for (i, class) in a.cannot_tell_apart.iter().enumerate().filter(|(i, _)| alike(*i)) {
            let names: Vec<&str> = class.iter().map(|id| title(id)).collect();
            let _ = writeln!(out, "\n  This recording cannot tell apart: {}.", names.join(", "));
            let alike = a.alike.get(i).filter(|alike| !alike.separate_by.is_empty());
            if let Some(alike) = alike {
                let _ =
                    writeln!(out, "    overlap {:.2}; what would separate them: {}", alike.overlap, alike.separate_by);
            }
        }
    }

    /// Writes which effect of the library comes nearest to an unknown cause.
    fn nearest(&self, out: &mut String) {
        let Some(nearest) = &self.answer.nearest else { return };
        let Some(effect) = self.effect(&nearest.id) else { return };
        let share = percent(nearest.share);
        let _ = writeln!(
            out,
            "\n  nearest in the library: {} ({}), alone {share} of what was explained",
            title(&nearest.id),
            nearest.id
        );
        parameters(out, effect);
    }

    fn runners_up(&self, out: &mut String) {
        let a = self.answer;
        let others: Vec<&EffectAnswer> = a
            .effects
            .iter()
            .filter(|e| !e.idle && !a.together.contains(&e.id) && Some(&e.id) != a.main.as_ref())
            .filter(|e| e.probability >= LEAST_PROBABILITY)
            .take(LISTED)
            .collect();
        let _ = writeln!(out, "\n  otherwise:");
        for effect in others {
            let closed = closed(effect).map(|c| format!(", closes {c} alone")).unwrap_or_default();
            let _ = writeln!(out, "    {:.2} {}{closed}", effect.probability, title(&effect.id));
        }
        if a.verdict != Verdict::None {
            let _ = writeln!(out, "    {:.2} nothing is lacking", a.none_probability);
        }
        if a.verdict != Verdict::Unknown {
            let _ = writeln!(out, "    {:.2} something that is not in the library", a.unknown_probability);
        }
    }

    fn how_far(&self, out: &mut String) {
        let a = self.answer;
        if a.gap.is_empty() {
            let why = if self.held_out.is_some() {
                "Not measured."
            } else {
                "Not measured: that takes another recording of the same unit, held out from the fit (--hold)."
            };
            let _ = writeln!(out, "  {why}");
            return;
        }
        let on = measured_on(self.held_out.is_some());
        metrics(out, on, "after", &a.gap);
        for effect in self.judged_present() {
            if let Some(closed) = closed(effect) {
                let _ = writeln!(out, "  {} alone closes {closed} of the gap in log score", title(&effect.id));
            }
        }
        let in_pairs = if self.is_drive() || self.curves.is_empty() {
            "; without torques, before plus what it gains on them"
        } else {
            ""
        };
        let _ = writeln!(out, "  floor: what the augmented simulator scores on its own recordings{in_pairs}");
        if let Some(gain) = &a.navigation {
            let _ = writeln!(
                out,
                "  the navigation filter errs there by {} rms with the nominal model, by {} with the augmented one;\n  \
                 its NIS goes from {} to {} (1 is consistent)",
                errors(&gain.before),
                errors(&gain.after),
                significant(gain.before.nis_mean, 3),
                significant(gain.after.nis_mean, 3),
            );
        }
        if let Some(nearest) = a.nearest.as_ref().filter(|n| !n.gap.is_empty()) {
            let closed = self.effect(&nearest.id).and_then(closed);
            let closes =
                closed.map(|c| format!(", which alone closes {c} of the gap in log score")).unwrap_or_default();
            let _ = writeln!(out, "\n  with {}{closes}:", title(&nearest.id));
            metrics(out, on, "with it", &nearest.gap);
        }
    }

    pub(super) fn remedy(&self, out: &mut String) {
        let a = self.answer;
        match a.verdict {
            Verdict::None if a.none_probability < CERTAIN => {
                if !self.is_open() {
                    let _ = writeln!(
                        out,
                        "  Probably nothing; that something is lacking has probability {:.2}.",
                        1.0 - a.none_probability
                    );
                }
                let again = if self.is_drive() {
                    "  Record again, for longer: --fit given several times diagnoses all recordings together."
                } else {
                    "  Record again, for longer."
                };
                let _ = writeln!(out, "{again}");
            }
            Verdict::None => {
                let _ = writeln!(
                    out,
                    "  Nothing: the simulator may be used as it is, under the conditions of this recording."
                );
            }
            Verdict::Identified => {
                self.remedies(out);
                self.gain(out);
            }
            Verdict::CannotTell => {
                let _ = writeln!(out, "  Log what the notes name, and ask again.");
            }
            Verdict::Unknown => {
                self.remedies(out);
                let place = a.place.as_ref().and_then(|p| p.description.as_deref());
                let _ = match place {
                    Some(description) => writeln!(out, "  Look for a cause of this: {description}."),
                    None => writeln!(out, "  Look for a cause where the curves above leave their bands."),
                };
                let _ = writeln!(
                    out,
                    "  Until it is found, do not rely on the simulator where curves leave its bands; take a filter's noise from \
                     recordings."
                );
            }
        }
    }

    fn remedies(&self, out: &mut String) {
        for about in self.judged_present().filter_map(|effect| about_of(&effect.id)) {
            let _ = writeln!(out, "  {}: {}", about.title, about.remedy);
        }
    }

    /// Writes how much less the heading drifts over the longest horizon.
    fn gain(&self, out: &mut String) {
        let longest = self
            .answer
            .gap
            .iter()
            .filter_map(|m| heading_horizon_s(m).map(|horizon_s| (horizon_s, m)))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((horizon_s, m)) = longest {
            let [before, after, floor] = [m.before, m.after, m.floor].map(|v| significant(degrees(v), 3));
            let horizon = duration_text(horizon_s);
            let _ = if m.after < HARDLY * m.before {
                writeln!(
                    out,
                    "  A filter that models it would let the heading drift {after}° rms in {horizon} at rest, where it is \
                     {before}° without;\n  on simulated recordings it is {floor}°."
                )
            } else {
                writeln!(
                    out,
                    "  The heading at rest gains little by it: it drifts {before}° rms in {horizon} without, {after}° with it."
                )
            };
        }
    }
}

#[cfg(test)]
#[path = "gap/tests.rs"]
mod tests;
