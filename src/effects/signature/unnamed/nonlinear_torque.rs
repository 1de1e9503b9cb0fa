//! A joint that turns with its torque, but not in proportion: torque and its cube, or torque and the root of its size.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

/// rad/(N·m) at no load.
const RANGE: [f64; 2] = [2e-5, 2e-4];

/// Torque and its cube.
pub(in crate::effects::signature) fn softening_columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let effort = reading.effort(joint);
    vec![reading.moved(joint, effort), reading.moved(joint, effort * effort * effort / 1e4)]
}

/// Torque, and the root of its size with its sign.
pub(in crate::effects::signature) fn hardening_columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let effort = reading.effort(joint);
    let root = 10.0 * libm::sqrt(effort.abs()) * effort.signum();
    vec![reading.moved(joint, effort), reading.moved(joint, root)]
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    let detail = format!("turn of joint {} not proportional to its torque", joint + 1);
    all.push(site.unnamed(Shape::Softening { joint }, RANGE, vec![1.0, 0.5], detail.clone()));
    all.push(site.unnamed(Shape::Hardening { joint }, RANGE, vec![1.0; 2], detail));
}
