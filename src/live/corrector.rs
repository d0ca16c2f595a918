//! Reading by reading: what was read less the bias, and what rest teaches about it.

use super::bias_filter::BiasFilter;
use super::clock::{Clock, Stamped, off_s};
use super::nis::{NisSummary, NisWindow};
use super::rest::{BLOCK_S, Block, Finished, RestNoise, Wheels, as_predicted, turns};
use super::saved::Saved;
use crate::bias::Restart;
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::files::mark;
use std::sync::Arc;

/// A temperature that is older than this is no longer the gyro's, s.
const TEMPERATURE_FOR_S: f64 = 30.0;

/// How a [`Corrector`] works.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Settings {
    /// Wheels tell when the robot stands; else the rate itself does.
    pub wheels: bool,
    /// Temperatures are read: `[gyro.temperature]` is used where the configuration has it, else the warm-up by elapsed time.
    pub temperature: bool,
    /// Correct also outside the configuration's `[validation]`; else the reading passes through there.
    pub extrapolate: bool,
    /// Rest teaches nothing: the bias is that of the configuration, and what was learnt before.
    pub no_learning: bool,
}

/// Knowledge at the first sample.
#[derive(Debug, Clone, Copy, Default)]
pub struct Start<'a> {
    /// Its stamp, ns.
    pub stamp_ns: i64,
    /// Its arrival by a clock that nobody sets, s, from any origin.
    pub arrival_s: f64,
    /// Time since power-on, s.
    pub since_power_on_s: f64,
    /// State that the last run left.
    pub saved: Option<&'a Saved>,
    /// Boot of this computer; the one of `saved` means that the gyro stayed on meanwhile. Empty: it was off.
    pub boot_id: &'a str,
}

/// Flags of a corrected sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Flags {
    /// State of its stamp.
    pub stamped: Stamped,
    /// The reading was passed through: time since power-on or temperature lie outside `[validation]`.
    pub outside_validity: bool,
    /// The reading was passed through: the error is by temperature, and there is none, or none of late.
    pub no_temperature: bool,
    /// The reading is no finite number.
    pub not_finite: bool,
    /// The robot stood in the last complete block.
    pub at_rest: bool,
}

impl Flags {
    /// Whether the reading was passed through uncorrected.
    #[must_use]
    pub fn passed_through(&self) -> bool {
        self.outside_validity || self.no_temperature || self.not_finite
    }
}

/// A sample and what is known of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corrected {
    /// Rate less the bias, or the reading where it was passed through, rad/s.
    pub rate_rad_s: f64,
    /// Its variance, rad²/s²: of white noise in one sample and of the bias. Of a reading passed through, the square of the bias is
    /// added, which is then in the rate.
    pub rate_variance_rad2_s2: f64,
    /// The bias, rad/s.
    pub bias_rad_s: f64,
    /// Its standard deviation, rad/s.
    pub bias_std_rad_s: f64,
    /// Age of the warm-up, s: time since a cold power-on, or what would have warmed the gyro as far.
    pub age_s: f64,
    /// Its flags.
    pub flags: Flags,
}

/// A block at rest that waits for the next one.
#[derive(Debug, Clone, Copy)]
struct Pending {
    block: Finished,
    variance_rad2_s2: f64,
    /// Its middle, s of arrival since the first sample.
    middle_s: f64,
    temperature_c: Option<f64>,
    /// Whether the block before it was at rest too.
    after_rest: bool,
}

/// Corrects readings about one axis.
#[derive(Debug, Clone)]
pub struct Corrector {
    settings: Settings,
    filter: BiasFilter,
    /// When the filter's state holds, s of arrival since the first sample.
    filter_s: f64,
    noise: RestNoise,
    by_temperature: bool,
    /// Ages, s, or temperatures, °C, on which the model was fitted.
    valid: Option<[f64; 2]>,
    clock: Clock,
    age_at_start_s: f64,
    since_power_on_at_start_s: f64,
    block: Block,
    pending: Option<Pending>,
    at_rest: bool,
    wheels: Wheels,
    nis: NisWindow,
    learnt: u64,
    refused: u64,
    /// Temperature, °C, and its arrival since the first sample, s.
    temperature: Option<(f64, f64)>,
    /// Variance of the bias where the last block ended, rad²/s².
    variance_rad2_s2: f64,
    configuration_sha256: Arc<str>,
}

impl Corrector {
    /// Begins at the first sample, which is then given to [`Corrector::sample`] like the others; with notes for the user.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] without `[gyro]`, or with a discrete model that oscillates; [`ErrorKind::Value`] if the time since
    /// power-on is no duration.
    pub fn new(config: &Config, settings: Settings, start: &Start<'_>) -> Result<(Self, Vec<String>)> {
        if !(start.since_power_on_s.is_finite() && start.since_power_on_s >= 0.0) {
            let found = format!("{} s is no duration", start.since_power_on_s);
            return Err(Error::new(ErrorKind::Value, "live correction", found)
                .at("time since power-on")
                .hint("give zero or a positive number of seconds"));
        }
        let gyro = config.require_gyro()?;
        let by_temperature = settings.temperature && gyro.temperature.is_some();
        let configuration_sha256: Arc<str> = mark::sha256_hex(&config.to_toml()?).into();
        let valid = config.validation.as_ref().and_then(|v| match by_temperature {
            true => v.valid_from_temperature_c.zip(v.valid_to_temperature_c).map(<[f64; 2]>::from),
            false => Some([v.valid_from_s, v.valid_to_s]),
        });
        let mut notes = Vec::new();
        if gyro.temperature.is_some() && !by_temperature {
            notes.push(
                "no temperature is read: [gyro.temperature] is not used, the gyro warms up by elapsed time".into(),
            );
        }
        let began = Began::new(config, start, &mut notes)?;
        let (mut filter, said) =
            BiasFilter::new(config, by_temperature, began.restart.as_ref(), began.since_power_on_s)?;
        notes.extend(said);
        if let Some(saved) = began.stayed_on.filter(|s| *s.configuration_sha256 == *configuration_sha256)
            && filter.restore(saved.state, saved.covariance)
        {
            filter.predict(began.off_s);
            notes.push("what was learnt at rest before is kept".into());
        }
        let warm_s = began.restart.map_or(0.0, |r| r.age_s(gyro.time_constant_s));
        let age_at_start_s = warm_s + began.since_power_on_s;
        let clock = Clock::new(start.stamp_ns, start.arrival_s, config.sample_time_s);
        let corrector = Self {
            settings,
            variance_rad2_s2: filter.variance_rad2_s2(None),
            filter,
            filter_s: 0.0,
            noise: RestNoise::new(config, gyro),
            by_temperature,
            valid,
            clock,
            age_at_start_s,
            since_power_on_at_start_s: began.since_power_on_s,
            block: Block::after(0.0),
            pending: None,
            at_rest: false,
            wheels: Wheels::default(),
            nis: NisWindow::EMPTY,
            learnt: 0,
            refused: 0,
            temperature: None,
            configuration_sha256,
        };
        Ok((corrector, notes))
    }

    /// Takes in a reading of the wheels: whether all of them stand, and its arrival by the same clock as the samples', s.
    pub fn wheels(&mut self, still: bool, arrival_s: f64) {
        self.wheels.add(still, arrival_s);
    }

    /// Takes in a temperature, °C, and its arrival, s. What is no finite number is left out.
    pub fn temperature(&mut self, temperature_c: f64, arrival_s: f64) {
        if temperature_c.is_finite() {
            self.temperature = Some((temperature_c, arrival_s));
        }
    }

    /// Corrects a reading with its stamp, ns, its arrival by a clock that nobody sets, s, and its value, rad/s.
    pub fn sample(&mut self, stamp_ns: i64, arrival_s: f64, reading_rad_s: f64) -> Corrected {
        let stamped = self.clock.look(stamp_ns, arrival_s);
        let now_s = self.clock.elapsed_s();
        let usable = reading_rad_s.is_finite();
        let temperature_c = self.temperature.filter(|(_, at)| arrival_s - at <= TEMPERATURE_FOR_S).map(|(t, _)| t);
        let no_temperature = self.by_temperature && temperature_c.is_none();
        match stamped {
            Stamped::Steady if usable && !no_temperature => {
                if let Some(block) = self.block.add(self.clock.stamp_s(), reading_rad_s) {
                    self.block = Block::after(self.clock.stamp_s());
                    self.finish(block, now_s, arrival_s, temperature_c);
                }
            }
            // one reading more or less does not make a block another one
            Stamped::Steady | Stamped::Repeated | Stamped::Overtaken => {}
            Stamped::Gap | Stamped::JumpedForward | Stamped::JumpedBack => self.begin_anew(),
        }
        let bias_rad_s = self.filter.bias_rad_s(now_s - self.filter_s, temperature_c);
        let age_s = self.age_at_start_s + now_s;
        let flags = Flags {
            stamped,
            outside_validity: !self.settings.extrapolate && self.outside_validity(age_s, temperature_c),
            no_temperature,
            not_finite: !usable,
            at_rest: self.at_rest,
        };
        let white = self.clock.step_s().map_or(0.0, |step| self.noise.sample_rad2_s2(step));
        let variance = white + self.variance_rad2_s2;
        let passed = flags.passed_through();
        Corrected {
            rate_rad_s: if passed { reading_rad_s } else { reading_rad_s - bias_rad_s },
            rate_variance_rad2_s2: if passed { variance + bias_rad_s * bias_rad_s } else { variance },
            bias_rad_s,
            bias_std_rad_s: self.variance_rad2_s2.sqrt(),
            age_s,
            flags,
        }
    }

    /// Time since power-on at the last sample, s.
    #[must_use]
    pub fn since_power_on_s(&self) -> f64 {
        self.since_power_on_at_start_s + self.clock.elapsed_s()
    }

    /// Stamp, ns, and arrival, s, of the last sample: where a corrector begins that takes the place of this one.
    #[must_use]
    pub fn last_sample(&self) -> (i64, f64) {
        (self.clock.stamp_ns(), self.clock.arrival_s())
    }

    /// NIS of the last blocks at rest; `None` before the first.
    #[must_use]
    pub fn nis(&self) -> Option<NisSummary> {
        self.nis.summary()
    }

    /// Blocks at rest that were learnt, and those that were steady and yet too far from the predicted bias to be rest.
    #[must_use]
    pub fn blocks(&self) -> [u64; 2] {
        [self.learnt, self.refused]
    }

    /// State for a file that outlasts a restart; `boot_id` as in [`Start`].
    #[must_use]
    pub fn saved(&self, boot_id: &str) -> Saved {
        let now_s = self.clock.elapsed_s();
        let mut filter = self.filter.clone();
        filter.predict((now_s - self.filter_s).max(0.0));
        let ages_s = [self.age_at_start_s, self.since_power_on_at_start_s].map(|age| age + now_s);
        Saved::new(ages_s, self.clock.stamp_ns(), [boot_id, &self.configuration_sha256], filter.saved())
    }

    /// Takes the place of `before`: what was last read goes on, and of the same configuration what was counted too.
    #[must_use]
    pub fn in_place_of(mut self, before: Option<&Self>) -> Self {
        if let Some(before) = before {
            (self.temperature, self.wheels) = (before.temperature, before.wheels);
            if before.configuration_sha256 == self.configuration_sha256 {
                self.nis = before.nis;
                (self.learnt, self.refused, self.at_rest) = (before.learnt, before.refused, before.at_rest);
            }
        }
        self
    }

    fn begin_anew(&mut self) {
        self.block = Block::after(self.clock.stamp_s());
        (self.pending, self.at_rest) = (None, false);
        let _ = self.wheels.stood();
    }

    fn outside_validity(&self, age_s: f64, temperature_c: Option<f64>) -> bool {
        let at = if self.by_temperature { temperature_c } else { Some(age_s) };
        self.valid.zip(at).is_some_and(|([from, to], at)| at < from || at > to)
    }

    /// A block is complete: learns the one before it, if it lies between two at rest.
    fn finish(&mut self, block: Finished, now_s: f64, arrival_s: f64, temperature_c: Option<f64>) {
        let stood_s = self.wheels.since_s.map(|since| (arrival_s - since).max(block.duration_s));
        let wheels_stood = self.wheels.stood();
        let stood_s = stood_s.filter(|_| self.settings.wheels && wheels_stood);
        let variance_rad2_s2 = self.noise.mean_rad2_s2(&block, stood_s);
        let middle_s = (now_s - 0.5 * block.duration_s).max(self.filter_s);
        let mut there = self.filter.clone();
        there.predict(middle_s - self.filter_s);
        let found = there.innovation(block.mean_rad_s, variance_rad2_s2, temperature_c);
        let rests = if self.settings.wheels {
            wheels_stood && !turns(found.innovation_rad_s)
        } else {
            let steady = self.noise.steady(&block);
            self.refused += u64::from(steady && !as_predicted(found.nis));
            steady && as_predicted(found.nis)
        };
        let learns = rests && !self.settings.no_learning;
        if let Some(before) = self.pending.take().filter(|before| learns && before.after_rest) {
            self.filter.predict((before.middle_s - self.filter_s).max(0.0));
            self.filter_s = self.filter_s.max(before.middle_s);
            let rate = before.block.mean_rad_s;
            if let Some(learnt) = self.filter.learn(rate, before.variance_rad2_s2, before.temperature_c) {
                self.nis.add(learnt.nis);
                self.learnt += 1;
            }
        }
        let after_rest = self.at_rest;
        self.at_rest = rests;
        self.pending = rests.then_some(Pending { block, variance_rad2_s2, middle_s, temperature_c, after_rest });
        let mut now = self.filter.clone();
        now.predict((now_s + BLOCK_S - self.filter_s).max(0.0));
        self.variance_rad2_s2 = now.variance_rad2_s2(temperature_c);
    }
}

/// How the run began.
struct Began<'a> {
    /// How warm the gyro was at its last power-on.
    restart: Option<Restart>,
    /// State that the last run left of this power-on.
    stayed_on: Option<&'a Saved>,
    /// Time between the last run's last sample and this one's first, s; 0 where it is not known.
    off_s: f64,
    since_power_on_s: f64,
}

impl<'a> Began<'a> {
    fn new(config: &Config, start: &Start<'a>, notes: &mut Vec<String>) -> Result<Self> {
        let since_power_on_s = start.since_power_on_s;
        let cold = Self { restart: None, stayed_on: None, off_s: 0.0, since_power_on_s };
        let Some(saved) = start.saved else { return Ok(cold) };
        let between_s = off_s(saved.stamp_ns, start.stamp_ns);
        if !saved.boot_id.is_empty() && saved.boot_id == start.boot_id {
            let off_s = between_s.unwrap_or_else(|| {
                notes.push("the stamps went back since the last run: the pause is taken for none".into());
                0.0
            });
            notes.push(format!("the computer stayed on since the last run, {off_s:.1} s ago: so did the gyro"));
            // how warm it was at that power-on
            let warm_s = (saved.warm_up_age_s - saved.since_power_on_s).max(0.0);
            let restart = Some(Restart::new(warm_s, 0.0, None)?);
            let since_power_on_s = saved.since_power_on_s + off_s;
            return Ok(Self { restart, stayed_on: Some(saved), off_s, since_power_on_s });
        }
        let Some(between_s) = between_s else {
            notes.push(
                "the stamps went back since the last run: how long the gyro was off is not known, taken as cold".into(),
            );
            return Ok(cold);
        };
        let off_s = (between_s - since_power_on_s).max(0.0);
        let cooling = config.require_gyro()?.cooling_time_constant_s;
        let restart = Restart::new(saved.warm_up_age_s, off_s, cooling)?;
        notes.push(format!("the gyro was off for {off_s:.1} s since the last run, by the stamps"));
        Ok(Self { restart: Some(restart), off_s, ..cold })
    }
}
