//! Floor 2: the configuration file, schema 1. The fit writes it; filter, simulator and gap read it.
//!
//! TOML, SI, the unit in the key. Unknown keys, missing keys, unphysical values, another schema and a changed file
//! are refused by name. The checksum in `[provenance]` covers every byte but itself (line ends aside); a file
//! without `[provenance]` was written by hand and is *unsigned*: accepted, and said so.

mod acts_on;
mod check;
mod custom;
mod keys;
mod law;
mod noise;
mod schema;
mod seal;
mod temperature;

pub use acts_on::ActsOn;
pub use custom::{CustomEffect, CustomParameter, OWN};
pub use law::{Law, Signal};
pub use noise::{GaussMarkovTerm, NarrowBand, Noise, NoiseTerm, NoiseTerms};
pub use schema::{
    Config, Covariance, EffectTable, Encoder, Gyro, Kind, LastRun, NoiseProvenance, Pose, Provenance, Steering,
    Traction, Validation, Vehicle,
};
pub use temperature::{Temperature, TemperatureCovariance};

use crate::error::{Error, ErrorKind, Result};
use std::path::Path;

/// The schema that this version reads and writes.
pub const SCHEMA: i64 = 1;

impl Config {
    /// Reads and checks a configuration with `[gyro]`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`], [`ErrorKind::Config`] or [`ErrorKind::Checksum`], with file, line and key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let (config, name) = read_text(path.as_ref())?;
        let config = Self::parse(&config, &name)?;
        if config.gyro.is_none() {
            return Err(Error::new(ErrorKind::Config, name, "the table [gyro] is missing")
                .hint("make one with: gyroid fit LOG --base THIS_FILE -o CONFIG"));
        }
        Ok(config)
    }

    /// Reads a base for `fit`: the same file, where `[gyro]` may be missing.
    ///
    /// # Errors
    /// As [`Config::read`].
    pub fn read_base(path: impl AsRef<Path>) -> Result<Self> {
        let (text, name) = read_text(path.as_ref())?;
        Self::parse(&text, &name)
    }

    /// Reads a configuration from `text`; `name` is the file's name in messages.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] or [`ErrorKind::Checksum`].
    pub fn parse(text: &str, name: &str) -> Result<Self> {
        // schema first: the keys of another schema would only confuse
        let table: toml::Table = text.parse().map_err(|e| schema::toml_error(&e, text, name))?;
        match table.get("schema") {
            Some(toml::Value::Integer(SCHEMA)) => {}
            Some(other) => {
                let found = format!("schema {other}, and this version reads schema {SCHEMA}");
                return Err(Error::new(ErrorKind::Config, name, found)
                    .at("schema")
                    .hint("use the gyroid that wrote it"));
            }
            None => {
                return Err(Error::new(ErrorKind::Config, name, "the key is missing")
                    .at("schema")
                    .hint(format!("add: schema = {SCHEMA}")));
            }
        }
        keys::complete(&table, name)?;
        let config: Self = toml::from_str(text).map_err(|e| schema::toml_error(&e, text, name))?;
        seal::verify(text, &config, name)?;
        check::physical(&config, name)?;
        Ok(config)
    }

    /// Whether the file carries a checksum (files written by hand do not).
    #[must_use]
    pub fn is_signed(&self) -> bool {
        self.provenance.is_some()
    }

    /// The file's text; with `[provenance]` present, its checksum is made anew.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if a value is unphysical or cannot be written.
    pub fn to_toml(&self) -> Result<String> {
        check::physical(self, "configuration")?;
        seal::write(self)
    }

    /// The configuration after a run that left the gyro's warm-up at the age `warm_up_age_s` (see [`LastRun`]).
    ///
    /// # Errors
    /// [`ErrorKind::Config`] without `[gyro]`.
    pub fn after_run(mut self, warm_up_age_s: f64) -> Result<Self> {
        let gyro = self.gyro.as_mut().ok_or_else(|| missing_table("gyro"))?;
        gyro.last_run = Some(LastRun { warm_up_age_s });
        Ok(self)
    }

    /// `[gyro]`, which [`Config::read`] guarantees.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if it is missing.
    pub fn require_gyro(&self) -> Result<&Gyro> {
        self.gyro.as_ref().ok_or_else(|| missing_table("gyro"))
    }

    /// The same without `[gyro.temperature]`, for users of the warm-up by elapsed time alone, and a note where the
    /// table was there.
    #[must_use]
    pub(crate) fn by_elapsed_time(mut self) -> (Self, Option<String>) {
        let table = self.gyro.as_mut().and_then(|g| g.temperature.take());
        let note = "[gyro.temperature] is not used here: the gyro warms up by elapsed time, as c1_rad_s, c2_rad_s and \
                    time_constant_s of the same file say";
        (self, table.map(|_| note.to_string()))
    }

    /// The same robot, carrying `load_kg` more ([`Vehicle::load_kg`]).
    #[must_use]
    pub fn carrying(&self, load_kg: f64) -> Self {
        let vehicle = self.vehicle.map(|v| Vehicle { load_kg: v.load_kg + load_kg, ..v });
        Self { vehicle, ..self.clone() }
    }

    /// `[vehicle]`.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if it is missing; [`ErrorKind::Value`] if its load is no mass.
    pub fn require_vehicle(&self) -> Result<&Vehicle> {
        let vehicle = self.vehicle.as_ref().ok_or_else(|| missing_table("vehicle"))?;
        if !(vehicle.load_kg.is_finite() && vehicle.load_kg >= 0.0) {
            let found = format!("a load of {} kg is no mass", vehicle.load_kg);
            return Err(Error::new(ErrorKind::Value, "load", found).hint("give the weighed load in kg, zero or more"));
        }
        Ok(vehicle)
    }

    /// `[traction]`.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if it is missing.
    pub(crate) fn require_traction(&self) -> Result<&Traction> {
        self.traction.as_ref().ok_or_else(|| missing_table("traction"))
    }

    /// `[encoder]`.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if it is missing.
    pub fn require_encoder(&self) -> Result<&Encoder> {
        self.encoder.as_ref().ok_or_else(|| missing_table("encoder"))
    }
}

fn missing_table(table: &str) -> Error {
    Error::new(ErrorKind::Config, "configuration", format!("the table [{table}] is missing"))
        .hint("fit with --base ROBOT.toml, which brings it, or add it by hand")
}

fn read_text(path: &Path) -> Result<(String, String)> {
    let name = path.display().to_string();
    let bytes = crate::files::memory::read(path).map_err(|e| Error::io(path, &e))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        Error::new(ErrorKind::Config, &name, "is not UTF-8 text")
            .at(format!("byte {at}"))
            .hint("save it as UTF-8, or write the file anew with gyroid fit")
    })?;
    Ok((text, name))
}

#[cfg(test)]
mod tests;
