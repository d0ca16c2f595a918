//! A diagnosis: the recording beside the nominal and the augmented simulator, and the verdict.

use super::drive::MAP;
use super::messages::{Header, Pose, PoseStamped};
use super::protobuf::{Band, Banded, Compared, Curve, Quantity, Verdict};
use super::recording::Recording;
use crate::error::Result;
use crate::files::OutputFile;
use crate::gap::DriveTraces;
use crate::gap::rest::predictive::{Curve as Banding, Over, Shown};
use crate::report::GapReport;
use crate::report::gap::words::curve_name;
use crate::signal::names;

/// A diagnosis for a recording.
pub(crate) struct GapRecording<'a> {
    /// The answer, its curves and its drives.
    pub report: &'a GapReport<'a>,
    /// The command, as its JSON's schema names it.
    pub command: &'static str,
}

impl GapRecording<'_> {
    /// Writes the recording: of a drive each channel as recorded and as both simulators have it, of a gyro at rest the bands.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Io`] if the disk refuses.
    pub(crate) fn write(&self, file: OutputFile) -> Result<()> {
        let report = self.report;
        let over_time = report.curves.iter().filter(|c| c.over == Over::Time);
        let begins =
            report.traces.iter().filter_map(|d| d.times_s.first()).chain(over_time.filter_map(|c| c.x.first()));
        let first_s = begins.copied().reduce(f64::min).unwrap_or(0.0);
        let mut to = Recording::new(file, first_s)?;
        let verdict = to.topic("/gyroid/verdict")?;
        to.put(&verdict, first_s, &self.verdict())?;
        let (over_time, others): (Vec<&Banding>, Vec<&Banding>) =
            report.curves.iter().partition(|c| c.over == Over::Time);
        if !others.is_empty() {
            let topic = to.topic("/gyroid/curve")?;
            others.iter().try_for_each(|curve| to.put(&topic, first_s, &banded(curve)))?;
        }
        for curve in over_time {
            points(curve, &mut to)?;
        }
        for (number, drive) in (1..).zip(report.traces) {
            // a file has one clock, and drives may share theirs: each has topics of its own
            let prefix = if report.traces.len() > 1 { format!("/drive_{number}") } else { String::new() };
            channels(drive, &prefix, &mut to)?;
        }
        to.finish()
    }

    fn verdict(&self) -> Verdict {
        let answer = self.report.answer;
        let probability =
            |name: &str, value| Quantity { name: name.into(), unit: "1".into(), value, ..Quantity::default() };
        let mut quantities = vec![
            probability("probability of no gap", answer.none_probability),
            probability("probability of an unknown effect", answer.unknown_probability),
        ];
        for effect in answer.present() {
            quantities.push(probability(&format!("probability of {}", effect.id), effect.probability));
            quantities.extend(effect.gap_closed.map(|share| Quantity {
                ci95: effect.gap_closed_ci95.map_or_else(Vec::new, Vec::from),
                ..probability(&format!("share of the gap closed by {}", effect.id), share)
            }));
            quantities.extend(effect.parameters.iter().map(|(name, value)| Quantity {
                name: format!("{}: {name}", effect.id),
                value: *value,
                std: effect.std.get(name).copied().unwrap_or(f64::NAN),
                ..Quantity::default()
            }));
        }
        let verdict = serde_json::to_value(answer.verdict).ok();
        let verdict = verdict.as_ref().and_then(|v| v.as_str()).unwrap_or_default();
        Verdict { command: self.command.into(), verdict: verdict.into(), text: self.report.text(), quantities }
    }
}

/// A curve over something else than time, as one message.
fn banded(curve: &Banding) -> Curve {
    let band = |name: &str, band: &[[f64; 2]]| Band {
        name: name.into(),
        low: band.iter().map(|b| b[0]).collect(),
        high: band.iter().map(|b| b[1]).collect(),
    };
    Curve {
        name: curve_name(curve),
        x_unit: curve.x_unit.clone(),
        unit: curve.unit.clone(),
        x: curve.x.clone(),
        recorded: curve.recorded.clone(),
        bands: vec![band("nominal", &curve.before), band("augmented", &curve.after)],
    }
}

/// A curve over time, point by point.
fn points(curve: &Banding, to: &mut Recording) -> Result<()> {
    let name = match curve.shown {
        Shown::Deviation => "deviation",
        Shown::Power => "power",
        Shown::LargestPower => "largest_power",
        Shown::AllanDeviation => "allan_deviation",
        Shown::ShareOfSamples => "share_of_samples",
        Shown::NoiseLevel => "noise_level",
    };
    let topic = to.topic(&format!("/gyroid/band/{name}"))?;
    for (k, time_s) in curve.x.iter().enumerate() {
        let of = |band: &[[f64; 2]]| band.get(k).copied().unwrap_or([f64::NAN; 2]);
        let ([before_low, before_high], [after_low, after_high]) = (of(&curve.before), of(&curve.after));
        let recorded = curve.recorded.get(k).copied().unwrap_or(f64::NAN);
        to.put(&topic, *time_s, &Banded { recorded, before_low, before_high, after_low, after_high })?;
    }
    Ok(())
}

/// A drive: every channel, and where it has a position the three poses.
fn channels(drive: &DriveTraces, prefix: &str, to: &mut Recording) -> Result<()> {
    let mut topics = Vec::new();
    for trace in &drive.traces {
        topics.push(to.topic::<Compared>(&format!("{prefix}/gyroid/compared/{}", trace.channel))?);
    }
    let of = |channel: &str| drive.traces.iter().find(|t| t.channel == channel);
    let position = of(names::X).zip(of(names::Y));
    let mut poses = Vec::new();
    if position.is_some() {
        for name in ["recorded", "before", "after"] {
            poses.push(to.topic::<PoseStamped>(&format!("{prefix}/pose/{name}"))?);
        }
    }
    let heading = of(names::HEADING);
    for (k, time_s) in drive.times_s.iter().enumerate() {
        let three = |trace: &crate::gap::Trace| {
            let after = if trace.after.is_empty() { trace.before[k] } else { trace.after[k] };
            [trace.recorded[k], trace.before[k], after]
        };
        for (trace, topic) in drive.traces.iter().zip(&topics) {
            let [recorded, before, after] = three(trace);
            if recorded.is_finite() {
                to.put(topic, *time_s, &Compared { recorded, before, after })?;
            }
        }
        let Some((x, y)) = position else { continue };
        let (x, y, heading) = (three(x), three(y), heading.map_or([0.0; 3], three));
        for (i, topic) in poses.iter().enumerate() {
            if x[i].is_finite() && y[i].is_finite() {
                let heading_rad = if heading[i].is_finite() { heading[i] } else { 0.0 };
                let header = Header::new(to.stamp(*time_s), MAP);
                to.put(topic, *time_s, &PoseStamped { header, pose: Pose::planar(x[i], y[i], heading_rad) })?;
            }
        }
    }
    Ok(())
}
