//! nats = ½ Σ d'S⁻¹d,  d = innovation with the effect - innovation without it, under the nominal simulator
//!
//! Both worlds drive the same run with the same noise, and one Kalman filter of the nominal simulator reads both logs, each
//! with its own torques. Its innovations are white with covariance S where the simulator is right, so that the mean of the
//! log-likelihood ratio of the true world against the nominal one is half the energy of the whitened difference: this is
//! what the best possible diagnosis has, once it knows the effect's form. The filter's state is (v, ω, heading, x, y, turn-on,
//! relative errors of C1 and T), so that what the stated repeatability can explain does not count.
//!
//! Of an effect that is noise, d is drawn: its spectrum r over the innovations' is smoothed over bands of a third of an
//! octave, and nats = ½ Σ_f [r - ln(1 + r)].
//!
//! Of an effect that is rare and large, readings are what tells: z of the share p that it moves by more than half a standard
//! deviation, with mean square s² of these moves, and nats = Σ ln[(1 - p) + p N(z; 0, 1 + s²)/N(z; 0, 1)].
//!
//! Of an effect that is the size of a noise, each channel's innovations have a variance v times as large, and
//! nats = n/2 (v - 1 - ln v).
//!
//! A log without torques is read with a random walk of both speeds, whose steps are those of the run: an effect counts there as
//! far as wheels, gyro and pose contradict each other.

use super::machine::Machine;
use super::record::{DriveRun, Trace};
use crate::bench::worlds::nats::level;
use crate::math::spectra::Periodogram;
use nalgebra::{SMatrix, SVector};

const N: usize = 8;
type Vector = SVector<f64, N>;
type Matrix = SMatrix<f64, N, N>;

const V: usize = 0;
const W: usize = 1;
const HEADING: usize = 2;
const X: usize = 3;
const Y: usize = 4;
const BIAS: usize = 5;
const C1: usize = 6;
const WARM: usize = 7;

/// Sensors in a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sensors {
    pub torque: bool,
    pub pose: bool,
    pub gyro: bool,
    /// Rows from one reading of the wheels to the next.
    pub wheel_rows: usize,
}

impl Sensors {
    pub(crate) const ALL: Self = Self { torque: true, pose: true, gyro: true, wheel_rows: 1 };
}

/// The nominal simulator as a filter.
pub(super) struct Reader<'a> {
    machine: &'a Machine,
    run: &'a DriveRun,
    sensors: Sensors,
    /// Variance of the change of v and ω in a row.
    steps: [f64; 2],
}

/// Whitened innovations: wheels, gyro, and three of the pose.
pub(super) type Innovations = [Vec<f64>; 6];

impl<'a> Reader<'a> {
    /// A filter for logs of `run`; `nominal` holds the signals of the nominal robot in it.
    pub(crate) fn new(machine: &'a Machine, run: &'a DriveRun, sensors: Sensors, nominal: &Trace) -> Self {
        let steps = if sensors.torque {
            let (v, dt) = (&machine.vehicle, machine.step_s);
            let (mass, yaw) = inertias(machine);
            let force = v.torque_noise_n_m_sqrt_s / v.wheel_radius_m;
            [2.0 * dt * (force / mass).powi(2), 2.0 * dt * (force * v.half_track_m / yaw).powi(2)]
        } else {
            [&nominal.v_m_s, &nominal.w_rad_s].map(|x| {
                let sum: f64 = x.windows(2).map(|p| (p[1] - p[0]).powi(2)).sum();
                sum / x.len().max(2) as f64
            })
        };
        Self { machine, run, sensors, steps }
    }

    /// Reads `trace`; `gyro` is the gyro's channel.
    pub(crate) fn innovations(&self, trace: &Trace, gyro: &[f64]) -> Innovations {
        let (m, dt) = (self.machine, self.machine.step_s);
        let vehicle = &m.vehicle;
        let (r, b) = (vehicle.wheel_radius_m, vehicle.half_track_m);
        let (mass, yaw) = inertias(m);
        // dv/dt = (uL + uR)/(r m) - 2 c v/(r² m), and the like for ω
        let [slow_v, slow_w] = match self.sensors.torque {
            true => {
                let c = 2.0 * vehicle.viscous_friction_n_m_s / (r * r);
                [c / mass, c * b * b / yaw]
            }
            false => [0.0; 2],
        };
        let keep = [slow_v, slow_w].map(|a| (-a * dt).exp());
        let gain = [slow_v, slow_w].map(|a| if a > 0.0 { -(-a * dt).exp_m1() / a } else { dt });

        let unit = &m.gyro;
        let mut x = Vector::zeros();
        let mut p = Matrix::zeros();
        p[(BIAS, BIAS)] = unit.turn_on_std_rad_s.powi(2);
        p[(C1, C1)] = unit.relative_std.powi(2);
        p[(WARM, WARM)] = unit.relative_std.powi(2);
        let mut out: Innovations = Default::default();
        for (k, rate) in gyro.iter().enumerate() {
            for (i, side) in [(0, -1.0), (1, 1.0)].into_iter().filter(|_| k % self.sensors.wheel_rows == 0) {
                let h = [(V, 1.0 / r), (W, side * b / r)];
                out[i].push(update(&mut x, &mut p, &h, trace.wheel_rad_s[i][k], m.wheel_std_rad_s.powi(2)));
            }
            if self.sensors.gyro {
                let part = (self.run.since_power_on_s + k as f64 * dt) / unit.time_constant_s;
                let (left, risen) = ((-part).exp(), -(-part).exp_m1());
                let h = [(W, 1.0), (BIAS, 1.0), (C1, unit.c1_rad_s * risen), (WARM, -unit.c1_rad_s * part * left)];
                let y = rate - unit.c1_rad_s * risen - unit.c2_rad_s;
                out[2].push(update(&mut x, &mut p, &h, y, unit.white_std_rad_s().powi(2)));
            }
            if self.sensors.pose && !trace.pose[0][k].is_nan() {
                // along and across, so that headings that drifted apart compare
                let (sin, cos) = x[HEADING].sin_cos();
                let [px, py, heading] = [0, 1, 2].map(|i| trace.pose[i][k]);
                let variance = m.pose.position_std_m.powi(2);
                let (along, across) = (px * cos + py * sin, py * cos - px * sin);
                out[3].push(update(&mut x, &mut p, &[(X, cos), (Y, sin)], along, variance));
                out[4].push(update(&mut x, &mut p, &[(X, -sin), (Y, cos)], across, variance));
                let variance = m.pose.heading_std_rad.powi(2);
                out[5].push(update(&mut x, &mut p, &[(HEADING, 1.0)], heading, variance));
            }
            let [force, moment] = match self.sensors.torque {
                true => {
                    let [left, right] = [trace.torque_n_m[0][k], trace.torque_n_m[1][k]];
                    [(left + right) / (r * mass), b * (right - left) / (r * yaw)]
                }
                false => [0.0; 2],
            };
            self.predict(&mut x, &mut p, keep, [gain[0] * force, gain[1] * moment]);
        }
        out
    }

    fn predict(&self, x: &mut Vector, p: &mut Matrix, keep: [f64; 2], add: [f64; 2]) {
        let dt = self.machine.step_s;
        let (v, w) = (x[V], x[W]);
        x[V] = keep[0] * v + add[0];
        x[W] = keep[1] * w + add[1];
        let (v_mean, w_mean) = (0.5 * (v + x[V]), 0.5 * (w + x[W]));
        let (sin, cos) = (x[HEADING] + 0.5 * dt * w_mean).sin_cos();
        x[HEADING] += dt * w_mean;
        x[X] += dt * v_mean * cos;
        x[Y] += dt * v_mean * sin;
        // F P F', where F is the identity but for these rows: each takes shares of others, which still are as before
        let half = [0.5 * dt * (1.0 + keep[0]), 0.5 * dt * (1.0 + keep[1])];
        let along = |row: usize, d_v: f64, d_heading: f64| {
            (row, 1.0, [(V, half[0] * d_v), (HEADING, dt * d_heading), (W, 0.5 * dt * half[1] * d_heading)])
        };
        let rows = [
            along(X, cos, -v_mean * sin),
            along(Y, sin, v_mean * cos),
            (HEADING, 1.0, [(W, half[1]), (V, 0.0), (V, 0.0)]),
            (V, keep[0], [(W, 0.0); 3]),
            (W, keep[1], [(V, 0.0); 3]),
        ];
        for (row, own, shares) in &rows {
            for j in 0..N {
                p[(*row, j)] = own * p[(*row, j)] + shares.iter().map(|(i, share)| share * p[(*i, j)]).sum::<f64>();
            }
        }
        for (row, own, shares) in &rows {
            for j in 0..N {
                p[(j, *row)] = own * p[(j, *row)] + shares.iter().map(|(i, share)| share * p[(j, *i)]).sum::<f64>();
            }
        }
        // noise over the row: what it adds to a speed goes with half of it into the way
        let [qv, qw] = self.steps;
        p[(V, V)] += qv;
        p[(W, W)] += qw;
        p[(W, HEADING)] += 0.5 * dt * qw;
        p[(HEADING, W)] += 0.5 * dt * qw;
        p[(HEADING, HEADING)] += dt * dt * qw / 3.0;
        for (row, d) in [(X, cos), (Y, sin)] {
            p[(V, row)] += 0.5 * dt * qv * d;
            p[(row, V)] += 0.5 * dt * qv * d;
        }
        let way = dt * dt * qv / 3.0;
        p[(X, X)] += way * cos * cos;
        p[(Y, Y)] += way * sin * sin;
        p[(X, Y)] += way * sin * cos;
        p[(Y, X)] += way * sin * cos;
    }
}

/// Mass and yaw inertia with those of the wheels.
fn inertias(machine: &Machine) -> (f64, f64) {
    let v = &machine.vehicle;
    let wheel = 2.0 * v.wheel_inertia_kg_m2 / v.wheel_radius_m.powi(2);
    (v.mass_kg + wheel, v.yaw_inertia_kg_m2 + wheel * v.half_track_m.powi(2))
}

/// Takes in y = Σ h x + noise of `variance`; gives the innovation over its standard deviation.
fn update(x: &mut Vector, p: &mut Matrix, h: &[(usize, f64)], y: f64, variance: f64) -> f64 {
    let mut ph = Vector::zeros();
    let mut guess = 0.0;
    for (i, slope) in h {
        ph += p.column(*i) * *slope;
        guess += slope * x[*i];
    }
    let s = variance + h.iter().map(|(i, slope)| slope * ph[*i]).sum::<f64>();
    let innovation = y - guess;
    *x += ph * (innovation / s);
    *p -= ph * ph.transpose() / s;
    innovation / s.sqrt()
}

/// Nats of an effect that is identical in every repetition of the drive.
pub(super) fn of_signal(with: &Innovations, without: &Innovations) -> f64 {
    let energy = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    0.5 * with.iter().zip(without).map(energy).sum::<f64>()
}

/// Nats of an effect that changes the size of a noise.
pub(super) fn of_level(with: &Innovations, without: &Innovations) -> f64 {
    let square = |e: &[f64]| e.iter().map(|v| v * v).sum::<f64>();
    let one = |(a, b): (&Vec<f64>, &Vec<f64>)| match a.len() {
        0 => 0.0,
        n => n as f64 * level((square(a) / square(b)).sqrt()),
    };
    with.iter().zip(without).map(one).sum()
}

/// Nats of an effect that is noise.
pub(super) fn of_noise(with: &Innovations, without: &Innovations) -> f64 {
    let one = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let d: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        if d.len() < 16 {
            return 0.0;
        }
        // an ordinate is exponential with the spectrum as its mean, one for two degrees of freedom
        let variance = d.iter().map(|v| v * v).sum::<f64>() / d.len() as f64;
        let raw = Periodogram::new(d.len()).ordinates(&d);
        let scale = variance * raw.len() as f64 / raw.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let (mut sum, mut from) = (0.0, 0);
        while from < raw.len() {
            let to = ((from as f64 * 1.26).ceil() as usize).max(from + 3).min(raw.len());
            let r = scale * raw[from..to].iter().sum::<f64>() / (to - from) as f64;
            sum += (to - from) as f64 * (r - r.ln_1p());
            from = to;
        }
        sum
    };
    with.iter().zip(without).map(one).sum()
}

/// From this move on a reading counts as moved, standard deviations.
const MOVED: f64 = 0.5;

/// Nats of an effect that is rare and large, if its law is known but not its times.
pub(super) fn of_rare(with: &Innovations, without: &Innovations) -> f64 {
    let one = |(with, without): (&Vec<f64>, &Vec<f64>)| {
        let moves = || with.iter().zip(without).map(|(a, b)| (a - b).powi(2));
        let (count, sum) = moves().filter(|d| *d > MOVED * MOVED).fold((0.0, 0.0), |(n, s), d| (n + 1.0, s + d));
        if count == 0.0 {
            return 0.0;
        }
        let (share, wide) = (count / with.len() as f64, 1.0 + sum / count);
        let gain = |z: &f64| {
            // far out the other density is all there is
            let ln_other = 0.5 * z * z * (1.0 - 1.0 / wide) - 0.5 * wide.ln() + share.ln();
            if ln_other > 30.0 { ln_other } else { (1.0 - share + ln_other.exp()).ln() }
        };
        with.iter().map(gain).sum::<f64>()
    };
    with.iter().zip(without).map(one).sum::<f64>().max(0.0)
}
