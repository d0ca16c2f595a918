//! keep e while D(all kept) < D(all kept but e): what is entered into a foreign simulator must make its error smaller there
//!
//! Backward: of the effects whose absence is not resolved to be worse, the one that adds least goes, and the others are tried anew,
//! since of two that stand in for each other neither is missed alone.

use super::replay::{Replayed, Shrinkage, shrinkage};
use crate::error::Result;
use serde::Serialize;

/// An effect that is not entered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Dropped {
    /// Its id.
    pub effect: String,
    /// The reason.
    pub why: &'static str,
    /// Share of the gap that it closes beyond the others that were there; none where there is no gap beyond the noise.
    pub adds: Option<f64>,
    /// Its 95 % interval.
    pub ci95: Option<[f64; 2]>,
}

/// Effects that are entered, and those that are not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Gate {
    /// Ids of those that are.
    pub kept: Vec<String>,
    /// Those that are not.
    pub dropped: Vec<Dropped>,
    /// What those that are entered close together; where there are none, what all would. None if none were found.
    #[serde(flatten)]
    pub shrinkage: Option<Shrinkage>,
}

/// Sorts `effects`, ids with what is entered for them, by `run`: the simulator's errors with these entered. `before` is with none.
///
/// # Errors
/// Those of `run`.
pub(crate) fn gate<T: Clone>(
    before: &Replayed,
    effects: Vec<(&str, T)>,
    mut run: impl FnMut(&[(&str, T)]) -> Result<Replayed>,
) -> Result<Gate> {
    let mut kept = effects;
    let mut dropped = Vec::new();
    if kept.is_empty() {
        return Ok(Gate { kept: Vec::new(), dropped, shrinkage: None });
    }
    let mut with = run(&kept)?;
    let all = shrinkage(before, before, &with);
    while !kept.is_empty() {
        let mut least: Option<(usize, Shrinkage, Replayed)> = None;
        for at in 0..kept.len() {
            let mut others = kept.clone();
            others.remove(at);
            let without = if others.is_empty() { before.clone() } else { run(&others)? };
            let adds = shrinkage(before, &without, &with);
            if !adds.shrinks && least.as_ref().is_none_or(|(_, other, _)| adds.closed < other.closed) {
                least = Some((at, adds, without));
            }
        }
        let Some((at, adds, without)) = least else { break };
        let (id, _) = kept.remove(at);
        let why = "your simulator is not resolved to be nearer to the recording with it";
        dropped.push(Dropped { effect: id.into(), why, adds: adds.closed, ci95: adds.ci95 });
        with = without;
    }
    let together = shrinkage(before, before, &with);
    if !kept.is_empty() && !together.shrinks {
        let why = "it helps beside the others, and all together do not";
        let (adds, ci95) = (together.closed, together.ci95);
        dropped.extend(kept.drain(..).map(|(id, _)| Dropped { effect: id.into(), why, adds, ci95 }));
    }
    let shrinkage = Some(if kept.is_empty() { all } else { together });
    Ok(Gate { kept: kept.into_iter().map(|(id, _)| id.into()).collect(), dropped, shrinkage })
}
