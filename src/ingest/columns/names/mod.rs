//! Meaning of a column by its name: words, axis and unit, in the spellings of common recorders.

use crate::units::{RateUnit, TimeUnit};

/// Axis of the gyro.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Roll axis.
    X,
    /// Pitch axis.
    Y,
    /// Yaw axis of a robot on level ground.
    #[default]
    Z,
}

impl Axis {
    /// All axes.
    pub(crate) const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Reads `x`, `y`, `z`.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        match text.trim().to_lowercase().as_str() {
            "x" => Some(Self::X),
            "y" => Some(Self::Y),
            "z" => Some(Self::Z),
            _ => None,
        }
    }

    /// The axis that the name of a gyro's column says: `gyro_z_rad_s`, `angular_velocity.x`, `wy`.
    #[must_use]
    pub(crate) fn of_column(name: &str) -> Option<Self> {
        match parse(name).role {
            Role::Gyro(axis) => axis,
            _ => None,
        }
    }
}

impl std::fmt::Display for Axis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        })
    }
}

/// How good a time column is: the sensor's own clock before the computer's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum TimeKind {
    /// Says that it counts from power-on.
    SincePowerOn,
    /// Time of the sample.
    Sensor,
    /// Time at which a computer received or stored the sample.
    Host,
}

/// Meaning of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Rate of the gyro; without an axis if the name gives none.
    Gyro(Option<Axis>),
    /// Time, whole or in one column.
    Time(TimeKind),
    /// Whole seconds, or the nanoseconds to go with them, of a time in two columns.
    TimePart { kind: TimeKind, nanoseconds: bool },
    /// Temperature.
    Temperature,
    /// Supply voltage.
    Supply,
    /// Not needed here.
    Other,
}

/// A column's name, taken apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Named {
    pub role: Role,
    /// Unit as written in the name, if a part of it looks like one.
    pub unit: Option<String>,
}

/// Words that name an angular rate.
const RATE: [&str; 14] = [
    "gyro",
    "gyr",
    "gyros",
    "gyroscope",
    "w",
    "omega",
    "angularvelocity",
    "angvel",
    "angularrate",
    "angrate",
    "rate",
    "rotationrate",
    "rotrate",
    "bodyrate",
];
/// Words that make of a rate something else than a gyro's measurement.
const NOT_MEASURED: [&str; 36] = [
    "odo",
    "odom",
    "odometry",
    "wheel",
    "encoder",
    "truth",
    "true",
    "gt",
    "groundtruth",
    "mocap",
    "gps",
    "gnss",
    "ref",
    "reference",
    "cmd",
    "command",
    "setpoint",
    "target",
    "desired",
    "bias",
    "offset",
    "scale",
    "cov",
    "covariance",
    "std",
    "sigma",
    "var",
    "variance",
    "error",
    "est",
    "estimated",
    "status",
    "temp",
    "temperature",
    "integral",
    "sample",
];
/// Words of which a time column's name consists ...
const TIME: [&str; 15] = [
    "t",
    "time",
    "timestamp",
    "timestamps",
    "stamp",
    "ts",
    "uptime",
    "elapsed",
    "datetime",
    "epoch",
    "utc",
    "zeit",
    "zeitstempel",
    "tiempo",
    "tempo",
];
/// ... and words that may stand beside them.
const BESIDE_TIME: [&str; 22] = [
    "header",
    "field",
    "sensor",
    "imu",
    "gyro",
    "device",
    "since",
    "power",
    "on",
    "poweron",
    "boot",
    "start",
    "startup",
    "unix",
    "local",
    "relative",
    "data",
    "msg",
    "measurement",
    "total",
    "from",
    "seconds",
];
/// Words of a computer's clock.
const HOST: [&str; 16] = [
    "host", "recv", "rx", "receive", "received", "receipt", "arrival", "pc", "system", "sys", "ros", "log", "logger",
    "record", "recorded", "server",
];

/// Takes a name apart.
pub(crate) fn parse(name: &str) -> Named {
    let trimmed = name.trim().trim_start_matches(['#', '%', '.', '/']).trim();
    // `rostopic echo -p` calls the time of receipt %time
    let receipt = name.trim().starts_with('%');
    let (stem, bracketed) = split_brackets(trimmed);
    let mut words = words_of(&stem);
    let mut axis = None;
    let mut unit = None;
    match bracketed.as_deref() {
        Some("0") => axis = Some(Axis::X),
        Some("1") => axis = Some(Axis::Y),
        Some("2") => axis = Some(Axis::Z),
        Some(other) => unit = Some(other.to_string()),
        None => {}
    }
    // PX4's `gyro_rad[2]` is in rad/s
    if words == ["gyro", "rad"] {
        words.pop();
        unit = Some("rad/s".to_string());
    }
    // counts of the sensor's own, which no unit follows
    if unit.is_none()
        && words.len() > 1
        && words.last().is_some_and(|w| is_raw(w))
        && gyro_role(&words[..words.len() - 1], axis).is_some()
    {
        unit = words.pop();
    }
    let suffix = if unit.is_none() { take_rate_unit(&mut words) } else { None };
    let unit_text = unit.clone().or_else(|| suffix.clone());
    if let Some(gyro) = gyro_role(&words, axis) {
        return Named { role: gyro, unit: unit_text };
    }
    let named_rate_unit = suffix.is_some();
    if !named_rate_unit {
        if let Some(named) = time_role(&words, unit.as_deref(), receipt) {
            return named;
        }
        if let Some(named) = environment_role(&words, unit.as_deref()) {
            return named;
        }
    }
    Named { role: Role::Other, unit: unit_text }
}

/// Whether what stands in the place of a unit says that the numbers are the sensor's own counts.
pub(crate) fn is_raw(unit: &str) -> bool {
    ["raw", "lsb", "lsbs", "counts", "count", "adc", "digits", "digit"].contains(&unit.trim().to_lowercase().as_str())
}

/// `name [unit]`, `name (unit)`, `name[2]` into the name and what stands in the brackets.
pub(crate) fn split_brackets(name: &str) -> (String, Option<String>) {
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some(inner) = name.strip_suffix(close)
            && let Some((stem, content)) = inner.rsplit_once(open)
        {
            return (stem.trim().to_string(), Some(content.trim().to_string()));
        }
    }
    (name.to_string(), None)
}

/// Words in lower case; borders are whatever is no letter or digit, and `aB`.
pub(crate) fn words_of(stem: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in stem.chars() {
        if !c.is_alphanumeric() && c != '°' {
            words.push(String::new());
        } else {
            if c.is_uppercase() && before.is_lowercase() {
                words.push(String::new());
            }
            words.last_mut().into_iter().for_each(|w| w.extend(c.to_lowercase()));
        }
        before = c;
    }
    words.retain(|w| !w.is_empty());
    words
}

/// Takes a rate unit off the end of the words: `.. rad s`, `.. deg per s`, `.. dps`.
fn take_rate_unit(words: &mut Vec<String>) -> Option<String> {
    // the whole name must not be its unit
    for n in (1..=3).rev().filter(|n| n < &words.len()) {
        let tail = words[words.len() - n..].join("_");
        if RateUnit::parse(&tail).is_some() {
            words.truncate(words.len() - n);
            return Some(tail);
        }
    }
    None
}

fn is_axis(word: &str) -> Option<Axis> {
    match word {
        "x" | "roll" => Some(Axis::X),
        "y" | "pitch" => Some(Axis::Y),
        "z" | "yaw" => Some(Axis::Z),
        _ => None,
    }
}

fn gyro_role(words: &[String], index: Option<Axis>) -> Option<Role> {
    if words.iter().any(|w| NOT_MEASURED.contains(&w.as_str())) {
        return None;
    }
    let is_rate = |words: &[String]| {
        let pair = |p: &[String]| RATE.contains(&p.concat().as_str());
        words.iter().any(|w| RATE.contains(&w.as_str())) || words.windows(2).any(pair)
    };
    let (last, before) = words.split_last()?;
    if let Some(axis) = index {
        return is_rate(words).then_some(Role::Gyro(Some(axis)));
    }
    if let Some(axis) = is_axis(last)
        && is_rate(before)
    {
        return Some(Role::Gyro(Some(axis)));
    }
    // yaw rate, z rate
    if matches!(last.as_str(), "rate" | "velocity")
        && let Some(axis) = before.last().and_then(|w| is_axis(w))
        && (last == "rate" || matches!(before.last().map(String::as_str), Some("yaw" | "pitch" | "roll")))
    {
        return Some(Role::Gyro(Some(axis)));
    }
    // gz, wz, gyroz, omegaz, yawrate
    for axis in ["x", "y", "z"] {
        if let Some(word) = last.strip_suffix(axis)
            && (word == "g" || word == "rot" || RATE.contains(&word))
        {
            return Some(Role::Gyro(is_axis(axis)));
        }
    }
    for axis in ["roll", "pitch", "yaw"] {
        if last.strip_prefix(axis) == Some("rate") {
            return Some(Role::Gyro(is_axis(axis)));
        }
    }
    // a gyro of one axis: only if the name says nothing else
    (words.len() <= 2 && RATE.contains(&words.concat().as_str()) && last != "w").then_some(Role::Gyro(None))
}

fn time_role(words: &[String], bracketed: Option<&str>, receipt: bool) -> Option<Named> {
    let mut words = words.to_vec();
    let mut unit = bracketed.map(str::to_string);
    let mut part = None;
    if let Some(last) = words.last().cloned()
        && words.len() > 1
        && unit.is_none()
        && TimeUnit::parse(&last).is_some()
    {
        words.pop();
        // sec and nanosec of a ROS stamp
        if words.iter().any(|w| w == "stamp") {
            part = match last.as_str() {
                "sec" | "secs" => Some(false),
                "nsec" | "nsecs" | "nanosec" | "nanosecs" => Some(true),
                _ => None,
            };
        }
        unit = Some(last);
    } else if words.last().is_some_and(|w| w == "nsecs" || w == "nanosecs") {
        words.pop();
        part = Some(true);
        unit = Some("ns".to_string());
    }
    let known = |w: &String| {
        [&TIME[..], &BESIDE_TIME, &HOST].iter().any(|set| set.contains(&w.as_str()))
            || w.strip_prefix("imu").is_some_and(|n| n.parse::<u8>().is_ok())
    };
    // a column that is called by its unit alone
    if let [word] = &words[..]
        && [
            "seconds",
            "secs",
            "sec",
            "sekunden",
            "millis",
            "micros",
            "nanos",
            "ms",
            "milliseconds",
            "microseconds",
            "nanoseconds",
        ]
        .contains(&word.as_str())
    {
        return Some(Named { role: Role::Time(TimeKind::Sensor), unit: unit.or_else(|| Some(word.clone())) });
    }
    if words.is_empty() || !words.iter().all(known) || !words.iter().any(|w| TIME.contains(&w.as_str())) {
        return None;
    }
    let has = |set: &[&str]| words.iter().any(|w| set.contains(&w.as_str()));
    let kind = if receipt || has(&HOST) {
        TimeKind::Host
    } else if has(&["since", "uptime"]) && has(&["on", "poweron", "boot", "startup", "uptime"]) {
        TimeKind::SincePowerOn
    } else {
        TimeKind::Sensor
    };
    let role = match part {
        Some(nanoseconds) => Role::TimePart { kind, nanoseconds },
        None => Role::Time(kind),
    };
    Some(Named { role, unit })
}

fn environment_role(words: &[String], bracketed: Option<&str>) -> Option<Named> {
    let has = |set: &[&str]| words.iter().any(|w| set.contains(&w.as_str()));
    let last = words.last()?.clone();
    let role = if has(&["temp", "temperature", "temps"]) {
        Role::Temperature
    } else if has(&["supply", "vcc", "vdd", "voltage", "vbat", "vsupply"]) {
        Role::Supply
    } else {
        return None;
    };
    if has(&["setpoint", "target", "std", "var", "variance", "status", "rate", "slope", "ambient", "motor"]) {
        return None;
    }
    let unit = bracketed.map(str::to_string).or_else(|| environment_factor(role, &last).map(|_| last));
    Some(Named { role, unit })
}

/// The words before the last one of a name that ends like one of a pair of seconds and nanoseconds, and whether it is
/// the nanoseconds; `None` for other names.
pub(crate) fn time_part(name: &str) -> Option<(String, bool)> {
    let mut words = words_of(name);
    let nanoseconds = match words.pop()?.as_str() {
        "sec" | "secs" | "seconds" => false,
        "nsec" | "nsecs" | "nanosec" | "nanosecs" | "nanoseconds" => true,
        _ => return None,
    };
    Some((words.join("_"), nanoseconds))
}

/// Whether a name of a rate tells the motion (`yaw_rate`) rather than the sensor (`gyro_z`): a state estimate has one too.
pub(crate) fn tells_motion(name: &str) -> bool {
    let mut words = words_of(&split_brackets(name).0);
    take_rate_unit(&mut words);
    let joined = words.concat();
    ["yawrate", "yawvelocity", "zrate"].contains(&joined.as_str())
}

/// Factor and offset to °C or V of a unit of temperature or supply.
pub(crate) fn environment_factor(role: Role, unit: &str) -> Option<(f64, f64)> {
    let unit = unit.to_lowercase().replace(['°', 'º'], "deg").replace([' ', '_'], "");
    match (role, unit.as_str()) {
        (Role::Temperature, "c" | "degc" | "celsius") => Some((1.0, 0.0)),
        (Role::Temperature, "k" | "kelvin" | "degk") => Some((1.0, -273.15)),
        (Role::Temperature, "f" | "degf" | "fahrenheit") => Some((5.0 / 9.0, -160.0 / 9.0)),
        (Role::Supply, "v" | "volt" | "volts") => Some((1.0, 0.0)),
        (Role::Supply, "mv" | "millivolt" | "millivolts") => Some((1e-3, 0.0)),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
