//! The sensor's low-pass and vibrations that a fit took out, in words.

use super::numbers::significant;
use crate::identify::terms::TermEstimate;

/// The low-pass and vibrations that were taken out of the residuals before the tests, a line each; none where they are
/// not coloured.
pub(super) fn coloured_text(colour: &[TermEstimate]) -> Vec<String> {
    let ends = |[low, high]: [f64; 2]| format!("[{}, {}]", significant(low, 4), significant(high, 4));
    let mut lines: Vec<String> = colour
        .iter()
        .map(|t| match (t.center_hz, t.bandwidth_hz) {
            (Some(center), Some(width)) => format!(
                "vibration of {} rad/s at {} Hz, 95 % {}, {} Hz wide",
                significant(t.estimate, 3),
                significant(center.estimate, 4),
                ends(center.ci95),
                significant(width.estimate, 2)
            ),
            _ => format!("low-pass with half power at {} Hz, 95 % {}", significant(t.estimate, 3), ends(t.ci95)),
        })
        .collect();
    if !lines.is_empty() {
        lines.push(
            "taken out of the residuals before they were judged; the angle random walk is that of the plateau".into(),
        );
    }
    lines
}
