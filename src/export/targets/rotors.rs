//! RotorS IMU plugin: gyroscopeNoiseDensity = N, gyroscopeBiasRandomWalk = σ √(2/τ) or K, gyroscopeBiasCorrelationTime = τ
//!
//! Continuous. `GazeboImuPlugin::addNoise` (rotors_gazebo_plugins/src/gazebo_imu_plugin.cpp) divides N by √dt and lets the
//! bias follow db = -b/τ dt + σ_b dW exactly. A Gauss-Markov term of stationary standard deviation σ has σ_b = σ √(2/τ). The
//! plugin reads the walk as `gyroscopeBiasRandomWalk`, while the macros that come with it write `gyroscopeRandomWalk`,
//! which it ignores: both stand in the file.

use super::super::number::Known;
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::Target;
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

static ABOUT: About = About {
    id: "rotors",
    program: "RotorS and its descendants, IMU plugin of Gazebo classic",
    file: "imu_plugin.xml",
    keys: &[
        Key { name: "gyroscopeNoiseDensity", unit: "rad/s/sqrt(Hz), continuous", meaning: "angle random walk N" },
        Key {
            name: "gyroscopeRandomWalk",
            unit: "rad/s^2/sqrt(Hz), continuous",
            meaning: "what drives the bias; written under both names that copies of the plugin read",
        },
        Key {
            name: "gyroscopeBiasCorrelationTime",
            unit: "s",
            meaning: "time after which the bias has forgotten itself",
        },
        Key {
            name: "gyroscopeTurnOnBiasSigma",
            unit: "rad/s",
            meaning: "spread of the bias from power-on to power-on",
        },
    ],
    needs: "N; a Gauss-Markov term or K; turn_on_bias_std_rad_s; robotNamespace, linkName and the accelerometer from you",
    convention: "continuous densities; the plugin divides N by sqrt(dt) and integrates the bias exactly itself",
    source: "github.com/ethz-asl/rotors_simulator: rotors_gazebo_plugins/src/gazebo_imu_plugin.cpp",
    warm_up: "the plugin has no warm-up and no constant bias, so that C1, C2 and T are not in this file",
    comment: Comment::Xml,
};

pub(super) struct Rotors;

impl Target for Rotors {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        sheet.line("<plugin filename=\"librotors_gazebo_imu_plugin.so\" name=\"rotors_gazebo_imu_plugin\">");
        sheet.indent("  ");
        element(sheet, "gyroscopeNoiseDensity", source.angle_random_walk()?);
        let walk = |v: &str| {
            format!(
                "<gyroscopeRandomWalk>{v}</gyroscopeRandomWalk><gyroscopeBiasRandomWalk>{v}</gyroscopeBiasRandomWalk>"
            )
        };
        if let Some(markov) = source.gauss_markov() {
            let tau = markov.correlation_time_s;
            let driven = Known::exact(markov.std_rad_s.value * (2.0 / tau.value).sqrt());
            sheet.comment("of the Gauss-Markov term: sigma sqrt(2 / tau)");
            sheet.put("gyroscopeRandomWalk", driven, Shape::Scalar, walk);
            element(sheet, "gyroscopeBiasCorrelationTime", tau);
            if source.rate_random_walk().is_some() {
                let hint = "export K to another target, or delete the Gauss-Markov term";
                sheet.leave_out(
                    "rate random walk K",
                    "the plugin has one bias process, and the Gauss-Markov term has it",
                    hint,
                );
            }
        } else {
            let without = "the plugin keeps its default";
            sheet.put_walk("gyroscopeRandomWalk", source.rate_random_walk(), Shape::Scalar, without, walk);
            sheet.leave_out(
                "gyroscopeBiasCorrelationTime",
                "no Gauss-Markov term was identified; the plugin's default of 1000 s bounds the walk beyond it",
                "run gyroid noise LOG --write CONFIG on a log much longer than the correlation time",
            );
        }
        match source.turn_on() {
            Some(std) => element(sheet, "gyroscopeTurnOnBiasSigma", Known::exact(std)),
            None => sheet.leave_out(
                "gyroscopeTurnOnBiasSigma",
                "one log knows one power-on",
                "run gyroid fit LOGS... --config FILE on several power-ons, which writes turn_on_bias_std_rad_s",
            ),
        }
        sheet.leave_out_accelerometer("accelerometer*");
        sheet.indent("");
        sheet.line("</plugin>");
        Ok(())
    }
}

fn element(sheet: &mut Sheet, name: &'static str, number: Known) {
    sheet.put(name, number, Shape::Scalar, |v| format!("<{name}>{v}</{name}>"));
}
