//! Logs that are read in one pass and not held give what logs in memory give.

use crate::common::{data, gyroid, run, warm_up_csv};
use gyroid::identify::terms::{NoiseModel, TermOptions, noise_model, noise_model_reduced};
use gyroid::identify::{Fit, FitOptions, fit, fit_reduced};
use gyroid::ingest::{GyroQuery, GyroRecording, Reading, StreamedRecording, read_gyro, read_gyro_within, write_log};
use gyroid::math::random::Stream;
use gyroid::noise::{Deviation, TermKind};
use gyroid::signal::{Limits, Log, Reduced, Reducer, TimeAxis, names};
use gyroid::validate::{self, Residuals};
use serde_json::Value;
use std::fs;
use std::path::Path;

const STEP_S: f64 = 0.01;
const ARW: f64 = 1e-4;

/// A gyro that warms up (C1 2e-3 rad/s, T 900 s) under white noise, angle noise and a random walk.
fn rates(samples: usize, quantization: f64, walk: f64, seed: u64) -> Vec<f64> {
    let (mut white, mut drawn, mut angle) = (Stream::new(seed, 0), Stream::new(seed, 1), Stream::new(seed, 2));
    let (mut bias, mut before) = (0.0, quantization * angle.normal());
    (0..samples)
        .map(|i| {
            bias += walk * STEP_S.sqrt() * drawn.normal();
            let now = quantization * angle.normal();
            let rounded = (now - std::mem::replace(&mut before, now)) / STEP_S;
            let warm = -2e-3 * (-(i as f64) * STEP_S / 900.0).exp_m1();
            -5e-3 + warm + bias + rounded + ARW / STEP_S.sqrt() * white.normal()
        })
        .collect()
}

fn streamed(path: &Path, memory_bytes: usize) -> StreamedRecording {
    match read_gyro_within(path, &GyroQuery::default(), memory_bytes, &mut |_| ()).unwrap() {
        Reading::Streamed(recording) => *recording,
        Reading::Whole(_) => panic!("{} was held", path.display()),
    }
}

/// Every parameter within `relative` of the other's.
fn agree(a: &Fit, b: &Fit, relative: f64) {
    let parts = |f: &Fit| [f.c1_rad_s, f.c2_rad_s, f.time_constant_s];
    for (a, b) in parts(a).iter().zip(parts(b)) {
        assert!((a.estimate / b.estimate - 1.0).abs() < relative, "{} {}", a.estimate, b.estimate);
        // the noise is seen on other groups of blocks: the root of a variance of 500 of them is known to 3 %
        assert!((a.std / b.std - 1.0).abs() < 0.12, "{} {}", a.std, b.std);
    }
    let (a, b) = (&a.noise, &b.noise);
    assert!((a.angle_random_walk_rad_sqrt_s / b.angle_random_walk_rad_sqrt_s - 1.0).abs() < 1e-6);
}

/// The same terms, each within the standard error that either of them states.
fn same_terms(a: &NoiseModel, b: &NoiseModel) {
    let ids = |m: &NoiseModel| m.terms.iter().map(|t| t.id).collect::<Vec<TermKind>>();
    assert_eq!(ids(a), ids(b));
    for (a, b) in a.terms.iter().zip(&b.terms) {
        assert!((a.estimate - b.estimate).abs() < a.std.min(b.std), "{:?}: {a:?} {b:?}", a.id);
    }
}

/// Deviations at the averaging times that both have, within half of their standard error.
fn same_deviations(a: &NoiseModel, b: &NoiseModel) {
    for ((kind, ours), (_, theirs)) in a.deviations.iter().zip(&b.deviations) {
        let mut shared = 0;
        for p in ours {
            let Some(q) = theirs.iter().find(|q| q.m == p.m) else { continue };
            shared += 1;
            let std = q.deviation_rad_s / (2.0 * q.degrees_of_freedom).sqrt();
            // means of few blocks are no means of many samples: the modified deviation is the one that notices
            let slack = if *kind == Deviation::Modified { 0.02 * q.deviation_rad_s } else { 0.0 };
            let off = (p.deviation_rad_s - q.deviation_rad_s).abs();
            assert!(off < 0.5 * std + slack, "{kind:?} at {}: {p:?} {q:?}", p.m);
        }
        assert!(shared > 10, "{kind:?}: {shared}");
    }
}

#[test]
fn two_million_samples_from_parquet_and_csv_give_the_same_both_ways() {
    const SAMPLES: usize = 2_000_000;
    let dir = tempfile::tempdir().unwrap();
    let mut log = Log::new("simulation", TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: SAMPLES });
    log.push(names::GYRO_Z, rates(SAMPLES, 0.0, 0.0, 1)).unwrap();
    for name in ["log.parquet", "log.csv"] {
        let path = dir.path().join(name);
        write_log(&path, &log).unwrap();
        let whole: GyroRecording = read_gyro(&path, &GyroQuery::default()).unwrap();
        let once = streamed(&path, 0);
        assert_eq!(once.log.samples(), SAMPLES);
        assert!(once.log.coarse.block > 1, "the log must be long enough to be reduced");
        let (ours, theirs) = (&once.audit, &whole.audit);
        assert_eq!((ours.rows, ours.samples), (theirs.rows, theirs.samples));
        assert!((ours.span_s / theirs.span_s - 1.0).abs() < 1e-9);
        assert_eq!((ours.gaps.count, ours.missing.count), (0, 0));
        assert_eq!((ours.stuck.runs, ours.motion.intervals.len()), (theirs.stuck.runs, theirs.motion.intervals.len()));
        assert!((ours.rest.noise_std_rad_s / theirs.rest.noise_std_rad_s - 1.0).abs() < 0.01);

        let (time, values) = (&whole.log.time, whole.log.require(names::GYRO_Z).unwrap());
        let in_memory = fit(time, values, &FitOptions::default()).unwrap();
        let in_one_pass = fit_reduced(&once.log, &FitOptions::default()).unwrap();
        agree(&in_one_pass, &in_memory, 1e-6);

        let residuals = in_memory.residuals(time, values);
        let options = validate::Options { draws: 99, ..validate::Options::default() };
        let known = validate::whiteness(time, &residuals, &in_memory.jacobian(time), &options);
        let left = Residuals::new(&once.log, &in_one_pass.model());
        let directions = in_one_pass.directions();
        type Direction<'a> = &'a (dyn Fn(f64) -> f64 + Sync);
        let directions: Vec<Direction> = directions.iter().map(|f| f as Direction).collect();
        let found = validate::whiteness_reduced(&left, &directions, &options);
        assert_eq!(found.levels.len(), known.levels.len());
        assert!((found.white, known.white) == (true, true), "{} {}", found.joint_p_value, known.joint_p_value);
        for (a, b) in found.levels.iter().zip(&known.levels) {
            assert!((a.averaging_time_s / b.averaging_time_s - 1.0).abs() < 0.01);
            // r_1 of nearly the same samples, or of all of them
            let off = a.whiteness.autocorrelation[1] - b.whiteness.autocorrelation[1];
            assert!(off.abs() < a.whiteness.autocorrelation_bound, "{off} at {}", a.averaging_time_s);
        }
        let variance = residuals.iter().map(|r| r * r).sum::<f64>() / SAMPLES as f64;
        assert!((left.variance / variance - 1.0).abs() < 1e-5, "{} {variance}", left.variance);
    }
}

/// What a pass keeps that may hold 2¹⁴ means and eight stretches of 2¹⁴ samples.
fn reduced(values: &[f64]) -> Reduced {
    let limits = Limits { blocks: 1 << 14, stretch: 1 << 14, stretches: 8 };
    let mut pass = Reducer::new(STEP_S, values[0], false, limits);
    values.iter().enumerate().for_each(|(i, v)| pass.push(i as f64 * STEP_S, *v, f64::NAN));
    pass.finish().unwrap()
}

#[test]
fn noise_terms_of_a_reduced_log_are_those_of_all_its_samples() {
    const SAMPLES: usize = 1 << 19;
    let time = TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: SAMPLES };
    let options = TermOptions { draws: 19, ..TermOptions::default() };
    for (quantization, walk) in [(0.0, 0.0), (0.0, 1e-5), (5e-6, 1e-5)] {
        let values = rates(SAMPLES, quantization, walk, 5);
        let log = reduced(&values);
        assert_eq!((log.coarse.block, log.stretches.len()), (32, 8));
        let whole = noise_model(&time, &values, None, &options).unwrap();
        let kept = noise_model_reduced(&log, &options).unwrap();
        assert_eq!(kept.samples, SAMPLES);
        // what is fast is known from a fourth of the samples: the error is twice that of all of them, and most of it is new
        let ids = |m: &NoiseModel| m.terms.iter().map(|t| t.id).collect::<Vec<TermKind>>();
        assert_eq!(ids(&kept), ids(&whole));
        for (a, b) in kept.terms.iter().zip(&whole.terms) {
            assert!((a.estimate - b.estimate).abs() < 3.0 * a.std.hypot(b.std), "{a:?} {b:?}");
            assert!(a.std < 3.0 * b.std && b.std < 1.1 * a.std, "{a:?} {b:?}");
            let truth = match a.id {
                TermKind::AngleRandomWalk => ARW,
                TermKind::RateRandomWalk => walk,
                TermKind::Quantization => quantization,
                other => panic!("{other:?} was not simulated"),
            };
            assert!((a.estimate - truth).abs() < 4.0 * a.std, "{a:?}: {truth}");
        }
        assert!(kept.goodness.p_value > 0.01, "{}", kept.goodness.p_value);
    }
}

#[test]
fn deviations_at_long_times_are_those_of_all_samples_taken_in_strides() {
    const SAMPLES: usize = 1 << 18;
    let values = rates(SAMPLES, 0.0, 1e-5, 3);
    let time = TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: SAMPLES };
    let options = TermOptions { draws: 19, ..TermOptions::default() };
    let limits = Limits { blocks: 1 << 16, stretch: 1 << 15, stretches: 8 };
    let mut pass = Reducer::new(STEP_S, values[0], false, limits);
    values.iter().enumerate().for_each(|(i, v)| pass.push(i as f64 * STEP_S, *v, f64::NAN));
    let log = pass.finish().unwrap();
    assert_eq!((log.coarse.block, log.stretches.len()), (4, 8));
    let whole = noise_model(&time, &values, None, &options).unwrap();
    let kept = noise_model_reduced(&log, &options).unwrap();
    same_terms(&kept, &whole);
    same_deviations(&kept, &whole);
}

#[test]
fn a_log_that_proves_too_large_is_read_on_in_one_pass() {
    let dir = tempfile::tempdir().unwrap();
    let (plain, packed) = (dir.path().join("log.csv"), dir.path().join("log.csv.gz"));
    let mut log = Log::new("simulation", TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: 200_000 });
    log.push(names::GYRO_Z, rates(200_000, 0.0, 0.0, 2)).unwrap();
    write_log(&plain, &log).unwrap();
    write_log(&packed, &log).unwrap();
    // a packed file does not tell its length: two columns of 150 000 rows are held before it is found too large
    let mut rows = Vec::new();
    let size = 2 * 8 * 150_000;
    let late = match read_gyro_within(&packed, &GyroQuery::default(), size, &mut |p| rows.push(p)).unwrap() {
        Reading::Streamed(recording) => *recording,
        Reading::Whole(_) => panic!("held"),
    };
    assert!(rows.iter().all(|p| p.of.is_none()) && rows.last().unwrap().rows == 200_000);
    let at_once = streamed(&plain, size);
    assert_eq!(late.log.stretches, at_once.log.stretches);
    assert_eq!(late.log.coarse, at_once.log.coarse);
    assert_eq!(late.audit, at_once.audit);
    assert!(matches!(
        read_gyro_within(&plain, &GyroQuery::default(), 4 * size, &mut |_| ()).unwrap(),
        Reading::Whole(_)
    ));
}

#[test]
fn what_is_wrong_with_a_log_is_found_on_the_way() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("log.csv");
    let values = rates(20_000, 0.0, 0.0, 4);
    let mut text = String::from("t_s,gyro_z_rad_s,temperature_c\n");
    for (i, v) in values.iter().enumerate() {
        let t = i as f64 * STEP_S + if i >= 12_000 { 3.0 } else { 0.0 };
        let v = if (5000..5040).contains(&i) { 0.125 } else { *v };
        let celsius = 20.0 + t / 10.0;
        text += &if i == 700 { format!("{t},,{celsius}\n") } else { format!("{t},{v},{celsius}\n") };
        if i == 900 {
            text += &format!("{t},{v},{celsius}\n");
        }
    }
    fs::write(&path, text).unwrap();
    let whole = read_gyro(&path, &GyroQuery::default()).unwrap();
    let once = streamed(&path, 0);
    let (ours, theirs) = (&once.audit, &whole.audit);
    assert_eq!((&ours.missing, &ours.duplicates), (&theirs.missing, &theirs.duplicates));
    assert_eq!((ours.missing.count, ours.missing.first_row, ours.duplicates.first_row), (1, Some(701), Some(902)));
    assert_eq!((ours.gaps.count, ours.gaps.longest_at_s), (theirs.gaps.count, theirs.gaps.longest_at_s));
    assert!((ours.gaps.missing_s - theirs.gaps.missing_s).abs() < 1e-6);
    assert_eq!((&ours.stuck, &ours.saturation), (&theirs.stuck, &theirs.saturation));
    let [low, high] = once.temperature_c.unwrap();
    assert!(low == 20.0 && (high - 40.299).abs() < 1e-9, "{low} {high}");
    assert!(once.log.coarse.temperature_c.is_some());
    assert_eq!(ours.rows, 20_001);
}

fn command(arguments: &[&str]) -> (i32, Value, String) {
    let (code, out, err) = run(gyroid().args(arguments));
    (code, serde_json::from_str(&out).unwrap_or(Value::Null), err)
}

#[test]
fn the_commands_say_the_same_of_a_small_log_either_way() {
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("log.csv");
    fs::write(&log, warm_up_csv(1, 4000)).unwrap();
    let (log, config) = (log.to_str().unwrap(), dir.path().join("gyro.toml"));
    let config = config.to_str().unwrap();
    let (code, held, err) = command(&["fit", log, "--json", "-", "-o", config]);
    assert_eq!(code, 0, "{err}");
    let again = dir.path().join("again.toml");
    let again = again.to_str().unwrap();
    let (code, once, err) = command(&["fit", log, "--json", "-", "--memory", "0", "-o", again]);
    assert_eq!(code, 0, "{err}");
    for key in ["c1_rad_s", "c2_rad_s", "time_constant_s"] {
        let of = |json: &Value| json["parameters"][key]["estimate"].as_f64().unwrap();
        assert!((of(&held) / of(&once) - 1.0).abs() < 1e-6, "{key}");
    }
    assert!(fs::metadata(dir.path().join("again.png")).unwrap().len() > 10_000);
    assert!(once["log"]["notes"].to_string().contains("one pass"), "{}", once["log"]);
    let number = |json: &Value, key: &str| json[key].as_f64().unwrap();
    let (_, held, _) = command(&["validate", config, log, "--json", "-"]);
    let (code, once, err) = command(&["validate", config, log, "--json", "-", "--memory", "0"]);
    assert_eq!((code, &held["explained"], &once["explained"]), (0, &Value::Bool(true), &Value::Bool(true)), "{err}");
    for key in ["offset_expected_std_rad_s", "residual_std_rad_s", "expected_std_rad_s"] {
        assert!((number(&held, key) / number(&once, key) - 1.0).abs() < 1e-6, "{key}");
    }
    let (_, held, _) = command(&["noise", log, "--json", "-", "--draws", "99"]);
    let (code, once, err) = command(&["noise", log, "--json", "-", "--draws", "99", "--memory", "0"]);
    assert_eq!(code, 0, "{err}");
    let n = |json: &Value| json["terms"][0]["estimate"].as_f64().unwrap();
    assert!((n(&held) / n(&once) - 1.0).abs() < 1e-6);
}

#[test]
fn work_keeps_to_the_memory_with_all_that_is_made_of_the_log() {
    // 40 000 times and rates are 0.64 MB, and seven times that with residuals, derivatives, transforms
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("log.csv");
    fs::write(&log, warm_up_csv(1, 40_000)).unwrap();
    let log = log.to_str().unwrap();
    let once = |arguments: &[&str]| {
        let (_, json, err) = command(arguments);
        let notes = json["log"]["notes"].to_string();
        assert!(!json.is_null(), "{err}");
        notes.contains("one pass")
    };
    for work in ["fit", "noise"] {
        assert!(once(&[work, log, "--json", "-", "--memory", "2"]));
        assert!(!once(&[work, log, "--json", "-", "--memory", "20"]));
        assert!(!once(&[work, log, "--json", "-", "--memory", "2", "--trim-motion"]));
    }
    assert!(!once(&["fit", log, "--json", "-", "--memory", "2", "--loss", "huber"]));
}

#[test]
fn the_real_recording_is_the_same_in_one_pass() {
    let path = data("cats_coldsoak_a.csv");
    for axis in ["x", "y", "z"] {
        let (code, held, err) = command(&["fit", path.to_str().unwrap(), "--axis", axis, "--json", "-"]);
        assert!(code == 0 || code == 3, "{err}");
        let (again, once, err) =
            command(&["fit", path.to_str().unwrap(), "--axis", axis, "--json", "-", "--memory", "0"]);
        assert_eq!(again, code, "{err}");
        for key in ["c1_rad_s", "c2_rad_s", "time_constant_s"] {
            let of = |json: &Value| json["parameters"][key]["estimate"].as_f64().unwrap();
            assert!((of(&held) / of(&once) - 1.0).abs() < 1e-6, "{axis} {key}");
        }
        assert_eq!(held["white"], once["white"]);
    }
}

#[test]
fn what_needs_all_samples_at_once_is_refused_with_the_way_out() {
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("log.csv");
    fs::write(&log, warm_up_csv(1, 400)).unwrap();
    let path = log.to_str().unwrap();
    for option in [&["--sort-time"][..], &["--trim-motion"], &["--loss", "huber"]] {
        let (code, _, err) = command(&[&["fit", path, "--memory", "0"], option].concat());
        assert_eq!(code, 2, "{option:?}: {err}");
        assert!(err.contains(option[0]) && err.contains("--memory"), "{err}");
    }
    let text = fs::read_to_string(&log).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    let back = [&rows[..300], &rows[200..]].concat().join("\n");
    fs::write(&log, back).unwrap();
    let (code, _, err) = command(&["fit", path, "--memory", "0"]);
    assert_eq!(code, 1);
    assert!(err.contains("row 300") && err.contains("time goes back by 49.5"), "{err}");
}
