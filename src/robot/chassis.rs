//! The link that carries the robot: what is loaded onto it, is loaded there.

use super::model::{Mass, Model};
use super::read::{choose, models, opened};
use super::types::{Choice, Format};
use super::wheels::Wheels;
use super::xml::Xml;
use crate::error::Result;

/// The heaviest link that does not turn with a wheel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chassis {
    /// Its name.
    pub name: String,
    /// Its own mass, kg.
    pub mass_kg: f64,
    /// Driven wheels of a side.
    pub wheels_a_side: usize,
}

/// The chassis of the description `text`; `file` is its name in messages. None where no link but the wheels has a mass.
///
/// # Errors
/// As [`parse`](super::parse).
pub(crate) fn chassis(text: &str, file: &str, format: Format, choice: &Choice) -> Result<Option<Chassis>> {
    let (document, skipped_rows) = opened(text, file)?;
    let all = models(&Xml { file, doc: &document, skipped_rows }, document.root_element(), format)?;
    let (model, wheels) = choose(&all, file, choice)?;
    Ok(heaviest(model, &wheels).map(|link| Chassis {
        name: model.links[link].name.clone(),
        mass_kg: weight(model, link),
        wheels_a_side: wheels.left.len(),
    }))
}

fn weight(model: &Model, link: usize) -> f64 {
    if let Mass::Known { kg, .. } = &model.links[link].mass { *kg } else { 0.0 }
}

/// Its index.
pub(super) fn heaviest(model: &Model, wheels: &Wheels) -> Option<usize> {
    let turning: Vec<usize> = wheels.all().flat_map(|j| model.rigid(model.joints[j].child)).collect();
    (0..model.links.len())
        .filter(|l| !turning.contains(l))
        .max_by(|a, b| weight(model, *a).total_cmp(&weight(model, *b)))
        .filter(|l| weight(model, *l) > 0.0)
}
