//! θ̂ = argmax ln p(readings | θ):   ν/√S = Σ_j s_j δ_j + white,   δ = (A + P)⁻¹ b,   cov θ̂ = (A + P)⁻¹
//!
//! Constants of the model, coordinates of its effects and the noise, all by the likelihood of the extended Kalman filter that judges
//! recordings ([`super::super::drive::ekf`]): one pass gives the innovations ν and their slopes s by every coordinate. A and b are
//! their sums, P the precisions of what is drawn anew in each run. The noise is maximised one standard deviation at a time, in its
//! logarithm, with what is drawn anew integrated out; in turns, until neither gains. The likelihood of a filter is right whether or
//! not the torques come from a control that acts on the readings: given the past, they are known.

use super::constants::{Constant, Constants};
use crate::effects::drive::ModelChange;
use crate::gap::drive::ekf::innovations::{Innovation, run_scoped};
use crate::gap::drive::ekf::noise::{Channel, Noise, Process};
use crate::gap::drive::fit::models;
use crate::gap::drive::preprocess::initial_noise::InitialNoise;
use crate::gap::drive::preprocess::torque_bandwidth;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::basis::{Column, Scoped, nuisances};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::fmt;

/// Turns of constants and noise.
const TURNS: usize = 4;
/// Gauss-Newton steps in a turn.
const STEPS: usize = 10;
/// Gain below which a step, or a turn, is the last one, nats.
const SETTLED: f64 = 0.05;
/// Share of its energy that a column must have beside the others to be told.
const OWN: f64 = 1e-5;
/// Standard deviation of the gyro's turn-on bias while it is estimated, rad/s: any.
const ANY_BIAS_RAD_S: f64 = 1.0;
/// Longest step of a standard deviation's logarithm.
const FURTHEST: f64 = 1.5;
/// Smallest and largest standard deviation over the first guess.
const RANGE: [f64; 2] = [1e-4, 1e4];

/// Standard deviations that are fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    /// Of the torques, N·m·√s.
    Torque,
    /// Of a wheel's speed, rad/s.
    Wheels,
    /// Of a sample of the gyro, rad/s.
    Gyro,
    /// Of a position, m.
    Position,
    /// Of a heading, rad.
    Heading,
}

impl Level {
    const ALL: [Self; 5] = [Self::Torque, Self::Wheels, Self::Gyro, Self::Position, Self::Heading];

    fn of(self, record: &mut Record) -> &mut f64 {
        let belief = &mut record.belief;
        match self {
            Self::Torque => &mut belief.torque_noise_n_m_sqrt_s,
            Self::Wheels => &mut belief.wheel_std_rad_s,
            Self::Gyro => &mut belief.gyro_std_rad_s,
            Self::Position => &mut belief.position_std_m,
            Self::Heading => &mut belief.heading_std_rad,
        }
    }

    /// Those that `record` tells by this filter. Without torques, noise of wheels and gyro is estimated with the motion.
    fn told_by(record: &Record) -> Vec<Self> {
        let forced = record.torques_n_m.is_some();
        let there = |level: &Self| match level {
            Self::Torque | Self::Wheels => forced,
            Self::Gyro => forced && record.gyro_rad_s.is_some(),
            Self::Position => record.pose.is_some(),
            Self::Heading => record.pose.as_ref().is_some_and(|p| p[2].iter().any(|h| h.is_finite())),
        };
        Self::ALL.into_iter().filter(there).collect()
    }
}

/// The model that is fitted, beside its effects.
#[derive(Clone)]
pub(super) struct Fitting {
    /// The drives, with the constants and noise fitted so far.
    pub record: Record,
    /// Constants that are fitted.
    pub free: Vec<Constant>,
    /// Effects that are fitted, with their coordinates.
    pub changes: Vec<(&'static dyn ModelChange, Vec<f64>)>,
    /// The constants as a change.
    own: &'static Constants,
    /// Share of the torque noise that is white within a step.
    ripple: f64,
    /// Motion beyond the model, without torques.
    process: Process,
    lsb_rad_s: Option<f64>,
}

impl fmt::Debug for Fitting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let coordinates: Vec<&Vec<f64>> = self.changes.iter().map(|c| &c.1).collect();
        f.debug_struct("Fitting").field("free", &self.free).field("coordinates", &coordinates).finish_non_exhaustive()
    }
}

/// A column that is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fitted {
    /// A constant.
    Constant(Constant),
    /// Coordinate `.1` of change `.0`.
    Change(usize, usize),
    /// Turn-on bias of a drive.
    TurnOn(usize),
    /// Something else that is drawn anew.
    Drawn,
}

/// Normal equations of one pass.
pub(super) struct Normal {
    /// Columns.
    pub columns: Vec<Fitted>,
    /// Estimates of their deviations; zero of a column that the others hold already.
    pub delta: DVector<f64>,
    /// Covariance; zero there.
    pub covariance: DMatrix<f64>,
    /// ln p with what is drawn anew integrated out, nats.
    pub ln_p: f64,
    /// Gain of the step that the equations promise, nats.
    pub gain: f64,
}

impl Normal {
    fn place(&self, of: Fitted) -> Option<usize> {
        self.columns.iter().position(|c| *c == of).filter(|i| self.covariance[(*i, *i)] > 0.0)
    }

    /// Deviation and standard deviation of a column; none where it is not told.
    pub(super) fn told(&self, of: Fitted) -> Option<[f64; 2]> {
        self.place(of).map(|i| [self.delta[i], self.covariance[(i, i)].sqrt()])
    }

    /// Covariance of two columns; zero where one is not told.
    pub(super) fn between(&self, a: Fitted, b: Fitted) -> f64 {
        self.place(a).zip(self.place(b)).map_or(0.0, |(i, j)| self.covariance[(i, j)])
    }
}

/// Without the asymmetry that rounding makes.
fn symmetric(m: &DMatrix<f64>) -> DMatrix<f64> {
    0.5 * (m + m.transpose())
}

impl Fitting {
    /// Of `record` as it is believed, with nothing fitted yet.
    pub(super) fn new(
        mut record: Record,
        own: &'static Constants,
        free: Vec<Constant>,
        changes: Vec<(&'static dyn ModelChange, Vec<f64>)>,
    ) -> Self {
        record.belief.turn_on_bias_std_rad_s = ANY_BIAS_RAD_S;
        record.belief.warm_up_relative_std = 0.0;
        let lsb_rad_s = record.given.wheel_lsb_rad_s;
        Self { record, free, changes, own, ripple: 0.0, process: Process::default(), lsb_rad_s }
    }

    /// Without torques: how the speeds diffuse, and noise of wheels and gyro with it. With them: how the torque noise changes
    /// within a step.
    fn estimate_motion(&mut self) {
        let found = InitialNoise::of(&self.record);
        if self.record.torques_n_m.is_none() {
            self.process = found.noise.process;
            self.record = self.record.clone().with_levels_of(&found.noise);
        } else {
            let before = self.noise(&self.record);
            let all = self.record.belief.torque_noise_n_m_sqrt_s.powi(2);
            self.ripple = torque_bandwidth::before(&self.record, &before).process.ripple / all.max(f64::MIN_POSITIVE);
        }
    }

    /// Takes another time constant of the warm-up.
    pub(super) fn warm_with(&mut self, own: &'static Constants) {
        self.own = own;
        self.record.belief.warm_up.time_constant_s = own.0;
    }

    /// Noise that the filter assumes for `record`.
    pub(super) fn noise(&self, record: &Record) -> Noise {
        let forced = record.torques_n_m.is_some();
        let ripple = self.ripple * record.belief.torque_noise_n_m_sqrt_s.powi(2);
        let process = if forced { Process { ripple, ..self.process } } else { self.process };
        Noise { process, ..Noise::of(&record.belief, forced, self.lsb_rad_s) }
    }

    fn theta(&self) -> Vec<Vec<f64>> {
        let own = self.own.theta(&Default::default());
        std::iter::once(own).chain(self.changes.iter().map(|c| c.1.clone())).collect()
    }

    /// Normal equations of `record` at the constants that it believes, with columns for `free` and for the changes.
    pub(super) fn normal(&self, record: &Record, free: &[Constant], with_changes: bool) -> Normal {
        self.pass(record, &self.columns(record, free, with_changes), |_| {})
    }

    /// Calls `each` with channel, ν/√S and √S of every innovation, the columns at what `normal` estimates.
    pub(super) fn innovations(&self, normal: &Normal, mut each: impl FnMut(Channel, f64, f64) + Send) {
        let columns = self.columns(&self.record, &self.free, true);
        self.pass(&self.record, &columns, |i| {
            let told: f64 = i.slopes.iter().zip(normal.delta.iter()).map(|(s, d)| s * d).sum();
            each(i.channel, i.white - told, i.std);
        });
    }

    /// Estimates of the coordinates of `change`, in a drive of its own or of all, beside the constants that it does not hold, and
    /// their standard deviations; none where it is not told.
    pub(super) fn beside(&self, record: &Record, change: &'static dyn ModelChange) -> Vec<Option<[f64; 2]>> {
        let mut with = self.clone();
        let place = with.changes.len();
        with.changes.push((change, vec![0.0; change.coordinates().len() + change.departures().len()]));
        let mut columns = with.columns(record, &self.free, true);
        // the prior of what is asked about is not part of the answer
        let is_asked = |fitted: &Fitted| matches!(fitted, Fitted::Change(i, _) if *i == place);
        columns.iter_mut().filter(|c| is_asked(&c.2)).for_each(|c| c.1 = 0.0);
        let normal = with.pass(record, &columns, |_| {});
        (0..change.coordinates().len()).map(|j| normal.told(Fitted::Change(place, j))).collect()
    }

    fn columns(&self, record: &Record, free: &[Constant], with_changes: bool) -> Vec<(Scoped, f64, Fitted)> {
        let mut columns: Vec<(Scoped, f64, Fitted)> = Vec::new();
        for (column, std) in nuisances(record) {
            let fitted = match (column.column, column.drive) {
                (Column::TurnOn, drive) => Fitted::TurnOn(drive.unwrap_or(0)),
                _ => Fitted::Drawn,
            };
            columns.push((column, std.powi(-2), fitted));
        }
        if with_changes {
            for (i, (change, _)) in self.changes.iter().enumerate() {
                for (j, c) in change.coordinates().iter().enumerate() {
                    let place = Column::Coordinate(i + 1, j).into();
                    columns.push((place, c.scale[1].powi(-2), Fitted::Change(i, j)));
                }
            }
        }
        columns.extend(free.iter().map(|c| (Column::Coordinate(0, *c as usize).into(), 0.0, Fitted::Constant(*c))));
        columns
    }

    fn pass(&self, record: &Record, columns: &[(Scoped, f64, Fitted)], each: impl FnMut(&Innovation) + Send) -> Normal {
        let slopes = columns.iter().any(|c| matches!(c.2, Fitted::Change(..) | Fitted::Constant(_)));
        let own: &'static dyn ModelChange = self.own;
        let changes: Vec<&'static dyn ModelChange> =
            std::iter::once(own).chain(self.changes.iter().map(|c| c.0)).collect();
        let here = models(record, &changes, &self.theta(), slopes);
        let scoped: Vec<Scoped> = columns.iter().map(|c| c.0).collect();
        let summed = run_scoped(record, &here, &self.noise(record), &scoped, each);
        let p = columns.len();
        let mut a = DMatrix::from_fn(p, p, |i, j| summed.gram[(i, j)]);
        let mut b = DVector::from_fn(p, |i, _| summed.gram[(i, p)]);
        // the priors of effects are about zero, not about where they are now
        for (i, (_, precision, fitted)) in columns.iter().enumerate() {
            a[(i, i)] += precision;
            if let Fitted::Change(c, j) = fitted {
                b[i] -= precision * self.changes[*c].1[*j];
            }
        }
        let names: Vec<Fitted> = columns.iter().map(|c| c.2).collect();
        let priors: Vec<f64> = columns.iter().map(|c| c.1).collect();
        solved(&symmetric(&a), &b, &priors, names, summed.ln_likelihood() - self.ln_prior())
    }

    /// -ln p of the effects' coordinates, without constants.
    fn ln_prior(&self) -> f64 {
        let one = |(change, theta): &(&'static dyn ModelChange, Vec<f64>)| -> f64 {
            change.coordinates().iter().zip(theta).map(|(c, t)| 0.5 * (t / c.scale[1]).powi(2)).sum()
        };
        self.changes.iter().map(one).sum()
    }

    /// Fits everything.
    pub(super) fn fit(&mut self) -> Normal {
        let mut before = f64::NEG_INFINITY;
        if self.record.torques_n_m.is_none() {
            self.estimate_motion();
        }
        for turn in 0..TURNS {
            self.fit_noise();
            if turn == 0 && self.record.torques_n_m.is_some() {
                self.estimate_motion();
            }
            let ln_p = self.fit_constants();
            if ln_p - before < SETTLED {
                break;
            }
            before = ln_p;
        }
        self.normal(&self.record, &self.free, true)
    }

    /// Gauss-Newton steps; ln p at their end, nats.
    fn fit_constants(&mut self) -> f64 {
        // the nominal robot has one radius
        let free: Vec<Constant> = self.free.iter().copied().filter(|c| *c != Constant::RadiusRatio).collect();
        let mut best = self.normal(&self.record, &free, true);
        for _ in 0..STEPS {
            if best.gain < SETTLED {
                break;
            }
            let from = (self.record.clone(), self.changes.clone());
            let mut share = 1.0;
            let next = loop {
                (self.record, self.changes) = from.clone();
                self.step(&best, share);
                let there = self.normal(&self.record, &free, true);
                if there.ln_p.is_finite() && there.ln_p > best.ln_p - SETTLED {
                    break Some(there);
                }
                share *= 0.5;
                if share < 1e-3 {
                    break None;
                }
            };
            let Some(next) = next else {
                (self.record, self.changes) = from;
                break;
            };
            best = next;
        }
        best.ln_p
    }

    /// Moves constants and effects by `share` of what `normal` estimates.
    fn step(&mut self, normal: &Normal, share: f64) {
        let mut theta = self.own.theta(&Default::default());
        for (column, delta) in normal.columns.iter().zip(normal.delta.iter()) {
            match column {
                Fitted::TurnOn(_) | Fitted::Drawn => {}
                Fitted::Constant(c) => theta[*c as usize] = share * delta,
                Fitted::Change(i, j) => {
                    let [low, high] = self.changes[*i].0.coordinates()[*j].bounds;
                    let value = &mut self.changes[*i].1[*j];
                    *value = (*value + share * delta).clamp(low, high);
                }
            }
        }
        let belief = &mut self.record.belief;
        self.own.at(&theta).robot(&mut belief.robot);
        belief.robot.viscous_friction_n_m_s = belief.robot.viscous_friction_n_m_s.max(0.0);
        belief.warm_up.c1_rad_s += theta[Constant::WarmUp as usize];
        belief.warm_up.time_constant_s = self.own.0;
    }

    /// ln p of the noise that `record` believes, nats.
    fn ln_p(&self, record: &Record) -> f64 {
        self.normal(record, &[], false).ln_p
    }

    /// Maximises ln p over one standard deviation after the other, by the parabola through three values.
    fn fit_noise(&mut self) {
        let levels = Level::told_by(&self.record);
        let first: Vec<f64> = levels.iter().map(|level| *level.of(&mut self.record.clone())).collect();
        let mut apart = vec![0.5; levels.len()];
        let mut before = f64::NEG_INFINITY;
        for _ in 0..STEPS {
            let mut now = before;
            for (i, level) in levels.iter().enumerate() {
                let at = |ln: f64| {
                    let mut record = self.record.clone();
                    let std = level.of(&mut record);
                    *std = (*std * ln.exp()).clamp(first[i] * RANGE[0], first[i] * RANGE[1]);
                    record
                };
                let weighed: Vec<f64> = [-apart[i], 0.0, apart[i]].par_iter().map(|ln| self.ln_p(&at(*ln))).collect();
                let [below, here, above] = [weighed[0], weighed[1], weighed[2]];
                let bend = 2.0 * here - below - above;
                let vertex =
                    if bend > 0.0 { 0.5 * apart[i] * (above - below) / bend } else { FURTHEST.copysign(above - below) };
                let vertex = vertex.clamp(-FURTHEST, FURTHEST);
                let there = at(vertex);
                let gained = self.ln_p(&there);
                let (best, record) = if gained >= here.max(below).max(above) {
                    (gained, there)
                } else if below > here.max(above) {
                    (below, at(-apart[i]))
                } else if above > here {
                    (above, at(apart[i]))
                } else {
                    (here, self.record.clone())
                };
                apart[i] = (vertex.abs()).clamp(0.02, apart[i].max(0.1));
                self.record = record;
                now = best;
            }
            if now - before < SETTLED {
                break;
            }
            before = now;
        }
    }

    /// Standard deviation of ln σ of each level that is told, by the curvature of ln p.
    pub(super) fn level_stds(&self) -> Vec<(Level, f64)> {
        let apart = 0.05;
        let here = self.ln_p(&self.record);
        let one = |level: Level| {
            let [below, above] = [-apart, apart].map(|ln: f64| {
                let mut record = self.record.clone();
                *level.of(&mut record) *= ln.exp();
                self.ln_p(&record)
            });
            let bend = (2.0 * here - below - above) / (apart * apart);
            (level, if bend > 0.0 { bend.powf(-0.5) } else { f64::INFINITY })
        };
        Level::told_by(&self.record).into_iter().map(one).collect()
    }
}

/// Solution of (A + P) δ = b, columns that lie in the span of those before them left out.
fn solved(a: &DMatrix<f64>, b: &DVector<f64>, priors: &[f64], columns: Vec<Fitted>, ln_p: f64) -> Normal {
    let p = columns.len();
    let told = independent(a);
    let n = told.len();
    let small = DMatrix::from_fn(n, n, |i, j| a[(told[i], told[j])]);
    let mut delta = DVector::zeros(p);
    let mut covariance = DMatrix::zeros(p, p);
    // an ill-conditioned sum of squares is as if nothing were told
    if let Some(factor) = small.cholesky() {
        let right = DVector::from_fn(n, |i, _| b[told[i]]);
        let (solution, inverse) = (factor.solve(&right), factor.inverse());
        for (i, at) in told.iter().enumerate() {
            delta[*at] = solution[i];
            for (j, other) in told.iter().enumerate() {
                covariance[(*at, *other)] = inverse[(i, j)];
            }
        }
    }
    // what is drawn anew, integrated out
    let drawn: Vec<usize> = (0..p).filter(|i| matches!(columns[*i], Fitted::TurnOn(_) | Fitted::Drawn)).collect();
    let d = drawn.len();
    let right = DVector::from_fn(d, |i, _| b[drawn[i]]);
    let own = DMatrix::from_fn(d, d, |i, j| a[(drawn[i], drawn[j])]).cholesky();
    let (of_drawn, volume) = own.map_or((0.0, 0.0), |factor| {
        let diagonal: f64 = (0..d).map(|i| factor.l_dirty()[(i, i)].ln()).sum();
        let prior: f64 = drawn.iter().map(|i| 0.5 * priors[*i].ln()).sum();
        (0.5 * right.dot(&factor.solve(&right)), prior - diagonal)
    });
    let gain = 0.5 * b.dot(&delta) - of_drawn;
    Normal { columns, delta, covariance, ln_p: ln_p + of_drawn + volume, gain }
}

/// Columns that have more than [`OWN`] of their energy beside those before them.
fn independent(a: &DMatrix<f64>) -> Vec<usize> {
    let p = a.nrows();
    let mut chosen: Vec<usize> = Vec::new();
    for c in 0..p {
        let energy = a[(c, c)];
        if !(energy > 0.0 && energy.is_finite()) {
            continue;
        }
        let n = chosen.len();
        let block = DMatrix::from_fn(n, n, |i, j| a[(chosen[i], chosen[j])]);
        let cross = DVector::from_fn(n, |i, _| a[(chosen[i], c)]);
        let inside = if n == 0 { Some(0.0) } else { block.cholesky().map(|f| cross.dot(&f.solve(&cross))) };
        if inside.is_some_and(|inside| energy - inside > OWN * energy) {
            chosen.push(c);
        }
    }
    chosen
}
