//! SDF 1.4 and later: models, alone or in a world.

use super::model::{ALONE, Form, Joint, Link, MOST_JOINTS, Mass, Model, Motion, Shape, symmetric, turned};
use super::plugin;
use super::xml::{Xml, child, child_text, children, placed};
use crate::error::Result;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

/// Models in models, and frames on frames, go no deeper than this in any real file.
const DEEPEST: usize = 50;
/// A hinge whose limits lie further from zero turns without end, rad.
const NO_LIMIT_RAD: f64 = 1e4;

/// Reads the models of an `<sdf>` that are not fixed to the world.
pub(super) fn read(xml: &Xml, root: Node) -> Result<Vec<Model>> {
    let version = root.attribute("version").unwrap_or("1.7");
    // until 1.4 an axis was given in the axes of the model
    let of_model = version.split('.').nth(1).and_then(|minor| minor.parse::<u32>().ok()).is_some_and(|m| m <= 4);
    let models = children(root, "world").flat_map(|w| children(w, "model")).chain(children(root, "model"));
    let moving = models.filter(|m| !plugin::is_static(*m));
    moving.map(|node| Reader { xml, of_model, node }.model(0)).collect()
}

/// One `<model>`.
struct Reader<'a, 'x, 'i> {
    xml: &'a Xml<'x>,
    of_model: bool,
    node: Node<'a, 'i>,
}

impl Reader<'_, '_, '_> {
    fn model(&self, depth: usize) -> Result<Model> {
        if depth > DEEPEST {
            return Err(self.xml.error(self.node, "models lie in models too deep"));
        }
        let mut model = Model { name: self.node.attribute("name").unwrap_or("model").into(), ..Model::default() };
        if let Some(node) = children(self.node, "link").nth(MOST_JOINTS) {
            return Err(self.xml.error(node, format!("more than {MOST_JOINTS} links")).hint(ALONE));
        }
        for node in children(self.node, "link") {
            model.links.push(self.link(node)?);
        }
        for node in children(self.node, "model") {
            let nested = Reader { node, ..*self }.model(depth + 1)?.moved(&self.own_pose(node)?);
            let (first, prefix) = (model.links.len(), nested.name.clone());
            let named = |name: &str| format!("{prefix}::{name}");
            model.links.extend(nested.links.into_iter().map(|l| Link { name: named(&l.name), ..l }));
            model.joints.extend(nested.joints.into_iter().map(|j| Joint {
                name: named(&j.name),
                parent: j.parent.map(|p| p + first),
                child: j.child + first,
                ..j
            }));
        }
        let includes: Vec<&str> =
            children(self.node, "include").map(|i| child_text(i, "uri").unwrap_or("a model")).collect();
        if !includes.is_empty() {
            model.notes.push(format!("not read, for it is another file: {}", includes.join(", ")));
        }
        for node in children(self.node, "joint") {
            let joint = self.joint(node, &model)?;
            model.joints.extend(joint);
        }
        if model.joints.len() > MOST_JOINTS {
            return Err(self.xml.error(self.node, format!("more than {MOST_JOINTS} joints")).hint(ALONE));
        }
        plugin::read(self.xml, self.node, &mut model)?;
        Ok(model)
    }

    /// The pose of an element in the frame of the element it is relative to, whatever that is.
    fn own_pose(&self, node: Node) -> Result<Isometry3<f64>> {
        let Some(pose) = child(node, "pose") else { return Ok(Isometry3::identity()) };
        let text = pose.text().unwrap_or_default();
        if text.trim().is_empty() {
            return Ok(Isometry3::identity());
        }
        if pose.attribute("rotation_format") == Some("quat_xyzw") {
            let [x, y, z, i, j, k, w] = self.xml.numbers(pose, text)?;
            let turn = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-9);
            return Ok(Isometry3::from_parts(Translation3::new(x, y, z), turn.unwrap_or_default()));
        }
        let [x, y, z, a, b, c] = self.xml.numbers(pose, text)?;
        let unit = if pose.attribute("degrees") == Some("true") { 1f64.to_radians() } else { 1.0 };
        Ok(placed([x, y, z], [a * unit, b * unit, c * unit]))
    }

    /// The pose of a link, joint or frame in the model's frame; `usual` is what it is relative to where it does not say.
    fn pose(&self, node: Node, usual: Option<&str>, depth: usize) -> Result<Isometry3<f64>> {
        if depth > DEEPEST {
            return Err(self.xml.error(node, "frames are placed relative to each other in a circle"));
        }
        let relative = child(node, "pose").and_then(|p| p.attribute("relative_to")).filter(|name| !name.is_empty());
        let base = match relative.or(usual) {
            None | Some("__model__") => Isometry3::identity(),
            Some(name) => self.frame(node, name, depth + 1)?,
        };
        Ok(base * self.own_pose(node)?)
    }

    /// The pose of a link, joint or frame by name.
    fn frame(&self, from: Node, name: &str, depth: usize) -> Result<Isometry3<f64>> {
        if let Some((model, rest)) = name.split_once("::")
            && let Some(node) = children(self.node, "model").find(|m| m.attribute("name") == Some(model))
        {
            return Ok(self.own_pose(node)? * Reader { node, ..*self }.frame(from, rest, depth)?);
        }
        let is = |n: &Node| n.is_element() && n.attribute("name") == Some(name);
        let Some(node) = self.node.children().find(is) else {
            return Err(self.xml.error(from, format!("there is no link, joint or frame {name}")));
        };
        let usual = match node.tag_name().name() {
            "joint" => child_text(node, "child"),
            "frame" => node.attribute("attached_to").filter(|name| !name.is_empty()),
            _ => None,
        };
        self.pose(node, usual, depth)
    }

    fn link(&self, node: Node) -> Result<Link> {
        let pose = self.pose(node, None, 0)?;
        let mut shapes = Vec::new();
        for (element, collides) in [("collision", true), ("visual", false)] {
            for node in children(node, element) {
                let form = child(node, "geometry").map_or(Ok(Form::Other), |g| self.form(g))?;
                shapes.push(Shape { form, pose: pose * self.own_pose(node)?, collides });
            }
        }
        let mass = child(node, "inertial").map_or(Ok(Mass::None), |inertial| self.mass(inertial, &pose))?;
        Ok(Link { name: self.xml.required(node, "name")?.into(), pose, mass, shapes })
    }

    fn mass(&self, node: Node, link: &Isometry3<f64>) -> Result<Mass> {
        if matches!(node.attribute("auto"), Some("true" | "1")) {
            return Ok(Mass::NotTold("Gazebo takes it from shapes and densities (<inertial auto>)".into()));
        }
        let Some(kg) = self.xml.text_scalar(node, "mass")? else {
            return Ok(Mass::NotTold("its <inertial> has no mass".into()));
        };
        let pose = link * self.own_pose(node)?;
        let mut elements = [0.0; 6];
        if let Some(inertia) = child(node, "inertia") {
            for (element, name) in elements.iter_mut().zip(["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]) {
                *element = self.xml.text_scalar(inertia, name)?.unwrap_or(0.0);
            }
        }
        let inertia = turned(&symmetric(elements), &pose.rotation);
        Ok(Mass::Known { kg, at: pose * Point3::origin(), inertia })
    }

    fn form(&self, geometry: Node) -> Result<Form> {
        let Some(node) = geometry.children().find(Node::is_element) else { return Ok(Form::Other) };
        let length = |name: &str| -> Result<f64> { Ok(self.xml.text_scalar(node, name)?.unwrap_or(0.0)) };
        Ok(match node.tag_name().name() {
            "cylinder" => Form::Cylinder { radius: length("radius")?, length: length("length")? },
            "capsule" => Form::Capsule { radius: length("radius")?, length: length("length")? },
            "sphere" => Form::Sphere { radius: length("radius")? },
            "box" => Form::Box(self.xml.text(node, "size")?.unwrap_or_default()),
            "ellipsoid" => Form::Ellipsoid(self.xml.text(node, "radii")?.unwrap_or_default()),
            _ => Form::Other,
        })
    }

    /// `None` where the child lies in a model that was not read.
    fn joint(&self, node: Node, model: &Model) -> Result<Option<Joint>> {
        let name = self.xml.required(node, "name")?;
        let link = |name: &str| model.links.iter().position(|l| l.name == name);
        let Some(own) = child_text(node, "child") else {
            return Err(self.xml.error(node, "<child> is missing"));
        };
        let Some(index) = link(own) else {
            let elsewhere = !model.notes.is_empty() || own.contains("::");
            let error = self.xml.error(node, format!("there is no link {own}"));
            return if elsewhere { Ok(None) } else { Err(error) };
        };
        let pose = if own.contains("::") {
            model.links[index].pose * self.own_pose(node)?
        } else {
            self.pose(node, Some(own), 0)?
        };
        let axis = child(node, "axis");
        let xyz = axis.and_then(|a| child(a, "xyz"));
        let direction =
            Vector3::from(xyz.map_or(Ok([0.0, 0.0, 1.0]), |x| self.xml.numbers(x, x.text().unwrap_or_default()))?);
        let in_model = self.of_model
            || axis.and_then(|a| child_text(a, "use_parent_model_frame")).is_some_and(|t| matches!(t, "1" | "true"));
        let direction = match xyz.and_then(|x| x.attribute("expressed_in")).filter(|name| !name.is_empty()) {
            Some("__model__") => direction,
            Some(frame) => self.frame(node, frame, 0)? * direction,
            None if in_model => direction,
            None => pose * direction,
        };
        let limit = axis.and_then(|a| child(a, "limit"));
        let end = |name: &str| -> Result<bool> {
            let found = limit.and_then(|l| child(l, name));
            // Gazebo writes ±1e16, ±1.8e308 or ±inf for none
            Ok(found.and_then(|l| l.text()?.trim().parse().ok()).is_none_or(|x: f64| x.abs() > NO_LIMIT_RAD))
        };
        let motion = match node.attribute("type") {
            Some("continuous") => Motion::Spinning,
            Some("revolute") if end("lower")? && end("upper")? => Motion::Spinning,
            Some("revolute") => Motion::Turning,
            Some("fixed") => Motion::Fixed,
            _ => Motion::Other,
        };
        let dynamics = axis.and_then(|a| child(a, "dynamics"));
        Ok(Some(Joint {
            name: name.into(),
            parent: child_text(node, "parent").and_then(link),
            child: index,
            motion,
            axis: direction.try_normalize(0.0).unwrap_or_else(Vector3::z),
            at: pose * Point3::origin(),
            damping: dynamics.map(|d| self.xml.text_scalar(d, "damping")).transpose()?.flatten(),
            armature: None,
            driven: false,
        }))
    }
}
