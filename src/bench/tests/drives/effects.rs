//! Every effect of drives: what the simulator puts in, the diagnosis finds again.
//!
//! `cargo test --lib bench::tests::drives battery -- --ignored --nocapture --test-threads 1` goes through more drives, and prints the
//! coverage of the intervals and the false alarms.

use crate::config::{Config, EffectTable};
use crate::effects::drive::{Driving, by_id, registry};
use crate::effects::{Library, Parameters};
use crate::gap::drive::model_selection::judge;
use crate::gap::drive::options::Options;
use crate::gap::drive::record::Record;
use crate::gap::selection::findings::Findings;
use crate::gap::selection::sets::{Main, Part};
use crate::math::cases::cases;
use crate::math::random::Stream;
use crate::signal::Log;
use crate::simulate::{self, Course, drive_with};
use statrs::distribution::{Binomial, DiscreteCDF};
use std::collections::BTreeMap;

const ROBOT: &str = include_str!("../../../../tests/common/robot.toml");
/// Length of a drive: 6000 rows.
const SPAN_S: f64 = 60.0;
/// Probability that an honest diagnosis fails a count.
const CHANCE: f64 = 0.01;
/// Clean drives in which something is found: at most this share.
const FALSE_ALARMS: f64 = 0.05;

/// One effect a drive, plain to see. Parameters that are here are looked for.
const PLAIN: [(&str, &[(&str, f64)]); 24] = [
    ("wheel.slip", &[("compliance", 0.3), ("cubic_compliance", 2.0)]),
    ("wheel.radius_mismatch", &[("right_over_left_minus_one", 0.01)]),
    ("wheel.radius_scale", &[("relative", -0.012)]),
    ("wheel.radius_left", &[("relative", -0.03)]),
    ("wheel.radius_right", &[("relative", 0.008)]),
    ("wheel.rolling_resistance", &[("coefficient", 0.02)]),
    ("wheel.lateral_skid", &[("lateral_slip_s", 0.03)]),
    ("vehicle.track_width", &[("relative", 0.02)]),
    ("vehicle.payload", &[("mass_relative", 0.15), ("inertia_relative", 0.1)]),
    ("vehicle.com_offset", &[("offset_m", -0.04)]),
    ("motor.torque_gain", &[("right_over_left_minus_one", 0.08)]),
    ("encoder.quantization", &[("lsb_rad_s", 0.08)]),
    ("encoder.missed_ticks", &[("loss_fraction", 0.05), ("right", 1.0), ("burst_s", 0.3), ("share_of_time", 0.05)]),
    ("gyro.scale_factor", &[("relative", 0.012)]),
    ("gyro.scale_asymmetry", &[("relative", 0.015)]),
    ("gyro.vibration_rectification", &[("coefficient_rad_s_per_m2_s2", 0.004)]),
    ("gyro.bias_step", &[("step_rad_s", 0.004), ("time_s", 33.0)]),
    ("sensor.gyro_delay", &[("delay_s", 0.014)]),
    ("sensor.wheel_delay", &[("delay_s", 0.007)]),
    ("sensor.pose_delay", &[("delay_s", 0.03)]),
    ("gyro.noise_level", &[("noise_over_nominal", 2.2)]),
    ("encoder.noise_level", &[("noise_over_nominal", 1.3)]),
    ("pose.noise_level", &[("noise_over_nominal", 0.6)]),
    ("ground.slope", &[("slope_rad", 0.015), ("uphill_heading_rad", 0.8)]),
];
/// What shapes the effect in this run and is described, not estimated with a standard deviation.
const FORM: [&str; 4] = ["time_s", "right", "burst_s", "share_of_time"];

fn of(parameters: &[(&str, f64)]) -> Parameters {
    parameters.iter().map(|(name, value)| ((*name).to_string(), *value)).collect()
}

/// A drive of the nominal robot with these effects, its turn-on drawn at random.
fn recording(effects: &[(&str, Parameters)], seed: u64) -> Log {
    let mut config = Config::parse(ROBOT, "robot.toml").unwrap();
    let table = |(id, p): &(&str, Parameters)| EffectTable { id: (*id).to_string(), parameters: p.clone() };
    config.effects = effects.iter().map(table).collect();
    let options = simulate::Options { vary_turn_on: true, ..seed.into() };
    drive_with(&config, Course::Brisk, SPAN_S, &options, &Library::new()).unwrap().log
}

fn judged(log: &Log, effects: &[&'static dyn Driving], options: &Options) -> Findings {
    let record = Record::new(&Config::parse(ROBOT, "robot.toml").unwrap(), log, 0.0).unwrap();
    judge(&record, effects, options).findings
}

/// The part of `id` in the most probable set that holds it.
fn part<'a>(findings: &'a Findings, id: &str) -> Option<&'a Part> {
    findings.best_with(id, false).and_then(|set| set.part(id))
}

#[track_caller]
fn finds(id: &str) {
    let (_, truth) = PLAIN.iter().find(|p| p.0 == id).unwrap();
    let findings = judged(&recording(&[(id, of(truth))], 11), registry(), &Options::default());
    let mains = findings.mains();
    let top = &findings.sets[0].parts;
    assert_eq!(mains[0].0, Main::Effect(id.to_string()), "{mains:?}, {top:#?}");
    let part = part(&findings, id).unwrap();
    for (name, truth) in truth.iter().filter(|(name, _)| !FORM.contains(name)) {
        let (found, std) = (part.parameters[*name], part.std.get(*name).copied().unwrap_or(0.0));
        let off = (found - truth).abs();
        println!("{id} {name}: {found:.6} ± {std:.6}, true {truth}, probability {:.3}", mains[0].1);
        assert!(off < 4.0 * std || off < 0.05 * truth.abs(), "{id} {name}: {found} ± {std}, true {truth}");
        assert!(std < 0.5 * truth.abs(), "{id} {name}: {found} ± {std} says nothing");
    }
}

macro_rules! each {
    ({ $($test:ident: $id:literal;)* } battery { $($long:ident: $long_id:literal;)* }) => {
        $(#[test] fn $test() { finds($id); })*
        $(#[test] #[ignore = "battery: some seconds and more"] fn $long() { finds($long_id); })*
        #[test]
        fn every_effect_has_its_test() {
            let mut tested = [$($id,)* $($long_id),*];
            let mut all: Vec<_> = registry().iter().map(|e| e.about().id).collect();
            tested.sort_unstable();
            all.sort_unstable();
            assert_eq!(tested.as_slice(), all);
        }
    };
}

each! {
    {
        unequal_radii: "wheel.radius_mismatch";
        skid: "wheel.lateral_skid";
        track: "vehicle.track_width";
        lattice: "encoder.quantization";
        lost_ticks: "encoder.missed_ticks";
        gain: "gyro.scale_factor";
        quieter_reference: "pose.noise_level";
    } battery {
        battery_other_radii: "wheel.radius_scale";
        battery_left_radius: "wheel.radius_left";
        battery_right_radius: "wheel.radius_right";
        battery_unequal_motors: "motor.torque_gain";
        battery_asymmetry: "gyro.scale_asymmetry";
        battery_rectification: "gyro.vibration_rectification";
        battery_step: "gyro.bias_step";
        battery_louder_gyro: "gyro.noise_level";
        battery_louder_wheels: "encoder.noise_level";
        battery_slip: "wheel.slip";
        battery_rolling_resistance: "wheel.rolling_resistance";
        battery_payload: "vehicle.payload";
        battery_centre_of_mass: "vehicle.com_offset";
        battery_delay: "sensor.gyro_delay";
        battery_late_wheels: "sensor.wheel_delay";
        battery_late_reference: "sensor.pose_delay";
        battery_slope: "ground.slope";
    }
}

/// Most of `n` events of probability `p` that chance brings, but for [`CHANCE`].
fn most(n: u64, p: f64) -> u64 {
    let law = Binomial::new(p, n).unwrap();
    (0..=n).find(|k| law.cdf(*k) >= 1.0 - CHANCE).unwrap()
}

/// What is alleged of clean drives, and how often.
fn alarms(drives: u64) -> BTreeMap<Main, u64> {
    let mut all = BTreeMap::new();
    for seed in 0..drives {
        let main = judged(&recording(&[], 7000 + seed), registry(), &Options::default()).top();
        if main != Main::None {
            *all.entry(main).or_default() += 1;
        }
    }
    all
}

#[test]
#[ignore = "battery: 100 drives"]
fn battery_of_clean_drives() {
    let drives = cases(100);
    let found = alarms(drives);
    println!("false alarms in {drives} clean drives: {found:?}");
    assert!(found.values().sum::<u64>() <= most(drives, FALSE_ALARMS), "{found:?}");
}

/// Uniform in the logarithm, either sign.
fn signed(s: &mut Stream, low: f64, high: f64) -> f64 {
    let size = low * (high / low).powf(s.uniform());
    if s.uniform() < 0.5 { -size } else { size }
}

/// Effects with one parameter, and the range of its size.
const COVERED: [(&str, &str, [f64; 2]); 11] = [
    ("gyro.scale_factor", "relative", [2e-3, 2e-2]),
    ("vehicle.track_width", "relative", [2e-3, 3e-2]),
    ("motor.torque_gain", "right_over_left_minus_one", [1e-2, 2e-1]),
    ("wheel.radius_mismatch", "right_over_left_minus_one", [1e-3, 1e-2]),
    ("wheel.radius_scale", "relative", [2e-3, 2e-2]),
    ("wheel.radius_left", "relative", [1e-3, 3e-2]),
    ("wheel.radius_right", "relative", [1e-3, 3e-2]),
    ("wheel.lateral_skid", "lateral_slip_s", [5e-3, 5e-2]),
    ("vehicle.com_offset", "offset_m", [5e-3, 8e-2]),
    ("gyro.scale_asymmetry", "relative", [2e-3, 2e-2]),
    ("gyro.vibration_rectification", "coefficient_rad_s_per_m2_s2", [5e-4, 5e-3]),
];

/// How often the 95 % interval holds the truth in `draws` drives where the effect is known to be looked for, and mean and
/// root mean square of (estimate - truth)/std.
fn coverage(id: &str, name: &str, [low, high]: [f64; 2], draws: u64) -> (u64, [f64; 2]) {
    let (mut covered, mut sums) = (0, [0.0; 2]);
    for draw in 0..draws {
        let seed = 100_000 + 7919 * draw + 31 * id.bytes().map(u64::from).sum::<u64>();
        let truth = signed(&mut Stream::new(seed, 3), low, high);
        let log = recording(&[(id, of(&[(name, truth)]))], seed);
        let findings = judged(&log, &[by_id(id).unwrap()], &Options::default());
        // an effect that is not seen at all covers nothing
        let Some(part) = part(&findings, id) else { continue };
        let z = (part.parameters[name] - truth) / part.std[name];
        covered += u64::from(z.abs() <= 1.96);
        sums = [sums[0] + z, sums[1] + z * z];
    }
    (covered, [sums[0] / draws as f64, (sums[1] / draws as f64).sqrt()])
}

#[track_caller]
fn covers(id: &str, draws: u64) {
    let (id, name, range) = *COVERED.iter().find(|c| c.0 == id).unwrap();
    let (covered, [mean, rms]) = coverage(id, name, range, draws);
    println!("| `{id}` | `{name}` | {covered} of {draws} | {mean:.2} | {rms:.2} |");
    assert!(draws - covered <= most(draws, 0.05), "{id} {name}: {covered} of {draws}, z {mean:.2}, rms {rms:.2}");
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_intervals_of_the_gain_cover() {
    covers("gyro.scale_factor", 20);
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_intervals_of_the_track_cover() {
    covers("vehicle.track_width", 20);
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_intervals_of_the_motors_cover() {
    covers("motor.torque_gain", 20);
}

#[test]
#[ignore = "battery: 100 drives of each of eleven effects"]
fn battery_of_intervals() {
    let only = std::env::var("GYROID_ONLY").unwrap_or_default();
    println!("| effect | parameter | covered | mean z | rms z |\n|---|---|---|---|---|");
    for (id, _, _) in COVERED.iter().filter(|c| c.0.contains(&only)) {
        covers(id, cases(100));
    }
}

#[test]
#[ignore = "battery: twelve drives"]
fn battery_of_lost_ticks() {
    let mut missed = Vec::new();
    for loss in [0.05, 0.1, 0.2, 0.35] {
        for seed in 11..11 + cases(3) {
            let ticks = of(&[("loss_fraction", loss), ("right", 1.0), ("burst_s", 0.3), ("share_of_time", 0.05)]);
            let findings =
                judged(&recording(&[("encoder.missed_ticks", ticks)], seed), registry(), &Options::default());
            let main = findings.top();
            println!("loss {loss}, seed {seed}: {main:?}");
            if main != Main::Effect("encoder.missed_ticks".into()) {
                missed.push((loss, seed));
            }
        }
    }
    assert!(missed.is_empty(), "not found: {missed:?}");
}

/// A delay of many rows is no slope at zero; free forms that follow the yaw acceleration would explain more than a shorter one.
#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_gyro_that_is_late_by_many_rows_is_found() {
    for (delay_s, seed) in [(0.024, 21), (0.057, 22), (0.13, 23)] {
        let late = of(&[("delay_s", delay_s)]);
        let findings = judged(&recording(&[("sensor.gyro_delay", late)], seed), registry(), &Options::default());
        let mains = findings.mains();
        assert_eq!(mains[0].0, Main::Effect("sensor.gyro_delay".into()), "{delay_s}: {mains:?}");
        let part = part(&findings, "sensor.gyro_delay").unwrap();
        let (found, std) = (part.parameters["delay_s"], part.std["delay_s"]);
        println!("{delay_s} s: {found:.5} ± {std:.5}");
        assert!((found - delay_s).abs() < 4.0 * std || (found - delay_s).abs() < 0.02 * delay_s, "{found} ± {std}");
    }
}

/// Bursts of which none shows: what is lost on average makes one wheel read low, as no pair of other radii does in the nominal
/// mean. What bursts happen to lose at one speed more than at another may look like a form of its own, now and then.
#[test]
#[ignore = "battery: eight drives"]
fn battery_of_bursts() {
    let (loss, share) = (1.2e-3, 0.3);
    let mut named = 0;
    for seed in 31..39 {
        let right = (seed % 2) as f64;
        let ticks = of(&[("loss_fraction", loss), ("right", right), ("burst_s", 0.06), ("share_of_time", share)]);
        let findings = judged(&recording(&[("encoder.missed_ticks", ticks)], seed), registry(), &Options::default());
        let mains = findings.mains();
        println!("seed {seed}: {mains:?}");
        assert!(!matches!(&mains[0].0, Main::Effect(id) if id.starts_with("wheel.")), "{mains:?}");
        if mains[0].0 != Main::Effect("encoder.missed_ticks".into()) {
            continue;
        }
        named += 1;
        let part = part(&findings, "encoder.missed_ticks").unwrap();
        assert_eq!((part.parameters["right"], part.parameters["share_of_time"]), (right, 1.0), "{part:?}");
        // 300 bursts of six rows: their share of the time varies by a tenth or less
        let (found, std) = (part.parameters["loss_fraction"], part.std["loss_fraction"].hypot(0.1 * loss * share));
        assert!((found - loss * share).abs() < 4.0 * std, "{found} ± {std}");
    }
    assert!(named >= 6, "{named} of 8");
}
