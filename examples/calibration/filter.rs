//! The filter's standard deviations at the end of a drive, and its own tests of consistency.

use crate::table::{Claim, Row, counts};
use gyroid::Result;
use gyroid::config::Config;
use gyroid::navigate::{self, Estimate, Settings};
use gyroid::signal::names;
use gyroid::simulate::{self, Course, drive, truth_names};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 1e-3\nwarm_up_relative_std = 0.1\n[gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 1e-5\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 8e-4\nviscous_friction_n_m_s = 6e-4\ntorque_noise_n_m_sqrt_s = 4e-4\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 2e-3\nheading_std_rad = 2e-3\n";
const DURATION_S: f64 = 60.0;

struct Drive {
    /// Whether x, y, heading and the gyro's error lie inside ± 1.96 standard deviations.
    inside: [bool; 4],
    nis: bool,
    unbiased: bool,
    white: bool,
    /// Whether each sensor's mean NIS lies inside its 99.9 % bounds.
    sensors: Vec<bool>,
}

fn driven(config: &Config, seed: u64) -> Result<Drive> {
    let options = simulate::Options { vary_turn_on: true, ..seed.into() };
    let made = drive(config, Course::Random, DURATION_S, &options)?;
    let summary = navigate::run(config, &made.log, &Settings::default())?.summary;
    let last = |name: &str| made.truth.require(name).map(|v| v[v.len() - 1]);
    let held = |e: Estimate, error: f64| error.abs() <= 1.96 * e.std;
    let end = summary.final_pose;
    let turn = end.heading_rad.estimate - last(names::HEADING)?;
    let inside = [
        held(end.x_m, end.x_m.estimate - last(names::X)?),
        held(end.y_m, end.y_m.estimate - last(names::Y)?),
        held(end.heading_rad, (turn + PI).rem_euclid(TAU) - PI),
        held(end.gyro_error_rad_s, end.gyro_error_rad_s.estimate - last(truth_names::GYRO_ERROR)?),
    ];
    let c = summary.consistency;
    let sensors = c.sensors.iter().map(|s| s.fit_for_use).collect();
    Ok(Drive { inside, nis: c.nis_holds, unbiased: c.unbiased, white: c.white, sensors })
}

pub fn rows(logs: u64) -> Result<Vec<Row>> {
    let config = Config::parse(ROBOT, "calibration")?;
    let drives: Vec<Drive> = (0..logs).into_par_iter().map(|i| driven(&config, 301_000 + i)).collect::<Result<_>>()?;
    let of = |held: &dyn Fn(&Drive) -> bool| counts(drives.iter().map(|d| Some(held(d))));
    let mut rows: Vec<Row> = ["x", "y", "heading", "gyro error"]
        .iter()
        .enumerate()
        .map(|(j, name)| Row::interval(format!("{name} at the end of a drive, ± 1.96 std"), of(&|d| d.inside[j])))
        .collect();
    rows.push(Row::interval("mean NIS of a drive", of(&|d| d.nis)));
    rows.push(Row::interval("innovations unbiased, joint test", of(&|d| d.unbiased)));
    rows.push(Row::interval("innovations white at lag one, joint test", of(&|d| d.white)));
    let sensors = counts(drives.iter().flat_map(|d| &d.sensors).map(|s| Some(*s)));
    rows.push(Row::new("mean NIS of a sensor, bounds of 99.9 %", Claim::Exactly(0.999), sensors));
    Ok(rows)
}
