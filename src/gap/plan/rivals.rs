//! Effects that a log cannot tell apart, each with the size that it has when it is fitted to the log.

use crate::config::{Config, EffectTable, Kind};
use crate::effects::{Library, Parameters};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::Answer;
use crate::gap::asked;
use crate::gap::explain::explain;
use crate::signal::Log;
use rayon::prelude::*;
use serde::Serialize;

/// One of the effects that a log cannot tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rival {
    /// Identifier.
    pub id: String,
    /// Its parameters where it is fitted to the log in the place of the others.
    pub parameters: Parameters,
    /// Effects that are found beside it, fitted together with it.
    pub beside: Vec<Beside>,
}

/// An effect that is at work whichever of the rivals is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Beside {
    /// Identifier.
    pub id: String,
    /// Its parameters.
    pub parameters: Parameters,
}

impl Rival {
    /// The effects at work where this one is.
    pub(super) fn tables(&self) -> Vec<EffectTable> {
        let table = |id: &str, parameters: &Parameters| EffectTable { id: id.into(), parameters: parameters.clone() };
        let beside = self.beside.iter().map(|b| table(&b.id, &b.parameters));
        std::iter::once(table(&self.id, &self.parameters)).chain(beside).collect()
    }

    /// Whether it is this effect, or one beside it.
    pub(super) fn has(&self, id: &str) -> bool {
        self.id == id || self.beside.iter().any(|b| b.id == id)
    }
}

/// Ids of the effects in question: `among` where some are named, else the class of the main effect of `answer`, or its first
/// class; and of the effects that are found beside them.
///
/// # Errors
/// [`ErrorKind::Usage`] if `among` names an effect that `library` does not have for recordings of this `kind`, one twice, or
/// just one.
pub(super) fn in_question(
    answer: Option<&Answer>,
    among: &[String],
    library: &Library,
    kind: Kind,
) -> Result<(Vec<String>, Vec<String>)> {
    let own = |answer: &Answer| {
        let classes = || answer.cannot_tell_apart.iter();
        let of_main = classes().find(|class| answer.main.as_ref().is_some_and(|main| class.contains(main)));
        of_main.or_else(|| classes().next()).cloned()
    };
    let class = if among.is_empty() { answer.and_then(own).unwrap_or_default() } else { among.to_vec() };
    if !among.is_empty() {
        let known: Vec<&str> = match kind {
            Kind::Driving => library.driving().map(|e| e.about().id).collect(),
            Kind::Stationary => library.effects().map(|e| e.about().id).collect(),
        };
        asked::check("among", &among.iter().map(String::as_str).collect::<Vec<_>>(), &known, kind)?;
        if among.len() < 2 {
            let found = "one effect has no rival";
            return Err(Error::new(ErrorKind::Usage, "among", found).hint("name two effects or more"));
        }
    }
    let together = answer.map_or(&[][..], |answer| &answer.together);
    let beside = together.iter().filter(|id| !class.contains(id)).cloned().collect();
    Ok((class, beside))
}

/// The effects `ids` as rivals, each fitted to `log` with the effects `beside`, and those that nothing in the log would show. The log
/// gives no size to those that are in neither.
///
/// # Errors
/// Those of [`explain`]; of effects that nothing in the log would show only if it shows none of them.
pub(super) fn fitted(
    (config, log, since_power_on_s): (&Config, &Log, f64),
    library: &Library,
    ids: &[String],
    beside: &[String],
) -> Result<(Vec<Rival>, Vec<String>)> {
    let one = |id: &String| -> Result<Option<Rival>> {
        let all: Vec<&str> = std::iter::once(id).chain(beside).map(String::as_str).collect();
        let found = explain(config, log, library, &all, since_power_on_s)?;
        let parameters = |id: &str| -> Option<Parameters> {
            let own = found.effects.iter().find(|e| e.id == id)?;
            Some(own.parameters.iter().map(|(name, value)| (name.clone(), value.estimate)).collect())
        };
        let beside = beside.iter().filter_map(|id| Some(Beside { parameters: parameters(id)?, id: id.clone() }));
        Ok(parameters(id).map(|own| Rival { id: id.clone(), parameters: own, beside: beside.collect() }))
    };
    let all: Vec<Result<Option<Rival>>> = ids.par_iter().map(one).collect();
    let shown = all.iter().any(Result::is_ok);
    let is_hidden = |one: &Result<_>| shown && one.as_ref().is_err_and(|e| e.kind == ErrorKind::Column);
    let (hidden, fitted): (Vec<_>, Vec<_>) = ids.iter().zip(all).partition(|(_, one)| is_hidden(one));
    let rivals = fitted.into_iter().map(|(_, one)| one).collect::<Result<Vec<_>>>()?;
    Ok((rivals.into_iter().flatten().collect(), hidden.into_iter().map(|(id, _)| id.clone()).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::ids as driving;
    use crate::effects::ids;

    fn answer(classes: &[&[&str]], main: Option<&str>, together: &[&str]) -> Answer {
        let owned = |ids: &[&str]| ids.iter().map(|id| (*id).to_owned()).collect::<Vec<_>>();
        let mut answer = crate::gap::answer::compose::answer(&Default::default(), |_| None);
        answer.cannot_tell_apart = classes.iter().map(|c| owned(c)).collect();
        answer.main = main.map(str::to_owned);
        answer.together = owned(together);
        answer
    }

    #[test]
    fn the_class_of_the_main_effect_is_in_question() {
        let library = Library::new();
        let (tone, ramp, walk, step) = (ids::tone(), ids::rate_ramp(), ids::rate_random_walk(), ids::bias_step());
        let of = |answer: &Answer| in_question(Some(answer), &[], &library, Kind::Stationary).unwrap();
        let found = of(&answer(&[&[tone, step], &[ramp, walk]], Some(ramp), &[ramp, tone]));
        assert_eq!(found, (vec![ramp.to_owned(), walk.to_owned()], vec![tone.to_owned()]));
        let found = of(&answer(&[&[tone, step], &[ramp, walk]], None, &[]));
        assert_eq!(found.0, [tone, step]);
        assert_eq!(of(&answer(&[], Some(ramp), &[ramp])), (vec![], vec![ramp.to_owned()]));
    }

    #[test]
    fn what_is_no_rival_is_refused() {
        let library = Library::new();
        let of = |ids: &[&str], kind| {
            let among: Vec<String> = ids.iter().map(|id| (*id).to_owned()).collect();
            in_question(None, &among, &library, kind)
        };
        let (payload, radius) = (driving::payload(), driving::radius_scale());
        assert!(of(&[payload, radius], Kind::Driving).is_ok());
        for ids in [&[payload][..], &[payload, payload], &[payload, ids::rate_ramp()]] {
            assert_eq!(of(ids, Kind::Driving).unwrap_err().kind, ErrorKind::Usage, "{ids:?}");
        }
        assert_eq!(of(&[payload, radius], Kind::Stationary).unwrap_err().kind, ErrorKind::Usage);
    }
}
