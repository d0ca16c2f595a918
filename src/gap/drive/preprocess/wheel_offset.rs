//! wheels(t) = w(t - τ), τ > 0: readings of the wheels that come late, moved to their true times
//!
//! Where messages queue, the odometry lags the gyro by some tenths of a second: too far for a derivative by τ, and a
//! delay of the gyro, which the library knows, has the other sign. Stamping the readings τ earlier changes no density,
//! so that the likelihoods of the drive for different τ are comparable.

use crate::effects::{About, Parameters};
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::record::Record;
use crate::gap::selection::sets::Part;
use crate::model::drive::Instrument;
use rayon::prelude::*;

/// Longest delay that is looked for, s: longer ones are offsets of a clock.
const LONGEST_S: f64 = 0.4;
/// Delays that are tried first.
const TRIED: usize = 20;
/// Step at which the refinement of a delay ends, as a share of the time between rows.
const FINE: f64 = 0.02;
/// Parts of a drive whose delays are compared.
const PARTS: usize = 8;
/// Delays that are tried in each part, on either side, with a parabola through the best.
const NEAR: i32 = 6;
/// Difference of the times of one row at most, s.
const SAME_S: f64 = 1e-9;

/// A delay of the wheels' readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WheelOffset {
    /// τ, s.
    pub delay_s: f64,
    /// Its standard deviation, from the scatter between parts of the drive, s.
    pub std_s: f64,
    /// ln p with the readings moved, nats.
    pub ln_likelihood: f64,
    /// Gain in ln p over no delay, nats.
    pub gain: f64,
}

impl WheelOffset {
    /// Part of a set that states it; `known`: the effect of the library, none: a free form.
    #[must_use]
    pub(crate) fn part(&self, share: f64, known: Option<&About>) -> Part {
        let text =
            format!("the wheels lag the gyro by {:.3} ± {:.3} s: their readings come late", self.delay_s, self.std_s);
        let Some(known) = known else {
            return Part::described("free.delay.wheels", false, share, text);
        };
        let mut part = Part::described(known.id, true, share, text);
        part.parameters = Parameters::from([(known.size().into(), self.delay_s)]);
        part.std = Parameters::from([(known.size().into(), self.std_s)]);
        part
    }
}

/// `record` with the readings of its wheels stamped `delay_s` earlier. Those from before the log began are dropped.
/// Where wheels and gyro share their rows, they are moved by whole rows: the diffusion of the speeds depends on the
/// rows.
#[must_use]
pub(crate) fn put_back(record: &Record, delay_s: f64) -> Record {
    if record.wheels_share_rows() {
        return record.earlier(Instrument::Wheels, (delay_s / record.step_s).round() as usize);
    }
    record.by_drive(|_, drive| put_back_in(drive, delay_s))
}

fn put_back_in(record: &Record, delay_s: f64) -> Record {
    let n = record.len();
    let begin_s = record.times_s.first().copied().unwrap_or(0.0);
    let power_on_s = record.since_power_on_s.first().copied().unwrap_or(0.0) - begin_s;
    let is_there = |k: &usize| record.wheels_rad_s.iter().any(|w| w[*k].is_finite());
    let moved = |k: usize| record.times_s[k] - delay_s;
    let late: Vec<usize> = (0..n).filter(|k| is_there(k) && moved(*k) >= begin_s).collect();
    let mut out = Record {
        times_s: Vec::with_capacity(n + late.len()),
        since_power_on_s: Vec::with_capacity(n + late.len()),
        torques_n_m: None,
        gyro_rad_s: record.gyro_rad_s.as_ref().map(|_| Vec::new()),
        wheels_rad_s: [Vec::new(), Vec::new()],
        pose: record.pose.as_ref().map(|_| [Vec::new(), Vec::new(), Vec::new()]),
        ..record.clone()
    };
    let (mut row, mut wheel) = (0, 0);
    while row < n || wheel < late.len() {
        let there_s = record.times_s.get(row).copied().unwrap_or(f64::INFINITY);
        let wheels_s = late.get(wheel).map_or(f64::INFINITY, |k| moved(*k));
        let t_s = there_s.min(wheels_s);
        let here = (there_s <= t_s + SAME_S).then_some(row);
        let turned = (wheels_s <= t_s + SAME_S).then(|| late[wheel]);
        row += usize::from(here.is_some());
        wheel += usize::from(turned.is_some());
        let of = |values: &[f64], at: Option<usize>| at.map_or(f64::NAN, |k| values[k]);
        out.times_s.push(t_s);
        out.since_power_on_s.push(here.map_or(t_s + power_on_s, |k| record.since_power_on_s[k]));
        for (to, from) in out.wheels_rad_s.iter_mut().zip(&record.wheels_rad_s) {
            to.push(of(from, turned));
        }
        if let (Some(to), Some(from)) = (&mut out.gyro_rad_s, &record.gyro_rad_s) {
            to.push(of(from, here));
        }
        if let (Some(to), Some(from)) = (&mut out.pose, &record.pose) {
            to.iter_mut().zip(from).for_each(|(to, from)| to.push(of(from, here)));
        }
    }
    out
}

/// The delay of the wheels that explains `record` best under `models`. None without a gyro to compare with, and none
/// with torques: a delay then shows otherwise.
#[must_use]
pub(crate) fn find(record: &Record, models: &Models, noise: &Noise) -> Option<WheelOffset> {
    if record.gyro_rad_s.is_none() || record.torques_n_m.is_some() || record.span_s() < 4.0 * LONGEST_S {
        return None;
    }
    let whole = without_begin(record);
    let weigh = |delay_s: f64| {
        let moved;
        let record = if delay_s > 0.0 {
            moved = put_back(&whole, delay_s);
            &moved
        } else {
            &whole
        };
        run(record, models, noise, &[], |_| {}).ln_likelihood()
    };
    let nothing = weigh(0.0);
    let whole_rows = record.wheels_share_rows();
    let mut step_s = if whole_rows { record.step_s } else { LONGEST_S / TRIED as f64 };
    let count = (LONGEST_S / step_s) as usize;
    let try_one = |i: usize| (i as f64 * step_s, weigh(i as f64 * step_s));
    let tried: Vec<(f64, f64)> = (1..count).into_par_iter().map(try_one).collect();
    let mut best = tried.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    while !whole_rows && step_s > FINE * record.step_s {
        step_s *= 0.5;
        for delay_s in [best.0 - step_s, best.0 + step_s] {
            let weight = weigh(delay_s.clamp(0.0, LONGEST_S));
            if weight > best.1 {
                best = (delay_s, weight);
            }
        }
    }
    let std_s = scatter(&whole, best.0, |part, delay_s| {
        run(&put_back(part, delay_s), models, noise, &[], |_| {}).ln_likelihood()
    });
    (best.0 > 0.0).then_some(WheelOffset { delay_s: best.0, std_s, ln_likelihood: best.1, gain: best.1 - nothing })
}

/// Gain in ln p, nats, with the readings of the wheels moved `delay_s` earlier, under `models`.
#[must_use]
pub(crate) fn gain(record: &Record, models: &Models, noise: &Noise, delay_s: f64) -> f64 {
    let whole = without_begin(record);
    let weigh = |record: &Record| run(record, models, noise, &[], |_| {}).ln_likelihood();
    weigh(&put_back(&whole, delay_s)) - weigh(&whole)
}

/// `record` without the first readings of its wheels, so that the same number is left at every delay.
fn without_begin(record: &Record) -> Record {
    let mut out = record.clone();
    for rows in record.drives() {
        let times_s = &record.times_s[rows.clone()];
        let early = times_s.partition_point(|t| *t < times_s[0] + LONGEST_S);
        for wheel in &mut out.wheels_rad_s {
            wheel[rows.clone()][..early].fill(f64::NAN);
        }
    }
    out
}

/// Standard deviation of a delay from its scatter between parts of the drive: innovations are correlated beside white
/// noise, and the curvature of the likelihood would be too optimistic.
fn scatter(record: &Record, delay_s: f64, weigh: impl Fn(&Record, f64) -> f64 + Sync) -> f64 {
    let n = record.len();
    let of = |part: usize| {
        let part = record.window(part * n / PARTS..(part + 1) * n / PARTS);
        let step_s = 0.5 * delay_s / f64::from(NEAR);
        let tried: Vec<f64> = (-NEAR..=NEAR).map(|i| weigh(&part, delay_s + f64::from(i) * step_s)).collect();
        let best = (0..tried.len()).max_by(|a, b| tried[*a].total_cmp(&tried[*b])).unwrap_or(NEAR as usize);
        let vertex = match tried[best.saturating_sub(1)..(best + 2).min(tried.len())] {
            [below, top, above] if below + above < 2.0 * top => 0.5 * (above - below) / (2.0 * top - below - above),
            _ => 0.0,
        };
        delay_s + (best as f64 - f64::from(NEAR) + vertex) * step_s
    };
    let found: Vec<f64> = (0..PARTS).into_par_iter().map(of).collect();
    let mean = found.iter().sum::<f64>() / PARTS as f64;
    let square = found.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (PARTS - 1) as f64;
    // no finer than the delays that were tried
    (square / PARTS as f64).sqrt().max(0.25 * delay_s / f64::from(NEAR))
}
