//! The files that all programs read, and the true values in them. The generators share no code with what is measured.

use crate::drive::Outcome;
use crate::python;
use gyroid::ingest::write_log;
use gyroid::math::random::Stream;
use gyroid::signal::{Log, TimeAxis, names};
use serde_json::{Map, Value, json};
use std::f64::consts::{LN_2, PI};
use std::path::Path;

pub const STEP_S: f64 = 0.01;
const WHITE_RAD_S: f64 = 1.7e-3;
const C1_MRAD_S: f64 = 2.0;
const C2_MRAD_S: f64 = -5.0;
const TIME_CONSTANT_S: f64 = 600.0;
const BIAS_INSTABILITY_MRAD_S: f64 = 0.1;
const DECAY: f64 = 0.9;
/// statsmodels' Ljung-Box takes time as the square of the samples.
const WHITE: usize = 50_000;

/// Writes the files; gives each task's true values, or why there are none.
pub fn write_data(folder: &Path, samples: usize) -> Outcome<Map<String, Value>> {
    let mut draw = Stream::new(1, 0);
    let [x, y, z] = std::array::from_fn(|_| warm_up(samples, &mut draw));
    write_raw(&folder.join("raw.bin"), &z)?;
    let mut log = Log::new("bench", TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: samples });
    for (name, values) in [("gyro_x_rad_s", x), ("gyro_y_rad_s", y), (names::GYRO_Z, z)] {
        log.push(name, values)?;
    }
    for name in ["log.csv", "log.parquet"] {
        write_log(folder.join(name), &log)?;
    }
    let mut white: Vec<f64> = (0..samples.max(WHITE)).map(|_| WHITE_RAD_S * draw.normal()).collect();
    write_raw(&folder.join("white.bin"), &white[..WHITE])?;
    white.truncate(samples);
    write_raw(&folder.join("noise.bin"), &with_flicker(white, &mut draw))?;
    let mut last = draw.normal() / (1.0 - DECAY * DECAY).sqrt();
    let coloured = (0..samples).map(|_| {
        last = DECAY * last + draw.normal();
        last
    });
    write_raw(&folder.join("coloured.bin"), &coloured.collect::<Vec<_>>())?;
    let payload = python(&["mujoco.sysid", "make"], &folder.join("payload.parquet"));
    let read = json!({ "rows": samples, "largest error of z, rad/s": 0.0 });
    let truth = json!({
        "fit": { "C1, mrad/s": C1_MRAD_S, "C2, mrad/s": C2_MRAD_S, "T, s": TIME_CONSTANT_S },
        "noise": { "N, mrad/√s": 1e3 * WHITE_RAD_S * STEP_S.sqrt(), "B, mrad/s": BIAS_INSTABILITY_MRAD_S, "other terms": 0 },
        "autocorrelation": { "at lag 1": DECAY, "at lag 10": DECAY.powi(10) },
        "payload": payload.unwrap_or_else(|why| json!(why.to_string())),
        "csv": read,
        "parquet": read,
    });
    Ok(truth.as_object().cloned().unwrap_or_default())
}

/// Warm-up and white noise, rad/s, as a sensor's single precision has them.
fn warm_up(samples: usize, draw: &mut Stream) -> Vec<f64> {
    let at = |i: usize| 1e-3 * (C2_MRAD_S - C1_MRAD_S * (-(i as f64) * STEP_S / TIME_CONSTANT_S).exp_m1());
    (0..samples).map(|i| f64::from((at(i) + WHITE_RAD_S * draw.normal()) as f32)).collect()
}

/// Adds noise of the spectrum B²/(2πf): first-order Gauss-Markov processes, their correlation times an octave apart from two
/// samples to four times the log, each of the variance B² ln 2/π.
fn with_flicker(mut values: Vec<f64>, draw: &mut Stream) -> Vec<f64> {
    let std = 1e-3 * BIAS_INSTABILITY_MRAD_S * (LN_2 / PI).sqrt();
    let mut correlated = 2.0;
    while correlated < 4.0 * values.len() as f64 {
        let decay = (-1.0 / correlated).exp();
        let driven = std * (1.0 - decay * decay).sqrt();
        let mut state = std * draw.normal();
        for value in &mut values {
            *value += state;
            state = decay * state + driven * draw.normal();
        }
        correlated *= 2.0;
    }
    values
}

fn write_raw(path: &Path, values: &[f64]) -> Outcome<()> {
    Ok(std::fs::write(path, values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())?)
}

pub fn read_raw(path: &Path) -> Outcome<Vec<f64>> {
    let bytes = std::fs::read(path)?;
    Ok(bytes.chunks_exact(8).map(|b| f64::from_le_bytes(std::array::from_fn(|i| b[i]))).collect())
}
