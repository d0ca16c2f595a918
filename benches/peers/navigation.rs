//! The drives and models that gyroid's navigation filters share with filterpy's.

use crate::drive::{DT_S, Outcome, ROBOT, Row, SINCE_POWER_ON_S, TRACTION, rows, run, settled, step};
use crate::making::read_raw;
use crate::ours::timed;
use gyroid::config::Config;
use gyroid::navigate::{Filter, MotionModel, RollingFilter, Settings, SlipFilter, state};
use gyroid::traction::TractionLaw;
use gyroid::units::STANDARD_GRAVITY_M_S2;
use gyroid::vehicle::Rolling;
use serde_json::{Value, json};
use std::path::Path;

/// Numbers of a row in the file: three readings, two torques, true x and y at its end.
const WIDTH: usize = 7;

fn config(task: &str) -> Outcome<Config> {
    let traction = if task == "slip" { TRACTION } else { "" };
    Ok(Config::parse(&format!("{ROBOT}{traction}"), "robot.toml")?)
}

/// Writes `TASK.json`, the model, and `TASK.bin`, the drive.
pub fn write(folder: &Path, task: &str) -> Outcome<()> {
    let config = config(task)?;
    let (rows, ends) = rows(&config)?;
    let model = match task {
        "slip" => passed(&config, &SlipFilter::new(&config, &Settings::default(), SINCE_POWER_ON_S)?.0, &rows)?,
        _ => passed(&config, &RollingFilter::new(&config, &Settings::default(), SINCE_POWER_ON_S)?.0, &rows)?,
    };
    std::fs::write(folder.join(format!("{task}.json")), model.to_string())?;
    let numbers = rows.iter().zip(ends).flat_map(|(row, end)| row.readings.into_iter().chain(row.torques).chain(end));
    Ok(std::fs::write(folder.join(format!("{task}.bin")), numbers.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())?)
}

fn passed<const N: usize, M: MotionModel<N>>(config: &Config, new: &Filter<N, M>, rows: &[Row]) -> Outcome<Value> {
    let (first, rest) = settled(new, rows);
    let mut model = model(config, &first, &run(&first, rest))?;
    model["settling_rows"] = json!(rows.len() - rest.len());
    Ok(model)
}

/// Time, memory and error of gyroid's filter over the drive beside the model `path`.
pub fn measured(task: &str, path: &Path) -> Outcome<Value> {
    let config = config(task)?;
    let numbers = read_raw(&path.with_extension("bin"))?;
    let rows = numbers.chunks_exact(WIDTH).map(|r| Row { readings: [r[0], r[1], r[2]], torques: [r[3], r[4]] });
    let rows: Vec<Row> = rows.collect();
    let (seconds, peak_mib, path) = match task {
        "slip" => track(&SlipFilter::new(&config, &Settings::default(), SINCE_POWER_ON_S)?.0, &rows)?,
        _ => track(&RollingFilter::new(&config, &Settings::default(), SINCE_POWER_ON_S)?.0, &rows)?,
    };
    let ends = numbers.chunks_exact(WIDTH).skip(rows.len() - path.len());
    let squares = path.iter().zip(ends).map(|(at, end)| (at[0] - end[5]).powi(2) + (at[1] - end[6]).powi(2));
    let error_m = (squares.sum::<f64>() / path.len() as f64).sqrt();
    let curve: Vec<_> = path.iter().enumerate().map(|(row, at)| (row as f64, at[0])).collect();
    let answers = json!({ "position error, m rms": { "estimate": error_m } });
    Ok(json!({ "seconds": seconds, "peak_mib": peak_mib, "answers": answers, "curve": curve }))
}

/// x and y (m) at the end of each row, once settled.
fn track<const N: usize, M: MotionModel<N>>(
    new: &Filter<N, M>,
    rows: &[Row],
) -> Outcome<(f64, Option<f64>, Vec<[f64; 2]>)> {
    let (first, rest) = settled(new, rows);
    timed(|| {
        let (mut filter, mut path) = (first.clone(), Vec::with_capacity(rest.len()));
        for row in rest {
            step(&mut filter, row);
            path.push([filter.mean()[state::X], filter.mean()[state::Y]]);
        }
        Ok(path)
    })
}

/// The numbers of a filter's model, its first and its last state, for `filterpy_filter.py`.
fn model<const N: usize, M: MotionModel<N>>(
    config: &Config,
    first: &Filter<N, M>,
    last: &Filter<N, M>,
) -> Outcome<Value> {
    let (gyro, vehicle) = (config.require_gyro()?, config.require_vehicle()?);
    let robot = Rolling::new(vehicle);
    let forcing = robot.forcing([0.0; 2]);
    let walk = gyro.noise.as_ref().and_then(|n| n.rate_random_walk_rad_s_sqrt_s).unwrap_or(0.0);
    let torque_variance = vehicle.torque_noise_n_m_sqrt_s.powi(2) / DT_S;
    let wheel_variance = config.require_encoder()?.speed_noise_std_rad_s.powi(2);
    let ln_t = first.mean()[state::LN_TIME_CONSTANT];
    let mut gyro_row = vec![0.0; N];
    (gyro_row[state::YAW_RATE], gyro_row[state::GYRO_ERROR]) = (1.0, 1.0);
    let wheel_row = |side| first.model().wheel_row(side).as_slice().to_vec();
    let covariance: Vec<Vec<f64>> = first.covariance().row_iter().map(|r| r.iter().copied().collect()).collect();
    let mut out = json!({
        "dt_s": DT_S,
        "acceleration_by_torque": robot.acceleration_by_torque(),
        "yaw_acceleration_by_torque": robot.yaw_acceleration_by_torque(),
        "speed_damping_per_s": forcing.speed_damping_per_s,
        "yaw_damping_per_s": forcing.yaw_damping_per_s,
        "reading_rows": [gyro_row, wheel_row(0), wheel_row(1)],
        "reading_variances": [gyro.angle_random_walk_rad_sqrt_s.powi(2) / DT_S, wheel_variance, wheel_variance],
        "disturbance_variances": [torque_variance, torque_variance],
        "walk_variance": walk * walk * DT_S,
        "ln_t_bounds": [ln_t - 2.0, ln_t + 2.0],
        "first_mean": first.mean().as_slice(),
        "first_covariance": covariance,
        "last_mean": last.mean().as_slice(),
        "last_std": last.std().as_slice(),
    });
    if let Some(traction) = &config.traction {
        let TractionLaw::Burckhardt(law) = traction.law else { return Err("the script knows Burckhardt's law".into()) };
        let load = vehicle.mass_kg * STANDARD_GRAVITY_M_S2 * traction.driven_load_share;
        out["burckhardt"] = json!([law.c1, law.c2, law.c3]);
        out["loads_n"] = json!([load * traction.left_load_share, load * (1.0 - traction.left_load_share)]);
        out["low_speed_m_s"] = json!(traction.low_speed_m_s);
        out["radius_m"] = json!(vehicle.wheel_radius_m);
        out["half_track_m"] = json!(vehicle.half_track_m);
        out["viscous_friction_n_m_s"] = json!(vehicle.viscous_friction_n_m_s);
        out["inverse_mass"] = json!(1.0 / vehicle.mass_kg);
        out["inverse_yaw_inertia"] = json!(1.0 / vehicle.yaw_inertia_kg_m2);
        out["inverse_wheel_inertia"] = json!(1.0 / vehicle.wheel_inertia_kg_m2);
    }
    Ok(out)
}
