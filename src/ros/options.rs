//! How the node works, as its user says.

use crate::live::Settings;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Topic of the bias.
pub(super) const BIAS: &str = "~/bias";

/// Axis of the IMU that the configuration's gyro is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// Forward.
    X,
    /// To the left.
    Y,
    /// Upwards.
    Z,
}

/// Topics, relative to the namespace, absolute with a leading `/`, private with a leading `~/`.
#[derive(Debug, Clone)]
pub struct Topics {
    /// `sensor_msgs/Imu` to correct.
    pub imu: String,
    /// `sensor_msgs/JointState` of the wheels.
    pub joints: Option<String>,
    /// `nav_msgs/Odometry` of the wheels, where there are no joint states.
    pub odometry: Option<String>,
    /// `sensor_msgs/Temperature` of the gyro, °C.
    pub temperature: Option<String>,
    /// `sensor_msgs/Imu`, corrected.
    pub out: String,
}

/// How the node works.
#[derive(Debug, Clone)]
pub struct Options {
    /// The configuration's file, which is read again when it changes.
    pub config: PathBuf,
    /// Topics.
    pub topics: Topics,
    /// Names of the joints that are wheels; empty: all are.
    pub wheels: Vec<String>,
    /// Axis of the gyro.
    pub axis: Axis,
    /// The node's name.
    pub name: String,
    /// Its namespace, with a leading `/`.
    pub namespace: String,
    /// DDS domain.
    pub domain: u16,
    /// Correct outside the configuration's validity too.
    pub extrapolate: bool,
    /// Learn the bias at rest.
    pub learn: bool,
    /// Time since power-on when the first sample comes, s.
    pub since_power_on_s: f64,
    /// File that keeps how warm the gyro is over a restart.
    pub state: Option<PathBuf>,
    /// The gyro was off between the runs, although the computer was not.
    pub power_cut: bool,
    /// Record what arrives and what is published here (MCAP).
    pub record: Option<PathBuf>,
    /// End after so many seconds.
    pub duration: Option<Duration>,
}

/// Flags that the outside sets.
#[derive(Debug, Clone, Default)]
pub struct Signals {
    /// End.
    pub stop: Arc<AtomicBool>,
    /// Read the configuration again.
    pub reload: Arc<AtomicBool>,
}

impl Options {
    /// The topic's absolute name.
    pub(super) fn absolute(&self, topic: &str) -> String {
        let namespace = self.namespace.trim_end_matches('/');
        match (topic.strip_prefix("~/"), topic.starts_with('/')) {
            (Some(private), _) => format!("{namespace}/{}/{private}", self.name),
            (None, true) => topic.to_string(),
            (None, false) => format!("{namespace}/{topic}"),
        }
    }

    /// The corrector's settings by the topics that there are.
    pub(super) fn settings(&self) -> Settings {
        Settings {
            wheels: self.topics.joints.is_some() || self.topics.odometry.is_some(),
            temperature: self.topics.temperature.is_some(),
            extrapolate: self.extrapolate,
            no_learning: !self.learn,
        }
    }
}

/// The boot of this computer; empty where the system does not tell.
pub(super) fn boot_id() -> String {
    std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default().trim().to_string()
}
