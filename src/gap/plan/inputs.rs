//! Courses as logs that a simulator follows: commands, and what wheels, motors, gyro and reference of the nominal robot would read
//!
//! Such a log has the channels of the recorded one, at its sample time, so that what is simulated with it can be diagnosed beside that.

use super::courses::Track;
use crate::config::Config;
use crate::error::Result;
use crate::signal::{Log, TimeAxis, names};
use crate::vehicle::{Forcing, Motion, Rolling, advance};

/// Name of a planned log in messages.
pub(super) const SOURCE: &str = "plan";

/// Rows in which a pose is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Reference {
    /// None.
    None,
    /// As often as in the recorded log: every so many rows.
    Every(usize),
    /// Where the robot stands on its mark.
    Marks,
}

impl Reference {
    /// That of a recorded log.
    pub(super) fn of(log: &Log) -> Self {
        let Some(x) = log.get(names::X) else { return Self::None };
        let read = x.iter().filter(|x| x.is_finite()).count();
        if read == 0 { Self::None } else { Self::Every((x.len() as f64 / read as f64).round().max(1.0) as usize) }
    }
}

/// Whether a log has the torques of both wheels.
pub(super) fn has_torques(log: &Log) -> bool {
    log.get(names::TORQUE_LEFT).and(log.get(names::TORQUE_RIGHT)).is_some()
}

/// Inputs of the nominal robot of `config` on `track`, with the channels of `like`, and torques where `torques`.
///
/// # Errors
/// [`crate::ErrorKind::Config`] without `[vehicle]`.
pub(super) fn of_track(
    config: &Config,
    track: &Track,
    like: &Log,
    (reference, torques): (Reference, bool),
) -> Result<Log> {
    let robot = Rolling::new(config.require_vehicle()?);
    let step_s = like.time.median_step_s();
    let len = (track.duration_s() / step_s).floor() as usize + 1;
    let mut log = Log::new(SOURCE, TimeAxis::Uniform { start_s: 0.0, step_s, len });
    let mut columns: [Vec<f64>; 9] = std::array::from_fn(|_| Vec::with_capacity(len));
    let mut marks = track.marks_s.iter().peekable();
    let mut motion = Motion::default();
    for k in 0..len {
        let t_s = k as f64 * step_s;
        let next = track.at(t_s + step_s);
        let planned = Forcing::between(motion.velocity(), next, step_s);
        let is_read = match reference {
            Reference::None => false,
            Reference::Every(rows) => k.is_multiple_of(rows),
            Reference::Marks => marks.next_if(|mark| **mark <= t_s).is_some(),
        };
        let pose = [motion.x_m, motion.y_m, motion.heading_rad].map(|v| if is_read { v } else { f64::NAN });
        // in the middle of the step, where the friction is that of its mean speed
        let middle = Motion {
            speed_m_s: 0.5 * (motion.speed_m_s + next[0]),
            yaw_rate_rad_s: 0.5 * (motion.yaw_rate_rad_s + next[1]),
            ..motion
        };
        let torques = robot.torques_for(&middle, planned.acceleration_m_s2, planned.yaw_acceleration_rad_s2);
        let [left, right] = robot.wheel_speeds(&motion);
        let row =
            [motion.speed_m_s, motion.yaw_rate_rad_s, left, right, torques[0], torques[1], pose[0], pose[1], pose[2]];
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        motion = advance(&motion, &planned, step_s);
    }
    let gyro = columns[1].clone();
    let [speed, yaw_rate, left, right, torque_left, torque_right, x, y, heading] = columns;
    log.push(names::COMMAND_SPEED, speed)?;
    log.push(names::COMMAND_YAW_RATE, yaw_rate)?;
    log.push(names::WHEEL_LEFT, left)?;
    log.push(names::WHEEL_RIGHT, right)?;
    if like.get(names::GYRO_Z).is_some() {
        log.push(names::GYRO_Z, gyro)?;
    }
    if torques || has_torques(like) {
        log.push(names::TORQUE_LEFT, torque_left)?;
        log.push(names::TORQUE_RIGHT, torque_right)?;
    }
    if reference != Reference::None {
        log.push(names::X, x)?;
        log.push(names::Y, y)?;
        if reference == Reference::Marks || like.get(names::HEADING).is_some() {
            log.push(names::HEADING, heading)?;
        }
    }
    Ok(log)
}

#[cfg(test)]
mod tests {
    use super::super::courses::{COURSES, Limits};
    use super::*;
    use crate::simulate::{Options, replay};

    const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
        [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 100.0\nangle_random_walk_rad_sqrt_s = 1e-6\n\
        [vehicle]\nmass_kg = 20.0\nyaw_inertia_kg_m2 = 0.5\nhalf_track_m = 0.2\nwheel_radius_m = 0.08\n\
        wheel_inertia_kg_m2 = 0.003\nviscous_friction_n_m_s = 0.05\ntorque_noise_n_m_sqrt_s = 0.0\n\
        [encoder]\nspeed_noise_std_rad_s = 1e-6\n";

    fn like(channels: &[&str]) -> Log {
        let mut log = Log::new("like.csv", TimeAxis::Uniform { start_s: 0.0, step_s: 0.01, len: 10 });
        channels.iter().for_each(|name| log.push(*name, vec![0.0; 10]).unwrap());
        log
    }

    /// The simulator is given the torques of the course and nothing else: without noise it drives as commanded.
    #[test]
    fn a_simulator_that_follows_the_torques_drives_the_course() {
        let config = Config::parse(ROBOT, "robot.toml").unwrap();
        let like = like(&[names::GYRO_Z, names::TORQUE_LEFT, names::TORQUE_RIGHT]);
        let limits = Limits { speed_m_s: 0.8, acceleration_m_s2: 1.6, half_track_m: 0.2 };
        for course in &COURSES {
            let track = course.track(limits, 60.0);
            let inputs = of_track(&config, &track, &like, (Reference::None, false)).unwrap();
            let driven = replay(&config, &inputs, &Options::from(1)).unwrap();
            for (name, own) in [("speed_m_s", names::COMMAND_SPEED), ("yaw_rate_rad_s", names::COMMAND_YAW_RATE)] {
                let off = driven.truth.get(name).unwrap().iter().zip(inputs.get(own).unwrap());
                let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // torques are held over a step of (10 ms)/(2 s) of the slowest motion
                assert!(off < 1e-3, "{} {name}: {off}", course.name);
            }
        }
    }

    #[test]
    fn it_has_the_channels_and_the_reference_of_the_log() {
        let config = Config::parse(ROBOT, "robot.toml").unwrap();
        let limits = Limits { speed_m_s: 0.8, acceleration_m_s2: 1.6, half_track_m: 0.2 };
        let track = COURSES.iter().find(|c| c.name == "squares").unwrap().track(limits, 60.0);
        let blind = like(&[names::GYRO_Z, names::WHEEL_LEFT, names::WHEEL_RIGHT]);
        let log = of_track(&config, &track, &blind, (Reference::of(&blind), false)).unwrap();
        assert!(log.get(names::X).is_none() && log.get(names::TORQUE_LEFT).is_none());
        let marked = of_track(&config, &track, &blind, (Reference::Marks, true)).unwrap();
        let read = |name: &str| marked.get(name).unwrap().iter().filter(|v| v.is_finite()).count();
        assert_eq!([names::X, names::Y, names::HEADING].map(read), [track.marks_s.len(); 3]);
        assert!(has_torques(&marked));
        let mut posed = like(&[names::X, names::Y]);
        posed.channels[0].values.iter_mut().enumerate().for_each(|(k, x)| *x = if k % 5 == 0 { 0.0 } else { f64::NAN });
        assert_eq!(Reference::of(&posed), Reference::Every(5));
        assert!(
            of_track(&config, &track, &posed, (Reference::of(&posed), false)).unwrap().get(names::HEADING).is_none()
        );
    }
}
