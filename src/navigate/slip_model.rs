//! dv/dt, dω/dt, dφ̇L/dt, dφ̇R/dt of wheels that slip ([`Slipping`]): the motion model of ten states
//!
//! The wheels' speeds are states of their own, and with them the slip: λ follows from v, ω and φ̇ ([`crate::traction`]).
//! Noise: each wheel's torque has white noise of density q, held over a step. Where no torques are known, those that
//! would keep the speeds act, with the noise that gives a rolling robot the given acceleration densities.
//!
//! Near and beyond the peak of μ the step bends within the uncertainty of the slip, and its derivative at the mean makes
//! the filter too sure. There it is linearised over the uncertainty: with points at ±√3 standard deviations along the four
//! directions of the velocities' covariance and the two disturbances, slope (f⁺ - f⁻)/(2√3), shift of the mean
//! (f⁺ + f⁻ - 2 f)/6, and, as noise, what a line leaves of it, (f⁺ + f⁻ - 2 f) √2/6: second-order divided differences
//! (Nørgaard, Poulsen, Ravn, Automatica 36 (2000) 1627) in the six directions that bend; all else stays analytic.

use super::model::{BENDS, Input, MotionModel, Transition, bits, state};
use super::rolling_model::{motion_of, set_motion};
use super::ud::UdCovariance;
use crate::config::{Traction, Vehicle};
use crate::vehicle::{Rolling, Slipping, SlippingState};
use nalgebra::{Matrix4, SMatrix, SVector};
use state::{HEADING, SPEED, X, Y, YAW_RATE};

/// Number of states.
pub(crate) const SLIP_STATES: usize = 10;
const N: usize = SLIP_STATES;

/// Index of φ̇L, rad/s; that of φ̇R follows.
pub(crate) const WHEELS: usize = 8;

/// Before the first reading a wheel is taken to roll, up to this standard deviation, rad/s.
const ROLLING_STD_RAD_S: f64 = 0.01;

/// The states that the step's velocities come from.
const CAUSES: [usize; 4] = [SPEED, YAW_RATE, WHEELS, WHEELS + 1];
const CAUSING: u32 = bits(&CAUSES);
/// States that a step changes.
const MOVED: [usize; 7] = [X, Y, HEADING, SPEED, YAW_RATE, WHEELS, WHEELS + 1];

/// Squared distance of the points over which a bent step is linearised, in variances: that of [`super::UnscentedFilter`].
const SPREAD: f64 = 3.0;
/// The law counts as bent where, over that distance, its second difference exceeds this part of its first difference: the
/// mean then shifts by 3 % of the standard deviation. Below, the derivative at the mean is as good.
const BEND: f64 = 0.05;
/// And this friction coefficient, where the law is flat.
const BEND_FLOOR: f64 = 1e-5;
/// A step crosses the bend where the slope of the law changes by this part of that at zero slip.
const SLOPE_CROSSED: f64 = 0.25;

/// The slipping robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlipModel {
    robot: Slipping,
    rolling: Rolling,
    torque_noise_density: f64,
}

impl SlipModel {
    /// The robot that the two tables describe.
    #[must_use]
    pub fn new(vehicle: &Vehicle, traction: &Traction) -> Self {
        Self {
            robot: Slipping::new(vehicle, traction),
            rolling: Rolling::new(vehicle),
            torque_noise_density: vehicle.torque_noise_n_m_sqrt_s,
        }
    }

    fn torques(&self, mean: &SVector<f64, N>, input: Input) -> [f64; 2] {
        match input {
            Input::Torques(torques) => torques,
            Input::Accelerations(_) => self.rolling.torques_for(&motion_of(mean), 0.0, 0.0),
        }
    }

    /// Where the law of traction bends within the uncertainty of a wheel's slip, before or after the step, or the step
    /// crosses the law's bend: a root of the velocities' covariance, and which of its columns and of the disturbances
    /// have a part in it.
    fn bends(
        &self,
        covariance: &UdCovariance<N>,
        before: &SlippingState,
        after: &SlippingState,
        step: &Transition<N>,
    ) -> Option<(Matrix4<f64>, [bool; BENDS])> {
        let law = self.robot.law();
        let root = Matrix4::from_fn(|i, j| covariance.element(CAUSES[i], CAUSES[j])).cholesky()?.l();
        let carried = Matrix4::from_fn(|i, j| step.phi[(CAUSES[i], CAUSES[j])]) * root;
        let slips = [before, after].map(|s| (self.robot.slips(s), self.robot.slip_derivatives(s)));
        let mut directions = [false; BENDS];
        for side in 0..2 {
            let [(slip_before, by_before), (slip_after, by_after)] = slips.map(|(s, by)| (s[side].slip, by[side]));
            let along =
                |by: [f64; 3], column: [f64; 4]| by[0] * column[0] + by[1] * column[1] + by[2] * column[2 + side];
            let at_first = |k: usize| if k < 4 { along(by_before, root.column(k).into_owned().into()) } else { 0.0 };
            let at_last = |k: usize| match k.checked_sub(4) {
                None => along(by_after, carried.column(k).into_owned().into()),
                Some(d) => along(by_after, CAUSES.map(|i| step.gamma[(i, d)] * step.variances[d].sqrt())),
            };
            let moved: [[f64; BENDS]; 2] = [std::array::from_fn(at_first), std::array::from_fn(at_last)];
            let crossing = (law.friction(slip_after)[1] - law.friction(slip_before)[1]).abs();
            let crosses = crossing > SLOPE_CROSSED * law.friction(0.0)[1];
            for (slip, moved) in [slip_before, slip_after].into_iter().zip(moved) {
                let variance = moved.iter().map(|m| m * m).sum::<f64>();
                // first and second difference of the law over so many standard deviations
                let over = |std: f64| {
                    let reach = SPREAD.sqrt() * std;
                    let [up, middle, down] = [slip + reach, slip, slip - reach].map(|s| law.friction(s)[0]);
                    [(up - down).abs(), (up + down - 2.0 * middle).abs()]
                };
                let [odd, even] = over(variance.sqrt());
                let much = BEND * odd + BEND_FLOOR;
                for (direction, m) in directions.iter_mut().zip(moved) {
                    *direction |= crosses && m * m > 0.01 * variance;
                    *direction |= even > much && over(m)[1] > much / BENDS as f64;
                }
            }
        }
        directions.contains(&true).then_some((root, directions))
    }

    /// Replaces the derivatives at the mean by differences over the spread of the velocities and disturbances, in the
    /// `directions` that bend.
    fn linearise_over(
        &self,
        (root, directions): (Matrix4<f64>, [bool; BENDS]),
        mean: &SVector<f64, N>,
        input: Input,
        dt_s: f64,
        out: &mut Transition<N>,
    ) {
        let centre = out.mean;
        let differences = |up: SVector<f64, N>, down: SVector<f64, N>| {
            let (up, down) = (up - centre, down - centre);
            ((up - down) * (0.5 / SPREAD.sqrt()), up + down)
        };
        let mut bend = SMatrix::<f64, N, BENDS>::zeros();
        let mut slopes = SMatrix::<f64, N, 4>::zeros();
        let residual = (0.25 * (SPREAD - 1.0)).sqrt() / SPREAD;
        for k in 0..4 {
            if !directions[k] {
                let column = SVector::<f64, 4>::from(root.column(k).into_owned());
                for i in MOVED {
                    slopes[(i, k)] = (0..4).map(|j| out.phi[(i, CAUSES[j])] * column[j]).sum();
                }
                continue;
            }
            let at = |sign: f64| {
                let mut x = *mean;
                (0..4).for_each(|i| x[CAUSES[i]] += sign * SPREAD.sqrt() * root[(i, k)]);
                self.disturbed(&x, input, [0.0; 2], dt_s)
            };
            let (odd, even) = differences(at(1.0), at(-1.0));
            slopes.set_column(k, &odd);
            bend.set_column(k, &even);
        }
        for k in (0..2).filter(|k| directions[4 + k]) {
            let std = out.variances[k].sqrt();
            let at = |sign: f64| {
                let mut size = [0.0; 2];
                size[k] = sign * SPREAD.sqrt() * std;
                self.disturbed(mean, input, size, dt_s)
            };
            let (odd, even) = differences(at(1.0), at(-1.0));
            if std > 0.0 {
                out.gamma.set_column(k, &(odd / std));
            }
            bend.set_column(4 + k, &even);
        }
        // slopes by the directions, to slopes by the velocities: A L = slopes
        let Some(by_velocities) = root.transpose().solve_upper_triangular(&slopes.transpose()) else { return };
        for (k, cause) in CAUSES.into_iter().enumerate() {
            for i in MOVED {
                out.phi[(i, cause)] = by_velocities[(k, i)];
            }
        }
        let shift = bend.column_sum() * (0.5 / SPREAD);
        for i in MOVED {
            out.mean[i] += shift[i];
        }
        out.bend = Some(bend * residual);
    }

    /// Torques (left, right) of each of the two disturbances.
    fn by_disturbance(&self, input: Input) -> [[f64; 2]; 2] {
        match input {
            Input::Torques(_) => [[1.0, 0.0], [0.0, 1.0]],
            Input::Accelerations(_) => {
                let half_a = 0.5 / self.rolling.acceleration_by_torque();
                let half_alpha = 0.5 / self.rolling.yaw_acceleration_by_torque();
                [[half_a, half_a], [-half_alpha, half_alpha]]
            }
        }
    }
}

impl MotionModel<N> for SlipModel {
    const DEPENDS: [u32; N] = {
        let mut rows = [0; N];
        rows[X] = bits(&[X, HEADING]) | CAUSING;
        rows[Y] = bits(&[Y, HEADING]) | CAUSING;
        rows[HEADING] = bits(&[HEADING]) | CAUSING;
        (rows[SPEED], rows[YAW_RATE]) = (CAUSING, CAUSING);
        (rows[WHEELS], rows[WHEELS + 1]) = (CAUSING, CAUSING);
        rows
    };

    const DISTURBED: [u32; N] = {
        let mut rows = [0; N];
        let mut i = 0;
        while i < MOVED.len() {
            rows[MOVED[i]] = bits(&[0, 1]);
            i += 1;
        }
        rows
    };

    fn start(&self, mean: &mut SVector<f64, N>, covariance: &mut SMatrix<f64, N, N>) {
        for side in 0..2 {
            let row = rolling_row(&self.rolling, side);
            mean[WHEELS + side] = row.dot(mean);
            let with = *covariance * row;
            for i in 0..WHEELS + side {
                covariance[(i, WHEELS + side)] = with[i];
                covariance[(WHEELS + side, i)] = with[i];
            }
            covariance[(WHEELS + side, WHEELS + side)] = row.dot(&with) + ROLLING_STD_RAD_S * ROLLING_STD_RAD_S;
        }
    }

    fn carry(
        &self,
        mean: &SVector<f64, N>,
        covariance: Option<&UdCovariance<N>>,
        input: Input,
        dt_s: f64,
        out: &mut Transition<N>,
    ) {
        let before = state_of(mean);
        let (after, j) = self.robot.step_with_jacobian(&before, self.torques(mean, input), dt_s);
        set_state(&mut out.mean, &after);
        for (row, i) in j.pose.iter().zip([X, Y, HEADING]).chain(j.velocities.iter().zip(CAUSES)) {
            for (value, k) in row.iter().zip(CAUSES) {
                out.phi[(i, k)] = *value;
            }
            for (k, [left, right]) in self.by_disturbance(input).into_iter().enumerate() {
                out.gamma[(i, k)] = row[4] * left + row[5] * right;
            }
        }
        for i in [X, Y] {
            out.phi[(i, HEADING)] = j.position_by_heading[i];
        }
        [out.variances[0], out.variances[1]] = self.variances(input, dt_s);
        if let Some(bends) = covariance.and_then(|covariance| self.bends(covariance, &before, &after, out)) {
            self.linearise_over(bends, mean, input, dt_s, out);
        }
    }

    fn disturbed(&self, mean: &SVector<f64, N>, input: Input, disturbances: [f64; 2], dt_s: f64) -> SVector<f64, N> {
        let mut torques = self.torques(mean, input);
        for (size, by) in disturbances.into_iter().zip(self.by_disturbance(input)) {
            (0..2).for_each(|i| torques[i] += size * by[i]);
        }
        let mut after = *mean;
        set_state(&mut after, &self.robot.step(&state_of(mean), torques, dt_s));
        after
    }

    fn torque_noise_density(&self) -> f64 {
        self.torque_noise_density
    }

    fn wheel_row(&self, side: usize) -> SVector<f64, N> {
        let mut h = SVector::zeros();
        h[WHEELS + side] = 1.0;
        h
    }

    fn slips(&self, mean: &SVector<f64, N>) -> Option<[(f64, SVector<f64, N>); 2]> {
        let s = state_of(mean);
        let (slips, by) = (self.robot.slips(&s), self.robot.slip_derivatives(&s));
        Some(std::array::from_fn(|i| {
            let mut row = SVector::zeros();
            [row[SPEED], row[YAW_RATE], row[WHEELS + i]] = by[i];
            (slips[i].slip, row)
        }))
    }
}

/// The speed of a wheel that rolls, by v and ω.
fn rolling_row(robot: &Rolling, side: usize) -> SVector<f64, N> {
    let mut row = SVector::zeros();
    [row[SPEED], row[YAW_RATE]] = robot.wheel_by_motion()[side];
    row
}

fn state_of(m: &SVector<f64, N>) -> SlippingState {
    SlippingState { motion: motion_of(m), wheels_rad_s: [m[WHEELS], m[WHEELS + 1]] }
}

fn set_state(mean: &mut SVector<f64, N>, s: &SlippingState) {
    set_motion(mean, &s.motion);
    [mean[WHEELS], mean[WHEELS + 1]] = s.wheels_rad_s;
}

#[cfg(test)]
mod tests;
