//! A joint turns in proportion to the torque about it.

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    vec![reading.moved(joint, reading.effort(joint))]
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place {
        all.push(site.hypothesis(Kind::JointCompliance, Shape::Torque { joint }));
    }
}
