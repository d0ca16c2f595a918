//! What `[[effect]]` tables change of an export, and what they hold that no key stands for.

use super::{bare, close, exported, full, many, of, one, options};
use gyroid::config::{Config, EffectTable};
use gyroid::export::{Options, registry};

fn table(id: &str, parameters: &[(&str, f64)]) -> EffectTable {
    EffectTable {
        id: id.into(),
        parameters: parameters.iter().map(|(name, value)| ((*name).to_string(), *value)).collect(),
    }
}

#[test]
fn no_target_drops_an_effect_without_a_word() {
    const ID: &str = "gyro.temperature_sensitivity";
    for target in registry() {
        let target = target.about().id;
        let mut config = full();
        config.effects.clear();
        let with_device = Options { device_id: Some(1), ..options() };
        let without = exported(&config, target, &with_device).unwrap();
        config.effects = vec![table(ID, &[("coefficient_rad_s_per_c", 1e-5)])];
        let with = exported(&config, target, &with_device).unwrap();
        let said =
            with.notes.iter().any(|n| n.contains(ID)) || with.left_out.iter().any(|l| l.why.contains("temperature"));
        assert!(said || with.written.len() > without.written.len(), "{target}: {}", with.text);
    }
}

#[test]
fn ros_takes_what_effects_make_of_the_geometry() {
    let mut config = full();
    config.effects = vec![
        table("vehicle.track_width", &[("relative", 0.5)]),
        table("wheel.radius_left", &[("relative", -0.03)]),
        table("vehicle.payload", &[("mass_relative", 0.2)]),
    ];
    let export = of(&config, "ros2-control");
    let key = |name: &str| one(&export, &format!("diff_drive_controller/ros__parameters/{name}"));
    for (name, value) in [
        ("wheel_separation", 0.34),
        ("wheel_separation_multiplier", 1.5),
        ("left_wheel_radius_multiplier", 0.97),
        ("right_wheel_radius_multiplier", 1.0),
    ] {
        close(key(name), value);
    }
    assert!(export.notes.iter().any(|n| n.contains("vehicle.payload left out")), "{:?}", export.notes);
}

#[test]
fn what_effects_change_goes_out_and_what_has_no_key_is_said() {
    let mut config = bare();
    let nominal = of(&config, "kalibr");
    assert!(!nominal.notes.iter().any(|n| n.contains("[[effect]]")), "{:?}", nominal.notes);
    config.effects = vec![
        table("gyro.noise_level", &[("noise_over_nominal", 2.5)]),
        table("gyro.warm_up", &[("c1_rad_s", -1e-3), ("time_constant_s", 77.0)]),
        table("gyro.turn_on_shift", &[("shift_rad_s", 1e-4)]),
        table("gyro.narrow_band_noise", &[("center_hz", 21.0), ("bandwidth_hz", 0.5), ("std_rad_s", 1e-3)]),
        table("gyro.tone", &[("frequency_hz", 3.0), ("amplitude_rad_s", 1e-4)]),
        table("wheel.radius_left", &[("relative", 0.03)]),
    ];
    let changed = of(&config, "kalibr");
    close(one(&changed, "gyroscope_noise_density"), 2.5 * one(&nominal, "gyroscope_noise_density"));
    for said in [
        "gyro.noise_level: N is 2.5000 times",
        "a vibration of 1.000e-3 rad/s at 21.0000 Hz",
        "gyro.tone left out: no number of this file",
        "wheel.radius_left left out: of the robot",
        "(1 - exp(-t / 7.700000e1 s))",
    ] {
        assert!(changed.notes.iter().any(|n| n.contains(said)), "{said}: {:?}", changed.notes);
    }
    let c2 = config.gyro.as_ref().unwrap().c2_rad_s;
    close(many(&of(&config, "matlab"), "ConstantBias")[2], -1e-3 + c2 + 1e-4);
}

#[test]
fn matlab_says_what_of_a_curve_is_lost() {
    let full = std::fs::read_to_string(super::fixture("full.toml")).unwrap();
    let [bend, lag] = ["bend_rad_s_per_c2 = 2.0e-6\n", "lag_s = 40.0\n"];
    for (out, is_lost) in [(vec![], true), (vec![bend], true), (vec![lag], true), (vec![bend, lag], false)] {
        let text = out.iter().fold(full.clone(), |text, line| text.replace(line, ""));
        let notes = of(&Config::parse(&text, "full.toml").unwrap(), "matlab").notes;
        assert_eq!(notes.iter().any(|n| n.contains("a straight line without lag")), is_lost, "without {out:?}");
    }
}
