use super::gate::gate;
use super::replay::{Replayed, shrinkage};
use crate::error::ErrorKind;
use crate::math::random::Stream;
use crate::signal::{Log, TimeAxis, names};

const ROWS: usize = 4000;
const STEP_S: f64 = 0.01;

fn log(channels: &[(&str, Vec<f64>)], begin_s: f64) -> Log {
    let mut log = Log::new("log", TimeAxis::Uniform { start_s: begin_s, step_s: STEP_S, len: channels[0].1.len() });
    channels.iter().for_each(|(name, values)| log.push(*name, values.clone()).unwrap());
    log
}

/// A wheel's speed with noise: motion of a period of 7 s, times `gain`.
fn wheel(gain: f64, noise: f64, seed: u64) -> Vec<f64> {
    let mut draw = Stream::new(seed, 0);
    (0..ROWS).map(|k| gain * 10.0 * (0.9 * k as f64 * STEP_S).sin() + noise * draw.normal()).collect()
}

fn error(wheel: Vec<f64>) -> Replayed {
    // the recording's clock begins elsewhere
    let recording = log(&[(names::WHEEL_LEFT, self::wheel(1.0, 0.02, 1))], 77.0);
    Replayed::of(&recording, &log(&[(names::WHEEL_LEFT, wheel)], 0.0)).unwrap()
}

#[test]
fn half_of_a_bias_gone_closes_three_quarters() {
    let moved = |by: f64, seed| error(wheel(1.0, 0.03, seed).iter().map(|w| w + by).collect());
    let (before, after) = (moved(0.2, 2), moved(0.1, 2));
    let told = shrinkage(&before, &before, &after);
    // noise of both logs √(0.02² + 0.03²); the bias is known to that over √n, its square to 2·0.2 times it: share of 0.2²
    let noise = 0.02_f64.hypot(0.03);
    let std = 2.0 * noise / 0.2 / (ROWS as f64).sqrt();
    let closed = told.closed.unwrap();
    assert!((closed - 0.75).abs() < 4.0 * std, "{closed} ± {std}");
    let [low, high] = told.ci95.unwrap();
    assert!(told.shrinks && low < 0.75 && 0.75 < high && high - low < 8.0 * std, "{low} to {high}");
    let channel = &told.channels[0];
    // a median of overlapping differences: relative standard deviation below 1.5/√n
    assert!((channel.noise_std / noise - 1.0).abs() < 6.0 / (ROWS as f64).sqrt(), "{channel:?}");
    assert!((channel.rms_before - 0.2_f64.hypot(noise)).abs() < 4.0 * noise / (ROWS as f64).sqrt(), "{channel:?}");
}

#[test]
fn the_true_model_closes_all_beyond_the_noise() {
    let (before, after) = (error(wheel(1.1, 0.02, 2)), error(wheel(1.0, 0.02, 3)));
    let told = shrinkage(&before, &before, &after);
    // gap over noise: (1²/2)/(2·0.02²) = 625; after, mean r²/σ² is 1 ± √(2/n) and the noise is known to 2·1.5/√n
    let std = (2.0_f64.sqrt() + 3.0) / (ROWS as f64).sqrt() / 625.0;
    let closed = told.closed.unwrap();
    assert!((closed - 1.0).abs() < 4.0 * std, "{closed} ± {std}");
    assert!(told.shrinks && told.ci95.unwrap()[0] > 0.99, "{told:?}");
}

#[test]
fn another_draw_of_the_noise_is_no_shrinkage() {
    let runs = 200;
    let pairs = (0..runs)
        .filter(|k| {
            let [a, b] = [1000 + 2 * k, 1001 + 2 * k].map(|seed| error(wheel(1.01, 0.02, seed)));
            shrinkage(&a, &a, &b).shrinks
        })
        .count();
    // binomial of 2.5 %: mean 5, standard deviation 2.2
    assert!(pairs <= 14, "{pairs} of {runs}");
}

/// A circle at 0.8 m/s and 0.5 rad/s, the way times `gain`; a pose each tenth row, from this pose on.
fn circle(gain: f64, [x, y, heading]: [f64; 3]) -> Log {
    let at = |k: usize| 0.5 * k as f64 * STEP_S;
    let radius = gain * 0.8 / 0.5;
    let only = |k: usize, v: f64| if k.is_multiple_of(10) { v } else { f64::NAN };
    let of = |f: &dyn Fn(f64) -> f64| (0..ROWS).map(|k| only(k, f(at(k)))).collect::<Vec<f64>>();
    log(
        &[
            (names::X, of(&|a| x + radius * ((heading + a).sin() - heading.sin()))),
            (names::Y, of(&|a| y - radius * ((heading + a).cos() - heading.cos()))),
            // headings of two turns apart are one
            (names::HEADING, of(&|a| (heading + a).rem_euclid(std::f64::consts::TAU))),
        ],
        0.0,
    )
}

#[test]
fn displacements_know_neither_place_nor_heading_of_the_start() {
    let recording = circle(1.0, [0.0; 3]);
    let same = Replayed::of(&recording, &circle(1.0, [5.0, -3.0, 2.5])).unwrap();
    let longer = Replayed::of(&recording, &circle(1.02, [5.0, -3.0, 2.5])).unwrap();
    let told = shrinkage(&longer, &longer, &same);
    let rms: Vec<(f64, f64)> = told.channels.iter().map(|c| (c.rms_before, c.rms_after)).collect();
    // over 1 s: R sin 0.5 ahead, R (1 - cos 0.5) to the left
    for (rms, way) in rms.iter().zip([1.6 * 0.5_f64.sin(), 1.6 * (1.0 - 0.5_f64.cos()), 0.0]) {
        assert!((rms.0 - 0.02 * way).abs() < 1e-9 && rms.1 < 1e-9, "{rms:?}");
    }
    assert!(told.shrinks && (told.closed.unwrap() - 1.0).abs() < 1e-6, "{told:?}");
}

#[test]
fn what_does_not_help_is_left_out_and_stand_ins_are_not_both_lost() {
    let before = error(wheel(1.1, 0.02, 2));
    // a and b each do the same, c does harm
    let run = |effects: &[(&str, ())]| {
        let has = |id| effects.iter().any(|(e, ())| *e == id);
        let gain = if has("a") || has("b") { 1.0 } else { 1.1 };
        Ok(error(wheel(gain + if has("c") { 0.03 } else { 0.0 }, 0.02, 2)))
    };
    let told = gate(&before, vec![("a", ()), ("b", ()), ("c", ())], run).unwrap();
    assert_eq!((told.kept.len(), told.dropped.len(), told.dropped[0].effect.as_str()), (1, 2, "c"), "{told:?}");
    assert!(told.shrinkage.unwrap().closed.unwrap() > 0.99);
    let told = gate(&before, vec![("c", ())], run).unwrap();
    assert!(told.kept.is_empty() && told.dropped[0].adds.unwrap() < 0.0, "{told:?}");
    assert_eq!(gate(&before, vec![], run).unwrap().shrinkage, None);
}

#[test]
fn logs_that_cannot_be_compared_are_refused() {
    let recording = log(&[(names::WHEEL_LEFT, wheel(1.0, 0.02, 1))], 0.0);
    let refused = |recording: &Log, simulated: &Log| Replayed::of(recording, simulated).unwrap_err();
    let short = log(&[(names::WHEEL_LEFT, vec![0.0; ROWS / 2 - 10])], 0.0);
    assert_eq!(refused(&recording, &short).kind, ErrorKind::TooShort);
    assert!(refused(&recording, &log(&[(names::WHEEL_LEFT, vec![0.0; ROWS])], 1e9)).to_string().contains("count"));
    assert_eq!(refused(&recording, &log(&[("odo", vec![0.0; ROWS])], 0.0)).kind, ErrorKind::Column);
    assert_eq!(refused(&short, &recording).kind, ErrorKind::TooShort);
}
