//! x̄_k = Σ_t hat_k(t) x(t) / Σ_t hat_k(t): states and inputs about the knots of a correction.
//!
//! Functions are evaluated before they are averaged: a mean of squares is not the square of a mean. Wheel angles are
//! not included: a wheel turns several times between two knots, so a dependence on its angle is left to the regression
//! in the likelihood.

use super::Record;
use crate::gap::drive::ekf::filter_pass::{FilterPass, RowLinearization};
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::regressors::basis::{COSINES, FUNCTIONS, Follows, Row, Scales, hat};

/// A state or an input, averaged about the knots.
pub(crate) struct Covariate {
    /// Name, as in the conditions of an answer where it is one of these.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Mean about each knot, in `unit`.
    pub values: Vec<f64>,
    /// Means of functions of it about each knot, simplest first.
    pub functions: Vec<Vec<f64>>,
}

/// Knots at even distances in one drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knots {
    /// Time from one knot to the next, s.
    pub step_s: f64,
    /// Number of knots.
    pub count: usize,
}

/// Places of the heading and of the torques in `NAMES`.
const HEADING: usize = 5;
const TORQUES: std::ops::Range<usize> = 7..11;
const NAMES: [(&str, &str); 12] = [
    ("speed", "m/s"),
    ("yaw_rate", "rad/s"),
    ("lateral_acceleration", "m/s²"),
    ("acceleration", "m/s²"),
    ("yaw_acceleration", "rad/s²"),
    ("heading", "rad"),
    ("elapsed_time", "s"),
    ("torque_sum", "N·m"),
    ("torque_difference", "N·m"),
    ("torque_left", "N·m"),
    ("torque_right", "N·m"),
    ("temperature", "°C"),
];

/// Value and functions of each covariate in one row, in the order of [`NAMES`].
fn of_row(row: &Row, scales: &Scales, t_s: f64, temperature_c: f64) -> [(f64, Vec<f64>); NAMES.len()] {
    let mut table = [0.0; FUNCTIONS];
    row.functions(scales, &[0.0; COSINES], &mut table);
    let of = |follows: Follows, most: usize| table[follows.first()..][..most.min(follows.count())].to_vec();
    let [ul, ur] = row.torques;
    let bent = |x: f64| vec![x, x * x.abs()];
    [
        (row.speed, of(Follows::Speed, 5)),
        (row.yaw_rate, of(Follows::YawRate, 5)),
        (row.speed * row.yaw_rate, of(Follows::Turning, 3)),
        (row.acceleration, of(Follows::Acceleration, 3)),
        (row.yaw_acceleration, of(Follows::YawAcceleration, 3)),
        (0.0, of(Follows::Heading, 2)),
        // more functions of time could follow any signal
        (t_s, vec![t_s]),
        (ul + ur, bent(ul + ur)),
        (ur - ul, bent(ur - ul)),
        (ul, bent(ul)),
        (ur, bent(ur)),
        (temperature_c, vec![temperature_c]),
    ]
}

/// Covariates that `record` holds, about `knots` of each of its drives, from the states of the filter of `models`.
pub(crate) fn about(record: &Record, models: &Models, noise: &Noise, knots: &[Knots]) -> Vec<Covariate> {
    let scales = Scales::of(record, &noise.process.agility);
    let total: usize = knots.iter().map(|k| k.count).sum();
    let mut sums: Vec<Vec<(f64, Vec<f64>)>> = Vec::with_capacity(NAMES.len());
    let mut weights = vec![[0.0; NAMES.len()]; total];
    let mut first = 0;
    for (rows, knots) in record.drives().zip(knots) {
        let mut along = FilterPass::new(record, rows, &scales, models, noise, &[]);
        let mut at = RowLinearization::default();
        while along.row(&mut at) {
            if !at.goes_on {
                break;
            }
            let m = &at.leaving;
            let row = Row {
                speed: m.speed_m_s,
                yaw_rate: m.yaw_rate_rad_s,
                acceleration: m.acceleration_m_s2,
                yaw_acceleration: m.yaw_acceleration_rad_s2,
                heading: m.heading_rad.sin_cos(),
                torques: record.torques(at.row),
                ..Row::default()
            };
            let temperature_c = record.temperature_c.as_ref().map_or(f64::NAN, |t| t[at.row]);
            let here = of_row(&row, &scales, m.t_s, temperature_c);
            if sums.is_empty() {
                sums = here.iter().map(|(_, f)| vec![(0.0, vec![0.0; f.len()]); total]).collect();
            }
            let before = ((m.t_s / knots.step_s) as usize).min(knots.count - 1);
            for k in before..(before + 2).min(knots.count) {
                let weight = hat(m.t_s - k as f64 * knots.step_s, knots.step_s);
                for (c, (value, functions)) in here.iter().enumerate().filter(|(_, (value, _))| value.is_finite()) {
                    let sum = &mut sums[c][first + k];
                    sum.0 += weight * value;
                    sum.1.iter_mut().zip(functions).for_each(|(s, f)| *s += weight * f);
                    weights[first + k][c] += weight;
                }
            }
        }
        first += knots.count;
    }
    let known = |c: usize| {
        let there = !TORQUES.contains(&c) || record.torques_n_m.is_some();
        there && weights.iter().any(|w| w[c] > 0.0)
    };
    // in a pause longer than the distance of knots: the value at the knot before
    let mean = |of: &dyn Fn(usize) -> f64, c: usize| -> Vec<f64> {
        let mut last = (0..total).find(|k| weights[*k][c] > 0.0).map_or(0.0, |k| of(k) / weights[k][c]);
        let mut at = |k: usize| {
            if weights[k][c] > 0.0 {
                last = of(k) / weights[k][c];
            }
            last
        };
        (0..total).map(&mut at).collect()
    };
    let one = |(c, sums): (usize, Vec<(f64, Vec<f64>)>)| {
        let (name, unit) = NAMES[c];
        let count = sums.first().map_or(0, |s| s.1.len());
        let function = |f: usize| mean(&|k| sums[k].1[f], c);
        let functions: Vec<Vec<f64>> = (0..count).map(function).collect();
        let values = match c {
            // cosine and sine
            HEADING => functions[0].iter().zip(&functions[1]).map(|(cos, sin)| sin.atan2(*cos)).collect(),
            _ => mean(&|k| sums[k].0, c),
        };
        Covariate { name, unit, values, functions }
    };
    sums.into_iter().enumerate().filter(|(c, _)| known(*c)).map(one).collect()
}
