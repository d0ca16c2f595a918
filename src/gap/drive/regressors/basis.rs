//! Columns: derivatives of the equations by the coefficient β of everything that may be missing from the model, by row.

use crate::gap::drive::ekf::agility::Classes;
use crate::gap::drive::ekf::noise::{EVEN, Ratios};
use crate::gap::drive::ekf::slopes::Slopes;
use crate::gap::drive::record::Record;
use std::f64::consts::PI;

/// One equation of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Equation {
    /// dv/dt, m/s²
    Force,
    /// dω/dt, rad/s²
    Moment,
    /// Sideways speed, m/s
    Sideways,
    /// Speed over ground along the heading beyond v, m/s
    Along,
    /// Turning of the heading beyond ω, rad/s
    Turn,
    /// Reading of the left wheel, rad/s
    WheelLeft,
    /// Reading of the right wheel, rad/s
    WheelRight,
    /// Reading of the gyro, rad/s
    Gyro,
    /// Reading of the position along the heading, m
    PoseAlong,
    /// Reading of the position to the left of the heading, m
    PoseAcross,
    /// Reading of the heading, rad
    PoseHeading,
}

impl Equation {
    /// Unit of a term added to it.
    #[must_use]
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Force => "m/s²",
            Self::Moment => "rad/s²",
            Self::Sideways | Self::Along => "m/s",
            Self::Turn | Self::WheelLeft | Self::WheelRight | Self::Gyro => "rad/s",
            Self::PoseAlong | Self::PoseAcross => "m",
            Self::PoseHeading => "rad",
        }
    }

    /// Channel of the answer.
    #[must_use]
    pub(crate) fn channel(self) -> &'static str {
        match self {
            Self::Force | Self::Moment => "torque",
            Self::WheelLeft => "wheel_left",
            Self::WheelRight => "wheel_right",
            Self::Gyro => "gyro",
            _ => "pose",
        }
    }

    /// The equation, in words.
    #[must_use]
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Force => "equations of motion: the force along the robot",
            Self::Moment => "equations of motion: the moment about the vertical axis",
            Self::Sideways => "kinematics: the sideways speed",
            Self::Along => "kinematics: the speed over ground",
            Self::Turn => "kinematics: the turning of the heading",
            Self::WheelLeft => "wheel measurement: the left wheel",
            Self::WheelRight => "wheel measurement: the right wheel",
            Self::Gyro => "gyro measurement",
            Self::PoseAlong => "pose measurement: the position along the heading",
            Self::PoseAcross => "pose measurement: the position across the heading",
            Self::PoseHeading => "pose measurement: the heading",
        }
    }

    /// Equation of the free form with this id; none for other ids.
    #[must_use]
    pub(crate) fn of_free_form(id: &str) -> Option<Self> {
        let mut words = id.split('.').skip(1);
        let first = words.next()?;
        let what = if matches!(first, "outliers" | "level" | "lattice") { words.next()? } else { first };
        Some(match what {
            "force" => Self::Force,
            "moment" => Self::Moment,
            "sideways" => Self::Sideways,
            "along" => Self::Along,
            "turn" => Self::Turn,
            "delay" | "wheel_left" | "wheels" => Self::WheelLeft,
            "wheel_right" => Self::WheelRight,
            "gyro" => Self::Gyro,
            "pose_along" | "pose" | "position" => Self::PoseAlong,
            "pose_across" => Self::PoseAcross,
            "pose_heading" | "heading" => Self::PoseHeading,
            _ => return None,
        })
    }
}

/// Quantity that a free form is a function of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Follows {
    /// Forward speed
    Speed,
    /// Yaw rate
    YawRate,
    /// Products of forward speed and yaw rate
    Turning,
    /// dv/dt
    Acceleration,
    /// dω/dt
    YawAcceleration,
    /// Heading
    Heading,
    /// Commanded torques
    Torque,
    /// Recent change of the torques: lagged torques less the torques
    TorqueRate,
    /// Angle of the wheels
    WheelAngle,
    /// Time
    Time,
}

/// Number of cosines of time in the table.
const TIMES: usize = 8;

impl Follows {
    /// All, in the order of the table.
    pub(crate) const ALL: [Self; 10] = [
        Self::Speed,
        Self::YawRate,
        Self::Turning,
        Self::Acceleration,
        Self::YawAcceleration,
        Self::Heading,
        Self::Torque,
        Self::TorqueRate,
        Self::WheelAngle,
        Self::Time,
    ];

    /// Number of its functions in the table.
    #[must_use]
    pub(crate) fn count(self) -> usize {
        match self {
            Self::Speed | Self::YawRate => 5,
            Self::Turning | Self::Acceleration | Self::YawAcceleration => 3,
            Self::Heading | Self::WheelAngle | Self::TorqueRate | Self::Torque => 4,
            Self::Time => TIMES,
        }
    }

    /// Index of its first function in the table.
    #[must_use]
    pub(crate) fn first(self) -> usize {
        Self::ALL.iter().take_while(|f| **f != self).map(|f| f.count()).sum()
    }

    /// Value of `condition` in the answer.
    #[must_use]
    pub(crate) fn condition(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::YawRate | Self::Turning => "yaw_rate",
            Self::Acceleration => "acceleration",
            Self::YawAcceleration => "yaw_acceleration",
            Self::Heading => "heading",
            Self::Torque | Self::TorqueRate => "torque",
            Self::WheelAngle => "wheel_angle",
            Self::Time => "elapsed_time",
        }
    }

    /// Name in the id of a free form.
    #[must_use]
    pub(crate) fn id(self) -> &'static str {
        match self {
            Self::Turning => "turning",
            Self::TorqueRate => "torque_rate",
            other => other.condition(),
        }
    }
}

/// Indices of the functions with which a coefficient may vary: two cosines of time, |speed|, |acceleration|.
#[must_use]
pub(crate) fn variations() -> [usize; 4] {
    let time = Follows::Time.first();
    [time + 1, time + 2, Follows::Speed.first() + 1, Follows::Acceleration.first() + 1]
}

/// Number of functions in the table.
pub(crate) const FUNCTIONS: usize = 5 + 5 + 3 + 3 + 3 + 4 + 4 + 4 + 4 + TIMES;

/// Quantities in one row of which the functions are made.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Row {
    /// m/s
    pub speed: f64,
    /// rad/s
    pub yaw_rate: f64,
    /// m/s²
    pub acceleration: f64,
    /// rad/s²
    pub yaw_acceleration: f64,
    /// Sine and cosine
    pub heading: (f64, f64),
    /// N·m
    pub torques: [f64; 2],
    /// Torques after a short and a long lag, N·m
    pub lagged: [[f64; 2]; 2],
    /// Sines and cosines
    pub wheel_angles: [(f64, f64); 2],
}

/// Typical values in this drive, by which the functions are scaled.
#[derive(Debug, Clone)]
pub(crate) struct Scales {
    /// m/s
    pub speed: f64,
    /// rad/s
    pub yaw_rate: f64,
    /// N·m
    pub torque: f64,
    /// Time over which differences of v and ω give accelerations, s: at least the time between readings. Over less, the
    /// correction by a reading would be taken for an acceleration, and grow until the next reading.
    pub slopes_over_s: [f64; 2],
    /// Classes of the rows by how much the motion changes, where they are distinguished
    pub classes: Classes,
}

impl Scales {
    /// Root mean squares of the recorded wheels and torques, and classes of the rows where `agility` distinguishes
    /// them.
    #[must_use]
    pub(crate) fn of(record: &Record, agility: &Ratios) -> Self {
        let rms = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, n) = values.filter(|v| v.is_finite()).fold((0.0, 0), |(s, n), v| (s + v * v, n + 1));
            (sum / f64::from(n.max(1))).sqrt()
        };
        let rolling = |mode: usize| rms(&mut (0..record.len()).map(|k| record.rolling(k)[mode])).max(1e-3);
        let torque = record.torques_n_m.as_ref().map_or(0.0, |[l, r]| rms(&mut l.iter().chain(r).copied()));
        Self {
            speed: rolling(0),
            yaw_rate: rolling(1),
            torque: torque.max(1e-6),
            slopes_over_s: slopes_over_s(record),
            classes: if *agility == EVEN { Classes::default() } else { Classes::of(record) },
        }
    }
}

/// Time over which differences of v and ω give accelerations, s; the least where torques tell these.
fn slopes_over_s(record: &Record) -> [f64; 2] {
    let every_s = record.torques_n_m.is_none().then(|| record.read_every_s());
    every_s.unwrap_or_default().map(|every_s| every_s.max(Slopes::OVER_S))
}

impl Row {
    /// Values of the functions, in the order of [`Follows::ALL`]; those of time are the first `cosines`.
    pub(crate) fn functions(&self, scales: &Scales, cosines: &[f64; COSINES], out: &mut [f64; FUNCTIONS]) {
        let v = self.speed / scales.speed;
        let w = self.yaw_rate / scales.yaw_rate;
        let (a, alpha) = (self.acceleration, self.yaw_acceleration);
        let (sin, cos) = self.heading;
        let [ul, ur] = self.torques.map(|u| u / scales.torque);
        // a smooth sign function
        let sign = |x: f64| 20.0 * x / (1.0 + 400.0 * x * x).sqrt();
        let (forward, left) = (sign(v), sign(w));
        let angles = self.wheel_angles;
        let mut at = 0;
        let mut put = |values: &[f64]| {
            out[at..at + values.len()].copy_from_slice(values);
            at += values.len();
        };
        put(&[v, v.abs(), v * v, v * v.abs(), forward]);
        put(&[w, w.abs(), w * w, w * w.abs(), left]);
        put(&[v * w, v.abs() * w, v * w.abs()]);
        put(&[a, a.abs(), a * forward]);
        put(&[alpha, alpha.abs(), alpha * left]);
        put(&[cos, sin, cos * cos - sin * sin, 2.0 * sin * cos]);
        // no function bends near zero: a speed control puts its knowledge of the state into small torques
        put(&[ul, ur, ul * ul.abs(), ur * ur.abs()]);
        let lag = |i: usize, j: usize| (self.lagged[i][j] - self.torques[j]) / scales.torque;
        put(&[lag(0, 0), lag(0, 1), lag(1, 0), lag(1, 1)]);
        put(&[angles[0].1, angles[0].0, angles[1].1, angles[1].0]);
        put(&cosines[..TIMES]);
    }
}

/// Number of cosines of time, the constant included; a random walk is made of the others.
pub(crate) const COSINES: usize = 25;

/// cos(nπu), n from zero: cos((n+1)x) = 2 cos x cos nx - cos((n-1)x).
pub(crate) fn cosines_of(progress: f64, out: &mut [f64]) {
    let first = (PI * progress).cos();
    for n in 0..out.len() {
        out[n] = match n {
            0 => 1.0,
            1 => first,
            _ => 2.0 * first * out[n - 1] - out[n - 2],
        };
    }
}

/// Triangle function: 1 at `from` = 0, falling linearly to 0 at ±`within`.
#[inline]
pub(crate) fn hat(from: f64, within: f64) -> f64 {
    (1.0 - from.abs() / within).max(0.0)
}

/// Prior standard deviation of the change in how much of an acceleration lasts to the next row, without torques.
const LASTING_STD: f64 = 0.3;

/// Mounting of the tracked point: offsets ahead and to the left, offset of the heading, and delay of the pose.
pub(crate) const MOUNTING: [Column; 4] = [
    Column::Free(Equation::PoseAlong, CONSTANT),
    Column::Free(Equation::PoseAcross, CONSTANT),
    Column::Free(Equation::PoseHeading, CONSTANT),
    Column::PoseDelay,
];

/// Index of the constant, the first of the cosines of time.
pub(crate) const CONSTANT: usize = FUNCTIONS - TIMES;

/// Nuisance columns, which are in every set, with their prior standard deviations. With a gyro: what varies from one
/// power-on to the next, for each drive. Without torques: how accelerations last. With a pose: the mounting of the
/// reference.
#[must_use]
pub(crate) fn nuisances(record: &Record) -> Vec<(Scoped, f64)> {
    let mut all = Vec::new();
    let b = &record.belief;
    if record.gyro_rad_s.is_some() {
        let of_a_run = [
            (Column::TurnOn, b.turn_on_bias_std_rad_s),
            (Column::WarmUpSize, b.warm_up_relative_std),
            (Column::WarmUpTime, b.warm_up_relative_std),
        ];
        let of_drive = |d: usize| of_a_run.map(|(column, std)| (column.of_drive(d), std));
        all.extend((0..record.starts.len()).flat_map(of_drive));
    }
    if record.torques_n_m.is_none() {
        let lasting = [(Equation::Force, Follows::Acceleration), (Equation::Moment, Follows::YawAcceleration)];
        all.extend(lasting.map(|(equation, follows)| (Column::Free(equation, follows.first()).into(), LASTING_STD)));
    }
    if record.pose.is_some() {
        let stds = [b.lever_arm_std_m, b.lever_arm_std_m, b.heading_offset_std_rad, b.pose_delay_std_s];
        all.extend(MOUNTING.map(Scoped::from).into_iter().zip(stds));
    }
    all.retain(|(_, std)| *std > 0.0);
    all
}

/// A column: the derivatives by one coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Column {
    /// Coordinate `.1` of the model change in place `.0`
    Coordinate(usize, usize),
    /// That coordinate times function `.2` of the table: the coordinate is not constant
    Varying(usize, usize, usize),
    /// The first coordinate of this model change, in the small amount that every robot has
    Usual(usize),
    /// Function `.1` of the table added to an equation
    Free(Equation, usize),
    /// Triangle added to an equation: 1 at the time `.1`, s since the log began, zero from `.2` s away on
    Hat(Equation, f64, f64),
    /// Delay of the pose, s
    PoseDelay,
    /// Deviation of C2 in this run
    TurnOn,
    /// Deviation of ln C1 in this run
    WarmUpSize,
    /// Deviation of ln T in this run
    WarmUpTime,
    /// cos(nπu) on the gyro, u from 0 to 1 over the drive
    GyroCosine(usize),
    /// Step of the gyro's bias at this time, s since the log began
    GyroStep(f64),
    /// -exp(-(t - t0)/τ) after a step at t0 = `.0`, τ = `.1`, s: the part of the change still to come
    GyroSettling(f64, f64),
}

/// A column, and the drives in which its coefficient holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scoped {
    /// The column.
    pub column: Column,
    /// Index of the only drive in which it acts; none: in all drives.
    pub drive: Option<usize>,
}

impl From<Column> for Scoped {
    fn from(column: Column) -> Self {
        Self { column, drive: None }
    }
}

impl Column {
    /// The column whose derivatives it has: of [`Column::Usual`] the first coordinate, of others itself.
    pub(crate) fn evaluated(self) -> Self {
        if let Self::Usual(change) = self { Self::Coordinate(change, 0) } else { self }
    }

    /// Equation and value of the term that it adds there; none for a column that is no free function.
    #[inline]
    pub(crate) fn added(self, functions: &[f64; FUNCTIONS], t_s: f64) -> Option<(Equation, f64)> {
        match self {
            Self::Free(equation, f) => Some((equation, functions[f])),
            Self::Hat(equation, at_s, within_s) => Some((equation, hat(t_s - at_s, within_s))),
            _ => None,
        }
    }

    /// The column in one drive alone, by index.
    #[must_use]
    pub(crate) fn of_drive(self, drive: usize) -> Scoped {
        Scoped { column: self, drive: Some(drive) }
    }
}

impl Scoped {
    /// Whether it does anything in a drive.
    #[must_use]
    pub(crate) fn acts_in(&self, drive: usize) -> bool {
        self.drive.is_none_or(|d| d == drive)
    }
}
