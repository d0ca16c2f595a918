//! Tests that every effect of the library passes, and references that each way of explaining must agree with.

use super::tried::Spectrum;
use super::tried::assert_ids_stand_once;
use super::*;
use crate::bias::WarmUp;
use crate::config::{Config, EffectTable};
use crate::math::dct::Cosine;
use crate::math::random::Stream;
use crate::model::{EffectSource, Scene};
use crate::signal::{Log, TimeAxis, names};
use crate::simulate::{Options, stationary_like, stationary_with};

/// A recording with a temperature that rises and swings, and a supply that sags and ripples.
pub(super) fn scene(len: usize, step_s: f64) -> Scene {
    let start_s = 3.0;
    let t = |i: usize| start_s + step_s * i as f64;
    let span = step_s * len as f64;
    Scene {
        time: TimeAxis::Uniform { start_s, step_s, len },
        step_s,
        temperature_c: Some((0..len).map(|i| 31.0 - 9.0 * (-t(i) / 20.0).exp() + (6.0 * t(i) / span).sin()).collect()),
        power_on_temperature_c: None,
        supply_v: Some((0..len).map(|i| 5.0 - 0.1 * t(i) / span + 0.03 * (0.7 * t(i)).sin()).collect()),
        warm_up: WarmUp { c1_rad_s: 2e-3, c2_rad_s: -3e-3, time_constant_s: 180.0 },
        white_std_rad_s: 1.5e-3,
        turn_on_bias_std_rad_s: 2e-4,
        warm_up_relative_std: 0.03,
    }
}

fn config(effects: Vec<EffectTable>) -> Config {
    let text = "schema = 1\nsample_time_s = 0.05\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -3e-3\ntime_constant_s = 180.0\n\
        angle_random_walk_rad_sqrt_s = 1.5e-4\n";
    let mut config = Config::parse(text, "gyroid.toml").unwrap();
    config.effects = effects;
    config
}

fn inputs(scene: &Scene) -> Log {
    let mut log = Log::new("hold.csv", scene.time.clone());
    log.push(names::TEMPERATURE, scene.temperature_c.clone().unwrap()).unwrap();
    log.push(names::GYRO_Z, vec![0.0; scene.len()]).unwrap();
    log.push(names::SUPPLY, scene.supply_v.clone().unwrap()).unwrap();
    log
}

/// A log of the whole simulator with this one effect.
fn bits(effect: &dyn Effect, parameters: Parameters, seed: u64) -> Vec<u64> {
    let config = config(vec![EffectTable { id: effect.about().id.into(), parameters }]);
    let log = stationary_like(&config, &inputs(&scene(400, 0.05)), &Options::from(seed), &Library::new()).unwrap();
    log.get(names::GYRO_Z).unwrap().iter().map(|v| v.to_bits()).collect()
}

/// Anywhere inside the bounds, small values as often as large ones.
fn draw(parameter: &Parameter, stream: &mut Stream) -> f64 {
    let [low, high] = parameter.bounds;
    let size = |reach: f64, stream: &mut Stream| reach * (-20.0 * stream.uniform()).exp();
    let side = if low < 0.0 && stream.uniform() < 0.5 { -size(-low, stream) } else { size(high, stream) };
    side.clamp(low, high)
}

fn drawn(effect: &dyn Effect, stream: &mut Stream) -> Parameters {
    effect.about().parameters.iter().map(|p| (p.name.to_string(), draw(p, stream))).collect()
}

fn of<const N: usize>(pairs: [(&str, f64); N]) -> Parameters {
    pairs.map(|(name, value)| (name.to_string(), value)).into()
}

/// Bias of every row, no white noise.
fn bias(id: &str, parameters: &Parameters, scene: &Scene, seed: u64) -> Vec<f64> {
    let mut work = by_id(id).unwrap().simulated(parameters, scene, seed).unwrap();
    (0..scene.len()).map(|row| work.bias_rad_s(row, scene)).collect()
}

#[test]
fn an_id_stands_once_and_parameters_are_those_that_users_know() {
    assert_ids_stand_once(&registry().iter().map(|e| e.about()).collect::<Vec<_>>());
    for effect in registry() {
        let (about, tried) = (effect.about(), effect.tried());
        assert_eq!(by_id(about.id).unwrap().about().id, about.id);
        assert!(!tried.sizes.is_empty(), "{}", about.id);
        for parameters in tried.sizes.iter().chain(&tried.drawn) {
            let work = effect.simulated(parameters, &scene(400, 0.05), 1);
            assert!(work.is_ok(), "{} {parameters:?}: {:?}", about.id, work.err());
        }
    }
    assert!(by_id("gyro.unheard_of").is_none());
}

#[test]
fn every_effect_says_what_it_is() {
    for effect in registry() {
        let about = effect.about();
        let said = |text: &str, least: usize| assert!(text.len() >= least, "{}: {text:?}", about.id);
        said(about.title, 4);
        said(about.deficient, 12);
        said(about.equation, 12);
        assert!(about.source.chars().any(|c| c.is_ascii_digit()) || about.source.contains("Schafer"), "{}", about.id);
        assert!(about.remedy.ends_with('.') && about.remedy.matches(". ").count() == 0, "{}", about.id);
        assert_eq!(about.channel, "gyro");
        let off = about.parameters.iter().any(|p| p.null.is_some()) || !effect.nominal(&scene(400, 0.05)).is_empty();
        assert!(off, "{} cannot be switched off", about.id);
        for (i, p) in about.parameters.iter().enumerate() {
            said(p.meaning, 3);
            assert!(p.bounds[0] < p.bounds[1] && p.bounds.iter().all(|b| b.is_finite()), "{}", p.name);
            assert!(p.null.is_none_or(|v| (p.bounds[0]..=p.bounds[1]).contains(&v)), "{}", p.name);
            assert!(about.parameters[..i].iter().all(|q| q.name != p.name), "{} twice", p.name);
        }
    }
}

#[test]
fn nothing_changes_where_an_effect_is_switched_off() {
    let nominal: Vec<u64> = {
        let log = stationary_like(&config(vec![]), &inputs(&scene(400, 0.05)), &Options::from(7), &Library::new());
        log.unwrap().get(names::GYRO_Z).unwrap().iter().map(|v| v.to_bits()).collect()
    };
    let mut stream = Stream::new(1, 1);
    for effect in registry() {
        for _ in 0..5 {
            let stated = effect.nominal(&scene(400, 0.05));
            let null = |p: &Parameter| p.null.or(stated.get(p.name).copied());
            let value = |p: &Parameter, s: &mut Stream| null(p).unwrap_or_else(|| draw(p, s));
            let off: Parameters =
                effect.about().parameters.iter().map(|p| (p.name.to_string(), value(p, &mut stream))).collect();
            assert_eq!(bits(*effect, off.clone(), 7), nominal, "{} {off:?}", effect.about().id);
        }
    }
}

#[test]
fn logs_are_finite_inside_the_bounds_and_repeat_with_their_seed() {
    let mut stream = Stream::new(2, 1);
    for effect in registry() {
        for _ in 0..12 {
            let parameters = drawn(*effect, &mut stream);
            let log = bits(*effect, parameters.clone(), 3);
            assert!(log.iter().all(|b| f64::from_bits(*b).is_finite()), "{} {parameters:?}", effect.about().id);
            assert_eq!(log, bits(*effect, parameters, 3), "{}", effect.about().id);
        }
    }
}

#[test]
fn what_is_drawn_anew_differs_from_run_to_run_and_from_table_to_table() {
    let scene = scene(400, 0.05);
    let mut random = 0;
    for effect in registry() {
        let (id, Some(parameters)) = (effect.about().id, effect.tried().drawn) else { continue };
        random += 1;
        assert_ne!(bias(id, &parameters, &scene, 1), bias(id, &parameters, &scene, 2), "{id}");
        let table = EffectTable { id: id.into(), parameters: parameters.clone() };
        let sum = |n: usize| {
            let mut config = config(vec![table.clone(); n]);
            config.gyro.as_mut().unwrap().angle_random_walk_rad_sqrt_s = 0.0;
            let log = stationary_with(&config, 19.95, &Options::from(1), &Library::new()).unwrap();
            let model = config.gyro.as_ref().unwrap().warm_up();
            let rate = log.get(names::GYRO_Z).unwrap();
            (0..log.len()).map(|i| rate[i] - model.error_rad_s(log.time.at(i))).collect::<Vec<f64>>()
        };
        let (one, two) = (sum(1), sum(2));
        assert!(one.iter().zip(&two).any(|(a, b)| (2.0 * a - b).abs() > 1e-5), "{id}: both tables drew the same");
    }
    assert!(random >= 7, "{random}");
}

/// Mean power of `logs` simulated series in bands of coefficients, over what `spectrum` says.
fn agrees(
    label: &str,
    n: usize,
    spectrum: impl Fn(f64) -> f64,
    lowest: usize,
    ends: f64,
    log: impl Fn(u64) -> Vec<f64>,
) {
    const LOGS: usize = 200;
    let transform = Cosine::new(n);
    let mut power = vec![0.0; n];
    for seed in 0..LOGS as u64 {
        let x = transform.forward(&log(seed));
        power.iter_mut().zip(&x).for_each(|(p, x)| *p += x * x / LOGS as f64);
    }
    let mut low = lowest;
    while low < n {
        let high = (2 * low).min(n);
        let ratio: Vec<f64> =
            (low..high).map(|k| power[k] / spectrum(std::f64::consts::PI * k as f64 / n as f64)).collect();
        let mean = ratio.iter().sum::<f64>() / ratio.len() as f64;
        // chi-squared with LOGS degrees of freedom a coefficient; five standard deviations
        let bound = 5.0 * (2.0 / (LOGS * ratio.len()) as f64).sqrt() + ends;
        assert!((mean - 1.0).abs() < bound, "{label}, coefficients {low} to {high}: {mean}, bound {bound}");
        low = high;
    }
}

#[test]
fn spectra_are_those_of_the_simulated_noise() {
    let n = 2000;
    let scene = scene(n, 0.05);
    let mut compared = 0;
    for effect in registry() {
        let Some(Explanation::Noise(noise)) = effect.explanation(&scene) else { continue };
        let (id, spectra) = (effect.about().id, effect.tried().spectra);
        assert!(!spectra.is_empty(), "{id} brings no spectrum to compare");
        for Spectrum { theta, lowest, error } in spectra {
            let parameters: Parameters = noise.names().into_iter().map(str::to_string).zip(theta.clone()).collect();
            let log = |seed| bias(id, &parameters, &scene, seed);
            agrees(id, n, |w| noise.spectrum(&scene, &theta, w), lowest, error, log);
            compared += 1;
        }
    }
    assert!(compared >= 6, "{compared}");
}

#[test]
fn the_mean_of_a_spectrum_over_a_band_is_that_of_its_values() {
    let scene = scene(2000, 0.05);
    for effect in registry() {
        let Some(Explanation::Noise(noise)) = effect.explanation(&scene) else { continue };
        for theta in noise.starts(&scene) {
            for [low, high] in [[0.3, 0.301], [0.9, 0.95], [2.0, 2.1]] {
                const POINTS: usize = 4000;
                let at = |k: usize| low + (high - low) * (k as f64 + 0.5) / POINTS as f64;
                let mean = (0..POINTS).map(|k| noise.spectrum(&scene, &theta, at(k))).sum::<f64>() / POINTS as f64;
                let found = noise.mean_spectrum(&scene, &theta, 0.5 * (low + high), [low, high]);
                // smooth noises are taken in the middle of a band of a few percent: the second order of a power law
                assert!((found / mean - 1.0).abs() < 2e-3, "{} {theta:?} {low}: {found} {mean}", effect.about().id);
            }
        }
    }
    // a line far narrower than the band, and half of it
    let effect = by_id("gyro.narrow_band_noise").unwrap();
    let Some(Explanation::Noise(noise)) = effect.explanation(&scene) else { unreachable!() };
    let omega = std::f64::consts::TAU * 3.0 * scene.step_s;
    let mean = |band: [f64; 2]| noise.mean_spectrum(&scene, &[3.0, 1e-4, 2e-4], omega, band) * (band[1] - band[0]);
    // ∫ S dω over one sign of the frequency is π σ²
    let all = std::f64::consts::PI * 4e-8;
    assert!((mean([omega - 0.1, omega + 0.1]) / all - 1.0).abs() < 2e-3);
    assert!((mean([omega, omega + 0.1]) / all - 0.5).abs() < 2e-3);
}

#[test]
fn gains_are_those_of_the_simulated_filters() {
    let n = 2000;
    let mut scene = scene(n, 0.05);
    scene.white_std_rad_s = 1.0;
    scene.warm_up = WarmUp { c1_rad_s: 0.0, c2_rad_s: 0.0, time_constant_s: 180.0 };
    for effect in registry() {
        let Some(Explanation::Filter(filter)) = effect.explanation(&scene) else { continue };
        let (id, spectra) = (effect.about().id, effect.tried().spectra);
        assert!(!spectra.is_empty(), "{id} brings no gain to compare");
        for Spectrum { theta, lowest, error } in spectra {
            let parameters: Parameters = filter.names().into_iter().map(str::to_string).zip(theta.clone()).collect();
            let log = |seed| {
                let mut work = effect.simulated(&parameters, &scene, seed).unwrap();
                let mut white = Stream::new(seed, 9);
                (0..n).map(|_| work.filtered(white.normal())).collect()
            };
            agrees(&format!("{id} {theta:?}"), n, |w| filter.spectrum(&scene, &theta, w), lowest, error, log);
        }
    }
}

#[test]
fn columns_are_those_of_the_simulated_signals() {
    let scene = scene(3000, 0.05);
    let mut stream = Stream::new(4, 1);
    let mut compared = 0;
    let tried =
        registry().iter().flat_map(|effect| effect.tried().sizes.into_iter().map(move |sizes| (*effect, sizes)));
    for (effect, parameters) in tried {
        let Some(Explanation::Signal(signal) | Explanation::Line(signal)) = effect.explanation(&scene) else {
            continue;
        };
        compared += 1;
        let (id, up_to_constant) = (effect.about().id, effect.tried().up_to_constant);
        let shape = signal.shape(&scene, &parameters).unwrap();
        let coefficients = signal.coefficients(&scene, &shape, &parameters).unwrap();
        let columns = signal.columns(&scene, &shape);
        assert_eq!(columns.len(), coefficients.len(), "{id}");
        let simulated = bias(id, &parameters, &scene, 1);
        let offset = signal.offset(&scene, &shape).unwrap_or_else(|| vec![0.0; scene.len()]);
        let gap: Vec<f64> = (0..scene.len())
            .map(|i| {
                simulated[i] - offset[i] - columns.iter().zip(&coefficients).map(|(c, b)| c.values[i] * b).sum::<f64>()
            })
            .collect();
        // covariates are told up to a constant, which C2 takes
        let constant = if up_to_constant { gap[0] } else { 0.0 };
        let size = simulated.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        assert!(size > 1e-5 && gap.iter().all(|g| (g - constant).abs() < 1e-9 * size), "{id}");
        // a bend is free of what the first column and a constant explain
        if let [first, bend] = &columns[..]
            && up_to_constant
        {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let norm = |a: &[f64]| dot(a, a).sqrt();
            let (x, z) = (&first.values, &bend.values);
            assert!(dot(x, z).abs() < 1e-9 * norm(x) * norm(z) && z.iter().sum::<f64>().abs() < 1e-9 * norm(z), "{id}");
        }
        // there and back
        for _ in 0..5 {
            let shapes = signal.shapes(&scene);
            let shape = &shapes[(stream.uniform() * shapes.len() as f64) as usize];
            let drawn: Vec<f64> = coefficients.iter().map(|_| stream.normal()).collect();
            let told = signal.parameters(&scene, shape, &drawn);
            let about = effect.about();
            assert!(told.keys().all(|k| about.parameters.iter().any(|p| p.name == k)), "{id}");
            assert!(about.parameters.iter().all(|p| !p.required || told.contains_key(p.name)), "{id}");
            if let Some(back) = signal.coefficients(&scene, shape, &told) {
                assert!(back.iter().zip(&drawn).all(|(a, b)| (a - b).abs() < 1e-9), "{id}: {back:?} {drawn:?}");
            } else {
                assert!(signal.prior_std(&told).is_some(), "{id}");
            }
            for (value, [low, high]) in shape.iter().zip(signal.refine(&scene).unwrap_or_default()) {
                assert!(*value >= low * (1.0 - 1e-12) && *value <= high * (1.0 + 1e-12), "{id}: {value}");
            }
        }
    }
    assert!(compared >= 8, "{compared}");
}

#[test]
fn the_scatter_of_a_tone_is_that_of_its_phase() {
    let scene = scene(200, 0.05);
    let parameters = of([("frequency_hz", 2.0), ("amplitude_rad_s", 0.3)]);
    let Some(Explanation::Line(signal)) = by_id("gyro.tone").unwrap().explanation(&scene) else { unreachable!() };
    let columns = signal.columns(&scene, &[2.0]);
    let std = signal.prior_std(&parameters).unwrap();
    // whole periods: the columns are orthogonal, of norm² n/2
    let n = 2000;
    let sums = (0..n).map(|seed| {
        let x = bias("gyro.tone", &parameters, &scene, seed);
        [0, 1].map(|j| x.iter().zip(&columns[j].values).map(|(a, b)| a * b).sum::<f64>() / 100.0 / std[j])
    });
    let mean = sums.fold([0.0; 2], |m, s| [m[0] + s[0] * s[0] / n as f64, m[1] + s[1] * s[1] / n as f64]);
    // 2 cos² of a uniform phase: mean 1, variance 1/2
    assert!(mean.iter().all(|m| (m - 1.0).abs() < 5.0 * (0.5 / n as f64).sqrt()), "{mean:?}");
}

#[test]
fn the_columns_of_a_varying_level_are_its_log_variance() {
    let scene = scene(3000, 0.05);
    for effect in registry() {
        let Some(Explanation::Variance(signal)) = effect.explanation(&scene) else { continue };
        for parameters in effect.tried().sizes {
            let coefficients = signal.coefficients(&scene, &[], &parameters).unwrap();
            let columns = signal.columns(&scene, &[]);
            let mut work = effect.simulated(&parameters, &scene, 1).unwrap();
            for i in 0..scene.len() {
                let log: f64 = columns.iter().zip(&coefficients).map(|(c, b)| c.values[i] * b).sum();
                let level = 2.0 * work.white_scale(i, &scene).ln();
                assert!((level - log).abs() < 1e-9, "{}, row {i}", effect.about().id);
            }
            let back = signal.parameters(&scene, &[], &coefficients);
            assert!(back.iter().zip(&parameters).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-12), "{back:?}");
        }
    }
}

#[test]
fn noises_start_inside_their_range_and_reach_from_nothing_to_far_above_the_white_noise() {
    for (len, step_s) in [(400, 0.05), (100_000, 0.01), (60, 10.0)] {
        let scene = scene(len, step_s);
        for effect in registry() {
            let Some(explanation) = effect.explanation(&scene) else { continue };
            let (Explanation::Noise(noise) | Explanation::Filter(noise)) = &explanation else { continue };
            let range = noise.range(&scene);
            assert_eq!(range.len(), noise.names().len());
            assert!(range.iter().all(|[low, high]| *low > 0.0 && low < high), "{}", effect.about().id);
            for start in noise.starts(&scene) {
                let inside = |(v, r): (&f64, &[f64; 2])| *v >= r[0] * 0.999 && *v <= r[1] * 1.001;
                assert!(start.iter().zip(&range).all(inside), "{}: {start:?} {range:?}", effect.about().id);
            }
            if matches!(explanation, Explanation::Noise(_)) {
                let ends = [0, 1].map(|side| range.iter().map(|r| r[side]).collect::<Vec<f64>>());
                let omega = |k: usize| std::f64::consts::PI * k as f64 / len as f64;
                let white = scene.white_std_rad_s * scene.white_std_rad_s;
                // gain in log-likelihood of a spectrum 1 + s against 1: s²/4 a coefficient
                let least: f64 =
                    (1..len).map(|k| (noise.spectrum(&scene, &ends[0], omega(k)) / white).powi(2) / 4.0).sum();
                assert!(least < 0.1, "{} at its least: {least}", effect.about().id);
                assert!(noise.spectrum(&scene, &ends[1], omega(2)) > 10.0 * white, "{}", effect.about().id);
            }
        }
    }
}

#[test]
fn outliers_come_with_their_probability_and_readings_lie_on_the_lattice() {
    let scene = scene(10, 0.05);
    let (n, p) = (200_000, 0.003);
    let mut work = by_id("gyro.outliers").unwrap().simulated(&of([("probability_per_sample", p)]), &scene, 1).unwrap();
    let shifts: Vec<f64> = (0..n).map(|i| work.output(i, 0.5) - 0.5).filter(|d| *d != 0.0).collect();
    let (count, expected) = (shifts.len() as f64, n as f64 * p);
    assert!((count - expected).abs() < 5.0 * expected.sqrt(), "{count}");
    let up = shifts.iter().filter(|d| **d > 0.0).count() as f64;
    assert!((up - 0.5 * count).abs() < 2.5 * count.sqrt(), "{up} of {count}");
    assert!(shifts.iter().all(|d| (d.abs() - 20.0 * scene.white_std_rad_s).abs() < 1e-12));

    let mut work = by_id("gyro.quantization").unwrap().simulated(&of([("lsb_rad_s", 0.25)]), &scene, 1).unwrap();
    assert_eq!([0.1, 0.13, -0.13, 0.74].map(|v| work.output(0, v)), [0.0, 0.25, -0.25, 0.75]);
    assert!(bias("gyro.turn_on_shift", &of([("shift_rad_s", -0.125)]), &scene, 1).iter().all(|b| *b == -0.125));
}

#[test]
fn telegraph_noise_dwells_as_long_as_it_says() {
    let (dt, dwell, ratio) = (0.01, 0.5, 3.0);
    let scene = scene(1_000_000, dt);
    let parameters = of([("level_spacing_rad_s", 2.0), ("mean_dwell_s", dwell), ("dwell_ratio", ratio)]);
    let levels = bias("gyro.telegraph_noise", &parameters, &scene, 1);
    assert!(levels.iter().all(|v| v.abs() == 1.0));
    // τ₁ = 2 τ r/(1+r), τ₂ = 2 τ/(1+r); of the rows at a level, Δt/τ leave it, less what comes back within Δt
    for (level, tau) in [(1.0, 2.0 * dwell * ratio / (1.0 + ratio)), (-1.0, 2.0 * dwell / (1.0 + ratio))] {
        let here = levels.windows(2).filter(|w| w[0] == level).count() as f64;
        let left = levels.windows(2).filter(|w| w[0] == level && w[1] != level).count() as f64;
        let rate = dt * (1.0 / (2.0 * dwell * ratio / (1.0 + ratio)) + (1.0 + ratio) / (2.0 * dwell));
        let expected = here * dt / tau * (-(-rate).exp_m1() / rate);
        assert!((left - expected).abs() < 5.0 * expected.sqrt(), "{level}: {left} of {here}, expected {expected}");
    }
}

#[test]
fn errors_name_effect_parameter_and_what_there_is() {
    let mut scene = scene(100, 0.05);
    let text = |id: &str, parameters: Parameters, scene: &Scene| {
        Library::new().gyro_effect(id, &parameters, scene, 1).err().unwrap().to_string()
    };
    let unknown = text("gyro.tone", of([("frequency_hz", 1.0), ("amplitude", 1.0)]), &scene);
    assert!(unknown.contains("gyro.tone.amplitude`") && unknown.contains("amplitude_rad_s, phase_rad"), "{unknown}");
    let missing = text("gyro.gauss_markov", of([("std_rad_s", 1.0)]), &scene);
    assert!(missing.contains("correlation_time_s") && missing.contains("missing"), "{missing}");
    let wild = text("gyro.tone", of([("frequency_hz", -1.0), ("amplitude_rad_s", 1.0)]), &scene);
    assert!(wild.contains("frequency_hz") && wild.contains("-1"), "{wild}");
    assert!(text("gyro.rate_rammp", of([]), &scene).contains("gyro.rate_ramp"));
    assert!(text("wheel.slip", of([]), &scene).contains("is an effect of drives"));
    scene.temperature_c = None;
    let bare = text("gyro.temperature_sensitivity", of([("coefficient_rad_s_per_c", 1e-5)]), &scene);
    assert!(bare.contains("temperature_c") && bare.contains("--inputs"), "{bare}");
    assert!(by_id("gyro.noise_growth").unwrap().explanation(&scene).is_none());
    scene.supply_v = Some(vec![5.0; 100]);
    let flat = text("gyro.supply_sensitivity", of([("coefficient_rad_s_per_v", 1e-5)]), &scene);
    assert!(flat.contains("same in every row"), "{flat}");
    let rest = config(vec![EffectTable { id: "gyro.noise_growth".into(), parameters: of([("relative_per_c", 0.01)]) }]);
    let alone = stationary_with(&rest, 10.0, &Options::from(1), &Library::new()).unwrap_err().to_string();
    assert!(alone.contains("temperature_c"), "{alone}");

    let library = Library::without(["gyro.tone"]);
    let tone = of([("frequency_hz", 1.0), ("amplitude_rad_s", 1.0)]);
    assert!(Library::new().gyro_effect("gyro.tone", &tone, &scene, 1).is_ok());
    assert!(library.gyro_effect("gyro.tone", &tone, &scene, 1).is_err());
    assert_eq!(library.effects().count(), registry().len() - 1);
    assert!(library.by_id("gyro.tone").is_none() && library.by_id("gyro.bandwidth").is_some());
}
