//! Changes of the exported numbers by `[[effect]]` tables, and effects that no target has a key for.
//!
//! The level of the white noise multiplies N, another warm-up takes the nominal one's place, a shifted turn-on adds to C2; the
//! sensor's low-pass, its vibrations and its lattice stand where `[gyro.noise]` has them.

use crate::config::{EffectTable, Gyro, NarrowBand, Noise, OWN};

/// `gyro` as changed by `effects`, and the id of each effect that changed it, with a sentence on the change.
pub(super) fn folded(gyro: &Gyro, effects: &[EffectTable]) -> (Gyro, Vec<(String, String)>) {
    let mut out = gyro.clone();
    let notes = effects.iter().filter_map(|effect| {
        let note = fold(&mut out, effect)?;
        Some((effect.id.clone(), format!("[[effect]] {}: {note}", effect.id)))
    });
    let notes = notes.collect();
    (out, notes)
}

/// Sentences about the effects `ids`, which the file has no number for.
pub(super) fn left_out<'a>(ids: impl Iterator<Item = &'a str>) -> Vec<String> {
    let (own, listed): (Vec<&str>, Vec<&str>) = ids.partition(|id| id.starts_with(OWN));
    let (of_gyro, of_robot) = listed.into_iter().partition(|id| id.starts_with("gyro."));
    let why = [
        (of_gyro, "no number of this file stands for it"),
        (of_robot, "of the robot, not of its gyro"),
        (own, "an effect of your own, which this file has no place for"),
    ];
    let there = why.into_iter().filter(|(ids, _)| !ids.is_empty());
    there.map(|(ids, why)| format!("[[effect]] {} left out: {why}", ids.join(", "))).collect()
}

/// Applies an effect where `[gyro]` has a key for it, and describes the change; `None` where it has none.
fn fold(gyro: &mut Gyro, effect: &EffectTable) -> Option<String> {
    let value = |name: &str| effect.parameters.get(name).copied();
    match effect.id.as_str() {
        "gyro.noise_level" => {
            let over = value("noise_over_nominal")?;
            gyro.angle_random_walk_rad_sqrt_s *= over;
            Some(format!("N is {over:.4} times that of [gyro]"))
        }
        "gyro.warm_up" => {
            (gyro.c1_rad_s, gyro.time_constant_s) = (value("c1_rad_s")?, value("time_constant_s")?);
            (gyro.covariance, gyro.discrete) = (None, None);
            Some("C1 and T are its, not those of [gyro]".into())
        }
        "gyro.turn_on_shift" => {
            let shift = value("shift_rad_s")?;
            gyro.c2_rad_s += shift;
            gyro.discrete = None;
            Some(format!("C2 is {shift:.4e} rad/s above that of [gyro]"))
        }
        "gyro.bandwidth" => {
            noise(gyro).bandwidth_cutoff_hz = Some(value("cutoff_hz")?);
            Some("N is that of the plateau below its low-pass".into())
        }
        "gyro.narrow_band_noise" => {
            let band = NarrowBand {
                center_hz: value("center_hz")?,
                bandwidth_hz: value("bandwidth_hz")?,
                std_rad_s: value("std_rad_s")?,
                form: None,
                center_ci95_hz: None,
                bandwidth_ci95_hz: None,
                std_ci95_rad_s: None,
            };
            noise(gyro).narrow_band.push(band);
            Some("N is without it".into())
        }
        "gyro.quantization" => {
            noise(gyro).quantization_lsb_rad_s = Some(value("lsb_rad_s")?);
            Some("its step is the quantization step, where the file has one".into())
        }
        _ => None,
    }
}

fn noise(gyro: &mut Gyro) -> &mut Noise {
    gyro.noise.get_or_insert_with(Noise::default)
}
