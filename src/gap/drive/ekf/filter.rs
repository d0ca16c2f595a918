//! P⁻ = F P F' + Q,  S = H P⁻ H' + R,  K = P⁻ H'/S: the extended Kalman filter of [`crate::gap::drive::ekf::innovations`], one scalar reading
//! at a time
//!
//! A reading that is late by the share δ of the last step reads H (ξ - u), where u is the change of the state by noise
//! w since then: Var u = (δ² + ρ (δ - δ²)) Var w and Cov(ξ, u) = δ Cov(ξ, w). The share ρ of w is white within the
//! step, the rest constant over it. Both wheels read the same u.

use crate::gap::drive::ekf::noise::{LASTING_S, Noise};
use crate::gap::drive::record::Record;
use crate::gap::drive::record::reckoning::FirstPose;
use crate::gap::drive::regressors::basis::Scales;
use crate::model::drive::{DriveModel, Moving};
use std::ops::Range;

/// Number of states: x, y, θ, v, ω.
pub(crate) const N: usize = 5;
/// Place of x.
pub(crate) const X: usize = 0;
/// Place of y.
pub(crate) const Y: usize = 1;
/// Place of θ.
pub(crate) const TH: usize = 2;
/// Place of v.
pub(crate) const V: usize = 3;
/// Place of ω.
pub(crate) const W: usize = 4;
/// States of the pose, which come first.
pub(crate) const PLACES: usize = 3;
/// A state.
pub(crate) type Vector = [f64; N];
/// A matrix of the state, rows then columns.
pub(crate) type Matrix = [[f64; N]; N];

/// F d: the derivatives `d` of the state moved to the next row
pub(crate) fn ahead(f: &Matrix, d: &Vector) -> Vector {
    let mut out = *d;
    out[X] += f[X][TH] * d[TH] + f[X][V] * d[V] + f[X][W] * d[W];
    out[Y] += f[Y][TH] * d[TH] + f[Y][V] * d[V] + f[Y][W] * d[W];
    out[TH] += f[TH][V] * d[V] + f[TH][W] * d[W];
    for i in [V, W] {
        out[i] = f[i][TH] * d[TH] + f[i][V] * d[V] + f[i][W] * d[W];
        // only a force that follows the position has these
        if f[i][X] != 0.0 || f[i][Y] != 0.0 {
            out[i] += f[i][X] * d[X] + f[i][Y] * d[Y];
        }
    }
    out
}

/// Share φ of an acceleration that lasts, and the difference that the acceleration is.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Lasting {
    /// φ
    pub share: f64,
    /// Rows between the two speeds, and the time, s; none before there are two.
    pub over: Option<(usize, f64)>,
    /// Whether the acceleration of this row lasts at all.
    pub lasts: bool,
}

/// Inputs of one step, from one row to the next.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Step {
    /// Torques, left and right, N·m; none: accelerations are not those of the model
    pub torques: Option<[f64; 2]>,
    /// Sideways speed, m/s
    pub sideways: f64,
    /// Accelerations where no torques tell them, m/s² and rad/s²
    pub drift: [f64; 2],
    /// Their origin in the accelerations before, v and ω
    pub lasting: [Lasting; 2],
    /// Diffusion of v (m²/s³) and ω (rad²/s³)
    pub diffusion: [f64; 2],
    /// Length of the step, s
    pub dt: f64,
}

/// Change of v (m/s) and ω (rad/s) by noise in the last step, or in its last part, estimated from the readings since.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shaken {
    /// Its mean
    pub mean: [f64; 2],
    /// Covariance with the state, and own covariance
    with_state: [[f64; 2]; N],
    own: [[f64; 2]; 2],
}

/// Result of an update by one reading.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Corrected {
    /// S, variance of the innovation
    pub variance: f64,
    /// K, gain of the state
    pub gain: Vector,
    /// Gain of the change of v and ω by noise in the last step
    pub shaken_gain: [f64; 2],
}

/// State and covariance.
pub(crate) struct Filter<'a> {
    /// x, y, θ, v, ω
    pub state: Vector,
    covariance: Matrix,
    /// Change of v and ω by noise in the last step.
    pub shaken: Shaken,
    noise: &'a Noise,
    by_torque: [[f64; 2]; 2],
}

impl<'a> Filter<'a> {
    /// At the first row of the drive in `rows`: where it reaches its first pose from, by dead reckoning, without one at zero; speeds from
    /// its first wheel readings.
    pub(crate) fn new(record: &Record, rows: Range<usize>, noise: &'a Noise, by_torque: [[f64; 2]; 2]) -> Self {
        let (mut state, mut covariance) = ([0.0; N], [[0.0; N]; N]);
        let b = &record.belief;
        if let Some(first) = FirstPose::of(record, rows.clone()) {
            state[..PLACES].copy_from_slice(&first.back_at(record, rows.start));
            (0..PLACES).for_each(|i| covariance[i][i] = first.variance[i]);
        }
        let first = |values: &[f64]| values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
        let wheels = [0, 1].map(|i| first(&record.wheels_rad_s[i][rows.clone()]));
        [state[V], state[W]] = b.robot.speed_and_yaw_rate(wheels);
        let speed = 2.0 * b.robot.radius_m[0] * noise.reading[0].sqrt();
        covariance[V][V] = speed * speed;
        covariance[W][W] = (speed / b.robot.half_track_m).powi(2);
        Self { state, covariance, shaken: Shaken::default(), noise, by_torque }
    }

    /// Puts the robot on its first pose. Until then no reading has told the pose, so that it has no covariance with the speeds.
    pub(crate) fn place(&mut self, first: &FirstPose) {
        self.state[..PLACES].copy_from_slice(&first.pose);
        for i in 0..PLACES {
            self.shaken.with_state[i] = [0.0; 2];
            for j in 0..N {
                (self.covariance[i][j], self.covariance[j][i]) = (0.0, 0.0);
            }
            self.covariance[i][i] = first.variance[i];
        }
    }

    /// Share of the torque noise that is white within a step, 0 to 1.
    fn within(&self) -> f64 {
        let all = self.noise.torque;
        if all > 0.0 { (self.noise.process.ripple / all).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Restricts the change by noise in the last step to this share of it, at its end, 0 to 1.
    pub(crate) fn since(&mut self, share: f64) {
        let variance = share * share + self.within() * (share - share * share);
        let Shaken { with_state, own, .. } = &mut self.shaken;
        with_state.iter_mut().flatten().for_each(|c| *c *= share);
        own.iter_mut().flatten().for_each(|c| *c *= variance);
    }

    /// Update by one scalar reading h·(ξ - late u). `late`: none where no reading of the row is late, else the delay of
    /// this one over the largest in the row, 0 to 1.
    pub(crate) fn correct(&mut self, nu: f64, h: &Vector, variance: f64, late: Option<f64>) -> Corrected {
        let mut ph: Vector = std::array::from_fn(|i| (0..N).map(|j| self.covariance[i][j] * h[j]).sum());
        let mut s = variance + (0..N).map(|i| h[i] * ph[i]).sum::<f64>();
        let mut shaken_gain = [0.0; 2];
        if let Some(late) = late {
            let by = [h[V], h[W]];
            let Shaken { with_state, own, .. } = &mut self.shaken;
            let times = |row: &[f64; 2]| row[0] * by[0] + row[1] * by[1];
            let (both, alone) = (with_state.each_ref().map(times), own.each_ref().map(times));
            // Cov(u, reading)
            let pw: [f64; 2] =
                std::array::from_fn(|a| (0..N).map(|i| with_state[i][a] * h[i]).sum::<f64>() - late * alone[a]);
            ph.iter_mut().zip(both).for_each(|(ph, c)| *ph -= late * c);
            s = variance + (0..N).map(|i| h[i] * ph[i]).sum::<f64>() - late * (by[0] * pw[0] + by[1] * pw[1]);
            shaken_gain = pw.map(|p| p / s);
            for (row, p) in with_state.iter_mut().zip(ph) {
                row.iter_mut().zip(shaken_gain).for_each(|(c, k)| *c -= p * k);
            }
            for (row, p) in own.iter_mut().zip(pw) {
                row.iter_mut().zip(shaken_gain).for_each(|(c, k)| *c -= p * k);
            }
            self.shaken.mean.iter_mut().zip(shaken_gain).for_each(|(m, k)| *m += k * nu);
        }
        let gain = ph.map(|v| v / s);
        for ((state, row), k) in self.state.iter_mut().zip(&mut self.covariance).zip(gain) {
            *state += k * nu;
            row.iter_mut().zip(ph).for_each(|(p, ph)| *p -= k * ph);
        }
        Corrected { variance: s, gain, shaken_gain }
    }

    /// ∂(next state)/∂state; `forces`: those of the effects at `at`, `middle`: sine and cosine of the heading half way.
    pub(crate) fn jacobian(
        &self,
        model: &DriveModel,
        at: &Moving,
        forces: &[[f64; 2]],
        step: &Step,
        middle: (f64, f64),
        scales: &Scales,
    ) -> Matrix {
        let Step { torques, sideways, dt, .. } = *step;
        let (sin, cos) = middle;
        let v = at.speed_m_s;
        let mut f = [[0.0; N]; N];
        for (i, row) in f.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        f[X][TH] = dt * (-v * sin - sideways * cos);
        f[Y][TH] = dt * (v * cos - sideways * sin);
        f[X][V] = dt * cos;
        f[Y][V] = dt * sin;
        f[X][W] = 0.5 * dt * f[X][TH];
        f[Y][W] = 0.5 * dt * f[Y][TH];
        f[TH][W] = dt;
        let Some(torques) = torques else { return f };
        let step = [1e-4 * scales.speed, 1e-4 * scales.yaw_rate, 1e-4, 1e-4, 1e-4];
        let by = |which: usize| {
            let mut moved = *at;
            match which {
                0 => moved.speed_m_s += step[0],
                1 => moved.yaw_rate_rad_s += step[1],
                2 => moved.heading_rad += step[2],
                3 => moved.x_m += step[3],
                _ => moved.y_m += step[4],
            }
            model.accelerate_with(&mut moved, torques, |place, effect| {
                let follows = effect.force_follows();
                let moves = match which {
                    0 | 1 => follows.speeds,
                    2 => follows.heading,
                    _ => follows.position,
                };
                (!moves).then(|| forces[place])
            });
            [
                (moved.acceleration_m_s2 - at.acceleration_m_s2) / step[which],
                (moved.yaw_acceleration_rad_s2 - at.yaw_acceleration_rad_s2) / step[which],
            ]
        };
        let causes = if model.follows_position { 5 } else { 3 };
        for (i, which) in [V, W, TH, X, Y].into_iter().enumerate().take(causes) {
            let [dv, dw] = by(i);
            f[V][which] += dt * dv;
            f[W][which] += dt * dw;
        }
        f
    }

    /// Adds the variance of the pose by torque noise that changes within a step of `dt` s, beyond half of the change of
    /// the speeds: for white noise w, ∫∫w dt given ∫w dt has the variance q dt³/12.
    fn ripple(&mut self, dt: f64, (sin, cos): (f64, f64)) {
        let [[a, b], [c, d]] = self.by_torque;
        let q = self.noise.process.ripple * dt.powi(3) / 12.0;
        let (way, both, turn) = (q * (a * a + b * b), q * (a * c + b * d), q * (c * c + d * d));
        let ahead = [cos, sin];
        for i in 0..2 {
            for j in 0..2 {
                self.covariance[i][j] += way * ahead[i] * ahead[j];
            }
            self.covariance[i][TH] += both * ahead[i];
            self.covariance[TH][i] += both * ahead[i];
        }
        self.covariance[TH][TH] += turn;
    }

    /// Predicts the state one step ahead.
    pub(crate) fn predict(&mut self, model: &DriveModel, at: &Moving, step: &Step, f: &Matrix) {
        let Step { torques, sideways, drift, diffusion: [qv, qw], dt, .. } = *step;
        let s = self.state;
        // the midpoint rule for speed and yaw rate, an arc for the position
        let mut middle = *at;
        middle.speed_m_s += 0.5 * dt * at.acceleration_m_s2;
        middle.yaw_rate_rad_s += 0.5 * dt * at.yaw_acceleration_rad_s2;
        middle.heading_rad += 0.5 * dt * s[W];
        let (sin, cos) = s[TH].sin_cos();
        middle.x_m += 0.5 * dt * s[V] * cos;
        middle.y_m += 0.5 * dt * s[V] * sin;
        let [dv, dw] = torques.map_or(drift, |torques| {
            model.accelerate(&mut middle, torques);
            [middle.acceleration_m_s2, middle.yaw_acceleration_rad_s2]
        });
        let (dv, dw) = (dt * dv, dt * dw);
        let (v, w) = (s[V] + 0.5 * dv, s[W] + 0.5 * dw);
        let turn = dt * w;
        let (sin, cos) = (s[TH] + 0.5 * turn).sin_cos();
        // chord over arc
        let chord = 1.0 - turn * turn / 24.0;
        let way = dt * v * chord;
        self.state[X] += way * cos - dt * sideways * sin;
        self.state[Y] += way * sin + dt * sideways * cos;
        self.state[TH] += turn;
        self.state[V] += dv;
        self.state[W] += dw;
        // P = F P F' + Q
        let columns: Matrix = std::array::from_fn(|j| ahead(f, &self.covariance.map(|row| row[j])));
        let full: Matrix = std::array::from_fn(|i| ahead(f, &columns.map(|column| column[i])));
        // rounding differences between the two halves grow where the motion is unstable, until P is no covariance
        self.covariance = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (full[i][j] + full[j][i])));
        let [[a, b], [c, d]] = self.by_torque;
        let q = self.noise.torque * dt;
        // an uncertain force lasts for several steps
        let [vv, vw, ww] = model.force_covariance(at).map(|c| c * dt * LASTING_S);
        let vv = vv + q * (a * a + b * b) + qv * dt;
        let ww = ww + q * (c * c + d * d) + qw * dt;
        let vw = vw + q * (a * c + b * d);
        // noise that has changed the speeds within a step has moved the pose by half of that
        let half = 0.5 * dt;
        let along: Vector = [half * cos, half * sin, 0.0, 1.0, 0.0];
        let about: Vector = [-0.5 * half * dt * v * sin, 0.5 * half * dt * v * cos, half, 0.0, 1.0];
        let with_state = std::array::from_fn(|i| [vv * along[i] + vw * about[i], vw * along[i] + ww * about[i]]);
        self.shaken = Shaken { mean: [0.0; 2], with_state, own: [[vv, vw], [vw, ww]] };
        for i in 0..N {
            for j in 0..N {
                let own = vv * along[i] * along[j] + ww * about[i] * about[j];
                self.covariance[i][j] += own + vw * (along[i] * about[j] + about[i] * along[j]);
            }
        }
        if self.noise.process.ripple > 0.0 {
            self.ripple(dt, (sin, cos));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{by_id, ids};
    use crate::gap::drive::ekf::innovations::run;
    use crate::gap::drive::ekf::models::Models;
    use crate::gap::drive::ekf::noise::{Channel, Process};
    use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};
    use crate::gap::drive::preprocess::torque_bandwidth::tests::shaken;
    use crate::math::random::Stream;
    use crate::model::drive::Instrument;

    const ROWS: usize = 12_000;
    const STEP_S: f64 = 0.02;
    const TORQUE_NOISE: f64 = 0.01;

    /// A robot moved by torque noise alone, one instrument late by this share of a step; the noise is constant over a
    /// step, or white.
    fn late(of: Instrument, share: f64, white: bool) -> Record {
        let mut belief = belief();
        belief.torque_noise_n_m_sqrt_s = TORQUE_NOISE;
        (belief.gyro_std_rad_s, belief.wheel_std_rad_s) = (3e-4, 3e-3);
        let draw = &mut Stream::new(11, 4);
        let robot = belief.robot;
        let [ahead, about] = DriveModel::new(robot, Vec::new()).by_torque();
        let [mut v, mut w] = [0.0; 2];
        let (mut wheels, mut gyro, mut then) = ([Vec::new(), Vec::new()], Vec::new(), [0.0; 2]);
        for _ in 0..ROWS {
            let read = |instrument| if instrument == of { then } else { [v, w] };
            for (values, side) in wheels.iter_mut().zip([-1.0, 1.0]) {
                let [v, w] = read(Instrument::Wheels);
                let wheel = (v + side * robot.half_track_m * w) / robot.radius_m[0];
                values.push(wheel + belief.wheel_std_rad_s * draw.normal());
            }
            gyro.push(read(Instrument::Gyro)[1] + belief.gyro_std_rad_s * draw.normal());
            // both parts of the step, before and after the instant of a late reading
            let whole = [0, 1].map(|_| TORQUE_NOISE / STEP_S.sqrt() * draw.normal());
            for part in [1.0 - share, share] {
                then = [v, w];
                let torques =
                    if white { [0, 1].map(|_| TORQUE_NOISE / (part * STEP_S).sqrt() * draw.normal()) } else { whole };
                v += part * STEP_S * (ahead[0] * torques[0] + ahead[1] * torques[1]);
                w += part * STEP_S * (about[0] * torques[0] + about[1] * torques[1]);
            }
        }
        let mut record = recorded(belief, STEP_S, wheels, gyro);
        record.torques_n_m = Some([vec![0.0; ROWS], vec![0.0; ROWS]]);
        record
    }

    #[test]
    fn what_is_late_knows_a_part_of_what_the_last_step_has_done() {
        let (gyro, wheels) = ((Instrument::Gyro, ids::gyro_delay()), (Instrument::Wheels, ids::wheel_delay()));
        for ((of, id), share, white) in [
            (gyro, 0.3, false),
            (gyro, 0.6, false),
            (gyro, 0.6, true),
            (gyro, 0.9, true),
            (wheels, 0.6, false),
            (wheels, 0.5, true),
        ] {
            let change = by_id(id).and_then(|e| e.change()).unwrap();
            let record = late(of, share, white);
            let here = DriveModel::new(record.belief.robot, vec![change.at(&[share * STEP_S])]);
            let mut noise = Noise::believed(&record, None);
            noise.process = Process { ripple: if white { noise.torque } else { 0.0 }, ..noise.process };
            let (mut n, mut sum, mut turned) = (0.0, [0.0; 3], 0.0);
            let _ = run(&record, &Models::alone(here, Vec::new()), &noise, &[], |i| {
                n += 1.0 / 3.0;
                sum[i.channel as usize] += i.white * i.white;
                turned += if i.channel == Channel::Gyro { i.std.powi(2) } else { 0.0 };
            });
            // six standard deviations of the mean of n squares of standard normal variables
            let means = sum.map(|s| s / n);
            assert!(means.iter().all(|m| (m - 1.0).abs() < 6.0 * (2.0 / n).sqrt()), "{id} {share} {white}: {means:?}");
            // torque noise exceeds the gyro's, so that an error of the former would show
            assert!(turned / n > 1.5 * noise.reading[2], "{id}");
        }
    }

    #[test]
    fn the_covariance_stays_one_where_motion_is_unstable() {
        let record = shaken(1, 9);
        let noise = Noise::believed(&record, None);
        let model = DriveModel::new(record.belief.robot, Vec::new());
        let mut filter = Filter::new(&record, 0..record.len(), &noise, model.by_torque());
        let still = Moving { speed_m_s: 0.3, yaw_rate_rad_s: -0.7, ..Moving::default() };
        let step = Step {
            torques: Some([0.0; 2]),
            sideways: 0.0,
            drift: [0.0; 2],
            lasting: Default::default(),
            diffusion: noise.process.diffusion,
            dt: record.step_s,
        };
        // growth by a tenth in each step, with coupling
        let mut f: Matrix = [[0.0; N]; N];
        for (i, row) in f.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        (f[TH][W], f[X][V], f[Y][TH]) = (0.02, 0.013, 0.07);
        (f[V][V], f[W][W], f[V][W], f[W][V]) = (1.1, 1.1, 0.3, 0.17);
        let h: Vector = [0.0, 0.0, 0.1, 0.9, -1.3];
        for k in 0..20_000 {
            filter.predict(&model, &still, &step, &f);
            for (i, row) in filter.covariance.iter().enumerate() {
                assert!(row[i] > 0.0, "{k}: {:?}", filter.covariance);
                let size = |j: usize| (row[i] * filter.covariance[j][j]).sqrt();
                // rounding errors of one step, which must not have grown
                let even = |j: usize| (row[j] - filter.covariance[j][i]).abs() <= 1e-12 * size(j);
                assert!((0..N).all(even), "{k}: {:?}", filter.covariance);
            }
            filter.correct(0.0, &h, 1e-3, None);
            filter.correct(0.0, &[0.0, 0.0, 0.0, 0.4, 1.0], 1e-3, None);
            filter.correct(0.0, &[1.0, 0.0, 0.0, 0.0, 0.0], 1e-2, None);
            filter.correct(0.0, &[0.0, 1.0, 0.0, 0.0, 0.0], 1e-2, None);
            filter.correct(0.0, &[0.0, 0.0, 1.0, 0.0, 0.0], 1e-2, None);
        }
    }
}
