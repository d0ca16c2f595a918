//! `report.md`: the tables, the figures and the paper row by row.

use super::{StudyReport, factor};
use crate::files::mark;
use crate::report::numbers::significant;
use crate::study::{Comparison, Estimator, Study};
use crate::units::RAD_S_PER_DEG_S;
use std::fmt::Write;

impl StudyReport {
    /// The page, in Markdown; it shows the figures by the names of their files.
    #[must_use]
    pub(crate) fn page(&self) -> String {
        // writing to a String cannot fail
        let mut out = String::new();
        let _ = writeln!(out, "# Filters with and without slip\n\n<!-- {} -->\n", mark::text());
        let _ = writeln!(out, "{}: {}.\n", self.robot, self.heading());
        out += "Errors are estimate less truth. Intervals hold 95 %, over runs.\n\n";
        out += &table_of_errors(&self.study);
        out +=
            "\nNEES of (x, y, heading) is 3 where the filter is as sure as it should be; NIS is 1.\n\n## Factors\n\n";
        out += "| error over error | x | y | heading | runs won in x, y, heading |\n|---|---|---|---|---|\n";
        for (_, words, c) in self.comparisons() {
            let won = c.won.map(percent).join(", ");
            let _ = writeln!(out, "| {words} | {} | {won} |", factors(&c).join(" | "));
        }
        let _ = writeln!(
            out,
            "\nThe filter with slip is nearer in x, y and heading alike in {} of the runs.",
            percent(self.won_in_all())
        );
        self.grounds(&mut out);
        self.wrong(&mut out);
        self.settling(&mut out);
        out += "\n## Figures\n\n";
        let sweeps = !self.grounds.is_empty() || !self.beliefs.is_empty();
        for name in Self::figure_names(sweeps) {
            let _ = writeln!(out, "![{}]({name}.png)\n", name.replace('_', " "));
        }
        out += "## The paper, row by row\n\n";
        out += "Alessandri, Bartolini, Pavanati, Punta, Vinci, *An application of the extended Kalman filter for integrated \
                navigation in mobile robotics*.\n\n| where | what it says | status | here |\n|---|---|---|---|\n";
        for c in self.claims() {
            let _ =
                writeln!(out, "| {} | {} | {} | {} |", c.place, c.says, c.status.name(), c.here.replace('|', "\\|"));
        }
        out
    }

    fn grounds(&self, out: &mut String) {
        if self.grounds.is_empty() {
            return;
        }
        *out += "\n## Other grounds\n\nThe filter knows the ground. Factors: error without slip model over error with it.\n\n\
                 | ground | greatest friction | slip, rms | x | y | heading | NEES | inside bounds |\n\
                 |---|---|---|---|---|---|---|---|\n";
        for g in &self.grounds {
            let Some(c) = g.study.compare(Estimator::Slip, Estimator::Rolling) else { continue };
            let _ = writeln!(
                out,
                "| {} | {} | {} % | {} | {} |",
                g.surface.name().replace('_', " "),
                significant(g.peak_friction, 3),
                significant(100.0 * g.slip_rms, 2),
                factors(&c).join(" | "),
                consistency(&g.study, Estimator::Slip)
            );
        }
    }

    fn wrong(&self, out: &mut String) {
        if self.beliefs.is_empty() {
            return;
        }
        *out += "\n## A filter that is wrong about traction\n\nFactors: error without slip model over error with it.\n\n\
                 | believed friction over true | stiffness | x | y | heading | NIS |\n|---|---|---|---|---|---|\n";
        for b in &self.beliefs {
            let cells = factors(&b.against_rolling).join(" | ");
            let nis = significant(b.nis_mean, 4);
            let _ = writeln!(out, "| {} | {} | {cells} | {nis} |", b.friction_factor, b.stiffness_factor);
        }
    }

    fn settling(&self, out: &mut String) {
        *out += "\n## How many runs it takes\n\nRMS errors of the filter with slip over the first runs.\n\n\
                 | runs | x, m | y, m | heading, ° |\n|---|---|---|---|\n";
        for p in self.convergence(Estimator::Slip) {
            let cells: Vec<String> = (0..3).map(|i| cell(i, p.rms[i], p.rms_ci95[i])).collect();
            let _ = writeln!(out, "| {} | {} |", p.runs, cells.join(" | "));
        }
    }
}

fn table_of_errors(study: &Study) -> String {
    let mut out = String::from(
        "## Root mean square errors\n\n| | x, m | y, m | heading, ° | at the end: x, y, heading | NEES | inside bounds | \
         NIS |\n|---|---|---|---|---|---|---|---|\n",
    );
    for e in &study.estimators {
        let [x, y, heading] = e.rms_end;
        let _ = writeln!(
            out,
            "| {} | {} | {} m, {} m, {} ° | {} | {} |",
            e.estimator.words(),
            std::array::from_fn::<String, 3, _>(|i| cell(i, e.rms[i], e.rms_ci95[i])).join(" | "),
            significant(x, 3),
            significant(y, 3),
            significant(heading / RAD_S_PER_DEG_S, 3),
            consistency(study, e.estimator),
            e.nis_mean.map_or_else(String::new, |n| significant(n, 4))
        );
    }
    out
}

/// Factors of x, y and heading with their intervals, as cells.
fn factors(c: &Comparison) -> [String; 3] {
    std::array::from_fn(|i| factor(c.factor[i], c.factor_ci95[i]))
}

/// Metres for x and y, degrees for the heading.
fn cell(quantity: usize, value: f64, ci95: [f64; 2]) -> String {
    let per_si = if quantity == 2 { 1.0 / RAD_S_PER_DEG_S } else { 1.0 };
    factor(value * per_si, ci95.map(|end| end * per_si))
}

/// Mean NEES and its time inside the bounds, as two cells.
fn consistency(study: &Study, estimator: Estimator) -> String {
    let nees = study.of(estimator).and_then(|e| e.nees.as_ref());
    nees.map_or_else(|| " | ".into(), |n| format!("{} | {}", significant(n.mean, 3), percent(n.inside)))
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}
