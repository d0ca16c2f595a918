use super::*;
use crate::math::random::Stream;

fn clean() -> Before {
    Before {
        rows: 0,
        duplicates: Duplicates { count: 0, first_row: None, handling: Handling::Dropped },
        out_of_order: OutOfOrder { count: 0, handling: Handling::Sorted },
        missing: Missing { count: 0, first_row: None, handling: Handling::Dropped },
    }
}

fn judged(time_s: &[f64], rate: &[f64]) -> Audit {
    judge(clean(), time_s, &TimeAxis::Explicit(time_s.to_vec()).compact(1e-6), rate)
}

fn noise(seed: u64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut s = Stream::new(seed, 0);
    ((0..n).map(|i| i as f64 * 0.01).collect(), (0..n).map(|_| 1e-3 * s.normal()).collect())
}

#[test]
fn gaps_are_counted_with_their_place() {
    let (mut time, rate) = noise(1, 1000);
    time[500..].iter_mut().for_each(|t| *t += 2.0);
    time[700..].iter_mut().for_each(|t| *t += 0.05);
    let audit = judged(&time, &rate);
    assert_eq!(audit.gaps.count, 2);
    assert!((audit.gaps.missing_s - 2.05).abs() < 1e-9);
    assert!((audit.gaps.longest_s - 2.01).abs() < 1e-9);
    assert!((audit.gaps.longest_at_s.unwrap() - 4.99).abs() < 1e-9);
    assert!((audit.sampling.rate_hz - 100.0).abs() < 1e-6);
    assert!(audit.sampling.step_std_s < 1e-9);
}

#[test]
fn stuck_values_are_found_and_noise_is_not() {
    let n = 50_000;
    // a lattice so coarse that most neighbours are equal, a fine one, and none
    for q in [3e-3, 1e-3, 1e-5, 0.0] {
        let (time, mut rate) = noise(2, n);
        if q > 0.0 {
            rate.iter_mut().for_each(|x| *x = (*x / q).round() * q);
        }
        let sound = judged(&time, &rate).stuck;
        assert_eq!(sound.runs, 0, "{q}: {sound:?}");
        let value = rate[20_000];
        rate[20_000..22_000].fill(value);
        let stuck = judged(&time, &rate).stuck;
        assert_eq!(stuck.runs, 1, "{q}: {stuck:?}");
        assert!(stuck.samples >= 2000 && (stuck.longest_at_s.unwrap() - 200.0).abs() < 0.1 + 0.01 * 20.0);
    }
}

#[test]
fn values_at_the_end_of_the_range_are_saturated() {
    let (time, mut rate) = noise(3, 5000);
    assert_eq!(judged(&time, &rate).saturation.samples, 0);
    rate[1000..1040].fill(4.36);
    rate[3000..3010].fill(-4.36);
    let found = judged(&time, &rate).saturation;
    assert_eq!(found.samples, 50);
    assert_eq!(found.limit_rad_s, Some(4.36));
    assert_eq!(found.first_at_s, Some(10.0));
}

#[test]
fn the_bias_moves_as_far_as_it_does() {
    let (time, mut rate) = noise(4, 20_000);
    for (t, x) in time.iter().zip(&mut rate) {
        *x += 0.01 * t / 200.0;
    }
    // medians of twenty stretches of a line: 19/20 of its rise; the median of 1000 scatters by 1.25σ/√1000 = 4e-5
    let rest = judged(&time, &rate).rest;
    assert!((rest.drift_rad_s - 0.0095).abs() < 5.0 * 1.42 * 4e-5, "{}", rest.drift_rad_s);
    // quartile of 400 blocks that scatter by 0.124: standard error 1.36 · 0.124/√400 = 0.0084
    assert!((rest.noise_std_rad_s / 1e-3 - 1.0).abs() < 4.0 * 0.0084, "{}", rest.noise_std_rad_s);
}

#[test]
fn long_logs_are_judged_piece_by_piece_as_in_one() {
    let n = 3 * scan::PIECE + 11;
    let (mut time, mut rate) = noise(3, n);
    // runs and gaps at, before and across the borders of pieces
    for at in [scan::PIECE - 3, 2 * scan::PIECE, 3 * scan::PIECE - 1] {
        rate[at..at + 9].fill(0.5);
        time[at..].iter_mut().for_each(|t| *t += 0.1);
    }
    let (all, one) = (Runs::of(&rate), Runs::of_piece(&rate));
    assert_eq!((all.at_least, all.longest), (one.at_least, one.longest));
    assert_eq!((all.smallest, all.largest), (one.smallest, one.largest));
    assert_eq!((all.longest, all.at_least[3]), (9, 3));
    let (sampling, gaps) = steps(&time, false);
    let one = Intervals::of(&time, sampling.median_step_s);
    assert_eq!((gaps.count, gaps.longest_s, gaps.longest_at_s), (3, one.longest_s, one.longest_at_s));
    assert!((gaps.missing_s - one.missing_s).abs() < 1e-9);
    assert_eq!(Runs::of(&[1.0; 200_000]).longest, 200_000);
}

#[test]
fn a_sensor_that_froze_is_no_rest_and_what_lives_does_not_move() {
    for q in [1e-6, 0.0] {
        let (time, mut rate) = noise(5, 40_000);
        if q > 0.0 {
            rate.iter_mut().for_each(|x| *x = (*x / q).round() * q);
        }
        let last = rate[20_000];
        rate[20_000..].fill(last);
        let audit = judged(&time, &rate);
        assert!(audit.motion.assessed && audit.motion.intervals.is_empty(), "{:?}", audit.motion);
        assert!((audit.rest.noise_std_rad_s / 1e-3 - 1.0).abs() < 0.05, "{}", audit.rest.noise_std_rad_s);
        let told = audit.findings().into_iter().find(|f| f.contains("stuck")).unwrap();
        assert!(told.ends_with("the sensor froze from 200.0 to 400.0 s: cut the log there"), "{told}");
        // and motion before it is motion
        rate[5000..5500].iter_mut().for_each(|x| *x += 0.5);
        assert_eq!(judged(&time, &rate).motion.intervals.len(), 1);
    }
}
