//! The direction of the last move, times the size of the torque.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

/// rad/(N·m)
const RANGE: [f64; 2] = [0.5e-5, 5e-5];

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    vec![reading.moved(joint, 0.5 * reading.approach[joint] * reading.effort(joint).abs())]
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.columns.approach {
        let detail = format!("direction of joint {}'s last move, growing with its torque", joint + 1);
        all.push(site.unnamed(Shape::DirectionLoad { joint }, RANGE, vec![1.0], detail));
    }
}
