//! τ̂ = argmax Σ u_real(t) u_sim(t - τ)/√(Σ u² Σ u²):  runs with the same commands, aligned by these

use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Log, names};
use serde::Serialize;
use std::collections::BTreeMap;

/// Step of the grid on which commands are compared, s.
const GRID_S: f64 = 0.05;
/// Share of the commands' variance that the other run must explain for both to have the same.
const SAME: f64 = 0.5;
/// Longest stretch that is compared at every lag, s.
const LONGEST_S: f64 = 600.0;

/// Inputs by which runs are aligned, the first that both have: what was commanded, what drove, what turned.
const INPUTS: [[&str; 2]; 4] = [
    [names::COMMAND_LEFT, names::COMMAND_RIGHT],
    [names::COMMAND_SPEED, names::COMMAND_YAW_RATE],
    [names::TORQUE_LEFT, names::TORQUE_RIGHT],
    [names::WHEEL_LEFT, names::WHEEL_RIGHT],
];

/// A run of the simulator and a recording with the same commands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    /// The simulator's log.
    pub simulator: String,
    /// The recording.
    pub real: String,
    /// Channels by which they are aligned.
    pub inputs: [&'static str; 2],
    /// Time of the recording at which the simulator's log begins, less the simulator's, s.
    pub offset_s: f64,
    /// Correlation of the inputs there.
    pub correlation: f64,
    /// Root mean square differences of the channels that both have, in the unit of each.
    pub rms: BTreeMap<String, f64>,
}

/// A channel at even times; NaN where it has none.
fn sampled(log: &Log, name: &str) -> Option<(f64, Vec<f64>)> {
    let values = log.get(name)?;
    let there: Vec<(f64, f64)> =
        (0..log.len()).map(|k| (log.time.at(k), values[k])).filter(|r| r.1.is_finite()).collect();
    let (first, last) = (there.first()?.0, there.last()?.0.min(there.first()?.0 + LONGEST_S));
    let mut k = 0;
    let at = |i: usize| {
        let t = first + i as f64 * GRID_S;
        while k + 1 < there.len() && there[k + 1].0 <= t {
            k += 1;
        }
        let (t0, v0) = there[k];
        there.get(k + 1).map_or(v0, |(t1, v1)| v0 + (v1 - v0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0))
    };
    Some((first, (0..=((last - first) / GRID_S) as usize).map(at).collect()))
}

fn both(log: &Log, channels: [&str; 2]) -> Option<(f64, [Vec<f64>; 2])> {
    let ((a, left), (_, right)) = (sampled(log, channels[0])?, sampled(log, channels[1])?);
    Some((a, [left, right]))
}

/// Correlation of two pairs of signals, the second moved by `lag` steps, over where both are.
fn correlation(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2], lag: i64) -> f64 {
    let (mut cross, mut own, mut other, mut count) = (0.0, 0.0, 0.0, 0);
    for (x, y) in a.iter().zip(b) {
        let from = lag.max(0);
        let to = (x.len() as i64).min(y.len() as i64 + lag);
        for i in from..to {
            let (u, v) = (x[i as usize], y[(i - lag) as usize]);
            cross += u * v;
            own += u * u;
            other += v * v;
            count += 1;
        }
    }
    let enough = count as usize > a[0].len().min(b[0].len());
    if enough && own > 0.0 && other > 0.0 { cross / (own * other).sqrt() } else { 0.0 }
}

/// Aligns a recording with the run of the simulator that had the same commands.
///
/// # Errors
/// [`ErrorKind::Column`] where they share no commands, torques or wheels; [`ErrorKind::Value`] where the commands differ.
pub fn paired(simulator: &Log, real: &Log) -> Result<Pair> {
    let found = INPUTS.into_iter().find_map(|inputs| Some((inputs, both(real, inputs)?, both(simulator, inputs)?)));
    let Some((inputs, (begin, a), (other, b))) = found else {
        return Err(Error::new(
            ErrorKind::Column,
            &real.source,
            "has no commands, torques or wheels that the simulator's log has too",
        )
        .hint("leave out --paired: unpaired logs are compared as well"));
    };
    let furthest = a[0].len().max(b[0].len()) as i64 / 2;
    let tried = (-furthest..=furthest).map(|lag| (correlation(&a, &b, lag), lag));
    let (best, lag) = tried.max_by(|x, y| x.0.total_cmp(&y.0)).unwrap_or((0.0, 0));
    if best.max(0.0).powi(2) < SAME {
        let found = format!(
            "the commands differ from those of {}: at the best lag {} and {} have a correlation of {best:.2}",
            simulator.source, inputs[0], inputs[1]
        );
        return Err(Error::new(ErrorKind::Value, &real.source, found)
            .hint("give runs with the same commands, in the same order, or leave out --paired"));
    }
    // the peak between the steps of the grid, by the parabola through three correlations
    let [below, above] = [-1, 1].map(|d| correlation(&a, &b, lag + d));
    let bend = 2.0 * best - below - above;
    let vertex = if bend > 0.0 { (0.5 * (above - below) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    let offset_s = begin - other + (lag as f64 + vertex) * GRID_S;
    let rms = [names::WHEEL_LEFT, names::WHEEL_RIGHT, names::GYRO_Z, names::TORQUE_LEFT, names::TORQUE_RIGHT]
        .into_iter()
        .filter_map(|name| Some((name.to_string(), difference(real, simulator, name, offset_s)?)));
    Ok(Pair {
        simulator: simulator.source.clone(),
        real: real.source.clone(),
        inputs,
        offset_s,
        correlation: best,
        rms: rms.collect(),
    })
}

/// Root mean square difference of a channel, the simulator's moved by `offset_s`.
fn difference(real: &Log, simulator: &Log, name: &str, offset_s: f64) -> Option<f64> {
    let ((begin, a), (other, b)) = (sampled(real, name)?, sampled(simulator, name)?);
    let lag = ((other + offset_s - begin) / GRID_S).round() as i64;
    let pairs = (0..a.len() as i64).filter_map(|i| Some(a[i as usize] - b.get(usize::try_from(i - lag).ok()?)?));
    let (n, sum) = pairs.fold((0, 0.0), |(n, sum), d| (n + 1, sum + d * d));
    (n > 0).then(|| (sum / f64::from(n)).sqrt())
}
