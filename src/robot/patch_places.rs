//! Sizes that each format of descriptions has a place for.

use super::model::Mass;
use super::patch_edits::Edits;
use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use roxmltree::Node;

/// Shapes nearly as large as a wheel are the wheel, too.
pub(super) const RIM: f64 = 0.9;
/// Elements of an inertia matrix, by name.
const ELEMENTS: [(&str, usize, usize); 6] =
    [("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2)];

/// The mass of one link as it is to be: kg, centre of mass and inertia in the model's axes.
pub(super) struct Weighed {
    pub kg: f64,
    pub at: Point3<f64>,
    pub inertia: Matrix3<f64>,
}

/// Places of a format for what may be true. Each says why where the description has none.
pub(super) trait Places {
    /// Enlarges the shapes of the wheel on a joint by a factor, and moves its axle, m in the model's axes.
    fn wheel(&self, joint: usize, factor: f64, by: Vector3<f64>, edits: &mut Edits) -> Placed;
    /// Gives a link mass, centre and inertia.
    fn mass(&self, link: usize, to: &Weighed, edits: &mut Edits) -> Placed;
    /// Adds dry friction, N·m, and damping, N·m·s, to a joint.
    fn friction(&self, joint: usize, dry: f64, damping: f64, edits: &mut Edits) -> Placed;
    /// Multiplies the torque of the motors of a joint.
    fn gear(&self, joint: usize, factor: f64, edits: &mut Edits) -> Placed;
    /// Sets gravity, m/s² in the world's axes, of this size where the description states another.
    fn gravity(&self, direction: Vector3<f64>, usual: f64, edits: &mut Edits) -> Placed;
}

/// Done, or why the description has no place.
pub(super) type Placed = std::result::Result<(), String>;

/// The child of `parent` with a tag and a name.
pub(super) fn named<'a, 'i>(parent: Node<'a, 'i>, tag: &str, name: &str) -> Option<Node<'a, 'i>> {
    parent.children().find(|n| n.has_tag_name(tag) && n.attribute("name") == Some(name))
}

/// Elements of the inertia in a link's axes that differ from those it had, by name.
pub(super) fn changed(had: &Mass, to: &Weighed, axes: &UnitQuaternion<f64>) -> Vec<(&'static str, f64)> {
    let own = axes.to_rotation_matrix();
    let turned = |inertia: &Matrix3<f64>| own.matrix().transpose() * inertia * own.matrix();
    let before = if let Mass::Known { inertia, .. } = had { turned(inertia) } else { Matrix3::zeros() };
    let after = turned(&to.inertia);
    let scale = after.norm() * 1e-9;
    let differ = ELEMENTS.into_iter().filter(|(_, i, j)| (after[(*i, *j)] - before[(*i, *j)]).abs() > scale);
    differ.map(|(name, i, j)| (name, after[(i, j)])).collect()
}
