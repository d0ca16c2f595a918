//! A description, from its file to the robot.

use super::model::Model;
use super::types::{Choice, EXPAND, Format, Robot};
use super::{facts, mjcf, sdf, urdf, wheels, xml};
use crate::error::{Error, ErrorKind, Result, one_of};
use roxmltree::{Document, Node};
use std::path::Path;

/// Reads the description at `path`.
///
/// # Errors
/// [`ErrorKind::Io`]; [`ErrorKind::Format`] for another kind of file, and for what cannot be read in it, with its line;
/// [`ErrorKind::Value`] where it has no driven wheels, or several readings are possible.
pub(crate) fn read(path: impl AsRef<Path>, format: Format, choice: &Choice) -> Result<Robot> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, &e))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| Error::new(ErrorKind::Format, &file, "is not text").hint("give a file of XML"))?;
    parse(&text, &file, format, choice)
}

/// Reads a description from its text; `file` is the file's name in messages.
///
/// # Errors
/// As [`read`], but for the reading of the file.
pub(crate) fn parse(text: &str, file: &str, format: Format, choice: &Choice) -> Result<Robot> {
    let (doc, skipped_rows) = opened(text, file)?;
    let models = models(&xml::Xml { file, doc: &doc, skipped_rows }, doc.root_element(), format)?;
    let (model, wheels) = choose(&models, file, choice)?;
    Ok(facts::robot(model, &wheels, file, format))
}

/// The document of a text, and the number of empty lines before it, which some begin with and XML does not allow.
pub(super) fn opened<'a>(text: &'a str, file: &str) -> Result<(Document<'a>, u32)> {
    let whole = text.trim_start_matches('\u{feff}');
    let text = whole.trim_start();
    let skipped_rows = whole[..whole.len() - text.len()].matches('\n').count() as u32;
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let doc = Document::parse_with_options(text, options).map_err(|e| {
        if text.contains("<xacro:") {
            return Error::new(ErrorKind::Format, file, "holds xacro macros, which are not expanded here")
                .hint(format!("expand them first: {EXPAND}"));
        }
        Error::new(ErrorKind::Format, file, format!("is no XML: {e}"))
            .hint("correct the place, or write the file anew with the tool that it came from")
    })?;
    Ok((doc, skipped_rows))
}

/// The robots of a document in that format.
pub(super) fn models(xml: &xml::Xml, root: Node, format: Format) -> Result<Vec<Model>> {
    let error = |found: String| Error::new(ErrorKind::Format, xml.file, found);
    let tag = root.tag_name().name();
    match Format::of(tag) {
        Some(found) if found == format => {}
        Some(found) => {
            return Err(error(format!("is {found} (<{tag}>), not {format}")).hint(format!(
                "give it with {} {}",
                found.option(),
                xml.file
            )));
        }
        None => {
            let hint = match tag {
                "mujocoinclude" => "it is a part of a model: give the file with <mujoco>, the parts put into it".into(),
                "launch" => "it is a launch file: give the description that it loads".to_string(),
                _ => format!(
                    "{format} begins with <{}>",
                    match format {
                        Format::Urdf => "robot",
                        Format::Sdf => "sdf",
                        Format::Mjcf => "mujoco",
                    }
                ),
            };
            return Err(error(format!("begins with <{tag}>: that is no description of a robot")).hint(hint));
        }
    }
    Ok(match format {
        Format::Urdf => vec![urdf::read(xml, root)?],
        Format::Sdf => sdf::read(xml, root)?,
        Format::Mjcf => mjcf::read(xml, root)?,
    })
}

/// The robot that is asked for, or the only one with driven wheels.
pub(super) fn choose<'a>(models: &'a [Model], file: &str, choice: &Choice) -> Result<(&'a Model, wheels::Wheels)> {
    let error = |found: String| Error::new(ErrorKind::Value, file, found);
    if let Some(name) = &choice.model {
        let names: Vec<&str> = models.iter().map(|m| m.name.as_str()).collect();
        let model = models.iter().find(|m| m.name == *name);
        let model = model.ok_or_else(|| error(format!("has no robot {name}")).hint(one_of(name, &names)))?;
        return Ok((model, wheels::find(model, file, choice)?));
    }
    let found: Vec<_> = models.iter().map(|m| (m, wheels::find(m, file, choice))).collect();
    let names: Vec<&str> = found.iter().filter(|(_, w)| w.is_ok()).map(|(m, _)| m.name.as_str()).collect();
    if names.len() > 1 {
        return Err(error(format!("holds {} robots with driven wheels: {}", names.len(), names.join(", ")))
            .hint(format!("name one: --model {}", names[0])));
    }
    // of several, what stands around is not what the user means
    let best =
        found.into_iter().min_by_key(|(m, w)| (w.is_err(), m.joints.is_empty(), std::cmp::Reverse(m.links.len())));
    match best {
        Some((model, wheels)) => Ok((model, wheels?)),
        None => Err(error("holds no robot that could move".into())
            .hint("give the description of the robot itself, not that of the world around it")),
    }
}
