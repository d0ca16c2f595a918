//! g_i = (f(+) - f(-))/2e_i,   H_ij = (f(+,+) + f(-,-) - f(+,0) - f(-,0) - f(0,+) - f(0,-) + 2 f)/2e_i e_j
//!
//! Differences on both sides: a third derivative that was taken for a second one would turn a narrow valley, in which a
//! maximum is sought, away from where it leads (Abramowitz and Stegun, 25.3.27).

/// Gradient of `f` at `x`, and its curvature -H by rows, by differences of `steps`; `here` is f(x). Zero where `f` is infinite beside.
#[must_use]
pub(crate) fn curvature(f: impl Fn(&[f64]) -> f64, x: &[f64], here: f64, steps: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let d = x.len();
    let moved = |by: &[usize], sign: f64| {
        let mut y = x.to_vec();
        by.iter().for_each(|i| y[*i] += sign * steps[*i]);
        f(&y)
    };
    let ends: Vec<[f64; 2]> = (0..d).map(|i| [moved(&[i], 1.0), moved(&[i], -1.0)]).collect();
    let slope = |([up, down], e): (&[f64; 2], &f64)| Some((up - down) / (2.0 * e)).filter(|v| v.is_finite());
    let gradient = ends.iter().zip(steps).map(|end| slope(end).unwrap_or(0.0)).collect();
    let bend: Vec<f64> = ends.iter().map(|[up, down]| up - 2.0 * here + down).collect();
    let mut out = vec![0.0; d * d];
    for i in 0..d {
        out[i * d + i] = -bend[i] / (steps[i] * steps[i]);
        for j in 0..i {
            let both = moved(&[i, j], 1.0) - 2.0 * here + moved(&[i, j], -1.0);
            let mixed = (bend[i] + bend[j] - both) / (2.0 * steps[i] * steps[j]);
            (out[i * d + j], out[j * d + i]) = (mixed, mixed);
        }
    }
    // beside the edge of where f is defined it tells nothing
    out.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
    (gradient, out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_tells_nothing() {
        let f = |x: &[f64]| if x[0] > 1.0 { f64::NEG_INFINITY } else { -x[0] * x[0] - x[1] * x[1] };
        let (gradient, curvature) = curvature(f, &[1.0, 1.0], -2.0, &[0.1, 0.1]);
        assert!(gradient[0] == 0.0 && (gradient[1] + 2.0).abs() < 1e-9, "{gradient:?}");
        assert!(curvature[..3] == [0.0; 3] && (curvature[3] - 2.0).abs() < 1e-9, "{curvature:?}");
    }

    #[test]
    fn a_cubic_has_the_curvature_of_its_quadratic_part() {
        // the third derivatives are far larger than the second ones
        let f = |x: &[f64]| {
            let (a, b) = (x[0] - 1.0, x[1] + 2.0);
            -1.5 * a * a + 0.25 * a * b - 0.5 * b * b + 300.0 * (a * a * b + a * b * b + a * a * a)
        };
        let x = [1.0, -2.0];
        let (gradient, curvature) = curvature(f, &x, f(&x), &[0.01, 0.02]);
        assert!((gradient[0] - 300.0 * 1e-4).abs() < 1e-9 && gradient[1].abs() < 1e-9, "{gradient:?}");
        for (found, true_one) in curvature.iter().zip([3.0, -0.25, -0.25, 1.0]) {
            assert!((found - true_one).abs() < 1e-8, "{curvature:?}");
        }
    }
}
