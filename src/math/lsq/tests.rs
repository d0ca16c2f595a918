use super::*;
use crate::error::ErrorKind;
use crate::math::random::Stream;
use proptest::prelude::*;

/// x⁰, x¹, ... on a grid that is not centred: badly scaled, well determined.
fn powers(n: u32, degree: i32) -> Vec<Vec<f64>> {
    (0..=degree).map(|d| (0..n).map(|i| (1.0 + f64::from(i)).powi(d)).collect()).collect()
}

fn combine(columns: &[Vec<f64>], c: &[f64]) -> Vec<f64> {
    (0..columns[0].len()).map(|i| columns.iter().zip(c).map(|(col, c)| col[i] * c).sum()).collect()
}

#[test]
fn a_combination_of_columns_is_found_again() {
    let columns = powers(30, 3);
    let truth = [3.0, -0.5, 2e-2, 7e-4];
    let fit = solve_qr(&columns, &combine(&columns, &truth)).unwrap();
    assert_eq!(fit.rank, 4);
    for (c, t) in fit.coefficients.iter().zip(truth) {
        assert!((c / t - 1.0).abs() < 1e-10, "{c} {t}");
    }
}

#[test]
fn a_straight_line_has_the_textbook_covariance() {
    // y = a + b x: (AᵀA)⁻¹ = [[Σx², -Σx], [-Σx, n]] / (n Σx² - (Σx)²)
    let columns = powers(12, 1);
    let y: Vec<f64> = (0..12).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
    let fit = solve_qr(&columns, &y).unwrap();
    let (n, sx, sxx) = (12.0, 78.0, 650.0);
    let det = n * sxx - sx * sx;
    let covariance = fit.inverse_normal();
    for (found, known) in [
        (covariance[0][0], sxx / det),
        (covariance[0][1], -sx / det),
        (covariance[1][0], -sx / det),
        (covariance[1][1], n / det),
    ] {
        assert!((found / known - 1.0).abs() < 1e-13, "{found} {known}");
    }
    for column in &columns {
        assert!(dot(column, &fit.residuals).abs() < 1e-12, "residuals are orthogonal to the columns");
    }
}

#[test]
fn a_dependent_column_is_named() {
    let mut columns = powers(20, 2);
    columns.push(columns[0].iter().zip(&columns[1]).map(|(a, b)| 2.0 * a - 3.0 * b).collect());
    columns.push(vec![0.0; 20]);
    let y = combine(&columns[..3], &[1.0, 2.0, 3.0]);
    let fit = solve_qr(&columns, &y).unwrap();
    assert_eq!(fit.rank, 3);
    assert_eq!(fit.dropped.len(), 2);
    assert!(fit.dropped.contains(&4), "the column of zeros: {:?}", fit.dropped);
    assert!(fit.rss < 1e-20 * dot(&y, &y));
    for j in fit.dropped {
        assert_eq!(fit.coefficients[j], 0.0);
    }
}

#[test]
fn duals_are_biorthogonal_and_the_projection_is_complete() {
    let columns = powers(25, 3);
    let factor = QrFactor::new(&columns).unwrap();
    for j in 0..columns.len() {
        let dual = factor.dual(j);
        for (k, column) in columns.iter().enumerate() {
            let product = dot(&dual, column);
            let known = if j == k { 1.0 } else { 0.0 };
            assert!((product - known).abs() < 1e-13 * norm(&dual) * norm(column), "{j} {k} {product}");
        }
    }
    let mut v: Vec<f64> = (0..25).map(|i| f64::from(i).sin()).collect();
    factor.project_out(&mut v);
    for column in &columns {
        assert!(dot(&v, column).abs() < 1e-14 * norm(column));
    }
}

#[test]
fn shapes_and_values_that_cannot_be_fitted_are_refused() {
    let kind = |columns: &[Vec<f64>], y: &[f64]| solve_qr(columns, y).unwrap_err().kind;
    assert_eq!(kind(&[], &[]), ErrorKind::Usage);
    assert_eq!(kind(&[vec![]], &[]), ErrorKind::TooShort);
    assert_eq!(kind(&[vec![1.0], vec![2.0]], &[1.0]), ErrorKind::TooShort);
    assert_eq!(kind(&[vec![1.0, 2.0], vec![2.0]], &[1.0, 1.0]), ErrorKind::Usage);
    assert_eq!(kind(&[vec![1.0, f64::NAN]], &[1.0, 1.0]), ErrorKind::Value);
    assert_eq!(kind(&[vec![1.0, 2.0]], &[1.0, f64::INFINITY]), ErrorKind::Value);
    assert_eq!(kind(&[vec![1.0, 2.0]], &[1.0]), ErrorKind::Usage);
    assert_eq!(kind(&[vec![f64::MAX, f64::MAX]], &[1.0, 1.0]), ErrorKind::Numeric);
}

#[test]
fn lengths_neither_overflow_nor_underflow() {
    for unit in [1e-300, 1e-170, 1.0, 1e170, 1e300] {
        assert!((norm(&[3.0 * unit, 4.0 * unit]) / (5.0 * unit) - 1.0).abs() < 1e-15);
    }
    assert!(norm(&[1.0, f64::NAN]).is_nan() && norm(&[f64::INFINITY, 1.0]).is_infinite());
    assert_eq!(norm(&[]), 0.0);
}

/// b1 (1 - exp(-b2 x)) with noise, fitted from `start`.
fn rise(start: [f64; 2], noise: f64) -> Result<Polished> {
    let mut draws = Stream::new(3, 0);
    let data: Vec<(f64, f64)> = (1..60)
        .map(|i| f64::from(i) / 10.0)
        .map(|x| (x, -3.0 * (-0.7 * x).exp_m1() + noise * draws.normal()))
        .collect();
    polish(
        &start,
        &mut |p, residual, jacobian| {
            residual.extend(data.iter().map(|(x, y)| -p[0] * (-p[1] * x).exp_m1() - y));
            jacobian.push(data.iter().map(|(x, _)| -(-p[1] * x).exp_m1()).collect());
            jacobian.push(data.iter().map(|(x, _)| p[0] * x * (-p[1] * x).exp()).collect());
        },
        50,
    )
}

#[test]
fn polish_reaches_the_truth_without_noise_and_the_minimum_with_it() {
    let clean = rise([2.0, 1.5], 0.0).unwrap();
    assert!(clean.termination.converged(), "{:?}", clean.termination);
    assert!((clean.parameters[0] / 3.0 - 1.0).abs() < 1e-14 && (clean.parameters[1] / 0.7 - 1.0).abs() < 1e-14);
    // the same minimum from two starts, whatever the noise
    let (a, b) = (rise([2.0, 1.5], 0.1).unwrap(), rise([4.0, 0.3], 0.1).unwrap());
    assert!(a.termination.converged() && b.termination.converged());
    for (a, b) in a.parameters.iter().zip(&b.parameters) {
        assert!((a / b - 1.0).abs() < 1e-13, "{a} {b}");
    }
}

#[test]
fn polish_says_when_steps_run_out() {
    let model = &mut |p: &[f64], residual: &mut Vec<f64>, jacobian: &mut Vec<Vec<f64>>| {
        // Rosenbrock's valley
        residual.extend([1.0 - p[0], 10.0 * (p[1] - p[0] * p[0])]);
        jacobian.push(vec![-1.0, -20.0 * p[0]]);
        jacobian.push(vec![0.0, 10.0]);
    };
    let short = polish(&[-1.2, 1.0], model, 1).unwrap();
    assert!(matches!(short.termination, Termination::StepLimit { steps: 1, .. }), "{:?}", short.termination);
    let whole = polish(&[-1.2, 1.0], model, 200).unwrap();
    assert!(whole.termination.converged(), "{:?}", whole.termination);
    assert!(whole.parameters.iter().all(|p| (p - 1.0).abs() < 1e-14) && whole.rss < 1e-28);
}

#[test]
fn polish_names_a_parameter_without_influence() {
    let error = rise([0.0, 1.0], 0.0).unwrap_err();
    assert_eq!(error.kind, ErrorKind::Numeric);
    assert_eq!(error.place.as_deref(), Some("parameter 2"));
}

#[test]
fn polish_refuses_what_it_cannot_start_from() {
    assert_eq!(rise([f64::NAN, 1.0], 0.0).unwrap_err().kind, ErrorKind::Value);
    assert_eq!(rise([1e300, -1e3], 0.0).unwrap_err().kind, ErrorKind::Value);
    let no_columns = polish(&[1.0], &mut |_, r, _| r.push(1.0), 3).unwrap_err();
    assert_eq!(no_columns.kind, ErrorKind::Usage);
    let ragged = polish(&[1.0], &mut |_, r, j| (r.push(1.0), j.push(vec![1.0, 2.0])).0, 3).unwrap_err();
    assert_eq!(ragged.kind, ErrorKind::Usage);
    assert_eq!(polish(&[], &mut |_, _, _| (), 3).unwrap_err().kind, ErrorKind::Usage);
}

proptest! {
    #[test]
    fn units_of_columns_and_data_only_scale_the_answer(
        shifts in prop::array::uniform3(-60i32..60),
        data in -60i32..60,
    ) {
        let columns = powers(15, 2);
        let y: Vec<f64> = (0..15).map(|i| (0.3 * f64::from(i)).cos()).collect();
        let plain = solve_qr(&columns, &y).unwrap();
        let unit = 2.0_f64.powi(data);
        let scaled: Vec<Vec<f64>> =
            columns.iter().zip(shifts).map(|(c, s)| c.iter().map(|v| v * 2.0_f64.powi(s)).collect()).collect();
        let fit = solve_qr(&scaled, &y.iter().map(|v| v * unit).collect::<Vec<_>>()).unwrap();
        for ((a, b), s) in plain.coefficients.iter().zip(&fit.coefficients).zip(shifts) {
            prop_assert!((b * 2.0_f64.powi(s) / unit / a - 1.0).abs() < 1e-12);
        }
        prop_assert!((fit.rss / (unit * unit) / plain.rss - 1.0).abs() < 1e-12);
    }
}
