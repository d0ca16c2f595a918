use super::*;
use crate::bias::WarmUp;
use crate::config::Config;
use crate::math::random::Stream;

const GYRO: &str = "schema = 1\nsample_time_s = 0.05\n[gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\n\
    angle_random_walk_rad_sqrt_s = 1.5e-4\nturn_on_bias_std_rad_s = 4e-4\nwarm_up_relative_std = 0.05\n";
const NOISE: &str = "[gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 2e-6\n\
    [gyro.noise.terms.gauss_markov_rad_s]\nestimate = 1e-4\nstd = 1e-5\nci95 = [8e-5, 1.2e-4]\ncorrelation_time_s = 150.0\n";
const STEP_S: f64 = 0.05;

fn config(more: &str) -> Config {
    Config::parse(&format!("{GYRO}{more}"), "gyroid.toml").unwrap()
}

fn ns(t_s: f64) -> i64 {
    (t_s * 1e9).round() as i64
}

fn begun(config: &Config, settings: Settings, start: &Start<'_>) -> Corrector {
    Corrector::new(config, settings, start).unwrap().0
}

/// A gyro as the configuration describes it, drawn anew at each power-on.
struct Gyro {
    model: WarmUp,
    walk: f64,
    markov: f64,
    rocking: f64,
    draw: Stream,
}

impl Gyro {
    fn new(run: u64) -> Self {
        let mut draw = Stream::new(11, run);
        let c1_rad_s = -2.4e-3 * (1.0 + 0.05 * draw.normal());
        let c2_rad_s = 8e-3 + 4e-4 * draw.normal();
        let model = WarmUp { c1_rad_s, c2_rad_s, time_constant_s: 240.0 * (1.0 + 0.05 * draw.normal()) };
        let markov = 1e-4 * draw.normal();
        Self { model, walk: 0.0, markov, rocking: 0.0, draw }
    }

    fn step(&mut self, k: u32) {
        self.walk += 2e-6 * STEP_S.sqrt() * self.draw.normal();
        let phi = (-STEP_S / 150.0).exp();
        self.markov = phi * self.markov + 1e-4 * (1.0 - phi * phi).sqrt() * self.draw.normal();
        if k.is_multiple_of(10) {
            self.rocking = 1e-4 * self.draw.normal();
        }
    }

    fn bias(&self, t_s: f64) -> f64 {
        self.model.error_rad_s(t_s) + self.walk + self.markov
    }

    fn read(&mut self, t_s: f64, rate: f64) -> f64 {
        let rocks = if rate == 0.0 { self.rocking } else { 0.0 };
        rate + rocks + self.bias(t_s) + 1.5e-4 / STEP_S.sqrt() * self.draw.normal()
    }
}

/// Rests of 15 s in each minute; else it turns to and fro.
fn rate(t_s: f64) -> f64 {
    let phase = t_s.rem_euclid(60.0);
    if phase < 15.0 { 0.0 } else { 0.4 * (0.7 * t_s).sin() }
}

/// Mean NEES over runs at each of the minutes, and the mean NIS of all.
fn consistency(settings: Settings, runs: u64) -> (Vec<f64>, f64, f64) {
    let config = config(NOISE);
    let (mut nees, mut nis, mut std_end) = (vec![0.0; 5], 0.0, 0.0);
    for run in 0..runs {
        let mut gyro = Gyro::new(run);
        let mut corrector = begun(&config, settings, &Start::default());
        for k in 1..=6000_u32 {
            let t = STEP_S * f64::from(k);
            gyro.step(k);
            if settings.wheels {
                corrector.wheels(rate(t) == 0.0, t);
            }
            let reading = gyro.read(t, rate(t));
            let got = corrector.sample(ns(t), t, reading);
            if k % 1200 == 0 {
                let error = (got.bias_rad_s - gyro.bias(t)) / got.bias_std_rad_s;
                nees[(k / 1200 - 1) as usize] += error * error / runs as f64;
                std_end = got.bias_std_rad_s;
            }
        }
        nis += corrector.nis().unwrap().mean / runs as f64;
    }
    (nees, nis, std_end)
}

#[test]
fn the_covariance_is_honest_by_the_wheels_and_by_the_rate_alone() {
    for wheels in [true, false] {
        let runs = 300;
        let (nees, nis, std) = consistency(Settings { wheels, ..Settings::default() }, runs);
        // five standard errors of a mean of chi-squared; the model is linearised in T
        let bound = 5.0 * (2.0 / runs as f64).sqrt();
        assert!(nees.iter().all(|n| (n - 1.0).abs() < bound), "{wheels} {nees:?}");
        // the rocking of half a second falls into two blocks, and moves their means by less than is allowed for
        assert!(0.85 < nis && nis < 1.05, "{wheels} {nis}");
        // and rest does teach: the spread between power-ons is 4e-4 rad/s
        assert!(std < 1.2e-4, "{std}");
    }
}

#[test]
fn a_clock_that_is_set_changes_nothing_but_the_flag() {
    let config = config("");
    let mut corrector = begun(&config, Settings::default(), &Start::default());
    let mut gyro = Gyro::new(1);
    let mut last = None;
    for k in 1..=2400_u32 {
        let t = STEP_S * f64::from(k);
        // an hour forward, then two back
        let set = [0.0, 3600.0, -3600.0][(k / 800).min(2) as usize];
        let got = corrector.sample(ns(t + set), t, gyro.read(t, 0.0));
        let expected = [(800, Stamped::JumpedForward), (1600, Stamped::JumpedBack)];
        let stamped = expected.iter().find(|(at, _)| *at == k).map_or(Stamped::Steady, |(_, s)| *s);
        assert_eq!(got.flags.stamped, stamped, "{k}");
        assert!((got.age_s - t).abs() < 1e-9);
        if let Some(before) = last.replace(got) {
            assert!(got.bias_std_rad_s <= before.bias_std_rad_s * 1.01, "{k}");
        }
    }
}

#[test]
fn what_is_no_number_passes_through_and_teaches_nothing() {
    let config = config("");
    let mut corrector = begun(&config, Settings { wheels: true, ..Settings::default() }, &Start::default());
    let mut gyro = Gyro::new(2);
    for k in 1..=400_u32 {
        let t = STEP_S * f64::from(k);
        corrector.wheels(true, t);
        let reading = match k % 5 {
            0 => f64::NAN,
            1 => f64::INFINITY,
            _ => gyro.read(t, 0.0),
        };
        let got = corrector.sample(ns(t), t, reading);
        assert_eq!(got.flags.not_finite, k % 5 < 2);
        assert!(got.bias_rad_s.is_finite() && got.bias_std_rad_s.is_finite());
        // the same stamp again
        assert_eq!(corrector.sample(ns(t), t, 9.0).flags.stamped, Stamped::Repeated);
    }
    let ([learnt, _], std) = (corrector.blocks(), corrector.sample(ns(20.05), 20.05, 0.0).bias_std_rad_s);
    assert!(learnt > 20 && std < 2e-4, "{learnt} {std}");
}

#[test]
fn learning_is_switched_off_and_on_and_what_was_learnt_stays() {
    let config = config("");
    let settings = |no_learning| Settings { wheels: true, no_learning, ..Settings::default() };
    let mut corrector = begun(&config, settings(true), &Start::default());
    let (mut gyro, mut learnt) = (Gyro::new(3), Vec::new());
    for k in 1..=2400_u32 {
        let t = STEP_S * f64::from(k);
        corrector.wheels(true, t);
        let _ = corrector.sample(ns(t), t, gyro.read(t, 0.0));
        if k % 800 == 0 {
            learnt.push((corrector.blocks()[0], corrector.saved("boot").state));
            let (stamp_ns, arrival_s) = corrector.last_sample();
            let saved = corrector.saved("boot");
            let start = Start { stamp_ns, arrival_s, saved: Some(&saved), boot_id: "boot", ..Start::default() };
            corrector = begun(&config, settings(k != 800), &start).in_place_of(Some(&corrector));
        }
    }
    let [(none, _), (some, taught), (no_more, kept)] = learnt.try_into().unwrap();
    assert!(none == 0 && some > 20 && no_more == some, "{none} {some} {no_more}");
    // the error itself goes on by the model; its asymptote and time constant are as they were taught
    assert_eq!(taught[1..], kept[1..]);
    assert!(corrector.nis().is_some());
}

#[test]
fn a_turn_with_standing_wheels_is_no_rest() {
    let config = config("");
    let mut corrector = begun(&config, Settings { wheels: true, ..Settings::default() }, &Start::default());
    for k in 1..=400_u32 {
        let t = STEP_S * f64::from(k);
        corrector.wheels(true, t);
        let _ = corrector.sample(ns(t), t, 0.3);
    }
    assert_eq!(corrector.blocks()[0], 0);
}

#[test]
fn outside_the_validity_the_reading_passes_through_and_is_known_less() {
    let valid = "[validation]\nwhite = true\nidentifiable = true\njoint_p_value = 0.4\nlevel = 0.05\naveraging_times_s = [1.0]\n\
        samples = 100\nsample_rate_hz = 20.0\nvalid_from_s = 0.0\nvalid_to_s = 10.0\ntime_constant_ci95_s = [200.0, 280.0]\n";
    let config = config(valid);
    for extrapolate in [false, true] {
        let mut corrector = begun(&config, Settings { extrapolate, ..Settings::default() }, &Start::default());
        let inside = corrector.sample(ns(5.0), 5.0, 0.1);
        let outside = corrector.sample(ns(15.0), 15.0, 0.1);
        assert!(!inside.flags.passed_through() && inside.rate_rad_s < 0.093);
        assert_eq!(outside.flags.outside_validity, !extrapolate);
        assert_eq!(outside.rate_rad_s == 0.1, !extrapolate);
        assert_eq!(outside.rate_variance_rad2_s2 > inside.rate_variance_rad2_s2 + 5e-5, !extrapolate);
    }
}

#[test]
fn by_temperature_it_waits_for_one_and_learns_the_slope() {
    let table = "[gyro.temperature]\nreference_c = 30.0\nbias_rad_s = 4e-3\nsensitivity_rad_s_k = 2e-4\n\
        [gyro.temperature.covariance]\nbias_bias_rad2_s2 = 1e-8\nbias_sensitivity_rad2_s2_k = 0.0\n\
        sensitivity_sensitivity_rad2_s2_k2 = 1e-10\n";
    let config = config(table);
    let settings = Settings { temperature: true, wheels: true, ..Settings::default() };
    let mut corrector = begun(&config, settings, &Start::default());
    assert!(corrector.sample(0, 0.0, 0.1).flags.no_temperature);
    let mut draw = Stream::new(5, 0);
    let mut got = None;
    for k in 1..=8000_u32 {
        let t = STEP_S * f64::from(k);
        let temperature = 30.0 + 0.05 * t;
        corrector.temperature(temperature, t);
        corrector.wheels(true, t);
        // the slope is 5 % more than stated, half of its standard deviation
        let bias = 4e-3 + 2.1e-4 * (temperature - 30.0);
        got = Some((corrector.sample(ns(t), t, bias + 1.5e-4 / STEP_S.sqrt() * draw.normal()), bias));
    }
    let (got, bias) = got.unwrap();
    assert!((got.bias_rad_s - bias).abs() < 4.0 * got.bias_std_rad_s && got.bias_std_rad_s < 1e-4, "{got:?} {bias}");
    // old temperatures are none
    assert!(corrector.sample(ns(500.0), 500.0, 0.1).flags.no_temperature);
}

#[test]
fn a_restart_keeps_how_warm_it_was() {
    let config = config("cooling_time_constant_s = 600.0\n");
    let mut corrector = begun(&config, Settings::default(), &Start::default());
    let mut gyro = Gyro::new(3);
    for k in 1..=6000_u32 {
        let t = STEP_S * f64::from(k);
        let _ = corrector.sample(ns(t), t, gyro.read(t, 0.0));
    }
    let before = corrector.sample(ns(300.05), 300.05, 0.0);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("state.json");
    assert_eq!(Saved::read(&path).unwrap(), None);
    corrector.saved("boot 1").write(&path).unwrap();
    let saved = Saved::read(&path).unwrap().unwrap();
    assert!((saved.warm_up_age_s - 300.05).abs() < 1e-6);
    let start = |boot_id: &'static str, stamp_s: f64| {
        let start = Start { stamp_ns: ns(stamp_s), boot_id, saved: Some(&saved), ..Start::default() };
        let mut again = begun(&config, Settings::default(), &start);
        again.sample(ns(stamp_s), 0.0, 0.0)
    };
    // the program alone was restarted
    let on = start("boot 1", 310.05);
    assert!((on.age_s - 310.05).abs() < 1e-6 && (on.bias_rad_s - before.bias_rad_s).abs() < 1e-4);
    assert!(on.bias_std_rad_s < 1.1 * before.bias_std_rad_s);
    // the robot was off for five minutes
    let off = start("boot 2", 600.05);
    let restart = crate::bias::Restart::new(saved.warm_up_age_s, 300.0, Some(600.0)).unwrap();
    assert!((off.age_s - restart.age_s(240.0)).abs() < 1e-6 && off.bias_std_rad_s > 3e-4);
    // its clock was not set: cold
    assert_eq!(start("boot 2", 1.0).age_s, 0.0);
    // under another configuration the age counts and what was learnt does not
    std::fs::write(&path, "{}").unwrap();
    assert!(Saved::read(&path).unwrap_err().to_string().contains("delete it"));
}
