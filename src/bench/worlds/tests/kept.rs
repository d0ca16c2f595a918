//! Habits of who records change how a log is written, and nothing that is in it.

use super::*;
use crate::bench::worlds::habits::{HABITS, Habits, Printed, noise_rad_s};

const HALF: f64 = 0.5;

#[test]
fn decimals_are_a_tenth_of_the_noise_at_most_and_as_few_as_that_allows() {
    for printed in [Printed::Radians, Printed::Degrees] {
        for noise in [3e-5, 9.9e-4, 1e-3, 0.04] {
            let step = printed.step_rad_s(noise);
            assert!(step <= 0.1 * noise * (1.0 + 1e-12) && step > 0.0099 * noise, "{step} for {noise}");
            let mut s = Stream::new(4, 1);
            let before: Vec<f64> = (0..4000).map(|_| noise * s.normal() + 0.3).collect();
            let mut after = before.clone();
            printed.print(&mut after, noise);
            assert!(before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 0.501 * step));
            assert!(after.iter().all(|v| (v / step - (v / step).round()).abs() < 1e-6));
            assert!((noise_rad_s(&before, 2.0 * noise) / noise - 1.0).abs() < 0.1);
        }
    }
    assert_eq!(noise_rad_s(&[1.0; 9], 0.2), 0.2);
    assert_eq!(noise_rad_s(&[], 0.2), 0.2);
}

#[test]
fn habits_change_how_rest_is_written_and_nothing_else() {
    let (mut printed, mut csv) = (0, 0);
    let specs = [Vec::new(), vec![("gyro.noise_level", Strength::Strong)], vec![("gyro.bandwidth", Strength::Strong)]];
    for index in 0..12 {
        let spec = Spec { effects: specs[index % 3].clone(), messy: false };
        let [plain, kept] = [0.0, HALF].map(|habits| case::make(17, index, &spec, habits).unwrap());
        assert_eq!((&plain.config, &plain.label.effects), (&kept.config, &kept.label.effects));
        assert!(plain.label.kept.is_empty() && plain.kept_in == Files::Parquet);
        for name in [names::TEMPERATURE, names::SUPPLY] {
            assert_eq!(plain.fit.get(name), kept.fit.get(name));
        }
        let says = |habit: &str| kept.label.kept.iter().any(|k| k == habit);
        assert_eq!(says("csv"), kept.kept_in == Files::Csv);
        csv += usize::from(says("csv"));
        let endings: BTreeSet<String> = kept.files().unwrap().into_iter().map(|(name, _)| name).collect();
        let ending = if says("csv") { "csv" } else { "parquet" };
        assert_eq!(endings, ["fit", "hold"].map(|name| format!("{name}.{ending}")).into());
        let [before, after] = [&plain, &kept].map(|case| case.fit.get(names::GYRO_Z).unwrap());
        if !says("printed") {
            assert_eq!(before, after);
            continue;
        }
        printed += 1;
        let gyro = kept.config.require_gyro().unwrap();
        let stated = gyro.angle_random_walk_rad_sqrt_s / kept.config.sample_time_s.unwrap().sqrt();
        let noise = noise_rad_s(before, stated);
        let worst = before.iter().zip(after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst > 0.0 && worst <= 0.0501 * noise, "{worst} of {noise}");
    }
    assert!((2..=10).contains(&printed) && (2..=10).contains(&csv), "{printed} printed, {csv} CSV");
}

#[test]
fn each_habit_has_its_share() {
    let all: Vec<Habits> = (0..4000).map(|seed| Habits::draw(0.3, &mut Stream::new(seed, HABITS))).collect();
    let share = |f: &dyn Fn(&Habits) -> bool| all.iter().filter(|h| f(h)).count() as f64 / all.len() as f64;
    let near = |found: f64, wanted: f64| assert!((found - wanted).abs() < 0.035, "{found} for {wanted}");
    near(share(&|h| h.printed.is_some()), 0.3);
    near(share(&|h| h.printed == Some(Printed::Degrees)), 0.15);
    near(share(&|h| h.files == Files::Csv), 0.3 * 0.85);
    near(share(&|h| h.wheels_hz.is_some()), 0.15);
    near(share(&|h| h.steering.is_none()), 0.4);
    near(share(&|h| h.offsets_s[0].is_some()), 0.15 * 0.75);
    near(share(&|h| h.offsets_s[1].is_some()), 0.15 * 0.5);
    for [fit, hold] in all.iter().flat_map(|h| h.offsets_s.into_iter().flatten()) {
        assert!(fit.abs() <= 1.5 && hold.abs() <= 1.5 && (fit - hold).abs() >= 0.3);
    }
    assert!((0..50).all(|seed| Habits::draw(0.0, &mut Stream::new(seed, HABITS)) == Habits::PLAIN));
    assert!(all.iter().all(|h| h.at_rest().files != Files::Apart && h.at_rest().steering.is_none()));
}
