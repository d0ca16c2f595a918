//! VINS-Fusion (and VINS-Mono): gyr_n = N √(2f), gyr_w = K √f
//!
//! Discrete. `midPointIntegration` (vins_estimator/src/factor/integration_base.h) propagates V Q Vᵀ with gyr_n² for each of
//! the two samples of a step, each entering the rotation with dt/2, and gyr_w² entering the bias with dt:
//!
//! ```text
//! rotation: 2 (dt/2)² gyr_n² = N² dt   =>  gyr_n = N √(2/dt) = N √(2f)
//! bias:     dt² gyr_w² = K² dt         =>  gyr_w = K √(1/dt) = K √f
//! ```

use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

static ABOUT: About = About {
    id: "vins-fusion",
    program: "VINS-Fusion and VINS-Mono, visual-inertial state estimation",
    file: "config.yaml",
    keys: &[
        Key {
            name: "gyr_n",
            unit: "rad/s, discrete",
            meaning: "N sqrt(2 f): a sample's noise as the midpoint rule takes it",
        },
        Key {
            name: "gyr_w",
            unit: "rad/s^2, discrete",
            meaning: "K sqrt(f): the bias' step a sample over the sample time",
        },
    ],
    needs: "N and the IMU's rate; K from a log of hours; acc_n and acc_w from elsewhere; the lines go into your config.yaml",
    convention: "discrete: the midpoint rule adds 2 (dt/2)^2 gyr_n^2 to the rotation and dt^2 gyr_w^2 to the bias a step",
    source: "github.com/HKUST-Aerial-Robotics/VINS-Fusion: vins_estimator/src/factor/integration_base.h",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct VinsFusion;

impl Target for VinsFusion {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn first_line(&self) -> Option<&'static str> {
        Some("%YAML:1.0")
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let rate = source.rate_hz()?;
        sheet.note(format!("{}: at another rate of the IMU these numbers are others", source.rate_text()?));
        let density = source.angle_random_walk()?.times((2.0 * rate).sqrt());
        sheet.put("gyr_n", density, Shape::Scalar, |v| format!("gyr_n: {v}"));
        let walk = source.rate_random_walk().map(|k| k.times(rate.sqrt()));
        sheet.put_walk("gyr_w", walk, Shape::Scalar, "VINS-Fusion then reads 0", |v| format!("gyr_w: {v}"));
        sheet.leave_out_accelerometer("acc_n, acc_w");
        Ok(())
    }
}
