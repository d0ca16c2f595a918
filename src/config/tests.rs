use super::*;
use crate::bias::{Discrete, Scheme, WarmUp};
use crate::traction::{Surface, TractionLaw};
use proptest::prelude::*;

fn sample() -> Config {
    let model = WarmUp { c1_rad_s: 2.9e-3, c2_rad_s: -4.7e-3, time_constant_s: 181.7 };
    Config {
        schema: SCHEMA,
        kind: Kind::Driving,
        sample_time_s: Some(0.01),
        gyro: Some(Gyro {
            c1_rad_s: model.c1_rad_s,
            c2_rad_s: model.c2_rad_s,
            time_constant_s: model.time_constant_s,
            angle_random_walk_rad_sqrt_s: 1.7e-4,
            earth_rate_rad_s: Some(5.1e-5),
            turn_on_bias_std_rad_s: Some(2e-4),
            warm_up_relative_std: Some(0.03),
            cooling_time_constant_s: Some(260.0),
            covariance: Some(Covariance::from_matrix(&[
                [4e-10, -1e-10, 2e-6],
                [-1e-10, 3e-10, 1e-7],
                [2e-6, 1e-7, 9.0],
            ])),
            discrete: Some(Discrete::new(&model, 0.01, Scheme::Exact).unwrap()),
            noise: Some(Noise {
                rate_random_walk_rad_s_sqrt_s: Some(1e-6),
                quantization_lsb_rad_s: None,
                bandwidth_cutoff_hz: Some(46.0),
                bandwidth_cutoff_ci95_hz: Some([43.5, 48.5]),
                bandwidth_form: None,
                narrow_band: Vec::new(),
                terms: Some(NoiseTerms {
                    rate_random_walk_rad_s_sqrt_s: Some(NoiseTerm { estimate: 1e-6, std: 2e-7, ci95: [7e-7, 1.5e-6] }),
                    rate_ramp_rad_s2: Some(NoiseTerm { estimate: -1e-9, std: 2e-10, ci95: [-1.4e-9, -6e-10] }),
                    gauss_markov_rad_s: Some(GaussMarkovTerm {
                        estimate: 6e-5,
                        std: 1e-5,
                        ci95: [4.5e-5, 9e-5],
                        correlation_time_s: 900.0,
                        correlation_time_ci95_s: Some([300.0, f64::INFINITY]),
                    }),
                    ..NoiseTerms::default()
                }),
            }),
            temperature: Some(Temperature {
                reference_c: 31.5,
                bias_rad_s: -3.3e-3,
                sensitivity_rad_s_k: 4.5e-5,
                curvature_rad_s_k2: Some(-2.5e-7),
                covariance: Some(TemperatureCovariance::from_matrix(&[
                    [6e-12, 1e-14, -2e-15],
                    [1e-14, 9e-14, 1e-16],
                    [-2e-15, 1e-16, 8e-16],
                ])),
            }),
            last_run: Some(LastRun { warm_up_age_s: 640.5 }),
        }),
        vehicle: Some(Vehicle {
            mass_kg: 17.1,
            yaw_inertia_kg_m2: 0.61,
            half_track_m: 0.24,
            steering: Some(Steering::Skid),
            wheel_radius_m: 0.066,
            wheel_inertia_kg_m2: 0.0011,
            viscous_friction_n_m_s: 0.0005,
            torque_noise_n_m_sqrt_s: 0.0002,
            torque_constant_n_m_a: None,
            load_kg: 0.0,
        }),
        traction: Some(Traction::new(TractionLaw::Burckhardt(Surface::Snow.law()))),
        encoder: Some(Encoder { speed_noise_std_rad_s: 0.0185, ticks_per_revolution: Some(4096.0) }),
        pose: None,
        effects: vec![EffectTable {
            id: "gyro.scale_factor".into(),
            parameters: [("relative".to_string(), 0.006)].into(),
        }],
        custom_effects: Vec::new(),
        validation: None,
        provenance: Some(Provenance {
            log: "log.csv".into(),
            log_sha256: "ab".into(),
            column: "gz".into(),
            gyroid_version: "0.1.0".into(),
            command: "gyroid fit log.csv".into(),
            checksum: String::new(),
            noise: Some(NoiseProvenance {
                log: "day.csv".into(),
                log_sha256: "cd".into(),
                column: "gz".into(),
                gyroid_version: "0.1.0".into(),
                command: "gyroid noise day.csv --write gyroid.toml".into(),
            }),
        }),
    }
}

#[test]
fn round_trip_loses_nothing() {
    let config = sample();
    let text = config.to_toml().unwrap();
    let mut back = Config::parse(&text, "x.toml").unwrap();
    assert_eq!(back.to_toml().unwrap(), text);
    back.provenance.as_mut().unwrap().checksum = String::new();
    assert_eq!(back, config);
}

#[test]
fn a_run_is_remembered_under_a_new_seal() {
    let before = Config::parse(&sample().to_toml().unwrap(), "x.toml").unwrap();
    let text = before.clone().after_run(912.25).unwrap().to_toml().unwrap();
    let after = Config::parse(&text, "x.toml").unwrap();
    assert!(after.is_signed());
    assert_eq!(after.gyro.unwrap().last_run, Some(LastRun { warm_up_age_s: 912.25 }));
    assert_ne!(after.provenance.unwrap().checksum, before.provenance.unwrap().checksum);
    assert!(Config::parse(&text.replace("912.25", "112.25"), "x.toml").is_err());
}

#[test]
fn every_changed_byte_is_refused() {
    let text = sample().to_toml().unwrap();
    for at in 0..text.len() {
        let mut bytes = text.clone().into_bytes();
        bytes[at] = if bytes[at] == b'7' { b'8' } else { b'7' };
        let changed = String::from_utf8(bytes).unwrap();
        let error = Config::parse(&changed, "x.toml").expect_err(&changed[at.saturating_sub(20)..]);
        assert!(error.to_string().starts_with("x.toml: "), "{error}");
    }
}

#[test]
fn every_truncation_that_loses_a_key_is_refused() {
    let text = sample().to_toml().unwrap();
    let last = text.trim_end().len();
    for end in (0..last).step_by(7) {
        // a cut that removes [provenance] whole leaves a valid unsigned file only if all required keys are there
        match Config::parse(&text[..end], "x.toml") {
            Err(_) => {}
            Ok(config) => assert!(!config.is_signed(), "cut at {end} passes as signed"),
        }
    }
}

#[test]
fn windows_line_ends_are_the_same_file() {
    let text = sample().to_toml().unwrap().replace('\n', "\r\n");
    assert!(Config::parse(&text, "x.toml").is_ok());
}

fn refused(change: impl Fn(&mut String), part: &str) {
    let mut config = sample();
    config.provenance = None;
    let mut text = config.to_toml().unwrap();
    change(&mut text);
    let error = Config::parse(&text, "x.toml").unwrap_err().to_string();
    assert!(error.contains(part), "{error} lacks {part}");
}

#[test]
fn what_is_wrong_is_named() {
    refused(|t| *t = t.replace("schema = 1", "schema = 2"), "schema 2");
    refused(|t| *t = t.replace("schema = 1\n", ""), "schema");
    refused(|t| *t = t.replace("mass_kg = 17.1\n", ""), "mass_kg");
    refused(|t| *t = t.replace("mass_kg = 17.1", "mass_lb = 17.1"), "mass_lb");
    refused(|t| *t = t.replace("mass_kg = 17.1", "mass_kg = -17.1"), "vehicle.mass_kg");
    refused(|t| *t = t.replace("time_constant_s = 181.7", "time_constant_s = 0.0"), "gyro.time_constant_s");
    refused(|t| *t = t.replace("c1_rad_s = 0.0029", "c1_rad_s = nan"), "gyro.c1_rad_s");
    refused(|t| *t = t.replace("c1_rad_s = 0.0029", "c1_rad_s = 1e300"), "gyro.c1_rad_s");
    refused(|t| *t = t.replace("initial = -0.0047", "initial = -0.0048"), "gyro.discrete.initial");
    refused(
        |t| *t = t.replace("c1_c1_rad2_s2 = 0.0000000004", "c1_c1_rad2_s2 = -1.0").replace("4e-10", "-1.0"),
        "gyro.covariance",
    );
    refused(|t| *t = t.replace("warm_up_age_s = 640.5", "warm_up_age_s = -1.0"), "gyro.last_run.warm_up_age_s");
    refused(|t| *t = t.replace("warm_up_age_s = 640.5", "warm_up_age_s = inf"), "gyro.last_run.warm_up_age_s");
    refused(|t| *t = t.replace("warm_up_age_s", "warm_up_age_min"), "warm_up_age_min");
    refused(|t| *t = t.replace("constant_s = 260.0", "constant_s = 0.0"), "gyro.cooling_time_constant_s");
    refused(|t| *t = t.replace("revolution = 4096.0", "revolution = 0"), "encoder.ticks_per_revolution");
    refused(|t| *t = t.replace("reference_c = 31.5", "reference_c = 315.0"), "gyro.temperature.reference_c");
    refused(|t| *t = t.replace("reference_c = 31.5", "reference_k = 304.6"), "reference_k");
    refused(|t| *t = t.replace("k = 0.000045", "k = inf").replace("k = 4.5e-5", "k = inf"), "sensitivity_rad_s_k");
    refused(|t| *t = t.replace("reference_c = 31.5\n", ""), "reference_c");
    refused(|t| *t = t.replace("curvature_rad2_s2_k4 = ", "curvature_rad2_s2_k4 = -"), "gyro.temperature.covariance");
    refused(|t| t.push_str("= broken"), "x.toml");
}

#[test]
fn a_hand_written_file_is_unsigned() {
    let text = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = 2e-3\n\
                time_constant_s = 300\nangle_random_walk_rad_sqrt_s = 1e-4\n";
    let config = Config::parse(text, "x.toml").unwrap();
    assert!(!config.is_signed());
    assert_eq!(config.require_gyro().unwrap().time_constant_s, 300.0);
}

proptest! {
    #[test]
    fn any_numbers_survive(c1 in -1.0..1.0f64, c2 in -1.0..1.0f64, t in 1e-3..1e7f64, ts in 1e-4..10.0f64) {
        let mut config = sample();
        let model = WarmUp { c1_rad_s: c1, c2_rad_s: c2, time_constant_s: t };
        let gyro = config.gyro.as_mut().unwrap();
        (gyro.c1_rad_s, gyro.c2_rad_s, gyro.time_constant_s) = (c1, c2, t);
        gyro.discrete = Some(Discrete::new(&model, ts, Scheme::BackwardEuler).unwrap());
        let back = Config::parse(&config.to_toml().unwrap(), "x").unwrap();
        prop_assert_eq!(back.gyro, config.gyro);
    }
}

#[test]
fn a_traction_table_is_read_with_its_defaults_and_checked_by_name() {
    let text = |law: &str| format!("schema = 1\n[traction.law.{law}\n");
    let config = Config::parse(&text("burckhardt]\nc1 = 0.1946\nc2 = 94.129\nc3 = 0.0646"), "x").unwrap();
    assert_eq!(config.traction, Some(Traction::new(TractionLaw::Burckhardt(Surface::Snow.law()))));
    for (law, part) in [
        ("burckhardt]\nc1 = -0.2\nc2 = 94.0\nc3 = 0.0", "traction.law.burckhardt.c1"),
        ("pacejka]\nb = 10.0\nc = 1.9\nd = 0.9\ne = 1.2", "traction.law.pacejka.e"),
        ("dugoff]\nfriction = 0.5", "stiffness"),
        ("lugre]\nfriction = 0.5", "lugre"),
    ] {
        let error = Config::parse(&text(law), "x").unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    let error = Config::parse(
        "schema = 1\n[traction]\nleft_load_share = 1.5\n[traction.law.linear]\nstiffness = 20.0\nfriction = 0.5\n",
        "x",
    );
    assert!(error.unwrap_err().to_string().contains("left_load_share"));
}

#[test]
fn all_missing_keys_are_said_at_once_with_guesses() {
    let text = "schema = 1\nkind = \"driving\"\n[vehicel]\nmass_kg = 9.5\n[encoder]\nspeed_noise = 0.02\n[gyro]\nc1_rad_s = 0.0\n\
                c2_rads = 0.0\n";
    let error = Config::parse(text, "robot.toml").unwrap_err().to_string();
    for part in [
        "robot.toml: 5 keys are missing: gyro.c2_rad_s, gyro.time_constant_s, gyro.angle_random_walk_rad_sqrt_s, \
         encoder.speed_noise_std_rad_s, [vehicle]",
        "3 keys are unknown: vehicel, gyro.c2_rads, encoder.speed_noise",
        "did you mean vehicle by vehicel, c2_rad_s by gyro.c2_rads, speed_noise_std_rad_s by encoder.speed_noise?",
        "gyroid init --kind driving",
    ] {
        assert!(error.contains(part), "{error} lacks {part}");
    }
    let rest = Config::parse("schema = 1\n[gyro]\nc1_rad_s = 0.0\n", "g.toml").unwrap_err().to_string();
    assert!(rest.contains("3 keys are missing: gyro.c2_rad_s") && rest.contains("--kind rest"), "{rest}");
}

/// The lists of keys agree with what the parser takes.
#[test]
fn the_lists_of_keys_are_those_of_the_tables() {
    let config = Config {
        pose: Some(Pose {
            rate_hz: 5.0,
            position_std_m: 0.1,
            heading_std_rad: 0.1,
            lever_arm_std_m: Some(0.1),
            heading_offset_std_rad: Some(0.1),
            delay_std_s: Some(0.1),
            correlation_time_s: Some(1.0),
        }),
        vehicle: sample().vehicle.map(|v| Vehicle { torque_constant_n_m_a: Some(0.1), ..v }),
        provenance: None,
        ..sample()
    };
    let full: toml::Table = config.to_toml().unwrap().parse().unwrap();
    for (title, key, needed) in keys::all() {
        let table = full[title].as_table().unwrap();
        assert!(table.contains_key(key) || (title, key) == ("gyro", "noise"), "{title}.{key}");
        let mut less = full.clone();
        less[title].as_table_mut().unwrap().remove(key);
        let read = Config::parse(&toml::to_string(&less).unwrap(), "x.toml");
        assert_eq!(read.is_err(), needed, "{title}.{key}: {read:?}");
        assert_eq!(less.try_into::<Config>().is_err(), needed, "{title}.{key}, by the parser alone");
    }
    for title in ["gyro", "vehicle", "traction", "encoder", "pose"] {
        for key in full[title].as_table().unwrap().keys() {
            assert!(keys::all().any(|(t, k, _)| t == title && k == key), "{title}.{key} is in no list");
        }
    }
}
