//! Positions in proportion to themselves.

use nalgebra::Vector3;

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape, twist};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading) -> Vec<Displacement> {
    vec![twist(reading.target, Vector3::zeros())]
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() {
        all.push(site.hypothesis(Kind::MeasurementScale, Shape::Scale));
    }
}
