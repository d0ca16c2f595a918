//! Keys of the tables that people write: all that are missing are said at once, with a guess where one was misspelt.

use crate::error::{Error, ErrorKind, Result, nearest};

/// Keys of a table: those that it must have, and those that it may have.
type Keys = (&'static str, &'static [&'static str], &'static [&'static str]);

const TABLES: [Keys; 5] = [
    (
        "gyro",
        &["c1_rad_s", "c2_rad_s", "time_constant_s", "angle_random_walk_rad_sqrt_s"],
        &[
            "earth_rate_rad_s",
            "turn_on_bias_std_rad_s",
            "warm_up_relative_std",
            "cooling_time_constant_s",
            "covariance",
            "discrete",
            "noise",
            "temperature",
            "last_run",
        ],
    ),
    (
        "vehicle",
        &[
            "mass_kg",
            "yaw_inertia_kg_m2",
            "half_track_m",
            "wheel_radius_m",
            "wheel_inertia_kg_m2",
            "viscous_friction_n_m_s",
            "torque_noise_n_m_sqrt_s",
        ],
        &["steering", "torque_constant_n_m_a"],
    ),
    ("traction", &["law"], &["low_speed_m_s", "driven_load_share", "left_load_share", "rolling_resistance"]),
    ("encoder", &["speed_noise_std_rad_s"], &["ticks_per_revolution"]),
    (
        "pose",
        &["rate_hz", "position_std_m", "heading_std_rad"],
        &["lever_arm_std_m", "heading_offset_std_rad", "delay_std_s", "correlation_time_s"],
    ),
];

/// Keys and tables of the file itself.
const FILE: [&str; 12] = [
    "schema",
    "kind",
    "sample_time_s",
    "gyro",
    "vehicle",
    "traction",
    "encoder",
    "pose",
    "effect",
    "custom_effect",
    "validation",
    "provenance",
];

/// Refuses a file that lacks keys. One unknown key alone is left to the parser, which knows its line.
///
/// # Errors
/// [`ErrorKind::Config`] with every missing key, every unknown one beside them, and guesses.
pub(super) fn complete(table: &toml::Table, name: &str) -> Result<()> {
    let (mut missing, mut unknown, mut guesses) = (Vec::new(), Vec::new(), Vec::new());
    // a table of another name than any is what a missing one was meant to be
    for key in table.keys().filter(|key| !FILE.contains(&key.as_str())) {
        guess(key, FILE.into_iter().filter(|known| !table.contains_key(*known)), "", &mut guesses);
        unknown.push(key.clone());
    }
    for (title, needed, optional) in TABLES {
        let Some(own) = table.get(title).and_then(toml::Value::as_table) else { continue };
        missing.extend(needed.iter().filter(|k| !own.contains_key(**k)).map(|key| format!("{title}.{key}")));
        for key in own.keys().filter(|k| !needed.contains(&k.as_str()) && !optional.contains(&k.as_str())) {
            let free = needed.iter().chain(optional).copied().filter(|k| !own.contains_key(*k));
            guess(key, free, &format!("{title}."), &mut guesses);
            unknown.push(format!("{title}.{key}"));
        }
    }
    let drives = table.get("kind").and_then(toml::Value::as_str) == Some("driving") && table.contains_key("gyro");
    let tables = ["vehicle", "encoder"].into_iter().filter(|t| drives && !table.contains_key(*t));
    missing.extend(tables.map(|t| format!("[{t}]")));
    if missing.is_empty() {
        return Ok(());
    }
    let mut found = format!("{} missing: {}", are(missing.len()), missing.join(", "));
    if !unknown.is_empty() {
        found += &format!("; {} unknown: {}", are(unknown.len()), unknown.join(", "));
    }
    let kind = if missing.iter().all(|m| m.starts_with("gyro.")) { "rest" } else { "driving" };
    let written = format!("gyroid init --kind {kind} -o FILE writes every key with its unit");
    let hint = match &guesses[..] {
        [] => written,
        [(meant, _)] => format!("did you mean {meant}? {written}"),
        several => {
            let all: Vec<String> = several.iter().map(|(meant, key)| format!("{meant} by {key}")).collect();
            format!("did you mean {}? {written}", all.join(", "))
        }
    };
    Err(Error::new(ErrorKind::Config, name, found).hint(hint))
}

/// Adds the known name that an unknown one was probably meant for.
fn guess<'a>(key: &str, known: impl Iterator<Item = &'a str>, table: &str, guesses: &mut Vec<(String, String)>) {
    guesses.extend(nearest(key, known).map(|meant| (meant.to_string(), format!("{table}{key}"))));
}

fn are(count: usize) -> String {
    if count == 1 { "1 key is".into() } else { format!("{count} keys are") }
}

#[cfg(test)]
pub(super) fn all() -> impl Iterator<Item = (&'static str, &'static str, bool)> {
    let of = |keys: &'static [&'static str], title, needed| keys.iter().map(move |key| (title, *key, needed));
    TABLES
        .into_iter()
        .flat_map(move |(title, needed, optional)| of(needed, title, true).chain(of(optional, title, false)))
}
