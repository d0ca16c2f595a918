//! Warm-ups, levels of noise and noise in a band: what their labels say is in the log.

use super::*;
use crate::bench::worlds::case::believed;
use crate::bench::worlds::warm_up::{UNSTATED, WarmUp};

fn one(id: &'static str, strength: Strength) -> Spec {
    Spec { effects: vec![(id, strength)], messy: false }
}

#[test]
fn a_warm_up_is_that_of_its_label() {
    let (mut unstated, mut stated) = (0, 0);
    for index in 0..12 {
        let case = make(21, index, &one("gyro.warm_up", Strength::Strong)).unwrap();
        let gyro = case.config.require_gyro().unwrap();
        let label = &case.label.effects["gyro.warm_up"];
        let (c1, time_s) = (label["c1_rad_s"], label["time_constant_s"]);
        if gyro.c1_rad_s == 0.0 {
            unstated += 1
        } else {
            stated += 1
        }
        // from the first time constant to the end the reading rises by what the label says
        let (y, step_s) = (case.fit.get(names::GYRO_Z).unwrap(), case.config.sample_time_s.unwrap());
        let late = mean(&y[y.len() * 19 / 20..]);
        let rest = |t: f64| (-t / time_s).exp();
        let t_s = 0.7 * time_s.min(0.4 * case.fit.time.span_s());
        let (at, half) = ((t_s / step_s) as usize, (0.1 * t_s / step_s) as usize);
        let found = late - mean(&y[at - half..at + half]);
        let expected = c1 * (rest(t_s) - rest(0.975 * case.fit.time.span_s()));
        let noise = gyro.angle_random_walk_rad_sqrt_s / (2.0 * half as f64 * step_s).sqrt();
        // stretched by 6 % at most, which moves half of it by some percent
        assert!((found - expected).abs() < 5.0 * noise + 0.08 * c1.abs(), "{index}: {found} for {expected}");
        assert!(time_s > 10.0 && c1 != gyro.c1_rad_s, "{label:?}");
    }
    // binomial, 12 at 0.3
    assert!((1..=8).contains(&unstated) && stated >= 4, "{unstated} without a warm-up, {stated} with another");
}

#[test]
fn a_simulator_without_a_warm_up_tells_nothing_of_the_effect() {
    for (effects, share) in [
        (vec![], UNSTATED),
        (vec![("gyro.warm_up", Strength::Strong)], UNSTATED),
        (vec![("gyro.rate_random_walk", Strength::Weak)], UNSTATED),
        // one exponential where none is stated is the warm-up
        (vec![("gyro.second_time_constant", Strength::Strong)], 0.0),
    ] {
        let spec = Spec { effects, messy: false };
        let without = |seed: &u64| {
            believed(Unit::draw(&mut Stream::new(*seed, 1)), &spec, *seed).config().gyro.unwrap().c1_rad_s == 0.0
        };
        let n = 1000.0;
        let found = (0..1000).filter(without).count() as f64;
        assert!(
            (found - n * share).abs() <= 5.0 * (n * share * (1.0 - share)).sqrt(),
            "{:?}: {found} of {n}",
            spec.effects
        );
    }
}

#[test]
fn a_unit_whose_warm_up_is_unknown_keeps_its_form_and_nats() {
    let mut seen = 0;
    for seed in 0..60 {
        let unit = Unit::draw(&mut Stream::new(seed, 1));
        let form = |unit: &Unit| WarmUp::draw(unit, &mut Stream::new(seed, 3));
        if seen == 3 || !form(&unit).is_unstated() {
            continue;
        }
        seen += 1;
        let unit = unit.without_warm_up();
        let run = Run::draw(&unit, &mut Stream::new(seed, 2));
        assert!(run.c1_rad_s == 0.0 && form(&unit).is_unstated());
        let path = form(&unit).path(&run, &mut Stream::new(seed, 4));
        for target in [6.0, 2000.0] {
            let strength = form(&unit).strength(&run, &path, target);
            let nats = form(&unit).nats(&run, &path, strength);
            assert!((nats / target - 1.0).abs() < 0.01, "{nats} for {target}");
        }
    }
    assert_eq!(seen, 3);
}

#[test]
fn white_noise_has_the_level_of_its_label() {
    let (mut louder, mut quieter) = (0, 0);
    for seed in 0..8 {
        let run = run(seed);
        let z = white("gyro.noise_level", &run, seed, 0.15);
        let label = effect("gyro.noise_level", &run, seed).parameters(&run, &[], 0.15)["noise_over_nominal"];
        let found = variance(&z).sqrt();
        assert!((found / label - 1.0).abs() < 5.0 * (0.5 / run.len as f64).sqrt(), "{found} for {label}");
        // it breathes by a tenth of the strength
        assert!((label.ln().abs() - 0.15).abs() < 0.02, "{label}");
        if label > 1.0 { louder += 1 } else { quieter += 1 }
    }
    assert!(louder > 0 && quieter > 0);
}

#[test]
fn noise_in_a_band_has_the_band_of_its_label() {
    for seed in 0..6 {
        let run = run(seed);
        let effect = effect("gyro.narrow_band_noise", &run, seed);
        let x = effect.path(&run, &mut Stream::new(seed, 4));
        let label = effect.parameters(&run, &x, 2.0);
        let (center_hz, width_hz) = (label["center_hz"], label["bandwidth_hz"]);
        assert_eq!(label["std_rad_s"], 2.0);
        // so many independent lines over the log
        let of = (width_hz * run.span_s()).max(1.0);
        assert!((variance(&x) - 1.0).abs() < 5.0 / of.sqrt(), "{} over {of}", variance(&x));
        let ordinates = Periodogram::new(run.len).ordinates(&x);
        let inside = |half_hz: f64| {
            let near = |k: &usize| ((k + 1) as f64 / run.span_s() - center_hz).abs() < half_hz;
            ordinates.iter().enumerate().filter(|(k, _)| near(k)).map(|p| p.1).sum::<f64>()
        };
        // half of a Lorentzian line's power is within its width, three quarters of a normal one's
        let share = inside(0.5 * width_hz) / ordinates.iter().sum::<f64>();
        assert!((0.5 - 3.0 / of.sqrt()..0.8 + 3.0 / of.sqrt()).contains(&share), "{share} over {of}");
        let [low, high] = effect.place(&run, &x).frequency_hz.unwrap();
        assert!(low < center_hz && center_hz < high);
    }
}
