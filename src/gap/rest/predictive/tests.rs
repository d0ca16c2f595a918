use super::*;
use crate::bias::WarmUp;
use crate::gap::rest::state_space::{Coefficient, Markov, Outliers};
use crate::signal::TimeAxis;

const ROWS: usize = 12_000;
const STEP_S: f64 = 0.1;
const WHITE_RAD_S: f64 = 5e-4;

/// Twenty minutes; the temperature rises by 8 °C and swings by 3 °C, the supply swings by 0.1 V.
fn scene() -> Scene {
    let t = |i: usize| i as f64 * STEP_S;
    let temperature = |i: usize| 25.0 + 8.0 * (1.0 - (-t(i) / 400.0).exp()) + 3.0 * (t(i) / 110.0).sin();
    Scene {
        time: TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: ROWS },
        step_s: STEP_S,
        temperature_c: Some((0..ROWS).map(temperature).collect()),
        power_on_temperature_c: None,
        supply_v: Some((0..ROWS).map(|i| 5.0 + 0.1 * (t(i) / 37.0).cos()).collect()),
        warm_up: WarmUp { c1_rad_s: 2e-3, c2_rad_s: -4e-3, time_constant_s: 200.0 },
        white_std_rad_s: WHITE_RAD_S,
        turn_on_bias_std_rad_s: 2e-4,
        warm_up_relative_std: 0.03,
    }
}

fn of(curves: &[Curve], over: Over, shown: Shown) -> &Curve {
    curves.iter().find(|c| c.over == over && c.shown == shown).unwrap()
}

/// Summary that a failing test prints.
fn told(curves: &[Curve]) -> String {
    let one = |c: &Curve| {
        let out = [c.outside_before, c.outside_after].map(|v| (100.0 * v).round());
        format!("{:?} {:?}: share {:.2} outside {out:?} % most {:?}\n", c.over, c.shown, c.share, c.most_in)
    };
    curves.iter().map(one).collect()
}

fn largest(curves: &[Curve]) -> &Curve {
    curves.iter().max_by(|a, b| a.share.total_cmp(&b.share)).unwrap()
}

/// A recording of the nominal simulator with `added` in it, against the nominal simulator and `after`.
fn with(added: impl Fn(usize, f64) -> f64, after: &StateSpaceModel, seed: u64) -> Vec<Curve> {
    let scene = scene();
    let nominal = StateSpaceModel::nominal(&scene);
    let mut y = nominal.simulate(seed, 0).unwrap();
    y.iter_mut().enumerate().for_each(|(i, y)| *y += added(i, i as f64 * STEP_S));
    curves(&scene, &y, &nominal, after, seed).unwrap()
}

#[test]
fn a_recording_of_the_simulator_lies_in_its_bands() {
    let scene = scene();
    let nominal = StateSpaceModel::nominal(&scene);
    let (mut out, mut points, mut false_alarms, mut seen) = (0.0, 0.0, 0, 0);
    for seed in 0..12 {
        let mut y = nominal.simulate(100 + seed, 7).unwrap();
        // missing samples change nothing
        y[3000..3100].fill(f64::NAN);
        for c in curves(&scene, &y, &nominal, &nominal, seed).unwrap() {
            out += c.outside_before * c.x.len() as f64;
            points += c.x.len() as f64;
            false_alarms += usize::from(c.excess_before > 0.0);
            seen += 1;
            assert_eq!((c.outside_before, &c.before), (c.outside_after, &c.after));
        }
    }
    // 2 in 40 by construction. Points of one curve are correlated: about 60 independent ones in each of 12 recordings
    let share = out / points;
    assert!((share - 0.05).abs() < 5.0 * (0.05 * 0.95_f64 / 720.0).sqrt(), "{share}");
    assert!(false_alarms * 20 <= seen, "{false_alarms} of {seen}");
}

#[test]
fn a_ramp_shows_over_time_and_elapsed_time() {
    let scene = scene();
    let nominal = StateSpaceModel::nominal(&scene);
    let mut after = nominal.clone();
    // 0.6 mrad/s at the end: more than the repeatability of C1 and C2 allows
    let slope = 5e-7;
    after.coefficients.push(Coefficient {
        column: (0..ROWS).map(|i| i as f64 * STEP_S).collect(),
        mean: slope,
        std: 0.0,
    });
    let curves = with(|_, t| slope * t, &after, 3);
    let time = of(&curves, Over::Time, Shown::Deviation);
    assert!(time.outside_before > 0.5 && time.excess_before > 0.0, "{}", told(&curves));
    assert!(time.outside_after < 0.3 && time.excess_after == 0.0, "{}", told(&curves));
    assert!(of(&curves, Over::ElapsedTime, Shown::Deviation).outside_before > 0.4);
    let slow: f64 = curves.iter().filter(|c| c.shown == Shown::Deviation).map(|c| c.share).sum();
    assert!(slow > 0.7, "{slow}");
    assert!((curves.iter().map(|c| c.share).sum::<f64>() - 1.0).abs() < 1e-12);
    assert!(of(&curves, Over::ElapsedTime, Shown::NoiseLevel).excess_before == 0.0);
}

#[test]
fn what_follows_the_temperature_shows_over_temperature() {
    let scene = scene();
    let temperature = scene.temperature_c.clone().unwrap();
    let nominal = StateSpaceModel::nominal(&scene);
    let curves = with(|i, _| 3e-5 * (temperature[i] - 25.0), &nominal, 4);
    let c = of(&curves, Over::TemperatureC, Shown::Deviation);
    // six times the share that is outside by chance
    assert!(c.outside_before > 0.3 && c.share > 0.1, "{}", told(&curves));
    // nearly as much excess as over time, in half as many bins
    assert!(c.excess_before > 0.7 * of(&curves, Over::Time, Shown::Deviation).excess_before);
    assert!(c.share > 2.0 * of(&curves, Over::SupplyV, Shown::Deviation).share);
    // it rises from bin to bin
    let (first, last) = (c.recorded[0], c.recorded[c.recorded.len() - 1]);
    assert!(last - first > 1e-4, "{first} {last}");
}

#[test]
fn noise_that_grows_shows_in_the_level_over_temperature() {
    let scene = scene();
    let temperature = scene.temperature_c.clone().unwrap();
    let nominal = StateSpaceModel::nominal(&scene);
    let mut grown = nominal.clone();
    grown.white_scale = Some(temperature.iter().map(|t| 1.0 + 0.05 * (t - 31.0)).collect());
    let y = grown.simulate(5, 0).unwrap();
    let curves = curves(&scene, &y, &nominal, &grown, 5).unwrap();
    let level = of(&curves, Over::TemperatureC, Shown::NoiseLevel);
    assert!(level.outside_before > 0.4 && level.outside_after < 0.3, "{}", told(&curves));
    // the temperature rises with time: so does the noise
    assert!(level.share > 0.3 && largest(&curves).shown == Shown::NoiseLevel, "{}", told(&curves));
}

#[test]
fn outliers_show_in_the_amplitudes() {
    let scene = scene();
    let nominal = StateSpaceModel::nominal(&scene);
    let mut rough = nominal.clone();
    rough.outliers = Some(Outliers { probability: 2e-3, std_rad_s: 20.0 * WHITE_RAD_S });
    let y = rough.simulate(6, 0).unwrap();
    let curves = curves(&scene, &y, &nominal, &rough, 6).unwrap();
    let top = largest(&curves);
    assert_eq!(top.over, Over::Amplitude, "{}", told(&curves));
    assert!(top.most_in.unwrap()[0] >= 5.0, "{:?}", top.most_in);
    assert!(top.excess_after == 0.0, "{}", top.excess_after);
}

#[test]
fn a_tone_shows_at_its_frequency() {
    let nominal = StateSpaceModel::nominal(&scene());
    let curves = with(|_, t| 1e-4 * (std::f64::consts::TAU * 1.7 * t).sin(), &nominal, 8);
    let lines = of(&curves, Over::Frequency, Shown::LargestPower);
    let [low, high] = lines.most_in.unwrap();
    assert!(low < 1.7 && 1.7 < high && high / low < 1.6, "{low} {high}");
    assert!(lines.share > of(&curves, Over::Time, Shown::Deviation).share);
}

#[test]
fn a_walk_shows_at_long_averaging_times() {
    let nominal = StateSpaceModel::nominal(&scene());
    let mut walking = nominal.clone();
    walking.markov.push(Markov::random_walk(2e-5, STEP_S));
    let y = walking.simulate(9, 0).unwrap();
    let curves = curves(&scene(), &y, &nominal, &walking, 9).unwrap();
    let allan = of(&curves, Over::AveragingTime, Shown::AllanDeviation);
    assert!(allan.most_in.unwrap()[0] > 1.0 && allan.outside_after < 0.3, "{}", told(&curves));
}

#[test]
fn the_same_seed_gives_the_same_curves_and_other_input_is_refused() {
    let scene = scene();
    let nominal = StateSpaceModel::nominal(&scene);
    let y = nominal.simulate(1, 0).unwrap();
    let run = |seed| curves(&scene, &y, &nominal, &nominal, seed).unwrap();
    assert!(run(1) == run(1));
    assert!(run(1) != run(2));
    let back: Vec<Curve> = serde_json::from_str(&serde_json::to_string(&run(1)).unwrap()).unwrap();
    assert!(back.iter().zip(run(1)).all(|(a, b)| (a.over, a.shown, a.x.len()) == (b.over, b.shown, b.x.len())));
    assert!(curves(&scene, &y[1..], &nominal, &nominal, 1).unwrap_err().to_string().contains("11999 rows"));
    let missing = vec![f64::NAN; ROWS];
    assert_eq!(curves(&scene, &missing, &nominal, &nominal, 1).unwrap_err().kind, ErrorKind::TooShort);
}
