//! Export targets: another program, the file that it reads, and the keys that a gyro's configuration can fill.

use super::about::{About, Comment};
use super::sheet::{LeftOut, Sheet, Written};
use super::source::Source;
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::Axis;
use serde_json::{Value, json};

/// Advice on the warm-up for a filter, whether its bias is a state or not.
pub(super) const SUBTRACT: &str =
    "subtract it before the filter (gyroid navigate does), or wait for three time constants";

/// A program that reads the results of a fit of a gyro.
pub trait Target: Sync + Send {
    /// Description of the target.
    fn about(&self) -> &'static About;

    /// Line at the very beginning of the file, before any comment; `None` where the format needs none.
    fn first_line(&self) -> Option<&'static str> {
        None
    }

    /// Fills the file.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] where the configuration cannot support the file at all.
    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()>;
}

/// A finished export.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// The target's name.
    pub target: &'static str,
    /// The file.
    pub text: String,
    /// The numbers in it.
    pub written: Vec<Written>,
    /// The keys that are not in it.
    pub left_out: Vec<LeftOut>,
    /// Notes for the user on the file.
    pub notes: Vec<String>,
    /// Axis of the target that the numbers belong to.
    pub axis: Axis,
    /// Whether that axis is an assumption.
    pub axis_assumed: bool,
}

/// Exports a configuration to a target.
///
/// # Errors
/// [`ErrorKind::Config`] if the model failed its validation (and [`super::Options::accept`] is not set), or if the
/// configuration cannot support the file.
pub fn export(target: &dyn Target, source: &Source<'_>) -> Result<Export> {
    if let Some(why) = source.failed().filter(|_| !source.options.accept) {
        return Err(Error::new(ErrorKind::Config, &source.origin.file, format!("the model is not fit for use: {why}"))
            .at("[validation]")
            .hint("record longer or look into the residuals; --accept exports it all the same"));
    }
    let about = target.about();
    let mut sheet = Sheet::new(about);
    head(about, source, &mut sheet);
    target.fill(source, &mut sheet)?;
    source.left_out().iter().for_each(|text| sheet.note(text));
    let (body, written, left_out, notes) = sheet.into_parts();
    let text = target.first_line().map_or_else(String::new, |line| format!("{line}\n")) + &body;
    let (axis, axis_assumed) = source.axis();
    Ok(Export { target: about.id, text, written, left_out, notes, axis, axis_assumed })
}

/// Writes the lines above the numbers: program, provenance, validation, axis, convention.
fn head(about: &About, source: &Source<'_>, sheet: &mut Sheet) {
    let (config, origin) = (source.config, source.origin);
    sheet.comment(&format!("{} ({}), written by gyroid {}", about.program, about.file, origin.version));
    sheet.comment(&format!("command: {}", origin.command));
    let signed = if config.is_signed() { "" } else { ", unsigned (written or changed by hand)" };
    sheet.comment(&format!("configuration: {}, sha256 {}{signed}", origin.file, origin.sha256));
    if let Some(p) = &config.provenance {
        let column = if p.column.is_empty() { String::new() } else { format!(", column {}", p.column) };
        sheet.comment(&format!("log: {}{column}, sha256 {}", p.log, p.log_sha256));
        sheet.comment(&format!("fitted by gyroid {}: {}", p.gyroid_version, p.command));
        if let Some(n) = &p.noise {
            sheet.comment(&format!("noise terms: {}, sha256 {}", n.log, n.log_sha256));
            sheet.comment(&format!("identified by gyroid {}: {}", n.gyroid_version, n.command));
        }
    }
    match (&config.validation, source.failed()) {
        (None, _) => sheet.note("the model was not tested on any log: the configuration has no [validation]"),
        (Some(_), Some(why)) => sheet.note(format!("NOT FIT FOR USE, exported with --accept: {why}")),
        (Some(v), None) => {
            let temperatures = match (v.valid_from_temperature_c, v.valid_to_temperature_c) {
                (Some(low), Some(high)) => format!(", {low:.1} to {high:.1} degC"),
                _ => String::new(),
            };
            sheet.comment(&format!(
                "tested on {} samples at {:.4} Hz: residuals white (joint p = {:.3}); valid from {:.0} to {:.0} s since \
                 power-on{temperatures}",
                v.samples, v.sample_rate_hz, v.joint_p_value, v.valid_from_s, v.valid_to_s
            ));
        }
    }
    if let Some(v) = &config.validation {
        sheet.comment(&format!(
            "N is from samples at {:.4} Hz: it holds at any rate if a sample is the mean since the last one; a log \
             thinned out without averaging overstates it by the root of the thinning",
            v.sample_rate_hz
        ));
    }
    let (axis, assumed) = source.axis();
    let why = if assumed { "assumed, because no column says which (--axis)" } else { "the one that was fitted" };
    sheet.note(format!("axis {axis}: {why}; where a number serves all axes, the others are assumed to be like it",));
    sheet.comment(&format!("known: {}", source.terms_text()));
    sheet.comment(&format!("convention: {}", about.convention));
    sheet.comment(&format!("source: {}", about.source));
    if about.comment == Comment::Xml {
        sheet.comment("XML allows no double hyphen in a comment: each is written with a space in between");
    }
    sheet.note(
        "identified at rest: vibration, scale factor and timing errors of a moving robot are not in these numbers; \
         no filter should assume less",
    );
    source.effects.iter().for_each(|text| sheet.note(text));
    let g = &source.gyro;
    if let Some(cutoff_hz) = g.noise.as_ref().and_then(|n| n.bandwidth_cutoff_hz) {
        sheet.note(format!(
            "N is that of the plateau below the sensor's low-pass, half power at {cutoff_hz:.4e} Hz: it is what a filter needs; \
             samples faster than that scatter less, and are correlated"
        ));
    }
    for band in g.noise.iter().flat_map(|n| &n.narrow_band) {
        sheet.note(format!(
            "a vibration of {:.3e} rad/s at {:.4} Hz, {:.3} Hz wide, was in the log: N is without it",
            band.std_rad_s, band.center_hz, band.bandwidth_hz
        ));
    }
    if g.c1_rad_s != 0.0 {
        sheet.note(format!(
            "the bias warms up: e(t) = {:.6e} (1 - exp(-t / {:.6e} s)) + {:.6e} rad/s, t from power-on; {}",
            g.c1_rad_s, g.time_constant_s, g.c2_rad_s, about.warm_up
        ));
    }
    sheet.line("");
}

impl Export {
    /// The stable form: `target`; `axis` and whether it is assumed; `keys`, each `{"key", "value", "unit", "meaning",
    /// "ci95"}` with the value as the file holds it (an array where the key is one) and the interval in the same unit, null
    /// where it is not known or not bounded; `left_out`, each `{"key", "why", "hint"}`; `notes`; `text`, the file itself.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "target": self.target,
            "axis": self.axis,
            "axis_assumed": self.axis_assumed,
            "keys": self.written.iter().map(Written::json).collect::<Vec<_>>(),
            "left_out": self.left_out.iter().map(LeftOut::json).collect::<Vec<_>>(),
            "notes": self.notes,
            "text": self.text,
        })
    }
}
