//! The whole arm turns about the base's origin along the horizontal moment that arm and payload have about it.
//!
//! Where the first joint stands upright on that origin this is what bending of the first link does: no reading of the arm tells the two
//! apart, and both are then said.

use nalgebra::Vector3;

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape, twist};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading) -> Vec<Displacement> {
    let posture = &reading.posture;
    let (Some(origin), Some(force), Some(moment)) = (posture.origins.first(), posture.forces.first(), posture.moments.first())
    else {
        return vec![[0.0; 6]];
    };
    let about_base: Vector3<f64> = moment + origin.cross(force);
    let up = reading.gravity / reading.gravity.norm().max(1e-12);
    let turn = about_base - up * up.dot(&about_base);
    vec![twist(turn.cross(&reading.target), turn)]
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() {
        let tilt = site.hypothesis(Kind::BaseTilt, Shape::BaseTilt);
        // As likely as that one of the links bends: the first may be the same thing.
        all.push(Hypothesis { share: Some(1.0 / site.joints() as f64), ..tilt });
    }
}
