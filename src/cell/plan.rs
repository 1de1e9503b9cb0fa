//! The order of measuring: which configuration is read when, from where the arm comes to it, and what it carries.

use crate::measurement::Role;
use crate::scene::Scene;
use crate::seed::stream;

/// A reading to be taken, in the order of measuring.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// Same number, same configuration (and payload): a repeat.
    pub pose_id: usize,
    /// For fitting or for verification.
    pub role: Role,
    /// Commanded joint coordinates, rad or m.
    pub joints: Vec<f64>,
    /// Joint coordinates from which the last move comes, rad or m.
    pub from: Vec<f64>,
    /// Mass that the tool is believed to carry, kg.
    pub payload_kg: f64,
    /// Since the start of the session, s.
    pub time_s: f64,
    /// From the end of the last move to the reading, s.
    pub dwell_s: f64,
}

impl Planned {
    /// Direction of each joint's last move: -1, 0 or 1.
    #[must_use]
    pub fn approach(&self) -> Vec<i8> {
        let direction = |(to, from): (&f64, &f64)| match to.total_cmp(from) {
            std::cmp::Ordering::Less => -1,
            std::cmp::Ordering::Equal => 0,
            std::cmp::Ordering::Greater => 1,
        };
        self.joints.iter().zip(&self.from).map(direction).collect()
    }
}

/// The order of measuring: chosen and held-out configurations shuffled, so that neither sees only one part of a drift.
#[must_use]
pub fn plan(scene: &Scene, chosen: &[Vec<f64>], held_out: &[Vec<f64>]) -> Vec<Planned> {
    let mut rows: Vec<(usize, Role, Vec<f64>)> = Vec::with_capacity(chosen.len() + held_out.len());
    rows.extend(chosen.iter().enumerate().map(|(index, joints)| (index, Role::Fit, joints.clone())));
    rows.extend(held_out.iter().enumerate().map(|(index, joints)| (chosen.len() + index, Role::HeldOut, joints.clone())));
    stream(scene.seed, "plan/order").shuffle(&mut rows);
    in_order(scene, rows)
}

/// Rows that are already in the order of measuring.
#[must_use]
pub fn in_order(scene: &Scene, rows: Vec<(usize, Role, Vec<f64>)>) -> Vec<Planned> {
    let mut from = vec![0.0; scene.arm.joint_count()];
    let planned = rows.into_iter().enumerate().map(|(index, (pose_id, role, joints))| {
        let from = std::mem::replace(&mut from, joints.clone());
        let time_s = index as f64 * scene.plan.seconds_per_pose;
        Planned { pose_id, role, joints, from, payload_kg: 0.0, time_s, dwell_s: scene.plan.dwell_s }
    });
    planned.collect()
}
