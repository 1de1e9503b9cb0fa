//! A link bends under the moment across: where it is bolted to its joint (a hinge at the joint), or all along, as a slender beam.

use nalgebra::Vector3;

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape, twist};
use crate::effects::Kind;

/// Of the prior, the share of a link that is a slender beam; others yield where they are bolted to their joint.
const BEAM: f64 = 0.2;

/// A hinge at the joint, across its axis.
pub(super) fn hinge_columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    vec![reading.turned(joint, reading.posture.moment_across(joint))]
}

/// A beam from its joint to the next: a turn in proportion to the mean moment, about where a beam turns.
pub(super) fn beam_columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let posture = &reading.posture;
    let next = if joint + 1 < reading.joints.len() { posture.origins[joint + 1] } else { posture.tool };
    let along = next - posture.origins[joint];
    let square = along.norm_squared();
    // Too short to have a direction: a hinge.
    if square < 1e-6 {
        return hinge_columns(reading, joint);
    }
    let across = |moment: Vector3<f64>| moment - along * (along.dot(&moment) / square);
    // Its own weight is a small part of what it carries: the moment at its end is that at its root without the lever.
    let near = across(posture.moments[joint]);
    let far = across(posture.moments[joint] - along.cross(&posture.forces[joint]));
    let turn = (near + far) / 2.0;
    let bow = (near / 3.0 + far / 6.0).cross(&along);
    vec![twist(bow + turn.cross(&(reading.target - next)), turn)]
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place {
        let hinge = site.hypothesis(Kind::LinkBending, Shape::MomentAcross { joint });
        all.push(Hypothesis { share: Some(1.0 - BEAM), ..hinge.clone() });
        all.push(Hypothesis { shape: Shape::Beam { joint }, share: Some(BEAM), detail: "as a beam".to_owned(), ..hinge });
    }
}
