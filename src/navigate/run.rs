//! The filter over a log.
//!
//! Row k's readings are taken in at its time; row k's torques then act until the next row's. Missing readings (NaN) are
//! left out, so that sensors may have rates of their own. Steps may be uneven.

use super::compare::{NOT_ALIGNED, aligned_errors};
use super::consistency::Gatherer;
use super::filter::{Filter, RollingFilter, SlipFilter};
use super::gyro_changes::GyroChanges;
use super::model::{Input, MotionModel, state};
use super::reading::Sensor;
use super::reference::{self, ErrorSums, Reference};
use super::results::{Estimate, FinalPose, Run, Smoothed, Summary};
use super::sensors::{self, Sensors};
use super::smoother::Tape;
use super::standstill::{Detector, StandstillSummary};
use super::table::Table;
use super::temperature;
use super::{ErrorModel, Settings, WheelModel};
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::progress;
use crate::signal::{Log, increasing_times, names as channels, since_power_on};
use crate::vehicle::Rolling;

/// Runs the filter over `log`.
///
/// It takes in what the log has: the gyro, wheel speeds (or the speed and yaw rate that an odometry made of them), or the
/// speed alone. Something must tell the speed, and gyro or wheels the yaw rate; without a gyro `[gyro]` is not needed.
///
/// Torques drive the prediction where the log has them. Rows without get unknown accelerations, white with the
/// densities of `settings`, or else those of the log's own motion: with D(δ) the mean square change of the speed that
/// the encoders show over a lag δ of about 0.2 s, a white acceleration of density q gives D = q δ + 2 σ², σ² being the
/// encoders' noise in that speed; so q = (D - 2 σ²)/δ, and likewise for the yaw rate, of wheels or gyro, whichever has
/// the smaller noise.
///
/// With `[gyro.temperature]` the log must have the temperature: its part is taken off the gyro's readings beforehand, and the
/// error of what is left is estimated; the error that the run reports is the sum.
///
/// # Errors
/// [`ErrorKind::Config`] if a table is missing, or the configuration holds effects ([`super::run_with`] takes them);
/// [`ErrorKind::Column`] if nothing tells speed or yaw rate, the temperature is missing that the configuration needs, or the pose
/// is missing that is to be used or started at; [`ErrorKind::Time`] if time does
/// not run forward; [`ErrorKind::TooShort`] with fewer than two rows; [`ErrorKind::Numeric`] with the row where the
/// state overflows.
pub fn run(config: &Config, log: &Log, settings: &Settings) -> Result<Run> {
    refuse_effects(config)?;
    if sensors::gyro(log).is_none() {
        if settings.off_time_s.is_some() {
            let found = format!("{} has no gyro that was off", log.source);
            return Err(Error::new(ErrorKind::Usage, "--off-time", found).hint("leave out --off-time"));
        }
        let settings = Settings { error_model: ErrorModel::Off, ..*settings };
        return nominal(&sensors::without_gyro(config), log, &settings);
    }
    if settings.error_model == ErrorModel::WarmUp
        && let Some(compensated) = temperature::compensated(config, log)?
    {
        let run = nominal(&compensated.config, &compensated.log, settings)?;
        return Ok(compensated.given_back(run));
    }
    nominal(config, log, settings)
}

fn nominal(config: &Config, log: &Log, settings: &Settings) -> Result<Run> {
    let plain = &GyroChanges::default();
    let start_s = since_power_on(log, settings.since_power_on_s)?.first().copied().unwrap_or_default();
    if slips(config, log, settings) {
        let (filter, notes) = SlipFilter::new(config, settings, start_s)?;
        return over_log(filter, notes, config, log, settings, start_s, plain);
    }
    let (filter, mut notes) = RollingFilter::new(config, settings, start_s)?;
    if settings.wheels == WheelModel::Auto && config.traction.is_some() {
        notes.push("the log has no torques to tell slip by: [traction] is not used".to_string());
    }
    over_log(filter, notes, config, log, settings, start_s, plain)
}

/// Whether the filter lets the wheels slip by `[traction]`.
pub(super) fn slips(config: &Config, log: &Log, settings: &Settings) -> bool {
    match settings.wheels {
        WheelModel::Auto => config.traction.is_some() && torques(log).is_some(),
        WheelModel::Rolling => false,
        WheelModel::Slip => true,
    }
}

pub(super) fn over_log<const N: usize, M: MotionModel<N>>(
    mut filter: Filter<N, M>,
    mut notes: Vec<String>,
    config: &Config,
    log: &Log,
    settings: &Settings,
    start_s: f64,
    gyro: &GyroChanges,
) -> Result<Run> {
    if log.len() < 2 {
        let found = format!("{} rows, and a drive needs two", log.len());
        return Err(Error::new(ErrorKind::TooShort, &log.source, found).hint("give a longer log"));
    }
    let times = increasing_times(log)?;
    let assumed = log.get(channels::SINCE_POWER_ON).is_none();
    if assumed && settings.error_model == ErrorModel::WarmUp {
        let channel = channels::SINCE_POWER_ON;
        notes.push(format!("the log has no {channel}: taken to begin {start_s} s after power-on (--start-offset)"));
    }
    let age_s = age_at_start_s(config, settings)? + start_s;
    notes.extend(outside_validity(config, age_s, age_s + log.time.span_s()));
    let odometry = sensors::odometry(config, log)?;
    let mut sensors = Sensors::of(&odometry, log, &times, config, settings)?;
    if let Some(readings) = &gyro.readings {
        sensors.replace_gyro(readings);
    }
    sensors.delay(&[Sensor::Gyro], gyro.delay_s, &times);
    sensors.delay(&[Sensor::WheelLeft, Sensor::WheelRight, Sensor::Speed], gyro.wheel_delay_s, &times);
    notes.extend(sensors.notes.iter().cloned());
    let robot = Rolling::new(config.require_vehicle()?);
    let noise = |sensor, interval_s| filter.variance_over(sensor, interval_s);
    let inputs = Inputs::new(log, settings, || sensors.acceleration_densities(&robot, log, &times, &noise))?;
    let mut next_mean = sensors.means.iter().peekable();
    let reference = Reference::new(log, config.pose.as_ref());
    let laid_on = reference.as_ref().and_then(|r| r.share(settings));
    if let Some(pose) = reference::start(log, reference.as_ref(), settings)? {
        let std = config.pose.map_or([0.0; 2], |p| [p.position_std_m, p.heading_std_rad]);
        filter = filter.starting_at(pose, std);
    } else if let (None, Some((0, first))) = (laid_on, reference.as_ref().and_then(Reference::first)) {
        let distance_m = first.position[0].hypot(first.position[1]);
        if distance_m > 0.01 + 5.0 * config.pose.map_or(0.0, |p| p.position_std_m) {
            notes.push(format!(
                "the reference begins {distance_m:.2} m from the origin: compare with --start-at-reference"
            ));
        }
    }

    let mut detector =
        settings.standstill.map(|rule| Detector::new(rule, config, log, &odometry, &times)).transpose()?;
    let mut standstill = None;
    let mut gatherer = Gatherer::new();
    let mut innovations = Vec::new();
    let mut errors = ErrorSums::default();
    let slip_modelled = filter.slips().is_some();
    if settings.smooth {
        filter.tape = Tape::for_rows(log.len()).map(Box::new);
        let all = filter.tape.is_some();
        let found = || format!("{} rows are too many to smooth: each pose is given the readings up to it", log.len());
        notes.extend((!all).then(found));
    }
    let mut table = Table::new(log.len(), slip_modelled);
    for k in 0..times.len() {
        progress::tell(k, times.len());
        if let Some(variance) = gyro.variances.get(k) {
            filter.set_noise_variance(Sensor::Gyro, *variance);
        }
        for (sensor, values) in &sensors.readings {
            if let Some(innovation) = filter.update(*sensor, values[k]) {
                gatherer.add(*sensor, &innovation);
                if settings.innovations {
                    innovations.push((times[k], *sensor, innovation));
                }
            }
        }
        if let Some(variances) = detector.as_mut().and_then(|d| d.variances(k)) {
            let before = filter.std()[state::GYRO_ERROR];
            filter.update_still(variances);
            standstill = Some(StandstillSummary::add(standstill, before, filter.std()[state::GYRO_ERROR]));
        }
        table.push(filter.mean(), &filter.std(), filter.slips(), gatherer.end_row());
        if filter.tape.is_some() {
            let (mean, covariance) = (*filter.mean(), filter.covariance());
            filter.tape.iter_mut().for_each(|tape| tape.row(&mean, covariance));
        }
        if !filter.mean().iter().all(|v| v.is_finite()) {
            return Err(Error::new(ErrorKind::Numeric, &log.source, "the filter's state is no longer finite")
                .at(format!("row {}", k + 1))
                .hint("look for absurd readings in this row and those before"));
        }
        if let (Some(reference), None) = (&reference, laid_on) {
            let m = filter.mean();
            let pose = [m[state::X], m[state::Y], m[state::HEADING]];
            if reference.at(k).is_some() {
                let covariance = filter.covariance().fixed_view::<3, 3>(state::X, state::X).into_owned();
                errors.add(reference, k, pose, Some(covariance));
            }
        }
        if let Some(next) = times.get(k + 1) {
            let mut at_s = times[k];
            while let Some(mean) = next_mean.next_if(|mean| mean.row == k) {
                if mean.middle_s > at_s {
                    filter.predict(inputs.at(k), mean.middle_s - at_s);
                    at_s = mean.middle_s;
                }
                let innovation = match mean.sensor {
                    // what is late is read at one instant, and no mean
                    late if mean.interval_s == 0.0 => filter.update(late, mean.mean),
                    wheels => {
                        gatherer.of_ticks(wheels);
                        filter.update_mean(wheels, mean.mean, mean.interval_s)
                    }
                };
                if let Some(innovation) = innovation {
                    gatherer.add(mean.sensor, &innovation);
                    if settings.innovations {
                        innovations.push((mean.middle_s.max(at_s), mean.sensor, innovation));
                    }
                }
            }
            filter.predict(inputs.at(k), next - at_s);
        }
    }
    let consistency = gatherer.finish(inputs.densities.map(|_| log.time.span_s() / sensors::LAG_S));
    if consistency.readings == 0 {
        return Err(Error::new(ErrorKind::Value, &log.source, "no reading of gyro or wheels is a finite number")
            .hint("check the columns: gyroid inspect LOG"));
    }
    let errors = match (&reference, laid_on) {
        (Some(reference), Some(share)) => {
            let errors = aligned_errors(reference, &times, &table.track(), share);
            notes.extend(errors.is_none().then(|| NOT_ALIGNED.to_string()));
            errors
        }
        _ => errors.finish(),
    };
    let smoothed = match filter.tape.take() {
        Some(tape) => {
            Some(smoothed(*tape, filter.model(), &table, log, &times, reference.as_ref().zip(Some(laid_on)))?)
        }
        None => None,
    };
    notes.extend(filter.model().found());
    let summary = Summary {
        rows: log.len() as u64,
        span_s: log.time.span_s(),
        since_power_on_s: start_s,
        since_power_on_assumed: assumed,
        warm_up_age_end_s: age_s + log.time.span_s(),
        slip_modelled,
        slip: table.slip(),
        torques_used: inputs.torques.is_some(),
        acceleration_densities: inputs.densities,
        standstill,
        consistency,
        final_pose: final_pose(&filter),
        reference: errors,
        notes,
    };
    Ok(Run { summary, pose: table.finish(&log.source, log.time.clone())?, smoothed, innovations })
}

/// Smooths the filter's pass; `reference` comes with the share of the path over which tracks are aligned with it.
fn smoothed<const N: usize, M: MotionModel<N>>(
    tape: Tape<N>,
    model: &M,
    filtered: &Table,
    log: &Log,
    times: &[f64],
    reference: Option<(&Reference, Option<f64>)>,
) -> Result<Smoothed> {
    let mut table = filtered.like();
    let mut poses = Vec::new();
    tape.backwards(|s| {
        let (mean, p) = (&s.mean, &s.covariance);
        let slips = model.slips(mean).map(|both| both.map(|(slip, row)| [slip, row.dot(&(p * row)).max(0.0).sqrt()]));
        table.push(mean, &p.diagonal().map(|v| v.max(0.0).sqrt()), slips, filtered.nis(s.row));
        if reference.is_some_and(|(reference, laid_on)| laid_on.is_none() && reference.at(s.row).is_some()) {
            let pose = [mean[state::X], mean[state::Y], mean[state::HEADING]];
            poses.push((s.row, pose, p.fixed_view::<3, 3>(state::X, state::X).into_owned()));
        }
    });
    table.reverse();
    let errors = reference.and_then(|(reference, laid_on)| match laid_on {
        Some(share) => aligned_errors(reference, times, &table.track(), share),
        None => {
            let mut sums = ErrorSums::default();
            poses.iter().rev().for_each(|(row, pose, p)| sums.add(reference, *row, *pose, Some(*p)));
            sums.finish()
        }
    });
    Ok(Smoothed { pose: table.finish(&log.source, log.time.clone())?, reference: errors })
}

/// How warm the gyro was at power-on, as the time on since a cold one, s; 0 where it was cold.
fn age_at_start_s(config: &Config, settings: &Settings) -> Result<f64> {
    let gyro = config.require_gyro()?;
    let restart = settings.off_time_s.map(|off_s| gyro.restart(off_s)).transpose()?;
    Ok(restart.map_or(0.0, |r| r.age_s(gyro.time_constant_s)))
}

/// Note on a drive that leaves the span of time that the model was fitted on; `None` inside it, or where it is not
/// stated.
fn outside_validity(config: &Config, from_s: f64, to_s: f64) -> Option<String> {
    let valid = config.validation.as_ref()?;
    let (start, end) = (valid.valid_from_s, valid.valid_to_s);
    (from_s < start || to_s > end).then(|| {
        format!(
            "the drive lasts from {from_s:.0} s to {to_s:.0} s after a cold power-on, and the model was fitted on \
             {start:.0} s to {end:.0} s: beyond, it extrapolates"
        )
    })
}

fn refuse_effects(config: &Config) -> Result<()> {
    if config.effects.is_empty() {
        return Ok(());
    }
    let ids: Vec<_> = config.effects.iter().map(|e| e.id.as_str()).collect();
    let found = format!("the nominal filter has no effects, and the file has {}", ids.join(", "));
    Err(Error::new(ErrorKind::Config, "configuration", found)
        .at("`[[effect]]`")
        .hint("delete the tables [[effect]] to navigate with the nominal robot"))
}

/// The torques, if any row has both.
pub(super) fn torques(log: &Log) -> Option<[&[f64]; 2]> {
    let both = [log.get(channels::TORQUE_LEFT)?, log.get(channels::TORQUE_RIGHT)?];
    both[0].iter().zip(both[1]).any(|(l, r)| l.is_finite() && r.is_finite()).then_some(both)
}

/// Input to each row's prediction: torques, N·m, or densities of unknown accelerations, (m/s²)²/Hz and (rad/s²)²/Hz.
struct Inputs<'a> {
    torques: Option<[&'a [f64]; 2]>,
    densities: Option<[f64; 2]>,
}

impl<'a> Inputs<'a> {
    fn new(log: &'a Log, settings: &Settings, measured: impl FnOnce() -> Result<[f64; 2]>) -> Result<Self> {
        let torques = torques(log);
        let whole = torques.is_some_and(|t| t.iter().all(|side| side.iter().all(|v| v.is_finite())));
        let densities = match (whole, settings.acceleration_densities) {
            (true, _) => None,
            (false, Some(given)) if given.iter().all(|d| d.is_finite() && *d >= 0.0) => Some(given),
            (false, Some(given)) => {
                let found = format!("{given:?} are no densities");
                return Err(Error::new(ErrorKind::Value, "navigation", found).at("acceleration densities"));
            }
            (false, None) => Some(measured()?),
        };
        Ok(Self { torques, densities })
    }

    fn at(&self, k: usize) -> Input {
        let torques = self.torques.map(|[left, right]| [left[k], right[k]]);
        match torques.filter(|t| t.iter().all(|v| v.is_finite())) {
            Some(torques) => Input::Torques(torques),
            None => Input::Accelerations(self.densities.unwrap_or_default()),
        }
    }
}

fn final_pose<const N: usize, M: MotionModel<N>>(filter: &Filter<N, M>) -> FinalPose {
    let (mean, std) = (filter.mean(), filter.std());
    let of = |i: usize| Estimate { estimate: mean[i], std: std[i] };
    FinalPose {
        x_m: of(state::X),
        y_m: of(state::Y),
        heading_rad: of(state::HEADING),
        gyro_error_rad_s: of(state::GYRO_ERROR),
    }
}
