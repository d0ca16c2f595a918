//! value = null ± u;  null exp(±u) where only a ratio has a meaning;  1/value = 1/null + u where null is beyond all reach
//!
//! An effect in one direction, by its distance u from the value at which it changes nothing. Its other parameters are
//! what they are where nobody states them; those that must be stated are typical of the log: the middle node of their
//! prior, or the geometric middle of their range.

use crate::config::EffectTable;
use crate::effects::drive::Driving;
use crate::effects::{About, Effect, Explanation, Parameter, Parameters, Signal};
use crate::model::Scene;

/// How values follow from distances.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale {
    /// null ± u
    Offset,
    /// null exp(±u)
    Ratio,
    /// 1/value = 1/null + u
    Inverse,
}

/// One effect in one direction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Direction {
    pub id: &'static str,
    /// Name of the parameter that says how large it is.
    pub parameter: &'static str,
    /// Value at which it changes nothing.
    pub null: f64,
    /// 1 where the value grows with the distance, else -1.
    pub sign: f64,
    /// Parameters that must be stated beside it.
    pub others: Parameters,
    scale: Scale,
    bounds: [f64; 2],
}

impl Direction {
    /// The directions of an effect: both where its size has both. `nominal`: parameters at which it changes nothing,
    /// where the description does not say; `typical`: others that must be stated.
    pub(super) fn of(about: &'static About, nominal: &Parameters, typical: &Parameters) -> Vec<Self> {
        let null = |p: &Parameter| nominal.get(p.name).copied().or(p.null);
        let Some((size, null)) = about.parameters.iter().find_map(|p| Some((p, null(p)?))) else { return Vec::new() };
        let [low, high] = size.bounds;
        let scale = match null {
            n if n >= high && low > 0.0 => Scale::Inverse,
            n if low > 0.0 && n > 0.0 => Scale::Ratio,
            _ => Scale::Offset,
        };
        let signs: &[f64] = match scale {
            Scale::Inverse => &[-1.0],
            _ if null > low => &[1.0, -1.0],
            _ => &[1.0],
        };
        let of_other = |p: &Parameter| {
            let stated = nominal.get(p.name).or_else(|| typical.get(p.name)).copied();
            (p.name.to_owned(), stated.unwrap_or(0.5 * (p.bounds[0] + p.bounds[1])))
        };
        let others: Parameters =
            about.parameters.iter().filter(|p| p.required && p.name != size.name).map(of_other).collect();
        let one = |sign: &f64| Self {
            id: about.id,
            parameter: size.name,
            null,
            sign: *sign,
            others: others.clone(),
            scale,
            bounds: size.bounds,
        };
        signs.iter().map(one).collect()
    }

    /// Value of the parameter at the distance `u`.
    pub(super) fn value(&self, u: f64) -> f64 {
        match self.scale {
            Scale::Offset => self.null + self.sign * u,
            Scale::Ratio => self.null * (self.sign * u).exp(),
            Scale::Inverse => (self.null.recip() + u).recip(),
        }
    }

    /// The largest distance inside the bounds.
    pub(super) fn most(&self) -> f64 {
        let [low, high] = self.bounds;
        let end = if self.sign > 0.0 { high } else { low };
        let most = match self.scale {
            Scale::Offset => (end - self.null).abs(),
            Scale::Ratio => (end / self.null).ln().abs(),
            Scale::Inverse => low.recip() - self.null.recip(),
        };
        // rounding must not lead beyond
        most * (1.0 - 1e-9)
    }

    /// The effect at the distance `u`.
    pub(super) fn table(&self, u: f64) -> EffectTable {
        let mut parameters = self.others.clone();
        parameters.insert(self.parameter.into(), self.value(u));
        EffectTable { id: self.id.into(), parameters }
    }
}

/// Typical parameters of an effect at rest in this scene, by the prior of its explanation; empty where all follow from
/// its description. None where the scene cannot show it.
pub(super) fn typical(effect: &dyn Effect, scene: &Scene) -> Option<Parameters> {
    let about = effect.about();
    Some(match effect.explanation(scene)? {
        Explanation::Signal(s) | Explanation::Line(s) | Explanation::Variance(s) => of_signal(s.as_ref(), scene),
        Explanation::Noise(n) | Explanation::Filter(n) | Explanation::Level(n) => {
            let middle = |range: [f64; 2]| (range[0] * range[1]).sqrt();
            n.names().into_iter().map(str::to_owned).zip(n.range(scene).into_iter().map(middle)).collect()
        }
        // between a row and the log
        Explanation::TwoLevels => {
            Parameters::from([(about.name(1).into(), (scene.step_s * scene.time.span_s()).sqrt())])
        }
        Explanation::TurnOn | Explanation::Outliers { .. } | Explanation::Lattice => Parameters::new(),
    })
}

/// Typical parameters without a null value of an effect of drives.
pub(super) fn typical_of_drives(effect: &dyn Driving) -> Parameters {
    let Some(change) = effect.change() else { return Parameters::new() };
    let mut all = change.parameters(&vec![0.0; change.coordinates().len()]);
    all.retain(|name, _| effect.about().parameters.iter().any(|p| p.name == name && p.null.is_none()));
    all
}

fn of_signal(signal: &dyn Signal, scene: &Scene) -> Parameters {
    let shapes = signal.shapes(scene);
    let Some(shape) = shapes.get(shapes.len() / 2) else { return Parameters::new() };
    let coefficients = vec![0.0; signal.columns(scene, shape).len()];
    signal.parameters(scene, shape, &coefficients)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bias::WarmUp;
    use crate::effects::{drive, registry};
    use crate::signal::TimeAxis;

    fn scene() -> Scene {
        let len = 2000;
        Scene {
            time: TimeAxis::Uniform { start_s: 0.0, step_s: 0.5, len },
            step_s: 0.5,
            temperature_c: Some((0..len).map(|i| 20.0 + 0.01 * i as f64).collect()),
            power_on_temperature_c: None,
            supply_v: Some((0..len).map(|i| 5.0 + 0.1 * (0.01 * i as f64).sin()).collect()),
            warm_up: WarmUp { c1_rad_s: 2e-3, c2_rad_s: -3e-3, time_constant_s: 180.0 },
            white_std_rad_s: 1e-3,
            turn_on_bias_std_rad_s: 5e-3,
            warm_up_relative_std: 0.1,
        }
    }

    /// Every effect has a size, and what is simulated at each of its ends is inside its bounds.
    #[test]
    fn every_effect_has_a_direction_that_can_be_simulated() {
        let scene = scene();
        for effect in registry() {
            let typical = typical(*effect, &scene).unwrap();
            let all = Direction::of(effect.about(), &effect.nominal(&scene), &typical);
            assert!(!all.is_empty(), "{}", effect.about().id);
            for one in all {
                for u in [1e-9 * one.most(), 0.5 * one.most(), one.most()] {
                    let made = effect.simulated(&one.table(u).parameters, &scene, 1);
                    assert!(made.is_ok(), "{} {u}: {:?}", one.id, made.err());
                }
            }
        }
        for effect in drive::registry() {
            let all = Direction::of(effect.about(), &Parameters::new(), &Parameters::new());
            assert!(!all.is_empty(), "{}", effect.about().id);
            for one in all {
                for u in [1e-9 * one.most(), one.most()] {
                    let made = effect.simulated(&one.table(u).parameters, 60.0, 1);
                    assert!(made.is_ok(), "{} {u}: {:?}", one.id, made.err());
                }
            }
        }
    }

    #[test]
    fn values_leave_the_null_in_their_direction() {
        let parameter = |bounds, null| Parameter { name: "size", meaning: "", bounds, null, required: true };
        let of = |bounds, null: f64| {
            let parameters: &'static [Parameter] = Box::leak(Box::new([parameter(bounds, Some(null))]));
            let about: &'static About = Box::leak(Box::new(About { parameters, ..*registry()[0].about() }));
            Direction::of(about, &Parameters::new(), &Parameters::new())
        };
        let both = of([-1.0, 2.0], 0.0);
        assert_eq!(both.iter().map(|d| d.value(0.5)).collect::<Vec<_>>(), [0.5, -0.5]);
        assert_eq!(of([0.0, 2.0], 0.0).len(), 1);
        let ratios = of([0.01, 100.0], 1.0);
        assert!((ratios[0].value(2f64.ln()) - 2.0).abs() < 1e-12 && (ratios[1].value(2f64.ln()) - 0.5).abs() < 1e-12);
        let open = &of([1e-6, 1e7], 1e7)[..];
        assert!(open.len() == 1 && (open[0].value(0.1) - 10.0).abs() < 1e-4);
        assert!(open[0].value(open[0].most()) >= 1e-6);
    }
}
