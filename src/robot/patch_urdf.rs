//! Places in a URDF.

use super::model::Model;
use super::patch_edits::{Edits, rounded};
use super::patch_places::{Placed, Places, RIM, Weighed, changed, named};
use super::wheels::radius;
use super::xml::{child, children};
use nalgebra::{UnitQuaternion, Vector3};
use roxmltree::Node;

pub(super) struct Urdf<'a, 'i, 'm> {
    pub root: Node<'a, 'i>,
    pub model: &'m Model,
}

impl<'a, 'i> Urdf<'a, 'i, '_> {
    fn joint(&self, joint: usize) -> Result<Node<'a, 'i>, String> {
        let name = &self.model.joints[joint].name;
        named(self.root, "joint", name).ok_or_else(|| format!("there is no <joint> {name}"))
    }
}

impl Places for Urdf<'_, '_, '_> {
    fn wheel(&self, joint: usize, factor: f64, by: Vector3<f64>, edits: &mut Edits) -> Placed {
        let (model, node) = (self.model, self.joint(joint)?);
        let parent = model.joints[joint].parent.map_or(UnitQuaternion::identity(), |p| model.links[p].pose.rotation);
        let by = parent.inverse() * by;
        if let Some(origin) = child(node, "origin") {
            let at = edits.attribute(origin, "xyz").unwrap_or_else(|| vec![0.0; 3]);
            let to: Vec<f64> = at.iter().zip(by.iter()).map(|(a, b)| a + b).collect();
            edits.set_attribute(origin, "xyz", &to);
        } else {
            if !edits.add_child(node, "origin", &origin_at(by)) {
                return Err(format!("the joint {} is empty", model.joints[joint].name));
            }
        }
        if factor == 1.0 {
            return Ok(());
        }
        let least = radius(model, joint).map_or(f64::INFINITY, |(r, _)| RIM * r);
        for link in model.rigid(model.joints[joint].child) {
            let Some(link) = named(self.root, "link", &model.links[link].name) else { continue };
            for shape in ["collision", "visual"].into_iter().flat_map(|of| children(link, of)) {
                let round = child(shape, "geometry").and_then(|g| g.children().find(Node::is_element));
                let Some(round) = round else { continue };
                if let Some(r) =
                    edits.attribute(round, "radius").and_then(|r| r.first().copied()).filter(|r| *r > least)
                {
                    edits.set_attribute(round, "radius", &[r * factor]);
                }
            }
        }
        Ok(())
    }

    fn mass(&self, link: usize, to: &Weighed, edits: &mut Edits) -> Placed {
        let link = &self.model.links[link];
        let none = || format!("{} has no <inertial> with a mass", link.name);
        let node = named(self.root, "link", &link.name).and_then(|l| child(l, "inertial")).ok_or_else(none)?;
        let mass = child(node, "mass").ok_or_else(none)?;
        let origin = child(node, "origin");
        let turn = origin.and_then(|o| edits.attribute(o, "rpy")).unwrap_or_else(|| vec![0.0; 3]);
        let &[roll, pitch, yaw] = &turn[..] else { return Err(none()) };
        let axes = link.pose.rotation * UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        edits.set_attribute(mass, "value", &[to.kg]);
        let at = link.pose.inverse() * to.at;
        match origin {
            Some(origin) => edits.set_attribute(origin, "xyz", at.coords.as_slice()),
            None if at.coords.norm() < 1e-12 => {}
            None if edits.add_child(node, "origin", &origin_at(at.coords)) => {}
            None => return Err(none()),
        }
        let inertia = child(node, "inertia").ok_or_else(none)?;
        for (name, value) in changed(&link.mass, to, &axes) {
            edits.set_attribute(inertia, name, &[value]);
        }
        Ok(())
    }

    fn friction(&self, joint: usize, dry: f64, damping: f64, edits: &mut Edits) -> Placed {
        let node = self.joint(joint)?;
        let Some(dynamics) = child(node, "dynamics") else {
            let element = format!("<dynamics damping=\"{}\" friction=\"{}\"/>", rounded(damping), rounded(dry));
            return match edits.add_child(node, "dynamics", &element) {
                true => Ok(()),
                false => Err(format!("the joint {} is empty", self.model.joints[joint].name)),
            };
        };
        for (name, more) in [("friction", dry), ("damping", damping)] {
            if more != 0.0 {
                let had = edits.attribute(dynamics, name).and_then(|v| v.first().copied()).unwrap_or(0.0);
                edits.set_attribute(dynamics, name, &[had + more]);
            }
        }
        Ok(())
    }

    fn gear(&self, _joint: usize, _factor: f64, _edits: &mut Edits) -> Placed {
        Err("URDF states no gain of a motor's torque: multiply the commands".into())
    }

    fn gravity(&self, _direction: Vector3<f64>, _usual: f64, _edits: &mut Edits) -> Placed {
        Err("a URDF holds the robot and not its world: tilt gravity where the world is made".into())
    }
}

fn origin_at(place: Vector3<f64>) -> String {
    format!("<origin xyz=\"{} {} {}\"/>", rounded(place.x), rounded(place.y), rounded(place.z))
}
