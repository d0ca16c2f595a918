//! Logs with the inputs, rows and channels of a given one, with noise of their own
//!
//! A first guess at a size that shows is ½ Σ (d/σ)² = 12: d is what the effect changes of the readings beside the same
//! noise, σ² half the mean square by which two logs without it differ.

use super::direction::Direction;
use crate::config::{Config, EffectTable, Gyro, Kind, Pose};
use crate::effects::Library;
use crate::error::Result;
use crate::signal::{Log, names};
use crate::simulate::{Options, Seeds, replay_with, stationary_like};

/// ½ Σ (d/σ)² at the first guess.
const SHOWS: f64 = 12.0;
/// Factor around it that is near enough.
const NEAR: f64 = 2.0;
/// Most steps towards it.
const STEPS: usize = 40;
/// Longest of them, as a factor.
const FURTHEST: f64 = 100.0;
/// Rates of a pose that is read in every row, Hz.
const EVERY_ROW_HZ: f64 = 1e9;
/// A step of the log may differ from the stated sample time by this part of it.
const STEP_TOLERANCE: f64 = 0.01;

/// Channels that tell the size of a change, and whether they are counted by their differences from reading to reading: a
/// pose drifts without end.
const TOLD: [(&str, bool); 6] = [
    (names::GYRO_Z, false),
    (names::WHEEL_LEFT, false),
    (names::WHEEL_RIGHT, false),
    (names::X, true),
    (names::Y, true),
    (names::HEADING, true),
];

/// Simulates logs like a given one.
pub(in crate::gap) struct Simulator<'a> {
    config: Config,
    inputs: &'a Log,
    library: &'a Library,
    since_power_on_s: f64,
}

impl<'a> Simulator<'a> {
    /// Logs of the simulator `config` like `inputs`, which begin `since_power_on_s` after power-on where they do not say so.
    pub(in crate::gap) fn new(config: &Config, inputs: &'a Log, library: &'a Library, since_power_on_s: f64) -> Self {
        let mut config = config.clone();
        if config.kind == Kind::Driving {
            let step_s = inputs.time.median_step_s();
            let near = |s: &f64| (s / step_s - 1.0).abs() <= STEP_TOLERANCE;
            config.sample_time_s = config.sample_time_s.filter(near).or(Some(step_s));
            // readings are taken where the log has some
            let pose = config.pose.unwrap_or(Pose::assumed(EVERY_ROW_HZ));
            config.pose = inputs.get(names::X).map(|_| Pose { rate_hz: EVERY_ROW_HZ, ..pose });
        }
        Self { config, inputs, library, since_power_on_s }
    }

    /// One log; `effects`: what it has beyond the simulator.
    ///
    /// # Errors
    /// Those of [`replay_with`] and [`stationary_like`].
    pub(in crate::gap) fn log(&self, effects: &[EffectTable], seeds: Seeds) -> Result<Log> {
        let mut config = self.config.clone();
        config.effects.extend_from_slice(effects);
        // of a drive the gyro begins as stated: one of its own in each log would be another unit's
        let stated = |gyro: &Gyro| gyro.turn_on_bias_std_rad_s.or(gyro.warm_up_relative_std).is_some();
        let options = Options {
            seeds,
            since_power_on_s: self.since_power_on_s,
            vary_turn_on: config.kind == Kind::Stationary && config.gyro.as_ref().is_some_and(stated),
            ..Options::from(seeds.sensors)
        };
        let simulated = match config.kind {
            Kind::Driving => replay_with(&config, self.inputs, &options, self.library)?.log,
            Kind::Stationary => stationary_like(&config, self.inputs, &options, self.library)?,
        };
        like(&simulated, self.inputs)
    }

    /// ½ Σ (d/σ)² of `direction` at the distance `u`, given logs without it; infinite where it cannot be simulated.
    fn shows(&self, direction: &Direction, u: f64, without: &[Log; 2], seeds: Seeds) -> f64 {
        let Ok(with) = self.log(&[direction.table(u)], seeds) else { return f64::INFINITY };
        let one = |(name, steps): (&str, bool)| {
            let [a, b] = [&without[0], &without[1]].map(|log| log.get(name));
            let (a, b, with) = (a?, b?, with.get(name)?);
            let apart = squares(a, b, steps);
            let variance = 0.5 * apart.iter().sum::<f64>() / apart.len().max(1) as f64;
            let moved = squares(with, a, steps).iter().sum::<f64>();
            (variance > 0.0).then(|| 0.5 * moved / variance)
        };
        TOLD.into_iter().filter_map(one).sum()
    }

    /// The first guess at a distance that shows.
    ///
    /// # Errors
    /// Those of [`Simulator::log`] without an effect.
    pub(super) fn start(&self, direction: &Direction, seeds: Seeds) -> Result<f64> {
        let other = Seeds { sensors: seeds.sensors.wrapping_add(1), turn_on: seeds.turn_on, ..seeds };
        let without = [self.log(&[], seeds)?, self.log(&[], other)?];
        let most = direction.most();
        let mut u = (1e-6 * most).max(f64::MIN_POSITIVE);
        for _ in 0..STEPS {
            let shows = self.shows(direction, u, &without, seeds);
            if (SHOWS / NEAR..SHOWS * NEAR).contains(&shows) {
                break;
            }
            let factor = (SHOWS / shows.max(f64::MIN_POSITIVE)).sqrt().clamp(FURTHEST.recip(), FURTHEST);
            let next = (u * factor).min(most);
            if next == u {
                break;
            }
            u = next;
        }
        Ok(u)
    }
}

/// Squares of the differences of two channels where both have readings; `steps`: of their steps from reading to reading.
fn squares(a: &[f64], b: &[f64], steps: bool) -> Vec<f64> {
    let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).filter(|d| d.is_finite()).collect();
    match steps {
        true => apart.windows(2).map(|d| (d[1] - d[0]).powi(2)).collect(),
        false => apart.iter().map(|d| d * d).collect(),
    }
}

/// `simulated` with the channels of `inputs`, and readings where these have some.
fn like(simulated: &Log, inputs: &Log) -> Result<Log> {
    let mut log = Log::new(&inputs.source, simulated.time.clone());
    // wheels that are told by ticks or odometry alone
    let wheels = [names::WHEEL_LEFT, names::WHEEL_RIGHT];
    let no_speeds = wheels.iter().all(|name| inputs.get(name).is_none());
    for channel in &simulated.channels {
        let name = channel.name.as_str();
        match inputs.get(name) {
            Some(there) => {
                let masked = channel.values.iter().zip(there).map(|(v, r)| if r.is_finite() { *v } else { f64::NAN });
                log.push(name, masked.collect())?;
            }
            None if name == names::SINCE_POWER_ON || no_speeds && wheels.contains(&name) => {
                log.push(name, channel.values.clone())?;
            }
            None => {}
        }
    }
    for name in [names::TEMPERATURE, names::SUPPLY] {
        if let (Some(values), None) = (inputs.get(name), log.get(name)) {
            log.push(name, values.to_vec())?;
        }
    }
    Ok(log)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Parameters, by_id, ids};
    use crate::signal::TimeAxis;

    const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.5\n\
        [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 120.0\nangle_random_walk_rad_sqrt_s = 1e-4\n";

    fn rest(len: usize) -> (Config, Log) {
        let mut log = Log::new("rest.csv", TimeAxis::Uniform { start_s: 0.0, step_s: 0.5, len });
        let rates = (0..len).map(|i| if i % 7 == 3 { f64::NAN } else { 0.0 }).collect();
        log.push(names::GYRO_Z, rates).unwrap();
        log.push(names::TEMPERATURE, vec![25.0; len]).unwrap();
        (Config::parse(REST, "rest.toml").unwrap(), log)
    }

    #[test]
    fn a_log_has_the_channels_and_gaps_of_its_inputs() {
        let (config, inputs) = rest(400);
        let log = Simulator::new(&config, &inputs, &Library::new(), 0.0).log(&[], Seeds::from(3)).unwrap();
        let names: Vec<&str> = log.channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, [names::GYRO_Z, names::TEMPERATURE]);
        let rates = log.get(names::GYRO_Z).unwrap();
        assert!(rates.iter().enumerate().all(|(i, v)| v.is_nan() == (i % 7 == 3)));
    }

    /// A ramp a t beside white noise σ: ½ Σ (a t/σ)².
    #[test]
    fn the_first_guess_shows() {
        let (config, inputs) = rest(2000);
        let library = Library::new();
        let simulator = Simulator::new(&config, &inputs, &library, 0.0);
        let ramp = by_id(ids::rate_ramp()).unwrap().about();
        let direction = &Direction::of(ramp, &Parameters::new(), &Parameters::new())[0];
        let u = simulator.start(direction, Seeds::from(5)).unwrap();
        let std = 1e-4 / 0.5f64.sqrt();
        let shows: f64 = (0..2000).filter(|i| i % 7 != 3).map(|i| 0.5 * (u * 0.5 * f64::from(i) / std).powi(2)).sum();
        assert!((SHOWS / 2.5..SHOWS * 2.5).contains(&shows), "{shows}");
    }
}
