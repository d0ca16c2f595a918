//! A set of effects as the filter and the simulator of a drive take it.

use super::bursts::{self, Bursts, Predicted, Sought};
use super::lag::{LATE, by_whole_rows};
use super::pass::{Models, Noise, Process};
use super::record::Record;
use crate::effects::Library;
use crate::effects::Parameters;
use crate::effects::drive::missed_ticks::{LOSS, is_mean, side_of};
use crate::effects::drive::{DriveExplanation, ModelChange};
use crate::model::drive::{DriveEffect, DriveModel};
use rayon::prelude::*;
use std::borrow::Cow;

/// Effects with their parameters.
pub type Effects = [(String, Parameters)];

/// Accounts of lost ticks that the filter weighs.
const WEIGHED: usize = 4;

/// What effects come to in a drive.
pub struct Claimed {
    /// Changes of the equations, with their coordinates.
    changes: Vec<(&'static dyn ModelChange, Vec<f64>)>,
    /// Which of them is a late gyro.
    late: Option<usize>,
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
        let mut out = Self {
            changes: Vec::new(),
            late: None,
            wheel_lsb_rad_s: None,
            step_rad_s: None,
            walk_rad_s_sqrt_s: None,
            loss: None,
        };
        for (id, parameters) in effects {
            let value = |name: &str| parameters.get(name).copied();
            if id == "gyro.rate_random_walk" {
                out.walk_rad_s_sqrt_s = value("rate_random_walk_rad_s_sqrt_s");
            }
            let Some(effect) = library.driving_by_id(id) else { continue };
            match effect.explanation() {
                DriveExplanation::Model(change) => {
                    out.late = (id == LATE.0).then_some(out.changes.len()).or(out.late);
                    out.changes.push((change, change.theta(parameters)));
                }
                DriveExplanation::GyroStep => out.step_rad_s = value("step_rad_s"),
                DriveExplanation::MissedTicks(sides) if is_mean(parameters) => {
                    let law = sides[side_of(parameters)];
                    out.changes.push((law, law.theta(parameters)));
                }
                DriveExplanation::MissedTicks(_) => out.loss = value(LOSS),
                DriveExplanation::WheelLattice => out.wheel_lsb_rad_s = value("lsb_rad_s"),
            }
        }
        out
    }

    /// The robot with them.
    #[must_use]
    pub fn models(&self, record: &Record) -> Models {
        self.with_delay(record, None)
    }

    fn with_delay(&self, record: &Record, delay_s: Option<f64>) -> Models {
        let at = |(i, (change, theta)): (usize, &(&'static dyn ModelChange, Vec<f64>))| match delay_s {
            Some(delay_s) if self.late == Some(i) => change.at(&[delay_s]),
            _ => change.at(theta),
        };
        let effects: Vec<Box<dyn DriveEffect>> = self.changes.iter().enumerate().map(at).collect();
        Models { here: DriveModel::new(record.belief.robot, effects), beside: Vec::new() }
    }

    /// The drive as a filter reads it, and the robot that it takes it for: what a gyro read that is late by more than a row says of
    /// the yaw rate then, and nothing of that now.
    #[must_use]
    pub fn read<'a>(&self, record: &'a Record) -> (Cow<'a, Record>, Models) {
        let Some(delay_s) = self.late.map(|i| self.changes[i].1[0]) else {
            return (Cow::Borrowed(record), self.models(record));
        };
        let (record, left_s) = by_whole_rows(record, delay_s);
        let models = self.with_delay(&record, Some(left_s));
        (record, models)
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
        let (record, models) = self.read(record);
        let record = record.as_ref();
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
