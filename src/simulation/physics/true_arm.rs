//! The true arm in plain numbers: what both the multibody and the static seat are made of.

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::clearance::{Clearance, SeatedBy};
use super::conditions::Conditions;
use super::coordinate::{BEAM_POINTS, Bend, Coordinate, Direction};
use super::drive_train::Drive;
use super::error::PhysicsError;
use super::mechanism::{Held, Mechanisms, Reactions, Shift, shifted};
use super::play::{Decision, Load};
use crate::arm::frames::Pose;
use crate::arm::{Arm, Inertial};
use crate::arm::{JointKind, Step};
use crate::simulation::effect::Effect;

/// Segments, masses and clearances of the arm with its true parameters.
#[derive(Clone, Debug)]
pub(in crate::simulation) struct TrueArm {
    /// `link_from_joint` of each joint, and last `link_from_tool`; see [`crate::arm::ChainAt::segments`].
    pub(super) segments: Vec<Pose>,
    /// How each joint moves.
    pub(super) kinds: Vec<JointKind>,
    /// Play of each joint.
    pub(super) clearances: Vec<Clearance>,
    held: Vec<Held>,
    /// Drive train of each joint.
    pub(super) drives: Vec<Drive>,
    /// Coordinates that yield, from the base outwards.
    pub(super) coordinates: Vec<Coordinate>,
    /// Expansion of each link, base link first, 1/K.
    expansion_per_k: Vec<f64>,
    /// Expansion of the base link with the temperature of the first link that moves, 1/K.
    foot_expansion_with_first_link_per_k: f64,
    base_shifts: Vec<Shift>,
    tool_shifts: Vec<Shift>,
    /// Mass that the tool carries beyond what is believed, kg.
    excess_kg: f64,
    /// What answers to the load.
    pub(super) reactions: Reactions,
    /// Mass distribution of the link that each joint moves, in the frame after the joint's motion.
    pub(super) inertials: Vec<Inertial>,
    /// Pose of that link's frame in the frame after the joint's motion: turned where a URDF's axis is not z.
    pub(super) joint_from_link: Vec<Pose>,
    /// m/s².
    pub(in crate::simulation) gravity_in_base: Vector3<f64>,
    /// Pose of the base link's frame in the chain's first frame.
    pub(super) base_from_base_link: Pose,
    /// Below these loads a joint's coordinates do not move.
    holding: Vec<Holding>,
    /// Weight of the arm outboard of each joint, N, and its length, m.
    outboard: Vec<[f64; 2]>,
}

/// Where an arm is to be, but for what yields.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::simulation) struct Placement {
    /// Outputs of the drive trains, rad or m.
    pub(in crate::simulation) joints: Vec<f64>,
    /// Direction of each joint's last move: 1, −1, or 0 where it stood.
    pub(in crate::simulation) directions: Vec<f64>,
    /// Growth of each segment, base to first joint first; 1 where nothing grows.
    pub(super) growth: Vec<f64>,
    /// `world_from_base`: where the base has moved to.
    pub(in crate::simulation) base_shift: Option<Pose>,
    /// Where the tool has moved to on its link.
    pub(super) tool_shift: Option<Pose>,
    /// Mass at the tool's origin, kg.
    pub(in crate::simulation) payload_kg: f64,
}

/// 1, −1, or 0 where nothing moved.
fn direction(way: f64) -> f64 {
    if way == 0.0 { 0.0 } else { way.signum() }
}

/// Loads below which the friction of a fit keeps it where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Holding {
    /// N, for the radial and the axial coordinate.
    pub(super) force: f64,
    /// N·m, for the tilt.
    pub(super) moment: f64,
}

/// Rounding leaves about 1e-14 N on an axis without load; nothing real is this small.
const SMALLEST_HOLDING: f64 = 1e-9;

/// Threshold of gravity-seated lost motion over the friction of the fits.
const LOST_MOTION_SHARE: f64 = 2e-3;

/// A link that is shorter is no beam, m.
const SHORTEST_BEAM_M: f64 = 1e-3;

impl TrueArm {
    pub(super) fn new(arm: &Arm, parameters_true: &[f64], effects: &[Effect], holding_ratio: f64) -> Result<Self, PhysicsError> {
        let count = arm.joint_count();
        check_count("true parameters", parameters_true.len(), arm.chain.parameters.len())?;
        check_count("links (one per joint, and the base)", arm.links.len(), count + 1)?;
        for (parameter, value) in arm.chain.parameters.iter().zip(parameters_true) {
            check_finite(|| format!("true parameter `{}`", parameter.name), *value)?;
        }
        for component in &arm.gravity_in_base {
            check_finite(|| "gravity".to_owned(), *component)?;
        }
        let kinds: Vec<JointKind> = arm.chain.joints.iter().map(|joint| joint.kind).collect();
        let parts = Mechanisms::new(&kinds, effects)?;
        let joint_from_link: Vec<Pose> = (0..count).map(|joint| joint_from_link(arm, joint)).collect();
        let inertials = (arm.links[1..].iter().zip(&joint_from_link))
            .map(|(link, joint_from_link)| checked_inertial(link).map(|inertial| moved(inertial, joint_from_link)))
            .collect::<Result<Vec<_>, _>>()?;
        let at = arm.chain.at(parameters_true);
        let base = arm.chain.frame_names().iter().position(|name| *name == arm.links[0].name);
        let base_from_base_link = base.map_or_else(Pose::identity, |index| at.frames(&vec![0.0; count])[index]);
        let segments = at.segments();
        let gravity = arm.gravity_in_base.norm();
        let outboard: Vec<[f64; 2]> = (0..count)
            .map(|joint| {
                let weight = gravity * inertials[joint..].iter().map(|inertial| inertial.mass_kg).sum::<f64>();
                let reach: f64 = segments[joint + 1..].iter().map(|segment| segment.translation.vector.norm()).sum();
                [weight, reach]
            })
            .collect();
        let holding = outboard
            .iter()
            .map(|[weight, reach]| Holding {
                force: (holding_ratio * weight).max(SMALLEST_HOLDING),
                moment: (holding_ratio * weight * reach).max(SMALLEST_HOLDING),
            })
            .collect();
        Ok(TrueArm {
            segments,
            kinds,
            clearances: parts.clearances,
            held: parts.held,
            drives: parts.drives,
            coordinates: parts.coordinates,
            expansion_per_k: parts.expansion_per_k,
            foot_expansion_with_first_link_per_k: parts.foot_expansion_with_first_link_per_k,
            base_shifts: parts.base_shifts,
            tool_shifts: parts.tool_shifts,
            excess_kg: parts.excess_kg,
            reactions: parts.reactions,
            inertials,
            joint_from_link,
            gravity_in_base: arm.gravity_in_base,
            base_from_base_link,
            holding,
            outboard,
        })
    }

    pub(super) fn joint_count(&self) -> usize {
        self.kinds.len()
    }

    /// Where the arm is to be under `conditions`, no load acting on it.
    pub(super) fn placement(&self, conditions: &Conditions) -> Placement {
        let share = conditions.share();
        Placement {
            joints: self.drives.iter().enumerate().map(|(joint, drive)| drive.output(joint, conditions)).collect(),
            directions: conditions.joints.iter().zip(conditions.from).map(|(to, from)| direction(to - from)).collect(),
            growth: self.growth(conditions.rise_k),
            base_shift: shifted(&self.base_shifts, share),
            tool_shift: shifted(&self.tool_shifts, share),
            // Less than nothing hangs on no tool.
            payload_kg: (conditions.payload_kg + self.excess_kg).max(0.0),
        }
    }

    /// Growth of each segment where the links are warmer by `rise_k`, base link first.
    fn growth(&self, rise_k: &[f64]) -> Vec<f64> {
        let mut growth: Vec<f64> = self.expansion_per_k.iter().zip(rise_k).map(|(per_k, rise)| 1.0 + per_k * rise).collect();
        growth[0] += self.foot_expansion_with_first_link_per_k * rise_k[1];
        growth
    }

    /// Where the hinge of `coordinate` is, seen from the frame after its joint's motion.
    pub(super) fn hinge(&self, coordinate: &Coordinate, placement: &Placement) -> Pose {
        let point = match coordinate.direction {
            Direction::Joint | Direction::Across { bend: Bend::Joint, .. } => return Pose::identity(),
            Direction::Across { bend: Bend::Beam { point }, .. } => point,
        };
        // From the joint's origin, which does not slide with it, to the next one's.
        let start = match self.kinds[coordinate.joint] {
            JointKind::Revolute => Vector3::zeros(),
            JointKind::Prismatic => -Vector3::z() * placement.joints[coordinate.joint],
        };
        let along = self.segment(coordinate.joint + 1, placement).translation.vector - start;
        let length = along.norm();
        // Too short to have a direction: a hinge at the joint.
        if length < SHORTEST_BEAM_M {
            return Pose::identity();
        }
        let z = along / length;
        let x = z.cross(&if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() }).normalize();
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
        Pose::from_parts(Translation3::from(start + along * BEAM_POINTS[point]), UnitQuaternion::from_rotation_matrix(&axes))
    }

    /// Loads below which friction keeps the play of joint `joint` in its middle, with a payload on the tool.
    pub(super) fn fit_holding(&self, joint: usize, payload_kg: f64) -> Holding {
        let [weight, reach] = self.outboard[joint];
        let all = weight + self.gravity_in_base.norm() * payload_kg;
        let Held { force, moment } = self.held[joint];
        let usual = self.holding[joint];
        Holding {
            force: force.map_or(usual.force, |share| (share * all).max(SMALLEST_HOLDING)),
            moment: moment.map_or(usual.moment, |share| (share * all * reach).max(SMALLEST_HOLDING)),
        }
    }

    /// Segment `index`, grown with the link it is on; the base and the tool where they have moved to.
    pub(super) fn segment(&self, index: usize, placement: &Placement) -> Pose {
        let growth = placement.growth[index];
        let grown = |segment: &Pose| Pose::from_parts(Translation3::from(segment.translation.vector * growth), segment.rotation);
        let mut segment = if index == 0 {
            // Where the arm stands in the cell is no link: only the foot grows.
            self.base_from_base_link * grown(&(self.base_from_base_link.inverse() * self.segments[0]))
        } else {
            grown(&self.segments[index])
        };
        if let (0, Some(world_from_base)) = (index, &placement.base_shift) {
            segment = world_from_base * segment;
        }
        if let (true, Some(shift)) = (index == self.joint_count(), &placement.tool_shift) {
            segment *= shift;
        }
        segment
    }

    /// The load about the axis of joint `joint` (along it where it slides) below which a play that gravity seats stays in its middle,
    /// N·m or N: as little as keeps a step across the play quasi-static.
    pub(super) fn turn_holding(&self, joint: usize) -> f64 {
        let holding = self.turn_friction(joint);
        (holding * LOST_MOTION_SHARE).max(SMALLEST_HOLDING)
    }

    /// The friction of a drive train that a load well below what it was built for does not overcome, N·m or N.
    pub(super) fn turn_friction(&self, joint: usize) -> f64 {
        let holding = self.holding[joint];
        if self.kinds[joint] == JointKind::Revolute { holding.moment } else { holding.force }
    }

    /// The motions of joint `joint` at coordinate `q`: inboard of its play, and outboard of it.
    pub(super) fn motions(&self, joint: usize, q: f64) -> (Pose, Pose) {
        match self.kinds[joint] {
            JointKind::Revolute => (Pose::identity(), turn_about_z(q)),
            JointKind::Prismatic => (Pose::translation(0.0, 0.0, q), Pose::identity()),
        }
    }

    /// What decides the coordinates of each joint's play under the loads `loads`, with a payload on the tool.
    pub(super) fn decisions(&self, loads: &[Load], payload_kg: f64) -> Vec<Decision> {
        let by = |clearance: f64, load: f64, holding: f64| {
            if clearance == 0.0 {
                SeatedBy::Fit
            } else if load >= holding {
                SeatedBy::Load
            } else {
                SeatedBy::Friction
            }
        };
        let joints = self.clearances.iter().zip(loads).enumerate();
        joints
            .map(|(joint, (clearance, load))| (clearance, self.fit_holding(joint, payload_kg), load))
            .map(|(clearance, holding, load)| Decision {
                radial: by(clearance.radial_m, load.radial.norm(), holding.force),
                axial: by(clearance.axial_m, load.axial.abs(), holding.force),
                tilt: by(clearance.tilt_rad, load.tilt.norm(), holding.moment),
            })
            .collect()
    }
}

/// Where the frame of the link that `joint` moves lies in the frame after the joint's motion.
fn joint_from_link(arm: &Arm, joint: usize) -> Pose {
    let after =
        arm.chain.steps.iter().skip_while(|step| !matches!(step, Step::Joint { joint: other } if *other == joint)).skip(1);
    let fixed = after.map_while(|step| match step {
        Step::Fixed(pose) => Some(pose),
        _ => None,
    });
    fixed.fold(Pose::identity(), |joint_from_here, pose| joint_from_here * pose)
}

/// The mass in the joint's frame; to the bit as it is where that is the link's.
fn moved(inertial: Inertial, joint_from_link: &Pose) -> Inertial {
    if *joint_from_link == Pose::identity() { inertial } else { inertial.moved(joint_from_link) }
}

/// The rotation by `angle` (rad) about z.
pub(super) fn turn_about_z(angle: f64) -> Pose {
    let (sine, cosine) = libm::sincos(angle / 2.0);
    let rotation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(cosine, 0.0, 0.0, sine));
    Pose::from_parts(Translation3::identity(), rotation)
}

fn check_count(what: &'static str, got: usize, expected: usize) -> Result<(), PhysicsError> {
    if got == expected { Ok(()) } else { Err(PhysicsError::Count { what, got, expected }) }
}

fn check_finite(what: impl FnOnce() -> String, got: f64) -> Result<(), PhysicsError> {
    if got.is_finite() { Ok(()) } else { Err(PhysicsError::NotFinite { what: what(), got }) }
}

fn checked_inertial(link: &crate::arm::Link) -> Result<Inertial, PhysicsError> {
    let inertial = link.inertial.clone().ok_or_else(|| PhysicsError::MissingInertial { link: link.name.clone() })?;
    let bad = |what: &str| Err(PhysicsError::BadInertial { link: link.name.clone(), what: what.to_owned() });
    if !(inertial.mass_kg >= 0.0 && inertial.mass_kg.is_finite()) {
        return bad(&format!("its mass is {} kg", inertial.mass_kg));
    }
    if !inertial.centre_of_mass_in_link.coords.iter().all(|value| value.is_finite()) {
        return bad("its centre of mass is not finite");
    }
    let inertia = &inertial.inertia_in_link;
    if !inertia.iter().all(|value| value.is_finite()) {
        return bad("its inertia is not finite");
    }
    if (inertia - inertia.transpose()).norm() > 1e-9 * inertia.norm() {
        return bad("its inertia is not symmetric");
    }
    // Zero is allowed (a point mass); rounding may put it a little below.
    if inertia.symmetric_eigenvalues().min() < -1e-12 * inertia.norm() {
        return bad("its inertia is negative about some axis");
    }
    Ok(inertial)
}
