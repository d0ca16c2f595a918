//! Places in an SDF.

use super::model::Model;
use super::patch_edits::{Edits, rounded};
use super::patch_places::{Placed, Places, RIM, Weighed, changed, named};
use super::wheels::radius;
use super::xml::{Xml, child, children};
use nalgebra::{UnitQuaternion, Vector3};
use roxmltree::Node;

pub(super) struct Sdf<'a, 'i, 'm, 'x> {
    pub xml: &'m Xml<'x>,
    pub root: Node<'a, 'i>,
    pub model: &'m Model,
}

impl<'a, 'i> Sdf<'a, 'i, '_, '_> {
    /// A link or joint of the model.
    fn part(&self, tag: &str, name: &str) -> Result<Node<'a, 'i>, String> {
        if name.contains("::") {
            return Err(format!("{name} is part of a model within the model"));
        }
        let models = self.root.descendants().filter(|n| n.has_tag_name("model"));
        let own = models.filter(|n| n.attribute("name").unwrap_or("model") == self.model.name);
        let found = own.into_iter().find_map(|m| named(m, tag, name));
        found.ok_or_else(|| format!("there is no <{tag}> {name}"))
    }

    /// Position and angles of a `<pose>` in the model's or the link's axes.
    fn pose(&self, node: Node, edits: &Edits) -> Result<Vec<f64>, String> {
        let Some(pose) = child(node, "pose") else { return Ok(vec![0.0; 6]) };
        let odd =
            pose.attributes().find(|a| !(a.value().is_empty() || a.value() == "__model__" || a.value() == "false"));
        let row = self.xml.row(pose);
        if let Some(odd) = odd {
            return Err(format!("the pose of line {row} is stated by {}=\"{}\"", odd.name(), odd.value()));
        }
        let values = edits.text(pose).filter(|v| v.is_empty() || v.len() == 6);
        let values = values.ok_or_else(|| format!("the pose of line {row} is not six numbers"))?;
        Ok(if values.is_empty() { vec![0.0; 6] } else { values })
    }

    fn set(&self, node: Node, tag: &str, values: &[f64], edits: &mut Edits) -> Placed {
        let words = values.iter().map(|x| rounded(*x).to_string()).collect::<Vec<_>>().join(" ");
        let done = match child(node, tag) {
            Some(found) => edits.set_text(found, values),
            None => edits.add_child(node, tag, &format!("<{tag}>{words}</{tag}>")),
        };
        let row = self.xml.row(node);
        if done { Ok(()) } else { Err(format!("<{}> of line {row} is empty", node.tag_name().name())) }
    }
}

impl Places for Sdf<'_, '_, '_, '_> {
    fn wheel(&self, joint: usize, factor: f64, by: Vector3<f64>, edits: &mut Edits) -> Placed {
        let model = self.model;
        let (child_link, name) = (model.joints[joint].child, &model.joints[joint].name);
        let hinge = self.part("joint", name)?;
        let placed = child(hinge, "pose").and_then(|p| p.attribute("relative_to")).filter(|to| !to.is_empty());
        if let Some(to) = placed.filter(|to| *to != model.links[child_link].name) {
            return Err(format!("the joint {name} is placed relative to {to}, not to its wheel"));
        }
        for link in model.rigid(child_link) {
            let node = self.part("link", &model.links[link].name)?;
            let mut pose = self.pose(node, edits)?;
            pose.iter_mut().zip(by.iter()).for_each(|(at, by)| *at += by);
            self.set(node, "pose", &pose, edits)?;
            if factor == 1.0 {
                continue;
            }
            let least = radius(model, joint).map_or(f64::INFINITY, |(r, _)| RIM * r);
            for shape in ["collision", "visual"].into_iter().flat_map(|of| children(node, of)) {
                let form = child(shape, "geometry").and_then(|g| g.children().find(Node::is_element));
                for size in form
                    .into_iter()
                    .flat_map(|f| f.children())
                    .filter(|n| n.has_tag_name("radius") || n.has_tag_name("radii"))
                {
                    let Some(had) = edits.text(size) else { continue };
                    let to: Vec<f64> = had.iter().map(|r| if *r > least { r * factor } else { *r }).collect();
                    if to != had {
                        edits.set_text(size, &to);
                    }
                }
            }
        }
        Ok(())
    }

    fn mass(&self, link: usize, to: &Weighed, edits: &mut Edits) -> Placed {
        let link = &self.model.links[link];
        let node = self.part("link", &link.name)?;
        let inertial = child(node, "inertial").ok_or_else(|| format!("{} has no <inertial>", link.name))?;
        let mut pose = self.pose(inertial, edits)?;
        let axes = link.pose.rotation * UnitQuaternion::from_euler_angles(pose[3], pose[4], pose[5]);
        let at = link.pose.inverse() * to.at;
        pose[..3].copy_from_slice(at.coords.as_slice());
        self.set(inertial, "mass", &[to.kg], edits)?;
        if child(inertial, "pose").is_some() || at.coords.norm() > 1e-12 {
            self.set(inertial, "pose", &pose, edits)?;
        }
        let inertia = child(inertial, "inertia").ok_or_else(|| format!("{} has no <inertia>", link.name))?;
        changed(&link.mass, to, &axes)
            .into_iter()
            .try_for_each(|(name, value)| self.set(inertia, name, &[value], edits))
    }

    fn friction(&self, joint: usize, dry: f64, damping: f64, edits: &mut Edits) -> Placed {
        let name = &self.model.joints[joint].name;
        let axis = child(self.part("joint", name)?, "axis").ok_or_else(|| format!("the joint {name} has no <axis>"))?;
        let Some(dynamics) = child(axis, "dynamics") else {
            let inside = format!("<damping>{}</damping><friction>{}</friction>", rounded(damping), rounded(dry));
            return match edits.add_child(axis, "dynamics", &format!("<dynamics>{inside}</dynamics>")) {
                true => Ok(()),
                false => Err(format!("the axis of {name} is empty")),
            };
        };
        [("friction", dry), ("damping", damping)].into_iter().filter(|(_, more)| *more != 0.0).try_for_each(
            |(tag, more)| {
                let had = child(dynamics, tag).and_then(|n| edits.text(n)).and_then(|v| v.first().copied());
                self.set(dynamics, tag, &[had.unwrap_or(0.0) + more], edits)
            },
        )
    }

    fn gear(&self, _joint: usize, _factor: f64, _edits: &mut Edits) -> Placed {
        Err("SDF states no gain of a motor's torque: multiply the commands".into())
    }

    fn gravity(&self, direction: Vector3<f64>, usual: f64, edits: &mut Edits) -> Placed {
        let world =
            child(self.root, "world").ok_or("the file holds a model and no world: tilt gravity in the world's file")?;
        let had = child(world, "gravity").and_then(|g| edits.text(g));
        let size = had.map_or(usual, |g| g.iter().map(|x| x * x).sum::<f64>().sqrt());
        self.set(world, "gravity", (direction * size).as_slice(), edits)
    }
}
