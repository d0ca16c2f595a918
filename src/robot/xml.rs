//! Numbers of an XML document, and the places of what is wrong with them.

use crate::error::{Error, ErrorKind, Result};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use roxmltree::{Document, Node};
use std::fmt::Display;

/// A document and the name of its file.
pub(super) struct Xml<'a> {
    pub file: &'a str,
    pub doc: &'a Document<'a>,
    /// Empty lines before the document.
    pub skipped_rows: u32,
}

/// Marks text that xacro or a launch file would replace.
pub(super) fn is_placeholder(text: &str) -> bool {
    text.contains("${") || text.contains("$(")
}

impl Xml<'_> {
    /// The line of the file in which a node begins.
    pub(super) fn row(&self, node: Node) -> u32 {
        self.doc.text_pos_at(node.range().start).row + self.skipped_rows
    }

    /// Error at a node: file, line and tag, and what was found there.
    pub(super) fn error(&self, node: Node, found: impl Display) -> Error {
        let row = self.row(node);
        Error::new(ErrorKind::Format, self.file, found)
            .at(format!("line {row}, <{}>", node.tag_name().name()))
            .hint("correct the place, or write the file anew with the tool that it came from")
    }

    /// `N` numbers apart by spaces.
    pub(super) fn numbers<const N: usize>(&self, node: Node, text: &str) -> Result<[f64; N]> {
        let shown = text.trim();
        if is_placeholder(text) {
            return Err(self
                .error(node, format!("{shown:?} stands in the place of numbers"))
                .hint(format!("expand the macros first: {}", super::types::EXPAND)));
        }
        let numbers: Option<Vec<f64>> =
            text.split_whitespace().map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        numbers.and_then(|all| all.try_into().ok()).ok_or_else(|| {
            let wanted = if N == 1 { "a number".to_string() } else { format!("{N} numbers apart by spaces") };
            self.error(node, format!("{shown:?} is found")).hint(format!("expected {wanted}"))
        })
    }

    /// The same of an attribute, if it is there.
    pub(super) fn attribute<const N: usize>(&self, node: Node, name: &str) -> Result<Option<[f64; N]>> {
        node.attribute(name).map(|text| self.numbers(node, text)).transpose()
    }

    /// One number of an attribute, if it is there.
    pub(super) fn scalar(&self, node: Node, name: &str) -> Result<Option<f64>> {
        Ok(self.attribute(node, name)?.map(|[x]| x))
    }

    /// The same of a child's text, if it is there.
    pub(super) fn text<const N: usize>(&self, node: Node, name: &str) -> Result<Option<[f64; N]>> {
        child(node, name).map(|c| self.numbers(c, c.text().unwrap_or_default())).transpose()
    }

    /// One number of a child's text, if it is there.
    pub(super) fn text_scalar(&self, node: Node, name: &str) -> Result<Option<f64>> {
        Ok(self.text(node, name)?.map(|[x]| x))
    }

    /// An attribute that must be there.
    pub(super) fn required<'a>(&self, node: Node<'a, '_>, name: &str) -> Result<&'a str> {
        node.attribute(name).ok_or_else(|| self.error(node, format!("the attribute {name} is missing")))
    }
}

/// The first child element of that name.
pub(super) fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

/// All child elements of that name.
pub(super) fn children<'a, 'i>(node: Node<'a, 'i>, name: &str) -> impl Iterator<Item = Node<'a, 'i>> {
    let name = name.to_string();
    node.children().filter(move |c| c.is_element() && c.tag_name().name() == name)
}

/// The text of a child element, trimmed.
pub(super) fn child_text<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    child(node, name).and_then(|c| c.text()).map(str::trim)
}

/// Position in m, and roll, pitch and yaw about fixed axes in rad, as URDF and SDF have them.
pub(super) fn placed([x, y, z]: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}
