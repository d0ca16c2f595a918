//! The checksum: SHA-256 of the file's text with the checksum's own value empty and line ends as `\n`.

use super::schema::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::files::mark::{checksum_value, sha256_hex, with_digest};

const HEADER: &str = "\
# Written by gyroid. SI units, the unit stands in each key.
# e(t) = c1 (1 - exp(-t / time_constant)) + c2, t from power-on; a sample's white noise is angle_random_walk / sqrt(sample time).
# [gyro.discrete]: e[k+1] = decay * e[k] + drive, e[0] = initial.
# The checksum covers every byte of this file. To edit by hand, delete [provenance]: the file is then read as unsigned.

";

/// Goes before the header where there is `[gyro.temperature]`.
const BY_TEMPERATURE: &str = "\
# By temperature: e = bias + sensitivity (temperature - reference) + curvature (temperature - reference)^2, see [gyro.temperature];
# by elapsed time, for what has no thermometer:
#
";

/// Serialises with a checksum where there is a `[provenance]` to hold it, else with a last line by which gyroid knows the file.
pub(super) fn write(config: &Config) -> Result<String> {
    let mut config = config.clone();
    if let Some(p) = &mut config.provenance {
        p.checksum = String::new();
    }
    let body = toml::to_string(&config).map_err(|e| {
        Error::new(ErrorKind::Config, "configuration", format!("cannot be written as TOML: {e}"))
            .hint("leave out what has no number")
    })?;
    let by_temperature = config.gyro.as_ref().is_some_and(|g| g.temperature.is_some());
    let text = if by_temperature { format!("{BY_TEMPERATURE}{HEADER}{body}") } else { format!("{HEADER}{body}") };
    let Some(at) = checksum_value(&text).filter(|_| config.provenance.is_some()) else {
        return Ok(with_digest(text));
    };
    let digest = sha256_hex(&text);
    Ok(format!("{}{digest}{}", &text[..at.start], &text[at.end..]))
}

/// Compares the file's checksum, if it has one, with its text.
pub(super) fn verify(text: &str, config: &Config, name: &str) -> Result<()> {
    let Some(provenance) = &config.provenance else { return Ok(()) };
    let text = text.replace("\r\n", "\n");
    let expected = checksum_value(&text).map(|at| sha256_hex(&format!("{}{}", &text[..at.start], &text[at.end..])));
    if expected.as_deref() == Some(provenance.checksum.as_str()) {
        return Ok(());
    }
    Err(Error::new(ErrorKind::Checksum, name, "the file was changed after gyroid wrote it: its checksum does not fit")
        .at("`provenance.checksum`")
        .hint("restore it, or, if the change was meant, delete the table [provenance]"))
}
