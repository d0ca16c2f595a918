//! b(t) = ± D/2: a two-state Markov chain in continuous time, mean dwell times τ₁ (upper) and τ₂ (lower)
//!
//! `mean_dwell_s` = (τ₁ + τ₂)/2, `dwell_ratio` = τ₁/τ₂. With a = 1/τ₂, b = 1/τ₁ the chain is at the upper level with
//! probability p = a/(a + b), and after Δt with p + (1 - p) exp(-(a + b) Δt) from the upper, p - p exp(-(a + b) Δt) from the
//! lower level: exact for any Δt.

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::Explanation;
use super::parts::{Bias, Checked, RATE_BOUND_RAD_S, TIME_BOUNDS_S, step_s, stream};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene, Switch, Way};

const SPACING: &str = "level_spacing_rad_s";
const DWELL: &str = "mean_dwell_s";
const RATIO: &str = "dwell_ratio";

static ABOUT: About = About {
    id: "gyro.telegraph_noise",
    title: "telegraph noise",
    equation: "b(t) = ± D/2: the bias flips between two levels at random times (popcorn noise)",
    source: "Kirton and Uren, Adv. Phys. 38 (1989) 367; Machlup, J. Appl. Phys. 25 (1954) 341",
    channel: "gyro",
    deficient: "gyro bias: it flips between two levels",
    condition: None,
    parameters: &[
        Parameter {
            name: SPACING,
            meaning: "D, distance of the levels, rad/s",
            bounds: [0.0, RATE_BOUND_RAD_S],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: DWELL,
            meaning: "mean time at a level, over both, s",
            bounds: TIME_BOUNDS_S,
            null: None,
            required: true,
        },
        Parameter {
            name: RATIO,
            meaning: "mean time at the upper level over that at the lower; 1 where it is not stated",
            bounds: [1e-4, 1e4],
            null: None,
            required: false,
        },
    ],
    remedy: "Exchange the sensor: a defect of the chip causes it; else track the two levels with a switching filter.",
};

/// The bias flips between two levels.
pub(super) struct TelegraphNoise;

impl Effect for TelegraphNoise {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        let levels = [("level_spacing_rad_s", 1e-3), ("mean_dwell_s", 0.5)];
        Tried::size(&levels).drawn(&levels)
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some("a recording with ten times as many jumps, or a histogram of the smoothed rate")
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (spacing, dwell_s) = (checked.value(SPACING)?, checked.value(DWELL)?);
        let ratio = checked.optional(RATIO).unwrap_or(1.0);
        let upper = ratio / (1.0 + ratio);
        // τ₁ = 2 τ p and τ₂ = 2 τ (1 - p), so a + b = 1/(2 τ p (1 - p))
        let rate_per_s = 1.0 / (2.0 * dwell_s * upper * (1.0 - upper));
        let level = |offset| Way { offset, ..Way::PLAIN };
        let ways = [level(-0.5 * spacing), level(0.5 * spacing)];
        let in_filter = GyroInFilter::Switching(Switch { ways, share: upper, rate_per_s, start: upper });
        let mut draw = stream(&ABOUT, seed);
        let mut high = false;
        Ok(Box::new(Bias(
            move |row, scene: &Scene| {
                let stays = if row == 0 { 0.0 } else { (-rate_per_s * step_s(scene, row)).exp() };
                let towards = if high { 1.0 } else { 0.0 };
                high = draw.uniform() < upper + (towards - upper) * stays;
                if high { 0.5 * spacing } else { -0.5 * spacing }
            },
            in_filter,
        )))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::TwoLevels)
    }
}
