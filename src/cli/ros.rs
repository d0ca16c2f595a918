//! `gyroid ros`: the live node.

use super::outcome::Outcome;
#[cfg(feature = "ros2")]
use super::output::{Common, Output};
use clap::Args;
#[cfg(feature = "ros2")]
use gyroid::files::Plan;
#[cfg(feature = "ros2")]
use gyroid::ros::{self, Axis, Gyro, Options, Signals, Topics};
use gyroid::{Error, ErrorKind, Result};
#[cfg(feature = "ros2")]
use signal_hook::consts::{SIGINT, SIGTERM};
use std::path::PathBuf;
#[cfg(feature = "ros2")]
use std::time::Duration;

/// Correct a gyro live, as a ROS 2 node that needs no ROS installation
///
/// It subscribes sensor_msgs/Imu, subtracts the configuration's e(t) and what rest has taught of its deviation, and publishes the
/// message with the rates about its axes corrected and their variances filled in. ~/bias has the bias with its variance, /diagnostics
/// NIS and what arrives. It learns while the wheels stand (--joints or --odometry), or, without wheels, while the rate is no more
/// than the stated white noise. All topics are BEST_EFFORT but /diagnostics. It reads CONFIG again when the file changes, and on
/// SIGHUP. ros2 param set changes config, extrapolate and learn while it runs.
///
/// It runs until SIGINT or SIGTERM.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid ros gyroid.toml --joints joint_states --state /var/lib/gyroid.json\n  \
    gyroid ros gyroid.toml --imu imu/raw --out imu/data --namespace /robot1\n  \
    gyroid ros gyroid.toml --temperature imu/temperature --axis x\n  \
    gyroid ros x.toml y.toml z.toml --axis x,y,z")]
// help is the same without the feature
#[cfg_attr(not(feature = "ros2"), allow(dead_code))]
pub(crate) struct RosArgs {
    /// Configurations (schema 1) with [gyro], one for each axis
    #[arg(required = true, value_name = "CONFIG")]
    configs: Vec<PathBuf>,
    /// Topic of sensor_msgs/Imu to correct; relative to the namespace, as all topics, but for a leading /
    #[arg(long, value_name = "TOPIC", default_value = "imu/data_raw")]
    imu: String,
    /// Topic of the corrected sensor_msgs/Imu
    #[arg(long, value_name = "TOPIC", default_value = "imu/data")]
    out: String,
    /// Topic of sensor_msgs/JointState that has the wheels [default: none, the rate itself tells rest]
    #[arg(long, value_name = "TOPIC")]
    joints: Option<String>,
    /// Topic of nav_msgs/Odometry by wheels alone, where there are no joint states
    #[arg(long, value_name = "TOPIC", conflicts_with = "joints")]
    odometry: Option<String>,
    /// Joints that are wheels [default: all]
    #[arg(long, value_name = "JOINT", value_delimiter = ',', requires = "joints")]
    wheels: Vec<String>,
    /// Topic of sensor_msgs/Temperature of the gyro, for [gyro.temperature] [default: none, the gyro warms up by elapsed time]
    #[arg(long, value_name = "TOPIC")]
    temperature: Option<String>,
    /// Axes of the IMU that the CONFIGs describe, in their order
    #[arg(long, value_enum, value_delimiter = ',', default_value = "z")]
    axis: Vec<AxisName>,
    /// Name of the node
    #[arg(long, value_name = "NAME", default_value = "gyroid")]
    name: String,
    /// Namespace of the node
    #[arg(long, value_name = "NAMESPACE", default_value = "/")]
    namespace: String,
    /// DDS domain [default: the environment's ROS_DOMAIN_ID, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=232))]
    domain: Option<u16>,
    /// Time since power-on when the first message comes, s
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    start_offset: f64,
    /// File that keeps how warm the gyro is and what was learnt; read at the start, written every ten seconds and at the end.
    /// Of several axes each has its own: state.json is state.x.json and so on
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// The gyro was off since the run in --state, although the computer was not
    #[arg(long, requires = "state")]
    power_cut: bool,
    /// Correct also outside the span that CONFIG was fitted on, where readings else pass through
    #[arg(long)]
    extrapolate: bool,
    /// Learn nothing at rest: the bias is that of CONFIG
    #[arg(long)]
    no_learn: bool,
    /// Record what arrives and what is published to this MCAP file, which must not be there yet
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// End after so many seconds
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum AxisName {
    X,
    Y,
    Z,
}

#[cfg(not(feature = "ros2"))]
pub(crate) fn run(_: &RosArgs) -> Result<Outcome> {
    let found = "this gyroid was built without ROS 2";
    let error = Error::new(ErrorKind::Usage, "gyroid ros", found);
    Err(error.hint("build it with: cargo install --path . --features ros2"))
}

#[cfg(feature = "ros2")]
pub(crate) fn run(args: &RosArgs) -> Result<Outcome> {
    let options = args.options()?;
    let states = options.gyros.iter().filter_map(|gyro| options.state_file(gyro.axis));
    let plan = Plan::new().reads(&args.configs).updates("--state", states).writes("--record", &args.record);
    let output = Output::open(&Common { json: None, quiet: args.quiet, force: false }, "ros", plan)?;
    let signals = Signals::default();
    let mut watched = vec![(SIGINT, &signals.stop), (SIGTERM, &signals.stop)];
    #[cfg(unix)]
    watched.push((signal_hook::consts::SIGHUP, &signals.reload));
    for (signal, flag) in watched {
        signal_hook::flag::register(signal, flag.clone())
            .map_err(|e| Error::new(ErrorKind::Io, "signals", e).hint("start it again"))?;
    }
    ros::run(&options, &signals, &mut |text| output.say(text))?;
    Ok(Outcome::Done)
}

#[cfg(feature = "ros2")]
impl RosArgs {
    fn options(&self) -> Result<Options> {
        let duration = self
            .duration
            .map(Duration::try_from_secs_f64)
            .transpose()
            .map_err(|e| Error::new(ErrorKind::Usage, "--duration", e).hint("give a positive number of seconds"))?;
        Ok(Options {
            gyros: self.gyros()?,
            topics: Topics {
                imu: self.imu.clone(),
                joints: self.joints.clone(),
                odometry: self.odometry.clone(),
                temperature: self.temperature.clone(),
                out: self.out.clone(),
            },
            wheels: self.wheels.clone(),
            name: self.name.clone(),
            namespace: self.namespace.clone(),
            domain: domain(self.domain)?,
            extrapolate: self.extrapolate,
            learn: !self.no_learn,
            since_power_on_s: self.start_offset,
            state: self.state.clone(),
            power_cut: self.power_cut,
            record: self.record.clone(),
            duration,
        })
    }

    /// The axes with their configurations.
    fn gyros(&self) -> Result<Vec<Gyro>> {
        let wrong = |found| {
            let hint = "name an axis for each configuration: gyroid ros x.toml z.toml --axis x,z";
            Err(Error::new(ErrorKind::Usage, "--axis", found).hint(hint))
        };
        if self.axis.len() != self.configs.len() {
            return wrong(format!("{} named for {} configurations", self.axis.len(), self.configs.len()));
        }
        if (1..self.axis.len()).any(|k| self.axis[..k].contains(&self.axis[k])) {
            return wrong("an axis is named twice".into());
        }
        let axis = |name: &AxisName| match name {
            AxisName::X => Axis::X,
            AxisName::Y => Axis::Y,
            AxisName::Z => Axis::Z,
        };
        Ok(self
            .axis
            .iter()
            .zip(&self.configs)
            .map(|(name, file)| Gyro { axis: axis(name), config: file.clone() })
            .collect())
    }
}

/// The domain that was asked for, else the environment's.
#[cfg(feature = "ros2")]
fn domain(asked: Option<u16>) -> Result<u16> {
    const NAME: &str = "ROS_DOMAIN_ID";
    match (asked, std::env::var(NAME)) {
        (Some(domain), _) => Ok(domain),
        (None, Ok(text)) if !text.is_empty() => text.parse().ok().filter(|d| *d <= 232).ok_or_else(|| {
            Error::new(ErrorKind::Usage, NAME, format!("{text:?} is no domain")).hint("a number from 0 to 232")
        }),
        _ => Ok(0),
    }
}
