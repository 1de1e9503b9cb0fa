//! A turn about a joint's origin: the moments about the x and y axes of its link bend it unequally.

use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let moment = reading.posture.moment_across(joint);
    reading.posture.across_link(joint).map(|axis| reading.turned(joint, axis * axis.dot(&moment))).to_vec()
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    let detail = format!("moment across the axis of joint {} turns its link, about one axis more than about another", joint + 1);
    all.push(site.unnamed(Shape::UnequalBend { joint }, site.range(Kind::LinkBending), vec![1.0; 2], detail));
}
