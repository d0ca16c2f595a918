//! Lattice and outliers: with one static coefficient the likelihood is an integral over it.

use super::super::lattice::Cell;
use super::super::*;
use super::log_sum_exp;

fn constant(rows: usize) -> Believed {
    let mut believed = Believed::white(rows, 0.1, 1.0);
    believed.coefficients.push(Coefficient { column: vec![1.0; rows], mean: 0.4, std: 2.0 });
    believed
}

/// ln ∫ N(β; mean, std²) Π_k p(y_k | β) dβ by the trapezoidal rule, which is all but exact for smooth densities.
fn integral(believed: &Believed, y: &[f64], log_density: impl Fn(f64) -> f64) -> f64 {
    let Coefficient { mean, std, .. } = believed.coefficients[0];
    let (n, reach) = (8000, 8.0);
    let logs: Vec<f64> = (0..=n)
        .map(|i| reach * (2.0 * f64::from(i) / f64::from(n) - 1.0))
        .map(|z| {
            let beta = mean + std * z;
            -0.5 * z * z + y.iter().map(|y| log_density(y - beta)).sum::<f64>()
        })
        .collect();
    log_sum_exp(&logs) + (2.0 * reach / f64::from(n)).ln() - 0.5 * std::f64::consts::TAU.ln()
}

#[test]
fn a_lattice_is_scored_as_the_integral_over_cells() {
    // collapsing costs nothing on a fine lattice and at most this many nats in all on a coarse one
    for (lsb, bound) in [(0.01, 1e-6), (0.5, 1e-5), (2.0, 5e-3), (4.0, 0.15)] {
        let mut believed = constant(40);
        believed.lattice_lsb_rad_s = Some(lsb);
        for stream in 0..10 {
            let y = believed.simulate(5, stream).unwrap();
            assert!(y.iter().all(|y| (y / lsb - (y / lsb).round()).abs() < 1e-9));
            let exact = integral(&believed, &y, |r| Cell::new(r, 0.5 * lsb).log_probability - lsb.ln());
            let found = believed.score(&y).unwrap().total();
            assert!((found - exact).abs() < bound, "{lsb}: {found} {exact}");
        }
    }
}

#[test]
fn a_fine_lattice_is_no_lattice() {
    let plain = constant(100);
    let mut fine = plain.clone();
    fine.lattice_lsb_rad_s = Some(1e-5);
    let y = fine.simulate(1, 0).unwrap();
    let (a, b) = (plain.score(&y).unwrap().total(), fine.score(&y).unwrap().total());
    assert!((a - b).abs() < 1e-6, "{a} {b}");
}

#[test]
fn outliers_are_scored_as_the_integral_over_the_mixture() {
    let normal = |r: f64, s: f64| -0.5 * ((std::f64::consts::TAU * s * s).ln() + r * r / (s * s));
    for (probability, std, bound) in [(0.02, 10.0, 0.02), (0.1, 4.0, 0.1), (0.3, 20.0, 0.3)] {
        let mut believed = constant(60);
        believed.outliers = Some(Outliers { probability, std_rad_s: std });
        let mut worst = 0.0f64;
        for stream in 0..20 {
            let y = believed.simulate(9, stream).unwrap();
            let wide = f64::hypot(1.0, std);
            let exact = integral(&believed, &y, |r| {
                log_sum_exp(&[(1.0 - probability).ln() + normal(r, 1.0), probability.ln() + normal(r, wide)])
            });
            worst = worst.max((believed.score(&y).unwrap().total() - exact).abs());
        }
        assert!(worst < bound, "{probability} {std}: {worst}");
    }
}

#[test]
fn a_wild_reading_counts_as_unlikely_not_as_impossible() {
    let mut believed = constant(50);
    believed.lattice_lsb_rad_s = Some(0.1);
    let mut y = believed.simulate(2, 0).unwrap();
    y[20] = 500.0;
    let row = believed.score(&y).unwrap().log_density[20];
    assert!(row < -1e5 && row.is_finite(), "{row}");
    believed.outliers = Some(Outliers { probability: 1e-3, std_rad_s: 300.0 });
    let run = believed.score(&y).unwrap();
    assert!(run.log_density[20] > -20.0, "{}", run.log_density[20]);
    // and the estimate did not move
    assert!((run.predicted_rad_s[21] - run.predicted_rad_s[20]).abs() < 0.1);
}
