//! Fit of 1e6 samples from memory, and how long its parts take: `cargo bench --bench fit`.

use gyroid::identify::{FitOptions, fit};
use gyroid::math::random::Stream;
use gyroid::signal::{Moments, TimeAxis};
use std::hint::black_box;
use std::time::Instant;

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
    Ok(())
}
