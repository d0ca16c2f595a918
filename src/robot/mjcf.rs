//! MJCF, the files of MuJoCo: each body in the world that can move is a robot.

use super::mjcf_defaults::{Defaults, onto};
use super::model::{
    ALONE, Form, Joint, Link, MOST_JOINTS, Mass, Model, Motion, Shape, shifted, sum, symmetric, turned,
};
use super::xml::{Xml, child, children};
use crate::error::Result;
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Unit, Vector3};
use roxmltree::Node;
use std::f64::consts::PI;

/// Of a geom that states neither mass nor density, kg/m³: MuJoCo's default.
const DENSITY_KG_M3: f64 = 1000.0;
/// Bodies lie no deeper in each other in any real file.
const DEEPEST: usize = 200;

/// Reads the robots of a `<mujoco>`.
pub(super) fn read(xml: &Xml, root: Node) -> Result<Vec<Model>> {
    let defaults = Defaults::read(root);
    let driven = driven(root);
    let include = root.descendants().find(|n| n.has_tag_name("include"));
    let mut models = Vec::new();
    for world in children(root, "worldbody") {
        for body in children(world, "body") {
            let name = body.attribute("name").or_else(|| root.attribute("model")).unwrap_or("robot");
            let mut model = Model { name: name.into(), ..Model::default() };
            let reader = Reader { xml, defaults: &defaults, driven: &driven };
            let frame = Frame { pose: Isometry3::identity(), class: world.attribute("childclass"), depth: 0 };
            reader.body(body, None, &frame, &mut model)?;
            if let Some(file) = include.and_then(|i| i.attribute("file")) {
                model.notes.push(format!("not read, for it is another file: {file}"));
            }
            models.push(model);
        }
    }
    Ok(models)
}

/// Names of the joints that actuators act on, by themselves or by tendons.
fn driven<'a>(root: Node<'a, '_>) -> Vec<&'a str> {
    let actuators = children(root, "actuator").flat_map(|a| a.children().filter(Node::is_element)).collect::<Vec<_>>();
    let tendons: Vec<&str> = actuators.iter().filter_map(|a| a.attribute("tendon")).collect();
    let pulled = children(root, "tendon").flat_map(|t| t.children().filter(Node::is_element));
    let pulled = pulled.filter(|t| t.attribute("name").is_some_and(|name| tendons.contains(&name)));
    let by_tendons = pulled.flat_map(|t| children(t, "joint")).filter_map(|j| j.attribute("joint"));
    let itself = |a: &Node<'a, '_>| a.attribute("joint").or_else(|| a.attribute("jointinparent"));
    actuators.iter().filter_map(itself).chain(by_tendons).collect()
}

/// Frame that bodies and geoms lie in.
struct Frame<'a> {
    pose: Isometry3<f64>,
    /// Class of defaults that holds in it.
    class: Option<&'a str>,
    /// Number of bodies and frames that it lies in.
    depth: usize,
}

struct Reader<'b, 'a, 'i, 'x> {
    xml: &'b Xml<'x>,
    defaults: &'b Defaults<'a, 'i>,
    driven: &'b [&'a str],
}

impl<'a, 'i> Reader<'_, 'a, 'i, '_> {
    /// Adds a body, and those on it.
    fn body(&self, node: Node<'a, 'i>, parent: Option<usize>, on: &Frame<'a>, model: &mut Model) -> Result<()> {
        if on.depth > DEEPEST {
            return Err(self.xml.error(node, "bodies lie in bodies too deep"));
        }
        if model.links.len() > MOST_JOINTS {
            return Err(self.xml.error(node, format!("more than {MOST_JOINTS} bodies")).hint(ALONE));
        }
        let frame = self.within(node, on, on.depth)?;
        let pose = frame.pose;
        let index = model.links.len();
        let row = self.xml.row(node);
        let name = node.attribute("name").map_or_else(|| format!("body of line {row}"), String::from);
        model.links.push(Link { name, pose, mass: Mass::None, shapes: Vec::new() });
        self.joints(node, index, parent, &frame, model)?;
        let mut parts = Vec::new();
        self.parts(node, index, &frame, model, &mut parts)?;
        model.links[index].mass = match child(node, "inertial").filter(|_| !self.defaults.inertia_from_geoms) {
            Some(inertial) => self.inertial(inertial, &pose)?,
            None => together(parts),
        };
        Ok(())
    }

    /// The frame of a body or a frame that lies in `on`.
    fn within(&self, node: Node<'a, 'i>, on: &Frame<'a>, depth: usize) -> Result<Frame<'a>> {
        let pose = on.pose * self.defaults.pose(self.xml, node, None)?;
        Ok(Frame { pose, class: node.attribute("childclass").or(on.class), depth })
    }

    /// Geoms and bodies of a body, or of a frame in it.
    fn parts(
        &self,
        node: Node<'a, 'i>,
        index: usize,
        frame: &Frame<'a>,
        model: &mut Model,
        parts: &mut Vec<Mass>,
    ) -> Result<()> {
        for geom in children(node, "geom") {
            let (shape, mass) = self.geom(geom, &frame.pose, frame.class)?;
            model.links[index].shapes.push(shape);
            parts.push(mass);
        }
        for inner in children(node, "frame") {
            let own = self.within(inner, frame, frame.depth + 1)?;
            if frame.depth > DEEPEST {
                return Err(self.xml.error(inner, "frames lie in frames too deep"));
            }
            self.parts(inner, index, &own, model, parts)?;
        }
        let inside = Frame { depth: frame.depth + 1, ..*frame };
        children(node, "body").try_for_each(|body| self.body(body, Some(index), &inside, model))
    }

    /// The joints of a body; a body without any is fixed.
    fn joints(
        &self,
        node: Node<'a, 'i>,
        index: usize,
        parent: Option<usize>,
        &Frame { pose, class, .. }: &Frame<'a>,
        model: &mut Model,
    ) -> Result<()> {
        let joint = |name: String, motion, axis, at| Joint {
            name,
            parent,
            child: index,
            motion,
            axis,
            at,
            damping: None,
            armature: None,
            driven: false,
        };
        let first = model.joints.len();
        let body = model.links[index].name.clone();
        for found in children(node, "joint") {
            let get = |name| self.defaults.attribute(found, name, class);
            let axis = self.defaults.numbers(self.xml, found, "axis", class)?.unwrap_or([0.0, 0.0, 1.0]);
            let at = self.defaults.numbers(self.xml, found, "pos", class)?.unwrap_or([0.0; 3]);
            let limited = match get("limited") {
                Some("true") => true,
                Some("false") => false,
                _ => self.defaults.limits_follow_ranges && get("range").is_some(),
            };
            let motion = match get("type") {
                None | Some("hinge") if limited => Motion::Turning,
                None | Some("hinge") => Motion::Spinning,
                _ => Motion::Other,
            };
            let own = found.attribute("name");
            let name = own.map_or_else(|| format!("joint of {body}"), String::from);
            let axis = (pose * Vector3::from(axis)).try_normalize(0.0).unwrap_or_else(Vector3::z);
            let number = |name| -> Result<Option<f64>> {
                Ok(self.defaults.numbers(self.xml, found, name, class)?.map(|[x]: [f64; 1]| x))
            };
            model.joints.push(Joint {
                damping: number("damping")?,
                armature: number("armature")?,
                driven: own.is_some_and(|name| self.driven.contains(&name)),
                ..joint(name, motion, axis, pose * Point3::from(at))
            });
        }
        if children(node, "freejoint").next().is_some() {
            model.joints.push(joint(
                format!("free joint of {body}"),
                Motion::Other,
                Vector3::z(),
                pose * Point3::origin(),
            ));
        }
        if model.joints.len() == first && parent.is_some() {
            model.joints.push(joint(format!("weld of {body}"), Motion::Fixed, Vector3::z(), pose * Point3::origin()));
        }
        Ok(())
    }

    fn geom(&self, node: Node<'a, 'i>, on: &Isometry3<f64>, class: Option<&str>) -> Result<(Shape, Mass)> {
        let get = |name| self.defaults.attribute(node, name, class);
        let number = |name| -> Result<Option<f64>> {
            Ok(self.defaults.numbers(self.xml, node, name, class)?.map(|[x]: [f64; 1]| x))
        };
        let mut own = self.defaults.pose(self.xml, node, class)?;
        let sizes: Vec<f64> =
            get("size").unwrap_or_default().split_whitespace().filter_map(|w| w.parse().ok()).collect();
        let size = |i: usize| sizes.get(i).copied().unwrap_or(0.0);
        let mut half = size(1);
        if let Some([a, b, c, d, e, f]) = self.defaults.numbers(self.xml, node, "fromto", class)? {
            let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
            half = (to - from).norm() / 2.0;
            if let Some(along) = Unit::try_new(to - from, 1e-12) {
                own = Isometry3::from_parts(Translation3::from((from + to) / 2.0), onto(&along));
            }
        }
        let form = match get("type").unwrap_or(if get("mesh").is_some() { "mesh" } else { "sphere" }) {
            "sphere" => Form::Sphere { radius: size(0) },
            "cylinder" => Form::Cylinder { radius: size(0), length: 2.0 * half },
            "capsule" => Form::Capsule { radius: size(0), length: 2.0 * half },
            "box" => Form::Box([2.0 * size(0), 2.0 * size(1), 2.0 * size(2)]),
            "ellipsoid" => Form::Ellipsoid([size(0), size(1), size(2)]),
            _ => Form::Other,
        };
        let pose = on * own;
        let collides = !(get("contype") == Some("0") && get("conaffinity") == Some("0"));
        let density = number("density")?.unwrap_or(DENSITY_KG_M3);
        let kg = match number("mass")? {
            Some(kg) => Some(kg),
            None => volume_m3(&form).map(|v| v * density).or((density == 0.0).then_some(0.0)),
        };
        let name = node.attribute("name").or_else(|| get("mesh")).unwrap_or("a geom");
        let mass = match (kg, unit_inertia(&form)) {
            (Some(kg), _) if kg <= 0.0 => Mass::None,
            (Some(kg), Some(inertia)) => {
                Mass::Known { kg, at: pose * Point3::origin(), inertia: turned(&(inertia * kg), &pose.rotation) }
            }
            _ => Mass::NotTold(format!("{name} is a mesh, whose volume is not read")),
        };
        Ok((Shape { form, pose, collides }, mass))
    }

    fn inertial(&self, node: Node, body: &Isometry3<f64>) -> Result<Mass> {
        let Some(kg) = self.xml.scalar(node, "mass")? else {
            return Ok(Mass::NotTold("its <inertial> has no mass".into()));
        };
        let pose = body * self.defaults_free_pose(node)?;
        let inertia = match (self.xml.attribute(node, "diaginertia")?, self.xml.attribute(node, "fullinertia")?) {
            (Some(diagonal), _) => Matrix3::from_diagonal(&Vector3::from(diagonal)),
            // MJCF's order is xx, yy, zz, xy, xz, yz
            (None, Some([xx, yy, zz, xy, xz, yz])) => symmetric([xx, xy, xz, yy, yz, zz]),
            (None, None) => Matrix3::zeros(),
        };
        Ok(Mass::Known { kg, at: pose * Point3::origin(), inertia: turned(&inertia, &pose.rotation) })
    }

    /// The pose of an `<inertial>`, which has no class.
    fn defaults_free_pose(&self, node: Node) -> Result<Isometry3<f64>> {
        let [x, y, z] = self.xml.attribute(node, "pos")?.unwrap_or([0.0; 3]);
        let turn = self.xml.attribute(node, "quat")?.and_then(|[w, x, y, z]: [f64; 4]| {
            nalgebra::UnitQuaternion::try_new(nalgebra::Quaternion::new(w, x, y, z), 1e-12)
        });
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), turn.unwrap_or_default()))
    }
}

/// One mass of several.
fn together(parts: Vec<Mass>) -> Mass {
    if let Some(unknown) = parts.iter().find(|m| matches!(m, Mass::NotTold(_))) {
        return unknown.clone();
    }
    sum(parts.iter()).map_or(Mass::None, |(kg, at, inertia)| Mass::Known { kg, at, inertia })
}

/// `None` for a form whose volume is not known.
fn volume_m3(form: &Form) -> Option<f64> {
    Some(match *form {
        Form::Sphere { radius } => 4.0 / 3.0 * PI * radius.powi(3),
        Form::Cylinder { radius, length } => PI * radius * radius * length,
        Form::Capsule { radius, length } => PI * radius * radius * (length + 4.0 / 3.0 * radius),
        Form::Box([a, b, c]) => a * b * c,
        Form::Ellipsoid([a, b, c]) => 4.0 / 3.0 * PI * a * b * c,
        Form::Other => return None,
    })
}

/// Inertia of a homogeneous body of 1 kg about its centre, kg·m².
fn unit_inertia(form: &Form) -> Option<Matrix3<f64>> {
    let [x, y, z] = match *form {
        Form::Sphere { radius } => [0.4 * radius * radius; 3],
        Form::Cylinder { radius, length } => {
            let across = (3.0 * radius * radius + length * length) / 12.0;
            [across, across, radius * radius / 2.0]
        }
        Form::Capsule { radius: r, length } => {
            // a cylinder, and two halves of a sphere at its ends, whose centres lie 3 r / 8 further out
            let (tube, ball) = (length, 4.0 / 3.0 * r);
            let (tube, ball) = (tube / (tube + ball), ball / (tube + ball));
            let end = Matrix3::from_diagonal_element(0.4 * r * r)
                - Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0)) * (0.375 * r).powi(2);
            let end = shifted(&end, 1.0, &Vector3::new(0.0, 0.0, length / 2.0 + 0.375 * r));
            let across = tube * (3.0 * r * r + length * length) / 12.0 + ball * end[(0, 0)];
            [across, across, tube * r * r / 2.0 + ball * end[(2, 2)]]
        }
        Form::Box([a, b, c]) => [(b * b + c * c) / 12.0, (a * a + c * c) / 12.0, (a * a + b * b) / 12.0],
        Form::Ellipsoid([a, b, c]) => [(b * b + c * c) / 5.0, (a * a + c * c) / 5.0, (a * a + b * b) / 5.0],
        Form::Other => return None,
    };
    Some(Matrix3::from_diagonal(&Vector3::new(x, y, z)))
}
