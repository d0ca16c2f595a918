//! What is known of parts decides between effects that a drive cannot tell apart: a gyro's gain is good to some percent, a track of a
//! robot that skids is not. One wheel's radius is one coordinate, and noise has a level of its own.

use crate::config::{Config, EffectTable};
use crate::effects::drive::registry;
use crate::effects::{Library, Parameters};
use crate::gap::drive::model_selection::{Judged, judge};
use crate::gap::drive::options::Options;
use crate::gap::drive::record::Record;
use crate::gap::selection::sets::{Main, Part};
use crate::simulate::{self, Course, drive_with};

const ROBOT: &str = include_str!("../../../../tests/common/robot.toml");

/// The robot, how it steers stated.
fn robot(steering: &str) -> Config {
    let text = ROBOT.replace("wheel_radius_m", &format!("{steering}wheel_radius_m"));
    Config::parse(&text, "robot.toml").unwrap()
}

fn judged(steering: &str, effects: &[(&str, &str, f64)], seed: u64, cut: impl Fn(&mut Record)) -> Judged {
    let nominal = robot(steering);
    let mut config = nominal.clone();
    let table = |(id, name, value): &(&str, &str, f64)| EffectTable {
        id: (*id).to_string(),
        parameters: Parameters::from([((*name).to_string(), *value)]),
    };
    config.effects = effects.iter().map(table).collect();
    let options = simulate::Options { vary_turn_on: true, ..seed.into() };
    let log = drive_with(&config, Course::Brisk, 60.0, &options, &Library::new()).unwrap().log;
    let mut record = Record::new(&nominal, &log, 0.0).unwrap();
    cut(&mut record);
    judge(&record, registry(), &Options::default())
}

fn blind(record: &mut Record) {
    record.pose = None;
    record.torques_n_m = None;
}

fn main_of(judged: &Judged) -> Main {
    judged.findings.top()
}

fn part<'a>(judged: &'a Judged, id: &str) -> &'a Part {
    judged.findings.best_with(id, true).and_then(|set| set.part(id)).unwrap()
}

#[track_caller]
fn near(part: &Part, name: &str, truth: f64) {
    let (found, std) = (part.parameters[name], part.std[name]);
    println!("{} {name}: {found:.5} ± {std:.5}, true {truth}", part.id);
    assert!((found - truth).abs() < 4.0 * std || (found - truth).abs() < 0.02 * truth.abs(), "{found} ± {std}");
}

/// Wheels and gyro alone: the yaw rates differ by a factor, and whose it is no reading tells.
#[test]
#[ignore = "battery: some ten seconds"]
fn battery_a_yaw_rate_that_is_far_off_is_the_track_of_a_robot_that_skids() {
    for steering in ["", "steering = \"skid\"\n"] {
        let found = judged(steering, &[("vehicle.track_width", "relative", 0.7)], 5, blind);
        assert_eq!(main_of(&found), Main::Effect("vehicle.track_width".into()), "{:?}", found.findings.mains());
        near(part(&found, "vehicle.track_width"), "relative", 0.7);
        // the others are named in its class
        let class = found.alike.iter().find(|a| a.ids[0] == "vehicle.track_width").unwrap();
        assert!(class.ids.contains(&"gyro.scale_factor".into()) && class.ids.contains(&"wheel.radius_scale".into()));
        assert!(class.separate_by.contains("pose"), "{}", class.separate_by);
    }
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_track_of_twice_the_nominal_is_found_with_all_channels() {
    for truth in [0.5, 0.95] {
        let found = judged("", &[("vehicle.track_width", "relative", truth)], 6, |_| {});
        assert_eq!(main_of(&found), Main::Effect("vehicle.track_width".into()), "{:?}", found.findings.mains());
        near(part(&found, "vehicle.track_width"), "relative", truth);
    }
}

/// Takes channels out of a drive.
type Cut = fn(&mut Record);

/// The left wheel 3 % small, whatever else was logged.
#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_one_radius_is_one_effect() {
    let cuts: [(&str, Cut); 3] =
        [("all channels", |_| {}), ("no pose", |r| r.pose = None), ("no torques", |r| r.torques_n_m = None)];
    for (what, cut) in cuts {
        for (id, truth) in [("wheel.radius_left", -0.03), ("wheel.radius_right", 0.012)] {
            let found = judged("", &[(id, "relative", truth)], 7, cut);
            assert_eq!(main_of(&found), Main::Effect(id.into()), "{what}: {:?}", found.findings.mains());
            // without torques how speeds change is a model of its own: what it lacks biases how large they are, and has others named
            if what != "no torques" {
                assert_eq!(found.findings.together(Some(id)), [id], "{what}");
                near(part(&found, id), "relative", truth);
            }
        }
    }
}

/// A wheel that rolls farther reads low, as one that loses ticks does: forces tell it by its radius, and without them nothing does.
#[test]
#[ignore = "battery: some ten seconds"]
fn battery_a_larger_radius_and_lost_ticks_are_one_class_without_torques() {
    let effect = [("wheel.radius_left", "relative", 0.02)];
    let found = judged("", &effect, 8, |r| r.torques_n_m = None);
    let mains = found.findings.mains();
    let told = |id: &str| mains.iter().find(|m| m.0 == Main::Effect(id.into())).map_or(0.0, |m| m.1);
    let (radius, ticks) = (told("wheel.radius_left"), told("encoder.missed_ticks"));
    assert!(radius > ticks && ticks > 0.05 && radius + ticks > 0.8, "{mains:?}");
    let both = ["wheel.radius_left", "encoder.missed_ticks"];
    let told = found.alike.iter().any(|class| both.iter().all(|id| class.ids.iter().any(|own| own == id)));
    assert!(told, "{:?}", found.alike);
    let found = judged("", &effect, 8, |_| {});
    let mains = found.findings.mains();
    assert!(
        mains[0].0 == Main::Effect("wheel.radius_left".into()) && mains[0].1 > 0.9 * (1.0 - found.findings.doubt),
        "{mains:?}"
    );
}

#[test]
#[ignore = "battery: drives of the generator"]
fn battery_noise_beside_another_effect_has_its_own_name() {
    let effects =
        [("gyro.noise_level", "noise_over_nominal", 2.2), ("wheel.radius_mismatch", "right_over_left_minus_one", 0.02)];
    let found = judged("", &effects, 9, |_| {});
    let together = found.findings.together(None);
    assert_eq!(together, ["gyro.noise_level", "wheel.radius_mismatch"], "{:?}", found.findings.mains());
    let set = &found.findings.sets[0];
    near(set.part("gyro.noise_level").unwrap(), "noise_over_nominal", 2.2);
    near(set.part("wheel.radius_mismatch").unwrap(), "right_over_left_minus_one", 0.02);
    let said = &set.part("gyro.noise_level").unwrap().description;
    assert!(said.contains("2.2") && said.contains("as large as stated"), "{said}");
}

/// Noise that grows with the speed is no level.
#[test]
fn noise_that_follows_the_speed_is_no_level() {
    let found = judged("", &[], 10, |record| {
        let mut draw = crate::math::random::Stream::new(10, 77);
        let speeds: Vec<f64> = (0..record.len()).map(|k| record.wheels_rad_s[1][k].abs()).collect();
        let std = record.belief.gyro_std_rad_s;
        for (gyro, speed) in record.gyro_rad_s.iter_mut().flatten().zip(speeds) {
            *gyro += 0.4 * std * speed * draw.normal();
        }
    });
    assert_eq!(main_of(&found), Main::Unknown, "{:?}", found.findings.mains());
}

#[test]
fn another_steering_is_refused_by_name() {
    let text = ROBOT.replace("wheel_radius_m", "steering = \"ackermann\"\nwheel_radius_m");
    let error = Config::parse(&text, "robot.toml").unwrap_err().to_string();
    assert!(error.contains("steering") && error.contains("skid") && error.contains("differential"), "{error}");
    assert_eq!(robot("steering = \"skid\"\n").vehicle.unwrap().steering, Some(crate::config::Steering::Skid));
}
