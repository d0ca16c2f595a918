//! Effects of the user's own, from tables `[[custom_effect]]`: one definition is simulated and explains recordings, as any other.

mod at_rest;
mod in_drives;

use self::in_drives::{Driven, InDrives, QUANTITIES};
use super::about::{About, Parameter, Parameters};
use super::drive::Driving;
use super::effect::Effect;
use crate::config::{ActsOn, CustomEffect, Law};
use crate::error::Result;
use crate::signal::names;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// An effect of the user's own as it acts at rest, and as it acts in drives; it does one of the two.
#[derive(Debug)]
pub(super) struct Own {
    at_rest: Custom,
    in_drives: Driven,
}

/// An effect of the user's own on a gyro at rest.
#[derive(Debug, Clone, Copy)]
struct Custom(&'static Defined);

#[derive(Debug)]
struct Defined {
    about: &'static About,
    table: CustomEffect,
    law: Law,
    drives: InDrives,
}

/// Every definition that this process has met. All that knows effects holds `&'static` references to them, as those of the
/// library are; what is allocated here is therefore never freed, and a definition that is met again is not allocated again.
static MET: Mutex<Vec<&'static Own>> = Mutex::new(Vec::new());

fn met() -> MutexGuard<'static, Vec<&'static Own>> {
    MET.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The effect that `definition` defines.
///
/// # Errors
/// [`crate::ErrorKind::Config`] for an expression that cannot be read.
pub(super) fn of(definition: &CustomEffect) -> Result<&'static Own> {
    let law = definition.law("configuration")?;
    let mut all = met();
    if let Some(at) = all.iter().position(|known| known.defined().table == *definition) {
        let known = all.remove(at);
        all.push(known);
        return Ok(known);
    }
    let about = Box::leak(Box::new(described(definition, &law)));
    let drives = InDrives::of(definition, &law);
    let defined: &'static Defined = Box::leak(Box::new(Defined { about, table: definition.clone(), law, drives }));
    let made: &'static Own = Box::leak(Box::new(Own { at_rest: Custom(defined), in_drives: Driven::new(defined) }));
    all.push(made);
    Ok(made)
}

impl Own {
    fn defined(&self) -> &'static Defined {
        self.at_rest.0
    }

    /// The effect, where it acts on a gyro at rest.
    pub(super) fn at_rest(&'static self) -> Option<&'static dyn Effect> {
        (!self.defined().table.acts_on.is_of_drives()).then_some(&self.at_rest)
    }

    /// The effect, where it acts in drives.
    pub(super) fn in_drives(&'static self) -> Option<&'static dyn Driving> {
        self.defined().table.acts_on.is_of_drives().then_some(&self.in_drives)
    }
}

/// Description of the effect of the user's own `id`, for reports: of several definitions the one that was met last.
#[must_use]
pub(crate) fn about(id: &str) -> Option<&'static About> {
    met().iter().rev().map(|known| known.defined().about).find(|about| about.id == id)
}

/// Unit of the parameter `name` of the effect of the user's own `id`.
#[must_use]
pub(crate) fn unit(id: &str, name: &str) -> Option<&'static str> {
    let all = met();
    let known = all.iter().rev().find(|known| known.defined().about.id == id)?;
    known.defined().table.parameters.iter().find(|p| p.name == name).map(|p| p.unit.as_str())
}

fn kept(text: String) -> &'static str {
    Box::leak(text.into_boxed_str())
}

/// The description that the library's effects bring along.
fn described(definition: &CustomEffect, law: &Law) -> About {
    let one = |p: &crate::config::CustomParameter| Parameter {
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

fn follows(table: &CustomEffect, law: &Law, name: &str) -> bool {
    table.acts_on.signals().iter().position(|s| s.name == name).is_some_and(|at| law.uses_signal(at))
}

impl Defined {
    /// Values of all parameters in the order of their tables, NaN of one that is missing.
    fn values(&self, parameters: &Parameters) -> Vec<f64> {
        self.table.parameters.iter().map(|p| parameters.get(&p.name).copied().unwrap_or(f64::NAN)).collect()
    }

    /// Whether the expression has the signal `name`.
    fn follows(&self, name: &str) -> bool {
        follows(&self.table, &self.law, name)
    }

    /// Parameters by name, inside their bounds.
    fn named(&self, values: &[f64]) -> Parameters {
        let inside =
            |(p, v): (&crate::config::CustomParameter, &f64)| (p.name.clone(), v.clamp(p.bounds[0], p.bounds[1]));
        self.table.parameters.iter().zip(values).map(inside).collect()
    }
}

#[cfg(test)]
mod tests;
