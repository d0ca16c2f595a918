//! MATLAB gyroparams: NoiseDensity = N and RandomWalk = K with NoiseType 'single-sided', ConstantBias = C1 + C2
//!
//! imuSensor makes the noise of a sample w √(f/s) NoiseDensity and the step of the walk w √(s/f) RandomWalk, where the
//! scale s is 2 for NoiseType 'double-sided' (the default, and all that releases before the property know) and 1 for
//! 'single-sided'. A gyro of angle random walk N has N √f a sample, and its bias steps by K/√f: that is s = 1. With the
//! default, N would come out as N/√2 and K as √2 K.
//!
//! BiasInstability scales unit noise through the filter BiasInstabilityCoefficients; B²/(2πf) needs those of
//! `fractalcoef`, with which MathWorks' example of the Allan variance simulates the B that it has identified. TemperatureBias
//! counts from 25 °C.

use super::super::number::Known;
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::Target;
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

/// imuSensor's reference, °C.
const REFERENCE_C: f64 = 25.0;

static ABOUT: About = About {
    id: "matlab",
    program: "MATLAB, gyroparams of imuSensor (Navigation Toolbox, Sensor Fusion and Tracking Toolbox)",
    file: "gyro_params.m",
    keys: &[
        Key {
            name: "NoiseDensity",
            unit: "(rad/s)/sqrt(Hz), continuous, single-sided",
            meaning: "angle random walk N",
        },
        Key { name: "RandomWalk", unit: "(rad/s)*sqrt(Hz), continuous, single-sided", meaning: "rate random walk K" },
        Key { name: "BiasInstability", unit: "rad/s", meaning: "bias instability B" },
        Key { name: "ConstantBias", unit: "rad/s", meaning: "C1 + C2, the bias of the warm gyro" },
        Key { name: "Resolution", unit: "(rad/s)/LSB", meaning: "quantization step of the output" },
        Key {
            name: "TemperatureBias",
            unit: "(rad/s)/degC",
            meaning: "slope of the bias against temperature at 25 degC",
        },
    ],
    needs: "N, C1, C2; K and B from a log of hours; [[effect]] gyro.temperature_sensitivity for TemperatureBias",
    convention: "NoiseType 'single-sided': a sample has N sqrt(f) and the bias steps by K / sqrt(f); the default has N / sqrt(2)",
    source: "mathworks.com/help/nav/ref/gyroparams.html, imusensor-system-object.html (Algorithms)",
    warm_up: "imuSensor has no warm-up: ConstantBias is its end, reached after some three time constants",
    comment: Comment::Percent,
};

pub(super) struct Matlab;

impl Target for Matlab {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let axis = source.axis().0 as usize;
        let property = |name: &'static str| move |v: &str| format!("params.{name} = [{v}];");
        let double = |name: &'static str, operator: &'static str| {
            move |v: &str| format!("params.{name} = [{v}] {operator} double_sided;")
        };
        sheet.note(
            "releases whose gyroparams has no NoiseType behave as 'double-sided': there NoiseDensity is multiplied by \
             sqrt(2) and RandomWalk divided by it",
        );
        if let Some(text) = source.earth_stays_text("ConstantBias", "imuSensor") {
            sheet.note(text);
        }
        sheet.line("params = gyroparams;");
        sheet.line("if isprop(params, 'NoiseType')");
        sheet.line("    params.NoiseType = 'single-sided';");
        sheet.line("    double_sided = 1;");
        sheet.line("else");
        sheet.line("    double_sided = sqrt(2);");
        sheet.line("end");
        sheet.put("NoiseDensity", source.angle_random_walk()?, Shape::Alike, double("NoiseDensity", "*"));
        let without = "gyroparams keeps 0";
        sheet.put_walk("RandomWalk", source.rate_random_walk(), Shape::Alike, without, double("RandomWalk", "/"));
        match source.bias_instability() {
            Some(b) => {
                sheet.note(
                    "BiasInstability means B only with the coefficients of 1/f noise, set below (R2023b and later)",
                );
                sheet.put("BiasInstability", b, Shape::Alike, property("BiasInstability"));
                sheet.line("if isprop(params, 'BiasInstabilityCoefficients')");
                sheet.line("    params.BiasInstabilityCoefficients = fractalcoef(500);");
                sheet.line("end");
            }
            None => sheet.leave_out(
                "BiasInstability",
                "no bias instability was identified",
                "run gyroid noise LOG --write CONFIG on a log of hours",
            ),
        }
        sheet.put("ConstantBias", source.warm_bias(), Shape::OnAxis(axis), property("ConstantBias"));
        if let Some(lsb) = source.lattice() {
            sheet.put("Resolution", Known::exact(lsb), Shape::Scalar, |v| format!("params.Resolution = {v};"));
        }
        match source.thermal() {
            Ok(t) => {
                let slope = t.slope_rad_s_c + 2.0 * t.bend_rad_s_c2 * (REFERENCE_C - t.power_on_c);
                if t.bend_rad_s_c2 != 0.0 || t.lag_s > 0.0 {
                    sheet.note(
                        "TemperatureBias is a straight line without lag: bend and lag of the fitted curve are lost",
                    );
                }
                sheet.put("TemperatureBias", Known::exact(slope), Shape::OnAxis(axis), property("TemperatureBias"));
            }
            Err([why, hint]) => sheet.leave_out("TemperatureBias", why, hint),
        }
        Ok(())
    }
}
