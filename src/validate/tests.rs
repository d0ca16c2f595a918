use super::*;

const QUICK: Options = Options { level: 0.05, draws: 199, seed: 1 };

fn axis(len: usize, step_s: f64) -> TimeAxis {
    TimeAxis::Uniform { start_s: 0.0, step_s, len }
}

/// Residuals after a constant and a slope were fitted: what the projection must make up for.
fn detrended(mut x: Vec<f64>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = x.len() as f64;
    let fitted = vec![vec![1.0; x.len()], (0..x.len()).map(|i| i as f64).collect::<Vec<_>>()];
    orthonormal(&fitted, &x).remove_from(&mut x);
    assert!(x.iter().sum::<f64>().abs() < 1e-6 * n);
    (x, fitted)
}

fn rejections(runs: u64, n: usize, step_s: f64, series: impl Fn(&mut Stream) -> Vec<f64>) -> f64 {
    let rejected = (0..runs)
        .filter(|seed| {
            let (x, fitted) = detrended(series(&mut Stream::new(*seed, 77)));
            !whiteness(&axis(n, step_s), &x, &fitted, &QUICK).white
        })
        .count();
    rejected as f64 / runs as f64
}

/// 99.9 % of binomial shares at 5 % lie below.
fn bound(runs: u64) -> f64 {
    0.05 + 3.1 * (0.05f64 * 0.95 / runs as f64).sqrt()
}

#[test]
#[ignore = "battery: some ten seconds"]
fn battery_the_joint_level_is_right_whatever_the_distribution() {
    let (runs, n) = (200, 600);
    let normal = rejections(runs, n, 1.0, |s| (0..n).map(|_| s.normal()).collect());
    let heavy = rejections(runs, n, 1.0, |s| (0..n).map(|_| s.normal().powi(3)).collect());
    let lattice = rejections(runs, n, 1.0, |s| (0..n).map(|_| (0.7 * s.normal()).round()).collect());
    println!("joint size at 5 %: normal {normal}, heavy tails {heavy}, lattice {lattice}");
    for share in [normal, heavy, lattice] {
        assert!(share < bound(runs), "{share}");
    }
    assert!(normal > 0.05 - 3.1 * (0.05f64 * 0.95 / runs as f64).sqrt(), "{normal}");
}

#[test]
fn few_blocks_keep_the_level() {
    // 150 samples and 15 blocks of ten: where textbook p values are off
    let runs = 300;
    let share = rejections(runs, 150, 1.0, |s| (0..150).map(|_| s.normal()).collect());
    assert!(share < bound(runs), "{share}");
}

#[test]
fn a_walk_under_white_noise_is_seen_although_the_samples_look_white() {
    let n = 20_000;
    let mut draw = Stream::new(3, 0);
    let mut level = 0.0;
    let x: Vec<f64> = (0..n)
        .map(|_| {
            level += 3e-3 * draw.normal();
            level + draw.normal()
        })
        .collect();
    let (x, fitted) = detrended(x);
    let v = whiteness(&axis(n, 0.1), &x, &fitted, &QUICK);
    // the paper's check, most lags inside ±1.96/√n, sees next to nothing at the sample rate
    let lag1 = v.levels[0].whiteness.autocorrelation[1];
    assert!(lag1.abs() < 0.2, "{lag1}");
    assert!(!v.white, "{}", v.joint_p_value);
    let (level, _, p) = v.strongest().unwrap();
    assert!(v.levels[level].averaging_time_s >= 0.1 && p <= 0.01);
}

#[test]
fn long_series_use_textbook_values_where_they_are_exact() {
    let n = 60_000;
    let mut draw = Stream::new(11, 0);
    let x: Vec<f64> = (0..n).map(|_| draw.normal()).collect();
    let v = whiteness(&axis(n, 0.01), &x, &[vec![1.0; n]], &QUICK);
    let times: Vec<f64> = v.levels.iter().map(|l| l.averaging_time_s).collect();
    assert_eq!(times.len(), 3, "{times:?}");
    assert_eq!(v.levels[0].calibrated_p_values, v.levels[0].whiteness.p_values());
    assert!(v.white, "{}", v.joint_p_value);
}

#[test]
fn same_seed_same_verdict_and_too_little_is_no_verdict() {
    let mut draw = Stream::new(12, 0);
    let x: Vec<f64> = (0..400).map(|_| draw.normal()).collect();
    let run = || whiteness(&axis(400, 1.0), &x, &[], &QUICK);
    assert_eq!(run(), run());
    let none = whiteness(&axis(5, 1.0), &x[..5], &[], &QUICK);
    assert!(!none.white && none.joint_p_value.is_nan() && none.levels.is_empty());
}

#[test]
fn means_are_over_decades_of_seconds_while_enough_of_them_are_left() {
    assert_eq!(block_sizes(1_000_000, 0.01), [1, 100, 1000, 10_000]);
    assert_eq!(block_sizes(1000, 1.0), [1, 10]);
    // a sample of half a second and more is the first mean itself
    assert_eq!(block_sizes(1000, 0.7), [1, 14]);
    for (slots, sizes) in [(10 * whiteness::FEWEST, &[1, 10][..]), (10 * whiteness::FEWEST - 1, &[1])] {
        assert_eq!(block_sizes(slots, 1.0), sizes, "{slots}");
    }
}
