//! Fit of 1e6 samples from memory, beside scipy's `curve_fit` on the same data in the same run.
//!
//! `cargo bench --bench fit`; the Python with scipy is `$PYTHON`, or `python3`. Without scipy the ratio is left out.

use gyroid::identify::{FitOptions, fit};
use gyroid::math::random::Stream;
use gyroid::signal::{Moments, TimeAxis};
use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

const SCIPY: &str = r"
import sys, time, json, numpy as np
from scipy.optimize import curve_fit
y = np.fromfile(sys.argv[1]); t = np.arange(len(y)) * float(sys.argv[2])
f = lambda t, c1, c2, T: c1 * (1 - np.exp(-t / T)) + c2
start = [y[-1000:].mean() - y[:1000].mean(), y[:1000].mean(), t[-1] / 5]
times = []
for _ in range(3):
    a = time.perf_counter(); p, _ = curve_fit(f, t, y, p0=start); times.append(time.perf_counter() - a)
print(json.dumps({'seconds': sorted(times)[1], 'parameters': p.tolist()}))
";

/// Median and smallest seconds of `runs` calls.
fn time(runs: usize, mut f: impl FnMut()) -> (f64, f64) {
    let mut all: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            f();
            start.elapsed().as_secs_f64()
        })
        .collect();
    all.sort_by(f64::total_cmp);
    (all[runs / 2], all[0])
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (n, step) = (1_000_000usize, 0.01);
    let mut draw = Stream::new(1, 0);
    let values: Vec<f64> =
        (0..n).map(|i| -5e-3 - 2e-3 * (-(i as f64) * step / 600.0).exp_m1() + 1.7e-3 * draw.normal()).collect();
    let axis = TimeAxis::Uniform { start_s: 0.0, step_s: step, len: n };
    let uneven = TimeAxis::Explicit(axis.to_vec());
    let options = FitOptions::default();

    let sum = time(21, || {
        black_box(black_box(&values).iter().sum::<f64>());
    });
    let moments = time(21, || {
        black_box(Moments::new(&axis, black_box(&values)).is_ok());
    });
    let whole = time(21, || {
        black_box(fit(&axis, black_box(&values), &options).is_ok());
    });
    let slow = time(5, || {
        black_box(fit(&uneven, black_box(&values), &options).is_ok());
    });
    println!("1e6 samples from memory, one thread: median (fastest), ms");
    for (name, (median, fastest)) in [
        ("bare sum of the samples", sum),
        ("block moments", moments),
        ("fit: estimates, covariance, intervals, comparison, advice", whole),
        ("the same with a time for every sample", slow),
    ] {
        println!("  {name:<60}{:>9.3} ({:.3})", median * 1e3, fastest * 1e3);
    }

    let mut file = tempfile::NamedTempFile::new()?;
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::io::Write::write_all(&mut file, &bytes)?;
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let run = Command::new(&python).args(["-c", SCIPY]).arg(file.path()).arg(step.to_string()).output();
    match run {
        Ok(out) if out.status.success() => {
            let answer: serde_json::Value = serde_json::from_slice(&out.stdout)?;
            let seconds = answer["seconds"].as_f64().ok_or("no time from scipy")?;
            let ours = fit(&axis, &values, &options)?;
            println!("  {:<60}{:>9.3}", "scipy curve_fit (estimates and covariance)", seconds * 1e3);
            println!("  ratio scipy / gyroid: {:.0}", seconds / whole.0);
            println!("  scipy {}", answer["parameters"]);
            println!(
                "  gyroid [{}, {}, {}]",
                ours.c1_rad_s.estimate, ours.c2_rad_s.estimate, ours.time_constant_s.estimate
            );
        }
        _ => println!("  no scipy in {python}: no ratio"),
    }
    Ok(())
}
