//! Tests that every effect of drives passes, and tests of the simulator with these effects.

use super::*;
use crate::config::{Config, EffectTable, Steering, Vehicle};
use crate::effects::tried::assert_ids_stand_once;
use crate::effects::{Library, Parameter, Parameters};
use crate::error::Result;
use crate::math::random::Stream;
use crate::model::drive::{DriveEffect, DriveModel, Instrument, Moving, Past, Robot};
use crate::model::{EffectSource, GyroEffect, Scene};
use crate::signal::{Log, names};
use crate::simulate::{Course, Drive, Options, drive, drive_with, replay_with, truth_names};
use crate::vehicle::{Motion, Rolling};

const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = 2.9e-3\nc2_rad_s = -4.7e-3\ntime_constant_s = 181.0\nangle_random_walk_rad_sqrt_s = 1.7e-4\n\
    [vehicle]\nmass_kg = 17.1\nyaw_inertia_kg_m2 = 0.61\nhalf_track_m = 0.24\nwheel_radius_m = 0.066\n\
    wheel_inertia_kg_m2 = 0.0011\nviscous_friction_n_m_s = 0.0005\ntorque_noise_n_m_sqrt_s = 0.0002\n\
    [encoder]\nspeed_noise_std_rad_s = 0.0185\n[pose]\nrate_hz = 10.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

pub(super) fn config(effects: &[(&str, &Parameters)]) -> Config {
    let mut config = Config::parse(TEXT, "robot.toml").unwrap();
    let table = |(id, parameters): &(&str, &Parameters)| EffectTable {
        id: (*id).to_string(),
        parameters: (*parameters).clone(),
    };
    config.effects = effects.iter().map(table).collect();
    config
}

fn of<const N: usize>(pairs: [(&str, f64); N]) -> Parameters {
    pairs.map(|(name, value)| (name.to_string(), value)).into()
}

/// Effects that change nothing, whatever they are called.
struct Nothing;

impl crate::model::drive::DriveEffect for Nothing {}

impl EffectSource for Nothing {
    fn is_of_drives(&self, _: &str) -> bool {
        true
    }

    fn gyro_effect(&self, id: &str, _: &Parameters, _: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        Err(crate::Error::new(crate::ErrorKind::Config, "configuration", id))
    }

    fn drive_effect(&self, _: &str, _: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Ok(Box::new(Self))
    }
}

fn bits(log: &Log) -> Vec<(String, Vec<u64>)> {
    log.channels.iter().map(|c| (c.name.clone(), c.values.iter().map(|v| v.to_bits()).collect())).collect()
}

/// Anywhere inside the bounds, small values as often as large ones.
fn draw(parameter: &Parameter, stream: &mut Stream) -> f64 {
    let [low, high] = parameter.bounds;
    let size = |reach: f64, stream: &mut Stream| reach * (-12.0 * stream.uniform()).exp();
    let side = if low < 0.0 && stream.uniform() < 0.5 { -size(-low, stream) } else { size(high, stream) };
    side.clamp(low, high)
}

fn drawn(effect: &dyn Driving, stream: &mut Stream) -> Parameters {
    effect.about().parameters.iter().map(|p| (p.name.to_string(), draw(p, stream))).collect()
}

fn change_of(effect: &dyn Driving) -> Option<&'static dyn ModelChange> {
    match effect.explanation() {
        DriveExplanation::Model(change) => Some(change),
        _ => None,
    }
}

/// A plain size of the effect `id`.
fn usual(id: &str) -> Parameters {
    by_id(id).unwrap().tried().parameters()
}

#[test]
fn an_id_stands_once_and_parameters_are_those_that_users_know() {
    assert_ids_stand_once(&registry().iter().map(|e| e.about()).collect::<Vec<_>>());
    for effect in registry() {
        let (about, tried) = (effect.about(), effect.tried());
        assert_eq!(by_id(about.id).unwrap().about().id, about.id);
        let required: Vec<_> = about.parameters.iter().filter(|p| p.required).map(|p| p.name).collect();
        assert_eq!(required, tried.required.iter().map(|p| p.0).collect::<Vec<_>>(), "{}", about.id);
        assert!(effect.simulated(&tried.parameters(), 10.0, 1).is_ok(), "{}: {tried:?}", about.id);
    }
    assert!(by_id("wheel.unheard_of").is_none());
}

#[test]
fn every_effect_says_what_it_is() {
    let conditions = ["speed", "yaw_rate", "acceleration", "yaw_acceleration", "heading", "torque", "wheel_angle"];
    for effect in registry() {
        let about = effect.about();
        let said = |text: &str, least: usize| assert!(text.len() >= least, "{}: {text:?}", about.id);
        said(about.title, 4);
        said(about.deficient, 12);
        said(about.equation, 12);
        assert!(about.source.chars().any(|c| c.is_ascii_digit()) || about.source.contains("et al."), "{}", about.id);
        assert!(about.remedy.ends_with('.') && about.remedy.matches(". ").count() == 0, "{}", about.id);
        assert!(["wheels", "wheel_left", "torque", "gyro", "pose"].contains(&about.channel), "{}", about.id);
        assert!(about.condition.is_none_or(|c| conditions.contains(&c)), "{}", about.id);
        assert!(about.parameters.iter().any(|p| p.null.is_some()), "{} cannot be switched off", about.id);
        for (i, p) in about.parameters.iter().enumerate() {
            said(p.meaning, 1);
            assert!(p.bounds[0] < p.bounds[1] && p.bounds.iter().all(|b| b.is_finite()), "{}", p.name);
            assert!(p.null.is_none_or(|v| (p.bounds[0]..=p.bounds[1]).contains(&v)), "{}", p.name);
            assert!(about.parameters[..i].iter().all(|q| q.name != p.name), "{} twice", p.name);
        }
        if let Some(change) = change_of(*effect) {
            let sizes = change.sizes();
            assert!(sizes.chars().any(|c| c.is_ascii_digit()), "{}: {sizes:?}", about.id);
        }
        let steered = [None, Some(Steering::Differential), Some(Steering::Skid)];
        let of = |c: &'static dyn ModelChange| steered.map(|s| c.coordinates_of(s)).concat();
        for c in change_of(*effect).into_iter().flat_map(of) {
            assert!(0.0 < c.scale[0] && c.scale[0] < c.scale[1], "{}", about.id);
            assert!(c.bounds[0] < -c.scale[1].min(-c.bounds[0]) + 1e-12 && c.bounds[1] >= c.scale[1], "{}", about.id);
        }
    }
}

#[test]
fn coordinates_and_parameters_are_two_names_of_the_same() {
    let mut stream = Stream::new(1, 1);
    for effect in registry() {
        let Some(change) = change_of(*effect) else { continue };
        let id = effect.about().id;
        let zero = vec![0.0; change.coordinates().len()];
        let null = change.parameters(&zero);
        for (name, value) in &null {
            let parameter = effect.about().parameters.iter().find(|p| p.name == name).unwrap();
            assert!(parameter.null.is_none_or(|n| n == *value), "{id} {name}");
        }
        assert_eq!(change.theta(&null), zero, "{id}");
        for _ in 0..100 {
            let theta: Vec<f64> = change
                .coordinates()
                .iter()
                .map(|c| (c.scale[1] * (2.0 * stream.uniform() - 1.0)).clamp(c.bounds[0], c.bounds[1]))
                .collect();
            let parameters = change.parameters(&theta);
            assert!(effect.simulated(&parameters, 10.0, 1).is_ok(), "{id} {parameters:?}");
            for (a, b) in change.theta(&parameters).iter().zip(&theta) {
                assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{id} {theta:?} {parameters:?}");
            }
        }
        for _ in 0..100 {
            let parameters = drawn(*effect, &mut stream);
            for (name, back) in change.parameters(&change.theta(&parameters)) {
                let turns = if name == "uphill_heading_rad" { std::f64::consts::TAU } else { f64::INFINITY };
                let off = back - parameters[&name];
                let off = if turns.is_finite() { off - (off / turns).round() * turns } else { off };
                assert!(off.abs() < 1e-9 * (1.0 + back.abs()), "{id} {name} {back} {parameters:?}");
            }
        }
    }
}

#[test]
fn nothing_changes_where_an_effect_is_switched_off() {
    let options = Options { since_power_on_s: 4.0, ..Options::from(7) };
    let made = |config: &Config, source: &dyn EffectSource| {
        let d = drive_with(config, Course::Brisk, 6.0, &options, source).unwrap();
        (bits(&d.log), bits(&d.truth))
    };
    let nothing = made(&config(&[("anything", &Parameters::new())]), &Nothing);
    let mut stream = Stream::new(1, 1);
    for effect in registry() {
        for _ in 0..3 {
            let value = |p: &Parameter, s: &mut Stream| p.null.unwrap_or_else(|| draw(p, s));
            let off: Parameters =
                effect.about().parameters.iter().map(|p| (p.name.to_string(), value(p, &mut stream))).collect();
            let found = made(&config(&[(effect.about().id, &off)]), &Library::new());
            assert!(found == nothing, "{} {off:?}", effect.about().id);
        }
    }
}

/// Largest difference between the readings of channel `name` in two logs, in its unit, over the rows where both are
/// known.
fn apart(a: &Log, b: &Log, name: &str) -> f64 {
    let (a, b) = (a.get(name).unwrap(), b.get(name).unwrap());
    a.iter().zip(b).filter(|(a, _)| a.is_finite()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_robot_with_effects_that_do_nothing_is_the_nominal_one() {
    // Runge-Kutta against the closed form
    let text = "[[effect]]\nid = \"anything\"\n";
    for course in [Course::Brisk, Course::Square] {
        for ticks in ["", "ticks_per_revolution = 1e9\n"] {
            let text = TEXT.replace("[pose]", &format!("{ticks}[pose]")) + text;
            let mut changed = Config::parse(&text, "robot.toml").unwrap();
            let changed_drive = drive_with(&changed, course, 30.0, &Options::from(3), &Nothing).unwrap();
            changed.effects.clear();
            let plain = drive(&changed, course, 30.0, &Options::from(3)).unwrap();
            // the control reads the wheels: a count more or less in 1e9 a turn is 6e-7 rad/s, or 4e-8 m/s
            let [motion, torque, wheels] = if ticks.is_empty() { [1e-9, 1e-8, 1e-7] } else { [1e-7, 1e-5, 1e-4] };
            for channel in &plain.truth.channels {
                let off = apart(&plain.truth, &changed_drive.truth, &channel.name);
                assert!(off < motion, "{} {off}", channel.name);
            }
            for (name, bound) in [
                (names::GYRO_Z, motion),
                (names::X, motion),
                (names::TORQUE_LEFT, torque),
                (names::WHEEL_RIGHT, wheels),
            ] {
                let off = apart(&plain.log, &changed_drive.log, name);
                assert!(off < bound, "{name} {off}");
            }
        }
    }
    let vehicle = config(&[]).vehicle.unwrap();
    let (rolling, model) = (Rolling::new(&vehicle), DriveModel::new(Robot::from(&vehicle), Vec::new()));
    let mut stream = Stream::new(5, 5);
    for _ in 0..200 {
        let (mut at, torques) = (moving(&mut stream), [stream.normal(), stream.normal()]);
        model.accelerate(&mut at, torques);
        let f = rolling.forcing(torques);
        let a = f.acceleration_m_s2 - f.speed_damping_per_s * at.speed_m_s;
        let alpha = f.yaw_acceleration_rad_s2 - f.yaw_damping_per_s * at.yaw_rate_rad_s;
        assert!((a - at.acceleration_m_s2).abs() < 1e-9 && (alpha - at.yaw_acceleration_rad_s2).abs() < 1e-9);
        let motion = Motion { speed_m_s: at.speed_m_s, yaw_rate_rad_s: at.yaw_rate_rad_s, ..Motion::default() };
        for (a, b) in model.wheels_rad_s(&at).into_iter().zip(rolling.wheel_speeds(&motion)) {
            assert!((a - b).abs() < 1e-9);
        }
        assert_eq!(model.gyro_rad_s(&at), at.yaw_rate_rad_s);
    }
}

fn moving(s: &mut Stream) -> Moving<'static> {
    Moving {
        t_s: 3.0,
        since_power_on_s: 9.0,
        x_m: 5.0 * s.normal(),
        y_m: 5.0 * s.normal(),
        heading_rad: 2.0 * s.normal(),
        speed_m_s: 0.7 * s.normal(),
        yaw_rate_rad_s: s.normal(),
        acceleration_m_s2: s.normal(),
        yaw_acceleration_rad_s2: s.normal(),
        wheel_force_n: [8.0 * s.normal(), 8.0 * s.normal()],
        past: None,
    }
}

#[test]
fn an_effect_changes_the_equations_that_it_says_and_no_other() {
    let vehicle: Vehicle = config(&[]).vehicle.unwrap();
    let nominal = DriveModel::new(Robot::from(&vehicle), Vec::new());
    let mut stream = Stream::new(2, 2);
    for effect in registry() {
        let Some(change) = change_of(*effect) else { continue };
        let (id, channel, touches) = (effect.about().id, effect.about().channel, change.touches());
        let theta: Vec<f64> = change.coordinates().iter().map(|c| 0.3 * c.scale[1]).collect();
        let model = DriveModel::new(Robot::from(&vehicle), vec![change.at(&theta)]);
        // force, moment, sideways, wheels, gyro, pose
        let mut moved = [false; 6];
        for _ in 0..100 {
            let (at, torques) = (moving(&mut stream), [stream.normal(), stream.normal()]);
            let mut past = Past::default();
            let rates =
                [at.speed_m_s - 0.1 * at.acceleration_m_s2, at.yaw_rate_rad_s - 0.1 * at.yaw_acceleration_rad_s2];
            past.push(2.9, rates, at.wheel_force_n);
            let (mut here, mut there) = (at, at);
            nominal.accelerate(&mut here, torques);
            model.accelerate(&mut there, torques);
            moved[0] |= here.acceleration_m_s2 != there.acceleration_m_s2;
            moved[1] |= here.yaw_acceleration_rad_s2 != there.yaw_acceleration_rad_s2;
            moved[2] |= model.sideways_m_s(&at) != 0.0;
            let at = Moving { past: Some(&past), ..at };
            moved[3] |= model.wheels_rad_s(&at) != nominal.wheels_rad_s(&at);
            moved[5] |= at.pose_ago(model.delay_s(Instrument::Pose)) != at.pose_ago(nominal.delay_s(Instrument::Pose));
            moved[4] |= model.gyro_rad_s(&at) != nominal.gyro_rad_s(&at);
        }
        let motion = moved[..3].contains(&true);
        assert!(touches.motion || !motion, "{id} moves the robot");
        assert!(touches.wheels || !moved[3], "{id} moves the wheels");
        assert!(touches.gyro || !moved[4], "{id} moves the gyro");
        assert!(touches.pose || !moved[5], "{id} moves the reference");
        let as_said = match channel {
            "gyro" => moved == [false, false, false, false, true, false],
            "pose" => moved[..2] == [false; 2] && moved[2] != moved[5] && moved[3..5] == [false; 2],
            "torque" => motion && !moved[2] && !moved[3] && !moved[4],
            _ => moved[3] && !moved[2] && !moved[4],
        };
        assert!(as_said, "{id}, channel {channel}: {moved:?}");
    }
}

#[test]
fn a_replay_differs_where_the_effect_acts_and_nowhere_else() {
    let nominal = config(&[]);
    let inputs = drive(&nominal, Course::Brisk, 20.0, &Options::from(2)).unwrap().log;
    let again = |config: &Config, source: &dyn EffectSource| replay_with(config, &inputs, &Options::from(3), source);
    let base = again(&config(&[("anything", &Parameters::new())]), &Nothing).unwrap().log;
    let all = [names::GYRO_Z, names::WHEEL_LEFT, names::WHEEL_RIGHT, names::X, names::HEADING];
    for effect in registry() {
        let id = effect.about().id;
        let log = again(&config(&[(id, &usual(id))]), &Library::new()).unwrap().log;
        let moved = all.map(|name| apart(&base, &log, name) > 0.0);
        assert_eq!(moved, effect.tried().moves, "{id}");
    }
}

#[test]
fn drives_are_finite_inside_the_bounds_and_repeat_with_their_seed() {
    let mut stream = Stream::new(2, 1);
    for k in 0..200 {
        let effect = registry()[k % registry().len()];
        let parameters = drawn(effect, &mut stream);
        let config = config(&[(effect.about().id, &parameters)]);
        let made = || drive_with(&config, Course::Brisk, 3.0, &Options::from(3), &Library::new());
        let what = format!("{} {parameters:?}", effect.about().id);
        let Drive { log, .. } = made().map_err(|e| format!("{what}: {e}")).unwrap();
        for channel in &log.channels {
            let pose = [names::X, names::Y, names::HEADING].contains(&channel.name.as_str());
            assert!(channel.values.iter().all(|v| v.is_finite() || pose && v.is_nan()), "{what}: {}", channel.name);
        }
        if k % 10 == 0 {
            assert!(bits(&log) == bits(&made().unwrap().log), "{what}");
        }
    }
}

#[test]
fn an_effect_draws_its_own_numbers_whatever_stands_beside_it() {
    let (ticks, step) = (usual("encoder.missed_ticks"), usual("gyro.bias_step"));
    let (off, lattice) = (of([("relative", 0.0)]), of([("lsb_rad_s", 0.0)]));
    let log = |effects: &[(&str, &Parameters)]| {
        drive_with(&config(effects), Course::Square, 20.0, &Options::from(4), &Library::new()).unwrap().log
    };
    let both = log(&[("encoder.missed_ticks", &ticks), ("gyro.bias_step", &step)]);
    let more = log(&[
        ("gyro.scale_factor", &off),
        ("encoder.quantization", &lattice),
        ("encoder.missed_ticks", &ticks),
        ("gyro.bias_step", &step),
    ]);
    assert!(bits(&both) == bits(&more));
    // two steps fall at two times
    let two = log(&[("gyro.bias_step", &step), ("gyro.bias_step", &step)]);
    let none = log(&[("gyro.scale_factor", &off)]);
    let (two, none) = (two.get(names::GYRO_Z).unwrap(), none.get(names::GYRO_Z).unwrap());
    let once = two.iter().zip(none).filter(|(a, b)| (*a - *b - 0.01).abs() < 1e-9).count();
    assert!(once > 0, "both steps at one time");
}

mod physics;
