//! An arm in one configuration: where its joints are, and what they carry. Everything is in the root frame, the chain's first.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::arm::Arm;
use crate::arm::ChainAt;
use crate::arm::frames::Pose;

/// What an arm is made of, as far as signatures need it.
#[derive(Clone, Debug)]
pub struct Mechanism {
    /// From the root to the tool.
    pub chain: ChainAt,
    /// Transforms between joints ([`crate::arm::ChainAt::segments`]).
    pub segments: Vec<Pose>,
    /// Which joints slide.
    pub slides: Vec<bool>,
    /// Mass of each moving link (kg) and its centre in the frame that moves with its joint (m).
    pub centres: Vec<(f64, Point3<f64>)>,
    /// Whether the masses are the robot's; else each link is taken to weigh 1 kg, in its middle.
    pub masses_known: bool,
    /// Free fall, m/s².
    pub gravity: Vector3<f64>,
}

/// One configuration.
#[derive(Clone, Debug)]
pub struct Posture {
    /// Directions of the joint axes.
    pub axes: Vec<Vector3<f64>>,
    /// Axes of the frame that moves with each joint, as columns.
    pub frames: Vec<Matrix3<f64>>,
    /// Origins of the joints, m.
    pub origins: Vec<Vector3<f64>>,
    /// Origin of the tool frame, m.
    pub tool: Vector3<f64>,
    /// Axes of the tool frame as columns.
    pub tool_axes: Matrix3<f64>,
    /// Force that each joint carries, N.
    pub forces: Vec<Vector3<f64>>,
    /// Moment about each joint's origin that it carries, N·m.
    pub moments: Vec<Vector3<f64>>,
    /// Length of the segments outboard of each joint, m.
    pub reaches: Vec<f64>,
}

impl Mechanism {
    /// The nominal arm.
    #[must_use]
    pub fn new(arm: &Arm) -> Mechanism {
        let at = arm.chain.at_nominal();
        let segments = at.segments();
        let count = arm.joint_count();
        let names = arm.chain.frame_names();
        let rest = vec![0.0; count];
        let frames = at.frames(&rest);
        let joint_frames: Vec<Pose> = segments[..count]
            .iter()
            .scan(Pose::identity(), |root_from_joint, segment| {
                *root_from_joint *= segment;
                Some(*root_from_joint)
            })
            .collect();
        let known = |joint: usize| -> Option<(f64, Point3<f64>)> {
            let link = arm.links.get(joint + 1)?;
            let inertial = link.inertial.as_ref()?;
            let frame = names.iter().position(|name| *name == link.name)?;
            Some((inertial.mass_kg, joint_frames[joint].inverse() * frames[frame] * inertial.centre_of_mass_in_link))
        };
        let masses: Vec<Option<(f64, Point3<f64>)>> = (0..count).map(known).collect();
        // Flanges and adapters often have none; the arm's total does not.
        let masses_known = masses.iter().flatten().map(|(mass, _)| mass).sum::<f64>() > 0.0;
        let centres = masses
            .into_iter()
            .enumerate()
            .map(|(joint, centre)| match centre {
                Some(centre) => centre,
                None if masses_known => (0.0, Point3::origin()),
                None => (1.0, Point3::from(segments[joint + 1].translation.vector / 2.0)),
            })
            .collect();
        let slides = arm.slides();
        Mechanism { chain: at, segments, slides, centres, masses_known, gravity: arm.gravity_in_base }
    }

    /// Number of joints.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.slides.len()
    }

    /// The same masses on `chain`, from the root to the tool: the fitted arm instead of the nominal one.
    #[must_use]
    pub fn with_chain(self, chain: ChainAt) -> Mechanism {
        Mechanism { segments: chain.segments(), chain, ..self }
    }

    /// The arm at the coordinates `joints` (rad or m), with a payload (kg) at the origin of its tool frame.
    #[must_use]
    pub fn posture(&self, joints: &[f64], payload_kg: f64) -> Posture {
        self.posture_moved(joints, payload_kg, &self.gravity, &[])
    }

    /// From root to tool.
    #[must_use]
    pub fn chain(&self) -> &ChainAt {
        &self.chain
    }

    /// The same where rigid motions (in root) move what is outboard: `motions[0]` the whole arm, `motions[i]` what moves with joint `i`
    /// (from 1) and beyond. None that is missing moves anything. `gravity` in root, m/s².
    #[must_use]
    pub fn posture_moved(&self, joints: &[f64], payload_kg: f64, gravity: &Vector3<f64>, motions: &[Motion]) -> Posture {
        let count = self.joint_count();
        let (mut axes, mut frames, mut origins) = (Vec::new(), Vec::new(), Vec::new());
        let mut centres = Vec::with_capacity(count);
        let mut carried = motions.first().copied().unwrap_or(Motion::IDENTITY);
        let (rotation, origin) = self.chain.visit_joints(joints, |joint, (before, joint_origin), (after, moved_origin)| {
            axes.push(carried.rotation * before[2]);
            origins.push(carried.of_point(joint_origin));
            if let Some(motion) = motions.get(joint + 1) {
                carried = motion.after(&carried);
            }
            let frame = carried.rotation * Matrix3::from_columns(after);
            frames.push(frame);
            let moved_origin = carried.of_point(moved_origin);
            let (mass, centre) = &self.centres[joint];
            centres.push((*mass, moved_origin + frame * centre.coords));
        });
        let (rotation, origin) = (carried.rotation * rotation, carried.of_point(&origin));
        let (mut forces, mut moments) = (vec![Vector3::zeros(); count], vec![Vector3::zeros(); count]);
        // From the tip inwards: total weight, and its moment about the root's origin.
        let mut force = gravity * payload_kg;
        let mut moment = origin.cross(&force);
        for joint in (0..count).rev() {
            let (mass, centre) = centres[joint];
            force += gravity * mass;
            moment += centre.cross(&(gravity * mass));
            forces[joint] = force;
            moments[joint] = moment - origins[joint].cross(&force);
        }
        let reaches = (0..count)
            .map(|joint| self.segments[joint + 1..].iter().map(|segment| segment.translation.vector.norm()).sum())
            .collect();
        Posture { axes, frames, origins, tool: origin, tool_axes: rotation, forces, moments, reaches }
    }
}

/// A rigid motion in root: `point → rotation · point + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Turn.
    pub rotation: Matrix3<f64>,
    /// Shift, m.
    pub translation: Vector3<f64>,
}

impl Motion {
    /// No motion.
    pub const IDENTITY: Motion =
        Motion { rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), translation: Vector3::new(0.0, 0.0, 0.0) };

    /// `first`, then this.
    #[must_use]
    pub fn after(&self, first: &Motion) -> Motion {
        Motion { rotation: self.rotation * first.rotation, translation: self.of_point(&first.translation) }
    }

    /// The motion back.
    #[must_use]
    pub fn inverse(&self) -> Motion {
        let rotation = self.rotation.transpose();
        Motion { rotation, translation: -(rotation * self.translation) }
    }

    /// The motion that moves on from `twist` (shift of `point` in m, turn in rad): a screw about the axis that stays.
    #[must_use]
    pub fn of_twist(twist: &[f64; 6], point: &Vector3<f64>) -> Motion {
        let turn = Vector3::new(twist[3], twist[4], twist[5]);
        let shift = Vector3::new(twist[0], twist[1], twist[2]) - turn.cross(point);
        let square = turn.norm_squared();
        let angle = libm::sqrt(square);
        // Series where the angle is small: 1 − θ²/6, 1/2 − θ²/24, 1/6 − θ²/120.
        let (a, b, c) = if angle < 1e-4 {
            (1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
        } else {
            let (sine, cosine) = libm::sincos(angle);
            (sine / angle, (1.0 - cosine) / square, (angle - sine) / (square * angle))
        };
        let cross = turn.cross_matrix();
        let cross2 = cross * cross;
        Motion {
            rotation: Matrix3::identity() + cross * a + cross2 * b,
            translation: (Matrix3::identity() + cross * b + cross2 * c) * shift,
        }
    }

    /// Where `point` comes to.
    #[must_use]
    pub fn of_point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }
}

/// How well levers are known, m (one sigma): centres of mass, and origins that calibration cannot place along their axes.
const LEVER_SIGMA: f64 = 2e-3;
/// How well the direction of gravity is known, rad: the base frame is fitted, its foot need not be level.
const GRAVITY_SIGMA: f64 = 2e-3;

impl Posture {
    /// One sigma of a component of the moment at `joint`, N·m: what is not known of levers and of the direction of gravity.
    #[must_use]
    pub fn moment_sigma(&self, joint: usize) -> f64 {
        libm::hypot(LEVER_SIGMA * self.forces[joint].norm(), GRAVITY_SIGMA * self.moments[joint].norm())
    }

    /// One sigma of a component of the force at `joint`, N.
    #[must_use]
    pub fn force_sigma(&self, joint: usize) -> f64 {
        GRAVITY_SIGMA * self.forces[joint].norm()
    }

    /// What a unit move of `joint`, which slides or turns, does to `target` (in root): shift (m) and turn (rad).
    #[must_use]
    pub fn moved(&self, joint: usize, slides: bool, target: &Vector3<f64>) -> [f64; 6] {
        let axis = self.axes[joint];
        let (shift, turn) = if slides { (axis, Vector3::zeros()) } else { (axis.cross(&(target - self.origins[joint])), axis) };
        [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
    }

    /// Torque about the axis of `joint`, N·m.
    #[must_use]
    pub fn torque(&self, joint: usize) -> f64 {
        self.axes[joint].dot(&self.moments[joint])
    }

    /// The moment across the axis of `joint`, N·m.
    #[must_use]
    pub fn moment_across(&self, joint: usize) -> Vector3<f64> {
        self.moments[joint] - self.axes[joint] * self.torque(joint)
    }

    /// The force across the axis of `joint`, N.
    #[must_use]
    pub fn force_across(&self, joint: usize) -> Vector3<f64> {
        let force = self.forces[joint];
        force - self.axes[joint] * self.axes[joint].dot(&force)
    }

    /// The x and y axes of the frame that moves with `joint`.
    #[must_use]
    pub fn across_link(&self, joint: usize) -> [Vector3<f64>; 2] {
        [0, 1].map(|axis| self.frames[joint].column(axis).into())
    }
}
