//! Effects of the user's own: tables `[[custom_effect]]`, checked so far that simulator and diagnosis can use what they say.

use super::acts_on::ActsOn;
use super::law::Law;
use crate::error::{Error, ErrorKind, Result};
use crate::math::expression::is_reserved;
use crate::math::random::Stream;
use serde::{Deserialize, Serialize};

/// Beginning of the id of every effect of the user's own: none of the library has it.
pub const OWN: &str = "custom.";
/// Points at which an expression is tried.
const TRIED: usize = 400;
/// Most parameters of an effect.
const MOST_PARAMETERS: usize = 8;

/// `[[custom_effect]]`: an effect of the user's own, as an expression in signals and parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CustomEffect {
    /// Identifier, such as `custom.tether`; it begins with `custom.`.
    pub id: String,
    /// For people: "tether".
    pub title: String,
    /// Where it acts: what the expression is added to, in its unit.
    pub acts_on: ActsOn,
    /// The expression, in signals and parameters. See [custom](custom.md).
    pub expression: String,
    /// Its parameters. The first one says how large it is.
    #[serde(rename = "parameter")]
    pub parameters: Vec<CustomParameter>,
}

/// `[[custom_effect.parameter]]`: a number in the expression that is fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CustomParameter {
    /// Name in the expression and in `[[effect]]`.
    pub name: String,
    /// Its unit, for people.
    pub unit: String,
    /// Smallest and largest value that is physically possible.
    pub bounds: [f64; 2],
    /// Value at which the effect changes nothing; not stated of a parameter that only shapes the effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub null: Option<f64>,
    /// Sizes in practice, from and to: of a parameter with `null` the distance from it, of another one its values.
    pub plausible: [f64; 2],
    /// For people: what it is.
    pub meaning: String,
}

impl CustomParameter {
    /// A step from the null value that is plausible, to the side that the bounds leave open.
    #[must_use]
    pub(crate) fn inwards(&self) -> f64 {
        let [low, high] = self.bounds;
        let null = self.null.unwrap_or(low);
        if high - null >= null - low { self.plausible[1].min(high - null) } else { -self.plausible[1].min(null - low) }
    }
}

impl CustomEffect {
    /// The expression, ready to be evaluated.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] with the column for an expression that cannot be read.
    pub fn law(&self, name: &str) -> Result<Law> {
        let parameters: Vec<&str> = self.parameters.iter().map(|p| p.name.as_str()).collect();
        Law::new(&self.expression, self.acts_on.signals(), &parameters).map_err(|fault| {
            let place = format!("`custom_effect.{}.expression`, column {}", self.id, fault.column);
            Error::new(ErrorKind::Config, name, fault.found).at(place).hint(fault.hint)
        })
    }

    fn error(&self, name: &str, key: &str, found: impl std::fmt::Display) -> Error {
        Error::new(ErrorKind::Config, name, found).at(format!("`custom_effect.{}.{key}`", self.id))
    }
}

/// Refuses effects of the user's own that cannot be simulated or fitted. `drives`: whether the configuration is of drives.
pub(super) fn check(effects: &[CustomEffect], drives: bool, name: &str) -> Result<()> {
    for (i, effect) in effects.iter().enumerate() {
        let refuse = |key: &str, found: String, hint: String| Err(effect.error(name, key, found).hint(hint));
        let own = effect.id.strip_prefix(OWN).unwrap_or_default();
        if !is_word(own) {
            let found = format!("{:?} is no name of an effect of one's own", effect.id);
            let tail: String = effect.id.rsplit('.').next().unwrap_or_default().into();
            let tail = if is_word(&tail) { tail } else { "tether".into() };
            let hint =
                format!("ids without {OWN} are the library's: write {OWN}{tail}, in small letters, digits and _");
            return refuse("id", found, hint);
        }
        if effects[..i].iter().any(|e| e.id == effect.id) {
            return refuse("id", "another [[custom_effect]] has this id".into(), "give each an id of its own".into());
        }
        if !drives && effect.acts_on.is_of_drives() {
            let found = "a gyro at rest has no such place, and kind is \"stationary\"".into();
            let hint = "write gyro_bias_rad_s, or kind = \"driving\" with [vehicle] and [encoder]".into();
            return refuse("acts_on", found, hint);
        }
        parameters(effect, name)?;
        let law = effect.law(name)?;
        if let Some(idle) = effect.parameters.iter().enumerate().find(|(i, _)| !law.uses_parameter(*i)) {
            let found = format!("the parameter {} is not in it", idle.1.name);
            return refuse("expression", found, "use it, or delete its table".into());
        }
        tried(effect, &law, name)?;
    }
    Ok(())
}

/// A word of small letters, digits and _, begun by a letter.
fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_lowercase())
        && text.bytes().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'_')
}

fn parameters(effect: &CustomEffect, name: &str) -> Result<()> {
    let all = &effect.parameters;
    if all.is_empty() || all.len() > MOST_PARAMETERS {
        let hint = format!("write one to {MOST_PARAMETERS} tables [[custom_effect.parameter]] below the effect's own");
        return Err(effect.error(name, "parameter", format!("{} parameters", all.len())).hint(hint));
    }
    let signals = effect.acts_on.signals();
    for (i, p) in all.iter().enumerate() {
        let key = |key: &str| format!("{}.{key}", p.name);
        let refuse = |at: String, found: String, hint: &str| Err(effect.error(name, &at, found).hint(hint));
        if !is_word(&p.name) || p.name == "id" || is_reserved(&p.name) {
            let hint = "write small letters, digits and _, begun by a letter; functions, pi and id are no parameters";
            return refuse(key("name"), format!("{:?} is no name of a parameter", p.name), hint);
        }
        if signals.iter().any(|s| s.name == p.name) {
            return refuse(key("name"), format!("{} is a signal", p.name), "give the parameter another name");
        }
        if all[..i].iter().any(|other| other.name == p.name) {
            return refuse(key("name"), "another parameter has this name".into(), "give each a name of its own");
        }
        let [low, high] = p.bounds;
        if !(low.is_finite() && high.is_finite() && low < high) {
            let hint = "write the smallest and the largest possible value, the smaller one first";
            return refuse(key("bounds"), format!("no number lies from {low} to {high}"), hint);
        }
        if let Some(null) = p.null
            && !(null >= low && null <= high)
        {
            return refuse(key("null"), format!("{null} is out of bounds, {low} to {high}"), "widen the bounds");
        }
        let [from, to] = p.plausible;
        let least = if p.null.is_some() { 0.0 } else { f64::NEG_INFINITY };
        if !(from < to && to.is_finite() && from.is_finite() && (from > least || p.null.is_none())) {
            let hint = "write the smaller one first; of a parameter with null, both are above zero: distances from it";
            return refuse(key("plausible"), format!("{from} to {to} is no range"), hint);
        }
        let reach = p.null.map_or([from, to], |null| [null - to, null + to]);
        let fits = match p.null {
            Some(_) => reach[0] >= low || reach[1] <= high,
            None => from >= low && to <= high,
        };
        if !fits {
            let hint = "sizes in practice lie inside what is possible";
            return refuse(key("plausible"), format!("{from} to {to} leaves the bounds, {low} to {high}"), hint);
        }
    }
    Ok(())
}

/// Tries the expression: it is finite wherever parameters and signals may lie, zero where all parameters have their null value,
/// and where it acts on a gyro at rest, linear in these parameters.
fn tried(effect: &CustomEffect, law: &Law, name: &str) -> Result<()> {
    let all = &effect.parameters;
    let signals = effect.acts_on.signals();
    let shown = |x: &[f64], theta: &[f64]| {
        let used =
            signals.iter().zip(x).enumerate().filter(|(i, _)| law.uses_signal(*i)).map(|(_, (s, v))| (s.name, *v));
        let own = all.iter().zip(theta).map(|(p, v)| (p.name.as_str(), *v));
        used.chain(own).map(|(name, v)| format!("{name} = {v:.4}")).collect::<Vec<_>>().join(", ")
    };
    if all.iter().all(|p| p.null.is_none()) {
        let hint = "state null of the parameter that says how large the effect is: mostly 0";
        return Err(effect.error(name, "parameter", "no parameter has a null value").hint(hint));
    }
    let mut draw = Stream::new(0, 0);
    // ends and zero are where poles are
    let mut within = |[low, high]: [f64; 2]| match (draw.uniform() * 8.0) as usize {
        0 => low,
        1 => high,
        2 if low <= 0.0 && high >= 0.0 => 0.0,
        _ => low + (high - low) * draw.uniform(),
    };
    for _ in 0..TRIED {
        let x: Vec<f64> = signals.iter().map(|s| within(s.range)).collect();
        let mut theta: Vec<f64> = all.iter().map(|p| within(p.bounds)).collect();
        let value = law.value(|i| x[i], &theta);
        if !value.is_finite() {
            let found = format!("is {value} at {}", shown(&x, &theta));
            let hint = "narrow the bounds, or keep it away from the pole: x/sqrt(x^2 + 1e-4) is finite at 0 where x/abs(x) is not";
            return Err(effect.error(name, "expression", found).hint(hint));
        }
        all.iter().zip(&mut theta).for_each(|(p, v)| *v = p.null.unwrap_or(*v));
        let nothing = law.value(|i| x[i], &theta);
        if nothing.abs() > 1e-12 * value.abs() {
            let found = format!("is {nothing:.4e} at {}, where it should change nothing", shown(&x, &theta));
            let hint = "make it zero where all parameters have their null value: k*(a - b) for null = 0 of k";
            return Err(effect.error(name, "expression", found).hint(hint));
        }
    }
    if effect.acts_on.is_of_drives() { Ok(()) } else { linear(effect, law, name) }
}

/// At rest parameters with a null value are coefficients, and at most one other parameter is looked for.
fn linear(effect: &CustomEffect, law: &Law, name: &str) -> Result<()> {
    let all = &effect.parameters;
    let shapes: Vec<&str> = all.iter().filter(|p| p.null.is_none()).map(|p| p.name.as_str()).collect();
    if shapes.len() > 1 {
        let found = format!("{} have no null value, and at rest one parameter may have none", shapes.join(", "));
        return Err(effect.error(name, "parameter", found).hint("write all but one as numbers into the expression"));
    }
    let signals = effect.acts_on.signals();
    let mut draw = Stream::new(0, 1);
    for _ in 0..TRIED {
        let x: Vec<f64> = signals.iter().map(|s| s.range[0] + (s.range[1] - s.range[0]) * draw.uniform()).collect();
        let mut step = || -> Vec<f64> {
            let of = |p: &CustomParameter| match p.null {
                Some(null) => null + p.inwards() * draw.uniform(),
                None => p.plausible[0],
            };
            all.iter().map(of).collect()
        };
        let (a, b) = (step(), step());
        let sum: Vec<f64> =
            all.iter().zip(&a).zip(&b).map(|((p, a), b)| p.null.map_or(*a, |null| a + b - null)).collect();
        let [at_a, at_b, at_sum] = [&a, &b, &sum].map(|theta| law.value(|i| x[i], theta));
        if (at_sum - at_a - at_b).abs() > 1e-9 * (at_a.abs() + at_b.abs() + at_sum.abs()) {
            let sizes: Vec<&str> = all.iter().filter(|p| p.null.is_some()).map(|p| p.name.as_str()).collect();
            let found =
                format!("is not linear in {}, and at rest parameters with a null value are factors", sizes.join(", "));
            let hint = "write it as k*f(...), and take null out of the parameters inside f";
            return Err(effect.error(name, "expression", found).hint(hint));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
