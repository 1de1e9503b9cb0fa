//! A joint turns with its angle, the square and the cube of it.

use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let angle = reading.joints[joint];
    [angle, angle * angle, angle * angle * angle / 3.0].map(|amount| reading.moved(joint, amount)).to_vec()
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.turns() {
        let range = site.range(Kind::GearCoupling);
        let detail = format!("error of joint {} grows with its angle", joint + 1);
        all.push(site.unnamed(Shape::AngleCurve { joint }, range, vec![1.0, 0.5, 0.5], detail));
    }
}
