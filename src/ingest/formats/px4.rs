//! PX4's messages of gyros (uORB topics, also as `px4_msgs` in ROS 2): which field is what.

use super::fill::Ratio;
use super::head::Head;
use crate::ingest::columns::names::{Axis, Role, TimeKind};

/// Role and unit of the fields of `message` (`sensor_gyro`), whose columns begin at `first` and count time from `boot`
/// or from whatever ROS uses. Increments of angle become rates.
pub(crate) fn dress(message: &str, heads: &mut [Head], boot: bool) -> Vec<Ratio> {
    let clock = if boot { TimeKind::SincePowerOn } else { TimeKind::Sensor };
    let sampled = heads.iter().any(|h| h.name == "timestamp_sample");
    for head in heads.iter_mut() {
        let role = match head.name.as_str() {
            // means, inconsistencies and biases are called after the gyro too
            _ if matches!(head.named().role, Role::Gyro(_)) => {
                head.role = Some(Role::Other);
                continue;
            }
            // the sample's own time, where it is told beside that of its publication
            "timestamp_sample" => Role::Time(clock),
            "timestamp" if sampled => Role::Time(TimeKind::Host),
            "timestamp" => Role::Time(clock),
            _ => continue,
        };
        *head = head.clone().with_role(role).with_unit("us");
    }
    let gyro = |head: &mut Head, axis: Axis| *head = head.clone().with_role(Role::Gyro(Some(axis))).with_unit("rad/s");
    let axes = Axis::ALL.iter().enumerate();
    match message {
        "sensor_gyro" => {
            for head in heads.iter_mut() {
                match head.name.as_str() {
                    "x" => gyro(head, Axis::X),
                    "y" => gyro(head, Axis::Y),
                    "z" => gyro(head, Axis::Z),
                    "temperature" => *head = head.clone().with_role(Role::Temperature).with_unit("degC"),
                    _ => {}
                }
            }
        }
        "sensor_combined" => {
            for (i, axis) in axes {
                heads.iter_mut().filter(|h| h.name == format!("gyro_rad[{i}]")).for_each(|h| gyro(h, *axis));
            }
        }
        "vehicle_imu" => {
            let interval = ["delta_angle_dt", "dt"].iter().find_map(|n| heads.iter().position(|h| h.name == *n));
            let Some(by) = interval else { return Vec::new() };
            let by_name = heads[by].name.clone();
            let mut ratios = Vec::new();
            for (i, axis) in axes {
                let Some(column) = heads.iter().position(|h| h.name == format!("delta_angle[{i}]")) else { continue };
                heads[column].name = format!("delta_angle[{i}]/{by_name}");
                gyro(&mut heads[column], *axis);
                ratios.push(Ratio { column, by, unit: 1e-6 });
            }
            return ratios;
        }
        _ => {}
    }
    Vec::new()
}

/// `SensorGyro` as `sensor_gyro`.
pub(crate) fn topic_of(type_name: &str) -> String {
    let mut out = String::new();
    for c in type_name.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heads(names: &[&str]) -> Vec<Head> {
        names.iter().map(|n| Head::number(*n, "float")).collect()
    }

    #[test]
    fn the_samples_own_time_comes_first() {
        let mut h = heads(&["timestamp", "timestamp_sample", "x", "y", "z", "temperature"]);
        assert!(dress(&topic_of("SensorGyro"), &mut h, true).is_empty());
        let roles: Vec<Role> = h.iter().map(|h| h.named().role).collect();
        assert_eq!(roles[0], Role::Time(TimeKind::Host));
        assert_eq!(roles[1], Role::Time(TimeKind::SincePowerOn));
        assert_eq!(roles[4], Role::Gyro(Some(Axis::Z)));
        assert_eq!(roles[5], Role::Temperature);
        let mut h = heads(&["timestamp", "gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"]);
        dress("sensor_combined", &mut h, false);
        assert_eq!(h[0].named().role, Role::Time(TimeKind::Sensor));
        assert_eq!(h[3].named().unit.as_deref(), Some("rad/s"));
    }

    #[test]
    fn increments_are_divided_by_their_interval() {
        let names = ["timestamp", "delta_angle[0]", "delta_angle[1]", "delta_angle[2]", "delta_angle_dt"];
        let mut h = heads(&names);
        let ratios = dress("vehicle_imu", &mut h, true);
        assert_eq!(ratios[2], Ratio { column: 3, by: 4, unit: 1e-6 });
        assert_eq!(h[3].name, "delta_angle[2]/delta_angle_dt");
        assert!(dress("vehicle_imu", &mut heads(&names[..4]), true).is_empty());
    }
}
