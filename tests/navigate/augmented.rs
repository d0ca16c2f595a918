//! The navigation filter with effects in its model: on drives that have the effect it knows how good it is, and errs less than
//! the nominal filter. Bounds come from chi-squared distributions, at one in a million.

use assert_cmd::Command;
use gyroid::ErrorKind;
use gyroid::config::{Config, EffectTable, Temperature};
use gyroid::effects::Library;
use gyroid::navigate::{Settings, Summary, WheelModel, run, run_with};
use gyroid::signal::{Log, names};
use gyroid::simulate::{Course, Options, drive, drive_with, replay_with};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const ROBOT: &str = include_str!("../common/robot.toml");
const RUNS: u64 = 6;
const SPAN_S: f64 = 60.0;

type Pairs<'a> = &'a [(&'a str, f64)];

fn config(effects: &[(&str, Pairs)]) -> Config {
    let mut config = Config::parse(ROBOT, "robot.toml").unwrap();
    let table = |(id, parameters): &(&str, Pairs)| EffectTable {
        id: (*id).to_string(),
        parameters: parameters.iter().map(|(name, value)| ((*name).to_string(), *value)).collect(),
    };
    config.effects = effects.iter().map(table).collect();
    config
}

fn options(seed: u64) -> Options {
    Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) }
}

fn augmented(config: &Config, log: &Log) -> Summary {
    run_with(config, log, &Settings::default(), &Library::new()).unwrap().summary
}

fn nominal(log: &Log) -> Summary {
    run(&config(&[]), log, &Settings::default()).unwrap().summary
}

/// Both filters over drives with `effects`, nominal first.
fn both(effects: &[(&str, Pairs)], course: Course) -> Vec<[Summary; 2]> {
    let config = config(effects);
    let one = |seed| {
        let log = drive_with(&config, course, SPAN_S, &options(seed), &Library::new()).unwrap().log;
        [nominal(&log), augmented(&config, &log)]
    };
    (1..=RUNS).into_par_iter().map(one).collect()
}

/// Where a sum of chi-squared variables lies but for one in a million.
fn interval(degrees: f64) -> [f64; 2] {
    let chi = ChiSquared::new(degrees).unwrap();
    [chi.inverse_cdf(5e-7), chi.inverse_cdf(1.0 - 5e-7)]
}

/// Readings, sum of their NIS, sum of the heading's NEES at the end, sums of squared position and heading errors.
fn sums(runs: &[[Summary; 2]], which: usize) -> [f64; 5] {
    runs.iter().map(|r| &r[which]).fold([0.0; 5], |sum, s| {
        let (c, r) = (&s.consistency, s.reference.as_ref().unwrap());
        let n = c.readings as f64;
        let heading = r.heading_rms_rad.unwrap();
        let one = [n, n * c.nis_mean, r.heading_nees_end.unwrap(), r.position_rms_m.powi(2), heading * heading];
        std::array::from_fn(|i| sum[i] + one[i])
    })
}

/// What is expected of an effect's filter.
#[derive(Clone, Copy, PartialEq)]
enum Expect {
    /// Consistent; position and heading better.
    Both,
    /// Consistent; the position better.
    Position,
    /// Consistent; the nominal filter is not.
    Noise,
}

#[track_caller]
fn check(effects: &[(&str, Pairs)], expect: Expect) {
    let runs = both(effects, Course::Brisk);
    let ids: Vec<_> = effects.iter().map(|e| e.0).collect();
    let what = ids.join(" + ");
    let (before, after) = (sums(&runs, 0), sums(&runs, 1));
    println!(
        "{what:<34} NIS {:7.3} {:6.4}  heading NEES {:9.2} {:6.2}  position {:6.4} {:6.4} m  heading {:6.4} {:6.4} rad",
        before[1] / before[0],
        after[1] / after[0],
        before[2] / RUNS as f64,
        after[2] / RUNS as f64,
        (before[3] / RUNS as f64).sqrt(),
        (after[3] / RUNS as f64).sqrt(),
        (before[4] / RUNS as f64).sqrt(),
        (after[4] / RUNS as f64).sqrt()
    );
    let [low, high] = interval(after[0]);
    assert!(after[1] > low && after[1] < high, "{what}: NIS {} of {low} .. {high}", after[1]);
    let [low, high] = interval(RUNS as f64);
    assert!(after[2] > low && after[2] < high, "{what}: heading NEES {} of {low} .. {high}", after[2]);
    if expect == Expect::Noise {
        assert!(before[1] > interval(before[0])[1], "{what}: the nominal filter is consistent, too");
        return;
    }
    assert!(after[3] < before[3], "{what}: position {} after {}", after[3], before[3]);
    if expect == Expect::Both {
        assert!(after[4] < before[4], "{what}: heading {} after {}", after[4], before[4]);
    }
}

#[test]
fn constants_of_the_robot() {
    check(&[("wheel.radius_scale", &[("relative", 0.02)])], Expect::Position);
    check(&[("wheel.radius_mismatch", &[("right_over_left_minus_one", 0.01)])], Expect::Both);
    check(&[("vehicle.track_width", &[("relative", 0.03)])], Expect::Both);
    check(&[("wheel.radius_left", &[("relative", -0.02)])], Expect::Both);
    check(&[("vehicle.payload", &[("mass_relative", 0.3), ("inertia_relative", 0.2)])], Expect::Position);
    check(&[("vehicle.com_offset", &[("offset_m", 0.06)])], Expect::Both);
    // gyro and wheels tell the turn that the torques do not: the pose hardly suffers, the claimed accuracy does
    check(&[("motor.torque_gain", &[("right_over_left_minus_one", 0.05)])], Expect::Noise);
}

#[test]
fn forces() {
    check(&[("ground.slope", &[("slope_rad", 0.03), ("uphill_heading_rad", 0.7)])], Expect::Position);
    check(&[("wheel.rolling_resistance", &[("coefficient", 0.02)])], Expect::Position);
}

#[test]
fn wheels_and_motion() {
    check(&[("wheel.lateral_skid", &[("lateral_slip_s", 0.08)])], Expect::Position);
    // finer than twice the noise a lattice adds white noise of lsb²/12 (Widrow and Kollár, chapter 4)
    check(&[("encoder.quantization", &[("lsb_rad_s", 0.036)])], Expect::Noise);
    check(&[("sensor.wheel_delay", &[("delay_s", 0.037)])], Expect::Noise);
}

#[test]
fn noise_that_is_larger_than_stated() {
    check(&[("gyro.noise_level", &[("noise_over_nominal", 2.2)])], Expect::Noise);
    check(&[("encoder.noise_level", &[("noise_over_nominal", 1.5)])], Expect::Noise);
}

/// The filter drives by wheels and gyro: what only the reference has is said, and changes nothing.
#[test]
fn a_late_reference_is_none_of_the_filters_business() {
    let log = drive(&config(&[]), Course::Brisk, SPAN_S, &options(4)).unwrap().log;
    let plain = run(&config(&[]), &log, &Settings::default()).unwrap();
    let late = config(&[("sensor.pose_delay", &[("delay_s", 0.05)])]);
    let found = run_with(&late, &log, &Settings::default(), &Library::new()).unwrap();
    assert!(found.summary.notes.iter().any(|n| n.contains("sensor.pose_delay")), "{:?}", found.summary.notes);
    let [a, b] = [&plain, &found].map(|r| r.pose.get(names::X).unwrap());
    let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6, "{off}");
}

#[test]
fn the_gyro_on_the_move() {
    check(&[("gyro.scale_factor", &[("relative", 0.02)])], Expect::Both);
    check(&[("gyro.scale_asymmetry", &[("relative", 0.03)])], Expect::Both);
    check(&[("gyro.vibration_rectification", &[("coefficient_rad_s_per_m2_s2", 0.01)])], Expect::Both);
    check(&[("gyro.bias_step", &[("step_rad_s", 0.01), ("time_s", 50.0)])], Expect::Both);
    check(&[("sensor.gyro_delay", &[("delay_s", 0.037)])], Expect::Both);
    check(&[("sensor.gyro_delay", &[("delay_s", 0.03)]), ("gyro.scale_factor", &[("relative", -0.02)])], Expect::Both);
}

#[test]
fn noise_of_a_gyro_at_rest_in_a_drive() {
    check(&[("gyro.rate_ramp", &[("ramp_rad_s2", 1e-4)])], Expect::Both);
    check(&[("gyro.second_time_constant", &[("c3_rad_s", 8e-3), ("time_constant_s", 20.0)])], Expect::Both);
    check(&[("gyro.turn_on_shift", &[("shift_rad_s", 5e-3)])], Expect::Both);
    check(&[("gyro.quantization", &[("lsb_rad_s", 3.4e-3)])], Expect::Noise);
    check(&[("gyro.rate_random_walk", &[("rate_random_walk_rad_s_sqrt_s", 2e-3)])], Expect::Both);
    check(&[("gyro.gauss_markov", &[("std_rad_s", 4e-3), ("correlation_time_s", 5.0)])], Expect::Both);
    check(&[("gyro.tone", &[("frequency_hz", 0.2), ("amplitude_rad_s", 0.01)])], Expect::Both);
    check(&[("gyro.bias_instability", &[("bias_instability_rad_s", 5e-4)])], Expect::Noise);
}

/// A sensor that switches has no Gaussian innovations while it is not clear which way it reads: NIS is then held against the
/// nominal filter's, and the heading's NEES against chi-squared.
#[test]
fn sensors_that_switch() {
    for (id, parameters, heading) in [
        ("encoder.missed_ticks", &[("loss_fraction", 0.4), ("right", 1.0), ("share_of_time", 0.05)] as Pairs, true),
        ("gyro.bias_step", &[("step_rad_s", 0.01)], true),
        ("gyro.telegraph_noise", &[("level_spacing_rad_s", 0.01), ("mean_dwell_s", 4.0)], true),
        ("gyro.outliers", &[("probability_per_sample", 0.01)], true),
        // what the law of traction leaves open is noise to the filter, and the simulated law leaves nothing open
        ("wheel.slip", &[("compliance", 0.3), ("cubic_compliance", 1.0)], false),
    ] {
        let runs = both(&[(id, parameters)], Course::Brisk);
        let (before, after) = (sums(&runs, 0), sums(&runs, 1));
        let nis = |s: &[f64; 5]| s[1] / s[0];
        println!(
            "{id:<34} NIS {:7.3} {:6.4}  heading NEES {:9.2} {:6.2}  position {:6.4} {:6.4}  heading {:6.4} {:6.4}",
            nis(&before),
            nis(&after),
            before[2] / RUNS as f64,
            after[2] / RUNS as f64,
            (before[3] / RUNS as f64).sqrt(),
            (after[3] / RUNS as f64).sqrt(),
            (before[4] / RUNS as f64).sqrt(),
            (after[4] / RUNS as f64).sqrt()
        );
        assert!(nis(&after) < interval(after[0])[1] / after[0], "{id}: {}", nis(&after));
        assert!(nis(&after).ln().abs() < nis(&before).ln().abs(), "{id}: {} after {}", nis(&after), nis(&before));
        assert!(after[2] < interval(RUNS as f64)[1], "{id}: heading NEES {}", after[2]);
        assert!(after[3] < before[3], "{id}: position {} after {}", after[3], before[3]);
        assert!(!heading || after[4] < before[4], "{id}: heading {} after {}", after[4], before[4]);
    }
}

#[test]
fn temperature_comes_from_the_log() {
    let effects: &[(&str, Pairs)] = &[
        ("gyro.temperature_sensitivity", &[("coefficient_rad_s_per_c", 1e-3)]),
        ("gyro.noise_growth", &[("relative_per_c", 0.1)]),
    ];
    let with = config(effects);
    let runs: Vec<_> = (1..=RUNS)
        .map(|seed| {
            let mut inputs = drive(&config(&[]), Course::Brisk, SPAN_S, &options(seed)).unwrap().log;
            let warming = |k| 20.0 + 8.0 * (1.0 - (-0.01 * k as f64 / 30.0).exp());
            inputs.push(names::TEMPERATURE, (0..inputs.len()).map(warming).collect()).unwrap();
            let mut log = replay_with(&with, &inputs, &options(seed + 100), &Library::new()).unwrap().log;
            let cold = run_with(&with, &log, &Settings::default(), &Library::new()).unwrap_err();
            assert!(cold.kind == ErrorKind::Config && cold.to_string().contains(names::TEMPERATURE), "{cold}");
            log.push(names::TEMPERATURE, inputs.get(names::TEMPERATURE).unwrap().to_vec()).unwrap();
            [nominal(&log), augmented(&with, &log)]
        })
        .collect();
    let (before, after) = (sums(&runs, 0), sums(&runs, 1));
    let [low, high] = interval(after[0]);
    assert!(after[1] > low && after[1] < high, "NIS {} of {low} .. {high}", after[1]);
    assert!(before[1] > high && after[4] < before[4]);
}

#[test]
fn effects_of_size_zero_leave_the_nominal_filter() {
    let log = drive(&config(&[]), Course::Brisk, SPAN_S, &options(3)).unwrap().log;
    let plain = run(&config(&[]), &log, &Settings::default()).unwrap();
    let null: [&[(&str, Pairs)]; 3] = [
        &[("gyro.scale_factor", &[("relative", 0.0)]), ("sensor.gyro_delay", &[("delay_s", 0.0)])],
        // states of correlated noise that is none
        &[("gyro.tone", &[("frequency_hz", 1.0), ("amplitude_rad_s", 0.0)])],
        // and switches that never switch
        &[("gyro.outliers", &[("probability_per_sample", 0.0)]), ("encoder.missed_ticks", &[("loss_fraction", 0.0)])],
    ];
    for effects in null {
        let found = run_with(&config(effects), &log, &Settings::default(), &Library::new()).unwrap();
        for channel in &plain.pose.channels {
            let other = found.pose.get(&channel.name).unwrap();
            let size = channel.values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
            let off = channel.values.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // chords over a standard deviation against derivatives: (heading's std)²/6 of a position's variance
            assert!(off < 1e-4 * size, "{effects:?} {}: {off} of {size}", channel.name);
        }
    }
}

#[test]
fn without_torques_forces_change_nothing_and_the_user_is_told() {
    let effects: &[(&str, Pairs)] =
        &[("vehicle.payload", &[("mass_relative", 0.3)]), ("wheel.radius_scale", &[("relative", 0.02)])];
    let with = config(effects);
    let mut log = drive_with(&with, Course::Brisk, SPAN_S, &options(5), &Library::new()).unwrap().log;
    log.channels.retain(|c| c.name != names::TORQUE_LEFT && c.name != names::TORQUE_RIGHT);
    let (before, after) = (nominal(&log), augmented(&with, &log));
    let said: Vec<_> = after.notes.iter().filter(|n| n.contains("no torques")).collect();
    assert!(said.len() == 1 && said[0].contains("vehicle.payload"), "{:?}", after.notes);
    let position = |s: &Summary| s.reference.as_ref().unwrap().position_rms_m;
    assert!(position(&after) < 0.5 * position(&before), "{} after {}", position(&after), position(&before));
    // without a gyro its effects are none
    log.channels.retain(|c| c.name != names::GYRO_Z);
    let found = augmented(&config(&[("gyro.scale_factor", &[("relative", 0.1)])]), &log);
    assert!(found.notes.iter().any(|n| n.contains("no gyro") && n.contains("gyro.scale_factor")), "{:?}", found.notes);
    assert!((position(&found) - position(&nominal(&log))).abs() < 1e-3);
    // and a gyro that goes by temperature asks for none
    let mut by_temperature = config(&[("gyro.scale_factor", &[("relative", 0.1)])]);
    by_temperature.gyro.as_mut().unwrap().temperature = Some(Temperature {
        reference_c: 30.0,
        bias_rad_s: -4.7e-3,
        sensitivity_rad_s_k: 4e-5,
        curvature_rad_s_k2: None,
        covariance: None,
    });
    assert_eq!(position(&augmented(&by_temperature, &log)), position(&found));
}

#[test]
fn what_the_filter_cannot_take_is_refused_by_name() {
    let log = drive(&config(&[]), Course::Square, 5.0, &options(1)).unwrap().log;
    let refused = |config: &Config, parts: &[&str]| {
        let error = run_with(config, &log, &Settings::default(), &Library::new()).unwrap_err();
        let text = error.to_string();
        assert!(error.kind == ErrorKind::Config && parts.iter().all(|p| text.contains(p)), "{text}");
    };
    refused(&config(&[("gyro.bandwidth", &[("cutoff_hz", 5.0)])]), &["gyro.bandwidth", "sensor.gyro_delay"]);
    refused(&config(&[("wheel.square", &[])]), &["wheel.square"]);
    refused(&config(&[("gyro.scale_factor", &[("relativ", 0.1)])]), &["relativ"]);
    let tone: (&str, Pairs) = ("gyro.tone", &[("frequency_hz", 1.0), ("amplitude_rad_s", 0.01)]);
    refused(&config(&[tone, tone, tone]), &["states"]);
    let slipping = format!("{ROBOT}[traction.law.burckhardt]\nc1 = 0.1946\nc2 = 94.129\nc3 = 0.0646\n");
    let mut slipping = Config::parse(&slipping, "robot.toml").unwrap();
    slipping.effects = config(&[("gyro.scale_factor", &[("relative", 0.1)])]).effects;
    refused(&slipping, &["[traction]", "--wheels rolling"]);
    let rolling = Settings { wheels: WheelModel::Rolling, ..Settings::default() };
    assert!(run_with(&slipping, &log, &rolling, &Library::new()).is_ok());
    // and the nominal filter takes none at all
    assert!(run(&slipping, &log, &rolling).unwrap_err().to_string().contains("gyro.scale_factor"));
}

#[test]
fn diagnosed_and_navigated_from_the_command_line() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("sim.toml"), ROBOT).unwrap();
    let real = format!("{ROBOT}[[effect]]\nid = \"gyro.scale_factor\"\nrelative = 0.012\n");
    std::fs::write(dir.path().join("real.toml"), real).unwrap();
    let ok = |line: &str| {
        let output =
            Command::cargo_bin("gyroid").unwrap().current_dir(dir.path()).args(line.split(' ')).output().unwrap();
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    // squares turn one way, so that the gain does not cancel
    for (name, course, seed) in [("fit", "random", 21), ("hold", "square", 22)] {
        ok(&format!("simulate real.toml --course {course} --duration 80 --seed {seed} -o {name}.parquet"));
    }
    let text =
        ok("gap diagnose sim.toml --fit fit.parquet --hold hold.parquet --json a.json --write-sim augmented.toml");
    assert!(text.contains("navigation filter errs there by"), "{text}");
    let text = ok("navigate augmented.toml hold.parquet --json n.json -o pose.parquet");
    assert!(
        text.contains("without the effects") && text.contains("in the filter's model: gyro.scale_factor"),
        "{text}"
    );
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(dir.path().join(name)).unwrap()).unwrap()
    };
    let (answer, navigated) = (read("a.json"), read("n.json"));
    let heading = |v: &serde_json::Value| v["reference"]["heading_rms_rad"].as_f64().unwrap();
    let (with, without) = (heading(&navigated["with_error_model"]), heading(&navigated["without_effects"]));
    assert!(with < 0.5 * without, "{with} {without}");
    let consistency = &navigated["with_error_model"]["consistency"];
    let number = |key: &str| consistency[key].as_f64().unwrap();
    let [low, high] = interval(number("readings"));
    let nis = number("readings") * number("nis_mean");
    assert!(nis > low && nis < high, "{consistency}");
    // the same filter, from the reference's first pose on
    let gain = &answer["navigation"];
    // which is known to 2 mrad
    let [before, after] = ["before", "after"].map(|key| gain[key]["heading_rms_rad"].as_f64().unwrap());
    assert!(after < before && (after - with).abs() < 0.004 && (before - without).abs() < 0.004, "{gain}");
    let position = |key: &str| gain[key]["position_rms_m"].as_f64().unwrap();
    assert!(position("after") < position("before"), "{gain}");
    assert!(gain["before"]["nis_mean"].as_f64().unwrap() > gain["after"]["nis_mean"].as_f64().unwrap());
}
