//! A robot as URDF, SDF and MJCF have it in common: links with masses and shapes, joints, plugins that drive wheels.

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};

/// Most joints of a robot: humanoids have a hundred. What hangs on what is looked up for each of them.
pub(super) const MOST_JOINTS: usize = 2000;
/// Advice where there are more.
pub(super) const ALONE: &str = "give the description of the robot alone";

/// One robot of a description; all poses are in its own frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Model {
    pub name: String,
    pub links: Vec<Link>,
    pub joints: Vec<Joint>,
    /// Plugins that drive wheels by two sides.
    pub drives: Vec<Drive>,
    /// A plugin that moves the robot in another way, by its name.
    pub other_drive: Option<String>,
    pub imu: Option<Imu>,
    /// Decisions that a reader made.
    pub notes: Vec<String>,
}

#[derive(Debug, Clone)]
pub(super) struct Link {
    pub name: String,
    pub pose: Isometry3<f64>,
    pub mass: Mass,
    /// Shapes that collide come first.
    pub shapes: Vec<Shape>,
}

/// Mass of a link.
#[derive(Debug, Clone)]
pub(super) enum Mass {
    /// The description has none.
    None,
    /// Mass in kg, centre of mass, inertia about it in kg·m², in the model's axes.
    Known { kg: f64, at: Point3<f64>, inertia: Matrix3<f64> },
    /// It has one, and does not say how large.
    NotTold(String),
}

#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub form: Form,
    pub pose: Isometry3<f64>,
    pub collides: bool,
}

/// Lengths in m; a cylinder's and a capsule's axis is z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form {
    Cylinder {
        radius: f64,
        length: f64,
    },
    Capsule {
        radius: f64,
        length: f64,
    },
    Sphere {
        radius: f64,
    },
    Box([f64; 3]),
    Ellipsoid([f64; 3]),
    /// A mesh, a plane or another form without a radius.
    Other,
}

#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub name: String,
    /// Index of the parent link; `None`: the world.
    pub parent: Option<usize>,
    /// Index of the child link.
    pub child: usize,
    pub motion: Motion,
    /// Unit vector in the model's axes.
    pub axis: Vector3<f64>,
    pub at: Point3<f64>,
    /// N·m·s.
    pub damping: Option<f64>,
    /// Inertia of its motor as the joint feels it, kg·m².
    pub armature: Option<f64>,
    /// Whether the description names an actuator for it.
    pub driven: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Motion {
    Fixed,
    /// A hinge that turns without end.
    Spinning,
    /// A hinge with limits.
    Turning,
    Other,
}

/// Wheels that a plugin drives, with the sizes that it states.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    pub name: String,
    pub left: Vec<String>,
    pub right: Vec<String>,
    pub separation_m: Option<f64>,
    pub radius_m: Option<f64>,
}

/// The gyro of an IMU as a simulator has it.
#[derive(Debug, Clone)]
pub(super) struct Imu {
    pub name: String,
    pub rate_hz: Option<f64>,
    /// White noise of a sample about z, rad/s.
    pub noise_std_rad_s: Option<f64>,
}

impl Model {
    /// The joint that carries each link.
    fn carriers(&self) -> Vec<Option<usize>> {
        let mut carriers = vec![None; self.links.len()];
        for (at, joint) in self.joints.iter().enumerate().rev().filter(|(_, j)| j.parent != Some(j.child)) {
            carriers[joint.child] = Some(at);
        }
        carriers
    }

    /// The joints between a joint and the root, nearest first.
    pub(super) fn ancestors(&self, joint: usize) -> Vec<usize> {
        let carriers = self.carriers();
        let (mut found, mut met) = (Vec::new(), vec![false; self.joints.len()]);
        met[joint] = true;
        let mut at = self.joints[joint].parent;
        // joints that hang on each other in a ring end where they began
        while let Some(next) = at.and_then(|link| carriers[link]).filter(|next| !met[*next]) {
            met[next] = true;
            found.push(next);
            at = self.joints[next].parent;
        }
        found
    }

    /// A link and those fixed to it further out.
    pub(super) fn rigid(&self, link: usize) -> Vec<usize> {
        let mut fixed: Vec<Vec<usize>> = vec![Vec::new(); self.links.len()];
        for joint in self.joints.iter().filter(|j| j.motion == Motion::Fixed) {
            if let Some(parent) = joint.parent {
                fixed[parent].push(joint.child);
            }
        }
        let (mut found, mut met) = (vec![link], vec![false; self.links.len()]);
        met[link] = true;
        let mut next = 0;
        while let Some(&here) = found.get(next) {
            found.extend(fixed[here].iter().copied().filter(|child| !std::mem::replace(&mut met[*child], true)));
            next += 1;
        }
        found
    }

    /// Moves the model into the frame of another.
    pub(super) fn moved(mut self, by: &Isometry3<f64>) -> Self {
        for link in &mut self.links {
            link.pose = by * link.pose;
            link.shapes.iter_mut().for_each(|shape| shape.pose = by * shape.pose);
            if let Mass::Known { at, inertia, .. } = &mut link.mass {
                *at = by * *at;
                *inertia = turned(inertia, &by.rotation);
            }
        }
        for joint in &mut self.joints {
            joint.at = by * joint.at;
            joint.axis = by * joint.axis;
        }
        self
    }
}

/// An inertia in the axes into which `by` turns its own.
pub(super) fn turned(inertia: &Matrix3<f64>, by: &UnitQuaternion<f64>) -> Matrix3<f64> {
    let r = by.to_rotation_matrix();
    r.matrix() * inertia * r.matrix().transpose()
}

/// Inertia about another point, at `offset` from the centre of mass: I + m (d·d 1 - d dᵀ).
pub(super) fn shifted(inertia: &Matrix3<f64>, kg: f64, offset: &Vector3<f64>) -> Matrix3<f64> {
    inertia + (Matrix3::identity() * offset.norm_squared() - offset * offset.transpose()) * kg
}

/// Inertia matrix of its six elements xx, xy, xz, yy, yz, zz.
pub(super) fn symmetric([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Mass, centre of mass and inertia about it, of masses that are told; `None` where there are none.
pub(super) fn sum<'a>(masses: impl Iterator<Item = &'a Mass> + Clone) -> Option<(f64, Point3<f64>, Matrix3<f64>)> {
    let told = masses.filter_map(|m| match m {
        Mass::Known { kg, at, inertia } => Some((*kg, *at, *inertia)),
        _ => None,
    });
    let kg: f64 = told.clone().map(|(kg, ..)| kg).sum();
    if kg <= 0.0 {
        return None;
    }
    let centre = told.clone().map(|(m, at, _)| at.coords * m).sum::<Vector3<f64>>() / kg;
    let inertia = told.map(|(m, at, own)| shifted(&own, m, &(at.coords - centre))).sum();
    Some((kg, centre.into(), inertia))
}
