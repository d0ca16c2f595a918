//! Effects of the user's own, from tables `[[custom_effect]]`: one definition is simulated and explains recordings, as any other.

mod at_rest;
mod defined;
mod in_drives;
mod quantities;

use self::at_rest::Custom;
use self::defined::Defined;
use self::in_drives::Driven;
use super::about::About;
use super::drive::Driving;
use super::effect::Effect;
use crate::config::CustomEffect;
use crate::error::Result;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// An effect of the user's own as it acts at rest, and as it acts in drives; it does one of the two.
#[derive(Debug)]
pub(super) struct Own {
    at_rest: Custom,
    in_drives: Driven,
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
    let mut all = met();
    if let Some(at) = all.iter().position(|known| known.defined().table == *definition) {
        let known = all.remove(at);
        all.push(known);
        return Ok(known);
    }
    let defined: &'static Defined = Box::leak(Box::new(Defined::new(definition)?));
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

#[cfg(test)]
mod tests;
