//! Effects of the user's own, from tables `[[custom_effect]]`: one definition is simulated and explains recordings, as any other.

mod at_rest;

use super::about::{About, Parameter, Parameters};
use crate::config::{ActsOn, CustomEffect, Law};
use crate::error::Result;
use crate::signal::names;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// An effect of the user's own.
#[derive(Debug, Clone)]
pub(super) struct Custom(Arc<Defined>);

#[derive(Debug)]
struct Defined {
    about: &'static About,
    table: CustomEffect,
    law: Law,
}

/// Every definition that this process has met. All that knows effects holds `&'static` references to them, as those of the
/// library are; what is allocated here is therefore never freed, and a definition that is met again is not allocated again.
static MET: Mutex<Vec<&'static Custom>> = Mutex::new(Vec::new());

fn met() -> MutexGuard<'static, Vec<&'static Custom>> {
    MET.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The effect that `definition` defines.
///
/// # Errors
/// [`crate::ErrorKind::Config`] for an expression that cannot be read.
pub(super) fn of(definition: &CustomEffect) -> Result<&'static Custom> {
    let law = definition.law("configuration")?;
    let mut all = met();
    if let Some(at) = all.iter().position(|known| known.0.table == *definition) {
        let known = all.remove(at);
        all.push(known);
        return Ok(known);
    }
    let about = Box::leak(Box::new(described(definition, &law)));
    let made = Custom(Arc::new(Defined { about, table: definition.clone(), law }));
    let made: &'static Custom = Box::leak(Box::new(made));
    all.push(made);
    Ok(made)
}

/// Description of the effect of the user's own `id`, for reports: of several definitions the one that was met last.
#[must_use]
pub(crate) fn about(id: &str) -> Option<&'static About> {
    met().iter().rev().map(|known| known.0.about).find(|about| about.id == id)
}

/// Unit of the parameter `name` of the effect of the user's own `id`.
#[must_use]
pub(crate) fn unit(id: &str, name: &str) -> Option<&'static str> {
    let all = met();
    let known: &'static Custom = all.iter().rev().find(|known| known.0.about.id == id)?;
    known.0.table.parameters.iter().find(|p| p.name == name).map(|p| p.unit.as_str())
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
    };
    let condition = [names::SUPPLY, names::TEMPERATURE].into_iter().find(|name| follows(definition, law, name));
    About {
        id: kept(definition.id.clone()),
        title: kept(definition.title.clone()),
        equation: kept(format!("{symbol} = {}", definition.expression)),
        source: "the configuration",
        channel,
        deficient: kept(format!("{deficient}: {}", definition.title)),
        condition: Some(condition.unwrap_or("elapsed_time")),
        parameters: Box::leak(parameters.into_boxed_slice()),
        remedy: "Take its cause away, or keep it in simulator and filter: the augmented configuration holds it.",
    }
}

fn follows(table: &CustomEffect, law: &Law, name: &str) -> bool {
    table.acts_on.signals().iter().position(|s| s.name == name).is_some_and(|at| law.uses_signal(at))
}

impl Custom {
    /// Values of all parameters in the order of their tables, NaN of one that is missing.
    fn values(&self, parameters: &Parameters) -> Vec<f64> {
        self.0.table.parameters.iter().map(|p| parameters.get(&p.name).copied().unwrap_or(f64::NAN)).collect()
    }

    /// Whether the expression has the signal `name`.
    fn follows(&self, name: &str) -> bool {
        follows(&self.0.table, &self.0.law, name)
    }

    /// Parameters by name, inside their bounds.
    fn named(&self, values: &[f64]) -> Parameters {
        let inside =
            |(p, v): (&crate::config::CustomParameter, &f64)| (p.name.clone(), v.clamp(p.bounds[0], p.bounds[1]));
        self.0.table.parameters.iter().zip(values).map(inside).collect()
    }
}

#[cfg(test)]
mod tests;
