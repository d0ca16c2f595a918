//! Several axes of one log: a section each in the text, an entry each in the JSON.

use super::log_args::{LogArgs, LogRead};
use super::outcome::Outcome;
use super::output::Output;
use gyroid::{Error, ErrorKind, Result};
use serde_json::{Map, Value, json};

/// Result of a command for one axis: text, JSON, and whether it is fit for use.
pub(crate) struct Section {
    pub text: String,
    pub json: Value,
    /// Whether it is fit for use, or accepted.
    pub fit: bool,
}

/// Refuses options that write a file of one axis; each comes with whether it was given.
pub(crate) fn refuse(options: &[(&str, bool)]) -> Result<()> {
    match options.iter().find(|(_, given)| *given) {
        Some((option, _)) => Err(Error::new(ErrorKind::Usage, option, "is of one axis, and several are named")
            .hint("name the one: --axis z (a navigation filter takes the yaw axis)")),
        None => Ok(()),
    }
}

/// Reads the log once for all its axes, and reports the `section` of each.
pub(crate) fn each(
    log: &LogArgs,
    output: Output,
    doing: &'static str,
    mut section: impl FnMut(&LogRead) -> Result<Section>,
) -> Result<Outcome> {
    let working = output.working("reading the log");
    let read = log.read_axes(&working)?;
    drop(working);
    let mut all = Map::new();
    let mut fit = true;
    // each axis is given back before the next is looked at
    for (axis, read) in log.axes().iter().zip(read) {
        let working = output.working(doing);
        let done = section(&read)?;
        drop(working);
        output.say(format!("axis {axis}: {}", done.text));
        fit &= done.fit;
        all.insert(axis.to_string(), done.json);
    }
    output.finish(&json!({ "axes": all, "fit_for_use": fit }))?;
    Ok(if fit { Outcome::Done } else { Outcome::Unfit })
}
