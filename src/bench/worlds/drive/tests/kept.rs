//! Levels of noise, tracks of robots that skid, clocks, rates and decimals: labels say what is in the logs.

use super::*;
use crate::bench::worlds::drive::keep::{Keep, log};
use crate::bench::worlds::files::Files;
use crate::bench::worlds::habits::{Habits, Printed};
use crate::config::Steering;
use crate::signal::{Log, names};

#[test]
fn sensors_have_the_noise_of_their_label() {
    let (machine, run) = robot(4, 200.0);
    let clean = drive(&machine, &run, &World::nominal(), 0.0);
    let std = |x: &[f64]| (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt();
    for (id, seed) in [("gyro.noise_level", 1), ("encoder.noise_level", 2), ("pose.noise_level", 3)] {
        let effect = effect(id, &machine, seed);
        let (world, trace) = driven(&machine, &run, &effect, 0.5, 1.0);
        let label = effect.parameters(0.5, &run, &trace, &mut Stream::new(9, 4))["noise_over_nominal"];
        assert!((label.ln().abs() - 0.5).abs() < 0.05, "{id}: {label}");
        let found = match id {
            "gyro.noise_level" => std(&trace.gyro_noise),
            // the noise of the wheels drives the robot too: the reading less the speed itself
            "encoder.noise_level" => {
                let (r, b) = (machine.vehicle.wheel_radius_m, machine.vehicle.half_track_m);
                let noise = |k: usize| trace.wheel_rad_s[0][k] - (trace.v_m_s[k] - b * trace.w_rad_s[k]) / r;
                std(&(0..run.course.len()).map(noise).collect::<Vec<_>>()) / machine.wheel_std_rad_s
            }
            _ => {
                let quiet = drive(&machine, &run, &world, 0.0);
                let nominal = drive(&machine, &run, &World::nominal(), 1.0);
                let headings = trace.pose[2].iter().zip(&nominal.pose[2]).filter(|p| !p.0.is_nan());
                let differ: Vec<f64> = headings.map(|(a, b)| a - b).collect();
                assert_eq!(quiet.v_m_s, clean.v_m_s);
                1.0 + (label - 1.0).signum() * std(&differ) / machine.pose.heading_std_rad
            }
        };
        assert!((found / label - 1.0).abs() < 0.06, "{id}: {found} for {label}");
    }
}

#[test]
fn robots_that_skid_have_a_track_of_up_to_twice_the_nominal() {
    let mut widest = 0.0_f64;
    for seed in 0..6 {
        let (mut machine, run) = robot(seed, 60.0);
        machine.vehicle.steering = Some(Steering::Skid);
        let effect = effect("vehicle.track_width", &machine, seed);
        let large = effect.large.unwrap();
        widest = widest.max(large);
        let (_, trace) = driven(&machine, &run, &effect, large, 0.0);
        let label = effect.parameters(large, &run, &trace, &mut Stream::new(9, 4))["relative"];
        let (r, b) = (machine.vehicle.wheel_radius_m, machine.vehicle.half_track_m);
        let across = |k: usize| 0.5 * r / b * (trace.wheel_rad_s[1][k] - trace.wheel_rad_s[0][k]);
        let (cross, square) = (0..run.course.len())
            .map(|k| (trace.w_rad_s[k], across(k)))
            .fold((0.0, 0.0), |(c, q), (w, y)| (c + w * y, q + w * w));
        assert!((cross / square - 1.0 - label).abs() < 0.01 * label, "{} for {label}", cross / square - 1.0);
        assert!((label / large - 1.0).abs() < 0.05 && (0.1..=1.0).contains(&large));
        machine.vehicle.steering = Some(Steering::Differential);
        assert!(crate::bench::worlds::drive::tests::effect("vehicle.track_width", &machine, seed).large.is_none());
    }
    assert!(widest > 0.4, "{widest}");
}

/// The logs of run 0 and 1 as `habits` have them, and the labels of their clocks.
fn kept(habits: &Habits, lags: bool, has: Sensors) -> (Vec<Log>, Keep, Machine) {
    let (machine, run) = robot(7, 60.0);
    let has = Sensors { wheel_rows: habits.wheels_hz.map_or(1, |hz| (1.0 / (hz * machine.step_s)) as usize), ..has };
    let keep = Keep::new(habits, lags, has, machine.step_s);
    let trace = drive(&machine, &run, &World::nominal(), 1.0);
    let gyro = gyro_channel(&run, 0, &World::nominal(), &trace, &[], 5);
    let scene = Scene { machine: &machine, run: &run };
    let logs = (0..2).map(|r| log("x", r, scene, &World::nominal(), &trace, gyro.clone(), &keep).unwrap());
    (logs.collect(), keep, machine)
}

/// Times and values of a channel, where it has any.
fn series(log: &Log, name: &str) -> Vec<(f64, f64)> {
    let values = log.get(name).unwrap();
    (0..log.len()).filter(|k| !values[*k].is_nan()).map(|k| (log.time.at(k), values[k])).collect()
}

#[test]
fn clocks_are_off_by_what_the_label_says() {
    let offsets_s = [Some([-0.803, 1.204]), Some([0.5, -0.31])];
    let (plain, none, machine) = kept(&Habits::PLAIN, false, Sensors::ALL);
    assert!(none.labels().is_empty());
    let step_s = machine.step_s;
    for files in [Files::Parquet, Files::Apart] {
        let (logs, keep, _) = kept(&Habits { files, offsets_s, ..Habits::PLAIN }, false, Sensors::ALL);
        let labels = keep.labels();
        assert_eq!(labels.len(), 4);
        for label in labels {
            let r = usize::from(label.recording == "hold");
            let (channel, wanted) = match label.channel.as_str() {
                "wheels" => (names::WHEEL_LEFT, offsets_s[0]),
                _ => (names::HEADING, offsets_s[1]),
            };
            let wanted = wanted.unwrap()[r];
            let exact = if files == Files::Apart { 1e-12 } else { 0.5 * step_s + 1e-12 };
            assert!((label.offset_s - wanted).abs() <= exact, "{label:?}");
            let (before, after) = (series(&plain[r], channel), series(&logs[r], channel));
            assert!(after.len() < before.len(), "what lies before and after the recording is not in it");
            let last_s = plain[r].time.span_s();
            assert!(after.iter().all(|(t, _)| (-1e-9..=last_s + 1e-6).contains(t)));
            let skipped = before.iter().position(|b| b.1 == after[0].1 && b.0 + label.offset_s >= -1e-6).unwrap();
            for (a, b) in after.iter().zip(&before[skipped..]) {
                assert!((a.0 - b.0 - label.offset_s).abs() < 1e-6 && a.1 == b.1, "{a:?} {b:?}");
            }
            // stamps are told apart to a ten-millionth of a second
            let same = |a: &(f64, f64), b: &(f64, f64)| (a.0 - b.0).abs() < 1e-6 && a.1 == b.1;
            let [own, there] = [&logs[r], &plain[r]].map(|log| series(log, names::GYRO_Z));
            assert!(own.len() == there.len() && own.iter().zip(&there).all(|(a, b)| same(a, b)));
        }
    }
    let habits = Habits { offsets_s, ..Habits::PLAIN };
    assert!(kept(&habits, true, Sensors::ALL).1.labels().is_empty(), "beside a lag");
    let channels = |has| kept(&habits, false, has).1.labels().into_iter().map(|l| l.channel).collect::<BTreeSet<_>>();
    assert_eq!(channels(Sensors { gyro: false, ..Sensors::ALL }), ["pose".to_string()].into());
    assert_eq!(channels(Sensors { pose: false, ..Sensors::ALL }), ["wheels".to_string()].into());
}

#[test]
fn slow_wheels_and_decimals_are_as_asked_for() {
    let habits =
        Habits { files: Files::Apart, wheels_hz: Some(12.0), printed: Some(Printed::Degrees), ..Habits::PLAIN };
    let (logs, _, machine) = kept(&habits, false, Sensors::ALL);
    let (plain, ..) = kept(&Habits::PLAIN, false, Sensors::ALL);
    let wheels = series(&logs[0], names::WHEEL_RIGHT);
    let rate = (wheels.len() - 1) as f64 / (wheels[wheels.len() - 1].0 - wheels[0].0);
    assert!((10.0..=20.0).contains(&rate), "{rate} Hz");
    assert!(series(&logs[0], names::X) == series(&plain[0], names::X), "the pose has its own rate");
    for (name, noise) in
        [(names::GYRO_Z, machine.gyro.white_std_rad_s()), (names::WHEEL_RIGHT, machine.wheel_std_rad_s)]
    {
        let step = Printed::Degrees.step_rad_s(noise);
        assert!(step <= 0.1 * noise);
        for (_, v) in series(&logs[0], name) {
            assert!((v / step - (v / step).round()).abs() < 1e-5, "{name}: {v}");
        }
    }
    // wheels that are read seldom say less
    let run = draw_run(&machine, 60.0, 7, 0);
    let nats = |wheel_rows: usize| {
        let judge = Judge::new(Scene { machine: &machine, run: &run }, Sensors { wheel_rows, ..Sensors::ALL }, 5);
        judge.nats(&Present { effect: effect("wheel.radius_scale", &machine, 3), slot: 0, strength: 0.003 })
    };
    assert!(nats(8) < nats(1) && nats(8) > 0.02 * nats(1), "{} of {}", nats(8), nats(1));
}

#[test]
fn habits_leave_what_is_in_a_drive() {
    for index in 0..6 {
        let spec = Spec { effects: vec![("gyro.scale_factor", Strength::Medium)], messy: false };
        let [plain, other] =
            [0.0, 0.5].map(|habits| crate::bench::worlds::drive::make(23, index, &spec, habits).unwrap());
        assert!(plain.label.time_offsets.is_empty() && plain.kept_in == Files::Parquet);
        let stated = |case: &Case| case.config.vehicle.unwrap().steering;
        assert_eq!(stated(&plain), None);
        if other.kept_in != Files::Apart {
            assert_eq!(plain.label.effects, other.label.effects);
            assert_eq!(plain.fit.len(), other.fit.len());
        }
        let files: Vec<String> = other.files().unwrap().into_iter().map(|(name, _)| name).collect();
        assert_eq!(files.len() > 2, other.kept_in == Files::Apart, "{files:?}");
    }
}

#[test]
fn a_delay_that_healthy_stamps_may_have_tells_nothing() {
    let (machine, run) = robot(7, 60.0);
    let judge = Judge::new(Scene { machine: &machine, run: &run }, Sensors::ALL, 5);
    let nats = |rows: f64| {
        let strength = rows * machine.step_s;
        judge.nats(&Present { effect: effect("sensor.wheel_delay", &machine, 3), slot: 0, strength })
    };
    // one standard deviation is at most half a nat, however well it is measured, and six are at most eighteen
    assert!(nats(0.05) < 0.5 && nats(0.3) < 18.0 && nats(3.0) > 20.0, "{} {} {}", nats(0.05), nats(0.3), nats(3.0));
}

#[test]
fn logs_whose_wheels_are_read_seldom_have_no_torques() {
    let mut seldom = 0;
    for index in 0..12 {
        let spec = Spec { effects: vec![("gyro.scale_factor", Strength::Medium)], messy: false };
        let case = crate::bench::worlds::drive::make(29, index, &spec, 1.0).unwrap();
        let read = |name: &str| series(&case.fit, name).len();
        let is_seldom = 3 * read(names::WHEEL_LEFT) < 2 * read(names::GYRO_Z);
        seldom += usize::from(is_seldom);
        assert!(!is_seldom || case.fit.get(names::TORQUE_LEFT).is_none());
    }
    assert!(seldom > 2, "{seldom}");
}
