//! wheel = v_wheel / r,   u = k i: wheel speeds and torques from logged speeds over ground and motor currents
//!
//! Robots log the speed over ground of a wheel, and the current of its motor. Division by the nominal radius recovers
//! the wheel speed, whatever the true radius is: the robot computed the speed from its encoder with the nominal one.
//! The torque constant turns the current into a torque at the wheel. Where nothing measures the wheels, their commanded
//! speeds are used.

use super::{Odometry, Rolling};
use crate::config::Vehicle;
use crate::signal::{Log, names};
use std::borrow::Cow;

/// Rows in which a wheel turns backwards without any current ever being negative, from which on currents are magnitudes.
const BACKWARD_ROWS: usize = 3;
/// Speeds beyond this part of the highest one are no noise about zero.
const BACKWARD_SHARE: f64 = 0.05;

/// `log` with wheel speeds where it has speeds over ground of both wheels, or commanded speeds and no measured ones;
/// and with torques where it has motor currents and `vehicle` states the constant. The sentences say which channels
/// were added, and why others were not. Existing channels stay.
#[must_use]
pub fn known_by<'a>(vehicle: &Vehicle, log: &'a Log) -> (Cow<'a, Log>, Vec<String>) {
    let mut notes = Vec::new();
    let mut made: Vec<(&str, Vec<f64>)> = Vec::new();
    let pair = |a: &str, b: &str| Some([log.get(a)?, log.get(b)?]);
    let lacks = |a: &str, b: &str| pair(a, b).is_none_or(|both| both.iter().any(|v| v.iter().all(|x| x.is_nan())));
    let wheels = [names::WHEEL_LEFT, names::WHEEL_RIGHT];
    let mut speeds = pair(wheels[0], wheels[1]);
    if lacks(wheels[0], wheels[1])
        && let Some(both) = pair(names::WHEEL_LEFT_SPEED, names::WHEEL_RIGHT_SPEED)
    {
        speeds = Some(both);
        made.extend(wheels.into_iter().zip(both.map(|v| v.iter().map(|v| v / vehicle.wheel_radius_m).collect())));
        notes.push(format!(
            "Wheel speeds are what their speeds over ground stand for, by the nominal radius of {} m.",
            vehicle.wheel_radius_m
        ));
    }
    let torques = [names::TORQUE_LEFT, names::TORQUE_RIGHT];
    if lacks(torques[0], torques[1])
        && let Some(currents) = pair(names::CURRENT_LEFT, names::CURRENT_RIGHT)
    {
        match vehicle.torque_constant_n_m_a {
            None => notes.push(
                "Motor currents are not used: [vehicle] torque_constant_n_m_a, the torque at the wheel of one ampere, makes \
                 torques of them."
                    .into(),
            ),
            Some(_) if speeds.is_some_and(|speeds| are_magnitudes(currents, speeds)) => notes.push(
                "Motor currents are not used: none is negative, and wheels turn backwards. They are magnitudes, which do not \
                 tell the direction of the torque."
                    .into(),
            ),
            Some(constant) => {
                made.extend(torques.into_iter().zip(currents.map(|i| i.iter().map(|i| constant * i).collect())));
                notes.push(format!("Torques are motor currents times {constant} N·m/A, at the wheel."));
            }
        }
    }
    if lacks(torques[0], torques[1])
        && !made.iter().any(|(name, _)| *name == torques[0])
        && let Some(commanded) = commanded(vehicle, log)
    {
        if drives(log) {
            notes.push(
                "Commanded speeds are not used beside measured ones: what a controller makes of them is not known. Without \
                 torques or motor currents, forces, masses and motors cannot be judged."
                    .into(),
            );
        } else {
            made.extend(wheels.into_iter().zip(commanded));
            notes.push(
                "Commanded speeds stand for the wheels', which nothing in the log measures. What is said of the wheels is said of \
                 them and of the control that drives them: its lag is theirs, and a wheel that falls short of its command looks \
                 like a smaller one. Forces, masses, motors and slip cannot be judged; log the wheels' speeds."
                    .into(),
            );
        }
    }
    if made.is_empty() {
        return (Cow::Borrowed(log), notes);
    }
    let mut out = log.clone();
    for (name, values) in made {
        // a channel of this name holds no numbers
        out.channels.retain(|c| c.name != name);
        out.channels.push(crate::signal::Channel { name: name.into(), values });
    }
    (Cow::Owned(out), notes)
}

/// Speeds that both wheels were commanded, rad/s: their own, or those that a speed and a yaw rate stand for.
fn commanded(vehicle: &Vehicle, log: &Log) -> Option<[Vec<f64>; 2]> {
    let pair = |a: &str, b: &str| Some([log.get(a)?, log.get(b)?]);
    if let Some(wheels) = pair(names::COMMAND_LEFT, names::COMMAND_RIGHT) {
        return Some(wheels.map(<[f64]>::to_vec));
    }
    let [speed, yaw_rate] = pair(names::COMMAND_SPEED, names::COMMAND_YAW_RATE)?;
    let wheel =
        |[by_speed, by_yaw]: [f64; 2]| speed.iter().zip(yaw_rate).map(|(v, w)| by_speed * v + by_yaw * w).collect();
    Some(Rolling::new(vehicle).wheel_by_motion().map(wheel))
}

/// Whether something in the log measures how the robot is driven: wheels, ticks, one of them, or an odometry.
fn drives(log: &Log) -> bool {
    let one =
        [names::WHEEL_LEFT, names::WHEEL_RIGHT, names::ODO_SPEED, names::WHEEL_LEFT_SPEED, names::WHEEL_RIGHT_SPEED];
    one.iter().any(|name| reads(log, name)) || Odometry::counts(log).is_some()
}

/// Fault and remedy of a log with the speed of one wheel alone; `None` for any other log.
#[must_use]
pub(crate) fn one_wheel(log: &Log) -> Option<(String, String)> {
    let sides = [
        [names::WHEEL_LEFT, names::WHEEL_LEFT_SPEED, names::WHEEL_LEFT_TICKS],
        [names::WHEEL_RIGHT, names::WHEEL_RIGHT_SPEED, names::WHEEL_RIGHT_TICKS],
    ];
    let (one, other) = match sides.map(|side| side.into_iter().find(|name| reads(log, name))) {
        [Some(left), None] => (left, left.replace("left", "right")),
        [None, Some(right)] => (right, right.replace("right", "left")),
        _ => return None,
    };
    let found = format!("one wheel only, {one}: one wheel does not tell turning from driving");
    Some((found, format!("name the column of the other: --map {other}=COLUMN[:UNIT], or add its file")))
}

/// Fault and remedy of a log with positions and neither gyro nor wheels; `None` for any other log.
#[must_use]
pub(crate) fn positions_only(log: &Log) -> Option<(String, String)> {
    let moves = [names::GYRO_Z, names::ODO_SPEED, names::TORQUE_LEFT, names::WHEEL_LEFT, names::WHEEL_LEFT_TICKS];
    (reads(log, names::X) && !moves.iter().any(|name| reads(log, name))).then(|| {
        let found = "positions only: nothing in the log says the same thing a second time";
        (found.into(), "add the files of gyro and wheels, or name their columns with --map".into())
    })
}

fn reads(log: &Log, name: &str) -> bool {
    log.get(name).is_some_and(|values| values.iter().any(|v| v.is_finite()))
}

/// Whether no current is negative although wheels turn backwards.
fn are_magnitudes(currents: [&[f64]; 2], speeds: [&[f64]; 2]) -> bool {
    let backward = |v: &[f64]| {
        let highest = v.iter().filter(|x| x.is_finite()).fold(0.0_f64, |m, x| m.max(x.abs()));
        v.iter().filter(|x| **x < -BACKWARD_SHARE * highest).count()
    };
    currents.iter().all(|i| i.iter().all(|x| x.is_nan() || *x >= 0.0))
        && speeds.iter().map(|v| backward(v)).sum::<usize>() >= BACKWARD_ROWS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::TimeAxis;

    fn robot(torque_constant_n_m_a: Option<f64>) -> Vehicle {
        Vehicle {
            mass_kg: 50.0,
            yaw_inertia_kg_m2: 6.0,
            half_track_m: 0.28,
            steering: None,
            wheel_radius_m: 0.165,
            wheel_inertia_kg_m2: 0.0,
            viscous_friction_n_m_s: 0.0,
            torque_noise_n_m_sqrt_s: 0.0,
            torque_constant_n_m_a,
            load_kg: 0.0,
        }
    }

    fn log(channels: &[(&str, &[f64])]) -> Log {
        let rows = channels[0].1.len();
        let mut log = Log::new("test", TimeAxis::Explicit((0..rows).map(|k| k as f64).collect()));
        channels.iter().for_each(|(name, values)| log.push(*name, values.to_vec()).unwrap());
        log
    }

    #[test]
    fn speeds_over_ground_and_currents_become_wheel_speeds_and_torques() {
        let log = log(&[
            (names::WHEEL_LEFT_SPEED, &[0.33, f64::NAN]),
            (names::WHEEL_RIGHT_SPEED, &[0.165, 0.0]),
            (names::CURRENT_LEFT, &[2.0, -1.0]),
            (names::CURRENT_RIGHT, &[f64::NAN, 3.0]),
        ]);
        let (known, notes) = known_by(&robot(Some(0.5)), &log);
        let close = |name: &str, k: usize, value: f64| (known.get(name).unwrap()[k] - value).abs() < 1e-15;
        assert!(close(names::WHEEL_LEFT, 0, 2.0) && close(names::WHEEL_RIGHT, 0, 1.0));
        assert!(close(names::TORQUE_LEFT, 1, -0.5) && close(names::TORQUE_RIGHT, 1, 1.5));
        assert!(
            known.get(names::WHEEL_LEFT).unwrap()[1].is_nan() && known.get(names::TORQUE_RIGHT).unwrap()[0].is_nan()
        );
        assert!(notes.len() == 2 && notes[0].contains("0.165 m") && notes[1].contains("0.5 N·m/A"), "{notes:?}");
        // again: nothing is left to be made
        let (again, notes) = known_by(&robot(Some(0.5)), &known);
        assert!(matches!(again, Cow::Borrowed(_)) && notes.is_empty(), "{notes:?}");
    }

    #[test]
    fn commands_stand_for_wheels_that_nothing_measures() {
        let commands: [(&str, &[f64]); 2] = [(names::COMMAND_SPEED, &[0.33]), (names::COMMAND_YAW_RATE, &[0.1])];
        let alone = log(&commands);
        let (known, notes) = known_by(&robot(None), &alone);
        assert!(notes.len() == 1 && notes[0].starts_with("Commanded speeds stand for"), "{notes:?}");
        let [left, right] = [names::WHEEL_LEFT, names::WHEEL_RIGHT].map(|name| known.get(name).unwrap()[0]);
        assert!((left - (0.33 - 0.028) / 0.165).abs() < 1e-12 && (right - (0.33 + 0.028) / 0.165).abs() < 1e-12);
        let wheels: [(&str, &[f64]); 2] = [(names::COMMAND_LEFT, &[1.0]), (names::COMMAND_RIGHT, &[2.0])];
        let both = log(&wheels);
        assert_eq!(known_by(&robot(None), &both).0.get(names::WHEEL_RIGHT), Some(&[2.0][..]));
        // measured wheels, and torques, come first
        for beside in [
            [(names::WHEEL_LEFT, &[7.0][..]), (names::WHEEL_RIGHT, &[7.0])],
            [(names::ODO_SPEED, &[7.0]), (names::ODO_YAW_RATE, &[0.0])],
        ] {
            let log = log(&[commands, beside].concat());
            let (known, notes) = known_by(&robot(None), &log);
            assert!(
                matches!(known, Cow::Borrowed(_)) && notes[0].contains("not used beside measured ones"),
                "{notes:?}"
            );
        }
        let torques: [(&str, &[f64]); 2] = [(names::TORQUE_LEFT, &[1.0]), (names::TORQUE_RIGHT, &[1.0])];
        assert_eq!(known_by(&robot(None), &log(&[torques, commands].concat())).1, [""; 0]);
    }

    #[test]
    fn one_wheel_and_positions_alone_are_told() {
        let x: (&str, &[f64]) = (names::X, &[0.0, 1.0]);
        let (found, hint) = one_wheel(&log(&[(names::WHEEL_RIGHT, &[1.0, 1.0]), x])).unwrap();
        assert!(found.contains("one wheel only") && hint.contains("wheel_left_rad_s=COLUMN"), "{found}; {hint}");
        let (found, _) = positions_only(&log(&[x])).unwrap();
        assert!(found.contains("positions only"), "{found}");
        assert_eq!(one_wheel(&log(&[x])), None);
        assert_eq!(positions_only(&log(&[x, (names::GYRO_Z, &[0.0, 0.0])])), None);
    }

    #[test]
    fn channels_that_are_there_stay() {
        let log = log(&[
            (names::WHEEL_LEFT, &[1.0]),
            (names::WHEEL_RIGHT, &[1.0]),
            (names::WHEEL_LEFT_SPEED, &[9.0]),
            (names::WHEEL_RIGHT_SPEED, &[9.0]),
        ]);
        assert!(matches!(known_by(&robot(None), &log), (Cow::Borrowed(_), notes) if notes.is_empty()));
    }

    #[test]
    fn currents_without_a_constant_or_a_sign_are_told_and_left() {
        let columns = |current: f64| {
            log(&[
                (names::WHEEL_LEFT, &[1.0, -1.0, -1.0, -1.0]),
                (names::WHEEL_RIGHT, &[1.0, 1.0, 1.0, 1.0]),
                (names::CURRENT_LEFT, &[2.0, current, current, current]),
                (names::CURRENT_RIGHT, &[2.0, 2.0, 2.0, 2.0]),
            ])
        };
        for (constant, current, said) in
            [(None, -2.0, "torque_constant_n_m_a"), (Some(0.5), 2.0, "magnitudes"), (Some(0.5), -2.0, "at the wheel")]
        {
            let log = columns(current);
            let (known, notes) = known_by(&robot(constant), &log);
            assert!(notes.len() == 1 && notes[0].contains(said), "{notes:?}");
            assert_eq!(known.get(names::TORQUE_LEFT).is_some(), said == "at the wheel");
        }
    }
}
