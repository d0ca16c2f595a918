//! How warm the gyro was, kept in a file over a restart of the program or of the robot.

use crate::error::{Error, ErrorKind, Result};
use crate::files::{OutputFile, mark};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Its kind among gyroid's JSON files.
const COMMAND: &str = "live_state";

/// State that is kept. Written whole or not at all; replaced at every writing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Saved {
    /// Kind of the file.
    schema: String,
    /// Age of the warm-up at the last sample, s, as in `[gyro.last_run]`.
    pub warm_up_age_s: f64,
    /// Time on since the power-on that the last sample belongs to, s.
    pub since_power_on_s: f64,
    /// Stamp of the last sample, ns, by the sender's clock.
    pub stamp_ns: i64,
    /// Boot of the computer that wrote it: the same one means that the gyro stayed on. Empty where it is not known.
    pub boot_id: String,
    /// SHA-256 of the configuration, under which the state below was learnt.
    pub configuration_sha256: String,
    /// State of the filter, in its own order.
    pub state: [f64; 4],
    /// Its covariance, by rows.
    pub covariance: [[f64; 4]; 4],
}

impl Saved {
    /// State to be kept; `schema` is filled in.
    pub(super) fn new(
        ages_s: [f64; 2],
        stamp_ns: i64,
        ids: [&str; 2],
        (state, covariance): ([f64; 4], [[f64; 4]; 4]),
    ) -> Self {
        let [warm_up_age_s, since_power_on_s] = ages_s;
        let [boot_id, configuration_sha256] = ids.map(String::from);
        let schema = mark::json_schema(COMMAND);
        Self { schema, warm_up_age_s, since_power_on_s, stamp_ns, boot_id, configuration_sha256, state, covariance }
    }

    /// Reads `path`; `None` where there is no such file.
    ///
    /// # Errors
    /// [`ErrorKind::Io`], or [`ErrorKind::Format`] where it is no such file or an age is no duration.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        let hint = "delete it: the gyro is then taken for cold; or name another file";
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Error::io(path, &e)),
        };
        let wrong = |found: String| Error::new(ErrorKind::Format, path.display(), found).hint(hint);
        let saved: Self = serde_json::from_str(&text).map_err(|e| wrong(format!("is no state of a live node: {e}")))?;
        if saved.schema != mark::json_schema(COMMAND) {
            return Err(wrong(format!("its kind is {:?}", saved.schema)).at("schema"));
        }
        for (place, age) in [("warm_up_age_s", saved.warm_up_age_s), ("since_power_on_s", saved.since_power_on_s)] {
            if !(age.is_finite() && age >= 0.0) {
                return Err(wrong(format!("{age} s is no duration")).at(place));
            }
        }
        Ok(Some(saved))
    }

    /// Writes it to `path`, whole or not at all.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the disk refuses; [`ErrorKind::Numeric`] if a number cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| Error::new(ErrorKind::Numeric, path.display(), format!("cannot be written: {e}")))?;
        let mut file = OutputFile::claim(path)?;
        file.write_all(text.as_bytes())?;
        file.commit()
    }
}
