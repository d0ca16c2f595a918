//! The node's parameters: what they are, and what a request changes of the options.

use super::options::Options;
use ros2_client::parameters::raw::{self, Parameter};
use ros2_client::parameters::{NumericRange, ParameterDescriptor, ParameterValue};
use ros2_client::rcl_interfaces::ListParametersResult;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// The configuration's file; of several gyros `config_x` and so on.
const CONFIG: &str = "config";
const EXTRAPOLATE: &str = "extrapolate";
const LEARN: &str = "learn";

/// A parameter: its name, value, description, and whether it is fixed while the node runs.
struct Entry {
    name: Cow<'static, str>,
    value: ParameterValue,
    about: &'static str,
    fixed: bool,
}

/// Name of the parameter that is the file of the configuration of the gyro `k`.
fn config_name(options: &Options, k: usize) -> Cow<'static, str> {
    match options.gyros.as_slice() {
        [_] => CONFIG.into(),
        gyros => format!("{CONFIG}_{}", gyros[k].axis.name()).into(),
    }
}

/// The gyro whose configuration's file `name` is.
pub(super) fn config_of(options: &Options, name: &str) -> Option<usize> {
    (0..options.gyros.len()).find(|k| config_name(options, *k) == name)
}

/// All parameters in the order of their names.
fn entries(options: &Options) -> Vec<Entry> {
    let text = |text: &str| ParameterValue::String(text.into());
    let path = |path: &Path| ParameterValue::String(path.display().to_string());
    let topic = |topic: Option<&str>| text(&topic.map_or(String::new(), |t| options.absolute(t)));
    let changes = |name: &'static str, value, about| Entry { name: name.into(), value, about, fixed: false };
    let fixed = |name: &'static str, value, about| Entry { name: name.into(), value, about, fixed: true };
    let axes = options.axes().into_iter().map(String::from).collect();
    let topics = &options.topics;
    let configs = (0..options.gyros.len()).map(|k| Entry {
        name: config_name(options, k),
        value: path(&options.gyros[k].config),
        about: "file of the configuration; setting it reads the file",
        fixed: false,
    });
    let mut all = vec![
        fixed("axis", ParameterValue::StringArray(axes), "axes of the IMU that are corrected"),
        changes(
            EXTRAPOLATE,
            ParameterValue::Boolean(options.extrapolate),
            "correct outside the configuration's [validation] too; else readings pass through there",
        ),
        fixed("imu", topic(Some(&topics.imu)), "topic of sensor_msgs/Imu that is read"),
        fixed("joints", topic(topics.joints.as_deref()), "topic of sensor_msgs/JointState that is read; empty: none"),
        changes(LEARN, ParameterValue::Boolean(options.learn), "learn the bias while the robot stands"),
        fixed("odometry", topic(topics.odometry.as_deref()), "topic of nav_msgs/Odometry that is read; empty: none"),
        fixed("out", topic(Some(&topics.out)), "topic of sensor_msgs/Imu that is published"),
        fixed("state", path(options.state.as_deref().unwrap_or(Path::new(""))), "file of the state; empty: none"),
        fixed(
            "temperature",
            topic(topics.temperature.as_deref()),
            "topic of sensor_msgs/Temperature that is read; empty: none",
        ),
        fixed("wheels", ParameterValue::StringArray(options.wheels.clone()), "joints that are wheels; empty: all"),
    ];
    all.extend(configs);
    all.sort_by(|a, b| a.name.cmp(&b.name));
    all
}

/// Values of the named parameters; of one that there is not, none.
pub(super) fn get(options: &Options, names: &[String]) -> Vec<raw::ParameterValue> {
    let entries = entries(options);
    let of =
        |name: &String| entries.iter().find(|e| e.name == *name).map_or(ParameterValue::NotSet, |e| e.value.clone());
    names.iter().map(|name| of(name).into()).collect()
}

/// Descriptions of the named parameters.
pub(super) fn describe(options: &Options, names: &[String]) -> Vec<raw::ParameterDescriptor> {
    let entries = entries(options);
    let of = |name: &String| match entries.iter().find(|e| e.name == *name) {
        None => ParameterDescriptor::unknown(name),
        Some(entry) => ParameterDescriptor {
            name: name.clone(),
            param_type: entry.value.to_parameter_type(),
            description: entry.about.into(),
            additional_constraints: String::new(),
            read_only: entry.fixed,
            dynamic_typing: false,
            range: NumericRange::NotSpecified,
        },
    };
    names.iter().map(|name| of(name).into()).collect()
}

/// Names of the parameters, none of which has a prefix; all of them, or those of `wanted`.
pub(super) fn list(options: &Options, wanted: &[String]) -> ListParametersResult {
    let names = entries(options).into_iter().map(|e| e.name.to_string());
    let names = names.filter(|name| wanted.is_empty() || wanted.contains(name)).collect();
    ListParametersResult { names, prefixes: Vec::new() }
}

/// The options with the parameters that are wanted, all of them or none.
///
/// # Errors
/// Why one of them cannot be set.
pub(super) fn changed(options: &Options, wanted: &[Parameter]) -> Result<Options, String> {
    let entries = entries(options);
    let mut options = options.clone();
    for Parameter { name, value } in wanted {
        let Some(entry) = entries.iter().find(|e| e.name == *name) else {
            let names: Vec<_> = entries.iter().filter(|e| !e.fixed).map(|e| &*e.name).collect();
            return Err(format!("there is no parameter {name}; {} can be set", names.join(", ")));
        };
        if entry.fixed {
            return Err(format!("{name} is an option of the command line: start the node anew to change it"));
        }
        if value.ptype != ParameterValue::to_parameter_type_raw(&entry.value) {
            let kind = if matches!(entry.value, ParameterValue::String(_)) { "a string" } else { "a bool" };
            return Err(format!("{name} is {kind}"));
        }
        match (config_of(&options, name), name.as_str()) {
            (Some(k), _) => options.gyros[k].config = PathBuf::from(&value.string_value),
            (None, EXTRAPOLATE) => options.extrapolate = value.boolean_value,
            _ => options.learn = value.boolean_value,
        }
    }
    Ok(options)
}
