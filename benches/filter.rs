//! Steps of the navigation filters, beside the rolling filter with every loop written out (`filter/unrolled.rs`), in one run.
//!
//! `cargo bench --bench filter`. A step is one prediction and three readings: gyro and both wheels. Both rolling filters must
//! end in the same state. filterpy's filters stand in `cargo bench --bench peers`.

use gyroid::config::Config;
use gyroid::navigate::{RollingFilter, Settings, SlipFilter};
use gyroid::vehicle::Rolling;
use std::hint::black_box;
use std::time::Instant;

#[path = "filter/drive.rs"]
mod drive;
#[path = "filter/unrolled.rs"]
mod unrolled;
use drive::{DT_S, Outcome, ROBOT, Row, SINCE_POWER_ON_S, TRACTION, rows, run, settled};
use unrolled::Unrolled;

/// Interleaved; the median of them is told.
const REPETITIONS: usize = 7;
/// Passes over the drive of which a repetition takes the fastest.
const PASSES: usize = 20;

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

fn median(seconds: &mut [f64]) -> f64 {
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

fn main() -> Outcome<()> {
    let rolling_config = Config::parse(ROBOT, "robot.toml")?;
    let slip_config = Config::parse(&format!("{ROBOT}{TRACTION}"), "slipping_robot.toml")?;
    let (rolling_rows, slip_rows) = (rows(&rolling_config)?.0, rows(&slip_config)?.0);
    let (rolling, _) = RollingFilter::new(&rolling_config, &Settings::default(), SINCE_POWER_ON_S)?;
    let (slip, _) = SlipFilter::new(&slip_config, &Settings::default(), SINCE_POWER_ON_S)?;
    let (rolling, rolling_rows) = settled(&rolling, &rolling_rows);
    let (slip, slip_rows) = settled(&slip, &slip_rows);
    let (unrolled, by_yaw_rate) = unroll(&rolling_config, &rolling)?;
    assert_same(&run(&rolling, rolling_rows), &run_unrolled(&unrolled, by_yaw_rate, rolling_rows))?;

    let mut times = ["rolling", "rolling, unrolled by hand", "slip"].map(|name| (name, Vec::new()));
    for _ in 0..REPETITIONS {
        times[0].1.push(seconds_per_step(rolling_rows, |rows| run(&rolling, rows)));
        times[1].1.push(seconds_per_step(rolling_rows, |rows| run_unrolled(&unrolled, by_yaw_rate, rows)));
        times[2].1.push(seconds_per_step(slip_rows, |rows| run(&slip, rows)));
    }
    println!("A step: one prediction, three readings. Median of {REPETITIONS} interleaved repetitions, one thread.");
    println!("{:<28}{:>12}{:>16}", "filter", "ns a step", "steps a second");
    for (name, mut seconds) in times {
        let s = median(&mut seconds);
        println!("{name:<28}{:>12.0}{:>16.0}", 1e9 * s, 1.0 / s);
    }
    Ok(())
}
