//! ArduPilot: EK3_GYRO_P_NSE = N/√dt, EK3_GBIAS_P_NSE = K/√dt; INS_TCAL1_GYR1 = 10⁶ (k + 2 m s), GYR2 = 10⁶ m, s = 35 °C - T0
//!
//! Discrete. `NavEKF3_core::CovariancePrediction` (AP_NavEKF3_core.cpp) adds (dt EK3_GYRO_P_NSE)² to the rotation and
//! (dt² EK3_GBIAS_P_NSE)² to the bias, which it keeps as an angle a step, once every dt = EKF_TARGET_DT = 12 ms: the same
//! equations as PX4's.
//!
//! AP_InertialSensor_tempcal.cpp subtracts 10⁻⁶ (c1 + (c2 + c3 d) d) d, d = T - 35 °C, less its value at the temperature of
//! the offset calibration, so that no constant is needed. The fitted k z + m z², z = d + s counted from the temperature T0 at
//! power-on, is (k + 2 m s) d + m d² and a constant.

use super::super::number::Known;
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

/// EKF_TARGET_DT of AP_NavEKF3, s.
const STEP_S: f64 = 0.012;
/// TEMP_REFERENCE, °C.
const REFERENCE_C: f64 = 35.0;
/// SCALE_FACTOR.
const SCALE: f64 = 1e6;
/// TMAX must lie above TMIN by this much, °C.
const SHORTEST_RANGE_C: f64 = 10.0;

static ABOUT: About = About {
    id: "ardupilot",
    program: "ArduPilot, parameters for Mission Planner and MAVProxy",
    file: "gyro.parm",
    keys: &[
        Key { name: "EK3_GYRO_P_NSE", unit: "rad/s, discrete", meaning: "N / sqrt(dt)" },
        Key { name: "EK3_GBIAS_P_NSE", unit: "rad/s^2, discrete", meaning: "K / sqrt(dt)" },
        Key { name: "INS_TCAL1_ENABLE", unit: "", meaning: "1: thermal calibration of the first IMU is used" },
        Key { name: "INS_TCAL1_TMIN", unit: "degC", meaning: "lowest temperature of the log" },
        Key { name: "INS_TCAL1_TMAX", unit: "degC", meaning: "highest temperature of the log" },
        Key { name: "INS_TCAL1_GYR1", unit: "1e-6 rad/s/degC", meaning: "slope at 35 degC" },
        Key { name: "INS_TCAL1_GYR2", unit: "1e-6 rad/s/degC^2", meaning: "bend" },
        Key { name: "INS_TCAL1_GYR3", unit: "1e-6 rad/s/degC^3", meaning: "not identified: 0" },
    ],
    needs: "N; K from a log of hours; for INS_TCAL1_*: [[effect]] gyro.temperature_sensitivity and 10 degC or more of range",
    convention: "discrete: a step of dt adds (dt EK3_GYRO_P_NSE)^2 to the rotation, (dt EK3_GBIAS_P_NSE)^2 to the bias",
    source: "github.com/ArduPilot/ardupilot: libraries/AP_NavEKF3, AP_InertialSensor/AP_InertialSensor_tempcal.cpp",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct ArduPilot;

impl Target for ArduPilot {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let step_s = source.options.step_s.unwrap_or(STEP_S);
        sheet.note(format!("dt = {step_s} s, the filter's step (EKF_TARGET_DT)"));
        sheet.note(
            "ArduPilot's defaults allow for vibration in flight; the numbers below are the gyro alone, a lower bound: \
             fly with them only where the innovations stay consistent",
        );
        let noise = source.angle_random_walk()?.times(1.0 / step_s.sqrt());
        sheet.put("EK3_GYRO_P_NSE", noise, Shape::Scalar, |v| format!("EK3_GYRO_P_NSE,{v}"));
        let walk = source.rate_random_walk().map(|k| k.times(1.0 / step_s.sqrt()));
        sheet.put_walk("EK3_GBIAS_P_NSE", walk, Shape::Scalar, "ArduPilot keeps its value", |v| {
            format!("EK3_GBIAS_P_NSE,{v}")
        });
        thermal(source, sheet);
        Ok(())
    }
}

fn thermal(source: &Source<'_>, sheet: &mut Sheet) {
    let polynomial = match source.thermal() {
        Ok(polynomial) => polynomial,
        Err([why, hint]) => return sheet.leave_out("INS_TCAL1_*", why, hint),
    };
    let [low, high] = polynomial.range_c;
    if high - low < SHORTEST_RANGE_C {
        return sheet.leave_out(
            "INS_TCAL1_*",
            &format!("the log covers {low:.1} to {high:.1} degC, and ArduPilot wants 10 degC or more"),
            "record a warm-up from a colder start",
        );
    }
    if polynomial.lag_s > 0.0 {
        sheet.note(format!(
            "the bias lags the temperature by {:.0} s, which ArduPilot cannot express",
            polynomial.lag_s
        ));
    }
    sheet.note("without INS_TCAL1_ACC* the accelerometer is not compensated: their defaults are 0");
    let shift_c = REFERENCE_C - polynomial.power_on_c;
    let slope = polynomial.slope_rad_s_c + 2.0 * polynomial.bend_rad_s_c2 * shift_c;
    let letter = source.axis().0.to_string().to_uppercase();
    sheet.put_integer("INS_TCAL1_ENABLE", 1, |v| format!("INS_TCAL1_ENABLE,{v}"));
    for (key, value) in [("INS_TCAL1_TMIN", low), ("INS_TCAL1_TMAX", high)] {
        sheet.put(key, Known::exact(value), Shape::Scalar, |v| format!("{key},{v}"));
    }
    for (key, value) in
        [("INS_TCAL1_GYR1", slope), ("INS_TCAL1_GYR2", polynomial.bend_rad_s_c2), ("INS_TCAL1_GYR3", 0.0)]
    {
        let name = format!("{key}_{letter}");
        sheet.put_named(&name, key, Known::exact(SCALE * value), Shape::Scalar, |v| format!("{name},{v}"));
    }
}
