//! A drive over which the filter ran: what the sensors read, where the robot was, and each reading's innovation.

use super::fixed::{List, Text};
use super::messages::{
    Header, Imu, JointState, NOT_KNOWN, Odometry, Pose, PoseStamped, Temperature, TfMessage, TransformStamped,
    TwistWithCovarianceStamped, diagonal,
};
use super::protobuf::{Innovation, Quantity, Verdict};
use super::recording::{Recording, Topic};
use crate::config::Config;
use crate::error::Result;
use crate::files::OutputFile;
use crate::navigate::{Alignment, Run, Sensor, names as estimates};
use crate::signal::{Log, names};

/// Frames of the reference, of the filter, of the robot and of its gyro.
pub(super) const MAP: &str = "map";
const ODOM: &str = "odom";
const BASE: &str = "base_link";
pub(super) const IMU: &str = "imu_link";

/// A drive for a recording.
pub(crate) struct DriveRecording<'a> {
    /// The robot.
    pub config: &'a Config,
    /// The drive.
    pub log: &'a Log,
    /// The run whose pose is written; its innovations are recorded.
    pub run: &'a Run,
    /// Its pose.
    pub pose: &'a Log,
    /// The pose of the filter without error model, where that is another.
    pub without: Option<&'a Log>,
    /// The page for a terminal.
    pub text: &'a str,
}

/// A sensor as a topic's last word.
fn word(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Gyro => "gyro",
        Sensor::WheelLeft => "wheel_left",
        Sensor::WheelRight => "wheel_right",
        Sensor::Speed => "speed",
        Sensor::PoseX => "pose_x",
        Sensor::PoseY => "pose_y",
        Sensor::PoseHeading => "pose_heading",
    }
}

impl DriveRecording<'_> {
    /// Writes the recording: messages of a row together, rows in their order.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Io`] if the disk refuses.
    pub(crate) fn write(&self, file: OutputFile) -> Result<()> {
        let time = &self.log.time;
        let first_s = if time.is_empty() { 0.0 } else { time.at(0) };
        let mut to = Recording::new(file, first_s)?;
        let verdict = to.topic("/gyroid/verdict")?;
        to.put(&verdict, first_s, &self.verdict())?;
        let mut rows = Rows::new(self, &mut to)?;
        let mut topics = Vec::new();
        for sensor in Sensor::ALL {
            let read = self.run.innovations.iter().any(|r| r.1 == sensor);
            let name = format!("/gyroid/innovation/{}", word(sensor));
            topics.push(if read { Some(to.topic::<Innovation>(&name)?) } else { None });
        }
        let mut innovations = self.run.innovations.iter().peekable();
        for k in 0..time.len() {
            rows.write(&mut to, k)?;
            let next_s = if k + 1 < time.len() { time.at(k + 1) } else { f64::INFINITY };
            while let Some((at_s, sensor, found)) = innovations.next_if(|r| r.0 < next_s) {
                let Some(topic) = &topics[*sensor as usize] else { continue };
                let message = Innovation {
                    residual: found.residual,
                    std: found.variance.sqrt(),
                    standardised: found.standardised(),
                    nis: found.nis(),
                    used: found.used,
                };
                to.put(topic, *at_s, &message)?;
            }
        }
        to.finish()
    }

    fn verdict(&self) -> Verdict {
        let summary = &self.run.summary;
        let (end, consistency) = (&summary.final_pose, &summary.consistency);
        let estimates = [
            ("x at the end", "m", end.x_m),
            ("y at the end", "m", end.y_m),
            ("heading at the end", "rad", end.heading_rad),
            ("gyro error at the end", "rad/s", end.gyro_error_rad_s),
        ];
        let estimates = estimates.map(|(name, unit, e)| Quantity {
            name: name.into(),
            unit: unit.into(),
            value: e.estimate,
            std: e.std,
            ci95: Vec::new(),
        });
        // what a consistent filter has 95 times in 100
        let nis = Quantity {
            name: "mean NIS".into(),
            value: consistency.nis_mean,
            ci95: consistency.nis_mean_bounds95.to_vec(),
            ..Quantity::default()
        };
        Verdict {
            command: "navigate".into(),
            verdict: if consistency.fit_for_use { "fit_for_use" } else { "not_fit_for_use" }.into(),
            text: self.text.into(),
            quantities: estimates.into_iter().chain([nis]).collect(),
        }
    }

    /// The filter's frame in that of the reference.
    fn odom_in_map(&self) -> Pose {
        let smoothed = self.run.smoothed.as_ref().map(|s| s.reference.as_ref());
        let errors = smoothed.unwrap_or(self.run.summary.reference.as_ref());
        let alignment: Option<&Alignment> = errors.and_then(|e| e.alignment.as_ref());
        alignment.map_or(Pose::planar(0.0, 0.0, 0.0), |a| Pose::planar(a.x_m, a.y_m, a.rotation_rad))
    }
}

/// Columns x, y and heading of a log.
struct Path<'a>([&'a [f64]; 3]);

impl<'a> Path<'a> {
    fn of(log: &'a Log) -> Option<Self> {
        let heading = log.get(names::HEADING).unwrap_or_default();
        Some(Self([log.get(names::X)?, log.get(names::Y)?, heading]))
    }

    /// The pose at a row; along x where no heading was read.
    fn at(&self, k: usize) -> Option<Pose> {
        let [x, y, heading] = self.0.map(|column| column.get(k).copied().unwrap_or(0.0));
        let known = x.is_finite() && y.is_finite();
        known.then(|| Pose::planar(x, y, if heading.is_finite() { heading } else { 0.0 }))
    }
}

/// The gyro less its error, and that with its standard deviation, rad/s.
struct Corrected<'a> {
    rate: Topic<Imu>,
    bias: Topic<TwistWithCovarianceStamped>,
    error: &'a [f64],
    std: &'a [f64],
}

/// Both wheels: speeds over the radius are rad/s; torques, N·m, where there are.
struct Joints<'a> {
    topic: Topic<JointState>,
    speeds: [&'a [f64]; 2],
    radius_m: f64,
    torques: Option<[&'a [f64]; 2]>,
}

/// Topics with a message at a row of the log where one was read, and the columns that they are made of.
struct Rows<'a> {
    log: &'a Log,
    pose: &'a Log,
    tf: Topic<TfMessage>,
    odom: Topic<Odometry>,
    odom_in_map: Pose,
    estimate: Path<'a>,
    raw: Option<(Topic<Imu>, &'a [f64])>,
    corrected: Option<Corrected<'a>>,
    /// Variance of a reading of the gyro, (rad/s)².
    gyro_variance: f64,
    joints: Option<Joints<'a>>,
    temperature: Option<(Topic<Temperature>, &'a [f64])>,
    reference: Option<(Topic<PoseStamped>, Path<'a>)>,
    without: Option<(Topic<PoseStamped>, Path<'a>)>,
}

impl<'a> Rows<'a> {
    fn new(drive: &DriveRecording<'a>, to: &mut Recording) -> Result<Self> {
        let (log, pose) = (drive.log, drive.pose);
        let gyro = log.get(names::GYRO_Z).filter(|rates| rates.iter().any(|w| w.is_finite()));
        let raw = gyro.map(|rates| Ok((to.topic("/imu/data_raw")?, rates))).transpose()?;
        let error = [pose.get(estimates::GYRO_ERROR), pose.get(estimates::GYRO_ERROR_STD)];
        let corrected = match (error, &raw) {
            ([Some(error), Some(std)], Some(_)) => {
                Some(Corrected { rate: to.topic("/imu/data")?, bias: to.topic("/bias")?, error, std })
            }
            _ => None,
        };
        let white = drive.config.gyro.as_ref().map_or(0.0, |g| g.angle_random_walk_rad_sqrt_s);
        let radius_m = drive.config.vehicle.as_ref().map_or(1.0, |v| v.wheel_radius_m);
        let pair = |[left, right]: [&str; 2]| Some([log.get(left)?, log.get(right)?]);
        let by_rim = || Some((pair([names::WHEEL_LEFT_SPEED, names::WHEEL_RIGHT_SPEED])?, radius_m));
        let wheels = pair([names::WHEEL_LEFT, names::WHEEL_RIGHT]).map(|wheels| (wheels, 1.0)).or_else(by_rim);
        let torques = pair([names::TORQUE_LEFT, names::TORQUE_RIGHT]);
        let joints = match wheels {
            Some((speeds, radius_m)) => Some(Joints { topic: to.topic("/joint_states")?, speeds, radius_m, torques }),
            None => None,
        };
        let temperature = log.get(names::TEMPERATURE).map(|t| Ok((to.topic("/temperature")?, t))).transpose()?;
        let mut path = |topic: &str, log: Option<&'a Log>| -> Result<_> {
            log.and_then(Path::of).map(|path| Ok((to.topic(topic)?, path))).transpose()
        };
        let (reference, without) = (path("/reference", Some(log))?, path("/pose/without_error_model", drive.without)?);
        Ok(Self {
            log,
            pose,
            tf: to.topic("/tf")?,
            odom: to.topic("/odom")?,
            odom_in_map: drive.odom_in_map(),
            estimate: Path::of(pose).unwrap_or(Path([&[]; 3])),
            raw,
            corrected,
            gyro_variance: white * white / log.time.median_step_s(),
            joints,
            temperature,
            reference,
            without,
        })
    }

    fn write(&mut self, to: &mut Recording, k: usize) -> Result<()> {
        let time_s = self.log.time.at(k);
        let stamp = to.stamp(time_s);
        let header = |frame| Header::new(stamp, frame);
        if let Some((topic, rates)) = self.raw.as_ref().filter(|(_, rates)| rates[k].is_finite()) {
            to.put(topic, time_s, &imu(header(IMU), rates[k], self.gyro_variance))?;
            if let Some(Corrected { rate, bias, error, std }) = &self.corrected {
                let variance = std[k] * std[k];
                to.put(rate, time_s, &imu(header(IMU), rates[k] - error[k], self.gyro_variance + variance))?;
                to.put(bias, time_s, &TwistWithCovarianceStamped::of_gyro(header(IMU), [(2, error[k], variance)]))?;
            }
        }
        if let Some(Joints { topic, speeds, radius_m, torques }) = &self.joints
            && speeds.iter().all(|side| side[k].is_finite())
        {
            let efforts = torques.map(|sides| sides.map(|side| side[k])).filter(|t| t.iter().all(|v| v.is_finite()));
            let message = JointState {
                header: header(BASE),
                name: List::new(&["left_wheel", "right_wheel"].map(|name| Text::new(name).unwrap_or_default())),
                velocity: List::new(&speeds.map(|side| side[k] / radius_m)),
                effort: efforts.map_or_else(List::default, |efforts| List::new(&efforts)),
                ..JointState::default()
            };
            to.put(topic, time_s, &message)?;
        }
        if let Some((topic, degrees)) = self.temperature.as_ref().filter(|(_, degrees)| degrees[k].is_finite()) {
            to.put(topic, time_s, &Temperature { header: header(IMU), temperature: degrees[k], variance: 0.0 })?;
        }
        if let Some((topic, path)) = &self.reference
            && let Some(pose) = path.at(k)
        {
            to.put(topic, time_s, &PoseStamped { header: header(MAP), pose })?;
        }
        if let Some((topic, path)) = &self.without
            && let Some(pose) = path.at(k)
        {
            to.put(topic, time_s, &PoseStamped { header: header(ODOM), pose })?;
        }
        let Some(pose) = self.estimate.at(k) else { return Ok(()) };
        let child = |frame: &str| Text::new(frame).unwrap_or_default();
        let transforms = vec![
            TransformStamped { header: header(MAP), child_frame_id: child(ODOM), transform: self.odom_in_map },
            TransformStamped { header: header(ODOM), child_frame_id: child(BASE), transform: pose },
        ];
        to.put(&self.tf, time_s, &TfMessage { transforms })?;
        let of = |name: &str| self.pose.get(name).map_or(f64::NAN, |column| column[k]);
        let variance = |name: &str| of(name).powi(2);
        let [x, y, heading] = [estimates::X_STD, estimates::Y_STD, estimates::HEADING_STD].map(variance);
        let [speed, yaw_rate] = [estimates::SPEED_STD, estimates::YAW_RATE_STD].map(variance);
        let other = NOT_KNOWN;
        let message = Odometry {
            header: header(ODOM),
            child_frame_id: child(BASE),
            pose,
            pose_covariance: diagonal([x, y, other, other, other, heading]),
            linear: [of(estimates::SPEED), 0.0, 0.0],
            angular: [0.0, 0.0, of(estimates::YAW_RATE)],
            twist_covariance: diagonal([speed, other, other, other, other, yaw_rate]),
        };
        to.put(&self.odom, time_s, &message)
    }
}

/// A yaw rate, rad/s, with its variance; nothing else is known.
pub(super) fn imu(header: Header, rate_rad_s: f64, variance: f64) -> Imu {
    let mut covariance = [0.0; 9];
    (covariance[0], covariance[4], covariance[8]) = (NOT_KNOWN, NOT_KNOWN, variance);
    // -1: there is no such estimate (sensor_msgs/Imu)
    let mut none = [0.0; 9];
    none[0] = -1.0;
    Imu {
        header,
        orientation: [0.0, 0.0, 0.0, 1.0],
        orientation_covariance: none,
        angular_velocity: [0.0, 0.0, rate_rad_s],
        angular_velocity_covariance: covariance,
        linear_acceleration: [0.0; 3],
        linear_acceleration_covariance: none,
    }
}
