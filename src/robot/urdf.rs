//! URDF, with Gazebo's additions.

use super::model::{ALONE, Form, Joint, Link, MOST_JOINTS, Mass, Model, Motion, Shape, symmetric, turned};
use super::plugin;
use super::xml::{Xml, child, children, is_placeholder, placed};
use crate::error::Result;
use nalgebra::{Isometry3, Point3, Vector3};
use roxmltree::Node;
use std::collections::{BTreeSet, HashMap};

/// Reads the robot of a `<robot>`.
pub(super) fn read(xml: &Xml, root: Node) -> Result<Model> {
    let macros = |n: &Node| n.tag_name().namespace().is_some_and(|space| space.contains("xacro"));
    if let Some(found) = root.descendants().find(|n| n.is_element() && macros(n)) {
        return Err(xml
            .error(found, "is a xacro macro: xacro is not expanded here")
            .hint(format!("expand it first: {}", super::types::EXPAND)));
    }
    let mut model = Model { name: root.attribute("name").unwrap_or("robot").into(), ..Model::default() };
    let mut index = HashMap::new();
    for node in children(root, "link") {
        let name = xml.required(node, "name")?;
        if index.insert(name, model.links.len()).is_some() {
            return Err(xml.error(node, format!("the name {name} is given twice")).hint("give each link its own name"));
        }
        model.links.push(link(xml, node, name)?);
    }
    if let Some(node) = children(root, "joint").nth(MOST_JOINTS) {
        return Err(xml.error(node, format!("more than {MOST_JOINTS} joints")).hint(ALONE));
    }
    let mut unplaced = Vec::new();
    for node in children(root, "joint") {
        let found = |name: &str| -> Result<usize> {
            let end = child(node, name).ok_or_else(|| xml.error(node, format!("<{name}> is missing")))?;
            let link = xml.required(end, "link")?;
            index.get(link).copied().ok_or_else(|| xml.error(end, format!("there is no link {link}")))
        };
        let (parent, own) = (found("parent")?, found("child")?);
        let origin = child(node, "origin");
        let pose = match origin {
            Some(o) if o.attributes().any(|a| is_placeholder(a.value())) => {
                unplaced.push((model.joints.len(), o));
                Isometry3::identity()
            }
            _ => self::origin(xml, origin)?,
        };
        let axis = child(node, "axis").map(|a| xml.attribute(a, "xyz")).transpose()?.flatten();
        let motion = match node.attribute("type") {
            Some("continuous") => Motion::Spinning,
            Some("revolute") => Motion::Turning,
            Some("fixed") => Motion::Fixed,
            _ => Motion::Other,
        };
        let dynamics = child(node, "dynamics");
        model.links[own].pose = pose;
        model.joints.push(Joint {
            name: xml.required(node, "name")?.into(),
            parent: Some(parent),
            child: own,
            motion,
            axis: Vector3::from(axis.unwrap_or([1.0, 0.0, 0.0])),
            at: Point3::origin(),
            damping: dynamics.map(|d| xml.scalar(d, "damping")).transpose()?.flatten(),
            armature: None,
            driven: false,
        });
    }
    let driven = plugin::driven(root);
    model.joints.iter_mut().for_each(|j| j.driven = driven.contains(&j.name.as_str()));
    place(&mut model);
    // a sensor's place does not matter here, that of a mass does
    let weighs = |j: &usize| !matches!(model.links[model.joints[*j].child].mass, Mass::None);
    let all = if unplaced.is_empty() { 0 } else { model.joints.len() };
    let carrying: BTreeSet<usize> =
        (0..all).filter(weighs).flat_map(|j| model.ancestors(j).into_iter().chain([j])).collect();
    for (joint, origin) in unplaced {
        if carrying.contains(&joint) {
            return Err(xml
                .error(origin, format!("the place of {} is not expanded", model.joints[joint].name))
                .hint(format!("expand the macros first: {}", super::types::EXPAND)));
        }
    }
    children(root, "gazebo").try_for_each(|node| plugin::read(xml, node, &mut model))?;
    Ok(model)
}

/// Position and orientation of an `<origin>`.
fn origin(xml: &Xml, node: Option<Node>) -> Result<Isometry3<f64>> {
    let Some(node) = node else { return Ok(Isometry3::identity()) };
    let (xyz, rpy) = (xml.attribute(node, "xyz")?, xml.attribute(node, "rpy")?);
    Ok(placed(xyz.unwrap_or_default(), rpy.unwrap_or_default()))
}

/// A link in its own frame.
fn link(xml: &Xml, node: Node, name: &str) -> Result<Link> {
    let mut shapes = Vec::new();
    for (element, collides) in [("collision", true), ("visual", false)] {
        for node in children(node, element) {
            let pose = origin(xml, child(node, "origin"))?;
            let form = child(node, "geometry").map_or(Ok(Form::Other), |g| form(xml, g))?;
            shapes.push(Shape { form, pose, collides });
        }
    }
    let mass = match child(node, "inertial") {
        None => Mass::None,
        Some(inertial) => mass(xml, inertial)?,
    };
    Ok(Link { name: name.into(), pose: Isometry3::identity(), mass, shapes })
}

fn mass(xml: &Xml, inertial: Node) -> Result<Mass> {
    let pose = origin(xml, child(inertial, "origin"))?;
    let kg = child(inertial, "mass").map(|m| xml.scalar(m, "value")).transpose()?.flatten();
    let Some(kg) = kg else { return Ok(Mass::NotTold("its <inertial> has no mass".into())) };
    let of = |node: Node, name: &str| -> Result<f64> { Ok(xml.scalar(node, name)?.unwrap_or(0.0)) };
    let elements = child(inertial, "inertia")
        .map(|i| -> Result<[f64; 6]> {
            Ok([of(i, "ixx")?, of(i, "ixy")?, of(i, "ixz")?, of(i, "iyy")?, of(i, "iyz")?, of(i, "izz")?])
        })
        .transpose()?;
    let inertia = turned(&symmetric(elements.unwrap_or_default()), &pose.rotation);
    Ok(Mass::Known { kg, at: pose * Point3::origin(), inertia })
}

fn form(xml: &Xml, geometry: Node) -> Result<Form> {
    let Some(node) = geometry.children().find(Node::is_element) else { return Ok(Form::Other) };
    let length = |name: &str| -> Result<f64> { Ok(xml.scalar(node, name)?.unwrap_or(0.0)) };
    Ok(match node.tag_name().name() {
        "cylinder" => Form::Cylinder { radius: length("radius")?, length: length("length")? },
        "capsule" => Form::Capsule { radius: length("radius")?, length: length("length")? },
        "sphere" => Form::Sphere { radius: length("radius")? },
        "box" => Form::Box(xml.attribute(node, "size")?.unwrap_or_default()),
        _ => Form::Other,
    })
}

/// Moves links and joints, which know their place on their parent, into the frame of the root.
fn place(model: &mut Model) {
    let own: Vec<Isometry3<f64>> = model.links.iter().map(|l| l.pose).collect();
    for joint in 0..model.joints.len() {
        let at = model.joints[joint].child;
        // outermost first
        let chain: Vec<usize> = std::iter::once(joint).chain(model.ancestors(joint)).collect();
        let pose = chain.iter().rev().fold(Isometry3::identity(), |pose, j| pose * own[model.joints[*j].child]);
        model.links[at].pose = pose;
        let j = &mut model.joints[joint];
        j.at = pose * Point3::origin();
        j.axis = (pose * j.axis).try_normalize(0.0).unwrap_or_else(Vector3::x);
    }
    for link in &mut model.links {
        let pose = link.pose;
        link.shapes.iter_mut().for_each(|shape| shape.pose = pose * shape.pose);
        if let Mass::Known { at, inertia, .. } = &mut link.mass {
            *at = pose * *at;
            *inertia = turned(inertia, &pose.rotation);
        }
    }
}
