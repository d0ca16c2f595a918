//! A robot, its drive and the filters' passes over it: for the benches `filter` and `peers`.

use gyroid::config::Config;
use gyroid::navigate::{Filter, Input, MotionModel, Sensor};
use gyroid::signal::names;
use gyroid::simulate::{Course, Options, drive};
use std::error::Error;

pub type Outcome<T> = Result<T, Box<dyn Error>>;

pub const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 2e-6\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n";
/// Dry asphalt: at the accelerations of the drive the law is not bent, and one step of the model is enough.
pub const TRACTION: &str = "[traction.law.burckhardt]\nc1 = 1.2801\nc2 = 23.99\nc3 = 0.52\n";
pub const DT_S: f64 = 0.01;
pub const SINCE_POWER_ON_S: f64 = 20.0;
const DRIVE_S: f64 = 100.0;
const SETTLING_ROWS: usize = 200;

/// Readings (gyro, left and right wheel) and torques of a row.
#[derive(Clone, Copy)]
pub struct Row {
    pub readings: [f64; 3],
    pub torques: [f64; 2],
}

/// Rows of a drive, and the true x and y (m) at the end of each.
pub fn rows(config: &Config) -> Outcome<(Vec<Row>, Vec<[f64; 2]>)> {
    let options = Options { since_power_on_s: SINCE_POWER_ON_S, ..Options::from(1) };
    let drive = drive(config, Course::FigureEight, DRIVE_S, &options)?;
    let column = |name| drive.log.require(name);
    let readings = [column(names::GYRO_Z)?, column(names::WHEEL_LEFT)?, column(names::WHEEL_RIGHT)?];
    let torques = [column(names::TORQUE_LEFT)?, column(names::TORQUE_RIGHT)?];
    let [x, y] = [drive.truth.require("x_m")?, drive.truth.require("y_m")?];
    // nothing follows the last row
    let rows = 0..drive.log.len() - 1;
    let ends = rows.clone().map(|k| [x[k + 1], y[k + 1]]).collect();
    Ok((rows.map(|k| Row { readings: readings.map(|c| c[k]), torques: torques.map(|c| c[k]) }).collect(), ends))
}

/// The filter after `rows`.
pub fn run<const N: usize, M: MotionModel<N>>(first: &Filter<N, M>, rows: &[Row]) -> Filter<N, M> {
    let mut filter = first.clone();
    for row in rows {
        step(&mut filter, row);
    }
    filter
}

/// Three readings and one prediction.
#[inline(always)]
pub fn step<const N: usize, M: MotionModel<N>>(filter: &mut Filter<N, M>, row: &Row) {
    for (sensor, reading) in [Sensor::Gyro, Sensor::WheelLeft, Sensor::WheelRight].into_iter().zip(row.readings) {
        filter.update(sensor, reading);
    }
    filter.predict(Input::Torques(row.torques), DT_S);
}

/// The filter after the first two seconds, and the rest of the drive: at the start the speed is unknown, and how a wheel
/// breaks loose in the filter's mind at standstill hangs on roundings.
pub fn settled<'a, const N: usize, M: MotionModel<N>>(
    first: &Filter<N, M>,
    rows: &'a [Row],
) -> (Filter<N, M>, &'a [Row]) {
    let (start, rest) = rows.split_at(SETTLING_ROWS);
    (run(first, start), rest)
}
