//! A turn about a joint's origin along the moment across its axis, with the root of its size.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

/// rad/√(N·m)
const RANGE: [f64; 2] = [1e-5, 1e-4];

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let moment = reading.posture.moment_across(joint);
    vec![reading.turned(joint, moment / libm::sqrt(moment.norm().max(1e-9)))]
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    let detail = format!("moment across the axis of joint {} turns its link, not in proportion", joint + 1);
    all.push(site.unnamed(Shape::RootAcross { joint }, RANGE, vec![1.0], detail));
}
