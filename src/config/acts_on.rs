//! Where effects of the user's own act, and the signals that there are.

use super::law::Signal;
use serde::{Deserialize, Serialize};

/// Where an effect of the user's own acts: what its expression is added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ActsOn {
    /// The gyro's bias at rest, rad/s.
    GyroBiasRadS,
    /// The force on the robot along its heading, N, forwards.
    ForceN,
    /// The torque on the robot about the vertical axis, N·m, to the left.
    TorqueNM,
    /// The torque on the left wheel, N·m, forwards.
    WheelLeftTorqueNM,
    /// The torque on the right wheel, N·m, forwards.
    WheelRightTorqueNM,
    /// The reading of the left wheel's speed, rad/s.
    WheelLeftRadS,
    /// The reading of the right wheel's speed, rad/s.
    WheelRightRadS,
    /// The gyro's reading in a drive, rad/s.
    GyroRateRadS,
}

impl ActsOn {
    /// Signals that its expressions may use, and the values that each may have.
    #[must_use]
    pub fn signals(self) -> &'static [Signal] {
        match self {
            Self::GyroBiasRadS => &AT_REST,
            Self::ForceN | Self::TorqueNM | Self::WheelLeftTorqueNM | Self::WheelRightTorqueNM => &PUSHED,
            Self::WheelLeftRadS | Self::WheelRightRadS => &OF_WHEELS,
            Self::GyroRateRadS => &OF_GYRO,
        }
    }

    /// Whether it acts on a robot that drives, and not on a gyro alone.
    #[must_use]
    pub(crate) fn is_of_drives(self) -> bool {
        self != Self::GyroBiasRadS
    }
}

/// Since power-on; a log lasts a day at most.
const TIME: Signal = Signal { name: "t_s", range: [0.0, 1e5] };
/// Faster than indoor robots are.
const SPEED: Signal = Signal { name: "speed_m_s", range: [-10.0, 10.0] };
const YAW_RATE: Signal = Signal { name: "yaw_rate_rad_s", range: [-20.0, 20.0] };
const ACCELERATION: Signal = Signal { name: "acceleration_m_s2", range: [-50.0, 50.0] };
const YAW_ACCELERATION: Signal = Signal { name: "yaw_acceleration_rad_s2", range: [-200.0, 200.0] };
const LEFT: Signal = Signal { name: "wheel_left_rad_s", range: [-300.0, 300.0] };
const RIGHT: Signal = Signal { name: "wheel_right_rad_s", range: [-300.0, 300.0] };

/// A gyro at rest. Electronics work from -55 to 150 °C.
const AT_REST: [Signal; 3] =
    [TIME, Signal { name: "temperature_c", range: [-55.0, 150.0] }, Signal { name: "supply_v", range: [0.0, 60.0] }];

/// A robot that is pushed: where it is and how it moves. Accelerations follow from the forces, and are none of their causes.
const PUSHED: [Signal; 8] = [
    TIME,
    SPEED,
    YAW_RATE,
    LEFT,
    RIGHT,
    Signal { name: "x_m", range: [-1e3, 1e3] },
    Signal { name: "y_m", range: [-1e3, 1e3] },
    Signal { name: "heading_rad", range: [-100.0, 100.0] },
];

/// Wheels that are read: how they turn, and the force of each rim on the ground.
const OF_WHEELS: [Signal; 9] = [
    TIME,
    SPEED,
    YAW_RATE,
    LEFT,
    RIGHT,
    ACCELERATION,
    YAW_ACCELERATION,
    Signal { name: "wheel_left_force_n", range: [-1e4, 1e4] },
    Signal { name: "wheel_right_force_n", range: [-1e4, 1e4] },
];

/// A gyro that is read in a drive.
const OF_GYRO: [Signal; 5] = [TIME, SPEED, YAW_RATE, ACCELERATION, YAW_ACCELERATION];
