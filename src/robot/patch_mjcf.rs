//! Places in an MJCF. What a default class states is stated anew at the element: others are of the class, too.

use super::mjcf_defaults::Defaults;
use super::model::Model;
use super::patch_edits::{Edits, rounded};
use super::patch_places::{Placed, Places, RIM, Weighed};
use super::wheels::radius;
use super::xml::{Xml, child, children};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use roxmltree::Node;

pub(super) struct Mjcf<'a, 'i, 'm, 'x> {
    xml: &'m Xml<'x>,
    root: Node<'a, 'i>,
    model: &'m Model,
    defaults: Defaults<'a, 'i>,
}

impl<'a, 'i, 'm, 'x> Mjcf<'a, 'i, 'm, 'x> {
    pub(super) fn new(xml: &'m Xml<'x>, root: Node<'a, 'i>, model: &'m Model) -> Self {
        Self { xml, root, model, defaults: Defaults::read(root) }
    }

    fn body(&self, name: &str) -> Result<Node<'a, 'i>, String> {
        let found = self.root.descendants().find(|n| n.has_tag_name("body") && n.attribute("name") == Some(name));
        found.ok_or_else(|| format!("{name} has no name in the file"))
    }

    /// The element of a hinge.
    fn joint(&self, joint: usize) -> Result<Node<'a, 'i>, String> {
        let j = &self.model.joints[joint];
        let body = self.body(&self.model.links[j.child].name)?;
        let is = |n: &Node| n.attribute("name").is_none_or(|name| name == j.name);
        children(body, "joint").find(is).ok_or_else(|| format!("{} has no <joint>", j.name))
    }

    /// Numbers of an attribute as changed so far, else its own or its class's.
    fn numbers(&self, node: Node<'a, 'i>, name: &str, edits: &Edits) -> Option<Vec<f64>> {
        let class = node.ancestors().find_map(|n| n.attribute("childclass"));
        let words = || self.defaults.attribute(node, name, class);
        edits.attribute(node, name).or_else(|| words()?.split_whitespace().map(|w| w.parse().ok()).collect())
    }
}

impl Places for Mjcf<'_, '_, '_, '_> {
    fn wheel(&self, joint: usize, factor: f64, by: Vector3<f64>, edits: &mut Edits) -> Placed {
        let model = self.model;
        let j = &model.joints[joint];
        let body = self.body(&model.links[j.child].name)?;
        if body.parent().is_some_and(|p| p.has_tag_name("frame")) {
            return Err(format!("{} lies in a <frame>", model.links[j.child].name));
        }
        let parent = j.parent.map_or(UnitQuaternion::identity(), |p| model.links[p].pose.rotation);
        let by = parent.inverse() * by;
        let at = edits.attribute(body, "pos").unwrap_or_else(|| vec![0.0; 3]);
        edits.set_attribute(body, "pos", &at.iter().zip(by.iter()).map(|(a, b)| a + b).collect::<Vec<_>>());
        if factor == 1.0 {
            return Ok(());
        }
        let least = radius(model, joint).map_or(f64::INFINITY, |(r, _)| RIM * r);
        for link in model.rigid(j.child) {
            for geom in children(self.body(&model.links[link].name)?, "geom") {
                let class = geom.ancestors().find_map(|n| n.attribute("childclass"));
                let kind = self.defaults.attribute(geom, "type", class).unwrap_or("sphere");
                let Some(had) = self.numbers(geom, "size", edits) else { continue };
                let round = match kind {
                    "sphere" | "cylinder" | "capsule" => 1,
                    "ellipsoid" => 3,
                    _ => 0,
                };
                let grown = |(i, size): (usize, &f64)| if i < round && *size > least { size * factor } else { *size };
                let to: Vec<f64> = had.iter().enumerate().map(grown).collect();
                if to != had {
                    edits.set_attribute(geom, "size", &to);
                }
            }
        }
        Ok(())
    }

    fn mass(&self, link: usize, to: &Weighed, edits: &mut Edits) -> Placed {
        let link = &self.model.links[link];
        let inertial = child(self.body(&link.name)?, "inertial").filter(|_| !self.defaults.inertia_from_geoms);
        let inertial = inertial.ok_or_else(|| format!("the mass of {} comes from its shapes", link.name))?;
        let turned = ["euler", "axisangle", "xyaxes", "zaxis"].into_iter().find(|name| inertial.has_attribute(*name));
        if let Some(name) = turned {
            return Err(format!("the inertial of line {} is turned by {name}", self.xml.row(inertial)));
        }
        let quat = edits.attribute(inertial, "quat").filter(|q| q.len() == 4);
        let quat = quat.and_then(|q| UnitQuaternion::try_new(Quaternion::new(q[0], q[1], q[2], q[3]), 1e-12));
        let axes = (link.pose.rotation * quat.unwrap_or_default()).to_rotation_matrix();
        let inertia: Matrix3<f64> = axes.matrix().transpose() * to.inertia * axes.matrix();
        let [xx, yy, zz] = [0, 1, 2].map(|i| inertia[(i, i)]);
        let off = [inertia[(0, 1)], inertia[(0, 2)], inertia[(1, 2)]];
        if inertial.has_attribute("fullinertia") {
            edits.set_attribute(inertial, "fullinertia", &[xx, yy, zz, off[0], off[1], off[2]]);
        } else if off.iter().any(|x| x.abs() > 1e-9 * inertia.norm()) {
            return Err(format!("the inertial of line {} is turned against the robot", self.xml.row(inertial)));
        } else {
            edits.set_attribute(inertial, "diaginertia", &[xx, yy, zz]);
        }
        edits.set_attribute(inertial, "mass", &[to.kg]);
        edits.set_attribute(inertial, "pos", (link.pose.inverse() * to.at).coords.as_slice());
        Ok(())
    }

    fn friction(&self, joint: usize, dry: f64, damping: f64, edits: &mut Edits) -> Placed {
        let node = self.joint(joint)?;
        for (name, more) in [("frictionloss", dry), ("damping", damping)] {
            if more != 0.0 {
                let had = self.numbers(node, name, edits).and_then(|v| v.first().copied()).unwrap_or(0.0);
                edits.set_attribute(node, name, &[had + more]);
            }
        }
        Ok(())
    }

    fn gear(&self, joint: usize, factor: f64, edits: &mut Edits) -> Placed {
        let name = &self.model.joints[joint].name;
        let all = children(self.root, "actuator").flat_map(|a| a.children().filter(Node::is_element));
        let motors: Vec<Node> = all.filter(|a| a.attribute("joint") == Some(name)).collect();
        if motors.is_empty() {
            return Err(format!("no actuator names the joint {name}"));
        }
        for motor in motors {
            let bias = self.defaults.attribute(motor, "biastype", None).is_some_and(|kind| kind != "none");
            let tag = motor.tag_name().name();
            if bias || !matches!(tag, "motor" | "general") {
                return Err(format!(
                    "the <{tag}> of {name} holds a position or a speed, which its gear would change, too"
                ));
            }
            let mut gear = self.numbers(motor, "gear", edits).filter(|g| !g.is_empty()).unwrap_or_else(|| vec![1.0]);
            gear[0] *= factor;
            edits.set_attribute(motor, "gear", &gear);
        }
        Ok(())
    }

    fn gravity(&self, direction: Vector3<f64>, usual: f64, edits: &mut Edits) -> Placed {
        let option = child(self.root, "option");
        let had = option.and_then(|o| edits.attribute(o, "gravity"));
        let gravity = direction * had.map_or(usual, |g| g.iter().map(|x| x * x).sum::<f64>().sqrt());
        match option {
            Some(option) => edits.set_attribute(option, "gravity", gravity.as_slice()),
            None => {
                let [x, y, z] = [gravity.x, gravity.y, gravity.z].map(rounded);
                let element = format!("<option gravity=\"{x} {y} {z}\"/>");
                if !edits.add_child(self.root, "option", &element) {
                    return Err("the model is empty".into());
                }
            }
        }
        Ok(())
    }
}
