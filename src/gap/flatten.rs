//! What `[gyro.noise]` states of the spectrum near the sample rate is nominal: it is taken out before anything is judged
//!
//! Of what the readings are off the nominal warm-up each cosine coefficient is divided by √(|H(ω)|² + bands/(N²/Δt)): a
//! recording with exactly the stated low-pass and bands then has the white noise of the plateau, which is what the nominal
//! simulator is compared with. The feet of wide bands reach down to zero frequency: what is slow and not nominal gets
//! smaller by that, as it shows less above them. A lattice of the output does not survive, and is not looked for.

use crate::config::Noise;
use crate::model::Scene;

/// Takes the stated low-pass and bands out of `rate_rad_s`, one reading a row of `scene`; a sentence if there were any.
pub fn flatten(noise: Option<&Noise>, scene: &Scene, rate_rad_s: &mut Vec<f64>) -> Option<String> {
    let colour = noise.map(Noise::colour).filter(|colour| !colour.is_white())?;
    let nominal: Vec<f64> = (0..scene.len()).map(|i| scene.warm_up.error_rad_s(scene.time.at(i))).collect();
    rate_rad_s.iter_mut().zip(&nominal).for_each(|(rate, e)| *rate -= e);
    colour.take_out(scene.white_std_rad_s, scene.step_s, rate_rad_s);
    rate_rad_s.iter_mut().zip(&nominal).for_each(|(rate, e)| *rate += e);
    Some(
        "The low-pass and the bands that the configuration states were taken out of the readings before they were judged; a \
         lattice of the output is not looked for then."
            .into(),
    )
}
