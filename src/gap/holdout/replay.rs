//! closed = Σ_c (mean r²_without - mean r²_with)/σ_c² / Σ_c (mean r²_before/σ_c² - 1): how far the error of a foreign simulator shrinks
//!
//! The simulator is run open loop on the inputs of a recording, and r is what the recording says less what the simulator says, in the
//! wheel speeds, the yaw rate and the pose. An open-loop pose drifts without end, and the displacement over one second does not: it is
//! taken in the body's frame at the beginning of that second, of each log by itself, so that neither the place nor the heading of the
//! start matters.
//!
//! σ_c² is the noise of *both* logs in r, which no model closes: a sixth of the variance of the second differences of r, in which
//! neither the motion nor a slow error of the model remains. Of a displacement it thus holds the readings at both ends. Of several runs
//! the least is taken, since a fast error of the model only adds to it. What motors or wheels draw anew each run acts on the motion
//! and is not in σ_c²: nor is a bias of the gyro. Both stay in the gap as what no model closes, and the share is the smaller for them.
//!
//! Intervals are by blocks of time of at least one second (see `block_rows`), drawn with replacement, the same for all runs.

use super::{block_rows, block_sums};
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use crate::math::robust::{SECOND_DIFFERENCE, quantile, second_difference_std};
use crate::signal::slots::GAP_STEPS;
use crate::signal::{Log, names};
use serde::Serialize;
use std::f64::consts::TAU;

/// Time over which a displacement is taken, and shortest block, s.
const OVER_S: f64 = 1.0;
/// Fewest blocks for an interval.
const FEWEST_BLOCKS: usize = 20;
/// Share of the recording that the simulator's log must cover.
const COVERED: f64 = 0.5;
/// Resamplings of an interval.
const DRAWS: usize = 2000;
/// Noise that is taken to be there at least, over the size of the error: logs without noise have rounding.
const ROUNDING: f64 = 1e-6;
/// Channels that are compared reading by reading.
const READ: [&str; 3] = [names::WHEEL_LEFT, names::WHEEL_RIGHT, names::GYRO_Z];
/// Displacements over a second: ahead and to the left (m), turn (rad).
const MOVED: [&str; 3] = ["moved_ahead_1s_m", "moved_left_1s_m", "turned_1s_rad"];

/// What a recording says less what a run of the simulator says, channel by channel on the recording's rows; NaN where either is
/// missing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Replayed {
    step_s: f64,
    errors: Vec<(&'static str, Vec<f64>)>,
}

/// Size of one channel's errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ChannelErrors {
    /// Name, with its unit.
    pub channel: &'static str,
    /// Root mean square under the original, in that unit.
    pub rms_before: f64,
    /// Root mean square under the patched description.
    pub rms_after: f64,
    /// Standard deviation that the noise of both logs makes of it.
    pub noise_std: f64,
}

/// How far the error shrinks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Shrinkage {
    /// Share of the gap before; none where that does not exceed the noise.
    pub closed: Option<f64>,
    /// Its 95 % interval; none where more than one resampled gap in 40 does not exceed the noise.
    pub ci95: Option<[f64; 2]>,
    /// Whether the error is smaller, with a probability of at least 97.5 % by the blocks.
    pub shrinks: bool,
    /// Channels that all runs have.
    pub channels: Vec<ChannelErrors>,
}

/// Readings of a channel that are there, in order of time.
struct Series {
    times_s: Vec<f64>,
    values: Vec<f64>,
    gap_s: f64,
}

impl Series {
    /// Of a log whose first row is at `begin_s`.
    fn of(log: &Log, name: &str, begin_s: f64) -> Option<Self> {
        let all = log.get(name)?.iter().enumerate();
        let there = all.filter(|(_, v)| v.is_finite()).map(|(k, v)| (log.time.at(k) - begin_s, *v));
        let (times_s, mut values): (Vec<f64>, Vec<f64>) = there.unzip();
        if name == names::HEADING {
            (1..values.len()).for_each(|k| values[k] = values[k - 1] + turn(values[k] - values[k - 1]));
        }
        let gap_s = GAP_STEPS * median_step_s(&times_s)?;
        Some(Self { times_s, values, gap_s })
    }

    /// At a time, by a straight line between neighbours; NaN where there are none, or where they lie apart.
    fn at(&self, t_s: f64) -> f64 {
        // readings of one instant differ by rounding in their times
        let rounding = 1e-6 * self.gap_s;
        let after = self.times_s.partition_point(|t| *t < t_s - rounding);
        let Some(next) = self.times_s.get(after) else { return f64::NAN };
        if *next <= t_s + rounding {
            return self.values[after];
        }
        let Some(before) = after.checked_sub(1).filter(|b| next - self.times_s[*b] <= self.gap_s) else {
            return f64::NAN;
        };
        let share = (t_s - self.times_s[before]) / (next - self.times_s[before]);
        self.values[before] + share * (self.values[after] - self.values[before])
    }
}

fn median_step_s(times_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    (!steps.is_empty()).then(|| quantile(&mut steps, 0.5))
}

/// An angle's nearest equal to zero, rad.
fn turn(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

/// Displacement in the frame of the first pose, and turn.
fn moved(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = from[2].sin_cos();
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    [cos * x + sin * y, cos * y - sin * x, turn(to[2] - from[2])]
}

impl Replayed {
    /// Errors of `simulated`, whose time counts from the recording's first row.
    ///
    /// # Errors
    /// [`ErrorKind::Column`] where both logs share no channel; [`ErrorKind::TooShort`] where the simulator's covers less than half of
    /// the recording, or the recording is shorter than 20 s.
    pub(crate) fn of(recording: &Log, simulated: &Log) -> Result<Self> {
        let (step_s, span_s) = (recording.time.median_step_s(), recording.time.span_s());
        if !(span_s >= FEWEST_BLOCKS as f64 * OVER_S) {
            let found = format!("is {span_s:.1} s long, and a replay is measured over {FEWEST_BLOCKS} s at least");
            return Err(Error::new(ErrorKind::TooShort, &recording.source, found).hint("hold out a longer recording"));
        }
        let ends = (simulated.time.len() > 1).then(|| (simulated.time.at(0), simulated.time.at(simulated.len() - 1)));
        let covered = ends.map_or(0.0, |(first, last)| last.min(span_s) - first.max(0.0));
        if covered < COVERED * span_s {
            let seen = ends.map_or("has no two rows".into(), |(a, b)| format!("is from {a:.2} to {b:.2} s"));
            let found = format!("{seen}, and its inputs are from 0 to {span_s:.2} s");
            return Err(Error::new(ErrorKind::TooShort, &simulated.source, found)
                .hint("let the simulator run through all inputs, and let the time of its log count as theirs does"));
        }
        let begin_s = recording.time.at(0);
        let times_s: Vec<f64> = (0..recording.len()).map(|k| recording.time.at(k) - begin_s).collect();
        let mut errors = Vec::new();
        for name in READ {
            let (Some(real), Some(other)) = (recording.get(name), Series::of(simulated, name, 0.0)) else { continue };
            errors.push((name, times_s.iter().zip(real).map(|(t, v)| v - other.at(*t)).collect()));
        }
        let pose = |log: &Log, begin_s: f64| -> Option<[Series; 3]> {
            let [x, y, heading] = [names::X, names::Y, names::HEADING].map(|name| Series::of(log, name, begin_s));
            Some([x?, y?, heading?])
        };
        if let (Some(real), Some(other)) = (pose(recording, begin_s), pose(simulated, 0.0)) {
            errors.extend(MOVED.into_iter().zip(displacements(&times_s, &real, &other)));
        }
        errors.retain(|(_, values): &(_, Vec<f64>)| values.iter().filter(|v| v.is_finite()).count() > 2);
        if errors.is_empty() {
            let channels = |log: &Log| log.channels.iter().map(|c| c.name.clone()).collect::<Vec<_>>().join(", ");
            let found = format!(
                "has none of the wheel speeds, yaw rate or pose of {}; there are {}",
                recording.source,
                channels(simulated)
            );
            return Err(Error::new(ErrorKind::Column, &simulated.source, found)
                .hint("let the simulator write the channels of the recording, or name its columns with --map"));
        }
        Ok(Self { step_s, errors })
    }

    fn get(&self, channel: &str) -> Option<&[f64]> {
        self.errors.iter().find(|e| e.0 == channel).map(|e| e.1.as_slice())
    }
}

/// Differences of the displacements, on the rows where a second begins that has a pose at both ends.
fn displacements(times_s: &[f64], real: &[Series; 3], other: &[Series; 3]) -> [Vec<f64>; 3] {
    let mut errors = [(); 3].map(|()| vec![f64::NAN; times_s.len()]);
    let Some(step_s) = median_step_s(&real[0].times_s) else { return errors };
    let over_s = OVER_S.max(step_s);
    for (row, from_s) in times_s.iter().enumerate() {
        // only where there is a pose: between two, one reading would count several times
        let own = real[0].times_s.partition_point(|t| *t < *from_s);
        let end = real[0].times_s.partition_point(|t| *t < from_s + over_s - 0.5 * step_s);
        let Some(to_s) = real[0].times_s.get(end).filter(|to| (*to - from_s - over_s).abs() <= 0.5 * step_s) else {
            continue;
        };
        if real[0].times_s[own] != *from_s {
            continue;
        }
        let between = |pose: &[Series; 3]| {
            let [from, to] = [*from_s, *to_s].map(|t| [0, 1, 2].map(|i| pose[i].at(t)));
            moved(from, to)
        };
        let (a, b) = (between(real), between(other));
        [a[0] - b[0], a[1] - b[1], turn(a[2] - b[2])].into_iter().zip(&mut errors).for_each(|(e, all)| all[row] = e);
    }
    errors
}

/// Standard deviation of what is fast in an error: the noise of both logs.
fn noise_std(errors: &[f64]) -> f64 {
    let there: Vec<f64> = errors.iter().copied().filter(|v| v.is_finite()).collect();
    let size = (there.iter().map(|v| v * v).sum::<f64>() / there.len().max(1) as f64).sqrt();
    let noise = second_difference_std([there.as_slice()]) / SECOND_DIFFERENCE.sqrt();
    noise.max(ROUNDING * size).max(f64::MIN_POSITIVE.sqrt())
}

/// How far `with` is nearer to the recording than `without`, over the gap of `before`: three runs on the inputs of one recording, of
/// which `before` and `without` may be the same. Channels and rows that are not in all three do not count.
#[must_use]
pub(crate) fn shrinkage(before: &Replayed, without: &Replayed, with: &Replayed) -> Shrinkage {
    let rows = before.errors.first().map_or(0, |e| e.1.len());
    let (mut old, mut new, mut gap) = (vec![0.0; rows], vec![0.0; rows], vec![0.0; rows]);
    let mut channels = Vec::new();
    for (channel, first) in &before.errors {
        let (Some(second), Some(third)) = (without.get(channel), with.get(channel)) else { continue };
        let all = [first, second, third];
        let there: Vec<usize> = (0..rows).filter(|k| all.iter().all(|e| e[*k].is_finite())).collect();
        if there.is_empty() {
            continue;
        }
        let std = all.iter().map(|e| noise_std(e)).fold(f64::INFINITY, f64::min);
        let n = there.len() as f64;
        for k in &there {
            let [b, o, w] = all.map(|e| (e[*k] / std).powi(2) / n);
            old[*k] += o;
            new[*k] += w;
            gap[*k] += b - 1.0 / n;
        }
        let rms = |e: &[f64]| (there.iter().map(|k| e[*k] * e[*k]).sum::<f64>() / n).sqrt();
        channels.push(ChannelErrors { channel, rms_before: rms(first), rms_after: rms(third), noise_std: std });
    }
    let size = block_rows(&new, &old).max((OVER_S / before.step_s).ceil() as usize);
    let gains: Vec<f64> = old.iter().zip(&new).map(|(o, n)| o - n).collect();
    let blocks: Vec<(f64, f64)> = block_sums(&gains, size).into_iter().zip(block_sums(&gap, size)).collect();
    let total = |blocks: &mut dyn Iterator<Item = (f64, f64)>| blocks.fold((0.0, 0.0), |s, b| (s.0 + b.0, s.1 + b.1));
    let (gained, whole) = total(&mut blocks.iter().copied());
    let mut draw = Stream::new(1, u64::MAX);
    let mut drawn: Vec<(f64, f64)> = Vec::with_capacity(DRAWS);
    for _ in 0..DRAWS {
        let mut pick = |_| blocks[((draw.uniform() * blocks.len() as f64) as usize).min(blocks.len() - 1)];
        drawn.push(if blocks.is_empty() { (0.0, 0.0) } else { total(&mut (0..blocks.len()).map(&mut pick)) });
    }
    let mut gained_by_draw: Vec<f64> = drawn.iter().map(|d| d.0).collect();
    let mut shares: Vec<f64> = drawn.iter().filter(|d| d.1 > 0.0).map(|d| d.0 / d.1).collect();
    let closed = (whole > 0.0).then(|| gained / whole);
    let resolved = closed.is_some() && 40 * (DRAWS - shares.len()) <= DRAWS;
    Shrinkage {
        closed,
        ci95: resolved.then(|| [0.025, 0.975].map(|p| quantile(&mut shares, p))),
        shrinks: quantile(&mut gained_by_draw, 0.025) > 0.0,
        channels,
    }
}
