//! A set of effects as the filter and the simulator of a drive take it.

use super::bursts::{self, Bursts, Predicted, Sought};
use super::pass::{Models, Noise, Process};
use super::record::Record;
use crate::effects::Library;
use crate::effects::Parameters;
use crate::effects::drive::missed_ticks::LOSS;
use crate::effects::drive::{DriveExplanation, ModelChange};
use crate::model::drive::{DriveEffect, DriveModel};
use rayon::prelude::*;

/// Effects with their parameters.
pub type Effects = [(String, Parameters)];

/// Accounts of lost ticks that the filter weighs.
const WEIGHED: usize = 4;

/// What effects come to in a drive.
pub struct Claimed {
    /// Changes of the equations, with their coordinates.
    changes: Vec<(&'static dyn ModelChange, Vec<f64>)>,
    /// Step of the wheels' lattice, rad/s.
    pub wheel_lsb_rad_s: Option<f64>,
    /// Size of a step of the gyro's bias, rad/s; its time is another in each run.
    pub step_rad_s: Option<f64>,
    /// Random walk of the gyro's bias, rad/s/√s.
    pub walk_rad_s_sqrt_s: Option<f64>,
    /// Share that a wheel loses in bursts.
    pub loss: Option<f64>,
}

impl Claimed {
    /// Of `effects`; what the library does not know of drives changes nothing.
    #[must_use]
    pub fn new(effects: &Effects, library: &Library) -> Self {
        let mut out =
            Self { changes: Vec::new(), wheel_lsb_rad_s: None, step_rad_s: None, walk_rad_s_sqrt_s: None, loss: None };
        for (id, parameters) in effects {
            let value = |name: &str| parameters.get(name).copied();
            if id == "gyro.rate_random_walk" {
                out.walk_rad_s_sqrt_s = value("rate_random_walk_rad_s_sqrt_s");
            }
            let Some(effect) = library.driving_by_id(id) else { continue };
            match effect.explanation() {
                DriveExplanation::Model(change) => out.changes.push((change, change.theta(parameters))),
                DriveExplanation::GyroStep => out.step_rad_s = value("step_rad_s"),
                DriveExplanation::MissedTicks => out.loss = value(LOSS),
                DriveExplanation::WheelLattice => out.wheel_lsb_rad_s = value("lsb_rad_s"),
            }
        }
        out
    }

    /// The robot with them.
    #[must_use]
    pub fn models(&self, record: &Record) -> Models {
        let effects: Vec<Box<dyn DriveEffect>> = self.changes.iter().map(|(c, theta)| c.at(theta)).collect();
        Models { here: DriveModel::new(record.belief.robot, effects), beside: Vec::new() }
    }

    /// The noise that a filter of this model assumes.
    #[must_use]
    pub fn noise(&self, record: &Record, process: Process) -> Noise {
        Noise { process, ..Noise::believed(record, self.wheel_lsb_rad_s) }
    }

    /// Where this drive lost ticks, if that is claimed.
    #[must_use]
    pub fn bursts(&self, record: &Record, noise: &Noise) -> Option<Bursts> {
        let loss = self.loss?;
        let models = self.models(record);
        let of_side = |side: usize| {
            let predicted = Predicted::of(record, &models, noise, side);
            [false, true].map(|slow| predicted.accounts(record, Sought { side, loss: Some(loss), slow })).concat()
        };
        let mut all: Vec<Bursts> = [0, 1].into_par_iter().flat_map_iter(of_side).collect();
        // a pass of the filter each: for those that the chain takes for likely
        all.sort_by(|a, b| b.ln_evidence.total_cmp(&a.ln_evidence));
        all.truncate(WEIGHED);
        let weighed: Vec<(f64, Bursts)> =
            all.into_par_iter().map(|b| (bursts::weight(record, &models, noise, &b), b)).collect();
        weighed.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, b)| b)
    }
}
