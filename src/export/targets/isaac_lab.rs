//! Isaac Lab: GaussianNoiseCfg(std = N √f) a step, and a bias drawn at each reset with the turn-on spread
//!
//! Discrete: `gaussian_noise` (isaaclab/utils/noise/noise_model.py) adds std at each observation, whose rate f is the
//! environment's (simulation step times decimation). `NoiseModelWithAdditiveBias.reset` applies the bias' noise to the bias
//! that is there: with operation "add" it would grow from reset to reset, so that it must be "abs".

use super::super::number::Known;
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::Target;
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

static ABOUT: About = About {
    id: "isaac-lab",
    program: "Isaac Lab, noise of an observation, as a Python module",
    file: "gyro_noise.py",
    keys: &[
        Key { name: "noise_cfg.std", unit: "rad/s, discrete", meaning: "N sqrt(f): white noise of an observation" },
        Key {
            name: "bias_noise_cfg.std",
            unit: "rad/s",
            meaning: "spread of the bias from one power-on (reset) to the next",
        },
    ],
    needs: "N and the rate of the observations (--rate: simulation step times decimation); turn_on_bias_std_rad_s for the bias",
    convention: "discrete: the noise of one observation; the bias is drawn at each reset and stays",
    source: "isaac-sim.github.io/IsaacLab: isaaclab.utils.noise; source/isaaclab/isaaclab/utils/noise/noise_model.py",
    warm_up: "the noise of Isaac Lab has no warm-up: what is simulated is the gyro after e(t) was subtracted",
    comment: Comment::Hash,
};

pub(super) struct IsaacLab;

impl Target for IsaacLab {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let rate = source.rate_hz()?;
        let white = source.angle_random_walk()?.times(rate.sqrt());
        let turn_on = source.turn_on();
        sheet.note(format!(
            "{}: the rate at which the environment observes, 1 / (sim.dt decimation)",
            source.rate_text()?
        ));
        sheet.note("Isaac Lab's noise has no walk: K is not in this file");
        let model = if turn_on.is_some() { "NoiseModelWithAdditiveBiasCfg" } else { "NoiseModelCfg" };
        sheet.line(&format!("from isaaclab.utils.noise import GaussianNoiseCfg, {model}"));
        sheet.line("");
        sheet.line(&format!("GYRO_NOISE = {model}("));
        sheet.indent("    ");
        sheet.put("noise_cfg.std", white, Shape::Scalar, |v| {
            format!("noise_cfg=GaussianNoiseCfg(mean=0.0, std={v}, operation=\"add\"),")
        });
        match turn_on {
            // "abs": the bias is drawn anew, not added to the last one
            Some(std) => sheet.put("bias_noise_cfg.std", Known::exact(std), Shape::Scalar, |v| {
                format!("bias_noise_cfg=GaussianNoiseCfg(mean=0.0, std={v}, operation=\"abs\"),")
            }),
            None => sheet.leave_out(
                "bias_noise_cfg.std",
                "one log knows one power-on",
                "run gyroid fit LOGS... --config FILE on several power-ons, which writes turn_on_bias_std_rad_s",
            ),
        }
        sheet.indent("");
        sheet.line(")");
        Ok(())
    }
}
