//! Effects of the user's own at rest, on recordings that no simulator of ours made: the numbers are drawn and added up here.

use gyroid::config::Config;
use gyroid::effects::Library;
use gyroid::gap::answer::Verdict;
use gyroid::gap::{Diagnosis, Options, diagnose, explain};
use gyroid::signal::{Log, TimeAxis, names};

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\n\
    time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [[custom_effect]]\nid = \"custom.dropout\"\ntitle = \"regulator drops out\"\nacts_on = \"gyro_bias_rad_s\"\n\
    expression = \"slope*max(0, dropout_v - supply_v)\"\n\
    [[custom_effect.parameter]]\nname = \"slope\"\nunit = \"rad/s per V\"\nbounds = [-1.0, 1.0]\nnull = 0.0\n\
    plausible = [1e-5, 0.1]\nmeaning = \"bias per volt that the regulator lacks\"\n\
    [[custom_effect.parameter]]\nname = \"dropout_v\"\nunit = \"V\"\nbounds = [3.0, 4.0]\nplausible = [3.3, 3.9]\n\
    meaning = \"supply below which it drops out\"\n";
const SLOPE: f64 = -2.5e-3;
const DROPOUT_V: f64 = 3.62;

/// Uniform on (0, 1) by the multiplicative generator of Park and Miller.
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 as f64 / 2_147_483_647.0
    }

    /// Box and Muller.
    pub(crate) fn normal(&mut self) -> f64 {
        let far = (-2.0 * self.uniform().ln()).sqrt();
        far * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Two hours on a battery that runs down under a changing load; its regulator needs 3.62 V.
fn recording(seed: u64) -> Log {
    let mut draw = Draw(seed);
    let len = 36_000;
    let c2 = -2e-3 + 2e-4 * draw.normal();
    let (mut supply, mut gyro, mut sag) = (Vec::new(), Vec::new(), 0.0);
    for i in 0..len {
        let t = 0.2 * i as f64;
        if draw.uniform() < 1e-3 {
            sag = 0.08 * draw.uniform();
        }
        let u = 3.95 - 0.45 * (t / 7200.0).powf(1.3) - sag + 2e-3 * draw.normal();
        let lacks = if u < DROPOUT_V { DROPOUT_V - u } else { 0.0 };
        supply.push(u);
        gyro.push(1e-3 * (1.0 - (-t / 300.0).exp()) + c2 + SLOPE * lacks + 1e-4 / 0.2f64.sqrt() * draw.normal());
    }
    let mut log = Log::new("own.csv", TimeAxis::Uniform { start_s: 0.0, step_s: 0.2, len });
    log.push(names::SUPPLY, supply).unwrap();
    log.push(names::GYRO_Z, gyro).unwrap();
    log
}

fn diagnosed(config: &Config, library: &Library) -> Diagnosis {
    diagnose(config, &recording(11), Some(&recording(12)), library, &Options::default()).unwrap()
}

#[test]
fn an_effect_of_ones_own_is_named_with_its_sizes_and_written_back() {
    let config = Config::parse(REST, "sim.toml").unwrap();
    let library = Library::new().with_own(&config).unwrap();
    let Diagnosis { answer, augmented, .. } = diagnosed(&config, &library);
    assert_eq!((answer.verdict, answer.main.as_deref()), (Verdict::Identified, Some("custom.dropout")));
    let found = &answer.effects[0];
    for (name, truth) in [("slope", SLOPE), ("dropout_v", DROPOUT_V)] {
        let (value, std) = (found.parameters[name], found.std[name]);
        assert!((value - truth).abs() < 4.0 * std && std < 0.05 * truth.abs(), "{name}: {value} ± {std}");
    }
    assert!(found.gap_closed.unwrap() > 0.95, "{:?}", found.gap_closed);
    // the file that is written holds the definition and the sizes
    let again = Config::parse(&augmented.to_toml().unwrap(), "augmented.toml").unwrap();
    assert_eq!(again.custom_effects, config.custom_effects);
    assert_eq!(again.effects[0].id, "custom.dropout");
    let confirmed = diagnosed(&again, &Library::new().with_own(&again).unwrap()).answer;
    assert_eq!(confirmed.verdict, Verdict::None, "{:?}", confirmed.main);
    // without the definition nothing has its name
    let listed = diagnosed(&Config { custom_effects: Vec::new(), ..config }, &Library::new()).answer;
    assert!(listed.effects.iter().all(|e| e.id != "custom.dropout") && listed.verdict != Verdict::None);
}

#[test]
fn fitted_alone_its_intervals_hold_the_truth() {
    let config = Config::parse(REST, "sim.toml").unwrap();
    let library = Library::new().with_own(&config).unwrap();
    let mut held = 0;
    for seed in [21, 22, 23, 24, 25, 26] {
        let found = explain(&config, &recording(seed), &library, &["custom.dropout"], 0.0).unwrap();
        let parameters = &found.effects[0].parameters;
        let inside = |name: &str, truth: f64| parameters[name].ci95[0] < truth && truth < parameters[name].ci95[1];
        held += usize::from(inside("slope", SLOPE)) + usize::from(inside("dropout_v", DROPOUT_V));
    }
    // of 12 intervals of 95 %, eight or fewer hold the truth once in 5000 times
    assert!(held >= 9, "{held} of 12");
}

#[test]
fn what_its_bounds_exclude_is_not_named() {
    let rising = REST.replace("bounds = [-1.0, 1.0]", "bounds = [0.0, 1.0]");
    let config = Config::parse(&rising, "sim.toml").unwrap();
    let answer = diagnosed(&config, &Library::new().with_own(&config).unwrap()).answer;
    assert!(answer.main.as_deref() != Some("custom.dropout") && answer.verdict != Verdict::None, "{:?}", answer.main);
}
