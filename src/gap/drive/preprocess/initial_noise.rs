//! R, Q before any effect is known; without torques, Q beside the effect that explains most alone

use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::begin::ALONE;
use crate::gap::drive::fit::models_at;
use crate::gap::drive::preprocess::acceleration_model;
use crate::gap::drive::preprocess::torque_bandwidth;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::{Candidates, Kind};
use crate::gap::drive::screening::best_single_effect::alone;

/// Noise and motion beyond the model, before any effect is known.
pub(crate) struct InitialNoise {
    /// Quantization step of the wheels, rad/s; none: not quantized.
    pub(crate) lsb: Option<f64>,
    /// Noise, quantization included.
    pub(crate) noise: Noise,
    /// Noise that the nominal filter assumes: without quantization.
    pub(crate) nominal: Noise,
}

impl InitialNoise {
    pub(crate) fn of(record: &Record) -> Self {
        let lsb = record.wheel_lsb_rad_s();
        let mut noise = Noise { wheel_lsb_rad_s: lsb.unwrap_or(0.0), ..Noise::believed(record, lsb) };
        if record.torques_n_m.is_none() {
            noise = acceleration_model::likely(record, &Models::plain(record), &noise);
        }
        let noise = torque_bandwidth::before(record, &noise);
        let nominal = noise.without_lattice(record);
        Self { lsb, noise, nominal }
    }
}

/// [`diffused`] for a drive whose readings were moved: without torques the motion, which the late readings told, is
/// estimated anew.
pub(crate) fn rediffused(moved: &Record, believed: &Noise, all: &Candidates) -> (Noise, Option<Models>) {
    let noise = match moved.torques_n_m {
        Some(_) => *believed,
        None => acceleration_model::likely(moved, &Models::plain(moved), believed),
    };
    diffused(moved, noise, all)
}

/// Without torques: the noise with the diffusion estimated beside the effect that explains most alone, and the model
/// with that effect; none if none explains anything. Otherwise a gap would add to the diffusion, and the gyro's gain,
/// which scales all yaw rates, would make up for that; where a pose contradicts, with the help of free forms.
pub(crate) fn diffused(record: &Record, noise: Noise, all: &Candidates) -> (Noise, Option<Models>) {
    if record.torques_n_m.is_some() {
        return (noise, None);
    }
    let named = all.only(|g| matches!(all.kinds[g], Kind::Change(_)));
    let zero = named.linearise(record, &noise, &named.zero());
    let nothing = zero.ln_weight(&[]);
    let fits = alone(record, &noise, &named, &zero, ALONE);
    match fits.into_iter().max_by(|a, b| a.top().total_cmp(&b.top())) {
        Some(best) if best.top() > nothing => {
            let models = models_at(record, &best.candidates, &best.next().0);
            (acceleration_model::likely(record, &models, &noise), Some(models))
        }
        _ => (noise, None),
    }
}
