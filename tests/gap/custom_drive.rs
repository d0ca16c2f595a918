//! Effects of the user's own in drives, on drives that no simulator of ours made: a robot on two wheels is integrated here.

use crate::custom::Draw;
use gyroid::config::Config;
use gyroid::effects::Library;
use gyroid::gap::answer::Verdict;
use gyroid::gap::{Diagnosis, Options, diagnose, explain};
use gyroid::navigate::{Settings, run_with};
use gyroid::signal::{Log, TimeAxis, names};

const MASS_KG: f64 = 12.0;
const INERTIA_KG_M2: f64 = 0.35;
const HALF_TRACK_M: f64 = 0.2;
const RADIUS_M: f64 = 0.08;
const WHEEL_KG_M2: f64 = 0.002;
const FRICTION_N_M_S: f64 = 0.01;
const TORQUE_NOISE: f64 = 0.004;
const WHEEL_STD: f64 = 0.02;
const GYRO_ARW: f64 = 1e-4;
const POSE_STD: [f64; 2] = [0.003, 0.003];

/// The robot above. Its cable is fixed at (0.5 m, 0.2 m).
const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
    [vehicle]\nmass_kg = 12.0\nyaw_inertia_kg_m2 = 0.35\nhalf_track_m = 0.2\nwheel_radius_m = 0.08\n\
    wheel_inertia_kg_m2 = 0.002\nviscous_friction_n_m_s = 0.01\ntorque_noise_n_m_sqrt_s = 0.004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 10.0\nposition_std_m = 0.003\nheading_std_rad = 0.003\n\
    [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";
const TETHER: &str = "[[custom_effect]]\nid = \"custom.tether\"\ntitle = \"tether\"\nacts_on = \"force_n\"\n\
    expression = \"stiffness*max(0, 1 - free_m/sqrt((0.5 - x_m)^2 + (0.2 - y_m)^2 + 1e-6))\
    *((0.5 - x_m)*cos(heading_rad) + (0.2 - y_m)*sin(heading_rad))\"\n\
    [[custom_effect.parameter]]\nname = \"stiffness\"\nunit = \"N/m\"\nbounds = [0.0, 1000.0]\nnull = 0.0\n\
    plausible = [0.3, 30.0]\nmeaning = \"k, of the stretched tether\"\n\
    [[custom_effect.parameter]]\nname = \"free_m\"\nunit = \"m\"\nbounds = [0.05, 10.0]\nplausible = [0.3, 3.0]\n\
    meaning = \"length up to which it is slack\"\n";
const STIFFNESS: f64 = 3.0;
const FREE_M: f64 = 1.1;

const STEP_S: f64 = 0.02;
const ROWS: usize = 3000;
const PARTS: usize = 4;

/// d[x, y, θ, v, ω]/dt under the torques of left and right wheel.
fn rates([x, y, th, v, w]: [f64; 5], [left, right]: [f64; 2], stiffness: f64) -> [f64; 5] {
    let wheels = [(v - HALF_TRACK_M * w) / RADIUS_M, (v + HALF_TRACK_M * w) / RADIUS_M];
    let [l, r] = [left - FRICTION_N_M_S * wheels[0], right - FRICTION_N_M_S * wheels[1]].map(|t| t / RADIUS_M);
    let (dx, dy) = (0.5 - x, 0.2 - y);
    let far = dx.hypot(dy);
    let pull = if far > FREE_M { stiffness * (far - FREE_M) / far * (dx * th.cos() + dy * th.sin()) } else { 0.0 };
    let rolling = 2.0 * WHEEL_KG_M2 / (RADIUS_M * RADIUS_M);
    [
        v * th.cos(),
        v * th.sin(),
        w,
        (l + r + pull) / (MASS_KG + rolling),
        HALF_TRACK_M * (r - l) / (INERTIA_KG_M2 + HALF_TRACK_M * HALF_TRACK_M * rolling),
    ]
}

/// The classical method of order four.
fn runge_kutta(state: [f64; 5], torques: [f64; 2], stiffness: f64, h: f64) -> [f64; 5] {
    let moved = |k: &[f64; 5], by: f64| std::array::from_fn(|i| state[i] + by * k[i]);
    let k1 = rates(state, torques, stiffness);
    let k2 = rates(moved(&k1, 0.5 * h), torques, stiffness);
    let k3 = rates(moved(&k2, 0.5 * h), torques, stiffness);
    let k4 = rates(moved(&k3, h), torques, stiffness);
    std::array::from_fn(|i| state[i] + h * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0)
}

/// A minute in loops about the point where the tether is fixed, the torques by what the wheels read.
fn recording(seed: u64, stiffness: f64) -> Log {
    let mut draw = Draw(seed);
    // the first numbers of near seeds are near each other
    for _ in 0..20 {
        draw.uniform();
    }
    let phases = [0; 4].map(|_| std::f64::consts::TAU * draw.uniform());
    let c2 = -2e-3 + 2e-4 * draw.normal();
    let (c1, time_s) = (1e-3 * (1.0 + 0.03 * draw.normal()), 300.0 * (0.03 * draw.normal()).exp());
    let mut all: [Vec<f64>; 8] = Default::default();
    let mut state = [0.0; 5];
    for row in 0..ROWS {
        let t = STEP_S * row as f64;
        let [x, y, th, v, w] = state;
        let wheels = [-1.0, 1.0].map(|side| (v + side * HALF_TRACK_M * w) / RADIUS_M + WHEEL_STD * draw.normal());
        let gyro = w + c1 * (1.0 - (-t / time_s).exp()) + c2 + GYRO_ARW / STEP_S.sqrt() * draw.normal();
        let pose = if row % 5 == 0 {
            [x + POSE_STD[0] * draw.normal(), y + POSE_STD[0] * draw.normal(), th + POSE_STD[1] * draw.normal()]
        } else {
            [f64::NAN; 3]
        };
        // speed and yaw rate that are wanted, and what the wheels say of them
        // no period: a motion that repeats looks like itself, late
        let wave = |of: usize, per_s: f64| (per_s * t + phases[of]).sin();
        let wanted = [0.6 + 0.2 * wave(0, 0.5) + 0.15 * wave(2, 1.31), 0.6 + 0.3 * wave(1, 0.23) + 0.3 * wave(3, 0.87)];
        let read = [0.5 * RADIUS_M * (wheels[0] + wheels[1]), 0.5 * RADIUS_M * (wheels[1] - wheels[0]) / HALF_TRACK_M];
        let force = 3.0 * MASS_KG * (wanted[0] - read[0]);
        let moment = 3.0 * INERTIA_KG_M2 * (wanted[1] - read[1]);
        let command = [-1.0, 1.0].map(|side| 0.5 * RADIUS_M * (force + side * moment / HALF_TRACK_M));
        let row = [wheels[0], wheels[1], gyro, pose[0], pose[1], pose[2], command[0], command[1]];
        all.iter_mut().zip(row).for_each(|(channel, value)| channel.push(value));
        let torques = command.map(|u| u + TORQUE_NOISE / STEP_S.sqrt() * draw.normal());
        for _ in 0..PARTS {
            state = runge_kutta(state, torques, stiffness, STEP_S / PARTS as f64);
        }
    }
    let mut log = Log::new("tethered.csv", TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: ROWS });
    let channels = [
        names::WHEEL_LEFT,
        names::WHEEL_RIGHT,
        names::GYRO_Z,
        names::X,
        names::Y,
        names::HEADING,
        names::TORQUE_LEFT,
        names::TORQUE_RIGHT,
    ];
    channels.into_iter().zip(all).for_each(|(name, values)| log.push(name, values).unwrap());
    log
}

fn defined() -> (Config, Library) {
    let config = Config::parse(&format!("{ROBOT}{TETHER}"), "sim.toml").unwrap();
    let library = Library::new().with_own(&config).unwrap();
    (config, library)
}

#[test]
fn a_tether_that_pulls_is_named_with_its_sizes_and_navigates() {
    let (config, library) = defined();
    let (fit, hold) = (recording(101, STIFFNESS), recording(202, STIFFNESS));
    let Diagnosis { answer, augmented, .. } =
        diagnose(&config, &fit, Some(&hold), &library, &Options::default()).unwrap();
    assert_eq!((answer.verdict, answer.main.as_deref()), (Verdict::Identified, Some("custom.tether")));
    let found = answer.effects.iter().find(|e| e.id == "custom.tether").unwrap();
    for (name, truth) in [("stiffness", STIFFNESS), ("free_m", FREE_M)] {
        let (value, std) = (found.parameters[name], found.std[name]);
        assert!((value - truth).abs() < 4.0 * std && std < 0.1 * truth, "{name}: {value} ± {std}");
    }
    assert!(found.gap_closed.unwrap() > 0.9, "{:?}", found.gap_closed);
    // the file that is written holds definition and sizes, and navigates with them
    let again = Config::parse(&augmented.to_toml().unwrap(), "augmented.toml").unwrap();
    assert_eq!(again.custom_effects, config.custom_effects);
    assert_eq!(again.effects[0].id, "custom.tether");
    let known = Library::new().with_own(&again).unwrap();
    let confirmed = diagnose(&again, &hold, None, &known, &Options::default()).unwrap().answer;
    assert!(!confirmed.together.iter().any(|id| id == "custom.tether"), "{:?}", confirmed.together);
    let nis = |config: &Config| {
        let run = run_with(config, &hold, &Settings::default(), &known).unwrap();
        let own: Vec<f64> = run.pose.require("nis").unwrap().iter().copied().filter(|v| v.is_finite()).collect();
        own.iter().sum::<f64>() / own.len() as f64
    };
    let (with, without) = (nis(&again), nis(&Config { effects: Vec::new(), ..again.clone() }));
    assert!(with < without, "{with} {without}");
}

#[test]
fn fitted_alone_its_intervals_hold_the_truth() {
    let (config, library) = defined();
    let mut held = 0;
    for seed in [21, 22, 23, 24] {
        let found = explain(&config, &recording(seed, STIFFNESS), &library, &["custom.tether"], 0.0).unwrap();
        let parameters = &found.effects[0].parameters;
        let inside = |name: &str, truth: f64| parameters[name].ci95[0] < truth && truth < parameters[name].ci95[1];
        held += usize::from(inside("stiffness", STIFFNESS)) + usize::from(inside("free_m", FREE_M));
    }
    // of eight intervals of 95 %, four or fewer hold the truth once in 2700 times
    assert!(held >= 5, "{held} of 8");
}

#[test]
fn a_robot_without_a_tether_has_none() {
    let (config, library) = defined();
    for seed in [304, 305, 306] {
        let answer = diagnose(&config, &recording(seed, 0.0), None, &library, &Options::default()).unwrap().answer;
        let named = answer.together.iter().any(|id| id == "custom.tether");
        assert!(!named && answer.main.as_deref() != Some("custom.tether"), "{seed}: {:?}", answer.together);
    }
}
