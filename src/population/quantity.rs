//! C1, C2, ln T and ln N of a power-on, with the standard deviations of their errors.

use super::row::Row;

/// The quantities that are tracked: name, whether by logarithm, value and standard deviation.
pub(super) type Quantity = (&'static str, bool, fn(&Row) -> Option<[f64; 2]>);
pub(super) const QUANTITIES: [Quantity; 4] = [
    ("c1_rad_s", false, |r| Some([r.c1_rad_s?, r.c1_std_rad_s?])),
    ("c2_rad_s", false, |r| Some([r.c2_rad_s?, r.c2_std_rad_s?])),
    ("time_constant_s", true, |r| Some([r.time_constant_s?, r.time_constant_std_s?])),
    // the standard deviation of ln N by n differences of samples, 1/√(2 n)
    ("angle_random_walk_rad_sqrt_s", true, |r| {
        let n = r.angle_random_walk_rad_sqrt_s?;
        Some([n, n / (2.0 * r.degrees_of_freedom.unwrap_or(1.0).max(1.0)).sqrt()])
    }),
];

/// Value and standard deviation of a quantity in a row, through its logarithm where it has one; none where the row does not tell it.
pub(super) fn observed(quantity: &Quantity, row: &Row) -> Option<[f64; 2]> {
    let told = row.source.error.is_none() && row.warm_up_found != Some(false) && row.identifiable != Some(false);
    let [value, std] = (quantity.2)(row).filter(|_| told)?;
    let seen = if quantity.1 { [value.ln(), std / value] } else { [value, std] };
    // a parameter that was given has no spread
    (seen.iter().all(|v| v.is_finite()) && std > 0.0).then_some(seen)
}
