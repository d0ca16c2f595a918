//! A gyro at rest and a robot, and answers as JSON.

use crate::place::Place;
use serde_json::Value;

pub(crate) const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.5\n\
    [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 120.0\nangle_random_walk_rad_sqrt_s = 1e-4\n\
    turn_on_bias_std_rad_s = 5e-3\nwarm_up_relative_std = 0.1\n";
const DRIVING: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
    [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 1e-3\ntime_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 5e-3\nwarm_up_relative_std = 0.1\n\
    [vehicle]\nmass_kg = 14.0\nyaw_inertia_kg_m2 = 0.4\nhalf_track_m = 0.2\nwheel_radius_m = 0.07\n\
    wheel_inertia_kg_m2 = 0.001\nviscous_friction_n_m_s = 0.002\ntorque_noise_n_m_sqrt_s = 0.001\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n";

/// The robot, with a pose of this rate, Hz, and noise, m and rad.
pub(crate) fn driving(rate_hz: f64, std: f64) -> String {
    format!("{DRIVING}[pose]\nrate_hz = {rate_hz:?}\nposition_std_m = {std:?}\nheading_std_rad = {std:?}\n")
}

/// Answer of the command `line`.
pub(crate) fn json(place: &Place, line: &str) -> Value {
    serde_json::from_str(&place.ok(&format!("{line} --json -"))).unwrap()
}
