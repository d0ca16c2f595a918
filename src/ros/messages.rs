//! Messages on the wire: those of sensors, which a recording has too, and diagnostics.

pub(super) use crate::report::mcap::messages::{
    Header, Imu, JOINTS, JointState, Odometry, Stamp, Temperature, TwistWithCovarianceStamped,
};
use serde::Serialize;
use std::time::{SystemTime, UNIX_EPOCH};

/// The system's clock now.
pub(super) fn stamp_now() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Stamp { sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX), nanosec: since.subsec_nanos() }
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
