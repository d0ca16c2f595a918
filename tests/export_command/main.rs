//! `gyroid export` and the library's exports: every file is read back, and its numbers are held against the configuration by
//! the target's own equations.

mod command;
#[path = "../common/mod.rs"]
mod common;
mod effects;
mod embedded;

use common::{data, gyroid, run, warm_up_csv};
use gyroid::config::{Config, NoiseProvenance, Provenance, Validation};
use gyroid::export::{self, Export, Options, Origin, Source};
use gyroid::ingest::Axis;
use serde_json::Value;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};

/// The values of `full.toml`.
const N: f64 = 1.7e-4;
const K: f64 = 2.0e-5;
const C1: f64 = -2.4e-3;
const C2: f64 = 8.0e-3;
const T: f64 = 240.0;
const RATE_HZ: f64 = 200.0;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/exports").join(name)
}

fn full() -> Config {
    Config::read(fixture("full.toml")).unwrap()
}

fn bare() -> Config {
    Config::read(fixture("bare.toml")).unwrap()
}

fn origin() -> Origin {
    Origin {
        file: "gyroid.toml".into(),
        sha256: "0123abcd".into(),
        command: "gyroid export gyroid.toml --to x".into(),
        version: "9.9.9".into(),
    }
}

fn options() -> Options {
    Options { device_id: Some(3_407_882), ..Options::default() }
}

fn exported(config: &Config, id: &str, options: &Options) -> gyroid::Result<Export> {
    let origin = origin();
    export::export(export::by_id(id).unwrap(), &Source::new(config, &origin, options)?)
}

fn of(config: &Config, id: &str) -> Export {
    exported(config, id, &options()).unwrap()
}

/// The numbers of an assignment, whatever the language: `key: v`, `key = [v, v]`, `<key>v</key>`, `key,v`, `1\t1\tkey\tv\t9`.
/// Comments are cut first.
fn read_back(text: &str) -> BTreeMap<String, Vec<f64>> {
    let mut found = BTreeMap::new();
    let mut nesting: Vec<(usize, String)> = Vec::new();
    let text = without_xml_comments(text);
    for line in text.lines() {
        let line = line.split(['#', '%']).next().unwrap();
        let indent = line.len() - line.trim_start().len();
        let line = line.trim();
        nesting.retain(|(depth, _)| *depth < indent);
        if let Some(parent) = line.strip_suffix(':') {
            nesting.push((indent, parent.to_string()));
        }
        let path = |key: &str| nesting.iter().map(|n| n.1.as_str()).chain([key]).collect::<Vec<_>>().join("/");
        if line.contains('\t') {
            let cells: Vec<&str> = line.split('\t').collect();
            assert_eq!((cells.len(), cells[0], cells[1]), (5, "1", "1"), "{line}");
            found.insert(cells[2].to_string(), vec![cells[3].parse().unwrap()]);
            // MAV_PARAM_TYPE: 6 is a 32 bit integer, 9 a float
            assert_eq!(cells[4], if cells[3].parse::<i64>().is_ok() { "6" } else { "9" }, "{line}");
        } else if line.starts_with('<') {
            for part in line.split('<').filter(|p| !p.is_empty() && !p.starts_with('/')) {
                let (tag, value) = part.split_once('>').unwrap();
                let tag = tag.split(' ').next().unwrap();
                if let Ok(value) = value.parse::<f64>() {
                    // the axis that is not fitted comes first, and gives way
                    found.insert(tag.to_string(), vec![value]);
                }
            }
        } else if let Some((key, values)) = assignment(line) {
            found.insert(path(&key), values);
        }
    }
    found
}

fn without_xml_comments(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("<!--") {
        out.push_str(before);
        rest = after.split_once("-->").unwrap().1;
    }
    out + rest
}

fn assignment(line: &str) -> Option<(String, Vec<f64>)> {
    // Isaac Lab's keyword arguments: name=Class(mean=0.0, std=v, ...)
    if let Some((name, arguments)) = line.split_once("=GaussianNoiseCfg(") {
        let std = arguments.split("std=").nth(1)?.split(',').next()?;
        return Some((name.to_string(), vec![std.parse().ok()?]));
    }
    let at = line.find([':', '=', ','])?;
    let key = line[..at].trim().trim_matches('"').trim_start_matches("params.").to_string();
    let value = &line[at + 1..];
    let value = value.find('[').map_or(value, |open| &value[open + 1..value.rfind(']').unwrap_or(value.len())]);
    let value = value.split([';']).next()?;
    let numbers: Result<Vec<f64>, _> = value.split(',').map(|v| v.trim().parse::<f64>()).collect();
    Some((key, numbers.ok()?))
}

fn one(export: &Export, key: &str) -> f64 {
    let found = read_back(&export.text);
    let values = found.get(key).unwrap_or_else(|| panic!("{key} in {found:?}\n{}", export.text));
    assert_eq!(values.len(), 1, "{key}");
    values[0]
}

fn many(export: &Export, key: &str) -> Vec<f64> {
    read_back(&export.text).remove(key).unwrap_or_else(|| panic!("{key} in {}", export.text))
}

/// Equal to the nine digits that are written.
fn close(found: f64, wanted: f64) {
    assert!((found - wanted).abs() <= 0.51e-8 * wanted.abs(), "{found} is not {wanted}");
}

#[test]
fn continuous_densities_go_out_as_they_are() {
    for (id, density, walk) in [
        ("kalibr", "gyroscope_noise_density", "gyroscope_random_walk"),
        ("openvins", "imu0/gyroscope_noise_density", "imu0/gyroscope_random_walk"),
        ("orb-slam3", "IMU.NoiseGyro", "IMU.GyroWalk"),
        ("lio-sam", "lio_sam/imuGyrNoise", "lio_sam/imuGyrBiasN"),
        ("lio-sam-ros2", "/**/ros__parameters/imuGyrNoise", "/**/ros__parameters/imuGyrBiasN"),
    ] {
        let export = of(&full(), id);
        assert_eq!((one(&export, density), one(&export, walk)), (N, K), "{id}");
    }
    assert_eq!(one(&of(&full(), "kalibr"), "update_rate"), RATE_HZ);
    assert_eq!(one(&of(&full(), "openvins"), "imu0/update_rate"), RATE_HZ);
    assert_eq!(one(&of(&full(), "orb-slam3"), "IMU.Frequency"), RATE_HZ);
}

#[test]
fn gtsam_takes_squares() {
    let export = of(&full(), "gtsam");
    close(one(&export, "GYROSCOPE_COVARIANCE"), N * N);
    close(one(&export, "BIAS_OMEGA_COVARIANCE"), K * K);
}

#[test]
fn the_midpoint_rule_of_vins_adds_what_the_gyro_adds() {
    let export = of(&full(), "vins-fusion");
    let dt = 1.0 / RATE_HZ;
    let (gyr_n, gyr_w) = (one(&export, "gyr_n"), one(&export, "gyr_w"));
    // variance of rotation and bias after a second: n steps of integration_base.h
    close(RATE_HZ * 2.0 * (0.5 * dt * gyr_n).powi(2), N * N);
    close(RATE_HZ * (dt * gyr_w).powi(2), K * K);
    let at_100 = exported(&full(), "vins-fusion", &Options { rate_hz: Some(100.0), ..options() }).unwrap();
    close(one(&at_100, "gyr_n"), N * 200f64.sqrt());
    close(one(&at_100, "gyr_w"), K * 10.0);
}

#[test]
fn a_second_of_the_autopilots_covariance_prediction_adds_what_the_gyro_adds() {
    for (id, density, walk, dt) in
        [("px4", "EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE", 0.01), ("ardupilot", "EK3_GYRO_P_NSE", "EK3_GBIAS_P_NSE", 0.012)]
    {
        let export = of(&full(), id);
        let (p, b) = (one(&export, density), one(&export, walk));
        close((dt * p).powi(2) / dt, N * N);
        close((dt * b).powi(2) / dt, K * K);
        let slower = exported(&full(), id, &Options { step_s: Some(0.02), ..options() }).unwrap();
        close(one(&slower, density), N / 0.02f64.sqrt());
    }
    assert_eq!(one(&of(&full(), "px4"), "EKF2_GYR_NOISE"), 1.7e-3);
}

/// The fitted curve against the polynomials of both autopilots, over the log's temperatures.
#[test]
fn thermal_polynomials_repeat_the_fitted_curve() {
    let (k, m, t0) = (-1.5e-4, 2.0e-6, 12.0);
    let curve = |t: f64| k * (t - t0) + m * (t - t0) * (t - t0);
    let px4 = of(&full(), "px4");
    let (x0, x1, x2) = (one(&px4, "TC_G0_X0_2"), one(&px4, "TC_G0_X1_2"), one(&px4, "TC_G0_X2_2"));
    let reference = one(&px4, "TC_G0_TREF");
    assert_eq!((one(&px4, "TC_G_ENABLE"), one(&px4, "TC_G0_ID")), (1.0, 3_407_882.0));
    assert_eq!((one(&px4, "TC_G0_TMIN"), one(&px4, "TC_G0_TMAX"), one(&px4, "TC_G0_X3_2")), (12.0, 41.0, 0.0));
    let ardupilot = of(&full(), "ardupilot");
    let [g1, g2, g3] = ["GYR1", "GYR2", "GYR3"].map(|c| one(&ardupilot, &format!("INS_TCAL1_{c}_Z")));
    assert_eq!(one(&ardupilot, "INS_TCAL1_ENABLE"), 1.0);
    // AP_InertialSensor_tempcal.cpp, polynomial_eval
    let eval = |t: f64| {
        let d = t - 35.0;
        1e-6 * (g1 + (g2 + g3 * d) * d) * d
    };
    for t in [12.0, 20.5, 35.0, 41.0] {
        let d = t - reference;
        assert!((x0 + x1 * d + x2 * d * d - (C2 + curve(t))).abs() < 1e-12, "{t}");
        // offsets calibrated at 20 degC: only differences count
        assert!((eval(t) - eval(20.0) - (curve(t) - curve(20.0))).abs() < 1e-12, "{t}");
    }
    let matlab = of(&full(), "matlab");
    let slope = (curve(25.001) - curve(24.999)) / 0.002;
    assert!((many(&matlab, "TemperatureBias")[2] - slope).abs() < 1e-12);
    // counted from another temperature at power-on the same curve has another slope at 35 degC
    let warm = Options { power_on_temperature_c: Some(20.0), ..options() };
    close(one(&exported(&full(), "ardupilot", &warm).unwrap(), "INS_TCAL1_GYR1_Z"), 1e6 * (k + 2.0 * m * 15.0));
}

/// gz-sensors' recursion, without its noise, against e(t).
#[test]
fn gazebo_s_bias_repeats_the_warm_up() {
    let export = of(&full(), "gazebo");
    let (mean, tau) = (one(&export, "mean"), one(&export, "dynamic_bias_correlation_time"));
    assert!(one(&export, "dynamic_bias_stddev") > 0.0, "the bias stands still without it");
    let mut bias = one(&export, "bias_mean");
    let dt = 1.0 / one(&export, "update_rate");
    for step in 0..200_000 {
        let t = f64::from(step) * dt;
        let e = C1 * (1.0 - (-t / T).exp()) + C2;
        assert!((mean + bias - e).abs() < 1e-12, "{t}: {} is not {e}", mean + bias);
        bias *= (-dt / tau).exp();
    }
    close(one(&export, "stddev"), N * RATE_HZ.sqrt());
    close(one(&export, "bias_stddev"), 0.05 * C1.abs());
    assert_eq!((one(&export, "dynamic_bias_stddev"), one(&export, "precision")), (K, 5.0e-4));
    assert!(export.text.contains("gaussian_quantized"));
    // the axes that were not fitted come with white noise alone; the fitted one may be another
    let x = exported(&full(), "gazebo", &Options { axis: Some(Axis::X), ..options() }).unwrap();
    let body = without_xml_comments(&x.text);
    assert!(body.find("bias_mean").unwrap() < body.find("<y>").unwrap());
}

#[test]
fn without_a_walk_gazebo_s_bias_decays_and_hardly_walks() {
    let export = of(&bare(), "gazebo");
    let (sigma, tau) = (one(&export, "dynamic_bias_stddev"), one(&export, "dynamic_bias_correlation_time"));
    assert!(sigma > 0.0);
    // stationary standard deviation of dx = -x/tau dt + sigma dW
    close(sigma * (0.5 * tau).sqrt(), 1e-3 * C1.abs());
    assert!(export.notes.iter().any(|n| n.contains("only lets the bias decay")));
    assert!(!export.text.contains("gaussian_quantized"));
}

#[test]
fn rotors_has_the_gauss_markov_term() {
    let export = of(&full(), "rotors");
    let (walk, tau) = (one(&export, "gyroscopeRandomWalk"), one(&export, "gyroscopeBiasCorrelationTime"));
    assert_eq!(one(&export, "gyroscopeBiasRandomWalk"), walk);
    close(walk * (0.5 * tau).sqrt(), 6.0e-5);
    assert_eq!((one(&export, "gyroscopeNoiseDensity"), one(&export, "gyroscopeTurnOnBiasSigma")), (N, 3.0e-4));
    assert_eq!(tau, 1800.0);
    // without the term, K itself
    let mut config = full();
    config.gyro.as_mut().unwrap().noise.as_mut().unwrap().terms = None;
    assert_eq!(one(&of(&config, "rotors"), "gyroscopeBiasRandomWalk"), K);
}

#[test]
fn ros_takes_the_covariance_of_a_message() {
    let export = of(&full(), "ros2-control");
    let matrix = many(&export, "imu_sensor_broadcaster/ros__parameters/static_covariance_angular_velocity");
    assert_eq!(matrix.len(), 9);
    for (i, v) in matrix.iter().enumerate() {
        if i % 4 == 0 { close(*v, N * N * RATE_HZ) } else { assert_eq!(*v, 0.0) }
    }
    assert_eq!(one(&export, "diff_drive_controller/ros__parameters/wheel_separation"), 0.34);
    assert_eq!(one(&export, "diff_drive_controller/ros__parameters/wheel_radius"), 0.05);
    let without = of(&bare(), "ros2-control");
    assert!(!without.text.contains("diff_drive_controller:"));
    assert!(without.left_out.iter().any(|l| l.key.contains("wheel_radius") && l.hint.contains("--base")));
    let filter = of(&full(), "robot-localization");
    close(filter.written[0].values[0], N * N * RATE_HZ);
    assert!(filter.text.contains("angular_velocity_covariance[8] = 5.78e-06"), "{}", filter.text);
    // rows of three: position, orientation, velocity, rates, acceleration: the yaw rate is the twelfth
    let flags: Vec<&str> =
        filter.text.split("imu0_config: [").nth(1).unwrap().split(']').next().unwrap().split(',').collect();
    let fused: Vec<usize> = (0..flags.len()).filter(|i| flags[*i].trim() == "true").collect();
    assert_eq!((flags.len(), fused), (15, vec![11]));
    let roll = Options { axis: Some(Axis::X), ..options() };
    assert!(exported(&full(), "robot-localization", &roll).unwrap_err().to_string().contains("--axis z"));
}

#[test]
fn isaac_lab_draws_the_bias_anew_at_each_reset() {
    let export = exported(&full(), "isaac-lab", &Options { rate_hz: Some(50.0), ..options() }).unwrap();
    close(one(&export, "noise_cfg"), N * 50f64.sqrt());
    assert_eq!(one(&export, "bias_noise_cfg"), 3.0e-4);
    // "add" would pile up the biases of all resets
    assert!(export.text.lines().any(|l| l.contains("bias_noise_cfg=") && l.contains("operation=\"abs\"")));
    let without = of(&bare(), "isaac-lab");
    assert!(without.text.contains("= NoiseModelCfg(") && !without.text.contains("bias_noise_cfg="));
}

#[test]
fn matlab_s_sample_has_the_gyro_s_noise() {
    let export = of(&full(), "matlab");
    for (key, value) in [("NoiseDensity", N), ("RandomWalk", K), ("BiasInstability", 4.0e-5)] {
        assert_eq!(many(&export, key), [value; 3], "{key}");
    }
    assert_eq!(many(&export, "ConstantBias"), [0.0, 0.0, 5.6e-3]);
    assert_eq!(one(&export, "Resolution"), 5.0e-4);
    assert!(export.text.contains("params.NoiseType = 'single-sided';"));
    assert!(export.text.contains("* double_sided;") && export.text.contains("/ double_sided;"));
    let y = exported(&full(), "matlab", &Options { axis: Some(Axis::Y), ..options() }).unwrap();
    assert_eq!(many(&y, "ConstantBias"), [0.0, 5.6e-3, 0.0]);
}

#[test]
fn degrees_and_hours_are_converted() {
    let degrees = 180.0 / PI;
    let kf = of(&full(), "kf-gins");
    let arw = many(&kf, "imunoise/arw");
    let bias = many(&kf, "initgyrbias");
    for v in &arw {
        close(*v, N * degrees * 60.0);
    }
    close(bias[2], (C1 + C2) * degrees * 3600.0);
    assert_eq!(bias[..2], [0.0, 0.0]);
    close(many(&kf, "imunoise/gbstd")[0], 6.0e-5 * degrees * 3600.0);
    assert_eq!(one(&kf, "imunoise/corrtime"), 0.5);
    let sim = of(&full(), "gnss-ins-sim");
    assert_eq!(many(&sim, "gyro_arw"), arw);
    assert_eq!(many(&sim, "gyro_b"), bias);
    assert_eq!(many(&sim, "gyro_b_stability"), many(&kf, "imunoise/gbstd"));
    assert_eq!(many(&sim, "gyro_b_corr"), [1800.0; 3]);
}

/// What every target must do, whatever it is.
#[test]
fn every_target_passes_the_battery() {
    let mut ids = Vec::new();
    for target in export::registry() {
        let about = target.about();
        assert!(!ids.contains(&about.id), "{} twice", about.id);
        ids.push(about.id);
        assert!(about.keys.iter().all(|k| !k.name.is_empty() && !k.meaning.is_empty()), "{}", about.id);
        for (name, config) in [("full", full()), ("bare", bare())] {
            let export = of(&config, about.id);
            let place = format!("{} of {name}:\n{}", about.id, export.text);
            assert_eq!(export, of(&config, about.id), "the same bytes again: {place}");
            let commented = export.text.replace(['\n', '#', '%'], " ").replace("-->", " ").replace("<!--", " ");
            // a comment of XML parts double hyphens, and says so
            let comment = commented.split_whitespace().collect::<Vec<_>>().join(" ").replace("- -", "--");
            for part in ["sha256 0123abcd", "written by gyroid 9.9.9", "gyroid export gyroid.toml", "unsigned"] {
                assert!(comment.contains(part), "{part}: {place}");
            }
            for w in &export.written {
                let known = |k: &&gyroid::export::Key| w.key.starts_with(k.name);
                assert!(about.keys.iter().any(|k| known(&k)), "{} is not described: {place}", w.key);
                assert!(comment.contains(&format!("{}: {}", w.key, w.meaning)), "{} unexplained: {place}", w.key);
                assert!(w.unit.is_empty() || comment.contains(w.unit), "{} without unit: {place}", w.key);
                for v in &w.values {
                    let text = if v.fract() == 0.0 && w.unit.is_empty() { format!("{v}") } else { export::digits(*v) };
                    // firmware has all digits
                    let is_there = [&text, &format!("{v:e}")].iter().any(|text| export.text.contains(*text));
                    assert!(is_there, "{} = {text}: {place}", w.key);
                }
                if let Some([low, high]) = w.ci95 {
                    let value = w.values.iter().copied().find(|v| *v != 0.0).unwrap();
                    assert!(low <= value && value <= high, "{} outside its interval: {place}", w.key);
                }
            }
            for l in &export.left_out {
                let said = format!("left out: {}: {}. Hint: {}.", l.key, l.why, l.hint);
                let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
                assert!(comment.contains(&said), "{said}: {place}");
                assert!(!l.hint.is_empty() && !l.why.is_empty(), "{place}");
            }
            // what is left out is not written
            assert!(export.left_out.iter().all(|l| export.written.iter().all(|w| w.key != l.key)), "{place}");
        }
    }
    assert_eq!(ids.len(), 19);
}

#[test]
fn no_walk_is_left_out_with_the_mend_and_never_invented() {
    for (id, key) in [
        ("kalibr", "gyroscope_random_walk"),
        ("openvins", "gyroscope_random_walk"),
        ("orb-slam3", "IMU.GyroWalk"),
        ("vins-fusion", "gyr_w"),
        ("gtsam", "biasOmegaCovariance"),
        ("lio-sam", "imuGyrBiasN"),
        ("px4", "EKF2_GYR_B_NOISE"),
        ("ardupilot", "EK3_GBIAS_P_NSE"),
        ("rotors", "gyroscopeRandomWalk"),
        ("matlab", "RandomWalk"),
    ] {
        let export = of(&bare(), id);
        let left = export.left_out.iter().find(|l| l.key == key).unwrap_or_else(|| panic!("{id}: {key}"));
        assert!(left.hint.contains("gyroid noise"), "{}", left.hint);
        assert!(read_back(&export.text).keys().all(|k| !k.ends_with(key)), "{id}");
    }
    let kf = of(&bare(), "kf-gins");
    assert!(kf.left_out.iter().any(|l| l.key == "gbstd, corrtime") && !kf.text.contains("\n  gbstd:"));
}

#[test]
fn thermal_keys_need_a_curve_temperatures_and_a_device() {
    let left = |export: &Export, key: &str| {
        let found = export.left_out.iter().find(|l| l.key.contains(key)).unwrap_or_else(|| panic!("{key}"));
        format!("{} {}", found.why, found.hint)
    };
    assert!(left(&of(&bare(), "px4"), "TC_G0").contains("gyro.temperature_sensitivity"));
    let nameless = exported(&full(), "px4", &Options::default()).unwrap();
    assert!(left(&nameless, "TC_G0").contains("--device-id"));
    let mut config = full();
    let v = config.validation.as_mut().unwrap();
    v.valid_to_temperature_c = Some(20.0);
    assert!(left(&of(&config, "ardupilot"), "INS_TCAL1").contains("10 degC"));
    config.validation.as_mut().unwrap().valid_from_temperature_c = None;
    assert!(left(&of(&config, "ardupilot"), "INS_TCAL1").contains("temperature column"));
}

#[test]
fn walks_of_an_effect_and_of_the_gyro_add_their_variances() {
    let mut config = full();
    config.effects.push(gyroid::config::EffectTable {
        id: "gyro.rate_random_walk".into(),
        parameters: [("rate_random_walk_rad_s_sqrt_s".to_string(), 1.5e-5)].into(),
    });
    close(one(&of(&config, "kalibr"), "gyroscope_random_walk"), 2.5e-5);
}

#[test]
fn what_no_gyro_has_is_refused() {
    let mut silent = bare();
    silent.gyro.as_mut().unwrap().angle_random_walk_rad_sqrt_s = 0.0;
    for target in export::registry() {
        let error = exported(&silent, target.about().id, &options()).unwrap_err().to_string();
        assert!(error.contains("angle_random_walk_rad_sqrt_s") && error.contains("datasheet"), "{error}");
    }
    let mut timeless = bare();
    timeless.sample_time_s = None;
    let error = exported(&timeless, "vins-fusion", &options()).unwrap_err().to_string();
    assert!(error.contains("sample_time_s") && error.contains("--rate"), "{error}");
    let given = Options { rate_hz: Some(100.0), ..options() };
    close(one(&exported(&timeless, "vins-fusion", &given).unwrap(), "gyr_n"), N * 200f64.sqrt());
    // PX4 does not ask for the rate
    assert!(exported(&timeless, "px4", &options()).is_ok());
}

#[test]
fn a_model_that_failed_is_exported_only_if_accepted() {
    let mut config = full();
    let unfit: [fn(&mut Validation); 3] =
        [|v| v.white = false, |v| v.identifiable = false, |v| v.accepted_by_user = true];
    for spoil in unfit {
        config.validation = full().validation;
        spoil(config.validation.as_mut().unwrap());
        let error = exported(&config, "kalibr", &options()).unwrap_err().to_string();
        assert!(error.contains("not fit for use") && error.contains("--accept"), "{error}");
        let accepted = exported(&config, "kalibr", &Options { accept: true, ..options() }).unwrap();
        assert!(accepted.text.contains("NOT FIT FOR USE"), "{}", accepted.text);
    }
}

#[test]
fn nobody_s_file_name_becomes_a_line_of_its_own() {
    let mut config = full();
    config.provenance = Some(Provenance {
        log: "a.csv\n1\t1\tEVIL\t1\t9\nevil: 1 --> <evil>2</evil> */".into(),
        log_sha256: "ff\u{2028}00".into(),
        column: "gyro_y\r\nevil = 3".into(),
        gyroid_version: "0.1.0".into(),
        command: "gyroid fit 'x\ny'".into(),
        noise: Some(NoiseProvenance {
            log: "b\nevil: 4 --> <evil>5</evil>".into(),
            command: "gyroid noise b\nevil: 6".into(),
            ..NoiseProvenance::default()
        }),
        ..Provenance::default()
    });
    let options = Options { axis: Some(Axis::Z), ..options() };
    for target in export::registry() {
        let hostile = exported(&config, target.about().id, &options).unwrap();
        let harmless = exported(&full(), target.about().id, &options).unwrap();
        assert_eq!(read_back(&hostile.text), read_back(&harmless.text), "{}", hostile.text);
        assert!(hostile.text.contains("EVIL"), "it is still said");
    }
}
