//! Studies that the paper leaves out: friction from ice to dry, wrong traction parameters, and how many runs are
//! enough.

use super::setup::{Estimator, Setup};
use super::statistics::{Comparison, Study};
use super::study;
use crate::config::{Config, Traction};
use crate::error::Result;
use crate::math::NORMAL_975;
use crate::traction::{Burckhardt, Surface, TractionLaw};

/// The study on one ground.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ground {
    /// The ground.
    pub surface: Surface,
    /// Greatest friction coefficient.
    pub peak_friction: f64,
    /// Root mean square of the true slip over wheels and time in the first run.
    pub slip_rms: f64,
    /// The runs on it.
    pub study: Study,
}

/// The study on every ground, the filter knowing which; `progress` hears how many grounds are done.
///
/// # Errors
/// As [`study`].
pub(crate) fn by_ground(setup: &Setup, progress: impl Fn(usize)) -> Result<Vec<Ground>> {
    let mut grounds = Vec::with_capacity(Surface::ALL.len());
    for surface in Surface::ALL {
        let study = study(&setup.on(surface), |_| {})?;
        let slips = study.example.iter().flat_map(|e| e.true_slips.iter().flatten());
        let (sum, count) = slips.fold((0.0, 0.0), |(sum, count), slip| (sum + slip * slip, count + 1.0));
        let peak_friction = TractionLaw::Burckhardt(surface.law()).peak()[1];
        grounds.push(Ground { surface, peak_friction, slip_rms: f64::sqrt(sum / count), study });
        progress(grounds.len());
    }
    Ok(grounds)
}

/// The study with a filter whose traction parameters are wrong by these factors.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Belief {
    /// Believed friction over true friction.
    pub friction_factor: f64,
    /// Believed stiffness dμ/dλ at zero slip over the true one.
    pub stiffness_factor: f64,
    /// The filter with slip against that without, which uses no traction parameters.
    pub against_rolling: Comparison,
    /// Root mean squares of the filter with slip: x, y (m), heading (rad).
    pub rms: [f64; 3],
    /// Mean NIS of the filter with slip.
    pub nis_mean: f64,
}

/// Factors on the filter's traction parameters.
pub(crate) const FACTORS: [f64; 7] = [0.5, 0.8, 0.9, 1.0, 1.1, 1.25, 2.0];

/// The study with wrong traction parameters in the filter: friction first, then stiffness, each by [`FACTORS`].
///
/// Burckhardt's law with friction f and stiffness k times the true: c1 f, c3 f, c2 k/f. Other laws are scaled in friction
/// and stiffness likewise.
///
/// # Errors
/// As [`study`].
pub(crate) fn wrong_beliefs(setup: &Setup, progress: impl Fn(usize)) -> Result<Vec<Belief>> {
    let friction = FACTORS.iter().map(|f| (*f, 1.0));
    let stiffness = FACTORS.iter().map(|k| (1.0, *k));
    let mut beliefs = Vec::new();
    for (friction_factor, stiffness_factor) in friction.chain(stiffness) {
        let mut setup = Setup { estimators: Estimator::FILTERS.to_vec(), ..setup.clone() };
        believe(&mut setup.believed, friction_factor, stiffness_factor);
        let study = study(&setup, |_| {})?;
        if let (Some(slip), Some(against_rolling)) =
            (study.of(Estimator::Slip), study.compare(Estimator::Slip, Estimator::Rolling))
        {
            let nis_mean = slip.nis_mean.unwrap_or(f64::NAN);
            beliefs.push(Belief { friction_factor, stiffness_factor, against_rolling, rms: slip.rms, nis_mean });
        }
        progress(beliefs.len());
    }
    Ok(beliefs)
}

fn believe(config: &mut Config, friction: f64, stiffness: f64) {
    config.traction = config.traction.map(|t| Traction { law: scaled(t.law, friction, stiffness), ..t });
}

/// The law with friction and initial stiffness multiplied.
fn scaled(law: TractionLaw, friction: f64, stiffness: f64) -> TractionLaw {
    match law {
        // stiffness c1 c2 - c3: all but the second term, which is a part in fifty at most
        TractionLaw::Burckhardt(l) => TractionLaw::Burckhardt(Burckhardt {
            c1: l.c1 * friction,
            c2: l.c2 * stiffness / friction,
            c3: l.c3 * friction,
        }),
        TractionLaw::Pacejka(mut l) => {
            l.d *= friction;
            l.b *= stiffness / friction;
            TractionLaw::Pacejka(l)
        }
        TractionLaw::Dugoff(mut l) => {
            l.friction *= friction;
            l.stiffness *= stiffness;
            TractionLaw::Dugoff(l)
        }
        TractionLaw::Linear(mut l) => {
            l.friction *= friction;
            l.stiffness *= stiffness;
            TractionLaw::Linear(l)
        }
    }
}

/// Root mean squares over the first so many runs, with their intervals.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RunCount {
    /// Number of runs.
    pub runs: usize,
    /// x, y (m), heading (rad).
    pub rms: [f64; 3],
    /// Their 95 % intervals.
    pub rms_ci95: [[f64; 2]; 3],
}

/// How an estimator's RMS settles with the number of runs: 10, 20, 50, 100 … of those that the study has.
#[must_use]
pub(crate) fn convergence(study: &Study, estimator: Estimator) -> Vec<RunCount> {
    let Some(result) = study.of(estimator) else { return Vec::new() };
    let counts = (1..).flat_map(|decade| [1, 2, 5].map(|m| m * 10usize.pow(decade)));
    let counts = counts.take_while(|n| *n < study.runs).chain([study.runs]);
    counts
        .map(|runs| {
            let squares = |i: usize| result.run_rms[..runs].iter().map(move |r| r[i] * r[i]);
            let rms: [f64; 3] = std::array::from_fn(|i| (squares(i).sum::<f64>() / runs as f64).sqrt());
            let rms_ci95 = std::array::from_fn(|i| {
                let spread = super::statistics::spread_of_log_mean(squares(i));
                [-0.5, 0.5].map(|half| rms[i] * (half * NORMAL_975 * spread).exp())
            });
            RunCount { runs, rms, rms_ci95 }
        })
        .collect()
}
