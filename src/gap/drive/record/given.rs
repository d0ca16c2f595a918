//! ξ' = f(ξ) + g(ξ), g the `[[effect]]` tables of the nominal simulator: given effects, which are no findings
//!
//! A simulator that a diagnosis has augmented is a nominal simulator like any other. Effects that are found beside
//! given ones add to them: a radius 1 % larger than one that is given as 2 % larger.

use super::Record;
use crate::config::Config;
use crate::effects::Library;
use crate::effects::drive::{DriveExplanation, ModelChange};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::drive::ekf::effect_set::EffectSet;
use crate::model::drive::{DriveEffect, DriveModel};
use std::fmt;
use std::sync::Arc;

/// Effects that the nominal simulator holds.
#[derive(Clone, Default)]
pub struct Given {
    /// Changes of the equations, with their coordinates.
    changes: Arc<[(&'static dyn ModelChange, Vec<f64>)]>,
    /// Quantization step of the wheels, rad/s.
    pub wheel_lsb_rad_s: Option<f64>,
}

impl fmt::Debug for Given {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let coordinates: Vec<&Vec<f64>> = self.changes.iter().map(|c| &c.1).collect();
        f.debug_struct("Given")
            .field("coordinates", &coordinates)
            .field("wheel_lsb_rad_s", &self.wheel_lsb_rad_s)
            .finish()
    }
}

impl Given {
    /// Number of changes of the equations.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.changes.len()
    }
}

impl Record {
    /// The model of the robot with the given effects, and `effects` after them.
    #[must_use]
    pub(crate) fn model(&self, effects: Vec<Box<dyn DriveEffect>>) -> DriveModel {
        let given = self.given.changes.iter().map(|(change, theta)| change.at(theta));
        DriveModel::new(self.belief.robot, given.chain(effects).collect())
    }

    /// With the effects of `config` as given; readings of late sensors are moved earlier by whole rows.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] for effects that are no drive's, or that are drawn anew in each run.
    pub(crate) fn with_given(self, config: &Config) -> Result<Self> {
        if config.effects.is_empty() {
            return Ok(self);
        }
        let library = Library::new();
        for table in &config.effects {
            let lasts = library.driving_by_id(&table.id).is_some_and(|effect| {
                matches!(
                    effect.explanation(),
                    DriveExplanation::Model(_) | DriveExplanation::WheelLattice | DriveExplanation::NoiseLevel(_)
                )
            });
            if !lasts {
                let found = format!("{:?} is no part of a nominal simulator of drives", table.id);
                return Err(Error::new(ErrorKind::Config, "configuration", found).at("`[[effect]]`").hint(
                    "delete this table: when and where it acts is another in each run, and the diagnosis finds it",
                ));
            }
        }
        let effects: Vec<_> = config.effects.iter().map(|e| (e.id.clone(), e.parameters.clone())).collect();
        let claimed = EffectSet::new(&effects, &library);
        let mut record = self;
        claimed.believe(&mut record.belief);
        let mut changes = claimed.changes;
        for (place, of) in claimed.late {
            let (moved, left_s) = record.by_whole_rows(of, changes[place].1[0]);
            changes[place].1[0] = left_s;
            record = moved.unwrap_or(record);
        }
        record.given = Given { changes: changes.into(), wheel_lsb_rad_s: claimed.wheel_lsb_rad_s };
        Ok(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::EffectTable;
    use crate::effects::drive::{ids, registry};
    use crate::gap::drive::holdout;
    use crate::gap::drive::model_selection::{Options, judge};
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot};
    use crate::gap::selection::findings::Main;

    fn with(id: &str, name: &str, value: f64) -> Config {
        let mut config = robot();
        config.effects.push(EffectTable { id: id.into(), parameters: [(name.into(), value)].into() });
        config
    }

    #[test]
    fn what_is_given_is_not_found_again() {
        for (id, name, value) in [
            (ids::payload(), "mass_relative", 0.2),
            (ids::scale_factor(), "relative", 0.02),
            (ids::gyro_delay(), "delay_s", 0.026),
            (ids::wheel_noise(), "noise_over_nominal", 2.0),
        ] {
            let log = recorded(60.0, 17, Some((id, name, value)));
            let record = Record::new(&with(id, name, value), &log, 0.0).unwrap();
            let found = judge(&record, registry(), &Options::default());
            assert_eq!(found.findings.mains()[0].0, Main::None, "{id}");
            // the nominal simulator with the effect given scores as the plain one with the effect added
            let plain = Record::new(&robot(), &log, 0.0).unwrap();
            let effects = [(id.to_owned(), [(name.to_owned(), value)].into())];
            let score = |record: &Record, effects: &[_]| -> f64 {
                holdout::rows(record, &Library::new(), effects, Default::default()).iter().sum()
            };
            let (given, added) = (score(&record, &[]), score(&plain, &effects));
            assert!((given - added).abs() < 1e-6 * added.abs(), "{id}: {given} {added}");
        }
    }

    #[test]
    fn what_differs_from_what_is_given_is_what_is_found() {
        let log = recorded(60.0, 18, Some((ids::payload(), "mass_relative", 0.3)));
        let record = Record::new(&with(ids::payload(), "mass_relative", 0.1), &log, 0.0).unwrap();
        let found = judge(&record, registry(), &Options::default());
        assert_eq!(found.findings.mains()[0].0, Main::Effect(ids::payload().into()));
        let part = found.findings.sets[0].part(ids::payload()).unwrap();
        let (value, std) = (part.parameters["mass_relative"], part.std["mass_relative"]);
        assert!((value - (1.3 / 1.1 - 1.0)).abs() < 4.0 * std, "{value} ± {std}");
    }

    #[test]
    fn what_is_drawn_anew_in_each_run_is_refused() {
        let log = recorded(20.0, 19, None);
        let refused = Record::new(&with(ids::bias_step(), "step_rad_s", 0.01), &log, 0.0).unwrap_err();
        assert!(refused.to_string().contains(ids::bias_step()), "{refused}");
    }
}
