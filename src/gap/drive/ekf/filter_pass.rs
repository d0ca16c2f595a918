//! The filter over the rows of one drive, and the quantities that derivatives need in each row. Nothing of that depends
//! on the columns, so that one thread can run ahead with the filter while others follow with the columns.

use super::filter::{Corrected, Filter, Lasting, Matrix, N, Step, TH, V, Vector, W, X, Y};
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::{Channel, Noise, Process};
use crate::gap::drive::ekf::slopes::Slopes;
use crate::gap::drive::ekf::unknown_input;
use crate::gap::drive::record::Record;
use crate::gap::drive::record::reckoning::FirstPose;
use crate::gap::drive::regressors::basis::{COSINES, Column, FUNCTIONS, Row, Scales, cosines_of};
use crate::model::drive::{DriveModel, Instrument, Moving, Past};
use std::ops::Range;

/// Time constants of the lagged torques, s.
const LAGS_S: [f64; 2] = [0.05, 0.5];

/// A reading as the filter used it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScalarUpdate {
    /// Channel.
    pub channel: Channel,
    /// ∂(expected reading)/∂state
    pub h: Vector,
    /// Decrease of a late reading per change of v and ω by noise since it was true
    pub late: [f64; 2],
    /// K, gain of the state
    pub gain: Vector,
    /// Gain of the change of v and ω by noise in the last step
    pub shaken_gain: [f64; 2],
    /// ν/√S
    pub white: f64,
    /// √S
    pub std: f64,
}

/// One row as the filter went through it.
#[derive(Debug, Clone)]
pub(crate) struct RowLinearization {
    /// Row of the log.
    pub row: usize,
    /// Whether the robot is put on its first pose here: derivatives of the pose are zero before the readings.
    pub placed: bool,
    /// Motion before the readings, without the past.
    pub at: Moving<'static>,
    /// Sine and cosine of the heading there.
    pub heading: (f64, f64),
    /// Expected readings of left wheel, right wheel and gyro (without its bias) under the model at β, rad/s.
    pub here: [f64; 3],
    /// x, y and heading at the time that their readings are of, less the present ones, under the model at β.
    pub pose_ago: [f64; 3],
    /// Values of the functions of free forms, before the readings.
    pub functions: [f64; FUNCTIONS],
    /// cos(nπu), u from 0 to 1 over the drive
    pub cosines: [f64; COSINES],
    /// ∂(gyro)/∂(ln C1, ln T), rad/s
    pub warm_up: [f64; 2],
    /// Readings, in the order in which they were used.
    pub taken: Vec<ScalarUpdate>,
    /// v (m/s) and ω (rad/s) after the readings
    pub speeds: [f64; 2],
    /// Whether there is a next row; the fields below are about the step to it.
    pub goes_on: bool,
    /// Motion after the readings, accelerations included.
    pub leaving: Moving<'static>,
    /// Force and moment of each effect of the model at β there.
    pub forces: Vec<[f64; 2]>,
    /// ∂(state in the next row)/∂state
    pub f: Matrix,
    /// Inputs of the step.
    pub step: Step,
    /// Sine and cosine of the heading half way there.
    pub middle: (f64, f64),
    /// Values of the functions of free forms, on the way to the next row.
    pub functions_ahead: [f64; FUNCTIONS],
}

impl Default for RowLinearization {
    fn default() -> Self {
        let still = Moving::default();
        Self {
            row: 0,
            placed: false,
            at: still,
            heading: (0.0, 1.0),
            here: [0.0; 3],
            pose_ago: [0.0; 3],
            functions: [0.0; FUNCTIONS],
            cosines: [0.0; COSINES],
            warm_up: [0.0; 2],
            taken: Vec::with_capacity(Channel::ALL.len()),
            speeds: [0.0; 2],
            goes_on: false,
            leaving: still,
            forces: Vec::new(),
            f: [[0.0; N]; N],
            step: Step::default(),
            middle: (0.0, 1.0),
            functions_ahead: [0.0; FUNCTIONS],
        }
    }
}

/// The filter on its way through the rows of a drive.
pub(crate) struct FilterPass<'a> {
    record: &'a Record,
    rows: Range<usize>,
    scales: &'a Scales,
    models: &'a Models,
    noise: &'a Noise,
    filter: Filter<'a>,
    /// First pose, where the first row has none
    first: Option<FirstPose>,
    past: Past,
    /// Accelerations and forces under the torques before this row: sensors are read before the new ones act
    before: ([f64; 2], [f64; 2]),
    /// Mean accelerations of the filter in the last step: a late reading holds a part of that step, and of the change
    /// by noise in it
    stepped: [f64; 2],
    /// √(h'R⁻¹h) of v and of ω over that of the nominal robot, where the motion is an unknown input; else one.
    steep: [f64; 2],
    slopes: Slopes,
    row: Row,
    wheel_angles_rad: [f64; 2],
    /// Time step, s, and the factors by which lagged torques decay in it
    keep: (f64, [f64; 2]),
    /// Whether there are columns; whether these need any functions of the table, and those of time
    followed: bool,
    free: bool,
    timed: bool,
    start_s: f64,
    span_s: f64,
    next: usize,
    /// Last reading of each wheel, and how often it has come in a row
    repeats: [(f64, f64); 2],
    /// Variance of the quantization error, rad²/s², and the correlation of the errors of two equal readings
    lattice: (f64, f64),
    /// Σ ln(2πS) so far
    pub ln_volume: f64,
}

impl<'a> FilterPass<'a> {
    /// At the first of `rows`, which are those of one drive.
    pub(crate) fn new(
        record: &'a Record,
        rows: Range<usize>,
        scales: &'a Scales,
        models: &'a Models,
        noise: &'a Noise,
        columns: &[Column],
    ) -> Self {
        let models = models.carrying(record.load_kg(rows.start));
        let start_s = record.times_s.get(rows.start).copied().unwrap_or(0.0);
        let free = columns.iter().any(|c| matches!(c, Column::Free(..) | Column::Varying(..)));
        Self {
            record,
            scales,
            models,
            noise,
            filter: Filter::new(record, rows.clone(), noise, models.here.by_torque()),
            first: FirstPose::of(record, rows.clone()).filter(|first| first.row > rows.start),
            past: Past::default(),
            before: ([0.0; 2], [0.0; 2]),
            stepped: [0.0; 2],
            steep: [1.0; 2],
            slopes: Slopes::new(scales.slopes_over_s),
            row: Row { wheel_angles: [(0.0, 1.0); 2], ..Row::default() },
            wheel_angles_rad: [0.0; 2],
            keep: (f64::NAN, [0.0; 2]),
            followed: !columns.is_empty(),
            free,
            timed: free || columns.iter().any(|c| matches!(c, Column::GyroCosine(_))),
            start_s,
            span_s: (record.times_s[rows.clone()].last().copied().unwrap_or(start_s) - start_s).max(1e-9),
            next: rows.start,
            repeats: [(f64::NAN, 0.0); 2],
            lattice: lattice(noise),
            rows,
            ln_volume: 0.0,
        }
    }

    /// Filters one row and writes it to `out`; false after the last.
    pub(crate) fn row(&mut self, out: &mut RowLinearization) -> bool {
        let k = self.next;
        if k >= self.rows.end {
            return false;
        }
        self.next += 1;
        out.row = k;
        self.read(k, out);
        let [v, w] = self.speeds();
        out.speeds = [v, w];
        self.past.push(self.record.times_s[k] - self.start_s, [v, w], self.before.1);
        out.goes_on = self.next < self.rows.end;
        if out.goes_on {
            self.go(k, out);
        }
        true
    }

    /// Speed, m/s, and yaw rate, rad/s.
    fn speeds(&self) -> [f64; 2] {
        [self.filter.state[V], self.filter.state[W]]
    }

    fn moving(&self, k: usize) -> Moving<'static> {
        let state = &self.filter.state;
        Moving {
            t_s: self.record.times_s[k] - self.start_s,
            since_power_on_s: self.record.since_power_on_s[k],
            x_m: state[X],
            y_m: state[Y],
            heading_rad: state[TH],
            speed_m_s: state[V],
            yaw_rate_rad_s: state[W],
            acceleration_m_s2: self.before.0[0],
            yaw_acceleration_rad_s2: self.before.0[1],
            wheel_force_n: self.before.1,
            past: None,
        }
    }

    /// Updates by the readings of row `k`.
    fn read(&mut self, k: usize, out: &mut RowLinearization) {
        let (record, models, scales) = (self.record, self.models, self.scales);
        out.taken.clear();
        out.placed = self.first.is_some_and(|first| first.row == k);
        if let Some(first) = self.first.take_if(|_| out.placed) {
            self.filter.place(&first);
        }
        out.at = self.moving(k);
        if record.torques_n_m.is_none() {
            [out.at.acceleration_m_s2, out.at.yaw_acceleration_rad_s2] = self.stepped;
        }
        if self.timed {
            cosines_of(out.at.t_s / self.span_s, &mut out.cosines);
        }
        let Some(readings) = readings(record, k) else { return };
        // without torques the past rates are the gyro's own
        let at = Moving { past: record.torques_n_m.is_some().then_some(&self.past), ..out.at };
        let here = expected(&models.here, &at);
        let error = record.belief.warm_up.error_rad_s(record.since_power_on_s[k]);
        out.here = here;
        if self.followed {
            out.heading = at.heading_rad.sin_cos();
            let u = record.since_power_on_s[k] / record.belief.warm_up.time_constant_s;
            let grown = error - record.belief.warm_up.c2_rad_s;
            out.warm_up = [grown, -record.belief.warm_up.c1_rad_s * u * (-u).exp()];
        }
        if self.free {
            self.row.speed = at.speed_m_s;
            self.row.yaw_rate = at.yaw_rate_rad_s;
            self.row.heading = out.heading;
            [self.row.acceleration, self.row.yaw_acceleration] = self.before.0;
            self.row.torques = record.torques(k.saturating_sub(1).max(self.rows.start));
            self.row.functions(scales, &out.cosines, &mut out.functions);
        }
        // derivatives of the expected readings by the state
        let step = [1e-4 * scales.speed, 1e-4 * scales.yaw_rate];
        let by_speed = expected(&models.here, &Moving { speed_m_s: at.speed_m_s + step[0], ..at });
        let by_rate = expected(&models.here, &Moving { yaw_rate_rad_s: at.yaw_rate_rad_s + step[1], ..at });
        let by = |moved: &[f64; 3], step: f64| std::array::from_fn(|channel| (moved[channel] - here[channel]) / step);
        let (by_speed, by_rate): ([f64; 3], [f64; 3]) = (by(&by_speed, step[0]), by(&by_rate, step[1]));
        if self.noise.process.unknown_input != [0.0; 2] {
            self.steep = unknown_input::steepness(record, self.noise, by_speed, by_rate);
        }
        let mut uncertain = models.here.wheel_variance_rad2_s2(&at);
        let at_rims = self.noise.process.at_rims;
        if at_rims > 0.0 {
            let shaken = models.here.wheel_variance_by_torque_noise(&at);
            uncertain.iter_mut().zip(shaken).for_each(|(sum, own)| *sum += at_rims * own);
        }
        let late_s = models.here.delay_s(Instrument::Pose);
        out.pose_ago = at.pose_ago(late_s);
        let [back_x, back_y, turned] = out.pose_ago;
        let (sin, cos) = (at.heading_rad + 0.5 * turned).sin_cos();
        let prior = self.filter.state;
        let mut volume = 1.0;
        let late = self.late(k).map(|(share, late)| {
            self.filter.since(share);
            late
        });
        for (channel, value) in Channel::ALL.into_iter().zip(readings).filter(|(_, value)| value.is_finite()) {
            let place = channel as usize;
            let mut h = [0.0; N];
            let nu = match channel {
                Channel::WheelLeft | Channel::WheelRight | Channel::Gyro => {
                    (h[V], h[W]) = (by_speed[place], by_rate[place]);
                    let e = if channel == Channel::Gyro { error } else { 0.0 };
                    value - here[place] - e
                }
                Channel::X | Channel::Y | Channel::Heading => {
                    h[place - 3] = 1.0;
                    match channel {
                        Channel::X => (h[TH], h[V], h[W]) = (-back_y, -late_s * cos, 0.5 * late_s * back_y),
                        Channel::Y => (h[TH], h[V], h[W]) = (back_x, -late_s * sin, -0.5 * late_s * back_x),
                        _ => h[W] = -late_s,
                    }
                    let mut nu = value - prior[place - 3] - out.pose_ago[place - 3];
                    if channel == Channel::Heading {
                        nu -= (nu / std::f64::consts::TAU).round() * std::f64::consts::TAU;
                    }
                    nu
                }
            };
            let again = self.repeats.get_mut(place).map_or(0.0, |last| {
                let times = if last.0 == value { last.1 + 1.0 } else { 1.0 };
                *last = (value, times);
                repeated(self.lattice, times)
            });
            // change of the state by earlier readings of this row
            let moved: f64 = (0..N).map(|i| h[i] * (self.filter.state[i] - prior[i])).sum();
            let variance = self.noise.reading[place] + uncertain.get(place).unwrap_or(&0.0) + again;
            let of = late.map(|late| late.get(place).copied().unwrap_or(0.0));
            let late = [V, W].map(|i| of.unwrap_or(0.0) * h[i]);
            let shaken: f64 = late.iter().zip(self.filter.shaken.mean).map(|(by, mean)| by * mean).sum();
            let nu = nu - moved + shaken;
            let Corrected { variance, gain, shaken_gain } = self.filter.correct(nu, &h, variance, of);
            let std = variance.sqrt();
            out.taken.push(ScalarUpdate { channel, h, late, gain, shaken_gain, white: nu / std, std });
            volume *= std::f64::consts::TAU * variance;
            // the product of six variances may leave the range of numbers
            if !(1e-150..1e150).contains(&volume) {
                self.ln_volume += f64::ln(std::mem::replace(&mut volume, 1.0));
            }
        }
        self.ln_volume += volume.ln();
    }

    /// Largest delay in row `k` as a share of the step before it, and the delays of left wheel, right wheel and gyro
    /// relative to that; none where no delay lies within the step.
    fn late(&self, k: usize) -> Option<(f64, [f64; 3])> {
        let delays_s = [Instrument::Wheels, Instrument::Gyro].map(|of| self.models.here.delay_s(of));
        if k == self.rows.start || delays_s.iter().all(|delay_s| *delay_s <= 0.0) {
            return None;
        }
        let dt = self.record.times_s[k] - self.record.times_s[k - 1];
        let [wheels, gyro] = delays_s.map(|delay_s| if (0.0..=dt).contains(&delay_s) { delay_s / dt } else { 0.0 });
        let share = wheels.max(gyro);
        (share > 0.0).then(|| (share, [wheels, wheels, gyro].map(|own| own / share)))
    }

    /// Predicts from row `k` to the next.
    fn go(&mut self, k: usize, out: &mut RowLinearization) {
        let (record, models) = (self.record, self.models);
        let model = &models.here;
        let dt = record.times_s[k + 1] - record.times_s[k];
        let torques = record.torques(k);
        let forced = record.torques_n_m.is_some().then_some(torques);
        let mut at = self.moving(k);
        model.forces(&at, &mut out.forces);
        if forced.is_some() {
            model.accelerate_with(&mut at, torques, |place, _| Some(out.forces[place]));
        }
        model.renew_forces(&at, &mut out.forces);
        if self.free {
            self.look_ahead(&at, torques, dt, out);
        }
        // without torques accelerations last, and friction says nothing: torques that nobody logged make up for it
        let (mut drift, mut lasting) = ([0.0; 2], [Lasting::default(); 2]);
        if forced.is_none() {
            let Process { lasting: share, agility, .. } = &self.noise.process;
            let lasts = self.scales.classes.lasts(agility, k);
            drift = [0, 1].map(|i| if lasts[i] { share * self.before.0[i] } else { 0.0 });
            lasting = [0, 1].map(|i| Lasting { share: *share, over: self.slopes.over[i], lasts: lasts[i] });
        }
        out.leaving = at;
        let Process { diffusion, agility, unknown_input, .. } = &self.noise.process;
        let ratios = self.scales.classes.ratios(agility, k);
        let diffusion = [0, 1].map(|i| diffusion[i] * ratios[i] + unknown_input[i] / self.steep[i].powi(2));
        out.step = Step { torques: forced, sideways: model.sideways_m_s(&at), drift, lasting, diffusion, dt };
        out.middle = (at.heading_rad + 0.5 * dt * at.yaw_rate_rad_s).sin_cos();
        out.f = self.filter.jacobian(model, &at, &out.forces, &out.step, out.middle, self.scales);
        self.before = ([at.acceleration_m_s2, at.yaw_acceleration_rad_s2], at.wheel_force_n);
        let from = self.speeds();
        self.filter.predict(model, &at, &out.step, &out.f);
        let to = self.speeds();
        self.stepped = [0, 1].map(|i| (to[i] - from[i]) / dt);
        if forced.is_none() {
            // without torques accelerations come from the change of the speeds, and forces from the accelerations
            self.before = self.slopes.push(dt, to, model);
        }
    }

    /// Functions of free forms on the way to the next row.
    fn look_ahead(&mut self, at: &Moving, torques: [f64; 2], dt: f64, out: &mut RowLinearization) {
        let row = &mut self.row;
        row.speed = at.speed_m_s;
        row.yaw_rate = at.yaw_rate_rad_s;
        row.heading = at.heading_rad.sin_cos();
        [row.acceleration, row.yaw_acceleration] = match &self.record.torques_n_m {
            Some(_) => [at.acceleration_m_s2, at.yaw_acceleration_rad_s2],
            None => self.scales.classes.lasting(&self.noise.process.agility, self.before.0, out.row),
        };
        row.torques = torques;
        if self.keep.0 != dt {
            self.keep = (dt, LAGS_S.map(|lag_s| (-dt / lag_s).exp()));
        }
        for (lagged, keep) in row.lagged.iter_mut().zip(self.keep.1) {
            for (l, u) in lagged.iter_mut().zip(torques) {
                *l = u + keep * (*l - u);
            }
        }
        let turning = self.models.here.robot.wheels_rad_s(at.speed_m_s, at.yaw_rate_rad_s);
        for ((angle, w), turned) in self.wheel_angles_rad.iter_mut().zip(turning).zip(&mut row.wheel_angles) {
            *angle += w * dt;
            *turned = angle.sin_cos();
        }
        row.functions(self.scales, &out.cosines, &mut out.functions_ahead);
    }
}

/// Variance q²/12 of the quantization error, rad²/s², and the correlation exp(-4π² σ²/q²) of two errors at constant
/// speed, for white noise σ before quantization (Widrow and Kollár, Quantization noise, 2008).
fn lattice(noise: &Noise) -> (f64, f64) {
    let square = noise.wheel_lsb_rad_s.powi(2);
    if square == 0.0 {
        return (0.0, 0.0);
    }
    let white = (noise.reading[0] - square / 12.0).max(0.0);
    // without noise a reading repeats for ever: the correlation is limited
    (square / 12.0, (-4.0 * std::f64::consts::PI.powi(2) * white / square).exp().min(0.999))
}

/// Variance, rad²/s², that a reading gains where it comes in a row for the `times`-th time. Of m errors of variance v
/// with correlation ρ the information is m/(v (1 - ρ + m ρ)); the m-th adds the reciprocal of
/// v (1 - ρ + m ρ)(1 - ρ + (m - 1) ρ)/(1 - ρ).
fn repeated((variance, correlation): (f64, f64), times: f64) -> f64 {
    let of = |m: f64| 1.0 - correlation + m * correlation;
    variance * (of(times) * of(times - 1.0) / (1.0 - correlation) - 1.0)
}

fn expected(model: &DriveModel, at: &Moving) -> [f64; 3] {
    let [l, r] = model.wheels_rad_s(at);
    [l, r, model.gyro_rad_s(at)]
}

/// Readings of row `k` by channel; none where all are missing.
fn readings(record: &Record, k: usize) -> Option<[f64; 6]> {
    let [l, r] = &record.wheels_rad_s;
    let gyro = record.gyro_rad_s.as_ref().map_or(f64::NAN, |g| g[k]);
    let pose = record.pose.as_ref().map_or([f64::NAN; 3], |[x, y, h]| [x[k], y[k], h[k]]);
    let values = [l[k], r[k], gyro, pose[0], pose[1], pose[2]];
    values.iter().any(|v| v.is_finite()).then_some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_that_repeat_tell_no_more_than_their_errors_are_independent() {
        let variance = 0.03;
        for correlation in [0.0, 0.03, 0.7, 0.999] {
            let mut information = 0.0;
            for times in 1..=200 {
                let times = f64::from(times);
                information += (variance + repeated((variance, correlation), times)).recip();
                let known = times / (variance * (1.0 - correlation + times * correlation));
                assert!((information / known - 1.0).abs() < 1e-9, "{correlation} {times}");
            }
        }
    }

    #[test]
    fn noise_that_shakes_a_lattice_makes_its_errors_independent() {
        let of = |std: f64| {
            let lsb = 0.1_f64;
            let mut reading = [0.0; 6];
            reading[0] = std * std + lsb * lsb / 12.0;
            lattice(&Noise { torque: 0.0, process: Default::default(), wheel_lsb_rad_s: lsb, reading })
        };
        assert!((of(0.01).0 - 0.01 / 12.0).abs() < 1e-15);
        // noise of a tenth of a step leaves a correlation of two thirds, of half a step next to none
        assert!((of(0.01).1 - 0.674).abs() < 1e-3 && of(0.05).1 < 1e-4 && of(0.0).1 < 1.0);
        let none = Noise { torque: 0.0, process: Default::default(), wheel_lsb_rad_s: 0.0, reading: [1.0; 6] };
        assert_eq!(repeated(lattice(&none), 50.0), 0.0);
    }
}
