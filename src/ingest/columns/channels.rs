//! The channels of a drive, and the column names that leave no doubt about them.
//!
//! A name is recognised only with its unit, so that `speed` alone is not, `speed_kph` is; what messages of ROS hold
//! is in SI by its convention (REP 103), and names of one side such as `velL` are taken to be, which is told. Gyro, temperature, supply and time are told by their words, see
//! [`crate::ingest::columns::names`].

use super::names;
use super::quantity::{Conversion, Quantity, stem};
use crate::ingest::formats::head::{Head, Kind};
use crate::signal::names as channel;

/// A channel, and the names that mean it, the surest first.
pub(crate) struct Entry {
    pub channel: &'static str,
    pub quantity: Quantity,
    spellings: &'static [&'static str],
    /// Names that mean it without a unit, which is then that of SI.
    bare: &'static [&'static str],
}

const fn entry(channel: &'static str, quantity: Quantity, spellings: &'static [&'static str]) -> Entry {
    Entry { channel, quantity, spellings, bare: &[] }
}

/// A channel of one side: names with a unit, and names without.
const fn side(
    channel: &'static str,
    quantity: Quantity,
    spellings: &'static [&'static str],
    bare: &'static [&'static str],
) -> Entry {
    Entry { channel, quantity, spellings, bare }
}

/// All channels that a drive can have.
pub(crate) const TABLE: [Entry; 23] = [
    entry(channel::GYRO_Z, Quantity::Rate, &[]),
    entry(
        channel::WHEEL_LEFT,
        Quantity::Rate,
        &["wheel_left", "left_wheel", "wheel_speed_left", "left_wheel_speed", "encoder_left", "left_encoder"],
    ),
    entry(
        channel::WHEEL_RIGHT,
        Quantity::Rate,
        &["wheel_right", "right_wheel", "wheel_speed_right", "right_wheel_speed", "encoder_right", "right_encoder"],
    ),
    side(
        channel::WHEEL_LEFT_SPEED,
        Quantity::Speed,
        &[
            "wheel_left",
            "left_wheel",
            "wheel_speed_left",
            "left_wheel_speed",
            "speed_left",
            "left_speed",
            "v_left",
            "vel_l",
            "vel_left",
            "left_vel",
            "velocity_left",
            "left_velocity",
            "wheel_velocity_left",
            "left_wheel_velocity",
        ],
        &["vel_l", "vel_left", "left_vel", "velocity_left", "left_velocity"],
    ),
    side(
        channel::WHEEL_RIGHT_SPEED,
        Quantity::Speed,
        &[
            "wheel_right",
            "right_wheel",
            "wheel_speed_right",
            "right_wheel_speed",
            "speed_right",
            "right_speed",
            "v_right",
            "vel_r",
            "vel_right",
            "right_vel",
            "velocity_right",
            "right_velocity",
            "wheel_velocity_right",
            "right_wheel_velocity",
        ],
        &["vel_r", "vel_right", "right_vel", "velocity_right", "right_velocity"],
    ),
    entry(
        channel::WHEEL_LEFT_TICKS,
        Quantity::Count,
        &["wheel_left", "left_wheel", "encoder_left", "left_encoder", "left"],
    ),
    entry(
        channel::WHEEL_RIGHT_TICKS,
        Quantity::Count,
        &["wheel_right", "right_wheel", "encoder_right", "right_encoder", "right"],
    ),
    entry(
        channel::ODO_SPEED,
        Quantity::Speed,
        &[
            "odo_speed",
            "odo_v",
            "odom_speed",
            "odom_v",
            "odometry_speed",
            "odometry_v",
            "odom_twist_twist_linear_x",
            "twist_twist_linear_x",
            "wheel_speed",
            "vehicle_speed",
            "forward_speed",
            "speed",
        ],
    ),
    entry(
        channel::ODO_YAW_RATE,
        Quantity::Rate,
        &[
            "odo_yaw_rate",
            "odo_w",
            "odo_omega",
            "odom_yaw_rate",
            "odom_w",
            "odom_omega",
            "odometry_yaw_rate",
            "odom_twist_twist_angular_z",
            "twist_twist_angular_z",
            "wheel_yaw_rate",
        ],
    ),
    entry(channel::TORQUE_LEFT, Quantity::Torque, &["torque_left", "left_torque", "motor_torque_left"]),
    entry(channel::TORQUE_RIGHT, Quantity::Torque, &["torque_right", "right_torque", "motor_torque_right"]),
    side(
        channel::CURRENT_LEFT,
        Quantity::Current,
        &["motor_current_left", "left_motor_current", "current_left", "left_current", "cur_l", "current_l", "i_left"],
        &["motor_current_left", "left_motor_current", "current_left", "left_current", "cur_l", "cur_left"],
    ),
    side(
        channel::CURRENT_RIGHT,
        Quantity::Current,
        &[
            "motor_current_right",
            "right_motor_current",
            "current_right",
            "right_current",
            "cur_r",
            "current_r",
            "i_right",
        ],
        &["motor_current_right", "right_motor_current", "current_right", "right_current", "cur_r", "cur_right"],
    ),
    entry(
        channel::COMMAND_LEFT,
        Quantity::Rate,
        &[
            "command_left",
            "cmd_left",
            "left_cmd",
            "left_command",
            "wheel_left_cmd",
            "cmd_wheel_left",
            "left_wheel_cmd",
            "wheel_left_command",
            "wheel_command_left",
            "wheel_cmd_left",
            "left_wheel_command",
            "wheel_left_setpoint",
            "left_wheel_setpoint",
            "wheel_left_target",
            "target_wheel_left",
            "wheel_left_desired",
        ],
    ),
    entry(
        channel::COMMAND_RIGHT,
        Quantity::Rate,
        &[
            "command_right",
            "cmd_right",
            "right_cmd",
            "right_command",
            "wheel_right_cmd",
            "cmd_wheel_right",
            "right_wheel_cmd",
            "wheel_right_command",
            "wheel_command_right",
            "wheel_cmd_right",
            "right_wheel_command",
            "wheel_right_setpoint",
            "right_wheel_setpoint",
            "wheel_right_target",
            "target_wheel_right",
            "wheel_right_desired",
        ],
    ),
    side(
        channel::COMMAND_SPEED,
        Quantity::Speed,
        &[
            "command_speed",
            "cmd_speed",
            "cmd_v",
            "cmd_vel",
            "speed_cmd",
            "speed_command",
            "speed_setpoint",
            "target_speed",
        ],
        &["cmd_vel_linear_x", "cmd_vel_twist_linear_x", "command_linear_x", "cmd_linear_x", "cmd_vel_x", "linear_x"],
    ),
    side(
        channel::COMMAND_YAW_RATE,
        Quantity::Rate,
        &[
            "command_yaw_rate",
            "cmd_yaw_rate",
            "cmd_w",
            "cmd_omega",
            "yaw_rate_cmd",
            "yaw_rate_command",
            "yaw_rate_setpoint",
            "target_yaw_rate",
        ],
        &["cmd_vel_angular_z", "cmd_vel_twist_angular_z", "command_angular_z", "cmd_angular_z", "angular_z"],
    ),
    entry(
        channel::X,
        Quantity::Length,
        &[
            "x",
            "truth_x",
            "true_x",
            "gt_x",
            "groundtruth_x",
            "ground_truth_x",
            "reference_x",
            "ref_x",
            "mocap_x",
            "truth_east",
            "reference_east",
            "ref_east",
            "gnss_east",
            "gps_east",
            "east",
        ],
    ),
    entry(
        channel::Y,
        Quantity::Length,
        &[
            "y",
            "truth_y",
            "true_y",
            "gt_y",
            "groundtruth_y",
            "ground_truth_y",
            "reference_y",
            "ref_y",
            "mocap_y",
            "truth_north",
            "reference_north",
            "ref_north",
            "gnss_north",
            "gps_north",
            "north",
        ],
    ),
    entry(
        channel::HEADING,
        Quantity::Angle,
        &[
            "heading",
            "truth_yaw",
            "truth_heading",
            "true_yaw",
            "true_heading",
            "gt_yaw",
            "gt_heading",
            "groundtruth_yaw",
            "ground_truth_yaw",
            "reference_yaw",
            "reference_heading",
            "ref_yaw",
            "ref_heading",
            "mocap_yaw",
        ],
    ),
    entry(channel::TEMPERATURE, Quantity::Temperature, &[]),
    entry(channel::SUPPLY, Quantity::Voltage, &[]),
    entry(channel::SINCE_POWER_ON, Quantity::Time, &[]),
];

/// The entry of a channel.
pub(crate) fn of(channel: &str) -> Option<&'static Entry> {
    TABLE.iter().find(|e| e.channel == channel)
}

/// A column that is a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Found {
    pub channel: &'static str,
    pub column: usize,
    pub conversion: Conversion,
}

/// Columns with unambiguous names; ambiguous ones are reported in `notes`. Channels that are `taken` are skipped.
pub(crate) fn recognise(heads: &[Head], taken: &dyn Fn(&str) -> bool, notes: &mut Vec<String>) -> Vec<Found> {
    let mut found: Vec<Found> = Vec::new();
    let east = |heads: &[Head], i: usize| names::words_of(&heads[i].name).iter().any(|w| w == "east");
    for entry in TABLE.iter().filter(|e| !e.spellings.is_empty() && !taken(e.channel)) {
        // what a filter put out is no measurement of a wheel
        let estimated = is_result(heads) && [channel::ODO_SPEED, channel::ODO_YAW_RATE].contains(&entry.channel);
        let mut best: Vec<(usize, Found)> = Vec::new();
        for (i, head) in heads.iter().enumerate().filter(|(_, h)| h.kind == Kind::Number) {
            let Some((rank, conversion)) = entry.rank(head).filter(|(rank, _)| *rank == 0 || !estimated) else {
                continue;
            };
            if best.first().is_some_and(|(least, _)| rank < *least) {
                best.clear();
            }
            if best.first().is_none_or(|(least, _)| rank == *least) {
                best.push((rank, Found { channel: entry.channel, column: i, conversion }));
            }
        }
        let beside_east = found.iter().any(|f| f.channel == channel::X && east(heads, f.column));
        match &best[..] {
            [] => {}
            [(_, one)] if entry.channel == channel::HEADING && beside_east && is_compass(&heads[one.column].name) => {
                let name = &heads[one.column].name;
                notes.push(format!(
                    "{name:?} is not used: beside east and north it may be a compass heading; if it counts from east, \
                     counter-clockwise: --map {}={name}",
                    entry.channel
                ));
            }
            [(rank, one)] => {
                if *rank > entry.spellings.len() {
                    notes.push(format!(
                        "{:?} states no unit: taken as {}; otherwise --map {}={0}:UNIT",
                        heads[one.column].name,
                        entry.quantity.si(),
                        entry.channel
                    ));
                }
                found.push(*one);
            }
            several => {
                let names: Vec<_> = several.iter().map(|(_, f)| heads[f.column].name.as_str()).collect();
                notes.push(format!(
                    "none of {} is used: name one with --map {}={}",
                    names.join(", "),
                    entry.channel,
                    names[0]
                ));
            }
        }
    }
    found
}

impl Entry {
    /// How sure it is that a column is this channel, 0 for the channel's own name, and its conversion to SI.
    fn rank(&self, head: &Head) -> Option<(usize, Conversion)> {
        let stem = stem(&head.name, self.quantity);
        let by_convention = stem.words.contains("twist_twist").then_some(self.quantity.si());
        let Some(unit) = stem.unit.as_deref().or(head.unit.as_deref()).or(by_convention) else {
            let at = self.bare.iter().position(|s| *s == stem.words)?;
            return Some((self.spellings.len() + 1 + at, Conversion { factor: 1.0, offset: 0.0 }));
        };
        let conversion = self.quantity.parse(unit.trim_matches(['(', ')', '[', ']']))?;
        if head.name == self.channel {
            return Some((0, conversion));
        }
        let at = self.spellings.iter().position(|s| *s == stem.words)?;
        Some((at + 1, conversion))
    }
}

/// Whether a file holds the output of a filter or a simulator: no recorder writes the gyro's error, or a standard
/// deviation beside a yaw rate.
pub(crate) fn is_result(heads: &[Head]) -> bool {
    heads.iter().any(|h| ["gyro_error_rad_s", "yaw_rate_std_rad_s"].contains(&h.name.as_str()))
}

fn is_compass(name: &str) -> bool {
    names::words_of(name).iter().any(|w| w == "heading")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heads(names: &[&str]) -> Vec<Head> {
        let head = |n: &&str| Head::number(*n, "number");
        names.iter().map(head).collect()
    }

    fn pairs(columns: &[&str]) -> (Vec<(&'static str, usize)>, Vec<String>) {
        let mut notes = Vec::new();
        let found = recognise(&heads(columns), &|_| false, &mut notes);
        (found.iter().map(|f| (f.channel, f.column)).collect(), notes)
    }

    #[test]
    fn every_channel_recognises_its_own_name() {
        for entry in TABLE.iter().filter(|e| !e.spellings.is_empty()) {
            assert_eq!(pairs(&[entry.channel]).0, [(entry.channel, 0)]);
        }
    }

    #[test]
    fn real_files_are_recognised() {
        let (found, notes) = pairs(&["odo_yaw_rate_rad_s", "odo_v_m_s", "truth_yaw_rad", "truth_x_m", "truth_y_m"]);
        assert_eq!(
            found,
            [("odo_speed_m_s", 1), ("odo_yaw_rate_rad_s", 0), ("x_m", 3), ("y_m", 4), ("heading_rad", 2)]
        );
        assert!(notes.is_empty());
        assert_eq!(pairs(&["east_m", "north_m", "alt_m", "pos_var_m2"]).0, [("x_m", 0), ("y_m", 1)]);
        // the odometry's own pose is no reference
        assert_eq!(pairs(&["odo_x_m", "odo_y_m", "odo_yaw_rad"]).0, []);
        assert_eq!(pairs(&["/odom/twist/twist/linear/x"]).0, [("odo_speed_m_s", 0)]);
    }

    #[test]
    fn sides_without_a_unit_are_in_si_and_that_is_told() {
        let (found, notes) = pairs(&["time", "curL", "curR", "velL", "velR"]);
        let channels =
            [("wheel_left_m_s", 3), ("wheel_right_m_s", 4), ("motor_current_left_a", 1), ("motor_current_right_a", 2)];
        assert_eq!(found, channels);
        assert!(notes.len() == 4 && notes[0].contains("\"velL\" states no unit: taken as m/s"), "{notes:?}");
        assert!(notes[0].contains("--map wheel_left_m_s=velL:UNIT"), "{notes:?}");
        // a unit in the name is no assumption
        let (found, notes) = pairs(&["vel_left_mm_s", "left_current_ma"]);
        assert!(found.len() == 2 && notes.is_empty(), "{found:?} {notes:?}");
    }

    #[test]
    fn commands_are_no_measurements() {
        let (found, _) = pairs(&["cmd_vel.linear.x", "cmd_vel.angular.z", "wheel_left_cmd_rad_s", "cmd_right_rad_s"]);
        let channels = [
            ("command_left_rad_s", 2),
            ("command_right_rad_s", 3),
            ("command_speed_m_s", 0),
            ("command_yaw_rate_rad_s", 1),
        ];
        assert_eq!(found, channels);
        for name in ["cmd_vel/angular/z", "cmd_vel_rad_s", "target_yaw_rate_deg_s", "wheel_left_setpoint_rpm"] {
            let (found, _) = pairs(&[name]);
            assert!(found.iter().all(|f| f.0.starts_with("command_")), "{name}: {found:?}");
        }
    }

    #[test]
    fn doubt_is_told_and_not_decided() {
        // no unit
        assert_eq!(pairs(&["speed", "x"]).0, []);
        let (found, notes) = pairs(&["speed_m_s", "speed_kph"]);
        assert!(found.is_empty() && notes[0].contains("--map odo_speed_m_s=speed_m_s"), "{notes:?}");
        let (found, notes) = pairs(&["east_m", "north_m", "heading_deg"]);
        assert!(found.len() == 2 && notes[0].contains("compass"), "{notes:?}");
        // the surer name wins
        assert_eq!(pairs(&["speed_m_s", "odo_v_m_s"]).0, [("odo_speed_m_s", 1)]);
    }

    #[test]
    fn a_filters_output_holds_no_wheels() {
        assert_eq!(pairs(&["x_m", "speed_m_s", "gyro_error_rad_s"]).0, [("x_m", 0)]);
        assert_eq!(pairs(&["speed_m_s", "yaw_rate_std_rad_s"]).0, []);
        assert_eq!(pairs(&["speed_m_s", "yaw_rate_rad_s"]).0, [("odo_speed_m_s", 0)]);
    }

    #[test]
    fn units_are_converted() {
        let found = recognise(&heads(&["vehicle_speed_kph"]), &|_| false, &mut Vec::new());
        assert!((found[0].conversion.factor * 3.6 - 1.0).abs() < 1e-15);
    }
}
