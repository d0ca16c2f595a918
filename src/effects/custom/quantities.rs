//! t, v, ω, wheels, place, accelerations, forces: what expressions in drives follow, and the coordinates of their parameters

use crate::config::{CustomEffect, CustomParameter, Law};
use crate::effects::drive::Coordinate;
use crate::model::drive::{ForceFollows, Moving};

/// Ratio of the ends of a plausible range from which on its middle is the geometric one.
const WIDE: f64 = 10.0;

/// A quantity at one instant, by the motion and the speeds of the wheels that roll.
type Quantity = fn(&Moving, [f64; 2]) -> f64;

/// Signals of expressions in drives, and what the answer says of an effect that follows them: the first one that is in the
/// expression counts. For a place answers have no word.
pub(super) const QUANTITIES: [(&str, Option<&str>, Quantity); 12] = [
    ("x_m", None, |at, _| at.x_m),
    ("y_m", None, |at, _| at.y_m),
    ("heading_rad", Some("heading"), |at, _| at.heading_rad),
    ("wheel_left_force_n", Some("torque"), |at, _| at.wheel_force_n[0]),
    ("wheel_right_force_n", Some("torque"), |at, _| at.wheel_force_n[1]),
    ("yaw_acceleration_rad_s2", Some("yaw_acceleration"), |at, _| at.yaw_acceleration_rad_s2),
    ("acceleration_m_s2", Some("acceleration"), |at, _| at.acceleration_m_s2),
    ("speed_m_s", Some("speed"), |at, _| at.speed_m_s),
    ("wheel_left_rad_s", Some("speed"), |_, wheels| wheels[0]),
    ("wheel_right_rad_s", Some("speed"), |_, wheels| wheels[1]),
    ("yaw_rate_rad_s", Some("yaw_rate"), |at, _| at.yaw_rate_rad_s),
    ("t_s", Some("elapsed_time"), |at, _| at.since_power_on_s),
];

/// What a fit of a drive asks of a definition.
#[derive(Debug)]
pub(super) struct InDrives {
    /// In the order of the signals; none of those that are not in drives.
    pub quantities: Vec<Option<Quantity>>,
    pub force_follows: ForceFollows,
    /// Whether accelerations or forces of the wheels are in the expression.
    pub forced: bool,
    /// Places of the parameters in the order of the coordinates: those with a null value, then the shape.
    pub order: Vec<usize>,
    /// Value of each parameter at θ = 0.
    pub reference: Vec<f64>,
    pub coordinates: &'static [Coordinate],
    /// How many coordinates have a null value.
    pub sizes: usize,
}

/// Value of a parameter at θ = 0.
fn reference(p: &CustomParameter) -> f64 {
    let [low, high] = p.plausible;
    let middle = if low > 0.0 && high > WIDE * low { (low * high).sqrt() } else { 0.5 * (low + high) };
    p.null.unwrap_or(middle)
}

impl InDrives {
    pub(super) fn of(table: &CustomEffect, law: &Law) -> Self {
        let all = &table.parameters;
        let follows = |names: &[&str]| names.iter().any(|name| follows(table, law, name));
        let (mut order, shape): (Vec<usize>, Vec<usize>) = (0..all.len()).partition(|i| all[*i].null.is_some());
        let sizes = order.len();
        order.extend(shape);
        let reference: Vec<f64> = all.iter().map(reference).collect();
        let coordinate = |i: &usize| {
            let (p, at) = (&all[*i], reference[*i]);
            // as wide as values that are all equally plausible
            let spread = (p.plausible[1] - p.plausible[0]) / 12f64.sqrt();
            Coordinate {
                scale: if p.null.is_some() { p.plausible } else { [spread; 2] },
                bounds: p.bounds.map(|end| end - at),
            }
        };
        let quantity = |name: &str| QUANTITIES.into_iter().find(|known| known.0 == name).map(|known| known.2);
        Self {
            quantities: table.acts_on.signals().iter().map(|s| quantity(s.name)).collect(),
            force_follows: ForceFollows {
                position: follows(&["x_m", "y_m"]),
                heading: follows(&["heading_rad"]),
                speeds: follows(&["speed_m_s", "yaw_rate_rad_s", "wheel_left_rad_s", "wheel_right_rad_s"]),
                accelerations: false,
            },
            forced: follows(&[
                "acceleration_m_s2",
                "yaw_acceleration_rad_s2",
                "wheel_left_force_n",
                "wheel_right_force_n",
            ]),
            coordinates: Vec::leak(order.iter().map(coordinate).collect()),
            order,
            reference,
            sizes,
        }
    }
}

/// Whether the expression has the signal `name`.
pub(super) fn follows(table: &CustomEffect, law: &Law, name: &str) -> bool {
    table.acts_on.signals().iter().position(|s| s.name == name).is_some_and(|at| law.uses_signal(at))
}
