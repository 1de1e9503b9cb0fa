//! A shift: the force across a joint seats it, along the x and y axes of its link unequally.

use nalgebra::Vector3;

use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape, seated, twist};

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let posture = &reading.posture;
    let seat = seated(posture.force_across(joint), posture.force_sigma(joint), 0.0);
    posture.across_link(joint).map(|axis| twist(axis * axis.dot(&seat), Vector3::zeros())).to_vec()
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    let detail = format!("force across the axis of joint {} shifts it, more one way than another", joint + 1);
    all.push(site.unnamed(Shape::UnequalShift { joint }, site.range(Kind::RadialClearance), vec![1.0; 2], detail));
}
