//! ν_k = z_k - h(ξ_k), S_k = H P H' + R;  ln p = -½ Σ (ν²/S + ln 2πS);  ∂ν/∂β = -(H D + ∂h/∂β),  D⁺ = D + K ∂ν/∂β,  D⁻ = F D⁺ + ∂f/∂β
//!
//! One pass of the extended Kalman filter over a drive, with the derivatives of every innovation by every coordinate β of
//! what may be missing. State ξ: x, y, θ, v, ω. Where torques were not logged, v and ω diffuse as fast as this robot
//! accelerates. The whitened derivatives are summed up in one Gram matrix: all that the comparison of effects needs. Several
//! drives have a pass each, whose sums add up.

use super::column::{COSINES, Column, FUNCTIONS, Row, Scales, Scoped, cosines_of};
use super::filter::{Filter, N, Slopes, Step, TH, V, Vector, W};
use super::record::Record;
use super::tangents::{Expecting, Going, Tangents};
use crate::effects::drive::Touches;
use crate::model::drive::{DriveModel, Moving, Past};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};
use std::ops::Range;

/// What a reading is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// rad/s
    WheelLeft,
    /// rad/s
    WheelRight,
    /// rad/s
    Gyro,
    /// m
    X,
    /// m
    Y,
    /// rad
    Heading,
}

impl Channel {
    /// All.
    pub const ALL: [Self; 6] = [Self::WheelLeft, Self::WheelRight, Self::Gyro, Self::X, Self::Y, Self::Heading];
}

/// How speeds change where no torques tell it: accelerations last, and diffuse.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Unforced {
    /// Diffusion of v (m²/s³) and ω (rad²/s³)
    pub diffusion: [f64; 2],
    /// How much of an acceleration is there in the next row, 0 to 1
    pub lasting: f64,
}

/// Variances that the filter assumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Torque noise of each wheel, squared: N²·m²·s
    pub torque: f64,
    /// How the robot moves where no torques tell it
    pub unforced: Unforced,
    /// Of one reading of each channel, in its unit squared
    pub reading: [f64; 6],
}

impl Noise {
    /// As believed; lattice steps of the wheels add their twelfth.
    #[must_use]
    pub fn believed(record: &Record, wheel_lsb_rad_s: Option<f64>) -> Self {
        let b = &record.belief;
        let wheel = b.wheel_std_rad_s.powi(2) + wheel_lsb_rad_s.map_or(0.0, |q| q * q / 12.0);
        let torque = if record.torques_n_m.is_some() { b.torque_noise_n_m_sqrt_s.powi(2) } else { 0.0 };
        let (position, heading) = (b.position_std_m.powi(2), b.heading_std_rad.powi(2));
        Self {
            torque,
            unforced: Unforced::default(),
            reading: [wheel, wheel, b.gyro_std_rad_s.powi(2), position, position, heading],
        }
    }
}

/// The model of one pass: the robot, and the same at β ± step for each coordinate.
pub struct Models {
    /// At β.
    pub here: DriveModel,
    /// For each change, for each coordinate: a step beside, how far, and which equations it changes.
    pub beside: Vec<Vec<(DriveModel, f64, Touches)>>,
}

/// One innovation.
#[derive(Debug, Clone, Copy)]
pub struct Innovation<'a> {
    /// Row of the log.
    pub row: usize,
    /// Channel.
    pub channel: Channel,
    /// ν/√S
    pub white: f64,
    /// √S
    pub std: f64,
    /// Whitened derivatives: ν/√S = Σ_j slopes_j β_j + white noise.
    pub slopes: &'a [f64],
}

/// What a pass sums up: [A b; b' yy] of the whitened innovations, and ln p at β.
#[derive(Debug, Clone)]
pub struct Summed {
    /// Gram matrix of the slopes, the innovations in the last row and column.
    pub gram: Mat<f64>,
    /// Σ ln(2πS), over innovations.
    pub ln_volume: f64,
}

impl Summed {
    /// ln p of the drive at β.
    #[must_use]
    pub fn ln_likelihood(&self) -> f64 {
        let last = self.gram.ncols() - 1;
        -0.5 * (self.ln_volume + self.gram[(last, last)])
    }
}

/// How long an uncertain force keeps its sign, s.
pub(super) const LASTING_S: f64 = crate::model::drive::FORCE_LASTING_S;

/// Rows that are summed up at once.
const BLOCK: usize = 192;

/// Runs the filter over `record`; every column is one coefficient for all its drives.
pub fn run(
    record: &Record,
    models: &Models,
    noise: &Noise,
    columns: &[Column],
    each: impl FnMut(&Innovation),
) -> Summed {
    let everywhere: Vec<Scoped> = columns.iter().map(|c| Scoped::from(*c)).collect();
    run_scoped(record, models, noise, &everywhere, each)
}

/// Runs the filter over `record`, anew in each drive; slopes are zero in drives where a column does nothing.
pub fn run_scoped(
    record: &Record,
    models: &Models,
    noise: &Noise,
    columns: &[Scoped],
    mut each: impl FnMut(&Innovation),
) -> Summed {
    let p = columns.len();
    // one scale for all drives: a free form is the same function in each
    let scales = Scales::of(record);
    let mut summed = Summed { gram: Mat::zeros(p + 1, p + 1), ln_volume: 0.0 };
    let mut slopes = vec![0.0; p];
    for (drive, rows) in record.drives().enumerate() {
        let mut places: Vec<usize> = (0..p).filter(|c| columns[*c].acts_in(drive)).collect();
        let own: Vec<Column> = places.iter().map(|c| columns[*c].column).collect();
        if own.len() == p && record.starts.len() == 1 {
            return one(record, rows, &scales, models, noise, &own, each);
        }
        slopes.fill(0.0);
        let part = one(record, rows, &scales, models, noise, &own, |i| {
            places.iter().zip(i.slopes).for_each(|(place, slope)| slopes[*place] = *slope);
            each(&Innovation { slopes: &slopes, ..*i });
        });
        // the innovations stand last
        places.push(p);
        for (j, to) in places.iter().enumerate() {
            for (i, from) in places.iter().enumerate() {
                summed.gram[(*from, *to)] += part.gram[(i, j)];
            }
        }
        summed.ln_volume += part.ln_volume;
    }
    summed
}

/// Runs the filter over the rows of one drive.
fn one(
    record: &Record,
    rows: Range<usize>,
    scales: &Scales,
    models: &Models,
    noise: &Noise,
    columns: &[Column],
    mut each: impl FnMut(&Innovation),
) -> Summed {
    let p = columns.len();
    let Range { start: first, end } = rows;
    let start_s = record.times_s.get(first).copied().unwrap_or(0.0);
    let mut filter = Filter::new(record, first..end, noise, models.here.by_torque());
    let mut tangents = Tangents::new(columns, models);
    let mut summed = Summed { gram: Mat::zeros(p + 1, p + 1), ln_volume: 0.0 };
    let mut block = vec![0.0; BLOCK * (p + 1)];
    let mut filled = 0;
    let mut functions = [0.0; FUNCTIONS];
    let mut row = Row::default();
    let mut past = Past::default();
    // accelerations and forces under the torques before this row: sensors are read before the new ones act
    let mut before = ([0.0; 2], [0.0; 2]);
    let mut cosines = [0.0; COSINES];
    let mut slopes = Slopes::default();
    let free = columns.iter().any(|c| matches!(c, Column::Free(..) | Column::Varying(..)));
    let span = (record.times_s[first..end].last().copied().unwrap_or(start_s) - start_s).max(1e-9);
    for k in first..end {
        let t_s = record.times_s[k];
        let moving = |s: &Vector, before: &([f64; 2], [f64; 2])| Moving {
            t_s: t_s - start_s,
            since_power_on_s: record.since_power_on_s[k],
            heading_rad: s[TH],
            speed_m_s: s[V],
            yaw_rate_rad_s: s[W],
            acceleration_m_s2: before.0[0],
            yaw_acceleration_rad_s2: before.0[1],
            wheel_force_n: before.1,
            past: None,
        };
        // readings
        // without torques the past rates are the gyro's own
        let known = record.torques_n_m.is_some().then_some(&past);
        let at = Moving { past: known, ..moving(&filter.state, &before) };
        let expected = |model: &DriveModel, at: &Moving| {
            let [l, r] = model.wheels_rad_s(at);
            [l, r, model.gyro_rad_s(at)]
        };
        let here = expected(&models.here, &at);
        let error = record.belief.warm_up.error_rad_s(record.since_power_on_s[k]);
        row.speed = at.speed_m_s;
        row.yaw_rate = at.yaw_rate_rad_s;
        row.heading = at.heading_rad;
        row.acceleration = at.acceleration_m_s2;
        row.yaw_acceleration = at.yaw_acceleration_rad_s2;
        row.torques = record.torques(k.saturating_sub(1).max(first));
        row.progress = (t_s - start_s) / span;
        if free {
            row.functions(scales, &mut functions);
        }
        cosines_of(row.progress, &mut cosines);
        let readings = Readings::of(record, k);
        if readings.any {
            // derivatives of the expected readings by the state, then by the columns
            let step = [1e-4 * scales.speed, 1e-4 * scales.yaw_rate];
            let by_speed = expected(&models.here, &Moving { speed_m_s: at.speed_m_s + step[0], ..at });
            let by_rate = expected(&models.here, &Moving { yaw_rate_rad_s: at.yaw_rate_rad_s + step[1], ..at });
            let mut measured: Vec<(Channel, f64, Vector)> = Vec::with_capacity(6);
            for (i, channel) in [Channel::WheelLeft, Channel::WheelRight, Channel::Gyro].into_iter().enumerate() {
                let value = readings.values[i];
                if value.is_finite() {
                    let mut h = [0.0; N];
                    h[V] = (by_speed[i] - here[i]) / step[0];
                    h[W] = (by_rate[i] - here[i]) / step[1];
                    let e = if channel == Channel::Gyro { error } else { 0.0 };
                    measured.push((channel, value - here[i] - e, h));
                }
            }
            for (i, channel) in [Channel::X, Channel::Y, Channel::Heading].into_iter().enumerate() {
                let value = readings.values[3 + i];
                if value.is_finite() {
                    let mut h = [0.0; N];
                    h[i] = 1.0;
                    let mut nu = value - filter.state[i];
                    if channel == Channel::Heading {
                        nu -= (nu / std::f64::consts::TAU).round() * std::f64::consts::TAU;
                    }
                    measured.push((channel, nu, h));
                }
            }
            let u = record.since_power_on_s[k] / record.belief.warm_up.time_constant_s;
            tangents.expect(&Expecting {
                at: &at,
                here,
                functions: &functions,
                cosines: &cosines,
                warm_up: [error - record.belief.warm_up.c2_rad_s, -record.belief.warm_up.c1_rad_s * u * (-u).exp()],
            });
            let prior = filter.state;
            let uncertain = models.here.wheel_variance_rad2_s2(&at);
            for (channel, nu, h) in measured {
                // what earlier readings of this row have moved already
                let moved: f64 = (0..N).map(|i| h[i] * (filter.state[i] - prior[i])).sum();
                let (nu, variance, gain) = filter.correct(
                    nu - moved,
                    &h,
                    noise.reading[channel as usize] + uncertain.get(channel as usize).unwrap_or(&0.0),
                );
                let std = variance.sqrt();
                let out = &mut block[filled * (p + 1)..(filled + 1) * (p + 1)];
                tangents.correct(channel as usize, &h, &gain, std, &mut out[..p]);
                out[p] = nu / std;
                each(&Innovation { row: k, channel, white: nu / std, std, slopes: &out[..p] });
                summed.ln_volume += (std::f64::consts::TAU * variance).ln();
                filled += 1;
                if filled == BLOCK {
                    add(&mut summed.gram, &block, filled);
                    filled = 0;
                }
            }
        }
        past.push(t_s - start_s, filter.state[W]);
        let Some(&next) = record.times_s[..end].get(k + 1) else { break };
        // motion to the next row
        let dt = next - t_s;
        let torques = record.torques(k);
        let mut at = moving(&filter.state, &before);
        models.here.accelerate(&mut at, torques);
        let sideways = models.here.sideways_m_s(&at);
        if free {
            row.speed = at.speed_m_s;
            row.yaw_rate = at.yaw_rate_rad_s;
            row.heading = at.heading_rad;
            [row.acceleration, row.yaw_acceleration] = match &record.torques_n_m {
                Some(_) => [at.acceleration_m_s2, at.yaw_acceleration_rad_s2],
                None => before.0,
            };
            row.torques = torques;
            for (lagged, lag_s) in row.lagged.iter_mut().zip([0.05, 0.5]) {
                let keep = (-dt / lag_s).exp();
                for (l, u) in lagged.iter_mut().zip(torques) {
                    *l = u + keep * (*l - u);
                }
            }
            let turning = models.here.robot.wheels_rad_s(at.speed_m_s, at.yaw_rate_rad_s);
            for (angle, w) in row.wheel_angles.iter_mut().zip(turning) {
                *angle += w * dt;
            }
            row.functions(scales, &mut functions);
        }
        let f = filter.jacobian(&models.here, &at, torques, sideways, dt, scales);
        tangents.predict(&f, &Going { at: &at, torques, sideways, dt, functions: &functions });
        // without torques the robot goes on accelerating as it did
        let drift = if record.torques_n_m.is_none() {
            let [a, alpha] = before.0;
            [a - at.acceleration_m_s2, alpha - at.yaw_acceleration_rad_s2].map(|d| noise.unforced.lasting * d)
        } else {
            [0.0; 2]
        };
        before = ([at.acceleration_m_s2, at.yaw_acceleration_rad_s2], at.wheel_force_n);
        filter.predict(&models.here, &at, &Step { torques, sideways, drift, dt }, &f);
        if record.torques_n_m.is_none() {
            // without torques the accelerations are what speeds have done, and the forces what that takes
            before = slopes.push(dt, [filter.state[V], filter.state[W]], &models.here);
        }
    }
    add(&mut summed.gram, &block, filled);
    for j in 0..=p {
        for i in 0..j {
            summed.gram[(i, j)] = summed.gram[(j, i)];
        }
    }
    summed
}

/// G += B'B over the first `rows` rows of the block.
fn add(gram: &mut Mat<f64>, block: &[f64], rows: usize) {
    if rows > 0 {
        let width = gram.ncols();
        let b = MatRef::from_row_major_slice(&block[..rows * width], rows, width);
        // one triangle is enough until the end
        let (whole, lower) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
        matmul(gram.as_mut(), lower, Accum::Add, b.transpose(), whole, b, whole, 1.0, Par::Seq);
    }
}

struct Readings {
    values: [f64; 6],
    any: bool,
}

impl Readings {
    fn of(record: &Record, k: usize) -> Self {
        let [l, r] = &record.wheels_rad_s;
        let gyro = record.gyro_rad_s.as_ref().map_or(f64::NAN, |g| g[k]);
        let pose = record.pose.as_ref().map_or([f64::NAN; 3], |[x, y, h]| [x[k], y[k], h[k]]);
        let values = [l[k], r[k], gyro, pose[0], pose[1], pose[2]];
        Self { values, any: values.iter().any(|v| v.is_finite()) }
    }
}
