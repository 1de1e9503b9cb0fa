//! The seat of every clearance by rigid statics, without rapier.
//!
//! To first order in the play, the potential energy of the arm is linear in the coordinates of the play, with the force `f` and
//! the moment `M` that the outboard arm puts on each joint as coefficients. Rest is its minimum over discs and intervals: a
//! linear programme with the solution `c f⊥/‖f⊥‖`, `a sgn f_z`, `γ M⊥/‖M⊥‖`, joint by joint. Where the load turns with the play,
//! the programme is made anew about its own solution until nothing changes.

use nalgebra::{Point3, Vector2, Vector3};

use super::clearance::{Clearance, SeatedBy};
use super::play::{Decision, Load, Play};
use super::true_arm::{Placement, TrueArm};
use crate::arm::JointKind;
use crate::arm::frames::Pose;

/// The solution of the linear programme, made `rounds` times: 1 for the one about the middle of the clearances. Coordinates that
/// `decisions` does not leave to the load stay in the middle.
pub(super) fn static_seats(arm: &TrueArm, placement: &Placement, decisions: &[Decision], rounds: usize) -> Vec<Play> {
    let mut plays = vec![Play::CENTRE; arm.joint_count()];
    for _ in 0..rounds {
        plays = seats_about(arm, placement, decisions, &plays);
    }
    plays
}

/// The solution of the linear programme about `plays`.
pub(super) fn seats_about(arm: &TrueArm, placement: &Placement, decisions: &[Decision], plays: &[Play]) -> Vec<Play> {
    let loads = static_loads(arm, placement, plays);
    loads.iter().zip(&arm.clearances).zip(decisions).map(|((load, clearance), by)| seat(clearance, by, load)).collect()
}

fn seat(clearance: &Clearance, by: &Decision, load: &Load) -> Play {
    let along = |radius: f64, load: &Vector2<f64>, by| match by {
        SeatedBy::Load => load * (radius / load.norm()),
        SeatedBy::Fit | SeatedBy::Friction => Vector2::zeros(),
    };
    Play {
        radial: along(clearance.radial_m, &load.radial, by.radial),
        axial: if by.axial == SeatedBy::Load { clearance.axial_m * load.axial.signum() } else { 0.0 },
        tilt: along(clearance.tilt_rad, &load.tilt, by.tilt),
    }
}

/// The loads on the plays of an arm whose joints lie at `plays`.
pub(super) fn static_loads(arm: &TrueArm, placement: &Placement, plays: &[Play]) -> Vec<Load> {
    let mut base_from_reached = Pose::identity();
    let mut frames = Vec::with_capacity(arm.joint_count());
    let mut weights = Vec::with_capacity(arm.joint_count());
    for (joint, q) in placement.joints.iter().enumerate() {
        let (inboard, outboard) = arm.motions(joint, *q);
        let play = &plays[joint];
        let base_from_joint = base_from_reached * arm.segment(joint, placement) * inboard;
        let displaced = base_from_joint * play.pose();
        // Axes of the inboard part, centre of the outboard part: what the coordinates are about.
        frames.push((base_from_joint.rotation, displaced.translation.vector));
        base_from_reached = displaced * outboard;
        let inertial = &arm.inertials[joint];
        weights.push((base_from_reached * inertial.centre_of_mass_in_link, arm.gravity_in_base * inertial.mass_kg));
    }
    let mut loads = Vec::with_capacity(arm.joint_count());
    let payload = arm.gravity_in_base * placement.payload_kg;
    let tool = base_from_reached * arm.segment(arm.joint_count(), placement) * Point3::origin();
    let (mut force, mut moment_about_base): (Vector3<f64>, Vector3<f64>) = (payload, tool.coords.cross(&payload));
    for (joint, ((rotation, centre), (point, weight))) in frames.iter().zip(&weights).enumerate().rev() {
        force += weight;
        moment_about_base += point.coords.cross(weight);
        let force_in_joint = rotation.inverse() * force;
        let moment_in_joint = rotation.inverse() * (moment_about_base - centre.cross(&force));
        let along = if arm.kinds[joint] == JointKind::Revolute { moment_in_joint.z } else { force_in_joint.z };
        loads.push(Load { radial: force_in_joint.xy(), axial: force_in_joint.z, tilt: moment_in_joint.xy(), along });
    }
    loads.reverse();
    loads
}
