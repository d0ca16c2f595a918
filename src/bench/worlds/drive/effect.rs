//! world' = effect(world, strength): one effect of one robot, its form drawn once

use super::machine::Machine;
use super::nats::Sensors;
use super::record::{DriveRun, Trace};
use super::world::World;
use crate::bench::worlds::effect::Effect as AtRest;
use crate::bench::worlds::label::{Parameters, Place};
use crate::math::random::Stream;

/// A robot in a run: the facts that an effect may use when it is set.
#[derive(Clone, Copy)]
pub(super) struct Scene<'a> {
    pub machine: &'a Machine,
    pub run: &'a DriveRun,
}

/// Sensor that a log must have for the effect to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Need {
    /// No particular one.
    Anything,
    Torque,
    Pose,
    Gyro,
    /// Noise beside a motion that is known.
    GyroAndTorque,
}

impl Need {
    pub(crate) fn met(self, sensors: Sensors) -> bool {
        match self {
            Self::Anything => true,
            Self::Torque => sensors.torque,
            Self::Pose => sensors.pose,
            Self::Gyro => sensors.gyro,
            Self::GyroAndTorque => sensors.gyro && sensors.torque,
        }
    }
}

/// How an effect shows in a recording, by which its nats are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shows {
    /// Identical in every repetition of the drive.
    Signal,
    /// Random: drawn anew in each drive.
    Noise,
    /// A changed size of a noise that is there.
    Level,
    /// Rare and large: single readings show it.
    Rare,
}

type Set = dyn Fn(f64, &mut World, Scene<'_>, &mut Stream) + Send + Sync;
type Tell = dyn Fn(f64, &Trace) -> f64 + Send + Sync;

/// One effect of one robot.
pub(super) struct Effect {
    pub id: &'static str,
    pub channel: &'static str,
    pub need: Need,
    /// A strength from which the right one is sought, and the largest that is possible.
    pub start: f64,
    pub most: f64,
    pub shows: Shows,
    /// The strength that it has where it is strong, whatever its nats; else the nats say.
    pub large: Option<f64>,
    /// Standard deviation of its strength, s, in robots without a fault, over the time from row to row; zero where
    /// these have none of it.
    pub usual_rows: f64,
    /// Condition that it follows, as the contract has them; for effects that are in no list.
    pub condition: Option<&'static str>,
    set: Option<Box<Set>>,
    tell: Vec<(&'static str, Box<Tell>)>,
    rest: Option<Box<dyn AtRest>>,
}

impl Effect {
    pub(crate) fn new(id: &'static str, channel: &'static str, need: Need, [start, most]: [f64; 2]) -> Self {
        let (set, tell, rest, condition) = (None, Vec::new(), None, None);
        Self {
            id,
            channel,
            need,
            start,
            most,
            shows: Shows::Signal,
            large: None,
            usual_rows: 0.0,
            condition,
            set,
            tell,
            rest,
        }
    }

    /// One of a gyro's own effects, which it has at rest too.
    pub(crate) fn at_rest(rest: Box<dyn AtRest>, machine: &Machine) -> Self {
        let white = machine.gyro.white_std_rad_s();
        let shows = match rest.id() {
            "gyro.outliers" => Shows::Rare,
            _ if rest.psd(1.0).is_some() => Shows::Noise,
            _ => Shows::Signal,
        };
        let range = match rest.id() {
            "gyro.outliers" => [5.0, 300.0],
            "gyro.rate_random_walk" => [0.02 * white, 10.0 * white],
            "gyro.rate_ramp" => [1e-3 * white, 0.1 * white],
            _ => [0.1 * white, 10.0 * white],
        };
        let id = rest.id();
        Self { shows, rest: Some(rest), ..Self::new(id, "gyro", Need::Gyro, range) }
    }

    pub(crate) fn sets(self, set: impl Fn(f64, &mut World, Scene<'_>, &mut Stream) + Send + Sync + 'static) -> Self {
        Self { set: Some(Box::new(set)), ..self }
    }

    /// Adds a parameter by its name in the contract: its value from the strength and the signals of the fit's run.
    pub(crate) fn tells(
        mut self,
        name: &'static str,
        value: impl Fn(f64, &Trace) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.tell.push((name, Box::new(value)));
        self
    }

    pub(crate) fn shows(self, shows: Shows) -> Self {
        Self { shows, ..self }
    }

    /// Of time stamps, which a healthy logger has right to a twentieth of a row.
    pub(crate) fn timed(self) -> Self {
        Self { usual_rows: 0.05, ..self }
    }

    pub(crate) fn at_large(self, strength: f64) -> Self {
        Self { large: Some(strength), ..self }
    }

    pub(crate) fn following(self, condition: &'static str) -> Self {
        Self { condition: Some(condition), ..self }
    }

    /// Puts it into `world` with this strength.
    pub(crate) fn set(&self, strength: f64, world: &mut World, scene: Scene<'_>, s: &mut Stream) {
        if let Some(set) = &self.set {
            set(strength, world, scene, s);
        }
        if let Some(rest) = &self.rest {
            let path = rest.path(&scene.run.gyro, s);
            world.gyro.path_rad_s.resize(scene.run.course.len(), 0.0);
            for (sum, x) in world.gyro.path_rad_s.iter_mut().zip(&path) {
                *sum += strength * x;
            }
        }
    }

    /// Changes the gyro's readings, noise and all.
    pub(crate) fn output(&self, strength: f64, reading_rad_s: &mut [f64], run: &DriveRun, s: &mut Stream) {
        if let Some(rest) = &self.rest {
            rest.output(strength, reading_rad_s, &run.gyro, s);
        }
    }

    pub(crate) fn parameters(&self, strength: f64, run: &DriveRun, trace: &Trace, s: &mut Stream) -> Parameters {
        match &self.rest {
            Some(rest) => rest.parameters(&run.gyro, &rest.path(&run.gyro, s), strength),
            None => self.tell.iter().map(|(name, value)| ((*name).to_string(), value(strength, trace))).collect(),
        }
    }

    pub(crate) fn place(&self, run: &DriveRun, s: &mut Stream) -> Place {
        match &self.rest {
            Some(rest) => rest.place(&run.gyro, &rest.path(&run.gyro, s)),
            None => {
                Place { channel: self.channel.into(), condition: self.condition.map(String::from), ..Place::default() }
            }
        }
    }
}
