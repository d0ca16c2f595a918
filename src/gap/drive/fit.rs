//! Gauss-Newton over the coordinates of model changes, the comparison of sets inside each step.

use super::candidates::{Candidates, Kind};
use super::column::Column;
use super::evidence::{Coefficients, Member, Problem, Weighed};
use super::pass::{Models, Noise, Summed, run};
use super::record::Record;
use super::search::search;
use crate::effects::drive::ModelChange;
use crate::model::drive::{DriveEffect, DriveModel};

/// Coordinates of every change, by its place.
pub type Theta = Vec<Vec<f64>>;

/// Steps at most.
const STEPS: usize = 7;
/// Settled when no coordinate moves by more than this of its standard deviation.
const SETTLED: f64 = 0.15;

/// A linearisation and the sets that were compared there.
pub struct Compared {
    /// Where.
    pub theta: Theta,
    /// Candidates and their columns.
    pub candidates: Candidates,
    /// Normal equations.
    pub problem: Problem,
    /// Sets, the most probable first.
    pub sets: Vec<Weighed>,
    /// Sums of the pass.
    pub summed: Summed,
}

/// The model at θ, and beside it for every coordinate that has a column.
#[must_use]
pub fn models(record: &Record, changes: &[&'static dyn ModelChange], theta: &Theta, slopes: bool) -> Models {
    let build = |theta: &Theta| {
        let changed = changes.iter().zip(theta).filter(|(_, t)| t.iter().any(|v| *v != 0.0));
        let effects: Vec<Box<dyn DriveEffect>> = changed.map(|(c, t)| c.at(t)).collect();
        DriveModel::new(record.belief.robot, effects)
    };
    let mut beside = Vec::new();
    if slopes {
        for (i, change) in changes.iter().enumerate() {
            let one = change.coordinates().iter().enumerate().map(|(j, c)| {
                let step = 0.02 * c.scale[0].max(0.05 * theta[i][j].abs());
                let moved = |by: f64| {
                    let mut at = theta.clone();
                    at[i][j] += by;
                    build(&at)
                };
                (moved(step), moved(-step), 2.0 * step)
            });
            beside.push(one.collect());
        }
    }
    Models { here: build(theta), beside }
}

impl Candidates {
    /// The changes alone.
    #[must_use]
    pub fn change_list(&self) -> Vec<&'static dyn ModelChange> {
        self.changes.iter().map(|c| c.1).collect()
    }

    /// θ at zero.
    #[must_use]
    pub fn zero(&self) -> Theta {
        self.changes.iter().map(|c| vec![0.0; c.1.coordinates().len()]).collect()
    }

    fn here(&self, theta: &Theta) -> Vec<f64> {
        let value = |c: &Column| match *c {
            Column::Coordinate(i, j) => theta[i][j],
            _ => 0.0,
        };
        self.columns.iter().map(value).collect()
    }

    /// θ of a set: its coefficients, inside their bounds; zero for changes that are not in it. Also whether it is close to
    /// where it was.
    fn theta_of(&self, members: &[Member], coefficients: &Coefficients, before: &Theta) -> (Theta, bool) {
        let mut theta = self.zero();
        let mut settled = true;
        for &(g, _) in members {
            let Kind::Change(i) = self.kinds[g] else { continue };
            for (j, column) in self.groups[g].columns.iter().enumerate() {
                let Some((_, mean, std)) = coefficients.iter().find(|c| c.0 == *column) else { continue };
                let [low, high] = self.changes[i].1.coordinates()[j].bounds;
                theta[i][j] = mean.clamp(low, high);
                settled &= (theta[i][j] - before[i][j]).abs() <= SETTLED * std + 1e-12;
            }
        }
        // what left the set has moved too
        for (new, old) in theta.iter().zip(before) {
            settled &= new.iter().any(|v| *v != 0.0) || old.iter().all(|v| *v == 0.0);
        }
        (theta, settled)
    }

    /// One pass at θ, and its normal equations.
    pub fn linearise(&self, record: &Record, noise: &Noise, theta: &Theta) -> (Problem, Summed) {
        let models = models(record, &self.change_list(), theta, true);
        let summed = run(record, &models, noise, &self.columns, |_| {});
        let groups = self.scaled(|c| summed.gram[(c, c)]);
        let problem = Problem::new(&summed.gram, summed.ln_volume, &self.here(theta), groups, self.nuisance.clone());
        (problem, summed)
    }
}

/// Compares sets, moving to the best one's coordinates until they settle.
pub fn compare(record: &Record, noise: &Noise, make: &dyn Fn(Option<f64>) -> Candidates) -> Compared {
    let mut near = None;
    let mut candidates = make(near);
    let mut theta = candidates.zero();
    let mut best: Option<Compared> = None;
    for step in 0..STEPS {
        let (problem, summed) = candidates.linearise(record, noise, &theta);
        let sets = search(&problem, &[]);
        let top = sets[0].clone();
        let coefficients = problem.coefficients(&top.members);
        let (next, settled) = candidates.theta_of(&top.members, &coefficients, &theta);
        let stepped = top.members.iter().find_map(|&(g, _)| match candidates.kinds[g] {
            Kind::Step(t) => Some(t),
            _ => None,
        });
        let settled = settled && (stepped.is_none() || stepped.is_some() && near.is_some());
        let better = best.as_ref().is_none_or(|b| top.ln_weight >= b.sets[0].ln_weight);
        let here = Compared { theta: theta.clone(), candidates, problem, sets, summed };
        // far from the optimum a linearisation promises more than there is: the last one counts
        if better || !settled || step > 0 {
            best = Some(here);
        }
        if settled {
            break;
        }
        near = stepped;
        candidates = make(near);
        theta = next;
    }
    best.unwrap_or_else(|| unreachable_comparison(record, noise, make))
}

/// At least one step is always taken; this keeps the types honest without a panic.
fn unreachable_comparison(record: &Record, noise: &Noise, make: &dyn Fn(Option<f64>) -> Candidates) -> Compared {
    let candidates = make(None);
    let theta = candidates.zero();
    let (problem, summed) = candidates.linearise(record, noise, &theta);
    let sets = search(&problem, &[]);
    Compared { theta, candidates, problem, sets, summed }
}
