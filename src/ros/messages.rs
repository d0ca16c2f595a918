//! Messages as they are on the wire: fields in the order of their ROS definitions.

use super::fixed::{List, Text};
use serde::{Deserialize, Serialize};

/// Longest name of a frame or a joint, bytes.
const NAME: usize = 128;

/// Most joints of a message.
pub(crate) const JOINTS: usize = 64;

/// `builtin_interfaces/Time`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Stamp {
    pub sec: i32,
    pub nanosec: u32,
}

impl Stamp {
    /// Nanoseconds since the epoch of the sender's clock.
    pub(crate) fn ns(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }

    /// The system's clock now.
    pub(crate) fn now() -> Self {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        Self { sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX), nanosec: since.subsec_nanos() }
    }
}

/// `std_msgs/Header`.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Header {
    pub stamp: Stamp,
    pub frame_id: Text<NAME>,
}

/// `sensor_msgs/Imu`.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Imu {
    pub header: Header,
    pub orientation: [f64; 4],
    pub orientation_covariance: [f64; 9],
    pub angular_velocity: [f64; 3],
    pub angular_velocity_covariance: [f64; 9],
    pub linear_acceleration: [f64; 3],
    pub linear_acceleration_covariance: [f64; 9],
}

/// `sensor_msgs/JointState`.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct JointState {
    pub header: Header,
    pub name: List<Text<NAME>, JOINTS>,
    pub position: List<f64, JOINTS>,
    pub velocity: List<f64, JOINTS>,
    pub effort: List<f64, JOINTS>,
}

/// `sensor_msgs/Temperature`.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Temperature {
    pub header: Header,
    pub temperature: f64,
    pub variance: f64,
}

/// `geometry_msgs/TwistWithCovarianceStamped`.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct TwistWithCovarianceStamped {
    pub header: Header,
    pub linear: [f64; 3],
    pub angular: [f64; 3],
    /// By rows, of linear and angular velocity; serde has arrays up to 32.
    pub covariance: ([f64; 18], [f64; 18]),
}

/// `diagnostic_msgs/DiagnosticArray`.
#[derive(Clone, Serialize)]
pub(crate) struct DiagnosticArray {
    pub header: Header,
    pub status: Vec<DiagnosticStatus>,
}

/// `diagnostic_msgs/DiagnosticStatus`.
#[derive(Clone, Serialize)]
pub(crate) struct DiagnosticStatus {
    /// 0 OK, 1 WARN, 2 ERROR, 3 STALE.
    pub level: u8,
    pub name: String,
    pub message: String,
    pub hardware_id: String,
    pub values: Vec<KeyValue>,
}

/// `diagnostic_msgs/KeyValue`.
#[derive(Clone, Serialize)]
pub(crate) struct KeyValue {
    pub key: String,
    pub value: String,
}
