//! e(t) = C1' (1 - exp(-(t/T')^β)) + C2: the unit's warm-up is another than the simulator's

use super::draw::{between, chance, log_between, sign};
use super::effect::Effect;
use super::label::{Parameters, Place};
use super::nats;
use super::run::{Run, Unit};
use crate::math::random::Stream;

/// Least |ln| of the ratio of the real time constant to that with which the body heats.
const APART: f64 = 0.4;

/// Share of simulators that state no warm-up.
pub(super) const UNSTATED: f64 = 0.3;

enum Form {
    /// C1' = C1 (1 + size a), T' = T (1 + |time| a) to the power of time's sign; a is the strength.
    Other { size: f64, time: f64 },
    /// The simulator has none: C1' = sign a, a in rad/s, and T', s.
    Unstated { sign: f64, time_constant_s: f64 },
}

/// Another warm-up. The deviation of a run within the stated repeatability applies to it too.
pub(super) struct WarmUp {
    form: Form,
    stretch: f64,
}

impl WarmUp {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        // all draws whatever the form: it stays the same when the unit's C1 has become zero
        let (unstated, kind, side, stretch) = (chance(s, UNSTATED), s.uniform(), sign(s), between(s, 0.94, 1.06));
        let (size, time) = (between(s, 0.4, 1.0), between(s, 0.3, 1.0));
        let wanted_s = unit.time_constant_s * log_between(s, 0.4, 1.6);
        let form = if unstated || unit.c1_rad_s == 0.0 {
            let apart = (wanted_s / unit.heating_s()).ln();
            let time_constant_s = unit.heating_s() * apart.abs().max(APART).copysign(apart).exp();
            Form::Unstated { sign: side, time_constant_s }
        } else {
            // away from the time with which the body heats: else temperature and warm-up would be the same thing
            let slower = (unit.time_constant_s - unit.heating_s()).signum();
            // a slower warm-up is a smaller one too: else both would cancel
            let (size, time) = match kind {
                k if k < 0.4 => (side, 0.0),
                k if k < 0.8 => (-slower * size, slower * time),
                _ => (-slower * 0.15, slower),
            };
            Form::Other { size, time }
        };
        Self { form, stretch }
    }

    /// Whether the simulator states none.
    pub(crate) fn is_unstated(&self) -> bool {
        matches!(self.form, Form::Unstated { .. })
    }

    /// C1', rad/s, T', s, and β in `run`; `path` holds the run's draw.
    fn real(&self, run: &Run, path: &[f64], strength: f64) -> [f64; 3] {
        match self.form {
            Form::Other { size, time } => {
                let factor = (1.0 + time.abs() * strength).powf(time.signum());
                let stretch = 1.0 + (self.stretch - 1.0) * strength.min(1.0);
                [run.c1_rad_s * (1.0 + size * strength), run.time_constant_s * factor, stretch]
            }
            Form::Unstated { sign, time_constant_s } => {
                let differs = 1.0 + run.unit.relative_std * path.first().copied().unwrap_or(0.0);
                let factor = run.time_constant_s / run.unit.time_constant_s;
                [sign * strength * differs, time_constant_s * factor, self.stretch]
            }
        }
    }

    /// Addition to the run's own warm-up, rad/s, one value a row.
    fn added(&self, run: &Run, path: &[f64], strength: f64) -> Vec<f64> {
        let [c1_rad_s, time_s, stretch] = self.real(run, path, strength);
        let own = |t: f64| if self.is_unstated() { 0.0 } else { run.warm_up_rad_s(t) - run.c2_rad_s };
        run.times_s().map(|t| c1_rad_s * -(-(t / time_s).powf(stretch)).exp_m1() - own(t)).collect()
    }
}

impl Effect for WarmUp {
    fn id(&self) -> &'static str {
        "gyro.warm_up"
    }

    /// One normal draw: deviation of C1' in this run, in standard deviations, where the simulator states no warm-up
    /// that could vary.
    fn path(&self, _: &Run, s: &mut Stream) -> Vec<f64> {
        vec![s.normal()]
    }

    fn add(&self, strength: f64, path: &[f64], run: &Run, reading_rad_s: &mut [f64]) {
        for (y, x) in reading_rad_s.iter_mut().zip(self.added(run, path, strength)) {
            *y += x;
        }
    }

    fn nats(&self, run: &Run, path: &[f64], strength: f64) -> f64 {
        0.5 * nats::signal_energy(run, &self.added(run, path, strength))
    }

    /// Not from the energy of the path: small changes of T are those of a slope, large ones are not.
    fn strength(&self, run: &Run, path: &[f64], target: f64) -> f64 {
        nats::solve(target, self.strengths(run), |strength| self.nats(run, path, strength))
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        if self.is_unstated() { [1e-7, 10.0] } else { [1e-4, 300.0] }
    }

    fn parameters(&self, run: &Run, path: &[f64], strength: f64) -> Parameters {
        let [c1_rad_s, time_constant_s, _] = self.real(run, path, strength);
        [("c1_rad_s".to_string(), c1_rad_s), ("time_constant_s".to_string(), time_constant_s)].into()
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place::following("elapsed_time")
    }
}
