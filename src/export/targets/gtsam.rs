//! GTSAM: gyroscopeCovariance = N² I, biasOmegaCovariance = K² I
//!
//! Continuous, and squared: gtsam/navigation/PreintegratedRotation.h and PreintegrationCombinedParams.h call them
//! continuous-time "covariance"; the integrators divide or multiply by the step themselves.

use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

static ABOUT: About = About {
    id: "gtsam",
    program: "GTSAM, factor graphs: parameters of the IMU preintegration, as a Python module",
    file: "gyro_params.py",
    keys: &[
        Key {
            name: "gyroscopeCovariance",
            unit: "(rad/s)^2/Hz = rad^2/s, continuous, on the diagonal",
            meaning: "N^2, the squared angle random walk",
        },
        Key {
            name: "biasOmegaCovariance",
            unit: "(rad/s^2)^2/Hz = rad^2/s^3, continuous, on the diagonal",
            meaning: "K^2, the squared rate random walk",
        },
    ],
    needs: "N; K for biasOmegaCovariance (PreintegrationCombinedParams); the accelerometer's covariances from elsewhere",
    convention: "continuous and squared: the integrator divides the first by the step and multiplies the second by it itself",
    source: "github.com/borglab/gtsam: gtsam/navigation/PreintegrationParams.h, PreintegrationCombinedParams.h",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct Gtsam;

impl Target for Gtsam {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        sheet.line("import numpy as np");
        sheet.line("");
        let density = source.angle_random_walk()?.squared();
        sheet.put("gyroscopeCovariance", density, Shape::Scalar, |v| format!("GYROSCOPE_COVARIANCE = {v}"));
        let walk = source.rate_random_walk().map(|k| k.squared());
        let known = walk.is_some();
        let without = "PreintegrationParams works without it, PreintegrationCombinedParams keeps its default 1";
        sheet.put_walk("biasOmegaCovariance", walk, Shape::Scalar, without, |v| format!("BIAS_OMEGA_COVARIANCE = {v}"));
        sheet.leave_out_accelerometer("accelerometerCovariance, biasAccCovariance");
        sheet.line("");
        sheet.line("");
        sheet.line("def set_gyro(params):");
        sheet.indent("    ");
        let kind = if known { "gtsam.PreintegrationCombinedParams" } else { "gtsam.PreintegrationParams" };
        sheet.line(&format!("\"\"\"Sets the gyro's noise in `params`, a {kind}, and returns it.\"\"\""));
        sheet.line("params.setGyroscopeCovariance(GYROSCOPE_COVARIANCE * np.eye(3))");
        if known {
            sheet.line("params.setBiasOmegaCovariance(BIAS_OMEGA_COVARIANCE * np.eye(3))");
        }
        sheet.line("return params");
        Ok(())
    }
}
