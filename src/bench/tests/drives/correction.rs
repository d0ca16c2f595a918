//! The correction that an equation of a drive needs, as a smoothed signal: false alarms, recovery, what it goes with.

use crate::config::Config;
use crate::gap::answer::Correction;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::basis::Equation;
use crate::gap::drive::screening::model_discrepancy;
use crate::math::random::Stream;
use crate::simulate::{self, Course, drive};
use rayon::prelude::*;

const ROBOT: &str = include_str!("../../../../tests/common/robot.toml");
const EQUATIONS: [Equation; 11] = [
    Equation::Force,
    Equation::Moment,
    Equation::Sideways,
    Equation::Along,
    Equation::Turn,
    Equation::WheelLeft,
    Equation::WheelRight,
    Equation::Gyro,
    Equation::PoseAlong,
    Equation::PoseAcross,
    Equation::PoseHeading,
];
const SPAN_S: f64 = 60.0;

/// A drive of the robot `real`, as the nominal one is to explain it.
fn recording(real: &str, seed: u64) -> Record {
    let options = simulate::Options { vary_turn_on: true, ..seed.into() };
    let log = drive(&Config::parse(real, "real.toml").unwrap(), Course::Brisk, SPAN_S, &options).unwrap().log;
    Record::new(&Config::parse(ROBOT, "robot.toml").unwrap(), &log, 0.0).unwrap()
}

fn needed(record: &Record, equation: Equation) -> Correction {
    model_discrepancy::of(record, &Noise::believed(record, None), equation).unwrap()
}

#[test]
#[ignore = "battery: drives of the generator"]
fn battery_nothing_is_needed_where_nothing_is_lacking() {
    const SEEDS: u64 = 40;
    let of_seed = |seed: u64| {
        let record = recording(ROBOT, 300 + seed);
        EQUATIONS.map(|equation| needed(&record, equation).p_value)
    };
    let all: Vec<_> = (0..SEEDS).into_par_iter().map(of_seed).collect();
    for (i, equation) in EQUATIONS.into_iter().enumerate() {
        let below = |level: f64| all.iter().filter(|p| p[i] < level).count();
        println!(
            "{equation:?}: p < 0.05 in {}, p < 0.001 in {}, none in {}",
            below(0.05),
            below(0.001),
            SEEDS as usize - below(1.0)
        );
        // binomial: of 40 more than 8 at 0.05 come once in 6000, more than 2 at 0.001 once in 100 000
        assert!(
            below(0.05) <= 8 && below(0.001) <= 2,
            "{equation:?}: {:?}",
            all.iter().map(|p| p[i]).collect::<Vec<_>>()
        );
    }
}

/// What the gyro reads too much, straight between knots.
type Added = Box<dyn Fn(f64) -> f64>;

/// How much of that lies inside the 95 % band, on average over drives, and the standard deviation that this has by chance: in
/// each drive there are as many independent values as the smoother has degrees of freedom.
fn covered(added: fn(u64) -> Added) -> [f64; 2] {
    const SEEDS: u64 = 24;
    let of_seed = |seed: u64| {
        let mut record = recording(ROBOT, 500 + seed);
        let truth = added(seed);
        let times_s = record.times_s.clone();
        let gyro = record.gyro_rad_s.as_mut().unwrap();
        gyro.iter_mut().zip(&times_s).for_each(|(g, t)| *g += truth(*t));
        let c = needed(&record, Equation::Gyro);
        assert!(c.about_mean && c.p_value < 1e-6 && c.diffusion > 0.0, "{} {}", c.p_value, c.diffusion);
        let count = c.times_s.len() as f64;
        let mean = c.times_s.iter().map(|t| truth(*t)).sum::<f64>() / count;
        let off = |k: usize| (c.values[k] - truth(c.times_s[k]) + mean) / c.std[k];
        [(0..c.values.len()).filter(|k| off(*k).abs() < 1.96).count() as f64 / count, c.degrees_of_freedom]
    };
    let all: Vec<[f64; 2]> = (0..SEEDS).into_par_iter().map(of_seed).collect();
    let [inside, independent] = [0, 1].map(|i| all.iter().map(|a| a[i]).sum::<f64>());
    println!("inside {:.3}, independent values {:.1}", inside / SEEDS as f64, independent / SEEDS as f64);
    [inside / SEEDS as f64, (0.95 * 0.05 / independent).sqrt()]
}

#[test]
fn a_wandering_gyro_is_recovered_within_its_band() {
    let [inside, std] = covered(|seed| {
        let draw = &mut Stream::new(seed, 77);
        let mut knots = vec![0.0];
        for k in 0..61 {
            knots.push(knots[k] + 5e-4 * draw.normal());
        }
        let step_s = (SPAN_S - 0.01) / 60.0;
        Box::new(move |t| {
            let u = t / step_s;
            let k = u as usize;
            knots[k] + (u - k as f64) * (knots[k + 1] - knots[k])
        })
    });
    assert!((inside - 0.95).abs() < 4.0 * std, "{inside} ± {std}");
}

#[test]
fn a_wave_of_the_gyro_is_recovered_within_its_band() {
    // a wave of 20 s is smoother than a walk: less of it may lie outside
    let [inside, std] = covered(|_| Box::new(|t| 8e-4 * (std::f64::consts::TAU * t / 20.0).sin()));
    assert!(inside > 0.95 - 4.0 * std, "{inside} ± {std}");
}

#[test]
fn what_a_correction_goes_with_is_named() {
    let draggy = ROBOT.replace("viscous_friction_n_m_s = 0.0005", "viscous_friction_n_m_s = 0.003");
    for seed in 0..5 {
        // (0.003 - 0.0005) · 2 ω / (r m) less than the model has it, ω = v / r
        let c = needed(&recording(&draggy, 700 + seed), Equation::Force);
        println!("{:?}", c.regressors.iter().map(|r| format!("{} {:.3}", r.name, r.share)).collect::<Vec<_>>());
        assert_eq!(c.regressors[0].name, "speed");
        assert!(c.regressors[0].share > 0.8, "{:?}", c.regressors);
        let against = c.against.as_ref().unwrap();
        assert_eq!(
            (against.name.as_str(), against.unit.as_str(), against.values.len()),
            ("speed", "m/s", c.values.len())
        );
        // motors that push less than they say: the force follows what they are told, and with it the acceleration
        let mut record = recording(ROBOT, 800 + seed);
        record.torques_n_m.iter_mut().flatten().flatten().for_each(|u| *u *= 1.1);
        let c = needed(&record, Equation::Force);
        println!("{:?}", c.regressors.iter().map(|r| format!("{} {:.3}", r.name, r.share)).collect::<Vec<_>>());
        let share = |name: &str| c.regressors.iter().find(|r| r.name == name).map_or(0.0, |r| r.share);
        assert!(["torque_sum", "acceleration"].contains(&c.regressors[0].name.as_str()) && share("torque_sum") > 0.8);
    }
}

#[test]
#[ignore = "battery: drives of the generator"]
fn battery_several_drives_have_a_course_each() {
    use crate::gap::Drive;
    let config = Config::parse(ROBOT, "robot.toml").unwrap();
    let logs = [1, 2].map(|seed| drive(&config, Course::Brisk, 40.0, &simulate::Options::from(seed)).unwrap().log);
    let drives = logs.each_ref().map(|log| Drive::new(log, 0.0));
    let mut record = Record::of_drives(&config, &drives).unwrap();
    // the second gyro has a bias that grows, the first has not
    let second = record.drives().nth(1).unwrap();
    let times_s = record.times_s.clone();
    let gyro = record.gyro_rad_s.as_mut().unwrap();
    second.for_each(|k| gyro[k] += 2e-4 * times_s[k]);
    let c = needed(&record, Equation::Gyro);
    assert_eq!((c.starts.as_slice(), c.times_s.len()), (&[0, 41][..], 82));
    let rise = |from: usize| c.values[from + 40] - c.values[from];
    let [first, second] = [rise(0), rise(41)];
    let std = c.std[0].hypot(c.std[40]);
    // the ends of a band are independent nearly enough
    assert!(first.abs() < 4.0 * std && (second - 8e-3).abs() < 4.0 * std, "{first} {second} ± {std}");
}
