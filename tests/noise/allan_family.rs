//! The Allan family against allantools: `tests/allan/make.py` makes the expected values.

use gyroid::noise::allan::deviations;
use gyroid::noise::confidence::{degrees_of_freedom, noise_exponent, total_degrees_of_freedom};
use gyroid::noise::{Deviation, allan};
use serde_json::Value;

/// n' = 16807 n mod 2147483647 from 1234567890, over 2147483647: the test series of NIST SP 1065.
fn uniform(count: usize) -> Vec<f64> {
    let mut n = 1_234_567_890_u64;
    (0..count)
        .map(|_| {
            let now = n as f64 / 2_147_483_647.0;
            n = 16_807 * n % 2_147_483_647;
            now
        })
        .collect()
}

fn series(name: &str) -> Vec<f64> {
    if name == "sp1065" {
        return uniform(1000);
    }
    let mut sum = 0.0;
    let noise = uniform(4000).into_iter().map(|u| u - 0.5);
    noise
        .map(|u| {
            sum += u;
            u + 0.05 * sum
        })
        .collect()
}

fn expected() -> Value {
    serde_json::from_str(include_str!("../allan/expected.json")).unwrap()
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap()
}

#[test]
fn deviations_agree_with_allantools_to_ten_digits() {
    let expected = expected();
    for (name, entry) in expected["series"].as_object().unwrap() {
        let rates = series(name);
        assert_eq!(rates.len() as u64, entry["samples"].as_u64().unwrap());
        for deviation in Deviation::ALL {
            let wanted = entry["deviations"][deviation.id()].as_array().unwrap();
            assert!(wanted.len() >= 10, "{name} {deviation:?}");
            let averaged: Vec<usize> = wanted.iter().map(|w| number(&w[0]) as usize).collect();
            let found = deviations(&rates, number(&entry["step_s"]), &averaged, deviation);
            assert_eq!(found.len(), wanted.len(), "{name} {deviation:?}");
            for (f, w) in found.iter().zip(wanted) {
                let wanted = number(&w[1]);
                let error = (f.deviation_rad_s / wanted - 1.0).abs();
                assert!(error < 1e-10, "{name} {deviation:?} {}: {} {wanted}", f.m, f.deviation_rad_s);
                assert!(f.ci95[0] < wanted && wanted < f.ci95[1]);
            }
        }
        for case in entry["noise"].as_array().unwrap() {
            let found = noise_exponent(&allan::angles(&rates), number(&case[0]) as usize, number(&case[1]) as usize);
            assert_eq!(found.map(i64::from), case[2].as_i64(), "{name} {case}");
        }
    }
}

#[test]
fn published_values_of_sp1065_come_back() {
    // NIST SP 1065, table 31: 1000 points, averaging factors 1, 10, 100
    let rates = uniform(1000);
    let published = [
        (Deviation::Overlapping, [2.922_319e-1, 9.159_953e-2, 3.241_343e-2]),
        (Deviation::Modified, [2.922_319e-1, 6.172_376e-2, 2.170_921e-2]),
        (Deviation::Hadamard, [2.943_883e-1, 9.581_083e-2, 3.237_638e-2]),
        (Deviation::Total, [2.922_319e-1, 9.134_743e-2, 3.406_530e-2]),
    ];
    for (deviation, wanted) in published {
        let found = deviations(&rates, 1.0, &[1, 10, 100], deviation);
        for (f, w) in found.iter().zip(wanted) {
            assert!((f.deviation_rad_s / w - 1.0).abs() < 3e-7, "{deviation:?} {}: {} {w}", f.m, f.deviation_rad_s);
        }
    }
}

#[test]
fn degrees_of_freedom_agree_with_allantools() {
    let expected = expected();
    let cases = expected["edf"].as_array().unwrap();
    assert!(cases.len() > 100);
    for case in cases {
        let (alpha, d) = (case[0].as_i64().unwrap() as i32, number(&case[1]) as usize);
        let (m, angles, modified) = (number(&case[2]) as usize, number(&case[3]) as usize, case[4].as_bool().unwrap());
        let found = degrees_of_freedom(alpha, d, m, angles, modified);
        let wanted = number(&case[5]);
        assert!((found / wanted - 1.0).abs() < 1e-6, "{case}: {found}");
    }
    for case in expected["total_edf"].as_array().unwrap() {
        let alpha = case[0].as_i64().unwrap() as i32;
        let found = total_degrees_of_freedom(alpha, number(&case[1]) as usize, number(&case[2]) as usize);
        assert!((found / number(&case[3]) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn intervals_cover_what_they_should_under_white_noise() {
    // 400 logs; 95 % covered within four binomial standard errors, 1.1 % each
    use gyroid::math::random::Stream;
    let averaged = [1, 16, 128, 400];
    let mut inside = [[0u32; 4]; 4];
    for log in 0..400 {
        let mut draw = Stream::new(11, log);
        let rates: Vec<f64> = (0..2048).map(|_| draw.normal()).collect();
        for (i, deviation) in Deviation::ALL.into_iter().enumerate() {
            for (j, p) in deviations(&rates, 1.0, &averaged, deviation).iter().enumerate() {
                let truth = match deviation {
                    // white noise: the modified variance is the Allan variance times (1 + 1/m²)/2
                    Deviation::Modified => ((1.0 + (p.m as f64).powi(-2)) / 2.0 / p.m as f64).sqrt(),
                    _ => (p.m as f64).sqrt().recip(),
                };
                inside[i][j] += u32::from(p.ci95[0] < truth && truth < p.ci95[1]);
            }
        }
    }
    for (deviation, counts) in Deviation::ALL.iter().zip(inside) {
        for (m, count) in averaged.iter().zip(counts) {
            let share = f64::from(count) / 400.0;
            // beyond 68 blocks of means the noise type is taken from shorter averaging times, and right
            assert!((0.906..0.994).contains(&share), "{deviation:?} at {m}: {share}");
        }
    }
}

#[test]
fn grids_are_octaves_and_decades() {
    assert_eq!(allan::octaves(20), [1, 2, 4, 8, 16]);
    assert_eq!(allan::decades(120, 3), [1, 2, 5, 10, 22, 46, 100]);
    assert!(deviations(&[1.0, 2.0], 1.0, &[1, 2, 0], Deviation::Hadamard).is_empty());
}
