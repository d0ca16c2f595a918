//! Physical ranges: a value outside cannot be meant.

use super::custom;
use super::noise::{NoiseTerm, NoiseTerms};
use super::schema::{Config, Gyro, Kind};
use super::temperature::Temperature;
use crate::bias::Discrete;
use crate::error::{Error, ErrorKind, Result};

/// Where a value must lie.
#[derive(Clone, Copy)]
enum Range {
    /// finite
    Finite,
    /// > 0 and finite
    Positive,
    /// >= 0 and finite
    NotNegative,
    /// |x| below the bound and finite
    Within(f64),
    /// > 0 and <= 1
    Share,
    /// <= 1 and finite
    AtMostOne,
}

/// No gyro of a mobile robot is off by more at rest: 100 rad/s is 5700 °/s.
const RATE_BOUND_RAD_S: f64 = 100.0;
/// No gyro works that far from 0 °C.
const HOTTEST_C: f64 = 300.0;

/// The Earth turns at 7.292e-5 rad/s.
const EARTH_BOUND_RAD_S: f64 = 7.3e-5;

impl Range {
    fn holds(self, x: f64) -> bool {
        x.is_finite()
            && match self {
                Self::Finite => true,
                Self::Positive => x > 0.0,
                Self::NotNegative => x >= 0.0,
                Self::Within(bound) => x.abs() < bound,
                Self::Share => x > 0.0 && x <= 1.0,
                Self::AtMostOne => x <= 1.0,
            }
    }

    fn words(self) -> String {
        match self {
            Self::Finite => "a finite number".into(),
            Self::Positive => "a positive number".into(),
            Self::NotNegative => "zero or a positive number".into(),
            Self::Within(bound) => format!("a number between -{bound} and {bound}"),
            Self::Share => "a part above 0 and at most 1".into(),
            Self::AtMostOne => "a number of at most 1".into(),
        }
    }
}

/// Refuses what is not physical, and discretisations that do not belong to their model.
pub(super) fn physical(config: &Config, name: &str) -> Result<()> {
    let one = |key: &str, value: f64, range: Range| {
        if range.holds(value) {
            return Ok(());
        }
        Err(Error::new(ErrorKind::Config, name, format!("{value} is not physical"))
            .at(format!("`{key}`"))
            .hint(format!("expected {}", range.words())))
    };
    let maybe = |key: &str, value: Option<f64>, range| value.map_or(Ok(()), |v| one(key, v, range));
    use Range::{AtMostOne, Finite, NotNegative, Positive, Share, Within};

    maybe("sample_time_s", config.sample_time_s, Positive)?;
    if let Some(g) = &config.gyro {
        one("gyro.c1_rad_s", g.c1_rad_s, Within(RATE_BOUND_RAD_S))?;
        one("gyro.c2_rad_s", g.c2_rad_s, Within(RATE_BOUND_RAD_S))?;
        one("gyro.time_constant_s", g.time_constant_s, Positive)?;
        one("gyro.angle_random_walk_rad_sqrt_s", g.angle_random_walk_rad_sqrt_s, NotNegative)?;
        maybe("gyro.earth_rate_rad_s", g.earth_rate_rad_s, Within(EARTH_BOUND_RAD_S))?;
        maybe("gyro.turn_on_bias_std_rad_s", g.turn_on_bias_std_rad_s, NotNegative)?;
        maybe("gyro.warm_up_relative_std", g.warm_up_relative_std, NotNegative)?;
        maybe("gyro.cooling_time_constant_s", g.cooling_time_constant_s, Positive)?;
        maybe("gyro.last_run.warm_up_age_s", g.last_run.map(|l| l.warm_up_age_s), NotNegative)?;
        if let Some(noise) = &g.noise {
            maybe("gyro.noise.rate_random_walk_rad_s_sqrt_s", noise.rate_random_walk_rad_s_sqrt_s, NotNegative)?;
            maybe("gyro.noise.quantization_lsb_rad_s", noise.quantization_lsb_rad_s, NotNegative)?;
            maybe("gyro.noise.bandwidth_cutoff_hz", noise.bandwidth_cutoff_hz, Positive)?;
            for band in &noise.narrow_band {
                one("gyro.noise.narrow_band.center_hz", band.center_hz, Positive)?;
                one("gyro.noise.narrow_band.bandwidth_hz", band.bandwidth_hz, Positive)?;
                one("gyro.noise.narrow_band.std_rad_s", band.std_rad_s, NotNegative)?;
            }
            if let Some(terms) = &noise.terms {
                noise_terms(g, terms, name)?;
            }
        }
        if let Some(c) = &g.covariance {
            covariance(&c.to_matrix(), name, "gyro.covariance", ["c1", "c2", "time_constant"])?;
        }
        if let Some(t) = &g.temperature {
            temperature(t, name, &one)?;
        }
        if let Some(d) = &g.discrete {
            discrete(d, config, name)?;
        }
    }
    if let Some(v) = &config.vehicle {
        one("vehicle.mass_kg", v.mass_kg, Positive)?;
        one("vehicle.yaw_inertia_kg_m2", v.yaw_inertia_kg_m2, Positive)?;
        one("vehicle.half_track_m", v.half_track_m, Positive)?;
        one("vehicle.wheel_radius_m", v.wheel_radius_m, Positive)?;
        one("vehicle.wheel_inertia_kg_m2", v.wheel_inertia_kg_m2, NotNegative)?;
        one("vehicle.viscous_friction_n_m_s", v.viscous_friction_n_m_s, NotNegative)?;
        one("vehicle.torque_noise_n_m_sqrt_s", v.torque_noise_n_m_sqrt_s, NotNegative)?;
        maybe("vehicle.torque_constant_n_m_a", v.torque_constant_n_m_a, Positive)?;
    }
    if let Some(t) = &config.traction {
        one("traction.low_speed_m_s", t.low_speed_m_s, Positive)?;
        one("traction.driven_load_share", t.driven_load_share, Share)?;
        one("traction.left_load_share", t.left_load_share, Share)?;
        one("traction.rolling_resistance", t.rolling_resistance, NotNegative)?;
        for (key, value) in t.law.parameters() {
            let range = match key {
                "c3" => NotNegative,
                "e" => AtMostOne,
                _ => Positive,
            };
            one(&format!("traction.law.{}.{key}", t.law.name()), value, range)?;
        }
    }
    if let Some(e) = &config.encoder {
        one("encoder.speed_noise_std_rad_s", e.speed_noise_std_rad_s, NotNegative)?;
        maybe("encoder.ticks_per_revolution", e.ticks_per_revolution, Positive)?;
    }
    if let Some(p) = &config.pose {
        one("pose.rate_hz", p.rate_hz, Positive)?;
        one("pose.position_std_m", p.position_std_m, NotNegative)?;
        one("pose.heading_std_rad", p.heading_std_rad, NotNegative)?;
        maybe("pose.lever_arm_std_m", p.lever_arm_std_m, NotNegative)?;
        maybe("pose.heading_offset_std_rad", p.heading_offset_std_rad, NotNegative)?;
        maybe("pose.delay_std_s", p.delay_std_s, NotNegative)?;
        maybe("pose.correlation_time_s", p.correlation_time_s, NotNegative)?;
    }
    for effect in &config.effects {
        for (key, value) in &effect.parameters {
            one(&format!("effect.{}.{key}", effect.id), *value, Finite)?;
        }
    }
    custom::check(&config.custom_effects, config.kind == Kind::Driving, name)?;
    let needs_robot = config.kind == Kind::Driving && config.gyro.is_some();
    if needs_robot && (config.vehicle.is_none() || config.encoder.is_none()) {
        return Err(Error::new(ErrorKind::Config, name, "kind is \"driving\", and [vehicle] or [encoder] is missing")
            .at("`kind`")
            .hint("add the table, or set kind = \"stationary\""));
    }
    Ok(())
}

/// Checks that each term lies inside its interval, and agrees with the key that simulator and filter read.
fn noise_terms(gyro: &Gyro, terms: &NoiseTerms, name: &str) -> Result<()> {
    let refuse = |key: &str, found: String, hint: &str| {
        Err(Error::new(ErrorKind::Config, name, found).at(format!("`gyro.noise.terms.{key}`")).hint(hint))
    };
    let markov = terms.gauss_markov_rad_s;
    let sigma = markov.map(|m| NoiseTerm { estimate: m.estimate, std: m.std, ci95: m.ci95 });
    for (key, term) in [
        ("quantization_rad", terms.quantization_rad),
        ("angle_random_walk_rad_sqrt_s", terms.angle_random_walk_rad_sqrt_s),
        ("bias_instability_rad_s", terms.bias_instability_rad_s),
        ("rate_random_walk_rad_s_sqrt_s", terms.rate_random_walk_rad_s_sqrt_s),
        ("rate_ramp_rad_s2", terms.rate_ramp_rad_s2),
        ("gauss_markov_rad_s", sigma),
    ] {
        let Some(NoiseTerm { estimate, std, ci95: [low, high] }) = term else { continue };
        // a ramp has a sign
        let signed = key == "rate_ramp_rad_s2";
        if !(estimate.is_finite() && (signed || estimate >= 0.0) && std >= 0.0) {
            let found = format!("{estimate} with the standard deviation {std} is not physical");
            return refuse(key, found, "neither is negative");
        }
        if !(low <= estimate && estimate <= high) {
            let found = format!("the estimate {estimate} lies outside its interval {low} to {high}");
            return refuse(key, found, "write the lower end first, and the estimate between the ends");
        }
    }
    if let Some(m) = markov
        && !(m.correlation_time_s > 0.0 && m.correlation_time_s.is_finite())
    {
        let found = format!("correlation_time_s = {} is not physical", m.correlation_time_s);
        return refuse("gauss_markov_rad_s", found, "expected a positive number");
    }
    let walk = gyro.noise.as_ref().and_then(|n| n.rate_random_walk_rad_s_sqrt_s);
    for (key, term, own) in [
        (
            "angle_random_walk_rad_sqrt_s",
            terms.angle_random_walk_rad_sqrt_s,
            Some(("gyro.angle_random_walk_rad_sqrt_s", gyro.angle_random_walk_rad_sqrt_s)),
        ),
        (
            "rate_random_walk_rad_s_sqrt_s",
            terms.rate_random_walk_rad_s_sqrt_s,
            walk.map(|k| ("gyro.noise.rate_random_walk_rad_s_sqrt_s", k)),
        ),
    ] {
        if let (Some(term), Some((own_key, own))) = (term, own)
            && (term.estimate - own).abs() > 1e-9 * own.abs()
        {
            let found = format!("{} here, and {own} in {own_key}, which simulator and filter read", term.estimate);
            return refuse(key, found, "make them the same, or delete the term");
        }
    }
    Ok(())
}

/// Checks that temperatures are plausible for electronics, and that over ten degrees the error stays within a gyro's
/// bounds.
fn temperature(t: &Temperature, name: &str, one: &dyn Fn(&str, f64, Range) -> Result<()>) -> Result<()> {
    use Range::Within;
    one("gyro.temperature.reference_c", t.reference_c, Within(HOTTEST_C))?;
    one("gyro.temperature.bias_rad_s", t.bias_rad_s, Within(RATE_BOUND_RAD_S))?;
    one("gyro.temperature.sensitivity_rad_s_k", t.sensitivity_rad_s_k, Within(RATE_BOUND_RAD_S / 10.0))?;
    if let Some(q) = t.curvature_rad_s_k2 {
        one("gyro.temperature.curvature_rad_s_k2", q, Within(RATE_BOUND_RAD_S / 100.0))?;
    }
    match &t.covariance {
        Some(c) => {
            covariance(&c.to_matrix(), name, "gyro.temperature.covariance", ["bias", "sensitivity", "curvature"])
        }
        None => Ok(()),
    }
}

/// Checks that no variance is negative and no correlation is beyond one.
fn covariance(m: &[[f64; 3]; 3], name: &str, table: &str, keys: [&str; 3]) -> Result<()> {
    for i in 0..3 {
        for j in 0..=i {
            let bound = (m[i][i] * m[j][j]).sqrt() * (1.0 + 1e-9);
            if !(m[i][j].is_finite() && m[i][i] >= 0.0 && m[i][j].abs() <= bound) {
                let found = format!("{} for {} and {} is no covariance", m[i][j], keys[j], keys[i]);
                return Err(Error::new(ErrorKind::Config, name, found)
                    .at(format!("`{table}`"))
                    .hint("variances are not negative, and correlations lie between -1 and 1"));
            }
        }
    }
    Ok(())
}

/// Checks that decay, drive and initial are those of the model; otherwise filter and simulator would disagree.
fn discrete(d: &Discrete, config: &Config, name: &str) -> Result<()> {
    let Some(gyro) = &config.gyro else { return Ok(()) };
    let model = gyro.warm_up();
    let expected = Discrete::new(&model, d.sample_time_s, d.scheme).map_err(|e| e.named(name))?;
    let scale = model.c1_rad_s.abs() + model.c2_rad_s.abs();
    for (key, found, wanted, unit) in [
        ("decay", d.decay, expected.decay, 1.0),
        ("drive", d.drive, expected.drive, scale),
        ("initial", d.initial, expected.initial, scale),
    ] {
        let close = (found - wanted).abs() <= 1e-9 * unit.max(f64::MIN_POSITIVE);
        if !close {
            return Err(Error::new(
                ErrorKind::Config,
                name,
                format!("{found} does not belong to this model: {wanted}"),
            )
            .at(format!("`gyro.discrete.{key}`"))
            .hint("write the file anew with gyroid fit, or delete [gyro.discrete]"));
        }
    }
    Ok(())
}
