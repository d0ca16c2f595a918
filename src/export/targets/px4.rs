//! PX4: EKF2_GYR_NOISE = N/√dt, EKF2_GYR_B_NOISE = K/√dt; TC_G0_X1 = k, TC_G0_X2 = m, TC_G0_X0 = C2 about TC_G0_TREF
//!
//! Discrete. `Ekf::predictCovariance` (src/modules/ekf2/EKF/covariance.cpp) adds, once every dt (EKF2_PREDICT_US, 10 ms):
//!
//! ```text
//! rotation: (dt EKF2_GYR_NOISE)² = N² dt     =>  EKF2_GYR_NOISE = N/√dt
//! bias:     (dt EKF2_GYR_B_NOISE)² = K² dt   =>  EKF2_GYR_B_NOISE = K/√dt
//! ```
//!
//! `calc_thermal_offsets_3D` (src/modules/temperature_compensation) subtracts X0 + X1 d + X2 d² + X3 d³, d = T - TREF. Counted
//! from the temperature at power-on, b = C2 + k d + m d² needs no shift. Parameters are single precision.

use super::super::number::{Known, digits};
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

/// EKF2_PREDICT_US, s.
const STEP_S: f64 = 0.01;
/// MAV_PARAM_TYPE_REAL32 and MAV_PARAM_TYPE_INT32.
const REAL: u8 = 9;
const INTEGER: u8 = 6;
/// Ranges of EKF2_GYR_NOISE (rad/s) and EKF2_GYR_B_NOISE (rad/s²) in the metadata of PX4's parameters.
const NOISE_RANGE: [f64; 2] = [1e-4, 0.1];
const BIAS_NOISE_RANGE: [f64; 2] = [0.0, 0.01];

static ABOUT: About = About {
    id: "px4",
    program: "PX4 autopilot, parameters for QGroundControl",
    file: "gyro.params",
    keys: &[
        Key { name: "EKF2_GYR_NOISE", unit: "rad/s, discrete", meaning: "N / sqrt(dt)" },
        Key { name: "EKF2_GYR_B_NOISE", unit: "rad/s^2, discrete", meaning: "K / sqrt(dt)" },
        Key { name: "TC_G_ENABLE", unit: "", meaning: "1: thermal compensation of the gyros is on" },
        Key {
            name: "TC_G0_ID",
            unit: "",
            meaning: "device id of the gyro (--device-id; CAL_GYRO0_ID of your vehicle)",
        },
        Key { name: "TC_G0_TREF", unit: "degC", meaning: "temperature that the polynomial counts from" },
        Key { name: "TC_G0_TMIN", unit: "degC", meaning: "lowest temperature of the log" },
        Key { name: "TC_G0_TMAX", unit: "degC", meaning: "highest temperature of the log" },
        Key {
            name: "TC_G0_X0",
            unit: "rad/s",
            meaning: "bias at TC_G0_TREF, of the cold gyro: C2 without the Earth's rotation",
        },
        Key { name: "TC_G0_X1", unit: "rad/s/degC", meaning: "slope against temperature" },
        Key { name: "TC_G0_X2", unit: "rad/s/degC^2", meaning: "bend against temperature" },
        Key { name: "TC_G0_X3", unit: "rad/s/degC^3", meaning: "not identified: 0" },
    ],
    needs: "N; K from a log of hours; for TC_*: [[effect]] gyro.temperature_sensitivity, the log's temperatures, --device-id",
    convention: "discrete: a step of dt adds (dt EKF2_GYR_NOISE)^2 to the rotation, (dt EKF2_GYR_B_NOISE)^2 to the bias",
    source: "github.com/PX4/PX4-Autopilot: src/modules/ekf2/EKF/covariance.cpp; docs.px4.io, thermal calibration",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct Px4;

impl Target for Px4 {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let step_s = source.options.step_s.unwrap_or(STEP_S);
        sheet.note(format!("dt = {step_s} s: EKF2_PREDICT_US must be {:.0}", 1e6 * step_s));
        sheet.note(
            "PX4's defaults (1.5e-2 rad/s, 1e-3 rad/s^2) allow for vibration in flight; the numbers below are the gyro \
             alone, a lower bound: fly with them only where the innovations stay consistent",
        );
        sheet.comment("Vehicle-Id Component-Id Name Value Type");
        let noise = source.angle_random_walk()?.times(1.0 / step_s.sqrt());
        in_range(sheet, "EKF2_GYR_NOISE", noise.value, NOISE_RANGE);
        sheet.put("EKF2_GYR_NOISE", noise, Shape::Scalar, |v| row("EKF2_GYR_NOISE", v, REAL));
        let walk = source.rate_random_walk().map(|k| k.times(1.0 / step_s.sqrt()));
        if let Some(walk) = walk {
            in_range(sheet, "EKF2_GYR_B_NOISE", walk.value, BIAS_NOISE_RANGE);
        }
        sheet.put_walk("EKF2_GYR_B_NOISE", walk, Shape::Scalar, "PX4 keeps its value", |v| {
            row("EKF2_GYR_B_NOISE", v, REAL)
        });
        thermal(source, sheet);
        Ok(())
    }
}

fn row(name: &str, value: &str, kind: u8) -> String {
    format!("1\t1\t{name}\t{value}\t{kind}")
}

fn in_range(sheet: &mut Sheet, name: &str, value: f64, [low, high]: [f64; 2]) {
    if !(low..=high).contains(&value) {
        sheet.note(format!(
            "{name} = {} lies outside what PX4's metadata allow, {low} to {high}: ground stations refuse it or clip it",
            digits(value)
        ));
    }
}

fn thermal(source: &Source<'_>, sheet: &mut Sheet) {
    let polynomial = match source.thermal() {
        Ok(polynomial) => polynomial,
        Err([why, hint]) => return sheet.leave_out("TC_G_ENABLE, TC_G0_*", why, hint),
    };
    let Some(device) = source.options.device_id else {
        return sheet.leave_out(
            "TC_G_ENABLE, TC_G0_*",
            "PX4 compensates a gyro by its device id, which no log of rates holds",
            "read CAL_GYRO0_ID of the vehicle and give it with --device-id",
        );
    };
    sheet.note(
        "PX4 subtracts TC_G0_X* and CAL_GYRO0_*OFF both: set the three offsets to 0, or the bias is compensated twice",
    );
    sheet.note(format!(
        "TC_G0_TREF is taken to be the temperature at power-on{}",
        if source.options.power_on_temperature_c.is_some() {
            ""
        } else {
            ": the lowest of the log (--power-on-temperature)"
        }
    ));
    if polynomial.lag_s > 0.0 {
        sheet.note(format!(
            "the bias lags the temperature by {:.0} s, which PX4 cannot express: while the temperature moves, an error \
             of the slope times the lag times its rate of change remains",
            polynomial.lag_s
        ));
    }
    sheet.note(source.earth_text("TC_G0_X0", "PX4's EKF2"));
    let (axis, _) = source.axis();
    sheet.put_integer("TC_G_ENABLE", 1, |v| row("TC_G_ENABLE", v, INTEGER));
    sheet.put_integer("TC_G0_ID", device, |v| row("TC_G0_ID", v, INTEGER));
    for (key, value) in [
        ("TC_G0_TREF", polynomial.power_on_c),
        ("TC_G0_TMIN", polynomial.range_c[0]),
        ("TC_G0_TMAX", polynomial.range_c[1]),
    ] {
        sheet.put(key, Known::exact(value), Shape::Scalar, |v| row(key, v, REAL));
    }
    for (key, value) in [
        ("TC_G0_X0", source.gyro.c2_rad_s - source.gyro.earth_rate_rad_s.unwrap_or(0.0)),
        ("TC_G0_X1", polynomial.slope_rad_s_c),
        ("TC_G0_X2", polynomial.bend_rad_s_c2),
        ("TC_G0_X3", 0.0),
    ] {
        let name = format!("{key}_{}", axis as usize);
        sheet.put_named(&name, key, Known::exact(value), Shape::Scalar, |v| row(&name, v, REAL));
    }
}
