//! The numbers of a configuration that other programs ask for.

use super::effects;
use super::number::{Known, digits};
use crate::config::{Config, EffectTable, Gyro};
use crate::effects::drive::by_id;
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::Axis;
use crate::model::drive::Robot;
use std::cell::RefCell;
use std::collections::BTreeSet;

/// Standard normal quantile of 0.975.
const Z975: f64 = 1.959_963_984_540_054;
const ABSOLUTE_ZERO_C: f64 = -273.15;

/// Facts about the program that will read the file, which the configuration does not hold.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Axis of the target's IMU that was fitted; by default what the column's name says, else z.
    pub axis: Option<Axis>,
    /// Rate at which the target reads the gyro, Hz; by default that of the configuration.
    pub rate_hz: Option<f64>,
    /// Step of the target's filter, s, where it has one of its own.
    pub step_s: Option<f64>,
    /// Topic of the IMU.
    pub topic: Option<String>,
    /// PX4's device id of the gyro (`TC_G0_ID`).
    pub device_id: Option<u32>,
    /// Temperature at power-on, °C; by default the log's lowest.
    pub power_on_temperature_c: Option<f64>,
    /// Export also a model that failed its validation.
    pub accept: bool,
}

/// Where a configuration comes from, for the head of the file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Origin {
    /// Name of the configuration's file, without its folder.
    pub file: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// The command that exports it.
    pub command: String,
    /// Version of the program.
    pub version: String,
}

/// A configuration that is to be exported.
#[derive(Debug, Clone)]
pub struct Source<'a> {
    /// All of it.
    pub config: &'a Config,
    /// Its `[gyro]`, with what its effects change of it.
    pub gyro: Gyro,
    /// Changes by the effects that `gyro` includes, one sentence each.
    pub effects: Vec<String>,
    /// Where it comes from.
    pub origin: &'a Origin,
    /// Facts about the target, stated by the user.
    pub options: &'a Options,
    /// Effects that `gyro` includes, and those that the target has asked for.
    asked: RefCell<BTreeSet<String>>,
}

/// Half track and radii of the wheels under the effects of the configuration, as factors on the nominal ones.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Geometry {
    /// Factor on the half track.
    pub track: f64,
    /// Factors on the radii of the left and the right wheel.
    pub radii: [f64; 2],
    /// Effects that change it.
    pub effects: Vec<&'static str>,
}

/// σ and τ of a first-order Gauss-Markov process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GaussMarkov {
    /// Stationary standard deviation, rad/s.
    pub std_rad_s: Known,
    /// Correlation time, s.
    pub correlation_time_s: Known,
}

/// b = C2 + k z + m z², z the temperature above that at power-on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Thermal {
    /// k, rad/s/°C.
    pub slope_rad_s_c: f64,
    /// m, rad/s/°C².
    pub bend_rad_s_c2: f64,
    /// Lag behind the temperature sensor, s.
    pub lag_s: f64,
    /// Temperature at power-on, °C.
    pub power_on_c: f64,
    /// Temperatures of the log, °C.
    pub range_c: [f64; 2],
}

impl<'a> Source<'a> {
    /// # Errors
    /// [`ErrorKind::Config`] without `[gyro]`; [`ErrorKind::Usage`] if an option is not physical.
    pub fn new(config: &'a Config, origin: &'a Origin, options: &'a Options) -> Result<Self> {
        for (option, value) in [("--rate", options.rate_hz), ("--step", options.step_s)] {
            if let Some(value) = value
                && !(value > 0.0 && value.is_finite())
            {
                return Err(Error::new(ErrorKind::Usage, option, format!("{value} is not a positive number")));
            }
        }
        if let Some(t) = options.power_on_temperature_c
            && !(t > ABSOLUTE_ZERO_C && t.is_finite())
        {
            return Err(Error::new(
                ErrorKind::Usage,
                "--power-on-temperature",
                format!("{t} is no temperature in degC"),
            ));
        }
        if let Some(id) = options.device_id
            && (id == 0 || i32::try_from(id).is_err())
        {
            let found = format!("{id} is no device id: PX4 keeps them as positive 32 bit integers");
            return Err(Error::new(ErrorKind::Usage, "--device-id", found).hint("read CAL_GYRO0_ID of the vehicle"));
        }
        if let Some(topic) = &options.topic
            && !topic_is_named_as_ros_names(topic)
        {
            let found = format!("{topic:?} is no topic");
            return Err(Error::new(ErrorKind::Usage, "--topic", found).hint("write it as ROS does: /imu/data"));
        }
        let (gyro, folded) = effects::folded(config.require_gyro()?, &config.effects);
        let (asked, effects): (BTreeSet<String>, Vec<String>) = folded.into_iter().unzip();
        Ok(Self { config, gyro, effects, origin, options, asked: RefCell::new(asked) })
    }

    /// Why the configuration is not fit for use, where its validation failed.
    #[must_use]
    pub fn failed(&self) -> Option<String> {
        let v = self.config.validation.as_ref()?;
        let mut why = Vec::new();
        if !v.identifiable {
            why.push("the time constant is not identifiable".to_string());
        }
        if !v.white {
            why.push(format!("the residuals are not white (joint p = {:.3})", v.joint_p_value));
        }
        if why.is_empty() && v.accepted_by_user {
            why.push("no warm-up was found".to_string());
        }
        (!why.is_empty()).then(|| why.join(", and "))
    }

    /// The fitted axis as the target counts it, and whether that is an assumption.
    #[must_use]
    pub(crate) fn axis(&self) -> (Axis, bool) {
        let column = self.config.provenance.as_ref().and_then(|p| Axis::of_column(&p.column));
        match self.options.axis.or(column) {
            Some(axis) => (axis, false),
            None => (Axis::Z, true),
        }
    }

    /// f, Hz: what the user says, else the configuration's sample time, else the log's rate.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if nothing states it.
    pub(crate) fn rate_hz(&self) -> Result<f64> {
        let stated = self.options.rate_hz.or(self.config.sample_time_s.map(|dt| 1.0 / dt));
        stated.or(self.config.validation.as_ref().map(|v| v.sample_rate_hz)).ok_or_else(|| {
            Error::new(
                ErrorKind::Config,
                &self.origin.file,
                "the key is missing, and this target needs the gyro's rate",
            )
            .at("`sample_time_s`")
            .hint("add it, or give --rate HZ")
        })
    }

    /// f and where it is from, for the notes of a file.
    ///
    /// # Errors
    /// As [`Source::rate_hz`].
    pub(crate) fn rate_text(&self) -> Result<String> {
        let origin = match (self.options.rate_hz, self.config.sample_time_s) {
            (Some(_), _) => "given with --rate",
            (None, Some(_)) => "sample_time_s of the configuration, unless --rate says otherwise",
            (None, None) => "the rate of the log, unless --rate says otherwise",
        };
        Ok(format!("f = {} Hz ({origin})", digits(self.rate_hz()?)))
    }

    /// N, rad/√s (which is rad/s/√Hz).
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if it is zero: no target takes a gyro without white noise.
    pub(crate) fn angle_random_walk(&self) -> Result<Known> {
        let value = self.gyro.angle_random_walk_rad_sqrt_s;
        if value > 0.0 {
            let term = self.terms().and_then(|t| t.angle_random_walk_rad_sqrt_s);
            // an interval about another level is none of this one
            let ci95 = term.map(|t| t.ci95).filter(|[low, high]| (*low..=*high).contains(&value));
            return Ok(Known { value, ci95 });
        }
        Err(Error::new(
            ErrorKind::Config,
            &self.origin.file,
            "is 0: without white noise no filter can be told its weight",
        )
        .at("`gyro.angle_random_walk_rad_sqrt_s`")
        .hint("fit a log, or state the datasheet's noise density"))
    }

    /// K, rad/s/√s: of `[gyro.noise]`, and of an effect that adds a walk of its own.
    #[must_use]
    pub(crate) fn rate_random_walk(&self) -> Option<Known> {
        let term = self.terms().and_then(|t| t.rate_random_walk_rad_s_sqrt_s);
        let stated = self.gyro.noise.as_ref().and_then(|n| n.rate_random_walk_rad_s_sqrt_s);
        let own = stated.or(term.map(|t| t.estimate)).unwrap_or(0.0);
        match self.effect_value("gyro.rate_random_walk", "rate_random_walk_rad_s_sqrt_s") {
            // independent walks add their variances
            Some(added) if added > 0.0 => Some(Known::exact(own.hypot(added))),
            _ => (own > 0.0).then(|| Known { value: own, ci95: term.map(|t| t.ci95) }),
        }
    }

    /// B, rad/s.
    #[must_use]
    pub(crate) fn bias_instability(&self) -> Option<Known> {
        let term = self.terms().and_then(|t| t.bias_instability_rad_s);
        let effect = || self.effect_value("gyro.bias_instability", "bias_instability_rad_s").map(Known::exact);
        term.map(|t| Known { value: t.estimate, ci95: Some(t.ci95) }).or_else(effect).filter(|b| b.value > 0.0)
    }

    /// The Gauss-Markov term, identified or added as an effect.
    #[must_use]
    pub(crate) fn gauss_markov(&self) -> Option<GaussMarkov> {
        let term = self.terms().and_then(|t| t.gauss_markov_rad_s).map(|t| GaussMarkov {
            std_rad_s: Known { value: t.estimate, ci95: Some(t.ci95) },
            correlation_time_s: Known { value: t.correlation_time_s, ci95: t.correlation_time_ci95_s },
        });
        let effect = || {
            Some(GaussMarkov {
                std_rad_s: Known::exact(self.effect_value("gyro.gauss_markov", "std_rad_s")?),
                correlation_time_s: Known::exact(self.effect_value("gyro.gauss_markov", "correlation_time_s")?),
            })
        };
        term.or_else(effect).filter(|m| m.std_rad_s.value > 0.0 && m.correlation_time_s.value > 0.0)
    }

    /// C1, rad/s.
    #[must_use]
    pub(crate) fn warm_up(&self) -> Known {
        let variance = self.gyro.covariance.map(|c| c.c1_c1_rad2_s2);
        normal(self.gyro.c1_rad_s, variance)
    }

    /// C1 + C2, rad/s: the bias of the warm gyro.
    #[must_use]
    pub(crate) fn warm_bias(&self) -> Known {
        let variance = self.gyro.covariance.map(|c| c.c1_c1_rad2_s2 + 2.0 * c.c1_c2_rad2_s2 + c.c2_c2_rad2_s2);
        normal(self.gyro.c1_rad_s + self.gyro.c2_rad_s, variance)
    }

    /// C1 + C2 without the Earth's rotation, rad/s: for programs that count with that themselves.
    #[must_use]
    pub(crate) fn warm_bias_without_earth(&self) -> Known {
        let Known { value, ci95 } = self.warm_bias();
        let earth = self.gyro.earth_rate_rad_s.unwrap_or(0.0);
        Known { value: value - earth, ci95: ci95.map(|ends| ends.map(|v| v - earth)) }
    }

    /// Sentence for a `program` that models the Earth's rotation itself: whether it was subtracted from `key`.
    #[must_use]
    pub(crate) fn earth_text(&self, key: &str, program: &str) -> String {
        match self.gyro.earth_rate_rad_s {
            Some(earth) => format!(
                "{program} counts with the Earth's rotation itself: {earth:.4e} rad/s of it are taken off {key} \
                 (gyro.earth_rate_rad_s)"
            ),
            None => format!(
                "{program} counts with the Earth's rotation itself, and {key} still holds what the axis measured of it, at \
                 most 7.3e-5 rad/s: gyroid fit --latitude tells it apart"
            ),
        }
    }

    /// Sentence that `key` keeps the Earth's rotation, for a `program` whose world does not rotate; `None` where it is
    /// not known.
    #[must_use]
    pub(crate) fn earth_stays_text(&self, key: &str, program: &str) -> Option<String> {
        self.gyro.earth_rate_rad_s.map(|earth| {
            format!(
                "{key} keeps {earth:.4e} rad/s of the Earth's rotation (gyro.earth_rate_rad_s): {program}'s world stands \
                 still, so that it is part of what the gyro at rest is off by"
            )
        })
    }

    /// T, s.
    #[must_use]
    pub(crate) fn time_constant(&self) -> Known {
        let value = self.gyro.time_constant_s;
        let ci95 = self.config.validation.as_ref().map(|v| v.time_constant_ci95_s);
        // an effect's time constant is not the fitted one
        Known { value, ci95: ci95.filter(|[low, high]| (*low..=*high).contains(&value)) }
    }

    /// The stochastic terms that are known, in SI, for the head of the file: no target takes all of them.
    #[must_use]
    pub(crate) fn terms_text(&self) -> String {
        let own = Known::exact(self.gyro.angle_random_walk_rad_sqrt_s);
        let markov = self.gauss_markov();
        let named = [
            ("angle random walk N", "rad/sqrt(s)", self.angle_random_walk().ok().or(Some(own))),
            ("rate random walk K", "rad/s/sqrt(s)", self.rate_random_walk()),
            ("bias instability B", "rad/s", self.bias_instability()),
            ("Gauss-Markov sigma", "rad/s", markov.map(|m| m.std_rad_s)),
            ("its correlation time", "s", markov.map(|m| m.correlation_time_s)),
        ];
        let words =
            named.iter().filter_map(|(name, unit, known)| known.map(|k| format!("{name} = {:.4e} {unit}", k.value)));
        words.collect::<Vec<_>>().join(", ")
    }

    /// Spread of C2 from power-on to power-on, rad/s.
    #[must_use]
    pub(crate) fn turn_on(&self) -> Option<f64> {
        self.gyro.turn_on_bias_std_rad_s.filter(|s| *s > 0.0)
    }

    /// Step of the rate's lattice, rad/s.
    #[must_use]
    pub(crate) fn lattice(&self) -> Option<f64> {
        self.gyro.noise.as_ref().and_then(|n| n.quantization_lsb_rad_s).filter(|lsb| *lsb > 0.0)
    }

    /// The bias as a function of temperature, where the configuration has one and its temperatures are known; else what
    /// is missing.
    ///
    /// # Errors
    /// The missing information and the remedy, as text for the file.
    pub(crate) fn thermal(&self) -> std::result::Result<Thermal, [&'static str; 2]> {
        const EFFECT: &str = "gyro.temperature_sensitivity";
        let Some(slope_rad_s_c) = self.effect_value(EFFECT, "coefficient_rad_s_per_c") else {
            return Err([
                "the configuration knows the bias against time since power-on, not against temperature",
                "gyroid gap diagnose CONFIG --fit LOG --write-sim FILE writes [[effect]] gyro.temperature_sensitivity \
                 where a log with temperatures supports it; export that file",
            ]);
        };
        let v = self.config.validation.as_ref();
        let range = v.and_then(|v| Some([v.valid_from_temperature_c?, v.valid_to_temperature_c?]));
        let Some(range_c) = range else {
            return Err([
                "no range of temperatures is known in which the polynomial holds",
                "fit a log with a temperature column, which writes valid_from_temperature_c and valid_to_temperature_c",
            ]);
        };
        Ok(Thermal {
            slope_rad_s_c,
            bend_rad_s_c2: self.effect_value(EFFECT, "bend_rad_s_per_c2").unwrap_or(0.0),
            lag_s: self.effect_value(EFFECT, "lag_s").unwrap_or(0.0),
            power_on_c: self.options.power_on_temperature_c.unwrap_or(range_c[0]),
            range_c,
        })
    }

    /// The robot's geometry with the effects over that of `[vehicle]`; none without `[vehicle]`.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if an effect's parameter is missing, unknown or out of bounds.
    pub(crate) fn geometry(&self) -> Result<Option<Geometry>> {
        let Some(vehicle) = &self.config.vehicle else { return Ok(None) };
        let nominal = Robot::from(vehicle);
        let (mut robot, mut effects) = (nominal, Vec::new());
        for table in &self.config.effects {
            let Some(effect) = by_id(&table.id) else { continue };
            let before = robot;
            effect.simulated(&table.parameters, 1.0, 0)?.robot(&mut robot);
            if (before.half_track_m, before.radius_m) != (robot.half_track_m, robot.radius_m) {
                self.asked.borrow_mut().insert(table.id.clone());
                effects.push(effect.about().id);
            }
        }
        Ok(Some(Geometry {
            track: robot.half_track_m / nominal.half_track_m,
            radii: [0, 1].map(|side| robot.radius_m[side] / nominal.radius_m[side]),
            effects,
        }))
    }

    /// Effects that no number of the target's file stands for, and those that are of the robot and not of its gyro, as far as nothing
    /// has asked for them.
    pub(super) fn left_out(&self) -> Vec<String> {
        let asked = self.asked.borrow();
        let left = self.config.effects.iter().map(|e| e.id.as_str()).filter(|id| !asked.contains(*id));
        effects::left_out(left)
    }

    fn terms(&self) -> Option<crate::config::NoiseTerms> {
        self.gyro.noise.as_ref().and_then(|n| n.terms)
    }

    fn effect_value(&self, id: &str, key: &str) -> Option<f64> {
        self.asked.borrow_mut().insert(id.to_owned());
        let find = |e: &&EffectTable| e.id == id;
        self.config.effects.iter().find(find).and_then(|e| e.parameters.get(key)).copied()
    }
}

/// Letters, digits, `_` and `/`, begun by `/`, `~` or a letter.
fn topic_is_named_as_ros_names(topic: &str) -> bool {
    let rest = topic.strip_prefix(['~', '/']).unwrap_or(topic);
    let begins = topic.starts_with(|c: char| c == '~' || c == '/' || c.is_ascii_alphabetic());
    begins && !rest.is_empty() && rest.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '/')
}

fn normal(value: f64, variance: Option<f64>) -> Known {
    let half = variance.map(|v| Z975 * v.max(0.0).sqrt());
    Known { value, ci95: half.map(|h| [value - h, value + h]) }
}
