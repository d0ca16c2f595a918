//! How the node works, as its user says.

use crate::live::Settings;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Topic of the bias.
pub(super) const BIAS: &str = "~/bias";

/// Axis of the IMU that a configuration's gyro is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// Forward.
    X,
    /// To the left.
    Y,
    /// Upwards.
    Z,
}

impl Axis {
    /// `x`, `y` or `z`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

/// A gyro of the IMU.
#[derive(Debug, Clone)]
pub struct Gyro {
    /// Its axis.
    pub axis: Axis,
    /// File of its configuration, which is read again when it changes.
    pub config: PathBuf,
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
    /// The gyros that are corrected, each of another axis.
    pub gyros: Vec<Gyro>,
    /// Topics.
    pub topics: Topics,
    /// Names of the joints that are wheels; empty: all are.
    pub wheels: Vec<String>,
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
    /// File that keeps how warm the gyro is over a restart; of several gyros see [`Options::state_file`].
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
    /// File of the state of the gyro about `axis`: [`Options::state`], with the axis before its ending where there are several.
    #[must_use]
    pub fn state_file(&self, axis: Axis) -> Option<PathBuf> {
        let file = self.state.as_ref()?;
        if self.gyros.len() == 1 {
            return Some(file.clone());
        }
        let named = file.with_extension(axis.name());
        Some(match file.extension() {
            Some(ending) => named.with_added_extension(ending),
            None => named,
        })
    }

    /// Names of the axes.
    pub(super) fn axes(&self) -> Vec<&'static str> {
        self.gyros.iter().map(|gyro| gyro.axis.name()).collect()
    }

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
