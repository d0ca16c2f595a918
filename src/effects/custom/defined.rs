//! A table `[[custom_effect]]` with its expression read, and the description that the library's effects bring along.

use super::quantities::{InDrives, QUANTITIES, follows};
use crate::config::{ActsOn, CustomEffect, CustomParameter, Law};
use crate::effects::about::{About, Parameter, Parameters};
use crate::error::Result;
use crate::signal::names;

/// A definition, ready to be evaluated and described.
#[derive(Debug)]
pub(super) struct Defined {
    pub about: &'static About,
    pub table: CustomEffect,
    pub law: Law,
    pub drives: InDrives,
}

impl Defined {
    /// The definition with its expression read.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Config`] for an expression that cannot be read.
    pub(super) fn new(definition: &CustomEffect) -> Result<Self> {
        let law = definition.law("configuration")?;
        let about = Box::leak(Box::new(described(definition, &law)));
        let drives = InDrives::of(definition, &law);
        Ok(Self { about, table: definition.clone(), law, drives })
    }

    /// Values of all parameters in the order of their tables, NaN of one that is missing.
    pub(super) fn values(&self, parameters: &Parameters) -> Vec<f64> {
        self.table.parameters.iter().map(|p| parameters.get(&p.name).copied().unwrap_or(f64::NAN)).collect()
    }

    /// Whether the expression has the signal `name`.
    pub(super) fn follows(&self, name: &str) -> bool {
        follows(&self.table, &self.law, name)
    }

    /// Parameters by name, inside their bounds.
    pub(super) fn named(&self, values: &[f64]) -> Parameters {
        let inside = |(p, v): (&CustomParameter, &f64)| (p.name.clone(), v.clamp(p.bounds[0], p.bounds[1]));
        self.table.parameters.iter().zip(values).map(inside).collect()
    }

    /// Values of all parameters at θ, in the order of their tables.
    pub(super) fn at_theta(&self, theta: &[f64]) -> Vec<f64> {
        let mut values = self.drives.reference.clone();
        self.drives.order.iter().zip(theta).for_each(|(place, by)| values[*place] += by);
        values
    }
}

fn kept(text: String) -> &'static str {
    Box::leak(text.into_boxed_str())
}

/// The description that the library's effects bring along.
fn described(definition: &CustomEffect, law: &Law) -> About {
    let one = |p: &CustomParameter| Parameter {
        name: kept(p.name.clone()),
        meaning: kept(p.meaning.clone()),
        bounds: p.bounds,
        null: p.null,
        required: true,
    };
    let parameters: Vec<Parameter> = definition.parameters.iter().map(one).collect();
    let (channel, symbol, deficient) = match definition.acts_on {
        ActsOn::GyroBiasRadS => ("gyro", "b", "gyro bias"),
        ActsOn::ForceN => ("torque", "F", "equations of motion"),
        ActsOn::TorqueNM => ("torque", "N", "equations of motion"),
        ActsOn::WheelLeftTorqueNM => ("torque", "T_l", "equations of motion"),
        ActsOn::WheelRightTorqueNM => ("torque", "T_r", "equations of motion"),
        ActsOn::WheelLeftRadS => ("wheel_left", "wheel_l = (v - b ω)/r_l +", "wheel measurement"),
        ActsOn::WheelRightRadS => ("wheel_right", "wheel_r = (v + b ω)/r_r +", "wheel measurement"),
        ActsOn::GyroRateRadS => ("gyro", "reading = ω +", "gyro measurement"),
    };
    let at_rest = [names::SUPPLY, names::TEMPERATURE].map(|name| (name, Some(name)));
    let mut all = at_rest.into_iter().chain(QUANTITIES.map(|(name, condition, _)| (name, condition)));
    let followed = all.find(|(name, _)| follows(definition, law, name));
    let condition = followed.map_or(Some("elapsed_time"), |(_, condition)| condition);
    let equals = if symbol.ends_with('+') { "" } else { " =" };
    let equation = format!("{symbol}{equals} {}", definition.expression);
    About {
        id: kept(definition.id.clone()),
        title: kept(definition.title.clone()),
        equation: kept(equation),
        source: "the configuration",
        channel,
        deficient: kept(format!("{deficient}: {}", definition.title)),
        condition,
        parameters: Box::leak(parameters.into_boxed_slice()),
        remedy: "Take its cause away, or keep it in simulator and filter: the augmented configuration holds it.",
    }
}
