//! The tasks as gyroid does them: seconds, peak memory, answers.

use crate::drive::Outcome;
use crate::making::{STEP_S, read_raw};
use crate::{navigation, runs};
use gyroid::config::Config;
use gyroid::effects::Library;
use gyroid::gap;
use gyroid::identify::terms::{TermOptions, noise_model};
use gyroid::identify::{FitOptions, fit};
use gyroid::ingest::read_log;
use gyroid::math::spectra::autocorrelation;
use gyroid::noise::{Deviation, TermKind, allan};
use gyroid::signal::{TimeAxis, names};
use gyroid::validate::{Options, whiteness};
use serde_json::{Value, json};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

/// The robot of `examples/mujoco/robot.xml` without its payload.
const UNLOADED: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.8e-4\n\
    turn_on_bias_std_rad_s = 2e-4\n\
    [vehicle]\nmass_kg = 12.0\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.065\n\
    wheel_inertia_kg_m2 = 0.00133\nviscous_friction_n_m_s = 0.004\ntorque_noise_n_m_sqrt_s = 0.001\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n";

/// A task's seconds, peak memory, answers and, where there is one, its curve.
pub fn measured(task: &str, path: &Path) -> Outcome<Value> {
    match task {
        "csv" | "parquet" => read(path),
        "payload" => payload(path),
        "rolling" | "slip" => navigation::measured(task, path),
        _ => of_array(task, read_raw(path)?),
    }
}

/// Does the work `RUNS` times: the median of the seconds, the peak memory of the process so far, the last result.
pub fn timed<T>(mut work: impl FnMut() -> Outcome<T>) -> Outcome<(f64, Option<f64>, T)> {
    let mut seconds = Vec::new();
    loop {
        let start = Instant::now();
        let result = black_box(work()?);
        seconds.push(start.elapsed().as_secs_f64());
        if seconds.len() == runs() {
            seconds.sort_by(f64::total_cmp);
            return Ok((seconds[seconds.len() / 2], peak_mib(), result));
        }
    }
}

/// Where the system tells it.
fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

fn of_array(task: &str, rate: Vec<f64>) -> Outcome<Value> {
    let axis = TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: rate.len() };
    let (seconds, peak_mib, (answers, curve)) = match task {
        "fit" => told(&mut || fit(&axis, &rate, &FitOptions::default()), |found| {
            let scaled = |e: &gyroid::identify::Estimate, by: f64| {
                estimate(by * e.estimate, by * e.std, e.ci95.map(|end| by * end))
            };
            let answers = json!({
                "C1, mrad/s": scaled(&found.c1_rad_s, 1e3),
                "C2, mrad/s": scaled(&found.c2_rad_s, 1e3),
                "T, s": scaled(&found.time_constant_s, 1.0),
            });
            (answers, None)
        })?,
        "noise" => told(&mut || noise_model(&axis, &rate, None, &TermOptions::default()), |found| {
            let term = |kind| {
                let scaled =
                    found.term(kind).map(|t| estimate(1e3 * t.estimate, 1e3 * t.std, t.ci95.map(|end| 1e3 * end)));
                scaled.unwrap_or(Value::Null)
            };
            let ours = [term(TermKind::AngleRandomWalk), term(TermKind::BiasInstability)];
            let beside = found.terms.len() - ours.iter().filter(|t| !t.is_null()).count();
            let [n, b] = ours;
            (json!({ "N, mrad/√s": n, "B, mrad/s": b, "other terms": { "estimate": beside } }), None)
        })?,
        "allan" => {
            let averaged = averaged(rate.len());
            let work = &mut || Ok(allan::deviations(&rate, STEP_S, &averaged, Deviation::Overlapping));
            told(work, |points| (json!({}), Some(points.iter().map(|p| (p.m as f64, p.deviation_rad_s)).collect())))?
        }
        "autocorrelation" => told(&mut || Ok(autocorrelation(&rate, 1000)), |found| {
            let r = found.as_ref().map_or(&[][..], |f| &f.r);
            let curve = r.iter().enumerate().map(|(lag, r)| (lag as f64, *r)).collect();
            (json!({ "at lag 1": { "estimate": r.get(1) }, "at lag 10": { "estimate": r.get(10) } }), Some(curve))
        })?,
        _ => {
            let options = Options { draws: 0, ..Options::default() };
            told(&mut || Ok(whiteness(&axis, &rate, &[], &options)), |found| {
                let test = found.levels.first().map(|level| &level.whiteness.ljung_box);
                let number = |value: Option<f64>| json!({ "estimate": value });
                (json!({ "Q": number(test.map(|t| t.statistic)), "p": number(test.map(|t| t.p_value)) }), None)
            })?
        }
    };
    Ok(json!({ "seconds": seconds, "peak_mib": peak_mib, "answers": answers, "curve": curve }))
}

type Told = (f64, Option<f64>, (Value, Option<Vec<(f64, f64)>>));

/// The work, timed, and what is told of its result.
fn told<T>(
    work: &mut dyn FnMut() -> gyroid::Result<T>,
    tell: impl Fn(&T) -> (Value, Option<Vec<(f64, f64)>>),
) -> Outcome<Told> {
    let (seconds, peak_mib, result) = timed(|| Ok(work()?))?;
    Ok((seconds, peak_mib, tell(&result)))
}

fn estimate(estimate: f64, std: f64, ci95: [f64; 2]) -> Value {
    json!({ "estimate": estimate, "std": std, "ci95": ci95 })
}

/// Averaging times in samples: those of allan-variance.
fn averaged(samples: usize) -> Vec<usize> {
    let octaves = ((samples / 10) as f64).log2();
    let mut all: Vec<usize> = (0..100).map(|i| (octaves * f64::from(i) / 99.0).exp2().round() as usize).collect();
    all.dedup();
    all
}

fn read(path: &Path) -> Outcome<Value> {
    let (seconds, peak_mib, log) = timed(|| Ok(read_log(path)?))?;
    let written = read_raw(&path.with_file_name("raw.bin"))?;
    let z = log.require(names::GYRO_Z)?;
    let off = z.iter().zip(&written).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let answers = json!({ "rows": { "estimate": z.len() }, "largest error of z, rad/s": { "estimate": off } });
    Ok(json!({ "seconds": seconds, "peak_mib": peak_mib, "answers": answers }))
}

fn payload(path: &Path) -> Outcome<Value> {
    let config = Config::parse(UNLOADED, "unloaded.toml")?;
    let log = read_log(path)?;
    let explain = || gap::explain(&config, &log, &Library::new(), &["vehicle.payload"], 0.0);
    let (seconds, peak_mib, found) = timed(|| Ok(explain()?))?;
    let effect = found.effects.first().ok_or("no payload in the answer")?;
    let vehicle = config.require_vehicle()?;
    let scaled = |name: &str, by: f64| {
        let told = effect.parameters.get(name);
        told.map_or(Value::Null, |e| estimate(by * e.estimate, by * e.std, e.ci95.map(|end| by * end)))
    };
    let answers = json!({
        "payload, kg": scaled("mass_relative", vehicle.mass_kg),
        "added yaw inertia, kg m²": scaled("inertia_relative", vehicle.yaw_inertia_kg_m2),
    });
    Ok(json!({ "seconds": seconds, "peak_mib": peak_mib, "answers": answers }))
}
