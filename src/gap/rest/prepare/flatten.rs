//! Removal of the low-pass and noise bands that `[gyro.noise]` states: they are nominal, and taken out before the
//! diagnosis
//!
//! Each cosine coefficient of the deviation from the nominal warm-up is divided by √(|H(ω)|² + bands/(N²/Δt)). A
//! recording with exactly the stated low-pass and bands then has white noise of the plateau's level, which the nominal
//! simulator is compared with. Wide bands reach down to zero frequency: a slow effect appears smaller by the factor of
//! the bands there. Quantization of the output does not survive, and is not looked for.

use crate::config::Noise;
use crate::model::Scene;

/// Takes the stated low-pass and bands out of `rate_rad_s`, one reading per row of `scene`; returns a note, none where
/// nothing is stated.
pub(crate) fn flatten(noise: Option<&Noise>, scene: &Scene, rate_rad_s: &mut Vec<f64>) -> Option<String> {
    let colour = noise.map(Noise::colour).filter(|colour| !colour.is_white())?;
    let nominal: Vec<f64> = (0..scene.len()).map(|i| scene.warm_up.error_rad_s(scene.time.at(i))).collect();
    rate_rad_s.iter_mut().zip(&nominal).for_each(|(rate, e)| *rate -= e);
    colour.take_out(scene.white_std_rad_s, scene.step_s, rate_rad_s);
    rate_rad_s.iter_mut().zip(&nominal).for_each(|(rate, e)| *rate += e);
    Some(
        "The low-pass and the bands that the configuration states were taken out of the readings before they were judged; a \
         quantization of the output is not looked for then."
            .into(),
    )
}
