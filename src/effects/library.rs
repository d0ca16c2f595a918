//! The effects by id, for the simulator; some may be withheld.

use super::about::Parameters;
use super::custom::{self, Own};
use super::drive::{self, DriveExplanation, Driving};
use super::effect::Effect;
use super::registry;
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result, one_of};
use crate::model::drive::DriveEffect;
use crate::model::{EffectSource, GyroEffect, Scene, Through};

/// All effects of [`registry`] and those of the user's own, but for those that are withheld.
#[derive(Debug, Clone, Default)]
pub struct Library {
    withheld: Vec<String>,
    own: Vec<&'static Own>,
}

impl Library {
    /// Every effect.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Every effect but those with these `ids`: as if they had never been written.
    #[must_use]
    pub fn without<I: Into<String>>(ids: impl IntoIterator<Item = I>) -> Self {
        Self { withheld: ids.into_iter().map(Into::into).collect(), own: Vec::new() }
    }

    /// The same with the effects of the user's own that `config` defines.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] for an expression that cannot be read.
    pub fn with_own(mut self, config: &Config) -> Result<Self> {
        self.own = config.custom_effects.iter().map(custom::of).collect::<Result<_>>()?;
        Ok(self)
    }

    fn is_withheld(&self, id: &str) -> bool {
        self.withheld.iter().any(|w| w == id)
    }

    /// Ids of the effects that are withheld.
    pub(crate) fn withheld(&self) -> impl Iterator<Item = &str> {
        self.withheld.iter().map(String::as_str)
    }

    /// The effects, in the order of [`registry`], and those of the user's own after them.
    pub fn effects(&self) -> impl Iterator<Item = &'static dyn Effect> + '_ {
        let own = self.own.iter().filter_map(|own| own.at_rest());
        registry().iter().copied().chain(own).filter(|e| !self.is_withheld(e.about().id))
    }

    /// The effect `id`, unless it is unknown or withheld.
    #[must_use]
    pub fn by_id(&self, id: &str) -> Option<&'static dyn Effect> {
        self.effects().find(|e| e.about().id == id)
    }
}

impl Library {
    /// The effects of drives, in the order of [`drive::registry`], and those of the user's own after them.
    pub fn driving(&self) -> impl Iterator<Item = &'static dyn Driving> + '_ {
        let own = self.own.iter().filter_map(|own| own.in_drives());
        drive::registry().iter().copied().chain(own).filter(|e| !self.is_withheld(e.about().id))
    }

    /// The effect of drives `id`, unless it is unknown or withheld.
    #[must_use]
    pub(crate) fn driving_by_id(&self, id: &str) -> Option<&'static dyn Driving> {
        self.driving().find(|e| e.about().id == id)
    }
}

impl EffectSource for Library {
    fn is_of_drives(&self, id: &str) -> bool {
        self.driving_by_id(id).is_some()
    }

    fn acts_through(&self, id: &str) -> Through {
        match self.driving_by_id(id).map(Driving::explanation) {
            Some(DriveExplanation::Model(change)) => {
                Through { torques: change.needs().torques, gyro: change.needs().gyro }
            }
            Some(DriveExplanation::GyroStep) => Through { torques: false, gyro: true },
            _ => Through::default(),
        }
    }

    fn drive_effect(&self, id: &str, parameters: &Parameters, span_s: f64, seed: u64) -> Result<Box<dyn DriveEffect>> {
        let effect = self.driving_by_id(id).ok_or_else(|| {
            let ids: Vec<_> = self.driving().map(|e| e.about().id).collect();
            Error::new(ErrorKind::Config, "configuration", format!("no effect of drives is called {id:?}"))
                .at("`[[effect]]`")
                .hint(one_of(id, &ids))
        })?;
        effect.simulated(parameters, span_s, seed)
    }

    fn gyro_effect(&self, id: &str, parameters: &Parameters, scene: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let effect = self.by_id(id).ok_or_else(|| {
            let error = |found: String| Error::new(ErrorKind::Config, "configuration", found).at("`[[effect]]`");
            if self.is_of_drives(id) {
                return error(format!("{id} is an effect of drives, and here a gyro stands at rest"))
                    .hint("give a drive (simulate: --course NAME), or take the table out");
            }
            let driving = self.driving().map(|e| e.about().id);
            let mut ids: Vec<&str> = self.effects().map(|e| e.about().id).collect();
            // some act at rest and in drives
            driving.for_each(|id| {
                if !ids.contains(&id) {
                    ids.push(id)
                }
            });
            error(format!("no effect at rest is called {id:?}, and none of drives")).hint(one_of(id, &ids))
        })?;
        effect.simulated(parameters, scene, seed)
    }
}
