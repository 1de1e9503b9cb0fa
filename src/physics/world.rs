//! The rapier world: one multibody, gravity, nothing else.
//!
//! Every joint of the arm becomes up to three rapier links in series, the last of which carries the mass:
//! one that slides (radial: x, y; axial: z), and two that tilt, about x and then about y (rapier has no joint with two free
//! angular axes). A joint without clearance is one link with all axes locked. Links in between have no mass.
//!
//! A disc is a limit on one axis: rapier limits coordinates one by one (and ignores `coupled_axes` between links of a
//! multibody). Therefore the frame of every radial and tilt coordinate is turned, before each step, so that its x axis points
//! to where the joint lies: then x is the distance from the middle, which is limited, and y is a step along the circle, which
//! is not.

use nalgebra::{Vector2, Vector3};
use rapier3d::dynamics::{
    GenericJoint, IntegrationParameters, JointAxesMask, JointAxis, MassProperties, Multibody, MultibodyIndex, MultibodyJoint,
    MultibodyLink, RigidBodyBuilder, RigidBodyHandle, SpringCoefficients,
};
use rapier3d::pipeline::PhysicsWorld;

use super::clearance::SeatedBy;
use super::convert::{matrix_to_rapier, pose_from_rapier, pose_to_rapier, vector_to_rapier};
use super::play::{Decision, Load, Play};
use super::true_arm::{TrueArm, turn_about_z};
use crate::frames::Pose;

/// A step carries a coordinate this far beyond the edge of its clearance, from the middle: rapier notices a limit once it is
/// passed. What exceeds 1 is also the factor by which an error along the circle shrinks per step (its sign changes).
const REACH_PER_STEP: f64 = 1.05;

/// Duration of a step, s. Long, so that damping outweighs inertia by four orders of magnitude: steps are quasi-static, the
/// coordinates hardly push each other, and a few sweeps of rapier's solver are exact.
pub(super) const TIME_STEP_S: f64 = 1.0;

/// Stiffness of the limits: the angle that their spring would turn in one step, rad. A limit holds a coordinate at the edge
/// times `1 + REACH_PER_STEP / STIFFNESS²`, and each step leaves `2 / STIFFNESS` of what was beyond it.
const STIFFNESS: f64 = 1e5;

/// Damping of a coordinate that its load does not move, relative to one at the threshold.
const HELD: f64 = 1e12;

/// The rapier links of one joint of the arm, by index in the multibody, and its free coordinates, by index in rapier's
/// generalised coordinates.
#[derive(Clone, Copy, Debug)]
struct JointLinks {
    slide: Option<usize>,
    lean: Option<[usize; 2]>,
    /// The link that carries the mass.
    body: usize,
    /// Two coordinates from here on.
    radial: Option<usize>,
    axial: Option<usize>,
    /// Two coordinates from here on.
    tilt: Option<usize>,
}

/// The multibody, its joints' frames as last placed, and rapier around it.
pub(super) struct World {
    rapier: PhysicsWorld,
    multibody: MultibodyIndex,
    links: Vec<JointLinks>,
    tool: usize,
    /// Directions of the x axes of the radial and the tilt coordinates in the joint frame, rad.
    directions: Vec<[f64; 2]>,
    weights: Vec<Vector3<f64>>,
}

impl World {
    pub(super) fn new(arm: &TrueArm) -> Self {
        let mut rapier = PhysicsWorld { gravity: vector_to_rapier(&arm.gravity_in_base), ..PhysicsWorld::default() };
        rapier.integration_parameters = IntegrationParameters {
            dt: TIME_STEP_S,
            min_ccd_dt: TIME_STEP_S,
            num_solver_iterations: 1,
            num_internal_pgs_iterations: 4,
            ..IntegrationParameters::default()
        };
        let softness =
            SpringCoefficients { natural_frequency: STIFFNESS / (std::f64::consts::TAU * TIME_STEP_S), damping_ratio: 1.0 };
        let root = rapier.bodies.insert(RigidBodyBuilder::fixed());
        let mut builder = Builder { rapier, last: root, count: 0, freedoms: 0, softness };
        let mut links = Vec::new();
        for (clearance, inertial) in arm.clearances.iter().zip(&arm.inertials) {
            let no_mass = MassProperties::default();
            let mass = MassProperties::with_inertia_matrix(
                vector_to_rapier(&inertial.centre_of_mass_in_link.coords),
                inertial.mass_kg,
                matrix_to_rapier(&inertial.inertia_in_link),
            );
            let leans = clearance.tilt_rad > 0.0;
            let mut free = JointAxesMask::empty();
            let mut limits = Vec::new();
            let (mut radial, mut axial, mut tilt) = (None, None, None);
            if clearance.radial_m > 0.0 {
                radial = Some(builder.freedoms);
                free |= JointAxesMask::LIN_X | JointAxesMask::LIN_Y;
                limits.push((JointAxis::LinX, clearance.radial_m));
            }
            if clearance.axial_m > 0.0 {
                axial = Some(builder.freedoms + if radial.is_some() { 2 } else { 0 });
                free |= JointAxesMask::LIN_Z;
                limits.push((JointAxis::LinZ, clearance.axial_m));
            }
            let slide = (!free.is_empty()).then(|| builder.link(free, &limits, if leans { no_mass } else { mass }));
            let lean = leans.then(|| {
                tilt = Some(builder.freedoms);
                let first = builder.link(JointAxesMask::ANG_X, &[(JointAxis::AngX, clearance.tilt_rad)], no_mass);
                [first, builder.link(JointAxesMask::ANG_Y, &[], mass)]
            });
            let body = match (slide, lean) {
                (_, Some([_, second])) => second,
                (Some(slide), None) => slide,
                (None, None) => builder.link(JointAxesMask::empty(), &[], mass),
            };
            links.push(JointLinks { slide, lean, body, radial, axial, tilt });
        }
        let tool = builder.link(JointAxesMask::empty(), &[], MassProperties::default());
        let Builder { mut rapier, last, .. } = builder;
        // A step of no duration: rapier takes notice of bodies, masses and joints.
        rapier.integration_parameters.dt = 0.0;
        rapier.step();
        rapier.integration_parameters.dt = TIME_STEP_S;
        let multibody = rapier.multibody_joints.rigid_body_link(last).expect("the tool is a link of the multibody").multibody;
        let weights = arm.inertials.iter().map(|inertial| arm.gravity_in_base * inertial.mass_kg).collect();
        let directions = vec![[0.0; 2]; links.len()];
        World { rapier, multibody, links, tool, directions, weights }
    }

    fn multibody(&self) -> &Multibody {
        &self.rapier.multibody_joints[self.multibody]
    }

    fn multibody_mut(&mut self) -> &mut Multibody {
        self.rapier.multibody_joints.get_multibody_mut_internal(self.multibody).expect("the multibody is never removed")
    }

    fn link(&self, link: usize) -> &MultibodyLink {
        self.multibody().link(link).expect("links are never removed")
    }

    /// Number of free coordinates.
    pub(super) fn freedoms(&self) -> usize {
        self.multibody().ndofs()
    }

    /// Puts the joints' frames where the commanded coordinates and the growth of the links want them, the play of each joint at
    /// `plays`, everything at rest.
    pub(super) fn place(&mut self, arm: &TrueArm, joints: &[f64], growth: &[f64], plays: &[Play]) {
        for (joint, q) in joints.iter().enumerate() {
            let JointLinks { slide, lean, body, radial: radial_coordinate, axial: axial_coordinate, .. } = self.links[joint];
            let play = plays[joint];
            let (inboard, outboard) = arm.motions(joint, *q);
            let mut reached = arm.grown_segment(joint, growth) * inboard;
            self.directions[joint] = [direction(&play.radial), direction(&play.tilt)];
            let [radial, leaning] = self.directions[joint].map(turn_about_z);
            if let Some(slide) = slide {
                let mut coordinates = Vec::with_capacity(3);
                if radial_coordinate.is_some() {
                    coordinates.extend([play.radial.norm(), 0.0]);
                }
                if axial_coordinate.is_some() {
                    coordinates.push(play.axial);
                }
                let after = if body == slide { radial.inverse() * outboard } else { radial.inverse() };
                self.set_link(slide, &(reached * radial), &after, &coordinates);
                reached = Pose::identity();
            }
            if let Some([first, second]) = lean {
                self.set_link(first, &(reached * leaning), &Pose::identity(), &[play.tilt.norm()]);
                self.set_link(second, &Pose::identity(), &(leaning.inverse() * outboard), &[0.0]);
            }
            if slide.is_none() && lean.is_none() {
                self.set_link(body, &reached, &outboard, &[]);
            }
        }
        let tool = self.tool;
        self.set_link(tool, &arm.grown_segment(joints.len(), growth), &Pose::identity(), &[]);
        self.multibody_mut().generalized_velocity_mut().fill(0.0);
        let PhysicsWorld { multibody_joints, bodies, .. } = &mut self.rapier;
        let multibody = multibody_joints.get_multibody_mut_internal(self.multibody).expect("the multibody is never removed");
        multibody.forward_kinematics(bodies, false);
    }

    /// A link whose joint has the fixed transforms `before` and `after` around its coordinates.
    fn set_link(&mut self, link: usize, before: &Pose, after: &Pose, coordinates: &[f64]) {
        let joint = &mut self.multibody_mut().link_mut(link).expect("links are never removed").joint;
        let mut data = joint.data;
        data.local_frame1 = pose_to_rapier(before);
        data.local_frame2 = pose_to_rapier(&after.inverse());
        *joint = MultibodyJoint::new(data, false);
        if !coordinates.is_empty() {
            joint.apply_displacement(coordinates);
        }
    }

    /// Where the joints lie in their clearances, read from rapier's coordinates.
    pub(super) fn plays(&self) -> Vec<Play> {
        let coordinates = |link: usize| self.link(link).joint.coords();
        let mut plays = Vec::with_capacity(self.links.len());
        for (joint, links) in self.links.iter().enumerate() {
            let [radial, leaning] = self.directions[joint];
            let mut play = Play::CENTRE;
            if let Some(slide) = links.slide {
                let coordinates = coordinates(slide);
                play.radial = turned(radial, coordinates[0], coordinates[1]);
                play.axial = coordinates[2];
            }
            if let Some([first, second]) = links.lean {
                play.tilt = turned(leaning, coordinates(first)[3], coordinates(second)[4]);
            }
            plays.push(play);
        }
        plays
    }

    /// The loads on the joints' plays: gravity through rapier's Jacobians of the links, as last placed.
    pub(super) fn loads(&self) -> Vec<Load> {
        let multibody = self.multibody();
        let mut loads = vec![0.0; multibody.ndofs()];
        for (outer, weight) in self.weights.iter().enumerate() {
            let jacobian = multibody.body_jacobian(self.links[outer].body);
            for (load, column) in loads.iter_mut().zip(jacobian.column_iter()) {
                *load += column[0] * weight.x + column[1] * weight.y + column[2] * weight.z;
            }
        }
        let of_joint = |(links, [radial, leaning]): (&JointLinks, &[f64; 2])| Load {
            radial: links.radial.map_or_else(Vector2::zeros, |first| turned(*radial, loads[first], loads[first + 1])),
            axial: links.axial.map_or(0.0, |coordinate| loads[coordinate]),
            tilt: links.tilt.map_or_else(Vector2::zeros, |first| turned(*leaning, loads[first], loads[first + 1])),
        };
        self.links.iter().zip(&self.directions).map(of_joint).collect()
    }

    /// Sets the damping: a step carries each coordinate that its load decides just across its clearance, and those that friction
    /// holds nowhere. Damping sets how fast the arm comes to rest, never where.
    pub(super) fn damp(&mut self, arm: &TrueArm, loads: &[Load], decisions: &[Decision]) {
        let damping_of = |clearance: f64, load: f64, holding: f64, by| {
            let across = |load: f64| TIME_STEP_S * load / (REACH_PER_STEP * clearance);
            // The load of a decided coordinate was above the threshold in the middle, and hardly changes.
            if by == SeatedBy::Load { across(load.max(0.5 * holding)) } else { HELD * across(holding) }
        };
        for (joint, load) in loads.iter().enumerate() {
            let (clearance, holding, by) = (arm.clearances[joint], arm.holding[joint], decisions[joint]);
            let links = self.links[joint];
            let multibody = self.multibody_mut();
            let mut set = |coordinate: usize, damping: f64| multibody.damping_mut()[coordinate] = damping;
            if let Some(radial) = links.radial {
                let damping = damping_of(clearance.radial_m, load.radial.norm(), holding.force, by.radial);
                set(radial, damping);
                set(radial + 1, damping);
            }
            if let Some(axial) = links.axial {
                set(axial, damping_of(clearance.axial_m, load.axial.abs(), holding.force, by.axial));
            }
            if let Some(tilt) = links.tilt {
                let damping = damping_of(clearance.tilt_rad, load.tilt.norm(), holding.moment, by.tilt);
                set(tilt, damping);
                set(tilt + 1, damping);
            }
        }
    }

    /// One step of the simulation.
    pub(super) fn step(&mut self) {
        self.rapier.step();
    }

    /// `base_from_tool`, as last placed.
    pub(super) fn base_from_tool(&self) -> Pose {
        self.base_from(self.tool)
    }

    /// `base_from_link` of the link that joint `joint` moves, as last placed.
    pub(super) fn base_from_link(&self, joint: usize) -> Pose {
        self.base_from(self.links[joint].body)
    }

    fn base_from(&self, link: usize) -> Pose {
        pose_from_rapier(self.link(link).local_to_world())
    }
}

/// Where a limit holds a coordinate, relative to the edge of the clearance.
pub(super) const fn indentation() -> f64 {
    1.0 + REACH_PER_STEP / (STIFFNESS * STIFFNESS)
}

struct Builder {
    rapier: PhysicsWorld,
    last: RigidBodyHandle,
    count: usize,
    freedoms: usize,
    softness: SpringCoefficients<f64>,
}

impl Builder {
    /// Adds a link after the last one and returns its index in the multibody.
    fn link(&mut self, free: JointAxesMask, limits: &[(JointAxis, f64)], mass: MassProperties) -> usize {
        let body = RigidBodyBuilder::dynamic().additional_mass_properties(mass).can_sleep(false);
        let body = self.rapier.bodies.insert(body);
        let mut joint = GenericJoint::new(free.complement());
        joint.softness = self.softness;
        for (axis, limit) in limits {
            joint.set_limits(*axis, [-limit, *limit]);
        }
        self.rapier.multibody_joints.insert(self.last, body, joint, true).expect("a chain has no loop");
        self.last = body;
        self.count += 1;
        self.freedoms += free.bits().count_ones() as usize;
        self.count
    }
}

fn direction(v: &Vector2<f64>) -> f64 {
    libm::atan2(v.y, v.x)
}

/// The vector `(x, y)` of a frame whose x axis points in `direction` (rad).
fn turned(direction: f64, x: f64, y: f64) -> Vector2<f64> {
    let (sine, cosine) = libm::sincos(direction);
    Vector2::new(cosine * x - sine * y, sine * x + cosine * y)
}
