use super::*;
use crate::config::EffectTable;
use crate::effects::Library;
use crate::effects::drive::ids;
use crate::math::random::Stream as Draw;
use crate::simulate::{Course, Options, drive_with};
use std::f64::consts::FRAC_PI_2;

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.01\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.002\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

pub(in crate::gap) fn robot() -> Config {
    Config::parse(ROBOT, "robot.toml").unwrap()
}

/// A drive at 100 Hz with all channels and these effects.
pub(in crate::gap) fn recorded<'a>(
    span_s: f64,
    seed: u64,
    effects: impl IntoIterator<Item = (&'a str, &'a str, f64)>,
) -> Log {
    let mut config = robot();
    let table =
        |(id, name, value): (&str, &str, f64)| EffectTable { id: id.into(), parameters: [(name.into(), value)].into() };
    config.effects.extend(effects.into_iter().map(table));
    drive_with(&config, Course::Brisk, span_s, &Options::from(seed), &Library::new()).unwrap().log
}

pub(in crate::gap::drive) fn without(mut log: Log, lost: &[&str]) -> Log {
    log.channels.retain(|c| !lost.contains(&c.name.as_str()));
    log
}

/// Channels of `log`, every so many rows, stamped late.
fn part(log: &Log, channels: &[&str], every: usize, late_s: f64) -> Part {
    let rows: Vec<usize> = (0..log.len()).step_by(every).collect();
    let at_s = rows.iter().map(|k| log.time.at(*k) + late_s).collect();
    let mut out = Log::new("part", TimeAxis::Explicit(at_s));
    for name in channels {
        out.push(*name, rows.iter().map(|k| log.get(name).unwrap()[*k]).collect()).unwrap();
    }
    Part { log: out, zero_s: 0.0, dated: false }
}

const WHEELS: [&str; 2] = [names::WHEEL_LEFT, names::WHEEL_RIGHT];

/// Gyro at 100 Hz and wheels at 6.7 Hz whose clock is late.
pub(in crate::gap::drive) fn two_files(log: &Log, late_s: f64) -> Log {
    merge(vec![part(log, &[names::GYRO_Z], 1, 0.0), part(log, &WHEELS, 15, late_s)]).unwrap().0
}

fn set<'a>(fit: &'a Log, hold: Option<&'a Log>) -> Clocks<'a> {
    let drive = |log| Drive::new(log, 0.0);
    agree(&robot(), &[drive(fit)], &hold.map(drive).into_iter().collect::<Vec<_>>()).unwrap()
}

fn shifted(log: &Log, channels: &[&str], rows: isize) -> Log {
    let mut out = log.clone();
    for c in out.channels.iter_mut().filter(|c| channels.contains(&c.name.as_str())) {
        let from = c.values.clone();
        for (k, value) in c.values.iter_mut().enumerate() {
            let at = usize::try_from(k as isize - rows).ok();
            *value = at.and_then(|at| from.get(at)).copied().unwrap_or(f64::NAN);
        }
    }
    out
}

/// Stamps that were made of a nominal rate while rows were lost: the wheels' clock loses half a second at each of two
/// times.
#[test]
fn a_clock_of_wheels_read_seldom_wanders_and_is_followed() {
    let log = recorded(150.0, 8, None);
    let late = |t: f64| 0.4 + 0.5 * f64::from(u8::from(t > 50.0)) + 0.5 * f64::from(u8::from(t > 100.0));
    let mut wheels = part(&log, &WHEELS, 15, 0.0);
    let at_s = wheels.log.time.to_vec().into_iter().map(|t| t + late(t)).collect();
    wheels.log.time = TimeAxis::Explicit(at_s);
    // in files of their own, their readings are put into the gyro's rows
    let both = merge(vec![part(&log, &[names::GYRO_Z], 1, 0.0), wheels]).unwrap().0;
    let clocks = set(&both, None);
    assert!(clocks.said[0].contains("wanders"), "{:?}", clocks.said);
    let truth = log.get(names::WHEEL_LEFT).unwrap();
    let left = clocks.fit[0].get(names::WHEEL_LEFT).unwrap();
    let near: Vec<bool> = (0..clocks.fit[0].len())
        .filter(|k| left[*k].is_finite())
        .map(|k| {
            let row = ((clocks.fit[0].time.at(k) - log.time.at(0)) / 0.01).round() as usize;
            truth[row.saturating_sub(15)..(row + 16).min(truth.len())].contains(&left[k])
        })
        .collect();
    // beside the jumps, which take a knot of four seconds either way, to a row of the wheels
    let right = near.iter().filter(|n| **n).count() as f64 / near.len() as f64;
    assert!(right > 1.0 - 2.0 * 8.0 / 150.0 - 0.05, "{right}");
}

#[test]
fn wheels_of_the_same_clock_read_seldom_do_not_wander() {
    for seed in 1..5 {
        let log = recorded(90.0, seed, None);
        let both = merge(vec![part(&log, &[names::GYRO_Z], 1, 0.0), part(&log, &WHEELS, 10, 0.0)]).unwrap().0;
        let clocks = set(&both, None);
        assert!(clocks.offsets.is_empty(), "{seed}: {:?}", clocks.notes);
    }
}

#[test]
fn clocks_of_two_files_are_found_and_set() {
    for (seed, late_s) in [(1, -3.2), (2, 0.35), (3, 12.0)] {
        // a track that is not what is believed moves nothing
        let log = recorded(90.0, seed, Some((ids::track_width(), "relative", 0.4)));
        let both = two_files(&log, late_s);
        let clocks = set(&both, None);
        let [offset] = &clocks.offsets[..] else { panic!("{late_s}: {:?}", clocks.offsets) };
        assert_eq!((offset.channel.as_str(), offset.recording.as_str()), ("wheels", "fit"));
        let off = offset.offset_s - late_s;
        assert!(off.abs() < 3.0 * offset.std_s && offset.std_s < 0.01, "{late_s}: {offset:?}");
        // wheels stand where they were read, to that
        let (times_s, left) = (&clocks.fit[0].time.to_vec(), clocks.fit[0].get(names::WHEEL_LEFT).unwrap());
        let truth = log.get(names::WHEEL_LEFT).unwrap();
        let read: Vec<(f64, f64)> =
            times_s.iter().copied().zip(left.iter().copied()).filter(|r| r.1.is_finite()).collect();
        assert!(read.len() > 400);
        for (t, value) in read {
            let row = ((t - log.time.at(0) + off) / 0.01).round() as usize;
            assert_eq!(truth[row], value);
        }
        // nothing is left in which one of them does not read
        assert!(set(&clocks.fit[0], None).offsets.is_empty());
        assert!(clocks.said[0].contains("set before anything was judged"), "{:?}", clocks.said);
    }
}

#[test]
fn errors_are_what_the_standard_deviations_say() {
    // z² of 30 runs is chi-squared: its mean lies within 1 ± 5 √(2/30)
    let z = |seed: u64| {
        let log = recorded(60.0, 100 + seed, None);
        let both = two_files(&log, -1.0);
        let found = set(&both, None).offsets.swap_remove(0);
        ((found.offset_s + 1.0) / found.std_s).powi(2)
    };
    let mean = (0..30u64).into_par_iter().map(z).sum::<f64>() / 30.0;
    assert!(mean < 1.0 + 5.0 * (2.0_f64 / 30.0).sqrt() && mean > 0.1, "{mean}");
}

#[test]
fn a_lag_that_is_alike_in_all_recordings_is_an_effect() {
    let logs = [1, 2].map(|seed| recorded(60.0, seed, None));
    let late = |a: f64, b: f64| [two_files(&logs[0], a), two_files(&logs[1], b)];
    let [fit, hold] = late(0.1, 0.1);
    assert_eq!(set(&fit, Some(&hold)).offsets, []);
    let [fit, hold] = late(0.1, 0.16);
    let offsets = set(&fit, Some(&hold)).offsets;
    assert_eq!(offsets.iter().map(|o| o.recording.as_str()).collect::<Vec<_>>(), ["fit", "hold"]);
    let [fit, hold] = late(0.3, 0.3);
    assert_eq!(set(&fit, Some(&hold)).offsets.len(), 2);
    // without anything late nothing is moved
    let clocks = set(&logs[0], Some(&logs[1]));
    assert!(clocks.offsets.is_empty() && matches!(clocks.fit[0], Cow::Borrowed(_)), "{:?}", clocks.offsets);
}

#[test]
fn a_gyro_that_is_late_against_all_others_is_an_effect_and_no_clock() {
    let log = recorded(60.0, 4, Some((ids::gyro_delay(), "delay_s", 0.09)));
    assert_eq!(set(&log, None).offsets, []);
    // wheels that are early against gyro, pose and torques are a clock
    let early = shifted(&recorded(60.0, 4, None), &WHEELS, -15);
    let offsets = set(&early, None).offsets;
    assert!(offsets.len() == 1 && (offsets[0].offset_s + 0.15).abs() < 3.0 * offsets[0].std_s + 0.005, "{offsets:?}");
}

/// Each side of a square looks like the one before it; the delay lies half-way between the shifts of the first look.
#[test]
fn a_late_gyro_is_an_effect_on_a_course_of_laps_and_a_clock_of_the_torques_is_still_found() {
    let mut config = robot();
    config.effects.push(EffectTable { id: ids::gyro_delay().into(), parameters: [("delay_s".into(), 0.025)].into() });
    let run = |seed| drive_with(&config, Course::Square, 200.0, &Options::from(seed), &Library::new()).unwrap().log;
    let logs = [29, 30].map(run);
    assert_eq!(set(&logs[0], Some(&logs[1])).offsets, []);
    let moved = shifted(&logs[0], &[names::TORQUE_LEFT, names::TORQUE_RIGHT], -80);
    let offsets = set(&moved, Some(&logs[1])).offsets;
    assert!(offsets.len() == 1 && offsets[0].channel == "torque", "{offsets:?}");
    assert!((offsets[0].offset_s + 0.8).abs() < 4.0 * offsets[0].std_s + 0.01, "{offsets:?}");
}

#[test]
fn clocks_of_pose_and_torques_are_found_in_rows_of_their_own_and_in_those_of_others() {
    let log = recorded(60.0, 5, None);
    let pose = [names::X, names::Y, names::HEADING];
    let torques = [names::TORQUE_LEFT, names::TORQUE_RIGHT];
    for (channels, id, rows) in [(&pose[..], "pose", 150), (&torques[..], "torque", -80)] {
        let moved = shifted(&log, channels, rows);
        let clocks = set(&moved, None);
        let [offset] = &clocks.offsets[..] else { panic!("{id}: {:?}", clocks.offsets) };
        let late_s = 0.01 * rows as f64;
        assert!(offset.channel == id && (offset.offset_s - late_s).abs() < 3.0 * offset.std_s, "{offset:?}");
        // by whole rows it is back where it was
        let back = clocks.fit[0].get(channels[0]).unwrap();
        let there = back.iter().zip(log.get(channels[0]).unwrap()).filter(|(a, _)| a.is_finite());
        assert!(there.clone().count() > 200 && there.clone().all(|(a, b)| a == b), "{id}");
    }
    // positions alone: by the way between them
    let moved = shifted(&without(log, &[names::HEADING]), &pose[..2], 150);
    let offsets = set(&moved, None).offsets;
    assert!(offsets.len() == 1 && offsets[0].channel == "pose", "{offsets:?}");
    assert!((offsets[0].offset_s - 1.5).abs() < 3.0 * offsets[0].std_s, "{offsets:?}");
}

#[test]
fn a_wheel_that_reads_backwards_is_refused_with_its_mend() {
    let log = recorded(60.0, 6, None);
    let turned = |name: &str| {
        let mut log = log.clone();
        log.channels.iter_mut().filter(|c| c.name == name).for_each(|c| c.values.iter_mut().for_each(|v| *v *= -1.0));
        log
    };
    let refused = |log: &Log| {
        let drive = Drive::new(log, 0.0);
        agree(&robot(), &[drive], &[]).err().map(|e| e.to_string())
    };
    for (name, words) in [
        (names::WHEEL_LEFT, "the left wheel reads backwards"),
        (names::WHEEL_RIGHT, "the right wheel reads backwards"),
        (names::GYRO_Z, "opposite ways"),
    ] {
        let text = refused(&turned(name)).unwrap();
        assert!(text.contains(words) && text.contains("=-COLUMN"), "{text}");
    }
    assert_eq!(refused(&log), None);
}

/// A robot that drives straight ahead and turns a little as one wheel is larger: the gyro follows the wheels' sum, a hundredth as far.
#[test]
fn a_robot_that_rolls_straight_has_no_wheel_that_reads_backwards() {
    let draw = &mut crate::math::random::Stream::new(3, 0);
    let times: Vec<f64> = (0..3000).map(|k| 0.02 * f64::from(k)).collect();
    let speed = |t: f64| 0.5 - 0.5 * (t * std::f64::consts::TAU / 60.0).cos();
    let robot = robot();
    let radius_m = robot.vehicle.unwrap().wheel_radius_m;
    let mut log = Log::new("straight", TimeAxis::Explicit(times.clone()));
    for name in WHEELS {
        log.push(name, times.iter().map(|t| speed(*t) / radius_m + 0.02 * draw.normal()).collect()).unwrap();
    }
    log.push(names::GYRO_Z, times.iter().map(|t| 0.01 * speed(*t) + 1e-3 * draw.normal()).collect()).unwrap();
    assert!(agree(&robot, &[Drive::new(&log, 0.0)], &[]).is_ok());
}

#[test]
fn what_stops_half_way_is_judged_where_all_is_there() {
    let log = recorded(60.0, 7, None);
    let mut stopped = log.clone();
    let wheels = stopped.channels.iter_mut().filter(|c| WHEELS.contains(&c.name.as_str()));
    wheels.for_each(|c| c.values[3500..].fill(f64::NAN));
    let clocks = set(&stopped, None);
    assert_eq!(clocks.fit[0].len(), 3500);
    assert!(clocks.notes.len() == 1 && clocks.notes[0].contains("judged where both do"), "{:?}", clocks.notes);
}

/// Lags that a gyro that is no more there would have are no wandering clock.
#[test]
fn a_clock_is_followed_no_further_than_the_gyro_reads() {
    for seed in 1..5 {
        let log = recorded(90.0, seed, None);
        let mut gyro = part(&log, &[names::GYRO_Z], 1, 0.0);
        let rows = log.len() / 2;
        let at_s = (0..rows).map(|k| log.time.at(k)).collect();
        let mut first_half = Log::new("part", TimeAxis::Explicit(at_s));
        first_half.push(names::GYRO_Z, log.get(names::GYRO_Z).unwrap()[..rows].to_vec()).unwrap();
        gyro.log = first_half;
        let both = merge(vec![gyro, part(&log, &WHEELS, 10, 0.0)]).unwrap().0;
        let clocks = set(&both, None);
        assert!(clocks.offsets.is_empty(), "{seed}: {:?}", clocks.notes);
    }
}

#[test]
fn rims_that_run_ahead_are_no_clock() {
    // wheels that spin lead the gyro by tens of milliseconds, in every run
    let logs = [5, 6].map(|seed| recorded(60.0, seed, Some((ids::slip(), "compliance", 1.0))));
    let clocks = set(&logs[0], Some(&logs[1]));
    assert!(clocks.offsets.is_empty() && clocks.lags().is_empty(), "{:?}", clocks.offsets);
    // a clock that is off by as much is one, and known to a part of a row
    let early = [11, 12].map(|seed| shifted(&recorded(60.0, seed, None), &WHEELS, -9));
    let clocks = set(&early[0], Some(&early[1]));
    assert_eq!(clocks.offsets.len(), 2, "{:?}", clocks.offsets);
    for o in &clocks.offsets {
        assert!((o.offset_s + 0.09).abs() < 4.0 * o.std_s + 0.01 && o.std_s < 0.005, "{o:?}");
    }
    // then the remaining lag of the wheels is named as no effect
    assert_eq!(clocks.lags(), [Instrument::Wheels, Instrument::Gyro]);
}

/// A robot stands for a second at each mark while its heading is read: within a stand no offset shows.
#[test]
fn readings_where_the_robot_stands_tell_an_offset_no_finer_than_the_stand() {
    let mut found = 0;
    for seed in 0..10 {
        let mut draw = Draw::new(seed, 0);
        let quarters: Vec<f64> = (0..120).map(|_| if draw.uniform() < 0.5 { 1.0 } else { -1.0 }).collect();
        // a turn of 4 s after each stand
        let rate = |k: usize| if k % 250 < 50 { 0.0 } else { quarters[k / 250] * FRAC_PI_2 / 4.0 };
        let (times_s, gyro): (Vec<f64>, Vec<f64>) =
            (0..250 * quarters.len()).map(|k| (0.02 * k as f64, rate(k) + 1e-3 * draw.normal())).unzip();
        let mut heading_rad = 0.0;
        let (marks_s, headings_rad) = quarters
            .iter()
            .enumerate()
            .map(|(i, sign)| {
                let read = (5.0 * i as f64 + 0.5, heading_rad + 4e-3 * draw.normal());
                heading_rad += sign * FRAC_PI_2;
                read
            })
            .unzip::<f64, f64, Vec<_>, Vec<_>>();
        let Some(lag) = lag(&Integral::nodes(marks_s, headings_rad), &[Integral::of(&times_s, &gyro)]) else {
            continue;
        };
        found += 1;
        assert!(lag.lag_s.abs() < 0.6 && lag.std_s > 0.2, "{lag:?}");
    }
    assert!(found >= 5, "{found}");
}
