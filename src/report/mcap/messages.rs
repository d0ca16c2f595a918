//! ROS 2 messages as they are on the wire: fields in the order of their definitions.

use super::fixed::{List, Text};
use super::message::Message;
use byteorder::LittleEndian;
use serde::{Deserialize, Serialize};
use std::io;

/// Longest name of a frame or a joint, bytes.
const NAME: usize = 128;

/// Most joints of a message.
pub(crate) const JOINTS: usize = 64;

/// Variance of a quantity that is not known, (rad/s)², (m/s)², m² or rad²: large against any robot's motion.
pub(crate) const NOT_KNOWN: f64 = 1e6;

/// CDR, little-endian, without options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

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
}

/// `std_msgs/Header`.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Header {
    pub stamp: Stamp,
    pub frame_id: Text<NAME>,
}

impl Header {
    /// In a frame, whose name is cut where it is too long.
    pub(crate) fn new(stamp: Stamp, frame: &str) -> Self {
        Self { stamp, frame_id: Text::new(frame).unwrap_or_default() }
    }
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
    pub covariance: Covariance,
}

impl TwistWithCovarianceStamped {
    /// Errors of a gyro: axis (0: x), error, rad/s, and its variance, (rad/s)²; all else is not known.
    pub(crate) fn of_gyro(header: Header, errors: impl IntoIterator<Item = (usize, f64, f64)>) -> Self {
        let (mut angular, mut known) = ([0.0; 3], [NOT_KNOWN; 6]);
        for (axis, error_rad_s, variance) in errors {
            (angular[axis], known[3 + axis]) = (error_rad_s, variance);
        }
        Self { header, linear: [0.0; 3], angular, covariance: diagonal(known) }
    }
}

/// A covariance whose elements off the diagonal are zero.
pub(crate) fn diagonal(variances: [f64; 6]) -> Covariance {
    let (mut first, mut second) = ([0.0; 18], [0.0; 18]);
    for (i, variance) in variances.into_iter().enumerate() {
        let at = 7 * i;
        if at < 18 { first[at] = variance } else { second[at - 18] = variance }
    }
    (first, second)
}

/// `geometry_msgs/Pose`.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Pose {
    pub position: [f64; 3],
    /// x, y, z, w.
    pub orientation: [f64; 4],
}

impl Pose {
    /// In the plane, m and rad.
    pub(crate) fn planar(x_m: f64, y_m: f64, heading_rad: f64) -> Self {
        let (sin, cos) = (0.5 * heading_rad).sin_cos();
        Self { position: [x_m, y_m, 0.0], orientation: [0.0, 0.0, sin, cos] }
    }
}

/// `geometry_msgs/PoseStamped`.
#[derive(Clone, Copy, Default, Serialize)]
pub(crate) struct PoseStamped {
    pub header: Header,
    pub pose: Pose,
}

/// A covariance of six, by rows; serde has arrays up to 32.
pub(crate) type Covariance = ([f64; 18], [f64; 18]);

/// `nav_msgs/Odometry`.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Odometry {
    pub header: Header,
    pub child_frame_id: Text<NAME>,
    pub pose: Pose,
    pub pose_covariance: Covariance,
    pub linear: [f64; 3],
    pub angular: [f64; 3],
    pub twist_covariance: Covariance,
}

/// `geometry_msgs/TransformStamped`; a pose of the child's frame has the fields of the transform.
#[derive(Clone, Copy, Default, Serialize)]
pub(crate) struct TransformStamped {
    pub header: Header,
    pub child_frame_id: Text<NAME>,
    pub transform: Pose,
}

/// `tf2_msgs/TFMessage`.
#[derive(Clone, Default, Serialize)]
pub(crate) struct TfMessage {
    pub transforms: Vec<TransformStamped>,
}

const LINE: &str = "================================================================================\n";
const HEADER: &str = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
const TIME: &str = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const VECTOR: &str = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const POINT: &str = "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
const QUATERNION: &str = "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
const POSE: &str = "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n";
const TWIST: &str = "MSG: geometry_msgs/Twist\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n";
const TRANSFORM: &str =
    "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n";
const TRANSFORM_STAMPED: &str = "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n";

/// Types with their own fields and the definitions of the types in them.
macro_rules! definitions {
    ($($message:ty: $kind:literal, $fields:literal, [$($part:ident),*];)*) => {$(
        impl Message for $message {
            const ENCODINGS: [&'static str; 2] = ["cdr", "ros2msg"];

            fn kind() -> String {
                $kind.into()
            }

            fn schema() -> Vec<u8> {
                [$fields, $(LINE, $part),*].concat().into_bytes()
            }

            fn encode(&self, to: &mut Vec<u8>) -> io::Result<()> {
                to.extend(ENCAPSULATION);
                cdr_encoding::to_writer::<_, LittleEndian, _>(to, self).map_err(io::Error::other)
            }
        }
    )*};
}

definitions! {
    Imu: "sensor_msgs/msg/Imu",
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
         geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
         geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
        [QUATERNION, VECTOR, HEADER, TIME];
    JointState: "sensor_msgs/msg/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
        [HEADER, TIME];
    Temperature: "sensor_msgs/msg/Temperature",
        "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n",
        [HEADER, TIME];
    PoseStamped: "geometry_msgs/msg/PoseStamped",
        "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
        [POSE, POINT, QUATERNION, HEADER, TIME];
    Odometry: "nav_msgs/msg/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
         geometry_msgs/TwistWithCovariance twist\n",
        [POSE_COVARIANCE, POSE, POINT, QUATERNION, TWIST_COVARIANCE, TWIST, VECTOR, HEADER, TIME];
    TwistWithCovarianceStamped: "geometry_msgs/msg/TwistWithCovarianceStamped",
        "std_msgs/Header header\ngeometry_msgs/TwistWithCovariance twist\n",
        [TWIST_COVARIANCE, TWIST, VECTOR, HEADER, TIME];
    TfMessage: "tf2_msgs/msg/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
        [TRANSFORM_STAMPED, TRANSFORM, VECTOR, QUATERNION, HEADER, TIME];
}

const POSE_COVARIANCE: &str =
    "MSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n";
const TWIST_COVARIANCE: &str =
    "MSG: geometry_msgs/TwistWithCovariance\ngeometry_msgs/Twist twist\nfloat64[36] covariance\n";
