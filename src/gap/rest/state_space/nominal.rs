//! y(t) = e(t; C1, C2, T) + white noise, with C1, C2 and T inside their stated repeatability, linearised about nominal
//! values

use super::{Coefficient, StateSpaceModel};
use crate::model::Scene;

impl StateSpaceModel {
    /// Predictive model of the nominal simulator for a recording of `scene`: coefficients 0, 1 and 2 are the deviations
    /// of C2 (rad/s), of C1 (rad/s) and of T (s). T enters through its derivative: the error is of second order in its
    /// relative deviation.
    #[must_use]
    pub(crate) fn nominal(scene: &Scene) -> Self {
        let rows = scene.len();
        let warm_up = &scene.warm_up;
        let mut columns = [const { Vec::new() }; 3];
        let mut fixed = Vec::with_capacity(rows);
        for row in 0..rows {
            let t_s = scene.time.at(row);
            let [by_c1, by_c2, by_time_constant] = warm_up.gradient(t_s);
            fixed.push(warm_up.error_rad_s(t_s));
            for (column, value) in columns.iter_mut().zip([by_c2, by_c1, by_time_constant]) {
                column.push(value);
            }
        }
        let relative = scene.warm_up_relative_std;
        let stds =
            [scene.turn_on_bias_std_rad_s, relative * warm_up.c1_rad_s.abs(), relative * warm_up.time_constant_s];
        let coefficients =
            columns.into_iter().zip(stds).map(|(column, std)| Coefficient { column, mean: 0.0, std }).collect();
        let mut believed = Self::white(rows, scene.step_s, scene.white_std_rad_s);
        believed.fixed_rad_s = Some(fixed);
        believed.coefficients = coefficients;
        believed
    }
}
