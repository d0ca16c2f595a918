//! Noise terms estimated from simulated logs: each comes back, intervals cover, the fit's p value is uniform, and a warm-up does
//! not pass for a random walk.
//!
//! `cargo test --release --test noise -- --ignored --nocapture` runs the study of 2000 logs and prints its figures.

mod allan_family;
#[path = "../common/cases.rs"]
mod cases;
mod command;
mod logs;
mod many;
#[path = "../common/place.rs"]
mod place;
mod shape;
mod study;

use gyroid::identify::terms::{Explanation, NoiseModel, TermOptions, WarmUpRemoval, noise_model};
use gyroid::noise::TermKind;
use logs::{Truth, simulated, time};

fn options() -> TermOptions {
    TermOptions { draws: 19, ..TermOptions::default() }
}

fn estimate(truth: &Truth, seed: u64) -> NoiseModel {
    noise_model(&time(truth), &simulated(truth, seed), None, &options()).unwrap()
}

/// The terms that were simulated are those that are found, each within four standard deviations.
fn comes_back(truth: &Truth) {
    let model = estimate(truth, 1);
    let found: Vec<TermKind> = model.terms.iter().map(|t| t.id).collect();
    assert_eq!(found, truth.kinds(), "{:#?}", model.selection.iter().take(3).collect::<Vec<_>>());
    for term in &model.terms {
        let wanted = truth.size(term.id);
        let error = (term.estimate.abs() - wanted).abs();
        assert!(error < 4.0 * term.std, "{:?}: {} ± {}, truth {wanted}", term.id, term.estimate, term.std);
        let [low, high] = term.ci95;
        assert!(low < term.estimate && term.estimate < high, "{term:?}");
        if let Some(time) = term.correlation_time_s {
            let wanted = truth.correlation_time_s;
            assert!((time.estimate / wanted).ln().abs() < 4.0 * time.std / time.estimate, "{time:?}");
        }
    }
    // wavelet moments are an independent road to the same numbers
    let wavelet = model.wavelet.as_ref().unwrap();
    for (w, t) in wavelet.terms.iter().zip(&model.terms) {
        if t.id != TermKind::RateRamp {
            let spread = w.std.hypot(t.std);
            assert!((w.estimate - t.estimate).abs() < 5.0 * spread, "{w:?}\n{t:?}");
        }
    }
}

#[test]
fn white_noise_alone_is_found_alone() {
    comes_back(&Truth::white());
}

#[test]
fn quantisation_comes_back() {
    comes_back(&Truth { quantization: 5.8e-5, ..Truth::white() });
}

#[test]
fn bias_instability_comes_back() {
    comes_back(&Truth { bias_instability: 4e-5, ..Truth::white() });
}

#[test]
fn a_random_walk_comes_back() {
    comes_back(&Truth { rate_random_walk: 3.5e-6, ..Truth::white() });
}

#[test]
fn a_ramp_comes_back() {
    comes_back(&Truth { rate_ramp: 3e-8, ..Truth::white() });
}

#[test]
fn a_gauss_markov_term_comes_back() {
    comes_back(&Truth { gauss_markov: 1.1e-4, correlation_time_s: 10.0, ..Truth::white() });
}

#[test]
fn three_terms_come_back_together() {
    comes_back(&Truth { quantization: 5.8e-5, rate_random_walk: 3.5e-6, ..Truth::white() });
}

#[test]
fn a_term_that_is_not_there_is_refused_with_a_bound_and_advice() {
    let model = estimate(&Truth::white(), 3);
    let walk = model.refused.iter().find(|r| r.id == TermKind::RateRandomWalk).unwrap();
    // K = √3 N/τ with τ the length of the log is about what could be seen
    let seen = 3f64.sqrt() * 1e-4 / model.span_s;
    let upper = walk.upper95.unwrap();
    assert!(upper > 0.3 * seen && upper < 30.0 * seen, "{upper} {seen}");
    let advice = walk.advice.unwrap();
    assert!(advice.length_s.unwrap() > model.span_s && advice.longer_by_s.unwrap() > 0.0, "{advice:?}");
    assert!(walk.probability < 0.5);
}

#[test]
fn the_advised_length_is_enough() {
    let truth = Truth { rate_random_walk: 1.5e-6, warm_up: None, ..Truth::white() };
    let model = estimate(&truth, 4);
    let walk = model.term(TermKind::RateRandomWalk).unwrap();
    let advice = walk.advice.expect("this log is too short for ±20 %");
    let longer = Truth { samples: (advice.length_s.unwrap() / truth.step_s) as usize, ..truth };
    let again = estimate(&longer, 5);
    let known = again.term(TermKind::RateRandomWalk).unwrap();
    // the size that was assumed is an estimate itself: the width follows its error by less than half
    let half = 0.5 * (known.ci95[1] - known.ci95[0]) / known.estimate;
    assert!((0.14..0.28).contains(&half), "{half} after {} s", advice.length_s.unwrap());
}

#[test]
fn a_warm_up_does_not_pass_for_a_random_walk() {
    let truth = Truth { warm_up: Some([2e-3, 500.0]), ..Truth::white() };
    let rates = simulated(&truth, 6);
    let model = noise_model(&time(&truth), &rates, None, &options()).unwrap();
    assert!(model.warm_up_influence.removed);
    assert!(model.term(TermKind::RateRandomWalk).is_none(), "{:?}", model.terms);
    let w = &model.warm_up_influence;
    // left in, it makes a walk that the log without it rules out
    assert!(w.removed_is_upper_bound && w.rate_random_walk_left_in > 2.0 * w.rate_random_walk_removed, "{w:?}");
    let left = TermOptions { warm_up: WarmUpRemoval::Never, ..options() };
    let wrong = noise_model(&time(&truth), &rates, None, &left).unwrap();
    assert!(wrong.terms.len() > 1, "the warm-up must show as something");
}

#[test]
fn gaps_are_filled_and_change_little() {
    let truth = Truth { rate_random_walk: 3.5e-6, ..Truth::white() };
    let (rates, even) = (simulated(&truth, 7), time(&truth).to_vec());
    let kept: Vec<usize> = (0..rates.len()).filter(|i| !(4000..4400).contains(i) && i % 97 != 5).collect();
    let axis = gyroid::signal::TimeAxis::Explicit(kept.iter().map(|i| even[*i]).collect());
    let values: Vec<f64> = kept.iter().map(|i| rates[*i]).collect();
    let with = noise_model(&axis, &values, None, &options()).unwrap();
    assert!(with.filled > 600);
    let whole = estimate(&truth, 7);
    for term in &whole.terms {
        let other = with.term(term.id).unwrap();
        assert!(
            (other.estimate - term.estimate).abs() < 2.0 * term.std.max(0.03 * term.estimate),
            "{other:?} {term:?}"
        );
    }
}

#[test]
fn a_line_is_left_out_and_named() {
    let truth = Truth { rate_random_walk: 3.5e-6, ..Truth::white() };
    let mut rates = simulated(&truth, 9);
    // a third of a sample's standard deviation: in the spectrum it stands alone
    let tone = |i: usize| 1e-4 * (std::f64::consts::TAU * 1.2345 * 0.1 * i as f64).sin();
    rates.iter_mut().enumerate().for_each(|(i, v)| *v += tone(i));
    let model = noise_model(&time(&truth), &rates, None, &options()).unwrap();
    assert!((model.lines[0].frequency_hz - 1.2345).abs() < 1.0 / model.span_s, "{:?}", model.lines);
    let n = model.term(TermKind::AngleRandomWalk).unwrap();
    assert!((n.estimate - 1e-4).abs() < 4.0 * n.std, "{n:?}");
    assert_eq!(model.terms.len(), 2, "{:?}", model.terms);
    assert!(estimate(&truth, 9).lines.is_empty());
}

#[test]
fn time_and_temperature_are_told_apart_where_they_can_be() {
    let truth = Truth { rate_random_walk: 0.0, warm_up: None, ..Truth::white() };
    let axis = time(&truth);
    let (noise, span) = (simulated(&truth, 8), axis.span_s());
    let decided = |temperature: &dyn Fn(f64) -> f64, drift: &dyn Fn(f64, f64) -> f64| {
        let celsius: Vec<f64> = axis.to_vec().iter().map(|t| temperature(*t)).collect();
        let rates: Vec<f64> =
            axis.to_vec().iter().zip(&noise).zip(&celsius).map(|((t, v), c)| v + drift(*t, *c)).collect();
        noise_model(&axis, &rates, Some(&celsius), &options()).unwrap().drift.unwrap()
    };
    let warm = |t: f64| -(-t / (0.2 * span)).exp_m1();
    // the surroundings swing, the sensor's bias follows time alone, or temperature alone
    let swing = |t: f64| 25.0 + 5.0 * (9.0 * t / span).sin();
    let time_alone = decided(&swing, &|t, _| 3e-4 * warm(t));
    assert_eq!(time_alone.decided, Some(Explanation::ElapsedTime), "{time_alone:?}");
    let temperature_alone = decided(&swing, &|_, c| 1e-4 * (c - 25.0));
    assert_eq!(temperature_alone.decided, Some(Explanation::Temperature), "{temperature_alone:?}");
    // a sensor that warms itself: both say the same
    let own = decided(&|t| 25.0 + 8.0 * warm(t), &|t, _| 3e-4 * warm(t));
    assert_eq!(own.decided, None, "{own:?}");
    assert!(own.correlation > 0.99);
}

#[test]
fn logs_that_say_nothing_are_refused() {
    let truth = Truth { samples: 100, ..Truth::white() };
    let error = noise_model(&time(&truth), &simulated(&truth, 1), None, &options()).unwrap_err();
    assert!(error.to_string().contains("100 samples"), "{error}");
    let flat = vec![0.25; 1000];
    let truth = Truth { samples: 1000, ..Truth::white() };
    assert!(noise_model(&time(&truth), &flat, None, &options()).is_err());
    let bad = TermOptions { horizon_s: -1.0, ..options() };
    assert!(noise_model(&time(&truth), &simulated(&truth, 1), None, &bad).is_err());
}
