//! dν = h·D + d,  D⁺ = D - K dν,  D⁻ = F D⁺ + ∂f/∂β: the derivatives D of the state by every coordinate β.
//!
//! One array for each state, so that the loops over some two hundred columns run on vectors.

use super::column::{COSINES, Column, Equation};
use super::filter::{Matrix, N, TH, V, Vector, W, X, Y};
use super::pass::Models;
use crate::model::drive::Moving;

/// Derivatives of the state, and of the readings of the row at hand.
pub struct Tangents<'a> {
    columns: &'a [Column],
    models: &'a Models,
    state: [Vec<f64>; N],
    /// ∂(expected reading)/∂β at a fixed state, by channel
    direct: [Vec<f64>; 6],
    moved: Vec<f64>,
    /// For a coordinate that varies, the column of the coordinate
    varies: Vec<usize>,
    /// What each coordinate adds to dv/dt, dω/dt and the sideways speed
    adds: Vec<[f64; 3]>,
}

/// What the readings of a row are expected to be under the model at β, and what their derivatives follow.
pub struct Expecting<'a> {
    /// Motion at the row.
    pub at: &'a Moving<'a>,
    /// Left wheel, right wheel, gyro, rad/s.
    pub here: [f64; 3],
    /// Functions that free forms are made of.
    pub functions: &'a [f64],
    /// cos(nπu)
    pub cosines: &'a [f64; COSINES],
    /// ∂(gyro)/∂(ln C1, ln T), rad/s
    pub warm_up: [f64; 2],
}

/// What moves the robot between two rows.
pub struct Going<'a> {
    /// Motion, accelerations included.
    pub at: &'a Moving<'a>,
    /// N·m
    pub torques: [f64; 2],
    /// m/s
    pub sideways: f64,
    /// s
    pub dt: f64,
    /// Functions that free forms are made of.
    pub functions: &'a [f64],
}

impl<'a> Tangents<'a> {
    /// All zero. A coordinate that varies comes after the column of the coordinate itself.
    pub fn new(columns: &'a [Column], models: &'a Models) -> Self {
        let zero = || vec![0.0; columns.len()];
        let constant = |i, j| columns.iter().position(|c| *c == Column::Coordinate(i, j));
        let of = |(c, column): (usize, &Column)| match *column {
            Column::Varying(i, j, _) => constant(i, j).unwrap_or(c),
            _ => c,
        };
        Self {
            columns,
            models,
            state: std::array::from_fn(|_| zero()),
            direct: std::array::from_fn(|_| zero()),
            moved: zero(),
            varies: columns.iter().enumerate().map(of).collect(),
            adds: vec![[0.0; 3]; columns.len()],
        }
    }

    /// Takes in how the expected readings of a row depend on β directly.
    pub fn expect(&mut self, row: &Expecting) {
        let (sin, cos) = row.at.heading_rad.sin_cos();
        let d = &mut self.direct;
        for (c, column) in self.columns.iter().enumerate() {
            match *column {
                Column::Coordinate(i, j) => {
                    let (beside, width, touches) = &self.models.beside[i][j];
                    if touches.wheels {
                        let [l, r] = beside.wheels_rad_s(row.at);
                        (d[0][c], d[1][c]) = ((l - row.here[0]) / width, (r - row.here[1]) / width);
                    }
                    if touches.gyro {
                        d[2][c] = (beside.gyro_rad_s(row.at) - row.here[2]) / width;
                    }
                }
                Column::Varying(_, _, f) => {
                    let (of, value) = (self.varies[c], row.functions[f]);
                    for channel in &mut d[..3] {
                        channel[c] = value * channel[of];
                    }
                }
                Column::Free(equation, f) => {
                    let value = row.functions[f];
                    match equation {
                        Equation::WheelLeft => d[0][c] = value,
                        Equation::WheelRight => d[1][c] = value,
                        Equation::Gyro => d[2][c] = value,
                        Equation::PoseAlong => (d[3][c], d[4][c]) = (value * cos, value * sin),
                        Equation::PoseAcross => (d[3][c], d[4][c]) = (-value * sin, value * cos),
                        Equation::PoseHeading => d[5][c] = value,
                        Equation::Force | Equation::Moment | Equation::Sideways | Equation::Along | Equation::Turn => {}
                    }
                }
                Column::PoseDelay => {
                    let v = row.at.speed_m_s;
                    (d[3][c], d[4][c], d[5][c]) = (-v * cos, -v * sin, -row.at.yaw_rate_rad_s);
                }
                Column::TurnOn => d[2][c] = 1.0,
                Column::WarmUpSize => d[2][c] = row.warm_up[0],
                Column::WarmUpTime => d[2][c] = row.warm_up[1],
                Column::GyroCosine(n) => d[2][c] = row.cosines[n],
                Column::GyroStep(from_s) => d[2][c] = f64::from(u8::from(row.at.t_s >= from_s)),
                Column::GyroSettling(from_s, within_s) => {
                    let since_s = row.at.t_s - from_s;
                    d[2][c] = if since_s >= 0.0 { -(-since_s / within_s).exp() } else { 0.0 };
                }
            }
        }
    }

    /// One scalar reading of `channel` with slope `h`, `gain` and standard deviation `std`: whitened derivatives into `slopes`.
    pub fn correct(&mut self, channel: usize, h: &Vector, gain: &Vector, std: f64, slopes: &mut [f64]) {
        self.moved.copy_from_slice(&self.direct[channel]);
        for (h, state) in h.iter().zip(&self.state) {
            if *h != 0.0 {
                self.moved.iter_mut().zip(state).for_each(|(m, s)| *m += h * s);
            }
        }
        for (gain, state) in gain.iter().zip(&mut self.state) {
            state.iter_mut().zip(&self.moved).for_each(|(s, m)| *s -= gain * m);
        }
        slopes.iter_mut().zip(&self.moved).for_each(|(s, m)| *s = m / std);
    }

    /// On to the next row.
    pub fn predict(&mut self, f: &Matrix, going: &Going) {
        let (at, dt) = (going.at, going.dt);
        let p = self.columns.len();
        let [x, y, th, v, w] = &mut self.state;
        let (x, y, th, v, w) = (&mut x[..p], &mut y[..p], &mut th[..p], &mut v[..p], &mut w[..p]);
        for c in 0..p {
            let (dth, dv, dw) = (th[c], v[c], w[c]);
            x[c] += f[X][TH] * dth + f[X][V] * dv + f[X][W] * dw;
            y[c] += f[Y][TH] * dth + f[Y][V] * dv + f[Y][W] * dw;
            th[c] += f[TH][V] * dv + f[TH][W] * dw;
            v[c] = f[V][TH] * dth + f[V][V] * dv + f[V][W] * dw;
            w[c] = f[W][TH] * dth + f[W][V] * dv + f[W][W] * dw;
        }
        let (sin, cos) = (at.heading_rad + 0.5 * dt * at.yaw_rate_rad_s).sin_cos();
        for (c, column) in self.columns.iter().enumerate() {
            // dv/dt, dω/dt, sideways
            let d = match *column {
                Column::Coordinate(i, j) => {
                    let (beside, width, touches) = &self.models.beside[i][j];
                    if !touches.motion {
                        continue;
                    }
                    let mut moved = *at;
                    beside.accelerate(&mut moved, going.torques);
                    self.adds[c] = [
                        (moved.acceleration_m_s2 - at.acceleration_m_s2) / width,
                        (moved.yaw_acceleration_rad_s2 - at.yaw_acceleration_rad_s2) / width,
                        (beside.sideways_m_s(at) - going.sideways) / width,
                    ];
                    self.adds[c]
                }
                Column::Varying(_, _, f) => self.adds[self.varies[c]].map(|a| a * going.functions[f]),
                Column::Free(Equation::Force, i) => [going.functions[i], 0.0, 0.0],
                Column::Free(Equation::Moment, i) => [0.0, going.functions[i], 0.0],
                Column::Free(Equation::Sideways, i) => [0.0, 0.0, going.functions[i]],
                Column::Free(Equation::Along, i) => {
                    x[c] += dt * going.functions[i] * cos;
                    y[c] += dt * going.functions[i] * sin;
                    continue;
                }
                Column::Free(Equation::Turn, i) => {
                    th[c] += dt * going.functions[i];
                    continue;
                }
                _ => continue,
            };
            v[c] += dt * d[0];
            w[c] += dt * d[1];
            let (half_way, half_turn) = (0.5 * dt * dt * d[0], 0.5 * dt * dt * d[1]);
            x[c] += half_way * cos - dt * d[2] * sin;
            y[c] += half_way * sin + dt * d[2] * cos;
            th[c] += half_turn;
        }
    }
}
