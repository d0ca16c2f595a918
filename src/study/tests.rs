use super::*;
use crate::config::Config;
use crate::math::distributions::chi_squared_interval95;
use crate::simulate::Course;
use crate::traction::Surface;
use std::collections::BTreeSet;

fn setup(surface: Surface, course: Course, runs: usize) -> Setup {
    let config = Config::parse(DEFAULT_CONFIG, "study.toml").unwrap();
    let estimators = Estimator::FILTERS.to_vec();
    Setup { runs, estimators, ..Setup::new(config, course).on(surface) }
}

fn quick(setup: &Setup) -> Study {
    study(setup, |_| {}).unwrap()
}

#[test]
fn where_wheels_slip_the_filter_with_slip_wins_every_run_and_knows_how_well() {
    // driven to the limit of snow and far beyond that of ice
    for surface in [Surface::Ice, Surface::Snow] {
        let s = quick(&Setup { duration_s: 30.0, ..setup(surface, Course::Brisk, 40) });
        let c = s.compare(Estimator::Slip, Estimator::Rolling).unwrap();
        assert!(c.won.iter().all(|w| *w >= 0.95), "{} {c:?}", surface.name());
        assert!(c.factor_ci95.iter().all(|ci| ci[0] > 10.0), "{} {c:?}", surface.name());
        let slip = s.of(Estimator::Slip).unwrap();
        let nees = slip.nees.as_ref().unwrap();
        // 40 runs of three degrees of freedom, all times taken as one: the widest that the mean can spread, once in 10⁶
        let degrees: f64 = 3.0 * 40.0;
        let reach = 4.9 * (2.0 * degrees).sqrt();
        assert!((nees.mean * 40.0 - degrees).abs() < reach, "{} {}", surface.name(), nees.mean);
        assert_eq!(nees.bounds95, chi_squared_interval95(degrees).map(|x| x / 40.0));
        // 3 readings of 3001 rows in 40 runs, variance 2 each; white innovations
        let nis = slip.nis_mean.unwrap();
        assert!((nis - 1.0).abs() < 4.9 * (2.0 / (3.0 * 3001.0 * 40.0f64)).sqrt(), "{} {nis}", surface.name());
        assert!(s.of(Estimator::Rolling).unwrap().nees.as_ref().unwrap().inside < 0.1);
    }
}

#[test]
fn where_wheels_grip_slip_costs_nothing() {
    let s = quick(&Setup { duration_s: 30.0, ..setup(Surface::DryAsphalt, Course::Square, 40) });
    let c = s.compare(Estimator::Slip, Estimator::Rolling).unwrap();
    assert!(c.factor.iter().all(|f| *f > 1.0 / 1.05), "{c:?}");
}

#[test]
fn the_sigma_points_agree_with_the_filter() {
    let mut setup = Setup { duration_s: 10.0, ..setup(Surface::Snow, Course::Brisk, 4) };
    setup.estimators = vec![Estimator::Slip, Estimator::SlipUnscented];
    let s = quick(&setup);
    let of = |e| s.of(e).unwrap();
    let (slip, unscented) = (of(Estimator::Slip), of(Estimator::SlipUnscented));
    for i in 0..3 {
        let ratio = slip.rms[i] / unscented.rms[i];
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    }
    assert!((slip.nis_mean.unwrap() - unscented.nis_mean.unwrap()).abs() < 0.005);
}

#[test]
fn the_error_model_is_what_keeps_the_heading() {
    let mut setup = Setup { duration_s: 30.0, ..setup(Surface::DryAsphalt, Course::Square, 8) };
    setup.estimators = Estimator::ALL.to_vec();
    setup.estimators.retain(|e| *e != Estimator::SlipUnscented);
    let s = quick(&setup);
    let heading = |e| s.of(e).unwrap().rms[2];
    // e(t) is about 8e-3 - 2.4e-3 (1 - exp(-t/240)) rad/s, known to its repeatability of 2e-4 and 3 %
    assert!(heading(Estimator::GyroReckoning) > 10.0 * heading(Estimator::GyroReckoningModelled));
    assert!(heading(Estimator::SlipWithoutErrorModel) > 10.0 * heading(Estimator::Slip));
    assert!(heading(Estimator::GyroReckoningZeroed) < heading(Estimator::GyroReckoning));
    // the raw gyro drifts by the integral of e
    let gyro = setup.truth.gyro.as_ref().unwrap().warm_up();
    let drift: f64 = (0..3000).map(|k| 0.01 * gyro.error_rad_s(20.0 + 0.01 * f64::from(k))).sum();
    let end = s.of(Estimator::GyroReckoning).unwrap().rms_end[2];
    // turn-on 2e-4 rad/s over 30 s, 3 % of C1, over eight runs; white noise 1.5e-4 √30
    assert!((end - drift.abs()).abs() < 5.0 * 0.007 / 8f64.sqrt(), "{end} {drift}");
}

#[test]
fn same_seed_same_numbers_on_one_thread_or_many() {
    let setup = Setup { duration_s: 3.0, ..setup(Surface::Snow, Course::Brisk, 5) };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| quick(&setup))
    };
    assert_eq!(on(1), on(3));
    assert_ne!(quick(&setup).estimators, quick(&Setup { seed: 2, ..setup }).estimators);
}

#[test]
fn neighbouring_seeds_share_no_run() {
    let seeds = |seed: u64| {
        let setup = Setup { seed, ..setup(Surface::Ice, Course::Brisk, 1) };
        (0..1000).map(move |i| setup.run_seed(i)).collect::<Vec<_>>()
    };
    let all: BTreeSet<u64> = (0..20).flat_map(seeds).collect();
    assert_eq!(all.len(), 20_000);
}

#[test]
fn intervals_of_the_rms_cover_what_they_say() {
    // mean squares of runs are drawn from an exponential law of mean one: the RMS is one
    let mut stream = crate::math::random::Stream::new(5, 0);
    let (draws, n) = (2000, 100);
    let covered = (0..draws)
        .filter(|_| {
            let values: Vec<f64> = (0..n).map(|_| -(1.0 - stream.uniform()).ln()).collect();
            let mean = values.iter().sum::<f64>() / f64::from(n);
            let spread = statistics::spread_of_log_mean(values.iter().copied());
            mean.ln().abs() < crate::math::NORMAL_975 * spread
        })
        .count();
    // binomial, five standard errors; the delta method loses about a percent at a hundred runs
    let part = covered as f64 / f64::from(draws);
    assert!((part - 0.945).abs() < 5.0 * (0.05 * 0.95 / f64::from(draws)).sqrt(), "{part}");
}

#[test]
fn rms_settles_with_the_number_of_runs() {
    let s = quick(&Setup { duration_s: 2.0, ..setup(Surface::Snow, Course::Brisk, 60) });
    let counts = convergence(&s, Estimator::Slip);
    assert_eq!(counts.iter().map(|c| c.runs).collect::<Vec<_>>(), [10, 20, 50, 60]);
    let slip = s.of(Estimator::Slip).unwrap();
    // the squares of roots are the squares but for rounding
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
    assert!((0..3).all(|i| close(counts[3].rms[i], slip.rms[i])));
    assert!((0..3).all(|i| (0..2).all(|k| close(counts[3].rms_ci95[i][k], slip.rms_ci95[i][k]))));
    assert!(convergence(&s, Estimator::DeadReckoning).is_empty());
}

#[test]
fn wrong_beliefs_show() {
    let beliefs = wrong_beliefs(&Setup { duration_s: 8.0, ..setup(Surface::Ice, Course::Brisk, 4) }, |_| {}).unwrap();
    assert_eq!(beliefs.len(), 2 * FACTORS.len());
    let right = &beliefs[3];
    assert_eq!((right.friction_factor, right.stiffness_factor), (1.0, 1.0));
    // half the friction: the body is believed to gain half the speed
    assert!(beliefs[0].nis_mean > 2.0 * right.nis_mean && beliefs[0].rms[0] > 3.0 * right.rms[0], "{beliefs:?}");
}

#[test]
fn what_cannot_be_studied_is_refused() {
    let text = |s: Setup| study(&s, |_| {}).unwrap_err().to_string();
    let good = setup(Surface::Ice, Course::Brisk, 1);
    assert!(text(Setup { runs: 0, ..good.clone() }).contains("runs"));
    assert!(text(Setup { estimators: Vec::new(), ..good.clone() }).contains("estimators"));
    let mut rolling = good.clone();
    rolling.believed.traction = None;
    assert!(text(rolling).contains("[traction]"));
    assert!(text(Setup { duration_s: 0.0, ..good }).contains("duration"));
}
