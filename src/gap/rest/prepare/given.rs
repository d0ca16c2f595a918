//! |θ̂ - θ₀| ≤ 4 σ̂, of θ or of ln θ:   effects of the nominal simulator whose sizes the recording confirms are no
//! finding
//!
//! The recording is compared with the simulator without its `[[effect]]` tables: their effects have to be estimated
//! beside everything else, since a tone or a walk differs from run to run. An effect whose given size is confirmed is
//! then taken out of every set; another one is named with the size that the recording has. Scores are those of the
//! simulator with its effects.

use crate::config::Config;
use crate::effects::{Library, Parameters};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::calibration::Calibration;
use crate::gap::selection::findings::Findings;
use crate::gap::selection::sets::Part;

/// Standard deviations within which an estimate agrees with the given value.
const DIFFERS: f64 = 4.0;
/// Least probability of a given effect that shows in the recording.
const SHOWS: f64 = 0.5;

/// Effects of the nominal simulator of a gyro at rest.
pub(crate) struct Given {
    /// Identifiers and parameters.
    effects: Vec<(String, Parameters)>,
    /// The simulator without them.
    pub(crate) bare: Config,
}

impl Given {
    /// The effects of `config`.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] for an effect that `library` does not know at rest.
    pub(crate) fn of(config: &Config, library: &Library) -> Result<Self> {
        if let Some(unknown) = config.effects.iter().find(|e| library.by_id(&e.id).is_none()) {
            let found = format!("no effect at rest is called {:?}", unknown.id);
            return Err(Error::new(ErrorKind::Config, "configuration", found)
                .at("`[[effect]]`")
                .hint("delete this table; gyroid gap diagnose --help lists the effects"));
        }
        let effects = config.effects.iter().map(|e| (e.id.clone(), e.parameters.clone())).collect();
        Ok(Self { effects, bare: Config { effects: Vec::new(), ..config.clone() } })
    }

    /// The given effects with `found` beside them; an effect found replaces a given one of the same id.
    pub(crate) fn with(&self, found: &[(String, Parameters)]) -> Vec<(String, Parameters)> {
        let kept = self.effects.iter().filter(|given| found.iter().all(|one| one.0 != given.0));
        kept.chain(found).cloned().collect()
    }

    /// Takes given effects of confirmed size out of `findings`, and adds a note on those that do not show.
    pub(crate) fn take_out(&self, findings: &mut Findings, calibration: &Calibration) {
        for (id, _) in &self.effects {
            let presence = findings.presence(id).max(0.0);
            if presence < SHOWS {
                findings.notes.push(format!(
                    "The nominal simulator holds {id}, which this recording does not show (probability {presence:.2}): the effect may be \
                     smaller than it is given, or gone."
                ));
            }
        }
        findings.take_out_given(calibration, |part| {
            self.effects.iter().any(|(id, parameters)| part.id == *id && is_as_given(part, parameters))
        });
    }
}

fn is_as_given(part: &Part, given: &Parameters) -> bool {
    given.iter().all(|(name, value)| {
        let estimate = part.parameters.get(name).zip(part.std.get(name));
        estimate.is_none_or(|(found, std)| {
            // where a size is hardly known, its logarithm is compared
            let in_logarithm = *found > 0.0 && *value > 0.0 && (found / value).ln().abs() <= DIFFERS * std / found;
            in_logarithm || (found - value).abs() <= DIFFERS * std
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{drive, ids};
    use crate::gap::selection::sets::{Main, WeightedSet};

    fn config(effects: &str) -> Config {
        let text = format!(
            "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.1\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = 4e-3\n\
             time_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 1e-4\n{effects}"
        );
        Config::parse(&text, "sim.toml").unwrap()
    }

    /// A table of the effect `id` in a configuration.
    fn table(id: &str, parameter: &str) -> String {
        format!("[[effect]]\nid = \"{id}\"\n{parameter}\n")
    }

    #[test]
    fn what_is_as_large_as_it_is_given_is_taken_out_and_the_rest_stays() {
        let given = Given::of(&config(&table(ids::rate_ramp(), "ramp_rad_s2 = 1e-7")), &Library::new()).unwrap();
        assert!(given.bare.effects.is_empty());
        let found = |ramp_rad_s2: f64| {
            let mut part = Part::new(ids::rate_ramp(), true, 30.0);
            part.parameters.insert("ramp_rad_s2".into(), ramp_rad_s2);
            part.std.insert("ramp_rad_s2".into(), 1e-9);
            let parts = vec![part, Part::new(ids::tone(), true, 9.0)];
            Findings { sets: vec![WeightedSet { parts, ln_weight: 0.0, probability: 1.0 }], ..Findings::default() }
        };
        let mut same = found(1.03e-7);
        given.take_out(&mut same, &Calibration::default());
        assert_eq!((same.mains()[0].0.clone(), same.notes.len()), (Main::Effect(ids::tone().into()), 0));
        let mut other = found(1.05e-7);
        given.take_out(&mut other, &Calibration::default());
        assert_eq!(other.mains()[0].0, Main::Effect(ids::rate_ramp().into()));
        let mut gone = Findings::default();
        given.take_out(&mut gone, &Calibration::default());
        assert!(gone.notes[0].contains("does not show"), "{:?}", gone.notes);
        // found anew it stands in the place of what is given
        let anew = [(ids::rate_ramp().to_owned(), [("ramp_rad_s2".to_owned(), 2e-7)].into())];
        assert_eq!(given.with(&anew), anew);
        assert_eq!(given.with(&[]).len(), 1);
    }

    #[test]
    fn an_effect_of_drives_is_refused_by_name() {
        let slip = drive::ids::slip();
        let refused = Given::of(&config(&table(slip, "compliance = 0.1")), &Library::new());
        assert!(refused.is_err_and(|e| e.to_string().contains(slip)));
    }
}
