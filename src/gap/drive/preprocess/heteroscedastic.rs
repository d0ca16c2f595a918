//! max over conditions of Σ_c -n_c/2 ln s_c² + n/2 ln s² - price:   innovations of variance s_c² in class c of a condition,
//! or -n/2 ln(1 - ρ²) of the correlation ρ of successive ones
//!
//! Whether innovations are white noise of one variance, whatever the robot does.

use crate::gap::drive::preprocess::level::{Residual, WORTH, price};
use crate::gap::drive::record::Record;

/// Classes of equal size in which noise levels are compared.
const CLASSES: usize = 8;
/// Rows on either side whose wheel speeds tell the motion at a row.
const BESIDE: usize = 5;

/// Departure of the residuals of these channels from white noise of one variance: the condition that shows it most, and
/// its evidence beyond the cost of looking for it, nats; none where that is below [`WORTH`].
pub(crate) fn departs(record: &Record, residuals: &[Residual], places: &[usize]) -> Option<(&'static str, f64)> {
    let own: Vec<&Residual> = residuals.iter().filter(|r| places.contains(&(r.0 as usize))).collect();
    let n = own.len() as f64;
    let mean = own.iter().map(|r| r.2 * r.2).sum::<f64>() / n;
    // readings beside a row tell the motion, and nothing of the noise in the row
    let around = |k: usize| -> [f64; 2] {
        let drive = record.drive_around(k);
        let rows = k.saturating_sub(BESIDE).max(drive.start)..(k + BESIDE + 1).min(drive.end);
        let (n, sum) = rows.filter(|row| *row != k).fold((0.0, [0.0; 2]), |(n, sum), row| {
            let [l, r] = [0, 1].map(|i| record.wheels_rad_s[i][row]);
            if l.is_finite() && r.is_finite() { (n + 1.0, [sum[0] + l, sum[1] + r]) } else { (n, sum) }
        });
        sum.map(|s| s / n)
    };
    // the torque before the reading: a speed control computes the torque of a row from that row's readings, noise
    // included
    let torque = |k: usize| match k.checked_sub(1) {
        Some(before) if record.drive_around(k).contains(&before) => {
            record.torques(before).iter().map(|u| u.abs()).sum()
        }
        _ => f64::NAN,
    };
    let conditions: [(&'static str, &dyn Fn(usize) -> f64); 4] = [
        ("speed", &|k| around(k).iter().sum::<f64>().abs()),
        ("yaw_rate", &|k| (around(k)[1] - around(k)[0]).abs()),
        ("elapsed_time", &|k| k as f64),
        ("torque", &torque),
    ];
    let classes = |of: &dyn Fn(usize) -> f64| {
        let mut by: Vec<(f64, f64)> = own.iter().map(|r| (of(r.1), r.2 * r.2)).filter(|b| b.0.is_finite()).collect();
        by.sort_by(|a, b| a.0.total_cmp(&b.0));
        let each = by.len().div_ceil(CLASSES).max(1);
        let of_class = |c: &[(f64, f64)]| {
            let mean = c.iter().map(|b| b.1).sum::<f64>() / c.len() as f64;
            -0.5 * c.len() as f64 * mean.max(f64::MIN_POSITIVE).ln()
        };
        let all = if by.is_empty() { 0.0 } else { of_class(&by) };
        by.chunks(each).map(of_class).sum::<f64>() - all - (CLASSES - 1) as f64 * price(each)
    };
    let mut found: Vec<(&'static str, f64)> = conditions.iter().map(|(name, of)| (*name, classes(of))).collect();
    // correlation from one reading to the next, by channel
    let remembered = |place: &usize| {
        let one: Vec<f64> = residuals.iter().filter(|r| r.0 as usize == *place).map(|r| r.2).collect();
        let product = one.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / (mean * one.len().max(1) as f64);
        -0.5 * one.len() as f64 * (1.0 - product.clamp(-0.99, 0.99).powi(2)).ln() - price(one.len())
    };
    found.push(("coloured", places.iter().map(remembered).sum()));
    found.into_iter().filter(|f| f.1 >= WORTH).max_by(|a, b| a.1.total_cmp(&b.1))
}
