//! Gazebo SDF: mean = C1 + C2, bias_mean = -C1, dynamic_bias_correlation_time = T, stddev = N √f, dynamic_bias_stddev = K
//!
//! stddev is of a sample, discrete; dynamic_bias_stddev is continuous. `GaussianNoiseModel::ApplyImpl` (gz-sensors) adds to
//! each sample the mean, white noise of stddev, and a bias that starts at a draw from (bias_mean, bias_stddev) and follows
//!
//! ```text
//! bias := exp(-dt/τ) bias + σ √(τ/2 (1 - exp(-2 dt/τ))) ε,   τ = correlation time, σ = dynamic_bias_stddev
//! ```
//!
//! that is db = -b/τ dt + σ dW: with bias(0) = -C1 and τ = T its mean is -C1 exp(-t/T), and mean + bias is e(t). The bias stands
//! still unless σ > 0: where no walk was identified, σ is set so low that the process' standard deviation σ √(T/2) stays at
//! a thousandth of |C1|. One τ serves both, so that a walk of K forgets after T instead of walking on. In half of all
//! runs the model flips the sign of the first bias, and e(t) then starts at C2 + 2 C1: the file says so.

use super::super::number::{Known, digits};
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::Target;
use crate::error::Result;
use crate::export::about::{About, Comment, Key};
use crate::ingest::Axis;

/// Standard deviation of the bias beside |C1|, where it walks only so that it decays.
const NEGLIGIBLE: f64 = 1e-3;
/// gz-sensors takes a smaller precision for none.
const SMALLEST_PRECISION: f64 = 1e-6;

static ABOUT: About = About {
    id: "gazebo",
    program: "Gazebo, a model with the IMU as a sensor",
    file: "imu.sdf",
    keys: &[
        Key { name: "update_rate", unit: "Hz", meaning: "rate of the IMU, to which stddev belongs" },
        Key { name: "mean", unit: "rad/s", meaning: "C1 + C2, the bias of the warm gyro" },
        Key { name: "stddev", unit: "rad/s, discrete", meaning: "N sqrt(f): white noise of a sample" },
        Key { name: "bias_mean", unit: "rad/s", meaning: "-C1: what the cold gyro lacks of its warm bias" },
        Key { name: "bias_stddev", unit: "rad/s", meaning: "spread of C1 from power-on to power-on" },
        Key {
            name: "dynamic_bias_stddev",
            unit: "rad/s^2/sqrt(Hz), continuous",
            meaning: "what drives the bias: K, or a negligible number that lets it decay",
        },
        Key { name: "dynamic_bias_correlation_time", unit: "s", meaning: "T, the time constant of the warm-up" },
        Key { name: "precision", unit: "rad/s", meaning: "quantization step of the output" },
    ],
    needs: "C1, C2, T, N and the IMU's rate; K if it was identified; quantization_lsb_rad_s for precision",
    convention: "stddev is of a sample (N sqrt(f)); dynamic_bias_stddev is the driving density of an Ornstein-Uhlenbeck process",
    source: "sdformat.org/spec (noise); github.com/gazebosim/gz-sensors: src/GaussianNoiseModel.cc",
    warm_up: "this file holds it",
    comment: Comment::Xml,
};

pub(super) struct Gazebo;

impl Target for Gazebo {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn first_line(&self) -> Option<&'static str> {
        Some("<?xml version=\"1.0\" encoding=\"UTF-8\"?>")
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let rate = source.rate_hz()?;
        let white = source.angle_random_walk()?.times(rate.sqrt());
        sheet.note(source.rate_text()?);
        limits(source, sheet);
        if let Some(text) = source.earth_stays_text("mean", "Gazebo") {
            sheet.note(text);
        }
        sheet.line("<sdf version=\"1.7\">");
        sheet.line("  <model name=\"imu\">");
        sheet.line("    <link name=\"imu_link\">");
        sheet.line("      <sensor name=\"imu\" type=\"imu\">");
        sheet.line("        <always_on>true</always_on>");
        sheet.indent("        ");
        element(sheet, "update_rate", Known::exact(rate));
        sheet.line("<imu>");
        sheet.line("  <angular_velocity>");
        let (fitted, _) = source.axis();
        for axis in Axis::ALL {
            sheet.indent("            ");
            sheet.line(&format!("<{axis}>"));
            sheet.indent("              ");
            if axis == fitted {
                whole(source, white, sheet);
            } else {
                sheet.comment("not fitted: white noise like the fitted axis, no bias");
                sheet.line("<noise type=\"gaussian\">");
                sheet.line("  <mean>0.0</mean>");
                sheet.line(&format!("  <stddev>{}</stddev>", digits(white.value)));
                sheet.line("</noise>");
            }
            sheet.indent("            ");
            sheet.line(&format!("</{axis}>"));
        }
        sheet.indent("");
        sheet.line("          </angular_velocity>");
        sheet.line("        </imu>");
        sheet.line("      </sensor>");
        sheet.line("    </link>");
        sheet.line("  </model>");
        sheet.line("</sdf>");
        Ok(())
    }
}

/// Notes on the limits of Gazebo's noise model.
fn limits(source: &Source<'_>, sheet: &mut Sheet) {
    let g = &source.gyro;
    if g.c1_rad_s != 0.0 {
        sheet.note(format!(
            "Gazebo flips the sign of the first bias in half of all runs: the warm-up then starts at C2 + 2 C1 = {:.4e} \
             rad/s instead of C2 = {:.4e} rad/s and ends at the same warm bias; choose a seed that does not, or a model \
             without the flip",
            g.c2_rad_s + 2.0 * g.c1_rad_s,
            g.c2_rad_s
        ));
    }
    if let Some(k) = source.rate_random_walk() {
        sheet.note(format!(
            "one correlation time serves warm-up and random walk: beyond T = {:.0} s the walk is bound to a standard \
             deviation of K sqrt(T/2) = {:.3e} rad/s",
            g.time_constant_s,
            k.value * (0.5 * g.time_constant_s).sqrt()
        ));
    }
    if let Some(std) = source.turn_on() {
        sheet.leave_out(
            "spread of C2",
            &format!("C2 varies by {std:.3e} rad/s from power-on to power-on, and Gazebo would let it decay with T"),
            "draw the mean anew for each run",
        );
    }
    sheet.note("time counts from the start of the simulation, which is the power-on");
}

/// The axis that was fitted.
fn whole(source: &Source<'_>, white: Known, sheet: &mut Sheet) {
    let lattice = source.lattice().filter(|lsb| *lsb >= SMALLEST_PRECISION);
    let c1 = source.warm_up();
    let indent = "                ";
    sheet.line(&format!("<noise type=\"{}\">", if lattice.is_some() { "gaussian_quantized" } else { "gaussian" }));
    sheet.indent(indent);
    element(sheet, "mean", source.warm_bias());
    element(sheet, "stddev", white);
    if c1.value != 0.0 {
        element(sheet, "bias_mean", c1.times(-1.0));
        let spread = source.gyro.warm_up_relative_std.unwrap_or(0.0) * c1.value.abs();
        element(sheet, "bias_stddev", Known::exact(spread));
        let negligible = NEGLIGIBLE * c1.value.abs() * (2.0 / source.gyro.time_constant_s).sqrt();
        let driven = source.rate_random_walk().unwrap_or_else(|| {
            sheet.note("no rate random walk was identified: dynamic_bias_stddev only lets the bias decay");
            Known::exact(negligible)
        });
        element(sheet, "dynamic_bias_stddev", driven);
        element(sheet, "dynamic_bias_correlation_time", source.time_constant());
    } else if let Some(k) = source.rate_random_walk() {
        element(sheet, "dynamic_bias_stddev", k);
        element(sheet, "dynamic_bias_correlation_time", source.time_constant());
    }
    if let Some(lsb) = lattice {
        element(sheet, "precision", Known::exact(lsb));
    }
    sheet.indent("              ");
    sheet.line("</noise>");
}

fn element(sheet: &mut Sheet, name: &'static str, number: Known) {
    sheet.put(name, number, Shape::Scalar, |v| format!("<{name}>{v}</{name}>"));
}
