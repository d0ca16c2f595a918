//! b(t) = f(t, temperature, supply; θ) = Σ_j β_j x_j(t; shape), β_j = θ_j - null_j
//!
//! Parameters with a null value are coefficients: their columns x_j are f where they alone are away from it by one. A parameter
//! without one is the shape.

use super::defined::Defined;
use crate::config::{ActsOn, CustomParameter};
use crate::effects::about::{About, Parameters};
use crate::effects::effect::Effect;
use crate::effects::explanation::{Column, Explanation, Signal};
use crate::effects::parts::{Checked, covariate, log_spaced, path, varies};
#[cfg(test)]
use crate::effects::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, Scene};
use crate::signal::names;

/// Nodes of the shape.
const NODES: usize = 16;
/// Ratio of the ends of a range above zero from which on its nodes are even in the logarithm.
const WIDE: f64 = 10.0;

/// An effect of the user's own on a gyro at rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Custom(pub &'static Defined);

impl Effect for Custom {
    fn about(&self) -> &'static About {
        self.0.about
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::default()
    }

    fn simulated(&self, parameters: &Parameters, scene: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        Checked::of(self.0.about, parameters)?;
        for (name, values) in followed(scene) {
            if self.0.follows(name) {
                covariate(values.clone(), self.0.about, name, false)?;
            }
        }
        Ok(path(self.along(scene, &self.0.values(parameters))))
    }

    fn explanation(&self, scene: &Scene) -> Option<Explanation> {
        let varies = |values: &Option<Vec<f64>>| values.as_ref().is_some_and(|v| varies(v));
        let shows = followed(scene).into_iter().all(|(name, values)| !self.0.follows(name) || varies(values));
        shows.then(|| Explanation::Signal(Box::new(*self)))
    }
}

/// Covariates of a scene by the names of their signals.
fn followed(scene: &Scene) -> [(&'static str, &Option<Vec<f64>>); 2] {
    [(names::TEMPERATURE, &scene.temperature_c), (names::SUPPLY, &scene.supply_v)]
}

impl Custom {
    /// The bias in each row, rad/s; NaN where the scene lacks what it follows.
    fn along(&self, scene: &Scene, values: &[f64]) -> Vec<f64> {
        let signals = ActsOn::GyroBiasRadS.signals();
        let of =
            |name: &str| followed(scene).into_iter().find(|(known, _)| *known == name).and_then(|(_, v)| v.as_deref());
        let covariates: Vec<Option<&[f64]>> = signals.iter().map(|s| of(s.name)).collect();
        // what is no covariate is the time
        let at = |row: usize, signal: usize| match covariates[signal] {
            Some(values) => values[row],
            None if signal == 0 => scene.time.at(row),
            None => f64::NAN,
        };
        (0..scene.len()).map(|row| self.0.law.value(|signal| at(row, signal), values)).collect()
    }

    /// Values of all parameters at this shape, those with a null value at it.
    fn null(&self, shape: &[f64]) -> Vec<f64> {
        let mut shape = shape.iter().copied();
        let value = |p: &CustomParameter| p.null.or_else(|| shape.next()).unwrap_or(p.plausible[0]);
        self.0.table.parameters.iter().map(value).collect()
    }

    /// Parameters with a null value, by their places, and these values.
    fn coefficients(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.0.table.parameters.iter().enumerate().filter_map(|(i, p)| Some((i, p.null?)))
    }

    /// The parameter that is looked for; none where all are coefficients.
    fn shaping(&self) -> Option<&CustomParameter> {
        self.0.table.parameters.iter().find(|p| p.null.is_none())
    }
}

impl Signal for Custom {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        let Some([low, high]) = self.shaping().map(|p| p.plausible) else { return vec![Vec::new()] };
        if low > 0.0 && high > WIDE * low {
            return log_spaced(low, high, NODES).into_iter().map(|v| vec![v]).collect();
        }
        (0..NODES).map(|i| vec![low + (high - low) * i as f64 / (NODES - 1) as f64]).collect()
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        let null = self.null(shape);
        let column = |(place, at): (usize, f64)| {
            let mut one = null.clone();
            // a step of a size in practice: one may be far out of bounds
            let step = self.0.table.parameters[place].inwards();
            one[place] = at + step;
            let values = self.along(scene, &one).into_iter().map(|v| v / step).collect();
            Column { values, relative_scale: 1.0 }
        };
        Custom::coefficients(self).map(column).collect()
    }

    fn parameters(&self, _: &Scene, shape: &[f64], coefficients: &[f64]) -> Parameters {
        let mut values = self.null(shape);
        Custom::coefficients(self).zip(coefficients).for_each(|((place, _), by)| values[place] += by);
        self.0.named(&values)
    }

    fn shape(&self, _: &Scene, parameters: &Parameters) -> Option<Vec<f64>> {
        self.shaping().map_or(Some(Vec::new()), |p| Some(vec![*parameters.get(&p.name)?]))
    }

    fn coefficients(&self, _: &Scene, _: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        let values = self.0.values(parameters);
        Some(Custom::coefficients(self).map(|(place, null)| values[place] - null).collect())
    }

    fn refine(&self, _: &Scene) -> Option<Vec<[f64; 2]>> {
        self.shaping().map(|p| vec![p.plausible])
    }

    fn bounds(&self) -> Option<Vec<[f64; 2]>> {
        let all = &self.0.table.parameters;
        Some(Custom::coefficients(self).map(|(place, null)| all[place].bounds.map(|end| end - null)).collect())
    }
}
