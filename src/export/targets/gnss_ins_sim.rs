//! gnss-ins-sim: gyro_b = C1 + C2 in °/h, gyro_arw = N in °/√h, gyro_b_stability = σ in °/h, gyro_b_corr = τ in s
//!
//! Continuous: `gyro_gen` (gnss_ins_sim/pathgen/pathgen.py) adds gyro_b, white noise of arw/√dt and a first-order
//! Gauss-Markov bias of correlation time gyro_b_corr; without a correlation time it draws gyro_b_stability anew for each
//! sample, which is no drift at all. `IMU` (gnss_ins_sim/sim/imu_model.py) converts from degrees and hours.

use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::Target;
use crate::error::Result;
use crate::export::about::{About, Comment, Key};
use crate::units::{RAD_S_PER_DEG_H, RAD_SQRT_S_PER_DEG_SQRT_H};

static ABOUT: About = About {
    id: "gnss-ins-sim",
    program: "gnss-ins-sim, simulation of GNSS and INS, as a Python module",
    file: "gyro_err.py",
    keys: &[
        Key {
            name: "gyro_b",
            unit: "deg/h",
            meaning: "C1 + C2, the bias of the warm gyro, without the Earth's rotation",
        },
        Key { name: "gyro_arw", unit: "deg/sqrt(h), continuous", meaning: "angle random walk N" },
        Key {
            name: "gyro_b_stability",
            unit: "deg/h",
            meaning: "stationary standard deviation of the Gauss-Markov bias",
        },
        Key { name: "gyro_b_corr", unit: "s", meaning: "correlation time of the Gauss-Markov bias" },
    ],
    needs: "N, C1, C2; a Gauss-Markov term for the drift, without which IMU() asks for gyro_b_stability from you",
    convention: "continuous: white noise of gyro_arw / sqrt(dt) a sample; degrees and hours",
    source: "github.com/Aceinna/gnss-ins-sim: gnss_ins_sim/sim/imu_model.py, pathgen/pathgen.py",
    warm_up: "gnss-ins-sim has no warm-up: gyro_b is its end, reached after some three time constants",
    comment: Comment::Hash,
};

pub(super) struct GnssInsSim;

impl Target for GnssInsSim {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let axis = source.axis().0 as usize;
        sheet.note(
            "the body axes are forward, right, down: turn the sign of gyro_b where the log's axis points the other way",
        );
        sheet.line("import numpy as np");
        sheet.line("");
        sheet.line("imu_err = {");
        sheet.indent("    ");
        let entry = |name: &'static str| move |v: &str| format!("\"{name}\": np.array([{v}]),");
        sheet.note(source.earth_text("gyro_b", "gnss-ins-sim (in its frame NED, ref_frame 0)"));
        let bias = source.warm_bias_without_earth().times(1.0 / RAD_S_PER_DEG_H);
        sheet.put("gyro_b", bias, Shape::OnAxis(axis), entry("gyro_b"));
        let density = source.angle_random_walk()?.times(1.0 / RAD_SQRT_S_PER_DEG_SQRT_H);
        sheet.put("gyro_arw", density, Shape::Alike, entry("gyro_arw"));
        match source.gauss_markov() {
            Some(markov) => {
                let std = markov.std_rad_s.times(1.0 / RAD_S_PER_DEG_H);
                sheet.note(
                    "releases whose bias_drift() drives the bias with drift/fs instead of drift sqrt(1 - exp(-2 / (fs \
                     corr))) wander less than gyro_b_stability says",
                );
                sheet.put("gyro_b_stability", std, Shape::Alike, entry("gyro_b_stability"));
                sheet.put("gyro_b_corr", markov.correlation_time_s, Shape::Alike, entry("gyro_b_corr"));
            }
            None => sheet.leave_out(
                "gyro_b_stability, gyro_b_corr",
                "no Gauss-Markov term was identified",
                "run gyroid noise LOG --write CONFIG on a log of hours, or state np.zeros(3) where a gyro without drift will do",
            ),
        }
        sheet.leave_out_accelerometer("accel_b, accel_vrw, accel_b_stability");
        sheet.indent("");
        sheet.line("}");
        Ok(())
    }
}
