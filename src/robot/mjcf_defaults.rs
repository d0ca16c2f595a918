//! Attributes of MJCF elements, which default classes may give.

use super::xml::{Xml, child, children};
use crate::error::{ErrorKind, Result};
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::Node;
use std::collections::HashMap;

/// The default classes of a file, and what its `<compiler>` says of angles and inertias.
pub(super) struct Defaults<'a, 'i> {
    /// By name: the class's node, and the class that it refines.
    classes: HashMap<String, (Node<'a, 'i>, Option<String>)>,
    /// rad per unit of an angle.
    pub angle_rad: f64,
    euler_axes: String,
    /// Whether masses come from shapes even where they are given.
    pub inertia_from_geoms: bool,
    /// Whether a range alone makes limits.
    pub limits_follow_ranges: bool,
}

/// The class of all elements that name none.
const MAIN: &str = "main";

impl<'a, 'i> Defaults<'a, 'i> {
    pub(super) fn read(root: Node<'a, 'i>) -> Self {
        let compiler = |name: &str| children(root, "compiler").filter_map(|c| c.attribute(name)).last();
        let mut classes = HashMap::new();
        for node in children(root, "default") {
            Self::add(node, None, &mut classes);
        }
        Self {
            classes,
            angle_rad: if compiler("angle") == Some("radian") { 1.0 } else { 1f64.to_radians() },
            euler_axes: compiler("eulerseq").unwrap_or("xyz").to_string(),
            inertia_from_geoms: compiler("inertiafromgeom") == Some("true"),
            limits_follow_ranges: compiler("autolimits") != Some("false"),
        }
    }

    fn add(node: Node<'a, 'i>, parent: Option<&str>, into: &mut HashMap<String, (Node<'a, 'i>, Option<String>)>) {
        let name = node.attribute("class").unwrap_or(MAIN);
        into.insert(name.to_string(), (node, parent.map(String::from)));
        for nested in children(node, "default") {
            Self::add(nested, Some(name), into);
        }
    }

    /// An attribute of an element: its own, or that of its class, of the body's `class`, or of all.
    pub(super) fn attribute(&self, node: Node<'a, 'i>, name: &str, class: Option<&str>) -> Option<&'a str> {
        let kind = node.tag_name().name();
        // a free joint has no class
        if let Some(own) = node.attribute(name) {
            return Some(own);
        }
        let mut at = Some(node.attribute("class").or(class).unwrap_or(MAIN).to_string());
        for _ in 0..=self.classes.len() {
            let (class, parent) = self.classes.get(&at?)?;
            if let Some(found) = child(*class, kind).and_then(|element| element.attribute(name)) {
                return Some(found);
            }
            at = parent.clone();
        }
        None
    }

    /// Its numbers.
    pub(super) fn numbers<const N: usize>(
        &self,
        xml: &Xml,
        node: Node<'a, 'i>,
        name: &str,
        class: Option<&str>,
    ) -> Result<Option<[f64; N]>> {
        self.attribute(node, name, class).map(|text| xml.numbers(node, text)).transpose()
    }

    /// Pose of a body, geom or frame on its parent.
    pub(super) fn pose(&self, xml: &Xml, node: Node<'a, 'i>, class: Option<&str>) -> Result<Isometry3<f64>> {
        let position = self.numbers(xml, node, "pos", class)?.unwrap_or([0.0; 3]);
        Ok(Isometry3::from_parts(Translation3::from(position), self.orientation(xml, node, class)?))
    }

    fn orientation(&self, xml: &Xml, node: Node<'a, 'i>, class: Option<&str>) -> Result<UnitQuaternion<f64>> {
        let unit = |v: [f64; 3]| Unit::try_new(Vector3::from(v), 1e-12);
        if let Some([w, x, y, z]) = self.numbers(xml, node, "quat", class)? {
            return Ok(UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-12).unwrap_or_default());
        }
        if let Some([x, y, z, angle]) = self.numbers(xml, node, "axisangle", class)? {
            let about = unit([x, y, z]).unwrap_or_else(Vector3::z_axis);
            return Ok(UnitQuaternion::from_axis_angle(&about, angle * self.angle_rad));
        }
        if let Some(angles) = self.numbers::<3>(xml, node, "euler", class)? {
            let mut turn = UnitQuaternion::identity();
            for (axis, angle) in self.euler_axes.chars().zip(angles) {
                let about = match axis.to_ascii_lowercase() {
                    'x' => Vector3::x_axis(),
                    'y' => Vector3::y_axis(),
                    'z' => Vector3::z_axis(),
                    _ => {
                        return Err(crate::Error::new(
                            ErrorKind::Format,
                            xml.file,
                            format!("eulerseq {:?}", self.euler_axes),
                        )
                        .hint("expected three letters of x, y, z"));
                    }
                };
                let step = UnitQuaternion::from_axis_angle(&about, angle * self.angle_rad);
                // small letters turn about axes that turn along, capital letters about fixed ones
                turn = if axis.is_ascii_lowercase() { turn * step } else { step * turn };
            }
            return Ok(turn);
        }
        if let Some([a, b, c, d, e, f]) = self.numbers(xml, node, "xyaxes", class)? {
            let (x, y) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
            return Ok(UnitQuaternion::face_towards(&x.cross(&y), &y));
        }
        match self.numbers(xml, node, "zaxis", class)?.and_then(unit) {
            Some(z) => Ok(onto(&z)),
            None => Ok(UnitQuaternion::identity()),
        }
    }
}

/// The least turn that brings the z axis onto a direction.
pub(super) fn onto(direction: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), direction)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}
