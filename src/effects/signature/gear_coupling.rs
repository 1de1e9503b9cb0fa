//! A joint turns by a share of its own angle, or of that of a neighbour, whose drive shares its housing.

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading, joint: usize, source: usize) -> Vec<Displacement> {
    vec![reading.moved(joint, reading.joints[source])]
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        return;
    };
    let next = Some(joint + 1).filter(|next| *next < site.joints());
    for source in [Some(joint), joint.checked_sub(1), next].into_iter().flatten() {
        let detail = if source == joint { "its own angle".to_owned() } else { format!("angle of joint {}", source + 1) };
        all.push(Hypothesis { detail, ..site.hypothesis(Kind::GearCoupling, Shape::Ratio { joint, source }) });
    }
}
