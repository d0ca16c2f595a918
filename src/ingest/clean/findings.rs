//! The audit in sentences, for reports.

use super::audit::{Audit, Gaps, Handling, Stuck};
use super::motion::Motion;
use crate::units::{RAD_S_PER_DEG_S, duration_text};

impl Handling {
    /// The handling in words, as the end of a sentence.
    #[must_use]
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Dropped => "left out",
            Self::Spread => "spread evenly up to the next stamp",
            Self::Sorted => "sorted",
        }
    }
}

impl Gaps {
    /// The gaps in one sentence; `None` without any.
    #[must_use]
    pub fn text(&self) -> Option<String> {
        let at = self.longest_at_s?;
        let (missing, longest) = (duration_text(self.missing_s), duration_text(self.longest_s));
        let gaps = if self.count == 1 { "gap" } else { "gaps" };
        Some(format!("{} {gaps} with {missing} missing; the longest {longest} at {at:.1} s; kept", self.count))
    }
}

impl Motion {
    /// The moving stretches in one sentence; `None` without any.
    #[must_use]
    pub fn text(&self) -> Option<String> {
        const SHOWN: usize = 4;
        if self.intervals.is_empty() {
            return None;
        }
        let stretch = |i: &crate::ingest::Interval| format!("{:.1} to {:.1} s", i.start_s, i.end_s);
        let mut shown: Vec<String> = self.intervals.iter().take(SHOWN).map(stretch).collect();
        if self.intervals.len() > SHOWN {
            shown.push(format!("{} more", self.intervals.len() - SHOWN));
        }
        Some(format!("{} in {} samples: {}", duration_text(self.total_s), self.samples, shown.join(", ")))
    }
}

impl Audit {
    /// Findings besides gaps and motion, one sentence each, with how each was handled.
    #[must_use]
    pub fn findings(&self) -> Vec<String> {
        let row = |r: Option<usize>| r.map_or(String::new(), |r| format!(", first in row {r}"));
        let mut out = Vec::new();
        let m = &self.missing;
        if m.count > 0 {
            out.push(format!("{} rows without rate or time{}: {}", m.count, row(m.first_row), m.handling.text()));
        }
        let d = &self.duplicates;
        if d.count > 0 {
            out.push(format!("{} repeated time stamps{}: {}", d.count, row(d.first_row), d.handling.text()));
        }
        let o = &self.out_of_order;
        if o.count > 0 {
            out.push(format!("{} rows that go back in time: {}", o.count, o.handling.text()));
        }
        let s = &self.saturation;
        if let (true, Some(limit)) = (s.samples > 0, s.limit_rad_s) {
            let degrees = limit / RAD_S_PER_DEG_S;
            let at = format!("{limit:.4e} rad/s ({degrees:.4} deg/s)");
            out.push(format!("{} samples saturated at {at}: {}", s.samples, s.handling.text()));
        }
        let k = &self.stuck;
        if let (true, Some(at)) = (k.runs > 0, k.longest_at_s) {
            let longest = duration_text(k.longest_s);
            let runs = if k.runs == 1 { "run" } else { "runs" };
            let frozen = if k.longest_s > Stuck::FROZEN * self.span_s {
                format!("; the sensor froze from {at:.1} to {:.1} s: cut the log there", at + k.longest_s)
            } else {
                String::new()
            };
            out.push(format!(
                "{} {runs} stuck at a value, the longest {longest} at {at:.1} s: {}{frozen}",
                k.runs,
                k.handling.text()
            ));
        }
        if !self.motion.assessed {
            out.push("too short to tell motion from rest".into());
        }
        out
    }
}
