//! The navigation filter on simulated and recorded drives, and `gyroid simulate` and `gyroid navigate` as a user runs
//! them.

mod augmented;
#[path = "../common/cases.rs"]
mod cases;
mod commands;
mod definite;
mod encoder_ticks;
mod example_data;
mod filter;
mod fit_for_use;
mod long_run;
#[path = "../common/place.rs"]
mod place;
mod real_drives;
mod recording;
mod sensors;
mod standstill;
mod warm_restart;

/// A robot with every sensor, at 100 Hz.
const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";
