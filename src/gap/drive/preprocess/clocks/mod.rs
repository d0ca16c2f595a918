//! stream(t) = true(t - τ), τ of each recording its own: time offsets of clocks, corrected before the diagnosis
//!
//! A sensor that queues is late by the same tenth of a second in every run: an effect, which stays in the data. A lag
//! that is negative, longer, or different in each recording is that of a clock. Stamps of the gyro are taken as true
//! (without a gyro, those of the wheels), unless all other streams agree that it is the gyro that is late.

use super::offset::{Integral, Lag, lag};
use super::wander;
use super::wander::Track;
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::TimeOffset;
use crate::gap::diagnosis::Drive;
use crate::ingest::assemble::merge::{Part, merge};
use crate::model::drive::Instrument;
use crate::signal::{Log, TimeAxis, names};
use crate::vehicle::{GAIN, Odometry, Rolling, opposite};
use rayon::prelude::*;
use std::borrow::Cow;

/// Name of the recordings to diagnose from, in the answer.
const FIT: &str = "fit";
/// Longest lag that counts as the delay of a sensor, s.
const LONGEST_DELAY_S: f64 = 0.2;
/// Standard deviations from which on two lags differ.
const DIFFERS: f64 = 4.0;
/// Rows by which they may differ besides: a clock is set no finer than the rows.
const ROWS: f64 = 2.0;
/// Standard deviation of a lag that is known to the row, in rows.
const TO_THE_ROW: f64 = 0.5;
/// Time from which on a stream that ends before another counts as stopped, s.
const STOPPED_S: f64 = 2.0;
/// Correlation from which on a wheel's sign is certain, and below which the stated one is doubted.
const CERTAIN: f64 = 0.8;
const WRONG: f64 = 0.4;

/// A stream of readings with a clock of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stream {
    Wheels,
    Pose,
    Torque,
}

impl Stream {
    const ALL: [Self; 3] = [Self::Wheels, Self::Pose, Self::Torque];

    fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Wheels => &[
                names::WHEEL_LEFT,
                names::WHEEL_RIGHT,
                names::ODO_SPEED,
                names::ODO_YAW_RATE,
                names::WHEEL_LEFT_TICKS,
                names::WHEEL_RIGHT_TICKS,
            ],
            Self::Pose => &[names::X, names::Y, names::HEADING],
            Self::Torque => &[names::TORQUE_LEFT, names::TORQUE_RIGHT],
        }
    }

    /// Channel in the answer.
    fn id(self) -> &'static str {
        match self {
            Self::Wheels => "wheels",
            Self::Pose => "pose",
            Self::Torque => "torque",
        }
    }

    /// Range of lags that count as a delay, s. The response times of motors and wheels show as a lead of the torques,
    /// which differs from course to course.
    fn delays_s(self) -> [f64; 2] {
        [if self == Self::Torque { -LONGEST_DELAY_S } else { 0.0 }, LONGEST_DELAY_S]
    }

    fn may_differ_s(self, step_s: f64) -> f64 {
        if self == Self::Torque { LONGEST_DELAY_S } else { ROWS * step_s }
    }
}

/// Recordings with corrected clocks.
pub(crate) struct Clocks<'a> {
    /// Recordings to diagnose from.
    pub(crate) fit: Vec<Cow<'a, Log>>,
    /// Hold-out recordings.
    pub(crate) hold: Vec<Cow<'a, Log>>,
    /// Time offsets that were removed.
    pub(crate) offsets: Vec<TimeOffset>,
    /// A sentence on each of them.
    pub(crate) said: Vec<String>,
    /// Notes on these, and on streams that stopped.
    pub(crate) notes: Vec<String>,
}

impl Clocks<'_> {
    /// Whether the clock of this stream was set in any recording to diagnose from.
    fn was_set(&self, stream: Stream) -> bool {
        self.offsets.iter().any(|o| o.recording.starts_with(FIT) && o.channel == stream.id())
    }

    /// Whether that of the wheels was set.
    pub(crate) fn wheels_were_set(&self) -> bool {
        self.was_set(Stream::Wheels)
    }

    /// Instruments whose delays are lags of streams whose clocks were set, as finely as the recordings tell.
    pub(crate) fn lags(&self) -> Vec<Instrument> {
        let wheels: &[_] = if self.was_set(Stream::Wheels) { &[Instrument::Wheels, Instrument::Gyro] } else { &[] };
        let pose: &[_] = if self.was_set(Stream::Pose) { &[Instrument::Pose] } else { &[] };
        [wheels, pose].concat()
    }

    /// The corrected recordings with the times since power-on of their first rows, in the order given.
    pub(crate) fn drives(&self, fit: &[Drive<'_>], hold: &[Drive<'_>]) -> [Vec<Drive<'_>>; 2] {
        let set = |logs: &'_ [Cow<'_, Log>], given: &[Drive<'_>]| -> Vec<f64> {
            let begins = |(log, given): (&Cow<'_, Log>, &Drive<'_>)| {
                let moved_s = if log.is_empty() { 0.0 } else { log.time.at(0) - given.log.time.at(0) };
                given.since_power_on_s + moved_s
            };
            logs.iter().zip(given).map(begins).collect()
        };
        [(&self.fit, fit), (&self.hold, hold)].map(|(logs, given)| {
            let begun = logs.iter().zip(set(logs, given)).zip(given);
            begun.map(|((log, start_s), given)| Drive::new(log, start_s).carrying(given.load_kg)).collect()
        })
    }
}

/// Lags of one recording's streams, in the order of [`Stream::ALL`], and its typical time between rows, s.
struct Seen {
    lags: [Option<Lag>; 3],
    /// Lag of the wheels' clock over time, if it wanders.
    wheels: Option<Track>,
    step_s: f64,
    has_gyro: bool,
}

/// Correction of the clock of one stream.
#[derive(Debug, Clone)]
struct Off {
    lag: Lag,
    wanders: Option<Track>,
}

impl Off {
    fn at(&self, t_s: f64) -> f64 {
        self.wanders.as_ref().map_or(self.lag.lag_s, |track| track.at(t_s))
    }
}

/// Sets the clocks of the streams of all recordings.
///
/// # Errors
/// [`ErrorKind::Column`] where a wheel reads backwards.
pub(crate) fn agree<'a>(config: &Config, fit: &[Drive<'a>], hold: &[Drive<'a>]) -> Result<Clocks<'a>> {
    let logs: Vec<&'a Log> = fit.iter().chain(hold).map(|d| d.log).collect();
    let seen = logs.par_iter().map(|log| look(config, log)).collect::<Result<Vec<_>>>()?;
    let taken_out = offsets(&seen);
    let mut clocks =
        Clocks { fit: Vec::new(), hold: Vec::new(), offsets: Vec::new(), said: Vec::new(), notes: Vec::new() };
    for (place, ((log, seen), out)) in logs.iter().zip(&seen).zip(taken_out).enumerate() {
        let (kind, number, of) = match place.checked_sub(fit.len()) {
            None => (FIT, place, fit.len()),
            Some(place) => ("hold", place, hold.len()),
        };
        let recording = if of > 1 { format!("{kind} {}", number + 1) } else { kind.into() };
        let mut set: Cow<'a, Log> = Cow::Borrowed(log);
        for (stream, off) in Stream::ALL.into_iter().zip(out).filter_map(|(s, l)| Some((s, l?))) {
            set = Cow::Owned(retimed(&set, stream, &off)?);
            let lag = off.lag;
            clocks.said.push(said(&log.source, stream, &off, seen.has_gyro));
            clocks.offsets.push(TimeOffset {
                channel: stream.id().into(),
                recording: recording.clone(),
                offset_s: lag.lag_s,
                std_s: lag.std_s,
            });
        }
        let apart_s = if matches!(set, Cow::Owned(_)) { 0.0 } else { STOPPED_S };
        let set = whole(set, apart_s, &mut clocks.notes)?;
        if place < fit.len() { &mut clocks.fit } else { &mut clocks.hold }.push(set);
    }
    Ok(clocks)
}

/// Clock offsets to correct, by recording and stream; none for lags that count as delays of sensors.
fn offsets(seen: &[Seen]) -> Vec<[Option<Off>; 3]> {
    let mut out = vec![[const { None }; 3]; seen.len()];
    let step_s = seen.iter().map(|s| s.step_s).fold(0.0, f64::max);
    let apart = |a: &Lag, b: &Lag| (a.lag_s - b.lag_s).abs() - DIFFERS * a.std_s.hypot(b.std_s);
    let alike = |lags: &[Lag], may_s: f64| lags.iter().all(|a| lags.iter().all(|b| apart(a, b) <= may_s));
    let wander = seen.iter().any(|s| s.wheels.is_some());
    let late_s = reference_late_s(seen, step_s, wander);
    for (i, stream) in Stream::ALL.into_iter().enumerate() {
        if late_s.is_some() && stream != Stream::Torque {
            continue;
        }
        let against = |l: Lag| Lag { lag_s: l.lag_s + late_s.unwrap_or(0.0), ..l };
        let lags: Vec<Lag> = seen.iter().filter_map(|s| s.lags[i]).map(against).collect();
        let may_s = stream.may_differ_s(step_s);
        let [least_s, most_s] = stream.delays_s();
        let is_delay = |l: &Lag| {
            let slack_s = DIFFERS * l.std_s + ROWS * step_s;
            l.lag_s >= least_s - slack_s && l.lag_s <= most_s + slack_s
        };
        let wander = wander && stream == Stream::Wheels;
        if !wander && lags.iter().all(is_delay) && alike(&lags, may_s) {
            continue;
        }
        for (out, seen) in out.iter_mut().zip(seen) {
            let wanders = seen.wheels.clone().filter(|_| stream == Stream::Wheels);
            let lag = seen.lags[i]
                .map(against)
                .filter(|l| wanders.is_some() || l.lag_s.abs() > DIFFERS * l.std_s + 0.5 * step_s);
            out[i] = lag.map(|lag| match wanders {
                Some(track) => {
                    let [lag_s, std_s] = track.mean_and_spread_s();
                    Off { lag: Lag { lag_s, std_s, ..lag }, wanders: Some(track) }
                }
                None => Off { lag, wanders: None },
            });
        }
    }
    out
}

/// Delay of the gyro (without one: of the wheels), s, where all other streams agree, in all recordings, that it has one
/// of a sensor. Torques have a lead of their own: they are asked where wheels or pose cannot tell. Wheels whose clock
/// seems to `wander` would not agree with another stream if it did.
fn reference_late_s(seen: &[Seen], step_s: f64, wander: bool) -> Option<f64> {
    let asked = |s: &Seen| if s.lags[..2].iter().all(Option::is_some) { s.lags[..2].to_vec() } else { s.lags.to_vec() };
    let lags: Vec<Lag> = seen.iter().flat_map(asked).flatten().collect();
    let slack_s = |l: &Lag| DIFFERS * l.std_s + ROWS * step_s;
    let late = |l: &Lag| l.lag_s <= slack_s(l) && l.lag_s >= -LONGEST_DELAY_S - slack_s(l);
    let alike = |a: &Lag, b: &Lag| (a.lag_s - b.lag_s).abs() <= DIFFERS * a.std_s.hypot(b.std_s) + ROWS * step_s;
    let several = |s: &Seen| s.lags.iter().flatten().filter(|l| l.lag_s < -slack_s(l)).count() >= 2;
    let agree = lags.iter().all(|a| late(a) && lags.iter().all(|b| alike(a, b)));
    let late_s = -lags.iter().map(|l| l.lag_s).sum::<f64>() / lags.len() as f64;
    (agree && late_s.is_finite() && (!wander || seen.iter().all(several))).then_some(late_s)
}

/// Lags of the streams of one recording.
fn look(config: &Config, log: &Log) -> Result<Seen> {
    let nothing = Seen { lags: [None; 3], wheels: None, step_s: log.time.median_step_s(), has_gyro: false };
    let Some(vehicle) = config.vehicle.as_ref() else { return Ok(nothing) };
    let times_s = log.time.to_vec();
    if times_s.windows(2).any(|w| !(w[1] > w[0])) {
        // refused with a message of its own where the rows are read
        return Ok(nothing);
    }
    let there = |name: &str| log.get(name).filter(|v| v.iter().any(|v| v.is_finite()));
    let robot = Rolling::new(vehicle);
    let odometry = Odometry::of(log, &robot, config.encoder.and_then(|e| e.tick_rad()));
    let wheels = odometry.as_ref().and_then(Odometry::wheels);
    let with_signs = |signs: [f64; 2]| {
        wheels.map(|[l, r]| {
            let both = l
                .iter()
                .zip(r)
                .map(|(l, r)| <(f64, f64)>::from(robot.speed_and_yaw_rate([signs[0] * l, signs[1] * r])));
            let (speed, yaw): (Vec<f64>, Vec<f64>) = both.unzip();
            (speed, Integral::of(&times_s, &yaw))
        })
    };
    let moving = with_signs([1.0; 2]);
    let gyro = there(names::GYRO_Z);
    let turning = gyro.map(|g| Integral::of(&times_s, g));
    let mut lags = [None; 3];
    let mut track = None;
    if let (Some(gyro), Some((_, yaw))) = (&turning, &moving) {
        let by = std::slice::from_ref(gyro);
        let found = lag(yaw, by);
        let correlation = |found: &Option<Lag>| found.map_or(0.0, |l| l.correlation);
        if correlation(&found) < WRONG {
            for (signs, side) in BACKWARDS {
                let other = with_signs(signs).and_then(|(_, yaw)| lag(&yaw, by));
                // wheels that turn far more than the gyro roll straight, and one of them is a little larger
                let as_far = |l: Lag| (GAIN[1].recip()..=GAIN[0].recip()).contains(&l.slope);
                if correlation(&other) > CERTAIN && other.is_some_and(as_far) {
                    let [found, hint] = side.map_or_else(|| opposite(vehicle, log), one_backwards);
                    return Err(Error::new(ErrorKind::Column, &log.source, found).hint(hint));
                }
            }
        }
        // wheels in all rows of the gyro share its clock, and slipping wheels run ahead of the robot: only a lag that
        // is known to the row is that of a clock
        let shared = shares_rows(log, Stream::Wheels) && is_as_fast(log, Stream::Wheels);
        let whole = |l: &Lag| l.lag_s.abs() > LONGEST_DELAY_S || l.std_s <= TO_THE_ROW * log.time.median_step_s();
        lags[0] = found.filter(|l| l.correlation > 0.0 && (!shared || whole(l)));
        let own = lags[0].filter(|_| !shared);
        track = own.and_then(|about| wander::track(yaw, gyro, &about));
    }
    let wheels_lag = lags[0];
    let reference = turning.as_ref().or(moving.as_ref().map(|m| &m.1));
    let headings = there(names::HEADING).map(|h| unwrapped(&times_s, h));
    if let (Some(reference), Some(heading)) = (reference, headings) {
        lags[1] = lag(&heading, std::slice::from_ref(reference));
    }
    if let (None, Some((speed, _)), (Some(x), Some(y))) = (lags[1], &moving, (there(names::X), there(names::Y))) {
        // by distance travelled, against the clock of the wheels
        let speed: Vec<f64> = speed.iter().map(|v| v.abs()).collect();
        lags[1] = lag(&way(&times_s, x, y), &[Integral::of(&times_s, &speed)]).filter(|l| l.correlation > 0.0);
        if let (Some(lag), Some(wheels)) = (&mut lags[1], wheels_lag) {
            lag.lag_s += wheels.lag_s;
            lag.std_s = lag.std_s.hypot(wheels.std_s);
        }
    }
    lags[1] = lags[1].filter(|l| l.correlation > 0.0);
    if let (Some(left), Some(right)) = (there(names::TORQUE_LEFT), there(names::TORQUE_RIGHT)) {
        let moment: Vec<f64> = left.iter().zip(right).map(|(l, r)| r - l).collect();
        // a moment accelerates, and turns against friction
        let rates = gyro.map(|g| (g.to_vec(), turning.clone())).or_else(|| {
            let (_, yaw) = moving.as_ref()?;
            let [l, r] = wheels?;
            Some((l.iter().zip(r).map(|(l, r)| r - l).collect(), Some(yaw.clone())))
        });
        if let Some((rates, Some(turned))) = rates {
            let read: Vec<(f64, f64)> =
                times_s.iter().copied().zip(rates).filter(|(_, rate)| rate.is_finite()).collect();
            let (at_s, rates) = read.into_iter().unzip();
            let found = lag(&Integral::held(&times_s, &moment), &[Integral::nodes(at_s, rates), turned]);
            lags[2] = found.filter(|l| l.correlation > 0.0);
        }
    }
    Ok(Seen { lags, wheels: track, step_s: log.time.median_step_s(), has_gyro: gyro.is_some() })
}

/// Wrong signs of the wheels, with the side that has one; none: both.
const BACKWARDS: [([f64; 2], Option<&str>); 3] =
    [([-1.0, 1.0], Some("left")), ([1.0, -1.0], Some("right")), ([-1.0, -1.0], None)];

/// Error message and hint for a wheel with the wrong sign.
fn one_backwards(side: &str) -> [String; 2] {
    [
        format!("the {side} wheel reads backwards: with its sign turned round both wheels turn as the gyro does"),
        format!("turn it round: --map wheel_{side}_rad_s=-COLUMN"),
    ]
}

/// A heading without its jumps by full turns: the integral of the yaw rate.
fn unwrapped(times_s: &[f64], heading_rad: &[f64]) -> Integral {
    let (mut at_s, mut headings): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    for (t, h) in times_s.iter().zip(heading_rad).filter(|r| r.1.is_finite()) {
        let turns = headings.last().map_or(0.0, |last| ((h - last) / std::f64::consts::TAU).round());
        at_s.push(*t);
        headings.push(h - turns * std::f64::consts::TAU);
    }
    Integral::nodes(at_s, headings)
}

/// Distance along the positions: the integral of the speed.
fn way(times_s: &[f64], x_m: &[f64], y_m: &[f64]) -> Integral {
    let (mut at_s, mut ways) = (Vec::new(), Vec::new());
    let (mut last, mut sum) = (None::<(f64, f64)>, 0.0);
    for ((t, x), y) in times_s.iter().zip(x_m).zip(y_m).filter(|r| r.0.1.is_finite() && r.1.is_finite()) {
        sum += last.map_or(0.0, |(x0, y0)| (x - x0).hypot(y - y0));
        last = Some((*x, *y));
        at_s.push(*t);
        ways.push(sum);
    }
    Integral::nodes(at_s, ways)
}

/// Note on the offset of a clock.
fn said(source: &str, stream: Stream, off: &Off, has_gyro: bool) -> String {
    let (id, reference) = (stream.id(), if has_gyro { "gyro" } else { "wheels" });
    let Lag { lag_s, std_s, .. } = off.lag;
    if let Some(track) = &off.wanders {
        let low = track.lags_s.iter().copied().fold(f64::INFINITY, f64::min);
        let high = track.lags_s.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        return format!(
            "{source}: the clock of the {id} wanders against that of the {reference}, from {low:.2} to {high:.2} s late \
             ({lag_s:.2} ± {std_s:.2} s): set, as far as the yaw rates tell, before anything was judged. Stamps that were made of \
             a nominal rate do so where readings were lost: log the time at which each was taken."
        );
    }
    format!(
        "{source}: the clock of the {id} is {:.3} ± {std_s:.3} s {} that of the {reference}: set before anything was judged.",
        lag_s.abs(),
        if lag_s > 0.0 { "behind" } else { "ahead of" },
    )
}

/// Rows in which a stream has readings, and rows in which others have.
fn rows_of(log: &Log, stream: Stream) -> [Vec<bool>; 2] {
    let is_own = |name: &str| stream.channels().contains(&name);
    // values that are held, or run on, stand in every row
    let is_read = |name: &str| !Stream::Torque.channels().contains(&name) && name != names::SINCE_POWER_ON;
    let rows = |wanted: &dyn Fn(&str) -> bool| -> Vec<bool> {
        let channels: Vec<_> = log.channels.iter().filter(|c| wanted(&c.name)).collect();
        (0..log.len()).map(|k| channels.iter().any(|c| c.values[k].is_finite())).collect()
    };
    [rows(&is_own), rows(&|name| !is_own(name) && is_read(name))]
}

/// Whether most readings of a stream stand in rows in which others read too.
fn shares_rows(log: &Log, stream: Stream) -> bool {
    let [own, others] = rows_of(log, stream);
    let read = own.iter().filter(|there| **there).count();
    2 * own.iter().zip(&others).filter(|(own, other)| **own && **other).count() > read
}

/// Whether a stream has readings in most of the rows in which others have. A stream with a rate of its own has its own
/// clock, even where its readings were put into the rows of others.
fn is_as_fast(log: &Log, stream: Stream) -> bool {
    let [own, others] = rows_of(log, stream).map(|rows| rows.into_iter().filter(|there| *there).count());
    2 * own > others
}

/// `log` with the readings of one stream moved earlier by its offset. Readings in the rows of other sensors move to the
/// nearest of these, as the diffusion of the speeds depends on the rows. Others keep rows of their own.
fn retimed(log: &Log, stream: Stream, off: &Off) -> Result<Log> {
    let times_s = log.time.to_vec();
    let is_own = |name: &str| stream.channels().contains(&name);
    let [own, others] = rows_of(log, stream);
    if shares_rows(log, stream) {
        let mut out = log.clone();
        let to: Vec<Option<usize>> = times_s.iter().map(|t| nearest(&times_s, t - off.at(*t))).collect();
        for channel in out.channels.iter_mut().filter(|c| is_own(&c.name)) {
            let from = std::mem::replace(&mut channel.values, vec![f64::NAN; times_s.len()]);
            for (to, value) in to.iter().zip(from).filter(|(_, v)| v.is_finite()) {
                if let Some(to) = to {
                    channel.values[*to] = value;
                }
            }
        }
        return Ok(out);
    }
    let part = |rows: &[bool], wanted: &dyn Fn(&str) -> bool, late_s: &dyn Fn(f64) -> f64| -> Result<Part> {
        let mut kept: Vec<usize> = (0..log.len()).filter(|k| rows[*k]).collect();
        let mut last_s = f64::NEG_INFINITY;
        // a clock that wanders far may reverse the order of stamps
        kept.retain(|k| {
            let at_s = times_s[*k] - late_s(times_s[*k]);
            let ahead = at_s > last_s;
            last_s = last_s.max(at_s);
            ahead
        });
        let at_s = kept.iter().map(|k| times_s[*k] - late_s(times_s[*k])).collect();
        let mut part = Log::new(log.source.clone(), TimeAxis::Explicit(at_s));
        for channel in log.channels.iter().filter(|c| wanted(&c.name)) {
            part.push(channel.name.clone(), kept.iter().map(|k| channel.values[*k]).collect())?;
        }
        Ok(Part { log: part, zero_s: 0.0, dated: false })
    };
    let parts = vec![part(&others, &|name| !is_own(name), &|_| 0.0)?, part(&own, &is_own, &|t| off.at(t))?];
    let (mut out, _) = merge(parts)?;
    out.source.clone_from(&log.source);
    Ok(out)
}

/// Row nearest to a time; none where it is further than half a row.
fn nearest(times_s: &[f64], t_s: f64) -> Option<usize> {
    let after = times_s.partition_point(|t| *t < t_s);
    let found = [after.checked_sub(1), Some(after).filter(|k| *k < times_s.len())].into_iter().flatten();
    let best = found.min_by(|a, b| (times_s[*a] - t_s).abs().total_cmp(&(times_s[*b] - t_s).abs()))?;
    let beside = if best + 1 < times_s.len() { best + 1 } else { best.checked_sub(1)? };
    ((times_s[best] - t_s).abs() <= 0.51 * (times_s[beside] - times_s[best]).abs()).then_some(best)
}

/// Part of a recording in which gyro and wheels both read, if one begins or ends over `apart_s` from the other.
fn whole<'a>(log: Cow<'a, Log>, apart_s: f64, notes: &mut Vec<String>) -> Result<Cow<'a, Log>> {
    let there = |names: &[&str]| {
        let any = |k: &usize| names.iter().any(|n| log.get(n).is_some_and(|v| v[*k].is_finite()));
        Some([(0..log.len()).find(any)?, (0..log.len()).rev().find(any)?])
    };
    let (Some(gyro), Some(wheels)) = (there(&[names::GYRO_Z]), there(Stream::Wheels.channels())) else {
        return Ok(log);
    };
    let (from, to) = (gyro[0].max(wheels[0]), gyro[1].min(wheels[1]));
    let at = |k: usize| log.time.at(k);
    let [late_s, early_s] = [at(from) - at(0), at(log.len() - 1) - at(to)];
    if from >= to || late_s.max(early_s) <= apart_s {
        return Ok(log);
    }
    if late_s.max(early_s) > STOPPED_S {
        let span = |[first, last]: [usize; 2]| format!("from {:.2} to {:.2} s", at(first), at(last));
        notes.push(format!(
            "{}: the gyro reads {}, the wheels {}: judged where both do.",
            log.source,
            span(gyro),
            span(wheels)
        ));
    }
    let at_s = (from..=to).map(at).collect();
    let mut out = Log::new(log.source.clone(), TimeAxis::Explicit(at_s));
    for channel in &log.channels {
        out.push(channel.name.clone(), channel.values[from..=to].to_vec())?;
    }
    Ok(Cow::Owned(out))
}

#[cfg(test)]
pub(crate) mod tests;
