use super::*;
use crate::math::random::Stream;
use proptest::prelude::*;

fn sum(x: &[f64], offset: f64, terms: &[(f64, f64)]) -> Vec<f64> {
    x.iter().map(|x| offset + terms.iter().map(|(a, r)| a * (-r * x).exp()).sum::<f64>()).collect()
}

fn grid(n: u32, span: f64) -> Vec<f64> {
    (0..n).map(|i| span * f64::from(i) / f64::from(n - 1)).collect()
}

const TWO: Shape = Shape { terms: 2, offset: true };

#[test]
fn standard_deviations_cover_the_truth() {
    // 400 draws: the normalised errors of a nearly linear problem have mean square 1 ± √(2/400)
    let x = grid(200, 5.0);
    let clean = sum(&x, 0.5, &[(2.0, 0.9)]);
    let truth = [0.5, 2.0, 0.9];
    let draws = 400;
    let mut squares = [0.0; 3];
    for draw in 0..draws {
        let mut noise = Stream::new(11, draw);
        let y: Vec<f64> = clean.iter().map(|y| y + 0.01 * noise.normal()).collect();
        let fit = fit(&x, &y, Shape { terms: 1, offset: true }).unwrap();
        assert!(fit.termination.converged());
        for (((square, p), s), t) in squares.iter_mut().zip(fit.parameters()).zip(fit.standard_deviations()).zip(truth)
        {
            *square += ((p - t) / s).powi(2) / draws as f64;
        }
    }
    for square in squares {
        assert!((square - 1.0).abs() < 4.0 * (2.0 / draws as f64).sqrt(), "{squares:?}");
    }
}

#[test]
fn a_record_that_begins_late_gives_amplitudes_at_zero() {
    let x: Vec<f64> = grid(80, 4.0).iter().map(|x| x + 3.0).collect();
    let fit = fit(&x, &sum(&x, -1.0, &[(2.0, 0.6), (90.0, 3.0)]), TWO).unwrap();
    for (found, known) in fit.parameters().iter().zip([-1.0, 2.0, 90.0, 0.6, 3.0]) {
        assert!((found / known - 1.0).abs() < 1e-8, "{found} {known}");
    }
}

#[test]
fn the_covariance_of_a_late_record_is_that_of_its_own_parameters() {
    // the same noise seen from x = 0 and from x = 2: amplitudes at zero, propagated by a = a' exp(2 r)
    let x = grid(60, 5.0);
    let mut noise = Stream::new(5, 1);
    let y: Vec<f64> = sum(&x, 0.0, &[(3.0, 0.7)]).iter().map(|y| y + 0.01 * noise.normal()).collect();
    let shape = Shape { terms: 1, offset: false };
    let early = fit(&x, &y, shape).unwrap();
    let late = fit(&x.iter().map(|x| x + 2.0).collect::<Vec<_>>(), &y, shape).unwrap();
    let (a, r, lift) = (early.amplitudes[0], early.rates[0], (2.0 * early.rates[0]).exp());
    assert!((late.amplitudes[0] / (a * lift) - 1.0).abs() < 1e-12 && (late.rates[0] / r - 1.0).abs() < 1e-12);
    let c = &early.covariance;
    let variance = lift * lift * (c[0][0] + 4.0 * a * c[0][1] + 4.0 * a * a * c[1][1]);
    assert!((late.covariance[0][0] / variance - 1.0).abs() < 1e-9, "{} {variance}", late.covariance[0][0]);
}

#[test]
fn data_that_cannot_be_fitted_are_refused_by_kind() {
    let x = grid(20, 1.0);
    let y = sum(&x, 0.0, &[(1.0, 2.0)]);
    let kind = |x: &[f64], y: &[f64], shape| fit(x, y, shape).unwrap_err().kind;
    let with = |at: usize, value: f64| {
        let mut changed = y.clone();
        changed[at] = value;
        changed
    };
    assert_eq!(kind(&[], &[], TWO), ErrorKind::TooShort);
    assert_eq!(kind(&x[..5], &y[..5], TWO), ErrorKind::TooShort);
    assert_eq!(kind(&[1.0; 20], &y, TWO), ErrorKind::TooShort);
    assert_eq!(kind(&x, &y[1..], TWO), ErrorKind::Usage);
    assert_eq!(kind(&x, &y, Shape { terms: 0, offset: true }), ErrorKind::Usage);
    assert_eq!(kind(&x, &y, Shape { terms: MAX_TERMS + 1, offset: true }), ErrorKind::Usage);
    assert_eq!(kind(&x, &with(3, f64::NAN), TWO), ErrorKind::Value);
    assert_eq!(kind(&x, &with(3, f64::NEG_INFINITY), TWO), ErrorKind::Value);
    assert_eq!(kind(&x, &[0.0; 20], TWO), ErrorKind::Value);
    assert_eq!(kind(&x, &[7.5; 20], TWO), ErrorKind::Value);
    let wide: Vec<f64> =
        (0..20).map(|i| if i < 10 { -1.7e308 } else { 1.7e308 } * f64::from(i % 10 + 1) / 10.0).collect();
    assert_eq!(kind(&wide, &y, TWO), ErrorKind::Value);
    // amplitudes at x = 0 of a record at x = 1e4 overflow
    let far: Vec<f64> = x.iter().map(|x| x + 1e4).collect();
    assert_eq!(kind(&far, &y, Shape { terms: 1, offset: false }), ErrorKind::Numeric);
}

#[test]
fn more_terms_than_the_data_hold_are_refused_or_have_rates_known_to_be_unknown() {
    let x = grid(60, 3.0);
    for noise in [0.0, 1e-3] {
        let mut draws = Stream::new(8, 8);
        let y: Vec<f64> = sum(&x, 0.0, &[(1.0, 2.0)]).iter().map(|y| y + noise * draws.normal()).collect();
        match fit(&x, &y, Shape { terms: 2, offset: true }) {
            Ok(sum) => {
                let std = sum.standard_deviations();
                assert!(sum.rates.iter().zip(&std[3..]).any(|(rate, std)| std > rate), "{sum:?}");
            }
            Err(error) => assert_eq!(error.kind, ErrorKind::Numeric),
        }
    }
}

#[test]
fn extreme_values_never_panic() {
    let x = grid(20, 1.0);
    let decay = sum(&x, 0.2, &[(1.0, 2.0)]);
    for unit in [1e-320, 1e-300, 1e-200, 1e200, 1e300, 1.7e308] {
        for terms in 1..=3 {
            for offset in [false, true] {
                let shape = Shape { terms, offset };
                let scaled: Vec<f64> = decay.iter().map(|y| y * unit).collect();
                let stretched: Vec<f64> = x.iter().map(|x| x * unit).collect();
                let spike: Vec<f64> = (0..20).map(|i| if i == 7 { unit } else { 0.0 }).collect();
                for answer in [fit(&x, &scaled, shape), fit(&stretched, &decay, shape), fit(&x, &spike, shape)] {
                    let finite = |sum: ExpSum| sum.parameters().iter().all(|p| p.is_finite());
                    assert!(answer.is_err() || answer.is_ok_and(finite), "{unit} {shape:?}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn separated_rates_are_found_from_noise_free_data(
        slow in 0.8f64..3.0,
        apart in 3.0f64..6.0,
        a in prop_oneof![-5.0f64..-0.5, 0.5f64..5.0],
        b in prop_oneof![-5.0f64..-0.5, 0.5f64..5.0],
        offset in -3.0f64..3.0,
    ) {
        let x = grid(120, 2.0);
        let known = [offset, a, b, slow, slow * apart];
        let fit = fit(&x, &sum(&x, offset, &[(b, slow * apart), (a, slow)]), TWO).unwrap();
        prop_assert!(fit.termination.converged(), "{:?}", fit.termination);
        for (found, known) in fit.parameters().iter().zip(known) {
            prop_assert!((found - known).abs() < 1e-8 * (1.0 + known.abs()), "{fit:?}");
        }
    }

    #[test]
    fn the_order_of_samples_does_not_matter(seed in any::<u64>()) {
        let mut stream = Stream::new(seed, 0);
        let x = grid(50, 3.0);
        let y: Vec<f64> = sum(&x, 1.0, &[(2.0, 0.8), (-1.5, 5.0)]).iter().map(|y| y + 1e-4 * stream.normal()).collect();
        let mut order: Vec<usize> = (0..x.len()).collect();
        stream.shuffle(&mut order);
        let pick = |v: &[f64]| order.iter().map(|&i| v[i]).collect::<Vec<_>>();
        prop_assert_eq!(fit(&x, &y, TWO), fit(&pick(&x), &pick(&y), TWO));
    }

    #[test]
    fn scales_of_x_and_y_scale_the_answer(x_unit in 1e-6f64..1e6, y_unit in 1e-9f64..1e9, seed in any::<u64>()) {
        let mut stream = Stream::new(seed, 1);
        let x = grid(50, 3.0);
        let y: Vec<f64> = sum(&x, 1.0, &[(2.0, 0.8), (-1.5, 5.0)]).iter().map(|y| y + 1e-4 * stream.normal()).collect();
        let plain = fit(&x, &y, TWO).unwrap();
        let times = |v: &[f64], unit: f64| v.iter().map(|v| v * unit).collect::<Vec<_>>();
        let scaled = fit(&times(&x, x_unit), &times(&y, y_unit), TWO).unwrap();
        let units = [y_unit, y_unit, y_unit, 1.0 / x_unit, 1.0 / x_unit];
        for of in [ExpSum::parameters, ExpSum::standard_deviations] {
            for ((p, s), unit) in of(&plain).into_iter().zip(of(&scaled)).zip(units) {
                prop_assert!((s / unit / p - 1.0).abs() < 1e-8, "{p} {s} {unit}");
            }
        }
    }

    #[test]
    fn noise_alone_gives_an_answer_or_an_error(seed in any::<u64>(), terms in 1usize..=3, offset in any::<bool>()) {
        let mut stream = Stream::new(seed, 2);
        let y: Vec<f64> = (0..30).map(|_| stream.normal()).collect();
        match fit(&grid(30, 1.0), &y, Shape { terms, offset }) {
            Ok(sum) => prop_assert!(sum.rss.is_finite() && sum.rates.iter().all(|r| *r > 0.0)),
            Err(error) => prop_assert_eq!(error.kind, ErrorKind::Numeric),
        }
    }
}
