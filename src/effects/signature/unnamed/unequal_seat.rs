//! A turn about a joint's origin: the moment across seats it, about the x and y axes of its link unequally.

use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape, seated};

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let posture = &reading.posture;
    let seat = seated(posture.moment_across(joint), posture.moment_sigma(joint), 0.0);
    posture.across_link(joint).map(|axis| reading.turned(joint, axis * axis.dot(&seat))).to_vec()
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    let detail = format!(
        "moment across the axis of joint {} turns its link, whatever its size, about one axis more than about another",
        joint + 1
    );
    all.push(site.unnamed(Shape::UnequalSeat { joint }, site.range(Kind::TiltClearance), vec![1.0; 2], detail));
}
