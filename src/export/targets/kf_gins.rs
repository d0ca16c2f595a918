//! KF-GINS `imunoise`: arw = N in °/√h, gbstd = σ in °/h, corrtime = τ in h; initgyrbias = C1 + C2 in °/h
//!
//! Continuous: `GIEngine::insPropagation` (src/kf-gins/gi_engine.cpp) builds the spectral density arw² for the rate and
//! 2 gbstd²/corrtime for a first-order Gauss-Markov bias; `loadConfig` (src/kf_gins.cpp) converts from degrees and hours.

use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};
use crate::units::{RAD_S_PER_DEG_H, RAD_SQRT_S_PER_DEG_SQRT_H};

static ABOUT: About = About {
    id: "kf-gins",
    program: "KF-GINS, loosely coupled GNSS/INS",
    file: "kf-gins.yaml",
    keys: &[
        Key {
            name: "initgyrbias",
            unit: "deg/h",
            meaning: "C1 + C2, the bias of the warm gyro, without the Earth's rotation",
        },
        Key { name: "arw", unit: "deg/sqrt(h), continuous", meaning: "angle random walk N" },
        Key { name: "gbstd", unit: "deg/h", meaning: "stationary standard deviation of the Gauss-Markov bias" },
        Key {
            name: "corrtime",
            unit: "h",
            meaning: "correlation time of the Gauss-Markov bias (of all IMU errors there)",
        },
    ],
    needs: "N, C1, C2; a Gauss-Markov term for gbstd and corrtime; the lines go into your kf-gins.yaml",
    convention: "continuous: spectral densities arw^2 and 2 gbstd^2 / corrtime; degrees and hours",
    source: "github.com/i2Nav-WHU/KF-GINS: src/kf_gins.cpp (loadConfig), src/kf-gins/gi_engine.cpp",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct KfGins;

impl Target for KfGins {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let axis = source.axis().0 as usize;
        sheet.note(
            "KF-GINS counts forward, right, down: turn the sign of initgyrbias where the log's axis points the other way",
        );
        sheet.note(source.earth_text("initgyrbias", "KF-GINS"));
        let bias = source.warm_bias_without_earth().times(1.0 / RAD_S_PER_DEG_H);
        sheet.put("initgyrbias", bias, Shape::OnAxis(axis), |v| format!("initgyrbias: [{v}]"));
        sheet.line("imunoise:");
        sheet.indent("  ");
        let density = source.angle_random_walk()?.times(1.0 / RAD_SQRT_S_PER_DEG_SQRT_H);
        sheet.put("arw", density, Shape::Alike, |v| format!("arw: [{v}]"));
        match source.gauss_markov() {
            Some(markov) => {
                let std = markov.std_rad_s.times(1.0 / RAD_S_PER_DEG_H);
                sheet.put("gbstd", std, Shape::Alike, |v| format!("gbstd: [{v}]"));
                let time = markov.correlation_time_s.times(1.0 / 3600.0);
                sheet.put("corrtime", time, Shape::Scalar, |v| format!("corrtime: {v}"));
            }
            None => sheet.leave_out(
                "gbstd, corrtime",
                "no Gauss-Markov term was identified, and KF-GINS has no other model of a bias that moves",
                "run gyroid noise LOG --write CONFIG on a log of hours, or keep the numbers of your own kf-gins.yaml",
            ),
        }
        sheet.leave_out_accelerometer("vrw, abstd, asstd");
        let hint = "take it from the datasheet";
        sheet.leave_out("gsstd", "a gyro at rest says nothing of its scale factor", hint);
        Ok(())
    }
}
