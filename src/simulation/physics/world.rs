//! The rapier world: one multibody, gravity, nothing else.
//!
//! Every joint of the arm becomes up to three rapier links in series, the last of which carries the mass:
//! one that slides (radial: x, y; axial: z), and two that tilt, about x and then about y (rapier has no joint with two free
//! angular axes). After the joint's motion follows one link for each coordinate in which the joint or its link yields (see
//! [`Coordinate`]), held by a passive spring, by limits, or by limits and friction. A joint with none of these is one link with all
//! axes locked. Links in between have no mass.
//!
//! A disc is a limit on one axis: rapier limits coordinates one by one (and ignores `coupled_axes` between links of a
//! multibody). Therefore the frame of every radial and tilt coordinate is turned, before each step, so that its x axis points
//! to where the joint lies: then x is the distance from the middle, which is limited, and y is a step along the circle, which
//! is not.

use nalgebra::{Point3, Vector2, Vector3};
use rapier3d::dynamics::{
    GenericJoint, IntegrationParameters, JointAxesMask, JointAxis, MassProperties, Multibody, MultibodyIndex, MultibodyJoint,
    MultibodyLink, RigidBodyBuilder, RigidBodyHandle, SpringCoefficients,
};
use rapier3d::pipeline::PhysicsWorld;

use super::clearance::SeatedBy;
use super::convert::{matrix_to_rapier, pose_from_rapier, pose_to_rapier, vector_to_rapier};
use super::coordinate::{Axis, Coordinate, Direction, Hold, Law};
use super::play::{Decision, Load, Play};
use super::true_arm::{Placement, TrueArm, turn_about_z};
use crate::arm::JointKind;
use crate::arm::frames::Pose;

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

/// A step may push a coordinate that friction holds by as little as this share of its way before the solver's few sweeps no longer
/// overcome the friction: its damping is so many times smaller than what would let the friction alone move it across.
const LEAST_PUSH: f64 = 1e-4;

/// The rapier link of a coordinate.
#[derive(Clone, Copy, Debug)]
struct YieldingLink {
    link: usize,
    /// By index in rapier's generalised coordinates.
    degrees_of_freedom: usize,
    axis: JointAxis,
}

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
    /// First and last of its links in `World::yielding`.
    yielding: (usize, usize),
    /// The first of all its links.
    first: usize,
}

/// The multibody, its joints' frames as last placed, and rapier around it.
pub(in crate::simulation) struct World {
    rapier: PhysicsWorld,
    multibody: MultibodyIndex,
    links: Vec<JointLinks>,
    tool: usize,
    /// Directions of the x axes of the radial and the tilt coordinates in the joint frame, rad.
    directions: Vec<[f64; 2]>,
    weights: Vec<Vector3<f64>>,
    yielding: Vec<YieldingLink>,
    /// The frame of each joint in the last link of the joint before it, as last placed.
    inboard_from_joint: Vec<Pose>,
    payload_kg: f64,
}

/// Where what yields is to be put: the play of each joint, each coordinate of [`TrueArm::coordinates`], and what holds these.
pub(super) struct Yielded<'a> {
    pub(super) plays: &'a [Play],
    pub(super) coordinates: &'a [f64],
    pub(super) holds: &'a [Hold],
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
        let mut yielding = Vec::new();
        for (joint, (clearance, inertial)) in arm.clearances.iter().zip(&arm.inertials).enumerate() {
            let first = builder.count + 1;
            let coordinates: Vec<&Coordinate> = arm.coordinates.iter().filter(|other| other.joint == joint).collect();
            let yields = !coordinates.is_empty();
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
            let slide = (!free.is_empty()).then(|| builder.link(free, &limits, if leans || yields { no_mass } else { mass }));
            let lean = leans.then(|| {
                tilt = Some(builder.freedoms);
                let first = builder.link(JointAxesMask::ANG_X, &[(JointAxis::AngX, clearance.tilt_rad)], no_mass);
                [first, builder.link(JointAxesMask::ANG_Y, &[], if yields { no_mass } else { mass })]
            });
            let from = yielding.len();
            for (index, coordinate) in coordinates.iter().enumerate() {
                let axis = axis_of(coordinate, arm.kinds[joint]);
                // Limits from the start, so that rapier makes room for their constraints.
                let limits: &[(JointAxis, f64)] = match coordinate.law {
                    Law::LostMotion { half_width } | Law::Backlash { half_width } => &[(axis, half_width)],
                    Law::Spring { .. } | Law::Compensated { .. } | Law::Hardening { .. } | Law::Creep { .. } => &[],
                };
                let degrees_of_freedom = builder.freedoms;
                let mass = if index + 1 == coordinates.len() { mass } else { no_mass };
                yielding.push(YieldingLink { link: builder.link(axis.into(), limits, mass), degrees_of_freedom, axis });
            }
            let body = match (yielding[from..].last(), slide, lean) {
                (Some(last), _, _) => last.link,
                (None, _, Some([_, second])) => second,
                (None, Some(slide), None) => slide,
                (None, None, None) => builder.link(JointAxesMask::empty(), &[], mass),
            };
            links.push(JointLinks { slide, lean, body, radial, axial, tilt, yielding: (from, yielding.len()), first });
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
        let inboard_from_joint = vec![Pose::identity(); links.len()];
        let mut world =
            World { rapier, multibody, links, tool, directions, weights, yielding, inboard_from_joint, payload_kg: 0.0 };
        // Springs need no damping: a step of one second outweighs inertia, and goes nearly all the way to rest.
        let free: Vec<usize> = world.yielding.iter().map(|yielding| yielding.degrees_of_freedom).collect();
        free.into_iter().for_each(|degrees_of_freedom| world.multibody_mut().damping_mut()[degrees_of_freedom] = 0.0);
        world
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

    /// Puts the joints' frames where `placement` wants them, and what yields where `yielded` says, everything at rest.
    pub(super) fn place(&mut self, arm: &TrueArm, placement: &Placement, yielded: &Yielded) {
        self.load_tool(arm, placement.payload_kg);
        for (joint, q) in placement.joints.iter().enumerate() {
            let JointLinks { slide, lean, body, radial: radial_coordinate, axial: axial_coordinate, yielding, .. } =
                self.links[joint];
            let play = yielded.plays[joint];
            let (inboard, outboard) = arm.motions(joint, *q);
            let mut reached = arm.segment(joint, placement) * inboard;
            self.inboard_from_joint[joint] = reached;
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
                self.set_link(slide, &(reached * radial), &after, &coordinates, None);
                reached = Pose::identity();
            }
            if let Some([first, second]) = lean {
                self.set_link(first, &(reached * leaning), &Pose::identity(), &[play.tilt.norm()], None);
                let after = if body == second { leaning.inverse() * outboard } else { leaning.inverse() };
                self.set_link(second, &Pose::identity(), &after, &[0.0], None);
                reached = Pose::identity();
            }
            let mut before = reached * outboard;
            for index in yielding.0..yielding.1 {
                let YieldingLink { link, axis, .. } = self.yielding[index];
                let hold = Some((axis, yielded.holds[index]));
                let hinge = arm.hinge(&arm.coordinates[index], placement);
                self.set_link(link, &(before * hinge), &hinge.inverse(), &[yielded.coordinates[index]], hold);
                before = Pose::identity();
            }
            if slide.is_none() && lean.is_none() && yielding.0 == yielding.1 {
                self.set_link(body, &reached, &outboard, &[], None);
            }
        }
        let tool = self.tool;
        self.set_link(tool, &arm.segment(placement.joints.len(), placement), &Pose::identity(), &[], None);
        self.multibody_mut().generalized_velocity_mut().fill(0.0);
        let PhysicsWorld { multibody_joints, bodies, .. } = &mut self.rapier;
        let multibody = multibody_joints.get_multibody_mut_internal(self.multibody).expect("the multibody is never removed");
        multibody.forward_kinematics(bodies, false);
    }

    /// Hangs the payload on the tool: a point mass at its origin.
    fn load_tool(&mut self, arm: &TrueArm, payload_kg: f64) {
        if payload_kg.to_bits() == self.payload_kg.to_bits() {
            return;
        }
        self.payload_kg = payload_kg;
        if self.weights.len() == self.links.len() {
            self.weights.push(Vector3::zeros());
        }
        if let Some(weight) = self.weights.last_mut() {
            *weight = arm.gravity_in_base * payload_kg;
        }
        let tool = self.link(self.tool).rigid_body_handle();
        let PhysicsWorld { bodies, colliders, .. } = &mut self.rapier;
        if let Some(body) = bodies.get_mut(tool) {
            let mass = MassProperties { inv_mass: 0.0, ..MassProperties::default() };
            let mass = if payload_kg > 0.0 { MassProperties { inv_mass: 1.0 / payload_kg, ..mass } } else { mass };
            body.set_additional_mass_properties(mass, true);
            body.recompute_mass_properties_from_colliders(colliders);
        }
    }

    /// A link whose joint has the fixed transforms `before` and `after` around its coordinates, and what holds it.
    fn set_link(&mut self, link: usize, before: &Pose, after: &Pose, coordinates: &[f64], hold: Option<(JointAxis, Hold)>) {
        let joint = &mut self.multibody_mut().link_mut(link).expect("links are never removed").joint;
        let mut data = joint.data;
        data.local_frame1 = pose_to_rapier(before);
        data.local_frame2 = pose_to_rapier(&after.inverse());
        if let Some((axis, Hold::Between { lower, upper })) = hold {
            data.set_limits(axis, [lower, upper]);
        }
        *joint = MultibodyJoint::new(data, false);
        if let Some((axis, Hold::Spring { stiffness, rest })) = hold {
            joint.set_spring(axis as usize, stiffness, rest);
        }
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

    /// Where the coordinates that yield are, read from rapier's.
    pub(super) fn coordinates(&self) -> Vec<f64> {
        self.yielding.iter().map(|yielding| self.link(yielding.link).joint.coords()[yielding.axis as usize]).collect()
    }

    /// Gravity's load on every free coordinate of rapier's, through the Jacobians of the links as last placed.
    fn generalised_loads(&self) -> Vec<f64> {
        let multibody = self.multibody();
        let mut loads = vec![0.0; multibody.ndofs()];
        let bodies = self.links.iter().map(|links| links.body).chain([self.tool]);
        for (body, weight) in bodies.zip(&self.weights) {
            let jacobian = multibody.body_jacobian(body);
            for (load, column) in loads.iter_mut().zip(jacobian.column_iter()) {
                *load += column[0] * weight.x + column[1] * weight.y + column[2] * weight.z;
            }
        }
        loads
    }

    /// Frame of joint `joint` before its motion, as last placed.
    pub(in crate::simulation) fn base_from_joint(&self, joint: usize) -> Pose {
        let first = self.link(self.links[joint].first);
        let inboard = match first.parent_id() {
            Some(parent) => self.base_from(parent),
            None => Pose::identity(),
        };
        inboard * self.inboard_from_joint[joint]
    }

    /// The moment of gravity on joint `from`'s link, all outboard of it and the payload, about `centre`, N·m, as last placed.
    pub(in crate::simulation) fn moment_about(&self, arm: &TrueArm, centre: &Vector3<f64>, from: usize) -> Vector3<f64> {
        let masses = (from..self.links.len())
            .map(|outer| self.base_from(self.links[outer].body) * arm.inertials[outer].centre_of_mass_in_link)
            .chain([Point3::from(self.base_from_tool().translation.vector)]);
        masses.zip(&self.weights[from..]).map(|(point, weight)| (point.coords - centre).cross(weight)).sum()
    }

    /// The loads on the coordinates that yield: torques about their axes (forces along them).
    pub(super) fn coordinate_loads(&self) -> Vec<f64> {
        let loads = self.generalised_loads();
        self.yielding.iter().map(|yielding| loads[yielding.degrees_of_freedom]).collect()
    }

    /// The loads on the joints' plays: gravity through rapier's Jacobians of the links, as last placed.
    pub(super) fn loads(&self) -> Vec<Load> {
        let loads = self.generalised_loads();
        let of_joint = |(links, [radial, leaning]): (&JointLinks, &[f64; 2])| Load {
            radial: links.radial.map_or_else(Vector2::zeros, |first| turned(*radial, loads[first], loads[first + 1])),
            axial: links.axial.map_or(0.0, |coordinate| loads[coordinate]),
            tilt: links.tilt.map_or_else(Vector2::zeros, |first| turned(*leaning, loads[first], loads[first + 1])),
            along: 0.0,
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
            let (clearance, holding, by) = (arm.clearances[joint], arm.fit_holding(joint, self.payload_kg), decisions[joint]);
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

    /// The same for the coordinates that yield and have play: `loads` are theirs, `by` what decides them, `friction` what holds
    /// those with friction, N·m or N.
    pub(super) fn damp_coordinates(&mut self, arm: &TrueArm, loads: &[f64], by: &[SeatedBy], friction: &[f64]) {
        for (index, coordinate) in arm.coordinates.iter().enumerate() {
            let degrees_of_freedom = self.yielding[index].degrees_of_freedom;
            match coordinate.law {
                Law::LostMotion { half_width } => {
                    let across = |load: f64| TIME_STEP_S * load / (REACH_PER_STEP * half_width);
                    let holding = arm.turn_holding(coordinate.joint);
                    let damping = if by[index] == SeatedBy::Load {
                        across(loads[index].abs().max(0.5 * holding))
                    } else {
                        HELD * across(holding)
                    };
                    self.multibody_mut().damping_mut()[degrees_of_freedom] = damping;
                }
                Law::Backlash { half_width } => {
                    let multibody = self.multibody_mut();
                    multibody.frictions_mut()[degrees_of_freedom] = friction[index];
                    multibody.damping_mut()[degrees_of_freedom] = TIME_STEP_S * friction[index] / (LEAST_PUSH * half_width);
                }
                Law::Spring { .. } | Law::Compensated { .. } | Law::Hardening { .. } | Law::Creep { .. } => {}
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

fn axis_of(coordinate: &Coordinate, kind: JointKind) -> JointAxis {
    match (coordinate.direction, kind) {
        (Direction::Joint, JointKind::Revolute) => JointAxis::AngZ,
        (Direction::Joint, JointKind::Prismatic) => JointAxis::LinZ,
        (Direction::Across { axis: Axis::FirstX | Axis::LastX, .. }, _) => JointAxis::AngX,
        (Direction::Across { axis: Axis::Y, .. }, _) => JointAxis::AngY,
    }
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
