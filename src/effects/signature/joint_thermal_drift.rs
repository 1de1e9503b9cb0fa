//! A joint turns with the temperature of the link that it moves.

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    vec![reading.moved(joint, reading.rise_k[joint])]
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place.filter(|_| site.columns.temperature) {
        all.push(site.hypothesis(Kind::JointThermalDrift, Shape::Warmth { joint }));
    }
}
