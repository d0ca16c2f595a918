//! x⁺ = f(x, u; θ),  y = h(x; θ) + e + noise, with the effects θ of the configuration in f, h and noise
//!
//! The filter whose model is the augmented one. Every effect is taken from its one definition, the same that the simulator
//! integrates and the diagnosis fits ([`crate::model`]): nothing of an effect's equation stands here.
//!
//! | effect | in the filter |
//! |---|---|
//! | `wheel.radius_scale`, `wheel.radius_mismatch`, `vehicle.track_width` | constants of the robot: f (with torques) and h of the wheels |
//! | `vehicle.payload`, `vehicle.com_offset`, `motor.torque_gain` | constants of the robot: f |
//! | `wheel.rolling_resistance`, `ground.slope` | forces: f |
//! | `wheel.slip` | h of the wheels, by the force of each; what the law leaves open widens the wheels' noise and the torques' |
//! | `wheel.lateral_skid` | dx/dt = v cos θ - s sin θ, dy/dt = v sin θ + s cos θ, s a function of v and ω |
//! | `gyro.scale_factor`, `gyro.scale_asymmetry`, `gyro.vibration_rectification` | h of the gyro |
//! | `gyro.bias_step` | h of the gyro from its time on; without a time, a switch that comes once a drive and stays |
//! | `wheel.radius_left`, `wheel.radius_right` | constants of the robot: f (with torques) and h of the wheels |
//! | `gyro.noise_level`, `encoder.noise_level`, `pose.noise_level` | noise of that sensor |
//! | `sensor.pose_delay` | nothing: the filter drives by wheels and gyro, and a note says so |
//! | `sensor.gyro_delay`, `sensor.wheel_delay` | each reading is taken in τ before its row, where the state is what the gyro saw |
//! | `encoder.quantization` | noise of the wheels + lsb²/12; wheels that read zero are not taken for standing still |
//! | `encoder.missed_ticks` | a switch of that wheel between its reading and (1 - λ) of it |
//! | `gyro.rate_ramp`, `gyro.second_time_constant`, `gyro.turn_on_shift`, `gyro.temperature_sensitivity`, `gyro.supply_sensitivity`, `gyro.tone` of known phase | known from time, temperature or supply: taken off the reading |
//! | `gyro.noise_growth` | noise of the gyro, row by row |
//! | `gyro.quantization` | noise of the gyro + lsb²/12 |
//! | `gyro.rate_random_walk` | the walk of e and s |
//! | `gyro.gauss_markov`, `gyro.bias_instability` | states of exponentially correlated noise, four at most |
//! | `gyro.tone` | two states that turn into each other |
//! | `gyro.telegraph_noise`, `gyro.outliers` | a switch of the gyro |
//! | `custom.*` in drives | as it acts: f, h of the wheels or of the gyro; f also by the position where its force follows that |
//! | `gyro.bandwidth` | refused: it filters rate and noise alike, which no state here does |
//!
//! Effects that act through torques change f alone. A filter without torques uses nothing of them, which a note says.
//! The same holds for effects of a gyro that the log does not have. A delay τ also shifts e(t), in a warm-up by at most
//! C1 τ/T, which is negligible. The known part of the bias is not in the gyro error that the filter writes.
//!
//! A lattice is white noise as long as its step is below twice the noise's standard deviation (Widrow and Kollár, Quantization
//! Noise (2008), chapter 4); on a coarser one the error stays where the speed stays, and the filter is surer than it should be.
//! Without torques no acceleration is known: the part of an effect that depends on it (a slide or a vibration that is
//! late) is left out.
//!
//! The model itself, switches and states of correlated noise are in [`super::changed_model`].

use super::changed_model::{COLOURED_STATES, COLOURS, ChangedModel, Changes, Colour, Switched};
use super::filter::Filter;
use super::gyro_changes::GyroChanges;
use super::results::Run;
use super::rolling_model::ROLLING_STATES;
use super::run::{over_log, run, slips, torques};
use super::{ErrorModel, Settings};
use super::{sensors, temperature};
use crate::config::{Config, EffectTable};
use crate::error::{Error, ErrorKind, Result};
use crate::model::drive::{DriveModel, Instrument, Robot};
use crate::model::{EffectSource, GyroInFilter, InFilter, Scene};
use crate::signal::{Log, increasing_times, since_power_on};
use crate::simulate::{Options, scene_of_drive};

/// As [`run()`], with the effects of the configuration, which `effects` makes, in the filter's model.
///
/// # Errors
/// As [`run()`]; [`ErrorKind::Config`] if `effects` does not know one or its parameters, if one needs a temperature or a supply
/// that the log does not have, if no filter can represent one (the message says why), or if wheels slip by `[traction]` besides.
pub fn run_with(config: &Config, log: &Log, settings: &Settings, effects: &dyn EffectSource) -> Result<Run> {
    if config.effects.is_empty() {
        return run(config, log, settings);
    }
    let has_gyro = sensors::gyro(log).is_some();
    // a drive without a gyro needs no temperature
    if has_gyro
        && settings.error_model == ErrorModel::WarmUp
        && let Some(compensated) = temperature::compensated(config, log)?
    {
        let run = run_with(&compensated.config, &compensated.log, settings, effects)?;
        return Ok(compensated.given_back(run));
    }
    if slips(config, log, settings) {
        let found = "effects change a robot that rolls, and this filter's slips by [traction]";
        return Err(Error::new(ErrorKind::Config, "configuration", found)
            .at("`[[effect]]`")
            .hint("let it roll (--wheels rolling), or delete [traction]; the effect wheel.slip slips as well"));
    }
    if log.len() < 2 {
        let found = format!("{} rows, and a drive needs two", log.len());
        return Err(Error::new(ErrorKind::TooShort, &log.source, found).hint("give a longer log"));
    }
    let mut settings = *settings;
    let mut config = config.clone();
    let tables = std::mem::take(&mut config.effects);
    let torques = torques(log).is_some();
    if !has_gyro {
        if settings.off_time_s.is_some() {
            // the nominal filter has the words for it
            return run(&config, log, &settings);
        }
        settings.error_model = ErrorModel::Off;
        config = sensors::without_gyro(&config);
    }
    increasing_times(log)?;
    let start_s = since_power_on(log, settings.since_power_on_s)?.first().copied().unwrap_or_default();
    let mut made = Made::new(&config, log, &settings, start_s)?;
    for table in &tables {
        let through = effects.acts_through(&table.id);
        let of_gyro = through.gyro || !effects.is_of_drives(&table.id);
        if of_gyro && !has_gyro {
            made.notes.push(format!("the log has no gyro: {} changes nothing that the filter uses", table.id));
            continue;
        }
        if through.torques && !torques {
            made.notes.push(format!("the log has no torques: {} changes nothing that the filter uses", table.id));
            continue;
        }
        made.add(table, effects)?;
    }
    made.run(config, log, settings, start_s)
}

/// The effects of a configuration, collected by their form in the filter.
struct Made {
    scene: Scene,
    robot: Vec<Box<dyn crate::model::drive::DriveEffect>>,
    switches: Vec<(Switched, crate::model::Switch)>,
    /// Standard deviation and correlation time of each correlated noise.
    decaying: Vec<[f64; 2]>,
    ringing: Vec<Colour>,
    lattice_rad_s: f64,
    walk_rad_s_sqrt_s: f64,
    bias_rad_s: Vec<f64>,
    white_scale: Vec<f64>,
    white_variance: f64,
    delay_s: f64,
    wheel_delay_s: f64,
    /// Standard deviation of instruments' white noise over the nominal one.
    noise_over: Vec<(Instrument, f64)>,
    notes: Vec<String>,
}

impl Made {
    fn new(config: &Config, log: &Log, settings: &Settings, start_s: f64) -> Result<Self> {
        let options = Options { off_time_s: settings.off_time_s, ..Options::from(0) };
        let scene = scene_of_drive(config, log, start_s, &options)?;
        Ok(Self {
            scene,
            robot: Vec::new(),
            switches: Vec::new(),
            decaying: Vec::new(),
            ringing: Vec::new(),
            lattice_rad_s: 0.0,
            walk_rad_s_sqrt_s: 0.0,
            bias_rad_s: Vec::new(),
            white_scale: Vec::new(),
            white_variance: 0.0,
            delay_s: 0.0,
            wheel_delay_s: 0.0,
            noise_over: Vec::new(),
            notes: Vec::new(),
        })
    }

    fn add(&mut self, EffectTable { id, parameters }: &EffectTable, effects: &dyn EffectSource) -> Result<()> {
        if effects.is_of_drives(id) {
            // of what is drawn from the seed, the filter takes only what does not depend on it
            let effect = effects.drive_effect(id, parameters, self.scene.time.span_s(), 0)?;
            match effect.in_filter() {
                InFilter::Equations => self.robot.push(effect),
                InFilter::GyroDelay(delay_s) => self.delay_s += delay_s,
                InFilter::WheelDelay(delay_s) => self.wheel_delay_s += delay_s,
                InFilter::PoseDelay(_) => {
                    self.notes.push(format!("the filter drives by wheels and gyro: {id} changes nothing that it uses"));
                }
                InFilter::Noise(of, over) => self.noise_over.push((of, over)),
                InFilter::GyroSwitch(switch) => self.switches.push((Switched::Gyro, switch)),
                InFilter::WheelSwitch(side, switch) => self.switches.push((Switched::Wheel(side), switch)),
                InFilter::WheelLattice(lsb) => self.lattice_rad_s = self.lattice_rad_s.hypot(lsb),
            }
            return Ok(());
        }
        let mut effect = effects.gyro_effect(id, parameters, &self.scene, 0)?;
        match effect.in_filter() {
            GyroInFilter::Known => {
                self.bias_rad_s.resize(self.scene.len(), 0.0);
                self.white_scale.resize(self.scene.len(), 1.0);
                for row in 0..self.scene.len() {
                    self.bias_rad_s[row] += effect.bias_rad_s(row, &self.scene);
                    self.white_scale[row] *= effect.white_scale(row, &self.scene);
                }
            }
            GyroInFilter::White(variance) => self.white_variance += variance,
            GyroInFilter::Walk(walk) => self.walk_rad_s_sqrt_s = self.walk_rad_s_sqrt_s.hypot(walk),
            GyroInFilter::Correlated(parts) => self.decaying.extend(parts),
            GyroInFilter::Sinusoid { amplitude_rad_s: amplitude, angular_frequency_rad_s: omega } => {
                self.ringing.push(Colour::Ringing { amplitude, omega });
            }
            GyroInFilter::Switching(switch) => self.switches.push((Switched::Gyro, switch)),
            GyroInFilter::Unrepresented(why) => {
                return Err(Error::new(
                    ErrorKind::Config,
                    "configuration",
                    format!("the filter cannot take it: {why}"),
                )
                .at(format!("`effect.{id}`"))
                .hint(format!("delete the table of {id} to navigate without it")));
            }
        }
        Ok(())
    }

    /// The correlated noises in as many states as there are.
    fn colours(&mut self) -> Result<Vec<Colour>> {
        let mut colours = std::mem::take(&mut self.ringing);
        let used: usize = colours.iter().map(Colour::states).sum();
        let (quick, slow): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.decaying).into_iter().partition(|[_, time_s]| *time_s < self.scene.step_s);
        // forgotten from one row to the next: white, of the same spectrum at low frequencies
        for [std, time_s] in quick {
            let kept = (-self.scene.step_s / time_s).exp();
            self.white_variance += std * std * (1.0 + kept) / (1.0 - kept);
        }
        if used > COLOURS || (used == COLOURS && !slow.is_empty()) {
            let found = format!("tones and correlated noise of the gyro take more than {COLOURS} states");
            return Err(Error::new(ErrorKind::Config, "configuration", found)
                .at("`[[effect]]`")
                .hint("delete the smaller ones: a tone takes two, correlated noise one at least"));
        }
        let merged = merged(slow, COLOURS - used);
        colours.extend(merged.into_iter().map(|[std, time_s]| Colour::Decaying { std, time_s }));
        Ok(colours)
    }

    fn run(mut self, mut config: Config, log: &Log, mut settings: Settings, start_s: f64) -> Result<Run> {
        let colours = self.colours()?;
        if self.lattice_rad_s > 0.0 && settings.standstill.is_some_and(|rule| !rule.within_noise) {
            settings.standstill = None;
            self.notes.push(
                "quantized wheel speeds read zero also while the wheels creep: zeros are not taken for standing still \
                 (--zero-updates does)"
                    .into(),
            );
        }
        for (of, over) in std::mem::take(&mut self.noise_over) {
            self.louder(of, over, &mut config);
        }
        let gyro = self.gyro(&config, log)?;
        if let Some(table) = &mut config.gyro {
            let mut noise = table.noise.take().unwrap_or_default();
            let walk = noise.rate_random_walk_rad_s_sqrt_s.unwrap_or(0.0).hypot(self.walk_rad_s_sqrt_s);
            noise.rate_random_walk_rad_s_sqrt_s = (walk > 0.0).then_some(walk);
            table.noise = Some(noise);
        }
        let vehicle = config.require_vehicle()?;
        let changes = Changes {
            robot: DriveModel::new(Robot::from(vehicle), self.robot),
            torque_noise_density: vehicle.torque_noise_n_m_sqrt_s,
            wheel_radius_m: vehicle.wheel_radius_m,
            lattice_rad_s: self.lattice_rad_s,
            switches: self.switches,
            colours,
        };
        let notes = self.notes;
        let all = |more: Vec<String>| notes.into_iter().chain(more).collect();
        if !changes.colours.is_empty() || changes.robot.follows_position {
            let model = ChangedModel::<COLOURED_STATES>::new(changes, start_s);
            let (filter, more) = Filter::with_model(model, &config, &settings, start_s)?;
            return over_log(filter, all(more), &config, log, &settings, start_s, &gyro);
        }
        let model = ChangedModel::<ROLLING_STATES>::new(changes, start_s);
        let (filter, more) = Filter::with_model(model, &config, &settings, start_s)?;
        over_log(filter, all(more), &config, log, &settings, start_s, &gyro)
    }

    /// Multiplies the standard deviation of an instrument's white noise by `over`.
    fn louder(&mut self, of: Instrument, over: f64, config: &mut Config) {
        match of {
            Instrument::Gyro => {
                self.scene.white_std_rad_s *= over;
                config.gyro.iter_mut().for_each(|g| g.angle_random_walk_rad_sqrt_s *= over);
            }
            Instrument::Wheels => config.encoder.iter_mut().for_each(|e| e.speed_noise_std_rad_s *= over),
            Instrument::Pose => {
                if let Some(pose) = &mut config.pose {
                    pose.position_std_m *= over;
                    pose.heading_std_rad *= over;
                }
            }
        }
    }

    fn gyro(&self, config: &Config, log: &Log) -> Result<GyroChanges> {
        let mut out =
            GyroChanges { delay_s: self.delay_s, wheel_delay_s: self.wheel_delay_s, ..GyroChanges::default() };
        if let (Some(rates), false) = (sensors::gyro(log), self.bias_rad_s.is_empty()) {
            out.readings = Some(rates.iter().zip(&self.bias_rad_s).map(|(rate, bias)| rate - bias).collect());
        }
        if self.white_variance > 0.0 || !self.white_scale.is_empty() {
            let lattice = config.require_gyro()?.noise.as_ref().and_then(|n| n.quantization_lsb_rad_s).unwrap_or(0.0);
            let (white, rest) = (self.scene.white_std_rad_s, lattice * lattice / 12.0 + self.white_variance);
            let scale = |row| self.white_scale.get(row).copied().unwrap_or(1.0);
            out.variances = (0..log.len()).map(|row| (white * scale(row)).powi(2) + rest).collect();
        }
        Ok(out)
    }
}

/// Correlated noises (standard deviation, correlation time), merged to at most `room`: neighbours in time become one of the
/// same variance and the same spectrum at low frequencies.
fn merged(mut all: Vec<[f64; 2]>, room: usize) -> Vec<[f64; 2]> {
    if all.len() <= room || room == 0 {
        return all;
    }
    all.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let group = |g: usize| {
        let part = &all[g * all.len() / room..(g + 1) * all.len() / room];
        let variance: f64 = part.iter().map(|[std, _]| std * std).sum();
        let weighted: f64 = part.iter().map(|[std, time_s]| std * std * time_s).sum();
        [variance.sqrt(), if variance > 0.0 { weighted / variance } else { part[0][1] }]
    };
    (0..room).map(group).collect()
}
