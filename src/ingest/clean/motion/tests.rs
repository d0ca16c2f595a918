use super::*;
use crate::ingest::clean::quantization;
use crate::ingest::columns::rate_unit;
use crate::math::random::Stream;
use statrs::distribution::{Binomial, DiscreteCDF};

/// A log at rest: warm-up, white noise, random walk of the bias; rad/s.
struct Rest {
    angle_random_walk: f64,
    rate_random_walk: f64,
    c1: f64,
    time_constant_s: f64,
    step_s: f64,
    samples: usize,
}

impl Rest {
    fn draw(&self, s: &mut Stream) -> (Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..self.samples).map(|i| i as f64 * self.step_s).collect();
        let mut bias = 0.003;
        let rate = time
            .iter()
            .map(|t| {
                bias += self.rate_random_walk * self.step_s.sqrt() * s.normal();
                let white = self.angle_random_walk / self.step_s.sqrt() * s.normal();
                bias - self.c1 * (-t / self.time_constant_s).exp_m1() + white
            })
            .collect();
        (time, rate)
    }
}

fn found(time: &[f64], rate: &[f64]) -> Motion {
    let step = time[1] - time[0];
    let q = quantization::step(rate);
    let noise = rate_unit::noise_std(rate).max(q.unwrap_or(0.0) / 12f64.sqrt());
    detect(&TimeAxis::Explicit(time.to_vec()), rate, step, noise, q)
}

fn typical() -> Rest {
    Rest {
        angle_random_walk: 1e-4,
        rate_random_walk: 3e-6,
        c1: 5e-3,
        time_constant_s: 200.0,
        step_s: 0.01,
        samples: 60_000,
    }
}

#[test]
fn logs_at_rest_do_not_move() {
    let logs = 300;
    let mut s = Stream::new(11, 0);
    let mut alarms = 0;
    for _ in 0..logs {
        let between = |low: f64, high: f64, s: &mut Stream| low * (high / low).powf(s.uniform());
        let rest = Rest {
            angle_random_walk: between(1e-5, 1e-3, &mut s),
            rate_random_walk: between(1e-7, 1e-4, &mut s),
            c1: between(1e-4, 2e-2, &mut s),
            time_constant_s: between(60.0, 2000.0, &mut s),
            step_s: between(0.002, 1.0, &mut s),
            samples: 10_000,
        };
        let (time, mut rate) = rest.draw(&mut s);
        // one stray sample
        let at = (s.uniform() * 9_999.0) as usize;
        rate[at] += 0.3;
        alarms += u64::from(!found(&time, &rate).intervals.is_empty());
    }
    // the design's chance per log, and what it allows in so many logs with a probability of 99.9 %
    let most = Binomial::new(FALSE_ALARM, logs).unwrap().inverse_cdf(0.999);
    assert!(alarms <= most, "{alarms} false alarms, at most {most}");
}

#[test]
fn coarse_lattices_do_not_move() {
    let mut s = Stream::new(12, 0);
    for steps_per_std in [0.2, 1.0, 5.0] {
        let (time, rate) = typical().draw(&mut s);
        let q = steps_per_std * 1e-3;
        let rate: Vec<f64> = rate.iter().map(|x| (x / q).round() * q).collect();
        assert_eq!(found(&time, &rate).intervals, [], "step of {q}");
    }
}

#[test]
fn a_bias_step_is_no_motion() {
    let mut s = Stream::new(13, 0);
    for step in [0.003, 0.02] {
        let (time, mut rate) = typical().draw(&mut s);
        rate[31_234..].iter_mut().for_each(|x| *x += step);
        // the window on the step itself may count as motion
        assert!(found(&time, &rate).total_s < 3.0, "{:?}", found(&time, &rate));
    }
}

#[test]
fn moved_stretches_are_found() {
    type Change = fn(f64, &mut Stream) -> f64;
    let changes: [(&str, Change); 4] = [
        ("slow turn", |_, _| 0.01),
        ("fast turn", |_, _| 1.5),
        ("push", |u, _| 0.05 * (20.0 * u).sin()),
        ("vibration", |_, s| 0.006 * s.normal()),
    ];
    let mut s = Stream::new(14, 0);
    for (name, change) in changes {
        for (start_s, end_s) in [(100.0, 103.0), (350.0, 380.0), (0.0, 6.0), (592.0, 599.99)] {
            if name == "slow turn" && (start_s == 0.0 || end_s > 599.0) {
                continue; // not told from a bias step: the module's header says so
            }
            let (time, mut rate) = typical().draw(&mut s);
            for (t, x) in time.iter().zip(&mut rate).filter(|p| (start_s..=end_s).contains(p.0)) {
                *x += change((t - start_s) / (end_s - start_s), &mut s);
            }
            let motion = found(&time, &rate);
            let covers = motion.intervals.iter().any(|i| i.start_s <= start_s + 0.3 && i.end_s >= end_s - 0.3);
            let inside = motion.intervals.iter().all(|i| i.start_s >= start_s - 2.0 && i.end_s <= end_s + 2.0);
            assert!(covers && inside, "{name} {start_s}: {:?}", motion.intervals);
            let within = motion.intervals.iter().any(|i| (i.start_s..=i.end_s).contains(&(start_s + 1.0)));
            assert!(within && motion.samples as f64 >= (end_s - start_s - 0.6) / 0.01);
        }
    }
}

#[test]
fn a_log_that_is_still_being_set_down_moves_at_its_start() {
    let mut s = Stream::new(15, 0);
    let (time, mut rate) = typical().draw(&mut s);
    for (t, x) in time.iter().zip(&mut rate).filter(|p| *p.0 < 5.0) {
        *x += 0.2 * (3.0 * t).sin() + 0.05 * s.normal();
    }
    let motion = found(&time, &rate);
    assert_eq!(motion.intervals.len(), 1, "{motion:?}");
    assert!(motion.intervals[0].start_s == 0.0 && (5.0..7.0).contains(&motion.intervals[0].end_s), "{motion:?}");
}

#[test]
fn a_gap_in_a_fast_warm_up_is_no_motion() {
    let mut s = Stream::new(16, 0);
    let rest = Rest { c1: 2e-2, time_constant_s: 60.0, angle_random_walk: 1e-5, ..typical() };
    let (time, rate) = rest.draw(&mut s);
    let keep = |i: &usize| !(2_000..6_000).contains(i);
    let time: Vec<f64> = (0..time.len()).filter(keep).map(|i| time[i]).collect();
    let rate: Vec<f64> = (0..rate.len()).filter(keep).map(|i| rate[i]).collect();
    assert_eq!(found(&time, &rate).intervals, []);
}

#[test]
fn too_few_windows_are_not_assessed() {
    let time: Vec<f64> = (0..60).map(f64::from).collect();
    let rate: Vec<f64> = time.iter().map(|t| t.sin()).collect();
    assert!(!found(&time, &rate).assessed);
}
