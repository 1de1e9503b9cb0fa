//! A robot arm: its chain, what its links weigh, how they are shaped, and what stands around it.

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

use super::chain::{Chain, JointKind};
use super::frames::Pose;

/// A nominal arm with everything that is known about it without measuring.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Name of the robot.
    pub name: String,
    /// Kinematics and joint limits.
    pub chain: Chain,
    /// `links[0]` is the base link; `links[i]` moves with joint `i`, its frame is the chain's frame named [`Link::name`]. The
    /// last link carries the tool.
    pub links: Vec<Link>,
    /// Bodies of the cell, fixed in the chain's first frame (the base link, or the world in which its six parameters place it).
    pub fixtures: Vec<Fixture>,
    /// Pairs of links (by index, smaller first) that are never checked against each other, besides neighbours.
    pub uncollidable: Vec<(usize, usize)>,
    /// Acceleration of free fall in the chain's first frame, m/s².
    pub gravity_in_base: Vector3<f64>,
}

/// A rigid link.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Name, and name of its frame in the chain.
    pub name: String,
    /// Mass distribution; `None` where the source (a URDF without inertials) has none.
    pub inertial: Option<Inertial>,
    /// Shapes for collision and drawing.
    pub shapes: Vec<Shape>,
}

/// Mass, centre of mass and inertia of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct Inertial {
    /// kg.
    pub mass_kg: f64,
    /// In the link frame, m.
    pub centre_of_mass_in_link: Point3<f64>,
    /// About the centre of mass, along the axes of the link frame, kg·m².
    pub inertia_in_link: Matrix3<f64>,
}

/// A body of the cell that does not move.
#[derive(Clone, Debug, PartialEq)]
pub struct Fixture {
    /// Name for messages.
    pub name: String,
    /// Its shape; the frame is the chain's first.
    pub shape: Shape,
    /// Links (by index) that may touch it, such as the base link on its plate.
    pub may_touch: Vec<usize>,
}

/// A primitive shape at a pose in its link's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// `link_from_shape`.
    pub link_from_shape: Pose,
    /// Geometry in the shape's own frame.
    pub geometry: Geometry,
}

/// Primitive geometries, centred on the shape's frame (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// A segment of `2 · half_length` along z, swept by a ball of `radius`.
    Capsule {
        /// Half the length of the segment, without the caps.
        half_length: f64,
        /// Radius of the ball.
        radius: f64,
    },
    /// A cylinder of height `2 · half_length` along z.
    Cylinder {
        /// Half the height.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// A cuboid.
    Box {
        /// Half the edge along each axis.
        half_extents: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// Radius.
        radius: f64,
    },
}

impl Inertial {
    /// The same mass distribution of frame b in frame a.
    #[must_use]
    pub fn moved(&self, a_from_b: &Pose) -> Inertial {
        let rotation = a_from_b.rotation.to_rotation_matrix().into_inner();
        Inertial {
            mass_kg: self.mass_kg,
            centre_of_mass_in_link: a_from_b * self.centre_of_mass_in_link,
            inertia_in_link: rotation * self.inertia_in_link * rotation.transpose(),
        }
    }

    /// Why no body has this inertia, as what was found and what is allowed; `None` if one may have it.
    #[must_use]
    pub fn impossible(&self) -> Option<(String, &'static str)> {
        let mut principal: Vec<f64> = SymmetricEigen::new(self.inertia_in_link).eigenvalues.iter().copied().collect();
        principal.sort_by(f64::total_cmp);
        let found = format!("principal moments {:.4e}, {:.4e}, {:.4e} kg·m²", principal[0], principal[1], principal[2]);
        if principal[0] <= 0.0 {
            return Some((found, "a positive definite inertia"));
        }
        // A flat body meets the bound with equality, so rounding must pass.
        if principal[2] > (principal[0] + principal[1]) * (1.0 + 1e-9) {
            return Some((found, "principal moments of which none exceeds the sum of the other two (no body has others)"));
        }
        None
    }
}

impl Arm {
    /// Number of joints.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.chain.joints.len()
    }

    /// Which joints slide.
    #[must_use]
    pub fn slides(&self) -> Vec<bool> {
        self.chain.joints.iter().map(|joint| joint.kind == JointKind::Prismatic).collect()
    }

    /// Whether `joints` respects every limit.
    #[must_use]
    pub fn within_limits(&self, joints: &[f64]) -> bool {
        self.chain.joints.iter().zip(joints).all(|(joint, value)| (joint.lower..=joint.upper).contains(value))
    }
}
