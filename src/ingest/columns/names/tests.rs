use super::*;

#[test]
fn gyro_columns_of_common_recorders() {
    for (name, unit) in [
        ("gyro_z_rad_s", Some("rad_s")),
        ("gyro_z", None),
        ("gz", None),
        ("GZ", None),
        ("gz_rad_s", Some("rad_s")),
        ("gz_dps", Some("dps")),
        ("gyroZ", None),
        ("GyroZ_dps", Some("dps")),
        ("wz", None),
        ("omega_z", None),
        ("omegaZ", None),
        ("angular_velocity.z", None),
        ("angular_velocity_z", None),
        (".angular_velocity.z", None),
        ("field.angular_velocity.z", None),
        ("yaw_rate_rad_s", Some("rad_s")),
        ("yawRate", None),
        ("yawrate_dps", Some("dps")),
        ("w_RS_S_z [rad s^-1]", Some("rad s^-1")),
        ("GyrZ", None),
        ("Gyr_Z", None),
        ("Gyroscope z (rad/s)", Some("rad/s")),
        ("Gyroscope Z (°/s)", Some("°/s")),
        ("rate_z_deg_s", Some("deg_s")),
        ("gyro[2]", None),
        ("gyro_rad[2]", Some("rad/s")),
        ("RotationRateZ", None),
        ("gyro_z_mdps", Some("mdps")),
        ("rotation_rate_z_deg_per_s", Some("deg_per_s")),
        ("imu0_gyro_z", None),
        ("ang_vel_z", None),
        ("vehicle_angular_velocity.xyz[2]", None),
    ] {
        let named = parse(name);
        assert_eq!(named.role, Role::Gyro(Some(Axis::Z)), "{name}");
        assert_eq!(named.unit.as_deref(), unit, "{name}");
        if let Some(unit) = unit {
            assert!(RateUnit::parse(unit).is_some(), "{unit}");
        }
    }
    assert_eq!(parse("gx_rad_s").role, Role::Gyro(Some(Axis::X)));
    assert_eq!(parse("field.angular_velocity.y").role, Role::Gyro(Some(Axis::Y)));
    assert_eq!(parse("gyro[0]").role, Role::Gyro(Some(Axis::X)));
    assert_eq!(parse("rate_rad_s").role, Role::Gyro(None));
    assert_eq!(parse("angular_rate_dps").role, Role::Gyro(None));
}

#[test]
fn what_is_no_gyro() {
    for name in [
        "ax_m_s2",
        "linear_acceleration.z",
        "odo_yaw_rate_rad_s",
        "wheel_left_rad_s",
        "heading_rad",
        "mag_z",
        "angular_velocity_covariance[8]",
        "gyro_z_bias",
        "field.orientation.w",
        "qz",
        "sample_rate",
        "z",
        "x_m",
        "torque_left_n_m",
        "gps_heading_rate",
        "step",
        "weight",
        "rate_hz",
        "gyro_temp",
    ] {
        assert!(!matches!(parse(name).role, Role::Gyro(_)), "{name}: {:?}", parse(name));
    }
}

#[test]
fn times_and_their_clocks() {
    use TimeKind::{Host, Sensor, SincePowerOn};
    for (name, kind, unit) in [
        ("t_s", Sensor, Some("s")),
        ("t", Sensor, None),
        ("time", Sensor, None),
        ("Time", Sensor, None),
        ("timestamp", Sensor, None),
        ("timestamp_us", Sensor, Some("us")),
        ("time_ms", Sensor, Some("ms")),
        ("#timestamp [ns]", Sensor, Some("ns")),
        ("Time (s)", Sensor, Some("s")),
        ("stamp", Sensor, None),
        ("field.header.stamp", Sensor, None),
        ("time_since_power_on_s", SincePowerOn, Some("s")),
        ("time_since_boot_us", SincePowerOn, Some("us")),
        ("t_host_s", Host, Some("s")),
        ("t_recv_s", Host, Some("s")),
        ("%time", Host, None),
        ("millis", Sensor, Some("millis")),
        ("TimeUS", Sensor, Some("us")),
    ] {
        assert_eq!(parse(name), Named { role: Role::Time(kind), unit: unit.map(str::to_string) }, "{name}");
    }
    assert_eq!(parse("header.stamp.secs").role, Role::TimePart { kind: Sensor, nanoseconds: false });
    assert_eq!(parse("header.stamp.nanosec").role, Role::TimePart { kind: Sensor, nanoseconds: true });
    assert_eq!(parse("header.stamp.nsecs").role, Role::TimePart { kind: Sensor, nanoseconds: true });
    for name in ["dt_s", "time_constant_s", "exposure_time", "field.header.seq", "lateral_slip_s"] {
        assert!(!matches!(parse(name).role, Role::Time(_) | Role::TimePart { .. }), "{name}");
    }
}

#[test]
fn temperature_and_supply() {
    for (name, role, unit) in [
        ("temperature_c", Role::Temperature, Some("c")),
        ("temp", Role::Temperature, None),
        ("temp_degC", Role::Temperature, Some("c")),
        ("temperature_k", Role::Temperature, Some("k")),
        ("Temperature (°C)", Role::Temperature, Some("°C")),
        ("supply_v", Role::Supply, Some("v")),
        ("vcc", Role::Supply, None),
        ("battery_voltage_mv", Role::Supply, Some("mv")),
    ] {
        assert_eq!(parse(name), Named { role, unit: unit.map(str::to_string) }, "{name}");
    }
    assert_eq!(environment_factor(Role::Temperature, "K"), Some((1.0, -273.15)));
}
