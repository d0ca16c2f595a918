//! What `[gyro.noise]` states of the spectrum near the sample rate is nominal: it is taken out before anything is judged
//!
//! Each cosine coefficient of the readings is divided by √(|H(ω)|² + bands/(N²/Δt)): a recording with exactly the stated
//! low-pass and bands then has the white noise of the plateau, which is what the nominal simulator is compared with. At zero
//! frequency the divisor is that of the bands' feet, one within rounding: what is slow stays as it is. A lattice of the
//! output does not survive, and is not looked for.

use crate::config::Noise;
use crate::math::dct::Cosine;
use crate::model::Scene;
use crate::noise::BandForm;
use std::f64::consts::PI;

/// Takes the stated low-pass and bands out of `rate_rad_s`, one reading a row of `scene`; a sentence if there were any.
pub fn flatten(noise: Option<&Noise>, scene: &Scene, rate_rad_s: &mut Vec<f64>) -> Option<String> {
    let noise = noise.filter(|n| n.bandwidth_cutoff_hz.is_some() || !n.narrow_band.is_empty())?;
    let (len, step_s) = (rate_rad_s.len(), scene.step_s);
    let omega: Vec<f64> = (0..len).map(|k| PI * k as f64 / len as f64).collect();
    let mut power = match noise.bandwidth_cutoff_hz {
        Some(cutoff) => noise.bandwidth_form.unwrap_or_default().powers(cutoff, step_s, &omega),
        None => vec![1.0; len],
    };
    for band in &noise.narrow_band {
        let size = (band.std_rad_s / scene.white_std_rad_s.max(f64::MIN_POSITIVE)).powi(2);
        let unit = band.form.unwrap_or(BandForm::Resonance).unit(band.center_hz, band.bandwidth_hz, step_s, &omega);
        power.iter_mut().zip(unit).for_each(|(p, u)| *p += size * u);
    }
    let cosine = Cosine::new(len);
    let mut z = cosine.forward(rate_rad_s);
    z.iter_mut().zip(&power).for_each(|(z, p)| *z /= (p / power[0]).sqrt());
    *rate_rad_s = cosine.inverse(&z);
    Some(
        "The low-pass and the bands that the configuration states were taken out of the readings before they were judged; a \
         lattice of the output is not looked for then."
            .into(),
    )
}
