//! A robot as its description has it, each quantity with its source.

use crate::config::Steering;
use std::fmt;

/// How macros are expanded.
pub(super) const EXPAND: &str = "xacro ROBOT.urdf.xacro -o robot.urdf";

/// Format of a description.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    /// Unified Robot Description Format, of ROS.
    Urdf,
    /// Simulation Description Format, of Gazebo.
    Sdf,
    /// Of MuJoCo.
    Mjcf,
}

impl Format {
    /// By the name of a document's root element.
    pub(super) fn of(root: &str) -> Option<Self> {
        match root {
            "robot" => Some(Self::Urdf),
            "sdf" | "gazebo" => Some(Self::Sdf),
            "mujoco" => Some(Self::Mjcf),
            _ => None,
        }
    }

    pub(super) fn option(self) -> &'static str {
        match self {
            Self::Urdf => "--urdf",
            Self::Sdf => "--sdf",
            Self::Mjcf => "--mjcf",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Urdf => "URDF",
            Self::Sdf => "SDF",
            Self::Mjcf => "MJCF",
        })
    }
}

/// Choices of the user where a description leaves something open.
#[derive(Debug, Clone, Default)]
pub(crate) struct Choice {
    /// The robot, in a file that holds several.
    pub model: Option<String>,
    /// Joints of the driven wheels on the left; found where both are empty.
    pub left: Vec<String>,
    /// The same on the right.
    pub right: Vec<String>,
}

/// A quantity, SI, and its source; without a value, how to find it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fact {
    /// `None` where the description does not tell.
    pub value: Option<f64>,
    /// Where the value comes from, or what to do without one.
    pub source: String,
}

impl Fact {
    pub(super) fn told(value: f64, source: String) -> Self {
        Self { value: Some(value), source }
    }

    pub(super) fn not_told(hint: &str) -> Self {
        Self { value: None, source: hint.into() }
    }
}

/// A robot with two driven wheels, or one that skids, as its description has it.
#[derive(Debug, Clone)]
pub(crate) struct Robot {
    /// The description's file.
    pub file: String,
    /// Its format.
    pub format: Format,
    /// The robot's name.
    pub name: String,
    /// Joints of the driven wheels on the left.
    pub left: Vec<String>,
    /// The same on the right.
    pub right: Vec<String>,
    /// Two wheels turn it, or it skids.
    pub steering: Steering,
    /// Of all links, kg.
    pub mass_kg: Fact,
    /// About the vertical axis through the centre of mass, kg·m².
    pub yaw_inertia_kg_m2: Fact,
    /// Half the distance between the sides, m.
    pub half_track_m: Fact,
    /// m
    pub wheel_radius_m: Fact,
    /// Of the wheels of one side about their axles, kg·m².
    pub wheel_inertia_kg_m2: Fact,
    /// Torque per wheel speed of one side, N·m·s.
    pub viscous_friction_n_m_s: Fact,
    /// Rate of the IMU, Hz; `None` without one.
    pub gyro_rate_hz: Option<Fact>,
    /// White noise of a sample of the IMU's gyro about z, rad/s.
    pub gyro_noise_std_rad_s: Option<Fact>,
    /// Decisions of the reader, and contradictions in the description, a sentence each.
    pub notes: Vec<String>,
}
