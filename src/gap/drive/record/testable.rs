//! A recording tests a model only where two of its channels are redundant, in speed or in yaw rate. Channels that tell
//! each:
//!
//! | | speed | yaw rate |
//! |---|---|---|
//! | gyro | | 1 |
//! | speeds of both wheels, or an odometry's speed and yaw rate | 1 | 1 |
//! | one speed, or one wheel | 1 | |
//! | torques of both wheels | 1 | 1 |
//! | positions | 1 | 1 |

use crate::config::Config;
use crate::gap::answer::{Answer, Verdict, compose};
use crate::gap::diagnosis::{Diagnosis, Drive};
use crate::gap::drive::options::Options;
use crate::gap::selection::findings::Findings;
use crate::gap::selection::sets::WeightedSet;
use crate::gap::trace;
use crate::signal::{Log, names};
use crate::vehicle::Odometry;

/// Channels as a note names them.
const BOTH: &str = "the speeds of both wheels";
const ODOMETRY: &str = "one speed and one yaw rate, which stand for the wheels";
const GYRO: &str = "a gyro";
const TORQUES: &str = "torques";
const POSITIONS: &str = "positions";

/// Channels of a log, and the numbers of those that tell speed and yaw rate.
struct Said {
    channels: Vec<&'static str>,
    speeds: usize,
    yaw_rates: usize,
}

impl Said {
    fn of(log: &Log) -> Self {
        let has = |name: &str| log.get(name).is_some_and(|v| v.iter().any(|v| v.is_finite()));
        let both = |a: &str, b: &str| has(a) && has(b);
        let one_wheel = has(names::WHEEL_LEFT) || has(names::WHEEL_RIGHT);
        let wheels = both(names::WHEEL_LEFT, names::WHEEL_RIGHT) || Odometry::counts(log).is_some();
        let odometry = both(names::ODO_SPEED, names::ODO_YAW_RATE);
        let told = wheels || odometry;
        let channels = [
            (BOTH, wheels, 1, 1),
            (ODOMETRY, !wheels && odometry, 1, 1),
            ("one wheel", !told && one_wheel, 1, 0),
            ("one speed", !told && !one_wheel && has(names::ODO_SPEED), 1, 0),
            (GYRO, has(names::GYRO_Z), 0, 1),
            (TORQUES, both(names::TORQUE_LEFT, names::TORQUE_RIGHT), 1, 1),
            (POSITIONS, both(names::X, names::Y), 1, 1),
        ];
        let there = channels.iter().filter(|c| c.1);
        Self {
            channels: there.clone().map(|c| c.0).collect(),
            speeds: there.clone().map(|c| c.2).sum(),
            yaw_rates: there.map(|c| c.3).sum(),
        }
    }
}

/// The diagnosis of recordings without redundant channels; none where a recording has some, or no channel at all.
pub(crate) fn nothing_twice(config: &Config, fit: &[Drive<'_>], options: &Options) -> Option<Diagnosis> {
    let said: Vec<Said> = fit.iter().map(|d| Said::of(d.log)).collect();
    let tests = |s: &Said| s.speeds > 1 || s.yaw_rates > 1 || s.channels.is_empty();
    if said.is_empty() || said.iter().any(tests) {
        return None;
    }
    let none = WeightedSet { parts: Vec::new(), ln_weight: 0.0, probability: 1.0 };
    let findings = Findings::new(vec![none], &options.prior, &options.calibration, Vec::new());
    let there = &said[0].channels;
    let more: Vec<&str> = [
        ("the wheel speeds of both sides", BOTH),
        ("a gyro", GYRO),
        ("the wheels' torques or motor currents", TORQUES),
        ("positions of an external reference (GPS, motion capture)", POSITIONS),
    ]
    .into_iter()
    // an odometry's speed and yaw rate stand for the wheels
    .filter(|(_, channel)| !(there.contains(channel) || *channel == BOTH && there.contains(&ODOMETRY)))
    .map(|(what, _)| what)
    .collect();
    let notes = vec![
        format!(
            "The log holds {}: no two of its channels say how fast the robot drives, and no two how fast it turns. Any \
             recording agrees with the simulator then.",
            there.join(" and ")
        ),
        format!("To be tested it needs one more of: {}.", more.join("; ")),
    ];
    let answer = Answer {
        verdict: Verdict::CannotTell,
        main: None,
        main_probability: 0.0,
        none_probability: 0.0,
        unknown_probability: 0.0,
        trace: trace::of_notes(&notes).collect(),
        notes,
        ..compose::answer(&findings, |_| None)
    };
    Some(Diagnosis { answer, augmented: config.clone(), findings, far: None, prepared: None, traces: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot};

    #[test]
    fn a_recording_tests_where_two_channels_say_the_same() {
        let log = recorded(10.0, 1, None);
        let verdict = |kept: &[&str], speed: bool| {
            let mut log = log.clone();
            if speed {
                log.push(names::ODO_SPEED, vec![0.5; log.len()]).unwrap();
            }
            log.channels.retain(|c| kept.contains(&c.name.as_str()) || c.name == names::ODO_SPEED);
            let drive = Drive::new(&log, 0.0);
            nothing_twice(&robot(), &[drive], &Options::default()).map(|d| d.answer)
        };
        let (gyro, wheels) = ([names::GYRO_Z], [names::WHEEL_LEFT, names::WHEEL_RIGHT]);
        let (torques, places) = ([names::TORQUE_LEFT, names::TORQUE_RIGHT], [names::X, names::Y]);
        for (kept, speed) in [(&gyro[..], false), (&wheels, false), (&gyro, true), (&places, false), (&torques, false)]
        {
            let answer = verdict(kept, speed).unwrap();
            assert_eq!((answer.verdict, answer.main), (Verdict::CannotTell, None), "{kept:?}");
            // what is to be added is not there already
            for (channel, more) in [(torques[0], "torques"), (places[0], "positions"), (wheels[0], "both sides")] {
                assert_eq!(answer.notes[1].contains(more), !kept.contains(&channel), "{:?}", answer.notes);
            }
        }
        let mut odometry = log.clone();
        odometry.channels.clear();
        for name in [names::ODO_SPEED, names::ODO_YAW_RATE] {
            odometry.push(name, vec![0.5; log.len()]).unwrap();
        }
        let drive = Drive::new(&odometry, 0.0);
        let notes = nothing_twice(&robot(), &[drive], &Options::default()).unwrap().answer.notes;
        assert!(notes[0].contains("holds one speed and one yaw rate") && !notes[1].contains("both sides"), "{notes:?}");
        for (kept, speed) in [
            ([&gyro[..], &wheels].concat(), false),
            ([&wheels[..], &torques].concat(), false),
            ([&gyro[..], &torques].concat(), false),
            (places.to_vec(), true),
        ] {
            assert!(verdict(&kept, speed).is_none(), "{kept:?}");
        }
        // a log without any channel is refused where its rows are read
        assert!(verdict(&[], false).is_none());
    }
}
