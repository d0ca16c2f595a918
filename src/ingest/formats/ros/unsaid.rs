//! Definitions of messages that a file holds without saying what they are made of, as bags of ROS 2 before Iron do.
//!
//! Newest version first; which one a message is of, its length tells. Fields of `px4_msgs` after docs.px4.io (uORB messages of
//! v1.12 to v1.18) and github.com/PX4/px4_msgs.

/// Type, without `/msg/`, and one of its versions.
const VERSIONS: [(&str, &str); 6] = [
    (
        "px4_msgs/SensorGyro",
        "uint64 timestamp\nuint64 timestamp_sample\nuint32 device_id\nfloat32 x\nfloat32 y\nfloat32 z\nfloat32 temperature\n\
         uint32 error_count\nuint8[3] clip_counter\nuint8 samples",
    ),
    (
        "px4_msgs/SensorCombined",
        "uint64 timestamp\nfloat32[3] gyro_rad\nuint32 gyro_integral_dt\nint32 accelerometer_timestamp_relative\n\
         float32[3] accelerometer_m_s2\nuint32 accelerometer_integral_dt\nuint8 accelerometer_clipping\nuint8 gyro_clipping\n\
         uint8 accel_calibration_count\nuint8 gyro_calibration_count",
    ),
    // before v1.13
    (
        "px4_msgs/SensorCombined",
        "uint64 timestamp\nfloat32[3] gyro_rad\nuint32 gyro_integral_dt\nint32 accelerometer_timestamp_relative\n\
         float32[3] accelerometer_m_s2\nuint32 accelerometer_integral_dt\nuint8 accelerometer_clipping",
    ),
    // from v1.16 on
    (
        "px4_msgs/VehicleImu",
        "uint64 timestamp\nuint64 timestamp_sample\nuint32 accel_device_id\nuint32 gyro_device_id\nfloat32[3] delta_angle\n\
         float32[3] delta_velocity\nuint32 delta_angle_dt\nuint32 delta_velocity_dt\nuint8 delta_angle_clipping\n\
         uint8 delta_velocity_clipping\nuint8 accel_calibration_count\nuint8 gyro_calibration_count",
    ),
    // v1.13 to v1.15
    (
        "px4_msgs/VehicleImu",
        "uint64 timestamp\nuint64 timestamp_sample\nuint32 accel_device_id\nuint32 gyro_device_id\nfloat32[3] delta_angle\n\
         float32[3] delta_velocity\nuint16 delta_angle_dt\nuint16 delta_velocity_dt\nuint8 delta_angle_clipping\n\
         uint8 delta_velocity_clipping\nuint8 accel_calibration_count\nuint8 gyro_calibration_count",
    ),
    // v1.12
    (
        "px4_msgs/VehicleImu",
        "uint64 timestamp\nuint64 timestamp_sample\nuint32 accel_device_id\nuint32 gyro_device_id\nfloat32[3] delta_angle\n\
         float32[3] delta_velocity\nuint16 delta_angle_dt\nuint16 delta_velocity_dt\nuint8 delta_velocity_clipping\n\
         uint8 calibration_count",
    ),
];

/// The versions of the type called `name`, newest first.
pub(super) fn versions(name: &str) -> Vec<&'static str> {
    VERSIONS.iter().filter(|v| v.0 == name).map(|v| v.1).collect()
}
