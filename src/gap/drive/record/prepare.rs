//! A log with its configuration, prepared as a [`Record`].

use super::given::Given;
use super::{Belief, FEWEST_ROWS, Record};
use crate::bias::WarmUp;
use crate::config::{Config, Gyro, Kind, Pose};
use crate::effects::Library;
use crate::effects::drive::DriveExplanation;
use crate::error::{Error, ErrorKind, Result};
use crate::gap::drive::ekf::effect_set::EffectSet;
use crate::gap::drive::preprocess::pace::feedback_note;
use crate::gap::drive::preprocess::start_heading;
use crate::model::drive::Robot;
use crate::signal::{Log, increasing_times, names, since_power_on};
use crate::vehicle::{Odometry, Rolling, one_wheel, positions_only};

/// Assumed standard deviation of C2, rad/s, where the configuration states none: data sheets of cheap gyros say 0.1 to
/// 1 °/s.
const TURN_ON_STD_RAD_S: f64 = 5e-3;
/// Assumed relative standard deviation of C1 and T, where the configuration states none.
const WARM_UP_STD: f64 = 0.1;
/// Ratio of the gyro's rate in the log and the stated one beyond which they differ: more than clocks and lost rows do.
const OTHER_RATE: f64 = 1.1;

impl Record {
    /// Prepares the log of one drive.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if the configuration is not of a drive, or lacks a table; [`ErrorKind::Column`] without
    /// wheel speeds; [`ErrorKind::TooShort`] below 512 rows; [`ErrorKind::Time`] if time does not run forward.
    pub(crate) fn new(config: &Config, log: &Log, since_power_on_s: f64) -> Result<Self> {
        if config.kind != Kind::Driving {
            return Err(Error::new(ErrorKind::Config, "configuration", "kind is \"stationary\"")
                .at("`kind`")
                .hint("give the configuration of the robot, kind = \"driving\""));
        }
        if log.len() < FEWEST_ROWS {
            return Err(Error::new(ErrorKind::TooShort, &log.source, format!("{} rows", log.len()))
                .hint(format!("a drive needs at least {FEWEST_ROWS} rows to be judged")));
        }
        let mut notes = Vec::new();
        let column = |name: &str| log.get(name).map(<[f64]>::to_vec);
        let gyro_rad_s = column(names::GYRO_Z).filter(|g| g.iter().any(|v| v.is_finite()));
        let times_s = increasing_times(log)?;
        let gyro_step_s = gyro_rad_s.as_ref().map(|gyro| read_every_s(&times_s, gyro));
        let mut belief = belief(config, gyro_step_s, &mut notes)?;
        let load_kg = std::mem::take(&mut belief.robot.load_kg);
        notes.extend((load_kg > 0.0).then(|| {
            format!("The robot carries a known load of {load_kg} kg, taken as a point mass at its centre of mass.")
        }));
        let both = |left: &str, right: &str| Some([column(left)?, column(right)?]);
        let tick_rad = config.encoder.and_then(|e| e.tick_rad());
        let odometry = Odometry::of(log, &Rolling::new(config.require_vehicle()?), tick_rad);
        let wheels_rad_s = odometry.as_ref().and_then(Odometry::wheels).map(|both| both.map(<[f64]>::to_vec));
        let wheels_rad_s = wheels_rad_s.ok_or_else(|| no_wheels(log, odometry.is_some()))?;
        if odometry.as_ref().is_some_and(Odometry::is_converted) {
            notes.push(
                "The wheels are what the odometry's speed and yaw rate stand for, with the nominal radius and track."
                    .into(),
            );
        }
        let mut torques_n_m = both(names::TORQUE_LEFT, names::TORQUE_RIGHT);
        torques_n_m.iter_mut().flatten().for_each(|u| hold(u));
        let pose = column(names::X).zip(column(names::Y)).map(|(x, y)| {
            let nowhere = vec![f64::NAN; x.len()];
            [x, y, column(names::HEADING).unwrap_or(nowhere)]
        });
        let pose = pose.filter(|[x, y, _]| x.iter().zip(y).any(|(x, y)| x.is_finite() && y.is_finite()));
        for (there, what, lost) in [
            (torques_n_m.is_some(), "torques", "forces, masses and motors cannot be judged"),
            (gyro_rad_s.is_some(), "gyro", "nothing of the gyro can be judged"),
            (
                pose.is_some(),
                "pose",
                "what only moves the robot over ground (sideways skid) cannot be judged, and a common error of wheel radii, \
                 track width and gyro gain shows less",
            ),
        ] {
            if !there {
                notes.push(format!("No {what} in the log: {lost}."));
            }
        }
        let mut pose = pose;
        let lasting_s = config.pose.and_then(|p| p.correlation_time_s).unwrap_or(0.0);
        if let Some(pose) = pose.as_mut().filter(|_| lasting_s > 0.0) {
            thin(pose, &times_s, lasting_s);
            notes.push(format!(
                "Of the pose one reading in {lasting_s} s is used: closer ones are not independent, says [pose] correlation_time_s."
            ));
        }
        let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        let mut record = Self {
            since_power_on_s: since_power_on(log, since_power_on_s)?,
            starts: vec![0],
            sources: vec![log.source.clone()],
            loads_kg: vec![load_kg],
            step_s: steps[steps.len() / 2],
            times_s,
            torques_n_m,
            gyro_rad_s,
            wheels_rad_s,
            pose,
            temperature_c: column(names::TEMPERATURE).filter(|t| t.iter().any(|v| v.is_finite())),
            belief,
            wheels_were_set: false,
            given: Given::default(),
            notes,
        };
        record.notes.extend(feedback_note(&record));
        record.with_start_heading().with_given(config)
    }

    /// Adds an initial heading where the reference has positions alone, estimated from these; without the reference
    /// where they do not tell it.
    fn with_start_heading(self) -> Self {
        let Some([_, _, heading]) = &self.pose else { return self };
        if heading.iter().any(|h| h.is_finite()) {
            return self;
        }
        if let Some((mut told, std_rad)) = start_heading::told(&self) {
            told.belief.heading_std_rad = std_rad;
            told.notes = self.notes;
            told.notes.push(
                "The reference tells positions and no heading: the heading at the start is estimated from them, and is no \
                 finding."
                    .into(),
            );
            return told;
        }
        let mut notes = self.notes.clone();
        notes.push("The robot hardly moves in its positions: without a heading they are no reference.".into());
        Self { pose: None, notes, ..self }
    }

    /// With the effects of `config` as given; readings of late sensors are moved earlier by whole rows.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] for effects that are no drive's, or that are drawn anew in each run.
    pub(crate) fn with_given(self, config: &Config) -> Result<Self> {
        if config.effects.is_empty() {
            return Ok(self);
        }
        let library = Library::new().with_own(config)?;
        for table in &config.effects {
            let lasts = library.driving_by_id(&table.id).is_some_and(|effect| {
                matches!(
                    effect.explanation(),
                    DriveExplanation::Model(_) | DriveExplanation::WheelLattice | DriveExplanation::NoiseLevel(_)
                )
            });
            if !lasts {
                let found = format!("{:?} is no part of a nominal simulator of drives", table.id);
                return Err(Error::new(ErrorKind::Config, "configuration", found).at("`[[effect]]`").hint(
                    "delete this table: when and where it acts is another in each run, and the diagnosis finds it",
                ));
            }
        }
        let effects: Vec<_> = config.effects.iter().map(|e| (e.id.clone(), e.parameters.clone())).collect();
        let claimed = EffectSet::new(&effects, &library);
        let mut record = self;
        claimed.believe(&mut record.belief);
        let mut changes = claimed.changes;
        for (place, of) in claimed.late {
            let (moved, left_s) = record.by_whole_rows(of, changes[place].1[0]);
            changes[place].1[0] = left_s;
            record = moved.unwrap_or(record);
        }
        record.given = Given::new(changes, claimed.wheel_lsb_rad_s);
        Ok(record)
    }
}

fn no_wheels(log: &Log, one_speed: bool) -> Error {
    let refused = |found: &str, hint: String| Error::new(ErrorKind::Column, &log.source, found).hint(hint);
    if one_speed {
        return refused(
            "one speed for the whole robot, and not how fast each side drives",
            format!(
                "log both wheels; or, if the log's one yaw rate may stand for the wheels' difference, name it: --map {}=COLUMN",
                names::ODO_YAW_RATE
            ),
        );
    }
    if let Some((found, hint)) = one_wheel(log).or_else(|| positions_only(log)) {
        return refused(&found, hint);
    }
    refused(
        "no wheel speeds, neither of both wheels nor of an odometry that stands for them",
        format!("name the columns that hold them: --map {}=COLUMN[:UNIT]", names::WHEEL_LEFT),
    )
}

/// Median time between readings, s.
fn read_every_s(times_s: &[f64], readings: &[f64]) -> f64 {
    let there: Vec<f64> = times_s.iter().zip(readings).filter(|r| r.1.is_finite()).map(|r| *r.0).collect();
    let mut steps: Vec<f64> = there.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(f64::NAN)
}

/// `gyro_step_s`: median time between readings of the gyro, s; none without a gyro.
fn belief(config: &Config, gyro_step_s: Option<f64>, notes: &mut Vec<String>) -> Result<Belief> {
    let (vehicle, encoder) = (config.require_vehicle()?, config.require_encoder()?);
    let step_s = config.sample_time_s.ok_or_else(|| {
        Error::new(ErrorKind::Config, "configuration", "the key is missing")
            .at("`sample_time_s`")
            .hint("add it at the top of the file: white noise depends on it")
    })?;
    let mut assumed = |value: Option<f64>, default: f64, key: &str| {
        value.unwrap_or_else(|| {
            notes.push(format!("The configuration does not state {key}: {default} is assumed."));
            default
        })
    };
    // a robot without a gyro needs no table for it
    let gyro = match &config.gyro {
        None if gyro_step_s.is_none() => None,
        _ => Some(config.require_gyro()?),
    };
    let (mut turn_on, mut relative) = (0.0, 0.0);
    if let Some(gyro) = gyro {
        turn_on = assumed(gyro.turn_on_bias_std_rad_s, TURN_ON_STD_RAD_S, "turn_on_bias_std_rad_s");
        relative = assumed(gyro.warm_up_relative_std, WARM_UP_STD, "warm_up_relative_std");
    }
    // white noise is stated as a density: a reading has it over the time that it stands for
    let other = gyro_step_s.filter(|own| (own / step_s).ln().abs() > OTHER_RATE.ln());
    notes.extend(other.map(|own| {
        format!(
            "The gyro reads every {own:.4} s, where sample_time_s is {step_s} s: its white noise is taken as N/√({own:.4} s), that of \
             readings that average over this time."
        )
    }));
    let gyro_step_s = other.unwrap_or(step_s);
    let pose = config.pose.unwrap_or(Pose::assumed(step_s.recip()));
    Ok(Belief {
        robot: Robot::from(vehicle),
        steering: vehicle.steering,
        torque_noise_n_m_sqrt_s: vehicle.torque_noise_n_m_sqrt_s,
        gyro_std_rad_s: gyro.map_or(1.0, |g| g.angle_random_walk_rad_sqrt_s / gyro_step_s.sqrt()),
        wheel_std_rad_s: encoder.speed_variance_rad2_s2(step_s).sqrt(),
        position_std_m: pose.position_std_m,
        heading_std_rad: pose.heading_std_rad,
        lever_arm_std_m: pose.lever_arm_std_m.unwrap_or(0.0),
        heading_offset_std_rad: pose.heading_offset_std_rad.unwrap_or(0.0),
        pose_delay_std_s: pose.delay_std_s.unwrap_or(0.0),
        warm_up: gyro.map_or(WarmUp { c1_rad_s: 0.0, c2_rad_s: 0.0, time_constant_s: 1.0 }, Gyro::warm_up),
        turn_on_bias_std_rad_s: turn_on,
        warm_up_relative_std: relative,
        unknown_input: [0.0; 2],
    })
}

/// Keeps one reading of the pose in `lasting_s`.
fn thin(pose: &mut [Vec<f64>; 3], times_s: &[f64], lasting_s: f64) {
    let mut last_s = f64::NEG_INFINITY;
    for (k, t_s) in times_s.iter().enumerate() {
        let there = pose[..2].iter().all(|p| p[k].is_finite());
        if there && t_s - last_s >= lasting_s {
            last_s = *t_s;
        } else {
            pose.iter_mut().for_each(|p| p[k] = f64::NAN);
        }
    }
}

/// Replaces missing values by the last one before; by zero at the start.
fn hold(values: &mut [f64]) {
    let mut last = 0.0;
    for v in values {
        if v.is_finite() {
            last = *v;
        } else {
            *v = last;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::EffectTable;
    use crate::effects::drive::{ids, registry};
    use crate::gap::drive::holdout;
    use crate::gap::drive::model_selection::judge;
    use crate::gap::drive::options::Options;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot};
    use crate::gap::selection::sets::Main;

    fn with(id: &str, name: &str, value: f64) -> Config {
        let mut config = robot();
        config.effects.push(EffectTable { id: id.into(), parameters: [(name.into(), value)].into() });
        config
    }

    #[test]
    #[ignore = "battery: some seconds"]
    fn battery_what_is_given_is_not_found_again() {
        for (id, name, value) in [
            (ids::payload(), "mass_relative", 0.2),
            (ids::scale_factor(), "relative", 0.02),
            (ids::gyro_delay(), "delay_s", 0.026),
            (ids::wheel_noise(), "noise_over_nominal", 2.0),
        ] {
            let log = recorded(60.0, 17, Some((id, name, value)));
            let record = Record::new(&with(id, name, value), &log, 0.0).unwrap();
            let found = judge(&record, registry(), &Options::default());
            assert_eq!(found.findings.mains()[0].0, Main::None, "{id}");
            // the nominal simulator with the effect given scores as the plain one with the effect added
            let plain = Record::new(&robot(), &log, 0.0).unwrap();
            let effects = [(id.to_owned(), [(name.to_owned(), value)].into())];
            let score = |record: &Record, effects: &[_]| -> f64 {
                holdout::rows(record, &Library::new(), effects, Default::default()).iter().sum()
            };
            let (given, added) = (score(&record, &[]), score(&plain, &effects));
            assert!((given - added).abs() < 1e-6 * added.abs(), "{id}: {given} {added}");
        }
    }

    #[test]
    #[ignore = "battery: some ten seconds and more"]
    fn battery_what_differs_from_what_is_given_is_what_is_found() {
        let log = recorded(60.0, 18, Some((ids::payload(), "mass_relative", 0.3)));
        let record = Record::new(&with(ids::payload(), "mass_relative", 0.1), &log, 0.0).unwrap();
        let found = judge(&record, registry(), &Options::default());
        assert_eq!(found.findings.mains()[0].0, Main::Effect(ids::payload().into()));
        let part = found.findings.sets[0].part(ids::payload()).unwrap();
        let (value, std) = (part.parameters["mass_relative"], part.std["mass_relative"]);
        assert!((value - (1.3 / 1.1 - 1.0)).abs() < 4.0 * std, "{value} ± {std}");
    }

    #[test]
    fn white_noise_of_a_gyro_is_that_of_the_rate_of_its_log() {
        let log = recorded(40.0, 20, None);
        let stated = Record::new(&robot(), &log, 0.0).unwrap().belief.gyro_std_rad_s;
        let mut config = robot();
        config.sample_time_s = Some(0.0025);
        let record = Record::new(&config, &log, 0.0).unwrap();
        assert!((record.belief.gyro_std_rad_s / stated - 1.0).abs() < 1e-6);
        assert!(record.notes.iter().any(|n| n.contains("every 0.0100 s, where sample_time_s is 0.0025 s")));
    }

    #[test]
    fn what_is_drawn_anew_in_each_run_is_refused() {
        let log = recorded(20.0, 19, None);
        let refused = Record::new(&with(ids::bias_step(), "step_rad_s", 0.01), &log, 0.0).unwrap_err();
        assert!(refused.to_string().contains(ids::bias_step()), "{refused}");
    }
}
