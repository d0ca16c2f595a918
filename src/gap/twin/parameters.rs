//! Parameters of a twin of drives from its fit, with standard deviations and intervals.

use super::constants::Constant;
use super::refine::{Fitted, Fitting, Level, Normal};
use super::told::{Parameter, Provenance};
use crate::config::Config;
use crate::effects::Parameters;
use crate::effects::drive::ModelChange;
use crate::math::random_effects::{Observed, spread};
use std::collections::BTreeMap;

/// By name; constants that the log does not tell are known from `given`.
pub(super) fn parameters(
    config: &Config,
    fitting: &Fitting,
    normal: &Normal,
    given: Provenance,
    runs: usize,
) -> BTreeMap<String, Parameter> {
    let mut parameters = BTreeMap::new();
    let mut tell = |name: &str, parameter: Parameter| {
        parameters.insert(name.to_string(), parameter);
    };
    let std = |c: Constant| normal.told(Fitted::Constant(c)).map(|t| t[1]);
    if let Some(v) = &config.vehicle {
        for (name, value, constant, unit) in [
            ("mass_kg", v.mass_kg, Constant::Mass, "kg"),
            ("yaw_inertia_kg_m2", v.yaw_inertia_kg_m2, Constant::Inertia, "kg m2"),
            ("half_track_m", v.half_track_m, Constant::Track, "m"),
            ("wheel_radius_m", v.wheel_radius_m, Constant::Radius, "m"),
        ] {
            let parameter = match std(constant) {
                Some(std) => Parameter::positive(value, std, unit),
                None => Parameter::kept(value, unit, given),
            };
            tell(name, parameter);
        }
        if let Some([ratio, ratio_std]) = normal.told(Fitted::Constant(Constant::RadiusRatio)) {
            let [radius, own] = [Constant::Radius, Constant::RadiusRatio].map(Fitted::Constant);
            let (variance, shared) = (normal.between(radius, radius), normal.between(radius, own));
            let both = normal.told(radius).map_or(0.0, |t| t[0]);
            for (name, sign) in [("wheel_radius_left_m", -0.5), ("wheel_radius_right_m", 0.5)] {
                let std = (variance + 2.0 * sign * shared + 0.25 * ratio_std.powi(2)).max(0.0).sqrt();
                tell(name, Parameter::positive(v.wheel_radius_m * (both + sign * ratio).exp(), std, "m"));
            }
        }
        let viscous = v.viscous_friction_n_m_s;
        let friction = std(Constant::Viscous).map(|std| Parameter::told(viscous, std, "N m s"));
        tell("viscous_friction_n_m_s", friction.unwrap_or_else(|| Parameter::kept(viscous, "N m s", given)));
        tell("wheel_inertia_kg_m2", Parameter::kept(v.wheel_inertia_kg_m2, "kg m2", given));
    }
    let levels = fitting.level_stds();
    let without_torques = fitting.record.torques_n_m.is_none();
    let mut level = |name: &str, value: f64, of: Level, unit: &str| {
        let std = levels.iter().find(|l| l.0 == of).map_or(f64::INFINITY, |l| l.1);
        tell(name, Parameter::positive(value, std, unit));
    };
    if let (Some(v), false) = (&config.vehicle, without_torques) {
        level("torque_noise_n_m_sqrt_s", v.torque_noise_n_m_sqrt_s, Level::Torque, "N m sqrt(s)");
    }
    if let Some(e) = &config.encoder {
        level("encoder_speed_noise_std_rad_s", e.speed_noise_std_rad_s, Level::Wheels, "rad/s");
    }
    if let Some(p) = &config.pose {
        level("pose_position_std_m", p.position_std_m, Level::Position, "m");
        level("pose_heading_std_rad", p.heading_std_rad, Level::Heading, "rad");
    }
    if let Some(g) = &config.gyro {
        level("gyro_angle_random_walk_rad_sqrt_s", g.angle_random_walk_rad_sqrt_s, Level::Gyro, "rad/sqrt(s)");
        if let Some([_, own, _]) = turn_ons(normal, runs) {
            tell("gyro_c2_rad_s", Parameter::told(g.c2_rad_s, own, "rad/s"));
        }
        if let Some(std) = std(Constant::WarmUp) {
            tell("gyro_c1_rad_s", Parameter::told(g.c1_rad_s, std, "rad/s"));
            tell("gyro_time_constant_s", Parameter::kept(g.time_constant_s, "s", Provenance::Log));
        }
    }
    parameters
}

/// Standard deviations of parameters from those of coordinates, to first order.
pub(super) fn moved(change: &dyn ModelChange, theta: &[f64], stds: &[f64]) -> Parameters {
    let here = change.parameters(theta);
    let mut squares = Parameters::new();
    for (j, std) in stds.iter().enumerate() {
        let mut there = theta.to_vec();
        there[j] += std;
        for (name, value) in change.parameters(&there) {
            *squares.entry(name.clone()).or_insert(0.0) += (value - here.get(&name).copied().unwrap_or(value)).powi(2);
        }
    }
    squares.into_iter().map(|(name, square)| (name, square.sqrt())).collect()
}

/// Mean over the runs of the gyro's turn-on bias beside the one that is believed, the standard deviation of that mean, and the
/// spread between runs, rad/s.
pub(super) fn turn_ons(normal: &Normal, runs: usize) -> Option<[f64; 3]> {
    let each: Vec<[f64; 2]> = (0..runs).filter_map(|d| normal.told(Fitted::TurnOn(d))).collect();
    let first = each.first()?;
    let observed: Vec<Observed<1>> = each.iter().map(|t| Observed::number(t[0], t[1])).collect();
    Some(match spread(&observed) {
        Some(spread) => [spread.mean[0], spread.mean_covariance[0].sqrt(), spread.std],
        None => [first[0], first[1], 0.0],
    })
}
