//! A set of effects in the form that filter and simulator of a drive use.

use crate::effects::drive::{DriveExplanation, Lost, ModelChange};
use crate::effects::{InDrives, Library, Parameters, in_drives};
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::{Noise, Process};
use crate::gap::drive::preprocess::lost_ticks;
use crate::gap::drive::preprocess::lost_ticks::{LostTicks, Predicted, Sought};
use crate::gap::drive::record::{Belief, Record};
use crate::model::drive::{DriveEffect, Instrument};
use rayon::prelude::*;
use std::borrow::Cow;

/// Effects with their parameters.
pub(crate) type Effects = [(String, Parameters)];

/// Most accounts of lost ticks that the filter weighs.
const WEIGHED: usize = 4;

/// Changes that a set of effects makes to a drive.
pub(crate) struct EffectSet {
    /// Changes of the equations, with their coordinates.
    pub(crate) changes: Vec<(&'static dyn ModelChange, Vec<f64>)>,
    /// Index in `changes` and instrument of each delay.
    pub(crate) late: Vec<(usize, Instrument)>,
    /// Quantization step of the wheels, rad/s.
    pub wheel_lsb_rad_s: Option<f64>,
    /// Size of a step of the gyro's bias, rad/s; its time differs from run to run.
    pub step_rad_s: Option<f64>,
    /// Random walk of the gyro's bias, rad/s/√s.
    pub walk_rad_s_sqrt_s: Option<f64>,
    /// Ticks that a wheel loses in bursts.
    pub lost: Option<Lost>,
    /// Standard deviation of the white noise over the nominal one: gyro, wheels, pose.
    pub noise_over: [f64; 3],
}

impl EffectSet {
    /// From `effects`; those that the library does not know of drives change nothing.
    #[must_use]
    pub(crate) fn new(effects: &Effects, library: &Library) -> Self {
        let mut out = Self {
            changes: Vec::new(),
            late: Vec::new(),
            wheel_lsb_rad_s: None,
            step_rad_s: None,
            walk_rad_s_sqrt_s: None,
            lost: None,
            noise_over: [1.0; 3],
        };
        for (id, parameters) in effects {
            if let Some(walk) = in_drives(InDrives::Walk).filter(|walk| walk.id == id) {
                out.walk_rad_s_sqrt_s = parameters.get(walk.size()).copied();
            }
            let Some(effect) = library.driving_by_id(id) else { continue };
            let size = parameters.get(effect.about().size()).copied();
            match effect.explanation() {
                DriveExplanation::Model(change) => {
                    out.late.extend(change.lags().map(|of| (out.changes.len(), of)));
                    out.changes.push((change, change.theta(parameters)));
                }
                DriveExplanation::GyroStep => out.step_rad_s = size,
                DriveExplanation::MissedTicks(loss) if loss.is_mean(parameters) => {
                    let law = loss.mean()[loss.side(parameters)];
                    out.changes.push((law, law.theta(parameters)));
                }
                DriveExplanation::MissedTicks(loss) => out.lost = loss.lost(parameters),
                DriveExplanation::WheelLattice => out.wheel_lsb_rad_s = size,
                DriveExplanation::NoiseLevel(of) => out.noise_over[of as usize] *= size.unwrap_or(1.0),
            }
        }
        out
    }

    /// The model of the robot with these changes.
    #[must_use]
    pub(crate) fn models(&self, record: &Record) -> Models {
        self.with_delays(record, &[])
    }

    fn with_delays(&self, record: &Record, delays_s: &[(usize, f64)]) -> Models {
        let at = |(i, (change, theta)): (usize, &(&'static dyn ModelChange, Vec<f64>))| match delays_s
            .iter()
            .find(|d| d.0 == i)
        {
            Some((_, delay_s)) => change.at(&[*delay_s]),
            None => change.at(theta),
        };
        let effects = || -> Vec<Box<dyn DriveEffect>> { self.changes.iter().enumerate().map(at).collect() };
        Models::of_each_load(record, |load_kg| Models::alone(record.model(load_kg, effects()), Vec::new()))
    }

    /// The drive as a filter of these effects reads it, with its model: readings that are late by more than a row are
    /// moved earlier by whole rows, and the model holds the remaining delay.
    #[must_use]
    pub(crate) fn read<'a>(&self, record: &'a Record) -> (Cow<'a, Record>, Models) {
        let mut read = Cow::Borrowed(record);
        let mut left_s = Vec::new();
        for &(i, of) in &self.late {
            let (moved, left) = read.by_whole_rows(of, self.changes[i].1[0]);
            left_s.push((i, left));
            if let Some(moved) = moved {
                read = Cow::Owned(moved);
            }
        }
        let models = self.with_delays(&read, &left_s);
        (read, models)
    }

    /// Rows by which [`Self::read`] moves the readings of each channel earlier.
    #[must_use]
    pub(crate) fn rows_late(&self, record: &Record) -> [usize; 6] {
        let mut rows = [0; 6];
        for &(i, of) in &self.late {
            let channels = match of {
                Instrument::Wheels => 0..2,
                Instrument::Gyro => 2..3,
                Instrument::Pose => 3..6,
            };
            rows[channels].fill(record.whole_rows(of, self.changes[i].1[0]));
        }
        rows
    }

    /// The noise that a filter of this model assumes.
    #[must_use]
    pub(crate) fn noise(&self, record: &Record, process: Process) -> Noise {
        let mut louder = record.belief;
        self.believe(&mut louder);
        Noise { process, ..Noise::of(&louder, record.torques_n_m.is_some(), self.wheel_lsb_rad_s) }
    }

    /// Multiplies the believed white noise by [`EffectSet::noise_over`].
    pub(crate) fn believe(&self, belief: &mut Belief) {
        let [gyro, wheels, pose] = self.noise_over;
        belief.gyro_std_rad_s *= gyro;
        belief.wheel_std_rad_s *= wheels;
        belief.position_std_m *= pose;
        belief.heading_std_rad *= pose;
    }

    /// Most probable bursts of lost ticks in this drive; none where no loss is claimed, or no bursts are found.
    #[must_use]
    pub(crate) fn bursts(&self, record: &Record, noise: &Noise) -> Option<LostTicks> {
        let lost = self.lost?;
        let (record, models) = self.read(record);
        let record = record.as_ref();
        let predicted = Predicted::of(record, &models, noise, lost.side);
        let account = |slow: bool| predicted.accounts(record, Sought { side: lost.side, loss: Some(lost.loss), slow });
        let mut all: Vec<LostTicks> = [false, true].into_par_iter().flat_map_iter(account).collect();
        // each needs a pass of the filter: only the most probable ones by the chain are weighed
        all.sort_by(|a, b| b.ln_evidence.total_cmp(&a.ln_evidence));
        all.truncate(WEIGHED);
        let weighed: Vec<(f64, LostTicks)> =
            all.into_par_iter().map(|b| (lost_ticks::weight(record, &models, noise, &b), b)).collect();
        weighed.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, b)| b)
    }
}
