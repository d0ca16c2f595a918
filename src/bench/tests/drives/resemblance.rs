//! Which effects of drives look like which: what each effect alone, fitted to the end, gains on a drive that another made.
//!
//! `cargo test --lib bench::tests::drives::resemblance:: -- --ignored --nocapture` prints the table. Lattices, lost ticks and steps of the
//! bias are no smooth changes of the equations: they make drives here, and are not fitted.

use crate::config::{Config, EffectTable};
use crate::effects::drive::{DriveExplanation, ModelChange, by_id, registry};
use crate::effects::{Library, Parameters};
use crate::gap::drive::ekf::innovations::{Summed, run};
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::models;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::basis::Column;
use crate::simulate::{self, Course, drive_with};

const ROBOT: &str = include_str!("../../../../tests/common/robot.toml");
/// C2, ln C1 and ln T of the run, with their standard deviations as the configuration states them.
const NUISANCES: [(Column, f64); 3] = [(Column::TurnOn, 2e-4), (Column::WarmUpSize, 0.03), (Column::WarmUpTime, 0.03)];

/// Small enough that the filter stays close to linear.
const MADE: [(&str, &[(&str, f64)]); 21] = [
    ("wheel.slip", &[("compliance", 0.02)]),
    ("wheel.radius_mismatch", &[("right_over_left_minus_one", 0.003)]),
    ("wheel.radius_scale", &[("relative", -0.004)]),
    ("wheel.radius_left", &[("relative", -0.004)]),
    ("wheel.radius_right", &[("relative", 0.004)]),
    ("wheel.rolling_resistance", &[("coefficient", 0.003)]),
    ("wheel.lateral_skid", &[("lateral_slip_s", 0.02)]),
    ("vehicle.track_width", &[("relative", 0.006)]),
    ("vehicle.payload", &[("mass_relative", 0.02)]),
    ("vehicle.com_offset", &[("offset_m", -0.005)]),
    ("motor.torque_gain", &[("right_over_left_minus_one", 0.01)]),
    ("encoder.quantization", &[("lsb_rad_s", 0.08)]),
    ("encoder.missed_ticks", &[("loss_fraction", 0.02), ("share_of_time", 0.05)]),
    ("gyro.scale_factor", &[("relative", 0.006)]),
    ("gyro.scale_asymmetry", &[("relative", 0.008)]),
    ("gyro.vibration_rectification", &[("coefficient_rad_s_per_m2_s2", 0.003)]),
    ("gyro.bias_step", &[("step_rad_s", 0.001), ("time_s", 33.0)]),
    ("sensor.gyro_delay", &[("delay_s", 0.004)]),
    ("sensor.wheel_delay", &[("delay_s", 0.004)]),
    ("sensor.pose_delay", &[("delay_s", 0.006)]),
    ("ground.slope", &[("slope_rad", 0.002), ("uphill_heading_rad", 0.8)]),
];

fn recording(id: &str, parameters: &[(&str, f64)], seed: u64) -> Record {
    let nominal = Config::parse(ROBOT, "robot.toml").unwrap();
    let mut config = nominal.clone();
    let parameters: Parameters = parameters.iter().map(|(name, value)| ((*name).to_string(), *value)).collect();
    config.effects.push(EffectTable { id: id.into(), parameters });
    let options = simulate::Options { vary_turn_on: true, ..seed.into() };
    let log = drive_with(&config, Course::Brisk, 60.0, &options, &Library::new()).unwrap().log;
    Record::new(&nominal, &log, 0.0).unwrap()
}

/// Solves A x = b, A positive definite, by elimination.
fn solved(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for i in 0..n {
        let pivot = a[i].clone();
        for j in i + 1..n {
            let factor = a[j][i] / pivot[i];
            (i..n).for_each(|k| a[j][k] -= factor * pivot[k]);
            b[j] -= factor * b[i];
        }
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| a[i][k] * b[k]).sum();
        b[i] = (b[i] - known) / a[i][i];
    }
    b
}

/// The best step from here over the first `columns`, and ln p after it; the first three have priors. Innovations are slopes
/// times what is missing, plus noise.
fn best(summed: &Summed, columns: usize) -> (Vec<f64>, f64) {
    let gram = &summed.gram;
    let last = gram.ncols() - 1;
    let a = (0..columns).map(|i| {
        let prior = |j: usize| NUISANCES.get(i).filter(|_| i == j).map_or(0.0, |n| n.1.powi(-2));
        (0..columns).map(|j| gram[(i, j)] + prior(j)).collect()
    });
    let b: Vec<f64> = (0..columns).map(|i| gram[(i, last)]).collect();
    let x = solved(a.collect(), b.clone());
    let explained: f64 = x.iter().zip(&b).map(|(x, b)| x * b).sum();
    (x, summed.ln_likelihood() + 0.5 * explained)
}

/// Largest ln p over nominal with this change alone, nats: Gauss and Newton, steps halved until they gain.
fn gain(record: &Record, change: &'static dyn ModelChange) -> f64 {
    let coordinates = change.coordinates();
    let mut columns: Vec<Column> = NUISANCES.map(|n| n.0).to_vec();
    columns.extend((0..coordinates.len()).map(|j| Column::Coordinate(0, j)));
    let noise = Noise::believed(record, None);
    let sum =
        |theta: &[f64]| run(record, &models(record, &[change], &vec![theta.to_vec()], true), &noise, &columns, |_| {});
    let mut theta = vec![0.0; coordinates.len()];
    let mut here = sum(&theta);
    let nominal = best(&here, NUISANCES.len()).1;
    let mut top = nominal;
    'steps: for _ in 0..12 {
        let (step, _) = best(&here, columns.len());
        let mut factor = 1.0;
        for _ in 0..5 {
            let beside: Vec<f64> = (0..theta.len())
                .map(|j| {
                    let [low, high] = coordinates[j].bounds;
                    (theta[j] + factor * step[NUISANCES.len() + j]).clamp(low, high)
                })
                .collect();
            let there = sum(&beside);
            let weight = best(&there, NUISANCES.len()).1;
            if weight > top {
                let settled = weight - top < 0.01;
                (theta, here, top) = (beside, there, weight);
                if settled {
                    break 'steps;
                }
                continue 'steps;
            }
            factor *= 0.5;
        }
        break;
    }
    top - nominal
}

fn smooth(id: &str) -> Option<&'static dyn ModelChange> {
    match by_id(id).unwrap().explanation() {
        DriveExplanation::Model(change) => Some(change),
        _ => None,
    }
}

#[test]
fn each_effect_explains_its_own_drive_best() {
    for made in ["gyro.scale_factor", "vehicle.payload", "wheel.radius_scale"] {
        let (id, parameters) = MADE.iter().find(|m| m.0 == made).unwrap();
        let record = recording(id, parameters, 500);
        let right = gain(&record, smooth(id).unwrap());
        assert!(right > 20.0, "{id} gains {right}");
        for other in ["gyro.scale_factor", "vehicle.payload", "wheel.radius_scale", "ground.slope"] {
            let wrong = gain(&record, smooth(other).unwrap());
            assert!(other == made || wrong < 0.9 * right, "{other} gains {wrong} on a drive of {made}, {right}");
        }
    }
}

#[test]
#[ignore = "21 drives, 18 effects fitted to each"]
fn resemblance_of_all_pairs() {
    let short = |id: &str| id.split('.').nth(1).unwrap_or(id).replace('_', " ");
    let fitted: Vec<_> = registry().iter().filter_map(|e| Some((e.about().id, smooth(e.about().id)?))).collect();
    let heads: Vec<String> = fitted.iter().map(|f| short(f.0)).collect();
    println!("| made by | most, nats | {} |", heads.join(" | "));
    println!("|---|---|{}", "---|".repeat(heads.len()));
    for (id, parameters) in MADE {
        let record = recording(id, parameters, 500);
        let gains: Vec<f64> = fitted.iter().map(|f| gain(&record, f.1)).collect();
        let most = gains.iter().copied().fold(1.0, f64::max);
        let row: Vec<String> = gains.iter().map(|g| format!("{:.2}", g / most)).collect();
        println!("| {} | {most:.0} | {} |", short(id), row.join(" | "));
    }
}
