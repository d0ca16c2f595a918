//! Steps of the navigation filters, beside filterpy's extended Kalman filter on the same model and drive, and beside the
//! rolling filter with every loop written out (`filter/unrolled.rs`), all in one run.
//!
//! `cargo bench --bench filter`; the Python with numpy and filterpy is `$PYTHON`, or `python3`. Without filterpy its
//! rows are left out. A step is one prediction and three readings: gyro and both wheels. All must end in the same state.

use gyroid::config::Config;
use gyroid::navigate::{Filter, Input, MotionModel, RollingFilter, Sensor, Settings, SlipFilter, state};
use gyroid::signal::names;
use gyroid::simulate::{Course, Options, drive};
use gyroid::traction::TractionLaw;
use gyroid::units::STANDARD_GRAVITY_M_S2;
use gyroid::vehicle::Rolling;
use serde_json::{Value, json};
use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

#[path = "filter/unrolled.rs"]
mod unrolled;
use unrolled::Unrolled;

type Outcome<T> = Result<T, Box<dyn Error>>;

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 2e-6\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n";
/// Dry asphalt: at the accelerations of the drive the law is not bent, and one step of the model is enough.
const TRACTION: &str = "[traction.law.burckhardt]\nc1 = 1.2801\nc2 = 23.99\nc3 = 0.52\n";
const DT_S: f64 = 0.01;
const SINCE_POWER_ON_S: f64 = 20.0;
const DRIVE_S: f64 = 100.0;
const SETTLING_ROWS: usize = 200;

/// Interleaved; the median of them is told.
const REPETITIONS: usize = 7;
/// Passes over the drive of which a repetition takes the fastest.
const PASSES: usize = 20;
const PYTHON_PASSES: usize = 2;

/// Readings (gyro, left and right wheel) and torques of a row.
#[derive(Clone, Copy)]
struct Row {
    readings: [f64; 3],
    torques: [f64; 2],
}

fn rows(config: &Config) -> Outcome<Vec<Row>> {
    let options = Options { since_power_on_s: SINCE_POWER_ON_S, ..Options::from(1) };
    let log = drive(config, Course::FigureEight, DRIVE_S, &options)?.log;
    let column = |name| log.require(name);
    let readings = [column(names::GYRO_Z)?, column(names::WHEEL_LEFT)?, column(names::WHEEL_RIGHT)?];
    let torques = [column(names::TORQUE_LEFT)?, column(names::TORQUE_RIGHT)?];
    // nothing follows the last row
    let rows = 0..log.len() - 1;
    Ok(rows.map(|k| Row { readings: readings.map(|c| c[k]), torques: torques.map(|c| c[k]) }).collect())
}

fn run<const N: usize, M: MotionModel<N>>(first: &Filter<N, M>, rows: &[Row]) -> Filter<N, M> {
    let mut filter = first.clone();
    for row in rows {
        for (sensor, reading) in [Sensor::Gyro, Sensor::WheelLeft, Sensor::WheelRight].into_iter().zip(row.readings) {
            filter.update(sensor, reading);
        }
        filter.predict(Input::Torques(row.torques), DT_S);
    }
    filter
}

/// The filter after the first two seconds, and the rest of the drive: at the start the speed is unknown, and how a wheel
/// breaks loose in the filter's mind at standstill hangs on roundings.
fn settled<'a, const N: usize, M: MotionModel<N>>(first: &Filter<N, M>, rows: &'a [Row]) -> (Filter<N, M>, &'a [Row]) {
    let (start, rest) = rows.split_at(SETTLING_ROWS);
    (run(first, start), rest)
}

fn run_unrolled(first: &Unrolled, by_yaw_rate: f64, rows: &[Row]) -> Unrolled {
    let mut filter = first.clone();
    for row in rows {
        let [gyro, left, right] = row.readings;
        filter.gyro(gyro);
        filter.wheel(left, -by_yaw_rate);
        filter.wheel(right, by_yaw_rate);
        filter.predict(row.torques, DT_S);
    }
    filter
}

/// Seconds per step: the fastest of some passes over the drive.
fn seconds_per_step<T>(rows: &[Row], pass: impl Fn(&[Row]) -> T) -> f64 {
    let fastest = (0..PASSES).map(|_| {
        let begin = Instant::now();
        black_box(pass(black_box(rows)));
        begin.elapsed().as_secs_f64()
    });
    fastest.fold(f64::INFINITY, f64::min) / rows.len() as f64
}

/// The hand-written filter in the state of `first`, and its b/r.
fn unroll(config: &Config, first: &RollingFilter) -> Outcome<(Unrolled, f64)> {
    let (gyro, vehicle) = (config.require_gyro()?, config.require_vehicle()?);
    let robot = Rolling::new(vehicle);
    let forcing = robot.forcing([0.0; 2]);
    let upper = first.factors().unit_upper();
    let walk = gyro.noise.as_ref().and_then(|n| n.rate_random_walk_rad_s_sqrt_s).unwrap_or(0.0);
    let above_diagonal: Vec<f64> = (0..8).flat_map(|j| (0..j).map(move |i| (i, j))).map(|at| upper[at]).collect();
    let filter = Unrolled {
        mean: (*first.mean()).into(),
        u: above_diagonal.try_into().map_err(|_| "U has not 28 entries")?,
        d: *first.factors().diagonal(),
        a_by_torque: robot.acceleration_by_torque(),
        alpha_by_torque: robot.yaw_acceleration_by_torque(),
        damping: forcing.speed_damping_per_s,
        yaw_damping: forcing.yaw_damping_per_s,
        torque_variance: vehicle.torque_noise_n_m_sqrt_s.powi(2) / DT_S,
        walk: walk * walk,
        gyro_variance: gyro.angle_random_walk_rad_sqrt_s.powi(2) / DT_S,
        wheel_variance: config.require_encoder()?.speed_noise_std_rad_s.powi(2),
        wheel_by_speed: robot.wheel_by_motion()[1][0],
    };
    Ok((filter, robot.wheel_by_motion()[1][1]))
}

/// Fails if the two are further apart than 1e-10 standard deviations, or 1e-10 of a variance.
fn assert_same(ours: &RollingFilter, other: &Unrolled) -> Outcome<()> {
    let std = ours.std();
    for i in 0..8 {
        let variance: f64 =
            (i..8).map(|k| if k == i { other.d[k] } else { other.u[k * (k - 1) / 2 + i].powi(2) * other.d[k] }).sum();
        let apart = (ours.mean()[i] - other.mean[i]).abs() / std[i];
        let spread = (variance / (std[i] * std[i]) - 1.0).abs();
        if !(apart < 1e-10 && spread < 1e-10) {
            return Err(
                format!("unrolled: state {i} is {apart:e} standard deviations off, its variance {spread:e}").into()
            );
        }
    }
    Ok(())
}

/// What `filterpy_filter.py` needs to know of either filter.
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
        "passes": PYTHON_PASSES,
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

/// A model and a drive as files, and the script that takes them.
struct Filterpy {
    python: String,
    directory: tempfile::TempDir,
}

impl Filterpy {
    fn new(model: &Value, rows: &[Row]) -> Outcome<Self> {
        let directory = tempfile::tempdir()?;
        std::fs::write(directory.path().join("model.json"), model.to_string())?;
        let values = rows.iter().flat_map(|row| row.readings.into_iter().chain(row.torques));
        std::fs::write(directory.path().join("drive.bin"), values.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())?;
        Ok(Self { python: std::env::var("PYTHON").unwrap_or_else(|_| "python3".into()), directory })
    }

    /// Seconds per step; `None` without filterpy.
    fn seconds_per_step(&self) -> Outcome<Option<f64>> {
        let there = Command::new(&self.python).args(["-c", "import filterpy.kalman"]).output();
        if !there.is_ok_and(|out| out.status.success()) {
            return Ok(None);
        }
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/filterpy_filter.py");
        let files = ["model.json", "drive.bin"].map(|name| self.directory.path().join(name));
        let out = Command::new(&self.python).arg(script).args(files).output()?;
        if !out.status.success() {
            return Err(String::from_utf8_lossy(&out.stderr).into());
        }
        let answer: Value = serde_json::from_slice(&out.stdout)?;
        Ok(Some(answer["seconds_per_step"].as_f64().ok_or("no time from the script")?))
    }
}

/// Times of one contender.
struct Times(&'static str, Vec<f64>);

impl Times {
    fn median_s(&self) -> Option<f64> {
        let mut sorted = self.1.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }
}

fn main() -> Outcome<()> {
    let rolling_config = Config::parse(ROBOT, "robot.toml")?;
    let slip_config = Config::parse(&format!("{ROBOT}{TRACTION}"), "slipping_robot.toml")?;
    let (rolling_rows, slip_rows) = (rows(&rolling_config)?, rows(&slip_config)?);
    let (rolling, _) = RollingFilter::new(&rolling_config, &Settings::default(), SINCE_POWER_ON_S)?;
    let (slip, _) = SlipFilter::new(&slip_config, &Settings::default(), SINCE_POWER_ON_S)?;
    let (rolling, rolling_rows) = settled(&rolling, &rolling_rows);
    let (slip, slip_rows) = settled(&slip, &slip_rows);
    let (unrolled, by_yaw_rate) = unroll(&rolling_config, &rolling)?;
    let rolled = run(&rolling, rolling_rows);
    assert_same(&rolled, &run_unrolled(&unrolled, by_yaw_rate, rolling_rows))?;
    let rolling_python = Filterpy::new(&model(&rolling_config, &rolling, &rolled)?, rolling_rows)?;
    let slip_python = Filterpy::new(&model(&slip_config, &slip, &run(&slip, slip_rows))?, slip_rows)?;

    let mut times = ["rolling", "rolling, unrolled by hand", "rolling, filterpy", "slip", "slip, filterpy"]
        .map(|name| Times(name, Vec::new()));
    for _ in 0..REPETITIONS {
        times[0].1.push(seconds_per_step(rolling_rows, |rows| run(&rolling, rows)));
        times[1].1.push(seconds_per_step(rolling_rows, |rows| run_unrolled(&unrolled, by_yaw_rate, rows)));
        times[2].1.extend(rolling_python.seconds_per_step()?);
        times[3].1.push(seconds_per_step(slip_rows, |rows| run(&slip, rows)));
        times[4].1.extend(slip_python.seconds_per_step()?);
    }
    println!("A step: one prediction, three readings. Median of {REPETITIONS} interleaved repetitions, one thread.");
    println!("{:<28}{:>12}{:>16}{:>16}", "filter", "ns a step", "steps a second", "times gyroid's");
    for (at, contender) in times.iter().enumerate() {
        let Some(own) = times[if at < 3 { 0 } else { 3 }].median_s() else { continue };
        match contender.median_s() {
            Some(s) => println!("{:<28}{:>12.0}{:>16.0}{:>16.2}", contender.0, 1e9 * s, 1.0 / s, s / own),
            None => println!("{:<28}{:>12}", contender.0, "no filterpy"),
        }
    }
    Ok(())
}
