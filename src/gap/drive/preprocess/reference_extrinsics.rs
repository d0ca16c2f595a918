//! pose(t) = (x, y) + R(θ) l, θ + δ, all at t - τ;
//! so (x, y)(t) = pose(t) - R(θ) l + τ R(θ) (v, 0), θ = pose θ - δ + τ ω
//!
//! Mounting of a reference on the robot: the tracked point is l ahead and to the left of the middle of the axle, the
//! tracked heading is δ off, and all comes τ late. Where the configuration states only a standard deviation of this, it
//! is fitted beside the effects and removed from the recording before the comparison: it is a property of the
//! reference, not of the robot. The remainder stays among the nuisances. The filter is linear in l, δ and τ only while
//! they are small against its noise, so they are removed in steps, each linearised anew.

use crate::effects::drive::Driving;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::{Compared, models};
use crate::gap::drive::record::Record;
use crate::gap::drive::record::reckoning::driven;
use crate::gap::drive::regressors::basis::{MOUNTING, nuisances};
use crate::gap::drive::regressors::candidates::Candidates;
use crate::gap::selection::prior::Prior;
use crate::model::drive::Robot;

/// Most steps.
const STEPS: usize = 8;
/// Remainder that counts as settled, in its standard deviations.
const SETTLED: f64 = 0.2;

/// Offsets of the tracked point and of its heading, and delay of the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mounting {
    /// Ahead and to the left of the middle of the axle, m; heading, to the left, rad; delay, s.
    pub offset: [f64; 4],
    /// Standard deviations of the same; zero for offsets that are stated.
    pub std: [f64; 4],
    /// The robot as fitted at the same time: its wheels tell the distance driven during the delay.
    robot: Robot,
}

impl Mounting {
    /// `record` as it would read if the middle of the axle had been tracked, without delay.
    #[must_use]
    pub(crate) fn taken_out(&self, record: &Record) -> Record {
        record.by_drive(|_, drive| self.taken_out_of(drive))
    }

    fn taken_out_of(&self, record: &Record) -> Record {
        let mut out = record.clone();
        let [ahead, left, turned, late_s] = self.offset;
        let speeds = driven(record, &self.robot);
        if let Some([x, y, heading]) = &mut out.pose {
            let mut middle = 0;
            for (k, ((x, y), heading)) in x.iter_mut().zip(y).zip(heading).enumerate() {
                // half way between when it was true and now
                let middle_s = record.times_s[k] - 0.5 * late_s;
                while middle + 1 < k.max(1) && record.times_s[middle + 1] <= middle_s {
                    middle += 1;
                }
                let [v, w] = between(&record.times_s, &speeds, middle, middle_s);
                *heading -= turned;
                let (sin, cos) = heading.sin_cos();
                *x -= ahead * cos - left * sin;
                *y -= ahead * sin + left * cos;
                let (sin, cos) = (*heading + 0.5 * late_s * w).sin_cos();
                *x += late_s * v * cos;
                *y += late_s * v * sin;
                *heading += late_s * w;
            }
        }
        out
    }

    /// Note on the mounting.
    #[must_use]
    pub(crate) fn said(&self) -> String {
        let value = |i: usize, unit: f64| format!("{:.2} ± {:.2}", unit * self.offset[i], unit * self.std[i]);
        let parts = [
            (0, 1e3, "mm ahead of the axle's middle"),
            (1, 1e3, "mm to its left"),
            (2, 1f64.to_degrees(), "° to the left of the robot's heading"),
            (3, 1e3, "ms late"),
        ];
        let known = parts.iter().filter(|(i, ..)| self.std[*i] > 0.0);
        let said: Vec<String> = known.map(|(i, unit, words)| format!("{} {words}", value(*i, *unit))).collect();
        format!("The reference reads {}: taken out before anything was judged.", said.join(", "))
    }
}

/// The speeds at `t_s`, linear between row `k` and the next.
fn between(times_s: &[f64], speeds: &[[f64; 2]], k: usize, t_s: f64) -> [f64; 2] {
    let next = (k + 1).min(speeds.len() - 1);
    let span_s = times_s[next] - times_s[k];
    let u = if span_s > 0.0 { ((t_s - times_s[k]) / span_s).clamp(0.0, 1.0) } else { 0.0 };
    std::array::from_fn(|i| speeds[k][i] + u * (speeds[next][i] - speeds[k][i]))
}

/// Whether the configuration leaves the mounting of the reference of `record` open.
#[must_use]
pub(crate) fn is_open(record: &Record) -> bool {
    // a lever arm turns with a heading
    let reads = |i: usize| record.pose.as_ref().map_or(0, |p| p[i].iter().filter(|v| v.is_finite()).count());
    2 * reads(2) > reads(0) && nuisances(record).iter().any(|(one, _)| MOUNTING.contains(&one.column))
}

/// Estimated mounting of the reference of `record`; none where it is stated.
#[must_use]
pub(crate) fn find(
    record: &Record,
    noise: &Noise,
    effects: &[&'static dyn Driving],
    prior: &Prior,
) -> Option<Mounting> {
    let candidates = Candidates::new(record, effects, prior, false, &[]);
    let place = |i: usize| {
        let is = |c: &usize| candidates.columns[*c] == MOUNTING[i].into();
        candidates.nuisance.iter().map(|n| n.column).find(is)
    };
    let places = [0, 1, 2, 3].map(place);
    if places.iter().all(Option::is_none) {
        return None;
    }
    let mut mounting = Mounting { offset: [0.0; 4], std: [0.0; 4], robot: record.belief.robot };
    let mut theta = candidates.zero();
    for _ in 0..STEPS {
        let here = mounting.taken_out(record);
        let compared = Compared::narrow(&here, noise, candidates.clone(), theta, None);
        let coefficients = compared.problem.coefficients(&compared.sets[0].fitted);
        let mut settled = true;
        for (i, place) in places.iter().enumerate() {
            let Some((_, left, std)) = coefficients.iter().find(|c| Some(c.0) == *place) else { continue };
            mounting.offset[i] += left;
            mounting.std[i] = *std;
            settled &= left.abs() <= SETTLED * std;
        }
        theta = compared.next().0;
        mounting.robot = models(record, &candidates.change_list(), &theta, false).here.robot;
        if settled {
            break;
        }
    }
    Some(mounting)
}
